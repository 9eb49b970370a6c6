//! The surface of any set of voxels, smoothed without betraying the set.

use super::{Cells, Field, within};
use crate::mesh::Mesh;
use crate::volume::{Density, Grid, Label, Volume};

/// Rounds of smoothing: after four, stairs of one voxel are gone and more rounds change little.
const ROUNDS: usize = 4;

/// How far, at least, a voxel stays on its side of the surface, as density: two of 255 steps.
const ON_ITS_SIDE: f32 = 2.0 / 255.0;

/// A smooth closed surface around the voxels that are inside: each of them stays within it, every other outside.
pub fn of_mask(grid: &Grid, is_inside: impl Fn(usize) -> bool) -> Mesh {
    let Some(part) = Part::around(grid, is_inside) else { return Mesh::default() };
    let densities = part.smoothed();
    let end = part.grid.dims.map(|n| n as i32);
    within(Field { grid: &part.grid, densities: &densities }, Cells { low: [-1; 3], end })
}

/// The same set, smoothed alike, as matter of one label on a grid of its own; `None` for an empty set.
pub fn volume_of_mask(grid: &Grid, is_inside: impl Fn(usize) -> bool, label: Label) -> Option<Volume> {
    let part = Part::around(grid, is_inside)?;
    let labels = vec![label; part.grid.len()];
    let band = grid.spacing.max_element();
    Some(Volume::new(part.grid, band, part.smoothed(), labels, label))
}

/// The smallest box around the voxels, one voxel wider on every side, and which of its voxels are inside.
struct Part {
    grid: Grid,
    is_inside: Vec<bool>,
}

impl Part {
    fn around(whole: &Grid, is_inside: impl Fn(usize) -> bool) -> Option<Part> {
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
        Some(Part { grid, is_inside: inside })
    }

    fn smoothed(&self) -> Vec<Density> {
        let mut values: Vec<f32> = self.is_inside.iter().map(|&i| f32::from(u8::from(i))).collect();
        for _ in 0..ROUNDS {
            for axis in 0..3 {
                blur(&self.grid, axis, &mut values);
            }
            for (value, is_inside) in values.iter_mut().zip(&self.is_inside) {
                *value = match is_inside {
                    true => value.max(0.5 + ON_ITS_SIDE),
                    false => value.min(0.5 - ON_ITS_SIDE),
                };
            }
        }
        values.into_iter().map(Density::from_unit).collect()
    }
}

/// Weights ¼, ½, ¼ along one axis; nothing beyond the ends.
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
    use super::super::tests::is_watertight;
    use super::*;
    use crate::frame::Vec3;

    #[test]
    fn a_set_of_voxels_gets_a_closed_surface_of_its_own_size() {
        let grid = Grid::centred([40, 44, 48], Vec3::splat(0.2));
        let radius = 3.0;
        let is_inside = |i: usize| grid.centre(grid.cell(i)).length() < radius;
        let mesh = of_mask(&grid, is_inside);
        let expected = 4.0 / 3.0 * std::f64::consts::PI * f64::from(radius).powi(3);
        assert!(is_watertight(&mesh));
        assert!((mesh.volume_mm3() / expected - 1.0).abs() < 0.03, "{} of {expected}", mesh.volume_mm3());
        // Smooth: the normals are those of a ball, not of cubes.
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
