//! A plane mirror, and the eye that sees what it reflects.

use super::eye::{Eye, Window};
use super::scene::Scene;
use crate::frame::{Pose, Vec3};

/// A round plane mirror. It shows the scene before its face; whatever holds it is a solid of its own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mirror {
    /// The middle of its face, which reflects toward its own +z.
    pub world_from_mirror: Pose,
    /// mm
    pub radius: f32,
    /// Share of light that comes back, 0 to 1: 0.75 from a rhodium-plated front surface.
    pub shine: f32,
}

/// Width and height of a mirror's picture, pixels: on a screen it is seldom larger.
pub(super) const PIXELS: u32 = 400;

/// An eye nearer to the mirror's plane than this sees nothing in it, mm.
const NEAREST: f32 = 0.5;

impl Mirror {
    /// Across the face, as its picture has them.
    pub(super) fn right(&self) -> Vec3 {
        self.world_from_mirror.turn(Vec3::NEG_X)
    }

    pub(super) fn up(&self) -> Vec3 {
        self.world_from_mirror.turn(Vec3::Y)
    }

    /// Unit, out of the reflecting face.
    pub(super) fn normal(&self) -> Vec3 {
        self.world_from_mirror.turn(Vec3::Z)
    }

    /// The eye's image behind the mirror, which looks out through the face as through a window. What stands behind the face
    /// is nearer than `near`. `None` when the eye is behind the face.
    ///
    /// A ray that comes to the eye from a place of the face would have gone on to the image in a straight line, so nothing
    /// in the scene need be turned round.
    pub(super) fn image_of(&self, eye: &Eye) -> Option<Eye> {
        let (right, up, ahead) = (self.right(), self.up(), self.normal());
        let from_middle = eye.position - self.world_from_mirror.position;
        let before = from_middle.dot(ahead);
        if before < NEAREST {
            return None;
        }
        let (aside, above) = (from_middle.dot(right), from_middle.dot(up));
        let edge = |side: f32, off: f32| (side * self.radius - off) / before;
        let window = Window {
            left: edge(-1.0, aside),
            right: edge(1.0, aside),
            bottom: edge(-1.0, above),
            top: edge(1.0, above),
        };
        let position = eye.position - ahead * (2.0 * before);
        Some(Eye { position, right, up, ahead, window, near: before, far: eye.far + 2.0 * before })
    }

    /// The scene as light falls before the face: who looks into a mirror with a lamp on the head lights with it what it
    /// shows, as from the lamp's image behind it.
    pub(super) fn lit<'a>(&self, scene: &Scene<'a>) -> Scene<'a> {
        let mut lit = scene.clone();
        let before = (lit.lights.head.position - self.world_from_mirror.position).dot(self.normal());
        if before > 0.0 {
            lit.lights.head.position -= self.normal() * (2.0 * before);
        }
        lit
    }

    pub(super) fn is_sound(&self) -> bool {
        self.world_from_mirror.is_sound() && (0.1..1000.0).contains(&self.radius) && (0.0..=1.0).contains(&self.shine)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Quat;
    use crate::render::Viewpoint;

    #[test]
    fn what_is_seen_in_the_mirror_obeys_the_law_of_reflection() {
        // Aim: the place of the mirror's picture that shows a point is where light from that point leaves the face toward
        // the eye. Method: reflect the way from the eye to that place about the normal; it must lead to the point.
        let orientation = Quat::from_rotation_y(0.7) * Quat::from_rotation_x(-0.4);
        let mirror = Mirror {
            world_from_mirror: Pose { position: Vec3::new(4.0, -3.0, 2.0), orientation },
            radius: 11.0,
            shine: 1.0,
        };
        let place = |x: f32, y: f32, z: f32| mirror.world_from_mirror * Vec3::new(x, y, z);
        let eye = Viewpoint::looking(place(30.0, 40.0, 200.0), place(0.0, 0.0, 0.0), Vec3::Y).eye(1.0);
        let image = mirror.image_of(&eye).unwrap();
        for point in [place(-3.0, -6.0, 20.0), place(2.0, 5.0, 60.0), place(-9.0, 1.0, 5.0)] {
            let ([x, y], depth) = image.place(point);
            let way = mirror.right() * (2.0 * x - 1.0) + mirror.up() * (1.0 - 2.0 * y);
            let on_face = mirror.world_from_mirror.position + way * mirror.radius;
            let came = (on_face - eye.position).normalize();
            let goes = came - mirror.normal() * (2.0 * came.dot(mirror.normal()));
            let wanted = (point - on_face).normalize();
            assert!(goes.distance(wanted) < 1e-3, "{goes} {wanted}");
            assert!(depth > image.near);
        }
        assert!(image.place(place(0.0, 0.0, -1.0)).1 < image.near, "what is behind the face is not seen");
        let behind = Viewpoint::looking(place(0.0, 9.0, -50.0), place(0.0, 0.0, 0.0), Vec3::Y).eye(1.0);
        assert_eq!(mirror.image_of(&behind), None);
    }
}
