//! The channel through which the program tells the player what is to be heard.

use super::load::{DrillLoad, LOAD_WORDS};
use super::signal::Ramp;
use super::synth::Synth;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use typodont_core::mailbox;
use typodont_core::mailbox::{Receiver, Sender, SeqLock};

/// The program's end of a sound channel: sets what is to be heard, and never waits.
pub struct SoundSender {
    load: Arc<SeqLock<LOAD_WORDS>>,
    cries: Sender<f32>,
}

/// The player's end of a sound channel.
pub struct SoundReceiver {
    load: Arc<SeqLock<LOAD_WORDS>>,
    last: DrillLoad,
    cries: Receiver<f32>,
    pub(super) volume: Arc<PlayerVolume>,
    ramp: Ramp,
}

/// Volume, a fraction of full scale from 0 to 1, as the bits of an `f32`.
pub(super) struct PlayerVolume(AtomicU32);

impl PlayerVolume {
    fn get(&self) -> f32 {
        f32::from_bits(self.0.load(Ordering::Relaxed))
    }

    pub fn set(&self, share: f32) {
        self.0.store(share.to_bits(), Ordering::Relaxed);
    }
}

/// Samples over which a new volume is reached, so that it does not click: 10 ms at 48 kHz.
const VOLUME_STEPS: u32 = 480;

/// Cries that may wait. Only one is played at a time, so more than a few would never be played.
const CRY_CAPACITY: usize = 8;

/// Creates a channel: [`SoundSender`] for the program's thread, [`SoundReceiver`] for the player's.
pub fn sound_channel() -> (SoundSender, SoundReceiver) {
    let load = Arc::new(SeqLock::new());
    let (sender, receiver) = mailbox::channel(CRY_CAPACITY);
    let volume = Arc::new(PlayerVolume(AtomicU32::new(1.0f32.to_bits())));
    let ramp = Ramp::at(1.0);
    (
        SoundSender { load: load.clone(), cries: sender },
        SoundReceiver { load, last: DrillLoad::default(), cries: receiver, volume, ramp },
    )
}

impl SoundSender {
    /// Sets the load from now on; the newest value wins.
    pub fn set_load(&mut self, load: &DrillLoad) {
        self.load.write(load.encode());
    }

    /// Lets the patient cry, unless a cry is being played; `strength` is from 0, faint, to 1. Returns false, and
    /// drops the cry, if too many are waiting.
    pub fn cry(&mut self, strength: f32) -> bool {
        self.cries.try_send(strength).is_ok()
    }
}

impl SoundReceiver {
    /// Fills a block with the current sound. Never allocates.
    #[cfg_attr(not(feature = "playback"), expect(dead_code, reason = "only an output asks for sound"))]
    pub(super) fn fill(&mut self, synth: &mut Synth, block: &mut [f32]) {
        while let Some(strength) = self.cries.try_recv() {
            synth.cry(strength);
        }
        // A load that is being written at this moment counts from the next block on; before the first one, nothing
        // runs.
        if let Some((_, words)) = self.load.read() {
            self.last = DrillLoad::decode(words);
        }
        synth.fill(&self.last, block);
        let volume = self.volume.get();
        if self.ramp.goal != volume {
            self.ramp.ramp_to(volume, VOLUME_STEPS);
        }
        for sample in block {
            *sample *= self.ramp.next_value();
        }
    }

    /// The load that was set last; `None` before the first, and while one is being written.
    pub fn load(&self) -> Option<DrillLoad> {
        self.load.read().map(|(_, words)| DrillLoad::decode(words))
    }

    /// Strength of the next cry that waits, 0 to 1, where another player is to play it.
    pub fn next_cry(&mut self) -> Option<f32> {
        self.cries.try_recv()
    }

    /// Drops the cries that were sent while nothing could be heard.
    pub(super) fn drop_pending_cries(&mut self) {
        while self.cries.try_recv().is_some() {}
    }
}
