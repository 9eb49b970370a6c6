//! Mapping of the hand from the space of its device into the world, and the changes of that mapping.
//!
//! Takes poses in the space of the device, and commands. Gives poses in the world. While the mapping changes, the hand is
//! free: the last force fades out, and the tip stays or moves along a path of its own. Never moves the tip by a jump,
//! never allocates, never reads a clock.

use crate::device::Wrench;
use crate::frame::{Pose, Quat, Vec3, smooth_step};
use crate::tick::Tick;

/// Orientation and scale of the space in which a hand moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HandFrame {
    /// `world_from_device`.
    pub orientation: Quat,
    /// Distance in the world per distance of the hand, [`HandFrame::LEAST_SCALE`] to the end of [`HandFrame::SCALES`].
    pub scale: f32,
    /// Point of the world at which the middle of the device's workspace is, mm, where the hand is to be seen at a certain
    /// place; `None` leaves it where the tip's path brings it.
    pub middle: Option<Vec3>,
    /// True if the hand is free in this frame: the tip goes where the hand is, nothing is felt and nothing is cut.
    pub is_free: bool,
}

impl HandFrame {
    /// The space of the device is the world.
    pub const DEVICE: HandFrame = HandFrame { orientation: Quat::IDENTITY, scale: 1.0, middle: None, is_free: false };

    /// Scales of a hand that are offered. A hand at 0.5 moves half as far on the tooth, for fine work; at 4, a small device
    /// reaches all teeth of a jaw.
    pub const SCALES: [f32; 2] = [0.5, 4.0];

    /// Least scale: that of a hand in a picture in which a tooth fills a large screen.
    pub const LEAST_SCALE: f32 = 0.02;

    /// Farthest middle of a workspace along each axis, mm: beyond the view of any camera.
    const FARTHEST_MIDDLE: f32 = 10_000.0;

    /// Returns true for a rotation, a scale from [`HandFrame::LEAST_SCALE`] and a finite middle.
    pub fn is_valid(&self) -> bool {
        let scales = HandFrame::LEAST_SCALE..=HandFrame::SCALES[1];
        let is_near = |middle: Vec3| middle.is_finite() && middle.abs().max_element() <= HandFrame::FARTHEST_MIDDLE;
        Pose { orientation: self.orientation, ..Pose::IDENTITY }.is_valid()
            && scales.contains(&self.scale)
            && self.middle.is_none_or(is_near)
    }

    /// Returns a movement of the hand as a movement in the world, mm.
    fn movement(&self, in_device: Vec3) -> Vec3 {
        self.orientation * in_device * self.scale
    }

    /// Returns the frame at a share of the way to another one, by the shorter rotation.
    fn toward(&self, to: &HandFrame, share: f32) -> HandFrame {
        HandFrame {
            orientation: self.orientation.lerp(to.orientation, share),
            scale: self.scale + (to.scale - self.scale) * share,
            middle: to.middle,
            is_free: to.is_free,
        }
    }
}

/// Ticks in which the frame moves to a new one: slow enough for the eye to follow the handle, quick enough to be over
/// before the trainee works in the new view. 0.2 to 0.5 s feels alike.
const MOVE_TICKS: u32 = 300;

/// Minimum number of ticks in which the force fades out.
const FADE_TICKS: u32 = 100;

/// Maximum change of the force in one tick while it fades out, N: half of the step that is felt as a click.
const FADE_STEP: f32 = 0.03;

/// Maximum number of ticks of a short press of the clutch: 0.3 s, a click rather than a hold.
const SHORT_PRESS_TICKS: u64 = 300;

/// Maximum number of ticks between two short presses that belong together, as between two clicks of a mouse.
const SECOND_PRESS_TICKS: u64 = 400;

/// Path of the tip while the mapping changes; world space, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum TipPath {
    /// The tip stays at a point, wherever the hand goes.
    Stay(Vec3),
    /// The tip keeps its place in the workspace of the device, which turns about the origin of the world.
    Turn,
    /// The tip moves from a point to where the hand is once the middle of its workspace is at the frame's middle, or at the
    /// origin again.
    Centre(Vec3),
}

/// Force and torque that fade out on the hand, in the space of the device.
#[derive(Clone, Copy, Debug)]
struct FadingWrench {
    from: Wrench,
    ticks: u32,
    ticks_left: u32,
}

impl FadingWrench {
    fn of(from: Wrench) -> FadingWrench {
        // A force has passed the gate, so the conversion is of a small number.
        let ticks = FADE_TICKS.max((from.force.length() / FADE_STEP).ceil() as u32);
        let is_felt = from != Wrench::ZERO;
        FadingWrench { from, ticks, ticks_left: if is_felt { ticks } else { 0 } }
    }

    /// Returns the wrench of the next tick; zero at the end.
    fn advance(&mut self) -> Wrench {
        self.ticks_left = self.ticks_left.saturating_sub(1);
        let share = self.ticks_left as f32 / self.ticks as f32;
        Wrench { force: self.from.force * share, torque: self.from.torque * share }
    }
}

/// Change of the mapping that is in progress.
#[derive(Clone, Copy, Debug)]
struct MappingChange {
    from: HandFrame,
    from_middle: Vec3,
    to: HandFrame,
    path: TipPath,
    /// Ticks until the frame has arrived.
    ticks_left: u32,
    fade: FadingWrench,
}

/// Presses of the clutch.
#[derive(Clone, Copy, Debug, Default)]
struct Clutch {
    is_pressed: bool,
    pressed_at: Tick,
    /// End of a short press that a second one may follow.
    short_press: Option<Tick>,
    /// True if the present press follows a short one soon enough.
    is_second: bool,
}

impl Clutch {
    fn press(&mut self, now: Tick) {
        let is_second = self.short_press.is_some_and(|ended| now.0 - ended.0 <= SECOND_PRESS_TICKS);
        *self = Clutch { is_pressed: true, pressed_at: now, short_press: None, is_second };
    }

    /// Returns true if this was the second of two short presses.
    fn release(&mut self, now: Tick) -> bool {
        let is_short = now.0 - self.pressed_at.0 <= SHORT_PRESS_TICKS;
        let is_double = is_short && self.is_second;
        *self = Clutch { short_press: (is_short && !is_double).then_some(now), ..Clutch::default() };
        is_double
    }
}

/// Pose of the hand in the world while the mapping changes, and the wrench that still fades out, in the space of the
/// device.
#[derive(Clone, Copy, Debug)]
pub(super) struct FreeHand {
    pub world_from_handle: Pose,
    pub wrench: Wrench,
}

/// State of the mapping from the device into the world.
#[derive(Clone, Debug)]
pub(super) struct HandMapping {
    frame: HandFrame,
    /// Point of the world at which the middle of the device's workspace is, mm.
    middle: Vec3,
    /// True while the world is the space of the device, so that most ticks need not compare the frame.
    is_device_space: bool,
    change: Option<MappingChange>,
    clutch: Clutch,
    /// True once a hand was seen; before, there is no tip that could stay.
    has_hand: bool,
}

impl HandMapping {
    /// Mapping of a simulation whose world is the space of the device.
    pub fn new() -> HandMapping {
        HandMapping {
            frame: HandFrame::DEVICE,
            middle: Vec3::ZERO,
            is_device_space: true,
            change: None,
            clutch: Clutch::default(),
            has_hand: false,
        }
    }

    /// The frame in effect.
    pub fn frame(&self) -> &HandFrame {
        &self.frame
    }

    /// True while the hand is free because the mapping changes.
    pub fn is_changing(&self) -> bool {
        self.change.is_some()
    }

    /// True if the middle of the workspace is at a certain point, or on its way there: the hand is where it is seen.
    pub fn is_registered(&self) -> bool {
        self.change.map_or(self.frame, |change| change.to).middle.is_some()
    }

    /// True while the tip stays at a point.
    pub fn is_tip_held(&self) -> bool {
        self.change.is_some_and(|change| matches!(change.path, TipPath::Stay(_)))
    }

    /// True while the middle of the workspace returns to the origin.
    pub fn is_centring(&self) -> bool {
        self.change.is_some_and(|change| matches!(change.path, TipPath::Centre(_)))
    }

    /// Returns the pose of a hand in the world, `world_from_handle`.
    pub fn world_pose(&mut self, in_device: &Pose) -> Pose {
        self.has_hand = true;
        if self.is_device_space {
            // A product with the identity may turn −0 into 0, and recordings are compared to the last bit.
            return *in_device;
        }
        self.placed(self.middle + self.frame.movement(in_device.position), in_device)
    }

    fn placed(&self, position: Vec3, in_device: &Pose) -> Pose {
        Pose { position, orientation: (self.frame.orientation * in_device.orientation).normalize() }
    }

    /// Begins to move to a frame, unless it is there or on its way. `path` is that of the tip, `rendered` the wrench of
    /// the last tick, in the space of the device. Before the first hand the frame is set at once. Returns true if the
    /// hand is free from now on.
    pub fn place(&mut self, to: HandFrame, path: TipPath, rendered: Wrench) -> bool {
        if to == self.change.map_or(self.frame, |change| change.to) {
            return false;
        }
        if !self.has_hand {
            (self.frame, self.middle) = (to, to.middle.unwrap_or_default());
            self.is_device_space = self.frame == HandFrame::DEVICE;
            return false;
        }
        self.begin(to, path, rendered);
        true
    }

    /// Presses or releases the clutch. `tip` is the present tip in the world, mm, `rendered` as for
    /// [`HandMapping::place`]. Returns true if the hand is free from now on.
    pub fn press_clutch(&mut self, is_pressed: bool, now: Tick, tip: Vec3, rendered: Wrench) -> bool {
        if !self.has_hand || is_pressed == self.clutch.is_pressed {
            return false;
        }
        let to = self.change.map_or(self.frame, |change| change.to);
        if is_pressed && to.middle.is_some() {
            // The tip would no longer be where the hand is seen.
            return false;
        }
        if is_pressed {
            self.clutch.press(now);
            self.begin(to, TipPath::Stay(tip), rendered);
        } else if self.clutch.release(now) {
            self.begin(to, TipPath::Centre(tip), rendered);
        }
        is_pressed
    }

    fn begin(&mut self, to: HandFrame, path: TipPath, rendered: Wrench) {
        let is_moving = to != self.frame || matches!(path, TipPath::Centre(_));
        self.change = Some(MappingChange {
            from: self.frame,
            from_middle: self.middle,
            to,
            path,
            ticks_left: if is_moving { MOVE_TICKS } else { 0 },
            fade: self.change.map_or_else(|| FadingWrench::of(rendered), |change| change.fade),
        });
    }

    /// Ends the force that fades out: the hand was lost.
    pub fn drop_force(&mut self) {
        if let Some(change) = &mut self.change {
            change.fade = FadingWrench::of(Wrench::ZERO);
        }
    }

    /// Advances the change in progress by one tick with a pose of the hand in the space of its device; `None` if there is
    /// no change.
    pub fn advance(&mut self, in_device: &Pose) -> Option<FreeHand> {
        let mut change = self.change?;
        change.ticks_left = change.ticks_left.saturating_sub(1);
        let share = smooth_step(1.0 - change.ticks_left as f32 / MOVE_TICKS as f32);
        self.frame = if change.ticks_left == 0 { change.to } else { change.from.toward(&change.to, share) };
        let moved = self.frame.movement(in_device.position);
        let tip = match change.path {
            TipPath::Stay(tip) => {
                self.middle = tip - moved;
                tip
            }
            TipPath::Turn => {
                let turn = self.frame.orientation * change.from.orientation.conjugate();
                self.middle = turn * change.from_middle * (self.frame.scale / change.from.scale);
                self.middle + moved
            }
            TipPath::Centre(tip) => {
                self.middle = match change.to.middle {
                    None => (tip - moved) * (1.0 - share),
                    Some(to) => to + (tip - moved - to) * (1.0 - share),
                };
                self.middle + moved
            }
        };
        self.is_device_space = self.frame == HandFrame::DEVICE && self.middle == Vec3::ZERO;
        let wrench = change.fade.advance();
        let is_over =
            change.ticks_left == 0 && change.fade.ticks_left == 0 && !self.clutch.is_pressed && !change.to.is_free;
        self.change = (!is_over).then_some(change);
        Some(FreeHand { world_from_handle: self.placed(tip, in_device), wrench })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f32::consts::FRAC_PI_2;

    fn hand(x: f32, y: f32, z: f32) -> Pose {
        Pose::at(Vec3::new(x, y, z))
    }

    /// Advances a mapping to the end of its change with a hand at rest; returns the number of ticks and the tip.
    fn finish(mapping: &mut HandMapping, in_device: &Pose) -> (u32, Vec3) {
        let mut ticks = 0;
        loop {
            let free = mapping.advance(in_device).expect("a change is in progress");
            ticks += 1;
            if !mapping.is_changing() {
                return (ticks, free.world_from_handle.position);
            }
            assert!(ticks < 10_000);
        }
    }

    #[test]
    fn a_turned_frame_turns_the_hand_and_not_the_tip() {
        // Aim: after the view has turned by a quarter to the right, a movement to the right goes away from the first eye,
        // and the tip has not moved meanwhile. Method: turn with the tip held, then move by 2 mm at half scale.
        let mut mapping = HandMapping::new();
        let tip = mapping.world_pose(&hand(10.0, 5.0, -3.0)).position;
        let frame = HandFrame { orientation: Quat::from_rotation_y(FRAC_PI_2), scale: 0.5, ..HandFrame::DEVICE };
        assert!(mapping.place(frame, TipPath::Stay(tip), Wrench::ZERO));
        let (ticks, after) = finish(&mut mapping, &hand(10.0, 5.0, -3.0));
        assert_eq!((ticks, after, mapping.is_changing()), (MOVE_TICKS, tip, false));
        let moved = mapping.world_pose(&hand(12.0, 5.0, -3.0)).position - tip;
        assert!(moved.distance(Vec3::new(0.0, 0.0, -1.0)) < 1e-5, "{moved}");
        assert!(!mapping.place(frame, TipPath::Stay(tip), Wrench::ZERO), "it is there already");
    }

    #[test]
    fn a_turn_about_the_origin_keeps_the_workspace_where_it_is_seen() {
        // Aim: a hand far from the tooth is not displaced in its workspace. Method: there and back.
        let mut mapping = HandMapping::new();
        mapping.world_pose(&hand(0.0, 0.0, 60.0));
        let frame = HandFrame { orientation: Quat::from_rotation_y(FRAC_PI_2), scale: 1.0, ..HandFrame::DEVICE };
        mapping.place(frame, TipPath::Turn, Wrench::ZERO);
        let (_, tip) = finish(&mut mapping, &hand(0.0, 0.0, 60.0));
        assert!(tip.distance(Vec3::X * 60.0) < 1e-4, "{tip}");
        mapping.place(HandFrame::DEVICE, TipPath::Turn, Wrench::ZERO);
        finish(&mut mapping, &hand(0.0, 0.0, 60.0));
        assert_eq!(mapping.world_pose(&hand(1.0, 2.0, 3.0)).position, Vec3::new(1.0, 2.0, 3.0));
    }

    #[test]
    fn a_frame_with_a_middle_brings_the_hand_to_its_place_in_the_world() {
        // Aim: where a hand is registered with the picture, its tip arrives where the hand is seen, without a jump, the clutch
        // cannot move it away, and a frame without a middle brings it back. Method: half the scale, a quarter turn and a
        // shifted middle; the greatest step of the tip of a hand that rests.
        let mut mapping = HandMapping::new();
        let rest = hand(20.0, 0.0, 0.0);
        let from = mapping.world_pose(&rest).position;
        let orientation = Quat::from_rotation_z(FRAC_PI_2);
        let frame = HandFrame { orientation, scale: 0.5, middle: Some(Vec3::new(1.0, -4.0, 3.0)), is_free: false };
        assert!(mapping.place(frame, TipPath::Centre(from), Wrench::ZERO));
        let (mut tip, mut step) = (from, 0.0_f32);
        while let Some(free) = mapping.advance(&rest) {
            step = step.max(tip.distance(free.world_from_handle.position));
            tip = free.world_from_handle.position;
        }
        assert!(step < 0.3, "{step} mm in a tick");
        let there = Vec3::new(1.0, 6.0, 3.0);
        assert!(tip.distance(there) < 1e-4, "{tip}");
        assert!(mapping.world_pose(&rest).position.distance(there) < 1e-4);
        // Free, it goes where the hand goes in the device's own space.
        let free = HandFrame { middle: Some(Vec3::ZERO), is_free: true, ..HandFrame::DEVICE };
        assert!(mapping.place(free, TipPath::Centre(there), Wrench::ZERO));
        let moved: Vec<Vec3> = (0..2 * MOVE_TICKS)
            .map(|tick| mapping.advance(&hand(20.0 + 0.01 * tick as f32, 1.0, 0.0)).expect("it stays free"))
            .map(|free| free.world_from_handle.position)
            .collect();
        assert!(moved.last().unwrap().distance(Vec3::new(25.99, 1.0, 0.0)) < 1e-3, "{:?}", moved.last());
        assert!(mapping.place(frame, TipPath::Centre(there), Wrench::ZERO));
        finish(&mut mapping, &rest);
        assert!(mapping.is_registered() && !mapping.press_clutch(true, Tick(9), there, Wrench::ZERO));
        assert!(!mapping.press_clutch(false, Tick(99), there, Wrench::ZERO) && !mapping.is_changing());
        assert!(mapping.place(HandFrame::DEVICE, TipPath::Centre(there), Wrench::ZERO));
        let (_, end) = finish(&mut mapping, &rest);
        assert!(end.distance(rest.position) < 1e-4 && !mapping.is_registered(), "{end}");
    }

    #[test]
    fn two_short_presses_centre_the_hand_and_long_ones_do_not() {
        // Aim: what is held is a clutch, and only a double press recentres. Method: presses at given ticks; the hand moves
        // by 40 mm during the first.
        let check = |presses: &[(u64, u64)], is_centred: bool| {
            let mut mapping = HandMapping::new();
            let mut tip = mapping.world_pose(&hand(5.0, 0.0, 0.0)).position;
            let there = hand(45.0, 0.0, 0.0);
            let mut now = 0;
            for &(down, up) in presses {
                for (at, is_pressed) in [(down, true), (up, false)] {
                    while now < at {
                        let free = mapping.advance(&there).map(|free| free.world_from_handle);
                        tip = free.unwrap_or_else(|| mapping.world_pose(&there)).position;
                        now += 1;
                    }
                    mapping.press_clutch(is_pressed, Tick(now), tip, Wrench::ZERO);
                }
            }
            let (_, end) = finish(&mut mapping, &there);
            let expected = if is_centred { 45.0 } else { 5.0 };
            assert!(end.distance(Vec3::X * expected) < 1e-4, "{presses:?}: {end}");
        };
        check(&[(0, 200), (400, 500)], true);
        check(&[(0, 900)], false);
        check(&[(0, 900), (1_000, 1_100)], false);
        check(&[(0, 200), (700, 800)], false);
        check(&[(0, 200), (400, 900)], false);
    }

    #[test]
    fn a_force_fades_in_steps_that_nobody_feels() {
        // Aim: neither a small force nor a large one ends with a click. Method: the largest change of any tick, to zero.
        for force in [0.2, 3.3, 40.0] {
            let from = Wrench { force: Vec3::X * force, torque: Vec3::Y };
            let mut fading = FadingWrench::of(from);
            let (mut before, mut ticks) = (from.force, 0);
            while fading.ticks_left > 0 {
                let now = fading.advance().force;
                assert!(before.distance(now) <= FADE_STEP + 1e-4, "{force} N: {before} to {now}");
                (before, ticks) = (now, ticks + 1);
            }
            assert_eq!(fading.advance(), Wrench::ZERO);
            assert!(ticks >= FADE_TICKS && before == Vec3::ZERO);
        }
    }

    #[test]
    fn only_rotations_and_scales_in_range_are_frames() {
        let turned = HandFrame { orientation: Quat::from_rotation_y(1.0), scale: 4.0, ..HandFrame::DEVICE };
        assert!(turned.is_valid() && HandFrame::DEVICE.is_valid());
        for scale in [0.019, 4.1, f32::NAN] {
            assert!(!HandFrame { scale, ..turned }.is_valid(), "{scale}");
        }
        for x in [10_001.0, f32::NAN] {
            assert!(!HandFrame { middle: Some(Vec3::new(x, 0.0, 0.0)), ..turned }.is_valid(), "{x}");
        }
        for orientation in [Quat::from_xyzw(0.0, 0.0, 0.0, 0.0), Quat::NAN] {
            assert!(!HandFrame { orientation, ..turned }.is_valid(), "{orientation}");
        }
    }
}
