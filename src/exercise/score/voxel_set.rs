//! A set of voxels, one bit each.

/// Set of voxels of a grid.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct VoxelSet {
    words: Vec<u64>,
    len: usize,
}

impl VoxelSet {
    /// Returns true if the set contains the voxel with this array index.
    ///
    /// # Panics
    /// Panics if the index is outside the grid for which the set was made.
    pub fn contains(&self, voxel: usize) -> bool {
        assert!(voxel < self.len, "voxel {voxel} of {}", self.len);
        self.words[voxel / 64] >> (voxel % 64) & 1 == 1
    }

    /// Returns the array indices of the set's voxels in ascending order.
    pub fn iter(&self) -> impl Iterator<Item = usize> + '_ {
        self.words.iter().enumerate().filter(|(_, word)| **word != 0).flat_map(|(at, &word)| {
            let mut left = word;
            std::iter::from_fn(move || {
                let bit = (left != 0).then(|| left.trailing_zeros() as usize)?;
                left &= left - 1;
                Some(at * 64 + bit)
            })
        })
    }

    pub fn count(&self) -> usize {
        self.words.iter().map(|w| w.count_ones() as usize).sum()
    }
}

/// Makes a set from one flag per voxel, in array order.
impl FromIterator<bool> for VoxelSet {
    fn from_iter<I: IntoIterator<Item = bool>>(flags: I) -> VoxelSet {
        let mut bits = VoxelSet::default();
        for is_in in flags {
            if bits.len.is_multiple_of(64) {
                bits.words.push(0);
            }
            if let Some(last) = bits.words.last_mut() {
                *last |= u64::from(is_in) << (bits.len % 64);
            }
            bits.len += 1;
        }
        bits
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_goes_in_comes_out() {
        let flags: Vec<bool> = (0..200).map(|i| i % 7 == 3 || i == 63 || i == 199).collect();
        let bits: VoxelSet = flags.iter().copied().collect();
        assert!(flags.iter().enumerate().all(|(i, &f)| bits.contains(i) == f));
        let expected: Vec<usize> = (0..200).filter(|&i| flags[i]).collect();
        assert_eq!(bits.iter().collect::<Vec<_>>(), expected);
        assert_eq!(bits.count(), expected.len());
    }
}
