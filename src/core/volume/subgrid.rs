//! Parts of a grid for local work, so that it takes time in proportion to what is worked on and not to the whole.

use crate::frame::Vec3;
use crate::volume::{CellBox, Grid};

/// Box of voxels of a grid, with its own array indices.
#[derive(Clone, Copy, Debug)]
pub struct SubGrid {
    whole: Grid,
    low: [u32; 3],
    pub grid: Grid,
}

impl SubGrid {
    /// Returns the smallest box around the `wanted` voxels, with a margin in voxels that ends at the border of the
    /// grid; `None` if there are none.
    pub fn around(whole: &Grid, margin: u32, wanted: impl Iterator<Item = usize>) -> Option<SubGrid> {
        let cells = CellBox::around(wanted.map(|index| whole.cell(index)))?.grown_within(whole, margin);
        Some(SubGrid { whole: *whole, low: cells.low, grid: whole.part(&cells) })
    }

    /// Returns the index in the whole grid of a voxel of the box.
    pub fn whole_index(&self, index: usize) -> usize {
        let cell = self.grid.cell(index);
        self.whole.index(std::array::from_fn(|a| cell[a] + self.low[a]))
    }

    /// Returns the index in the box of a voxel of the whole grid; `None` outside the box.
    pub fn index_of(&self, whole_index: usize) -> Option<usize> {
        let cell = self.whole.cell(whole_index);
        let is_inside = |a: usize| cell[a] >= self.low[a] && cell[a] - self.low[a] < self.grid.dims[a];
        (0..3).all(is_inside).then(|| self.grid.index(std::array::from_fn(|a| cell[a] - self.low[a])))
    }
}

/// Empty voxels kept around the requested box, for sampling and surfaces.
const SURFACE_MARGIN: u32 = 3;

/// Box of voxels of a grid that is padded with empty voxels and may extend beyond the border of the grid.
pub struct PaddedGrid {
    /// Grid of the box.
    pub grid: Grid,
    whole: Grid,
    /// Index of the box's first voxel in the whole grid; negative beyond its border.
    offset: [i64; 3],
    /// Additional voxels on every side that are needed during the work only.
    extra_margin: [u32; 3],
}

impl PaddedGrid {
    /// Creates the grid of a box of voxels, with room for the surface and `extra_margin` voxels on
    /// every side.
    pub fn around(whole: &Grid, cells: &CellBox, extra_margin: [u32; 3]) -> PaddedGrid {
        let margin = extra_margin.map(|n| SURFACE_MARGIN + n);
        let offset = std::array::from_fn(|axis| i64::from(cells.low[axis]) - i64::from(margin[axis]));
        let dims = std::array::from_fn(|axis| cells.dims()[axis] + 2 * margin[axis]);
        PaddedGrid { grid: shifted(whole, offset, dims), whole: *whole, offset, extra_margin }
    }

    /// Extracts the box from one value per voxel of the whole grid; voxels beyond its border are `empty`.
    pub fn crop<T: Copy>(&self, values: Vec<T>, empty: T) -> Vec<T> {
        if self.grid == self.whole {
            return values;
        }
        let value = |cell| self.to_whole(cell).map_or(empty, |cell| values[self.whole.index(cell)]);
        self.grid.cells().map(value).collect()
    }

    /// Returns the whole grid; enlarged where the box, without `extra_margin`, extends beyond its border.
    pub fn enlarged_whole(&self) -> Grid {
        let before = self.before_whole();
        let high =
            |axis: usize| self.offset[axis] + i64::from(self.grid.dims[axis]) - i64::from(self.extra_margin[axis]);
        let end = |axis: usize| high(axis).max(i64::from(self.whole.dims[axis]));
        shifted(&self.whole, before, std::array::from_fn(|axis| (end(axis) - before[axis]) as u32))
    }

    /// Returns the values of the box in the [enlarged whole grid](PaddedGrid::enlarged_whole), `empty` elsewhere.
    pub fn paste<T: Copy>(&self, values: Vec<T>, empty: T) -> Vec<T> {
        let (grid, before) = (self.enlarged_whole(), self.before_whole());
        if grid == self.grid {
            return values;
        }
        let mut all = vec![empty; grid.len()];
        for (value, cell) in values.into_iter().zip(self.grid.cells()) {
            let to: [i64; 3] = std::array::from_fn(|axis| i64::from(cell[axis]) + self.offset[axis] - before[axis]);
            if (0..3).all(|axis| (0..i64::from(grid.dims[axis])).contains(&to[axis])) {
                all[grid.index(to.map(|n| n as u32))] = value;
            }
        }
        all
    }

    /// Returns the first voxel of the enlarged whole grid, counted from that of the whole grid: 0 or negative.
    fn before_whole(&self) -> [i64; 3] {
        std::array::from_fn(|axis| (self.offset[axis] + i64::from(self.extra_margin[axis])).min(0))
    }

    fn to_whole(&self, cell: [u32; 3]) -> Option<[u32; 3]> {
        let cell: [i64; 3] = std::array::from_fn(|axis| self.offset[axis] + i64::from(cell[axis]));
        let is_in = (0..3).all(|axis| (0..i64::from(self.whole.dims[axis])).contains(&cell[axis]));
        is_in.then(|| cell.map(|n| n as u32))
    }
}

/// Grid of another size, aligned with the voxels of `grid`.
fn shifted(grid: &Grid, first: [i64; 3], dims: [u32; 3]) -> Grid {
    let [x, y, z] = first.map(|n| n as f32);
    Grid { dims, spacing: grid.spacing, origin: grid.origin + grid.spacing * Vec3::new(x, y, z) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_cut_out_goes_back_to_its_place() {
        // Aim: a voxel keeps its position in space through crop and paste. Method: a box over one corner of a grid.
        let whole = Grid::centred([7, 6, 5], Vec3::new(0.5, 0.25, 1.0));
        let values: Vec<usize> = (1..=whole.len()).collect();
        let window = PaddedGrid::around(&whole, &CellBox { low: [1, 2, 1], high: [3, 4, 4] }, [2; 3]);
        let cut = window.crop(values, 0);
        let (grid, pasted) = (window.enlarged_whole(), window.paste(cut, 0));
        assert_eq!(grid.dims, [9, 9, 10]);
        for (&value, cell) in pasted.iter().zip(grid.cells()).filter(|(value, _)| **value != 0) {
            let from = whole.nearest(grid.centre(cell)).unwrap();
            assert_eq!(value, whole.index(from) + 1);
        }
        assert_eq!(pasted.iter().filter(|value| **value != 0).count(), whole.len(), "the box holds the whole grid");
    }
}
