//! `typodont worker`: scores queued sessions, one at a time, until it is stopped.

use super::database::DatabaseArguments;
use super::metrics::{self, Counters};
use super::store_arguments::StoreArguments;
use super::store_marker;
use crate::cli::progress::progress_bar;
use crate::cli::{CliError, print_line};
use clap::Args;
use indicatif::ProgressBar;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};
use typodont_exercise::score::SCORER_VERSION;
use typodont_report::SessionFile;
use typodont_report::bundle::{compare_results, sha256};
use typodont_report::sanitize_display;
use typodont_school::connection::{DbConnection, DbError};
use typodont_school::jobs;
use typodont_school::jobs::{Lease, ScoringJob};
use typodont_school::retry::Transient;
use typodont_school::store::ObjectStoreHandle;
use typodont_school::{RECORDING, rescore};

#[derive(Args)]
pub struct Arguments {
    #[command(flatten)]
    at: DatabaseArguments,
    #[command(flatten)]
    store: StoreArguments,
    /// Stop when no session is waiting
    #[arg(long)]
    drain: bool,
    /// Duration of a lease, in seconds: a session whose worker does not renew the lease is given to another worker
    #[arg(long, value_name = "SECONDS", default_value_t = 60.0)]
    lease: f64,
    /// Attempts to score a session before it is set aside
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(i32).range(1..))]
    attempts: i32,
    /// Port on the loopback address at which Prometheus reads counters, under /metrics
    #[arg(long, value_name = "PORT")]
    metrics: Option<u16>,
}

/// Poll interval of the queue.
const POLL_INTERVAL: Duration = Duration::from_secs(1);

/// Interval between two counts of the queue while there is work.
const COUNT_INTERVAL: Duration = Duration::from_secs(5);

/// Pause after the first failed attempt, s; it doubles after each further one.
const RETRY_AFTER_S: f64 = 2.0;

/// Renewals in the duration of a lease: two may fail before the session is given to another worker.
const RENEWALS_PER_LEASE: f64 = 3.0;

/// Valid lease times, s: shorter leases expire while the disk is busy; longer ones block the session of a stopped
/// worker for hours.
const LEASE_RANGE_S: std::ops::RangeInclusive<f64> = 1.0..=3600.0;

pub fn run(arguments: &Arguments) -> Result<(), CliError> {
    let Arguments { at, store, drain, attempts, .. } = arguments;
    if !LEASE_RANGE_S.contains(&arguments.lease) {
        return Err(CliError::misuse("--lease: the duration must be from 1 to 3600 seconds"));
    }
    let mut connection = at.connection()?;
    let store = store.open(at.retry_policy()?)?;
    store_marker::verify(&mut connection, &store)?;
    let lease = Lease {
        worker: worker_name(),
        scorer_version: SCORER_VERSION,
        seconds: arguments.lease,
        attempts_max: *attempts,
    };
    let stop = Arc::new(AtomicBool::new(false));
    let asked = Arc::clone(&stop);
    ctrlc::set_handler(move || asked.store(true, Ordering::Relaxed))
        .map_err(|e| CliError::wrong(format!("worker: cannot install the handler for Ctrl-C: {e}")))?;
    let counters = Arc::new(Counters::default());
    if let Some(port) = arguments.metrics {
        let at = metrics::serve(port, Arc::clone(&counters))
            .map_err(|e| CliError::wrong(format!("--metrics: no-address: {e}")))?;
        eprintln!("http://{at}/metrics");
    }
    let current_session = Arc::new(Mutex::new(None));
    spawn_lease_renewal(connection.new_connection(), lease.clone(), Arc::clone(&current_session), Arc::clone(&stop));
    let bar = progress_bar(0, "scored");
    let mut worker = ScoringWorker { connection, store, lease, counters, current_session, bar, counted: None };
    worker.score_until_stopped(&stop, *drain)?;
    worker.bar.finish_and_clear();
    let count = |of: &std::sync::atomic::AtomicU64| of.load(Ordering::Relaxed);
    print_line(format!(
        "{} scored, {} failed, {} set aside",
        count(&worker.counters.scored),
        count(&worker.counters.failed),
        count(&worker.counters.set_aside)
    ))
}

/// A worker's connections and the state of its queue.
struct ScoringWorker {
    connection: DbConnection,
    store: ObjectStoreHandle,
    lease: Lease,
    counters: Arc<Counters>,
    /// Session whose lease is being renewed.
    current_session: Arc<Mutex<Option<String>>>,
    bar: ProgressBar,
    /// Time of the last count of the queue.
    counted: Option<Instant>,
}

impl ScoringWorker {
    /// Scores queued sessions until the worker is stopped or, with `drain`, until the queue is empty.
    fn score_until_stopped(&mut self, stop: &AtomicBool, drain: bool) -> Result<(), CliError> {
        let mut is_away = false;
        while !stop.load(Ordering::Relaxed) {
            match self.poll() {
                Ok(PollOutcome::Worked) => is_away = false,
                Ok(PollOutcome::Empty) if drain => break,
                Ok(PollOutcome::Empty | PollOutcome::NothingDue) => sleep_unless_stopped(stop),
                // The school's servers may be unavailable for a while: the worker waits for them, and reports it once.
                Err(away) if away.is_transient() && !drain => {
                    if !std::mem::replace(&mut is_away, true) {
                        CliError::from(away).report();
                    }
                    sleep_unless_stopped(stop);
                }
                Err(unanswered) => return Err(unanswered.into()),
            }
        }
        Ok(())
    }

    /// Leases the next job and scores its session, if a job is due.
    fn poll(&mut self) -> Result<PollOutcome, DbError> {
        let lease = &self.lease;
        let job = self.connection.query_with_retry(|client| jobs::lease_next(client, lease))?;
        // Counting reads all jobs, so that it is not done for each of them.
        let is_count_due = job.is_none() || self.counted.is_none_or(|at| at.elapsed() > COUNT_INTERVAL);
        let is_empty = is_count_due && self.count_queue()? == 0;
        let Some(job) = job else { return Ok(if is_empty { PollOutcome::Empty } else { PollOutcome::NothingDue }) };
        *lock(&self.current_session) = Some(job.session.clone());
        let done = process_job(&mut self.connection, &self.store, &self.lease, &job, &self.counters);
        *lock(&self.current_session) = None;
        done?;
        self.bar.set_position(self.counters.scored.load(Ordering::Relaxed));
        Ok(PollOutcome::Worked)
    }

    /// Counts the waiting and leased jobs, and shows their number.
    fn count_queue(&mut self) -> Result<u64, DbError> {
        let tally = self.connection.query_with_retry(|client| jobs::count_jobs(client, SCORER_VERSION))?;
        self.counted = Some(Instant::now());
        self.counters.set_queue(tally);
        let unfinished = (tally.waiting + tally.leased) as u64;
        self.bar.set_length(self.counters.scored.load(Ordering::Relaxed) + unfinished);
        Ok(unfinished)
    }
}

/// Result of polling the queue.
enum PollOutcome {
    Worked,
    /// No job is due, but some are leased or wait for their time.
    NothingDue,
    /// The queue is empty.
    Empty,
}

/// Unique name of the worker in the records.
fn worker_name() -> String {
    let mut random = [0; 6];
    // Without random numbers, the process id alone is used.
    let _ = getrandom::fill(&mut random);
    format!("{}-{}", std::process::id(), typodont_exercise::scenario::hex(&random))
}

/// Scores a session and records the result.
fn process_job(
    connection: &mut DbConnection,
    store: &ObjectStoreHandle,
    lease: &Lease,
    job: &ScoringJob,
    counters: &Counters,
) -> Result<(), DbError> {
    let begun = Instant::now();
    let scored = store.read_bundle_file(&job.manifest, RECORDING).map_err(|(why, passing)| (why, !passing));
    let scored = scored.and_then(|bytes| {
        let result = rescore(&job.session, &bytes).map_err(|unscored| (unscored.0, true))?;
        Ok((result, sha256(&bytes)))
    });
    counters.add_seconds(begun.elapsed());
    match scored {
        Ok((result, recording_digest)) => {
            let agrees = agrees_with_station(&job.station_result, &result, &recording_digest);
            let first = connection.query_with_retry(|client| jobs::finish_job(client, job, &result, agrees))?;
            counters.scored.fetch_add(u64::from(first), Ordering::Relaxed);
            if agrees == Some(false) {
                eprintln!(
                    "{}: differs: the station's score differs from the worker's; `typodont verify` lists the \
                differences",
                    job.session
                );
            }
        }
        Err((why, hopeless)) => {
            let why = sanitize_display(&why, 400);
            let pause = RETRY_AFTER_S * 2f64.powi(job.attempts - 1);
            let aside =
                connection.query_with_retry(|client| jobs::fail_job(client, lease, job, &why, hopeless, pause))?;
            counters.failed.fetch_add(1, Ordering::Relaxed);
            counters.set_aside.fetch_add(u64::from(aside), Ordering::Relaxed);
            eprintln!("{}: {}: {why}", job.session, if aside { "set aside" } else { "will be tried again later" });
        }
    }
    Ok(())
}

/// True if the station's results are those of the recording that was scored, whose SHA-256 is given; `None` if it used another
/// scorer version.
fn agrees_with_station(station_result: &str, result: &SessionFile, recording_digest: &str) -> Option<bool> {
    let Ok(written) = SessionFile::from_json(station_result) else { return Some(false) };
    if written.digests.get(RECORDING).is_some_and(|digest| digest != recording_digest) {
        return Some(false);
    }
    (written.scorer_version == result.scorer_version).then(|| compare_results(result, &written).is_empty())
}

/// Renews the lease of the current session, on a connection of its own.
fn spawn_lease_renewal(
    mut connection: DbConnection,
    lease: Lease,
    current_session: Arc<Mutex<Option<String>>>,
    stop: Arc<AtomicBool>,
) {
    let every = Duration::from_secs_f64(lease.seconds / RENEWALS_PER_LEASE);
    thread::spawn(move || {
        loop {
            thread::sleep(every);
            let session = lock(&current_session).clone();
            match session {
                // A failed renewal is made up for by the next; a lost lease leads to a second, identical scoring.
                Some(session) => drop(connection.query_once(|client| jobs::renew_lease(client, &lease, &session))),
                None if stop.load(Ordering::Relaxed) => return,
                None => {}
            }
        }
    });
}

fn lock(current_session: &Mutex<Option<String>>) -> std::sync::MutexGuard<'_, Option<String>> {
    current_session.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Waits for work, and returns soon if the worker is to stop.
fn sleep_unless_stopped(stop: &AtomicBool) {
    let begun = Instant::now();
    while begun.elapsed() < POLL_INTERVAL && !stop.load(Ordering::Relaxed) {
        thread::sleep(Duration::from_millis(50));
    }
}
