//! A volume with voxels joined, for adapters whose textures are too small for it.

use crate::volume::{BRICK, Density, Grid, Label, Volume, Voxel};

pub struct Coarse {
    /// Voxels joined along each axis.
    joined: u32,
    /// Of the volume it was made from.
    dims: [u32; 3],
    pub volume: Volume,
}

impl Coarse {
    /// How many voxels must be joined along each axis so that a volume fits within a limit; 1 when it fits.
    pub fn needed(dims: [u32; 3], limit: u32) -> u32 {
        dims.into_iter().map(|n| n.div_ceil(limit.max(1))).max().unwrap_or(1)
    }

    pub fn of(volume: &Volume, joined: u32) -> Coarse {
        let fine = volume.grid();
        let dims = fine.dims.map(|n| n.div_ceil(joined));
        let spacing = fine.spacing * joined as f32;
        let grid = Grid { dims, spacing, origin: fine.origin + fine.spacing * (0.5 * (joined as f32 - 1.0)) };
        let voxels: Vec<Voxel> = grid.cells().map(|cell| mean(volume, cell, joined)).collect();
        let densities = voxels.iter().map(|v| v.density).collect();
        let labels = voxels.iter().map(|v| v.label).collect();
        let band = volume.band().max(1.5 * spacing.max_element());
        let volume = Volume::restored(grid, band, densities, labels).expect("a mean of labelled matter is labelled");
        Coarse { joined, dims: fine.dims, volume }
    }

    /// True when this was made from a volume of that size, so coarse.
    pub fn is_of(&self, volume: &Volume, joined: u32) -> bool {
        self.joined == joined && self.dims == volume.grid().dims
    }

    /// Takes over changed bricks; gives the coarse bricks that changed.
    pub fn update(&mut self, volume: &Volume, changed: &[usize]) -> Vec<usize> {
        for &brick in changed {
            let corner = volume.bricks().corner(brick);
            let span = |a: usize| corner[a] / self.joined..(corner[a] + BRICK).min(self.dims[a]).div_ceil(self.joined);
            for z in span(2) {
                for y in span(1) {
                    for x in span(0) {
                        self.volume.set_cell([x, y, z], mean(volume, [x, y, z], self.joined));
                    }
                }
            }
        }
        self.volume.take_dirty()
    }
}

/// The mean density of joined voxels, with the label of the densest.
fn mean(volume: &Volume, cell: [u32; 3], joined: u32) -> Voxel {
    let grid = volume.grid();
    let span = |a: usize| cell[a] * joined..((cell[a] + 1) * joined).min(grid.dims[a]);
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
    use crate::frame::Vec3;
    use crate::volume::phantom;

    #[test]
    fn a_coarse_ball_is_as_large_and_follows_cuts() {
        let mut volume = phantom::ball([61, 50, 55], Vec3::splat(0.2), 4.0);
        for joined in [2, 3] {
            let mut coarse = Coarse::of(&volume, joined);
            let radius = |x: f32| coarse.volume.density_at(Vec3::X * x) - 0.5;
            assert!(radius(3.8) > 0.0 && radius(4.2) < 0.0, "the surface stays where it was");
            for z in 27..50 {
                volume.set_cell([30, 25, z], Voxel::AIR);
            }
            let changed = volume.take_dirty();
            assert!(!coarse.update(&volume, &changed).is_empty() || changed.is_empty());
            let anew = Coarse::of(&volume, joined);
            assert!(coarse.volume.densities() == anew.volume.densities());
            assert!(coarse.volume.labels() == anew.volume.labels());
        }
    }

    #[test]
    fn as_few_voxels_are_joined_as_will_do() {
        assert_eq!(Coarse::needed([512, 512, 322], 2048), 1);
        assert_eq!(Coarse::needed([512, 512, 322], 512), 1);
        assert_eq!(Coarse::needed([512, 512, 322], 256), 2);
        assert_eq!(Coarse::needed([512, 512, 700], 256), 3);
    }
}
