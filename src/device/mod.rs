//! Haptic devices: what they can do, what they report, what they are told.
//!
//! Takes a force, gives a reading; units and axes are converted inside each driver, so that everyone else sees world
//! space: x to the right, y up, z toward the user, mm, N. Never knows what the hand holds or touches.

mod hand;
mod playback;
mod scripted;

pub use hand::{Hand, HandModel};
pub use playback::Playback;
pub use scripted::{Felt, Move, Scripted, Tremor};

use crate::frame::{Pose, Vec3};
use std::fmt;

/// What a device is and can render. Limits are those of the weakest axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Spec {
    pub name: String,
    /// N, for moments.
    pub max_force: f32,
    /// N, for hours.
    pub continuous_force: f32,
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
            max_stiffness: 1.02,
            max_damping: 0.005,
            resolution: 0.055,
            workspace_half: Vec3::new(80.0, 60.0, 35.0),
            apparent_mass: 0.045,
        }
    }
}

/// What a device reports for one tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// Tip and orientation in world space.
    pub pose: Pose,
    /// One bit per button, bit 0 the main one.
    pub buttons: u32,
}

impl Reading {
    pub fn at(position: Vec3) -> Reading {
        Reading { pose: Pose::at(position), buttons: 0 }
    }
}

/// What a device is told to render until the next exchange.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Output {
    /// N, world space.
    pub force: Vec3,
}

/// Anything that stands in a hand.
pub trait Device {
    fn spec(&self) -> &Spec;

    /// One beat: hands over the force and fetches the newest reading.
    fn exchange(&mut self, output: &Output) -> Result<Reading, Gone>;
}

/// Why a device gives no more readings.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Gone {
    /// A recording has no further ticks, a script no further moves.
    Ended,
    /// The device was unplugged or failed.
    Lost(String),
}

impl fmt::Display for Gone {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Gone::Ended => f.write_str("the device has no further readings"),
            Gone::Lost(why) => write!(f, "the device is gone — {why}"),
        }
    }
}
