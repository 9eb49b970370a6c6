//! WAV files that take the place of synthesised sounds.
//!
//! Takes a folder as `content/sounds/README.md` describes it. Gives the sounds that can be used, and a complaint about each
//! that cannot. Never fails: what is missing or broken is synthesised.

use crate::audio::{CRIES, Clip, Replacements};
use crate::diagnostic::{Diagnostic, nearest};
use hound::{SampleFormat, WavReader};
use std::collections::BTreeSet;
use std::fmt;
use std::io::{self, Cursor};
use std::ops::RangeInclusive;
use std::path::Path;

/// Samples a second.
const RATES: RangeInclusive<u32> = 8_000..=192_000;

/// More channels than any microphone for people has.
const CHANNELS_MAX: u16 = 8;

/// s. Longer would be music, and memory.
const LENGTH_MAX: f64 = 30.0;

/// s. What goes round faster than ten times a second is a tone, not a recording.
const LOOP_MIN: f64 = 0.1;

/// Bytes of the longest file of sense: all channels at the highest rate, in four bytes each, and its head.
const BYTES_MAX: u64 = 200 << 20;

/// Why a file cannot be used.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Unusable {
    /// It cannot be read from the disk.
    Unreadable {
        why: String,
    },
    /// It is no WAV file, or not one that can be understood.
    Syntax {
        why: String,
    },
    /// It ends before its head says.
    CutOff {
        samples: u32,
        told: u32,
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
    /// A sample that is not a number.
    NotFinite,
}

impl Unusable {
    /// Name of the rule, for complaints.
    pub fn code(&self) -> &'static str {
        match self {
            Unusable::Unreadable { .. } => "unreadable-sound",
            Unusable::Syntax { .. } | Unusable::NotFinite => "wrong-sound",
            Unusable::CutOff { .. } => "cut-off-sound",
            Unusable::Rate { .. } | Unusable::Channels { .. } => "unsuitable-sound",
            Unusable::Empty | Unusable::TooLong | Unusable::TooShort => "wrong-length",
        }
    }

    /// What would be right.
    pub fn help(&self) -> &'static str {
        match self {
            Unusable::Unreadable { .. } => "let this user read the file, or remove it",
            Unusable::Syntax { .. } | Unusable::NotFinite => "export it as WAV: PCM of 16 or 24 bits",
            Unusable::CutOff { .. } => "copy or export the file again: its end is missing",
            Unusable::Rate { .. } => "export it with 48000 samples a second (8000 to 192000 can be read)",
            Unusable::Channels { .. } => "export it with one channel, or two",
            Unusable::Empty => "record something into it, or remove it",
            Unusable::TooLong => "cut it to at most 30 seconds",
            Unusable::TooShort => "a sound that is played in a loop lasts at least 0.1 seconds",
        }
    }
}

impl fmt::Display for Unusable {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Unusable::Unreadable { why } => write!(f, "the sound cannot be read: {why}"),
            Unusable::Syntax { why } => write!(f, "this is not a WAV file that can be read: {why}"),
            Unusable::CutOff { samples, told } => {
                write!(f, "the sound is cut off: {samples} of its {told} samples are there")
            }
            Unusable::Rate { rate } => write!(f, "the sound has {rate} samples a second"),
            Unusable::Channels { channels } => write!(f, "the sound has {channels} channels"),
            Unusable::Empty => f.write_str("the sound has no samples"),
            Unusable::TooLong => f.write_str("the sound is longer than 30 seconds"),
            Unusable::TooShort => f.write_str("the sound is shorter than 0.1 seconds"),
            Unusable::NotFinite => f.write_str("a sample is not a number"),
        }
    }
}

/// Reads a folder of sounds. Every complaint says that the synthesised sound is heard instead. A folder that is not there
/// replaces nothing.
pub fn read(folder: &Path) -> (Replacements, Vec<Diagnostic>) {
    let mut complaints = misnamed(folder);
    let mut clip = |name: &str, is_looped: bool| {
        let path = folder.join(name);
        let bytes = match read_bytes(&path) {
            Ok(bytes) => bytes?,
            Err(unusable) => {
                complaints.push(complaint(&path, &unusable));
                return None;
            }
        };
        let parsed = parse(&bytes).and_then(|clip| match is_looped && seconds(&clip) < LOOP_MIN {
            true => Err(Unusable::TooShort),
            false => Ok(clip),
        });
        parsed.map_err(|unusable| complaints.push(complaint(&path, &unusable))).ok()
    };
    let handpiece = clip(HANDPIECE, true);
    let suction = clip(SUCTION, true);
    let cries = std::array::from_fn(|i| clip(&cry(i), false));
    (Replacements { handpiece, suction, cries }, complaints)
}

const HANDPIECE: &str = "handpiece.wav";
const SUCTION: &str = "suction.wav";

/// The file of a cry, counted from 0; people count from 1.
fn cry(which: usize) -> String {
    format!("cry-{:02}.wav", which + 1)
}

/// `None` when there is no such file.
fn read_bytes(path: &Path) -> Result<Option<Vec<u8>>, Unusable> {
    let unreadable = |error: io::Error| Unusable::Unreadable { why: error.to_string() };
    match std::fs::metadata(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(unreadable(error)),
        Ok(about) if about.len() > BYTES_MAX => Err(Unusable::TooLong),
        Ok(_) => std::fs::read(path).map(Some).map_err(unreadable),
    }
}

/// Complaints about sounds whose names replace nothing: a misspelt name would be silently left out.
fn misnamed(folder: &Path) -> Vec<Diagnostic> {
    let known: BTreeSet<String> =
        [HANDPIECE.to_string(), SUCTION.to_string()].into_iter().chain((0..CRIES).map(cry)).collect();
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut names: Vec<String> = entries.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    let strange = names.iter().filter(|name| name.to_lowercase().ends_with(".wav") && !known.contains(*name));
    strange
        .map(|name| {
            let meant =
                nearest(name, known.iter().map(String::as_str)).map(|near| format!("did you mean \"{near}\"? "));
            let help = format!("{}known: {HANDPIECE}, {SUCTION}, cry-01.wav to cry-14.wav", meant.unwrap_or_default());
            let path = folder.join(name).display().to_string();
            Diagnostic::about_file(&path, "unknown-sound", "no sound has this name, so nothing is replaced", Some(help))
        })
        .collect()
}

fn complaint(path: &Path, unusable: &Unusable) -> Diagnostic {
    let message = format!("{unusable}; the synthesised sound is heard instead");
    Diagnostic::about_file(&path.display().to_string(), unusable.code(), message, Some(unusable.help().into()))
}

/// Reads a WAV file; its channels are mixed into one.
pub fn parse(bytes: &[u8]) -> Result<Clip, Unusable> {
    let syntax = |error: hound::Error| Unusable::Syntax { why: error.to_string() };
    let mut reader = WavReader::new(Cursor::new(bytes)).map_err(syntax)?;
    let spec = reader.spec();
    let told = reader.len();
    if !RATES.contains(&spec.sample_rate) {
        return Err(Unusable::Rate { rate: spec.sample_rate });
    }
    if spec.channels == 0 || spec.channels > CHANNELS_MAX {
        return Err(Unusable::Channels { channels: spec.channels });
    }
    if f64::from(reader.duration()) > LENGTH_MAX * f64::from(spec.sample_rate) {
        return Err(Unusable::TooLong);
    }
    let samples = match spec.sample_format {
        SampleFormat::Float => whole(reader.samples::<f32>(), told, |s| s)?,
        SampleFormat::Int => {
            let full = 2f32.powi(i32::from(spec.bits_per_sample) - 1);
            whole(reader.samples::<i32>(), told, |s| s as f32 / full)?
        }
    };
    if samples.iter().any(|s| !s.is_finite()) {
        return Err(Unusable::NotFinite);
    }
    let channels = usize::from(spec.channels);
    let mixed: Vec<f32> =
        samples.chunks_exact(channels).map(|frame| frame.iter().sum::<f32>() / channels as f32).collect();
    if mixed.is_empty() {
        return Err(Unusable::Empty);
    }
    // Floats may go beyond full scale; ears and loudspeakers are spared.
    Ok(Clip { rate: spec.sample_rate, samples: mixed.iter().map(|s| s.clamp(-1.0, 1.0)).collect() })
}

/// Every sample the head promised.
fn whole<T>(
    samples: impl Iterator<Item = hound::Result<T>>,
    told: u32,
    number: impl Fn(T) -> f32,
) -> Result<Vec<f32>, Unusable> {
    let mut read = Vec::new();
    for sample in samples {
        match sample {
            Ok(sample) => read.push(number(sample)),
            Err(hound::Error::IoError(_)) => return Err(Unusable::CutOff { samples: read.len() as u32, told }),
            Err(error) => return Err(Unusable::Syntax { why: error.to_string() }),
        }
    }
    Ok(read)
}

/// s.
fn seconds(clip: &Clip) -> f64 {
    clip.samples.len() as f64 / f64::from(clip.rate)
}
