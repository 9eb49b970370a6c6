//! WAV files that replace synthesised sounds.
//!
//! Takes a folder as described in `content/sounds/README.md`. Gives the sounds that can be used, and a diagnostic for
//! each that cannot. Never fails: missing and broken sounds are synthesised.

use crate::{CRIES, Clip, Replacements};
use hound::{SampleFormat, WavReader};
use std::collections::BTreeSet;
use std::fmt;
use std::io::{self, Cursor};
use std::ops::RangeInclusive;
use std::path::Path;
use typodont_formats::diagnostic::{Diagnostic, nearest};

/// Accepted sample rates, Hz.
const RATES: RangeInclusive<u32> = 8_000..=192_000;

/// Maximum number of channels: more than any common microphone has.
const CHANNELS_MAX: u16 = 8;

/// Maximum duration, s; limits the memory used.
const LENGTH_MAX: f64 = 30.0;

/// Minimum duration of a loop, s: a faster repetition would be heard as a tone.
const LOOP_MIN: f64 = 0.1;

/// Maximum size of a file in bytes: all channels at the highest rate, four bytes each, and the header.
const BYTES_MAX: u64 = 200 << 20;

/// Reason why a sound file cannot be used.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum WavError {
    /// The file cannot be read.
    Unreadable {
        why: String,
    },
    /// The file is not a WAV file, or its format is not supported.
    Syntax {
        why: String,
    },
    /// The file ends before the length given in its header.
    CutOff {
        samples: u32,
        expected: u32,
    },
    Rate {
        rate: u32,
    },
    Channels {
        channels: u16,
    },
    Empty,
    TooLong,
    TooShort,
    /// A sample is not finite.
    NotFinite,
}

impl WavError {
    /// Returns the name of the rule, for diagnostics.
    pub fn code(&self) -> &'static str {
        match self {
            WavError::Unreadable { .. } => "unreadable-sound",
            WavError::Syntax { .. } | WavError::NotFinite => "wrong-sound",
            WavError::CutOff { .. } => "cut-off-sound",
            WavError::Rate { .. } | WavError::Channels { .. } => "unsuitable-sound",
            WavError::Empty | WavError::TooLong | WavError::TooShort => "wrong-length",
        }
    }

    /// Returns the remedy, for diagnostics.
    pub fn help(&self) -> &'static str {
        match self {
            WavError::Unreadable { .. } => "give this user permission to read the file, or remove it",
            WavError::Syntax { .. } | WavError::NotFinite => "export it as WAV: PCM of 16 or 24 bits",
            WavError::CutOff { .. } => "copy or export the file again: its end is missing",
            WavError::Rate { .. } => "export it with 48000 samples per second (8000 to 192000 are accepted)",
            WavError::Channels { .. } => "export it with one or two channels",
            WavError::Empty => "replace it by a recording, or remove it",
            WavError::TooLong => "shorten it to at most 30 seconds",
            WavError::TooShort => "a sound that is played in a loop must last at least 0.1 seconds",
        }
    }
}

impl fmt::Display for WavError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            WavError::Unreadable { why } => write!(f, "the sound cannot be read: {why}"),
            WavError::Syntax { why } => write!(f, "this is not a WAV file that can be read: {why}"),
            WavError::CutOff { samples, expected } => {
                write!(f, "the sound is incomplete: it has {samples} of {expected} samples")
            }
            WavError::Rate { rate } => write!(f, "the sound has {rate} samples per second"),
            WavError::Channels { channels } => write!(f, "the sound has {channels} channels"),
            WavError::Empty => f.write_str("the sound has no samples"),
            WavError::TooLong => f.write_str("the sound is longer than 30 seconds"),
            WavError::TooShort => f.write_str("the sound is shorter than 0.1 seconds"),
            WavError::NotFinite => f.write_str("a sample is not a number"),
        }
    }
}

impl std::error::Error for WavError {}

/// Reads a folder of sounds. Each diagnostic says that the synthesised sound is used instead. A missing folder
/// replaces nothing.
pub fn read_folder(folder: &Path) -> (Replacements, Vec<Diagnostic>) {
    let mut complaints = unknown_names(folder);
    let mut clip = |name: &str, is_looped: bool| {
        let path = folder.join(name);
        let bytes = match read_bytes(&path) {
            Ok(bytes) => bytes?,
            Err(error) => {
                complaints.push(diagnostic(&path, &error));
                return None;
            }
        };
        let parsed = parse(&bytes).and_then(|clip| match is_looped && duration_s(&clip) < LOOP_MIN {
            true => Err(WavError::TooShort),
            false => Ok(clip),
        });
        parsed.map_err(|error| complaints.push(diagnostic(&path, &error))).ok()
    };
    let handpiece = clip(HANDPIECE, true);
    let suction = clip(SUCTION, true);
    let cries = std::array::from_fn(|i| clip(&cry_file_name(i), false));
    (Replacements { handpiece, suction, cries }, complaints)
}

const HANDPIECE: &str = "handpiece.wav";
const SUCTION: &str = "suction.wav";

/// Returns the file name of a cry. Cries count from 0, their files from 1.
fn cry_file_name(which: usize) -> String {
    format!("cry-{:02}.wav", which + 1)
}

/// Returns `None` if there is no such file.
fn read_bytes(path: &Path) -> Result<Option<Vec<u8>>, WavError> {
    let unreadable = |error: io::Error| WavError::Unreadable { why: error.to_string() };
    match std::fs::metadata(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(unreadable(error)),
        Ok(about) if about.len() > BYTES_MAX => Err(WavError::TooLong),
        Ok(_) => std::fs::read(path).map(Some).map_err(unreadable),
    }
}

/// Returns diagnostics for sounds whose names replace nothing: a misspelt name would otherwise be ignored silently.
fn unknown_names(folder: &Path) -> Vec<Diagnostic> {
    let known: BTreeSet<String> =
        [HANDPIECE.to_string(), SUCTION.to_string()].into_iter().chain((0..CRIES).map(cry_file_name)).collect();
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut names: Vec<String> = entries.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    let unknown = names.iter().filter(|name| name.to_lowercase().ends_with(".wav") && !known.contains(*name));
    unknown
        .map(|name| {
            let meant =
                nearest(name, known.iter().map(String::as_str)).map(|near| format!("did you mean \"{near}\"? "));
            let help = format!("{}known: {HANDPIECE}, {SUCTION}, cry-01.wav to cry-14.wav", meant.unwrap_or_default());
            let path = folder.join(name).display().to_string();
            Diagnostic::about_file(&path, "unknown-sound", "no sound has this name, so nothing is replaced", Some(help))
        })
        .collect()
}

fn diagnostic(path: &Path, error: &WavError) -> Diagnostic {
    let message = format!("{error}; the synthesised sound is used instead");
    Diagnostic::about_file(&path.display().to_string(), error.code(), message, Some(error.help().into()))
}

/// Parses a WAV file; its channels are mixed into one.
///
/// # Errors
///
/// Returns an error if the file is malformed, incomplete, longer than 30 s, empty, or of an unsupported rate or
/// channel count.
pub fn parse(bytes: &[u8]) -> Result<Clip, WavError> {
    let syntax = |error: hound::Error| WavError::Syntax { why: error.to_string() };
    let mut reader = WavReader::new(Cursor::new(bytes)).map_err(syntax)?;
    let spec = reader.spec();
    let expected = reader.len();
    if !RATES.contains(&spec.sample_rate) {
        return Err(WavError::Rate { rate: spec.sample_rate });
    }
    if spec.channels == 0 || spec.channels > CHANNELS_MAX {
        return Err(WavError::Channels { channels: spec.channels });
    }
    if f64::from(reader.duration()) > LENGTH_MAX * f64::from(spec.sample_rate) {
        return Err(WavError::TooLong);
    }
    let samples = match spec.sample_format {
        SampleFormat::Float => collect_samples(reader.samples::<f32>(), expected, |s| s)?,
        SampleFormat::Int => {
            let full = 2f32.powi(i32::from(spec.bits_per_sample) - 1);
            collect_samples(reader.samples::<i32>(), expected, |s| s as f32 / full)?
        }
    };
    if samples.iter().any(|s| !s.is_finite()) {
        return Err(WavError::NotFinite);
    }
    let channels = usize::from(spec.channels);
    let mixed: Vec<f32> =
        samples.chunks_exact(channels).map(|frame| frame.iter().sum::<f32>() / channels as f32).collect();
    if mixed.is_empty() {
        return Err(WavError::Empty);
    }
    // Floats may exceed full scale; clamp them to protect ears and loudspeakers.
    Ok(Clip { rate: spec.sample_rate, samples: mixed.iter().map(|s| s.clamp(-1.0, 1.0)).collect() })
}

/// Returns all samples that the header announces.
///
/// # Errors
///
/// Returns an error if the samples end early or cannot be decoded.
fn collect_samples<T>(
    samples: impl Iterator<Item = hound::Result<T>>,
    expected: u32,
    number: impl Fn(T) -> f32,
) -> Result<Vec<f32>, WavError> {
    let mut read = Vec::new();
    for sample in samples {
        match sample {
            Ok(sample) => read.push(number(sample)),
            Err(hound::Error::IoError(_)) => return Err(WavError::CutOff { samples: read.len() as u32, expected }),
            Err(error) => return Err(WavError::Syntax { why: error.to_string() }),
        }
    }
    Ok(read)
}

/// Returns the duration, s.
fn duration_s(clip: &Clip) -> f64 {
    clip.samples.len() as f64 / f64::from(clip.rate)
}
