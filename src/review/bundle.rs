//! A bundle's files: these, by these names, and nothing that lies elsewhere.

use super::chance::hex;
use crate::report::SessionFile;
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

const REPORT: &str = "report.html";

/// Whether a bundle has a picture of this stem: `map-occlusal`.
pub fn is_picture(stem: &str) -> bool {
    stem.split_once('-').is_some_and(|(moment, view)| MOMENTS.contains(&moment) && VIEWS.contains(&view))
}

/// Where a picture lies within its bundle.
pub fn picture(stem: &str) -> String {
    format!("views/{stem}.png")
}

/// The path of a file of a bundle, if it is one and lies within the folder. `folder` is canonical.
///
/// `Err` says what is wrong: a link that leads out of the folder is as good as no file.
pub fn file_within(folder: &Path, bundle: &Path, name: &str) -> Result<PathBuf, String> {
    let path = folder.join(bundle).join(name);
    let real = fs::canonicalize(&path).map_err(|e| format!("unreadable-file: {e}"))?;
    match real.starts_with(folder) && real.is_file() {
        true => Ok(real),
        false => Err("outside-folder: it is a link that leads out of the folder, or no file".into()),
    }
}

/// A file's bytes, to be handed on.
pub fn read(folder: &Path, bundle: &Path, name: &str) -> Result<Vec<u8>, String> {
    let file = File::open(file_within(folder, bundle, name)?).map_err(|e| format!("unreadable-file: {e}"))?;
    let mut bytes = Vec::new();
    file.take(HANDED_MAX + 1).read_to_end(&mut bytes).map_err(|e| format!("unreadable-file: {e}"))?;
    match bytes.len() as u64 > HANDED_MAX {
        true => Err(format!("unreadable-file: it has more than {} MiB", HANDED_MAX >> 20)),
        false => Ok(bytes),
    }
}

/// A bundle's own page, if it is the one that its `session.json` names.
///
/// `Err` says why it is not shown.
pub fn report(folder: &Path, bundle: &Path, session: &SessionFile) -> Result<Vec<u8>, String> {
    let bytes = read(folder, bundle, REPORT)?;
    match session.digests.get(REPORT) {
        Some(named) if *named != hex(&Sha256::digest(&bytes)) => Err(
            "changed-file: report.html is not the one that session.json names; typodont verify says what else differs"
                .into(),
        ),
        _ => Ok(bytes),
    }
}
