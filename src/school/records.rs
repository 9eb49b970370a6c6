//! Queries that insert sessions and examiners' logs into the database and read them back.

use super::archive::Manifest;
use postgres::error::SqlState;
use postgres::{Client, Error, GenericClient};
use std::collections::BTreeMap;
use std::error::Error as _;
use std::path::{Component, Path};
use typodont_core::tick::TICK_S;
use typodont_integrations::session_id;
use typodont_report::{SessionFile, VerificationStatus};
use typodont_review::{LogEntry, LogSnapshot, LoggedDraft, OverrideSnapshot};

/// Status of a local session in the database.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SyncStatus {
    New,
    Known,
    /// The session or its participant was erased, so the session must not be inserted again.
    Erased,
}

/// Session to be inserted.
pub struct NewSession<'a> {
    pub class: &'a str,
    /// Name of the bundle's folder.
    pub bundle: &'a str,
    pub session: &'a SessionFile,
    /// Exact text of the session's `session.json`.
    pub session_json: &'a str,
    pub manifest: &'a Manifest,
}

/// Result of an insertion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InsertOutcome {
    Inserted,
    /// This station had inserted the session before.
    AlreadyInserted,
    /// Another station had inserted the session before.
    OtherStation,
    Erased,
    UnknownClass,
}

/// Session read from the database.
pub struct StoredSession {
    pub id: String,
    pub class: String,
    pub bundle: String,
    /// Month in which the session started, such as `2026-11`, or `unknown`.
    pub month: String,
    pub session: SessionFile,
    pub manifest: Manifest,
    /// True if a worker's score differs from the station's.
    pub differs: bool,
    /// Relation of `session` to its recording, as far as workers have scored it.
    pub verification: VerificationStatus,
}

/// Selection of sessions.
#[derive(Clone, Debug, Default)]
pub struct SessionFilter {
    pub class: Option<String>,
    /// Selects the results of workers with this scorer version; `None` selects the stations' own results.
    pub scorer_version: Option<u32>,
}

/// Describes a database error without the data values it refers to.
pub fn describe_db_error(error: &Error) -> String {
    match error.as_db_error() {
        Some(db) => format!("{} (SQLSTATE {})", db.message(), db.code().code()),
        None => {
            let mut text = error.to_string();
            let mut cause = error.source();
            while let Some(error) = cause {
                text += &format!(": {error}");
                cause = error.source();
            }
            text
        }
    }
}

/// Returns true if the same query may succeed later: the server is unreachable, starting, stopping or busy.
pub fn is_transient(error: &Error) -> bool {
    match error.code() {
        Some(code) => ["08", "40", "53", "57"].contains(&&code.code()[..2]) || *code == SqlState::LOCK_NOT_AVAILABLE,
        // The connection broke or could not be opened. Encoding and decoding errors of the client have no I/O cause.
        None => error.is_closed() || has_transient_io_cause(error),
    }
}

/// Returns true if the database refuses this session's own content, so that another session may still be stored: text
/// that it cannot store (class 22), a rule of a table (23), or a text that exceeds a limit (54).
pub fn is_data_error(error: &Error) -> bool {
    error.code().is_some_and(|code| ["22", "23", "54"].contains(&&code.code()[..2]))
}

fn has_transient_io_cause(error: &Error) -> bool {
    let mut cause = error.source();
    while let Some(error) = cause {
        if let Some(io) = error.downcast_ref::<std::io::Error>() {
            // A certificate that is not trusted now will not be trusted later.
            return io.kind() != std::io::ErrorKind::InvalidData && io.kind() != std::io::ErrorKind::InvalidInput;
        }
        cause = error.source();
    }
    false
}

/// Returns the name of the current login.
///
/// # Errors
///
/// Returns the database error.
pub fn login_name(client: &mut Client) -> Result<String, Error> {
    Ok(client.query_one("SELECT session_user::text", &[])?.get(0))
}

/// Returns whether a class of this name exists.
///
/// # Errors
///
/// Returns the database error.
pub fn has_class(client: &mut Client, class: &str) -> Result<bool, Error> {
    Ok(client.query_opt("SELECT FROM typodont.class WHERE name = $1", &[&class])?.is_some())
}

/// Returns the marker that identifies this database's store, and whether it was written to the store.
///
/// # Errors
///
/// Returns the database error.
pub fn store_marker(client: &mut Client) -> Result<(String, bool), Error> {
    let row = client.query_one("SELECT word, is_marked FROM typodont.store", &[])?;
    Ok((row.get(0), row.get(1)))
}

/// Records that the marker was written to the store.
///
/// # Errors
///
/// Returns the database error.
pub fn confirm_store_marker(client: &mut Client) -> Result<(), Error> {
    client.execute("SELECT typodont.store_is_marked()", &[]).map(drop)
}

/// Returns the SHA-256 of each `session.json` that this station inserted, by session id.
///
/// # Errors
///
/// Returns the database error.
pub fn session_digests(client: &mut Client, ids: &[String]) -> Result<BTreeMap<String, String>, Error> {
    let sql = "SELECT id::text, encode(sha256(convert_to(result, 'UTF8')), 'hex') FROM typodont.session
      WHERE station = session_user AND id IN (SELECT unnest($1::text[])::uuid)";
    Ok(client.query(sql, &[&ids])?.iter().map(|row| (row.get(0), row.get(1))).collect())
}

/// Returns the status of each session, in the given order.
///
/// # Errors
///
/// Returns the database error.
pub fn sync_status(client: &mut Client, sessions: &[&SessionFile]) -> Result<Vec<SyncStatus>, Error> {
    let ids: Vec<String> = sessions.iter().map(|s| session_id(s)).collect();
    let codes: Vec<String> = sessions.iter().map(|s| s.participant.replace('\0', "")).collect();
    let sql = "SELECT typodont.standing_of(id::uuid, code)
      FROM unnest($1::text[], $2::text[]) WITH ORDINALITY AS asked (id, code, place) ORDER BY place";
    let rows = client.query(sql, &[&ids, &codes])?;
    let status_of = |word: &str| match word {
        "known" => SyncStatus::Known,
        "erased" => SyncStatus::Erased,
        _ => SyncStatus::New,
    };
    Ok(rows.iter().map(|row| status_of(row.get(0))).collect())
}

/// Inserts a session, whose bundle must already be in the store, in one transaction. Repeated calls insert it only
/// once.
///
/// # Errors
///
/// Returns the database error.
pub fn insert_session(client: &mut Client, new_session: &NewSession) -> Result<InsertOutcome, Error> {
    let NewSession { class, bundle, session, session_json, manifest } = new_session;
    let id = session_id(session);
    let mut transaction = client.transaction()?;
    let Some(class) = transaction.query_opt("SELECT id FROM typodont.class WHERE name = $1", &[class])? else {
        return Ok(InsertOutcome::UnknownClass);
    };
    let class: i64 = class.get(0);
    let participant: Option<i64> = match session.participant.as_str() {
        "" => None,
        code => match transaction.query_one("SELECT typodont.participant_of($1)", &[&code]) {
            Ok(row) => row.get(0),
            Err(error) if error.code().is_some_and(|code| code.code() == "TY001") => return Ok(InsertOutcome::Erased),
            Err(error) => return Err(error),
        },
    };
    let scenario = &session.scenario;
    let exercise: i64 = transaction
        .query_one("SELECT typodont.exercise_of($1, $2, $3)", &[&scenario.sha256, &scenario.id, &scenario.title])?
        .get(0);
    // Manifests contain only numbers and strings, so serialization cannot fail.
    let manifest_json = serde_json::to_string(manifest).unwrap_or_default();
    let version = i64::from(session.scorer_version);
    let grade = session.grade.as_ref();
    let sql =
        "INSERT INTO typodont.session (id, class_id, participant_id, exercise_id, bundle, started_at, ended_because,
        length_s, scorer_version, points, passed, result, manifest)
      VALUES ($1::text::uuid, $2, $3, $4, $5, $6::text::timestamptz, $7, $8, $9, $10, $11, $12, $13::text::jsonb)
      ON CONFLICT (id) DO NOTHING";
    let inserted = transaction.execute(
        sql,
        &[
            &id,
            &class,
            &participant,
            &exercise,
            bundle,
            &timestamp(&session.started),
            &session.ended_because,
            &(session.servo.ticks as f64 * TICK_S),
            &version,
            &grade.map(|g| g.points),
            &grade.map(|g| g.passed),
            session_json,
            &manifest_json,
        ],
    )?;
    if inserted == 0 {
        // Row-level security shows a station only its own sessions.
        let own = transaction.query_opt("SELECT FROM typodont.session WHERE id = $1::text::uuid", &[&id])?;
        return Ok(if own.is_some() { InsertOutcome::AlreadyInserted } else { InsertOutcome::OtherStation });
    }
    insert_metrics(&mut transaction, &id, session)?;
    insert_ratings(&mut transaction, &id, session)?;
    transaction.commit()?;
    Ok(InsertOutcome::Inserted)
}

/// Inserts a session's metrics under the scorer version that computed them. The caller first deletes a station's
/// values that a worker's replace.
pub(super) fn insert_metrics(client: &mut impl GenericClient, id: &str, session: &SessionFile) -> Result<(), Error> {
    let names: Vec<&str> = session.metrics.keys().map(String::as_str).collect();
    let values: Vec<Option<f64>> = session.metrics.values().copied().collect();
    let sql = "INSERT INTO typodont.metric_value (session_id, scorer_version, metric, value)
      SELECT $1::text::uuid, $2, metric, value FROM unnest($3::text[], $4::float8[]) AS made (metric, value)";
    client.execute(sql, &[&id, &i64::from(session.scorer_version), &names, &values])?;
    Ok(())
}

/// Inserts the ratings of a session's questionnaire, if it has one.
fn insert_ratings(client: &mut impl GenericClient, id: &str, session: &SessionFile) -> Result<(), Error> {
    let Some(questionnaire) = &session.questionnaire else { return Ok(()) };
    let items = &questionnaire.items;
    let ids: Vec<&str> = items.iter().map(|i| i.id.as_str()).collect();
    let categories: Vec<&str> = items.iter().map(|i| i.category.as_str()).collect();
    let values: Vec<Option<f64>> = items.iter().map(|i| i.value).collect();
    let counted: Vec<Option<f64>> = items.iter().map(|i| i.counted).collect();
    let sql = "INSERT INTO typodont.rating (session_id, questionnaire, place, item, category, value, counted)
      SELECT $1::text::uuid, $2, place, item, category, value, counted FROM
      unnest($3::text[], $4::text[], $5::float8[], $6::float8[])
      WITH ORDINALITY AS given (item, category, value, counted, place)";
    client.execute(sql, &[&id, &questionnaire.id, &ids, &categories, &values, &counted])?;
    Ok(())
}

/// Normalizes an RFC 3339 timestamp for PostgreSQL; `None` for other text and for times before the year 1.
fn timestamp(text: &str) -> Option<String> {
    let moment = text.parse::<jiff::Timestamp>().ok()?;
    (moment.as_second() > -62_135_596_800).then(|| moment.to_string())
}

/// Reads the sessions that the login may read, in the order in which a folder's sessions are read (exercise,
/// participant, start), and messages about rows that cannot be read.
///
/// # Errors
///
/// Returns the database error.
pub fn sessions(client: &mut Client, filter: &SessionFilter) -> Result<(Vec<StoredSession>, Vec<String>), Error> {
    let scorer = filter.scorer_version.map(i64::from);
    let sql = "SELECT s.id::text, c.name, s.bundle,
        coalesce(to_char(s.started_at AT TIME ZONE 'UTC', 'YYYY-MM'), 'unknown'), s.result, s.manifest::text, k.result,
        (SELECT bool_and(d.agrees) FROM typodont.score d WHERE d.session_id = s.id)
      FROM typodont.session s JOIN typodont.class c ON c.id = s.class_id
      LEFT JOIN typodont.score k ON k.session_id = s.id AND k.scorer_version = $2
      WHERE ($1::text IS NULL OR c.name = $1) AND ($2::bigint IS NULL OR k.session_id IS NOT NULL)";
    let mut stored = Vec::new();
    let mut unreadable = Vec::new();
    for row in client.query(sql, &[&filter.class, &scorer])? {
        let (id, as_written, scored): (String, String, Option<String>) = (row.get(0), row.get(4), row.get(6));
        let manifest: String = row.get(5);
        let read = SessionFile::from_json(&as_written).and_then(|written| {
            let session = match scored {
                None => written,
                Some(text) => rescored_in_place(&written, SessionFile::from_json(&text)?),
            };
            Ok((session, serde_json::from_str(&manifest).map_err(|error| format!("manifest: {error}"))?))
        });
        let [class, bundle, month]: [String; 3] = [1, 2, 3].map(|column| row.get(column));
        match read {
            // The name was chosen by a station and must not lead out of the folder.
            Ok(_) if !is_plain_name(&bundle) => {
                unreadable.push(format!("{id}: \"{bundle}\" is not a valid bundle name"))
            }
            Ok((session, manifest)) => {
                let agrees: Option<bool> = row.get(7);
                let verification = match agrees {
                    // The result is a worker's own.
                    _ if scorer.is_some() => VerificationStatus::Verified,
                    Some(true) => VerificationStatus::Verified,
                    Some(false) => {
                        VerificationStatus::Differs(vec!["the worker's score differs from the station's".into()])
                    }
                    None => VerificationStatus::Pending,
                };
                let differs = agrees == Some(false);
                stored.push(StoredSession { id, class, bundle, month, session, manifest, differs, verification });
            }
            Err(error) => unreadable.push(format!("{id}: {error}")),
        }
    }
    stored.sort_by(|a, b| {
        let key = |k: &StoredSession| {
            (k.session.scenario.id.clone(), k.session.participant.clone(), k.session.started.clone())
        };
        (key(a), &a.bundle, &a.id).cmp(&(key(b), &b.bundle, &b.id))
    });
    Ok((stored, unreadable))
}

/// Returns true if `word` is a plain file name that cannot lead out of its folder.
pub fn is_plain_name(word: &str) -> bool {
    Path::new(word).components().all(|part| matches!(part, Component::Normal(_))) && !word.contains(['/', '\\'])
}

/// Returns the rescored result with the digests of the bundle that the station wrote.
fn rescored_in_place(written: &SessionFile, rescored: SessionFile) -> SessionFile {
    SessionFile { digests: written.digests.clone(), template_sha256: written.template_sha256.clone(), ..rescored }
}

/// Examiners' logs that the database holds, line by line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LogTable {
    Overrides,
    Ratings,
}

impl LogTable {
    fn name(self) -> &'static str {
        match self {
            LogTable::Overrides => "typodont.override",
            LogTable::Ratings => "typodont.examiner_rating",
        }
    }
}

/// Reads all overrides that the login may read, in chronological order.
///
/// # Errors
///
/// Returns the database error.
pub fn read_overrides(client: &mut Client) -> Result<OverrideSnapshot, Error> {
    read_log(client, LogTable::Overrides)
}

/// Reads all lines of examiners' logs that the login may read, in chronological order.
///
/// # Errors
///
/// Returns the database error.
pub fn read_log<D: LoggedDraft>(client: &mut Client, table: LogTable) -> Result<LogSnapshot<D>, Error> {
    let rows = client.query(&format!("SELECT session_id::text, line FROM {}", table.name()), &[])?;
    // Access was granted for the row's session, so a line about another session is ignored.
    let entry = |row: &postgres::Row| {
        let entry = serde_json::from_str::<LogEntry<D>>(row.get(1)).ok()?;
        (entry.draft.session() == row.get::<_, &str>(0)).then_some(entry)
    };
    let mut entries: Vec<LogEntry<D>> = rows.iter().filter_map(entry).collect();
    entries.sort_by(|a, b| (&a.at, a.number).cmp(&(&b.at, b.number)));
    Ok(LogSnapshot::from_entries(entries))
}

/// Inserts lines of an examiner's log, each given as entry, text and SHA-256, and returns the number of new ones.
/// Lines about sessions that the examiner may not read, or that do not exist, are skipped.
///
/// # Errors
///
/// Returns the database error.
pub fn insert_log_lines<D: LoggedDraft>(
    client: &mut Client,
    table: LogTable,
    log: &str,
    lines: &[(LogEntry<D>, String, String)],
) -> Result<u64, Error> {
    let mut inserted = 0;
    let mut transaction = client.transaction()?;
    let sql = format!(
        "INSERT INTO {} (log, number, session_id, line, sha256)
         SELECT $1, $2, s.id, $4, $5 FROM typodont.session s WHERE s.id::text = $3 ON CONFLICT DO NOTHING",
        table.name()
    );
    for (entry, line, digest) in lines {
        let number = i64::try_from(entry.number).unwrap_or(i64::MAX);
        inserted += transaction.execute(&sql, &[&log, &number, &entry.draft.session(), line, digest])?;
    }
    transaction.commit()?;
    Ok(inserted)
}

/// Returns true for the error of a table that an earlier version of the schema does not have.
pub fn is_missing_table(error: &Error) -> bool {
    error.code() == Some(&SqlState::UNDEFINED_TABLE)
}

/// Period for which the sessions of a class are kept.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Retention {
    /// Days; `None` leaves a known class as it is.
    pub days: Option<i32>,
    /// True if sessions are kept without limit, whatever was set before.
    pub is_unlimited: bool,
}

/// Creates a class or changes its retention; returns the days for which its sessions are kept, `None` without limit.
///
/// # Errors
/// The database's error.
pub fn set_class(client: &mut Client, name: &str, retention: Retention) -> Result<Option<i32>, Error> {
    let sql = "INSERT INTO typodont.class (name, keep_days) VALUES ($1, $2)
      ON CONFLICT (name) DO UPDATE
      SET keep_days = CASE WHEN $3 THEN NULL ELSE coalesce(excluded.keep_days, class.keep_days) END
      RETURNING keep_days";
    Ok(client.query_one(sql, &[&name, &retention.days, &retention.is_unlimited])?.get(0))
}

/// Returns the audit log, an object of JSON per entry, oldest first.
///
/// # Errors
/// The database's error.
pub fn audit_log(client: &mut Client) -> Result<Vec<String>, Error> {
    let sql =
        "SELECT json_build_object('number', id, 'at', at, 'login', login, 'action', action, 'session', session_id,
      'detail', detail)::text FROM typodont.audit ORDER BY id";
    Ok(client.query(sql, &[])?.iter().map(|row| row.get(0)).collect())
}

/// Records in the audit log that this login has read a number of sessions.
///
/// # Errors
/// The database's error.
pub fn note_read(client: &mut Client, count: usize) -> Result<(), Error> {
    client.query("SELECT typodont.note('sessions read', $1)", &[&count.to_string()]).map(|_| ())
}
