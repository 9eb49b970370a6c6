//! A shape known by its signed distance at the points of a grid: gum with a sulcus, and whatever no formula describes.

use crate::frame::Vec3;
use crate::volume::Grid;

/// A sampled shape that lies within its grid.
#[derive(Clone, Debug, PartialEq)]
pub struct Field {
    grid: Grid,
    /// mm, negative inside.
    distances: Vec<f32>,
    pub yields: Yield,
}

/// How soft matter lets a working end sink in that presses harder than it holds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Yield {
    /// N that it holds.
    pub from: f32,
    /// mm for each newton more.
    pub per_newton: f32,
    /// mm
    pub most: f32,
}

impl Yield {
    /// How deep an end sinks that presses with a force, mm.
    pub fn depth(&self, force: f32) -> f32 {
        ((force - self.from) * self.per_newton).clamp(0.0, self.most)
    }
}

impl Field {
    /// Asks for the signed distance at every point of a grid. What reaches the grid's border ends there.
    pub fn of(grid: Grid, yields: Yield, mut at: impl FnMut(Vec3) -> f32) -> Field {
        let [low, high] = grid.extent();
        let distances = grid.cells().map(|cell| {
            let point = grid.centre(cell);
            let beyond = (low - point).max(point - high).max_element() + grid.spacing.max_element();
            at(point).max(beyond)
        });
        Field { distances: distances.collect(), grid, yields }
    }

    pub fn extent(&self) -> [Vec3; 2] {
        self.grid.extent()
    }

    /// Between samples, mm.
    pub fn spacing(&self) -> f32 {
        self.grid.spacing.max_element()
    }

    /// mm, negative inside. Outside the grid never more than it is.
    pub fn distance(&self, point: Vec3) -> f32 {
        let [low, high] = self.grid.extent();
        let nearest = point.clamp(low, high);
        let inside = self.grid.mixed(&self.distances, nearest);
        let outside = nearest.distance(point);
        // The shape lies within a convex box: the way to it is at least as long as both ways square to each other.
        if outside > 0.0 { (outside * outside + inside.max(0.0) * inside.max(0.0)).sqrt() } else { inside }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sampled_ball_is_a_ball_inside_its_grid_and_never_nearer_than_it_is_outside() {
        let grid = Grid::centred([41; 3], Vec3::splat(0.2));
        let field = Field::of(grid, Yield::default(), |p| p.length() - 2.0);
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
        let yields = Yield { from: 0.25, per_newton: 1.0, most: 1.5 };
        assert_eq!([0.1, 0.25, 0.75, 9.0].map(|force| yields.depth(force)), [0.0, 0.0, 0.5, 1.5]);
    }
}
