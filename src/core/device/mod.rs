//! Interface of a haptic device: its specification, its readings and the forces it renders; and simulated hands.
//!
//! Takes a wrench and gives a reading, both in world space: x to the right, y up, z toward the user; mm, N. Drivers
//! of real devices convert units and axes; they are in `typodont-devices`. Never knows which instrument the hand
//! holds or what it touches.

mod simulated_hand;
mod playback;
mod scripted;

pub use playback::PlaybackDevice;
pub use scripted::{Move, MoveResult, ScriptedDevice, Tremor};
pub use simulated_hand::{HandModel, SimulatedHand};

use crate::frame::{Pose, Quat, Vec3};
use core::f32::consts::FRAC_1_SQRT_2;
use std::fmt;

/// Capabilities of a device. Limits that differ by axis are those of the weakest axis.
#[derive(Clone, Debug, PartialEq)]
pub struct DeviceSpec {
    pub name: String,
    /// Peak force, N: can be held for moments only.
    pub max_force: f32,
    /// Continuous force, N: can be held for hours.
    pub continuous_force: f32,
    /// Peak torque, N·mm: can be held for moments only; 0 if the device renders forces only.
    pub max_torque: f32,
    /// Stiffest spring that the device renders well at 1 kHz, N/mm.
    pub max_stiffness: f32,
    /// Greatest damping that the device renders well, N·s/mm.
    pub max_damping: f32,
    /// Smallest position step that the device reports, mm.
    pub resolution: f32,
    /// Half the size of the workspace box, mm.
    pub workspace_half: Vec3,
    /// Apparent mass at the tip, kg.
    pub apparent_mass: f32,
    /// Force that is left in a browser's page; `None` outside of a page, and for a device that renders none anyway.
    pub page_force: Option<PageForce>,
}

/// Force that a browser's page renders on a device: a page cannot promise a servo at 1 kHz.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PageForce {
    /// A part of it is rendered, on a device that releases the hand by itself when the page is late.
    Reduced,
    /// Not rendered.
    Off,
}

impl DeviceSpec {
    /// SensAble PHANTOM Omni, data sheet of 2004: 3.3 N, 0.88 N continuous, stiffness 1.26/2.31/1.02 N/mm by axis
    /// (the lowest is used, because a spring must feel the same in all directions), 0.055 mm, 160×120×70 mm, 45 g.
    /// The damping of 5 N·s/m is the value used by other toolkits.
    pub fn phantom_omni() -> DeviceSpec {
        DeviceSpec {
            name: "PHANTOM Omni".into(),
            max_force: 3.3,
            continuous_force: 0.88,
            max_torque: 0.0,
            max_stiffness: 1.02,
            max_damping: 0.005,
            resolution: 0.055,
            workspace_half: Vec3::new(80.0, 60.0, 35.0),
            apparent_mass: 0.045,
            page_force: None,
        }
    }
}

/// Orientation reported by a device that senses none: the handle upright, the working end down.
///
/// Handle space has its origin at the working end and +z along the shaft toward the hand, as for the stylus in HDAPI;
/// this rotation turns +z up.
pub const UPRIGHT: Quat = Quat::from_xyzw(-FRAC_1_SQRT_2, 0.0, 0.0, FRAC_1_SQRT_2);

/// State of the hand that a device reports for one tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// Tip position and orientation, `world_from_handle`; [`UPRIGHT`] if the device senses no orientation.
    pub pose: Pose,
    /// One bit per button; bit 0 is the main button.
    pub buttons: u32,
}

impl Reading {
    /// Reading for a servo cycle without a valid report. No number in it is finite, so the input gate rejects it and
    /// the simulation releases the hand.
    pub const ABSENT: Reading = Reading { pose: Pose { position: Vec3::NAN, orientation: Quat::NAN }, buttons: 0 };

    pub fn at(position: Vec3) -> Reading {
        Reading { pose: Pose::at(position), buttons: 0 }
    }
}

/// Force and torque that a device renders until the next exchange.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Wrench {
    /// N, world space.
    pub force: Vec3,
    /// N·mm about the tip, world space. Ignored by a device that renders no torque.
    pub torque: Vec3,
}

impl Wrench {
    /// Zero force and torque: the hand is free.
    pub const ZERO: Wrench = Wrench { force: Vec3::ZERO, torque: Vec3::ZERO };

    /// Returns the wrench limited to the peak force and torque of a device; a component that is not finite becomes
    /// zero.
    pub fn clamped_to(&self, spec: &DeviceSpec) -> Wrench {
        let clamped = |v: Vec3, most: f32| if v.is_finite() { v.clamp_length_max(most) } else { Vec3::ZERO };
        Wrench { force: clamped(self.force, spec.max_force), torque: clamped(self.torque, spec.max_torque) }
    }
}

/// Haptic device, real or simulated.
pub trait Device {
    fn spec(&self) -> &DeviceSpec;

    /// Runs one servo cycle: sends the wrench and returns the newest reading.
    ///
    /// Called on the servo thread. Once the device is open, this function never allocates, logs or opens anything,
    /// and it returns within a few milliseconds in every case. A wrench is valid for this cycle only: a device that
    /// receives no further exchange releases the hand by itself. The wrench is not rendered while [`Device::state`]
    /// is not ready.
    ///
    /// # Errors
    /// If the device was lost, or a recording or script has ended.
    fn exchange(&mut self, output: &Wrench) -> Result<Reading, DeviceError>;

    /// Returns which side keeps the 1 kHz cycle.
    fn pacing(&self) -> Pacing {
        Pacing::Host
    }

    /// Returns true if a person feels the force. The servo of a device without motors spares the processor: it runs ticks
    /// several at once, up to some milliseconds late, and does not release the hand after a late one.
    fn renders_force(&self) -> bool {
        true
    }

    /// State of the device as of the last exchange.
    fn state(&self) -> DeviceState {
        DeviceState::Ready
    }
}

impl<D: Device + ?Sized> Device for Box<D> {
    fn spec(&self) -> &DeviceSpec {
        (**self).spec()
    }

    fn exchange(&mut self, output: &Wrench) -> Result<Reading, DeviceError> {
        (**self).exchange(output)
    }

    fn pacing(&self) -> Pacing {
        (**self).pacing()
    }

    fn renders_force(&self) -> bool {
        (**self).renders_force()
    }

    fn state(&self) -> DeviceState {
        (**self).state()
    }
}

/// Side that keeps the 1 kHz servo cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pacing {
    /// The device: [`Device::exchange`] waits for its next report.
    Device,
    /// The caller: [`Device::exchange`] returns at once.
    Host,
}

/// State of an open device. Each state is visible to the user, so that every wait is explained.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DeviceState {
    /// Readings are valid and forces are rendered.
    Ready,
    /// The device waits for the user; `how` says what the user must do.
    Calibrate { how: &'static str },
    /// The device moves or settles by itself, and the user must not touch it; `what` says what it is doing.
    Homing { what: &'static str },
    /// The device reports readings, but its motors are off; `why` gives the reason and the remedy.
    ForceOff { why: &'static str },
}

impl DeviceState {
    pub fn is_ready(self) -> bool {
        self == DeviceState::Ready
    }
}

impl fmt::Display for DeviceState {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            DeviceState::Ready => f.write_str("ready"),
            DeviceState::Calibrate { how } => write!(f, "calibration required: {how}"),
            DeviceState::Homing { what } => write!(f, "homing: {what}"),
            DeviceState::ForceOff { why } => write!(f, "forces off: {why}"),
        }
    }
}

/// Reason for which a device gives no further readings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DeviceError {
    /// A recording has no further ticks, or a script no further moves.
    Ended,
    /// The device was unplugged or failed: `why` gives the reason, `code` the driver's error number (0 if none).
    Lost { why: &'static str, code: i32 },
}

impl fmt::Display for DeviceError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            DeviceError::Ended => f.write_str("the device has no further readings"),
            DeviceError::Lost { why, code: 0 } => write!(f, "the device was lost: {why}"),
            DeviceError::Lost { why, code } => write!(f, "the device was lost: {why} (code {code})"),
        }
    }
}

impl std::error::Error for DeviceError {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_upright_handle_points_up() {
        assert!((UPRIGHT * Vec3::Z - Vec3::Y).length() < 1e-6);
        assert!(!Reading::ABSENT.pose.is_valid());
    }
}
