//! The voxels of zones.

use super::cropped_grid::CroppedGrid;
use super::voxel_set::VoxelSet;
use crate::scenario::{Zone, ZoneRegion};
use typodont_core::frame::Vec3;
use typodont_core::volume::{Grid, Label, Volume, distance};

/// Returns the voxels of a zone in the volume at the start.
pub fn mask(zone: &Zone, initial: &Volume) -> VoxelSet {
    let grid = initial.grid();
    match &zone.region {
        ZoneRegion::Tissue(label) => initial.tissues().map(|l| l == *label).collect(),
        ZoneRegion::Around { label, within } => around(initial, *label, *within),
        region @ (ZoneRegion::Sphere { .. } | ZoneRegion::Box { .. } | ZoneRegion::Cylinder { .. }) => {
            matter_where(initial, |p| region.contains(p))
        }
        // A map of another size belongs to another tooth and marks nothing here.
        ZoneRegion::Mask(mask) if mask.dims == grid.dims => {
            mask.is_inside.iter().zip(initial.tissues()).map(|(&inside, l)| inside && l != Label::AIR).collect()
        }
        ZoneRegion::Mask(_) => initial.tissues().map(|_| false).collect(),
    }
}

fn matter_where(initial: &Volume, is_inside: impl Fn(Vec3) -> bool) -> VoxelSet {
    let grid: &Grid = initial.grid();
    let tissues = initial.tissues().zip(grid.cells());
    tissues.map(|(l, cell)| l != Label::AIR && is_inside(grid.centre(cell))).collect()
}

/// Returns the matter within a distance (mm) of a tissue, without the tissue itself.
fn around(initial: &Volume, label: Label, within: f32) -> VoxelSet {
    let grid = initial.grid();
    let is_label = |i: usize| initial.tissue(i) == label;
    let margin = (within / grid.spacing.min_element()).ceil() as u32 + 1;
    let Some(crop) = CroppedGrid::around(grid, margin, (0..grid.len()).filter(|&i| is_label(i))) else {
        return initial.tissues().map(|_| false).collect();
    };
    let distance = distance::to_set(&crop.grid, |i| is_label(crop.whole_index(i)));
    let is_near = |voxel: usize| crop.index_of(voxel).is_some_and(|i| distance[i] <= within);
    initial.tissues().enumerate().map(|(i, l)| l != Label::AIR && l != label && is_near(i)).collect()
}
