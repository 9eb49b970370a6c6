//! Segmentation of large scans: tissues are classified on a coarser grid, and fine voxels decide only where the
//! coarse grid leaves it open.
//!
//! The blur of a scanner and the tissues themselves keep their width in millimetres; finer voxels only refine the
//! position of the borders. On the surface, therefore, the value of the fine voxel decides; inside, the interpolated
//! coarse tissues do.

use crate::import::orientation::{AxisPermutation, crown_foot, crown_from_root};
use crate::import::segment::grey_levels::GreyLevels;
use crate::import::segment::{ClassifiedScan, SegmentationError, TissueClass, classify, label_of};
use crate::import::{GreyValues, ImportedTooth};
use typodont_anatomy::TissueLabels;
use typodont_core::frame::Vec3;
use typodont_core::parallel::{available_threads, par_rows};
use typodont_core::volume::redistance;
use typodont_core::volume::{Density, Grid, Label, Volume};

/// Maximum number of voxels that are classified at full resolution, which takes about one microsecond per voxel.
const WHOLE_MAX: usize = 6_000_000;

/// Target number of voxels of the coarse grid: a large molar at 0.18 mm, about the blur of scanners that take in
/// whole teeth.
const COARSE: f64 = 2_000_000.0;

/// Labels the tissues of a tooth, upright as [`segment`](crate::import::segment::segment) sets it. Above 6 million
/// voxels density is either full or empty: sufficient for writing, viewing and counting, but too steep for haptic
/// contact, and grey values are kept only if `keeps_grey_values`.
///
/// # Errors
/// Fails when no tooth is found, or when its tissues cannot be told apart.
pub fn labels(
    grid: &Grid,
    values: Vec<f32>,
    tissues: &TissueLabels,
    keeps_grey_values: bool,
) -> Result<ImportedTooth, SegmentationError> {
    match grid.len() <= WHOLE_MAX {
        true => crate::import::segment::segment(grid, values, tissues),
        false => coarse_to_fine(grid, &values, tissues, keeps_grey_values),
    }
}

fn coarse_to_fine(
    grid: &Grid,
    values: &[f32],
    tissues: &TissueLabels,
    keeps_grey_values: bool,
) -> Result<ImportedTooth, SegmentationError> {
    let blocks = Blocks::of(grid);
    let scan = classify(&blocks.coarse, blocks.means(grid, values))?;
    let coarse = scan.window.grid;
    let tissue = |i: usize| label_of(scan.matter[i], tissues);
    let permutation = AxisPermutation::lifting(crown_from_root(&coarse, tissue, tissues.enamel));
    let mut upright_grid = permutation.grid(grid);
    let neighbours = CoarseSampler::of(&scan);
    let mut label = vec![Label::AIR; upright_grid.len()];
    let [nx, ny, _] = upright_grid.dims;
    par_rows(&mut label, nx, available_threads(), |row, labels| {
        for (x, label) in (0..).zip(labels) {
            let cell = permutation.source_cell(grid, [x, row % ny, row / ny]);
            let at = (grid.centre(cell) - coarse.origin) / coarse.spacing;
            *label = label_of(neighbours.matter_at(at, values[grid.index(cell)]), tissues);
        }
    });
    keep_largest(upright_grid.dims, &mut label);
    upright_grid.origin -= crown_foot(&upright_grid, |i| label[i] == tissues.enamel);
    let density: Vec<Density> =
        label.iter().map(|l| if *l == Label::AIR { Density::EMPTY } else { Density::FULL }).collect();
    let grey_values = keeps_grey_values.then(|| {
        let mut measured = vec![0; upright_grid.len()];
        par_rows(&mut measured, nx, available_threads(), |row, measured| {
            for (x, measured) in (0..).zip(measured) {
                let cell = permutation.source_cell(grid, [x, row % ny, row / ny]);
                *measured = scan.levels.grey_value(values[grid.index(cell)]);
            }
        });
        GreyValues::of_matter(&measured, &density)
    });
    let volume = Volume::new(upright_grid, redistance::half_band(&upright_grid), density, label, tissues.dentine);
    Ok(ImportedTooth { volume, grey_values })
}

/// A coarse grid whose voxels are blocks of another grid.
struct Blocks {
    /// Voxels per block along each axis; blocks at the far sides may be truncated.
    counts: [u32; 3],
    coarse: Grid,
}

impl Blocks {
    fn of(grid: &Grid) -> Blocks {
        let side = libm::cbrt(grid.len() as f64 * grid.voxel_mm3() / COARSE) as f32;
        let counts = grid.spacing.to_array().map(|spacing| (side / spacing).round().max(1.0) as u32);
        let dims = [0, 1, 2].map(|axis| grid.dims[axis].div_ceil(counts[axis]));
        let wide = Vec3::from(counts.map(|n| n as f32));
        let origin = grid.origin + 0.5 * (wide - 1.0) * grid.spacing;
        Blocks { counts, coarse: Grid { dims, spacing: grid.spacing * wide, origin } }
    }

    /// Returns the mean of each block, ignoring NaN; NaN for a block of NaN only.
    fn means(&self, grid: &Grid, values: &[f32]) -> Vec<f32> {
        let [bx, by, bz] = self.counts.map(|n| n as usize);
        let [nx, ny, nz] = grid.dims.map(|n| n as usize);
        let mut means = vec![f32::NAN; self.coarse.len()];
        let [cx, cy, _] = self.coarse.dims;
        par_rows(&mut means, cx, available_threads(), |row, means| {
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

/// Samples the coarse classification at any position.
struct CoarseSampler<'a> {
    scan: &'a ClassifiedScan,
    levels: GreyLevels,
    /// For each coarse voxel: true if it and all its neighbours are solid, or all are empty, so that the fine value
    /// is not consulted.
    is_sure: Vec<bool>,
}

impl CoarseSampler<'_> {
    fn of(scan: &ClassifiedScan) -> CoarseSampler<'_> {
        let grid = &scan.window.grid;
        let is_air = |cell: [u32; 3]| scan.matter[grid.index(cell)] == TissueClass::Air;
        let is_sure = |cell: [u32; 3]| {
            let [xs, ys, zs] =
                [0, 1, 2].map(|axis| cell[axis].saturating_sub(1)..=(cell[axis] + 1).min(grid.dims[axis] - 1));
            let own = is_air(cell);
            zs.into_iter().all(|z| ys.clone().all(|y| xs.clone().all(|x| is_air([x, y, z]) == own)))
        };
        CoarseSampler { scan, levels: scan.levels, is_sure: grid.cells().map(is_sure).collect() }
    }

    /// Classifies a fine voxel by its position in coarse voxels and by its own value.
    fn matter_at(&self, at: Vec3, value: f32) -> TissueClass {
        let ClassifiedScan { window, matter, nearest_enamel, .. } = self.scan;
        let grid = &window.grid;
        let limit = |v: f32, n: u32| (v >= -0.5 && v <= n as f32 - 0.5).then(|| v.clamp(0.0, n as f32 - 1.0));
        let [Some(x), Some(y), Some(z)] = [0, 1, 2].map(|axis| limit(at[axis], grid.dims[axis])) else {
            return TissueClass::Air;
        };
        let nearest = grid.index([(x + 0.5) as u32, (y + 0.5) as u32, (z + 0.5) as u32]);
        if self.is_sure[nearest] && matter[nearest] == TissueClass::Air {
            return TissueClass::Air;
        }
        let is_enamel_near = nearest_enamel[nearest];
        if !self.is_sure[nearest] && matter[nearest] != TissueClass::Pulp {
            let full = if is_enamel_near { self.levels.enamel } else { self.levels.dentine };
            let half_full = 0.5 * (self.levels.background + full);
            if value.is_nan() || value < half_full {
                return TissueClass::Air;
            }
        }
        // Solid: the tissue with the largest interpolation weight.
        let [low, high] =
            [[x as u32, y as u32, z as u32], [0, 1, 2].map(|a| ([x, y, z][a] as u32 + 1).min(grid.dims[a] - 1))];
        let share = Vec3::new(x.fract(), y.fract(), z.fract());
        let [mut enamel, mut dentine, mut pulp] = [0.0f32; 3];
        for corner in 0..8 {
            let pick = |axis: usize| if corner >> axis & 1 == 1 { high[axis] } else { low[axis] };
            let weigh = |axis: usize| if corner >> axis & 1 == 1 { share[axis] } else { 1.0 - share[axis] };
            let weight = weigh(0) * weigh(1) * weigh(2);
            match matter[grid.index([pick(0), pick(1), pick(2)])] {
                TissueClass::Enamel => enamel += weight,
                TissueClass::Dentine => dentine += weight,
                TissueClass::Pulp => pulp += weight,
                TissueClass::Air => {}
            }
        }
        if pulp > enamel.max(dentine) {
            TissueClass::Pulp
        } else if enamel > dentine || (enamel + dentine == 0.0 && is_enamel_near) {
            TissueClass::Enamel
        } else {
            TissueClass::Dentine
        }
    }
}

/// Empties all but the largest connected piece. Pieces are joined run by run, so that the memory grows with the
/// surface and not with the volume.
fn keep_largest([nx, ny, _]: [u32; 3], label: &mut [Label]) {
    struct RowRun {
        start: u32,
        end: u32,
        /// Another run of the same piece; the first run refers to itself.
        root: u32,
    }
    fn find(runs: &mut [RowRun], mut n: u32) -> u32 {
        while runs[n as usize].root != n {
            let next = runs[n as usize].root;
            runs[n as usize].root = runs[next as usize].root;
            n = runs[n as usize].root;
        }
        n
    }
    let mut runs: Vec<RowRun> = Vec::new();
    // Index of the first run of each row.
    let mut rows: Vec<usize> = vec![0];
    for (row, labels) in label.chunks_exact(nx as usize).enumerate() {
        let mut at = 0;
        let own = runs.len();
        while let Some(start) = labels[at..].iter().position(|l| *l != Label::AIR).map(|step| at + step) {
            let end = labels[start..].iter().position(|l| *l == Label::AIR).map_or(labels.len(), |step| start + step);
            let number = runs.len() as u32;
            runs.push(RowRun { start: start as u32, end: end as u32, root: number });
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
        // Aim: the same pieces as the connected-component search finds. Method: two combs with interlocking teeth
        // that do not touch, and a speck.
        let grid = Grid::centred([30, 20, 10], Vec3::ONE);
        let is_in = |[x, y, z]: [u32; 3]| match (y, z) {
            (1, 1..9) => x < 20,
            (17, 1..9) => x > 3,
            (2..15, _) => x % 6 == 0 && x < 20 && z % 4 == 1,
            (5..17, _) => false,
            _ => x == 29 && y == 19 && z == 9,
        };
        let mut label: Vec<Label> = grid.cells().map(|c| Label(is_in(c).into())).collect();
        let pieces = typodont_core::volume::components::Components::of(&grid, |i| label[i] != Label::AIR);
        let (number, size) = pieces.largest().unwrap();
        keep_largest(grid.dims, &mut label);
        assert!((0..grid.len()).all(|i| (label[i] != Label::AIR) == (pieces.at(i) == Some(number))));
        assert_eq!(label.iter().filter(|l| **l != Label::AIR).count(), size);
    }

    #[test]
    fn a_large_scan_has_the_tissues_of_its_phantom() {
        // Aim: coarse-to-fine classification loses no tissue. Method: a phantom of 7 million voxels: a ball of
        // dentine with a cap of enamel and a pulp, its surface blurred over half a millimetre as by a scanner.
        let tissues = TissueLabels { enamel: Label(1), dentine: Label(2), pulp: Label(3) };
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
        let tooth = labels(&grid, grid.cells().map(value).collect(), &tissues, true).unwrap();
        let volume = &tooth.volume;
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
        assert_eq!(volume.grid().dims, grid.dims, "the crown already points along z");
        // Grey values run from the background, -1000, to enamel, 2500; the noise is ±32.
        let grey = tooth.grey_values.unwrap();
        let deep = |cell: [u32; 3]| (depth(grid.centre(cell)) > 0.5).then(|| (value(cell) + 1000.0) / 3500.0 * 160.0);
        for (index, cell) in grid.cells().enumerate().step_by(97) {
            if let Some(expected) = deep(cell) {
                let found = f32::from(grey.values()[index]);
                assert!((found - expected).abs() < 4.0, "{found}, not {expected}");
            }
        }
    }
}
