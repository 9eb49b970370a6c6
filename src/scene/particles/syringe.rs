//! The three-way syringe of an assistant.

use crate::instrument::revolve;
use std::sync::Arc;
use typodont_core::frame::{Pose, Quat, Vec3};
use typodont_render::{Appearance, MeshInstance};

/// Profile of the nozzle and the beginning of its handle: radius and height, mm.
const PROFILE: [[f32; 2]; 7] =
    [[0.7, 0.0], [1.5, 0.4], [1.5, 24.0], [2.6, 26.0], [4.5, 34.0], [4.5, 70.0], [2.0, 72.0]];

const STEEL: Appearance = Appearance { colour: [0.72, 0.74, 0.77], gloss: 0.8 };

/// Speed of the air at the nozzle, mm/s; the distance at which half of it is left, mm; half the width of the stream at the nozzle, mm, and
/// its growth with the distance. Estimates.
const AIR_SPEED: f32 = 20_000.0;
const HALF_DISTANCE: f32 = 10.0;
const WIDTH: [f32; 2] = [1.0, 0.3];

/// Velocity at a place, mm/s, of the air of a syringe that is aimed at another; it spreads away from the stream's axis.
pub fn air_velocity(nozzle: Vec3, aim: Vec3, place: Vec3) -> Vec3 {
    let way = (aim - nozzle).normalize_or(Vec3::NEG_Y);
    let along = (place - nozzle).dot(way);
    if along <= 0.0 {
        return Vec3::ZERO;
    }
    let aside = (place - nozzle - way * along) / (WIDTH[0] + WIDTH[1] * along);
    let speed = AIR_SPEED * libm::expf(-aside.length_squared()) / (1.0 + along / HALF_DISTANCE);
    (way + aside).normalize() * speed
}

/// A syringe with the end of its nozzle at a place, pointing to another, world space, mm.
pub fn syringe(nozzle: Vec3, aim: Vec3) -> MeshInstance {
    let back = (nozzle - aim).normalize_or(Vec3::Y);
    let orientation = Quat::from_rotation_arc(Vec3::Z, back);
    MeshInstance::plain(Arc::new(revolve(&PROFILE)), Pose { position: nozzle, orientation }, STEEL)
}
