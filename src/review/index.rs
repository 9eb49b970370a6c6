//! Index of all bundles in SQLite: a cache in the folder, which may be deleted at any time.
//!
//! A bundle is read again when the size or modification time of its `session.json` changes. User-written text reaches
//! SQLite only as bound values.

use super::bundle;
use super::chained_log::{IntegrityIssue, LogHead};
use super::effective_grade::effective_grade;
use super::overrides::OverrideSnapshot;
use super::pseudonyms::Pseudonymizer;
use super::query::{Query, ResultFilter, SortColumn};
use rusqlite::types::Value;
use rusqlite::{Connection, OptionalExtension, Row, params, params_from_iter};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, UNIX_EPOCH};
use typodont_exercise::scenario::hex;
use typodont_integrations::session_id;
use typodont_report::cohort::{FoundBundles, find_bundles};
use typodont_report::name_folding::fold_case;
use typodont_report::{GradeFile, SessionFile};

pub const FILE_NAME: &str = "review.sqlite";

/// Names under which the states of the logs are remembered.
pub const OVERRIDES_HEAD: &str = "head";
pub const RATINGS_HEAD: &str = "ratings_head";

/// Version of the tables below. A cache of another version is rebuilt.
const VERSION: i64 = 2;

/// Maximum wait for another program's lock on the cache.
const BUSY_TIMEOUT: Duration = Duration::from_secs(5);

const SCHEMA: &str = "
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

/// Sessions that can be listed, joined with their effective grades.
const LISTED_SESSIONS: &str = "
FROM session LEFT JOIN judged ON judged.id = session.id
WHERE session.problem IS NULL AND session.twin IS NULL AND session.rival IS NULL";

const COLUMNS: &str = "session.id, session.path, session.exercise, session.title, session.participant, session.code,
  session.began, session.recording, judged.points, judged.passed, coalesce(judged.overrides, 0), session.grade";

/// Session as listed.
#[derive(Clone, Debug, PartialEq)]
pub struct IndexedSession {
    pub id: String,
    /// Path of the bundle, relative to the folder.
    pub path: PathBuf,
    pub exercise: String,
    pub title: String,
    pub participant: String,
    /// Pseudonymous code of the participant; empty if the folder has no secret.
    pub code: String,
    pub began: String,
    pub recording: String,
    pub grade: Option<IndexedGrade>,
}

/// The scorer's grade (`machine`) and the effective points and result after overrides.
#[derive(Clone, Debug, PartialEq)]
pub struct IndexedGrade {
    pub machine: GradeFile,
    pub points: f64,
    pub passed: bool,
    pub overrides: usize,
}

/// Values offered by the list's filters.
#[derive(Clone, Debug, Default)]
pub struct FilterOptions {
    /// Id and title of each exercise.
    pub exercises: Vec<(String, String)>,
    pub folders: Vec<String>,
}

/// Size of a file, bytes, and its modification time, ns since 1970.
type BundleStamp = (i64, i64);

/// Stamp of a folder that cannot be read.
const UNREADABLE_FOLDER: BundleStamp = (-1, 0);

/// New or changed bundle.
struct ChangedBundle {
    path: String,
    stamp: BundleStamp,
    /// `Err` contains the reason for which the bundle is not a session.
    session: Result<SessionFile, String>,
}

/// Difference between the bundles of a folder and those of the cache.
struct BundleChanges {
    /// New and changed bundles, in the order of paths; then folders that cannot be read.
    changed: Vec<ChangedBundle>,
    /// Paths of the bundles that the folder no longer contains, in order.
    deleted: Vec<String>,
}

/// Index of a folder's sessions.
pub struct SessionIndex {
    path: PathBuf,
    connection: Connection,
    pseudonymizer: Option<Pseudonymizer>,
    /// Reason for which the index is kept in memory: the cache file in the folder cannot be used.
    pub fallback_reason: Option<String>,
    /// State of the log when the table `judged` was filled.
    graded_log: Option<(LogHead, Vec<IntegrityIssue>)>,
}

impl SessionIndex {
    /// Opens the cache. A cache that is damaged or of another version is rebuilt; where no file can be written, the
    /// index is kept in memory.
    ///
    /// # Errors
    ///
    /// Returns a message when not even a database in memory can be created.
    pub fn open(folder: &Path, pseudonymizer: Option<Pseudonymizer>) -> Result<SessionIndex, String> {
        let path = folder.join(FILE_NAME);
        let secret = pseudonymizer.as_ref().map(Pseudonymizer::fingerprint).unwrap_or_default();
        let (connection, fallback_reason) = match open_on_disk(&path, &secret) {
            Ok(connection) => (connection, None),
            Err(first) => {
                match remove_cache_files(&path).and_then(|()| open_on_disk(&path, &secret).map_err(|e| e.to_string())) {
                    Ok(connection) => (connection, None),
                    Err(_) => {
                        let created = Connection::open_in_memory().and_then(|c| prepare_schema(c, &secret));
                        (created.map_err(|e| format!("{FILE_NAME}: unusable-cache: {e}"))?, Some(first.to_string()))
                    }
                }
            }
        };
        Ok(SessionIndex { path, connection, pseudonymizer, fallback_reason, graded_log: None })
    }

    /// Updates the index from the folder and the override log.
    ///
    /// # Errors
    ///
    /// Returns a message when the index cannot be used even after it is rebuilt.
    pub fn refresh(&mut self, folder: &Path, log: &OverrideSnapshot) -> Result<(), String> {
        let done = self.rescan(folder).and_then(|changed| self.update_effective_grades(log, changed));
        done.or_else(|_| {
            // The cache file was deleted, moved or damaged while it was open, so it is rebuilt.
            let pseudonymizer = Pseudonymizer::load(folder)?.or(self.pseudonymizer.take());
            *self = SessionIndex::open(folder, pseudonymizer)?;
            self.rescan(folder)
                .and_then(|_| self.update_effective_grades(log, true))
                .map_err(|e| format!("{FILE_NAME}: unusable-cache: {e}"))
        })
    }

    /// Reads new and changed bundles and removes deleted ones. Returns true if anything changed.
    fn rescan(&mut self, folder: &Path) -> rusqlite::Result<bool> {
        self.check_cache()?;
        let found = find_bundles(folder);
        let changes = bundle_changes(folder, found, self.known_stamps()?);
        if changes.changed.is_empty() && changes.deleted.is_empty() {
            return Ok(false);
        }
        self.write_changes(changes)?;
        Ok(true)
    }

    /// Checks that the cache file still exists and belongs to the present secret.
    ///
    /// # Errors
    ///
    /// Returns the SQLite error, or `InvalidQuery` for a cache that must be rebuilt.
    fn check_cache(&self) -> rusqlite::Result<()> {
        if self.fallback_reason.is_none() && !self.path.exists() {
            return Err(rusqlite::Error::InvalidQuery);
        }
        // Another program has created a secret for anonymous mode since, so the codes in the cache are outdated.
        let sql = "SELECT value FROM known WHERE name = 'secret'";
        let secret: String = self.connection.query_row(sql, [], |row| row.get(0))?;
        if secret != self.pseudonymizer.as_ref().map(Pseudonymizer::fingerprint).unwrap_or_default() {
            return Err(rusqlite::Error::InvalidQuery);
        }
        Ok(())
    }

    /// Returns the stamps of all bundles in the cache, by path relative to the folder.
    fn known_stamps(&self) -> rusqlite::Result<BTreeMap<String, BundleStamp>> {
        let mut known = BTreeMap::new();
        let mut all = self.connection.prepare("SELECT path, size, modified FROM session")?;
        let mut rows = all.query([])?;
        while let Some(row) = rows.next()? {
            known.insert(row.get(0)?, (row.get(1)?, row.get(2)?));
        }
        Ok(known)
    }

    /// Writes the changes of the folder to the cache, in one transaction.
    fn write_changes(&mut self, changes: BundleChanges) -> rusqlite::Result<()> {
        let BundleChanges { changed, deleted } = changes;
        let change = self.connection.transaction()?;
        for path in &deleted {
            change.prepare("DELETE FROM session WHERE path = ?1")?.execute([path])?;
        }
        for ChangedBundle { path, stamp, session: read } in changed {
            match read {
                Ok(session) => insert_session(&change, &path, stamp, &session, self.pseudonymizer.as_ref())?,
                Err(why) => {
                    let sql = "INSERT OR REPLACE INTO session (path, size, modified, problem) VALUES (?1, ?2, ?3, ?4)";
                    change.prepare(sql)?.execute(params![path, stamp.0, stamp.1, why])?;
                }
            }
        }
        // An identical copy of a bundle is not a second attempt. If copies differ, one of them was changed, and none
        // is listed.
        change.execute(
            "UPDATE session SET
             twin = (SELECT min(other.path) FROM session AS other
               WHERE other.id = session.id AND other.content = session.content AND other.path < session.path),
             rival = (SELECT min(other.path) FROM session AS other
               WHERE other.id = session.id AND other.content <> session.content)",
            [],
        )?;
        change.commit()
    }

    /// Recomputes the effective grades of overridden sessions.
    fn update_effective_grades(&mut self, log: &OverrideSnapshot, changed: bool) -> rusqlite::Result<()> {
        let state = (log.head.clone(), log.issues.clone());
        if !changed && self.graded_log.as_ref() == Some(&state) {
            return Ok(());
        }
        let mut sessions: Vec<&str> = log.valid_entries().map(|entry| entry.draft.session.as_str()).collect();
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
            let effective = effective_grade(&grade, id, log);
            if effective.overrides() > 0 {
                let sql = "INSERT INTO judged (id, points, passed, overrides) VALUES (?1, ?2, ?3, ?4)";
                change.prepare(sql)?.execute(params![
                    id,
                    effective.points,
                    effective.passed,
                    effective.overrides() as i64
                ])?;
            }
        }
        change.commit()?;
        self.graded_log = Some(state);
        Ok(())
    }

    /// Returns one page of the list, and the number of sessions on all pages. With `by_code` (anonymous mode),
    /// participants are identified only by their codes. Given `paths`, the list is restricted to these bundles.
    ///
    /// # Errors
    ///
    /// Returns the SQLite error.
    pub fn query_sessions(
        &self,
        query: &Query,
        by_code: bool,
        paths: Option<&[PathBuf]>,
    ) -> rusqlite::Result<(Vec<IndexedSession>, usize)> {
        let (mut narrowed, mut bound) = where_clause(query, by_code);
        if let Some(paths) = paths {
            narrowed += " AND session.path IN (SELECT value FROM json_each(?))";
            // Paths in the index are UTF-8.
            bound.push(Value::Text(serde_json::to_string(paths).unwrap_or_default()));
        }
        let sql = format!("SELECT count(*) {LISTED_SESSIONS} {narrowed}");
        let count: i64 = self.connection.prepare(&sql)?.query_row(params_from_iter(&bound), |row| row.get(0))?;
        let first = (query.page - 1).saturating_mul(query.length);
        bound.extend([Value::Integer(query.length as i64), Value::Integer(first as i64)]);
        let order = order_by(query, by_code);
        let sql = format!("SELECT {COLUMNS} {LISTED_SESSIONS} {narrowed} ORDER BY {order} LIMIT ? OFFSET ?");
        let mut select = self.connection.prepare(&sql)?;
        let rows = select.query_map(params_from_iter(&bound), indexed_session)?;
        Ok((rows.collect::<rusqlite::Result<_>>()?, count as usize))
    }

    /// Returns the session with this id, if it is listed.
    ///
    /// # Errors
    ///
    /// Returns the SQLite error.
    pub fn session(&self, id: &str) -> rusqlite::Result<Option<IndexedSession>> {
        let sql = format!("SELECT {COLUMNS} {LISTED_SESSIONS} AND session.id = ?1");
        self.connection.prepare(&sql)?.query_row([id], indexed_session).optional()
    }

    /// Returns the exercises and folders of the listed sessions.
    ///
    /// # Errors
    ///
    /// Returns the SQLite error.
    pub fn filter_options(&self) -> rusqlite::Result<FilterOptions> {
        let sql = format!(
            "SELECT session.exercise, max(session.title) {LISTED_SESSIONS} GROUP BY session.exercise ORDER BY 1"
        );
        let mut select = self.connection.prepare(&sql)?;
        let exercises = select.query_map([], |row| Ok((row.get(0)?, row.get(1)?)))?;
        let sql = format!("SELECT DISTINCT session.folder {LISTED_SESSIONS} ORDER BY 1");
        let mut select = self.connection.prepare(&sql)?;
        let folders = select.query_map([], |row| row.get(0))?;
        Ok(FilterOptions {
            exercises: exercises.collect::<Result<_, _>>()?,
            folders: folders.collect::<Result<_, _>>()?,
        })
    }

    /// Returns the paths of the listed bundles, relative to the folder.
    ///
    /// # Errors
    ///
    /// Returns the SQLite error.
    pub fn paths(&self) -> rusqlite::Result<Vec<PathBuf>> {
        let mut select = self.connection.prepare(&format!("SELECT session.path {LISTED_SESSIONS}"))?;
        let rows = select.query_map([], |row| Ok(PathBuf::from(row.get::<_, String>(0)?)))?;
        rows.collect()
    }

    /// Returns the other listed sessions with the same recording.
    ///
    /// # Errors
    ///
    /// Returns the SQLite error.
    pub fn same_recording(&self, indexed: &IndexedSession) -> rusqlite::Result<Vec<IndexedSession>> {
        /// More are not named.
        const NAMED_MAX: i64 = 20;
        if indexed.recording.is_empty() {
            return Ok(Vec::new());
        }
        let sql = format!(
            "SELECT {COLUMNS} {LISTED_SESSIONS} AND session.recording = ?1 AND session.id <> ?2
             ORDER BY session.id LIMIT {NAMED_MAX}"
        );
        let mut select = self.connection.prepare(&sql)?;
        let rows = select.query_map([&indexed.recording, &indexed.id], indexed_session)?;
        rows.collect()
    }

    /// Returns path and reason for every file that is not listed: it is not a session, or a copy of one.
    ///
    /// # Errors
    ///
    /// Returns the SQLite error.
    pub fn left_out(&self) -> rusqlite::Result<Vec<(String, String)>> {
        let sql = "SELECT path, coalesce(problem,
                     'its result differs from that of ' || rival ||
                       ', a copy of the same session; typodont verify shows which one is valid',
                     'a copy of ' || twin)
                   FROM session WHERE problem IS NOT NULL OR twin IS NOT NULL OR rival IS NOT NULL ORDER BY path";
        let mut select = self.connection.prepare(sql)?;
        let rows = select.query_map([], |row| Ok((row.get(0)?, row.get(1)?)))?;
        rows.collect()
    }

    /// Returns the last state of a log that this index has remembered under a name.
    pub fn known_head(&self, name: &str) -> Option<LogHead> {
        let sql = "SELECT value FROM known WHERE name = ?1";
        let text: String = self.connection.prepare(sql).ok()?.query_row([name], |row| row.get(0)).ok()?;
        let (lines, sha256) = text.split_once(' ')?;
        Some(LogHead { lines: lines.parse().ok()?, sha256: sha256.to_string() })
    }

    /// Remembers the state of a log under a name. Errors are ignored: a cache that cannot be written does not remember.
    pub fn remember_head(&self, name: &str, head: &LogHead) {
        let sql = "INSERT OR REPLACE INTO known (name, value) VALUES (?1, ?2)";
        let text = format!("{} {}", head.lines, head.sha256);
        let _ = self.connection.execute(sql, [name, &text]);
    }
}

fn open_on_disk(path: &Path, secret: &str) -> rusqlite::Result<Connection> {
    let connection = Connection::open(path)?;
    connection.busy_timeout(BUSY_TIMEOUT)?;
    // The cache need not survive a power cut.
    connection.pragma_update(None, "synchronous", "OFF")?;
    // Functions in the schema of a foreign file must not run.
    connection.pragma_update(None, "trusted_schema", "OFF")?;
    prepare_schema(connection, secret)
}

/// Creates the tables in a new cache and empties an existing one.
///
/// # Errors
///
/// Returns the SQLite error, or `InvalidQuery` for a cache of another version.
fn prepare_schema(mut connection: Connection, secret: &str) -> rusqlite::Result<Connection> {
    // The immediate transaction ensures that two programs opening a new cache create its tables only once.
    let change = connection.transaction_with_behavior(rusqlite::TransactionBehavior::Immediate)?;
    let version: i64 = change.query_row("PRAGMA user_version", [], |row| row.get(0))?;
    if version == 0 {
        change.execute_batch(SCHEMA)?;
        change.pragma_update(None, "user_version", VERSION)?;
        change.execute("INSERT INTO known (name, value) VALUES ('secret', ?1)", [secret])?;
    }
    if !matches!(version, 0 | VERSION) {
        return Err(rusqlite::Error::InvalidQuery);
    }
    // Rows written by other programs are not trusted, and codes may belong to another secret: every program reads
    // every bundle once.
    change.execute("DELETE FROM session", [])?;
    change.execute("UPDATE known SET value = ?1 WHERE name = 'secret'", [secret])?;
    change.commit()?;
    Ok(connection)
}

/// Deletes the cache together with its rollback journal, which SQLite would otherwise apply to the next cache.
fn remove_cache_files(path: &Path) -> Result<(), String> {
    for path in [path.with_extension("sqlite-journal"), path.to_path_buf()] {
        match fs::remove_file(path) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => return Err(error.to_string()),
            _ => {}
        }
    }
    Ok(())
}

/// Compares the bundles found in a folder with the stamps in the cache, and reads those that differ.
fn bundle_changes(folder: &Path, found: FoundBundles, mut known: BTreeMap<String, BundleStamp>) -> BundleChanges {
    let mut changed = Vec::new();
    for file in &found.files {
        let bundle = file.parent().and_then(|b| b.strip_prefix(folder).ok()).unwrap_or(Path::new(""));
        let (name, is_text) = (bundle.to_string_lossy().into_owned(), bundle.to_str().is_some());
        let stamp = bundle_stamp(file);
        if known.remove(&name) != Some(stamp) {
            let read = match is_text {
                true => bundle::read_bundle_session(folder, bundle),
                false => Err("the name of the folder is not UTF-8".into()),
            };
            changed.push(ChangedBundle { path: name, stamp, session: read });
        }
    }
    for (path, why) in found.skipped {
        let name = path.strip_prefix(folder).unwrap_or(&path).to_string_lossy().into_owned();
        if known.remove(&name) != Some(UNREADABLE_FOLDER) {
            changed.push(ChangedBundle { path: name, stamp: UNREADABLE_FOLDER, session: Err(why) });
        }
    }
    BundleChanges { changed, deleted: known.into_keys().collect() }
}

/// Returns the stamp of a file, or (-1, -1) if its metadata cannot be read.
fn bundle_stamp(file: &Path) -> BundleStamp {
    let Ok(meta) = fs::metadata(file) else { return (-1, -1) };
    let since = meta.modified().ok().and_then(|t| t.duration_since(UNIX_EPOCH).ok()).unwrap_or_default();
    (meta.len() as i64, since.as_nanos() as i64)
}

fn insert_session(
    change: &Connection,
    path: &str,
    stamp: BundleStamp,
    session: &SessionFile,
    pseudonymizer: Option<&Pseudonymizer>,
) -> rusqlite::Result<()> {
    let id = session_id(session);
    let code = pseudonymizer.map_or_else(String::new, |codes| codes.code_for(&session.participant, &id));
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
        session.digests.get(typodont_exercise::record::FILE_NAME).map_or("", String::as_str),
        fold_case(&format!("{title}\n{id}\n{code}")),
        fold_case(&session.participant),
        grade.map(|g| serde_json::to_string(g).unwrap_or_default()),
        grade.map(|g| g.points),
        grade.map(|g| g.max_points),
        grade.map(|g| g.pass_points),
        grade.map(|g| g.passed),
        hex(&Sha256::digest(session.to_json())),
    ])?;
    Ok(())
}

/// Builds the conditions of a query in addition to [`LISTED_SESSIONS`], with their bound values.
fn where_clause(query: &Query, by_code: bool) -> (String, Vec<Value>) {
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
        let text = Value::from(fold_case(&query.text));
        match by_code {
            true => only("instr(session.searched, ?) > 0", vec![text]),
            false => only("(instr(session.searched, ?) > 0 OR instr(session.called, ?) > 0)", vec![text.clone(), text]),
        }
    }
    match query.result {
        Some(ResultFilter::Passed) => only("coalesce(judged.passed, session.passed) = 1", vec![]),
        Some(ResultFilter::Failed) => only("coalesce(judged.passed, session.passed) = 0", vec![]),
        Some(ResultFilter::Ungraded) => only("session.passed IS NULL", vec![]),
        None => {}
    }
    match query.overridden {
        Some(true) => only("judged.id IS NOT NULL", vec![]),
        Some(false) => only("judged.id IS NULL", vec![]),
        None => {}
    }
    (conditions, bound)
}

/// Builds the ORDER BY clause from column names defined here; no text of the request is part of it.
fn order_by(query: &Query, by_code: bool) -> String {
    let direction = if query.is_descending { "DESC" } else { "ASC" };
    let who = if by_code { "session.code" } else { "session.participant" };
    let column = match query.sort {
        SortColumn::Exercise => "session.exercise",
        SortColumn::Participant => who,
        // In anonymous mode only the date: the time could identify the participant.
        SortColumn::Began if by_code => "substr(session.began, 1, 10)",
        SortColumn::Began => "session.began",
        SortColumn::Machine => "session.points",
        SortColumn::MachineResult => "session.passed",
        SortColumn::Examiner => "judged.points",
        SortColumn::Result => "coalesce(judged.passed, session.passed)",
        SortColumn::Overrides => "coalesce(judged.overrides, 0)",
    };
    let last = if by_code { "session.id" } else { "session.began, session.path" };
    format!("{column} IS NULL, {column} {direction}, session.exercise, {who}, {last}")
}

fn indexed_session(row: &Row) -> rusqlite::Result<IndexedSession> {
    let machine: Option<String> = row.get(11)?;
    let machine = machine.and_then(|text| serde_json::from_str::<GradeFile>(&text).ok());
    let (points, passed): (Option<f64>, Option<bool>) = (row.get(8)?, row.get(9)?);
    let overrides: i64 = row.get(10)?;
    let grade = machine.map(|machine| IndexedGrade {
        points: points.unwrap_or(machine.points),
        passed: passed.unwrap_or(machine.passed),
        overrides: overrides as usize,
        machine,
    });
    Ok(IndexedSession {
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
