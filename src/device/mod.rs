//! Haptic devices: what they can do, what they report, what they are told.
//!
//! Takes a force, gives a reading; units and axes are converted inside each driver, so that everyone else sees world
//! space: x to the right, y up, z toward the user, mm, N. Never knows what the hand holds or touches.

mod coupling;
mod driver;
mod forcedimension;
mod hand;
mod haply;
pub mod hid;
mod link;
pub mod mouse;
pub mod open_handle;
mod openhaptics;
mod playback;
pub mod polhem;
pub mod realtime;
mod relay;
mod scripted;
mod shared_library;
pub mod spacemouse;
mod stream;
mod told;
mod trust;

pub use coupling::{Coupling, Far, Tie};
pub use driver::{DRIVERS, Driver, Found, Trouble, driver};
pub use hand::{Hand, HandModel};
pub use link::{Link, Mate};
pub use playback::Playback;
pub use relay::{Relay, Report, Wire};
pub use scripted::{Felt, Move, Scripted, Tremor};
pub use told::FORCE_LIFE;

use crate::frame::{Pose, Quat, Vec3};
use core::f32::consts::FRAC_1_SQRT_2;
use std::fmt;

/// What a device is and can render. Limits are those of the weakest axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Spec {
    pub name: String,
    /// N, for moments.
    pub max_force: f32,
    /// N, for hours.
    pub continuous_force: f32,
    /// N·mm, for moments; 0 where only forces are rendered.
    pub max_torque: f32,
    /// Stiffest spring it renders well at 1 kHz, N/mm.
    pub max_stiffness: f32,
    /// N·s/mm
    pub max_damping: f32,
    /// Smallest step of position it reports, mm.
    pub resolution: f32,
    /// Half the size of the box it reaches, mm.
    pub workspace_half: Vec3,
    /// Mass felt at the tip, kg.
    pub apparent_mass: f32,
}

impl Spec {
    /// SensAble PHANTOM Omni, data sheet of 2004: 3.3 N, 0.88 N continuous, stiffness 1.26/2.31/1.02 N/mm by axis (the
    /// weakest counts: a spring must feel alike in all directions), 0.055 mm, 160×120×70 mm, 45 g. Damping 5 N·s/m as
    /// other toolkits use for it.
    pub fn phantom_omni() -> Spec {
        Spec {
            name: "PHANTOM Omni".into(),
            max_force: 3.3,
            continuous_force: 0.88,
            max_torque: 0.0,
            max_stiffness: 1.02,
            max_damping: 0.005,
            resolution: 0.055,
            workspace_half: Vec3::new(80.0, 60.0, 35.0),
            apparent_mass: 0.045,
        }
    }
}

/// How a handle is held that cannot tell: upright, the working end down.
///
/// A handle's own space has its origin at the working end and +z from there along the shaft toward the hand, as HDAPI's
/// stylus has; so this turns z up.
pub const UPRIGHT: Quat = Quat::from_xyzw(-FRAC_1_SQRT_2, 0.0, 0.0, FRAC_1_SQRT_2);

/// What a device reports for one tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// Tip and orientation in world space, `world_from_handle`; [`UPRIGHT`] from a device that senses no orientation.
    pub pose: Pose,
    /// One bit per button, bit 0 the main one.
    pub buttons: u32,
}

impl Reading {
    /// What a beat brings that cannot be trusted: no number in it is finite, so the first gate refuses it and the
    /// simulation lets the hand go.
    pub const ABSENT: Reading = Reading { pose: Pose { position: Vec3::NAN, orientation: Quat::NAN }, buttons: 0 };

    pub fn at(position: Vec3) -> Reading {
        Reading { pose: Pose::at(position), buttons: 0 }
    }
}

/// What a device is told to render until the next exchange.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Output {
    /// N, world space.
    pub force: Vec3,
    /// N·mm about the tip, world space. Dropped by a device that renders no torque.
    pub torque: Vec3,
}

impl Output {
    /// Nothing: the hand is free.
    pub const NONE: Output = Output { force: Vec3::ZERO, torque: Vec3::ZERO };

    /// No more than a device can render; nothing of what is no number.
    pub fn within(&self, spec: &Spec) -> Output {
        let no_longer = |v: Vec3, most: f32| if v.is_finite() { v.clamp_length_max(most) } else { Vec3::ZERO };
        Output { force: no_longer(self.force, spec.max_force), torque: no_longer(self.torque, spec.max_torque) }
    }
}

/// Anything that stands in a hand.
pub trait Device {
    fn spec(&self) -> &Spec;

    /// One beat: hands over the force and fetches the newest reading.
    ///
    /// Called on the servo: never allocates, logs or opens anything once the device is open, and returns within a few
    /// milliseconds whatever happens. A force is good for this beat only: a device for which no exchange comes lets go by
    /// itself. While [`Device::state`] is not ready the force is not rendered.
    fn exchange(&mut self, output: &Output) -> Result<Reading, Gone>;

    /// Who keeps the beat.
    fn beat(&self) -> Beat {
        Beat::Ours
    }

    /// What the device is doing, as of the last exchange.
    fn state(&self) -> State {
        State::Ready
    }
}

impl<D: Device + ?Sized> Device for Box<D> {
    fn spec(&self) -> &Spec {
        (**self).spec()
    }

    fn exchange(&mut self, output: &Output) -> Result<Reading, Gone> {
        (**self).exchange(output)
    }

    fn beat(&self) -> Beat {
        (**self).beat()
    }

    fn state(&self) -> State {
        (**self).state()
    }
}

/// Who keeps the beat of 1 kHz.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Beat {
    /// The device: [`Device::exchange`] waits for its next report.
    Device,
    /// Whoever calls: [`Device::exchange`] returns at once.
    Ours,
}

/// What an open device is doing. Each is a visible state, so that nobody waits for something they cannot see.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// Readings can be trusted and forces are rendered.
    Ready,
    /// It waits for a person; what they are to do.
    Calibrate { how: &'static str },
    /// It moves or settles by itself; keep the hands off.
    Homing { what: &'static str },
    /// It reports, but its motors are off; why, and what to do.
    ForceOff { why: &'static str },
}

impl State {
    pub fn is_ready(self) -> bool {
        self == State::Ready
    }
}

impl fmt::Display for State {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            State::Ready => f.write_str("ready"),
            State::Calibrate { how } => write!(f, "needs calibrating: {how}"),
            State::Homing { what } => write!(f, "homing: {what}"),
            State::ForceOff { why } => write!(f, "no force: {why}"),
        }
    }
}

/// Why a device gives no more readings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Gone {
    /// A recording has no further ticks, a script no further moves.
    Ended,
    /// The device was unplugged or failed; what happened, and the number its driver gave for it (0 for none).
    Lost { why: &'static str, code: i32 },
}

impl fmt::Display for Gone {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Gone::Ended => f.write_str("the device has no further readings"),
            Gone::Lost { why, code: 0 } => write!(f, "the device is gone: {why}"),
            Gone::Lost { why, code } => write!(f, "the device is gone: {why} (code {code})"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_upright_handle_points_up() {
        assert!((UPRIGHT * Vec3::Z - Vec3::Y).length() < 1e-6);
        assert!(!Reading::ABSENT.pose.is_sound());
    }
}
