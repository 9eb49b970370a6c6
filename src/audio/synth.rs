//! The synthesiser: all sounds together, sample by sample.
//!
//! Takes loads and cries. Gives samples. Never allocates after its creation.

use super::airflow::AirflowSound;
use super::clip::{LoopedClip, Replacements};
use super::contact_sound::ContactSound;
use super::cries::Cries;
use super::handpiece::HandpieceSound;
use super::load::DrillLoad;

/// Options of a synthesiser.
#[derive(Clone, Debug, PartialEq)]
pub struct SynthOptions {
    /// Sample rate, Hz, 8 000 to 192 000.
    pub rate: u32,
    /// Selects the noise, and the order of the cries.
    pub seed: u64,
    pub replacements: Replacements,
}

impl Default for SynthOptions {
    fn default() -> Self {
        SynthOptions { rate: 48_000, seed: 0, replacements: Replacements::default() }
    }
}

/// Samples between two updates from the load. At 48 kHz that is a third of a millisecond.
const CONTROL_SAMPLES: u32 = 16;

/// Level above which the sum is compressed, not clipped, so that it stays below full scale.
const KNEE: f32 = 0.7;

/// Synthesises the sound of a load.
///
/// For a seed, the same loads at the same samples give the same output, for all blocks whose length is a multiple of
/// 16.
pub struct Synth {
    /// Time between two updates from the load, s.
    control_period: f32,
    samples_left: u32,
    handpiece: HandpieceSound,
    contact: ContactSound,
    airflow: AirflowSound,
    cries: Cries,
}

impl Synth {
    /// Creates a synthesiser. Takes some tens of milliseconds, because every cry is synthesised in advance.
    pub fn new(options: &SynthOptions) -> Synth {
        let SynthOptions { rate, seed, replacements } = options;
        let looped = |clip: &Option<_>| clip.as_ref().and_then(|clip| LoopedClip::new(clip, *rate));
        let hertz = *rate as f32;
        // Each sound has its own noise; otherwise they would be correlated.
        let seed_of = |voice: u64| seed.wrapping_mul(4).wrapping_add(voice);
        Synth {
            control_period: CONTROL_SAMPLES as f32 / hertz,
            samples_left: 0,
            handpiece: HandpieceSound::new(hertz, seed_of(0), looped(&replacements.handpiece)),
            contact: ContactSound::new(hertz, seed_of(1)),
            airflow: AirflowSound::new(hertz, seed_of(2), looped(&replacements.suction)),
            cries: Cries::new(*rate, seed_of(3), replacements),
        }
    }

    /// Fills a block with the sound of the load, mono, −1 to 1. Never allocates.
    pub fn fill(&mut self, load: &DrillLoad, block: &mut [f32]) {
        let load = load.clamped();
        for sample in block {
            if self.samples_left == 0 {
                self.samples_left = CONTROL_SAMPLES;
                self.handpiece.follow(&load, self.control_period);
                self.contact.follow(&load, &self.handpiece, self.control_period);
                self.airflow.follow(&load);
            }
            self.samples_left -= 1;
            *sample = soft_clip(
                self.handpiece.next_sample()
                    + self.contact.next_sample()
                    + self.airflow.next_sample()
                    + self.cries.next_sample(),
            );
        }
    }

    /// Starts a cry of the patient, unless one is being played: chosen by the seed, never the last one again.
    /// `strength` is from 0, faint, to 1.
    pub fn cry(&mut self, strength: f32) {
        self.cries.start(strength);
    }

    /// Returns the index of the current cry, from 0; `None` without one.
    pub fn current_cry(&self) -> Option<usize> {
        self.cries.current()
    }
}

/// Returns the sum unchanged up to the knee, then increasingly compressed, and never above one.
fn soft_clip(sum: f32) -> f32 {
    match sum.abs() - KNEE {
        over if over > 0.0 => (KNEE + (1.0 - KNEE) * (over / (1.0 - KNEE)).tanh()).copysign(sum),
        _ => sum,
    }
}
