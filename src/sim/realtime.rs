//! Priority for the servo's thread, as much as the system grants.
//!
//! Gives what was granted, so that nobody believes to have what they have not.

use std::fmt;

/// What the system granted the servo's thread.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Priority {
    /// Ahead of every ordinary thread (SCHED_FIFO on Linux; TIME_CRITICAL on Windows).
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
    match raise_to_realtime() {
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
