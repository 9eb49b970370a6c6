//! The actions with the instrument that a trainee has done, for the card that teaches them.

use typodont_core::frame::Vec3;
use typodont_render::Orbit;

/// Movement of the hand that counts as deliberate, mm.
const MOVED: f32 = 3.0;

/// Force that counts as a press, N.
const PRESSED: f32 = 0.4;

/// Rotation of the view that counts as deliberate, rad.
const ROTATED: f32 = 0.15;

/// Actions that the trainee has done in the exercise.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ControlsProgress {
    pub has_moved: bool,
    pub has_touched: bool,
    pub has_pressed: bool,
    pub has_rotated: bool,
    pub has_cut: bool,
    /// Place of the hand and angles of the view when the stage began.
    start: Option<(Vec3, f32, f32)>,
}

impl ControlsProgress {
    /// Begins a stage, to which the hand and the view may have been moved; what was done stays done.
    pub fn begin_stage(&mut self) {
        self.start = None;
    }

    /// Takes over what the trainee does at this moment.
    pub fn update(&mut self, lesson: &LessonProgress) {
        let LessonProgress { hand, is_touching, force, is_cutting, orbit } = *lesson;
        let (first, azimuth, elevation) = *self.start.get_or_insert((hand, orbit.azimuth, orbit.elevation));
        self.has_moved |= hand.distance(first) > MOVED;
        self.has_touched |= self.has_moved && is_touching;
        self.has_pressed |= force > PRESSED;
        self.has_rotated |= (orbit.azimuth - azimuth).abs().max((orbit.elevation - elevation).abs()) > ROTATED;
        self.has_cut |= is_cutting;
    }
}

/// State of the lesson that the card follows.
pub struct LessonProgress<'a> {
    pub hand: Vec3,
    pub is_touching: bool,
    /// N
    pub force: f32,
    pub is_cutting: bool,
    pub orbit: &'a Orbit,
}
