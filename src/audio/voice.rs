//! A voice that speaks a vowel: glottal pulses, breath, and the resonances of the vocal tract.
//!
//! Takes an utterance, a sample rate and a seed. Gives samples. Never uses unseeded randomness.

use super::signal::{Noise, PhaseAccumulator, StateVariableFilter, sample_count};
use typodont_core::frame::smooth_step;

/// Resonances (formants) of the vocal tract, Hz, lowest first.
pub type Vowel = [f32; 3];

/// Mean formants of women (G. Peterson, H. Barney, *Control methods used in a study of the vowels*, J. Acoust. Soc.
/// Am. 24, 1952, Table II), named after the words in which they were measured.
pub const HEED: Vowel = [310.0, 2790.0, 3310.0];
pub const HEAD: Vowel = [610.0, 2330.0, 2990.0];
pub const HAD: Vowel = [860.0, 2050.0, 2850.0];
pub const HOD: Vowel = [850.0, 1220.0, 2810.0];
pub const HAWED: Vowel = [590.0, 920.0, 2710.0];
pub const WHOD: Vowel = [370.0, 950.0, 2670.0];
pub const HUD: Vowel = [760.0, 1400.0, 2780.0];
pub const HEARD: Vowel = [500.0, 1640.0, 1960.0];
/// A hum with closed lips, and air drawn in through the teeth; chosen by ear.
pub const HUM: Vowel = [280.0, 1150.0, 2250.0];
pub const TEETH: Vowel = [3900.0, 5600.0, 7600.0];

/// Parameters of one utterance.
pub struct Utterance {
    /// The formants move from the first to the second.
    pub vowels: [Vowel; 2],
    /// Pitch at the beginning, at its extreme and at the end, Hz.
    pub pitch: [f32; 3],
    /// Position of the extreme in the utterance, 0 to 1.
    pub peak_at: f32,
    /// Duration, s.
    pub length: f32,
    /// Fraction of breath, 0 (voice only) to 1 (breath only).
    pub breath: f32,
    /// Time to full loudness, s.
    pub attack: f32,
    /// Amplitude of the tremor, as a fraction of the pitch.
    pub tremble: f32,
}

/// Weights of the formants: the source falls by about 12 dB per octave, and radiation from the lips adds 6.
const WEIGHTS: [f32; 3] = [1.0, 0.55, 0.28];

/// Quality factor of a formant: speech has bandwidths of 60 to 120 Hz below 2 kHz; a cry is tense.
const QUALITY: f32 = 9.0;

/// Frequency of the tremor of a frightened voice, Hz; `JITTER`: random variation of each pulse, as a fraction of its
/// length.
const TREMBLE_RATE: f32 = 6.2;
const JITTER: f32 = 0.012;

/// Last part of an utterance, in which it fades, as a fraction of its length.
const DECAY_SHARE: f32 = 0.4;

/// Samples between two updates of the formants.
const FORMANT_UPDATE_SAMPLES: usize = 48;

/// Peak of a synthesised utterance.
pub const PEAK: f32 = 0.9;

/// Synthesises an utterance at `rate` Hz, with a peak of [`PEAK`] and silent at both ends.
pub fn synthesize(utterance: &Utterance, rate: f32, seed: u64) -> Vec<f32> {
    let mut noise = Noise::new(seed);
    let (mut pulse, mut tremble, mut mouth) =
        (PhaseAccumulator::default(), PhaseAccumulator::default(), [const { None }; 3]);
    let (mut jitter, mut flow) = (0.0, 0.0);
    let count = sample_count(utterance.length, rate) as usize;
    let mut output: Vec<f32> = (0..count)
        .map(|i| {
            let progress = i as f32 / count as f32;
            if i % FORMANT_UPDATE_SAMPLES == 0 {
                tune_formants(&mut mouth, utterance, progress, rate);
            }
            tremble.advance(TREMBLE_RATE, rate);
            let pitch = pitch(utterance, progress) * (1.0 + jitter + utterance.tremble * tremble.sine());
            if pulse.advance(pitch, rate) {
                jitter = JITTER * noise.white();
            }
            let before = std::mem::replace(&mut flow, glottal_flow(pulse.phase()));
            // The sound radiated from the lips is the derivative of the flow; scaled to the loudness of the breath.
            let voice = (flow - before) * rate / pitch * 0.25;
            let breath = noise.white() * (0.3 + 0.7 * flow.max(utterance.breath));
            let source = (1.0 - utterance.breath) * voice + utterance.breath * breath;
            loudness(utterance, progress) * apply_formants(&mut mouth, source)
        })
        .collect();
    let peak = output.iter().fold(0.0f32, |peak, s| peak.max(s.abs())).max(1e-6);
    output.iter_mut().for_each(|s| *s *= PEAK / peak);
    output
}

/// Tunes the formants for a moment of the utterance, 0 to 1.
fn tune_formants(mouth: &mut [Option<StateVariableFilter>; 3], utterance: &Utterance, progress: f32, rate: f32) {
    let [from, to] = utterance.vowels;
    let eased = smooth_step(progress);
    for (i, filter) in mouth.iter_mut().enumerate() {
        // Interpolated in the logarithm, as the ear perceives frequency.
        let centre = from[i] * (to[i] / from[i]).powf(eased);
        filter.get_or_insert_default().tune(centre, QUALITY, rate);
    }
}

fn apply_formants(mouth: &mut [Option<StateVariableFilter>; 3], source: f32) -> f32 {
    mouth.iter_mut().flatten().zip(WEIGHTS).map(|(filter, weight)| weight * filter.process(source).band).sum()
}

fn pitch(utterance: &Utterance, progress: f32) -> f32 {
    let Utterance { pitch: [start, peak, end], peak_at, .. } = *utterance;
    let between = |from: f32, to: f32, t: f32| from * (to / from).powf(smooth_step(t));
    match progress < peak_at {
        true => between(start, peak, progress / peak_at),
        false => between(peak, end, (progress - peak_at) / (1.0 - peak_at)),
    }
}

/// Returns the flow through the glottis within one pulse (A. Rosenberg, *Effect of glottal pulse shape on the quality
/// of natural vowels*, J. Acoust. Soc. Am. 49, 1971, shape C with 40 % opening and 16 % closing).
fn glottal_flow(phase: f32) -> f32 {
    use std::f32::consts::PI;
    const OPENS: f32 = 0.40;
    const CLOSES: f32 = 0.16;
    match phase {
        t if t < OPENS => 0.5 * (1.0 - (PI * t / OPENS).cos()),
        t if t < OPENS + CLOSES => (0.5 * PI * (t - OPENS) / CLOSES).cos(),
        _ => 0.0,
    }
}

fn loudness(utterance: &Utterance, progress: f32) -> f32 {
    let begun = (progress * utterance.length / utterance.attack).min(1.0);
    let left = ((1.0 - progress) / DECAY_SHARE).min(1.0);
    smooth_step(begun) * smooth_step(left)
}
