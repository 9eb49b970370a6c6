//! Work that is leased: each session is scored once by each version, whoever dies on the way.

use super::pack::Manifest;
use super::records::enter_metrics;
use crate::report::SessionFile;
use postgres::error::SqlState;
use postgres::{Client, Error};

/// A session that is to be scored, for as long as its lease lasts.
#[derive(Clone, Debug)]
pub struct Job {
    pub session: String,
    /// This one included.
    pub attempts: i32,
    pub manifest: Manifest,
    /// Its `session.json`, as the station wrote it.
    pub written: String,
}

/// How a lease is held.
#[derive(Clone, Debug)]
pub struct Lease {
    /// Whose.
    pub worker: String,
    pub scorer_version: u32,
    /// For how long, s. It is renewed three times in this.
    pub seconds: f64,
    /// Attempts of a session before it is set aside.
    pub attempts_max: i32,
}

/// How much there is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    pub waiting: i64,
    pub leased: i64,
    pub done: i64,
    pub set_aside: i64,
}

/// Asks for every session with a recording that a version has not scored yet; gives how many were new.
pub fn enqueue(client: &mut Client, scorer_version: u32, class: Option<&str>) -> Result<u64, Error> {
    let sql = r#"INSERT INTO typodont.job (session_id, scorer_version)
      SELECT s.id, $1 FROM typodont.session s JOIN typodont.class c ON c.id = s.class_id
      WHERE s.manifest->'files' @> '[{"name": "recording.mcap"}]' AND ($2::text IS NULL OR c.name = $2)
        AND NOT EXISTS (SELECT FROM typodont.score k WHERE k.session_id = s.id AND k.scorer_version = $1)
      ON CONFLICT DO NOTHING"#;
    client.execute(sql, &[&i64::from(scorer_version), &class])
}

/// Lets what was set aside be tried again; gives how many.
pub fn try_again(client: &mut Client, scorer_version: u32) -> Result<u64, Error> {
    let sql = "UPDATE typodont.job SET state = 'waiting', attempts = 0, due_at = now(), error = NULL, ended_at = NULL
      WHERE scorer_version = $1 AND state = 'set aside'";
    client.execute(sql, &[&i64::from(scorer_version)])
}

/// Takes the next job, if there is one. A lease that lapsed is taken over; one that lapsed too often is set aside: it may be what
/// kills workers.
pub fn lease(client: &mut Client, lease: &Lease) -> Result<Option<Job>, Error> {
    let version = i64::from(lease.scorer_version);
    let lapsed = "UPDATE typodont.job SET state = 'set aside', ended_at = now(),
        error = 'its lease lapsed ' || attempts || ' times: it may be what ends workers'
      WHERE (session_id, scorer_version) IN (SELECT session_id, scorer_version FROM typodont.job
        WHERE scorer_version = $1 AND state = 'leased' AND due_at < now() AND attempts >= $2 FOR UPDATE SKIP LOCKED)";
    client.execute(lapsed, &[&version, &lease.attempts_max])?;
    let sql = "WITH next AS (
        SELECT session_id, scorer_version FROM typodont.job
        WHERE scorer_version = $1 AND state IN ('waiting', 'leased') AND due_at <= now()
        ORDER BY due_at LIMIT 1 FOR UPDATE SKIP LOCKED)
      UPDATE typodont.job j SET state = 'leased', attempts = j.attempts + 1, worker = $2,
        due_at = now() + make_interval(secs => $3)
      FROM next JOIN typodont.session s ON s.id = next.session_id
      WHERE j.session_id = next.session_id AND j.scorer_version = next.scorer_version
      RETURNING j.session_id::text, j.attempts, s.manifest::text, s.result";
    let Some(row) = client.query_opt(sql, &[&version, &lease.worker, &lease.seconds])? else { return Ok(None) };
    let manifest: String = row.get(2);
    let manifest = serde_json::from_str(&manifest).unwrap_or_else(|_| Manifest {
        // Its recording will be missed, and it is set aside for that.
        folder: String::new(),
        files: Vec::new(),
        parts: Vec::new(),
    });
    Ok(Some(Job { session: row.get(0), attempts: row.get(1), manifest, written: row.get(3) }))
}

/// Holds a lease for longer; whether it is still ours.
pub fn renew(client: &mut Client, lease: &Lease, session: &str) -> Result<bool, Error> {
    let sql = "UPDATE typodont.job SET due_at = now() + make_interval(secs => $4)
      WHERE session_id = $1::text::uuid AND scorer_version = $2 AND worker = $3 AND state = 'leased'";
    let version = i64::from(lease.scorer_version);
    Ok(client.execute(sql, &[&session, &version, &lease.worker, &lease.seconds])? == 1)
}

/// Writes a result down, with its measures, and ends the job: all of it or nothing. Whether it was the first: a result that is
/// there already stays.
pub fn finish(client: &mut Client, job: &Job, result: &SessionFile, agrees: Option<bool>) -> Result<bool, Error> {
    let version = i64::from(result.scorer_version);
    let mut change = client.transaction()?;
    let sql = "INSERT INTO typodont.score (session_id, scorer_version, result, agrees, typodont_version)
      VALUES ($1::text::uuid, $2, $3, $4, $5) ON CONFLICT DO NOTHING";
    let text = result.text();
    let first = match change.execute(sql, &[&job.session, &version, &text, &agrees, &env!("CARGO_PKG_VERSION")]) {
        Ok(rows) => rows == 1,
        // It was erased while it was scored.
        Err(error) if error.code() == Some(&SqlState::FOREIGN_KEY_VIOLATION) => return Ok(false),
        Err(error) => return Err(error),
    };
    if first {
        let sql = "DELETE FROM typodont.metric_value WHERE session_id = $1::text::uuid AND scorer_version = $2";
        change.execute(sql, &[&job.session, &version])?;
        enter_metrics(&mut change, &job.session, result)?;
        if agrees == Some(false) {
            let sql = "SELECT typodont.note_session('score differs from the station''s', $1::text::uuid)";
            change.execute(sql, &[&job.session])?;
        }
    }
    let sql = "UPDATE typodont.job SET state = 'done', ended_at = now(), error = NULL
      WHERE session_id = $1::text::uuid AND scorer_version = $2 AND state <> 'done'";
    change.execute(sql, &[&job.session, &version])?;
    change.commit()?;
    Ok(first)
}

/// Says that an attempt failed. It is tried again `pause` seconds later, or set aside with its error: at once where trying again
/// would say the same. Whether it was set aside.
pub fn fail(
    client: &mut Client,
    lease: &Lease,
    job: &Job,
    error: &str,
    hopeless: bool,
    pause: f64,
) -> Result<bool, Error> {
    let set_aside = hopeless || job.attempts >= lease.attempts_max;
    let sql =
        "UPDATE typodont.job SET state = CASE WHEN $4 THEN 'set aside' ELSE 'waiting' END, error = left($5, 2000),
        due_at = now() + make_interval(secs => $6), ended_at = CASE WHEN $4 THEN now() END
      WHERE session_id = $1::text::uuid AND scorer_version = $2 AND worker = $3 AND state = 'leased'";
    let version = i64::from(lease.scorer_version);
    let error = error.replace('\0', "");
    client.execute(sql, &[&job.session, &version, &lease.worker, &set_aside, &error, &pause])?;
    Ok(set_aside)
}

pub fn tally(client: &mut Client, scorer_version: u32) -> Result<Tally, Error> {
    let sql = "SELECT count(*) FILTER (WHERE state = 'waiting'), count(*) FILTER (WHERE state = 'leased'),
        count(*) FILTER (WHERE state = 'done'), count(*) FILTER (WHERE state = 'set aside')
      FROM typodont.job WHERE scorer_version = $1";
    let row = client.query_one(sql, &[&i64::from(scorer_version)])?;
    Ok(Tally { waiting: row.get(0), leased: row.get(1), done: row.get(2), set_aside: row.get(3) })
}
