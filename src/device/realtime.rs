//! Priority for the threads that keep the beat: the servo's and the wires', as much as the system grants.
//!
//! Gives what was granted, so that nobody believes to have what they have not.

use std::fmt;

/// What the system granted a thread.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Priority {
    /// Ahead of every ordinary thread (SCHED_FIFO on Linux, SCHED_RR where rtkit grants it; TIME_CRITICAL on Windows).
    Realtime,
    /// Like every other: beats will come late on a busy machine.
    Ordinary,
}

impl fmt::Display for Priority {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(match self {
            Priority::Realtime => "real-time priority",
            Priority::Ordinary => "ordinary priority: beats may come late on a busy machine",
        })
    }
}

/// Raises the calling thread as far as the system lets it.
pub fn raise() -> Priority {
    slacken_no_timer();
    match raise_to_realtime() || ask_rtkit() {
        true => Priority::Realtime,
        false => Priority::Ordinary,
    }
}

/// Below sound servers (which take 70–90) and above everything ordinary: a stalled sound is heard, a stalled window seen.
#[cfg(unix)]
const FIFO_PRIORITY: u8 = 20;

#[cfg(unix)]
fn raise_to_realtime() -> bool {
    use thread_priority::unix::{set_thread_priority_and_policy, thread_native_id};
    use thread_priority::{RealtimeThreadSchedulePolicy, ThreadPriority, ThreadPriorityValue, ThreadSchedulePolicy};
    let Ok(value) = ThreadPriorityValue::try_from(FIFO_PRIORITY) else { return false };
    let policy = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
    set_thread_priority_and_policy(thread_native_id(), ThreadPriority::Crossplatform(value), policy).is_ok()
}

#[cfg(not(unix))]
fn raise_to_realtime() -> bool {
    thread_priority::set_current_thread_priority(thread_priority::ThreadPriority::Max).is_ok()
}

/// Linux lets ordinary threads oversleep by 50 µs to save power; here that is a twentieth of a beat.
#[cfg(target_os = "linux")]
fn slacken_no_timer() {
    let least = std::num::NonZeroU64::MIN;
    // A kernel that refuses keeps its slack: beats are then late by that much, and counted so.
    let _ = rustix::thread::set_current_timer_slack(Some(least));
}

#[cfg(not(target_os = "linux"))]
fn slacken_no_timer() {}

/// Asks RealtimeKit, which desktops run for their sound servers, when the system does not let a user's thread ahead by
/// itself. It grants SCHED_RR up to priority 20, and wants a promise before: a thread that computes for 200 ms without once
/// waiting may be killed. The servo waits every millisecond.
#[cfg(target_os = "linux")]
fn ask_rtkit() -> bool {
    use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
    const BUS_NAME: &str = "org.freedesktop.RealtimeKit1";
    const PATH: &str = "/org/freedesktop/RealtimeKit1";
    /// µs of computing without a wait; rtkit's default upper bound.
    const RTTIME_MAX: u64 = 200_000;
    const PRIORITY: u32 = 10;
    /// A bus that does not answer must not keep the servo from starting.
    const PATIENCE: std::time::Duration = std::time::Duration::from_secs(2);
    let before = getrlimit(Resource::Rttime);
    let most = before.maximum.map_or(RTTIME_MAX, |most| most.min(RTTIME_MAX));
    if setrlimit(Resource::Rttime, Rlimit { current: Some(most), maximum: Some(most) }).is_err() {
        return false;
    }
    let thread = rustix::thread::gettid().as_raw_nonzero().get() as u64;
    let asked = zbus::block_on(async {
        let bus = zbus::connection::Builder::system().method_timeout(PATIENCE).build().await?;
        bus.call_method(Some(BUS_NAME), PATH, Some(BUS_NAME), "MakeThreadRealtime", &(thread, PRIORITY)).await
    });
    if asked.is_err() {
        // No priority, no promise. A limit that cannot be lifted again does not harm an ordinary thread.
        let _ = setrlimit(Resource::Rttime, before);
    }
    asked.is_ok()
}

#[cfg(not(target_os = "linux"))]
fn ask_rtkit() -> bool {
    false
}
