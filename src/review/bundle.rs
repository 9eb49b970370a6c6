//! A bundle's files: these, by these names, and nothing that lies elsewhere.

use crate::report::SessionFile;
use crate::report::cohort::read_session;
use crate::scenario::hex;
use sha2::{Digest, Sha256};
use std::fs::{self, File};
use std::io::Read;
use std::path::{Path, PathBuf};

/// Sides and sections that are pictured, in the order in which they are shown.
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

/// What each is a picture of.
const MOMENTS: [&str; 3] = ["before", "after", "map"];

/// Bytes of a file that is handed on; a session's page has up to 6 MB.
const HANDED_MAX: u64 = 64 << 20;

pub const REPORT: &str = "report.html";

/// Whether a bundle has a picture of this stem: `map-occlusal`.
pub fn is_picture(stem: &str) -> bool {
    stem.split_once('-').is_some_and(|(moment, view)| MOMENTS.contains(&moment) && VIEWS.contains(&view))
}

/// Where a picture lies within its bundle.
pub fn picture(stem: &str) -> String {
    format!("views/{stem}.png")
}

/// The path of a file of a bundle, if it is one and lies within it, and the bundle within the folder. `folder` is canonical.
///
/// `Err` says what is wrong: a link that leads out of the bundle is as good as no file.
pub fn file_within(folder: &Path, bundle: &Path, name: &str) -> Result<PathBuf, String> {
    let canonical = |path: &Path| fs::canonicalize(path).map_err(|e| format!("unreadable-file: {e}"));
    let own = canonical(&folder.join(bundle))?;
    let real = canonical(&own.join(name))?;
    match own.starts_with(folder) && real.starts_with(&own) && real.is_file() {
        true => Ok(real),
        false => Err("outside-folder: it is a link that leads out of the bundle, or no file".into()),
    }
}

/// What a bundle's `session.json` says now.
pub fn session(folder: &Path, bundle: &Path) -> Result<SessionFile, String> {
    file_within(folder, bundle, "session.json").and_then(|path| read_session(&path))
}

/// A file's bytes, to be handed on.
fn read(folder: &Path, bundle: &Path, name: &str) -> Result<Vec<u8>, String> {
    let file = File::open(file_within(folder, bundle, name)?).map_err(|e| format!("unreadable-file: {e}"))?;
    let mut bytes = Vec::new();
    file.take(HANDED_MAX + 1).read_to_end(&mut bytes).map_err(|e| format!("unreadable-file: {e}"))?;
    match bytes.len() as u64 > HANDED_MAX {
        true => Err(format!("unreadable-file: it has more than {} MiB", HANDED_MAX >> 20)),
        false => Ok(bytes),
    }
}

/// A file that `session.json` names by its digest, if it is the one that is named.
///
/// `Err` says why it is not shown.
pub fn read_named(folder: &Path, bundle: &Path, name: &str, session: &SessionFile) -> Result<Vec<u8>, String> {
    let bytes = read(folder, bundle, name)?;
    match session.digests.get(name) {
        Some(named) if *named == hex(&Sha256::digest(&bytes)) => Ok(bytes),
        _ => Err(format!(
            "changed-file: {name} is not the one that session.json names; typodont verify says what else differs"
        )),
    }
}
