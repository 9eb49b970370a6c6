//! The sound of the treatment: drill, hand instrument, suction, and the patient's voice.
//!
//! Takes a plain [`DrillLoad`] and, occasionally, a cry. Gives samples ([`Synth::fill`]), or plays them through the
//! system's sound output ([`SoundPlayer`]). Never depends on the simulation, never blocks its caller, and never
//! fails: if no sound can be played, the player reports it once and keeps trying.
//!
//! # Examples
//!
//! ```
//! use typodont_audio::{DrillLoad, Synth, SynthOptions, Tool};
//!
//! let mut synth = Synth::new(&SynthOptions::default());
//! let load = DrillLoad { tool: Tool::AirTurbine, is_running: true, speed: 300_000.0, ..DrillLoad::default() };
//! let mut block = [0.0; 4800]; // 0.1 s at 48 kHz
//! synth.fill(&load, &mut block);
//! assert!(block.iter().any(|sample| sample.abs() > 0.01));
//! assert!(block.iter().all(|sample| sample.abs() <= 1.0));
//! ```

mod load;
mod signal;
mod handpiece;
mod contact_sound;
mod airflow;
mod voice;
mod cries;
mod clip;
mod synth;
pub mod wav_files;
mod sound_channel;
mod playback;
mod player;
#[cfg(not(feature = "playback"))]
mod no_playback;
#[cfg(all(feature = "playback", unix, not(target_os = "macos")))]
mod pulse;
#[cfg(all(feature = "playback", not(all(unix, not(target_os = "macos")))))]
mod native;

pub use clip::{Clip, Replacements};
pub use cries::CRIES;
pub use load::{DrillLoad, LOAD_WORDS, Tool};
pub use playback::{AudioError, PlaybackOptions};
pub use player::{PlayerEvent, RETRY_INTERVAL, SoundPlayer, output_name};
pub use sound_channel::{SoundReceiver, SoundSender, sound_channel};
pub use synth::{Synth, SynthOptions};
