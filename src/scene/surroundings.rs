//! Solids around the tooth, drawn as they are touched.

use super::jaw::{Mouth, gum_tint, vertex_tint};
use super::palette::GLOSS;
use super::soft_tissue::YieldingSurface;
use std::sync::Arc;
use typodont_anatomy::jaw::{Jaw, RidgeSide, WORKING_OPENING_DEG, ridge_tint};
use typodont_anatomy::periodontium::Periodontium;
use typodont_core::aabb::Aabb;
use typodont_core::frame::Vec3;
use typodont_core::mesh::Mesh;
use typodont_core::touch::{Collider, ColliderGeometry, Compliance, SdfGrid};
use typodont_core::volume::{Grid, ISO, Label, Volume, surface};
use typodont_exercise::catalog::{TissueRole, TissueTable};
use typodont_exercise::scenario::Workpiece;
use typodont_render::{Appearance, ENAMEL_GLOSS, MeshInstance, VertexTint};

/// Distance between samples of a solid, mm: its curvature radii are larger.
const SPACING: f32 = 0.4;

/// The same for gingiva with a modelled margin.
const GUM_SPACING: f32 = 0.25;

/// Means of normals over neighbouring corners: neither facets nor steps of the samples show.
pub(super) const SMOOTHING: usize = 3;

/// Depth to which the gingiva is lowered at its ends, and the distance over which it is lowered, mm.
const DIVE: f32 = 1.0;
const FADE: f32 = 2.2;

/// Distance from the tooth up to which a mesh around it is drawn, mm.
const REACH: f32 = 12.0;

/// The mouth of an exercise, if it plays in one and the teeth worked on have a place there, and the solids around these teeth: the mouth's,
/// open as during treatment, or those that are touched.
pub fn mouth_and_solids(
    workpiece: &Workpiece,
    tissues: &TissueTable,
    is_in_mouth: bool,
) -> (Option<Mouth>, Vec<MeshInstance>) {
    let mouth = if is_in_mouth { Mouth::around(workpiece, tissues) } else { None };
    let solids = match &mouth {
        Some(mouth) => mouth.solids(WORKING_OPENING_DEG),
        None => surrounding_solids(workpiece, tissues),
    };
    (mouth, solids)
}

/// Gingiva and neighbouring teeth as they are touched, world space; without the gingiva under a rubber dam.
pub fn surrounding_solids(workpiece: &Workpiece, tissues: &TissueTable) -> Vec<MeshInstance> {
    workpiece
        .surroundings
        .iter()
        .filter(|shape| is_visible(shape, tissues))
        .filter(|shape| !workpiece.rubber_dam || tissues.role(shape.label) != Some(TissueRole::Soft))
        .map(|s| solid_of_shape(s, workpiece, tissues))
        .collect()
}

/// False for a hidden collider: the floor of a sulcus.
pub(super) fn is_visible(shape: &Collider, tissues: &TissueTable) -> bool {
    let floor = tissues.by_name("attachment").map(|e| e.label());
    !matches!(shape.geometry, ColliderGeometry::Sdf(_)) || Some(shape.label) != floor
}

pub(super) fn solid_of_shape(shape: &Collider, workpiece: &Workpiece, tissues: &TissueTable) -> MeshInstance {
    if let Some(soft) = YieldingSurface::of(shape, workpiece, tissues) {
        return soft.at_rest().clone();
    }
    let colour = tissues.by_label(shape.label).map_or([0.8; 3], |e| e.rgb());
    let mesh = Arc::new(shape_mesh(shape, workpiece));
    let tints = modelled_gum(shape, workpiece).map(|(_, gum)| gum_tints(gum, workpiece, &mesh));
    let is_enamel = tissues.role(shape.label) == Some(TissueRole::Neighbour);
    let gloss = if is_enamel { ENAMEL_GLOSS } else { GLOSS };
    let plain = MeshInstance::plain(mesh, workpiece.world_from_tooth, Appearance { colour, gloss });
    MeshInstance { vertex_tints: Arc::new(tints.unwrap_or_default()), is_enamel, ..plain }
}

/// Gingiva with a modelled margin: its field as it is felt, and its form; `None` for another shape.
fn modelled_gum<'a>(shape: &'a Collider, workpiece: &'a Workpiece) -> Option<(&'a SdfGrid, &'a Periodontium)> {
    match &shape.geometry {
        ColliderGeometry::Sdf(field) => Some((field, workpiece.periodontium.as_ref()?)),
        _ => None,
    }
}

/// Tints of gingiva with a modelled margin: those of the jaw's own gingiva around it.
fn gum_tints(gum: &Periodontium, workpiece: &Workpiece, mesh: &Mesh) -> Vec<VertexTint> {
    let is_upper = workpiece.teeth.first().is_some_and(|tooth| tooth.fdi < 30);
    let jaw = if is_upper { Jaw::Upper } else { Jaw::Lower };
    let middle = gum.middle();
    let tint = |place: &Vec3| {
        let azimuth = gum.azimuth(*place);
        let side = if place.x < middle.x { RidgeSide::Inner } else { RidgeSide::Outer };
        ridge_tint(jaw, side, place.z, [gum.margin(azimuth), gum.neckline(azimuth)], gum.distance_to_tooth(*place))
    };
    mesh.positions.iter().map(|place| vertex_tint(gum_tint(tint(place), *place))).collect()
}

/// A shape's surface in tooth space.
fn shape_mesh(shape: &Collider, workpiece: &Workpiece) -> Mesh {
    if let ColliderGeometry::Voxels(volume) = &shape.geometry {
        let Aabb { low, high } = volume.extent();
        let grid = Grid::covering(low, high, Vec3::splat(SPACING), 2);
        let band = 2.0 * volume.half_band();
        let coarse = Volume::from_distance(grid, 2.0 * SPACING, |p| ((ISO - volume.density_at(p)) * band, Label(1)));
        let mut mesh = surface::extract(&coarse);
        mesh.positions.iter_mut().for_each(|p| *p = shape.tooth_from_collider * *p);
        mesh.normals.iter_mut().for_each(|n| *n = shape.tooth_from_collider.rotate(*n));
        return mesh;
    }
    let middle = shape.tooth_from_collider.position;
    let within = |reach: Vec3| Aabb::around([middle]).grown(reach);
    let Aabb { low, high } = match &shape.geometry {
        ColliderGeometry::Ball { radius } => within(Vec3::splat(*radius)),
        // However it is turned.
        ColliderGeometry::RoundBox { half, .. } if is_upright(shape) => within(*half),
        ColliderGeometry::RoundBox { half, .. } => within(Vec3::splat(half.length())),
        ColliderGeometry::Capsule { half_length, radius } => within(Vec3::splat(half_length + radius)),
        ColliderGeometry::Sdf(field) => field.extent(),
        ColliderGeometry::Mesh(_) | ColliderGeometry::Voxels(_) => workpiece.bounds().grown(Vec3::splat(REACH)),
    };
    let is_drawn_whole = workpiece.own_jaw || workpiece.periodontium.is_some();
    if let ColliderGeometry::Mesh(obstacle) = &shape.geometry
        && is_drawn_whole
    {
        // A jaw of one's own, or a neighbour that was grown: it is as fine as it needs to be.
        let mut mesh = obstacle.mesh();
        mesh.positions.iter_mut().for_each(|p| *p = shape.tooth_from_collider * *p);
        mesh.compute_normals();
        mesh.smooth_normals(SMOOTHING);
        return mesh;
    }
    if let Some((field, gum)) = modelled_gum(shape, workpiece) {
        // As the eye sees it: lying on the tooth. A probe finds it a little off.
        let Aabb { low, high } = field.extent();
        let grid = Grid::covering(low, high, Vec3::splat(GUM_SPACING), 1);
        // At its ends along the arch and below, the gingiva is lowered under the jaw's own, which is a little deeper.
        let dive = |p: Vec3| {
            let inside = (p.y - low.y).min(high.y - p.y).min(p.z - low.z);
            let share = (1.0 - inside / FADE).clamp(0.0, 1.0);
            DIVE * share * share * (3.0 - 2.0 * share)
        };
        let gum_field = SdfGrid::from_fn(grid, Compliance::default(), |p| gum.gum_sdf_visual(p) + dive(p));
        let mut mesh =
            surface::extract(&Volume::from_distance(grid, 2.0 * GUM_SPACING, |p| (gum_field.distance(p), Label(1))));
        mesh.smooth_normals(SMOOTHING);
        return mesh;
    }
    let grid = Grid::covering(low, high, Vec3::splat(SPACING), 3);
    surface::extract(&Volume::from_distance(grid, 2.0 * SPACING, |p| (shape.distance(p), Label(1))))
}

fn is_upright(shape: &Collider) -> bool {
    shape.tooth_from_collider.orientation.w.abs() > 0.9999
}
