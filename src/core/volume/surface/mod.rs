//! Triangulated isosurface at density 0.5.
//!
//! Takes a volume, one of its bricks, or any set of voxels. Gives closed meshes in tooth space, mm, with
//! counter-clockwise triangles facing outward and normals from the smooth gradient. Never leaves a hole: space beyond
//! the grid counts as empty.
//!
//! Method: Lorensen & Cline, *Marching Cubes* (1987), with the case table derived in `cases`; where it is drawn, with
//! one more vertex in cells that a sharp edge crosses (`sharp_edges`).

mod cases;
mod density_grid;
mod mask;
mod planes;
mod sharp_edges;

pub use mask::{of_mask, volume_of_mask};

use crate::mesh::Mesh;
use crate::volume::{BRICK, Volume};
use cases::{CASES, CELL_EDGES, CellEdge, CubeCase, EdgeIndex};
use density_grid::{CellRange, Crossing, DensityGrid};
use sharp_edges::{Outline, SharpEdges};
use std::collections::BTreeMap;

/// Extracts the whole surface.
pub fn extract(volume: &Volume) -> Mesh {
    let Some(cells) = CellRange::around_matter(volume) else { return Mesh::default() };
    extract_cells(DensityGrid::of(volume), cells, None)
}

/// Extracts the whole surface as it is drawn: with sharp edges, and with the normals of a smoothed copy of the volume.
pub fn extract_sharp(volume: &Volume, smoothed: &Volume) -> Mesh {
    let Some(cells) = CellRange::around_matter(volume) else { return Mesh::default() };
    extract_cells(DensityGrid::of(volume), cells, Some(SharpEdges::new(volume, smoothed, &cells)))
}

/// Extracts the part of the surface as it is drawn that belongs to a brick. All bricks together give the whole surface;
/// vertices are shared within a brick only.
pub fn extract_brick(volume: &Volume, smoothed: &Volume, brick: usize) -> Mesh {
    let corner = volume.bricks().corner(brick).map(|v| v as i32);
    let dims = volume.grid().dims.map(|n| n as i32);
    // The first brick also closes the surface at the lower border of the grid.
    let low = corner.map(|v| if v == 0 { -1 } else { v });
    let end = std::array::from_fn(|a| (corner[a] + BRICK as i32).min(dims[a]));
    let cells = CellRange { low, end };
    extract_cells(DensityGrid::of(volume), cells, Some(SharpEdges::new(volume, smoothed, &cells)))
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

/// Extracts the surface within a range of cells. Cells without a surface cost a fraction of an instruction each.
fn extract_cells(field: DensityGrid, cells: CellRange, edges: Option<SharpEdges>) -> Mesh {
    let CellRange { low, end } = cells;
    if (0..3).any(|a| low[a] >= end[a]) {
        return Mesh::default();
    }
    let mut builder = MeshBuilder::new(field, cells, edges);
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
    /// For each vertex, true if a sharp edge is near; empty where edges are not sought.
    is_at_edge: Vec<bool>,
    edges: Option<SharpEdges<'a>>,
    /// Numbers of the vertices on sharp edges.
    edge_vertices: BTreeMap<Outline, u32>,
}

impl<'a> MeshBuilder<'a> {
    fn new(field: DensityGrid<'a>, cells: CellRange, edges: Option<SharpEdges<'a>>) -> MeshBuilder<'a> {
        let samples: [usize; 3] = std::array::from_fn(|a| (cells.end[a] - cells.low[a]) as usize + 1);
        let vertex = vec![[0; 3]; 2 * samples[0] * samples[1]];
        let (mesh, is_at_edge) = (Mesh::default(), Vec::new());
        MeshBuilder {
            field,
            cases: &CASES,
            low: cells.low,
            samples,
            vertex,
            mesh,
            is_at_edge,
            edges,
            edge_vertices: BTreeMap::new(),
        }
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
        if self.edges.is_some() && case.edges.iter().any(|e| self.is_at_edge[vertices[usize::from(e.0)] as usize]) {
            return self.cell_with_edges(cell, case, &vertices);
        }
        let corner = |edge: &EdgeIndex| vertices[usize::from(edge.0)];
        self.mesh.triangles.extend(case.triangles.iter().map(|t| [corner(&t[0]), corner(&t[1]), corner(&t[2])]));
    }

    fn add_vertex(&mut self, start: [i32; 3], axis: usize) -> u32 {
        let (crossing, is_at_edge) = match &mut self.edges {
            Some(edges) => edges.crossing(&self.field, start, axis),
            None => (self.field.crossing(start, axis), false),
        };
        self.push(crossing, is_at_edge)
    }

    fn push(&mut self, Crossing { position, normal }: Crossing, is_at_edge: bool) -> u32 {
        self.mesh.positions.push(position);
        self.mesh.normals.push(normal);
        if self.edges.is_some() {
            self.is_at_edge.push(is_at_edge);
        }
        self.mesh.positions.len() as u32 - 1
    }

    /// The surface in a cell near a sharp edge: each outline that an edge crosses is a fan around a vertex on that edge.
    /// The cell that comes later joins its vertex with that of a cell before, if the edge goes on there.
    #[cold]
    fn cell_with_edges(&mut self, cell: [i32; 3], case: &'static CubeCase, vertices: &[u32; 12]) {
        let vertex = |edge: EdgeIndex| vertices[usize::from(edge.0)];
        for (number, ring) in case.rings.iter().enumerate() {
            let Some(apex) = self.edge_vertex((cell, number), case) else {
                let own = case.triangles.iter().filter(|t| ring.contains(&t[0]));
                self.mesh.triangles.extend(own.map(|t| t.map(vertex)));
                continue;
            };
            for line in sharp_edges::lines(ring) {
                let face = line[0].shared_face(line[1]).expect("a line lies on a face");
                let beyond = sharp_edges::outline_beyond(&self.field, cell, ring, line, face)
                    .and_then(|(outline, case)| Some((outline, self.edge_vertex(outline, case)?)));
                let [a, b] = line.map(vertex);
                match beyond {
                    None => {
                        let apex = self.number((cell, number), apex);
                        self.mesh.triangles.push([a, b, apex]);
                    }
                    Some((outline, beyond)) if face.side == 0 => {
                        let apex = self.number((cell, number), apex);
                        let beyond = self.number(outline, beyond);
                        self.mesh.triangles.extend([[a, beyond, apex], [beyond, b, apex]]);
                    }
                    Some(_) => {}
                }
            }
        }
    }

    /// The vertex on the sharp edge that crosses an outline.
    fn edge_vertex(&mut self, outline: Outline, case: &'static CubeCase) -> Option<Crossing> {
        self.edges.as_mut()?.vertex(&self.field, outline, case)
    }

    /// Number of an edge's vertex in the mesh, to which it is added when it is first used.
    fn number(&mut self, outline: Outline, vertex: Crossing) -> u32 {
        if let Some(&known) = self.edge_vertices.get(&outline) {
            return known;
        }
        let number = self.push(vertex, true);
        self.edge_vertices.insert(outline, number);
        number
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::{Density, Grid, Label, Voxel, phantom};
    use super::*;
    use crate::frame::Vec3;
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
        let noise = noise();
        for mesh in [extract(&noise), extract_sharp(&noise, &noise)] {
            assert!(mesh.triangles.len() > 20_000);
            assert!(is_watertight(&mesh));
        }
    }

    #[test]
    fn the_bricks_together_are_the_whole() {
        for volume in [noise(), notched_ball()] {
            compare_bricks_with_whole(&volume);
        }
    }

    /// A ball with a round groove of sharp edges.
    fn notched_ball() -> Volume {
        let grid = Grid::centred([64; 3], Vec3::splat(0.1));
        Volume::from_distance(grid, 0.15, |p| ((p.length() - 2.5).max(0.6 - p.x.hypot(p.z - 2.4)), Label(1)))
    }

    fn compare_bricks_with_whole(volume: &Volume) {
        let whole = extract_sharp(volume, volume);
        let bricks: Vec<Mesh> = (0..volume.bricks().len()).map(|b| extract_brick(volume, volume, b)).collect();
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
        let mut volume = notched_ball();
        let before: Vec<Mesh> = (0..volume.bricks().len()).map(|b| extract_brick(&volume, &volume, b)).collect();
        for z in 40..58 {
            volume.set_cell([32, 32, z], Voxel::AIR);
        }
        let dirty = volume.take_dirty();
        let affected = dirty_neighbourhood(&volume, &dirty);
        for (index, before) in before.iter().enumerate() {
            assert!(affected.contains(&index) || *before == extract_brick(&volume, &volume, index), "brick {index}");
        }
    }
}
