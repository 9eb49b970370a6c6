//! Sound output on a thread of its own, at the pace of the sound server.
//!
//! Takes loads and cries from another thread. Gives sound, and events about its state. Never blocks the sending thread.

#[cfg(all(feature = "playback", not(all(unix, not(target_os = "macos")))))]
use super::native::NativeStream as OutputStream;
#[cfg(not(feature = "playback"))]
use super::no_playback::NoStream as OutputStream;
#[cfg(all(feature = "playback", unix, not(target_os = "macos")))]
use super::pulse::PulseStream as OutputStream;

use super::playback::{AudioError, PlaybackOptions, PlaybackState};
use super::sound_channel::{PlayerVolume, SoundReceiver};
use super::synth::{Synth, SynthOptions};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::thread::{self, JoinHandle};
use typodont_core::mailbox;
use typodont_core::mailbox::{Receiver, Sender};
use web_time::{Duration, Instant};

/// Events of the player. Each is sent once, and again only after its opposite.
#[derive(Clone, Debug, PartialEq)]
pub enum PlayerEvent {
    /// Sound is played through `place`, with this `latency` if the server reports it.
    Playing { place: String, latency: Option<Duration> },
    /// No sound can be played. The player retries every [`RETRY_INTERVAL`].
    Silent(AudioError),
}

/// Interval between attempts to find a server. Below 1 s, a server that refuses would receive too many requests.
pub const RETRY_INTERVAL: Duration = Duration::from_secs(2);

/// Opens the system's sound output and closes it again without a sound; gives its name.
///
/// # Errors
///
/// Returns an error if nothing can be played.
pub fn output_name() -> Result<String, AudioError> {
    OutputStream::open(&PlaybackOptions::default()).map(|stream| stream.place())
}

/// Capacity for events.
const EVENT_CAPACITY: usize = 16;

/// Plays what a [`SoundSender`] sends, until it is dropped.
pub struct SoundPlayer {
    events: Receiver<PlayerEvent>,
    volume: Arc<PlayerVolume>,
    shared: Arc<PlaybackState>,
    thread: Option<JoinHandle<()>>,
}

impl SoundPlayer {
    /// Starts playing on a thread of its own. If that is not possible, [`SoundPlayer::next_event`] gives the reason.
    pub fn start(receiver: SoundReceiver, options: PlaybackOptions) -> SoundPlayer {
        let (mut sender, events) = mailbox::channel(EVENT_CAPACITY);
        let shared = Arc::new(PlaybackState::default());
        let (thread_state, volume) = (shared.clone(), receiver.volume.clone());
        let name = thread::Builder::new().name("sound".into());
        let thread = name.spawn(move || run_player(receiver, &options, &mut sender, &thread_state)).ok();
        SoundPlayer { events, volume, shared, thread }
    }

    /// Returns the next event, if there is one.
    pub fn next_event(&mut self) -> Option<PlayerEvent> {
        self.events.try_recv()
    }

    /// Sets the volume, a fraction of full scale from 0 to 1.
    pub fn set_volume(&self, share: f32) {
        let share = if share.is_nan() { 0.0 } else { share.clamp(0.0, 1.0) };
        self.volume.set(share);
    }

    /// Returns how often the server ran out of samples because the machine was too busy; each time there was a gap in
    /// the sound.
    pub fn underruns(&self) -> u64 {
        self.shared.underruns.load(Ordering::Relaxed)
    }
}

impl Drop for SoundPlayer {
    fn drop(&mut self) {
        self.shared.is_over.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            thread.thread().unpark();
            // A player that panicked plays nothing any more; nothing remains to be done.
            let _ = thread.join();
        }
    }
}

/// Connects to a server and plays; starts again when the server is lost.
fn run_player(
    mut receiver: SoundReceiver,
    options: &PlaybackOptions,
    events: &mut Sender<PlayerEvent>,
    shared: &PlaybackState,
) {
    let mut is_reported = false;
    while !shared.is_over.load(Ordering::Relaxed) {
        let error = match OutputStream::open(options) {
            Ok(stream) => {
                let _ = events.try_send(PlayerEvent::Playing { place: stream.place(), latency: stream.latency() });
                is_reported = false;
                let PlaybackOptions { seed, replacements, .. } = options.clone();
                let synth = Synth::new(&SynthOptions { rate: stream.rate(), seed, replacements });
                receiver.drop_pending_cries();
                let (error, back) = stream.play(synth, receiver, shared);
                receiver = back;
                error
            }
            Err(silence) => Some(silence),
        };
        let Some(error) = error else { return };
        if !is_reported {
            // If the channel is full, nobody reads the events, and this one is not needed.
            let _ = events.try_send(PlayerEvent::Silent(error));
            is_reported = true;
        }
        sleep_unless_over(RETRY_INTERVAL, shared);
    }
}

/// Waits, but not longer than until the player is dropped.
fn sleep_unless_over(time: Duration, shared: &PlaybackState) {
    let end = Instant::now() + time;
    while let Some(left) = end.checked_duration_since(Instant::now()).filter(|l| !l.is_zero()) {
        if shared.is_over.load(Ordering::Relaxed) {
            return;
        }
        thread::park_timeout(left);
    }
}
