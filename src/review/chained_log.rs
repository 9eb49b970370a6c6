//! Append-only logs of examiners' decisions.
//!
//! Each entry is one line of JSON that contains the SHA-256 of the previous line, so changed, removed and inserted
//! lines are detected. A line that a power cut left incomplete is ignored and stays in place. The log uses no key:
//! rewriting every line from some line on produces a consistent log. To detect that as well, keep a copy of the last
//! line's digest, which every page and every export shows.

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::fmt;
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, ErrorKind, Read, Seek, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;
use typodont_exercise::scenario::hex;
use typodont_formats::sync_folder;

/// Version of the line format.
const VERSION: u32 = 1;

/// Digest of the previous line in the first line.
const NO_PREVIOUS_DIGEST: &str = "0000000000000000000000000000000000000000000000000000000000000000";

/// Content of a line, before it has a number.
pub trait LoggedDraft: Serialize + DeserializeOwned + Clone {
    /// Name of the log's file in the folder of the bundles.
    const FILE_NAME: &'static str;

    /// Id of the session that the line is about.
    fn session(&self) -> &str;
}

/// Entry as written to the log.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LogEntry<D> {
    pub version: u32,
    /// Line number, from 1.
    pub number: u64,
    /// SHA-256 of the previous line.
    pub previous: String,
    /// Time of the entry, RFC 3339.
    pub at: String,
    #[serde(flatten)]
    pub draft: D,
}

/// Content of a log, with the issues found in it.
#[derive(Clone, Debug, PartialEq)]
pub struct LogSnapshot<D> {
    pub lines: Vec<LogLine<D>>,
    pub issues: Vec<IntegrityIssue>,
    pub head: LogHead,
    /// Number of the next line.
    pub(super) next_number: u64,
}

/// Parsed line.
#[derive(Clone, Debug, PartialEq)]
pub struct LogLine<D> {
    pub entry: LogEntry<D>,
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
pub struct ChainedLog<D> {
    path: PathBuf,
    /// Result of the last read, with the SHA-256 of the whole file and the head that it was compared with. The file's
    /// size and modification time would not do: whoever edits the file can set both.
    cached: Option<([u8; 32], Option<LogHead>, LogSnapshot<D>)>,
}

impl<D: LoggedDraft> ChainedLog<D> {
    /// Returns the log of a folder. The file is not opened and need not exist.
    pub fn of(folder: &Path) -> ChainedLog<D> {
        ChainedLog { path: folder.join(D::FILE_NAME), cached: None }
    }

    /// Reads the log and verifies it against `known_head`, the last state that was remembered. A missing file is read
    /// as an empty log.
    ///
    /// # Errors
    ///
    /// Returns the I/O error when the file cannot be read, is not a regular file, or stays locked by another program.
    pub fn read(&mut self, known_head: Option<&LogHead>) -> io::Result<LogSnapshot<D>> {
        let mut file = match require_plain_file(&self.path).and_then(|()| File::open(&self.path)) {
            Ok(file) => file,
            Err(error) if error.kind() == ErrorKind::NotFound => {
                return Ok(check_known_head(parse_log(b""), b"", known_head));
            }
            Err(error) => return Err(error),
        };
        // The lock excludes reading while a line is being written.
        lock_with_timeout(|| file.try_lock_shared())?;
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes)?;
        let of_file: [u8; 32] = Sha256::digest(&bytes).into();
        match &self.cached {
            Some((then, known, log)) if *then == of_file && known.as_ref() == known_head => return Ok(log.clone()),
            _ => {}
        }
        let now = check_known_head(parse_log(&bytes), &bytes, known_head);
        self.cached = Some((of_file, known_head.cloned(), now.clone()));
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
        decide: impl FnOnce(&LogSnapshot<D>) -> Result<D, E>,
    ) -> Result<LogEntry<D>, AppendError<E>> {
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
        let log = parse_log::<D>(&bytes);
        let draft = decide(&log).map_err(AppendError::Rejected)?;
        let last = raw_lines(&bytes).last().map(digest);
        let previous = last.unwrap_or_else(|| NO_PREVIOUS_DIGEST.into());
        let number = log.next_number.max(known_head.map_or(0, |known| known.lines.saturating_add(1)));
        let entry = LogEntry { version: VERSION, number, previous, at: at.to_string(), draft };
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
            // The directory entry of a new file survives a power cut, too.
            sync_folder(self.path.parent().unwrap_or(Path::new(".")));
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

impl<D> Default for LogSnapshot<D> {
    fn default() -> LogSnapshot<D> {
        LogSnapshot { lines: Vec::new(), issues: Vec::new(), head: LogHead::default(), next_number: 0 }
    }
}

impl<D> LogSnapshot<D> {
    /// Creates a snapshot from chronological entries that do not come from a log file, such as a database. No chain
    /// is verified.
    pub fn from_entries(entries: Vec<LogEntry<D>>) -> LogSnapshot<D> {
        let next_number = entries.len() as u64 + 1;
        let lines = entries.into_iter().map(|entry| LogLine { entry, is_invalid: false }).collect();
        LogSnapshot { lines, next_number, ..LogSnapshot::default() }
    }

    /// Returns all entries that are not invalid, in order, including those that later entries replace.
    pub fn valid_entries(&self) -> impl Iterator<Item = &LogEntry<D>> {
        self.lines.iter().filter(|line| !line.is_invalid).map(|line| &line.entry)
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
pub(super) fn parse_log<D: LoggedDraft>(bytes: &[u8]) -> LogSnapshot<D> {
    let mut log = LogSnapshot::default();
    let is_open = !bytes.is_empty() && !bytes.ends_with(b"\n");
    let lines: Vec<&[u8]> = raw_lines(bytes).collect();
    let whole = lines.len() - usize::from(is_open);
    let mut before = NO_PREVIOUS_DIGEST.to_string();
    // Number expected next, and count of unreadable lines since the last number read.
    let (mut next, mut unreadable) = (1u64, 0u64);
    for (index, line) in lines.iter().enumerate() {
        let own = digest(line);
        let Ok(entry) = serde_json::from_slice::<LogEntry<D>>(line) else {
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

impl<D> LogSnapshot<D> {
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
fn check_known_head<D>(mut log: LogSnapshot<D>, bytes: &[u8], known_head: Option<&LogHead>) -> LogSnapshot<D> {
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
