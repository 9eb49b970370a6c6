//! The system's own sound output, on Windows and macOS.
//!
//! Takes the default output. Gives a stream for which the system requests samples. Never needs a library beyond the
//! system's own.

use super::playback::{AudioError, BLOCK, LISTEN_FOR, PlaybackOptions, PlaybackState};
use super::sound_channel::SoundReceiver;
use super::synth::Synth;
use cpal::traits::{DeviceTrait, HostTrait, StreamTrait};
use cpal::{BufferSize, Device, ErrorKind, StreamConfig, SupportedBufferSize};
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex, mpsc};
use std::time::Duration;

/// NativeStream to the system's default output.
pub struct NativeStream {
    device: Device,
    name: String,
    config: StreamConfig,
}

impl NativeStream {
    pub fn open(output: &PlaybackOptions) -> Result<NativeStream, AudioError> {
        let device = cpal::default_host().default_output_device().ok_or_else(|| AudioError::Unavailable {
            why: "the system has no sound output; connect one, or select one in the system's settings".into(),
        })?;
        let name =
            device.description().map_or_else(|_| "the sound output".into(), |d| format!("the output {}", d.name()));
        let offered = device
            .default_output_config()
            .map_err(|error| AudioError::Refused { place: name.clone(), why: error.to_string() })?;
        // Two blocks are queued at any time.
        let block = (output.latency.as_secs_f64() / 2.0 * f64::from(offered.sample_rate())) as u32;
        let buffer_size = match *offered.buffer_size() {
            SupportedBufferSize::Range { min, max } => BufferSize::Fixed(block.clamp(min, max)),
            SupportedBufferSize::Unknown => BufferSize::Default,
        };
        let config = StreamConfig { buffer_size, ..offered.config() };
        Ok(NativeStream { device, name, config })
    }

    pub fn place(&self) -> String {
        self.name.clone()
    }

    pub fn rate(&self) -> u32 {
        self.config.sample_rate
    }

    /// Returns `None`: the system does not report its latency.
    pub fn latency(&self) -> Option<Duration> {
        None
    }

    /// Plays until the player is dropped (`None`) or the output is lost.
    pub fn play(
        self,
        synth: Synth,
        receiver: SoundReceiver,
        shared: &PlaybackState,
    ) -> (Option<AudioError>, SoundReceiver) {
        // Only the system's thread takes this lock while it plays; afterwards the receiver is taken out again.
        let voice = Arc::new(Mutex::new(Some((synth, receiver))));
        let why = self.play_until_over(&voice, shared);
        let left = voice.lock().unwrap_or_else(|broken| broken.into_inner()).take();
        let (_, receiver) = left.expect("set above, and taken only here");
        (why.map(|why| AudioError::Lost { place: self.name, why }), receiver)
    }

    fn play_until_over(
        &self,
        voice: &Arc<Mutex<Option<(Synth, SoundReceiver)>>>,
        shared: &PlaybackState,
    ) -> Option<String> {
        let channels = usize::from(self.config.channels.max(1));
        let (failed, failures) = mpsc::channel();
        let voice = voice.clone();
        let fill = move |samples: &mut [f32], _: &cpal::OutputCallbackInfo| {
            let mut voice = voice.try_lock();
            let Some((synth, receiver)) = voice.as_deref_mut().ok().and_then(Option::as_mut) else {
                return samples.fill(0.0);
            };
            spread(samples, channels, |block| receiver.fill(synth, block));
        };
        let fail = move |error: cpal::Error| drop(failed.send(error));
        let stream = match self.device.build_output_stream(self.config, fill, fail, None) {
            Ok(stream) => stream,
            Err(error) => return Some(format!("cannot be opened: {error}")),
        };
        if let Err(error) = stream.play() {
            return Some(format!("cannot be started: {error}"));
        }
        while !shared.is_over.load(Ordering::Relaxed) {
            match failures.recv_timeout(LISTEN_FOR).map(|error| (error.kind(), error)) {
                Ok((ErrorKind::Xrun, _)) => drop(shared.underruns.fetch_add(1, Ordering::Relaxed)),
                Ok((ErrorKind::DeviceChanged | ErrorKind::RealtimeDenied, _)) => {}
                Ok((_, error)) => return Some(format!("reports: {error}")),
                Err(mpsc::RecvTimeoutError::Timeout) => {}
                Err(mpsc::RecvTimeoutError::Disconnected) => return Some("ended".into()),
            }
        }
        None
    }
}

/// Writes the same samples to every channel.
fn spread(samples: &mut [f32], channels: usize, mut fill: impl FnMut(&mut [f32])) {
    let mut block = [0.0; BLOCK];
    for frames in samples.chunks_mut(BLOCK * channels) {
        let block = &mut block[..frames.len() / channels];
        fill(block);
        for (frame, sample) in frames.chunks_mut(channels).zip(block.iter()) {
            frame.fill(*sample);
        }
    }
}
