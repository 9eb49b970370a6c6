//! Smoothed surface of a set of voxels that stays true to the set.

use crate::mesh::Mesh;
use crate::volume::surface::density_grid::{CellRange, DensityGrid};
use crate::volume::surface::extract_cells;
use crate::volume::{Density, Grid, Label, Volume};

/// Smoothing rounds: after four, steps of one voxel are gone, and more rounds change little.
const ROUNDS: usize = 4;

/// Least difference between a voxel's density and the iso value, as density: two of 255 steps.
const ISO_MARGIN: f32 = 2.0 / 255.0;

/// Smooth closed surface around the voxels for which `is_inside` is true: each of them stays inside it, every other
/// voxel outside.
pub fn of_mask(grid: &Grid, is_inside: impl Fn(usize) -> bool) -> Mesh {
    let Some(part) = PaddedMask::around(grid, is_inside) else { return Mesh::default() };
    let densities = part.smoothed();
    let end = part.grid.dims.map(|n| n as i32);
    extract_cells(DensityGrid { grid: &part.grid, densities: &densities }, CellRange { low: [-1; 3], end }, None)
}

/// The same set with the same smoothing, as a volume with one label on a grid of its own; `None` for an empty set.
pub fn volume_of_mask(grid: &Grid, is_inside: impl Fn(usize) -> bool, label: Label) -> Option<Volume> {
    let part = PaddedMask::around(grid, is_inside)?;
    let labels = vec![label; part.grid.len()];
    let band = grid.spacing.max_element();
    Some(Volume::new(part.grid, band, part.smoothed(), labels, label))
}

/// Smallest box around the set, padded by one voxel on every side, and the voxels of the set in it.
struct PaddedMask {
    grid: Grid,
    is_inside: Vec<bool>,
}

impl PaddedMask {
    fn around(whole: &Grid, is_inside: impl Fn(usize) -> bool) -> Option<PaddedMask> {
        let (mut low, mut high) = ([u32::MAX; 3], [0; 3]);
        let mut found = Vec::new();
        for (index, cell) in whole.cells().enumerate().filter(|(i, _)| is_inside(*i)) {
            debug_assert_eq!(whole.index(cell), index);
            found.push(cell);
            low = std::array::from_fn(|a| low[a].min(cell[a]));
            high = std::array::from_fn(|a| high[a].max(cell[a]));
        }
        if found.is_empty() {
            return None;
        }
        let dims = std::array::from_fn(|a| high[a] - low[a] + 3);
        let grid = Grid { dims, spacing: whole.spacing, origin: whole.centre(low) - whole.spacing };
        let mut inside = vec![false; grid.len()];
        for cell in found {
            inside[grid.index(std::array::from_fn(|a| cell[a] - low[a] + 1))] = true;
        }
        Some(PaddedMask { grid, is_inside: inside })
    }

    fn smoothed(&self) -> Vec<Density> {
        let mut values: Vec<f32> = self.is_inside.iter().map(|&i| f32::from(u8::from(i))).collect();
        for _ in 0..ROUNDS {
            for axis in 0..3 {
                blur(&self.grid, axis, &mut values);
            }
            for (value, is_inside) in values.iter_mut().zip(&self.is_inside) {
                *value = match is_inside {
                    true => value.max(0.5 + ISO_MARGIN),
                    false => value.min(0.5 - ISO_MARGIN),
                };
            }
        }
        values.into_iter().map(Density::from_unit).collect()
    }
}

/// Convolution with weights ¼, ½, ¼ along one axis; zero beyond the ends.
fn blur(grid: &Grid, axis: usize, values: &mut [f32]) {
    let [nx, ny, nz] = grid.dims.map(|n| n as usize);
    let (length, stride) = [(nx, 1), (ny, nx), (nz, nx * ny)][axis];
    for start in (0..grid.len()).filter(|i| i / stride % length == 0) {
        let mut before = 0.0;
        for i in 0..length {
            let at = start + i * stride;
            let after = if i + 1 < length { values[at + stride] } else { 0.0 };
            let here = values[at];
            values[at] = 0.25 * before + 0.5 * here + 0.25 * after;
            before = here;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Vec3;
    use crate::volume::surface::tests::is_watertight;

    #[test]
    fn a_set_of_voxels_gets_a_closed_surface_of_its_own_size() {
        let grid = Grid::centred([40, 44, 48], Vec3::splat(0.2));
        let radius = 3.0;
        let is_inside = |i: usize| grid.centre(grid.cell(i)).length() < radius;
        let mesh = of_mask(&grid, is_inside);
        let expected = 4.0 / 3.0 * std::f64::consts::PI * f64::from(radius).powi(3);
        assert!(is_watertight(&mesh));
        assert!((mesh.volume_mm3() / expected - 1.0).abs() < 0.03, "{} of {expected}", mesh.volume_mm3());
        // The surface is smooth: the normals are those of a ball, not of cubes.
        let off = |(p, n): (&Vec3, &Vec3)| n.angle_between(*p);
        let mean = mesh.positions.iter().zip(&mesh.normals).map(off).sum::<f32>() / mesh.positions.len() as f32;
        assert!(mean < 0.1, "{mean} rad");
    }

    #[test]
    fn a_single_voxel_is_not_smoothed_away_even_in_the_grids_corner() {
        let grid = Grid::centred([4, 4, 4], Vec3::ONE);
        let mesh = of_mask(&grid, |i| i == 0);
        assert!(is_watertight(&mesh) && mesh.volume_mm3() > 0.0);
        assert!(of_mask(&grid, |_| false).is_empty());
    }
}
