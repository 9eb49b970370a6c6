//! Bricks: cubes of voxels with their occupancy, clearance and change flags.
//!
//! They make queries in empty space cheap: one look-up shows that a tool is far from matter, whatever the size of the
//! volume.

use crate::volume::{CellBox, Density, Grid};

/// Voxels along one edge of a brick.
pub const BRICK: u32 = 8;

/// Occupancy, change flags and distance to the nearest matter, per brick of [`BRICK`]³ voxels.
#[derive(Clone, Debug)]
pub struct Bricks {
    dims: [u32; 3],
    /// Number of voxels with any density, per brick.
    occupied: Vec<u16>,
    /// Lower bound of the Chebyshev distance, in bricks, to the nearest occupied brick: reduced when matter is added,
    /// not increased when it is removed.
    clearance: Vec<u8>,
    dirty: Vec<bool>,
}

impl Bricks {
    pub(super) fn new(grid: &Grid, density: &[Density]) -> Bricks {
        let dims = grid.dims.map(|n| n.div_ceil(BRICK));
        let count = dims.iter().map(|&n| n as usize).product();
        let mut bricks = Bricks { dims, occupied: vec![0; count], clearance: Vec::new(), dirty: vec![false; count] };
        for (row, values) in density.chunks_exact(grid.dims[0] as usize).enumerate() {
            let [y, z] = [row as u32 % grid.dims[1], row as u32 / grid.dims[1]];
            for (bx, run) in values.chunks(BRICK as usize).enumerate() {
                let filled = run.iter().filter(|&&d| d > Density::EMPTY).count() as u16;
                let brick = bricks.index([bx as u32, y / BRICK, z / BRICK]);
                bricks.occupied[brick] += filled;
            }
        }
        bricks.clearance = bricks.compute_clearance();
        bricks
    }

    pub fn dims(&self) -> [u32; 3] {
        self.dims
    }

    pub fn len(&self) -> usize {
        self.occupied.len()
    }

    pub fn is_empty(&self) -> bool {
        self.occupied.is_empty()
    }

    pub fn index(&self, [x, y, z]: [u32; 3]) -> usize {
        (z as usize * self.dims[1] as usize + y as usize) * self.dims[0] as usize + x as usize
    }

    pub fn is_occupied(&self, brick: [u32; 3]) -> bool {
        self.occupied[self.index(brick)] > 0
    }

    /// First voxel of a brick.
    pub fn corner(&self, index: usize) -> [u32; 3] {
        let (nx, ny) = (self.dims[0] as usize, self.dims[1] as usize);
        [(index % nx) as u32 * BRICK, (index / nx % ny) as u32 * BRICK, (index / (nx * ny)) as u32 * BRICK]
    }

    /// Number of voxel steps around a voxel, in every direction, that are guaranteed to be empty.
    pub fn clear_steps(&self, [x, y, z]: [u32; 3]) -> u32 {
        let steps = u32::from(self.clearance[self.index([x / BRICK, y / BRICK, z / BRICK])]);
        // The nearest voxel of a brick `steps` away is at least `steps - 1` whole bricks from this voxel's brick.
        steps.saturating_sub(1) * BRICK
    }

    #[inline]
    pub(super) fn update(&mut self, [x, y, z]: [u32; 3], before: Density, after: Density) {
        let brick = self.index([x / BRICK, y / BRICK, z / BRICK]);
        self.dirty[brick] |= before != after;
        match (before > Density::EMPTY, after > Density::EMPTY) {
            (true, false) => self.occupied[brick] -= 1,
            (false, true) => {
                self.occupied[brick] += 1;
                if self.occupied[brick] == 1 {
                    self.propagate_occupancy([x / BRICK, y / BRICK, z / BRICK]);
                }
            }
            _ => {}
        }
    }

    /// Updates the clearance after matter was added to an empty brick.
    ///
    /// Proceeds outward shell by shell and stops at the first shell without a change: none can follow beyond it,
    /// because the clearances of neighbours differ by at most one.
    fn propagate_occupancy(&mut self, brick: [u32; 3]) {
        for steps in 0..=u32::from(u8::MAX) {
            let span = |a: usize| brick[a].saturating_sub(steps)..=(brick[a] + steps).min(self.dims[a] - 1);
            let mut changed = false;
            for z in span(2) {
                for y in span(1) {
                    let on_face = z.abs_diff(brick[2]) == steps || y.abs_diff(brick[1]) == steps;
                    for x in span(0).filter(|x| on_face || x.abs_diff(brick[0]) == steps) {
                        let index = self.index([x, y, z]);
                        if u32::from(self.clearance[index]) > steps {
                            self.clearance[index] = steps as u8;
                            changed = true;
                        }
                    }
                }
            }
            if !changed {
                return;
            }
        }
    }

    pub(super) fn take_dirty(&mut self) -> Vec<usize> {
        let dirty = (0..self.dirty.len()).filter(|&i| self.dirty[i]).collect();
        self.dirty.fill(false);
        dirty
    }

    /// Chebyshev distance to occupied bricks: exact after one forward and one backward pass over all 26 neighbours.
    fn compute_clearance(&self) -> Vec<u8> {
        let mut reach: Vec<u8> = self.occupied.iter().map(|&n| if n > 0 { 0 } else { u8::MAX }).collect();
        let mut relax = |index: usize| {
            let nearest = self.neighbours(index).map(|n| reach[n]).min().unwrap_or(u8::MAX);
            reach[index] = reach[index].min(nearest.saturating_add(1));
        };
        (0..self.len()).for_each(&mut relax);
        (0..self.len()).rev().for_each(&mut relax);
        reach
    }

    fn neighbours(&self, index: usize) -> impl Iterator<Item = usize> + use<'_> {
        let [x, y, z] = self.corner(index).map(|c| c / BRICK);
        let span = |v: u32, n: u32| v.saturating_sub(1)..=(v + 1).min(n - 1);
        span(z, self.dims[2]).flat_map(move |z| {
            span(y, self.dims[1]).flat_map(move |y| span(x, self.dims[0]).map(move |x| self.index([x, y, z])))
        })
    }

    pub(super) fn bounding_box(&self, grid: &Grid, density: &[Density]) -> Option<CellBox> {
        let mut found: Option<CellBox> = None;
        for brick in (0..self.len()).filter(|&b| self.occupied[b] > 0) {
            let corner = self.corner(brick);
            let end: [u32; 3] = std::array::from_fn(|a| (corner[a] + BRICK).min(grid.dims[a]));
            let whole = CellBox { low: corner, high: end.map(|v| v - 1) };
            if found.is_some_and(|known| known.contains(&whole)) {
                continue;
            }
            for z in corner[2]..end[2] {
                for y in corner[1]..end[1] {
                    for x in corner[0]..end[0] {
                        if density[grid.index([x, y, z])] > Density::EMPTY {
                            let cell = [x, y, z];
                            found = Some(found.map_or(CellBox { low: cell, high: cell }, |known| known.with(cell)));
                        }
                    }
                }
            }
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Vec3;
    use crate::volume::{Grid, Label, Voxel, phantom};

    #[test]
    fn clear_steps_never_promise_too_much() {
        // Aim: no matter within the guaranteed cube. Method: compare with a search over all voxels.
        let volume = phantom::ball([90, 70, 80], Vec3::splat(0.2), 2.0);
        let grid = *volume.grid();
        let matter: Vec<[u32; 3]> =
            grid.cells().filter(|&c| volume.voxel(grid.index(c)).density > Density::EMPTY).collect();
        let apart = |a: [u32; 3], b: [u32; 3]| (0..3).map(|i| a[i].abs_diff(b[i])).max().unwrap();
        let mut promised = 0;
        for cell in grid.cells().step_by(997) {
            let nearest = matter.iter().map(|&m| apart(m, cell)).min().unwrap();
            let clear = volume.bricks().clear_steps(cell);
            assert!(clear <= nearest, "{cell:?}: {clear} promised, matter at {nearest}");
            promised = promised.max(clear);
        }
        assert!(promised >= 2 * BRICK, "the guarantee must be useful: {promised}");
    }

    #[test]
    fn matter_put_into_empty_space_is_announced() {
        // Aim: after matter is added, look-ups equal those of a volume created with it.
        let grid = Grid::centred([64, 64, 64], Vec3::splat(0.2));
        let mut volume = phantom::ball([64, 64, 64], Vec3::splat(0.2), 1.0);
        volume.set(grid.index([60, 5, 40]), Voxel { density: Density::FULL, label: Label(1) });
        let made_so = Bricks::new(&grid, volume.densities());
        for cell in grid.cells().step_by(61) {
            assert_eq!(volume.bricks().clear_steps(cell), made_so.clear_steps(cell), "{cell:?}");
        }
    }

    #[test]
    fn a_change_marks_its_brick_once() {
        let mut volume = phantom::ball([32, 32, 32], Vec3::splat(0.2), 2.0);
        assert!(volume.take_dirty().is_empty());
        let index = volume.grid().index([17, 17, 17]);
        volume.set(index, Voxel::AIR);
        let [x, y, z] = [17 / BRICK; 3];
        assert_eq!(volume.take_dirty(), [volume.bricks().index([x, y, z])]);
        assert!(volume.take_dirty().is_empty());
    }
}
