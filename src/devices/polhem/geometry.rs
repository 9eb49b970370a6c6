//! Geometry of an arm: from encoders to a pose, from a force to motor currents.
//!
//! Takes counts, and a force in the arm's axes (x toward the user, y right, z up; metres, as published by the
//! builders of the arms). Gives a pose in the same axes, and amperes. Never does any input or output.

use std::f64::consts::{FRAC_PI_2, TAU};

/// Geometry of one model of arm: joints A (about the vertical), B (upper arm), C (forearm), then the wrist D E F.
#[derive(Clone, Debug, PartialEq)]
pub struct ArmConfig {
    pub name: &'static str,
    /// Diameters of the capstans, m; `body`: of the bodies that they turn.
    pub capstan: [f64; 3],
    pub body: [f64; 3],
    /// Lengths of the base (height), the upper arm and the forearm, m.
    pub link: [f64; 3],
    /// Middle of the workspace from the foot of the arm, m.
    pub origin: [f64; 3],
    /// N·m/A
    pub torque_constant: [f64; 3],
    /// Encoder counts per revolution of a motor.
    pub counts: [f64; 3],
    /// Counts per revolution of D, E and F; 0 without a wrist.
    pub wrist_counts: f64,
    /// Motor and body turn in the same direction.
    pub is_aligned: [bool; 3],
    /// N
    pub max_force: f64,
    /// N/m
    pub max_stiffness: f64,
    /// N·s/m
    pub max_damping: f64,
    /// Reading of encoder C in the calibration position: upper arm upright, forearm level.
    pub preset_c: i16,
}

const WOODY: ArmConfig = ArmConfig {
    name: "default_woody",
    capstan: [0.010; 3],
    body: [0.160, 0.120, 0.120],
    link: [0.080, 0.205, 0.245],
    origin: [0.220, 0.0, 0.080],
    torque_constant: [0.0259; 3],
    counts: [2000.0; 3],
    wrist_counts: 0.0,
    is_aligned: [false, true, false],
    max_force: 5.0,
    max_stiffness: 1000.0,
    max_damping: 8.0,
    preset_c: 6000,
};

/// All arms whose geometry is published.
pub const ARM_CONFIGS: &[ArmConfig] = &[
    WOODY,
    ArmConfig { name: "woodenhaptics_v2015", is_aligned: [false; 3], ..WOODY },
    ArmConfig {
        name: "woodenhaptics_v2019",
        is_aligned: [false; 3],
        torque_constant: [0.321, 0.0603, 0.0603],
        ..WOODY
    },
    ArmConfig {
        name: "polhem_v1",
        body: [0.180, 0.100, 0.100],
        link: [0.058, 0.174, 0.133],
        origin: [0.140, 0.0, 0.100],
        torque_constant: [0.0538; 3],
        wrist_counts: 1024.0,
        is_aligned: [true; 3],
        max_stiffness: 800.0,
        preset_c: -5000,
        ..WOODY
    },
    ArmConfig {
        name: "aluhaptics_v2",
        capstan: [0.0138, 0.0098, 0.0098],
        body: [0.116, 0.076, 0.076],
        link: [0.111, 0.140, 0.111],
        origin: [0.140, 0.0, 0.0],
        is_aligned: [false; 3],
        // No preset is published; this is a quarter turn of the forearm, as for the others.
        preset_c: 3878,
        ..WOODY
    },
    ArmConfig {
        name: "vintage",
        capstan: [0.013, 0.010, 0.010],
        body: [0.117, 0.077, 0.077],
        link: [0.056, 0.138, 0.112],
        origin: [0.140, 0.0, 0.0],
        torque_constant: [0.0163; 3],
        counts: [4000.0; 3],
        is_aligned: [false; 3],
        max_stiffness: 800.0,
        // As above.
        preset_c: 7700,
        ..WOODY
    },
];

/// Angles of A, B and C, rad.
pub type JointAngles = [f64; 3];

impl ArmConfig {
    pub fn has_wrist(&self) -> bool {
        self.wrist_counts > 0.0
    }

    /// Returns the rotation of a joint per rotation of its motor, with the sign of their axes: negative where
    /// `is_aligned` is true.
    fn ratio(&self, joint: usize) -> f64 {
        let sign = if self.is_aligned[joint] { -1.0 } else { 1.0 };
        sign * self.capstan[joint] / self.body[joint]
    }

    /// Converts encoder counts to joint angles, rad.
    pub fn angles(&self, encoders: [i16; 3]) -> JointAngles {
        std::array::from_fn(|i| self.ratio(i) * TAU * f64::from(encoders[i]) / self.counts[i])
    }

    /// Returns the position of the tip from the middle of the workspace, m.
    pub fn position(&self, [a, b, c]: JointAngles) -> [f64; 3] {
        let [base, upper, fore] = self.link;
        let [ox, oy, oz] = self.origin;
        let out = upper * b.sin() + fore * c.sin();
        [a.cos() * out - ox, a.sin() * out - oy, base + upper * b.cos() - fore * c.cos() - oz]
    }

    /// Returns the orientation of the handle as rotations, applied right to left: about z, y, x, y, x by these
    /// angles, rad.
    pub fn handle_rotations(&self, [a, _, c]: JointAngles, wrist: [i16; 3]) -> [f64; 5] {
        let [d, e, f] = wrist.map(|n| TAU * f64::from(n) / self.wrist_counts);
        [a, FRAC_PI_2 - c, d, e, f]
    }

    /// Returns the motor currents that render a force, A: the torques about the joints are τ = Jᵀ F. Force in newtons.
    pub fn currents(&self, [a, b, c]: JointAngles, [fx, fy, fz]: [f64; 3]) -> [f64; 3] {
        let [_, upper, fore] = self.link;
        let outward = a.cos() * fx + a.sin() * fy;
        let torques = [
            (upper * b.sin() + fore * c.sin()) * (-a.sin() * fx + a.cos() * fy),
            upper * (b.cos() * outward - b.sin() * fz),
            fore * (c.cos() * outward + c.sin() * fz),
        ];
        std::array::from_fn(|i| self.ratio(i) * torques[i] / self.torque_constant[i])
    }

    /// Returns the tip's displacement per count of the encoder that moves it most, in the middle of the workspace, m.
    pub fn resolution(&self) -> f64 {
        let [_, upper, fore] = self.link;
        let lever = [upper + fore, upper, fore];
        (0..3).map(|i| (self.ratio(i) * TAU / self.counts[i]).abs() * lever[i]).fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_preset_has_the_upper_arm_upright_and_the_forearm_level() {
        // Aim: the presets of the configurations agree with their geometry. Method: the joint angles of the preset.
        for config in ARM_CONFIGS {
            let [a, b, c] = config.angles([0, 0, config.preset_c]);
            assert_eq!((a.abs(), b.abs()), (0.0, 0.0));
            assert!((c - FRAC_PI_2).abs() < 1e-3, "{}: {c}", config.name);
        }
    }

    #[test]
    fn torques_do_the_work_of_the_force() {
        // Aim: τ = Jᵀ F. Method: virtual work. A small rotation of a joint moves the tip; force times displacement
        // must equal torque times rotation, for every joint, pose and configuration.
        for config in ARM_CONFIGS {
            for angles in [[0.0, 0.3, 1.4], [0.4, -0.2, 1.7], [-0.6, 0.5, 1.1]] {
                let force = [1.5, -0.7, 2.0];
                let currents = config.currents(angles, force);
                for joint in 0..3 {
                    let mut turned = angles;
                    turned[joint] += 1e-6;
                    let (from, to) = (config.position(angles), config.position(turned));
                    let work: f64 = (0..3).map(|i| force[i] * (to[i] - from[i])).sum();
                    let torque = currents[joint] * config.torque_constant[joint] / config.ratio(joint);
                    assert!((work / 1e-6 - torque).abs() < 1e-4, "{} joint {joint}", config.name);
                }
            }
        }
    }
}
