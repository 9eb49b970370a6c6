//! Shape sampled as signed distances on a grid: gum with a sulcus, and other shapes without a formula.

use crate::aabb::Aabb;
use crate::frame::Vec3;
use crate::volume::Grid;

/// Sampled shape that lies within its grid.
#[derive(Clone, Debug, PartialEq)]
pub struct SdfGrid {
    grid: Grid,
    /// Signed distances, mm; negative inside.
    distances: Vec<f32>,
    /// Upper bound of the change of the distance per millimetre of motion; at least 1.
    steepness: f32,
    pub compliance: Compliance,
}

/// Compliance of soft tissue: depth to which a working end sinks in under a force.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Compliance {
    /// Force up to which the tissue does not yield, N.
    pub from_force: f32,
    /// Depth per newton above that force, mm/N.
    pub per_newton: f32,
    /// Greatest depth, mm.
    pub max_depth: f32,
}

impl Compliance {
    /// Depth to which a working end sinks in under a force, N; mm.
    pub fn depth(&self, force: f32) -> f32 {
        ((force - self.from_force) * self.per_newton).clamp(0.0, self.max_depth)
    }
}

impl SdfGrid {
    /// Samples a signed distance, mm, at every point of a grid. A shape that extends beyond the grid is cut off at
    /// its border.
    pub fn from_fn(grid: Grid, compliance: Compliance, mut at: impl FnMut(Vec3) -> f32) -> SdfGrid {
        let Aabb { low, high } = grid.extent();
        let distances = grid.cells().map(|cell| {
            let point = grid.centre(cell);
            let beyond = (low - point).max(point - high).max_element() + grid.spacing.max_element();
            at(point).max(beyond)
        });
        let distances: Vec<f32> = distances.collect();
        SdfGrid { steepness: steepness(&grid, &distances), distances, grid, compliance }
    }

    /// Upper bound of the change of the distance per millimetre of motion; at least 1.
    pub(super) fn steepness(&self) -> f32 {
        self.steepness
    }

    pub fn extent(&self) -> Aabb {
        self.grid.extent()
    }

    /// Largest distance between samples, mm.
    pub fn spacing(&self) -> f32 {
        self.grid.spacing.max_element()
    }

    /// Signed distance, mm; negative inside. Outside the grid it is a lower bound.
    pub fn distance(&self, point: Vec3) -> f32 {
        let Aabb { low, high } = self.grid.extent();
        let nearest = point.clamp(low, high);
        let inside = self.grid.trilinear(&self.distances, nearest);
        let outside = nearest.distance(point);
        // The shape lies within a convex box: the distance to it is at least the hypotenuse of the distance to the
        // box and the distance from there to the shape.
        if outside > 0.0 { (outside * outside + inside.max(0.0) * inside.max(0.0)).sqrt() } else { inside }
    }
}

/// Upper bound of the slope of samples interpolated trilinearly: along each axis it is between the slopes of the
/// surrounding edges of the grid. Outside the grid, where the distance to the grid is added, the slope is at most 1.
fn steepness(grid: &Grid, distances: &[f32]) -> f32 {
    let [nx, ny, _] = grid.dims.map(|n| n as usize);
    let squared_slopes = [1, nx, nx * ny].into_iter().enumerate().map(|(axis, stride)| {
        let is_edge = |index: &usize| index / stride % grid.dims[axis] as usize + 1 < grid.dims[axis] as usize;
        let rise = |index: usize| (distances[index + stride] - distances[index]).abs();
        let slope = (0..distances.len()).filter(is_edge).map(rise).fold(0.0, f32::max) / grid.spacing[axis];
        slope * slope
    });
    squared_slopes.sum::<f32>().sqrt().max(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sampled_ball_is_a_ball_inside_its_grid_and_never_nearer_than_it_is_outside() {
        let grid = Grid::centred([41; 3], Vec3::splat(0.2));
        let field = SdfGrid::from_fn(grid, Compliance::default(), |p| p.length() - 2.0);
        for i in 0..400 {
            let t = i as f32;
            let p = Vec3::new((t * 0.7).sin(), (t * 1.3).cos(), (t * 0.31).sin()) * 7.0;
            let (found, true_distance) = (field.distance(p), p.length() - 2.0);
            let is_inside = p.abs().max_element() <= 4.0;
            assert!(found <= true_distance + 0.02, "{p}: {found} for {true_distance}");
            assert!(!is_inside || p.abs().max_element() > 3.7 || (found - true_distance).abs() < 0.03, "{p}: {found}");
        }
    }

    #[test]
    fn an_end_sinks_only_under_more_than_is_held() {
        let yields = Compliance { from_force: 0.25, per_newton: 1.0, max_depth: 1.5 };
        assert_eq!([0.1, 0.25, 0.75, 9.0].map(|force| yields.depth(force)), [0.0, 0.0, 0.5, 1.5]);
    }
}
