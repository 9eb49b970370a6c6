//! Separation of hard tissue into enamel and dentine.
//!
//! A voxel that is half enamel and half air has the value of dentine, so every enamel surface has a thin layer with
//! the value of dentine. Values within such a layer are not reliable: its voxels take the tissue of the nearest
//! reliable voxel.

use crate::import::segment::TissueClass;
use crate::import::segment::grey_levels::GreyLevels;
use typodont_core::volume::components::Components;
use typodont_core::volume::{Grid, distance};

/// Depth up to which a voxel can be only partly filled, voxels: scanner blur ends within two.
const SKIN: f32 = 2.0;

/// Volume below which a piece of one tissue within the other is noise, mm³.
const ISLAND: f64 = 0.5;

/// Separates hard tissue into enamel and dentine. Returns, for every voxel, whether the nearest hard tissue is
/// enamel.
pub(super) fn separate_enamel_and_dentine(
    grid: &Grid,
    values: &[f32],
    levels: &GreyLevels,
    matter: &mut [TissueClass],
) -> Vec<bool> {
    let enamel_from = levels.enamel_threshold();
    for (matter, &value) in matter.iter_mut().zip(values) {
        if matter.is_hard() && value >= enamel_from {
            *matter = TissueClass::Enamel;
        }
    }
    remove_islands(grid, matter, TissueClass::Enamel, TissueClass::Dentine);
    let nearest_enamel = is_nearest_reliable_enamel(grid, matter);
    for (matter, &is_enamel) in matter.iter_mut().zip(&nearest_enamel) {
        if matter.is_hard() {
            *matter = if is_enamel { TissueClass::Enamel } else { TissueClass::Dentine };
        }
    }
    remove_islands(grid, matter, TissueClass::Dentine, TissueClass::Enamel);
    remove_islands(grid, matter, TissueClass::Enamel, TissueClass::Dentine);
    nearest_enamel
}

/// Returns, for every voxel, whether the nearest reliable voxel is enamel. Reliable are bright enamel voxels, and
/// bodies of dentine that lie deeper than the unreliable layer.
fn is_nearest_reliable_enamel(grid: &Grid, matter: &[TissueClass]) -> Vec<bool> {
    let skin = SKIN * grid.spacing.max_element();
    let is_deep: Vec<bool> = distance::to_set(grid, |i| !matter[i].is_hard()).into_iter().map(|d| d > skin).collect();
    let bodies = Components::of(grid, |i| is_deep[i] && matter[i] == TissueClass::Dentine);
    let is_small = small_pieces(grid, &bodies);
    let is_body: Vec<bool> = (0..grid.len()).map(|i| bodies.at(i).is_some_and(|number| !is_small[number])).collect();
    drop((bodies, is_deep));
    let (_, nearest) = distance::to_nearest(grid, |i| matter[i] == TissueClass::Enamel || is_body[i]);
    nearest.into_iter().map(|index| matter[index as usize] == TissueClass::Enamel).collect()
}

/// Returns, for every piece, whether it is an island; the largest piece never is.
fn small_pieces(grid: &Grid, pieces: &Components) -> Vec<bool> {
    let largest = pieces.largest().map(|(number, _)| number);
    let is_small =
        |(number, &size): (usize, &usize)| Some(number) != largest && size as f64 * grid.voxel_mm3() < ISLAND;
    pieces.sizes().iter().enumerate().map(is_small).collect()
}

/// Reassigns small pieces of one tissue to the other.
fn remove_islands(grid: &Grid, matter: &mut [TissueClass], island: TissueClass, surrounding: TissueClass) {
    let pieces = Components::of(grid, |i| matter[i] == island);
    let is_small = small_pieces(grid, &pieces);
    for (index, matter) in matter.iter_mut().enumerate() {
        if pieces.at(index).is_some_and(|number| is_small[number]) {
            *matter = surrounding;
        }
    }
}
