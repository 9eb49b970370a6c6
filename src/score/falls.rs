//! When voxels fell.

use crate::tick::Tick;

/// The voxels that became air, with the tick in which each did.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Falls {
    /// Ascending by voxel.
    all: Vec<(u32, Tick)>,
}

impl Falls {
    /// From a log in the order of time; of a voxel that fell twice the last time counts.
    pub fn sorted(mut log: Vec<(u32, Tick)>) -> Falls {
        log.sort_by_key(|&(voxel, tick)| (voxel, std::cmp::Reverse(tick)));
        log.dedup_by_key(|&mut (voxel, _)| voxel);
        Falls { all: log }
    }

    /// When a voxel fell; `None`: it never did.
    pub fn at(&self, voxel: usize) -> Option<Tick> {
        let place = self.all.binary_search_by_key(&voxel, |&(v, _)| v as usize).ok()?;
        Some(self.all[place].1)
    }

    /// Ascending by voxel.
    pub fn iter(&self) -> impl Iterator<Item = (usize, Tick)> + '_ {
        self.all.iter().map(|&(voxel, tick)| (voxel as usize, tick))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_fall_of_a_voxel_counts() {
        let falls = Falls::sorted(vec![(7, Tick(1)), (3, Tick(2)), (7, Tick(9))]);
        assert_eq!(falls.at(7), Some(Tick(9)));
        assert_eq!(falls.at(4), None);
        assert_eq!(falls.iter().collect::<Vec<_>>(), [(3, Tick(2)), (7, Tick(9))]);
    }
}
