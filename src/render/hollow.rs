//! How much matter lies around a place, for the shade in pits and fissures.
//!
//! Mean densities of cubes about half a millimetre wide, whatever the voxels' size, read between cubes' middles.

use crate::frame::Vec3;
use crate::volume::{BRICK, Grid, Volume};

/// Width that a cube comes near to, mm: a fissure's. 0.4 to 0.8 look alike.
const CUBE: f32 = 0.55;

/// Way outward from a surface to the place whose surroundings shade it, mm.
pub const REACH: f32 = 0.7;

/// Share of light that is lost where that place is all matter. 0.5 still shows colours.
pub const DARKEST: f32 = 0.62;

#[derive(Clone, Debug, PartialEq)]
pub struct Hollow {
    /// Voxels along a cube's edge: 1, 2, 4, 8 or 16.
    edge: u32,
    dims: [u32; 3],
    /// Mean density, 0 to 255, x fastest.
    mean: Vec<u8>,
}

impl Hollow {
    pub fn of(volume: &Volume) -> Hollow {
        let grid = volume.grid();
        let voxels = CUBE / grid.spacing.min_element();
        let edge = [1, 2, 4, 8, 16].into_iter().rfind(|&e| e as f32 <= 1.4 * voxels).unwrap_or(1);
        let dims = grid.dims.map(|n| n.div_ceil(edge));
        let mut hollow = Hollow { edge, dims, mean: vec![0; dims.iter().map(|&n| n as usize).product()] };
        hollow.fill(volume);
        hollow
    }

    pub fn edge(&self) -> u32 {
        self.edge
    }

    pub fn dims(&self) -> [u32; 3] {
        self.dims
    }

    pub fn mean(&self) -> &[u8] {
        &self.mean
    }

    /// Mean density (0–1) around a place in voxel steps; beyond the border as at the border.
    pub fn at(&self, at: Vec3) -> f32 {
        let last = Vec3::from(self.dims.map(|n| n as f32 - 1.0));
        let place = ((at + 0.5) / self.edge as f32 - 0.5).clamp(Vec3::ZERO, last);
        let base = place.floor();
        let f = place - base;
        let next = (base + 1.0).min(last);
        let value = |x: f32, y: f32, z: f32| f32::from(self.mean[self.index([x as u32, y as u32, z as u32])]);
        let mix = |a: f32, b: f32, t: f32| a + (b - a) * t;
        let along_x = |y: f32, z: f32| mix(value(base.x, y, z), value(next.x, y, z), f.x);
        let near = mix(along_x(base.y, base.z), along_x(next.y, base.z), f.y);
        let far = mix(along_x(base.y, next.z), along_x(next.y, next.z), f.y);
        mix(near, far, f.z) / 255.0
    }

    /// Share of light that reaches a surface: `outward` is the unit normal in voxel steps per mm.
    pub fn openness(&self, at: Vec3, outward: Vec3) -> f32 {
        1.0 - DARKEST * self.at(at + outward * REACH)
    }

    /// Looks again at changed bricks. Gives the cubes looked at, each once.
    pub fn update(&mut self, volume: &Volume, changed: &[usize]) -> Vec<usize> {
        let mut cubes: Vec<usize> = Vec::new();
        for &brick in changed {
            let corner = volume.bricks().corner(brick);
            let span =
                |a: usize| corner[a] / self.edge..(corner[a] + BRICK).min(volume.grid().dims[a]).div_ceil(self.edge);
            for z in span(2) {
                for y in span(1) {
                    cubes.extend(span(0).map(|x| self.index([x, y, z])));
                }
            }
        }
        cubes.sort_unstable();
        cubes.dedup();
        for &cube in &cubes {
            self.mean[cube] = self.measured(volume, self.cube(cube));
        }
        cubes
    }

    /// The cube at an index.
    pub fn cube(&self, index: usize) -> [u32; 3] {
        let [nx, ny, _] = self.dims.map(|n| n as usize);
        [(index % nx) as u32, (index / nx % ny) as u32, (index / (nx * ny)) as u32]
    }

    fn index(&self, [x, y, z]: [u32; 3]) -> usize {
        (z as usize * self.dims[1] as usize + y as usize) * self.dims[0] as usize + x as usize
    }

    /// All cubes in one pass over the voxels.
    fn fill(&mut self, volume: &Volume) {
        let grid = volume.grid();
        let mut sums = vec![0u32; self.mean.len()];
        for (row, values) in volume.densities().chunks_exact(grid.dims[0] as usize).enumerate() {
            let [y, z] = [row as u32 % grid.dims[1], row as u32 / grid.dims[1]];
            let first = self.index([0, y / self.edge, z / self.edge]);
            for (sum, run) in sums[first..].iter_mut().zip(values.chunks(self.edge as usize)) {
                *sum += run.iter().map(|d| u32::from(d.bits())).sum::<u32>();
            }
        }
        for (index, sum) in sums.into_iter().enumerate() {
            self.mean[index] = self.rounded(grid, self.cube(index), sum);
        }
    }

    fn measured(&self, volume: &Volume, cube: [u32; 3]) -> u8 {
        let grid = volume.grid();
        let span = |a: usize| cube[a] * self.edge..((cube[a] + 1) * self.edge).min(grid.dims[a]);
        let mut sum = 0;
        for z in span(2) {
            for y in span(1) {
                let first = grid.index([span(0).start, y, z]);
                let row = &volume.densities()[first..first + span(0).len()];
                sum += row.iter().map(|d| u32::from(d.bits())).sum::<u32>();
            }
        }
        self.rounded(grid, cube, sum)
    }

    fn rounded(&self, grid: &Grid, cube: [u32; 3], sum: u32) -> u8 {
        let span = |a: usize| ((cube[a] + 1) * self.edge).min(grid.dims[a]) - cube[a] * self.edge;
        let count = span(0) * span(1) * span(2);
        ((sum + count / 2) / count) as u8
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::{Label, Voxel, phantom};

    #[test]
    fn a_pit_is_darker_than_a_plain() {
        let grid = Grid::centred([80, 80, 60], Vec3::splat(0.1));
        // A plate with its top at z = 1 and a shaft of 0.8 mm, 1.5 mm deep.
        let plate = |p: Vec3| {
            let in_shaft = f32::max(p.truncate().length() - 0.4, -0.5 - p.z);
            (f32::max(p.z - 1.0, -in_shaft), Label(1))
        };
        let volume = Volume::from_distance(grid, 0.15, plate);
        let hollow = Hollow::of(&volume);
        let open = |p: Vec3| hollow.openness(grid.from_tooth(p), Vec3::Z / grid.spacing);
        assert!(open(Vec3::new(2.8, 2.8, 1.0)) > 0.95, "{}", open(Vec3::new(2.8, 2.8, 1.0)));
        assert!(open(Vec3::new(0.0, 0.0, -0.5)) < 0.85, "{}", open(Vec3::new(0.0, 0.0, -0.5)));
    }

    #[test]
    fn looking_again_is_as_good_as_looking_anew() {
        for spacing in [0.04, 0.1, 0.3, 0.8] {
            let mut volume = phantom::ball([37, 30, 41], Vec3::splat(spacing), 12.0 * spacing);
            let mut hollow = Hollow::of(&volume);
            for cell in [[20, 15, 30], [21, 15, 30], [4, 3, 40], [36, 29, 0]] {
                volume.set_cell(cell, Voxel::AIR);
            }
            let changed = volume.take_dirty();
            hollow.update(&volume, &changed);
            assert_eq!(hollow, Hollow::of(&volume), "{spacing} mm");
        }
    }
}
