//! Finds bundles and reads their results.

use super::Cohort;
use crate::session_file::{GradeFile, SessionFile, VERSION};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// Folders are looked into this deep: a class of sessions within a year within a school.
const DEPTH_MAX: usize = 4;

/// Every `session.json` below a folder, in order of exercise, participant, beginning and path.
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
    cohort.sessions.sort_by(|(pa, a), (pb, b)| {
        let key = |s: &SessionFile| (s.scenario.id.clone(), s.participant.clone(), s.started.clone());
        (key(a), pa).cmp(&(key(b), pb))
    });
    skip_duplicates(&mut cohort);
    cohort
}

/// Skips copies: a backup beside its original is no second attempt. Of sessions with the same recording, person and
/// time the first counts.
fn skip_duplicates(cohort: &mut Cohort) {
    let mut known: BTreeMap<(String, String, String), PathBuf> = BTreeMap::new();
    let (sessions, skipped) = (&mut cohort.sessions, &mut cohort.skipped);
    sessions.retain(|(path, session)| {
        let Some(digest) = session.digests.get("recording.mcap") else { return true };
        let key = (digest.clone(), session.participant.clone(), session.started.clone());
        match known.get(&key) {
            Some(first) => skipped.push((path.clone(), format!("duplicate of the session in {}", first.display()))),
            None => _ = known.insert(key.clone(), path.clone()),
        }
        known[&key] == *path
    });
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
    for folder in folders.iter().filter(|f| f.extension().is_none_or(|e| e != "partial")) {
        search_folder(found, folder, depth + 1);
    }
}

/// Reads one `session.json`.
///
/// # Errors
///
/// When the file cannot be read or is not a valid session.
pub fn read_session(file: &Path) -> Result<SessionFile, String> {
    let text = typodont_formats::read_text(file).map_err(|d| d.message)?;
    let session: SessionFile = serde_json::from_str(&text.text).map_err(|e| format!("not a session: {e}"))?;
    if session.grade.as_ref().is_some_and(|grade| !is_valid_grade(grade)) {
        return Err("not a session: the points of its grade are invalid".into());
    }
    match session.version {
        VERSION => Ok(session),
        version if version > VERSION => Err(format!("made by a newer program (version {version})")),
        version => Err(format!("not a session: version {version}")),
    }
}

/// True if every maximum of points is finite and not negative. Points above the maximum are left to `verify`.
fn is_valid_grade(grade: &GradeFile) -> bool {
    let most = grade.items.iter().map(|item| item.max_points).chain([grade.max_points]);
    most.into_iter().all(|points| points.is_finite() && points >= 0.0)
}
