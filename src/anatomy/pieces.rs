//! What hangs together: pieces of a set of voxels, joined face to face.

use crate::volume::Grid;

/// Which piece each voxel belongs to, pieces numbered in array order of their first voxel.
pub(super) struct Pieces {
    /// [`NONE`] outside the set.
    of: Vec<u32>,
    sizes: Vec<usize>,
}

const NONE: u32 = u32::MAX;

impl Pieces {
    pub(super) fn of(grid: &Grid, is_in: impl Fn(usize) -> bool) -> Pieces {
        let mut pieces = Pieces { of: vec![NONE; grid.len()], sizes: Vec::new() };
        let mut open = Vec::new();
        for start in 0..grid.len() {
            if pieces.of[start] != NONE || !is_in(start) {
                continue;
            }
            let number = pieces.sizes.len() as u32;
            let mut size = 0;
            pieces.of[start] = number;
            open.push(start);
            while let Some(index) = open.pop() {
                size += 1;
                for next in grid.neighbours(index) {
                    if pieces.of[next] == NONE && is_in(next) {
                        pieces.of[next] = number;
                        open.push(next);
                    }
                }
            }
            pieces.sizes.push(size);
        }
        pieces
    }

    pub(super) fn sizes(&self) -> &[usize] {
        &self.sizes
    }

    /// The number of a voxel's piece.
    pub(super) fn at(&self, index: usize) -> Option<usize> {
        (self.of[index] != NONE).then_some(self.of[index] as usize)
    }

    /// Number and size of the largest piece, the first of equals; `None` for an empty set.
    pub(super) fn largest(&self) -> Option<(usize, usize)> {
        self.sizes.iter().copied().enumerate().rev().max_by_key(|&(_, size)| size)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Vec3;

    #[test]
    fn pieces_join_at_faces_only() {
        // A bar of two, a voxel that touches it at an edge, and a bar of three far off.
        let grid = Grid::centred([5, 5, 5], Vec3::ONE);
        let set = [[0, 0, 0], [1, 0, 0], [2, 1, 0], [4, 4, 2], [4, 4, 3], [4, 4, 4]].map(|cell| grid.index(cell));
        let pieces = Pieces::of(&grid, |i| set.contains(&i));
        assert_eq!(pieces.sizes(), [2, 1, 3]);
        assert_eq!(pieces.largest(), Some((2, 3)));
        assert_eq!(set.map(|i| pieces.at(i)), [0, 0, 1, 2, 2, 2].map(Some));
        assert_eq!(pieces.at(grid.index([2, 2, 2])), None);
        assert_eq!(Pieces::of(&grid, |_| false).largest(), None);
    }
}
