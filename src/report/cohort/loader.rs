//! Finds bundles and reads their results.

use super::Cohort;
use crate::bundle::is_partial;
use crate::session_file::{FILE_BYTES_MAX, SessionFile};
use std::fs;
use std::path::{Path, PathBuf};

/// Folders are looked into this deep: a class of sessions within a year within a school.
const DEPTH_MAX: usize = 4;

/// Every `session.json` below a folder, in order of exercise, participant, beginning and path. Copies are among them: which
/// of them counts is decided when they have been verified.
pub fn read_cohort(folder: &Path) -> Cohort {
    let mut cohort = Cohort::default();
    let FoundBundles { files, skipped: left_out } = find_bundles(folder);
    cohort.skipped = left_out;
    for file in files {
        match read_session(&file) {
            Ok(session) => cohort.sessions.push((file.parent().unwrap_or(folder).to_path_buf(), session)),
            Err(reason) => cohort.skipped.push((file, reason)),
        }
    }
    cohort.sort();
    cohort
}

/// Session files found below a folder.
#[derive(Clone, Debug, Default)]
pub struct FoundBundles {
    /// Every `session.json`, in the order of paths.
    pub files: Vec<PathBuf>,
    /// Folders that could not be read, with the reason.
    pub skipped: Vec<(PathBuf, String)>,
}

/// Looks for bundles, without opening any.
pub fn find_bundles(folder: &Path) -> FoundBundles {
    let mut found = FoundBundles::default();
    search_folder(&mut found, folder, 0);
    found
}

fn search_folder(found: &mut FoundBundles, folder: &Path, depth: usize) {
    let file = folder.join("session.json");
    if file.is_file() {
        return found.files.push(file);
    }
    if depth == DEPTH_MAX {
        let reason = "the folder is nested too deeply to be searched; give a folder closer to it".into();
        return found.skipped.push((folder.to_path_buf(), reason));
    }
    let entries = match fs::read_dir(folder) {
        Ok(entries) => entries,
        Err(error) => return found.skipped.push((folder.to_path_buf(), error.to_string())),
    };
    let mut folders: Vec<PathBuf> = entries.filter_map(|e| Some(e.ok()?.path())).filter(|p| p.is_dir()).collect();
    folders.sort();
    // A folder that is still being written is not a session yet.
    for folder in folders.iter().filter(|folder| !is_partial(folder)) {
        search_folder(found, folder, depth + 1);
    }
}

/// Reads one `session.json`.
///
/// # Errors
///
/// When the file cannot be read or is not a valid session.
pub fn read_session(file: &Path) -> Result<SessionFile, String> {
    SessionFile::from_json(&read_session_text(file)?)
}

/// Reads the text of one `session.json`, up to its maximum size.
fn read_session_text(file: &Path) -> Result<String, String> {
    let size = fs::metadata(file).map_or(0, |meta| meta.len());
    if size > FILE_BYTES_MAX as u64 {
        let most = FILE_BYTES_MAX >> 20;
        return Err(format!("not a session: the file has {} MiB, and the maximum is {most} MiB", size >> 20));
    }
    typodont_formats::read_text(file).map(|source| source.text.clone()).map_err(|d| d.message)
}
