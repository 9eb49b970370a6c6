//! Access to the files of a bundle, restricted to known names within the bundle's folder.

use sha2::{Digest, Sha256};
use std::fs::{self, File};
use std::io::Read;
use std::path::{Path, PathBuf};
use typodont_exercise::scenario::hex;
use typodont_report::SessionFile;
use typodont_report::cohort::read_session;

/// Views and sections of the tooth for which a bundle has images, in display order.
pub const VIEWS: [&str; 9] = [
    "occlusal",
    "buccal",
    "lingual",
    "mesial",
    "distal",
    "apical",
    "slice-buccolingual",
    "slice-mesiodistal",
    "slice-horizontal",
];

/// Kinds of image of each view.
const PICTURE_KINDS: [&str; 3] = ["before", "after", "map"];

/// Maximum size of a file that is served, bytes. A session's report has up to 6 MB.
const FILE_BYTES_MAX: u64 = 64 << 20;

/// File name of a bundle's report.
pub const REPORT: &str = "report.html";

/// File name of the tooth as it was at the start.
pub const INITIAL_VOLUME: &str = "initial.seg.nrrd";

/// Maximum length of the part of a volume's file that is searched for its voxel size, bytes.
const VOLUME_HEADER_MAX: u64 = 64 << 10;

/// Returns true if `stem` is the stem of one of a bundle's images, such as `map-occlusal`.
pub fn is_picture(stem: &str) -> bool {
    stem.split_once('-').is_some_and(|(moment, view)| PICTURE_KINDS.contains(&moment) && VIEWS.contains(&view))
}

/// Returns true if `stem` is the stem of a map, which is coloured by the verdicts of the scorer.
pub fn is_map(stem: &str) -> bool {
    stem.starts_with("map-")
}

/// Returns the path of an image within its bundle.
pub fn picture_path(stem: &str) -> String {
    format!("views/{stem}.png")
}

/// Returns the canonical path of a bundle's file. `folder` is canonical.
///
/// # Errors
///
/// Returns a message when the file does not exist, is not a regular file, or lies outside the bundle, or the bundle
/// outside the folder, because of a symbolic link.
pub fn file_within(folder: &Path, bundle: &Path, name: &str) -> Result<PathBuf, String> {
    let canonical = |path: &Path| fs::canonicalize(path).map_err(|e| format!("unreadable-file: {e}"));
    let own = canonical(&folder.join(bundle))?;
    let real = canonical(&own.join(name))?;
    match own.starts_with(folder) && real.starts_with(&own) && real.is_file() {
        true => Ok(real),
        false => Err("outside-folder: the path is not a regular file, or a link leads out of the bundle".into()),
    }
}

/// Reads a bundle's `session.json`.
///
/// # Errors
///
/// Returns a message when the file cannot be read or is not a session.
pub fn read_bundle_session(folder: &Path, bundle: &Path) -> Result<SessionFile, String> {
    file_within(folder, bundle, "session.json").and_then(|path| read_session(&path))
}

/// Reads the size of the voxels of a bundle's initial volume from the file's header, mm along the first axis; `None` if
/// there is no such file or it does not state the size.
pub fn voxel_size(folder: &Path, bundle: &Path) -> Option<f64> {
    let file = File::open(file_within(folder, bundle, INITIAL_VOLUME).ok()?).ok()?;
    let mut bytes = Vec::new();
    file.take(VOLUME_HEADER_MAX).read_to_end(&mut bytes).ok()?;
    let header = String::from_utf8_lossy(&bytes);
    let directions = header.lines().take_while(|line| !line.is_empty());
    let directions = directions.filter_map(|line| line.strip_prefix("space directions:")).next()?;
    let first = directions.split_once('(')?.1.split_once(')')?.0;
    let axis: Vec<f64> = first.split(',').map_while(|number| number.trim().parse().ok()).collect();
    let size = axis.iter().map(|v| v * v).sum::<f64>().sqrt();
    (axis.len() == 3 && size.is_finite() && size > 0.0).then_some(size)
}

/// Reads a file of a bundle, up to [`FILE_BYTES_MAX`].
fn read_limited(folder: &Path, bundle: &Path, name: &str) -> Result<Vec<u8>, String> {
    let file = File::open(file_within(folder, bundle, name)?).map_err(|e| format!("unreadable-file: {e}"))?;
    let mut bytes = Vec::new();
    file.take(FILE_BYTES_MAX + 1).read_to_end(&mut bytes).map_err(|e| format!("unreadable-file: {e}"))?;
    match bytes.len() as u64 > FILE_BYTES_MAX {
        true => Err(format!("unreadable-file: the file has more than {} MiB", FILE_BYTES_MAX >> 20)),
        false => Ok(bytes),
    }
}

/// Reads a file and verifies it against its digest in `session.json`.
///
/// # Errors
///
/// Returns a message when the file cannot be read, has no digest in `session.json`, or differs from it.
pub fn read_verified(folder: &Path, bundle: &Path, name: &str, session: &SessionFile) -> Result<Vec<u8>, String> {
    let bytes = read_limited(folder, bundle, name)?;
    match session.digests.get(name) {
        Some(named) if *named == hex(&Sha256::digest(&bytes)) => Ok(bytes),
        _ => Err(format!(
            "changed-file: {name} does not have the digest stated in session.json; typodont verify lists all differences"
        )),
    }
}
