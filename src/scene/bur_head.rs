//! Cutting heads of burs as they are drawn: blades of steel and carbide, grains of diamond.
//!
//! Takes the outline of the part that cuts, as it is felt. No part of the drawn head is outside it. The forms of blades and
//! grains were chosen by eye.

use std::f32::consts::TAU;
use typodont_core::frame::Vec3;
use typodont_core::mesh::Mesh;
use typodont_exercise::catalog::{InstrumentEntry, ToolKind};
use typodont_render::Rgb;

/// Greatest height of a row of vertices, mm, so that twisted blades are smooth.
const ROW: f32 = 0.2;

/// Depth of the flutes between blades, as a share of the radius, and rotation of the blades along one radius of height, rad.
const FLUTE: f32 = 0.17;
const TWIST: f32 = 0.35;

/// Section of a blade: place from its cutting edge to the next one's, as a share, and radius there, as a share of the flute's
/// depth from the edge down: the back falls slowly, the face rises steeply.
const SECTION: [[f32; 2]; 6] = [[0.0, 0.0], [0.2, 0.25], [0.4, 0.55], [0.6, 0.85], [0.75, 1.0], [1.0, 0.0]];

/// Radius up to which a bur has six blades instead of eight, mm.
const SLIM: f32 = 0.55;

/// Columns of grains around a diamond, and the depth between them, as a share of the radius.
const GRAINS: usize = 44;
const GRAIN_DEPTH: f32 = 0.05;

/// Colour of a diamond's grains and of the nickel between them, as shares of that of steel.
const GRAIN_TINTS: [Rgb; 2] = [[1.15, 1.1, 1.0], [0.62, 0.58, 0.5]];

/// Mesh of a cutting head, with a tint for each vertex: a bur without a kind has blades. `outline`: radius and height, from the tip upward, mm.
pub fn cutting_head(entry: &InstrumentEntry, outline: &[[f32; 2]]) -> (Mesh, Vec<Rgb>) {
    let rows = with_rows(outline);
    match entry.kind {
        Some(ToolKind::DiamondBur) => grains(&rows),
        _ => {
            let mesh = blades(&rows);
            let count = mesh.positions.len();
            (mesh, vec![[1.0; 3]; count])
        }
    }
}

/// The outline with further places where its own are far apart.
fn with_rows(outline: &[[f32; 2]]) -> Vec<[f32; 2]> {
    let mut rows = Vec::new();
    for pair in outline.windows(2) {
        let [[r0, z0], [r1, z1]] = [pair[0], pair[1]];
        let count = (libm::hypotf(r1 - r0, z1 - z0) / ROW).ceil().max(1.0) as usize;
        rows.extend((0..count).map(|i| {
            let share = i as f32 / count as f32;
            [r0 + (r1 - r0) * share, z0 + (z1 - z0) * share]
        }));
    }
    rows.extend(outline.last());
    rows
}

/// Blades, each with vertices of its own, so that its cutting edge is sharp.
fn blades(rows: &[[f32; 2]]) -> Mesh {
    let widest = rows.iter().map(|row| row[0]).fold(0.0, f32::max);
    let count = if widest > SLIM { 8 } else { 6 };
    let place = |blade: usize, [share, depth]: [f32; 2], [radius, height]: [f32; 2]| {
        let angle = TAU * (blade as f32 + share) / count as f32 + TWIST * height / widest.max(0.1);
        let radius = radius * (1.0 - FLUTE * depth);
        Vec3::new(radius * libm::cosf(angle), radius * libm::sinf(angle), height)
    };
    let mut mesh = Mesh::default();
    for blade in 0..count {
        let columns: Vec<Vec<Vec3>> =
            SECTION.iter().map(|&part| rows.iter().map(|&row| place(blade, part, row)).collect()).collect();
        mesh.append(sheet(&columns));
    }
    mesh
}

/// Grains that stand out of the metal that holds them.
fn grains(rows: &[[f32; 2]]) -> (Mesh, Vec<Rgb>) {
    let height_of = |row: usize, column: usize| noise(row as u32, (column % GRAINS) as u32);
    let columns: Vec<Vec<Vec3>> = (0..=GRAINS)
        .map(|column| {
            let angle = TAU * column as f32 / GRAINS as f32;
            let place = |(row, &[radius, height]): (usize, &[f32; 2])| {
                let radius = radius * (1.0 - GRAIN_DEPTH * (1.0 - height_of(row, column)));
                Vec3::new(radius * libm::cosf(angle), radius * libm::sinf(angle), height)
            };
            rows.iter().enumerate().map(place).collect()
        })
        .collect();
    let tint = |column: usize, row: usize| {
        let share = height_of(row, column);
        std::array::from_fn(|c| GRAIN_TINTS[1][c] + (GRAIN_TINTS[0][c] - GRAIN_TINTS[1][c]) * share)
    };
    let tints = (0..=GRAINS).flat_map(|column| (0..rows.len()).map(move |row| tint(column, row))).collect();
    (sheet(&columns), tints)
}

/// Columns of places as a surface, counter-clockwise seen from the side toward which the next column and the next row turn.
fn sheet(columns: &[Vec<Vec3>]) -> Mesh {
    let rows = columns[0].len() as u32;
    let mut mesh = Mesh { positions: columns.concat(), ..Mesh::default() };
    for column in 0..columns.len() as u32 - 1 {
        for row in 0..rows - 1 {
            let [a, b] = [column * rows + row, (column + 1) * rows + row];
            mesh.triangles.extend([[a, b, a + 1], [b, b + 1, a + 1]]);
        }
    }
    mesh.compute_normals();
    mesh
}

/// Random value of a grain, 0 to 1.
fn noise(row: u32, column: u32) -> f32 {
    let mut hash = row.wrapping_mul(0x9E37_79B1) ^ column.wrapping_mul(0x85EB_CA77).rotate_left(13);
    hash = (hash ^ hash >> 15).wrapping_mul(0x2C1B_3C6D);
    (hash >> 8) as f32 / (1u32 << 24) as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use typodont_exercise::catalog::InstrumentTable;
    use typodont_formats::Library;

    #[test]
    fn a_drawn_head_is_as_wide_as_the_felt_one_and_faces_outward() {
        // Method: a cylinder and a flame of every kind; each vertex lies within the outline, some on it, and the surface encloses
        // most of it.
        let table = InstrumentTable::read(&Library::shipped()).unwrap();
        let cylinder = vec![[0.0, 0.0], [0.6, 0.0], [0.6, 2.0], [0.0, 2.0]];
        let flame = vec![[0.0, 0.0], [0.4, 1.0], [0.6, 2.0], [0.0, 4.0]];
        let volume = |outline: &[[f32; 2]]| -> f64 {
            let cone = |p: &[[f32; 2]]| {
                let [[r0, z0], [r1, z1]] = [p[0], p[1]];
                f64::from((z1 - z0) * (r0 * r0 + r0 * r1 + r1 * r1) / 3.0)
            };
            std::f64::consts::PI * outline.windows(2).map(cone).sum::<f64>()
        };
        for name in ["round_bur_014", "diamond_round_014", "carbide_round_014"] {
            for outline in [&cylinder, &flame] {
                let (mesh, tints) = cutting_head(table.by_id(name).unwrap(), outline);
                assert_eq!(tints.len(), mesh.positions.len());
                let radii = mesh.positions.iter().map(|p| p.truncate().length());
                let widest = radii.fold(0.0, f32::max);
                assert!((0.59..0.6001).contains(&widest), "{name}: {widest}");
                let share = mesh.volume_mm3() / volume(outline);
                assert!((0.7..1.0).contains(&share), "{name}: {share}");
            }
        }
    }
}
