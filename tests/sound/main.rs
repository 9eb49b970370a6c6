//! The sound of the treatment.

#[path = "../support/mod.rs"]
mod support;
mod audio;
#[cfg(all(unix, not(target_os = "macos")))]
mod audio_server;
mod sounds;
