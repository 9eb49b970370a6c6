//! Surroundings of the window: settings that are kept, the user's language, the log of its state.
//!
//! One file for a computer and one for a page in a browser, with the same functions.

mod console;
#[cfg(not(target_family = "wasm"))]
mod native;
#[cfg(target_family = "wasm")]
mod web;

pub use console::close_own_console;
#[cfg(not(target_family = "wasm"))]
pub use native::*;
#[cfg(target_family = "wasm")]
pub use web::*;

/// Frames that a page, which has no threads, draws before a long step, so that the screen says what is being done.
pub const FRAMES_BEFORE_LONG_STEP: u32 = 2;

/// Writer of a line of the state log.
pub type LogSink = Box<dyn FnMut(&str)>;
