//! The sound of the treatment: drill, hand instrument, suction, and the patient's voice.
//!
//! Takes a plain [`DrillLoad`] and, now and then, a cry. Gives samples ([`Synth::fill`]), or lets them be heard through the
//! system's sound ([`Player`]). Never knows the simulation, never makes anyone wait, never fails aloud: who cannot be heard
//! says so once and goes on.

mod load;
mod signal;
mod rotor;
mod contact;
mod air;
mod voice;
mod cries;
mod clip;
mod synth;
mod player;
#[cfg(all(unix, not(target_os = "macos")))]
mod pulse;
#[cfg(not(all(unix, not(target_os = "macos"))))]
mod native;

pub use clip::{Clip, Replacements};
pub use cries::CRIES;
pub use load::{DrillLoad, Tool};
pub use player::{Heard, News, Output, Player, RETRY, Silence, Sounds, sounds};
pub use synth::{Options, Synth};
