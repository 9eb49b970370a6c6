//! The spring and damper between the hand and the tip.
//!
//! Takes where the hand and the tip are and what is touched. Gives the force on the hand. Stable for a 45 g hand with
//! coarse encoders and a tick of delay at the stiffest material its device allows (`tests/force_quality.rs`).

use super::material::Material;
use super::proxy::Contact;
use crate::frame::Vec3;
use crate::tick::TICK_S;

/// What a device can render, as far as the spring needs to know.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpringLimit {
    /// N/mm at coefficient 1.
    pub max_stiffness: f32,
    /// N·s/mm at coefficient 1.
    pub max_damping: f32,
    /// Smallest step of position the device reports, mm; 0 for an ideal one.
    pub resolution: f32,
}

/// Ticks over which the hand's speed is measured. Fewer are noisy with coarse encoders (0.055 mm in 1 ms reads as
/// 55 mm/s), more are late: at 8 a free 45 g hand starts to gain energy.
const SPEED_TICKS: usize = 5;

/// Depth over which damping comes in, mm: no jolt at first touch. 0.2–0.3 keeps slow touches passive.
const DAMPING_DEPTH: f32 = 0.3;

/// The first moments of a touch cannot be told apart by an encoder: over this many of its steps the spring comes in
/// softly, f = k·d·(1 − e^(−d / (10 q))). With 8 steps a touch at 5 mm/s still gains energy, with 10 none from 2 mm/s up.
const SOFT_STEPS: f32 = 10.0;

/// Most that a change of tissue under the tip may change the force within one tick, N. Half of what is felt as a click.
const TISSUE_STEP: f32 = 0.03;

/// Share by which friction and damping follow a change of tissue within one tick.
const TISSUE_SHARE: f32 = 0.1;

/// The force on the hand, and the parts that others need.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pull {
    /// N, from the tip toward where the hand is pushed; tooth space.
    pub force: Vec3,
    /// The spring's part of it, N: what carving thresholds are compared with.
    pub spring: f32,
    /// N/mm now in effect.
    pub stiffness: f32,
}

/// The spring's memory: the hand's way and the coefficients now in effect.
#[derive(Clone, Debug)]
pub struct Law {
    limit: SpringLimit,
    /// The hand's last positions, newest at `newest`.
    way: [Vec3; SPEED_TICKS + 1],
    newest: usize,
    /// Ticks of `way` that are real.
    known: usize,
    in_effect: Option<Material>,
}

impl Law {
    pub fn new(limit: SpringLimit) -> Law {
        Law { limit, way: [Vec3::ZERO; SPEED_TICKS + 1], newest: 0, known: 0, in_effect: None }
    }

    /// Friction and the like as they are in effect: smoothed over borders between tissues.
    pub fn in_effect(&self) -> Option<&Material> {
        self.in_effect.as_ref()
    }

    /// Forgets the hand's way: after a pause, or when the device jumped.
    pub fn forget(&mut self) {
        self.known = 0;
        self.in_effect = None;
    }

    /// The hand's velocity over the last few ticks, mm/s.
    pub fn velocity(&self) -> Vec3 {
        let span = self.known.saturating_sub(1).min(SPEED_TICKS);
        if span == 0 {
            return Vec3::ZERO;
        }
        let oldest = (self.newest + self.way.len() - span) % self.way.len();
        (self.way[self.newest] - self.way[oldest]) / (span as f32 * TICK_S as f32)
    }

    /// The force for this tick. Positions in tooth space, mm.
    pub fn pull(&mut self, hand: Vec3, tip: Vec3, contact: Option<&Contact>) -> Pull {
        self.newest = (self.newest + 1) % self.way.len();
        self.way[self.newest] = hand;
        self.known = (self.known + 1).min(self.way.len());
        let Some(contact) = contact else {
            self.in_effect = None;
            return Pull::default();
        };
        let stretch = tip - hand;
        let depth = stretch.length();
        let softened = depth * self.softness(depth);
        let material = self.approach(contact.material, softened);
        let stiffness = material.stiffness * self.limit.max_stiffness;
        let spring = stiffness * softened;
        let outward = stretch.normalize_or_zero();
        let leaving = self.velocity().dot(outward);
        let damping = material.damping * self.limit.max_damping * (depth / DAMPING_DEPTH).min(1.0);
        // Matter pushes; it never pulls a hand that leaves.
        let force = outward * (spring - damping * leaving).max(0.0);
        Pull { force, spring, stiffness }
    }

    /// How far the spring has come in at a depth, 0–1.
    fn softness(&self, depth: f32) -> f32 {
        let scale = SOFT_STEPS * self.limit.resolution;
        if scale <= 0.0 { 1.0 } else { 1.0 - libm::expf(-depth / scale) }
    }

    /// Moves the coefficients in effect toward the touched tissue's, no faster than the hand should feel.
    fn approach(&mut self, touched: Material, softened: f32) -> Material {
        let Some(now) = self.in_effect else {
            self.in_effect = Some(touched);
            return touched;
        };
        let force_per_share = (self.limit.max_stiffness * softened).max(1e-6);
        let most = TISSUE_STEP / force_per_share;
        let toward = |from: f32, to: f32| from + (to - from) * TISSUE_SHARE;
        let next = Material {
            stiffness: now.stiffness + (touched.stiffness - now.stiffness).clamp(-most, most),
            damping: toward(now.damping, touched.damping),
            static_friction: toward(now.static_friction, touched.static_friction),
            dynamic_friction: toward(now.dynamic_friction, touched.dynamic_friction),
            cut_force: None,
            hardness: None,
        };
        self.in_effect = Some(next);
        next
    }
}
