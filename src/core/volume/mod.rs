//! Voxel volume: a density and a tissue label per voxel.
//!
//! Takes densities, labels and a spacing in mm. Gives samples, gradients, distances and surfaces, and changes only
//! through ordered [`Edit`]s. Never knows the name of a tissue, a device or a file.

mod bricks;
mod cell_box;
pub mod components;
pub mod distance;
mod edit;
mod grid;
mod hollowness;
pub mod redistance;
mod sample;
pub mod solid;
pub mod surface;
pub mod subgrid;

pub use bricks::{BRICK, Bricks};
pub use cell_box::CellBox;
pub use edit::Edit;
pub use grid::Grid;
pub use hollowness::hollowness;
pub use sample::RAY_LENGTH_MAX;

use crate::aabb::Aabb;
use crate::frame::Vec3;

/// Number of a tissue; its meaning is defined by a label table.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(transparent)]
pub struct Label(pub u8);

impl Label {
    /// Air: the one label with the same meaning in every table.
    pub const AIR: Label = Label(0);
}

/// Fraction of a voxel that is filled with matter: 0 empty, 1 full. Stored in 8 bits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
#[repr(transparent)]
pub struct Density(u8);

impl Density {
    pub const EMPTY: Density = Density(0);
    pub const FULL: Density = Density(u8::MAX);

    /// Returns the nearest storable density; values outside 0–1 are clamped.
    #[inline]
    pub fn from_unit(unit: f32) -> Density {
        Density((unit.clamp(0.0, 1.0) * f32::from(u8::MAX) + 0.5) as u8)
    }

    pub fn unit(self) -> f32 {
        f32::from(self.0) * (1.0 / f32::from(u8::MAX))
    }

    /// Returns true for the matter side of the surface (above [`ISO`]).
    pub fn is_solid(self) -> bool {
        self.0 > u8::MAX / 2
    }

    pub fn from_bits(bits: u8) -> Density {
        Density(bits)
    }

    pub fn bits(self) -> u8 {
        self.0
    }
}

/// Density at the surface: matter is where the interpolated density is higher.
pub const ISO: f32 = 0.5;

/// Content of one voxel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Voxel {
    pub density: Density,
    pub label: Label,
}

impl Voxel {
    pub const AIR: Voxel = Voxel { density: Density::EMPTY, label: Label::AIR };
}

/// Density and label per voxel on a regular grid, x fastest.
///
/// Every voxel with a density above zero has a label: the outer half of a surface's density ramp, where density is
/// below [`ISO`], has the label of the tissue under it. Only solid voxels count as tissue ([`Volume::tissue`]). Every
/// way to create or change a volume keeps this invariant, so that voxel counts and the surface always agree.
#[derive(Clone, Debug)]
pub struct Volume {
    grid: Grid,
    /// Half the width of the density ramp across the surface, mm.
    half_band: f32,
    density: Vec<Density>,
    label: Vec<Label>,
    bricks: Bricks,
}

impl Volume {
    /// Creates a volume from densities and the labels of solid voxels: the density ramp takes the label of the tissue
    /// under it, and solid voxels without a label get `default_label`.
    ///
    /// # Panics
    /// If the length of an array differs from the number of voxels, which indicates a bug in a file reader; or if
    /// `half_band` is not positive or `default_label` is [`Label::AIR`].
    pub fn new(
        grid: Grid,
        half_band: f32,
        density: Vec<Density>,
        mut label: Vec<Label>,
        default_label: Label,
    ) -> Volume {
        assert_eq!(density.len(), grid.len(), "one density per voxel");
        assert_eq!(label.len(), grid.len(), "one label per voxel");
        assert!(half_band > 0.0 && default_label != Label::AIR, "the density ramp needs a width, and matter a label");
        for (label, density) in label.iter_mut().zip(&density) {
            *label = match *label {
                _ if !density.is_solid() => Label::AIR,
                Label::AIR => default_label,
                known => known,
            };
        }
        label_surfaces(&grid, &density, &mut label, default_label);
        let bricks = Bricks::new(&grid, &density);
        Volume { grid, half_band, density, label, bricks }
    }

    /// Recreates a volume from the parts of another. `None` if a length is wrong, a voxel with density lacks a label,
    /// or one without density has one.
    pub fn from_parts(grid: Grid, half_band: f32, density: Vec<Density>, label: Vec<Label>) -> Option<Volume> {
        let is_whole = density.len() == grid.len() && label.len() == grid.len();
        let is_labelled = |(d, l): (&Density, &Label)| (*d > Density::EMPTY) == (*l != Label::AIR);
        if !is_whole || !density.iter().zip(&label).all(is_labelled) {
            return None;
        }
        let bricks = Bricks::new(&grid, &density);
        Some(Volume { grid, half_band, density, label, bricks })
    }

    /// Creates a volume from a signed distance to the surface in mm (negative inside) and the label of the inside.
    ///
    /// `at` is called once per voxel, with the voxel's centre in tooth space.
    pub fn from_distance(grid: Grid, half_band: f32, mut at: impl FnMut(Vec3) -> (f32, Label)) -> Volume {
        let mut density = Vec::with_capacity(grid.len());
        let mut label = Vec::with_capacity(grid.len());
        for [x, y, z] in grid.cells() {
            let (distance, tissue) = at(grid.centre([x, y, z]));
            density.push(density_at_distance(distance, half_band));
            label.push(tissue);
        }
        Volume::new(grid, half_band, density, label, Label(1))
    }

    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Half the width of the density ramp across the surface, mm.
    pub fn half_band(&self) -> f32 {
        self.half_band
    }

    pub fn bricks(&self) -> &Bricks {
        &self.bricks
    }

    pub fn densities(&self) -> &[Density] {
        &self.density
    }

    /// Labels of all voxels; [`Label::AIR`] where the density is zero.
    pub fn labels(&self) -> &[Label] {
        &self.label
    }

    /// Tissue of a solid voxel; [`Label::AIR`] for all others.
    #[inline]
    pub fn tissue(&self, index: usize) -> Label {
        if self.density[index].is_solid() { self.label[index] } else { Label::AIR }
    }

    /// [`Volume::tissue`] of every voxel, in array order.
    pub fn tissues(&self) -> impl Iterator<Item = Label> + '_ {
        self.density.iter().zip(&self.label).map(|(d, &l)| if d.is_solid() { l } else { Label::AIR })
    }

    pub fn voxel(&self, index: usize) -> Voxel {
        Voxel { density: self.density[index], label: self.label[index] }
    }

    /// Number of solid voxels of a tissue.
    pub fn count(&self, tissue: Label) -> usize {
        self.tissues().filter(|&l| l == tissue).count()
    }

    /// Writes one voxel and returns the edit. A voxel with zero density becomes air.
    ///
    /// # Panics
    /// If the cell is outside the grid.
    #[inline]
    pub fn set_cell(&mut self, cell: [u32; 3], voxel: Voxel) -> Edit {
        let index = self.grid.index(cell);
        let before = self.voxel(index);
        let after = if voxel.density > Density::EMPTY { voxel } else { Voxel::AIR };
        self.density[index] = after.density;
        self.label[index] = after.label;
        self.bricks.update(cell, before.density, after.density);
        Edit { index: index as u32, before, after }
    }

    /// [`Volume::set_cell`] for an array index.
    pub fn set(&mut self, index: usize, voxel: Voxel) -> Edit {
        self.set_cell(self.grid.cell(index), voxel)
    }

    /// Repeats an edit made on another copy of the same volume; returns `false` if this copy did not hold the content
    /// that the edit replaces.
    ///
    /// Edits must be applied in the order in which they were made.
    pub fn apply_edit(&mut self, edit: &Edit) -> bool {
        let matches = self.voxel(edit.index as usize) == edit.before;
        self.set(edit.index as usize, edit.after);
        matches
    }

    /// Replaces the label of every labelled voxel by the one that `choose` returns; densities stay.
    pub fn relabel(&mut self, mut choose: impl FnMut(usize, Label) -> Label) {
        for (index, label) in self.label.iter_mut().enumerate() {
            if *label != Label::AIR {
                let chosen = choose(index, *label);
                debug_assert!(chosen != Label::AIR, "matter must keep a label");
                *label = chosen;
            }
        }
    }

    /// Returns the bricks changed since the last call, in ascending order.
    pub fn take_dirty(&mut self) -> Vec<usize> {
        self.bricks.take_dirty()
    }

    /// Smallest box of voxel indices (both ends inclusive) that contains all matter; `None` for an empty volume.
    pub fn bounding_box(&self) -> Option<CellBox> {
        self.bricks.bounding_box(&self.grid, &self.density)
    }

    /// Box around the centres of all voxels with matter, tooth space, mm; of an empty volume, that of its grid.
    pub fn extent(&self) -> Aabb {
        self.bounding_box().map_or(self.grid.extent(), |cells| self.grid.extent_of(&cells))
    }
}

/// Labels the voxels that have density without being solid. Two rounds of spreading labels to neighbours cover every
/// density ramp that the program makes.
fn label_surfaces(grid: &Grid, density: &[Density], label: &mut [Label], default_label: Label) {
    let mut open: Vec<usize> =
        (0..grid.len()).filter(|&i| density[i] > Density::EMPTY && label[i] == Label::AIR).collect();
    for _ in 0..2 {
        let mut found = Vec::new();
        for &index in &open {
            let under = grid.neighbours(index).filter(|&n| label[n] != Label::AIR).max_by_key(|&n| density[n]);
            found.extend(under.map(|n| (index, label[n])));
        }
        for (index, name) in found {
            label[index] = name;
        }
        open.retain(|&index| label[index] == Label::AIR);
    }
    // Any remaining voxels are noise far from anything solid.
    for index in open {
        label[index] = default_label;
    }
}

/// Density at a signed distance (mm, negative inside) from the surface, with a ramp of ±`half_band` mm.
#[inline]
pub fn density_at_distance(distance: f32, half_band: f32) -> Density {
    Density::from_unit(0.5 - 0.5 * distance / half_band)
}

#[cfg(test)]
pub(crate) mod phantom {
    //! Test volumes of known shape.
    use super::*;

    pub fn ball(dims: [u32; 3], spacing: Vec3, radius: f32) -> Volume {
        let grid = Grid::centred(dims, spacing);
        let band = 2.0 * spacing.max_element();
        Volume::from_distance(grid, band, |p| (p.length() - radius, Label(1)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn density_round_trips_and_iso_is_a_half() {
        for bits in 0..=255 {
            assert_eq!(Density::from_unit(Density::from_bits(bits).unit()).bits(), bits);
        }
        assert!(Density::from_unit(0.51).is_solid());
        assert!(!Density::from_unit(0.49).is_solid());
        assert_eq!(density_at_distance(-9.0, 0.1), Density::FULL);
        assert_eq!(density_at_distance(9.0, 0.1), Density::EMPTY);
    }

    #[test]
    fn a_voxel_that_is_emptied_becomes_air_and_the_copy_follows() {
        // Aim: applying the edits in order reproduces the volume, and a mismatch is reported.
        let mut volume = phantom::ball([24, 24, 24], Vec3::splat(0.2), 1.5);
        let mut copy = volume.clone();
        let centre = volume.grid().index([12, 12, 12]);
        let edit = volume.set(centre, Voxel { density: Density::from_unit(0.3), label: Label(1) });
        assert_eq!(volume.tissue(centre), Label::AIR, "a voxel below iso is no tissue");
        assert!(edit.removes());
        assert!(copy.apply_edit(&edit));
        assert!(!copy.apply_edit(&edit), "the same edit twice does not fit");
        assert_eq!(copy.voxel(centre), volume.voxel(centre));
    }

    #[test]
    fn the_tight_box_holds_all_matter_and_no_more() {
        let volume = phantom::ball([40, 50, 60], Vec3::new(0.2, 0.2, 0.2), 2.0);
        let CellBox { low, high } = volume.bounding_box().unwrap();
        let solid = |i: [u32; 3]| volume.voxel(volume.grid().index(i)).density > Density::EMPTY;
        for [x, y, z] in volume.grid().cells() {
            if solid([x, y, z]) {
                assert!((0..3).all(|a| low[a] <= [x, y, z][a] && [x, y, z][a] <= high[a]));
            }
        }
        assert!(volume.grid().cells().any(|c| c[0] == low[0] && solid(c)));
        assert!(volume.grid().cells().any(|c| c[2] == high[2] && solid(c)));
    }
}
