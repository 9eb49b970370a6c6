//! Ambient occlusion from the mean density around a point, which darkens pits and fissures.
//!
//! Stores the mean densities of cubes about half a millimetre wide, whatever the voxel size, and interpolates between
//! the centres of the cubes.

use typodont_core::frame::Vec3;
use typodont_core::volume::{BRICK, Grid, Volume};

/// Target width of a cube, mm: that of a fissure. 0.4 to 0.8 look alike.
const CUBE_WIDTH: f32 = 0.55;

/// Distance along the outward normal from a surface point to its occlusion sample, mm.
pub const SAMPLE_DISTANCE: f32 = 0.7;

/// Share of light lost where the occlusion sample lies entirely in matter. 0.5 still shows colours.
pub const MAX_OCCLUSION: f32 = 0.62;

/// Mean densities of cubes of voxels.
#[derive(Clone, Debug, PartialEq)]
pub struct OcclusionVolume {
    /// Voxels along a cube's edge: 1, 2, 4, 8 or 16.
    cube_voxels: u32,
    dims: [u32; 3],
    /// Mean densities, 0 to 255, x fastest.
    means: Vec<u8>,
}

impl OcclusionVolume {
    pub fn new(volume: &Volume) -> OcclusionVolume {
        let grid = volume.grid();
        let voxels = CUBE_WIDTH / grid.spacing.min_element();
        let edge = [1, 2, 4, 8, 16].into_iter().rfind(|&e| e as f32 <= 1.4 * voxels).unwrap_or(1);
        let dims = grid.dims.map(|n| n.div_ceil(edge));
        let mut occlusion =
            OcclusionVolume { cube_voxels: edge, dims, means: vec![0; dims.iter().map(|&n| n as usize).product()] };
        occlusion.rebuild(volume);
        occlusion
    }

    #[cfg(feature = "gpu")]
    pub fn cube_voxels(&self) -> u32 {
        self.cube_voxels
    }

    #[cfg(feature = "gpu")]
    pub fn dims(&self) -> [u32; 3] {
        self.dims
    }

    #[cfg(feature = "gpu")]
    pub fn means(&self) -> &[u8] {
        &self.means
    }

    /// Returns the mean density (0–1) at a point in voxel coordinates. Points outside the grid are clamped to its
    /// border.
    pub fn mean_at(&self, at: Vec3) -> f32 {
        let last = Vec3::from(self.dims.map(|n| n as f32 - 1.0));
        let place = ((at + 0.5) / self.cube_voxels as f32 - 0.5).clamp(Vec3::ZERO, last);
        let base = place.floor();
        let f = place - base;
        let next = (base + 1.0).min(last);
        let value = |x: f32, y: f32, z: f32| f32::from(self.means[self.index([x as u32, y as u32, z as u32])]);
        let mix = |a: f32, b: f32, t: f32| a + (b - a) * t;
        let along_x = |y: f32, z: f32| mix(value(base.x, y, z), value(next.x, y, z), f.x);
        let near = mix(along_x(base.y, base.z), along_x(next.y, base.z), f.y);
        let far = mix(along_x(base.y, next.z), along_x(next.y, next.z), f.y);
        mix(near, far, f.z) / 255.0
    }

    /// Returns the share of light that reaches a surface point in voxel coordinates; `outward` is the unit normal in
    /// voxels per mm.
    pub fn openness(&self, at: Vec3, outward: Vec3) -> f32 {
        1.0 - MAX_OCCLUSION * self.mean_at(at + outward * SAMPLE_DISTANCE)
    }

    /// Recomputes the cubes that overlap changed bricks. Returns their indices, each once.
    pub fn update(&mut self, volume: &Volume, changed: &[usize]) -> Vec<usize> {
        let mut cubes: Vec<usize> = Vec::new();
        for &brick in changed {
            let corner = volume.bricks().corner(brick);
            let span = |a: usize| {
                corner[a] / self.cube_voxels..(corner[a] + BRICK).min(volume.grid().dims[a]).div_ceil(self.cube_voxels)
            };
            for z in span(2) {
                for y in span(1) {
                    cubes.extend(span(0).map(|x| self.index([x, y, z])));
                }
            }
        }
        cubes.sort_unstable();
        cubes.dedup();
        for &cube in &cubes {
            self.means[cube] = self.mean_of_cube(volume, self.cube_at(cube));
        }
        cubes
    }

    /// Returns the coordinates of the cube at an index.
    pub fn cube_at(&self, index: usize) -> [u32; 3] {
        let [nx, ny, _] = self.dims.map(|n| n as usize);
        [(index % nx) as u32, (index / nx % ny) as u32, (index / (nx * ny)) as u32]
    }

    fn index(&self, [x, y, z]: [u32; 3]) -> usize {
        (z as usize * self.dims[1] as usize + y as usize) * self.dims[0] as usize + x as usize
    }

    /// Computes all cubes in one pass over the voxels.
    fn rebuild(&mut self, volume: &Volume) {
        let grid = volume.grid();
        let mut sums = vec![0u32; self.means.len()];
        for (row, values) in volume.densities().chunks_exact(grid.dims[0] as usize).enumerate() {
            let [y, z] = [row as u32 % grid.dims[1], row as u32 / grid.dims[1]];
            let first = self.index([0, y / self.cube_voxels, z / self.cube_voxels]);
            for (sum, run) in sums[first..].iter_mut().zip(values.chunks(self.cube_voxels as usize)) {
                *sum += run.iter().map(|d| u32::from(d.bits())).sum::<u32>();
            }
        }
        for (index, sum) in sums.into_iter().enumerate() {
            self.means[index] = self.rounded(grid, self.cube_at(index), sum);
        }
    }

    fn mean_of_cube(&self, volume: &Volume, cube: [u32; 3]) -> u8 {
        let grid = volume.grid();
        let span = |a: usize| cube[a] * self.cube_voxels..((cube[a] + 1) * self.cube_voxels).min(grid.dims[a]);
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
        let span = |a: usize| ((cube[a] + 1) * self.cube_voxels).min(grid.dims[a]) - cube[a] * self.cube_voxels;
        let count = span(0) * span(1) * span(2);
        ((sum + count / 2) / count) as u8
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::phantom;
    use typodont_core::volume::{Label, Voxel};

    #[test]
    fn a_pit_is_darker_than_a_flat_surface() {
        let grid = Grid::centred([80, 80, 60], Vec3::splat(0.1));
        // A plate with its top at z = 1, and a shaft 0.8 mm wide and 1.5 mm deep.
        let plate = |p: Vec3| {
            let in_shaft = f32::max(p.truncate().length() - 0.4, -0.5 - p.z);
            (f32::max(p.z - 1.0, -in_shaft), Label(1))
        };
        let volume = Volume::from_distance(grid, 0.15, plate);
        let occlusion = OcclusionVolume::new(&volume);
        let open = |p: Vec3| occlusion.openness(grid.from_tooth(p), Vec3::Z / grid.spacing);
        assert!(open(Vec3::new(2.8, 2.8, 1.0)) > 0.95, "{}", open(Vec3::new(2.8, 2.8, 1.0)));
        assert!(open(Vec3::new(0.0, 0.0, -0.5)) < 0.85, "{}", open(Vec3::new(0.0, 0.0, -0.5)));
    }

    #[test]
    fn an_update_equals_a_new_computation() {
        for spacing in [0.04, 0.1, 0.3, 0.8] {
            let mut volume = phantom::ball([37, 30, 41], Vec3::splat(spacing), 12.0 * spacing);
            let mut occlusion = OcclusionVolume::new(&volume);
            for cell in [[20, 15, 30], [21, 15, 30], [4, 3, 40], [36, 29, 0]] {
                volume.set_cell(cell, Voxel::AIR);
            }
            let changed = volume.take_dirty();
            occlusion.update(&volume, &changed);
            assert_eq!(occlusion, OcclusionVolume::new(&volume), "{spacing} mm");
        }
    }
}
