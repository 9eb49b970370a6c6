//! A plane mirror, and the reflected eye that sees what it shows.

use super::eye::{Eye, FrustumWindow};
use super::scene::RenderScene;
use typodont_core::frame::{Pose, Vec3};

/// A round plane mirror. It shows the scene in front of its face; its rim and handle are separate mesh instances.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlaneMirror {
    /// Centre of the face, which reflects toward its own +z.
    pub world_from_mirror: Pose,
    /// Radius of the face, mm.
    pub radius: f32,
    /// Share of light that is reflected, 0 to 1: 0.75 for a rhodium-plated front surface.
    pub reflectance: f32,
}

/// Width and height of a mirror's image, pixels: on a screen it is seldom larger.
pub(super) const PICTURE_SIZE: u32 = 400;

/// Minimum distance of an eye from the plane of the mirror, mm. Nearer than this it sees nothing in the mirror.
const MIN_DISTANCE: f32 = 0.5;

impl PlaneMirror {
    /// Unit vector to the right in the mirror's image.
    pub(super) fn right(&self) -> Vec3 {
        self.world_from_mirror.rotate(Vec3::NEG_X)
    }

    /// Unit vector upward in the mirror's image.
    pub(super) fn up(&self) -> Vec3 {
        self.world_from_mirror.rotate(Vec3::Y)
    }

    /// Unit normal, out of the reflecting face.
    pub(super) fn normal(&self) -> Vec3 {
        self.world_from_mirror.rotate(Vec3::Z)
    }

    /// Returns the mirror image of an eye, which looks out through the face as through a window. Everything behind
    /// the face is nearer than `near`. `None` when the eye is behind the face or within 0.5 mm of its plane.
    ///
    /// A ray that reaches the eye from a point of the face would have continued in a straight line to the mirrored
    /// eye, so the scene itself need not be mirrored.
    pub(super) fn reflected_eye(&self, eye: &Eye) -> Option<Eye> {
        let (right, up, forward) = (self.right(), self.up(), self.normal());
        let from_middle = eye.position - self.world_from_mirror.position;
        let distance = from_middle.dot(forward);
        if distance < MIN_DISTANCE {
            return None;
        }
        let (aside, above) = (from_middle.dot(right), from_middle.dot(up));
        let edge = |side: f32, off: f32| (side * self.radius - off) / distance;
        let window = FrustumWindow {
            left: edge(-1.0, aside),
            right: edge(1.0, aside),
            bottom: edge(-1.0, above),
            top: edge(1.0, above),
        };
        let position = eye.position - forward * (2.0 * distance);
        Some(Eye { position, right, up, forward, window, near: distance, far: eye.far + 2.0 * distance })
    }

    /// Returns the scene with the light that falls on what the mirror shows: a head lamp in front of the face also
    /// lights the scene from its mirror image behind the face.
    pub(super) fn with_reflected_light<'a>(&self, scene: &RenderScene<'a>) -> RenderScene<'a> {
        let mut reflected = scene.clone();
        let distance = (reflected.lights.head.position - self.world_from_mirror.position).dot(self.normal());
        if distance > 0.0 {
            reflected.lights.head.position -= self.normal() * (2.0 * distance);
        }
        reflected
    }

    pub(super) fn is_valid(&self) -> bool {
        self.world_from_mirror.is_valid()
            && (0.1..1000.0).contains(&self.radius)
            && (0.0..=1.0).contains(&self.reflectance)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Viewpoint;
    use typodont_core::frame::Quat;

    #[test]
    fn the_mirror_image_obeys_the_law_of_reflection() {
        // Aim: the image position that shows a point is where light from that point leaves the face toward the eye.
        // Method: reflect the direction from the eye to that position about the normal; it must lead to the point.
        let orientation = Quat::from_rotation_y(0.7) * Quat::from_rotation_x(-0.4);
        let mirror = PlaneMirror {
            world_from_mirror: Pose { position: Vec3::new(4.0, -3.0, 2.0), orientation },
            radius: 11.0,
            reflectance: 1.0,
        };
        let place = |x: f32, y: f32, z: f32| mirror.world_from_mirror * Vec3::new(x, y, z);
        let eye = Viewpoint::look_at(place(30.0, 40.0, 200.0), place(0.0, 0.0, 0.0), Vec3::Y).eye(1.0);
        let image = mirror.reflected_eye(&eye).unwrap();
        for point in [place(-3.0, -6.0, 20.0), place(2.0, 5.0, 60.0), place(-9.0, 1.0, 5.0)] {
            let ([x, y], depth) = image.project(point);
            let offset = mirror.right() * (2.0 * x - 1.0) + mirror.up() * (1.0 - 2.0 * y);
            let on_face = mirror.world_from_mirror.position + offset * mirror.radius;
            let came = (on_face - eye.position).normalize();
            let goes = came - mirror.normal() * (2.0 * came.dot(mirror.normal()));
            let wanted = (point - on_face).normalize();
            assert!(goes.distance(wanted) < 1e-3, "{goes} {wanted}");
            assert!(depth > image.near);
        }
        assert!(image.project(place(0.0, 0.0, -1.0)).1 < image.near, "points behind the face are clipped");
        let behind = Viewpoint::look_at(place(0.0, 9.0, -50.0), place(0.0, 0.0, 0.0), Vec3::Y).eye(1.0);
        assert_eq!(mirror.reflected_eye(&behind), None);
    }
}
