//! The window, driven with a real mouse and real keys.

#[path = "../support/mod.rs"]
mod support;
#[cfg(all(unix, not(target_os = "macos")))]
mod author_window;
#[cfg(all(unix, not(target_os = "macos")))]
mod kiosk;
#[cfg(all(unix, not(target_os = "macos")))]
mod window;
#[cfg(all(unix, not(target_os = "macos")))]
mod page;
