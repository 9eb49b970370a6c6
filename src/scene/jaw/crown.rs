//! One crown as triangles: grown as a carved tooth is, coarser, and cut off in the gum.

use super::teeth::{Kind, Model};
use crate::anatomy::{Tissues, grid_of_spacing, grow};
use crate::frame::Vec3;
use crate::mesh::Mesh;
use crate::render::Rgb;
use crate::volume::{Grid, Label, Volume, surface};

/// Distance between samples, mm: cusps and ridges show, the finest grooves as shallow valleys. From 0.45 on edges fray, below 0.3
/// a mouth takes longer to draw than it gains.
const SPACING: f32 = 0.36;

/// Length of root that a crown brings along, mm: it ends out of sight in the gum.
const STUB: f32 = 4.5;

/// How far around a place of the surface matter is looked for, mm: a groove is surrounded by more of it than a cusp.
const AROUND: f32 = 0.9;

/// Share of matter around a place that is flat, and above it until a groove is as dark as can be.
const FLAT: f32 = 0.53;
const DEEPER: f32 = 0.17;

/// What a crown is grown of here: the table of tissues has no say in what is only looked at.
const TISSUES: Tissues = Tissues { enamel: Label(1), dentine: Label(2), pulp: Label(3) };

/// A surface with a colour at each corner.
#[derive(Clone, Debug, Default)]
pub struct Coloured {
    pub mesh: Mesh,
    pub tints: Vec<Rgb>,
}

impl Coloured {
    /// Adds another surface, its corners and normals carried over by a map.
    pub fn add(&mut self, other: &Coloured, point: impl Fn(Vec3) -> Vec3, way: impl Fn(Vec3) -> Vec3, turned: bool) {
        let first = self.mesh.positions.len() as u32;
        self.mesh.positions.extend(other.mesh.positions.iter().map(|p| point(*p)));
        self.mesh.normals.extend(other.mesh.normals.iter().map(|n| way(*n)));
        let corners = |[a, b, c]: [u32; 3]| if turned { [a, c, b] } else { [a, b, c] };
        self.mesh.triangles.extend(other.mesh.triangles.iter().map(|t| corners(t.map(|i| first + i))));
        self.tints.extend(&other.tints);
    }
}

/// Outward normals of the corners, weighted by the area of their triangles.
pub fn smooth_normals(mesh: &mut Mesh) {
    mesh.normals = vec![Vec3::ZERO; mesh.positions.len()];
    for &triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|i| mesh.positions[i as usize]);
        triangle.iter().for_each(|&i| mesh.normals[i as usize] += (b - a).cross(c - a));
    }
    mesh.normals.iter_mut().for_each(|n| *n = n.normalize_or(Vec3::Z));
}

/// A tooth's crown and the beginning of its root, closed, in tooth space; mm.
pub fn crown(model: &Model) -> Coloured {
    let volume = grow(&model.form, above(grid_of_spacing(&model.form, SPACING), -STUB), &TISSUES);
    let mesh = surface::extract(&volume);
    let tints = mesh.positions.iter().map(|p| tint(model, &volume, *p)).collect();
    Coloured { mesh, tints }
}

/// The part of a grid above a height.
fn above(grid: Grid, height: f32) -> Grid {
    let levels = (((height - grid.origin.z) / grid.spacing.z).max(0.0) as u32).min(grid.dims[2] - 1);
    let [nx, ny, nz] = grid.dims;
    let origin = grid.origin + Vec3::Z * (levels as f32 * grid.spacing.z);
    Grid { dims: [nx, ny, nz - levels], origin, ..grid }
}

/// Tints of enamel's colour: warmer toward the neck, where dentine shines through; greyish and clear at an incisor's edge.
const NECK: Rgb = [0.98, 0.93, 0.84];
const ROOT: Rgb = [0.93, 0.83, 0.66];
const EDGE: Rgb = [0.93, 0.95, 0.99];
const DEEP: Rgb = [0.84, 0.75, 0.62];
const CANINE: Rgb = [0.99, 0.975, 0.94];
const PLAIN: Rgb = [1.0; 3];

fn mixed(a: Rgb, b: Rgb, share: f32) -> Rgb {
    let share = share.clamp(0.0, 1.0);
    std::array::from_fn(|c| a[c] + (b[c] - a[c]) * share)
}

fn tint(model: &Model, volume: &Volume, place: Vec3) -> Rgb {
    let sizes = &model.form.sizes;
    let [mesial, distal] = sizes.neckline_rise;
    let rise = if place.y < 0.0 { mesial } else { distal };
    let neckline = rise * place.y * place.y / (place.x * place.x + place.y * place.y + 0.01);
    let body = if model.kind == Kind::Canine { CANINE } else { PLAIN };
    let height = (place.z - neckline) / sizes.crown;
    let on_enamel = mixed(NECK, body, height / 0.45);
    let enamel = match model.kind {
        Kind::Incisor => mixed(on_enamel, EDGE, (height - 0.65) / 0.3),
        Kind::Canine => on_enamel,
        Kind::Premolar | Kind::Molar if height > 0.3 => mixed(on_enamel, DEEP, sunk(volume, place)),
        Kind::Premolar | Kind::Molar => on_enamel,
    };
    // Over a sample's width, so that the neckline is a line and not a stair.
    mixed(ROOT, enamel, 0.5 + (place.z - neckline) / SPACING)
}

/// 0 on flat or bulging places, 1 deep in a groove.
fn sunk(volume: &Volume, place: Vec3) -> f32 {
    const CORNERS: [[f32; 3]; 8] = {
        const S: f32 = 0.577;
        [[S, S, S], [S, S, -S], [S, -S, S], [S, -S, -S], [-S, S, S], [-S, S, -S], [-S, -S, S], [-S, -S, -S]]
    };
    let axes = [Vec3::X, Vec3::Y, Vec3::Z, Vec3::NEG_X, Vec3::NEG_Y, Vec3::NEG_Z];
    let ways = axes.into_iter().chain(CORNERS.map(Vec3::from));
    let matter: f32 = ways.map(|way| volume.density_at(place + way * AROUND)).sum();
    ((matter / 14.0 - FLAT) / DEEPER).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::super::teeth::{LOWER, UPPER};
    use super::*;
    use crate::touch::Obstacle;

    #[test]
    fn every_crown_is_closed_and_as_large_as_the_table_says() {
        // Aim: a closed surface facing outward, of the table's widths and length to a sample's distance.
        for model in UPPER.iter().chain(&LOWER) {
            let Coloured { mesh, tints } = crown(model);
            let sizes = &model.sizes;
            assert!(Obstacle::new(&mesh).is_some(), "{sizes:?} is closed");
            assert!(mesh.volume_mm3() > 50.0, "{sizes:?}");
            assert_eq!(tints.len(), mesh.positions.len());
            let low = mesh.positions.iter().copied().fold(Vec3::INFINITY, Vec3::min);
            let high = mesh.positions.iter().copied().fold(Vec3::NEG_INFINITY, Vec3::max);
            let found = Vec3::new(high.x - low.x, high.y - low.y, high.z);
            let wanted = Vec3::new(sizes.buccolingual[0], sizes.mesiodistal[0], sizes.crown);
            assert!((found - wanted).abs().max_element() < SPACING, "{found} not {wanted}");
            assert!((low.z + STUB).abs() < 2.0 * SPACING, "the root ends at {}", low.z);
        }
    }
}
