//! Drivers against fakes that speak the real protocols, and the servo.

#[path = "../support/mod.rs"]
mod support;
mod counting;
mod devices;
#[cfg(target_os = "linux")]
mod doctor;
mod drivers;
mod haply;
mod link_key;
mod live;
mod mouse;
mod native;
mod open_handle;
mod page;
mod pipe;
mod pointer_policy;
mod polhem;
#[cfg(unix)]
mod polhem_serial;
mod rig;
mod servo;
mod simulated;
mod soak;
mod spacemouse;
mod staged;
mod stream;
mod suite;
