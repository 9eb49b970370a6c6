//! Rigid poses, and transforms named `a_from_b`.
//!
//! Takes and gives millimetres and unit quaternions. Never scales: a millimetre of hand motion is a millimetre on the
//! tooth.

pub use glam::{Mat3, Quat, Vec2, Vec3};

/// Rigid transform, also used as a position with an orientation.
///
/// Transforms compose from right to left: `tip_in_tooth = tooth_from_world * tip_in_world`.
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

    /// Rotates a direction or a force into the other space, without translation.
    pub fn rotate(&self, direction: Vec3) -> Vec3 {
        self.orientation * direction
    }

    /// Returns true if every number is finite and the quaternion has unit length within 1 %.
    pub fn is_valid(&self) -> bool {
        self.position.is_finite()
            && self.orientation.is_finite()
            && (self.orientation.length_squared() - 1.0).abs() < 0.02
    }
}

/// Returns the rotation nearest to three axes, which a device may report slightly skewed or scaled: the direction of
/// `z` is kept, then that of `x`. `None` if the axes are far from a right-handed orthonormal triple.
pub fn nearest_rotation(x: Vec3, y: Vec3, z: Vec3) -> Option<Quat> {
    // Signed volume of the box spanned by the axes: 1 for a rotation, negative for a reflection.
    let is_near = x.cross(y).dot(z) > 0.5;
    let z = z.try_normalize()?;
    let x = (x - z * z.dot(x)).try_normalize()?;
    is_near.then(|| Quat::from_mat3(&Mat3::from_cols(x, z.cross(x), z)).normalize())
}

/// Rotation about x, then y, then z of the space that stays in place, each in degrees.
pub fn rotation_about_axes([x, y, z]: [f32; 3]) -> Quat {
    let [x, y, z] = [x, y, z].map(f32::to_radians);
    Quat::from_rotation_z(z) * Quat::from_rotation_y(y) * Quat::from_rotation_x(x)
}

/// Rises from 0 at 0 to 1 at 1, level at both ends and beyond them.
pub fn smooth_step(share: f32) -> f32 {
    let t = share.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
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
        assert!(!Pose::at(Vec3::new(f32::NAN, 0.0, 0.0)).is_valid());
        assert!(!Pose { orientation: Quat::from_xyzw(0.0, 0.0, 0.0, 0.0), ..Pose::IDENTITY }.is_valid());
        assert!(Pose::IDENTITY.is_valid());
    }

    #[test]
    fn skewed_axes_become_a_rotation() {
        // Aim: the matrices of devices are slightly inaccurate, but quaternions must be exact. Method: skew a known
        // rotation by one per cent.
        let turn = Quat::from_rotation_y(0.7) * Quat::from_rotation_x(-0.4);
        let Mat3 { x_axis: x, y_axis: y, z_axis: z } = Mat3::from_quat(turn);
        let found = nearest_rotation(x * 1.01 + y * 0.01, y * 0.99, z * 1.005).unwrap();
        assert!((found.length() - 1.0).abs() < 1e-6);
        assert!(found.angle_between(turn) < 0.02, "{found} for {turn}");
        assert_eq!(nearest_rotation(Vec3::ZERO, Vec3::ZERO, Vec3::ZERO), None);
        assert_eq!(nearest_rotation(Vec3::NAN, y, z), None);
        assert_eq!(nearest_rotation(-x, y, z), None, "a reflection is no rotation");
    }
}
