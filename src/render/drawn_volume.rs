//! The volume as it is drawn: smoothed over the neighbouring voxels, so that rays see the edge of a cut as a line and triangles
//! have smooth normals; or averaged, for GPUs whose textures are too small for it.
//!
//! Flat surfaces stay where they are. An edge is rounded by up to half a voxel, and matter thinner than a voxel disappears.

use typodont_core::parallel::par_map;
use typodont_core::volume::{BRICK, Density, Grid, Label, Volume, Voxel};

/// A volume that was made from another to be drawn.
pub struct DrawnVolume {
    /// Voxels of the original that are averaged into one along each axis; 1 if they are smoothed instead.
    factor: u32,
    /// Dimensions of the original volume, voxels.
    dims: [u32; 3],
    pub volume: Volume,
}

impl DrawnVolume {
    /// Returns the smallest factor by which a volume must be downsampled to fit within a limit; 1 when it fits
    /// already.
    #[cfg(feature = "gpu")]
    pub fn required_factor(dims: [u32; 3], limit: u32) -> u32 {
        dims.into_iter().map(|n| n.div_ceil(limit.max(1))).max().unwrap_or(1)
    }

    pub fn new(volume: &Volume, factor: u32) -> DrawnVolume {
        let dims = volume.grid().dims;
        let volume = if factor == 1 { smoothed(volume) } else { averaged(volume, factor) };
        DrawnVolume { factor, dims, volume }
    }

    /// True when this was made from a volume of the same dimensions with the same factor.
    pub fn matches(&self, volume: &Volume, factor: u32) -> bool {
        self.factor == factor && self.dims == volume.grid().dims
    }

    /// Applies changed bricks. Returns the bricks of the drawn volume that changed.
    pub fn update(&mut self, volume: &Volume, changed: &[usize]) -> Vec<usize> {
        // Bricks in which a label alone changed.
        let mut relabelled = Vec::new();
        for &brick in changed {
            let corner = volume.bricks().corner(brick);
            if self.factor == 1 {
                relabelled.extend(self.smooth_again(volume, corner));
                continue;
            }
            let span = |a: usize| corner[a] / self.factor..(corner[a] + BRICK).min(self.dims[a]).div_ceil(self.factor);
            for z in span(2) {
                for y in span(1) {
                    for x in span(0) {
                        self.volume.set_cell([x, y, z], mean_voxel(volume, [x, y, z], self.factor));
                    }
                }
            }
        }
        let mut bricks = self.volume.take_dirty();
        bricks.extend(relabelled);
        bricks.sort_unstable();
        bricks.dedup();
        bricks
    }

    /// Smooths a brick and the voxels around it. Returns the bricks of voxels whose label alone changed.
    fn smooth_again(&mut self, volume: &Volume, corner: [u32; 3]) -> Vec<usize> {
        let mut relabelled = Vec::new();
        let low = corner.map(|v| v.saturating_sub(1));
        let size = std::array::from_fn(|a| (corner[a] + BRICK + 1).min(self.dims[a]) - low[a]);
        let voxels = smoothed_box(volume, low, size);
        for (i, voxel) in voxels.into_iter().enumerate() {
            let i = i as u32;
            let cell = [low[0] + i % size[0], low[1] + i / size[0] % size[1], low[2] + i / (size[0] * size[1])];
            let before = self.volume.voxel(self.volume.grid().index(cell));
            if before != voxel {
                self.volume.set_cell(cell, voxel);
                if before.density == voxel.density {
                    relabelled.push(self.volume.bricks().index(cell.map(|v| v / BRICK)));
                }
            }
        }
        relabelled
    }
}

/// Means of each voxel's density and its neighbours', with weights of a quarter, a half and a quarter along each axis.
fn smoothed(volume: &Volume) -> Volume {
    let grid = *volume.grid();
    let [nx, ny, nz] = grid.dims;
    let layer = |number: usize| {
        let first = number as u32 * BRICK;
        smoothed_box(volume, [0, 0, first], [nx, ny, BRICK.min(nz - first)])
    };
    let layers = par_map(nz.div_ceil(BRICK) as usize, layer);
    let densities = layers.iter().flatten().map(|v| v.density).collect();
    let labels = layers.iter().flatten().map(|v| v.label).collect();
    Volume::from_parts(grid, volume.half_band(), densities, labels).expect("smoothed matter has a label")
}

/// Smoothed voxels of a box, x fastest. Beyond the grid there is nothing.
fn smoothed_box(volume: &Volume, low: [u32; 3], size: [u32; 3]) -> Vec<Voxel> {
    let grid = volume.grid();
    let size = size.map(|n| n as usize);
    let [wide, deep, high] = size.map(|n| n + 2);
    let mut sums = vec![0u16; wide * deep * high];
    for z in 0..high {
        for y in 0..deep {
            let (at_y, at_z) = (low[1] + y as u32, low[2] + z as u32);
            // One less than that is the row's place.
            if at_y == 0 || at_z == 0 || at_y > grid.dims[1] || at_z > grid.dims[2] {
                continue;
            }
            let first = low[0].saturating_sub(1);
            let last = (low[0] + size[0] as u32 + 1).min(grid.dims[0]);
            let start = grid.index([first, at_y - 1, at_z - 1]);
            let to = (z * deep + y) * wide + (first + 1 - low[0]) as usize;
            let row = &volume.densities()[start..start + (last - first) as usize];
            for (sum, density) in sums[to..].iter_mut().zip(row) {
                *sum = u16::from(density.bits());
            }
        }
    }
    // Along each axis in place: a sum is at the first of its three places.
    for stride in [1, wide, wide * deep] {
        for i in 0..sums.len() - 2 * stride {
            sums[i] += 2 * sums[i + stride] + sums[i + 2 * stride];
        }
    }
    let mut voxels = Vec::with_capacity(size.iter().product());
    for z in 0..size[2] {
        for y in 0..size[1] {
            let start = grid.index([low[0], low[1] + y as u32, low[2] + z as u32]);
            let labels = &volume.labels()[start..start + size[0]];
            let row = &sums[(z * deep + y) * wide..][..size[0]];
            for (x, (sum, label)) in row.iter().zip(labels).enumerate() {
                let density = Density::from_bits(((sum + 32) / 64) as u8);
                let label = match (density, *label) {
                    (Density::EMPTY, _) => Label::AIR,
                    (_, Label::AIR) => nearest_label(volume, [low[0] + x as u32, low[1] + y as u32, low[2] + z as u32]),
                    (_, label) => label,
                };
                voxels.push(Voxel { density, label });
            }
        }
    }
    voxels
}

/// Label of the densest voxel around one.
fn nearest_label(volume: &Volume, cell: [u32; 3]) -> Label {
    let grid = volume.grid();
    let span = |a: usize| cell[a].saturating_sub(1)..(cell[a] + 2).min(grid.dims[a]);
    let cells = span(2).flat_map(|z| span(1).flat_map(move |y| span(0).map(move |x| [x, y, z])));
    let voxels = cells.map(|cell| volume.voxel(grid.index(cell)));
    voxels.max_by_key(|voxel| voxel.density).map_or(Label::AIR, |voxel| voxel.label)
}

/// A volume in which `factor` voxels along each axis are averaged into one.
fn averaged(volume: &Volume, factor: u32) -> Volume {
    let fine = volume.grid();
    let dims = fine.dims.map(|n| n.div_ceil(factor));
    let spacing = fine.spacing * factor as f32;
    let grid = Grid { dims, spacing, origin: fine.origin + fine.spacing * (0.5 * (factor as f32 - 1.0)) };
    let voxels: Vec<Voxel> = grid.cells().map(|cell| mean_voxel(volume, cell, factor)).collect();
    let densities = voxels.iter().map(|v| v.density).collect();
    let labels = voxels.iter().map(|v| v.label).collect();
    let band = volume.half_band().max(1.5 * spacing.max_element());
    Volume::from_parts(grid, band, densities, labels).expect("averaged matter has a label")
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
    fn a_drawn_ball_keeps_its_size_and_follows_cuts() {
        let mut volume = phantom::ball([61, 50, 55], Vec3::splat(0.2), 4.0);
        for factor in [1, 2, 3] {
            let mut drawn = DrawnVolume::new(&volume, factor);
            let radius = |x: f32| drawn.volume.density_at(Vec3::X * x) - 0.5;
            assert!(radius(3.8) > 0.0 && radius(4.2) < 0.0, "the surface stays where it was");
            for z in 27..50 {
                volume.set_cell([30, 25, z], Voxel::AIR);
            }
            let changed = volume.take_dirty();
            assert!(!drawn.update(&volume, &changed).is_empty() || changed.is_empty());
            let anew = DrawnVolume::new(&volume, factor);
            assert!(drawn.volume.densities() == anew.volume.densities());
            assert!(drawn.volume.labels() == anew.volume.labels());
        }
    }

    #[test]
    fn smoothed_matter_is_what_the_weights_say() {
        // Aim: every voxel, also at the border of the grid. Method: random densities, and the sum over 27 neighbours.
        let grid = Grid::centred([13, 11, 19], Vec3::ONE);
        let mut state = 3u32;
        let mut random = || {
            state = state.wrapping_mul(1664525).wrapping_add(1013904223);
            (state >> 24) as u8
        };
        let densities: Vec<Density> =
            (0..grid.len()).map(|_| Density::from_bits(random().saturating_sub(128))).collect();
        let volume = Volume::new(grid, 1.0, densities, vec![Label(2); grid.len()], Label(2));
        let drawn = DrawnVolume::new(&volume, 1).volume;
        for (index, cell) in grid.cells().enumerate() {
            let mut sum = 0;
            for (dz, dy, dx) in (0..27).map(|n| (n / 9, n / 3 % 3, n % 3)) {
                let place: [i64; 3] = std::array::from_fn(|a| i64::from(cell[a]) + [dx, dy, dz][a] - 1);
                if (0..3).all(|a| (0..i64::from(grid.dims[a])).contains(&place[a])) {
                    let weight = [1u32, 2, 1][dx as usize] * [1, 2, 1][dy as usize] * [1, 2, 1][dz as usize];
                    sum += weight * u32::from(volume.voxel(grid.index(place.map(|v| v as u32))).density.bits());
                }
            }
            assert_eq!(u32::from(drawn.voxel(index).density.bits()), (sum + 32) / 64, "{cell:?}");
        }
    }

    #[test]
    fn a_brick_is_named_whose_labels_alone_changed() {
        // Aim: tissue that replaced another of the same density is seen. Method: a voxel in the middle of a ball.
        let mut volume = phantom::ball([40, 40, 40], Vec3::splat(0.2), 3.0);
        let mut drawn = DrawnVolume::new(&volume, 1);
        let brick = volume.bricks().index([2, 2, 2]);
        volume.set_cell([20, 20, 20], Voxel { density: Density::FULL, label: Label(7) });
        assert_eq!(drawn.update(&volume, &[brick]), [brick]);
        assert_eq!(drawn.update(&volume, &[brick]), []);
    }

    #[cfg(feature = "gpu")]
    #[test]
    fn the_smallest_sufficient_factor_is_chosen() {
        assert_eq!(DrawnVolume::required_factor([512, 512, 322], 2048), 1);
        assert_eq!(DrawnVolume::required_factor([512, 512, 322], 512), 1);
        assert_eq!(DrawnVolume::required_factor([512, 512, 322], 256), 2);
        assert_eq!(DrawnVolume::required_factor([512, 512, 700], 256), 3);
    }
}
