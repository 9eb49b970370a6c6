//! Append-only log of overrides.
//!
//! Each override is one line of JSON that contains the SHA-256 of the previous line, so changed, removed and inserted
//! lines are detected. A line that a power cut left incomplete is ignored and stays in place. The log uses no key:
//! rewriting every line from some line on produces a consistent log. To detect that as well, keep a copy of the last
//! line's digest, which every page and every export shows.

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::fmt;
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, ErrorKind, Read, Seek, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};
use typodont_exercise::scenario::hex;

pub const FILE_NAME: &str = "overrides.jsonl";

/// Version of the line format.
const VERSION: u32 = 1;

/// Digest of the previous line in the first line.
const NO_PREVIOUS_DIGEST: &str = "0000000000000000000000000000000000000000000000000000000000000000";

/// Override as written to the log. An entry without an examiner's value withdraws the previous one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OverrideEntry {
    pub version: u32,
    /// Line number, from 1.
    pub number: u64,
    /// SHA-256 of the previous line.
    pub previous: String,
    /// Time of the override, RFC 3339.
    pub at: String,
    #[serde(flatten)]
    pub draft: OverrideDraft,
}

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

/// Content of a log, with the issues found in it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LogSnapshot {
    pub lines: Vec<LogLine>,
    pub issues: Vec<IntegrityIssue>,
    pub head: LogHead,
    /// Number of the next line.
    pub(super) next_number: u64,
}

/// Parsed line.
#[derive(Clone, Debug, PartialEq)]
pub struct LogLine {
    pub entry: OverrideEntry,
    /// True if the line is not what was originally written; such a line is ignored.
    pub is_invalid: bool,
}

/// Length of a log and digest of its last line.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LogHead {
    /// Number of complete lines.
    pub lines: u64,
    /// SHA-256 of the last complete line; empty for an empty log.
    pub sha256: String,
}

/// Integrity violation found in a log.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum IntegrityIssue {
    /// The line is incomplete, as after a power cut or with a full disk. The lines before it are valid.
    Torn { line: u64 },
    /// The line does not have the digest stated in the next line or remembered by this program.
    Changed { line: u64 },
    /// Lines are missing before this line.
    Removed { before: u64 },
    /// The line was copied or moved to this position.
    Misplaced { line: u64 },
    /// Lines that existed before are missing at the end.
    Shortened { lines: u64, before: u64 },
}

impl IntegrityIssue {
    /// Returns the key of the issue's message in the language files, and the message's numeric arguments.
    pub fn message_key(&self) -> (&'static str, Vec<(&'static str, u64)>) {
        match self {
            IntegrityIssue::Torn { line } => ("torn", vec![("line", *line)]),
            IntegrityIssue::Changed { line } => ("changed", vec![("line", *line)]),
            IntegrityIssue::Removed { before } => ("removed", vec![("line", *before)]),
            IntegrityIssue::Misplaced { line } => ("misplaced", vec![("line", *line)]),
            IntegrityIssue::Shortened { lines, before } => ("shortened", vec![("lines", *lines), ("before", *before)]),
        }
    }

    /// Returns true if the issue can be an accident (an incomplete line); all others require that somebody edited the
    /// file.
    pub fn is_accident(&self) -> bool {
        matches!(self, IntegrityIssue::Torn { .. })
    }
}

impl fmt::Display for IntegrityIssue {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            IntegrityIssue::Torn { line } => {
                write!(f, "torn-line: line {line} is incomplete and is ignored")
            }
            IntegrityIssue::Changed { line } => {
                write!(f, "changed-line: line {line} was changed after it was written and is ignored")
            }
            IntegrityIssue::Removed { before } => write!(f, "removed-lines: lines were removed before line {before}"),
            IntegrityIssue::Misplaced { line } => {
                write!(f, "misplaced-line: line {line} is out of place and is ignored")
            }
            IntegrityIssue::Shortened { lines, before } => {
                write!(f, "removed-lines: the log has {lines} lines but had {before}")
            }
        }
    }
}

/// Reason for which nothing was written.
#[derive(Debug)]
pub enum AppendError<E> {
    /// The log cannot be written.
    Io(io::Error),
    /// The caller's `decide` rejected the draft.
    Rejected(E),
}

impl<E: fmt::Display> fmt::Display for AppendError<E> {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            AppendError::Io(error) => write!(f, "the log cannot be written: {error}"),
            AppendError::Rejected(error) => error.fmt(f),
        }
    }
}

impl<E: fmt::Debug + fmt::Display> std::error::Error for AppendError<E> {}

/// Log file of a folder.
pub struct OverrideLog {
    path: PathBuf,
    /// Result of the last read, with the file's size and modification time then.
    cached: Option<((u64, SystemTime), LogSnapshot)>,
}

impl OverrideLog {
    /// Returns the log of a folder. The file is not opened and need not exist.
    pub fn of(folder: &Path) -> OverrideLog {
        OverrideLog { path: folder.join(FILE_NAME), cached: None }
    }

    /// Reads the log and verifies it against `known_head`, the last state that was remembered. A missing file is read
    /// as an empty log.
    ///
    /// # Errors
    ///
    /// Returns the I/O error when the file cannot be read, is not a regular file, or stays locked by another program.
    pub fn read(&mut self, known_head: Option<&LogHead>) -> io::Result<LogSnapshot> {
        let mut file = match require_plain_file(&self.path).and_then(|()| File::open(&self.path)) {
            Ok(file) => file,
            Err(error) if error.kind() == ErrorKind::NotFound => {
                return Ok(check_known_head(parse_log(b""), b"", known_head));
            }
            Err(error) => return Err(error),
        };
        let meta = file.metadata()?;
        let stamp = (meta.len(), meta.modified()?);
        match &self.cached {
            Some((then, log)) if *then == stamp => return Ok(log.clone()),
            _ => {}
        }
        // The lock excludes reading while a line is being written.
        lock_with_timeout(|| file.try_lock_shared())?;
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes)?;
        let now = check_known_head(parse_log(&bytes), &bytes, known_head);
        let meta = file.metadata()?;
        self.cached = Some(((meta.len(), meta.modified()?), now.clone()));
        Ok(now)
    }

    /// Appends the draft that `decide` returns. `decide` sees the log under an exclusive lock.
    ///
    /// If lines counted by `known_head` are missing, the new line is numbered after them, so that it is not mistaken
    /// for one of them.
    ///
    /// # Errors
    ///
    /// Returns an error when the file cannot be read or written, is not a regular file, stays locked by another
    /// program, or `decide` rejects.
    pub fn append<E>(
        &mut self,
        at: &str,
        known_head: Option<&LogHead>,
        decide: impl FnOnce(&LogSnapshot) -> Result<OverrideDraft, E>,
    ) -> Result<OverrideEntry, AppendError<E>> {
        let failed = AppendError::Io;
        let is_new = !self.path.exists();
        let mut options = OpenOptions::new();
        options.read(true).append(true).create(true);
        // Names and reasons are readable only by the owner of the folder.
        #[cfg(unix)]
        std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
        let mut file = require_plain_file(&self.path).and_then(|()| options.open(&self.path)).map_err(failed)?;
        lock_with_timeout(|| file.try_lock()).map_err(failed)?;
        let mut bytes = Vec::new();
        file.rewind().and_then(|()| file.read_to_end(&mut bytes)).map_err(failed)?;
        let log = parse_log(&bytes);
        let draft = decide(&log).map_err(AppendError::Rejected)?;
        let last = raw_lines(&bytes).last().map(digest);
        let previous = last.unwrap_or_else(|| NO_PREVIOUS_DIGEST.into());
        let number = log.next_number.max(known_head.map_or(0, |known| known.lines.saturating_add(1)));
        let entry = OverrideEntry { version: VERSION, number, previous, at: at.to_string(), draft };
        let text = serde_json::to_string(&entry).map_err(|e| failed(e.into()))?;
        // An incomplete last line is terminated first, so that the new line stays readable.
        let begin = if bytes.is_empty() || bytes.ends_with(b"\n") { "" } else { "\n" };
        let written = file.write_all(format!("{begin}{text}\n").as_bytes()).and_then(|()| file.sync_all());
        if let Err(error) = written {
            // Remove a partially written line. If this fails too, the line is reported as incomplete.
            let _ = file.set_len(bytes.len() as u64);
            return Err(failed(error));
        }
        if is_new {
            sync_folder(&self.path);
        }
        self.cached = None;
        Ok(entry)
    }
}

/// Rejects a link, pipe or folder in place of the log: writing to it would go elsewhere or block forever.
fn require_plain_file(path: &Path) -> io::Result<()> {
    match fs::symlink_metadata(path) {
        Ok(meta) if !meta.is_file() => Err(io::Error::other("the log is a link or not a regular file")),
        _ => Ok(()),
    }
}

/// Acquires a lock, which other programs hold only while they write a line. Gives up after about 5 s, so that a
/// program that never releases it cannot block the application.
fn lock_with_timeout(lock: impl Fn() -> Result<(), TryLockError>) -> io::Result<()> {
    const PAUSE: Duration = Duration::from_millis(10);
    // About 5 s.
    for _ in 0..500 {
        match lock() {
            Ok(()) => return Ok(()),
            Err(TryLockError::Error(error)) => return Err(error),
            Err(TryLockError::WouldBlock) => std::thread::sleep(PAUSE),
        }
    }
    Err(io::Error::other("the log is locked by another program"))
}

/// Syncs the folder of a new file, so that its directory entry survives a power cut.
fn sync_folder(path: &Path) {
    if let Some(folder) = path.parent().and_then(|folder| File::open(folder).ok()) {
        // Systems on which folders cannot be synced do so by themselves.
        let _ = folder.sync_all();
    }
}

impl LogSnapshot {
    /// Creates a snapshot from chronological entries that do not come from a log file, such as a database. No chain
    /// is verified.
    pub fn from_entries(entries: Vec<OverrideEntry>) -> LogSnapshot {
        let next_number = entries.len() as u64 + 1;
        let lines = entries.into_iter().map(|entry| LogLine { entry, is_invalid: false }).collect();
        LogSnapshot { lines, next_number, ..LogSnapshot::default() }
    }

    /// Returns all entries that are not invalid, in order, including those that later entries replace.
    pub fn valid_entries(&self) -> impl Iterator<Item = &OverrideEntry> {
        self.lines.iter().filter(|line| !line.is_invalid).map(|line| &line.entry)
    }

    /// Returns the last valid entry about a session's item, or about its whole grade.
    pub fn latest_for(&self, session: &str, item: Option<usize>) -> Option<&OverrideEntry> {
        self.valid_entries().filter(|entry| entry.draft.concerns(session, item)).last()
    }
}

/// Splits the file into its non-empty lines, complete or not.
fn raw_lines(bytes: &[u8]) -> impl Iterator<Item = &[u8]> {
    bytes.split(|b| *b == b'\n').filter(|line| !line.is_empty())
}

fn digest(line: &[u8]) -> String {
    hex(&Sha256::digest(line))
}

/// Parses a log and verifies its chain of digests.
fn parse_log(bytes: &[u8]) -> LogSnapshot {
    let mut log = LogSnapshot::default();
    let is_open = !bytes.is_empty() && !bytes.ends_with(b"\n");
    let lines: Vec<&[u8]> = raw_lines(bytes).collect();
    let whole = lines.len() - usize::from(is_open);
    let mut before = NO_PREVIOUS_DIGEST.to_string();
    // Number expected next, and count of unreadable lines since the last number read.
    let (mut next, mut unreadable) = (1u64, 0u64);
    for (index, line) in lines.iter().enumerate() {
        let own = digest(line);
        let Ok(entry) = serde_json::from_slice::<OverrideEntry>(line) else {
            unreadable += 1;
            // The following line shows whether this one is incomplete or was changed.
            log.issues.push(IntegrityIssue::Torn { line: next });
            (before, next) = (own, next + 1);
            continue;
        };
        let number = entry.number;
        let mut is_invalid = false;
        // A number without a successor cannot be genuine.
        let has_next = number < u64::MAX;
        if number < next || !has_next {
            log.issues.push(IntegrityIssue::Misplaced { line: number });
            is_invalid = true;
        } else if number > next {
            log.issues.push(IntegrityIssue::Removed { before: number });
        } else if entry.previous != before {
            log.invalidate_before(number, unreadable);
            is_invalid = number == 1;
        }
        log.lines.push(LogLine { entry, is_invalid });
        if has_next && (!is_invalid || number >= next) {
            (next, unreadable) = (number + 1, 0);
        }
        before = own;
        if index < whole {
            log.head = LogHead { lines: next - 1, sha256: before.clone() };
        }
    }
    if unreadable > 0 && !is_open {
        // The line is terminated but unreadable, so it was changed rather than cut off.
        log.issues.retain(|t| *t != IntegrityIssue::Torn { line: next - 1 });
        log.issues.push(IntegrityIssue::Changed { line: next - 1 });
    }
    log.next_number = next;
    log
}

impl LogSnapshot {
    /// Marks the line before `number` as changed, because its digest is not the one stated in line `number`.
    fn invalidate_before(&mut self, number: u64, unread: u64) {
        let before = number.saturating_sub(1).max(1);
        if unread > 0 {
            // The unreadable line is followed by another one, so it was changed rather than cut off.
            self.issues.retain(|t| *t != IntegrityIssue::Torn { line: before });
        } else if let Some(line) = self.lines.last_mut() {
            line.is_invalid = true;
        }
        self.issues.push(IntegrityIssue::Changed { line: before });
    }
}

/// Compares a log with the last state that was remembered.
fn check_known_head(mut log: LogSnapshot, bytes: &[u8], known_head: Option<&LogHead>) -> LogSnapshot {
    let Some(known) = known_head.filter(|known| known.lines > 0) else { return log };
    if log.head.lines < known.lines {
        log.issues.push(IntegrityIssue::Shortened { lines: log.head.lines, before: known.lines });
        return log;
    }
    // The line that was the last one then may be anywhere now.
    if raw_lines(bytes).any(|line| digest(line) == known.sha256) {
        return log;
    }
    let issue = IntegrityIssue::Changed { line: known.lines };
    if !log.issues.contains(&issue) {
        log.issues.push(issue);
    }
    for line in log.lines.iter_mut().filter(|line| line.entry.number == known.lines) {
        line.is_invalid = true;
    }
    log
}

#[cfg(test)]
mod tests {
    use super::*;

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
        let known = parse_log(text.as_bytes()).head;
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
}
