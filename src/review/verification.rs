//! Verification of the listed bundles in the background.

use super::app::ReviewApp;
use super::bundle;
use super::index::{IndexedSession, SessionIndex};
use super::query::{Query, VerificationFilter};
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::UNIX_EPOCH;
use typodont_report::bundle::BundleFolder;
use typodont_report::{VerificationStatus, Verifier, sanitize_display};

/// Maximum displayed length of the differences of a bundle, characters.
const NOTE_MAX: usize = 600;

/// Judgements of the bundles, and the work that is left.
#[derive(Default)]
pub(super) struct VerificationQueue {
    /// By path of the bundle: its files as they were judged, and the judgement.
    judged: BTreeMap<PathBuf, (String, VerificationStatus)>,
    /// Bundles whose digests and sums are compared first, because that is quick.
    to_check: BTreeSet<PathBuf>,
    /// Bundles whose recordings are replayed.
    to_replay: BTreeSet<PathBuf>,
}

impl VerificationQueue {
    /// Drops what concerns bundles that are no longer listed, so that a desk that runs for months neither grows nor counts
    /// deleted sessions as done.
    fn keep_listed(&mut self, listed: &BTreeSet<PathBuf>) {
        self.judged.retain(|path, _| listed.contains(path));
        self.to_check.retain(|path| listed.contains(path));
        self.to_replay.retain(|path| listed.contains(path));
    }

    /// Number of bundles whose judgement is final.
    fn done(&self) -> usize {
        self.judged.values().filter(|(_, status)| *status != VerificationStatus::Pending).count()
    }
}

/// A status as it is shown: a word and, for a result that differs, its differences.
#[derive(Serialize)]
pub(super) struct ShownVerification {
    /// `verified`, `pending`, `unverified` or `differs`: the end of the text's key.
    word: &'static str,
    note: String,
}

impl ShownVerification {
    pub fn of(status: &VerificationStatus) -> ShownVerification {
        let note = match status {
            VerificationStatus::Verified | VerificationStatus::Pending => String::new(),
            VerificationStatus::Unverified(_) | VerificationStatus::Differs(_) => status.note(),
        };
        ShownVerification { word: filter_of(status).name(), note: sanitize_display(&note, NOTE_MAX) }
    }

    /// Leaves out the note, which states points and measures, where the marks of the session are hidden.
    pub fn without_note_if(self, is_hidden: bool) -> ShownVerification {
        if is_hidden { ShownVerification { note: String::new(), ..self } } else { self }
    }
}

fn filter_of(status: &VerificationStatus) -> VerificationFilter {
    match status {
        VerificationStatus::Verified => VerificationFilter::Verified,
        VerificationStatus::Pending => VerificationFilter::Pending,
        VerificationStatus::Unverified(_) => VerificationFilter::Unverified,
        VerificationStatus::Differs(_) => VerificationFilter::Differs,
    }
}

/// Number of sessions whose recordings are still to be replayed, of all that are listed.
#[derive(Clone, Copy, Serialize)]
pub(super) struct VerificationProgress {
    left: usize,
    count: usize,
}

impl ReviewApp {
    /// Searches the folder for bundles that are new, changed or deleted, whether or not anybody opens a page, and brings
    /// the queue up to date with it.
    pub fn queue_changed_bundles(&self) {
        let listed = {
            let mut state = self.state();
            // A folder or an index that cannot be read is reported on every page.
            let read = state.refresh(&self.folder).and_then(|_| state.index.paths().map_err(|e| e.to_string()));
            let Ok(listed) = read else { return };
            BTreeSet::from_iter(listed)
        };
        self.verification_queue().keep_listed(&listed);
        for path in listed {
            let print = fingerprint(&self.folder.join(&path));
            let mut queue = self.verification_queue();
            if queue.judged.get(&path).is_none_or(|(judged, _)| *judged != print) {
                queue.to_check.insert(path);
            }
        }
    }

    /// Judges the next bundle of the queue; returns false if it is empty. Several threads may call it at the same time.
    pub fn verify_next(&self, verifier: &Verifier) -> bool {
        let Some((path, replays)) = self.next_to_verify() else { return false };
        let print = fingerprint(&self.folder.join(&path));
        let own = BundleFolder::on_disk(self.folder.join(&path));
        let status = match bundle::read_bundle_session(&self.folder, &path) {
            Ok(session) if replays => verifier.verify(&own, &session),
            Ok(session) => verifier.check(&own, &session),
            Err(why) => VerificationStatus::Unverified(why),
        };
        let mut queue = self.verification_queue();
        if status == VerificationStatus::Pending {
            queue.to_replay.insert(path.clone());
        }
        queue.judged.insert(path, (print, status));
        true
    }

    /// Takes a bundle out of the queue, and whether its recording is to be replayed.
    fn next_to_verify(&self) -> Option<(PathBuf, bool)> {
        let mut queue = self.verification_queue();
        let quick = queue.to_check.pop_first().map(|path| (path, false));
        quick.or_else(|| queue.to_replay.pop_first().map(|path| (path, true)))
    }

    /// Relation of a listed session's result to its recording; pending for a bundle that was changed since.
    pub(super) fn verification(&self, indexed: &IndexedSession) -> VerificationStatus {
        self.verification_at(&indexed.path)
    }

    fn verification_at(&self, path: &Path) -> VerificationStatus {
        let known = self.verification_queue().judged.get(path).cloned();
        let print = fingerprint(&self.folder.join(path));
        known.filter(|(judged, _)| *judged == print).map(|(_, status)| status).unwrap_or_default()
    }

    /// Returns the sessions of a query, and their number on all pages.
    ///
    /// # Errors
    ///
    /// Returns the SQLite error.
    pub(super) fn query_sessions(
        &self,
        index: &SessionIndex,
        query: &Query,
    ) -> rusqlite::Result<(Vec<IndexedSession>, usize)> {
        let Some(asked) = query.verification else { return index.query_sessions(query, self.anonymous, None) };
        let is_asked = |path: &PathBuf| filter_of(&self.verification_at(path)) == asked;
        let paths: Vec<PathBuf> = index.paths()?.into_iter().filter(is_asked).collect();
        index.query_sessions(query, self.anonymous, Some(&paths))
    }

    pub(super) fn verification_progress(&self, count: usize) -> VerificationProgress {
        VerificationProgress { left: count.saturating_sub(self.verification_queue().done()), count }
    }

    fn verification_queue(&self) -> MutexGuard<'_, VerificationQueue> {
        self.verification.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Queue of a new application.
pub(super) fn new_queue() -> Mutex<VerificationQueue> {
    Mutex::default()
}

/// Names, sizes and times of a bundle's files. The time of the last change of a file's metadata is among them where the
/// system has it, because a user cannot set it back.
fn fingerprint(bundle: &Path) -> String {
    let mut lines = Vec::new();
    for folder in [bundle.to_path_buf(), bundle.join("views")] {
        for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
            let Ok(meta) = fs::symlink_metadata(entry.path()) else { continue };
            let modified = meta.modified().ok().and_then(|t| t.duration_since(UNIX_EPOCH).ok()).unwrap_or_default();
            let name = entry.file_name();
            lines.push(format!("{name:?} {} {} {}", meta.len(), modified.as_nanos(), changed_at(&meta)));
        }
    }
    lines.sort();
    lines.join("\n")
}

#[cfg(unix)]
fn changed_at(meta: &fs::Metadata) -> i128 {
    use std::os::unix::fs::MetadataExt;
    i128::from(meta.ctime()) * 1_000_000_000 + i128::from(meta.ctime_nsec())
}

#[cfg(not(unix))]
fn changed_at(_: &fs::Metadata) -> i128 {
    0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bundles_that_are_no_longer_listed_are_forgotten() {
        // Aim: a deleted bundle is not counted as done, which would hide that another one is still to be judged.
        let mut queue = VerificationQueue::default();
        for name in ["kept", "deleted"] {
            queue.judged.insert(name.into(), (String::new(), VerificationStatus::Verified));
            queue.to_check.insert(name.into());
            queue.to_replay.insert(name.into());
        }
        queue.judged.insert("waiting".into(), (String::new(), VerificationStatus::Pending));
        assert_eq!(queue.done(), 2);
        queue.keep_listed(&["kept", "waiting", "new"].map(PathBuf::from).into());
        assert_eq!(queue.done(), 1);
        assert_eq!(queue.judged.keys().collect::<Vec<_>>(), [Path::new("kept"), Path::new("waiting")]);
        assert_eq!((queue.to_check.len(), queue.to_replay.len()), (1, 1));
    }
}
