//! The view of the trainee: the eye, the picture, and a mirror in it.

use typodont_core::frame::{Pose, Vec3};

/// Position and picture of the trainee's eye. World space, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TraineeView {
    pub eye: Vec3,
    /// Point in the middle of the picture.
    pub focus: Vec3,
    /// Upward direction of the picture; need not be perpendicular to the direction of view.
    pub up: Vec3,
    /// Half the width and half the height of the picture at a depth of 1 mm.
    pub half_extent: [f32; 2],
    /// Mirror in which the trainee looks, if there is one.
    pub mirror: Option<MirrorFace>,
}

/// Reflecting face of a mouth mirror: a disc.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MirrorFace {
    pub centre: Vec3,
    /// Unit normal, out of the reflecting side.
    pub normal: Vec3,
    pub radius: f32,
}

impl TraineeView {
    /// Returns the same view in another space; the pose must not scale.
    pub fn transformed(&self, pose: &Pose) -> TraineeView {
        let mirror = self.mirror.map(|face| MirrorFace {
            centre: *pose * face.centre,
            normal: pose.rotate(face.normal),
            radius: face.radius,
        });
        TraineeView {
            eye: *pose * self.eye,
            focus: *pose * self.focus,
            up: pose.rotate(self.up),
            half_extent: self.half_extent,
            mirror,
        }
    }

    /// Returns true if a point lies within the edges of the picture, hidden or not.
    pub fn contains(&self, point: Vec3) -> bool {
        let forward = (self.focus - self.eye).normalize_or(Vec3::NEG_Z);
        let right = forward.cross(self.up).normalize_or(forward.any_orthonormal_vector());
        let up = right.cross(forward);
        let offset = point - self.eye;
        let depth = offset.dot(forward);
        let [half_width, half_height] = self.half_extent;
        depth > 0.0 && offset.dot(right).abs() <= half_width * depth && offset.dot(up).abs() <= half_height * depth
    }

    /// Returns false for a view with a coordinate that is not finite or farther than 10 m, which no session produces.
    pub fn is_valid(&self) -> bool {
        const FARTHEST: f32 = 1e4;
        let is_near = |v: Vec3| v.is_finite() && v.abs().max_element() <= FARTHEST;
        let is_face_valid = |face: MirrorFace| {
            is_near(face.centre) && face.normal.is_normalized() && (0.0..=FARTHEST).contains(&face.radius)
        };
        [self.eye, self.focus, self.up].into_iter().all(is_near)
            && self.half_extent.iter().all(|half| (0.0..=FARTHEST).contains(half))
            && self.mirror.is_none_or(is_face_valid)
    }
}
