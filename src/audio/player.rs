//! Who lets the sound be heard: a thread of its own, at whatever pace the sound server asks.

#[cfg(not(all(unix, not(target_os = "macos"))))]
use super::native::Stream;
#[cfg(all(unix, not(target_os = "macos")))]
use super::pulse::Stream;

use super::clip::Replacements;
use super::load::{DrillLoad, WORDS};
use super::signal::Ramp;
use super::synth::{Options, Synth};
use crate::mailbox::{self, Newest, Receiver, Sender};
use std::fmt;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

/// The program's end: says what is to be heard, and never waits for it.
pub struct Sounds {
    load: Arc<Newest<WORDS>>,
    cries: Sender<f32>,
}

/// The player's end.
pub struct Heard {
    load: Arc<Newest<WORDS>>,
    last: DrillLoad,
    cries: Receiver<f32>,
    volume: Arc<Volume>,
    ramp: Ramp,
}

/// A share of full scale, 0 to 1, as the bits of an `f32`.
struct Volume(AtomicU32);

impl Volume {
    fn share(&self) -> f32 {
        f32::from_bits(self.0.load(Ordering::Relaxed))
    }
}

/// Samples in which a new volume is reached, so that it does not click: 10 ms at 48 kHz.
const VOLUME_STEPS: u32 = 480;

/// Cries that may wait. The patient has one mouth, so more than a few are never said.
const CRIES_WAITING: usize = 8;

/// A pair: what [`Sounds`] says, [`Heard`] hears, from one thread to another.
pub fn sounds() -> (Sounds, Heard) {
    let load = Arc::new(Newest::new());
    let (sender, receiver) = mailbox::ordered(CRIES_WAITING);
    let volume = Arc::new(Volume(AtomicU32::new(1.0f32.to_bits())));
    let ramp = Ramp::at(1.0);
    (
        Sounds { load: load.clone(), cries: sender },
        Heard { load, last: DrillLoad::default(), cries: receiver, volume, ramp },
    )
}

impl Sounds {
    /// The load from now on; the newest wins.
    pub fn load(&mut self, load: &DrillLoad) {
        self.load.write(load.to_words());
    }

    /// The patient cries, unless they already do; `strength` from 0, faint, to 1. False when too many cries wait: that one is
    /// lost.
    pub fn cry(&mut self, strength: f32) -> bool {
        self.cries.try_send(strength).is_ok()
    }
}

impl Heard {
    /// Fills a block with what is to be heard now. Never allocates.
    pub(super) fn fill(&mut self, synth: &mut Synth, block: &mut [f32]) {
        while let Some(strength) = self.cries.try_recv() {
            synth.cry(strength);
        }
        // A load that is being written this very moment counts from the next block on; before the first, nothing runs.
        if let Some((_, words)) = self.load.read() {
            self.last = DrillLoad::from_words(words);
        }
        synth.fill(&self.last, block);
        let volume = self.volume.share();
        if self.ramp.goal != volume {
            self.ramp.aim(volume, VOLUME_STEPS);
        }
        for sample in block {
            *sample *= self.ramp.next();
        }
    }

    /// Cries from while nobody could hear them are not made up for.
    fn forget_cries(&mut self) {
        while self.cries.try_recv().is_some() {}
    }
}

/// Where and how to play.
#[derive(Clone, Debug, PartialEq)]
pub struct Output {
    pub seed: u64,
    pub replacements: Replacements,
    /// From a load to the ear, as far as it is ours to ask for: 0.01 to 0.2 s. A server may give less or more.
    pub latency: Duration,
    /// A PulseAudio socket other than the session's own (Linux only).
    pub server: Option<PathBuf>,
}

/// Long enough for a busy desktop, short enough for hand and ear to agree: 20 to 30 ms works.
const LATENCY: Duration = Duration::from_millis(24);

impl Default for Output {
    fn default() -> Self {
        Output { seed: 0, replacements: Replacements::default(), latency: LATENCY, server: None }
    }
}

/// What the player has to say. Each is said once, and again only after its opposite.
#[derive(Clone, Debug, PartialEq)]
pub enum News {
    /// It can be heard, through what `place` names; the server keeps it back for `latency`, unless it does not say.
    Playing { place: String, latency: Option<Duration> },
    /// It cannot be heard. The player tries again by itself, every [`RETRY`].
    Silent(Silence),
}

/// Why nothing can be heard.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Silence {
    /// No sound server or no output.
    None { why: String },
    /// There is one, and it refuses.
    Refused { place: String, why: String },
    /// It played, and went away.
    Lost { place: String, why: String },
}

impl fmt::Display for Silence {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Silence::None { why } => write!(f, "there is no sound: {why}"),
            Silence::Refused { place, why } => write!(f, "there is no sound: {place} refuses to play it ({why})"),
            Silence::Lost { place, why } => write!(f, "the sound stopped: {place} {why}"),
        }?;
        f.write_str("; everything else goes on, and the sound comes back when it can")
    }
}

impl std::error::Error for Silence {}

/// How often a missing server is looked for. Below 1 s a refusing one would be pestered.
pub const RETRY: Duration = Duration::from_secs(2);

/// Samples at most between two looks at the load: 2.7 ms at 48 kHz. Whole looks of the synthesiser.
pub(super) const BLOCK: usize = 128;

/// How long one wait for a server's wishes, or for the end, lasts.
pub(super) const LISTEN_FOR: Duration = Duration::from_millis(50);

/// News that may wait to be read.
const NEWS_WAITING: usize = 16;

/// Plays what [`Sounds`] says until it is dropped.
pub struct Player {
    news: Receiver<News>,
    volume: Arc<Volume>,
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

/// What the player's thread and its owner both see.
#[derive(Default)]
pub(super) struct Shared {
    pub is_over: AtomicBool,
    /// How often the server ran out of samples.
    pub gaps: AtomicU64,
}

impl Player {
    /// Starts playing on a thread of its own. Where that is not possible, [`Player::news`] says why.
    pub fn start(heard: Heard, output: Output) -> Player {
        let (mut sender, news) = mailbox::ordered(NEWS_WAITING);
        let shared = Arc::new(Shared::default());
        let (seen, volume) = (shared.clone(), heard.volume.clone());
        let name = thread::Builder::new().name("sound".into());
        let thread = name.spawn(move || play(heard, &output, &mut sender, &seen)).ok();
        Player { news, volume, shared, thread }
    }

    /// The next news, if there is any.
    pub fn news(&mut self) -> Option<News> {
        self.news.try_recv()
    }

    /// How loud everything is from now on: a share of full scale, 0 to 1.
    pub fn volume(&self, share: f32) {
        let share = if share.is_nan() { 0.0 } else { share.clamp(0.0, 1.0) };
        self.volume.0.store(share.to_bits(), Ordering::Relaxed);
    }

    /// How often the server ran out of samples so far, because this machine was too busy; each was heard as a gap.
    pub fn gaps(&self) -> u64 {
        self.shared.gaps.load(Ordering::Relaxed)
    }
}

impl Drop for Player {
    fn drop(&mut self) {
        self.shared.is_over.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            thread.thread().unpark();
            // A thread that panicked plays no more; there is nobody left to tell.
            let _ = thread.join();
        }
    }
}

/// Finds a server, plays, and begins again when it goes away.
fn play(mut heard: Heard, output: &Output, news: &mut Sender<News>, shared: &Shared) {
    let mut is_told = false;
    while !shared.is_over.load(Ordering::Relaxed) {
        let silence = match Stream::open(output) {
            Ok(stream) => {
                let _ = news.try_send(News::Playing { place: stream.place(), latency: stream.latency() });
                is_told = false;
                let Output { seed, replacements, .. } = output.clone();
                let synth = Synth::new(&Options { rate: stream.rate(), seed, replacements });
                heard.forget_cries();
                let (silence, back) = stream.play(synth, heard, shared);
                heard = back;
                silence
            }
            Err(silence) => Some(silence),
        };
        let Some(silence) = silence else { return };
        if !is_told {
            // A box full of news that nobody reads needs no more of it.
            let _ = news.try_send(News::Silent(silence));
            is_told = true;
        }
        pause(RETRY, shared);
    }
}

/// Waits, or does not when it is over.
fn pause(time: Duration, shared: &Shared) {
    let end = Instant::now() + time;
    while let Some(left) = end.checked_duration_since(Instant::now()).filter(|l| !l.is_zero()) {
        if shared.is_over.load(Ordering::Relaxed) {
            return;
        }
        thread::park_timeout(left);
    }
}
