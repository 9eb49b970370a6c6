//! Recorded sounds that take the place of synthesised ones.

use super::cries::CRIES;
use rubato::audioadapter_buffers::direct::InterleavedSlice;
use rubato::{Fft, FixedSync, Resampler};

/// A recording, one channel.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Clip {
    /// Hz, 8 000 to 192 000.
    pub rate: u32,
    /// −1 to 1.
    pub samples: Vec<f32>,
}

/// What a school brings of its own; where there is none the synthesised sound is heard.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Replacements {
    /// A handpiece running free, played in a loop and slower under load.
    pub handpiece: Option<Clip>,
    /// Played in a loop.
    pub suction: Option<Clip>,
    pub cries: [Option<Clip>; CRIES],
}

impl Clip {
    /// The samples at another rate, Hz, as loud as they are.
    pub(super) fn at_rate(&self, rate: u32) -> Vec<f32> {
        if rate == self.rate || self.samples.is_empty() {
            return self.samples.clone();
        }
        self.resampled(rate).unwrap_or_default()
    }

    /// `None` only for a rate of zero, which no clip and no output has.
    fn resampled(&self, rate: u32) -> Option<Vec<f32>> {
        /// Frames at once; rubato's own advice for whole clips.
        const CHUNK: usize = 1024;
        let mut resampler = Fft::new(self.rate as usize, rate as usize, CHUNK, 1, FixedSync::Both).ok()?;
        let frames = self.samples.len();
        let input = InterleavedSlice::new(&self.samples, 1, frames).ok()?;
        Some(resampler.process_all(&input, frames, None).ok()?.take_data())
    }
}

/// How much of a loop's end is faded into its beginning, of its length: the seam is not heard.
const SEAM: f32 = 0.1;

/// Samples that go round, at any speed.
#[derive(Clone, Debug)]
pub struct Loop {
    samples: Vec<f32>,
    place: f64,
}

impl Loop {
    /// `None` of a clip too short to go round.
    pub fn of(clip: &Clip, rate: u32) -> Option<Loop> {
        let mut samples = clip.at_rate(rate);
        let seam = (samples.len() as f32 * SEAM) as usize;
        let kept = samples.len() - seam;
        for i in 0..seam {
            // Equal power: the ends of a noise are strangers to each other.
            let way = std::f32::consts::FRAC_PI_2 * (i as f32 / seam as f32);
            samples[i] = samples[i] * way.sin() + samples[kept + i] * way.cos();
        }
        samples.truncate(kept);
        (samples.len() > 1).then_some(Loop { samples, place: 0.0 })
    }

    /// The next sample; `speed` 1 plays as recorded.
    pub fn next(&mut self, speed: f32) -> f32 {
        let count = self.samples.len();
        let before = self.place as usize % count;
        let way = (self.place - self.place.floor()) as f32;
        let sample = self.samples[before] + way * (self.samples[(before + 1) % count] - self.samples[before]);
        self.place = (self.place + f64::from(speed)) % count as f64;
        sample
    }
}
