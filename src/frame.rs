//! Where things are: rigid poses, and transforms named `a_from_b`.
//!
//! Takes and gives millimetres and unit quaternions. Never scales: a millimetre of the hand is a millimetre of the tooth.

use glam::Mat3;
pub use glam::{Quat, Vec3};

/// A rigid transform, and as such also a place and an orientation.
///
/// Read right to left: `tip_in_tooth = tooth_from_world * tip_in_world`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// mm
    pub position: Vec3,
    /// Unit quaternion.
    pub orientation: Quat,
}

impl Pose {
    pub const IDENTITY: Pose = Pose { position: Vec3::ZERO, orientation: Quat::IDENTITY };

    pub fn at(position: Vec3) -> Pose {
        Pose { position, ..Pose::IDENTITY }
    }

    pub fn inverse(&self) -> Pose {
        let orientation = self.orientation.conjugate();
        Pose { position: -(orientation * self.position), orientation }
    }

    /// Carries a direction or a force across: turned, not moved.
    pub fn turn(&self, direction: Vec3) -> Vec3 {
        self.orientation * direction
    }

    /// True when every number is finite and the quaternion is of unit length within 1 %.
    pub fn is_sound(&self) -> bool {
        self.position.is_finite()
            && self.orientation.is_finite()
            && (self.orientation.length_squared() - 1.0).abs() < 0.02
    }
}

/// The rotation with these axes, which a device may give slightly skewed or too long: z is kept, then x. `None` if they are
/// not near any.
pub fn rotation_near(x: Vec3, y: Vec3, z: Vec3) -> Option<Quat> {
    // A box of these edges; a mirror's is negative.
    let is_near = x.cross(y).dot(z) > 0.5;
    let z = z.try_normalize()?;
    let x = (x - z * z.dot(x)).try_normalize()?;
    is_near.then(|| Quat::from_mat3(&Mat3::from_cols(x, z.cross(x), z)).normalize())
}

impl Default for Pose {
    fn default() -> Self {
        Pose::IDENTITY
    }
}

impl std::ops::Mul<Vec3> for Pose {
    type Output = Vec3;
    fn mul(self, point: Vec3) -> Vec3 {
        self.orientation * point + self.position
    }
}

impl std::ops::Mul for Pose {
    type Output = Pose;
    fn mul(self, inner: Pose) -> Pose {
        Pose { position: self * inner.position, orientation: (self.orientation * inner.orientation).normalize() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pose_and_its_inverse_cancel() {
        let world_from_tooth =
            Pose { position: Vec3::new(3.0, -2.0, 7.0), orientation: Quat::from_xyzw(0.5, 0.5, -0.5, 0.5) };
        let point_in_tooth = Vec3::new(1.0, 2.0, 3.0);
        let back = world_from_tooth.inverse() * (world_from_tooth * point_in_tooth);
        assert!((back - point_in_tooth).length() < 1e-5);
    }

    #[test]
    fn broken_poses_are_seen() {
        assert!(!Pose::at(Vec3::new(f32::NAN, 0.0, 0.0)).is_sound());
        assert!(!Pose { orientation: Quat::from_xyzw(0.0, 0.0, 0.0, 0.0), ..Pose::IDENTITY }.is_sound());
        assert!(Pose::IDENTITY.is_sound());
    }

    #[test]
    fn skewed_axes_become_a_rotation() {
        // Aim: devices' matrices are a little off; quaternions must not be. Method: skew a known turn by a hundredth.
        let turn = Quat::from_rotation_y(0.7) * Quat::from_rotation_x(-0.4);
        let Mat3 { x_axis: x, y_axis: y, z_axis: z } = Mat3::from_quat(turn);
        let found = rotation_near(x * 1.01 + y * 0.01, y * 0.99, z * 1.005).unwrap();
        assert!((found.length() - 1.0).abs() < 1e-6);
        assert!(found.angle_between(turn) < 0.02, "{found} for {turn}");
        assert_eq!(rotation_near(Vec3::ZERO, Vec3::ZERO, Vec3::ZERO), None);
        assert_eq!(rotation_near(Vec3::NAN, y, z), None);
        assert_eq!(rotation_near(-x, y, z), None, "a mirror is no turn");
    }
}
