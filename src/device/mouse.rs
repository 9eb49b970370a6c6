//! A plain mouse: the screen's plane and the wheel. It renders no force; the window draws a spring instead.
//!
//! Takes what a window sees of the pointer, through a [`Mouse`] that any thread may hold. Gives a device whose hand follows
//! the pointer, and to the window where that hand is and what it would feel. Never reads a mouse by itself.

use super::{Beat, Device, Driver, Found, Gone, Output, Reading, Spec, Trouble, UPRIGHT};
use crate::frame::{Pose, Quat, Vec3};
use crate::mailbox::Newest;
use crate::tick::TICK_S;
use std::sync::Arc;
use std::sync::atomic::{AtomicI32, AtomicU32, Ordering};

/// Half the box that the pointer sweeps, mm: a tooth with room around it. Beyond 40 a sweep over a screen is not enough.
const WORKSPACE_HALF: Vec3 = Vec3::new(30.0, 25.0, 20.0);

/// How far the hand goes with one pixel, mm. Chosen so that a pixel is below a voxel (0.1–0.2 mm) and a sweep of 600 pixels
/// crosses the workspace.
const MM_PER_PIXEL: f32 = 0.1;

/// How far in one step of the wheel takes the hand, mm.
const MM_PER_STEP: f32 = 0.5;

/// Time in which the hand makes up for most of its distance to the pointer, s. Windows see the pointer 60 to 125 times a
/// second; the hand blends their steps instead of jumping through matter.
const FOLLOW_TIME: f32 = 0.02;

/// Fastest the hand follows, mm/s: a quick hand with an instrument.
const FOLLOW_SPEED: f32 = 250.0;

/// Places are kept in µm, so that any thread may add to them.
const UM_PER_MM: f32 = 1000.0;

/// A mouse as a window sees it. Clones are the same mouse.
#[derive(Clone, Debug)]
pub struct Mouse(Arc<Shared>);

#[derive(Debug)]
struct Shared {
    /// Where the pointer is, world space, µm.
    pointer: [AtomicI32; 3],
    buttons: AtomicU32,
    /// Hand and force, 3 floats each. Written by the device only.
    spring: Newest<6>,
}

impl Mouse {
    /// A mouse and the device that it moves; the hand is in the middle.
    pub fn new() -> (Mouse, Handle) {
        let shared =
            Arc::new(Shared { pointer: Default::default(), buttons: AtomicU32::new(0), spring: Newest::new() });
        let handle = Handle { shared: shared.clone(), spec: spec(), hand: Vec3::ZERO };
        (Mouse(shared), handle)
    }

    /// The pointer went so many pixels to the right and down, as windows count; `world_from_view` tells how the picture under
    /// it lies in the world (right, up, toward the eye).
    pub fn moved(&self, right_px: f32, down_px: f32, world_from_view: Quat) {
        self.advance(world_from_view * Vec3::new(number(right_px), -number(down_px), 0.0) * MM_PER_PIXEL);
    }

    /// The wheel was turned; forward, away from the user, is positive and takes the hand into the picture.
    pub fn wheel(&self, steps: f32, world_from_view: Quat) {
        self.advance(world_from_view * Vec3::new(0.0, 0.0, -number(steps)) * MM_PER_STEP);
    }

    /// A button went down or up; bit 0 is the main one. There are 32.
    pub fn button(&self, bit: u32, is_down: bool) {
        let mask = 1u32.checked_shl(bit).unwrap_or(0);
        match is_down {
            true => self.0.buttons.fetch_or(mask, Ordering::Relaxed),
            false => self.0.buttons.fetch_and(!mask, Ordering::Relaxed),
        };
    }

    /// Lets go: the pointer is brought to a place (world space, mm) and no button is down. At the working end's place nothing
    /// presses any more.
    pub fn rest_at(&self, place: Vec3) {
        for ((at, mm), half) in self.0.pointer.iter().zip(place.to_array()).zip(WORKSPACE_HALF.to_array()) {
            at.store((mm.clamp(-half, half) * UM_PER_MM).round() as i32, Ordering::Relaxed);
        }
        self.0.buttons.store(0, Ordering::Relaxed);
    }

    /// Where the hand is (world space, mm) and the force that it does not feel (N), for a spring on the screen. `None`
    /// before the first beat.
    pub fn spring(&self) -> Option<(Vec3, Vec3)> {
        let [a, b, c, d, e, f] = self.0.spring.read()?.1.map(f32::from_bits);
        Some((Vec3::new(a, b, c), Vec3::new(d, e, f)))
    }

    /// Adds to the pointer's place and keeps it in the workspace, so that it comes back at once from a border.
    fn advance(&self, by: Vec3) {
        for ((at, by), half) in self.0.pointer.iter().zip(by.to_array()).zip(WORKSPACE_HALF.to_array()) {
            let (by_um, half_um) = ((by * UM_PER_MM).round() as i32, (half * UM_PER_MM) as i32);
            let moved = |um: i32| Some(um.saturating_add(by_um).clamp(-half_um, half_um));
            // Always `Ok`: the closure never refuses.
            let _ = at.fetch_update(Ordering::Relaxed, Ordering::Relaxed, moved);
        }
    }
}

/// Zero for what is no number, which would spoil the other directions as well.
fn number(told: f32) -> f32 {
    if told.is_nan() { 0.0 } else { told }
}

/// The device that a [`Mouse`] moves.
#[derive(Debug)]
pub struct Handle {
    shared: Arc<Shared>,
    spec: Spec,
    hand: Vec3,
}

impl Device for Handle {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    fn beat(&self) -> Beat {
        Beat::Ours
    }

    fn exchange(&mut self, output: &Output) -> Result<Reading, Gone> {
        let pointer = Vec3::from_array([0, 1, 2].map(|i| self.shared.pointer[i].load(Ordering::Relaxed) as f32));
        let toward = pointer / UM_PER_MM - self.hand;
        let step = toward * (TICK_S as f32 / FOLLOW_TIME);
        self.hand += step.clamp_length_max(FOLLOW_SPEED * TICK_S as f32);
        let [a, b, c] = self.hand.to_array().map(f32::to_bits);
        let [d, e, f] = output.force.to_array().map(f32::to_bits);
        self.shared.spring.write([a, b, c, d, e, f]);
        let pose = Pose { position: self.hand, orientation: UPRIGHT };
        Ok(Reading { pose, buttons: self.shared.buttons.load(Ordering::Relaxed) })
    }
}

/// The limits are those of a PHANTOM Omni: matter must answer as it does on a device with motors, for what is cut follows
/// from the force, whether it is felt or drawn.
fn spec() -> Spec {
    Spec {
        name: "mouse".into(),
        max_torque: 0.0,
        resolution: 1.0 / UM_PER_MM,
        workspace_half: WORKSPACE_HALF,
        ..Spec::phantom_omni()
    }
}

/// `--device mouse`.
pub struct MouseDriver;

impl Driver for MouseDriver {
    fn name(&self) -> &'static str {
        "mouse"
    }

    fn about(&self) -> &'static str {
        "a plain mouse: screen plane and wheel, no force; only in the desktop program's window"
    }

    fn find(&self) -> Result<Vec<Found>, Trouble> {
        Ok(vec![Found { title: "mouse (in a window)".into(), argument: String::new() }])
    }

    fn open(&self, _argument: Option<&str>) -> Result<Box<dyn Device + Send>, Trouble> {
        Err(Trouble::new(
            "a mouse needs a window to move in, and the command line has none",
            "use the desktop program, or another device: `typodont devices` lists what is plugged in",
        ))
    }
}
