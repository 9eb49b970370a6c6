//! Solid sampled as signed distances on a grid: a working end without a formula.
//!
//! Takes a volume, or closed triangles. Gives signed distances, normals and the surface, in the space of the grid.

use super::closed_mesh::TriangleTree;
use crate::aabb::Aabb;
use crate::frame::Vec3;
use crate::mesh::Mesh;
use crate::parallel::par_map;
use crate::volume::solid::{Triangle, for_each_winding};
use crate::volume::{CellBox, Grid, ISO, Label, Volume, density_at_distance, distance, redistance, surface};
use std::collections::VecDeque;

/// Solid that lies within its grid, or is cut off at its border.
#[derive(Clone, Debug, PartialEq)]
pub struct SampledShape {
    grid: Grid,
    /// Signed distances, mm; negative inside.
    distances: Vec<f32>,
}

/// Distance from the surface within which the nearest triangle is searched for each point, voxels; farther away it is one
/// of those of the neighbouring points.
const SEARCH_WITHIN: f32 = 1.5;

impl SampledShape {
    /// Samples the solid part of a volume.
    pub fn of_volume(volume: &Volume) -> SampledShape {
        let grid = *volume.grid();
        let far = distance::signed(&grid, |i| volume.densities()[i].is_solid());
        // Near the surface the density ramp gives the distance more accurately than whole voxels do.
        let near = |i: usize| (ISO - volume.densities()[i].unit()) * 2.0 * volume.half_band();
        let is_near_surface = |i: usize| (0.02..0.98).contains(&volume.densities()[i].unit());
        let distances =
            far.iter().enumerate().map(|(i, &far)| if is_near_surface(i) { near(i) } else { far }).collect();
        SampledShape { grid, distances }
    }

    /// Samples the inside of closed triangles that face outward. `None` if it contains no point of the grid.
    pub fn of_triangles(grid: Grid, triangles: &[Triangle]) -> Option<SampledShape> {
        let mut is_inside = vec![false; grid.len()];
        for_each_winding(&grid, triangles, |index, winding| is_inside[index] = winding > 0);
        let tree = TriangleTree::new(triangles)?;
        if !is_inside.contains(&true) {
            return None;
        }
        let rough = distance::signed(&grid, |i| is_inside[i]);
        let search_within = SEARCH_WITHIN * grid.spacing.max_element();
        let near: Vec<usize> = (0..grid.len()).filter(|&i| rough[i].abs() <= search_within).collect();
        let nearest = par_map(near.len(), |n| tree.nearest(grid.centre(grid.cell(near[n]))));
        let mut distances = distances_from_nearest(&grid, &tree, near.into_iter().zip(nearest).collect());
        for (distance, _) in distances.iter_mut().zip(is_inside).filter(|(_, is_inside)| *is_inside) {
            *distance = -*distance;
        }
        Some(SampledShape { grid, distances })
    }

    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Returns the part below a height (z), mm.
    pub fn below(mut self, height: f32) -> SampledShape {
        let grid = self.grid;
        for (cell, distance) in grid.cells().zip(&mut self.distances) {
            *distance = distance.max(grid.centre(cell).z - height);
        }
        self
    }

    /// Returns the part that also lies within another shape.
    pub fn within(mut self, other: &SampledShape) -> SampledShape {
        let grid = self.grid;
        for (cell, distance) in grid.cells().zip(&mut self.distances) {
            *distance = distance.max(other.distance(grid.centre(cell)));
        }
        self
    }

    /// Returns the shape on the smallest part of its grid that holds it with a margin, mm; `None` if no point of the
    /// grid is inside.
    pub fn cropped(self, margin: f32) -> Option<SampledShape> {
        let inside = self.grid.cells().zip(&self.distances).filter(|(_, d)| **d < 0.0).map(|(cell, _)| cell);
        let CellBox { low, high } = CellBox::around(inside)?;
        let beside = (margin / self.grid.spacing.min_element()).ceil() as u32;
        let low = low.map(|n| n.saturating_sub(beside));
        let high = std::array::from_fn(|axis| (high[axis] + beside).min(self.grid.dims[axis] - 1));
        let grid = self.grid.part(&CellBox { low, high });
        let of = |[x, y, z]: [u32; 3]| self.distances[self.grid.index([low[0] + x, low[1] + y, low[2] + z])];
        Some(SampledShape { distances: grid.cells().map(of).collect(), grid })
    }

    /// Returns the surface, without the face at which the shape is cut off by the border of its grid.
    pub fn surface(&self) -> Mesh {
        let half_band = redistance::half_band(&self.grid);
        let densities = self.distances.iter().map(|&d| density_at_distance(d, half_band)).collect();
        surface::extract(&Volume::new(self.grid, half_band, densities, vec![Label::AIR; self.grid.len()], Label(1)))
    }

    /// Signed distance of a point, mm: trilinear interpolation; beyond the grid the distance to the grid is added.
    pub fn distance(&self, point: Vec3) -> f32 {
        let Aabb { low, high } = self.grid.extent();
        let inside = point.clamp(low, high);
        self.grid.trilinear(&self.distances, inside) + inside.distance(point)
    }

    fn normal(&self, point: Vec3) -> Vec3 {
        let step = 0.5 * self.grid.spacing.min_element();
        let along = |axis: Vec3| self.distance(point + axis * step) - self.distance(point - axis * step);
        Vec3::new(along(Vec3::X), along(Vec3::Y), along(Vec3::Z)).normalize_or_zero()
    }

    /// Point of the surface near a point, and the outward normal there.
    pub(super) fn project_to_surface(&self, point: Vec3) -> (Vec3, Vec3) {
        let mut on = point;
        for _ in 0..2 {
            on -= self.normal(on) * self.distance(on);
        }
        (on, self.normal(on))
    }
}

/// Unsigned distances of all points of a grid from triangles, mm, by points whose nearest triangle is known.
///
/// Each point passes its triangle on to its neighbours, which keep the nearest of those that they were given: the
/// distance to a triangle is exact however far it has been passed on, unlike one that is added up from point to point.
fn distances_from_nearest(grid: &Grid, tree: &TriangleTree, known: VecDeque<(usize, u32)>) -> Vec<f32> {
    let mut distances = vec![f32::INFINITY; grid.len()];
    let mut waiting = known;
    for &(index, triangle) in &waiting {
        distances[index] = tree.distance_from(triangle, grid.centre(grid.cell(index)));
    }
    while let Some((index, triangle)) = waiting.pop_front() {
        for neighbour in grid.neighbours(index) {
            let distance = tree.distance_from(triangle, grid.centre(grid.cell(neighbour)));
            if distance < distances[neighbour] {
                distances[neighbour] = distance;
                waiting.push_back((neighbour, triangle));
            }
        }
    }
    distances
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A box as closed triangles.
    fn cuboid(low: Vec3, high: Vec3) -> Vec<Triangle> {
        let corner = |n: u32| Vec3::select(glam::BVec3::new(n & 1 != 0, n & 2 != 0, n & 4 != 0), high, low);
        let faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        faces.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]].map(|t| t.map(corner))).collect()
    }

    fn cuboid_distance(p: Vec3, low: Vec3, high: Vec3) -> f32 {
        let beyond = (low - p).max(p - high);
        beyond.max(Vec3::ZERO).length() + beyond.max_element().min(0.0)
    }

    #[test]
    fn triangles_are_sampled_as_their_distance() {
        // Aim: signed distances near and far, also beyond edges and corners. Method: a box between the points of the grid
        // against its formula.
        let (low, high) = (Vec3::new(-0.93, -0.61, -0.47), Vec3::new(0.77, 0.82, 1.13));
        let grid = Grid::covering(low, high, Vec3::splat(0.1), 6);
        let shape = SampledShape::of_triangles(grid, &cuboid(low, high)).unwrap();
        for cell in grid.cells() {
            let expected = cuboid_distance(grid.centre(cell), low, high);
            let off = (shape.distance(grid.centre(cell)) - expected).abs();
            assert!(off < 1e-3, "{}: {off} at {expected}", grid.centre(cell));
        }
        let volume = shape.surface().volume_mm3() / f64::from((high - low).element_product());
        assert!((volume - 1.0).abs() < 0.02, "{volume}");
        assert!(SampledShape::of_triangles(grid, &cuboid(low - 9.0, high - 9.0)).is_none());
    }

    #[test]
    fn a_part_below_a_height_lies_on_its_own_grid() {
        let (low, high) = (Vec3::splat(-1.0), Vec3::new(1.0, 1.0, 4.0));
        let grid = Grid::covering(low, high, Vec3::splat(0.1), 4);
        let whole = SampledShape::of_triangles(grid, &cuboid(low, high)).unwrap();
        let part = whole.clone().below(0.5).cropped(0.3).unwrap();
        let Aabb { low, high } = part.grid().extent();
        assert!((high.z - 0.8).abs() < 0.11 && (low.z + 1.3).abs() < 0.11, "{low} {high}");
        assert!((part.distance(Vec3::new(0.0, 0.0, 0.7)) - 0.2).abs() < 1e-3);
        assert!(whole.below(-3.0).cropped(0.3).is_none());
    }
}
