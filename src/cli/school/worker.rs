//! `typodont worker`: scores what was enqueued, a session at a time, until it is ended.

use super::asking::{Line, Unanswered};
use super::database::At;
use super::mark;
use super::metrics::{self, Counters};
use super::patience::Passing;
use super::store::{Named, Store};
use super::sync::bar;
use crate::cli::{Failure, say};
use crate::report::SessionFile;
use crate::report::harmless;
use crate::school::work::{self, Job, Lease};
use crate::school::{RECORDING, rescored};
use crate::score::SCORER_VERSION;
use clap::Args;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

#[derive(Args)]
pub struct Arguments {
    #[command(flatten)]
    at: At,
    #[command(flatten)]
    store: Named,
    /// End when nothing waits any more, rather than stay
    #[arg(long)]
    drain: bool,
    /// For how long a session is this worker's without a sign of life, in seconds
    #[arg(long, value_name = "SECONDS", default_value_t = 60.0)]
    lease: f64,
    /// Attempts of a session before it is set aside
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(i32).range(1..))]
    attempts: i32,
    /// Port on this machine's loopback at which Prometheus finds counters, under /metrics
    #[arg(long, value_name = "PORT")]
    metrics: Option<u16>,
}

/// Between two looks for work.
const LOOK_EVERY: Duration = Duration::from_secs(1);

/// Between two counts of what waits, while there is work.
const COUNT_EVERY: Duration = Duration::from_secs(5);

/// After the first failed attempt, s; after each further one twice as long.
const PAUSE_S: f64 = 2.0;

/// Leases that make sense, s: shorter ones are lost to a busy disk, longer ones keep a dead worker's session for hours.
const LEASES_S: std::ops::RangeInclusive<f64> = 1.0..=3600.0;

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let Arguments { at, store, drain, attempts, .. } = arguments;
    if !LEASES_S.contains(&arguments.lease) {
        return Err(Failure::misuse("--lease: from 1 to 3600 seconds"));
    }
    let mut line = at.line()?;
    let store = store.open(at.patience()?)?;
    mark::check(&mut line, &store)?;
    let lease =
        Lease { worker: name(), scorer_version: SCORER_VERSION, seconds: arguments.lease, attempts_max: *attempts };
    let stop = Arc::new(AtomicBool::new(false));
    let asked = Arc::clone(&stop);
    ctrlc::set_handler(move || asked.store(true, Ordering::Relaxed))
        .map_err(|e| Failure::wrong(format!("worker: it could not be ended: {e}")))?;
    let counters = Arc::new(Counters::default());
    if let Some(port) = arguments.metrics {
        let at = metrics::serve(port, Arc::clone(&counters))
            .map_err(|e| Failure::wrong(format!("--metrics: no-address: {e}")))?;
        eprintln!("http://{at}/metrics");
    }
    let held = Arc::new(Mutex::new(None));
    beat(line.another(), lease.clone(), Arc::clone(&held), Arc::clone(&stop));
    let bar = bar(0, "scored");
    let mut counted: Option<Instant> = None;
    let mut look = || -> Result<Looked, Unanswered> {
        let job = line.ask(|client| work::lease(client, &lease))?;
        // Counting reads every job there is: not for each of them.
        let is_empty = if job.is_none() || counted.is_none_or(|at| at.elapsed() > COUNT_EVERY) {
            let tally = line.ask(|client| work::tally(client, SCORER_VERSION))?;
            counted = Some(Instant::now());
            counters.set_queue(tally);
            bar.set_length(counters.scored.load(Ordering::Relaxed) + (tally.waiting + tally.leased) as u64);
            tally.waiting == 0 && tally.leased == 0
        } else {
            false
        };
        let Some(job) = job else { return Ok(if is_empty { Looked::Empty } else { Looked::Nothing }) };
        *lock(&held) = Some(job.session.clone());
        let done = turn(&mut line, &store, &lease, &job, &counters);
        *lock(&held) = None;
        done?;
        bar.set_position(counters.scored.load(Ordering::Relaxed));
        Ok(Looked::Worked)
    };
    let mut is_away = false;
    while !stop.load(Ordering::Relaxed) {
        match look() {
            Ok(Looked::Worked) => is_away = false,
            Ok(Looked::Empty) if *drain => break,
            Ok(Looked::Empty | Looked::Nothing) => nap(&stop),
            // The school's servers may be away for a while: a worker that stays waits for them, and says so once.
            Err(away) if away.is_passing() && !drain => {
                if !std::mem::replace(&mut is_away, true) {
                    Failure::from(away).tell();
                }
                nap(&stop);
            }
            Err(unanswered) => return Err(unanswered.into()),
        }
    }
    bar.finish_and_clear();
    let count = |of: &std::sync::atomic::AtomicU64| of.load(Ordering::Relaxed);
    say(format!(
        "{} scored, {} failed, {} set aside",
        count(&counters.scored),
        count(&counters.failed),
        count(&counters.set_aside)
    ))
}

/// What came of a look for work.
enum Looked {
    Worked,
    /// Nothing that is due, though something is leased or waits for its time.
    Nothing,
    /// Nothing at all.
    Empty,
}

/// What the worker is called in the records: nobody else is.
fn name() -> String {
    let mut chance = [0; 6];
    // Without chance the process's number must do.
    let _ = getrandom::fill(&mut chance);
    format!("{}-{}", std::process::id(), crate::scenario::hex(&chance))
}

/// Scores a session and writes down what came of it.
fn turn(line: &mut Line, store: &Store, lease: &Lease, job: &Job, counters: &Counters) -> Result<(), Unanswered> {
    let begun = Instant::now();
    let scored = store.take(&job.manifest, RECORDING).map_err(|(why, passing)| (why, !passing));
    let scored = scored.and_then(|bytes| rescored(&job.session, &bytes).map_err(|unscored| (unscored.0, true)));
    counters.add_seconds(begun.elapsed());
    match scored {
        Ok(result) => {
            let agrees = agrees(&job.written, &result);
            let first = line.ask(|client| work::finish(client, job, &result, agrees))?;
            counters.scored.fetch_add(u64::from(first), Ordering::Relaxed);
            if agrees == Some(false) {
                eprintln!("{}: differs: its station says another score; typodont verify says where", job.session);
            }
        }
        Err((why, hopeless)) => {
            let why = harmless(&why, 400);
            let pause = PAUSE_S * 2f64.powi(job.attempts - 1);
            let aside = line.ask(|client| work::fail(client, lease, job, &why, hopeless, pause))?;
            counters.failed.fetch_add(1, Ordering::Relaxed);
            counters.set_aside.fetch_add(u64::from(aside), Ordering::Relaxed);
            eprintln!("{}: {}: {why}", job.session, if aside { "set aside" } else { "tried again later" });
        }
    }
    Ok(())
}

/// Whether a station wrote what the recording gives; none where it scored by another version.
fn agrees(written: &str, result: &SessionFile) -> Option<bool> {
    let written: SessionFile = serde_json::from_str(written).ok()?;
    let same =
        written.metrics == result.metrics && written.grade == result.grade && written.participant == result.participant;
    (written.scorer_version == result.scorer_version).then_some(same)
}

/// Renews the lease of what is held, three times in a lease, on a line of its own.
fn beat(mut line: Line, lease: Lease, held: Arc<Mutex<Option<String>>>, stop: Arc<AtomicBool>) {
    let every = Duration::from_secs_f64(lease.seconds / 3.0);
    thread::spawn(move || {
        loop {
            thread::sleep(every);
            let session = lock(&held).clone();
            match session {
                // A beat that is lost is made up for by the next; a lease that is lost costs a second scoring, which changes nothing.
                Some(session) => drop(line.ask_once(|client| work::renew(client, &lease, &session))),
                None if stop.load(Ordering::Relaxed) => return,
                None => {}
            }
        }
    });
}

fn lock(held: &Mutex<Option<String>>) -> std::sync::MutexGuard<'_, Option<String>> {
    held.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Waits for work, and not for long if it is to end.
fn nap(stop: &AtomicBool) {
    let begun = Instant::now();
    while begun.elapsed() < LOOK_EVERY && !stop.load(Ordering::Relaxed) {
        thread::sleep(Duration::from_millis(50));
    }
}
