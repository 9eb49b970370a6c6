//! Interior of closed triangle meshes, and distances to triangles.
//!
//! The interior is determined by winding numbers along rows of voxels. A row crosses a triangle if, seen along the
//! row, the triangle winds around it. The contribution of each edge is computed from the edge alone, with a half-open
//! rule, so that the two triangles at an edge never disagree. A row through an edge or a corner is therefore no
//! special case, and beyond a closed surface every row has the winding number zero, exactly.

use crate::frame::Vec3;
use crate::volume::Grid;
use glam::{DVec2, DVec3};

/// Corners of a triangle, counter-clockwise seen from outside, mm.
pub type Triangle = [Vec3; 3];

/// Calls `visit` with the array index and the winding number of each voxel whose centre is inside a closed surface.
pub fn for_each_winding(grid: &Grid, triangles: &[Triangle], mut visit: impl FnMut(usize, i32)) {
    let [nx, ny, nz] = grid.dims;
    let (origin, spacing) = (grid.origin.as_dvec3(), grid.spacing.as_dvec3());
    let mut crossings: Vec<(u32, f64, i32)> = Vec::new();
    for triangle in triangles {
        let corners = triangle.map(|corner| (corner.as_dvec3() - origin) / spacing);
        let [low, high] = [corners[0].min(corners[1]).min(corners[2]), corners[0].max(corners[1]).max(corners[2])];
        let rows = |low: f64, high: f64, n: u32| {
            let start = low.ceil().clamp(0.0, f64::from(n)) as u32;
            start..((high.floor() + 1.0).clamp(f64::from(start), f64::from(n)) as u32)
        };
        for z in rows(low.z, high.z, nz) {
            for y in rows(low.y, high.y, ny) {
                if let Some((x, sign)) = crossing(&corners, DVec2::new(y.into(), z.into())) {
                    crossings.push((z * ny + y, x, sign));
                }
            }
        }
    }
    crossings.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    for row in crossings.chunk_by(|a, b| a.0 == b.0) {
        let start = row[0].0 as usize * nx as usize;
        let mut winding = 0;
        for pair in row.windows(2) {
            winding -= pair[0].2;
            if winding != 0 {
                let from = pair[0].1.ceil().clamp(0.0, f64::from(nx)) as usize;
                let to = pair[1].1.ceil().clamp(0.0, f64::from(nx)) as usize;
                (from..to).for_each(|x| visit(start + x, winding));
            }
        }
    }
}

/// Crossing of a triangle by the line along x through a point of the y-z plane: its x coordinate, and the winding
/// number of the triangle around the point as seen from +x.
fn crossing(corners: &[DVec3; 3], place: DVec2) -> Option<(f64, i32)> {
    let [a, b, c] = *corners;
    let winding = edge_winding(a, b, place) + edge_winding(b, c, place) + edge_winding(c, a, place);
    if winding == 0 {
        return None;
    }
    let normal = (b - a).cross(c - a);
    let x = a.x - ((place.x - a.y) * normal.y + (place.y - a.z) * normal.z) / normal.x;
    // A triangle seen almost edge-on gives an uncertain coordinate, which is clamped to the triangle's extent.
    let [low, high] = [a.x.min(b.x).min(c.x), a.x.max(b.x).max(c.x)];
    Some((if x.is_finite() { x.clamp(low, high) } else { low }, winding))
}

/// Contribution of an edge to the winding number around a point: ±1 if the edge passes it on the side of greater y,
/// rising or falling in z.
fn edge_winding(a: DVec3, b: DVec3, place: DVec2) -> i32 {
    if (a.z <= place.y) == (b.z <= place.y) {
        return 0;
    }
    // Computed from the lower end, so that the reversed edge gives the same value to the last bit.
    let (low, high, sign) = if a.z < b.z { (a, b, 1) } else { (b, a, -1) };
    let y = low.y + (place.y - low.z) * ((high.y - low.y) / (high.z - low.z));
    if y > place.x { sign } else { 0 }
}

/// Closed surface that can be queried at any point.
pub struct WindingQuery {
    triangles: Vec<[DVec3; 3]>,
    low: DVec3,
    high: DVec3,
    /// Number of cells of the y-z plane along each side.
    side: usize,
    /// For each cell, the triangles that project onto it.
    triangles_over_cell: Vec<Vec<u32>>,
}

impl WindingQuery {
    pub fn new(triangles: &[Triangle]) -> WindingQuery {
        /// Maximum number of cells along a side. Below it there are about as many cells as triangles.
        const SIDE_MAX: usize = 1024;
        let triangles: Vec<[DVec3; 3]> = triangles.iter().map(|t| t.map(|corner| corner.as_dvec3())).collect();
        let corners = || triangles.iter().flatten().copied();
        let (low, high) =
            (corners().fold(DVec3::INFINITY, DVec3::min), corners().fold(DVec3::NEG_INFINITY, DVec3::max));
        let side = ((triangles.len() as f64).sqrt() as usize).clamp(1, SIDE_MAX);
        let mut solid =
            WindingQuery { triangles: Vec::new(), low, high, side, triangles_over_cell: vec![Vec::new(); side * side] };
        for (index, triangle) in (0u32..).zip(&triangles) {
            let [first, last] = [
                solid.cell(triangle[0].min(triangle[1]).min(triangle[2])),
                solid.cell(triangle[0].max(triangle[1]).max(triangle[2])),
            ];
            for z in first[1]..=last[1] {
                for y in first[0]..=last[0] {
                    solid.triangles_over_cell[z * side + y].push(index);
                }
            }
        }
        solid.triangles = triangles;
        solid
    }

    fn cell(&self, point: DVec3) -> [usize; 2] {
        let size = (self.high - self.low).max(DVec3::splat(1e-9));
        let at = (point - self.low) / size * self.side as f64;
        [at.y, at.z].map(|v| (v.max(0.0) as usize).min(self.side - 1))
    }

    /// Winding number of the surface around a point (mm); 0 outside.
    pub fn winding(&self, point: Vec3) -> i32 {
        let point = point.as_dvec3();
        if point.cmplt(self.low).any() || point.cmpgt(self.high).any() {
            return 0;
        }
        let [y, z] = self.cell(point);
        let place = DVec2::new(point.y, point.z);
        let met = self.triangles_over_cell[z * self.side + y]
            .iter()
            .filter_map(|&n| crossing(&self.triangles[n as usize], place));
        met.filter(|(x, _)| *x > point.x).map(|(_, turn)| turn).sum()
    }
}

/// Reduces `distance`, mm, of all voxels nearer than that to a triangle; voxels farther than `max_distance` are left
/// alone.
pub fn lower_distances(grid: &Grid, triangle: &Triangle, max_distance: f32, distance: &mut [f32]) {
    // Relative to the corner of the grid, where single precision is finest.
    let corners = triangle.map(|corner| corner - grid.origin);
    let low = corners[0].min(corners[1]).min(corners[2]) - max_distance;
    let high = corners[0].max(corners[1]).max(corners[2]) + max_distance;
    let [xs, ys, zs] = grid.cells_within(low + grid.origin, high + grid.origin);
    let facing = TriangleQuery::new(corners);
    for z in zs {
        for y in ys.clone() {
            let row = grid.index([0, y, z]);
            for x in xs.clone() {
                let point = Vec3::new(x as f32, y as f32, z as f32) * grid.spacing;
                let known = &mut distance[row + x as usize];
                if facing.plane_distance(point) < *known {
                    *known = known.min(facing.nearest(point).distance(point));
                }
            }
        }
    }
}

/// Triangle prepared for many distance queries.
struct TriangleQuery {
    corners: [Vec3; 3],
    normal: Vec3,
}

impl TriangleQuery {
    fn new(corners: [Vec3; 3]) -> TriangleQuery {
        let [a, b, c] = corners;
        TriangleQuery { corners, normal: (b - a).cross(c - a).normalize_or_zero() }
    }

    fn plane_distance(&self, point: Vec3) -> f32 {
        (point - self.corners[0]).dot(self.normal).abs()
    }

    /// Nearest point of the triangle, by the regions of Ericson, *Real-Time Collision Detection* (2005), 5.1.5.
    fn nearest(&self, point: Vec3) -> Vec3 {
        let [a, b, c] = self.corners;
        let (ab, ac, ap) = (b - a, c - a, point - a);
        let (d1, d2) = (ab.dot(ap), ac.dot(ap));
        if d1 <= 0.0 && d2 <= 0.0 {
            return a;
        }
        let bp = point - b;
        let (d3, d4) = (ab.dot(bp), ac.dot(bp));
        if d3 >= 0.0 && d4 <= d3 {
            return b;
        }
        let beside_ab = d1 * d4 - d3 * d2;
        if beside_ab <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
            return a + ab * (d1 / (d1 - d3));
        }
        let cp = point - c;
        let (d5, d6) = (ab.dot(cp), ac.dot(cp));
        if d6 >= 0.0 && d5 <= d6 {
            return c;
        }
        let beside_ac = d5 * d2 - d1 * d6;
        if beside_ac <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
            return a + ac * (d2 / (d2 - d6));
        }
        let beside_bc = d3 * d6 - d5 * d4;
        if beside_bc <= 0.0 && d4 >= d3 && d5 >= d6 {
            return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
        }
        let share = 1.0 / (beside_ab + beside_ac + beside_bc);
        a + ab * (beside_ac * share) + ac * (beside_ab * share)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Box with its corners on voxel centres, so that rows of voxels run through edges and corners.
    fn block(low: Vec3, high: Vec3) -> Vec<Triangle> {
        let corner = |n: usize| Vec3::new([low.x, high.x][n & 1], [low.y, high.y][n >> 1 & 1], [low.z, high.z][n >> 2]);
        let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let halves = faces.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]);
        halves.map(|t| t.map(corner)).collect()
    }

    #[test]
    fn rows_through_edges_and_corners_count_every_voxel_once() {
        // Aim: eight boxes that share faces fill space without a gap or a doubled voxel. Method: all their corners
        // lie on voxel centres.
        let grid = Grid { dims: [13, 14, 15], spacing: Vec3::new(0.5, 0.25, 1.0), origin: Vec3::new(-3.0, -1.5, -7.0) };
        let mut times = vec![0; grid.len()];
        let cuts = [grid.centre([1, 2, 2]), grid.centre([5, 6, 8]), grid.centre([11, 12, 13])];
        for n in 0..8usize {
            let pick = |axis: usize, upper: usize| cuts[(n >> axis & 1) + upper][axis];
            let [low, high] = [0, 1].map(|upper| Vec3::new(pick(0, upper), pick(1, upper), pick(2, upper)));
            for_each_winding(&grid, &block(low, high), |index, winding| times[index] += winding);
        }
        assert!(times.iter().all(|&n| n == 0 || n == 1));
        assert_eq!(times.iter().sum::<i32>(), 10 * 10 * 11);
    }

    #[test]
    fn a_point_is_inside_as_often_as_it_is_wound_around() {
        let mut triangles = block(Vec3::ZERO, Vec3::splat(3.0));
        triangles.extend(block(Vec3::ONE, Vec3::splat(4.0)));
        triangles.extend(block(Vec3::splat(0.2), Vec3::splat(0.6)).into_iter().map(|[a, b, c]| [a, c, b]));
        let solid = WindingQuery::new(&triangles);
        for (at, expected) in [(0.1, 1), (0.4, 0), (0.8, 1), (2.0, 2), (3.5, 1), (4.5, 0), (-0.5, 0)] {
            assert_eq!(solid.winding(Vec3::splat(at) + Vec3::new(0.0, 0.03, 0.01)), expected, "{at}");
        }
    }

    #[test]
    fn distances_to_triangles_equal_a_search_over_their_points() {
        let grid = Grid::centred([17, 15, 13], Vec3::splat(0.25));
        let triangle = [Vec3::new(-0.7, -0.3, 0.1), Vec3::new(0.9, -0.2, -0.4), Vec3::new(0.1, 0.8, 0.5)];
        let mut distance = vec![1.0; grid.len()];
        lower_distances(&grid, &triangle, 1.0, &mut distance);
        for (index, cell) in grid.cells().enumerate() {
            let point = grid.centre(cell);
            let mut least = 1.0f32;
            for i in 0..=60 {
                for j in 0..=60 - i {
                    let (u, v) = (i as f32 / 60.0, j as f32 / 60.0);
                    let on = triangle[0] * (1.0 - u - v) + triangle[1] * u + triangle[2] * v;
                    least = least.min(on.distance(point));
                }
            }
            assert!((distance[index] - least).abs() < 0.02, "{cell:?}: {} for {least}", distance[index]);
        }
    }
}
