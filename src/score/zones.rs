//! Which voxels a zone holds.

use super::bits::Bits;
use super::crop::Crop;
use crate::frame::Vec3;
use crate::scenario::{Region, Zone};
use crate::volume::{Grid, Label, Volume, distance};

/// One flag per voxel of the volume at the start.
pub fn mask(zone: &Zone, initial: &Volume) -> Bits {
    let grid = initial.grid();
    match &zone.region {
        Region::Tissue(label) => initial.tissues().map(|l| l == *label).collect(),
        Region::Around { label, within } => around(initial, *label, *within),
        region @ (Region::Sphere { .. } | Region::Box { .. } | Region::Cylinder { .. }) => {
            matter_where(initial, |p| region.holds(p))
        }
        // A map of another size belongs to another tooth: it marks nothing here.
        Region::Mask(mask) if mask.dims == grid.dims => {
            mask.is_inside.iter().zip(initial.tissues()).map(|(&inside, l)| inside && l != Label::AIR).collect()
        }
        Region::Mask(_) => initial.tissues().map(|_| false).collect(),
    }
}

fn matter_where(initial: &Volume, is_inside: impl Fn(Vec3) -> bool) -> Bits {
    let grid: &Grid = initial.grid();
    let tissues = initial.tissues().zip(grid.cells());
    tissues.map(|(l, cell)| l != Label::AIR && is_inside(grid.centre(cell))).collect()
}

/// Matter within a distance of a tissue, the tissue itself left out.
fn around(initial: &Volume, label: Label, within: f32) -> Bits {
    let grid = initial.grid();
    let is_label = |i: usize| initial.tissue(i) == label;
    let margin = (within / grid.spacing.min_element()).ceil() as u32 + 1;
    let Some(crop) = Crop::around(grid, margin, (0..grid.len()).filter(|&i| is_label(i))) else {
        return initial.tissues().map(|_| false).collect();
    };
    let distance = distance::to_set(&crop.grid, |i| is_label(crop.whole_index(i)));
    let is_near = |voxel: usize| crop.index_of(voxel).is_some_and(|i| distance[i] <= within);
    initial.tissues().enumerate().map(|(i, l)| l != Label::AIR && l != label && is_near(i)).collect()
}
