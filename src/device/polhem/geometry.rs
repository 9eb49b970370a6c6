//! The arm's geometry: encoders to a pose, a force to currents.
//!
//! Takes counts and a force in the arm's axes (x toward the user, y right, z up; metres, as the arms' builders publish
//! them). Gives a pose in the same axes and amperes. Never talks to anyone.

use std::f64::consts::{FRAC_PI_2, TAU};

/// One arm as it was built: joints A (about the vertical), B (upper arm), C (forearm), then the wrist D E F.
#[derive(Clone, Debug, PartialEq)]
pub struct Config {
    pub name: &'static str,
    /// Diameters of capstans and of the bodies they turn, m.
    pub capstan: [f64; 3],
    pub body: [f64; 3],
    /// Lengths: base's height, upper arm, forearm, m.
    pub link: [f64; 3],
    /// The middle of the workspace, from the foot of the arm, m.
    pub origin: [f64; 3],
    /// N·m/A
    pub torque_constant: [f64; 3],
    /// Counts per turn of a motor.
    pub counts: [f64; 3],
    /// Counts per turn of D, E and F; 0 where there is no wrist.
    pub wrist_counts: f64,
    /// Motor and body turn the same way.
    pub is_aligned: [bool; 3],
    /// N
    pub max_force: f64,
    /// N/m
    pub max_stiffness: f64,
    /// N·s/m
    pub max_damping: f64,
    /// What encoder C reads in the place where the arm is calibrated: upper arm upright, forearm level.
    pub preset_c: i16,
}

const WOODY: Config = Config {
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

/// Every arm whose geometry is published.
pub const CONFIGS: &[Config] = &[
    WOODY,
    Config { name: "woodenhaptics_v2015", is_aligned: [false; 3], ..WOODY },
    Config { name: "woodenhaptics_v2019", is_aligned: [false; 3], torque_constant: [0.321, 0.0603, 0.0603], ..WOODY },
    Config {
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
    Config {
        name: "aluhaptics_v2",
        capstan: [0.0138, 0.0098, 0.0098],
        body: [0.116, 0.076, 0.076],
        link: [0.111, 0.140, 0.111],
        origin: [0.140, 0.0, 0.0],
        is_aligned: [false; 3],
        // No preset is published; a quarter turn of the forearm, as on the others.
        preset_c: 3878,
        ..WOODY
    },
    Config {
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
pub type Angles = [f64; 3];

impl Config {
    pub fn has_wrist(&self) -> bool {
        self.wrist_counts > 0.0
    }

    /// How far a body turns with its motor; negative where they turn against each other.
    fn ratio(&self, joint: usize) -> f64 {
        let sign = if self.is_aligned[joint] { -1.0 } else { 1.0 };
        sign * self.capstan[joint] / self.body[joint]
    }

    pub fn angles(&self, encoders: [i16; 3]) -> Angles {
        std::array::from_fn(|i| self.ratio(i) * TAU * f64::from(encoders[i]) / self.counts[i])
    }

    /// Where the tip is, from the middle of the workspace, m.
    pub fn position(&self, [a, b, c]: Angles) -> [f64; 3] {
        let [base, upper, fore] = self.link;
        let [ox, oy, oz] = self.origin;
        let out = upper * b.sin() + fore * c.sin();
        [a.cos() * out - ox, a.sin() * out - oy, base + upper * b.cos() - fore * c.cos() - oz]
    }

    /// How the handle is turned, as rotations to be carried out right to left: about z, y, x, y, x by these angles.
    pub fn turns(&self, [a, _, c]: Angles, wrist: [i16; 3]) -> [f64; 5] {
        let [d, e, f] = wrist.map(|n| TAU * f64::from(n) / self.wrist_counts);
        [a, FRAC_PI_2 - c, d, e, f]
    }

    /// Currents that render a force, A: its torques about the joints, τ = Jᵀ F.
    pub fn currents(&self, [a, b, c]: Angles, [fx, fy, fz]: [f64; 3]) -> [f64; 3] {
        let [_, upper, fore] = self.link;
        let outward = a.cos() * fx + a.sin() * fy;
        let torques = [
            (upper * b.sin() + fore * c.sin()) * (-a.sin() * fx + a.cos() * fy),
            upper * (b.cos() * outward - b.sin() * fz),
            fore * (c.cos() * outward + c.sin() * fz),
        ];
        std::array::from_fn(|i| self.ratio(i) * torques[i] / self.torque_constant[i])
    }

    /// The way of the tip with one count of the encoder that moves it most, in the middle of the workspace, m.
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
    fn the_preset_stands_the_upper_arm_up_and_the_forearm_level() {
        // Aim: the presets of the configurations and their geometry say the same. Method: the angles of the preset.
        for config in CONFIGS {
            let [a, b, c] = config.angles([0, 0, config.preset_c]);
            assert_eq!((a.abs(), b.abs()), (0.0, 0.0));
            assert!((c - FRAC_PI_2).abs() < 1e-3, "{}: {c}", config.name);
        }
    }

    #[test]
    fn torques_do_the_work_that_the_force_does() {
        // Aim: τ = Jᵀ F. Method: virtual work. A small turn of a joint moves the tip; force times that way must be the
        // torque times the turn, for every joint, pose and configuration.
        for config in CONFIGS {
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
