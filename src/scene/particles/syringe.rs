//! The three-way syringe of an assistant.

use crate::instrument::revolve;
use std::sync::Arc;
use typodont_core::frame::{Pose, Quat, Vec3};
use typodont_render::{Appearance, MeshInstance};

/// Profile of the nozzle and the beginning of its handle: radius and height, mm.
const PROFILE: [[f32; 2]; 7] =
    [[0.7, 0.0], [1.5, 0.4], [1.5, 24.0], [2.6, 26.0], [4.5, 34.0], [4.5, 70.0], [2.0, 72.0]];

const STEEL: Appearance = Appearance { colour: [0.72, 0.74, 0.77], gloss: 0.8 };

/// A syringe with the end of its nozzle at a place, pointing to another, world space, mm.
pub fn syringe(nozzle: Vec3, aim: Vec3) -> MeshInstance {
    let back = (nozzle - aim).normalize_or(Vec3::Y);
    let orientation = Quat::from_rotation_arc(Vec3::Z, back);
    MeshInstance::plain(Arc::new(revolve(&PROFILE)), Pose { position: nozzle, orientation }, STEEL)
}
