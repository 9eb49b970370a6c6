//! Building blocks of all sounds: noise, ramps, a filter, a phase accumulator.
//!
//! Takes and gives plain numbers, one sample at a time. Never allocates.

use std::f32::consts::{PI, TAU};

/// Random numbers that depend only on the seed (xorshift; Marsaglia, *Xorshift RNGs*, 2003).
#[derive(Clone, Debug)]
pub struct Noise {
    state: u32,
}

impl Noise {
    pub fn new(seed: u64) -> Noise {
        // Spread adjacent seeds far apart, and avoid zero, for which the generator would be stuck.
        let spread = seed.wrapping_add(1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        Noise { state: ((spread >> 32) as u32).max(1) }
    }

    pub fn next_u32(&mut self) -> u32 {
        self.state ^= self.state << 13;
        self.state ^= self.state >> 17;
        self.state ^= self.state << 5;
        self.state
    }

    /// Returns white noise, −1 to 1.
    pub fn white(&mut self) -> f32 {
        self.next_u32() as i32 as f32 / i32::MAX as f32
    }
}

/// A value that moves linearly to its goal and reaches it exactly, so that a fade ends in true silence.
#[derive(Clone, Debug, Default)]
pub struct Ramp {
    pub value: f32,
    /// Value at the end of the ramp.
    pub goal: f32,
    step: f32,
    left: u32,
}

impl Ramp {
    /// Creates a ramp that stays at a value.
    pub fn at(value: f32) -> Ramp {
        Ramp { value, goal: value, ..Ramp::default() }
    }

    /// Starts a ramp to a goal that is reached after this number of samples.
    pub fn ramp_to(&mut self, goal: f32, samples: u32) {
        self.goal = goal;
        self.left = samples.max(1);
        self.step = (goal - self.value) / self.left as f32;
    }

    pub fn next_value(&mut self) -> f32 {
        if self.left > 0 {
            self.left -= 1;
            // A sum of small steps would miss the goal by a rounding error, which could be measured.
            self.value = if self.left == 0 { self.goal } else { self.value + self.step };
        }
        self.value
    }
}

/// Outputs of a filter for one sample.
#[derive(Clone, Copy, Debug)]
pub struct Bands {
    pub low: f32,
    /// Unity gain at the centre.
    pub band: f32,
    pub high: f32,
}

/// A state-variable filter that may be retuned while running (A. Simper, *Linear Trapezoidal Integrated State
/// Variable Filter*, Cytomic, 2013).
#[derive(Clone, Debug, Default)]
pub struct StateVariableFilter {
    width: f32,
    a: [f32; 3],
    memory: [f32; 2],
}

impl StateVariableFilter {
    /// Tunes to a centre, Hz, and a quality (centre divided by width, 0.5 to 50). The centre is limited to 0.45 of
    /// the rate.
    pub fn tune(&mut self, centre: f32, quality: f32, rate: f32) {
        let g = (PI * (centre / rate).clamp(1e-5, 0.45)).tan();
        self.width = 1.0 / quality;
        let a1 = 1.0 / (1.0 + g * (g + self.width));
        self.a = [a1, g * a1, g * g * a1];
    }

    pub fn tuned(centre: f32, quality: f32, rate: f32) -> StateVariableFilter {
        let mut filter = StateVariableFilter::default();
        filter.tune(centre, quality, rate);
        filter
    }

    pub fn process(&mut self, sample: f32) -> Bands {
        let [a1, a2, a3] = self.a;
        let [first, second] = self.memory;
        let residual = sample - second;
        let band = a1 * first + a2 * residual;
        let low = second + a2 * first + a3 * residual;
        self.memory = [2.0 * band - first, 2.0 * low - second];
        Bands { low, band: band * self.width, high: sample - self.width * band - low }
    }

    /// Clears the filter's memory.
    pub fn reset(&mut self) {
        self.memory = [0.0; 2];
    }
}

/// Phase of an oscillator, in revolutions from 0 to 1.
#[derive(Clone, Debug, Default)]
pub struct PhaseAccumulator {
    phase: f32,
}

impl PhaseAccumulator {
    /// Advances by one sample at a frequency in Hz; returns true when a revolution is complete.
    pub fn advance(&mut self, frequency: f32, rate: f32) -> bool {
        self.phase += frequency / rate;
        let is_over = self.phase >= 1.0;
        self.phase -= self.phase.floor();
        is_over
    }

    pub fn sine(&self) -> f32 {
        (TAU * self.phase).sin()
    }

    /// Returns the phase, 0 to 1.
    pub fn phase(&self) -> f32 {
        self.phase
    }
}

/// Returns the number of samples in a time in seconds, at least one.
pub fn sample_count(seconds: f32, rate: f32) -> u32 {
    ((seconds * rate) as u32).max(1)
}

/// Returns the fraction of a difference that is left after `time` if it decays to 1/e in `constant`; both in seconds.
pub fn decay_factor(time: f32, constant: f32) -> f32 {
    (-time / constant).exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ramp_arrives_and_stays() {
        let mut ramp = Ramp::default();
        ramp.ramp_to(0.3, 7);
        assert_eq!((0..7).map(|_| ramp.next_value()).last(), Some(0.3));
        ramp.ramp_to(0.0, 11);
        assert!((0..11).map(|_| ramp.next_value()).all(|value| value >= 0.0));
        assert_eq!((ramp.next_value(), ramp.value), (0.0, 0.0));
    }

    #[test]
    fn a_filter_passes_its_centre_and_little_else() {
        // Aim: the filter's bands are where they should be. Method: the level of filtered sines, an octave apart.
        let level = |frequency: f32| {
            let (mut filter, mut phase, mut peak) =
                (StateVariableFilter::tuned(1000.0, 8.0, 48_000.0), PhaseAccumulator::default(), 0.0f32);
            for i in 0..48_000 {
                phase.advance(frequency, 48_000.0);
                let band = filter.process(phase.sine()).band;
                peak = if i > 24_000 { peak.max(band.abs()) } else { 0.0 };
            }
            peak
        };
        assert!((level(1000.0) - 1.0).abs() < 0.02, "{}", level(1000.0));
        assert!(level(500.0) < 0.1 && level(2000.0) < 0.1, "{} {}", level(500.0), level(2000.0));
    }
}
