//! What is touched around the tooth, drawn as it is felt.

use super::jaw::smooth_normals;
use super::palette::GLOSS;
use crate::content::TissueTable;
use crate::frame::Vec3;
use crate::mesh::Mesh;
use crate::render::{Finish, Solid};
use crate::scenario::Workpiece;
use crate::touch::{Field, Form, Shape, Yield};
use crate::volume::{Grid, Label, Volume, surface};
use std::sync::Arc;

/// Distance between samples of what stands around, mm: its roundings are larger.
const SPACING: f32 = 0.4;

/// The same for gum with a margin of its own.
const FINE: f32 = 0.25;

/// How deep it goes where it ends, and over which way, mm.
const DIVE: f32 = 1.0;
const FADE: f32 = 2.2;

/// How far a mesh around the tooth is drawn from it, mm.
const REACH: f32 = 12.0;

/// Gum and neighbours as they are touched, world space.
pub fn around(workpiece: &Workpiece, tissues: &TissueTable) -> Vec<Solid> {
    workpiece.around.iter().filter(|shape| is_seen(shape, tissues)).map(|s| solid(s, workpiece, tissues)).collect()
}

/// False for what lies hidden: the floor of a sulcus.
pub(super) fn is_seen(shape: &Shape, tissues: &TissueTable) -> bool {
    let gum = tissues.by_name("gingiva").map(|e| e.label());
    !matches!(shape.form, Form::Field(_)) || Some(shape.label) == gum
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
        Form::Field(field) => field.extent(),
        Form::Mesh(_) => {
            let low = workpiece.teeth.iter().map(|t| t.low).fold(Vec3::INFINITY, Vec3::min);
            let high = workpiece.teeth.iter().map(|t| t.high).fold(Vec3::NEG_INFINITY, Vec3::max);
            [low - REACH, high + REACH]
        }
    };
    if let (Form::Mesh(obstacle), Some(_)) = (&shape.form, &workpiece.periodontium) {
        // A neighbour that was grown is as fine as it needs to be.
        let mut mesh = obstacle.mesh();
        mesh.positions.iter_mut().for_each(|p| *p = shape.tooth_from_shape * *p);
        smooth_normals(&mut mesh);
        return mesh;
    }
    if let (Form::Field(field), Some(gum)) = (&shape.form, &workpiece.periodontium) {
        // As the eye sees it: lying on the tooth. A probe finds it a little off.
        let [low, high] = field.extent();
        let grid = Grid::covering(low, high, Vec3::splat(FINE), 1);
        // Along the arch and below it goes down under the jaw's own gum, which lies a little deeper than what is felt.
        let dive = |p: Vec3| {
            let inside = (p.y - low.y).min(high.y - p.y).min(p.z - low.z);
            let share = (1.0 - inside / FADE).clamp(0.0, 1.0);
            DIVE * share * share * (3.0 - 2.0 * share)
        };
        let seen = Field::of(grid, Yield::default(), |p| gum.seen_gum(p) + dive(p));
        return surface::extract(&Volume::from_distance(grid, 2.0 * FINE, |p| (seen.distance(p), Label(1))));
    }
    let grid = Grid::covering(low, high, Vec3::splat(SPACING), 3);
    surface::extract(&Volume::from_distance(grid, 2.0 * SPACING, |p| (shape.distance(p), Label(1))))
}

fn is_upright(shape: &Shape) -> bool {
    shape.tooth_from_shape.orientation.w.abs() > 0.9999
}
