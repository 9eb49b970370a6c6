//! A plain mouse as a device: the screen plane and the wheel. It renders no force; the window draws a spring instead.
//!
//! Takes pointer events of a window, through a [`Mouse`] that any thread may hold. Gives a device whose hand follows
//! the pointer and, to the window, the position of that hand and the force it would feel. Never reads a mouse itself.

use crate::{Driver, FoundDevice, OpenError};
use std::sync::Arc;
use std::sync::atomic::{AtomicI32, AtomicU32, Ordering};
use typodont_core::device::{Device, DeviceError, DeviceSpec, Pacing, Reading, UPRIGHT, Wrench};
use typodont_core::frame::{Pose, Quat, Vec3};
use typodont_core::mailbox::SeqLock;
use typodont_core::tick::TICK_S;

/// Half the box that the pointer can reach, mm: a tooth with room around it. Beyond 40 one sweep of the screen is too
/// short.
const WORKSPACE_HALF: Vec3 = Vec3::new(30.0, 25.0, 20.0);

/// Hand displacement per pixel, mm. Chosen so that a pixel is smaller than a voxel (0.1–0.2 mm) and a sweep of 600
/// pixels crosses the workspace.
const MM_PER_PIXEL: f32 = 0.1;

/// Hand displacement per step of the wheel, mm.
const MM_PER_STEP: f32 = 0.5;

/// Time constant with which the hand approaches the pointer, s. Windows sample the pointer 60 to 125 times a second;
/// the hand smooths these steps instead of jumping through tissue.
const FOLLOW_TIME: f32 = 0.02;

/// Maximum speed of the hand, mm/s: that of a fast hand with an instrument.
const FOLLOW_SPEED: f32 = 250.0;

/// Positions are stored in µm, as integers, so that any thread may add to them.
const UM_PER_MM: f32 = 1000.0;

/// A mouse as seen by a window. Clones refer to the same mouse.
#[derive(Clone, Debug)]
pub struct Mouse(Arc<MouseState>);

#[derive(Debug)]
struct MouseState {
    /// Position of the pointer, world space, µm.
    pointer: [AtomicI32; 3],
    buttons: AtomicU32,
    /// Hand position and force, three floats each. Written only by the device.
    feedback: SeqLock<6>,
}

impl Mouse {
    /// Creates a mouse and the device that it moves; the hand starts at the origin.
    pub fn new() -> (Mouse, MouseDevice) {
        let shared =
            Arc::new(MouseState { pointer: Default::default(), buttons: AtomicU32::new(0), feedback: SeqLock::new() });
        let device = MouseDevice { shared: shared.clone(), spec: spec(), hand: Vec3::ZERO };
        (Mouse(shared), device)
    }

    /// Moves the pointer by pixels to the right and down, as windows count them. `world_from_view` is the orientation
    /// of the view under the pointer (right, up, toward the eye) in the world.
    pub fn move_by_pixels(&self, right_px: f32, down_px: f32, world_from_view: Quat) {
        self.move_by(world_from_view * Vec3::new(nan_to_zero(right_px), -nan_to_zero(down_px), 0.0) * MM_PER_PIXEL);
    }

    /// Moves the pointer by steps of the wheel. Forward, away from the user, is positive and moves the hand into the
    /// picture.
    pub fn move_by_wheel(&self, steps: f32, world_from_view: Quat) {
        self.move_by(world_from_view * Vec3::new(0.0, 0.0, -nan_to_zero(steps)) * MM_PER_STEP);
    }

    /// Presses or releases a button; bit 0 is the main one. There are 32.
    pub fn set_button(&self, bit: u32, is_down: bool) {
        let mask = 1u32.checked_shl(bit).unwrap_or(0);
        match is_down {
            true => self.0.buttons.fetch_or(mask, Ordering::Relaxed),
            false => self.0.buttons.fetch_and(!mask, Ordering::Relaxed),
        };
    }

    /// Releases all buttons and moves the pointer to `place` (world space, mm). At the position of the working end
    /// this ends all contact force.
    pub fn release_at(&self, place: Vec3) {
        for ((at, mm), half) in self.0.pointer.iter().zip(place.to_array()).zip(WORKSPACE_HALF.to_array()) {
            at.store((mm.clamp(-half, half) * UM_PER_MM).round() as i32, Ordering::Relaxed);
        }
        self.0.buttons.store(0, Ordering::Relaxed);
    }

    /// Returns the hand's position (world space, mm) and the force that it does not feel (N), for a spring on the
    /// screen. `None` before the first tick.
    pub fn hand_and_force(&self) -> Option<(Vec3, Vec3)> {
        let [a, b, c, d, e, f] = self.0.feedback.read()?.1.map(f32::from_bits);
        Some((Vec3::new(a, b, c), Vec3::new(d, e, f)))
    }

    /// Moves the pointer within the workspace, so that it responds at once when it turns back from the border.
    fn move_by(&self, by: Vec3) {
        for ((at, by), half) in self.0.pointer.iter().zip(by.to_array()).zip(WORKSPACE_HALF.to_array()) {
            let (by_um, half_um) = ((by * UM_PER_MM).round() as i32, (half * UM_PER_MM) as i32);
            let moved = |um: i32| Some(um.saturating_add(by_um).clamp(-half_um, half_um));
            // Always `Ok`: the closure never returns `None`.
            let _ = at.fetch_update(Ordering::Relaxed, Ordering::Relaxed, moved);
        }
    }
}

/// Replaces NaN by zero, since NaN in one direction would spread to the others.
fn nan_to_zero(value: f32) -> f32 {
    if value.is_nan() { 0.0 } else { value }
}

/// Device whose hand follows a [`Mouse`].
#[derive(Debug)]
pub struct MouseDevice {
    shared: Arc<MouseState>,
    spec: DeviceSpec,
    hand: Vec3,
}

impl Device for MouseDevice {
    fn spec(&self) -> &DeviceSpec {
        &self.spec
    }

    fn pacing(&self) -> Pacing {
        Pacing::Host
    }

    fn exchange(&mut self, output: &Wrench) -> Result<Reading, DeviceError> {
        let pointer = Vec3::from_array([0, 1, 2].map(|i| self.shared.pointer[i].load(Ordering::Relaxed) as f32));
        let toward = pointer / UM_PER_MM - self.hand;
        let step = toward * (TICK_S as f32 / FOLLOW_TIME);
        self.hand += step.clamp_length_max(FOLLOW_SPEED * TICK_S as f32);
        let [a, b, c] = self.hand.to_array().map(f32::to_bits);
        let [d, e, f] = output.force.to_array().map(f32::to_bits);
        self.shared.feedback.write([a, b, c, d, e, f]);
        let pose = Pose { position: self.hand, orientation: UPRIGHT };
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
        "a plain mouse: screen plane and wheel, no force; only in the desktop program's window"
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
