//! What examiners judged otherwise: a log that only grows.
//!
//! A line of JSON per judgement. Each names the SHA-256 of the line before it, so that a line that is changed, removed or slipped
//! in between shows; a line that a power cut tore is passed over and stays where it is. The log needs no key: whoever rewrites
//! all of it from some line on makes a log that agrees with itself. Who must be safe from that writes down the last line's digest,
//! which every page and every export shows.

use crate::scenario::hex;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::fmt;
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, ErrorKind, Read, Seek, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

pub const FILE_NAME: &str = "overrides.jsonl";

/// Version of a line's form.
const VERSION: u32 = 1;

/// Stands where the first line names the one before it.
const NONE_BEFORE: &str = "0000000000000000000000000000000000000000000000000000000000000000";

/// A judgement, as it stands in the log. Without an examiner's value it withdraws the one that stood.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Entry {
    pub version: u32,
    /// The line's number, from 1.
    pub number: u64,
    /// SHA-256 of the line before.
    pub previous: String,
    /// When, RFC 3339.
    pub at: String,
    #[serde(flatten)]
    pub draft: Draft,
}

/// What of it an examiner decides.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Draft {
    /// The session's id, and the SHA-256 of its recording as `session.json` names it; empty for one entered by hand.
    pub session: String,
    #[serde(default)]
    pub recording: String,
    /// Of which item; none for the whole grade.
    #[serde(default)]
    pub item: Option<ItemRef>,
    pub machine: Judged,
    #[serde(default)]
    pub examiner: Option<Judged>,
    pub reason: String,
    pub name: String,
}

/// An item of a rubric: its place, from 0, and its measure. The title is for people.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ItemRef {
    pub index: usize,
    pub metric: String,
    pub title: String,
}

/// Points; of the whole grade also whether it is passed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Judged {
    pub points: f64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub passed: Option<bool>,
}

impl Draft {
    /// Whether two judgements are of the same thing.
    pub fn is_of(&self, session: &str, item: Option<usize>) -> bool {
        self.session == session && self.item.as_ref().map(|i| i.index) == item
    }
}

/// What a log says.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Told {
    pub lines: Vec<Line>,
    pub troubles: Vec<Trouble>,
    pub head: Head,
    /// Number of the line that comes next.
    pub(super) next: u64,
}

/// A line that could be read.
#[derive(Clone, Debug, PartialEq)]
pub struct Line {
    pub entry: Entry,
    /// It is not what was written there once: it counts for nothing.
    pub doubtful: bool,
}

/// How far a log goes.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Head {
    /// Whole lines.
    pub lines: u64,
    /// SHA-256 of the last of them; empty of none.
    pub sha256: String,
}

/// What is wrong with a log.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Trouble {
    /// A power cut, a full disk: a line was begun and not ended. What stood before it holds.
    Torn { line: u64 },
    /// A line does not have the digest that the next one, or this program, knows it by.
    Changed { line: u64 },
    /// Lines are missing before one.
    Removed { before: u64 },
    /// A line stands where it does not belong: copied, or moved.
    Misplaced { line: u64 },
    /// Lines at the end are gone that were there before.
    Shortened { lines: u64, before: u64 },
}

impl Trouble {
    /// Its name in the languages' files, and the numbers in its sentence.
    pub fn words(&self) -> (&'static str, Vec<(&'static str, u64)>) {
        match self {
            Trouble::Torn { line } => ("torn", vec![("line", *line)]),
            Trouble::Changed { line } => ("changed", vec![("line", *line)]),
            Trouble::Removed { before } => ("removed", vec![("line", *before)]),
            Trouble::Misplaced { line } => ("misplaced", vec![("line", *line)]),
            Trouble::Shortened { lines, before } => ("shortened", vec![("lines", *lines), ("before", *before)]),
        }
    }

    /// A torn line is an accident; the rest is somebody's doing.
    pub fn is_accident(&self) -> bool {
        matches!(self, Trouble::Torn { .. })
    }
}

impl fmt::Display for Trouble {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Trouble::Torn { line } => write!(f, "torn-line: line {line} was begun and not ended; it is passed over"),
            Trouble::Changed { line } => {
                write!(f, "changed-line: line {line} was changed after it was written; it counts for nothing")
            }
            Trouble::Removed { before } => write!(f, "removed-lines: lines were removed before line {before}"),
            Trouble::Misplaced { line } => {
                write!(f, "misplaced-line: line {line} does not belong where it stands; it counts for nothing")
            }
            Trouble::Shortened { lines, before } => {
                write!(f, "removed-lines: the log has {lines} lines; it had {before}")
            }
        }
    }
}

/// Why nothing was written.
#[derive(Debug)]
pub enum Unwritten<E> {
    /// The log cannot be written.
    Failed(io::Error),
    /// Whoever wanted to write thought better of it, having seen what stands there.
    Refused(E),
}

/// A log on disk.
pub struct Log {
    path: PathBuf,
    /// What was read last, of a file of this size and time.
    read: Option<((u64, SystemTime), Told)>,
}

impl Log {
    pub fn of(folder: &Path) -> Log {
        Log { path: folder.join(FILE_NAME), read: None }
    }

    /// What it says now; `known` is how far it was known to go. A log that is not there says nothing.
    pub fn told(&mut self, known: Option<&Head>) -> io::Result<Told> {
        let mut file = match is_plain(&self.path).and_then(|()| File::open(&self.path)) {
            Ok(file) => file,
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(with_known(told(b""), b"", known)),
            Err(error) => return Err(error),
        };
        let meta = file.metadata()?;
        let stamp = (meta.len(), meta.modified()?);
        match &self.read {
            Some((then, told)) if *then == stamp => return Ok(told.clone()),
            _ => {}
        }
        // Not while a line is being written.
        in_time(|| file.try_lock_shared())?;
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes)?;
        let now = with_known(told(&bytes), &bytes, known);
        let meta = file.metadata()?;
        self.read = Some(((meta.len(), meta.modified()?), now.clone()));
        Ok(now)
    }

    /// Appends a line, holding the log against every other program meanwhile. `decide` sees what stands there.
    ///
    /// Where lines are missing that were `known`, the new one is numbered after them: it is not mistaken for one of those.
    pub fn append<E>(
        &mut self,
        at: &str,
        known: Option<&Head>,
        decide: impl FnOnce(&Told) -> Result<Draft, E>,
    ) -> Result<Entry, Unwritten<E>> {
        let failed = Unwritten::Failed;
        let is_new = !self.path.exists();
        let mut options = OpenOptions::new();
        options.read(true).append(true).create(true);
        // Names and reasons are for whoever keeps the folder.
        #[cfg(unix)]
        std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
        let mut file = is_plain(&self.path).and_then(|()| options.open(&self.path)).map_err(failed)?;
        in_time(|| file.try_lock()).map_err(failed)?;
        let mut bytes = Vec::new();
        file.rewind().and_then(|()| file.read_to_end(&mut bytes)).map_err(failed)?;
        let told = told(&bytes);
        let draft = decide(&told).map_err(Unwritten::Refused)?;
        let last = physical_lines(&bytes).last().map(digest);
        let previous = last.unwrap_or_else(|| NONE_BEFORE.into());
        let number = told.next.max(known.map_or(0, |known| known.lines.saturating_add(1)));
        let entry = Entry { version: VERSION, number, previous, at: at.to_string(), draft };
        let text = serde_json::to_string(&entry).map_err(|e| failed(e.into()))?;
        // A torn line is ended first: what follows it stays readable.
        let begin = if bytes.is_empty() || bytes.ends_with(b"\n") { "" } else { "\n" };
        let written = file.write_all(format!("{begin}{text}\n").as_bytes()).and_then(|()| file.sync_all());
        if let Err(error) = written {
            // Half a line is worse than none; where even this fails, it is a torn line.
            let _ = file.set_len(bytes.len() as u64);
            return Err(failed(error));
        }
        if is_new {
            sync_folder(&self.path);
        }
        self.read = None;
        Ok(entry)
    }
}

/// `Err` for a link, a pipe or a folder in the log's place: what is written there would go elsewhere, or wait for ever.
fn is_plain(path: &Path) -> io::Result<()> {
    match fs::symlink_metadata(path) {
        Ok(meta) if !meta.is_file() => Err(io::Error::other("it is a link, or no plain file")),
        _ => Ok(()),
    }
}

/// Takes a lock that another program may hold for a line's length; who holds it longer must not stop the desk.
fn in_time(lock: impl Fn() -> Result<(), TryLockError>) -> io::Result<()> {
    const PAUSE: Duration = Duration::from_millis(10);
    // Some five seconds.
    for _ in 0..500 {
        match lock() {
            Ok(()) => return Ok(()),
            Err(TryLockError::Error(error)) => return Err(error),
            Err(TryLockError::WouldBlock) => std::thread::sleep(PAUSE),
        }
    }
    Err(io::Error::other("another program holds it"))
}

/// A new file's name must survive a power cut as well.
fn sync_folder(path: &Path) {
    if let Some(folder) = path.parent().and_then(|folder| File::open(folder).ok()) {
        // Where folders cannot be synced, the system does it by itself.
        let _ = folder.sync_all();
    }
}

impl Told {
    /// Judgements that come from elsewhere than a log, in the order in which they were made: whoever keeps them vouches for them.
    pub fn of(entries: Vec<Entry>) -> Told {
        let next = entries.len() as u64 + 1;
        let lines = entries.into_iter().map(|entry| Line { entry, doubtful: false }).collect();
        Told { lines, next, ..Told::default() }
    }

    /// What stands: of each session and item the last judgement that counts.
    pub fn counting(&self) -> impl Iterator<Item = &Entry> {
        self.lines.iter().filter(|line| !line.doubtful).map(|line| &line.entry)
    }

    /// The last entry of a session's item, or of its grade, that counts: its number is 0 where there is none.
    pub fn last_of(&self, session: &str, item: Option<usize>) -> Option<&Entry> {
        self.counting().filter(|entry| entry.draft.is_of(session, item)).last()
    }
}

/// Lines as they stand, whole or torn.
fn physical_lines(bytes: &[u8]) -> impl Iterator<Item = &[u8]> {
    bytes.split(|b| *b == b'\n').filter(|line| !line.is_empty())
}

fn digest(line: &[u8]) -> String {
    hex(&Sha256::digest(line))
}

/// Reads a log and follows its chain.
fn told(bytes: &[u8]) -> Told {
    let mut told = Told::default();
    let is_open = !bytes.is_empty() && !bytes.ends_with(b"\n");
    let lines: Vec<&[u8]> = physical_lines(bytes).collect();
    let whole = lines.len() - usize::from(is_open);
    let mut before = NONE_BEFORE.to_string();
    // The number that comes next, and lines since the last number that nobody could read.
    let (mut next, mut unread) = (1u64, 0u64);
    for (index, line) in lines.iter().enumerate() {
        let own = digest(line);
        let Ok(entry) = serde_json::from_slice::<Entry>(line) else {
            unread += 1;
            // Whether it was torn or changed is known by the line that follows it.
            told.troubles.push(Trouble::Torn { line: next });
            (before, next) = (own, next + 1);
            continue;
        };
        let number = entry.number;
        let mut doubtful = false;
        // No log has so many lines: a number without a next one is nobody's.
        let has_next = number < u64::MAX;
        if number < next || !has_next {
            told.troubles.push(Trouble::Misplaced { line: number });
            doubtful = true;
        } else if number > next {
            told.troubles.push(Trouble::Removed { before: number });
        } else if entry.previous != before {
            told.distrust_before(number, unread);
            doubtful = number == 1;
        }
        told.lines.push(Line { entry, doubtful });
        if has_next && (!doubtful || number >= next) {
            (next, unread) = (number + 1, 0);
        }
        before = own;
        if index < whole {
            told.head = Head { lines: next - 1, sha256: before.clone() };
        }
    }
    if unread > 0 && !is_open {
        // It was ended, and still says nothing.
        told.troubles.retain(|t| *t != Trouble::Torn { line: next - 1 });
        told.troubles.push(Trouble::Changed { line: next - 1 });
    }
    told.next = next;
    told
}

impl Told {
    /// The line before one does not have the digest that this one names.
    fn distrust_before(&mut self, number: u64, unread: u64) {
        let before = number.saturating_sub(1).max(1);
        if unread > 0 {
            // What could not be read is not merely torn.
            self.troubles.retain(|t| *t != Trouble::Torn { line: before });
        } else if let Some(line) = self.lines.last_mut() {
            line.doubtful = true;
        }
        self.troubles.push(Trouble::Changed { line: before });
    }
}

/// Compares with how far the log was known to go.
fn with_known(mut told: Told, bytes: &[u8], known: Option<&Head>) -> Told {
    let Some(known) = known.filter(|known| known.lines > 0) else { return told };
    if told.head.lines < known.lines {
        told.troubles.push(Trouble::Shortened { lines: told.head.lines, before: known.lines });
        return told;
    }
    // The line that was last then, wherever it stands now.
    if physical_lines(bytes).any(|line| digest(line) == known.sha256) {
        return told;
    }
    let trouble = Trouble::Changed { line: known.lines };
    if !told.troubles.contains(&trouble) {
        told.troubles.push(trouble);
    }
    for line in told.lines.iter_mut().filter(|line| line.entry.number == known.lines) {
        line.doubtful = true;
    }
    told
}

#[cfg(test)]
mod tests {
    use super::*;

    fn draft(item: Option<usize>, points: Option<f64>) -> Draft {
        let item = item.map(|index| ItemRef { index, metric: "dice".into(), title: "Overlap".into() });
        Draft {
            session: "2ed6657d-e927-568b-95e1-2665a8aea6a2".into(),
            recording: String::new(),
            item,
            machine: Judged { points: 25.0, passed: None },
            examiner: points.map(|points| Judged { points, passed: None }),
            reason: "the wall is =sound\n<b>here</b>".into(),
            name: "Dr. Öz".into(),
        }
    }

    fn written(folder: &Path, points: f64) -> Entry {
        Log::of(folder).append("2026-11-22T09:00:00Z", None, |_| Ok::<_, ()>(draft(Some(0), Some(points)))).unwrap()
    }

    fn folder(name: &str) -> PathBuf {
        let folder = std::env::temp_dir().join(format!("typodont-overrides-{name}-{}", std::process::id()));
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(&folder).unwrap();
        folder
    }

    /// Four lines, changed somehow; what is told of them, and the points that count.
    fn after(change: impl Fn(Vec<String>) -> String) -> (Vec<Trouble>, Vec<f64>) {
        let folder = folder("after");
        for points in [1.0, 2.0, 3.0, 4.0] {
            written(&folder, points);
        }
        let path = folder.join(FILE_NAME);
        let text = fs::read_to_string(&path).unwrap();
        let known = told(text.as_bytes()).head;
        let changed = change(text.lines().map(|l| format!("{l}\n")).collect());
        fs::write(&path, &changed).unwrap();
        let told = Log::of(&folder).told(Some(&known)).unwrap();
        let points = told.counting().map(|e| e.draft.examiner.unwrap().points).collect();
        fs::remove_dir_all(&folder).unwrap();
        (told.troubles, points)
    }

    #[test]
    fn whoever_changes_the_log_is_found_out() {
        // Aim: every way to falsify a line shows, and what is doubtful does not count. Method: four lines, one hand at them.
        assert_eq!(after(|lines| lines.concat()), (vec![], vec![1.0, 2.0, 3.0, 4.0]));
        let edited = |line: &str| line.replace("\"points\":2.0", "\"points\":9.0");
        let check = |change: &dyn Fn(Vec<String>) -> String, trouble: Trouble, points: &[f64]| {
            assert_eq!(after(change), (vec![trouble], points.to_vec()));
        };
        check(&|l| l[0].clone() + &edited(&l[1]) + &l[2] + &l[3], Trouble::Changed { line: 2 }, &[1.0, 3.0, 4.0]);
        check(&|l| l[0].clone() + &l[2] + &l[3], Trouble::Removed { before: 3 }, &[1.0, 3.0, 4.0]);
        check(&|l| l[1..].concat(), Trouble::Removed { before: 2 }, &[2.0, 3.0, 4.0]);
        check(&|l| l.concat() + &l[1], Trouble::Misplaced { line: 2 }, &[1.0, 2.0, 3.0, 4.0]);
        check(&|l| l[..3].concat(), Trouble::Shortened { lines: 3, before: 4 }, &[1.0, 2.0, 3.0]);
        check(&|_| String::new(), Trouble::Shortened { lines: 0, before: 4 }, &[]);
        // The last line has none after it: only what this program remembers gives it away.
        let last = |l: Vec<String>| l[..3].concat() + &l[3].replace("\"points\":4.0", "\"points\":9.0");
        check(&last, Trouble::Changed { line: 4 }, &[1.0, 2.0, 3.0]);
        // Garbage within a line is no torn line.
        check(&|l| l[0].clone() + "rubbish\n" + &l[2] + &l[3], Trouble::Changed { line: 2 }, &[1.0, 3.0, 4.0]);
    }

    #[test]
    fn a_torn_line_is_survived() {
        // Aim: power fails within a line; what stood before holds and what comes after is chained. Method: cut the last line
        // everywhere it can be cut.
        let folder = folder("torn");
        written(&folder, 1.0);
        written(&folder, 2.0);
        let path = folder.join(FILE_NAME);
        let whole = fs::read(&path).unwrap();
        let first = whole.iter().position(|b| *b == b'\n').unwrap() + 1;
        for cut in (first + 1..whole.len() - 1).step_by(23) {
            fs::write(&path, &whole[..cut]).unwrap();
            let mut log = Log::of(&folder);
            let now = log.told(None).unwrap();
            assert_eq!((now.troubles, now.lines.len()), (vec![Trouble::Torn { line: 2 }], 1), "cut at {cut}");
            assert_eq!(written(&folder, 3.0).number, 3);
            assert_eq!(written(&folder, 4.0).number, 4);
            let now = log.told(None).unwrap();
            assert_eq!((now.troubles, now.lines.len()), (vec![Trouble::Torn { line: 2 }], 3), "cut at {cut}");
        }
        // Only its end is missing: the line is whole.
        fs::write(&path, &whole[..whole.len() - 1]).unwrap();
        assert_eq!(written(&folder, 3.0).number, 3);
        let now = Log::of(&folder).told(None).unwrap();
        assert_eq!((now.troubles, now.lines.len()), (vec![], 3));
        fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn many_may_write_at_once() {
        let folder = folder("many");
        std::thread::scope(|scope| {
            for _ in 0..8 {
                scope.spawn(|| (0..20).for_each(|n| drop(written(&folder, f64::from(n)))));
            }
        });
        let now = Log::of(&folder).told(None).unwrap();
        assert_eq!((now.troubles, now.lines.len(), now.head.lines), (vec![], 160, 160));
        fs::remove_dir_all(&folder).unwrap();
    }
}
