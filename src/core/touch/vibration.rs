//! Vibration of a running bur in matter (thesis 5.4).

use crate::frame::Vec3;
use crate::tick::Tick;

/// Sinusoidal force that is added while matter is being cut.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vibration {
    /// Frequency, Hz, up to half the servo rate; 500 in the thesis.
    pub frequency: f32,
    /// Amplitude, N; 0.3 in the thesis.
    pub amplitude: f32,
    /// Unit direction in world space; along y in the thesis.
    pub axis: Vec3,
}

impl Vibration {
    pub const NONE: Vibration = Vibration { frequency: 0.0, amplitude: 0.0, axis: Vec3::Y };

    /// Returns the force at a tick, N, world space.
    ///
    /// A cosine: at 500 Hz every tick hits a crest, with alternating sign; a sine would be zero at every tick.
    pub fn force(&self, tick: Tick) -> Vec3 {
        let cycles = f64::from(self.frequency) * tick.seconds();
        // Whole cycles are removed in f64, so that the phase is still exact an hour into a session.
        let phase = (cycles - cycles.floor()) as f32 * core::f32::consts::TAU;
        self.axis * (self.amplitude * libm::cosf(phase))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn five_hundred_hertz_alternates_every_tick() {
        let vibration = Vibration { frequency: 500.0, amplitude: 0.3, axis: Vec3::Y };
        for tick in [0, 1, 2, 3, 3_600_000, 3_600_001] {
            let expected = if tick % 2 == 0 { 0.3 } else { -0.3 };
            assert!((vibration.force(Tick(tick)).y - expected).abs() < 1e-5, "tick {tick}");
        }
    }
}
