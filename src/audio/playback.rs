//! Options, state and errors that the player shares with the output stream of each system.

use super::clip::Replacements;
use std::fmt;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicU64};
use std::time::Duration;

/// Options of the sound output.
#[derive(Clone, Debug, PartialEq)]
pub struct PlaybackOptions {
    /// Seed of the noise and of the order of the cries.
    pub seed: u64,
    pub replacements: Replacements,
    /// Requested time from a load to the ear, 0.01 to 0.2 s. A server may use less or more.
    pub latency: Duration,
    /// A PulseAudio socket other than that of the user's session (Linux only).
    pub server: Option<PathBuf>,
}

/// Default latency. Long enough for a busy desktop, short enough for touch and sound to agree: 20 to 30 ms works.
const LATENCY: Duration = Duration::from_millis(24);

impl Default for PlaybackOptions {
    fn default() -> Self {
        PlaybackOptions { seed: 0, replacements: Replacements::default(), latency: LATENCY, server: None }
    }
}

/// Maximum samples between two updates of the load: 2.7 ms at 48 kHz. A multiple of the synthesiser's own interval.
#[cfg(feature = "playback")]
pub(super) const BLOCK: usize = 128;

/// Time for which one wait for the server lasts.
#[cfg(feature = "playback")]
pub(super) const LISTEN_FOR: Duration = Duration::from_millis(50);

/// State shared by the player's thread and its owner.
#[derive(Default)]
pub(super) struct PlaybackState {
    pub is_over: AtomicBool,
    /// Number of times that the server ran out of samples.
    pub underruns: AtomicU64,
}

/// Reason why no sound can be played.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum AudioError {
    /// There is no sound server, or no output.
    Unavailable { why: String },
    /// The server or output refuses.
    Refused { place: String, why: String },
    /// Playback was interrupted.
    Lost { place: String, why: String },
}

impl fmt::Display for AudioError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            AudioError::Unavailable { why } => write!(f, "no sound can be played: {why}"),
            AudioError::Refused { place, why } => write!(f, "no sound can be played: {place} refused ({why})"),
            AudioError::Lost { place, why } => write!(f, "the sound stopped: {place} {why}"),
        }?;
        f.write_str("; the session continues, and the sound returns as soon as possible")
    }
}

impl std::error::Error for AudioError {}
