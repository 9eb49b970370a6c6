//! Tests of real-time code on computers that cannot guarantee real time.
//!
//! A virtual machine may stall for tens of milliseconds, and a core may be taken by another program. A driver then
//! switches the force off and reports it, which is correct and not a failure. A stopwatch therefore runs beside such a
//! test: a failure counts only if the computer itself kept time.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread;
use std::time::{Duration, Instant};

/// Delay of a wake-up from which the computer counts as stalled. The servo switches the force off when it is 10 ms
/// late, and a report passes several sleeping threads on its way.
const STALL: Duration = Duration::from_millis(2);

/// Number of attempts on a computer that stalls.
const TRIES: u32 = 5;

/// Runs a test. If it fails while the computer stalled, runs it again; prints SKIPPED after the last attempt.
pub fn in_real_time(test: impl Fn()) {
    for _ in 0..TRIES {
        let stopwatch = Stopwatch::start();
        let ended = catch_unwind(AssertUnwindSafe(&test));
        let worst = stopwatch.worst();
        match ended {
            Ok(()) => return,
            Err(failure) if worst < STALL => resume_unwind(failure),
            Err(_) => eprintln!("this failed while the machine stood still for {worst:?}: once more"),
        }
    }
    eprintln!("SKIPPED: this machine stalls whenever the test runs; let it run on a quiet one");
}

/// Measures the wake-up delay of ordinary threads on each core of the computer; a virtual core may stall while the
/// others run.
struct Stopwatch {
    cores: Vec<Arc<Core>>,
    is_over: Arc<AtomicBool>,
}

/// The sleeping thread of one core; times are in µs since `start`.
struct Core {
    start: Instant,
    asleep_since: AtomicU64,
    worst: AtomicU64,
}

const NAP: Duration = Duration::from_millis(1);

impl Stopwatch {
    fn start() -> Stopwatch {
        let is_over = Arc::new(AtomicBool::new(false));
        let count = thread::available_parallelism().map_or(1, |n| n.get());
        let cores = (0..count).map(|core| Core::watched(core, is_over.clone())).collect();
        Stopwatch { cores, is_over }
    }

    fn worst(&self) -> Duration {
        self.cores.iter().map(|core| core.worst()).max().unwrap_or_default()
    }
}

impl Core {
    fn watched(core: usize, is_over: Arc<AtomicBool>) -> Arc<Core> {
        let watched =
            Arc::new(Core { start: Instant::now(), asleep_since: AtomicU64::new(0), worst: AtomicU64::new(0) });
        let there = watched.clone();
        thread::spawn(move || {
            stay_on(core);
            while !is_over.load(Ordering::Relaxed) {
                there.asleep_since.store(there.now(), Ordering::Relaxed);
                thread::sleep(NAP);
                there.worst.fetch_max(there.overslept(), Ordering::Relaxed);
            }
        });
        watched
    }

    fn now(&self) -> u64 {
        self.start.elapsed().as_micros() as u64
    }

    fn overslept(&self) -> u64 {
        let since = self.asleep_since.load(Ordering::Relaxed);
        self.now().saturating_sub(since).saturating_sub(NAP.as_micros() as u64)
    }

    /// Longest delay so far, including that of a core that is stalled at present.
    fn worst(&self) -> Duration {
        Duration::from_micros(self.worst.load(Ordering::Relaxed).max(self.overslept()))
    }
}

/// Keeps the calling thread on a core, where the system can.
#[cfg(target_os = "linux")]
fn stay_on(core: usize) {
    let mut cores = rustix::thread::CpuSet::new();
    cores.set(core);
    let _ = rustix::thread::sched_setaffinity(None, &cores);
}

#[cfg(not(target_os = "linux"))]
fn stay_on(_core: usize) {}

impl Drop for Stopwatch {
    fn drop(&mut self) {
        self.is_over.store(true, Ordering::Relaxed);
    }
}
