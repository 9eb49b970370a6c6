//! Real-time priority for the servo thread and the device threads, as far as the system allows.
//!
//! Takes the calling thread. Gives the priority that was granted. Never assumes that a request succeeded.

use std::fmt;

/// Priority that the system granted to a thread.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Priority {
    /// Ahead of all ordinary threads (SCHED_FIFO on Linux, SCHED_RR where rtkit grants it; TIME_CRITICAL on Windows).
    Realtime,
    /// Same as all other threads: ticks will be late on a busy machine.
    Ordinary,
}

impl fmt::Display for Priority {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(match self {
            Priority::Realtime => "real-time priority",
            Priority::Ordinary => "ordinary priority: ticks may be late on a busy machine",
        })
    }
}

/// Priority that the system grants to a servo: asked for by a thread of its own, which then ends.
pub fn granted_priority() -> Priority {
    let thread = std::thread::Builder::new().name("priority".into()).spawn(raise_thread_priority);
    thread.ok().and_then(|thread| thread.join().ok()).unwrap_or(Priority::Ordinary)
}

/// Raises the priority of the calling thread as far as the system allows.
pub fn raise_thread_priority() -> Priority {
    set_min_timer_slack();
    match raise_to_realtime() || ask_rtkit() {
        true => Priority::Realtime,
        false => Priority::Ordinary,
    }
}

/// Below sound servers (70–90) and above everything ordinary: a stalled sound would be heard, and a stalled window
/// seen.
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

#[cfg(windows)]
fn raise_to_realtime() -> bool {
    thread_priority::set_current_thread_priority(thread_priority::ThreadPriority::Max).is_ok()
}

#[cfg(not(any(unix, windows)))]
fn raise_to_realtime() -> bool {
    false
}

/// Sets the timer slack to its minimum. Linux lets ordinary threads oversleep by 50 µs to save power: 5 % of a tick.
#[cfg(target_os = "linux")]
fn set_min_timer_slack() {
    let least = std::num::NonZeroU64::MIN;
    // If the kernel refuses, ticks are late by up to the slack, and the timing statistics show it.
    let _ = rustix::thread::set_current_timer_slack(Some(least));
}

#[cfg(not(target_os = "linux"))]
fn set_min_timer_slack() {}

/// Asks RealtimeKit, which desktops run for their sound servers, where the system does not let a user's thread raise
/// its own priority. RealtimeKit grants SCHED_RR up to priority 20 and first requires a limit: a thread that computes
/// for 200 ms without waiting may be killed. The servo waits after every tick or batch of ticks, which take
/// a few milliseconds at most.
#[cfg(target_os = "linux")]
fn ask_rtkit() -> bool {
    use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
    const BUS_NAME: &str = "org.freedesktop.RealtimeKit1";
    const PATH: &str = "/org/freedesktop/RealtimeKit1";
    /// µs of computing without waiting; the default upper limit of rtkit.
    const RTTIME_MAX: u64 = 200_000;
    const PRIORITY: u32 = 10;
    /// A bus that does not reply must not keep the servo from starting.
    const REPLY_TIMEOUT: std::time::Duration = std::time::Duration::from_secs(2);
    let before = getrlimit(Resource::Rttime);
    let most = before.maximum.map_or(RTTIME_MAX, |most| most.min(RTTIME_MAX));
    if setrlimit(Resource::Rttime, Rlimit { current: Some(most), maximum: Some(most) }).is_err() {
        return false;
    }
    let thread = rustix::thread::gettid().as_raw_nonzero().get() as u64;
    let granted = zbus::block_on(async {
        let bus = zbus::connection::Builder::system().method_timeout(REPLY_TIMEOUT).build().await?;
        bus.call_method(Some(BUS_NAME), PATH, Some(BUS_NAME), "MakeThreadRealtime", &(thread, PRIORITY)).await
    });
    if granted.is_err() {
        // Without the priority, the limit is not needed. If it cannot be lifted, that does not harm an ordinary
        // thread.
        let _ = setrlimit(Resource::Rttime, before);
    }
    granted.is_ok()
}

#[cfg(not(target_os = "linux"))]
fn ask_rtkit() -> bool {
    false
}
