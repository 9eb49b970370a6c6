//! Output of a build without the feature `playback`: it cannot be opened.

use super::playback::{AudioError, PlaybackOptions, PlaybackState};
use super::sound_channel::SoundReceiver;
use super::synth::Synth;
use std::convert::Infallible;
use std::time::Duration;

/// A stream that no server can open; it has no values.
pub struct NoStream(Infallible);

impl NoStream {
    /// Always fails: this build has no sound.
    pub fn open(_: &PlaybackOptions) -> Result<NoStream, AudioError> {
        Err(AudioError::Unavailable { why: "this build of the program has no sound (feature `audio`)".into() })
    }

    pub fn place(&self) -> String {
        match self.0 {}
    }

    pub fn latency(&self) -> Option<Duration> {
        match self.0 {}
    }

    pub fn rate(&self) -> u32 {
        match self.0 {}
    }

    pub fn play(self, _: Synth, _: SoundReceiver, _: &PlaybackState) -> (Option<AudioError>, SoundReceiver) {
        match self.0 {}
    }
}
