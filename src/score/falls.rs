//! When voxels fell.

use crate::tick::Tick;

/// How a voxel became air.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fall {
    pub at: Tick,
    /// How hard the trainee pressed, N; what led the hand is left out.
    pub force: f32,
    /// Index of the instrument in the hand.
    pub instrument: u8,
}

/// The voxels that became air, with how each did.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Falls {
    /// Ascending by voxel.
    all: Vec<(u32, Fall)>,
}

impl Falls {
    /// From a log in the order of time; of a voxel that fell twice the last time counts.
    pub fn sorted(mut log: Vec<(u32, Fall)>) -> Falls {
        log.sort_by_key(|&(voxel, fall)| (voxel, std::cmp::Reverse(fall.at)));
        log.dedup_by_key(|&mut (voxel, _)| voxel);
        Falls { all: log }
    }

    /// When a voxel fell; `None`: it never did.
    pub fn at(&self, voxel: usize) -> Option<Tick> {
        self.get(voxel).map(|fall| fall.at)
    }

    /// How a voxel fell; `None`: it never did.
    pub fn get(&self, voxel: usize) -> Option<Fall> {
        let place = self.all.binary_search_by_key(&voxel, |&(v, _)| v as usize).ok()?;
        Some(self.all[place].1)
    }

    /// Ascending by voxel.
    pub fn iter(&self) -> impl Iterator<Item = (usize, Fall)> + '_ {
        self.all.iter().map(|&(voxel, fall)| (voxel as usize, fall))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_fall_of_a_voxel_counts() {
        let fall = |tick: u64| Fall { at: Tick(tick), force: tick as f32, instrument: 0 };
        let falls = Falls::sorted(vec![(7, fall(1)), (3, fall(2)), (7, fall(9))]);
        assert_eq!(falls.get(7), Some(fall(9)));
        assert_eq!(falls.at(4), None);
        assert_eq!(falls.iter().collect::<Vec<_>>(), [(3, fall(2)), (7, fall(9))]);
    }
}
