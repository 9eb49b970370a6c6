//! Suction, which removes dust and water from the operating field.

use crate::instrument::revolve;
use std::f32::consts::PI;
use std::sync::Arc;
use typodont_core::aabb::Aabb;
use typodont_core::frame::{Pose, Quat, Vec3};
use typodont_exercise::scenario::Workpiece;
use typodont_render::{Appearance, MeshInstance};

/// Air that a saliva ejector draws, mm³/s: 60 litres a minute, of the low class of ISO 10637 (up to 90).
const FLOW: f32 = 1.0e6;

/// Radius of the tip, within which particles are removed, mm: tubes are 6 mm wide.
const RADIUS: f32 = 3.0;

/// Direction of the tube out of the mouth, world space: to the front, up and away from the trainee.
const TUBE_DIRECTION: Vec3 = Vec3::new(0.80, 0.42, -0.42);

/// A suction tip.
#[derive(Clone, Copy, Debug)]
pub struct Suction {
    /// World space, mm.
    inlet: Vec3,
}

impl Suction {
    pub fn new(inlet: Vec3) -> Suction {
        Suction { inlet }
    }

    /// Velocity of the air at a place, mm/s: it comes from all sides alike, so that it is spread over a ball.
    pub fn air_velocity(&self, place: Vec3) -> Vec3 {
        let toward_inlet = self.inlet - place;
        let squared = toward_inlet.length_squared().max(RADIUS * RADIUS);
        toward_inlet.normalize_or_zero() * (FLOW / (4.0 * PI * squared))
    }

    /// True if the path between two points leads into the inlet.
    pub fn captures(&self, from: Vec3, to: Vec3) -> bool {
        let path = to - from;
        let share = ((self.inlet - from).dot(path) / path.length_squared().max(1e-9)).clamp(0.0, 1.0);
        (from + path * share).distance(self.inlet) < RADIUS
    }
}

/// A saliva ejector beside the tooth, in the buccal vestibule: the drawn tube, and the position of its inlet; world
/// space, mm.
pub fn saliva_ejector(workpiece: &Workpiece) -> (MeshInstance, Vec3) {
    /// From the crown toward the cheek, and over the neck, mm.
    const ASIDE: f32 = 4.6;
    const OVER: f32 = 0.5;
    let Aabb { low, high } = workpiece.crown_bounds();
    let in_tooth = Vec3::new(high.x + ASIDE, 0.5 * (low.y + high.y), low.z + OVER);
    let inlet = workpiece.world_from_tooth * in_tooth;
    (suction_tube(inlet), inlet)
}

/// A suction tube with its inlet at a place, world space, mm.
pub fn suction_tube(inlet: Vec3) -> MeshInstance {
    /// Length of the tube, mm.
    const LENGTH: f32 = 90.0;
    const PLASTIC: Appearance = Appearance { colour: [0.84, 0.89, 0.90], gloss: 0.35 };
    // A rounded tip, open in its middle.
    let tip = [[1.6, 1.0], [1.6, 0.0], [2.4, -0.3], [RADIUS, 0.6], [RADIUS, 6.0], [2.6, 6.6], [2.6, LENGTH]];
    let orientation = Quat::from_rotation_arc(Vec3::Z, TUBE_DIRECTION.normalize());
    MeshInstance::plain(Arc::new(revolve(&tip)), Pose { position: inlet, orientation }, PLASTIC)
}
