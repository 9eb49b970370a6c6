//! The beat of 1 kHz: kept by a timer, or measured where a device keeps it.
//!
//! Looks at a monotonic clock; never at the time of day.

use super::beats::Beats;
use crate::device::Beat;
use crate::device::realtime::Priority;
use crate::tick::TICK_S;
use std::thread;
use std::time::{Duration, Instant};

const BEAT: Duration = Duration::from_micros((TICK_S * 1e6) as u64);

/// Keeps the beat, or measures it where the device keeps it.
pub(super) struct Pace {
    beat: Beat,
    /// End of a wait that is spun instead of slept.
    spin: Duration,
    /// When the next tick is due. Ticks are milliseconds of this clock, whoever keeps the beat.
    due: Instant,
    /// When the last beat came.
    last: Instant,
}

/// A beat of a device that comes earlier than this turns no tick: a device that runs faster than 1 kHz must not make a
/// session's time run faster.
const EARLY: Duration = Duration::from_micros(500);

/// With priority the last stretch of a wait is spun: waking takes 30–100 µs and varies. Without it spinning is punished by
/// the scheduler (measured: p99 of 2.5 ms against 0.1 ms), so nothing is.
const SPIN: Duration = Duration::from_micros(80);

impl Pace {
    pub fn new(beat: Beat, priority: Priority) -> Pace {
        let spin = if priority == Priority::Realtime { SPIN } else { Duration::ZERO };
        let now = Instant::now();
        Pace { beat, spin, due: now + BEAT, last: now }
    }

    /// Waits until the next beat is due, where the device does not do that.
    pub fn wait(&self) {
        if self.beat == Beat::Device {
            return;
        }
        let left = self.due.saturating_duration_since(Instant::now());
        if left > self.spin {
            thread::sleep(left - self.spin);
        }
        while Instant::now() < self.due {
            std::hint::spin_loop();
        }
    }

    /// A beat has come: counts how late, and says so; `None` for one that comes before its tick is due.
    ///
    /// A device's own beat is late by how much longer it took than a millisecond; beats are missed by the clock.
    pub fn beat(&mut self, beats: &mut Beats) -> Option<Duration> {
        let now = Instant::now();
        if now + EARLY < self.due {
            return None;
        }
        let behind = now.saturating_duration_since(self.due);
        let late = match self.beat {
            Beat::Ours => behind,
            Beat::Device => now.saturating_duration_since(self.last + BEAT),
        };
        beats.late.add(late);
        // Beats that never came are not made up for: the hand has moved on.
        let whole = (behind.as_secs_f64() / TICK_S) as u32;
        beats.missed += u64::from(whole);
        self.due += BEAT * (whole + 1);
        self.last = now;
        Some(late)
    }
}
