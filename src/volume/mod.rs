//! The tooth as voxels: how much matter, and which tissue.
//!
//! Takes densities, labels and a spacing in mm. Gives samples, gradients, distances, surfaces and pictures of them,
//! and changes itself only through ordered [`Edit`]s. Never knows a tissue's name, a device or a file.

mod bricks;
pub mod distance;
mod edit;
mod grid;
pub mod march;
pub mod rows;
mod sample;
pub mod solid;
pub mod surface;

pub use bricks::{BRICK, Bricks};
pub use edit::Edit;
pub use grid::Grid;

use crate::frame::Vec3;

/// Which tissue a voxel is made of; the number's meaning comes from a label table.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(transparent)]
pub struct Label(pub u8);

impl Label {
    /// Nothing there. The one label every table shares.
    pub const AIR: Label = Label(0);
}

/// How much of a voxel is filled with matter: 0 empty, 1 full. Stored in 8 bits today.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
#[repr(transparent)]
pub struct Density(u8);

impl Density {
    pub const EMPTY: Density = Density(0);
    pub const FULL: Density = Density(u8::MAX);

    /// The nearest storable density; values outside 0–1 are clamped.
    #[inline]
    pub fn from_unit(unit: f32) -> Density {
        Density((unit.clamp(0.0, 1.0) * f32::from(u8::MAX) + 0.5) as u8)
    }

    pub fn unit(self) -> f32 {
        f32::from(self.0) * (1.0 / f32::from(u8::MAX))
    }

    /// True on the matter side of the surface ([`ISO`]).
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

/// The density at which matter begins: the surface is where the interpolated density crosses it.
pub const ISO: f32 = 0.5;

/// What one voxel holds.
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
/// Every voxel with any density has a label: the thin outer half of a surface, where density is below [`ISO`], belongs to
/// the tissue under it. What counts as tissue is solid only ([`Volume::tissue`]). Every way of making or changing a volume
/// keeps this true, so that counting tissues and following the surface never disagree.
#[derive(Clone, Debug)]
pub struct Volume {
    grid: Grid,
    /// Half the width over which density rises from 0 to 1 across the surface, mm.
    band: f32,
    density: Vec<Density>,
    label: Vec<Label>,
    bricks: Bricks,
}

impl Volume {
    /// Puts a volume together from labels of what is solid: surfaces take the label of the tissue under them, and solid
    /// voxels without a label become `untold`.
    ///
    /// # Panics
    /// When the arrays' lengths differ from the grid's voxel count: the caller has read a file wrongly.
    pub fn new(grid: Grid, band: f32, density: Vec<Density>, mut label: Vec<Label>, untold: Label) -> Volume {
        assert_eq!(density.len(), grid.len(), "one density per voxel");
        assert_eq!(label.len(), grid.len(), "one label per voxel");
        assert!(band > 0.0 && untold != Label::AIR, "a surface has a width, and matter has a label");
        for (label, density) in label.iter_mut().zip(&density) {
            *label = match *label {
                _ if !density.is_solid() => Label::AIR,
                Label::AIR => untold,
                told => told,
            };
        }
        label_surfaces(&grid, &density, &mut label, untold);
        let bricks = Bricks::new(&grid, &density);
        Volume { grid, band, density, label, bricks }
    }

    /// A volume exactly as it was taken apart; `None` when a voxel with density lacks a label, or one without has one.
    pub fn restored(grid: Grid, band: f32, density: Vec<Density>, label: Vec<Label>) -> Option<Volume> {
        let is_whole = density.len() == grid.len() && label.len() == grid.len();
        let is_labelled = |(d, l): (&Density, &Label)| (*d > Density::EMPTY) == (*l != Label::AIR);
        if !is_whole || !density.iter().zip(&label).all(is_labelled) {
            return None;
        }
        let bricks = Bricks::new(&grid, &density);
        Some(Volume { grid, band, density, label, bricks })
    }

    /// Fills a grid from a signed distance to the surface in mm (negative inside) and a label for what is inside.
    ///
    /// `at` is asked once per voxel, with the voxel's centre in tooth space.
    pub fn from_distance(grid: Grid, band: f32, mut at: impl FnMut(Vec3) -> (f32, Label)) -> Volume {
        let mut density = Vec::with_capacity(grid.len());
        let mut label = Vec::with_capacity(grid.len());
        for [x, y, z] in grid.cells() {
            let (distance, tissue) = at(grid.centre([x, y, z]));
            density.push(ramp(distance, band));
            label.push(tissue);
        }
        Volume::new(grid, band, density, label, Label(1))
    }

    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Half the width of the density ramp across the surface, mm.
    pub fn band(&self) -> f32 {
        self.band
    }

    pub fn bricks(&self) -> &Bricks {
        &self.bricks
    }

    pub fn densities(&self) -> &[Density] {
        &self.density
    }

    /// The label of every voxel with any density; [`Label::AIR`] elsewhere.
    pub fn labels(&self) -> &[Label] {
        &self.label
    }

    /// The tissue of a solid voxel; [`Label::AIR`] for all others.
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

    /// Writes one voxel and says what changed. A voxel left without density loses its label.
    #[inline]
    pub fn set_cell(&mut self, cell: [u32; 3], voxel: Voxel) -> Edit {
        let index = self.grid.index(cell);
        let before = self.voxel(index);
        let after = if voxel.density > Density::EMPTY { voxel } else { Voxel::AIR };
        self.density[index] = after.density;
        self.label[index] = after.label;
        self.bricks.note(cell, before.density, after.density);
        Edit { index: index as u32, before, after }
    }

    /// [`Volume::set_cell`] for an array index.
    pub fn set(&mut self, index: usize, voxel: Voxel) -> Edit {
        self.set_cell(self.grid.cell(index), voxel)
    }

    /// Repeats an edit made on another copy of the same volume.
    ///
    /// Edits must come in the order they were made; `false` when this copy does not hold what the edit replaced.
    pub fn repeat(&mut self, edit: &Edit) -> bool {
        let matches = self.voxel(edit.index as usize) == edit.before;
        self.set(edit.index as usize, edit.after);
        matches
    }

    /// Gives every voxel with a label the one that `choose` names; density stays.
    pub fn relabel(&mut self, mut choose: impl FnMut(usize, Label) -> Label) {
        for (index, label) in self.label.iter_mut().enumerate() {
            if *label != Label::AIR {
                let chosen = choose(index, *label);
                debug_assert!(chosen != Label::AIR, "matter keeps a label");
                *label = chosen;
            }
        }
    }

    /// The bricks changed since the last call, in ascending order.
    pub fn take_dirty(&mut self) -> Vec<usize> {
        self.bricks.take_dirty()
    }

    /// Smallest box of voxel indices (both ends included) with any density; `None` for empty space.
    pub fn tight_box(&self) -> Option<[[u32; 3]; 2]> {
        self.bricks.tight_box(&self.grid, &self.density)
    }
}

/// Labels the voxels that have density without being solid: two rounds of asking the neighbours cover every ramp we make.
fn label_surfaces(grid: &Grid, density: &[Density], label: &mut [Label], untold: Label) {
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
    // What is left is noise far from anything solid.
    for index in open {
        label[index] = untold;
    }
}

/// Density at a signed distance (mm, negative inside) from the surface, rising over ±`band`.
#[inline]
pub fn ramp(distance: f32, band: f32) -> Density {
    Density::from_unit(0.5 - 0.5 * distance / band)
}

#[cfg(test)]
pub(crate) mod phantom {
    //! Known shapes for tests.
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
        assert_eq!(ramp(-9.0, 0.1), Density::FULL);
        assert_eq!(ramp(9.0, 0.1), Density::EMPTY);
    }

    #[test]
    fn a_voxel_that_is_emptied_becomes_air_and_the_copy_follows() {
        // Aim: whoever repeats the edits in order holds the same volume, and learns when it does not.
        let mut volume = phantom::ball([24, 24, 24], Vec3::splat(0.2), 1.5);
        let mut copy = volume.clone();
        let centre = volume.grid().index([12, 12, 12]);
        let edit = volume.set(centre, Voxel { density: Density::from_unit(0.3), label: Label(1) });
        assert_eq!(volume.tissue(centre), Label::AIR, "below iso nothing is left of the tissue");
        assert!(edit.removes());
        assert!(copy.repeat(&edit));
        assert!(!copy.repeat(&edit), "the same edit twice does not fit");
        assert_eq!(copy.voxel(centre), volume.voxel(centre));
    }

    #[test]
    fn the_tight_box_holds_all_matter_and_no_more() {
        let volume = phantom::ball([40, 50, 60], Vec3::new(0.2, 0.2, 0.2), 2.0);
        let [low, high] = volume.tight_box().unwrap();
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
