//! Viewpoints, and the orbit, zoom and pan of a camera by mouse or keys.

use super::eye::{Eye, FrustumWindow};
use typodont_core::frame::{Quat, Vec3};

/// A perspective camera. World space, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Viewpoint {
    /// Midpoint between the eyes.
    pub position: Vec3,
    /// Point that is looked at. In stereo the focus plane, on which both eyes' images agree, goes through it.
    pub focus: Vec3,
    /// Up direction of the image; need not be perpendicular to the direction of view, but must not be parallel to it.
    pub up: Vec3,
    /// Vertical field of view, rad.
    pub field_of_view: f32,
    /// Clipping distances along the direction of view, mm. Nothing nearer or farther is drawn.
    pub near: f32,
    pub far: f32,
}

impl Viewpoint {
    /// Looks from `position` at `focus`. The clipping distances are 0.1 and 20 times the distance between the two.
    pub fn look_at(position: Vec3, focus: Vec3, up: Vec3) -> Viewpoint {
        let distance = (focus - position).length().max(1e-3);
        Viewpoint { position, focus, up, field_of_view: FIELD_OF_VIEW, near: 0.1 * distance, far: 20.0 * distance }
    }

    /// Returns the distance from the eyes to the focus plane, mm.
    pub fn focus_distance(&self) -> f32 {
        (self.focus - self.position).length()
    }

    /// Returns the eye midway between both eyes; `aspect` is the image's width divided by its height.
    pub fn eye(&self, aspect: f32) -> Eye {
        let forward = (self.focus - self.position).normalize_or(Vec3::NEG_Z);
        let right = forward.cross(self.up).normalize_or(forward.any_orthonormal_vector());
        let top = libm::tanf(0.5 * self.field_of_view);
        let window = FrustumWindow { left: -top * aspect, right: top * aspect, bottom: -top, top };
        let Viewpoint { position, near, far, .. } = *self;
        Eye { position, right, up: right.cross(forward), forward, window, near, far }
    }

    /// True when an image can be rendered: finite values, 0 < near < far, a focus away from the eyes, and a field of
    /// view from 0.01 to 3 rad.
    pub fn is_valid(&self) -> bool {
        let all = [self.position, self.focus, self.up];
        all.iter().all(|v| v.is_finite())
            && self.focus_distance() > 1e-3
            && 0.0 < self.near
            && self.near < self.far
            && self.far.is_finite()
            && (0.01..3.0).contains(&self.field_of_view)
    }
}

/// Default vertical field of view, rad: 28°, as for a screen 40 cm wide seen from 70 cm, so that perspective looks
/// natural.
const FIELD_OF_VIEW: f32 = 0.49;

/// Minimum and maximum distance of an orbit, mm: from a fissure that fills the image to a whole head.
const DISTANCE_RANGE: [f32; 2] = [8.0, 600.0];

/// Maximum elevation up or down, rad: looking straight down, the up direction would be undefined.
const MAX_ELEVATION: f32 = 1.55;

/// A camera on a sphere around a centre. Every movement returns a new value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Orbit {
    /// Centre of the sphere, world space, mm.
    pub middle: Vec3,
    /// Angle to the right around the world's y axis, rad; 0 looks from the user's side (+z).
    pub azimuth: f32,
    /// Angle upward, rad.
    pub elevation: f32,
    /// mm
    pub distance: f32,
}

impl Orbit {
    /// Returns an orbit from which a whole ball is visible. World space, mm.
    pub fn around(middle: Vec3, radius: f32) -> Orbit {
        let distance = 1.08 * radius / libm::sinf(0.5 * FIELD_OF_VIEW);
        Orbit { middle, azimuth: 0.35, elevation: 0.55, distance: distance.clamp(DISTANCE_RANGE[0], DISTANCE_RANGE[1]) }
    }

    /// Rotates the camera around the centre, rad.
    pub fn rotated(self, right: f32, up: f32) -> Orbit {
        let azimuth = (self.azimuth + right) % std::f32::consts::TAU;
        Orbit { azimuth, elevation: (self.elevation + up).clamp(-MAX_ELEVATION, MAX_ELEVATION), ..self }
    }

    /// Moves the camera closer (factor below 1) or away, within 8 to 600 mm.
    pub fn zoomed(self, factor: f32) -> Orbit {
        Orbit { distance: (self.distance * factor).clamp(DISTANCE_RANGE[0], DISTANCE_RANGE[1]), ..self }
    }

    /// Moves the centre across the image, by shares of the image height, so that a grabbed point stays under the
    /// mouse.
    pub fn panned(self, right: f32, up: f32) -> Orbit {
        let eye = self.viewpoint().eye(1.0);
        let high = self.height_at_middle();
        Orbit { middle: self.middle - (eye.right * right + eye.up * up) * high, ..self }
    }

    /// Returns the height of the image in the plane through the centre, mm.
    pub fn height_at_middle(&self) -> f32 {
        2.0 * self.distance * self.viewpoint().eye(1.0).window.top
    }

    /// Returns the orientation of the image in the world: its right, its up, and out of it toward the eye.
    pub fn world_from_view(&self) -> Quat {
        Quat::from_rotation_y(self.azimuth) * Quat::from_rotation_x(-self.elevation)
    }

    pub fn viewpoint(&self) -> Viewpoint {
        let rotation = self.world_from_view();
        Viewpoint::look_at(self.middle + rotation * Vec3::Z * self.distance, self.middle, rotation * Vec3::Y)
    }
}

/// A quadrant of the dentition, from the patient's point of view.
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
        Orbit { middle: Vec3::new(2.0, 1.0, -3.0), azimuth: 0.4, elevation: 0.3, distance: 60.0 }
    }

    #[test]
    fn the_centre_stays_in_the_middle_of_the_image_when_rotating() {
        for (right, up) in [(0.0, 0.0), (1.0, 0.4), (-9.0, 7.0), (3.0, -9.0)] {
            let orbit = orbit().rotated(right, up);
            let ([x, y], depth) = orbit.viewpoint().eye(1.3).project(orbit.middle);
            assert!((x - 0.5).abs() < 1e-4 && (y - 0.5).abs() < 1e-4 && (depth - 60.0).abs() < 1e-3, "{x} {y} {depth}");
            assert!(orbit.viewpoint().eye(1.3).up.y > 0.0, "never upside down");
        }
    }

    #[test]
    fn a_grabbed_point_stays_under_the_mouse() {
        let (before, after) = (orbit(), orbit().panned(0.2, -0.1));
        let ([x, y], _) = after.viewpoint().eye(1.0).project(before.middle);
        assert!((x - 0.7).abs() < 1e-3 && (y - 0.6).abs() < 1e-3, "{x} {y}");
    }

    #[test]
    fn rotating_right_moves_the_eye_right_and_zooming_is_limited() {
        let right = orbit().viewpoint().eye(1.0).right;
        let moved = orbit().rotated(0.01, 0.0).viewpoint().position - orbit().viewpoint().position;
        assert!(moved.dot(right) > 0.0);
        assert_eq!(orbit().zoomed(1e-9).distance, DISTANCE_RANGE[0]);
        assert_eq!(orbit().zoomed(1e9).distance, DISTANCE_RANGE[1]);
    }

    #[test]
    fn a_ball_is_entirely_visible() {
        let orbit = Orbit::around(Vec3::new(1.0, 2.0, 3.0), 10.0);
        let eye = orbit.viewpoint().eye(1.0);
        for direction in [eye.right, -eye.right, eye.up, -eye.up] {
            let ([x, y], _) = eye.project(orbit.middle + direction * 10.0);
            assert!((0.0..1.0).contains(&x) && (0.0..1.0).contains(&y), "{x} {y}");
        }
    }
}
