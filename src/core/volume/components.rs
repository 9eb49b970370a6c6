//! Connected components of a set of voxels, joined face to face.

use crate::volume::Grid;

/// Component of each voxel; components are numbered in array order of their first voxel.
pub struct Components {
    /// [`NONE`] outside the set.
    numbers: Vec<u32>,
    sizes: Vec<usize>,
}

const NONE: u32 = u32::MAX;

impl Components {
    pub fn of(grid: &Grid, is_in: impl Fn(usize) -> bool) -> Components {
        let mut components = Components { numbers: vec![NONE; grid.len()], sizes: Vec::new() };
        let mut open = Vec::new();
        for start in 0..grid.len() {
            if components.numbers[start] != NONE || !is_in(start) {
                continue;
            }
            let number = components.sizes.len() as u32;
            let mut size = 0;
            components.numbers[start] = number;
            open.push(start);
            while let Some(index) = open.pop() {
                size += 1;
                for next in grid.neighbours(index) {
                    if components.numbers[next] == NONE && is_in(next) {
                        components.numbers[next] = number;
                        open.push(next);
                    }
                }
            }
            components.sizes.push(size);
        }
        components
    }

    pub fn sizes(&self) -> &[usize] {
        &self.sizes
    }

    /// Number of the component of a voxel; `None` outside the set.
    pub fn at(&self, index: usize) -> Option<usize> {
        (self.numbers[index] != NONE).then_some(self.numbers[index] as usize)
    }

    /// Number and size of the largest component, the first of several equal ones; `None` for an empty set.
    pub fn largest(&self) -> Option<(usize, usize)> {
        self.sizes.iter().copied().enumerate().rev().max_by_key(|&(_, size)| size)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Vec3;

    #[test]
    fn pieces_join_at_faces_only() {
        // Two voxels in a row, a voxel that touches them at an edge only, and three voxels in a row elsewhere.
        let grid = Grid::centred([5, 5, 5], Vec3::ONE);
        let set = [[0, 0, 0], [1, 0, 0], [2, 1, 0], [4, 4, 2], [4, 4, 3], [4, 4, 4]].map(|cell| grid.index(cell));
        let pieces = Components::of(&grid, |i| set.contains(&i));
        assert_eq!(pieces.sizes(), [2, 1, 3]);
        assert_eq!(pieces.largest(), Some((2, 3)));
        assert_eq!(set.map(|i| pieces.at(i)), [0, 0, 1, 2, 2, 2].map(Some));
        assert_eq!(pieces.at(grid.index([2, 2, 2])), None);
        assert_eq!(Components::of(&grid, |_| false).largest(), None);
    }
}
