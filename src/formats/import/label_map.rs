//! Conversion of a tooth's label map into a volume: the voxels as labelled, the surface without voxel steps.

use typodont_core::volume::redistance;
use typodont_core::volume::redistance::signed_distance_from_field;
use typodont_core::volume::subgrid::PaddedGrid;
use typodont_core::volume::{CellBox, Density, Grid, Label, Volume, density_at_distance, distance};

/// Number of smoothing passes: after six, the voxel steps no longer show in the surface normals.
const ROUNDS: usize = 6;

/// Minimum distance between a voxel centre and the smoothed surface, voxels: smoothing never moves the surface across
/// a voxel centre.
const HOLD: f32 = 0.05;

/// Margin of empty voxels that smoothing needs around the matter, in addition to the surface's own.
const SPARE: [u32; 3] = [1; 3];

/// Converts a label map into a volume. Every voxel keeps its label and stays solid or empty, as labelled.
///
/// The grid stays that of the map; it grows by a few voxels only where matter lies at its border. Returns `None` for
/// an empty map.
pub fn volume_from_label_map(grid: &Grid, label: Vec<Label>) -> Option<Volume> {
    let drawn = grid.cells().zip(&label).filter(|(_, l)| **l != Label::AIR).map(|(cell, _)| cell);
    let window = PaddedGrid::around(grid, &CellBox::around(drawn)?, SPARE);
    let label = window.crop(label, Label::AIR);
    let grid = &window.grid;
    let default_label = label.iter().copied().find(|&l| l != Label::AIR)?;

    let mut field = distance::signed(grid, |i| label[i] != Label::AIR);
    let hold = HOLD * grid.spacing.min_element();
    for _ in 0..ROUNDS {
        redistance::binomial_smooth(grid, &mut field);
        for (distance, &label) in field.iter_mut().zip(&label) {
            *distance = if label != Label::AIR { distance.min(-hold) } else { distance.max(hold) };
        }
    }
    field.iter_mut().for_each(|distance| *distance = -*distance);
    let signed_distance = signed_distance_from_field(grid, &field, redistance::max_distance(grid));
    drop(field);
    let band = redistance::half_band(grid);
    let density = signed_distance.into_iter().map(|distance| density_at_distance(distance, band)).collect();
    let (density, label) = (window.paste(density, Density::EMPTY), window.paste(label, Label::AIR));
    Some(Volume::new(window.enlarged_whole(), band, density, label, default_label))
}

#[cfg(test)]
mod tests {
    use super::*;
    use typodont_core::frame::Vec3;

    #[test]
    fn a_drawn_ball_is_round_and_keeps_its_voxels() {
        // Aim: no voxel steps. Method: on the surface of a labelled ball the gradient points outward within a few
        // degrees.
        let grid = Grid::centred([48, 48, 48], Vec3::splat(0.2));
        let is_drawn = |cell| grid.centre(cell).length() < 3.5;
        let label: Vec<Label> = grid.cells().map(|c| if is_drawn(c) { Label(4) } else { Label::AIR }).collect();
        let volume = volume_from_label_map(&grid, label.clone()).unwrap();
        assert_eq!(*volume.grid(), grid);
        assert!(volume.tissues().eq(label));
        let mut worst = 1.0f32;
        for (index, cell) in grid.cells().enumerate() {
            let (density, out) = (volume.voxel(index).density.unit(), grid.centre(cell));
            if (0.3..0.7).contains(&density) {
                let (_, gradient) = volume.density_and_gradient_at(out);
                worst = worst.min(-gradient.normalize().dot(out.normalize()));
            }
        }
        assert!(worst > 0.97, "{worst}");
    }

    #[test]
    fn matter_at_the_border_gets_room() {
        let grid = Grid::centred([5, 6, 7], Vec3::ONE);
        let volume = volume_from_label_map(&grid, vec![Label(2); grid.len()]).unwrap();
        assert_eq!(volume.grid().dims, [11, 12, 13]);
        assert_eq!(volume.count(Label(2)), grid.len());
        assert!(volume_from_label_map(&grid, vec![Label::AIR; grid.len()]).is_none());
    }
}
