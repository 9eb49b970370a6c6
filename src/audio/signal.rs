//! What every sound here is made of: noise, ramps, a filter, an angle that turns.

use std::f32::consts::{PI, TAU};

/// Chance that is the same for the same seed (xorshift; Marsaglia, *Xorshift RNGs*, 2003).
#[derive(Clone, Debug)]
pub struct Noise {
    state: u32,
}

impl Noise {
    pub fn new(seed: u64) -> Noise {
        // Neighbouring seeds are spread far apart, and none is zero, where the generator would stand still.
        let spread = seed.wrapping_add(1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        Noise { state: ((spread >> 32) as u32).max(1) }
    }

    pub fn bits(&mut self) -> u32 {
        self.state ^= self.state << 13;
        self.state ^= self.state >> 17;
        self.state ^= self.state << 5;
        self.state
    }

    /// White noise, −1 to 1.
    pub fn white(&mut self) -> f32 {
        self.bits() as i32 as f32 / i32::MAX as f32
    }
}

/// A value that goes to its goal in a straight line and arrives: a sound that fades ends in true silence.
#[derive(Clone, Debug, Default)]
pub struct Ramp {
    pub value: f32,
    /// What was aimed at.
    pub goal: f32,
    step: f32,
    left: u32,
}

impl Ramp {
    /// Stands at a value.
    pub fn at(value: f32) -> Ramp {
        Ramp { value, goal: value, ..Ramp::default() }
    }

    /// Sets out for a goal, to be reached after so many samples.
    pub fn aim(&mut self, goal: f32, samples: u32) {
        self.goal = goal;
        self.left = samples.max(1);
        self.step = (goal - self.value) / self.left as f32;
    }

    pub fn next(&mut self) -> f32 {
        if self.left > 0 {
            self.left -= 1;
            // Sums of small steps miss their goal by a hair, and a hair can be measured.
            self.value = if self.left == 0 { self.goal } else { self.value + self.step };
        }
        self.value
    }
}

/// What a filter lets through of one sample.
#[derive(Clone, Copy, Debug)]
pub struct Bands {
    pub low: f32,
    /// Unity at the centre.
    pub band: f32,
    pub high: f32,
}

/// A state-variable filter that may be retuned while it sounds (A. Simper, *Linear Trapezoidal Integrated State Variable
/// Filter*, Cytomic, 2013).
#[derive(Clone, Debug, Default)]
pub struct Filter {
    width: f32,
    a: [f32; 3],
    memory: [f32; 2],
}

impl Filter {
    /// Tunes to a centre in Hz and a quality (centre by width, 0.5 to 50). Centres beyond 0.45 of the rate are taken as that.
    pub fn tune(&mut self, centre: f32, quality: f32, rate: f32) {
        let g = (PI * (centre / rate).clamp(1e-5, 0.45)).tan();
        self.width = 1.0 / quality;
        let a1 = 1.0 / (1.0 + g * (g + self.width));
        self.a = [a1, g * a1, g * g * a1];
    }

    pub fn tuned(centre: f32, quality: f32, rate: f32) -> Filter {
        let mut filter = Filter::default();
        filter.tune(centre, quality, rate);
        filter
    }

    pub fn pass(&mut self, sample: f32) -> Bands {
        let [a1, a2, a3] = self.a;
        let [first, second] = self.memory;
        let rest = sample - second;
        let band = a1 * first + a2 * rest;
        let low = second + a2 * first + a3 * rest;
        self.memory = [2.0 * band - first, 2.0 * low - second];
        Bands { low, band: band * self.width, high: sample - self.width * band - low }
    }

    /// Forgets what it heard.
    pub fn rest(&mut self) {
        self.memory = [0.0; 2];
    }
}

/// An angle that turns, in turns from 0 to 1.
#[derive(Clone, Debug, Default)]
pub struct Turn {
    turns: f32,
}

impl Turn {
    /// Turns on by a frequency in Hz for one sample; true when a turn was completed.
    pub fn advance(&mut self, frequency: f32, rate: f32) -> bool {
        self.turns += frequency / rate;
        let is_over = self.turns >= 1.0;
        self.turns -= self.turns.floor();
        is_over
    }

    pub fn sine(&self) -> f32 {
        (TAU * self.turns).sin()
    }

    /// 0 to 1.
    pub fn turns(&self) -> f32 {
        self.turns
    }
}

/// So many samples in a time in seconds, at least one.
pub fn samples(seconds: f32, rate: f32) -> u32 {
    ((seconds * rate) as u32).max(1)
}

/// The share that is left of a distance after a time, when it falls to 1/e in `constant`; both in seconds.
pub fn decay(time: f32, constant: f32) -> f32 {
    (-time / constant).exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ramp_arrives_and_stays() {
        let mut ramp = Ramp::default();
        ramp.aim(0.3, 7);
        assert_eq!((0..7).map(|_| ramp.next()).last(), Some(0.3));
        ramp.aim(0.0, 11);
        assert!((0..11).map(|_| ramp.next()).all(|value| value >= 0.0));
        assert_eq!((ramp.next(), ramp.value), (0.0, 0.0));
    }

    #[test]
    fn a_filter_lets_its_centre_through_and_little_else() {
        // Aim: the filter's bands are where they are said to be. Method: the level of sines after it, an octave apart.
        let level = |frequency: f32| {
            let (mut filter, mut turn, mut peak) = (Filter::tuned(1000.0, 8.0, 48_000.0), Turn::default(), 0.0f32);
            for i in 0..48_000 {
                turn.advance(frequency, 48_000.0);
                let band = filter.pass(turn.sine()).band;
                peak = if i > 24_000 { peak.max(band.abs()) } else { 0.0 };
            }
            peak
        };
        assert!((level(1000.0) - 1.0).abs() < 0.02, "{}", level(1000.0));
        assert!(level(500.0) < 0.1 && level(2000.0) < 0.1, "{} {}", level(500.0), level(2000.0));
    }
}
