//! Sessions into the records, and out of them.

use super::pack::Manifest;
use crate::handover::session_id;
use crate::report::SessionFile;
use crate::review::{Entry, Told};
use crate::tick::TICK_S;
use postgres::error::SqlState;
use postgres::{Client, Error, GenericClient};
use std::collections::BTreeMap;
use std::error::Error as _;
use std::path::{Component, Path};

/// What the records say of a session.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Standing {
    New,
    Known,
    /// It, or its participant, was erased: it must not come back.
    Erased,
}

/// A session as it is entered.
pub struct Finished<'a> {
    pub class: &'a str,
    /// Name of the bundle's folder.
    pub bundle: &'a str,
    pub session: &'a SessionFile,
    /// Its `session.json`, word for word.
    pub text: &'a str,
    pub manifest: &'a Manifest,
}

/// What came of entering.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Entered {
    Now,
    /// This station had entered it before.
    Before,
    /// Another station had.
    Elsewhere,
    Erased,
    NoClass,
}

/// A session as the records hold it.
pub struct Kept {
    pub id: String,
    pub class: String,
    pub bundle: String,
    /// `2026-11`, or `unknown`.
    pub month: String,
    pub session: SessionFile,
    pub manifest: Manifest,
    /// A worker found another score than its station wrote.
    pub differs: bool,
}

/// Which sessions.
#[derive(Clone, Debug, Default)]
pub struct Which {
    pub class: Option<String>,
    /// Scored by workers with this version; otherwise as their stations wrote them.
    pub scorer_version: Option<u32>,
}

/// What an error of the database says, without the values that it is about.
pub fn told(error: &Error) -> String {
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

/// Whether the same question may get an answer later: the server is away, starting, stopping or busy.
pub fn is_passing(error: &Error) -> bool {
    match error.code() {
        Some(code) => ["08", "40", "53", "57"].contains(&&code.code()[..2]) || *code == SqlState::LOCK_NOT_AVAILABLE,
        // A broken line, or none yet; what the client itself cannot read or write says so in other ways.
        None => error.is_closed() || has_cause_of_input(error),
    }
}

fn has_cause_of_input(error: &Error) -> bool {
    let mut cause = error.source();
    while let Some(error) = cause {
        if let Some(io) = error.downcast_ref::<std::io::Error>() {
            // A certificate that is not believed stays so.
            return io.kind() != std::io::ErrorKind::InvalidData && io.kind() != std::io::ErrorKind::InvalidInput;
        }
        cause = error.source();
    }
    false
}

/// Who is logged in.
pub fn login(client: &mut Client) -> Result<String, Error> {
    Ok(client.query_one("SELECT session_user::text", &[])?.get(0))
}

pub fn has_class(client: &mut Client, class: &str) -> Result<bool, Error> {
    Ok(client.query_opt("SELECT FROM typodont.class WHERE name = $1", &[&class])?.is_some())
}

/// The word that lies in the store of these records, and whether it was laid there.
pub fn store_word(client: &mut Client) -> Result<(String, bool), Error> {
    let row = client.query_one("SELECT word, is_marked FROM typodont.store", &[])?;
    Ok((row.get(0), row.get(1)))
}

/// Says that the word lies in the store.
pub fn store_is_marked(client: &mut Client) -> Result<(), Error> {
    client.execute("SELECT typodont.store_is_marked()", &[]).map(drop)
}

/// Digests of what this station wrote of its sessions, by their ids.
pub fn written(client: &mut Client, ids: &[String]) -> Result<BTreeMap<String, String>, Error> {
    let sql = "SELECT id::text, encode(sha256(convert_to(result, 'UTF8')), 'hex') FROM typodont.session
      WHERE station = session_user AND id IN (SELECT unnest($1::text[])::uuid)";
    Ok(client.query(sql, &[&ids])?.iter().map(|row| (row.get(0), row.get(1))).collect())
}

/// What the records say of sessions, in their order.
pub fn standing(client: &mut Client, sessions: &[&SessionFile]) -> Result<Vec<Standing>, Error> {
    let ids: Vec<String> = sessions.iter().map(|s| session_id(s)).collect();
    let codes: Vec<String> = sessions.iter().map(|s| s.participant.replace('\0', "")).collect();
    let sql = "SELECT typodont.standing_of(id::uuid, code)
      FROM unnest($1::text[], $2::text[]) WITH ORDINALITY AS asked (id, code, place) ORDER BY place";
    let rows = client.query(sql, &[&ids, &codes])?;
    let standing = |word: &str| match word {
        "known" => Standing::Known,
        "erased" => Standing::Erased,
        _ => Standing::New,
    };
    Ok(rows.iter().map(|row| standing(row.get(0))).collect())
}

/// Enters a session whose bytes are stored: all of it or nothing, and once however often it is asked for.
pub fn enter(client: &mut Client, finished: &Finished) -> Result<Entered, Error> {
    let Finished { class, bundle, session, text, manifest } = finished;
    let id = session_id(session);
    let mut change = client.transaction()?;
    let Some(class) = change.query_opt("SELECT id FROM typodont.class WHERE name = $1", &[class])? else {
        return Ok(Entered::NoClass);
    };
    let class: i64 = class.get(0);
    let participant: Option<i64> = match session.participant.as_str() {
        "" => None,
        code => match change.query_one("SELECT typodont.participant_of($1)", &[&code]) {
            Ok(row) => row.get(0),
            Err(error) if error.code().is_some_and(|code| code.code() == "TY001") => return Ok(Entered::Erased),
            Err(error) => return Err(error),
        },
    };
    let scenario = &session.scenario;
    let exercise: i64 = change
        .query_one("SELECT typodont.exercise_of($1, $2, $3)", &[&scenario.sha256, &scenario.id, &scenario.title])?
        .get(0);
    // Manifests are plain numbers and texts: writing them cannot fail.
    let places = serde_json::to_string(manifest).unwrap_or_default();
    let version = i64::from(session.scorer_version);
    let grade = session.grade.as_ref();
    let sql =
        "INSERT INTO typodont.session (id, class_id, participant_id, exercise_id, bundle, started_at, ended_because,
        length_s, scorer_version, points, passed, result, manifest)
      VALUES ($1::text::uuid, $2, $3, $4, $5, $6::text::timestamptz, $7, $8, $9, $10, $11, $12, $13::text::jsonb)
      ON CONFLICT (id) DO NOTHING";
    let new = change.execute(
        sql,
        &[
            &id,
            &class,
            &participant,
            &exercise,
            bundle,
            &moment(&session.started),
            &session.ended_because,
            &(session.servo.ticks as f64 * TICK_S),
            &version,
            &grade.map(|g| g.points),
            &grade.map(|g| g.passed),
            text,
            &places,
        ],
    )?;
    if new == 0 {
        // Row-level security shows a station its own alone.
        let own = change.query_opt("SELECT FROM typodont.session WHERE id = $1::text::uuid", &[&id])?;
        return Ok(if own.is_some() { Entered::Before } else { Entered::Elsewhere });
    }
    enter_metrics(&mut change, &id, session)?;
    if let Some(questionnaire) = &session.questionnaire {
        let items = &questionnaire.items;
        let ids: Vec<&str> = items.iter().map(|i| i.id.as_str()).collect();
        let categories: Vec<&str> = items.iter().map(|i| i.category.as_str()).collect();
        let values: Vec<Option<f64>> = items.iter().map(|i| i.value).collect();
        let counted: Vec<Option<f64>> = items.iter().map(|i| i.counted).collect();
        let sql = "INSERT INTO typodont.rating (session_id, questionnaire, place, item, category, value, counted)
          SELECT $1::text::uuid, $2, place, item, category, value, counted FROM
          unnest($3::text[], $4::text[], $5::float8[], $6::float8[])
          WITH ORDINALITY AS given (item, category, value, counted, place)";
        change.execute(sql, &[&id, &questionnaire.id, &ids, &categories, &values, &counted])?;
    }
    change.commit()?;
    Ok(Entered::Now)
}

/// A session's measures by the version that made them. Entered again they are the same; where a worker and a station differ, the
/// worker is right.
pub(super) fn enter_metrics(client: &mut impl GenericClient, id: &str, session: &SessionFile) -> Result<(), Error> {
    let names: Vec<&str> = session.metrics.keys().map(String::as_str).collect();
    let values: Vec<Option<f64>> = session.metrics.values().copied().collect();
    let sql = "INSERT INTO typodont.metric_value (session_id, scorer_version, metric, value)
      SELECT $1::text::uuid, $2, metric, value FROM unnest($3::text[], $4::float8[]) AS made (metric, value)";
    client.execute(sql, &[&id, &i64::from(session.scorer_version), &names, &values])?;
    Ok(())
}

/// RFC 3339 as PostgreSQL reads it; nothing for what is no moment of our era.
fn moment(text: &str) -> Option<String> {
    let moment = text.parse::<jiff::Timestamp>().ok()?;
    (moment.as_second() > -62_135_596_800).then(|| moment.to_string())
}

/// Sessions that whoever is logged in may read, in the order in which a folder's are.
pub fn sessions(client: &mut Client, which: &Which) -> Result<(Vec<Kept>, Vec<String>), Error> {
    let scorer = which.scorer_version.map(i64::from);
    let sql = "SELECT s.id::text, c.name, s.bundle,
        coalesce(to_char(s.started_at AT TIME ZONE 'UTC', 'YYYY-MM'), 'unknown'), s.result, s.manifest::text, k.result,
        EXISTS (SELECT FROM typodont.score d WHERE d.session_id = s.id AND NOT d.agrees)
      FROM typodont.session s JOIN typodont.class c ON c.id = s.class_id
      LEFT JOIN typodont.score k ON k.session_id = s.id AND k.scorer_version = $2
      WHERE ($1::text IS NULL OR c.name = $1) AND ($2::bigint IS NULL OR k.session_id IS NOT NULL)";
    let mut kept = Vec::new();
    let mut unread = Vec::new();
    for row in client.query(sql, &[&which.class, &scorer])? {
        let (id, as_written, scored): (String, String, Option<String>) = (row.get(0), row.get(4), row.get(6));
        let manifest: String = row.get(5);
        let read = serde_json::from_str::<SessionFile>(&as_written).and_then(|written| {
            let session = match scored {
                None => written,
                Some(text) => again(&written, serde_json::from_str(&text)?),
            };
            Ok((session, serde_json::from_str(&manifest)?))
        });
        let [class, bundle, month]: [String; 3] = [1, 2, 3].map(|column| row.get(column));
        match read {
            // A station named it: it must not lead elsewhere.
            Ok(_) if !is_name(&bundle) => unread.push(format!("{id}: \"{bundle}\" is not a bundle's name")),
            Ok((session, manifest)) => {
                kept.push(Kept { id, class, bundle, month, session, manifest, differs: row.get(7) });
            }
            Err(error) => unread.push(format!("{id}: not a session: {error}")),
        }
    }
    kept.sort_by(|a, b| {
        let key = |k: &Kept| (k.session.scenario.id.clone(), k.session.participant.clone(), k.session.started.clone());
        (key(a), &a.bundle, &a.id).cmp(&(key(b), &b.bundle, &b.id))
    });
    Ok((kept, unread))
}

/// Whether a word is the name of something within a folder, and no way out of it.
pub fn is_name(word: &str) -> bool {
    Path::new(word).components().all(|part| matches!(part, Component::Normal(_))) && !word.contains(['/', '\\'])
}

/// A result made anew in the place of the one that was written: it is of the same bundle.
fn again(written: &SessionFile, anew: SessionFile) -> SessionFile {
    SessionFile { digests: written.digests.clone(), template_sha256: written.template_sha256.clone(), ..anew }
}

/// What examiners judged, in the order in which they did.
pub fn judgements(client: &mut Client) -> Result<Told, Error> {
    let rows = client.query("SELECT session_id::text, line FROM typodont.override", &[])?;
    // Whoever wrote the line was let in by its session: of another one it says nothing.
    let entry = |row: &postgres::Row| {
        let entry = serde_json::from_str::<Entry>(row.get(1)).ok()?;
        (entry.draft.session == row.get::<_, &str>(0)).then_some(entry)
    };
    let mut entries: Vec<Entry> = rows.iter().filter_map(entry).collect();
    entries.sort_by(|a, b| (&a.at, a.number).cmp(&(&b.at, b.number)));
    Ok(Told::of(entries))
}

/// Puts lines of an examiner's log into the records; gives how many were new. Lines of sessions that the examiner may not read, or
/// that are not there, stay behind.
pub fn judge(client: &mut Client, log: &str, lines: &[(Entry, String, String)]) -> Result<u64, Error> {
    let mut new = 0;
    let mut change = client.transaction()?;
    for (entry, line, digest) in lines {
        let sql = "INSERT INTO typodont.override (log, number, session_id, line, sha256)
          SELECT $1, $2, s.id, $4, $5 FROM typodont.session s WHERE s.id::text = $3 ON CONFLICT DO NOTHING";
        let number = i64::try_from(entry.number).unwrap_or(i64::MAX);
        new += change.execute(sql, &[&log, &number, &entry.draft.session, line, digest])?;
    }
    change.commit()?;
    Ok(new)
}
