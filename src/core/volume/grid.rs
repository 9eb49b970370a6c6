//! Regular grid of a volume: its dimensions, spacing and position in tooth space.

use super::CellBox;
use crate::aabb::Aabb;
use crate::frame::Vec3;

/// Regular grid of voxels. Voxel `[i, j, k]` has its centre at `origin + [i, j, k] * spacing` in tooth space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    pub dims: [u32; 3],
    /// Distance between voxel centres along each axis, mm; finite and positive.
    pub spacing: Vec3,
    /// Centre of voxel `[0, 0, 0]` in tooth space, mm.
    pub origin: Vec3,
}

impl Grid {
    /// Creates a grid centred on the origin of tooth space.
    pub fn centred(dims: [u32; 3], spacing: Vec3) -> Grid {
        let [nx, ny, nz] = dims.map(|n| n as f32 - 1.0);
        Grid { dims, spacing, origin: Vec3::new(nx, ny, nz) * spacing * -0.5 }
    }

    /// Returns the part of the grid above a height, mm: at least its uppermost layer.
    pub fn above(&self, height: f32) -> Grid {
        let levels = (((height - self.origin.z) / self.spacing.z).max(0.0) as u32).min(self.dims[2] - 1);
        let [nx, ny, nz] = self.dims;
        let origin = self.origin + Vec3::Z * (levels as f32 * self.spacing.z);
        Grid { dims: [nx, ny, nz - levels], origin, ..*self }
    }

    /// Creates the smallest grid that covers a box in tooth space, with `margin` voxels around it.
    pub fn covering(low: Vec3, high: Vec3, spacing: Vec3, margin: u32) -> Grid {
        let steps = ((high - low) / spacing).ceil();
        let dims = [steps.x, steps.y, steps.z].map(|n| n as u32 + 1 + 2 * margin);
        Grid { dims, spacing, origin: low - spacing * margin as f32 }
    }

    /// Number of voxels.
    pub fn len(&self) -> usize {
        self.dims.iter().map(|&n| n as usize).product()
    }

    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Volume of one voxel, mm³.
    pub fn voxel_mm3(&self) -> f64 {
        f64::from(self.spacing.x) * f64::from(self.spacing.y) * f64::from(self.spacing.z)
    }

    /// Array index of a voxel, which must lie in the grid.
    ///
    /// # Panics
    /// In debug builds, if the voxel is outside the grid.
    pub fn index(&self, [x, y, z]: [u32; 3]) -> usize {
        debug_assert!(x < self.dims[0] && y < self.dims[1] && z < self.dims[2]);
        (z as usize * self.dims[1] as usize + y as usize) * self.dims[0] as usize + x as usize
    }

    /// Voxel at an array index.
    pub fn cell(&self, index: usize) -> [u32; 3] {
        let (nx, ny) = (self.dims[0] as usize, self.dims[1] as usize);
        [(index % nx) as u32, (index / nx % ny) as u32, (index / (nx * ny)) as u32]
    }

    /// All voxels in array order.
    pub fn cells(&self) -> impl Iterator<Item = [u32; 3]> + use<> {
        let [nx, ny, nz] = self.dims;
        (0..nz).flat_map(move |z| (0..ny).flat_map(move |y| (0..nx).map(move |x| [x, y, z])))
    }

    /// Centre of a voxel in tooth space, mm.
    pub fn centre(&self, [x, y, z]: [u32; 3]) -> Vec3 {
        self.origin + Vec3::new(x as f32, y as f32, z as f32) * self.spacing
    }

    /// Converts a point in tooth space to voxel steps from voxel `[0, 0, 0]`.
    pub fn from_tooth(&self, point_in_tooth: Vec3) -> Vec3 {
        (point_in_tooth - self.origin) / self.spacing
    }

    /// Voxel whose centre is nearest to a point in tooth space; `None` outside the grid.
    pub fn nearest(&self, point_in_tooth: Vec3) -> Option<[u32; 3]> {
        // Truncation instead of rounding: for non-negative values it needs no function call.
        let at = self.from_tooth(point_in_tooth) + 0.5;
        let inside = |v: f32, n: u32| v >= 0.0 && v < n as f32;
        (inside(at.x, self.dims[0]) && inside(at.y, self.dims[1]) && inside(at.z, self.dims[2])).then_some([
            at.x as u32,
            at.y as u32,
            at.z as u32,
        ])
    }

    /// Box around the voxel centres, tooth space, mm.
    #[inline]
    pub fn extent(&self) -> Aabb {
        Aabb::new(self.origin, self.centre(self.dims.map(|n| n.saturating_sub(1))))
    }

    /// Box around the centres of the voxels of a box, tooth space, mm.
    pub fn extent_of(&self, cells: &CellBox) -> Aabb {
        Aabb::new(self.centre(cells.low), self.centre(cells.high))
    }

    /// Grid of a box of voxels.
    pub fn part(&self, cells: &CellBox) -> Grid {
        Grid { dims: cells.dims(), spacing: self.spacing, origin: self.centre(cells.low) }
    }

    /// Index ranges of the voxels whose centres lie within a box in tooth space, clipped to the grid.
    pub fn cells_within(&self, low: Vec3, high: Vec3) -> [std::ops::Range<u32>; 3] {
        let (low, high) = (self.from_tooth(low).ceil(), self.from_tooth(high).floor());
        std::array::from_fn(|axis| {
            let n = self.dims[axis] as f32;
            let start = low[axis].clamp(0.0, n) as u32;
            let end = (high[axis] + 1.0).clamp(0.0, n) as u32;
            start..end.max(start)
        })
    }

    /// Interpolates one value per voxel at a point in tooth space, trilinearly; extrapolates linearly slightly
    /// outside the grid.
    pub fn trilinear(&self, values: &[f32], point_in_tooth: Vec3) -> f32 {
        let [nx, ny, nz] = self.dims.map(|n| n as usize);
        let at = self.from_tooth(point_in_tooth);
        let base = |v: f32, n: usize| (v.max(0.0) as usize).min(n.saturating_sub(2));
        let (x, y, z) = (base(at.x, nx), base(at.y, ny), base(at.z, nz));
        let part = at - Vec3::new(x as f32, y as f32, z as f32);
        let value = |i: usize, j: usize, k: usize| {
            values[((z + k).min(nz - 1) * ny + (y + j).min(ny - 1)) * nx + (x + i).min(nx - 1)]
        };
        let mix = |a: f32, b: f32, t: f32| a + (b - a) * t;
        let along_x = |j: usize, k: usize| mix(value(0, j, k), value(1, j, k), part.x);
        let along_y = |k: usize| mix(along_x(0, k), along_x(1, k), part.y);
        mix(along_y(0), along_y(1), part.z)
    }

    /// The up to six face neighbours of a voxel, as array indices.
    pub fn neighbours(&self, index: usize) -> impl Iterator<Item = usize> + use<> {
        let cell = self.cell(index);
        let strides = [1, self.dims[0] as usize, self.dims[0] as usize * self.dims[1] as usize];
        let dims = self.dims;
        (0..3).flat_map(move |axis| {
            let below = (cell[axis] > 0).then(|| index - strides[axis]);
            let above = (cell[axis] + 1 < dims[axis]).then(|| index + strides[axis]);
            below.into_iter().chain(above)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn indices_cells_and_points_agree() {
        let grid = Grid::covering(Vec3::new(-1.0, 0.0, 2.0), Vec3::new(1.0, 3.0, 4.0), Vec3::new(0.5, 0.3, 0.2), 2);
        for (index, cell) in grid.cells().enumerate() {
            assert_eq!(grid.index(cell), index);
            assert_eq!(grid.cell(index), cell);
        }
        let cell = [3, 4, 5];
        assert_eq!(grid.nearest(grid.centre(cell)), Some(cell));
        assert_eq!(grid.nearest(grid.origin - grid.spacing), None);
        let Aabb { low, high } = grid.extent();
        assert!(low.x <= -1.0 && high.y >= 3.0);
    }

    #[test]
    fn a_corner_has_three_neighbours_and_the_middle_six() {
        let grid = Grid::centred([3, 3, 3], Vec3::ONE);
        assert_eq!(grid.neighbours(0).collect::<Vec<_>>(), [1, 3, 9]);
        assert_eq!(grid.neighbours(grid.index([1, 1, 1])).count(), 6);
    }

    #[test]
    fn a_box_outside_the_grid_holds_no_cells() {
        let grid = Grid::centred([4, 4, 4], Vec3::ONE);
        let ranges = grid.cells_within(Vec3::splat(50.0), Vec3::splat(60.0));
        assert!(ranges.iter().all(|r| r.is_empty()));
    }
}
