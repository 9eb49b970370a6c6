//! What is touched around the tooth, drawn as it is felt.

use super::palette::GLOSS;
use crate::content::TissueTable;
use crate::frame::Vec3;
use crate::mesh::Mesh;
use crate::render::{Finish, Solid};
use crate::scenario::Workpiece;
use crate::touch::{Form, Shape};
use crate::volume::{Grid, Label, Volume, surface};
use std::sync::Arc;

/// Distance between samples of what stands around, mm: its roundings are larger.
const SPACING: f32 = 0.4;

/// How far a mesh around the tooth is drawn from it, mm.
const REACH: f32 = 12.0;

/// Gum and neighbours as they are touched, world space.
pub fn around(workpiece: &Workpiece, tissues: &TissueTable) -> Vec<Solid> {
    workpiece.around.iter().map(|shape| solid(shape, workpiece, tissues)).collect()
}

pub(super) fn solid(shape: &Shape, workpiece: &Workpiece, tissues: &TissueTable) -> Solid {
    let colour = tissues.by_label(shape.label).map_or([0.8; 3], |e| e.rgb());
    let mesh = Arc::new(mesh_of(shape, workpiece));
    Solid::plain(mesh, workpiece.world_from_tooth, Finish { colour, gloss: GLOSS })
}

/// A shape's surface in tooth space.
fn mesh_of(shape: &Shape, workpiece: &Workpiece) -> Mesh {
    let middle = shape.tooth_from_shape.position;
    let [low, high] = match &shape.form {
        Form::Ball { radius } => [middle - *radius, middle + *radius],
        // However it is turned.
        Form::RoundBox { half, .. } if is_upright(shape) => [middle - *half, middle + *half],
        Form::RoundBox { half, .. } => [middle - half.length(), middle + half.length()],
        Form::Capsule { half_length, radius } => [middle - (half_length + radius), middle + (half_length + radius)],
        Form::Mesh(_) => {
            let low = workpiece.teeth.iter().map(|t| t.low).fold(Vec3::INFINITY, Vec3::min);
            let high = workpiece.teeth.iter().map(|t| t.high).fold(Vec3::NEG_INFINITY, Vec3::max);
            [low - REACH, high + REACH]
        }
    };
    let grid = Grid::covering(low, high, Vec3::splat(SPACING), 3);
    surface::extract(&Volume::from_distance(grid, 2.0 * SPACING, |p| (shape.distance(p), Label(1))))
}

fn is_upright(shape: &Shape) -> bool {
    shape.tooth_from_shape.orientation.w.abs() > 0.9999
}
