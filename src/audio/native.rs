//! The system's own sound, on Windows and macOS.
//!
//! Takes the default output. Gives a stream that the system calls for samples. Needs no library beyond the system's own.

use super::player::{BLOCK, Heard, LISTEN_FOR, Output, Shared, Silence};
use super::synth::Synth;
use cpal::traits::{DeviceTrait, HostTrait, StreamTrait};
use cpal::{BufferSize, Device, ErrorKind, StreamConfig, SupportedBufferSize};
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex, mpsc};
use std::time::Duration;

/// The system's default output.
pub struct Stream {
    device: Device,
    name: String,
    config: StreamConfig,
}

impl Stream {
    pub fn open(output: &Output) -> Result<Stream, Silence> {
        let device = cpal::default_host().default_output_device().ok_or_else(|| Silence::None {
            why: "the system has no sound output; plug one in, or choose one in the system's settings".into(),
        })?;
        let name =
            device.description().map_or_else(|_| "the sound output".into(), |d| format!("the output {}", d.name()));
        let offered = device
            .default_output_config()
            .map_err(|error| Silence::Refused { place: name.clone(), why: error.to_string() })?;
        // Two blocks are on their way at any time.
        let block = (output.latency.as_secs_f64() / 2.0 * f64::from(offered.sample_rate())) as u32;
        let buffer_size = match *offered.buffer_size() {
            SupportedBufferSize::Range { min, max } => BufferSize::Fixed(block.clamp(min, max)),
            SupportedBufferSize::Unknown => BufferSize::Default,
        };
        let config = StreamConfig { buffer_size, ..offered.config() };
        Ok(Stream { device, name, config })
    }

    pub fn place(&self) -> String {
        self.name.clone()
    }

    pub fn rate(&self) -> u32 {
        self.config.sample_rate
    }

    /// The system does not say.
    pub fn latency(&self) -> Option<Duration> {
        None
    }

    /// Plays until the end (`None`) or until the output goes away.
    pub fn play(self, synth: Synth, heard: Heard, shared: &Shared) -> (Option<Silence>, Heard) {
        // The system's thread alone takes this lock while it plays; afterwards the ears come back out of it.
        let voice = Arc::new(Mutex::new(Some((synth, heard))));
        let why = self.play_until_over(&voice, shared);
        let left = voice.lock().unwrap_or_else(|broken| broken.into_inner()).take();
        let (_, heard) = left.expect("put there above, and nobody else takes it out");
        (why.map(|why| Silence::Lost { place: self.name, why }), heard)
    }

    fn play_until_over(&self, voice: &Arc<Mutex<Option<(Synth, Heard)>>>, shared: &Shared) -> Option<String> {
        let channels = usize::from(self.config.channels.max(1));
        let (failed, failures) = mpsc::channel();
        let voice = voice.clone();
        let fill = move |samples: &mut [f32], _: &cpal::OutputCallbackInfo| {
            let mut voice = voice.try_lock();
            let Some((synth, heard)) = voice.as_deref_mut().ok().and_then(Option::as_mut) else {
                return samples.fill(0.0);
            };
            spread(samples, channels, |block| heard.fill(synth, block));
        };
        let fail = move |error: cpal::Error| drop(failed.send(error));
        let stream = match self.device.build_output_stream(self.config, fill, fail, None) {
            Ok(stream) => stream,
            Err(error) => return Some(format!("cannot be opened: {error}")),
        };
        if let Err(error) = stream.play() {
            return Some(format!("does not play: {error}"));
        }
        while !shared.is_over.load(Ordering::Relaxed) {
            match failures.recv_timeout(LISTEN_FOR).map(|error| (error.kind(), error)) {
                Ok((ErrorKind::Xrun, _)) => drop(shared.gaps.fetch_add(1, Ordering::Relaxed)),
                Ok((ErrorKind::DeviceChanged | ErrorKind::RealtimeDenied, _)) => {}
                Ok((_, error)) => return Some(format!("reports: {error}")),
                Err(mpsc::RecvTimeoutError::Timeout) => {}
                Err(mpsc::RecvTimeoutError::Disconnected) => return Some("ended".into()),
            }
        }
        None
    }
}

/// The same sample on every channel.
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
