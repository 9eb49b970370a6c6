//! Slot that carries the newest force from the servo to a device thread, and drops it when it is too old to be
//! rendered.
//!
//! Takes outputs from one thread; gives the newest one to another. Never waits, never allocates.

use typodont_core::device::Wrench;
use typodont_core::frame::Vec3;
use typodont_core::mailbox::SeqLock;
use web_time::{Duration, Instant};

/// Longest time for which a force may be sent after the servo wrote it: ten ticks. With a longer time, a stalled
/// program would keep pushing the hand; with a much shorter one, every short delay of a busy machine could be felt.
pub const FORCE_LIFE: Duration = Duration::from_millis(10);

/// The newest output and the time at which it was written.
pub(super) struct ForceSlot {
    /// Force and torque as six floats, then the time of writing, µs since `epoch`, as low and high word.
    words: SeqLock<8>,
    epoch: Instant,
}

impl ForceSlot {
    pub fn new() -> ForceSlot {
        ForceSlot { words: SeqLock::new(), epoch: Instant::now() }
    }

    /// Writes an output. Only one thread may call this.
    pub fn write(&self, output: &Wrench) {
        let Wrench { force, torque } = output;
        let [a, b, c, d, e, f] = [force.x, force.y, force.z, torque.x, torque.y, torque.z].map(f32::to_bits);
        let now_us = self.now_us();
        self.words.write([a, b, c, d, e, f, now_us as u32, (now_us >> 32) as u32]);
    }

    /// Returns the newest output, or [`Wrench::ZERO`] if it is older than [`FORCE_LIFE`].
    pub fn latest(&self) -> Wrench {
        let Some((_, words)) = self.words.read() else { return Wrench::ZERO };
        let written_us = u64::from(words[6]) | u64::from(words[7]) << 32;
        if self.now_us().saturating_sub(written_us) >= FORCE_LIFE.as_micros() as u64 {
            return Wrench::ZERO;
        }
        let [a, b, c, d, e, f, ..] = words.map(f32::from_bits);
        Wrench { force: Vec3::new(a, b, c), torque: Vec3::new(d, e, f) }
    }

    /// Returns the number of outputs written so far.
    pub fn write_count(&self) -> u64 {
        self.words.read().map_or(0, |(count, _)| count)
    }

    fn now_us(&self) -> u64 {
        self.epoch.elapsed().as_micros() as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_old_force_is_none() {
        let slot = ForceSlot::new();
        assert_eq!((slot.latest(), slot.write_count()), (Wrench::ZERO, 0));
        let output = Wrench { force: Vec3::new(0.5, -1.0, 2.0), torque: Vec3::X };
        // On a busy machine this thread may pause for longer than `FORCE_LIFE`: write until one output is read in
        // time.
        assert!((0..1000).any(|_| {
            slot.write(&output);
            slot.latest() == output
        }));
        std::thread::sleep(FORCE_LIFE);
        assert_eq!(slot.latest(), Wrench::ZERO);
    }
}
