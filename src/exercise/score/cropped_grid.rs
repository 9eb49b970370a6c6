//! A box cut out of a grid, so that the computation of distances takes time in proportion to the cavity and not to the
//! tooth.

use typodont_core::volume::Grid;

/// Part of a grid, with its own array indices.
#[derive(Clone, Copy, Debug)]
pub struct CroppedGrid {
    whole: Grid,
    low: [u32; 3],
    pub grid: Grid,
}

impl CroppedGrid {
    /// Returns the smallest box around the `wanted` voxels, with a margin in voxels; `None` if there are none.
    pub fn around(whole: &Grid, margin: u32, wanted: impl Iterator<Item = usize>) -> Option<CroppedGrid> {
        let (mut low, mut high) = ([u32::MAX; 3], [0; 3]);
        for index in wanted {
            for (axis, at) in whole.cell(index).into_iter().enumerate() {
                low[axis] = low[axis].min(at);
                high[axis] = high[axis].max(at);
            }
        }
        if low[0] == u32::MAX {
            return None;
        }
        let low = low.map(|v| v.saturating_sub(margin));
        let dims = std::array::from_fn(|a| (high[a] + margin).min(whole.dims[a] - 1) + 1 - low[a]);
        Some(CroppedGrid { whole: *whole, low, grid: Grid { dims, spacing: whole.spacing, origin: whole.centre(low) } })
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
