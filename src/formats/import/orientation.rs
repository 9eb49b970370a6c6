//! Setting a scanned tooth upright by permuting axes, which resamples nothing.

use typodont_anatomy::TissueLabels;
use typodont_core::aabb::Aabb;
use typodont_core::frame::Vec3;
use typodont_core::volume::{Density, Grid, Label, Volume};

/// A rotation by right angles: the source of each new axis, and whether the axis is reversed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AxisPermutation {
    source_axis: [usize; 3],
    is_reversed: [bool; 3],
}

/// Rotates a tooth crown up and moves the origin of tooth space: z is 0 at the lowest enamel, x and y are 0 in the
/// middle of the crown.
///
/// Never mirrors: a left tooth stays a left tooth. Returns with it the rotation, for further values of the same grid.
pub fn upright(
    (grid, density, label): (Grid, Vec<Density>, Vec<Label>),
    band: f32,
    tissues: &TissueLabels,
) -> (Volume, AxisPermutation) {
    let tissue = |i: usize| if density[i].is_solid() { label[i] } else { Label::AIR };
    let permutation = AxisPermutation::lifting(crown_from_root(&grid, tissue, tissues.enamel));
    let mut upright_grid = permutation.grid(&grid);
    let (density, label) = (permutation.array(&grid, density), permutation.array(&grid, label));
    let solid_enamel = |i: usize| density[i].is_solid() && label[i] == tissues.enamel;
    upright_grid.origin -= crown_foot(&upright_grid, solid_enamel);
    (Volume::new(upright_grid, band, density, label, tissues.dentine), permutation)
}

/// Does the same for a volume. A volume without enamel, in which crown and root cannot be told apart, is returned
/// unchanged.
pub fn set_upright(volume: Volume, tissues: &TissueLabels) -> Volume {
    if volume.count(tissues.enamel) == 0 {
        return volume;
    }
    let label = volume.tissues().collect();
    upright((*volume.grid(), volume.densities().to_vec(), label), volume.half_band(), tissues).0
}

/// Returns the vector from the centroid of all other matter to the centroid of the enamel, mm.
pub fn crown_from_root(grid: &Grid, tissue: impl Fn(usize) -> Label, enamel: Label) -> Vec3 {
    // Integer sums are exact for scans of any size.
    let mut sums = [[0u64; 4]; 2];
    for (index, cell) in grid.cells().enumerate() {
        let tissue = tissue(index);
        if tissue != Label::AIR {
            let sum = &mut sums[usize::from(tissue == enamel)];
            (0..3).for_each(|axis| sum[axis] += u64::from(cell[axis]));
            sum[3] += 1;
        }
    }
    let middle = |[x, y, z, count]: [u64; 4]| [x, y, z].map(|sum| (sum as f64 / count.max(1) as f64) as f32);
    let [root, crown] = sums.map(|sum| Vec3::from(middle(sum)) * grid.spacing);
    crown - root
}

/// Returns the middle of the crown's bounding box along x and y and its lowest voxel along z, mm.
pub fn crown_foot(grid: &Grid, is_crown: impl Fn(usize) -> bool) -> Vec3 {
    let mut crown = Aabb::EMPTY;
    let [nx, ny, _] = grid.dims;
    // Row by row: only the first and the last crown voxel of a row can touch the box.
    for row in 0..(grid.len() / nx as usize) as u32 {
        let start = row as usize * nx as usize;
        let of_crown = |x: &u32| is_crown(start + *x as usize);
        if let Some((first, last)) = (0..nx).find(of_crown).zip((0..nx).rfind(of_crown)) {
            let ends = [first, last].map(|x| grid.centre([x, row % ny, row / ny]));
            crown = crown.with(ends[0]).with(ends[1]);
        }
    }
    match crown.is_empty() {
        true => Vec3::ZERO,
        false => crown.centre().with_z(crown.low.z),
    }
}

impl AxisPermutation {
    /// Returns the rotation that turns the axis along which `up` is longest into z.
    pub fn lifting(up: Vec3) -> AxisPermutation {
        let length = up.abs();
        let axis = [1, 0].into_iter().fold(2, |most, axis| if length[axis] > length[most] { axis } else { most });
        let is_down = up[axis] < 0.0;
        // Neither a cyclic permutation of the axes nor the reversal of two of them mirrors.
        AxisPermutation { source_axis: [(axis + 1) % 3, (axis + 2) % 3, axis], is_reversed: [is_down, false, is_down] }
    }

    pub fn grid(&self, grid: &Grid) -> Grid {
        let spacing = Vec3::from(self.source_axis.map(|axis| grid.spacing[axis]));
        Grid::centred(self.source_axis.map(|axis| grid.dims[axis]), spacing)
    }

    /// Returns the values of a grid, one per voxel, in the order of the rotated grid.
    pub fn array<T: Copy>(&self, grid: &Grid, values: Vec<T>) -> Vec<T> {
        if *self == (AxisPermutation { source_axis: [0, 1, 2], is_reversed: [false; 3] }) {
            return values;
        }
        self.grid(grid).cells().map(|cell| values[grid.index(self.source_cell(grid, cell))]).collect()
    }

    /// Returns the cell that `cell` was before the rotation.
    pub fn source_cell(&self, grid: &Grid, cell: [u32; 3]) -> [u32; 3] {
        let mut old = [0; 3];
        for (axis, &from) in self.source_axis.iter().enumerate() {
            old[from] = if self.is_reversed[axis] { grid.dims[from] - 1 - cell[axis] } else { cell[axis] };
        }
        old
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_lift_brings_its_axis_up_and_mirrors_nothing() {
        let grid = Grid::centred([3, 4, 5], Vec3::new(0.1, 0.2, 0.3));
        for up in [Vec3::X, Vec3::Y, Vec3::Z, Vec3::NEG_X, Vec3::NEG_Y, Vec3::NEG_Z] {
            let permutation = AxisPermutation::lifting(up);
            let turned = permutation.grid(&grid);
            // The directions of the old axes, from three voxels one step away from a corner.
            let old_place = permutation.array(&grid, grid.cells().map(|cell| grid.centre(cell)).collect());
            let step = |cell: [u32; 3]| (old_place[turned.index(cell)] - old_place[0]).normalize();
            let [x, y, z] = [step([1, 0, 0]), step([0, 1, 0]), step([0, 0, 1])];
            assert!(z.distance(up) < 1e-5, "{up}");
            assert!(x.cross(y).distance(z) < 1e-5, "{up} mirrors");
        }
    }
}
