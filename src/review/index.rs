//! What is known of every bundle, in SQLite: a cache beside them, which may be deleted at any time.
//!
//! A bundle is read again when its `session.json` has another size or time. What a person wrote reaches SQLite as bound values
//! only.

use super::bundle;
use super::codes::Codes;
use super::overrides::{Head, Told, Trouble};
use super::query::{Outcome, Query, Sort, folded};
use super::standing::standing;
use crate::handover::session_id;
use crate::report::cohort::find;
use crate::report::{GradeFile, SessionFile};
use crate::scenario::hex;
use rusqlite::types::Value;
use rusqlite::{Connection, OptionalExtension, Row, params, params_from_iter};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, UNIX_EPOCH};

pub const FILE_NAME: &str = "review.sqlite";

/// Of the tables below. A cache of another version is made anew.
const VERSION: i64 = 2;

/// For how long another program may hold the cache.
const BUSY: Duration = Duration::from_secs(5);

const TABLES: &str = "
CREATE TABLE session (
  path TEXT PRIMARY KEY, size INTEGER NOT NULL, modified INTEGER NOT NULL, problem TEXT,
  id TEXT, exercise TEXT, title TEXT, participant TEXT, code TEXT, folder TEXT, began TEXT, recording TEXT, searched TEXT, called TEXT,
  grade TEXT, points REAL, max_points REAL, pass_points REAL, passed INTEGER, content TEXT,
  twin TEXT, rival TEXT
) STRICT;
CREATE INDEX by_id ON session (id, path);
CREATE TABLE judged (id TEXT PRIMARY KEY, points REAL NOT NULL, passed INTEGER NOT NULL, overrides INTEGER NOT NULL) STRICT;
CREATE TABLE known (name TEXT PRIMARY KEY, value TEXT NOT NULL) STRICT;
";

/// Sessions that can be listed, each with what examiners made of it.
const LISTED: &str = "
FROM session LEFT JOIN judged ON judged.id = session.id
WHERE session.problem IS NULL AND session.twin IS NULL AND session.rival IS NULL";

const COLUMNS: &str = "session.id, session.path, session.exercise, session.title, session.participant, session.code,
  session.began, session.recording, judged.points, judged.passed, coalesce(judged.overrides, 0), session.grade";

/// A session in the list.
#[derive(Clone, Debug, PartialEq)]
pub struct Listed {
    pub id: String,
    /// Of its bundle, from the folder on.
    pub path: PathBuf,
    pub exercise: String,
    pub title: String,
    pub participant: String,
    /// Empty where the folder has no secret.
    pub code: String,
    pub began: String,
    pub recording: String,
    pub grade: Option<Graded>,
}

/// The machine's grade, and what it comes to with an examiner's judgements.
#[derive(Clone, Debug, PartialEq)]
pub struct Graded {
    pub machine: GradeFile,
    pub points: f64,
    pub passed: bool,
    pub overrides: usize,
}

/// What a list can be narrowed to.
#[derive(Clone, Debug, Default)]
pub struct Choices {
    /// Id and title.
    pub exercises: Vec<(String, String)>,
    pub folders: Vec<String>,
}

/// A file's size, and the time of its last change in ns since 1970.
type Stamp = (i64, i64);

/// A bundle that is new or changed.
struct Fresh {
    path: String,
    stamp: Stamp,
    /// `Err` says why it is no session.
    read: Result<SessionFile, String>,
}

pub struct Index {
    path: PathBuf,
    connection: Connection,
    codes: Option<Codes>,
    /// The cache lies in memory, because it cannot lie in the folder; why.
    pub homeless: Option<String>,
    /// The log's state when `judged` was filled.
    judged: Option<(Head, Vec<Trouble>)>,
}

impl Index {
    /// Opens the cache; a broken one, or one of another version or secret, is made anew.
    pub fn open(folder: &Path, codes: Option<Codes>) -> Result<Index, String> {
        let path = folder.join(FILE_NAME);
        let secret = codes.as_ref().map(Codes::fingerprint).unwrap_or_default();
        let (connection, homeless) = match on_disk(&path, &secret) {
            Ok(connection) => (connection, None),
            Err(first) => match remove(&path).and_then(|()| on_disk(&path, &secret).map_err(|e| e.to_string())) {
                Ok(connection) => (connection, None),
                Err(_) => {
                    let made = Connection::open_in_memory().and_then(|c| tables(c, &secret));
                    (made.map_err(|e| format!("{FILE_NAME}: unusable-cache: {e}"))?, Some(first.to_string()))
                }
            },
        };
        Ok(Index { path, connection, codes, homeless, judged: None })
    }

    /// Looks at the folder again, and at what examiners judged.
    pub fn refresh(&mut self, folder: &Path, told: &Told) -> Result<(), String> {
        let done = self.look_again(folder).and_then(|changed| self.judge(told, changed));
        done.or_else(|_| {
            // Deleted, moved or broken beneath us: it is a cache, and is made anew.
            let codes = Codes::of(folder)?.or(self.codes.take());
            *self = Index::open(folder, codes)?;
            self.look_again(folder)
                .and_then(|_| self.judge(told, true))
                .map_err(|e| format!("{FILE_NAME}: unusable-cache: {e}"))
        })
    }

    /// Reads what is new or changed and forgets what is gone; whether there was any.
    fn look_again(&mut self, folder: &Path) -> rusqlite::Result<bool> {
        if self.homeless.is_none() && !self.path.exists() {
            return Err(rusqlite::Error::InvalidQuery);
        }
        // Another desk began to mark anonymously: its codes are not ours.
        let sql = "SELECT value FROM known WHERE name = 'secret'";
        let secret: String = self.connection.query_row(sql, [], |row| row.get(0))?;
        if secret != self.codes.as_ref().map(Codes::fingerprint).unwrap_or_default() {
            return Err(rusqlite::Error::InvalidQuery);
        }
        let found = find(folder);
        let mut known: BTreeMap<String, Stamp> = BTreeMap::new();
        {
            let mut all = self.connection.prepare("SELECT path, size, modified FROM session")?;
            let mut rows = all.query([])?;
            while let Some(row) = rows.next()? {
                known.insert(row.get(0)?, (row.get(1)?, row.get(2)?));
            }
        }
        let mut fresh: Vec<Fresh> = Vec::new();
        for file in &found.files {
            let bundle = file.parent().and_then(|b| b.strip_prefix(folder).ok()).unwrap_or(Path::new(""));
            let (name, is_text) = (bundle.to_string_lossy().into_owned(), bundle.to_str().is_some());
            let stamp = stamp(file);
            if known.remove(&name) != Some(stamp) {
                let read = match is_text {
                    true => bundle::session(folder, bundle),
                    false => Err("its folder's name is not UTF-8".into()),
                };
                fresh.push(Fresh { path: name, stamp, read });
            }
        }
        for (path, why) in found.left_out {
            let name = path.strip_prefix(folder).unwrap_or(&path).to_string_lossy().into_owned();
            if known.remove(&name) != Some((-1, 0)) {
                fresh.push(Fresh { path: name, stamp: (-1, 0), read: Err(why) });
            }
        }
        if fresh.is_empty() && known.is_empty() {
            return Ok(false);
        }
        let codes = self.codes.clone();
        let change = self.connection.transaction()?;
        for gone in known.keys() {
            change.prepare("DELETE FROM session WHERE path = ?1")?.execute([gone])?;
        }
        for Fresh { path, stamp, read } in fresh {
            match read {
                Ok(session) => enter(&change, &path, stamp, &session, codes.as_ref())?,
                Err(why) => {
                    let sql = "INSERT OR REPLACE INTO session (path, size, modified, problem) VALUES (?1, ?2, ?3, ?4)";
                    change.prepare(sql)?.execute(params![path, stamp.0, stamp.1, why])?;
                }
            }
        }
        // A copy beside its original is no second attempt; where they differ one of them was changed, and none is believed.
        change.execute(
            "UPDATE session SET
             twin = (SELECT min(other.path) FROM session AS other
               WHERE other.id = session.id AND other.content = session.content AND other.path < session.path),
             rival = (SELECT min(other.path) FROM session AS other
               WHERE other.id = session.id AND other.content <> session.content)",
            [],
        )?;
        change.commit()?;
        Ok(true)
    }

    /// Fills in what examiners made of the grades.
    fn judge(&mut self, told: &Told, changed: bool) -> rusqlite::Result<()> {
        let state = (told.head.clone(), told.troubles.clone());
        if !changed && self.judged.as_ref() == Some(&state) {
            return Ok(());
        }
        let mut sessions: Vec<&str> = told.counting().map(|entry| entry.draft.session.as_str()).collect();
        sessions.sort_unstable();
        sessions.dedup();
        let change = self.connection.transaction()?;
        change.execute("DELETE FROM judged", [])?;
        for id in sessions {
            let sql = "SELECT grade FROM session WHERE id = ?1 AND problem IS NULL AND twin IS NULL AND rival IS NULL";
            let text: Option<Option<String>> = change.prepare(sql)?.query_row([id], |row| row.get(0)).optional()?;
            let Some(grade) = text.flatten().and_then(|text| serde_json::from_str::<GradeFile>(&text).ok()) else {
                continue;
            };
            let now = standing(&grade, id, told);
            if now.overrides() > 0 {
                let sql = "INSERT INTO judged (id, points, passed, overrides) VALUES (?1, ?2, ?3, ?4)";
                change.prepare(sql)?.execute(params![id, now.points, now.passed, now.overrides() as i64])?;
            }
        }
        change.commit()?;
        self.judged = Some(state);
        Ok(())
    }

    /// A page of the list, and how many sessions all its pages have. `by_code`: people are known by their codes alone.
    pub fn page(&self, query: &Query, by_code: bool) -> rusqlite::Result<(Vec<Listed>, usize)> {
        let (narrowed, mut bound) = narrowed(query, by_code);
        let sql = format!("SELECT count(*) {LISTED} {narrowed}");
        let count: i64 = self.connection.prepare(&sql)?.query_row(params_from_iter(&bound), |row| row.get(0))?;
        let first = (query.page - 1).saturating_mul(query.length);
        bound.extend([Value::Integer(query.length as i64), Value::Integer(first as i64)]);
        let order = order(query, by_code);
        let sql = format!("SELECT {COLUMNS} {LISTED} {narrowed} ORDER BY {order} LIMIT ? OFFSET ?");
        let mut select = self.connection.prepare(&sql)?;
        let rows = select.query_map(params_from_iter(&bound), listed)?;
        Ok((rows.collect::<rusqlite::Result<_>>()?, count as usize))
    }

    pub fn session(&self, id: &str) -> rusqlite::Result<Option<Listed>> {
        let sql = format!("SELECT {COLUMNS} {LISTED} AND session.id = ?1");
        self.connection.prepare(&sql)?.query_row([id], listed).optional()
    }

    pub fn choices(&self) -> rusqlite::Result<Choices> {
        let sql = format!("SELECT session.exercise, max(session.title) {LISTED} GROUP BY session.exercise ORDER BY 1");
        let mut select = self.connection.prepare(&sql)?;
        let exercises = select.query_map([], |row| Ok((row.get(0)?, row.get(1)?)))?;
        let sql = format!("SELECT DISTINCT session.folder {LISTED} ORDER BY 1");
        let mut select = self.connection.prepare(&sql)?;
        let folders = select.query_map([], |row| row.get(0))?;
        Ok(Choices { exercises: exercises.collect::<Result<_, _>>()?, folders: folders.collect::<Result<_, _>>()? })
    }

    /// Path and reason of what is no session, or one that is listed already.
    pub fn left_out(&self) -> rusqlite::Result<Vec<(String, String)>> {
        let sql = "SELECT path, coalesce(problem,
                     'it has another result than ' || rival || ', which is the same session: typodont verify says which holds',
                     'the same session as ' || twin)
                   FROM session WHERE problem IS NOT NULL OR twin IS NOT NULL OR rival IS NOT NULL ORDER BY path";
        let mut select = self.connection.prepare(sql)?;
        let rows = select.query_map([], |row| Ok((row.get(0)?, row.get(1)?)))?;
        rows.collect()
    }

    /// How far the log of judgements was known to go.
    pub fn known_head(&self) -> Option<Head> {
        let sql = "SELECT value FROM known WHERE name = 'head'";
        let text: String = self.connection.prepare(sql).ok()?.query_row([], |row| row.get(0)).ok()?;
        let (lines, sha256) = text.split_once(' ')?;
        Some(Head { lines: lines.parse().ok()?, sha256: sha256.to_string() })
    }

    /// Remembers it. A cache that cannot be written forgets.
    pub fn know_head(&self, head: &Head) {
        let sql = "INSERT OR REPLACE INTO known (name, value) VALUES ('head', ?1)";
        let text = format!("{} {}", head.lines, head.sha256);
        let _ = self.connection.execute(sql, [text]);
    }
}

fn on_disk(path: &Path, secret: &str) -> rusqlite::Result<Connection> {
    let connection = Connection::open(path)?;
    connection.busy_timeout(BUSY)?;
    // A cache need not survive a power cut.
    connection.pragma_update(None, "synchronous", "OFF")?;
    // Nothing that stands in a file runs.
    connection.pragma_update(None, "trusted_schema", "OFF")?;
    tables(connection, secret)
}

/// `Err` where the tables are not ours and not new.
fn tables(mut connection: Connection, secret: &str) -> rusqlite::Result<Connection> {
    // Two programs that open a new cache at once make its tables once.
    let change = connection.transaction_with_behavior(rusqlite::TransactionBehavior::Immediate)?;
    let version: i64 = change.query_row("PRAGMA user_version", [], |row| row.get(0))?;
    if version == 0 {
        change.execute_batch(TABLES)?;
        change.pragma_update(None, "user_version", VERSION)?;
        change.execute("INSERT INTO known (name, value) VALUES ('secret', ?1)", [secret])?;
    }
    if !matches!(version, 0 | VERSION) {
        return Err(rusqlite::Error::InvalidQuery);
    }
    // What another program may have written there meanwhile is not believed, and codes may be of another secret: every desk
    // reads every bundle once.
    change.execute("DELETE FROM session", [])?;
    change.execute("UPDATE known SET value = ?1 WHERE name = 'secret'", [secret])?;
    change.commit()?;
    Ok(connection)
}

/// Takes the cache away, with the journal of a change that was never finished: the next cache would be mended by it.
fn remove(path: &Path) -> Result<(), String> {
    for path in [path.with_extension("sqlite-journal"), path.to_path_buf()] {
        match fs::remove_file(path) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => return Err(error.to_string()),
            _ => {}
        }
    }
    Ok(())
}

fn stamp(file: &Path) -> Stamp {
    let Ok(meta) = fs::metadata(file) else { return (-1, -1) };
    let since = meta.modified().ok().and_then(|t| t.duration_since(UNIX_EPOCH).ok()).unwrap_or_default();
    (meta.len() as i64, since.as_nanos() as i64)
}

fn enter(
    change: &Connection,
    path: &str,
    stamp: Stamp,
    session: &SessionFile,
    codes: Option<&Codes>,
) -> rusqlite::Result<()> {
    let id = session_id(session);
    let code = codes.map_or_else(String::new, |codes| codes.of_participant(&session.participant, &id));
    let folder = path.rsplit_once(['/', '\\']).map_or("", |(folder, _)| folder);
    let title = if session.scenario.title.is_empty() { &session.scenario.id } else { &session.scenario.title };
    let grade = session.grade.as_ref();
    let sql =
        "INSERT OR REPLACE INTO session (path, size, modified, id, exercise, title, participant, code, folder, began,
        recording, searched, called, grade, points, max_points, pass_points, passed, content)
        VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12, ?13, ?14, ?15, ?16, ?17, ?18, ?19)";
    change.prepare(sql)?.execute(params![
        path,
        stamp.0,
        stamp.1,
        id,
        session.scenario.id,
        title,
        session.participant,
        code,
        folder,
        session.started,
        session.digests.get(crate::record::FILE_NAME).map_or("", String::as_str),
        folded(&format!("{title}\n{id}\n{code}")),
        folded(&session.participant),
        grade.map(|g| serde_json::to_string(g).unwrap_or_default()),
        grade.map(|g| g.points),
        grade.map(|g| g.max_points),
        grade.map(|g| g.pass_points),
        grade.map(|g| g.passed),
        hex(&Sha256::digest(session.text())),
    ])?;
    Ok(())
}

/// Conditions beyond [`LISTED`], with what they are bound to.
fn narrowed(query: &Query, by_code: bool) -> (String, Vec<Value>) {
    let (mut conditions, mut bound) = (String::new(), Vec::new());
    let mut only = |condition: &str, values: Vec<Value>| {
        conditions += " AND ";
        conditions += condition;
        bound.extend(values);
    };
    if !query.exercise.is_empty() {
        only("session.exercise = ?", vec![query.exercise.clone().into()]);
    }
    if let Some(folder) = query.folder.as_ref().filter(|_| !by_code) {
        only("session.folder = ?", vec![folder.clone().into()]);
    }
    if !query.text.is_empty() {
        let text = Value::from(folded(&query.text));
        match by_code {
            true => only("instr(session.searched, ?) > 0", vec![text]),
            false => only("(instr(session.searched, ?) > 0 OR instr(session.called, ?) > 0)", vec![text.clone(), text]),
        }
    }
    match query.result {
        Some(Outcome::Passed) => only("coalesce(judged.passed, session.passed) = 1", vec![]),
        Some(Outcome::Failed) => only("coalesce(judged.passed, session.passed) = 0", vec![]),
        Some(Outcome::Ungraded) => only("session.passed IS NULL", vec![]),
        None => {}
    }
    match query.overridden {
        Some(true) => only("judged.id IS NOT NULL", vec![]),
        Some(false) => only("judged.id IS NULL", vec![]),
        None => {}
    }
    (conditions, bound)
}

/// Columns by their names here; nothing that was asked stands in it.
fn order(query: &Query, by_code: bool) -> String {
    let way = if query.down { "DESC" } else { "ASC" };
    let who = if by_code { "session.code" } else { "session.participant" };
    let column = match query.sort {
        Sort::Exercise => "session.exercise",
        Sort::Participant => who,
        // The hour tells who it was.
        Sort::Began if by_code => "substr(session.began, 1, 10)",
        Sort::Began => "session.began",
        Sort::Machine => "session.points",
        Sort::MachineResult => "session.passed",
        Sort::Examiner => "judged.points",
        Sort::Result => "coalesce(judged.passed, session.passed)",
        Sort::Overrides => "coalesce(judged.overrides, 0)",
    };
    let last = if by_code { "session.id" } else { "session.began, session.path" };
    format!("{column} IS NULL, {column} {way}, session.exercise, {who}, {last}")
}

fn listed(row: &Row) -> rusqlite::Result<Listed> {
    let machine: Option<String> = row.get(11)?;
    let machine = machine.and_then(|text| serde_json::from_str::<GradeFile>(&text).ok());
    let (points, passed): (Option<f64>, Option<bool>) = (row.get(8)?, row.get(9)?);
    let overrides: i64 = row.get(10)?;
    let grade = machine.map(|machine| Graded {
        points: points.unwrap_or(machine.points),
        passed: passed.unwrap_or(machine.passed),
        overrides: overrides as usize,
        machine,
    });
    Ok(Listed {
        id: row.get(0)?,
        path: PathBuf::from(row.get::<_, String>(1)?),
        exercise: row.get(2)?,
        title: row.get(3)?,
        participant: row.get(4)?,
        code: row.get(5)?,
        began: row.get(6)?,
        recording: row.get(7)?,
        grade,
    })
}
