//! What takes dust and water out of the field.

use crate::frame::{Pose, Quat, Vec3};
use crate::render::{Finish, Solid};
use crate::scenario::Workpiece;
use crate::scene::instrument::turned;
use std::f32::consts::PI;
use std::sync::Arc;

/// Air that a saliva ejector draws, mm³/s: 60 litres a minute, of the low class of ISO 10637 (up to 90).
const FLOW: f32 = 1.0e6;

/// Radius of the tip and of what it swallows, mm: tubes are 6 mm wide.
const RADIUS: f32 = 3.0;

/// A suction tip.
#[derive(Clone, Copy, Debug)]
pub struct Suction {
    /// World space, mm.
    mouth: Vec3,
}

impl Suction {
    pub fn at(mouth: Vec3) -> Suction {
        Suction { mouth }
    }

    /// Velocity of the air at a place, mm/s: it comes from all sides alike, so that it is spread over a ball.
    pub fn wind(&self, place: Vec3) -> Vec3 {
        let way = self.mouth - place;
        let squared = way.length_squared().max(RADIUS * RADIUS);
        way.normalize_or_zero() * (FLOW / (4.0 * PI * squared))
    }

    /// True when a way leads into the mouth.
    pub fn swallows(&self, from: Vec3, to: Vec3) -> bool {
        let way = to - from;
        let share = ((self.mouth - from).dot(way) / way.length_squared().max(1e-9)).clamp(0.0, 1.0);
        (from + way * share).distance(self.mouth) < RADIUS
    }
}

/// A saliva ejector that hangs beside the tooth, in the fold of the cheek: the tube as it is drawn, and its mouth; world
/// space, mm.
pub fn ejector(workpiece: &Workpiece) -> (Solid, Vec3) {
    /// From the crown toward the cheek, and over the neck, mm.
    const ASIDE: f32 = 4.6;
    const OVER: f32 = 0.5;
    const LENGTH: f32 = 90.0;
    /// The tube's way out of the mouth, world space: to the front, up and away from whoever works.
    const WAY: Vec3 = Vec3::new(0.80, 0.42, -0.42);
    const PLASTIC: Finish = Finish { colour: [0.84, 0.89, 0.90], gloss: 0.35 };
    let low = workpiece.teeth.iter().map(|t| t.crown_low).fold(Vec3::INFINITY, Vec3::min);
    let high = workpiece.teeth.iter().map(|t| t.crown_high).fold(Vec3::NEG_INFINITY, Vec3::max);
    let in_tooth = Vec3::new(high.x + ASIDE, 0.5 * (low.y + high.y), low.z + OVER);
    let mouth = workpiece.world_from_tooth * in_tooth;
    // A rounded tip, open in its middle.
    let tip = [[1.6, 1.0], [1.6, 0.0], [2.4, -0.3], [RADIUS, 0.6], [RADIUS, 6.0], [2.6, 6.6], [2.6, LENGTH]];
    let orientation = Quat::from_rotation_arc(Vec3::Z, WAY.normalize());
    (Solid::plain(Arc::new(turned(&tip)), Pose { position: mouth, orientation }, PLASTIC), mouth)
}
