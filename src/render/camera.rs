//! Where a picture is seen from, and how a mouse or a key moves that place.

use super::eye::{Eye, Window};
use crate::frame::{Quat, Vec3};

/// A perspective camera. World space, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Viewpoint {
    /// Between the eyes.
    pub position: Vec3,
    /// What is looked at. In stereo it lies on the focus plane, where both eyes' pictures agree.
    pub focus: Vec3,
    /// Upward in the picture; need not be across the direction of view, but not along it.
    pub up: Vec3,
    /// From the picture's lower to its upper edge, rad.
    pub field_of_view: f32,
    /// What is nearer or farther along the direction of view is not drawn, mm.
    pub near: f32,
    pub far: f32,
}

impl Viewpoint {
    /// Looks from one place at another. Draws from a tenth of the way between to far behind.
    pub fn looking(position: Vec3, focus: Vec3, up: Vec3) -> Viewpoint {
        let way = (focus - position).length().max(1e-3);
        Viewpoint { position, focus, up, field_of_view: FIELD_OF_VIEW, near: 0.1 * way, far: 20.0 * way }
    }

    /// From the eyes to the focus plane, mm.
    pub fn focus_distance(&self) -> f32 {
        (self.focus - self.position).length()
    }

    /// The middle eye; `ratio` is the picture's width by its height.
    pub fn eye(&self, ratio: f32) -> Eye {
        let ahead = (self.focus - self.position).normalize_or(Vec3::NEG_Z);
        let right = ahead.cross(self.up).normalize_or(ahead.any_orthonormal_vector());
        let top = libm::tanf(0.5 * self.field_of_view);
        let window = Window { left: -top * ratio, right: top * ratio, bottom: -top, top };
        let Viewpoint { position, near, far, .. } = *self;
        Eye { position, right, up: right.cross(ahead), ahead, window, near, far }
    }

    /// True when a picture can be made: finite numbers, 0 < near < far, a focus away from the eyes.
    pub fn is_sound(&self) -> bool {
        let all = [self.position, self.focus, self.up];
        all.iter().all(|v| v.is_finite())
            && self.focus_distance() > 1e-3
            && 0.0 < self.near
            && self.near < self.far
            && self.far.is_finite()
            && (0.01..3.0).contains(&self.field_of_view)
    }
}

/// 28°: a screen 40 cm wide seen from 70 cm, so that nothing looks bent.
const FIELD_OF_VIEW: f32 = 0.49;

/// Least and greatest distance of an orbit, mm: a fissure fills the picture, or a head does.
const DISTANCES: [f32; 2] = [8.0, 600.0];

/// Steepest look up or down, rad: straight down the picture's up would be lost.
const TILT_MOST: f32 = 1.55;

/// A camera on a ball around a middle. Every movement gives a new one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Orbit {
    /// World space, mm.
    pub middle: Vec3,
    /// To the right around the world's y axis, rad; 0 looks from the user's side (+z).
    pub turn: f32,
    /// Upward, rad.
    pub tilt: f32,
    /// mm
    pub distance: f32,
}

impl Orbit {
    /// Sees a ball whole.
    pub fn around(middle: Vec3, radius: f32) -> Orbit {
        let distance = 1.08 * radius / libm::sinf(0.5 * FIELD_OF_VIEW);
        Orbit { middle, turn: 0.35, tilt: 0.55, distance: distance.clamp(DISTANCES[0], DISTANCES[1]) }
    }

    /// Turns around the middle; rad.
    pub fn turned(self, right: f32, up: f32) -> Orbit {
        let turn = (self.turn + right) % std::f32::consts::TAU;
        Orbit { turn, tilt: (self.tilt + up).clamp(-TILT_MOST, TILT_MOST), ..self }
    }

    /// Comes nearer (factor below 1) or goes away.
    pub fn zoomed(self, factor: f32) -> Orbit {
        Orbit { distance: (self.distance * factor).clamp(DISTANCES[0], DISTANCES[1]), ..self }
    }

    /// Moves the middle across the picture, as shares of the picture's height: what was grabbed stays under the mouse.
    pub fn panned(self, right: f32, up: f32) -> Orbit {
        let eye = self.viewpoint().eye(1.0);
        let high = 2.0 * self.distance * eye.window.top;
        Orbit { middle: self.middle - (eye.right * right + eye.up * up) * high, ..self }
    }

    /// How the picture lies in the world: its right, its up, and out of it toward the eye.
    pub fn world_from_view(&self) -> Quat {
        Quat::from_rotation_y(self.turn) * Quat::from_rotation_x(-self.tilt)
    }

    pub fn viewpoint(&self) -> Viewpoint {
        let turned = self.world_from_view();
        Viewpoint::looking(self.middle + turned * Vec3::Z * self.distance, self.middle, turned * Vec3::Y)
    }
}

/// A quarter of the teeth, from the patient's point of view.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quadrant {
    UpperRight,
    UpperLeft,
    LowerLeft,
    LowerRight,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn orbit() -> Orbit {
        Orbit { middle: Vec3::new(2.0, 1.0, -3.0), turn: 0.4, tilt: 0.3, distance: 60.0 }
    }

    #[test]
    fn the_middle_stays_in_the_middle_however_one_turns() {
        for (right, up) in [(0.0, 0.0), (1.0, 0.4), (-9.0, 7.0), (3.0, -9.0)] {
            let orbit = orbit().turned(right, up);
            let ([x, y], depth) = orbit.viewpoint().eye(1.3).place(orbit.middle);
            assert!((x - 0.5).abs() < 1e-4 && (y - 0.5).abs() < 1e-4 && (depth - 60.0).abs() < 1e-3, "{x} {y} {depth}");
            assert!(orbit.viewpoint().eye(1.3).up.y > 0.0, "never upside down");
        }
    }

    #[test]
    fn what_was_grabbed_stays_under_the_mouse() {
        let (before, after) = (orbit(), orbit().panned(0.2, -0.1));
        let ([x, y], _) = after.viewpoint().eye(1.0).place(before.middle);
        assert!((x - 0.7).abs() < 1e-3 && (y - 0.6).abs() < 1e-3, "{x} {y}");
    }

    #[test]
    fn turning_right_moves_the_eye_right_and_zooming_has_ends() {
        let right = orbit().viewpoint().eye(1.0).right;
        let moved = orbit().turned(0.01, 0.0).viewpoint().position - orbit().viewpoint().position;
        assert!(moved.dot(right) > 0.0);
        assert_eq!(orbit().zoomed(1e-9).distance, DISTANCES[0]);
        assert_eq!(orbit().zoomed(1e9).distance, DISTANCES[1]);
    }

    #[test]
    fn a_ball_is_seen_whole() {
        let orbit = Orbit::around(Vec3::new(1.0, 2.0, 3.0), 10.0);
        let eye = orbit.viewpoint().eye(1.0);
        for way in [eye.right, -eye.right, eye.up, -eye.up] {
            let ([x, y], _) = eye.place(orbit.middle + way * 10.0);
            assert!((0.0..1.0).contains(&x) && (0.0..1.0).contains(&y), "{x} {y}");
        }
    }
}
