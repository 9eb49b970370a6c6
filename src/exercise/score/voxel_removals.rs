//! The times at which voxels were removed.

use typodont_core::tick::Tick;
use typodont_core::volume::Grid;

/// Removal of a voxel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VoxelRemoval {
    pub at: Tick,
    /// Force exerted by the trainee, N, without the forces of guidance.
    pub force: f32,
    /// Index of the instrument in use.
    pub instrument: u8,
}

/// The removed voxels, each with its removal.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct VoxelRemovals {
    /// Removals in ascending order of voxels.
    all: Vec<(u32, VoxelRemoval)>,
}

impl VoxelRemovals {
    /// Sorts a log that is in order of time; for a voxel that was removed twice, the last removal counts.
    pub fn sorted(mut log: Vec<(u32, VoxelRemoval)>) -> VoxelRemovals {
        log.sort_by_key(|&(voxel, fall)| (voxel, std::cmp::Reverse(fall.at)));
        log.dedup_by_key(|&mut (voxel, _)| voxel);
        VoxelRemovals { all: log }
    }

    /// Returns the tick at which a voxel was removed; `None` if it was not.
    pub fn at(&self, voxel: usize) -> Option<Tick> {
        self.get(voxel).map(|fall| fall.at)
    }

    /// Returns the removal of a voxel; `None` if it was not removed.
    pub fn get(&self, voxel: usize) -> Option<VoxelRemoval> {
        let place = self.all.binary_search_by_key(&voxel, |&(v, _)| v as usize).ok()?;
        Some(self.all[place].1)
    }

    /// Returns the removal by which a voxel was exposed: the earliest of its own and those of its neighbours; `None` if
    /// it was not exposed.
    pub fn exposing(&self, grid: &Grid, voxel: usize) -> Option<VoxelRemoval> {
        std::iter::once(voxel).chain(grid.neighbours(voxel)).filter_map(|v| self.get(v)).min_by_key(|r| r.at)
    }

    /// Returns all removals in ascending order of voxels.
    pub fn iter(&self) -> impl Iterator<Item = (usize, VoxelRemoval)> + '_ {
        self.all.iter().map(|&(voxel, fall)| (voxel as usize, fall))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_fall_of_a_voxel_counts() {
        let fall = |tick: u64| VoxelRemoval { at: Tick(tick), force: tick as f32, instrument: 0 };
        let falls = VoxelRemovals::sorted(vec![(7, fall(1)), (3, fall(2)), (7, fall(9))]);
        assert_eq!(falls.get(7), Some(fall(9)));
        assert_eq!(falls.at(4), None);
        assert_eq!(falls.iter().collect::<Vec<_>>(), [(3, fall(2)), (7, fall(9))]);
    }
}
