//! Fourteen cries of discomfort (as in the thesis, section 6.2), and the choice of the next one.
//!
//! Takes a strength and recordings that replace cries. Gives samples of one cry at a time. Never repeats the last cry.

use super::clip::Replacements;
use super::signal::{Noise, sample_count};
use super::voice::{self, HAD, HAWED, HEAD, HEARD, HEED, HOD, HUD, HUM, TEETH, Utterance, Vowel, WHOD};

/// Number of cries.
pub const CRIES: usize = 14;

const fn utterance(vowels: [Vowel; 2], pitch: [f32; 3], peak_at: f32, length: f32) -> Utterance {
    Utterance { vowels, pitch, peak_at, length, breath: 0.12, attack: 0.03, tremble: 0.01 }
}

/// The fourteen cries, composed by ear so that no two share vowel, melody and length.
const REPERTOIRE: [Utterance; CRIES] = [
    // Ah!
    Utterance { attack: 0.012, ..utterance([HOD, HOD], [290.0, 380.0, 240.0], 0.25, 0.38) },
    // Ow.
    utterance([HOD, WHOD], [330.0, 360.0, 190.0], 0.2, 0.62),
    // Ouch, breathy at the end.
    Utterance { breath: 0.3, attack: 0.015, ..utterance([HOD, HEED], [360.0, 400.0, 260.0], 0.15, 0.5) },
    // Eh!
    Utterance { attack: 0.01, ..utterance([HEAD, HEAD], [250.0, 310.0, 270.0], 0.5, 0.24) },
    // Mmm, with closed lips, rising.
    Utterance { attack: 0.09, ..utterance([HUM, HUM], [190.0, 270.0, 255.0], 0.8, 0.9) },
    // Hnn-ah.
    Utterance { attack: 0.06, ..utterance([HUM, HAD], [200.0, 330.0, 280.0], 0.7, 0.72) },
    // Oh.
    utterance([HAWED, WHOD], [260.0, 250.0, 160.0], 0.3, 0.56),
    // Ai!
    Utterance { attack: 0.015, tremble: 0.02, ..utterance([HAD, HEED], [340.0, 470.0, 390.0], 0.6, 0.45) },
    // Uh, short.
    Utterance { attack: 0.01, breath: 0.25, ..utterance([HUD, HUD], [230.0, 235.0, 170.0], 0.2, 0.2) },
    // Air drawn in through the teeth.
    Utterance { breath: 1.0, attack: 0.12, ..utterance([TEETH, [4600.0, 6600.0, 8600.0]], [200.0; 3], 0.5, 0.66) },
    // A long, trembling aah.
    Utterance { tremble: 0.035, attack: 0.05, ..utterance([HUD, HAD], [280.0, 420.0, 230.0], 0.45, 1.15) },
    // Eee, tense.
    Utterance { tremble: 0.015, ..utterance([HEED, HEED], [380.0, 430.0, 410.0], 0.35, 0.7) },
    // Err, falling, annoyed.
    Utterance { attack: 0.08, breath: 0.2, ..utterance([HEARD, HEARD], [210.0, 195.0, 140.0], 0.4, 0.95) },
    // A gasp.
    Utterance { breath: 0.85, attack: 0.05, ..utterance([WHOD, HAD], [240.0, 320.0, 300.0], 0.6, 0.34) },
];

/// Level of the loudest cry, relative to full scale: above the drill. 0.4 to 0.8 works.
const LEVEL: f32 = 0.6;

/// Level of the faintest cry, relative to the loudest.
const FAINTEST_LEVEL: f32 = 0.35;

/// Duration of the fades at both ends of a recorded cry, s, so that none starts or ends with a click.
const FADE_TIME: f32 = 0.003;

/// The patient's voice. Only one cry at a time: a new one does not interrupt it.
pub struct Cries {
    rng: Noise,
    repertoire: Vec<Vec<f32>>,
    last: Option<usize>,
    /// Index, position in samples, and level of the current cry.
    playing: Option<(usize, usize, f32)>,
}

impl Cries {
    /// Synthesises all cries at `rate` Hz, except those that have a recording.
    pub fn new(rate: u32, seed: u64, replacements: &Replacements) -> Cries {
        let voices = REPERTOIRE.iter().zip(&replacements.cries).enumerate();
        let repertoire = voices.map(|(i, (utterance, recorded))| match recorded {
            Some(clip) => fade_ends(clip.at_rate(rate), rate),
            None => voice::synthesize(utterance, rate as f32, i as u64),
        });
        Cries { rng: Noise::new(seed), repertoire: repertoire.collect(), last: None, playing: None }
    }

    /// Starts a random cry, never the last one again, unless one is being played. `strength` is 0 to 1.
    pub fn start(&mut self, strength: f32) {
        if self.playing.is_some() {
            return;
        }
        let chosen = match self.last {
            None => self.rng.next_u32() as usize % CRIES,
            Some(last) => (last + 1 + self.rng.next_u32() as usize % (CRIES - 1)) % CRIES,
        };
        let strength = if strength.is_nan() { 0.0 } else { strength.clamp(0.0, 1.0) };
        self.last = Some(chosen);
        self.playing = Some((chosen, 0, LEVEL * (FAINTEST_LEVEL + (1.0 - FAINTEST_LEVEL) * strength)));
    }

    /// Returns the index of the current cry, 0 to 13.
    pub fn current(&self) -> Option<usize> {
        self.playing.map(|(which, ..)| which)
    }

    pub fn next_sample(&mut self) -> f32 {
        let Some((which, place, level)) = &mut self.playing else { return 0.0 };
        let Some(sample) = self.repertoire[*which].get(*place) else {
            self.playing = None;
            return 0.0;
        };
        *place += 1;
        *level * sample
    }
}

fn fade_ends(mut samples: Vec<f32>, rate: u32) -> Vec<f32> {
    let count = samples.len();
    let edge = (sample_count(FADE_TIME, rate as f32) as usize).min(count / 2);
    for i in 0..edge {
        let share = i as f32 / edge as f32;
        samples[i] *= share;
        samples[count - 1 - i] *= share;
    }
    samples
}
