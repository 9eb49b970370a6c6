//! The window: most tests in their own process, a few with a real mouse and real keys.

#[path = "../support/mod.rs"]
mod support;
mod arm_window;
mod author_window;
mod harness;
mod lesson_window;
mod pointer_window;
mod screens;
mod trainee;
#[cfg(all(unix, not(target_os = "macos")))]
mod kiosk;
#[cfg(all(unix, not(target_os = "macos")))]
mod page;
#[cfg(all(unix, not(target_os = "macos")))]
mod window;
