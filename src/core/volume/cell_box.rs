//! Boxes of voxels.

use super::Grid;

/// Box of voxels of a grid, from `low` to `high`, both included.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CellBox {
    pub low: [u32; 3],
    pub high: [u32; 3],
}

impl CellBox {
    /// Returns the smallest box around voxels; `None` if there are none.
    pub fn around(cells: impl IntoIterator<Item = [u32; 3]>) -> Option<CellBox> {
        let mut cells = cells.into_iter();
        let first = cells.next()?;
        Some(cells.fold(CellBox { low: first, high: first }, CellBox::with))
    }

    /// Returns the smallest box around this one and a voxel.
    pub fn with(self, cell: [u32; 3]) -> CellBox {
        CellBox {
            low: std::array::from_fn(|axis| self.low[axis].min(cell[axis])),
            high: std::array::from_fn(|axis| self.high[axis].max(cell[axis])),
        }
    }

    /// Returns the box with `margin` more voxels on every side, as far as the grid goes.
    pub fn grown_within(self, grid: &Grid, margin: u32) -> CellBox {
        CellBox {
            low: self.low.map(|v| v.saturating_sub(margin)),
            high: std::array::from_fn(|axis| (self.high[axis] + margin).min(grid.dims[axis] - 1)),
        }
    }

    /// Numbers of voxels along the axes.
    pub fn dims(&self) -> [u32; 3] {
        std::array::from_fn(|axis| self.high[axis] - self.low[axis] + 1)
    }

    /// Returns true if every voxel of a box is in this one.
    pub fn contains(&self, other: &CellBox) -> bool {
        (0..3).all(|axis| self.low[axis] <= other.low[axis] && other.high[axis] <= self.high[axis])
    }
}
