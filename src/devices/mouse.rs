//! A pointer (mouse, pen or finger) as a device. It renders no force; instead its hand presses with limited force.
//!
//! Takes targets from a window, which chooses them on the surface under the pointer, through a [`Mouse`] that any
//! thread may hold. Gives a device whose hand approaches the target and, to the window, the position of that hand and
//! the force it would feel. Never reads a mouse itself.

use crate::{Driver, FoundDevice, OpenError};
use std::sync::Arc;
use std::sync::atomic::{AtomicI32, AtomicU32, Ordering};
use typodont_core::device::{Device, DeviceError, DeviceSpec, Pacing, Reading, UPRIGHT, Wrench};
use typodont_core::frame::{Pose, Quat, Vec2, Vec3};
use typodont_core::tick::TICK_S;

/// Half the box that the hand can reach, mm: the teeth of a quadrant with room around them.
const WORKSPACE_HALF: Vec3 = Vec3::new(60.0, 50.0, 40.0);

/// Time constant with which the hand approaches its target, s. Windows sample the pointer 60 to 125 times a second;
/// the hand smooths these steps instead of jumping through tissue.
const FOLLOW_TIME: f32 = 0.02;

/// Maximum speed of the free hand, mm/s: that of a fast hand with an instrument.
const FOLLOW_SPEED: f32 = 250.0;

/// Speed of the hand against resistance, mm/s, as long as it meets none of its maximum force; the speed falls in
/// proportion to the force. On enamel, felt with 1 N/mm, the force rises by at most 8 N/s, on soft caries by 0.7 N/s.
const PRESS_SPEED: f32 = 8.0;

/// Share of a force above the maximum that the hand gives way to in a tick. Tissue is felt with at most the stiffness of
/// the device, so that less than 1 never gives way too far.
const YIELD_SHARE: f32 = 0.5;

/// Time constant of the measured force, s.
const FORCE_TIME: f32 = 0.002;

/// Force below which the hand is free, N.
const FREE_FORCE: f32 = 0.02;

/// Time constant with which the handle turns, s.
const TURN_TIME: f32 = 0.15;

/// Positions are stored in µm and forces in mN, as integers, so that any thread may set them.
const UM_PER_MM: f32 = 1000.0;
const MN_PER_N: f32 = 1000.0;

/// Angles are stored in units of 10⁻⁴ rad, and the handle's lean in units of 10⁻⁴.
const ANGLE_UNITS: f32 = 1e4;

/// Maximum lean of the handle: the sine of about 65° from upright, beyond which a handpiece would lie on the teeth.
pub const LEAN_MAX: f32 = 0.9;

/// Target of the hand: set by the window, approached by the device.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HandTarget {
    /// World space, mm. Within matter it is never reached: the hand presses on the surface before it.
    pub place: Vec3,
    /// Maximum force of the hand against resistance, N. The hand gives way to a larger one.
    pub max_force: f32,
    /// Rotation of the upright handle around the vertical axis, rad.
    pub yaw: f32,
    /// Lean of the handle: components along x and z of the unit vector from the tip toward the hand, world space. The vector
    /// points upward; its horizontal part is at most [`LEAN_MAX`] long.
    pub lean: [f32; 2],
}

impl HandTarget {
    /// Orientation of the handle, `world_from_handle`.
    pub fn orientation(&self) -> Quat {
        let upright = Quat::from_rotation_y(self.yaw) * UPRIGHT;
        let [x, z] = Vec2::from_array(self.lean).clamp_length_max(LEAN_MAX).to_array();
        if x == 0.0 && z == 0.0 {
            return upright;
        }
        let handle = Vec3::new(x, (1.0 - x * x - z * z).sqrt(), z);
        Quat::from_rotation_arc(Vec3::Y, handle) * upright
    }
}

/// Everything that a window sets of a mouse.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MouseTarget {
    pub hand: HandTarget,
    /// Bit mask of the pressed buttons.
    pub buttons: u32,
}

/// A mouse as seen by a window. Clones refer to the same mouse.
#[derive(Clone, Debug)]
pub struct Mouse(Arc<MouseState>);

#[derive(Debug)]
struct MouseState {
    /// Place of the target, world space, µm.
    place: [AtomicI32; 3],
    /// mN
    max_force: AtomicU32,
    yaw: AtomicI32,
    lean: [AtomicI32; 2],
    buttons: AtomicU32,
    /// Maximum force of a target, N: that of the device.
    force_limit: f32,
}

impl Mouse {
    /// Creates a mouse and the device that it moves; the hand starts at the origin.
    pub fn new() -> (Mouse, MouseDevice) {
        let spec = spec();
        let shared = Arc::new(MouseState {
            place: Default::default(),
            max_force: AtomicU32::new(0),
            yaw: AtomicI32::new(0),
            lean: Default::default(),
            buttons: AtomicU32::new(0),
            force_limit: spec.max_force,
        });
        let device = MouseDevice {
            shared: shared.clone(),
            spec,
            hand: Vec3::ZERO,
            orientation: UPRIGHT,
            felt_force: Vec3::ZERO,
        };
        (Mouse(shared), device)
    }

    /// Sets the target of the hand, within the workspace. A value that is not finite leaves the target unchanged.
    pub fn aim(&self, target: HandTarget) {
        let HandTarget { place, max_force, yaw, lean } = target;
        let lean = Vec2::from_array(lean);
        if !(place.is_finite() && max_force.is_finite() && yaw.is_finite() && lean.is_finite()) {
            return;
        }
        for ((at, mm), half) in self.0.place.iter().zip(place.to_array()).zip(WORKSPACE_HALF.to_array()) {
            at.store((mm.clamp(-half, half) * UM_PER_MM).round() as i32, Ordering::Relaxed);
        }
        self.0.max_force.store((max_force.clamp(0.0, self.0.force_limit) * MN_PER_N).round() as u32, Ordering::Relaxed);
        self.0.yaw.store((yaw * ANGLE_UNITS).round() as i32, Ordering::Relaxed);
        for (part, value) in self.0.lean.iter().zip(lean.clamp_length_max(LEAN_MAX).to_array()) {
            part.store((value * ANGLE_UNITS).round() as i32, Ordering::Relaxed);
        }
    }

    /// Presses or releases a button; bit 0 is the main one. There are 32.
    pub fn set_button(&self, bit: u32, is_down: bool) {
        let mask = 1u32.checked_shl(bit).unwrap_or(0);
        match is_down {
            true => self.0.buttons.fetch_or(mask, Ordering::Relaxed),
            false => self.0.buttons.fetch_and(!mask, Ordering::Relaxed),
        };
    }

    /// The target and the buttons as they are now.
    pub fn state(&self) -> MouseTarget {
        MouseTarget { hand: self.0.target(), buttons: self.0.buttons.load(Ordering::Relaxed) }
    }

    /// Sets the target and all buttons, as [`Mouse::state`] of another mouse gave them.
    pub fn follow(&self, other: MouseTarget) {
        self.aim(other.hand);
        self.0.buttons.store(other.buttons, Ordering::Relaxed);
    }

    /// Releases all buttons and aims at `place` (world space, mm) without force. At the position of the working end
    /// this ends all contact force.
    pub fn release_at(&self, place: Vec3) {
        self.aim(HandTarget { place, max_force: 0.0, ..self.0.target() });
        self.0.buttons.store(0, Ordering::Relaxed);
    }
}

impl MouseState {
    fn target(&self) -> HandTarget {
        let place = [0, 1, 2].map(|i| self.place[i].load(Ordering::Relaxed) as f32 / UM_PER_MM);
        HandTarget {
            place: Vec3::from_array(place),
            max_force: self.max_force.load(Ordering::Relaxed) as f32 / MN_PER_N,
            yaw: self.yaw.load(Ordering::Relaxed) as f32 / ANGLE_UNITS,
            lean: [0, 1].map(|i| self.lean[i].load(Ordering::Relaxed) as f32 / ANGLE_UNITS),
        }
    }
}

/// Device whose hand follows a [`Mouse`].
///
/// Free, the hand goes straight to its target. Against resistance it presses like a light hand: the force rises slowly
/// to the maximum that the target allows, and the hand gives way to more, so that it slides along a surface.
#[derive(Debug)]
pub struct MouseDevice {
    shared: Arc<MouseState>,
    spec: DeviceSpec,
    hand: Vec3,
    orientation: Quat,
    /// Smoothed force on the hand, N.
    felt_force: Vec3,
}

impl MouseDevice {
    /// Returns the displacement of the hand in one tick, mm.
    fn displacement(&self, target: &HandTarget) -> Vec3 {
        const TICK: f32 = TICK_S as f32;
        /// Keeps the share of the maximum force finite, N.
        const LEAST_FORCE: f32 = 0.01;
        let toward = target.place - self.hand;
        let free = (toward * (TICK / FOLLOW_TIME)).clamp_length_max(FOLLOW_SPEED * TICK);
        let load = self.felt_force.length();
        if load < FREE_FORCE {
            return free;
        }
        let out = self.felt_force / load;
        let inward = (-free.dot(out)).max(0.0);
        let unused = target.max_force.max(LEAST_FORCE) - load;
        let advance = match unused > 0.0 {
            true => inward.min(PRESS_SPEED * TICK) * unused / (unused + load),
            false => (YIELD_SHARE * unused / self.spec.max_stiffness).max(-FOLLOW_SPEED * TICK),
        };
        free + out * (inward - advance)
    }
}

impl Device for MouseDevice {
    fn spec(&self) -> &DeviceSpec {
        &self.spec
    }

    fn pacing(&self) -> Pacing {
        Pacing::Host
    }

    fn renders_force(&self) -> bool {
        false
    }

    fn exchange(&mut self, output: &Wrench) -> Result<Reading, DeviceError> {
        const TICK: f32 = TICK_S as f32;
        let target = self.shared.target();
        self.felt_force += (output.force - self.felt_force) * (TICK / FORCE_TIME);
        self.hand += self.displacement(&target);
        self.orientation = self.orientation.slerp(target.orientation(), TICK / TURN_TIME).normalize();
        let pose = Pose { position: self.hand, orientation: self.orientation };
        Ok(Reading { pose, buttons: self.shared.buttons.load(Ordering::Relaxed) })
    }
}

/// Specification of the mouse. The limits are those of a PHANTOM Omni: tissue must respond as on a device with
/// motors, because removal follows from the force, whether it is felt or only drawn.
fn spec() -> DeviceSpec {
    DeviceSpec {
        name: "mouse".into(),
        max_torque: 0.0,
        resolution: 1.0 / UM_PER_MM,
        workspace_half: WORKSPACE_HALF,
        ..DeviceSpec::phantom_omni()
    }
}

/// Driver of the mouse.
pub struct MouseDriver;

impl Driver for MouseDriver {
    fn name(&self) -> &'static str {
        "mouse"
    }

    fn description(&self) -> &'static str {
        "a mouse, pen or touch screen: points at the surface, no force; only in the desktop program's window"
    }

    fn discover(&self) -> Result<Vec<FoundDevice>, OpenError> {
        Ok(vec![FoundDevice { title: "mouse (in a window)".into(), argument: String::new() }])
    }

    fn open(&self, _argument: Option<&str>) -> Result<Box<dyn Device + Send>, OpenError> {
        Err(OpenError::new(
            "the mouse works only in a window, and the command line has none",
            "use the desktop program, or another device: `typodont devices` lists what is connected",
        ))
    }
}
