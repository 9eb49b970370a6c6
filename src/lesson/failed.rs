//! Why a lesson has no bundle.

use crate::diagnostic::Diagnostic;
use crate::record::Unwritable;
use crate::report::bundle::{Unfinished, Unmade};
use crate::scenario::Unmakeable;
use std::fmt;
use std::path::PathBuf;

/// Why a lesson cannot begin or go on, and what is left of it.
#[derive(Debug)]
pub enum Failed {
    /// The exercise cannot be built with this seed or this scan.
    Impossible { scenario: String, why: Unmakeable },
    /// Nothing could be written, and nothing was begun.
    Unbegun(Unwritable),
    /// The bundle's folder cannot be made or filled.
    Unmade(Unmade),
    /// It broke off. What was recorded until then lies in a folder.
    Stopped { why: String, folder: PathBuf },
    /// No device of that name; which there are.
    UnknownDevice { name: String, known: String },
    /// There is none to hold.
    NoDevice { name: String, why: String },
    /// The second hand is to hold what the first does.
    SameDevice { name: String },
    /// Nobody can join at that address.
    CannotListen { at: String, why: String },
    /// A scan that is none, or no tooth.
    WrongVolume { path: PathBuf, why: String },
    /// A file that cannot be read.
    Unreadable(Diagnostic),
    /// A folder that holds no exercise, or cannot be read.
    NoScenarios { folder: PathBuf, why: String },
}

impl Failed {
    pub(super) fn stopped(unfinished: &Unfinished, why: &dyn fmt::Display) -> Failed {
        let recording = unfinished.recording();
        let folder = recording.parent().unwrap_or(&recording).to_path_buf();
        Failed::Stopped { why: why.to_string(), folder }
    }
}

impl fmt::Display for Failed {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Failed::Impossible { scenario, why } => write!(f, "{scenario}: impossible-scene: {why}"),
            Failed::Unbegun(error) => error.fmt(f),
            Failed::Unmade(unmade) => unmade.fmt(f),
            Failed::Stopped { why, folder } => {
                write!(f, "{why}\nwhat was recorded is in {}; `typodont finish` makes a bundle of it", folder.display())
            }
            Failed::UnknownDevice { name, known } => write!(
                f,
                "unknown-device: no device is named \"{name}\"; known: scripted, {known} (see `typodont devices`)"
            ),
            Failed::NoDevice { name, why } => write!(f, "{name}: no-device: {why}"),
            Failed::SameDevice { name } => {
                write!(f, "same-device: {name} is in the first hand; name another one, NAME:WHICH, for the second")
            }
            Failed::CannotListen { at, why } => {
                write!(f, "{at}: cannot-listen: {why}; name an address of this machine")
            }
            Failed::WrongVolume { path, why } => write!(f, "{}: wrong-volume: {why}", path.display()),
            Failed::Unreadable(found) => f.write_str(&found.headline()),
            Failed::NoScenarios { folder, why } => write!(f, "{}: {why}", folder.display()),
        }
    }
}

impl From<Diagnostic> for Failed {
    fn from(found: Diagnostic) -> Failed {
        Failed::Unreadable(found)
    }
}

impl From<Unmade> for Failed {
    fn from(unmade: Unmade) -> Failed {
        Failed::Unmade(unmade)
    }
}
