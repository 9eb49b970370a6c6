//! A force on its way from the servo to a device, and the one place that decides when it is too old to be rendered.
//!
//! Takes outputs from one thread, gives the newest to another. Never waits, never allocates.

use super::Output;
use crate::frame::Vec3;
use crate::mailbox::Newest;
use std::time::{Duration, Instant};

/// How long a force may be sent after the servo gave it: ten beats. Longer, and a stalled program pushes a hand on; much
/// shorter, and every hiccup of a busy machine is felt.
pub const FORCE_LIFE: Duration = Duration::from_millis(10);

/// The newest output, with when it was told.
pub(super) struct Told {
    /// Force and torque, 6 floats; when they were told, µs since `epoch`, low and high word.
    words: Newest<8>,
    epoch: Instant,
}

impl Told {
    pub fn new() -> Told {
        Told { words: Newest::new(), epoch: Instant::now() }
    }

    /// Tells an output. Only one thread may do so.
    pub fn tell(&self, output: &Output) {
        let Output { force, torque } = output;
        let [a, b, c, d, e, f] = [force.x, force.y, force.z, torque.x, torque.y, torque.z].map(f32::to_bits);
        let now_us = self.now_us();
        self.words.write([a, b, c, d, e, f, now_us as u32, (now_us >> 32) as u32]);
    }

    /// The newest output; none when it is older than [`FORCE_LIFE`].
    pub fn output(&self) -> Output {
        let Some((_, words)) = self.words.read() else { return Output::NONE };
        let told_us = u64::from(words[6]) | u64::from(words[7]) << 32;
        if self.now_us().saturating_sub(told_us) >= FORCE_LIFE.as_micros() as u64 {
            return Output::NONE;
        }
        let [a, b, c, d, e, f, ..] = words.map(f32::from_bits);
        Output { force: Vec3::new(a, b, c), torque: Vec3::new(d, e, f) }
    }

    /// How often something was told.
    pub fn count(&self) -> u64 {
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
        let told = Told::new();
        assert_eq!((told.output(), told.count()), (Output::NONE, 0));
        let output = Output { force: Vec3::new(0.5, -1.0, 2.0), torque: Vec3::X };
        // A loaded machine may be away for longer than a force lives: tell until one was heard in time.
        assert!((0..1000).any(|_| {
            told.tell(&output);
            told.output() == output
        }));
        std::thread::sleep(FORCE_LIFE);
        assert_eq!(told.output(), Output::NONE);
    }
}
