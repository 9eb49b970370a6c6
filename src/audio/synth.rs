//! All voices together, sample by sample.

use super::air::Air;
use super::clip::{Loop, Replacements};
use super::contact::Contact;
use super::cries::Cries;
use super::load::DrillLoad;
use super::rotor::Rotor;

/// What a synthesiser is made of.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Samples a second, 8 000 to 192 000.
    pub rate: u32,
    /// Which noise, and which cries in which order.
    pub seed: u64,
    pub replacements: Replacements,
}

impl Default for Options {
    fn default() -> Self {
        Options { rate: 48_000, seed: 0, replacements: Replacements::default() }
    }
}

/// How often the load is looked at, in samples. At 48 kHz that is a third of a millisecond.
const LOOK: u32 = 16;

/// Above this the sum is bent, not cut, so that it stays below full scale.
const KNEE: f32 = 0.7;

/// Makes the sound of a load.
///
/// The same loads at the same samples give the same samples for a seed, however they are cut into blocks of a multiple of 16.
pub struct Synth {
    /// Seconds between two looks at the load.
    look: f32,
    left: u32,
    rotor: Rotor,
    contact: Contact,
    air: Air,
    cries: Cries,
}

impl Synth {
    /// Takes some tens of milliseconds: every cry is said once in advance.
    pub fn new(options: &Options) -> Synth {
        let Options { rate, seed, replacements } = options;
        let looped = |clip: &Option<_>| clip.as_ref().and_then(|clip| Loop::of(clip, *rate));
        let hertz = *rate as f32;
        // Each voice has noise of its own, or all would rush alike.
        let seed_of = |voice: u64| seed.wrapping_mul(4).wrapping_add(voice);
        Synth {
            look: LOOK as f32 / hertz,
            left: 0,
            rotor: Rotor::new(hertz, seed_of(0), looped(&replacements.handpiece)),
            contact: Contact::new(hertz, seed_of(1)),
            air: Air::new(hertz, seed_of(2), looped(&replacements.suction)),
            cries: Cries::new(*rate, seed_of(3), replacements),
        }
    }

    /// Fills a block, mono, −1 to 1, with what the load sounds like. Never allocates.
    pub fn fill(&mut self, load: &DrillLoad, block: &mut [f32]) {
        let load = load.within_ranges();
        for sample in block {
            if self.left == 0 {
                self.left = LOOK;
                self.rotor.follow(&load, self.look);
                self.contact.follow(&load, &self.rotor, self.look);
                self.air.follow(&load);
            }
            self.left -= 1;
            *sample = bent(self.rotor.next() + self.contact.next() + self.air.next() + self.cries.next());
        }
    }

    /// The patient cries, unless they already do: a cry chosen by the seed, never the last one again. `strength` from 0, faint,
    /// to 1.
    pub fn cry(&mut self, strength: f32) {
        self.cries.begin(strength);
    }

    /// Which cry sounds, from 0; `None` when none does.
    pub fn crying(&self) -> Option<usize> {
        self.cries.sounding()
    }
}

/// Straight up to the knee, then ever flatter, never above one.
fn bent(sum: f32) -> f32 {
    match sum.abs() - KNEE {
        over if over > 0.0 => (KNEE + (1.0 - KNEE) * (over / (1.0 - KNEE)).tanh()).copysign(sum),
        _ => sum,
    }
}
