//! Where hard matter is enamel and where dentine.
//!
//! A voxel that is half enamel and half air looks like dentine, so every enamel surface wears a skin of dentine's value.
//! The values within such a skin are not believed: it takes the matter of the nearest voxel that can be.

use super::Matter;
use super::levels::Levels;
use crate::anatomy::pieces::Pieces;
use crate::volume::{Grid, distance};

/// How deep a voxel can be only partly filled, voxels: the blur of scanners ends within two.
const SKIN: f32 = 2.0;

/// Smaller pieces of one tissue within the other are noise, mm³.
const ISLAND: f64 = 0.5;

/// Parts hard matter into enamel and dentine. Returns whether the nearest hard matter of any voxel is enamel.
pub(super) fn part(grid: &Grid, values: &[f32], levels: &Levels, matter: &mut [Matter]) -> Vec<bool> {
    let enamel_from = levels.enamel_from();
    for (matter, &value) in matter.iter_mut().zip(values) {
        if matter.is_hard() && value >= enamel_from {
            *matter = Matter::Enamel;
        }
    }
    drown_islands(grid, matter, Matter::Enamel, Matter::Dentine);
    let nearest_enamel = believe_the_sure(grid, matter);
    for (matter, &is_enamel) in matter.iter_mut().zip(&nearest_enamel) {
        if matter.is_hard() {
            *matter = if is_enamel { Matter::Enamel } else { Matter::Dentine };
        }
    }
    drown_islands(grid, matter, Matter::Dentine, Matter::Enamel);
    drown_islands(grid, matter, Matter::Enamel, Matter::Dentine);
    nearest_enamel
}

/// Whether the nearest voxel that can be believed is enamel: a bright one, or one of a body that lies deeper than the skin.
fn believe_the_sure(grid: &Grid, matter: &[Matter]) -> Vec<bool> {
    let skin = SKIN * grid.spacing.max_element();
    let is_deep: Vec<bool> = distance::to_set(grid, |i| !matter[i].is_hard()).into_iter().map(|d| d > skin).collect();
    let bodies = Pieces::of(grid, |i| is_deep[i] && matter[i] == Matter::Dentine);
    let is_small = small(grid, &bodies);
    let is_body: Vec<bool> = (0..grid.len()).map(|i| bodies.at(i).is_some_and(|number| !is_small[number])).collect();
    drop((bodies, is_deep));
    let (_, nearest) = distance::to_nearest(grid, |i| matter[i] == Matter::Enamel || is_body[i]);
    nearest.into_iter().map(|index| matter[index as usize] == Matter::Enamel).collect()
}

/// Which pieces are islands; the largest never is.
fn small(grid: &Grid, pieces: &Pieces) -> Vec<bool> {
    let largest = pieces.largest().map(|(number, _)| number);
    let is_small =
        |(number, &size): (usize, &usize)| Some(number) != largest && size as f64 * grid.voxel_mm3() < ISLAND;
    pieces.sizes().iter().enumerate().map(is_small).collect()
}

/// Gives small pieces of one tissue to the other.
fn drown_islands(grid: &Grid, matter: &mut [Matter], island: Matter, sea: Matter) {
    let pieces = Pieces::of(grid, |i| matter[i] == island);
    let is_small = small(grid, &pieces);
    for (index, matter) in matter.iter_mut().enumerate() {
        if pieces.at(index).is_some_and(|number| is_small[number]) {
            *matter = sea;
        }
    }
}
