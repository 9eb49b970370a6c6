//! Spring and damper between the hand and the tip.
//!
//! Takes the positions of hand and tip and the contact. Gives the force on the hand. Stable for a hand of 45 g with
//! coarse encoders and one tick of delay, at the greatest stiffness that its device allows
//! (`tests/touch/force_quality.rs`).

use super::material::Material;
use super::proxy::Contact;
use crate::frame::Vec3;
use crate::tick::TICK_S;

/// Limits of a device that the spring has to respect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpringLimit {
    /// Stiffness at coefficient 1, N/mm.
    pub max_stiffness: f32,
    /// Damping at coefficient 1, N·s/mm.
    pub max_damping: f32,
    /// Smallest position step that the device reports, mm; 0 for an ideal device.
    pub resolution: f32,
}

impl SpringLimit {
    /// Returns the limits of springs at the tooth for a hand whose way is multiplied by a scale on the way there.
    pub fn at_scale(&self, scale: f32) -> SpringLimit {
        SpringLimit {
            max_stiffness: self.max_stiffness / scale,
            max_damping: self.max_damping / scale,
            resolution: self.resolution * scale,
        }
    }
}

/// Ticks over which the velocity of the hand is measured. Fewer are noisy with coarse encoders (0.055 mm in 1 ms
/// reads as 55 mm/s); more are late: at 8 a free hand of 45 g starts to gain energy.
const SPEED_TICKS: usize = 5;

/// Depth over which damping fades in at scale 1, mm: no jolt at first contact. 0.2–0.3 keeps slow contacts passive.
const DAMPING_DEPTH: f32 = 0.3;

/// Encoder steps over which the spring fades in, f = k·d·(1 − e^(−d / (10 q))), because an encoder cannot resolve the
/// first moments of a contact. With 8 steps a contact at 5 mm/s still gains energy, with 10 none from 2 mm/s up.
const SOFT_STEPS: f32 = 10.0;

/// Greatest change of force within one tick that a change of tissue may cause, N. Half of the step that is felt as a
/// click.
const MAX_TISSUE_FORCE_STEP: f32 = 0.03;

/// Fraction by which friction and damping approach those of a new tissue within one tick.
const TISSUE_SMOOTHING: f32 = 0.1;

/// Contact force on the hand, with the quantities that other components need.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ContactForce {
    /// Force on the hand, N, directed from the hand toward the tip; tooth space.
    pub force: Vec3,
    /// Spring component of the force, N, which is compared with cutting thresholds.
    pub spring: f32,
    /// Stiffness in effect, N/mm.
    pub stiffness: f32,
}

/// State of the contact spring: recent hand positions and the coefficients in effect.
#[derive(Clone, Debug)]
pub struct ContactSpring {
    /// Limits of the device at the present scale of the hand.
    limit: SpringLimit,
    device_limit: SpringLimit,
    /// Distance at the tooth per distance of the hand.
    scale: f32,
    /// Last hand positions, tooth space; the newest at index `newest`.
    hand_history: [Vec3; SPEED_TICKS + 1],
    newest: usize,
    /// Number of valid entries of `hand_history`.
    filled: usize,
    current_material: Option<Material>,
}

impl ContactSpring {
    pub fn new(limit: SpringLimit) -> ContactSpring {
        ContactSpring {
            limit,
            device_limit: limit,
            scale: 1.0,
            hand_history: [Vec3::ZERO; SPEED_TICKS + 1],
            newest: 0,
            filled: 0,
            current_material: None,
        }
    }

    /// Sets the distance at the tooth per distance of the hand. The hand feels the same stiffness and damping as at 1.
    pub fn set_scale(&mut self, scale: f32) {
        (self.limit, self.scale) = (self.device_limit.at_scale(scale), scale);
    }

    /// Clears the hand history, after a pause or a jump of the device.
    pub fn reset(&mut self) {
        self.filled = 0;
        self.current_material = None;
    }

    /// Velocity of the hand over the last few ticks, mm/s.
    pub fn velocity(&self) -> Vec3 {
        let span = self.filled.saturating_sub(1).min(SPEED_TICKS);
        if span == 0 {
            return Vec3::ZERO;
        }
        let oldest = (self.newest + self.hand_history.len() - span) % self.hand_history.len();
        (self.hand_history[self.newest] - self.hand_history[oldest]) / (span as f32 * TICK_S as f32)
    }

    /// Computes the force for this tick. Positions in tooth space, mm.
    pub fn force(&mut self, hand: Vec3, tip: Vec3, contact: Option<&Contact>) -> ContactForce {
        self.newest = (self.newest + 1) % self.hand_history.len();
        self.hand_history[self.newest] = hand;
        self.filled = (self.filled + 1).min(self.hand_history.len());
        let Some(contact) = contact else {
            self.current_material = None;
            return ContactForce::default();
        };
        let stretch = tip - hand;
        let depth = stretch.length();
        let softened = depth * self.softening(depth);
        let material = self.approach_material(contact.material, softened);
        let stiffness = material.stiffness * self.limit.max_stiffness;
        let spring = stiffness * softened;
        let outward = stretch.normalize_or_zero();
        let leaving = self.velocity().dot(outward);
        let damping = material.damping * self.limit.max_damping * (depth / (DAMPING_DEPTH * self.scale)).min(1.0);
        // The contact only pushes; it never pulls on a hand that moves away.
        let force = outward * (spring - damping * leaving).max(0.0);
        ContactForce { force, spring, stiffness }
    }

    /// Fade-in factor of the spring at a depth, 0–1.
    fn softening(&self, depth: f32) -> f32 {
        let scale = SOFT_STEPS * self.limit.resolution;
        if scale <= 0.0 { 1.0 } else { 1.0 - libm::expf(-depth / scale) }
    }

    /// Moves the coefficients in effect toward those of the touched tissue, slowly enough to be imperceptible.
    fn approach_material(&mut self, touched: Material, softened: f32) -> Material {
        let Some(now) = self.current_material else {
            self.current_material = Some(touched);
            return touched;
        };
        let force_per_share = (self.limit.max_stiffness * softened).max(1e-6);
        let max_step = MAX_TISSUE_FORCE_STEP / force_per_share;
        let toward = |from: f32, to: f32| from + (to - from) * TISSUE_SMOOTHING;
        let next = Material {
            stiffness: now.stiffness + (touched.stiffness - now.stiffness).clamp(-max_step, max_step),
            damping: toward(now.damping, touched.damping),
            static_friction: toward(now.static_friction, touched.static_friction),
            dynamic_friction: toward(now.dynamic_friction, touched.dynamic_friction),
            cut_force: None,
            hardness: None,
        };
        self.current_material = Some(next);
        next
    }
}
