//! Overrides: an examiner's points in place of the computed ones, with a reason and a name.

use super::chained_log::{ChainedLog, LogEntry, LogSnapshot, LoggedDraft};
use serde::{Deserialize, Serialize};

/// Override as written to the log. An entry without an examiner's value withdraws the previous one.
pub type OverrideEntry = LogEntry<OverrideDraft>;

/// Log of overrides of a folder.
pub type OverrideLog = ChainedLog<OverrideDraft>;

/// Content of a log of overrides, with the issues found in it.
pub type OverrideSnapshot = LogSnapshot<OverrideDraft>;

/// Content of an override, before it has a line number.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OverrideDraft {
    /// Id of the session.
    pub session: String,
    /// SHA-256 of the session's recording as stated in `session.json`; empty for a session entered by hand.
    #[serde(default)]
    pub recording: String,
    /// Overridden item; `None` for the whole grade.
    #[serde(default)]
    pub item: Option<RubricItemRef>,
    /// The scorer's points at the time of the override.
    pub machine: GivenPoints,
    /// The examiner's points; `None` withdraws the previous override.
    #[serde(default)]
    pub examiner: Option<GivenPoints>,
    pub reason: String,
    pub name: String,
}

/// Item of a rubric, identified by its index, from 0, and its metric. The title is for readers only.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RubricItemRef {
    pub index: usize,
    pub metric: String,
    pub title: String,
}

/// Points, and for the whole grade also whether it is a pass.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct GivenPoints {
    pub points: f64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub passed: Option<bool>,
}

impl OverrideDraft {
    /// Returns true if the override is about this session and item (`None` for the whole grade).
    pub fn concerns(&self, session: &str, item: Option<usize>) -> bool {
        self.session == session && self.item.as_ref().map(|i| i.index) == item
    }
}

impl LoggedDraft for OverrideDraft {
    const FILE_NAME: &'static str = "overrides.jsonl";

    fn session(&self) -> &str {
        &self.session
    }
}

impl OverrideSnapshot {
    /// Returns the last valid entry about a session's item, or about its whole grade.
    pub fn latest_for(&self, session: &str, item: Option<usize>) -> Option<&OverrideEntry> {
        self.valid_entries().filter(|entry| entry.draft.concerns(session, item)).last()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chained_log::{IntegrityIssue, parse_log};
    use std::fs;
    use std::path::{Path, PathBuf};

    const FILE_NAME: &str = OverrideDraft::FILE_NAME;

    fn draft(item: Option<usize>, points: Option<f64>) -> OverrideDraft {
        let item = item.map(|index| RubricItemRef { index, metric: "dice".into(), title: "Overlap".into() });
        OverrideDraft {
            session: "2ed6657d-e927-568b-95e1-2665a8aea6a2".into(),
            recording: String::new(),
            item,
            machine: GivenPoints { points: 25.0, passed: None },
            examiner: points.map(|points| GivenPoints { points, passed: None }),
            reason: "the wall is =sound\n<b>here</b>".into(),
            name: "Dr. Öz".into(),
        }
    }

    fn written(folder: &Path, points: f64) -> OverrideEntry {
        OverrideLog::of(folder)
            .append("2026-11-22T09:00:00Z", None, |_| Ok::<_, ()>(draft(Some(0), Some(points))))
            .unwrap()
    }

    fn folder(name: &str) -> PathBuf {
        let folder = std::env::temp_dir().join(format!("typodont-overrides-{name}-{}", std::process::id()));
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(&folder).unwrap();
        folder
    }

    /// Writes four lines, applies `change` to the file, and returns the reported issues and the points of the valid
    /// entries.
    fn after(change: impl Fn(Vec<String>) -> String) -> (Vec<IntegrityIssue>, Vec<f64>) {
        let folder = folder("after");
        for points in [1.0, 2.0, 3.0, 4.0] {
            written(&folder, points);
        }
        let path = folder.join(FILE_NAME);
        let text = fs::read_to_string(&path).unwrap();
        let known = parse_log::<OverrideDraft>(text.as_bytes()).head;
        let changed = change(text.lines().map(|l| format!("{l}\n")).collect());
        fs::write(&path, &changed).unwrap();
        let log = OverrideLog::of(&folder).read(Some(&known)).unwrap();
        let points = log.valid_entries().map(|e| e.draft.examiner.unwrap().points).collect();
        fs::remove_dir_all(&folder).unwrap();
        (log.issues, points)
    }

    #[test]
    fn every_change_of_the_log_is_detected() {
        // Aim: every way to falsify a line shows, and what is is_invalid does not count. Method: four lines, one hand
        // at them.
        assert_eq!(after(|lines| lines.concat()), (vec![], vec![1.0, 2.0, 3.0, 4.0]));
        let edited = |line: &str| line.replace("\"points\":2.0", "\"points\":9.0");
        let check = |change: &dyn Fn(Vec<String>) -> String, issue: IntegrityIssue, points: &[f64]| {
            assert_eq!(after(change), (vec![issue], points.to_vec()));
        };
        check(
            &|l| l[0].clone() + &edited(&l[1]) + &l[2] + &l[3],
            IntegrityIssue::Changed { line: 2 },
            &[1.0, 3.0, 4.0],
        );
        check(&|l| l[0].clone() + &l[2] + &l[3], IntegrityIssue::Removed { before: 3 }, &[1.0, 3.0, 4.0]);
        check(&|l| l[1..].concat(), IntegrityIssue::Removed { before: 2 }, &[2.0, 3.0, 4.0]);
        check(&|l| l.concat() + &l[1], IntegrityIssue::Misplaced { line: 2 }, &[1.0, 2.0, 3.0, 4.0]);
        check(&|l| l[..3].concat(), IntegrityIssue::Shortened { lines: 3, before: 4 }, &[1.0, 2.0, 3.0]);
        check(&|_| String::new(), IntegrityIssue::Shortened { lines: 0, before: 4 }, &[]);
        // No line follows the last one, so a change of it is detected only by the remembered digest.
        let last = |l: Vec<String>| l[..3].concat() + &l[3].replace("\"points\":4.0", "\"points\":9.0");
        check(&last, IntegrityIssue::Changed { line: 4 }, &[1.0, 2.0, 3.0]);
        // Garbage in place of a line is not an incomplete line.
        check(&|l| l[0].clone() + "rubbish\n" + &l[2] + &l[3], IntegrityIssue::Changed { line: 2 }, &[1.0, 3.0, 4.0]);
    }

    #[test]
    fn an_incomplete_line_is_survived() {
        // Aim: after a power cut within a line, the lines before it are valid and new lines are chained to it.
        // Method: cut the last line at many positions.
        let folder = folder("torn");
        written(&folder, 1.0);
        written(&folder, 2.0);
        let path = folder.join(FILE_NAME);
        let whole = fs::read(&path).unwrap();
        let first = whole.iter().position(|b| *b == b'\n').unwrap() + 1;
        for cut in (first + 1..whole.len() - 1).step_by(23) {
            fs::write(&path, &whole[..cut]).unwrap();
            let mut log = OverrideLog::of(&folder);
            let now = log.read(None).unwrap();
            assert_eq!((now.issues, now.lines.len()), (vec![IntegrityIssue::Torn { line: 2 }], 1), "cut at {cut}");
            assert_eq!(written(&folder, 3.0).number, 3);
            assert_eq!(written(&folder, 4.0).number, 4);
            let now = log.read(None).unwrap();
            assert_eq!((now.issues, now.lines.len()), (vec![IntegrityIssue::Torn { line: 2 }], 3), "cut at {cut}");
        }
        // Only the line break is missing, so the line is complete.
        fs::write(&path, &whole[..whole.len() - 1]).unwrap();
        assert_eq!(written(&folder, 3.0).number, 3);
        let now = OverrideLog::of(&folder).read(None).unwrap();
        assert_eq!((now.issues, now.lines.len()), (vec![], 3));
        fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn concurrent_writers_append_every_line() {
        let folder = folder("many");
        std::thread::scope(|scope| {
            for _ in 0..8 {
                scope.spawn(|| (0..20).for_each(|n| drop(written(&folder, f64::from(n)))));
            }
        });
        let now = OverrideLog::of(&folder).read(None).unwrap();
        assert_eq!((now.issues, now.lines.len(), now.head.lines), (vec![], 160, 160));
        fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn an_edit_that_keeps_size_and_time_is_noticed() {
        // Aim: a running program does not go on showing the text that it read first. Method: one letter is replaced,
        // and the file's modification time is set back. It once compared size and time only.
        let folder = folder("same-stamp");
        written(&folder, 1.0);
        written(&folder, 2.0);
        let path = folder.join(FILE_NAME);
        let mut log = OverrideLog::of(&folder);
        assert_eq!(log.read(None).unwrap().issues, vec![]);
        let before = fs::metadata(&path).unwrap();
        let text = fs::read_to_string(&path).unwrap();
        fs::write(&path, text.replacen("\"points\":1.0", "\"points\":9.0", 1)).unwrap();
        fs::File::options().write(true).open(&path).unwrap().set_modified(before.modified().unwrap()).unwrap();
        let after = fs::metadata(&path).unwrap();
        assert_eq!((after.len(), after.modified().unwrap()), (before.len(), before.modified().unwrap()));
        assert_eq!(log.read(None).unwrap().issues, vec![IntegrityIssue::Changed { line: 1 }]);
        fs::remove_dir_all(&folder).unwrap();
    }
}
