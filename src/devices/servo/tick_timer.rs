//! Timer for the 1 kHz ticks, or a measurement of them where the device sets the pace.
//!
//! Takes a device and the priority of the thread. Gives the lateness of each tick. Never reads the time
//! of day, only a monotonic clock.

use crate::realtime::Priority;
use crate::servo::timing::TimingStats;
use std::thread;
use typodont_core::device::{Device, Pacing};
use typodont_core::tick::TICK_S;
use web_time::{Duration, Instant};

const TICK_INTERVAL: Duration = Duration::from_micros((TICK_S * 1e6) as u64);

/// Keeps the pace, or measures it where the device keeps it.
pub(super) struct TickTimer {
    pacing: Pacing,
    /// Last part of a wait, which is spun instead of slept.
    spin_time: Duration,
    /// Time at which the next tick is due. A tick is a millisecond of this clock, for either pacing.
    next_due: Instant,
    /// Time of the last tick.
    last_tick: Instant,
}

/// Time before a tick is due at which a report is too early to count as that tick: a device faster than 1 kHz must
/// not make the time of a session run faster.
const EARLY_MARGIN: Duration = Duration::from_micros(500);

/// Duration of spinning at the end of a wait, with real-time priority: waking up takes 30–100 µs and varies. Without
/// priority, the scheduler penalises spinning (measured: p99 of 2.5 ms instead of 0.1 ms), so the whole wait is
/// slept; so it is for a device whose force nobody feels.
const SPIN_TIME: Duration = Duration::from_micros(80);

impl TickTimer {
    pub fn new(device: &dyn Device, priority: Priority) -> TickTimer {
        let spins = priority == Priority::Realtime && device.renders_force();
        let spin_time = if spins { SPIN_TIME } else { Duration::ZERO };
        let now = Instant::now();
        TickTimer { pacing: device.pacing(), spin_time, next_due: now + TICK_INTERVAL, last_tick: now }
    }

    /// Waits until the next tick is due, unless the device sets the pace.
    pub fn wait(&self) {
        if self.pacing == Pacing::Device {
            return;
        }
        let left = self.next_due.saturating_duration_since(Instant::now());
        if left > self.spin_time {
            thread::sleep(left - self.spin_time);
        }
        while Instant::now() < self.next_due {
            std::hint::spin_loop();
        }
    }

    /// Returns the number of ticks that are due and have not run, at most `most`, and the lateness of the oldest of all;
    /// records the lateness of each. The oldest beyond `most` are skipped and counted as missed.
    pub fn ticks_due(&mut self, most: u32, stats: &mut TimingStats) -> (u32, Duration) {
        let now = Instant::now();
        let Some(behind) = now.checked_duration_since(self.next_due) else { return (0, Duration::ZERO) };
        let due = (behind.as_secs_f64() / TICK_S) as u32 + 1;
        let run = due.min(most);
        stats.missed += u64::from(due - run);
        self.next_due += TICK_INTERVAL * (due - run);
        for _ in 0..run {
            stats.late.add(now.saturating_duration_since(self.next_due));
            self.next_due += TICK_INTERVAL;
        }
        self.last_tick = now;
        (run, behind)
    }

    /// Records that a tick was reached. Returns its lateness, or `None` if it comes before it is due.
    ///
    /// With [`Pacing::Device`] the lateness is the excess of the interval over a millisecond; missed ticks follow
    /// from the clock.
    pub fn tick_due(&mut self, stats: &mut TimingStats) -> Option<Duration> {
        let now = Instant::now();
        if now + EARLY_MARGIN < self.next_due {
            return None;
        }
        let behind = now.saturating_duration_since(self.next_due);
        let late = match self.pacing {
            Pacing::Host => behind,
            Pacing::Device => now.saturating_duration_since(self.last_tick + TICK_INTERVAL),
        };
        stats.late.add(late);
        // Missed ticks are not made up for: the hand has moved on.
        let missed = (behind.as_secs_f64() / TICK_S) as u32;
        stats.missed += u64::from(missed);
        self.next_due += TICK_INTERVAL * (missed + 1);
        self.last_tick = now;
        Some(late)
    }
}
