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
    /// When the next beat is due.
    due: Instant,
}

/// With priority the last stretch of a wait is spun: waking takes 30–100 µs and varies. Without it spinning is punished by
/// the scheduler (measured: p99 of 2.5 ms against 0.1 ms), so nothing is.
const SPIN: Duration = Duration::from_micros(80);

impl Pace {
    pub fn new(beat: Beat, priority: Priority) -> Pace {
        let spin = if priority == Priority::Realtime { SPIN } else { Duration::ZERO };
        Pace { beat, spin, due: Instant::now() + BEAT }
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

    /// A beat has come: counts how late, and says so.
    pub fn beat(&mut self, beats: &mut Beats) -> Duration {
        let now = Instant::now();
        let late = now.saturating_duration_since(self.due);
        beats.late.add(late);
        let whole = (late.as_secs_f64() / TICK_S) as u32;
        beats.missed += u64::from(whole);
        self.due = match self.beat {
            // Beats that never came are not made up for: the hand has moved on.
            Beat::Ours => self.due + BEAT * (whole + 1),
            Beat::Device => now + BEAT,
        };
        late
    }
}
