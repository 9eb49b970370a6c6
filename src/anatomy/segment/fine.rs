//! Large scans: tissues are told apart on a coarser grid, and each fine voxel is asked only what its neighbours there leave
//! open.
//!
//! The blur of a scanner and the tissues themselves are as wide in millimetres as ever; finer voxels only place the
//! borders between them. So on the surface a fine voxel's own value decides, and within, where the coarse grid's tissues
//! weigh alike.

use super::levels::Levels;
use super::{Matter, Told, Unclear, label_of, tell_apart};
use crate::anatomy::turn::{Turn, crown_foot, crown_from_root};
use crate::anatomy::{Tissues, slope};
use crate::frame::Vec3;
use crate::volume::rows::{in_rows, processors};
use crate::volume::{Density, Grid, Label, Volume};

/// Most voxels that are told apart as they are; that takes about a microsecond a voxel.
const WHOLE_MAX: usize = 6_000_000;

/// Voxels of the coarser grid: a large molar at 0.18 mm, which is about the blur of scanners that see whole teeth.
const COARSE: f64 = 2_000_000.0;

/// Labels of a tooth's tissues, upright as [`super::segment`] sets it. Density is all or nothing: enough to be written, seen
/// and counted, too steep to be touched.
pub fn labels(grid: &Grid, values: Vec<f32>, tissues: &Tissues) -> Result<Volume, Unclear> {
    match grid.len() <= WHOLE_MAX {
        true => super::segment(grid, values, tissues),
        false => coarse_to_fine(grid, &values, tissues),
    }
}

fn coarse_to_fine(grid: &Grid, values: &[f32], tissues: &Tissues) -> Result<Volume, Unclear> {
    let blocks = Blocks::of(grid);
    let told = tell_apart(&blocks.coarse, blocks.means(grid, values))?;
    let coarse = told.window.grid;
    let tissue = |i: usize| label_of(told.matter[i], tissues);
    let turn = Turn::that_lifts(crown_from_root(&coarse, tissue, tissues.enamel));
    let mut turned = turn.grid(grid);
    let neighbours = Neighbours::of(&told);
    let mut label = vec![Label::AIR; turned.len()];
    let [nx, ny, _] = turned.dims;
    in_rows(&mut label, nx, processors(), |row, labels| {
        for (x, label) in (0..).zip(labels) {
            let cell = turn.before(grid, [x, row % ny, row / ny]);
            let at = (grid.centre(cell) - coarse.origin) / coarse.spacing;
            *label = label_of(neighbours.matter_at(at, values[grid.index(cell)]), tissues);
        }
    });
    keep_largest(turned.dims, &mut label);
    turned.origin -= crown_foot(&turned, |i| label[i] == tissues.enamel);
    let density = label.iter().map(|l| if *l == Label::AIR { Density::EMPTY } else { Density::FULL }).collect();
    Ok(Volume::new(turned, slope::band(&turned), density, label, tissues.dentine))
}

/// A grid whose voxels are blocks of another's.
struct Blocks {
    /// Voxels of a block along each axis; at the far sides blocks may be cut short.
    counts: [u32; 3],
    coarse: Grid,
}

impl Blocks {
    fn of(grid: &Grid) -> Blocks {
        let side = (grid.len() as f64 * grid.voxel_mm3() / COARSE).cbrt() as f32;
        let counts = grid.spacing.to_array().map(|spacing| (side / spacing).round().max(1.0) as u32);
        let dims = [0, 1, 2].map(|axis| grid.dims[axis].div_ceil(counts[axis]));
        let wide = Vec3::from(counts.map(|n| n as f32));
        let origin = grid.origin + 0.5 * (wide - 1.0) * grid.spacing;
        Blocks { counts, coarse: Grid { dims, spacing: grid.spacing * wide, origin } }
    }

    /// The mean of each block; NaN where nothing in it is a number.
    fn means(&self, grid: &Grid, values: &[f32]) -> Vec<f32> {
        let [bx, by, bz] = self.counts.map(|n| n as usize);
        let [nx, ny, nz] = grid.dims.map(|n| n as usize);
        let mut means = vec![f32::NAN; self.coarse.len()];
        let [cx, cy, _] = self.coarse.dims;
        in_rows(&mut means, cx, processors(), |row, means| {
            let (first_y, first_z) = ((row % cy) as usize * by, (row / cy) as usize * bz);
            let mut sums = vec![(0.0f32, 0.0f32); means.len()];
            for z in first_z..(first_z + bz).min(nz) {
                for y in first_y..(first_y + by).min(ny) {
                    let line = &values[(z * ny + y) * nx..][..nx];
                    for ((sum, count), block) in sums.iter_mut().zip(line.chunks(bx)) {
                        for value in block.iter().filter(|value| !value.is_nan()) {
                            *sum += value;
                            *count += 1.0;
                        }
                    }
                }
            }
            for (mean, (sum, count)) in means.iter_mut().zip(sums) {
                *mean = sum / count;
            }
        });
        means
    }
}

/// What the coarse grid says about any place in it.
struct Neighbours<'a> {
    told: &'a Told,
    levels: Levels,
    /// Of each coarse voxel: whether it and all around it are solid, or empty, so that no value there is asked.
    is_sure: Vec<bool>,
}

impl Neighbours<'_> {
    fn of(told: &Told) -> Neighbours<'_> {
        let grid = &told.window.grid;
        let is_air = |cell: [u32; 3]| told.matter[grid.index(cell)] == Matter::Air;
        let is_sure = |cell: [u32; 3]| {
            let [xs, ys, zs] =
                [0, 1, 2].map(|axis| cell[axis].saturating_sub(1)..=(cell[axis] + 1).min(grid.dims[axis] - 1));
            let own = is_air(cell);
            zs.into_iter().all(|z| ys.clone().all(|y| xs.clone().all(|x| is_air([x, y, z]) == own)))
        };
        Neighbours { told, levels: told.levels, is_sure: grid.cells().map(is_sure).collect() }
    }

    /// The matter of a fine voxel, by its place in coarse voxels and its own value.
    fn matter_at(&self, at: Vec3, value: f32) -> Matter {
        let Told { window, matter, nearest_enamel, .. } = self.told;
        let grid = &window.grid;
        let limit = |v: f32, n: u32| (v >= -0.5 && v <= n as f32 - 0.5).then(|| v.clamp(0.0, n as f32 - 1.0));
        let [Some(x), Some(y), Some(z)] = [0, 1, 2].map(|axis| limit(at[axis], grid.dims[axis])) else {
            return Matter::Air;
        };
        let nearest = grid.index([(x + 0.5) as u32, (y + 0.5) as u32, (z + 0.5) as u32]);
        if self.is_sure[nearest] && matter[nearest] == Matter::Air {
            return Matter::Air;
        }
        let is_enamel_near = nearest_enamel[nearest];
        if !self.is_sure[nearest] && matter[nearest] != Matter::Pulp {
            let full = if is_enamel_near { self.levels.enamel } else { self.levels.dentine };
            let half_full = 0.5 * (self.levels.background + full);
            if value.is_nan() || value < half_full {
                return Matter::Air;
            }
        }
        // Solid: of what, is where the tissues around weigh most.
        let [low, high] =
            [[x as u32, y as u32, z as u32], [0, 1, 2].map(|a| ([x, y, z][a] as u32 + 1).min(grid.dims[a] - 1))];
        let share = Vec3::new(x.fract(), y.fract(), z.fract());
        let [mut enamel, mut dentine, mut pulp] = [0.0f32; 3];
        for corner in 0..8 {
            let pick = |axis: usize| if corner >> axis & 1 == 1 { high[axis] } else { low[axis] };
            let weigh = |axis: usize| if corner >> axis & 1 == 1 { share[axis] } else { 1.0 - share[axis] };
            let weight = weigh(0) * weigh(1) * weigh(2);
            match matter[grid.index([pick(0), pick(1), pick(2)])] {
                Matter::Enamel => enamel += weight,
                Matter::Dentine => dentine += weight,
                Matter::Pulp => pulp += weight,
                Matter::Air => {}
            }
        }
        if pulp > enamel.max(dentine) {
            Matter::Pulp
        } else if enamel > dentine || (enamel + dentine == 0.0 && is_enamel_near) {
            Matter::Enamel
        } else {
            Matter::Dentine
        }
    }
}

/// Empties all but the largest piece; pieces are joined row by row, so that the memory taken follows the surface.
fn keep_largest([nx, ny, _]: [u32; 3], label: &mut [Label]) {
    struct Run {
        start: u32,
        end: u32,
        /// Another run of the same piece; itself for the first.
        root: u32,
    }
    fn find(runs: &mut [Run], mut n: u32) -> u32 {
        while runs[n as usize].root != n {
            let next = runs[n as usize].root;
            runs[n as usize].root = runs[next as usize].root;
            n = runs[n as usize].root;
        }
        n
    }
    let mut runs: Vec<Run> = Vec::new();
    // Where each row's runs begin.
    let mut rows: Vec<usize> = vec![0];
    for (row, labels) in label.chunks_exact(nx as usize).enumerate() {
        let mut at = 0;
        let own = runs.len();
        while let Some(start) = labels[at..].iter().position(|l| *l != Label::AIR).map(|step| at + step) {
            let end = labels[start..].iter().position(|l| *l == Label::AIR).map_or(labels.len(), |step| start + step);
            let number = runs.len() as u32;
            runs.push(Run { start: start as u32, end: end as u32, root: number });
            at = end;
        }
        let beside = [(!(row as u32).is_multiple_of(ny)).then(|| row - 1), row.checked_sub(ny as usize)];
        for other in beside.into_iter().flatten() {
            let (mut theirs, last) = (rows[other], rows[other + 1]);
            let mut ours = own;
            while ours < runs.len() && theirs < last {
                if runs[ours].start < runs[theirs].end && runs[theirs].start < runs[ours].end {
                    let [a, b] = [ours, theirs].map(|n| find(&mut runs, n as u32));
                    runs[a.max(b) as usize].root = a.min(b);
                }
                if runs[ours].end < runs[theirs].end { ours += 1 } else { theirs += 1 }
            }
        }
        rows.push(runs.len());
    }
    let mut sizes = vec![0u64; runs.len()];
    for n in 0..runs.len() {
        let root = find(&mut runs, n as u32);
        sizes[root as usize] += u64::from(runs[n].end - runs[n].start);
    }
    let Some(largest) = (0..sizes.len()).rev().max_by_key(|&n| sizes[n]) else { return };
    for (row, pair) in rows.windows(2).enumerate() {
        for n in pair[0]..pair[1] {
            if find(&mut runs, n as u32) as usize != largest {
                let start = row * nx as usize;
                label[start + runs[n].start as usize..start + runs[n].end as usize].fill(Label::AIR);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_piece_is_kept_whole() {
        // Aim: pieces as the flood finds them. Method: two combs whose teeth interlock without touching, and a speck.
        let grid = Grid::centred([30, 20, 10], Vec3::ONE);
        let is_in = |[x, y, z]: [u32; 3]| match (y, z) {
            (1, 1..9) => x < 20,
            (17, 1..9) => x > 3,
            (2..15, _) => x % 6 == 0 && x < 20 && z % 4 == 1,
            (5..17, _) => false,
            _ => x == 29 && y == 19 && z == 9,
        };
        let mut label: Vec<Label> = grid.cells().map(|c| Label(is_in(c).into())).collect();
        let pieces = crate::anatomy::pieces::Pieces::of(&grid, |i| label[i] != Label::AIR);
        let (number, size) = pieces.largest().unwrap();
        keep_largest(grid.dims, &mut label);
        assert!((0..grid.len()).all(|i| (label[i] != Label::AIR) == (pieces.at(i) == Some(number))));
        assert_eq!(label.iter().filter(|l| **l != Label::AIR).count(), size);
    }

    #[test]
    fn a_large_scan_has_the_tissues_of_its_phantom() {
        // Aim: coarse to fine loses nothing. Method: a phantom of 7 million voxels: a ball of dentine with a cap of enamel
        // and a pulp, its surface blurred over half a millimetre as a scanner does.
        let tissues = Tissues { enamel: Label(1), dentine: Label(2), pulp: Label(3) };
        let grid =
            Grid { dims: [200, 210, 170], spacing: Vec3::new(0.06, 0.06, 0.08), origin: Vec3::new(-6.0, -6.3, -6.8) };
        let depth = |p: Vec3| 5.0 - p.length();
        let is_enamel = |p: Vec3| p.z > 0.5 && depth(p) < 1.2;
        let value = |cell: [u32; 3]| {
            let p = grid.centre(cell);
            let share = (depth(p) / 0.5 + 0.5).clamp(0.0, 1.0);
            let full = if is_enamel(p) { 2500.0 } else { 1500.0 };
            let noise = (cell[0] * 7 + cell[1] * 13 + cell[2] * 29) % 64;
            if p.length() < 1.0 { 0.0 } else { full * share - 1000.0 * (1.0 - share) + noise as f32 - 32.0 }
        };
        assert!(grid.len() > WHOLE_MAX);
        let volume = labels(&grid, grid.cells().map(value).collect(), &tissues).unwrap();
        let mm3 = |label| volume.count(label) as f64 * grid.voxel_mm3();
        let (mut enamel, mut whole) = (0, 0);
        for cell in grid.cells() {
            let p = grid.centre(cell);
            whole += usize::from(depth(p) > 0.0);
            enamel += usize::from(depth(p) > 0.0 && is_enamel(p));
        }
        let [enamel, whole] = [enamel, whole].map(|count| count as f64 * grid.voxel_mm3());
        let found = [mm3(Label(1)), mm3(Label(1)) + mm3(Label(2)) + mm3(Label(3)), mm3(Label(3))];
        for (found, expected) in found.into_iter().zip([enamel, whole, 4.19]) {
            assert!((found / expected - 1.0).abs() < 0.05, "{found} of {expected}");
        }
        assert_eq!(volume.grid().dims, grid.dims, "crown up along z already");
    }
}
