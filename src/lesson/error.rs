//! Errors of a lesson.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};
use typodont_exercise::record::RecorderError;
use typodont_exercise::scenario::WorkpieceError;
use typodont_formats::diagnostic::Diagnostic;
use typodont_report::bundle::{BundleError, PartialBundle};

/// Error that prevents a lesson from beginning or continuing.
#[derive(Debug)]
pub enum LessonError {
    /// The exercise cannot be built with this seed or this scan.
    ImpossibleScene { scenario: String, why: WorkpieceError },
    /// The recording could not be created; no session began.
    RecordingNotStarted(RecorderError),
    /// The recording cannot be synced to the disk; no session began.
    NoDiskSync { path: PathBuf, why: io::Error },
    /// The operating system gives no random numbers for the seed.
    NoRandomness { why: String },
    /// An examiner's code with fewer than `least` characters.
    ShortCode { least: usize },
    /// The random choices of the exercise cannot be sealed.
    NotSealable { scenario: String },
    /// An interrupted session cannot go on.
    NotResumable { why: String },
    /// The bundle's folder cannot be made or filled.
    Bundle(BundleError),
    /// The session stopped; `folder` holds its recording up to then, unless it was made in memory.
    Stopped { why: String, folder: Option<PathBuf> },
    /// No device of that name; `known` lists the valid names.
    UnknownDevice { name: String, known: String },
    /// The device cannot be opened.
    NoDevice { name: String, why: String },
    /// The second device is the same as the first.
    SameDevice { name: String },
    /// The lesson cannot listen on that address.
    NoListener { at: String, why: String },
    /// A file that is not a valid scan of a tooth.
    WrongVolume { path: PathBuf, why: String },
    /// A file that cannot be read.
    Unreadable(Diagnostic),
    /// A folder that holds no exercise, or cannot be read.
    NoScenarios(Box<Diagnostic>),
}

impl LessonError {
    pub(super) fn stopped(partial_bundle: &PartialBundle, why: &dyn fmt::Display) -> LessonError {
        LessonError::Stopped { why: why.to_string(), folder: partial_bundle.folder().map(Path::to_path_buf) }
    }
}

impl fmt::Display for LessonError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            LessonError::ImpossibleScene { scenario, why } => write!(f, "{scenario}: impossible-scene: {why}"),
            LessonError::RecordingNotStarted(error) => error.fmt(f),
            LessonError::NoDiskSync { path, why } => {
                write!(f, "{}: unwritable-file: the recording cannot be synced to the disk: {why}", path.display())
            }
            LessonError::NoRandomness { why } => {
                write!(f, "no-randomness: the operating system gives no random numbers: {why}; give a seed")
            }
            LessonError::ShortCode { least } => {
                write!(
                    f,
                    "short-code: the examiner's code must have at least {least} characters; a shorter one could be guessed"
                )
            }
            LessonError::NotSealable { scenario } => write!(
                f,
                "{scenario}: not-sealable: a sealed seed requires an exercise with \"draw\" and without other random \
                 positions or depths, which the recording contains from the beginning"
            ),
            LessonError::NotResumable { why } => {
                write!(f, "not-resumable: the session cannot be continued: {why}; score the work done so far instead")
            }
            LessonError::Bundle(unmade) => unmade.fmt(f),
            LessonError::Stopped { why, folder: None } => f.write_str(why),
            LessonError::Stopped { why, folder: Some(folder) } => {
                write!(
                    f,
                    "{why}\nthe recording up to this point is in {0}; once the cause is removed, \
                     `typodont finish {0}` makes the bundle",
                    folder.display()
                )
            }
            LessonError::UnknownDevice { name, known } => write!(
                f,
                "unknown-device: there is no device \"{name}\"; known: scripted, {known} (see `typodont devices`)"
            ),
            LessonError::NoDevice { name, why } => write!(f, "{name}: no-device: {why}"),
            LessonError::SameDevice { name } => {
                write!(f, "same-device: {name} is the first device; give another one, NAME:WHICH, as the second")
            }
            LessonError::NoListener { at, why } => {
                write!(f, "{at}: cannot-listen: {why}; give an address of this computer")
            }
            LessonError::WrongVolume { path, why } => write!(f, "{}: wrong-volume: {why}", path.display()),
            LessonError::Unreadable(found) => f.write_str(&found.headline()),
            LessonError::NoScenarios(found) => f.write_str(&found.headline()),
        }
    }
}

impl From<Diagnostic> for LessonError {
    fn from(found: Diagnostic) -> LessonError {
        LessonError::Unreadable(found)
    }
}

impl From<BundleError> for LessonError {
    fn from(unmade: BundleError) -> LessonError {
        LessonError::Bundle(unmade)
    }
}
