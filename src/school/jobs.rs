//! Queue of scoring jobs. Workers lease jobs, so each session is scored once per scorer version even if workers are
//! killed.

use super::archive::Manifest;
use super::records::insert_metrics;
use postgres::error::SqlState;
use postgres::{Client, Error};
use typodont_report::SessionFile;

/// Leased session that is to be scored.
#[derive(Clone, Debug)]
pub struct ScoringJob {
    pub session: String,
    /// Number of attempts, including this one.
    pub attempts: i32,
    pub manifest: Manifest,
    /// Text of the session's `session.json`, as the station wrote it.
    pub station_result: String,
}

/// Terms under which a worker leases jobs.
#[derive(Clone, Debug)]
pub struct Lease {
    /// Name of the worker.
    pub worker: String,
    pub scorer_version: u32,
    /// Duration, s. The worker renews the lease several times in this period.
    pub seconds: f64,
    /// Attempts after which a session is set aside.
    pub attempts_max: i32,
}

/// Number of jobs in each state.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct JobCounts {
    pub waiting: i64,
    pub leased: i64,
    pub done: i64,
    pub set_aside: i64,
}

/// Enqueues every session with a recording that the version has not scored yet, and returns the number of new jobs.
///
/// # Errors
///
/// Returns the database error.
pub fn enqueue(client: &mut Client, scorer_version: u32, class: Option<&str>) -> Result<u64, Error> {
    let sql = r#"INSERT INTO typodont.job (session_id, scorer_version)
      SELECT s.id, $1 FROM typodont.session s JOIN typodont.class c ON c.id = s.class_id
      WHERE s.manifest->'files' @> '[{"name": "recording.mcap"}]' AND ($2::text IS NULL OR c.name = $2)
        AND NOT EXISTS (SELECT FROM typodont.score k WHERE k.session_id = s.id AND k.scorer_version = $1)
      ON CONFLICT DO NOTHING"#;
    client.execute(sql, &[&i64::from(scorer_version), &class])
}

/// Returns all jobs that were set aside to the queue, with their attempts reset, and returns their number.
///
/// # Errors
///
/// Returns the database error.
pub fn retry_set_aside(client: &mut Client, scorer_version: u32) -> Result<u64, Error> {
    let sql = "UPDATE typodont.job SET state = 'waiting', attempts = 0, due_at = now(), error = NULL, ended_at = NULL
      WHERE scorer_version = $1 AND state = 'set aside'";
    client.execute(sql, &[&i64::from(scorer_version)])
}

/// Leases the next job that is due, if there is one. Expired leases of other workers are taken over. A job whose
/// lease expired `attempts_max` times is set aside, because scoring it may crash the workers.
///
/// # Errors
///
/// Returns the database error.
pub fn lease_next(client: &mut Client, lease: &Lease) -> Result<Option<ScoringJob>, Error> {
    let version = i64::from(lease.scorer_version);
    let lapsed = "UPDATE typodont.job SET state = 'set aside', ended_at = now(),
        error = 'the lease expired ' || attempts || ' times: scoring this session may crash workers'
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
        // The empty manifest has no recording, for which the session is set aside.
        folder: String::new(),
        files: Vec::new(),
        parts: Vec::new(),
    });
    Ok(Some(ScoringJob { session: row.get(0), attempts: row.get(1), manifest, station_result: row.get(3) }))
}

/// Renews a lease, and returns whether this worker still held it.
///
/// # Errors
///
/// Returns the database error.
pub fn renew_lease(client: &mut Client, lease: &Lease, session: &str) -> Result<bool, Error> {
    let sql = "UPDATE typodont.job SET due_at = now() + make_interval(secs => $4)
      WHERE session_id = $1::text::uuid AND scorer_version = $2 AND worker = $3 AND state = 'leased'";
    let version = i64::from(lease.scorer_version);
    Ok(client.execute(sql, &[&session, &version, &lease.worker, &lease.seconds])? == 1)
}

/// Stores a result with its metrics and completes the job, in one transaction. An existing result is kept; returns
/// whether this was the first one.
///
/// # Errors
///
/// Returns the database error.
pub fn finish_job(
    client: &mut Client,
    job: &ScoringJob,
    result: &SessionFile,
    agrees: Option<bool>,
) -> Result<bool, Error> {
    let version = i64::from(result.scorer_version);
    let mut transaction = client.transaction()?;
    let sql = "INSERT INTO typodont.score (session_id, scorer_version, result, agrees, typodont_version)
      VALUES ($1::text::uuid, $2, $3, $4, $5) ON CONFLICT DO NOTHING";
    let text = result.to_json();
    let first = match transaction.execute(sql, &[&job.session, &version, &text, &agrees, &env!("CARGO_PKG_VERSION")]) {
        Ok(rows) => rows == 1,
        // The session was erased while it was being scored.
        Err(error) if error.code() == Some(&SqlState::FOREIGN_KEY_VIOLATION) => return Ok(false),
        Err(error) => return Err(error),
    };
    if first {
        let sql = "DELETE FROM typodont.metric_value WHERE session_id = $1::text::uuid AND scorer_version = $2";
        transaction.execute(sql, &[&job.session, &version])?;
        insert_metrics(&mut transaction, &job.session, result)?;
        if agrees == Some(false) {
            let sql = "SELECT typodont.note_session('score differs from the station''s', $1::text::uuid)";
            transaction.execute(sql, &[&job.session])?;
        }
    }
    let sql = "UPDATE typodont.job SET state = 'done', ended_at = now(), error = NULL
      WHERE session_id = $1::text::uuid AND scorer_version = $2 AND state <> 'done'";
    transaction.execute(sql, &[&job.session, &version])?;
    transaction.commit()?;
    Ok(first)
}

/// Records a failed attempt. The job is due again after `retry_after_s` seconds, or is set aside with its error:
/// immediately if the error is permanent, otherwise after the last attempt. Returns whether the job was set aside.
///
/// # Errors
///
/// Returns the database error.
pub fn fail_job(
    client: &mut Client,
    lease: &Lease,
    job: &ScoringJob,
    error: &str,
    is_permanent: bool,
    retry_after_s: f64,
) -> Result<bool, Error> {
    let set_aside = is_permanent || job.attempts >= lease.attempts_max;
    let sql =
        "UPDATE typodont.job SET state = CASE WHEN $4 THEN 'set aside' ELSE 'waiting' END, error = left($5, 2000),
        due_at = now() + make_interval(secs => $6), ended_at = CASE WHEN $4 THEN now() END
      WHERE session_id = $1::text::uuid AND scorer_version = $2 AND worker = $3 AND state = 'leased'";
    let version = i64::from(lease.scorer_version);
    let error = error.replace('\0', "");
    client.execute(sql, &[&job.session, &version, &lease.worker, &set_aside, &error, &retry_after_s])?;
    Ok(set_aside)
}

/// Counts the jobs of a scorer version by state.
///
/// # Errors
///
/// Returns the database error.
pub fn count_jobs(client: &mut Client, scorer_version: u32) -> Result<JobCounts, Error> {
    let sql = "SELECT count(*) FILTER (WHERE state = 'waiting'), count(*) FILTER (WHERE state = 'leased'),
        count(*) FILTER (WHERE state = 'done'), count(*) FILTER (WHERE state = 'set aside')
      FROM typodont.job WHERE scorer_version = $1";
    let row = client.query_one(sql, &[&i64::from(scorer_version)])?;
    Ok(JobCounts { waiting: row.get(0), leased: row.get(1), done: row.get(2), set_aside: row.get(3) })
}
