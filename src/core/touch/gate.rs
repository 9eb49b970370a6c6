//! Validation of readings on the way in and limitation of forces on the way out.
//!
//! Takes poses and forces. Gives safe ones and counts the changes it had to make. Any value that is not finite
//! results in zero force, which releases the hand.

use crate::frame::{Pose, Vec3};

/// Force and torque limits of a device.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForceLimit {
    /// N
    pub max_force: f32,
    /// N·mm; 0 if the device renders forces only.
    pub max_torque: f32,
}

/// Counts of refused and changed values. All counts reach the recording and the report.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Gate {
    /// Readings refused because a number was not finite or a quaternion not of unit length.
    pub refused_readings: u64,
    /// Forces reduced to the limit of the device.
    pub clamped_forces: u64,
    /// Torques reduced to the limit of the device.
    pub clamped_torques: u64,
    /// Forces and torques that were not finite and were set to zero.
    pub zeroed_forces: u64,
}

impl Gate {
    /// Returns the pose, with its orientation normalised, if it is valid; otherwise counts it as refused.
    pub fn admit(&mut self, pose: &Pose) -> Option<Pose> {
        if pose.is_valid() {
            return Some(Pose { orientation: pose.orientation.normalize(), ..*pose });
        }
        self.refused_readings += 1;
        None
    }

    /// Returns the force limited to what the device can render, N.
    pub fn clamp_force(&mut self, force: Vec3, limit: &ForceLimit) -> Vec3 {
        let length = force.length();
        if !length.is_finite() {
            self.zeroed_forces += 1;
            return Vec3::ZERO;
        }
        if length > limit.max_force {
            self.clamped_forces += 1;
            return force * (limit.max_force / length);
        }
        force
    }

    /// Returns the torque limited to what the device can render, N·mm: zero if it renders forces only.
    pub fn clamp_torque(&mut self, torque: Vec3, limit: &ForceLimit) -> Vec3 {
        if limit.max_torque <= 0.0 {
            return Vec3::ZERO;
        }
        let length = torque.length();
        if !length.is_finite() {
            self.zeroed_forces += 1;
            return Vec3::ZERO;
        }
        if length > limit.max_torque {
            self.clamped_torques += 1;
            return torque * (limit.max_torque / length);
        }
        torque
    }

    /// Number of refused readings and of zeroed forces and torques so far; limited ones are not included.
    pub fn faults(&self) -> u64 {
        self.refused_readings + self.zeroed_forces
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_unsafe_passes() {
        let mut gate = Gate::default();
        let limit = ForceLimit { max_force: 3.3, max_torque: 0.0 };
        assert_eq!(gate.clamp_force(Vec3::new(f32::NAN, 0.0, 0.0), &limit), Vec3::ZERO);
        assert_eq!(gate.clamp_force(Vec3::new(f32::INFINITY, 0.0, 0.0), &limit), Vec3::ZERO);
        assert_eq!(
            gate.clamp_force(Vec3::splat(f32::MAX), &limit),
            Vec3::ZERO,
            "a length that overflows is not a force"
        );
        assert!((gate.clamp_force(Vec3::new(0.0, 9.0, 0.0), &limit).length() - 3.3).abs() < 1e-5);
        assert_eq!(gate.clamp_force(Vec3::X, &limit), Vec3::X);
        assert!(gate.admit(&Pose::at(Vec3::new(0.0, f32::NAN, 0.0))).is_none());
        assert!(gate.admit(&Pose::IDENTITY).is_some());
        assert_eq!(gate, Gate { refused_readings: 1, clamped_forces: 1, clamped_torques: 0, zeroed_forces: 3 });
    }

    #[test]
    fn a_torque_stays_within_what_the_device_renders() {
        let mut gate = Gate::default();
        let (none, some) =
            (ForceLimit { max_force: 3.3, max_torque: 0.0 }, ForceLimit { max_force: 3.3, max_torque: 50.0 });
        assert_eq!(gate.clamp_torque(Vec3::X * 20.0, &none), Vec3::ZERO);
        assert_eq!(gate.clamp_torque(Vec3::X * f32::NAN, &some), Vec3::ZERO);
        assert_eq!(gate.clamp_torque(Vec3::X * 20.0, &some), Vec3::X * 20.0);
        assert!((gate.clamp_torque(Vec3::X * 80.0, &some).x - 50.0).abs() < 1e-4);
        assert_eq!(gate, Gate { clamped_torques: 1, zeroed_forces: 1, ..Gate::default() });
    }
}
