//! A voice that says a vowel: pulses of the glottis, breath, and the resonances of the mouth.

use super::signal::{Filter, Noise, Turn, samples};

/// Resonances of a mouth, Hz, lowest first.
pub type Vowel = [f32; 3];

/// Women's means (G. Peterson, H. Barney, *Control methods used in a study of the vowels*, J. Acoust. Soc. Am. 24, 1952,
/// Table II), named as in the words they were read in.
pub const HEED: Vowel = [310.0, 2790.0, 3310.0];
pub const HEAD: Vowel = [610.0, 2330.0, 2990.0];
pub const HAD: Vowel = [860.0, 2050.0, 2850.0];
pub const HOD: Vowel = [850.0, 1220.0, 2810.0];
pub const HAWED: Vowel = [590.0, 920.0, 2710.0];
pub const WHOD: Vowel = [370.0, 950.0, 2670.0];
pub const HUD: Vowel = [760.0, 1400.0, 2780.0];
pub const HEARD: Vowel = [500.0, 1640.0, 1960.0];
/// A hum behind closed lips, and air drawn through the teeth; by ear.
pub const HUM: Vowel = [280.0, 1150.0, 2250.0];
pub const TEETH: Vowel = [3900.0, 5600.0, 7600.0];

/// One utterance, as a score for the voice.
pub struct Utterance {
    /// The mouth moves from one to the other.
    pub vowels: [Vowel; 2],
    /// Pitch at the beginning, at its peak (or its deepest) and at the end, Hz.
    pub pitch: [f32; 3],
    /// Where the peak lies, 0 to 1.
    pub peak_at: f32,
    /// s.
    pub length: f32,
    /// Share of breath in it, 0 (voice only) to 1 (breath only).
    pub breath: f32,
    /// How long it takes to be loud, s.
    pub attack: f32,
    /// How deep the pitch trembles, of the pitch.
    pub tremble: f32,
}

/// Weights of the resonances: the source falls by some 12 dB an octave, and lips give back 6.
const WEIGHTS: [f32; 3] = [1.0, 0.55, 0.28];

/// Quality of a resonance: speech has bandwidths of 60 to 120 Hz below 2 kHz; a cry is tense.
const QUALITY: f32 = 9.0;

/// How often a frightened voice trembles, Hz, and how unsteady each pulse is, of its length.
const TREMBLE_RATE: f32 = 6.2;
const JITTER: f32 = 0.012;

/// The last part of an utterance, in which it dies away, of its length.
const DYING: f32 = 0.4;

/// How often the mouth moves, samples.
const MOVES: usize = 48;

/// Peak of what is said.
pub const PEAK: f32 = 0.9;

/// Says it: samples at `rate` Hz with peaks of [`PEAK`], silent at both ends.
pub fn say(utterance: &Utterance, rate: f32, seed: u64) -> Vec<f32> {
    let mut noise = Noise::new(seed);
    let (mut pulse, mut tremble, mut mouth) = (Turn::default(), Turn::default(), [const { None }; 3]);
    let (mut jitter, mut flow) = (0.0, 0.0);
    let count = samples(utterance.length, rate) as usize;
    let mut said: Vec<f32> = (0..count)
        .map(|i| {
            let way = i as f32 / count as f32;
            if i % MOVES == 0 {
                shape(&mut mouth, utterance, way, rate);
            }
            tremble.advance(TREMBLE_RATE, rate);
            let pitch = pitch(utterance, way) * (1.0 + jitter + utterance.tremble * tremble.sine());
            if pulse.advance(pitch, rate) {
                jitter = JITTER * noise.white();
            }
            let before = std::mem::replace(&mut flow, glottis(pulse.turns()));
            // What leaves the lips is the change of the flow; scaled to the breath's loudness.
            let voice = (flow - before) * rate / pitch * 0.25;
            let breath = noise.white() * (0.3 + 0.7 * flow.max(utterance.breath));
            let source = (1.0 - utterance.breath) * voice + utterance.breath * breath;
            loudness(utterance, way) * through(&mut mouth, source)
        })
        .collect();
    let peak = said.iter().fold(0.0f32, |peak, s| peak.max(s.abs())).max(1e-6);
    said.iter_mut().for_each(|s| *s *= PEAK / peak);
    said
}

/// The resonances of the mouth at a moment, 0 to 1.
fn shape(mouth: &mut [Option<Filter>; 3], utterance: &Utterance, way: f32, rate: f32) {
    let [from, to] = utterance.vowels;
    let turned = way * way * (3.0 - 2.0 * way);
    for (i, filter) in mouth.iter_mut().enumerate() {
        // In steps of the logarithm, as the ear hears.
        let centre = from[i] * (to[i] / from[i]).powf(turned);
        filter.get_or_insert_default().tune(centre, QUALITY, rate);
    }
}

fn through(mouth: &mut [Option<Filter>; 3], source: f32) -> f32 {
    mouth.iter_mut().flatten().zip(WEIGHTS).map(|(filter, weight)| weight * filter.pass(source).band).sum()
}

fn pitch(utterance: &Utterance, way: f32) -> f32 {
    let Utterance { pitch: [start, peak, end], peak_at, .. } = *utterance;
    let between = |from: f32, to: f32, way: f32| from * (to / from).powf(way * way * (3.0 - 2.0 * way));
    match way < peak_at {
        true => between(start, peak, way / peak_at),
        false => between(peak, end, (way - peak_at) / (1.0 - peak_at)),
    }
}

/// The flow through the glottis within one pulse (A. Rosenberg, *Effect of glottal pulse shape on the quality of natural
/// vowels*, J. Acoust. Soc. Am. 49, 1971, shape C with 40 % opening and 16 % closing).
fn glottis(turns: f32) -> f32 {
    use std::f32::consts::PI;
    const OPENS: f32 = 0.40;
    const CLOSES: f32 = 0.16;
    match turns {
        t if t < OPENS => 0.5 * (1.0 - (PI * t / OPENS).cos()),
        t if t < OPENS + CLOSES => (0.5 * PI * (t - OPENS) / CLOSES).cos(),
        _ => 0.0,
    }
}

fn loudness(utterance: &Utterance, way: f32) -> f32 {
    let begun = (way * utterance.length / utterance.attack).min(1.0);
    let left = ((1.0 - way) / DYING).min(1.0);
    let smooth = |x: f32| x * x * (3.0 - 2.0 * x);
    smooth(begun) * smooth(left)
}
