//! Recorded sounds that replace synthesised ones.
//!
//! Takes samples at any rate. Gives them at the output's rate, once or in a loop. Never reads files.

use super::cries::CRIES;
use rubato::audioadapter_buffers::direct::InterleavedSlice;
use rubato::{Fft, FixedSync, Resampler};

/// A mono recording.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Clip {
    /// Sample rate, Hz, 8 000 to 192 000.
    pub rate: u32,
    /// Samples, −1 to 1.
    pub samples: Vec<f32>,
}

/// Recordings that a school provides; where there is none, the synthesised sound is played.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Replacements {
    /// A handpiece running freely, played in a loop and more slowly under load.
    pub handpiece: Option<Clip>,
    /// The suction, played in a loop.
    pub suction: Option<Clip>,
    /// The cries, in the order of their files.
    pub cries: [Option<Clip>; CRIES],
}

impl Clip {
    /// Returns the samples at another rate, Hz, at the same level.
    pub(super) fn at_rate(&self, rate: u32) -> Vec<f32> {
        if rate == self.rate || self.samples.is_empty() {
            return self.samples.clone();
        }
        self.resampled(rate).unwrap_or_default()
    }

    /// Returns `None` only for a rate of zero, which no clip and no output has.
    fn resampled(&self, rate: u32) -> Option<Vec<f32>> {
        /// Frames per step, as rubato recommends for whole clips.
        const CHUNK: usize = 1024;
        let mut resampler = Fft::new(self.rate as usize, rate as usize, CHUNK, 1, FixedSync::Both).ok()?;
        let frames = self.samples.len();
        let input = InterleavedSlice::new(&self.samples, 1, frames).ok()?;
        Some(resampler.process_all(&input, frames, None).ok()?.take_data())
    }
}

/// Part of a loop's end that is cross-faded into its beginning, as a fraction of its length, so that the seam is
/// inaudible.
const SEAM: f32 = 0.1;

/// Samples played in a loop, at any speed.
#[derive(Clone, Debug)]
pub struct LoopedClip {
    samples: Vec<f32>,
    position: f64,
}

impl LoopedClip {
    /// Creates a loop at `rate` Hz; `None` if the clip is too short.
    pub fn new(clip: &Clip, rate: u32) -> Option<LoopedClip> {
        let mut samples = clip.at_rate(rate);
        let seam = (samples.len() as f32 * SEAM) as usize;
        let length = samples.len() - seam;
        for i in 0..seam {
            // Equal power, because the two ends of a noise are uncorrelated.
            let angle = std::f32::consts::FRAC_PI_2 * (i as f32 / seam as f32);
            samples[i] = samples[i] * angle.sin() + samples[length + i] * angle.cos();
        }
        samples.truncate(length);
        (samples.len() > 1).then_some(LoopedClip { samples, position: 0.0 })
    }

    /// Returns the next sample; a `speed` of 1 plays as recorded.
    pub fn next_sample(&mut self, speed: f32) -> f32 {
        let count = self.samples.len();
        let before = self.position as usize % count;
        let fraction = (self.position - self.position.floor()) as f32;
        let sample = self.samples[before] + fraction * (self.samples[(before + 1) % count] - self.samples[before]);
        self.position = (self.position + f64::from(speed)) % count as f64;
        sample
    }
}
