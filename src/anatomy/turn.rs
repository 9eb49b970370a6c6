//! Setting a scanned tooth upright by exchanging axes: no voxel changes what it holds.

use super::Tissues;
use crate::frame::Vec3;
use crate::volume::{Density, Grid, Label, Volume};

/// A turn by right angles: which axis each new axis was, and whether it runs the other way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Turn {
    from: [usize; 3],
    is_reversed: [bool; 3],
}

/// Turns a tooth crown up and moves tooth space: z is 0 at the lowest enamel, x and y are 0 in the middle of the crown.
///
/// Never mirrors: a left tooth stays a left tooth.
pub(super) fn upright(
    (grid, density, label): (Grid, Vec<Density>, Vec<Label>),
    band: f32,
    tissues: &Tissues,
) -> Volume {
    let tissue = |i: usize| if density[i].is_solid() { label[i] } else { Label::AIR };
    let turn = Turn::that_lifts(crown_from_root(&grid, tissue, tissues.enamel));
    let mut turned = turn.grid(&grid);
    let (density, label) = (turn.array(&grid, density), turn.array(&grid, label));
    let solid_enamel = |i: usize| density[i].is_solid() && label[i] == tissues.enamel;
    turned.origin -= crown_foot(&turned, solid_enamel);
    Volume::new(turned, band, density, label, tissues.dentine)
}

/// The same of a volume. One without enamel, in which no crown can be told from a root, stays as it is.
pub fn set_upright(volume: Volume, tissues: &Tissues) -> Volume {
    if volume.count(tissues.enamel) == 0 {
        return volume;
    }
    let label = volume.tissues().collect();
    upright((*volume.grid(), volume.densities().to_vec(), label), volume.band(), tissues)
}

/// The way from the middle of everything else to the middle of the enamel, mm.
pub(super) fn crown_from_root(grid: &Grid, tissue: impl Fn(usize) -> Label, enamel: Label) -> Vec3 {
    // Whole numbers: sums over any scan are exact.
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

/// The middle of a crown's box along x and y, its lowest voxel along z.
pub(super) fn crown_foot(grid: &Grid, is_crown: impl Fn(usize) -> bool) -> Vec3 {
    let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    let [nx, ny, _] = grid.dims;
    // Row by row: only a row's first and last voxel of the crown can be on the box's sides.
    for row in 0..(grid.len() / nx as usize) as u32 {
        let start = row as usize * nx as usize;
        let of_crown = |x: &u32| is_crown(start + *x as usize);
        if let Some((first, last)) = (0..nx).find(of_crown).zip((0..nx).rfind(of_crown)) {
            let ends = [first, last].map(|x| grid.centre([x, row % ny, row / ny]));
            (low, high) = (low.min(ends[0]), high.max(ends[1]));
        }
    }
    match low.is_finite() {
        true => Vec3::new(0.5 * (low.x + high.x), 0.5 * (low.y + high.y), low.z),
        false => Vec3::ZERO,
    }
}

impl Turn {
    /// The turn that makes z of the axis along which `up` is longest.
    pub(super) fn that_lifts(up: Vec3) -> Turn {
        let length = up.abs();
        let axis = [1, 0].into_iter().fold(2, |most, axis| if length[axis] > length[most] { axis } else { most });
        let is_down = up[axis] < 0.0;
        // Exchanging axes in a ring mirrors nothing; nor does reversing two.
        Turn { from: [(axis + 1) % 3, (axis + 2) % 3, axis], is_reversed: [is_down, false, is_down] }
    }

    pub(super) fn grid(&self, grid: &Grid) -> Grid {
        let spacing = Vec3::from(self.from.map(|axis| grid.spacing[axis]));
        Grid::centred(self.from.map(|axis| grid.dims[axis]), spacing)
    }

    fn array<T: Copy>(&self, grid: &Grid, values: Vec<T>) -> Vec<T> {
        if *self == (Turn { from: [0, 1, 2], is_reversed: [false; 3] }) {
            return values;
        }
        self.grid(grid).cells().map(|cell| values[grid.index(self.before(grid, cell))]).collect()
    }

    /// Where a cell was before the turn.
    pub(super) fn before(&self, grid: &Grid, cell: [u32; 3]) -> [u32; 3] {
        let mut old = [0; 3];
        for (axis, &from) in self.from.iter().enumerate() {
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
            let turn = Turn::that_lifts(up);
            let turned = turn.grid(&grid);
            // Where the old axes' ways went: from three voxels that stood one step from a corner.
            let old_place = turn.array(&grid, grid.cells().map(|cell| grid.centre(cell)).collect());
            let step = |cell: [u32; 3]| (old_place[turned.index(cell)] - old_place[0]).normalize();
            let [x, y, z] = [step([1, 0, 0]), step([0, 1, 0]), step([0, 0, 1])];
            assert!(z.distance(up) < 1e-5, "{up}");
            assert!(x.cross(y).distance(z) < 1e-5, "{up} mirrors");
        }
    }
}
