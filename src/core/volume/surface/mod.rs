//! Triangulated isosurface at density 0.5.
//!
//! Takes a volume, one of its bricks, or any set of voxels. Gives closed meshes in tooth space, mm, with
//! counter-clockwise triangles facing outward and normals from the smooth gradient. Never leaves a hole: space beyond
//! the grid counts as empty.
//!
//! Method: Lorensen & Cline, *Marching Cubes* (1987), with the case table derived in `cases`.

mod cases;
mod mask;

pub use mask::{of_mask, volume_of_mask};

use crate::frame::Vec3;
use crate::mesh::Mesh;
use crate::volume::{BRICK, CellBox, Density, Grid, Volume};
use cases::{CASES, CELL_EDGES, CellEdge, CubeCase, EdgeIndex};

/// Extracts the whole surface.
pub fn extract(volume: &Volume) -> Mesh {
    let Some(CellBox { low, high }) = volume.bounding_box() else { return Mesh::default() };
    let cells = CellRange { low: low.map(|v| v as i32 - 1), end: high.map(|v| v as i32 + 1) };
    extract_cells(DensityGrid { grid: volume.grid(), densities: volume.densities() }, cells)
}

/// Extracts the part of the surface that belongs to a brick. All bricks together give the whole surface; vertices are
/// shared within a brick only.
pub fn extract_brick(volume: &Volume, brick: usize) -> Mesh {
    let corner = volume.bricks().corner(brick).map(|v| v as i32);
    let dims = volume.grid().dims.map(|n| n as i32);
    // The first brick also closes the surface at the lower border of the grid.
    let low = corner.map(|v| if v == 0 { -1 } else { v });
    let end = std::array::from_fn(|a| (corner[a] + BRICK as i32).min(dims[a]));
    extract_cells(DensityGrid { grid: volume.grid(), densities: volume.densities() }, CellRange { low, end })
}

/// Bricks whose part of the surface may change when the `dirty` bricks change: those and their neighbours, in
/// ascending order.
pub fn dirty_neighbourhood(volume: &Volume, dirty: &[usize]) -> Vec<usize> {
    let bricks = volume.bricks();
    let dims = bricks.dims();
    let mut found: Vec<usize> = Vec::new();
    for &brick in dirty {
        let at = bricks.corner(brick).map(|v| v / BRICK);
        let span = |a: usize| at[a].saturating_sub(1)..=(at[a] + 1).min(dims[a] - 1);
        for z in span(2) {
            for y in span(1) {
                found.extend(span(0).map(|x| bricks.index([x, y, z])));
            }
        }
    }
    found.sort_unstable();
    found.dedup();
    found
}

/// Densities on a grid, zero beyond it.
#[derive(Clone, Copy)]
struct DensityGrid<'a> {
    grid: &'a Grid,
    densities: &'a [Density],
}

impl DensityGrid<'_> {
    fn at(&self, sample: [i32; 3]) -> f32 {
        let is_inside = (0..3).all(|a| sample[a] >= 0 && (sample[a] as u32) < self.grid.dims[a]);
        if is_inside { self.densities[self.grid.index(sample.map(|v| v as u32))].unit() } else { 0.0 }
    }

    /// Density and gradient (central differences per mm) at both ends of the edge from a sample along an axis.
    fn edge_samples(&self, start: [i32; 3], axis: usize) -> [(f32, Vec3); 2] {
        let end = shifted_sample(start, axis, 1);
        let last = self.grid.dims.map(|n| n as i32 - 1);
        let is_within = (0..3).all(|a| start[a] > 0 && end[a] < last[a]);
        if !is_within {
            return [start, end].map(|sample| {
                let along =
                    |axis: usize| self.at(shifted_sample(sample, axis, 1)) - self.at(shifted_sample(sample, axis, -1));
                (self.at(sample), self.per_mm(Vec3::new(along(0), along(1), along(2))))
            });
        }
        // No neighbour lies beyond the grid, so array offsets can be used.
        let [nx, ny, _] = self.grid.dims.map(|n| n as usize);
        let steps = [1, nx, nx * ny];
        let first = self.grid.index(start.map(|v| v as u32));
        let unit = |place: usize| self.densities[place].unit();
        [first, first + steps[axis]].map(|place| {
            let across = Vec3::new(
                unit(place + 1) - unit(place - 1),
                unit(place + nx) - unit(place - nx),
                unit(place + nx * ny) - unit(place - nx * ny),
            );
            (unit(place), self.per_mm(across))
        })
    }

    fn per_mm(&self, across: Vec3) -> Vec3 {
        0.5 * across / self.grid.spacing
    }

    /// Sets one bit per sample of a row: 1 if solid.
    fn row(&self, low: i32, y: i32, z: i32, bits: &mut [u64], count: usize) {
        bits.fill(0);
        let [nx, ny, nz] = self.grid.dims.map(|n| n as i32);
        if y < 0 || z < 0 || y >= ny || z >= nz {
            return;
        }
        let row = self.grid.index([0, y as u32, z as u32]);
        let first = low.max(0);
        let last = (low + count as i32).min(nx);
        let values = &self.densities[row + first as usize..row + last as usize];
        let mut at = (first - low) as usize;
        let (eights, rest) = values.as_chunks::<8>();
        for eight in eights {
            let solid = solid_bits(eight);
            bits[at / 64] |= solid << (at % 64);
            if at % 64 > 56 {
                bits[at / 64 + 1] |= solid >> (64 - at % 64);
            }
            at += 8;
        }
        for density in rest {
            bits[at / 64] |= u64::from(density.is_solid()) << (at % 64);
            at += 1;
        }
    }
}

/// One bit per density: its highest bit, gathered by one multiplication.
fn solid_bits(eight: &[Density; 8]) -> u64 {
    let highest = u64::from_le_bytes(eight.map(Density::bits)) & 0x8080_8080_8080_8080;
    (highest >> 7).wrapping_mul(0x0102_0408_1020_4080) >> 56
}

fn shifted_sample(mut sample: [i32; 3], axis: usize, steps: i32) -> [i32; 3] {
    sample[axis] += steps;
    sample
}

/// Range of cells of eight samples each, by their lowest sample: from `low` up to, but excluding, `end`.
#[derive(Clone, Copy)]
struct CellRange {
    low: [i32; 3],
    end: [i32; 3],
}

/// Extracts the surface within a range of cells. Cells without a surface cost a fraction of an instruction each.
fn extract_cells(field: DensityGrid, cells: CellRange) -> Mesh {
    let CellRange { low, end } = cells;
    if (0..3).any(|a| low[a] >= end[a]) {
        return Mesh::default();
    }
    let mut builder = MeshBuilder::new(field, cells);
    let [nx, ny, _] = builder.samples;
    let words = nx.div_ceil(64) + 1;
    let mut planes = [vec![0u64; words * ny], vec![0u64; words * ny]];
    let fill = |plane: &mut [u64], z: i32| {
        for (bits, y) in plane.chunks_exact_mut(words).zip(low[1]..) {
            field.row(low[0], y, z, bits, nx);
        }
    };
    fill(&mut planes[0], low[2]);
    for z in low[2]..end[2] {
        fill(&mut planes[1], z + 1);
        for y in 0..ny - 1 {
            let row = |plane: usize, y: usize| &planes[plane][y * words..(y + 1) * words];
            let rows = [row(0, y), row(0, y + 1), row(1, y), row(1, y + 1)];
            for word in 0..words - 1 {
                let mut crossed = crossed_cells(&rows, word);
                while crossed != 0 {
                    let x = word * 64 + crossed.trailing_zeros() as usize;
                    crossed &= crossed - 1;
                    if x + 1 < nx {
                        builder.cell([low[0] + x as i32, low[1] + y as i32, z], case_of_cell(&rows, x));
                    }
                }
            }
        }
        planes.swap(0, 1);
    }
    builder.mesh
}

/// Bit mask of the cells, of 64 in a row, that have both solid and empty corners.
fn crossed_cells(rows: &[&[u64]; 4], word: usize) -> u64 {
    let both = |join: fn(u64, u64) -> u64, i: usize| rows.iter().map(|r| r[i]).reduce(join).unwrap_or(0);
    let (any, any_next) = (both(|a, b| a | b, word), both(|a, b| a | b, word + 1));
    let (all, all_next) = (both(|a, b| a & b, word), both(|a, b| a & b, word + 1));
    let after = |bits: u64, next: u64| (bits >> 1) | (next << 63);
    (any | after(any, any_next)) & !(all & after(all, all_next))
}

/// Solid corners of a cell, one bit each, x fastest.
fn case_of_cell(rows: &[&[u64]; 4], x: usize) -> usize {
    let (word, shift) = (x / 64, x % 64);
    let pair = |row: &[u64]| {
        let next = if shift == 63 { row[word + 1] << 1 } else { 0 };
        (((row[word] >> shift) | next) & 3) as usize
    };
    pair(rows[0]) | pair(rows[1]) << 2 | pair(rows[2]) << 4 | pair(rows[3]) << 6
}

/// Creates each vertex once, and the triangles, cell by cell in array order.
struct MeshBuilder<'a> {
    field: DensityGrid<'a>,
    cases: &'static [CubeCase],
    low: [i32; 3],
    samples: [usize; 3],
    /// Vertices on the edges from each sample along each axis, for two alternating layers of samples.
    vertex: Vec<[u32; 3]>,
    mesh: Mesh,
}

impl<'a> MeshBuilder<'a> {
    fn new(field: DensityGrid<'a>, cells: CellRange) -> MeshBuilder<'a> {
        let samples: [usize; 3] = std::array::from_fn(|a| (cells.end[a] - cells.low[a]) as usize + 1);
        let vertex = vec![[0; 3]; 2 * samples[0] * samples[1]];
        MeshBuilder { field, cases: &CASES, low: cells.low, samples, vertex, mesh: Mesh::default() }
    }

    #[inline]
    fn cell(&mut self, cell: [i32; 3], case: usize) {
        let [x, y, z]: [usize; 3] = std::array::from_fn(|a| (cell[a] - self.low[a]) as usize);
        let [nx, ny, _] = self.samples;
        let layers = [z % 2, 1 - z % 2].map(|layer| (layer * ny + y) * nx + x);
        let at_low = u8::from(x == 0) | u8::from(y == 0) << 1 | u8::from(z == 0) << 2;
        let mut vertices = [0; 12];
        let case = &self.cases[case];
        for edge in case.edges.iter().map(|edge| usize::from(edge.0)) {
            let CellEdge { axis, start, low_sides: before } = CELL_EDGES[edge];
            let slot = layers[start[2]] + start[1] * nx + start[0];
            // The first cell with this edge creates its vertex.
            if before & !at_low == 0 {
                let start = std::array::from_fn(|a| cell[a] + start[a] as i32);
                self.vertex[slot][axis] = self.add_vertex(start, axis);
            }
            vertices[edge] = self.vertex[slot][axis];
        }
        let corner = |edge: &EdgeIndex| vertices[usize::from(edge.0)];
        self.mesh.triangles.extend(case.triangles.iter().map(|t| [corner(&t[0]), corner(&t[1]), corner(&t[2])]));
    }

    fn add_vertex(&mut self, start: [i32; 3], axis: usize) -> u32 {
        let [(from, slope_from), (to, slope_to)] = self.field.edge_samples(start, axis);
        let part = (crate::volume::ISO - from) / (to - from);
        let mut steps = Vec3::from(start.map(|v| v as f32));
        steps[axis] += part;
        let slope = slope_from.lerp(slope_to, part);
        // If the gradient vanishes, the edge gives the outward direction.
        let out_along_edge = Vec3::AXES[axis] * (from - to).signum();
        self.mesh.positions.push(self.field.grid.origin + steps * self.field.grid.spacing);
        self.mesh.normals.push((-slope).try_normalize().unwrap_or(out_along_edge));
        self.mesh.positions.len() as u32 - 1
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::{Label, Voxel, phantom};
    use super::*;
    use std::collections::BTreeMap;

    /// Returns true if each directed edge occurs once and so does its reverse.
    pub fn is_watertight(mesh: &Mesh) -> bool {
        let mut edges: BTreeMap<[u32; 2], u32> = BTreeMap::new();
        for &[a, b, c] in &mesh.triangles {
            for edge in [[a, b], [b, c], [c, a]] {
                *edges.entry(edge).or_default() += 1;
            }
        }
        edges.iter().all(|(&[a, b], &n)| n == 1 && edges.get(&[b, a]) == Some(&1))
    }

    fn area(mesh: &Mesh) -> f64 {
        let at = |i: u32| mesh.positions[i as usize].as_dvec3();
        mesh.triangles.iter().map(|&[a, b, c]| 0.5 * (at(b) - at(a)).cross(at(c) - at(a)).length()).sum()
    }

    /// Volume of random densities, in which every case of a cell occurs.
    fn noise() -> Volume {
        let grid = Grid::centred([30, 29, 28], Vec3::ONE);
        let mut state = 7u32;
        let mut random = || {
            state = state.wrapping_mul(1664525).wrapping_add(1013904223);
            Density::from_bits((state >> 24) as u8)
        };
        let density: Vec<Density> = (0..grid.len()).map(|_| random()).collect();
        let label = vec![Label(1); grid.len()];
        Volume::new(grid, 1.0, density, label, Label(1))
    }

    #[test]
    fn a_ball_has_the_volume_area_and_normals_of_a_ball() {
        let volume = phantom::ball([90, 60, 75], Vec3::new(0.1, 0.15, 0.12), 3.0);
        let mesh = extract(&volume);
        let radius = 3.0f64;
        let expected = 4.0 / 3.0 * std::f64::consts::PI * radius.powi(3);
        assert!((mesh.volume_mm3() / expected - 1.0).abs() < 0.01, "{} mm³", mesh.volume_mm3());
        let expected = 4.0 * std::f64::consts::PI * radius.powi(2);
        assert!((area(&mesh) / expected - 1.0).abs() < 0.02, "{} mm²", area(&mesh));
        assert!(is_watertight(&mesh));
        for (position, normal) in mesh.positions.iter().zip(&mesh.normals) {
            assert!((normal.length() - 1.0).abs() < 1e-3);
            assert!(normal.angle_between(*position) < 0.05, "{normal} at {position}");
        }
    }

    #[test]
    fn whatever_the_voxels_hold_the_surface_is_closed() {
        // Aim: no hole and no doubled edge, even where cells are ambiguous and where matter touches the border of the
        // grid.
        let mesh = extract(&noise());
        assert!(mesh.triangles.len() > 20_000);
        assert!(is_watertight(&mesh));
    }

    #[test]
    fn the_bricks_together_are_the_whole() {
        let volume = noise();
        let whole = extract(&volume);
        let bricks: Vec<Mesh> = (0..volume.bricks().len()).map(|b| extract_brick(&volume, b)).collect();
        assert_eq!(bricks.iter().map(|m| m.triangles.len()).sum::<usize>(), whole.triangles.len());
        let corners = |mesh: &Mesh| -> Vec<[[u32; 3]; 3]> {
            let at = |i: u32| mesh.positions[i as usize].to_array().map(f32::to_bits);
            mesh.triangles.iter().map(|t| t.map(at)).collect()
        };
        let mut parts: Vec<_> = bricks.iter().flat_map(corners).collect();
        let mut all = corners(&whole);
        parts.sort_unstable();
        all.sort_unstable();
        assert!(parts == all);
    }

    #[test]
    fn only_affected_bricks_look_different_after_a_cut() {
        let mut volume = phantom::ball([64, 64, 64], Vec3::splat(0.2), 5.0);
        let before: Vec<Mesh> = (0..volume.bricks().len()).map(|b| extract_brick(&volume, b)).collect();
        for z in 50..62 {
            volume.set_cell([32, 32, z], Voxel::AIR);
        }
        let dirty = volume.take_dirty();
        let affected = dirty_neighbourhood(&volume, &dirty);
        for (index, before) in before.iter().enumerate() {
            assert!(affected.contains(&index) || *before == extract_brick(&volume, index), "brick {index}");
        }
    }
}
