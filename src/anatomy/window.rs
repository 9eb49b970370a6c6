//! The part of a grid in which work is done, which may reach beyond the grid's border.

use crate::frame::Vec3;
use crate::volume::{Density, Grid, Label};

/// Empty voxels that stay around what a window was made for: what touch and surfaces reach beyond it.
const ROOM: u32 = 3;

/// A box of a grid's voxels and of empty ones around it.
pub(super) struct Window {
    /// The grid of the window alone.
    pub grid: Grid,
    whole: Grid,
    /// Where the window's first voxel lies in the whole grid; negative beyond its border.
    first: [i64; 3],
    /// Voxels of the window's margin that work alone needs.
    spare: [u32; 3],
}

impl Window {
    /// The voxels from `low` to `high` with room for their surface and `spare` voxels on every side.
    pub(super) fn around(whole: &Grid, low: [u32; 3], high: [u32; 3], spare: [u32; 3]) -> Window {
        let margin = spare.map(|n| ROOM + n);
        let first = std::array::from_fn(|axis| i64::from(low[axis]) - i64::from(margin[axis]));
        let dims = std::array::from_fn(|axis| high[axis] - low[axis] + 1 + 2 * margin[axis]);
        Window { grid: moved(whole, first, dims), whole: *whole, first, spare }
    }

    /// The window's part of one value per voxel of the whole; beyond the border it is `empty`.
    pub(super) fn cut<T: Copy>(&self, values: Vec<T>, empty: T) -> Vec<T> {
        if self.grid == self.whole {
            return values;
        }
        let value = |cell| self.in_whole(cell).map_or(empty, |cell| values[self.whole.index(cell)]);
        self.grid.cells().map(value).collect()
    }

    /// The whole again, with nothing outside the window; it grows where matter needs room beyond its border.
    pub(super) fn paste(&self, density: Vec<Density>, label: Vec<Label>) -> (Grid, Vec<Density>, Vec<Label>) {
        let low = |axis: usize| self.first[axis] + i64::from(self.spare[axis]);
        let high = |axis: usize| self.first[axis] + i64::from(self.grid.dims[axis]) - i64::from(self.spare[axis]);
        let before: [i64; 3] = std::array::from_fn(|axis| low(axis).min(0));
        let end = |axis: usize| high(axis).max(i64::from(self.whole.dims[axis]));
        let grid = moved(&self.whole, before, std::array::from_fn(|axis| (end(axis) - before[axis]) as u32));
        if grid == self.grid {
            return (grid, density, label);
        }
        let mut all_density = vec![Density::EMPTY; grid.len()];
        let mut all_label = vec![Label::AIR; grid.len()];
        for (from, cell) in self.grid.cells().enumerate() {
            let to: [i64; 3] = std::array::from_fn(|axis| i64::from(cell[axis]) + self.first[axis] - before[axis]);
            if (0..3).all(|axis| (0..i64::from(grid.dims[axis])).contains(&to[axis])) {
                let to = grid.index(to.map(|n| n as u32));
                (all_density[to], all_label[to]) = (density[from], label[from]);
            }
        }
        (grid, all_density, all_label)
    }

    fn in_whole(&self, cell: [u32; 3]) -> Option<[u32; 3]> {
        let cell: [i64; 3] = std::array::from_fn(|axis| self.first[axis] + i64::from(cell[axis]));
        let is_in = (0..3).all(|axis| (0..i64::from(self.whole.dims[axis])).contains(&cell[axis]));
        is_in.then(|| cell.map(|n| n as u32))
    }
}

/// A grid of other size whose voxels are where those of `grid` are.
fn moved(grid: &Grid, first: [i64; 3], dims: [u32; 3]) -> Grid {
    let [x, y, z] = first.map(|n| n as f32);
    Grid { dims, spacing: grid.spacing, origin: grid.origin + grid.spacing * Vec3::new(x, y, z) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_cut_out_goes_back_to_its_place() {
        // Aim: a voxel keeps its place in space through cut and paste. Method: a window over one corner of a grid.
        let whole = Grid::centred([7, 6, 5], Vec3::new(0.5, 0.25, 1.0));
        let values: Vec<usize> = (1..=whole.len()).collect();
        let window = Window::around(&whole, [1, 2, 1], [3, 4, 4], [2; 3]);
        let cut = window.cut(values, 0);
        let label: Vec<Label> = cut.iter().map(|&v| Label(v as u8)).collect();
        let (grid, _, label) = window.paste(vec![Density::FULL; label.len()], label);
        assert_eq!(grid.dims, [9, 9, 10]);
        for (index, cell) in grid.cells().enumerate().filter(|&(i, _)| label[i] != Label::AIR) {
            let from = whole.nearest(grid.centre(cell)).unwrap();
            assert_eq!(usize::from(label[index].0), whole.index(from) + 1);
        }
        assert_eq!(label.iter().filter(|&&l| l != Label::AIR).count(), whole.len(), "the window holds all of it");
    }
}
