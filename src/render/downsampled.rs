//! A downsampled volume, for GPUs whose textures are too small for the original.

use typodont_core::volume::{BRICK, Density, Grid, Label, Volume, Voxel};

/// A volume in which `factor` voxels along each axis are averaged into one.
pub struct DownsampledVolume {
    /// Voxels averaged along each axis.
    factor: u32,
    /// Dimensions of the original volume, voxels.
    dims: [u32; 3],
    pub volume: Volume,
}

impl DownsampledVolume {
    /// Returns the smallest factor by which a volume must be downsampled to fit within a limit; 1 when it fits
    /// already.
    pub fn required_factor(dims: [u32; 3], limit: u32) -> u32 {
        dims.into_iter().map(|n| n.div_ceil(limit.max(1))).max().unwrap_or(1)
    }

    pub fn new(volume: &Volume, factor: u32) -> DownsampledVolume {
        let fine = volume.grid();
        let dims = fine.dims.map(|n| n.div_ceil(factor));
        let spacing = fine.spacing * factor as f32;
        let grid = Grid { dims, spacing, origin: fine.origin + fine.spacing * (0.5 * (factor as f32 - 1.0)) };
        let voxels: Vec<Voxel> = grid.cells().map(|cell| mean_voxel(volume, cell, factor)).collect();
        let densities = voxels.iter().map(|v| v.density).collect();
        let labels = voxels.iter().map(|v| v.label).collect();
        let band = volume.half_band().max(1.5 * spacing.max_element());
        let volume = Volume::from_parts(grid, band, densities, labels).expect("averaged matter has a label");
        DownsampledVolume { factor, dims: fine.dims, volume }
    }

    /// True when this was made from a volume of the same dimensions with the same factor.
    pub fn matches(&self, volume: &Volume, factor: u32) -> bool {
        self.factor == factor && self.dims == volume.grid().dims
    }

    /// Applies changed bricks. Returns the downsampled bricks that changed.
    pub fn update(&mut self, volume: &Volume, changed: &[usize]) -> Vec<usize> {
        for &brick in changed {
            let corner = volume.bricks().corner(brick);
            let span = |a: usize| corner[a] / self.factor..(corner[a] + BRICK).min(self.dims[a]).div_ceil(self.factor);
            for z in span(2) {
                for y in span(1) {
                    for x in span(0) {
                        self.volume.set_cell([x, y, z], mean_voxel(volume, [x, y, z], self.factor));
                    }
                }
            }
        }
        self.volume.take_dirty()
    }
}

/// Returns the mean density of a block of voxels, with the label of the densest one.
fn mean_voxel(volume: &Volume, cell: [u32; 3], factor: u32) -> Voxel {
    let grid = volume.grid();
    let span = |a: usize| cell[a] * factor..((cell[a] + 1) * factor).min(grid.dims[a]);
    let (mut sum, mut count, mut densest) = (0u32, 0u32, Voxel::AIR);
    for z in span(2) {
        for y in span(1) {
            for x in span(0) {
                let voxel = volume.voxel(grid.index([x, y, z]));
                sum += u32::from(voxel.density.bits());
                count += 1;
                if voxel.density > densest.density {
                    densest = voxel;
                }
            }
        }
    }
    let density = Density::from_bits(((sum + count / 2) / count) as u8);
    let label = if density > Density::EMPTY { densest.label } else { Label::AIR };
    Voxel { density, label }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::phantom;
    use typodont_core::frame::Vec3;

    #[test]
    fn a_downsampled_ball_keeps_its_size_and_follows_cuts() {
        let mut volume = phantom::ball([61, 50, 55], Vec3::splat(0.2), 4.0);
        for factor in [2, 3] {
            let mut coarse = DownsampledVolume::new(&volume, factor);
            let radius = |x: f32| coarse.volume.density_at(Vec3::X * x) - 0.5;
            assert!(radius(3.8) > 0.0 && radius(4.2) < 0.0, "the surface stays where it was");
            for z in 27..50 {
                volume.set_cell([30, 25, z], Voxel::AIR);
            }
            let changed = volume.take_dirty();
            assert!(!coarse.update(&volume, &changed).is_empty() || changed.is_empty());
            let anew = DownsampledVolume::new(&volume, factor);
            assert!(coarse.volume.densities() == anew.volume.densities());
            assert!(coarse.volume.labels() == anew.volume.labels());
        }
    }

    #[test]
    fn the_smallest_sufficient_factor_is_chosen() {
        assert_eq!(DownsampledVolume::required_factor([512, 512, 322], 2048), 1);
        assert_eq!(DownsampledVolume::required_factor([512, 512, 322], 512), 1);
        assert_eq!(DownsampledVolume::required_factor([512, 512, 322], 256), 2);
        assert_eq!(DownsampledVolume::required_factor([512, 512, 700], 256), 3);
    }
}
