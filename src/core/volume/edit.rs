//! Record of one changed voxel, by which all copies of a volume are kept up to date.

use crate::volume::Voxel;

/// Old and new content of a voxel. A sequence of edits, applied in order, turns one copy of a volume into another.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Edit {
    /// Array index in the volume's grid.
    pub index: u32,
    pub before: Voxel,
    pub after: Voxel,
}

impl Edit {
    /// Returns true if matter became air.
    pub fn removes(&self) -> bool {
        self.before.density.is_solid() && !self.after.density.is_solid()
    }

    /// Returns the edit as eight bytes, for digests: index (little-endian), old density and label, new density and
    /// label.
    pub fn bytes(&self) -> [u8; 8] {
        let [a, b, c, d] = self.index.to_le_bytes();
        let (before, after) = (self.before, self.after);
        [a, b, c, d, before.density.bits(), before.label.0, after.density.bits(), after.label.0]
    }
}
