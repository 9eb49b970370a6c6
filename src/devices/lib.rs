//! Drivers for haptic devices, and the servo that steps a simulation with one of them at 1 kHz.
//!
//! Takes a simulation and an open device. Gives readings and, in order, everything that the servo did. Units and axes
//! are converted inside each driver. Never lets a result depend on a clock: a monotonic clock is read only to keep
//! the rate.
//!
//! # Examples
//!
//! A device that works without hardware is the mouse, whose hand a window normally aims:
//!
//! ```
//! use typodont_core::device::{Device, Wrench};
//! use typodont_core::frame::Vec3;
//! use typodont_devices::driver_by_name;
//! use typodont_devices::mouse::{HandTarget, Mouse};
//!
//! assert!(driver_by_name("mouse").is_some());
//!
//! // The hand is aimed 10 mm to the right; it is there within a second.
//! let (mouse, mut device) = Mouse::new();
//! mouse.aim(HandTarget { place: Vec3::X * 10.0, max_force: 1.0, yaw: 0.0, lean: [0.0; 2] });
//! for _ in 0..1000 {
//!     device.exchange(&Wrench::ZERO).unwrap();
//! }
//! let reading = device.exchange(&Wrench::ZERO).unwrap();
//! assert!(reading.pose.position.distance(Vec3::X * 10.0) < 0.01);
//! ```

#[cfg(not(target_family = "wasm"))]
pub mod access;
mod coupling;
mod direct;
mod driver;
#[cfg(not(target_family = "wasm"))]
mod forcedimension;
#[cfg(not(target_family = "wasm"))]
mod haply;
pub mod hid;
mod link_key;
mod link;
pub mod mouse;
pub mod open_handle;
#[cfg(not(target_family = "wasm"))]
mod openhaptics;
pub mod polhem;
mod protocol;
pub mod realtime;
mod registry;
#[cfg(not(target_family = "wasm"))]
mod relay;
pub mod servo;
#[cfg(not(target_family = "wasm"))]
mod shared_library;
pub mod spacemouse;
#[cfg(not(target_family = "wasm"))]
mod stream;
// Without a relay, only the life time of a force is needed.
#[cfg_attr(target_family = "wasm", allow(dead_code))]
mod force_slot;
mod report_filter;
#[cfg(not(target_family = "wasm"))]
mod pose_rejects;

pub use coupling::{Coupling, CouplingParams, DelayedPosition};
pub use direct::DirectDevice;
pub use driver::{Driver, FoundDevice, OpenError};
pub use force_slot::FORCE_LIFE;
pub use link::{HandLink, LinkedHand};
pub use link_key::generate_key;
pub use protocol::{DeviceReport, Protocol};
pub use registry::{DRIVERS, NamedDevice, UnknownDriverError, driver_by_name};
#[cfg(not(target_family = "wasm"))]
pub use relay::Relay;
