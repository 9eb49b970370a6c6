//! A synthetic molar, passed through a model of a scanner with blur and noise, is segmented again.

use super::*;
use typodont_anatomy::lower_first_molar::lower_first;
use typodont_core::frame::Vec3;
use typodont_core::volume::{CellBox, Volume};

const ENAMEL: Label = Label(4);
const DENTINE: Label = Label(2);
const PULP: Label = Label(7);
const TISSUES: TissueLabels = TissueLabels { enamel: ENAMEL, dentine: DENTINE, pulp: PULP };

/// A model of a scanner.
struct Scanner {
    /// Values of air, dentine, enamel and pulp.
    values: [f32; 4],
    /// Number of smoothing passes.
    blur: usize,
    /// Half the width of the noise.
    noise: f32,
}

/// Hounsfield units of a micro-CT.
const SCANNER: Scanner = Scanner { values: [-1000.0, 1400.0, 2500.0, 40.0], blur: 2, noise: 150.0 };

impl Scanner {
    fn scan(&self, tooth: &Volume) -> Vec<f32> {
        let Scanner { values: [air, dentine, enamel, pulp], blur, noise } = *self;
        let full = |label| match label {
            DENTINE => dentine,
            ENAMEL => enamel,
            PULP => pulp,
            _ => air,
        };
        // A density ramp is three voxels wide; the filled fraction of a voxel falls from one to zero within one
        // voxel.
        let filled = |density: Density| (3.0 * (density.unit() - 0.5) + 0.5).clamp(0.0, 1.0);
        let voxels = tooth.densities().iter().zip(tooth.labels());
        let mut values: Vec<f32> = voxels.map(|(&d, &l)| air + filled(d) * (full(l) - air)).collect();
        (0..blur).for_each(|_| redistance::binomial_smooth(tooth.grid(), &mut values));
        let mut state = 12345u32;
        for value in &mut values {
            state = state.wrapping_mul(1664525).wrapping_add(1013904223);
            *value += noise * ((state >> 8) as f32 / (1 << 23) as f32 - 1.0);
        }
        values
    }
}

/// The Dice coefficient: twice the intersection over the sum of both sets.
fn dice(a: &Volume, b: &Volume, tissue: Label) -> f64 {
    let both = a.tissues().zip(b.tissues()).filter(|&(a, b)| a == tissue && b == tissue).count();
    2.0 * both as f64 / (a.count(tissue) + b.count(tissue)) as f64
}

fn segmented(tooth: &Volume, values: Vec<f32>) -> Volume {
    segment(tooth.grid(), values, &TISSUES).unwrap().volume
}

#[test]
fn a_scanned_molar_has_the_tissues_of_the_original() {
    for (spacing, least) in [(0.15, 0.95), (0.2, 0.9)] {
        let tooth = lower_first(spacing, &TISSUES);
        let found = segmented(&tooth, SCANNER.scan(&tooth));
        assert_eq!(found.grid().dims, tooth.grid().dims, "neither rotated nor padded");
        for tissue in [ENAMEL, DENTINE, PULP] {
            let dice = dice(&tooth, &found, tissue);
            assert!(dice >= least, "{spacing} mm, {tissue:?}: {dice}");
        }
    }
}

#[test]
fn no_layer_of_dentine_lies_on_enamel() {
    // Aim: no layer of dentine on enamel, which once made a cutting plane necessary. Method: solid voxels next to
    // air, above the highest point of the true cervical line.
    let tooth = lower_first(0.15, &TISSUES);
    let found = segmented(&tooth, SCANNER.scan(&tooth));
    let (mut enamel, mut dentine) = (0, 0);
    let grid = found.grid();
    for (index, cell) in grid.cells().enumerate() {
        let is_skin = || grid.neighbours(index).any(|n| found.tissue(n) == Label::AIR);
        if tooth.grid().centre(cell).z > 2.5 && found.tissue(index) != Label::AIR && is_skin() {
            match found.tissue(index) {
                ENAMEL => enamel += 1,
                _ => dentine += 1,
            }
        }
    }
    assert!(enamel > 5000, "{enamel}");
    assert_eq!(dentine, 0);
}

#[test]
fn the_surface_is_a_straight_ramp_where_it_was() {
    // Aim: the surface that touch finds is within a quarter of a voxel on average. Method: densities of original and
    // scan, voxel by voxel.
    let tooth = lower_first(0.2, &TISSUES);
    let found = segmented(&tooth, Scanner { noise: 0.0, ..SCANNER }.scan(&tooth));
    let (mut sum, mut worst, mut count) = (0.0, 0.0f32, 0);
    for index in 0..tooth.grid().len() {
        let [truth, made] = [&tooth, &found].map(|volume| volume.voxel(index).density.unit());
        if (0.1..0.9).contains(&truth) {
            // The whole width of a ramp is three voxels.
            let off = 3.0 * (truth - made).abs();
            (sum, worst, count) = (sum + f64::from(off), worst.max(off), count + 1);
        }
    }
    assert!(sum / f64::from(count) < 0.25, "{} voxels", sum / f64::from(count));
    assert_eq!(found.half_band(), tooth.half_band());
}

#[test]
fn a_tooth_in_any_position_comes_out_upright() {
    // Aim: axes are permuted, not mirrored, and nothing else changes. Method: x, y, z of the scan from y, z, x,
    // upside down.
    let tooth = lower_first(0.25, &TISSUES);
    let values = SCANNER.scan(&tooth);
    let expected = segmented(&tooth, values.clone());
    let [nx, ny, nz] = tooth.grid().dims;
    let lying = Grid { dims: [nz, nx, ny], ..*tooth.grid() };
    let from = |[x, y, z]: [u32; 3]| values[tooth.grid().index([nx - 1 - y, z, nz - 1 - x])];
    let found = segment(&lying, lying.cells().map(from).collect(), &TISSUES).unwrap().volume;
    assert_eq!(found.grid().dims, expected.grid().dims);
    assert!((found.grid().origin - expected.grid().origin).length() < 1e-3);
    for tissue in [ENAMEL, DENTINE, PULP] {
        // Of equally near voxels the first one decides, and the order differs.
        assert!(dice(&expected, &found, tissue) >= 0.995, "{tissue:?} {}", dice(&expected, &found, tissue));
    }
}

#[test]
fn z_is_zero_at_the_neck_and_the_crown_is_in_the_middle() {
    let tooth = lower_first(0.25, &TISSUES);
    let found = segmented(&tooth, SCANNER.scan(&tooth));
    let grid = found.grid();
    let enamel = || (0..grid.len()).filter(|&i| found.tissue(i) == ENAMEL).map(|i| grid.centre(grid.cell(i)));
    assert_eq!(enamel().map(|p| p.z).fold(f32::INFINITY, f32::min), 0.0);
    // Enamel thins out to nothing at the neck, and a scan shows no enamel thinner than its voxels.
    assert!((grid.origin - tooth.grid().origin).abs().cmple(Vec3::new(0.3, 0.3, 1.5)).all(), "{}", grid.origin);
}

#[test]
fn the_same_scan_twice_has_the_same_bits() {
    let tooth = lower_first(0.3, &TISSUES);
    let [a, mut b] = [0, 1].map(|_| SCANNER.scan(&tooth));
    // NaN around the tooth counts as background.
    b[0] = f32::NAN;
    let [a, b] = [a, b].map(|values| segmented(&tooth, values));
    assert!(a.densities() == b.densities() && a.labels() == b.labels() && a.grid() == b.grid());
}

#[test]
fn a_scan_that_truncates_the_tooth_is_padded() {
    // Aim: matter at the border of a scan has a surface too. Method: a scan without the lower half of the roots.
    let tooth = lower_first(0.25, &TISSUES);
    let values = SCANNER.scan(&tooth);
    let [nx, ny, nz] = tooth.grid().dims;
    let below = nz / 3;
    let cut = Grid { dims: [nx, ny, nz - below], ..*tooth.grid() };
    let found = segment(&cut, values[(nx * ny * below) as usize..].to_vec(), &TISSUES).unwrap().volume;
    let CellBox { low, high } = found.bounding_box().unwrap();
    for axis in 0..3 {
        assert!(low[axis] >= 2 && high[axis] + 2 < found.grid().dims[axis], "{low:?} {high:?}");
    }
    assert!(found.densities().iter().filter(|d| **d == Density::FULL).count() > 1000);
}

#[test]
fn scans_without_a_tooth_are_refused() {
    let tooth = lower_first(0.3, &TISSUES);
    let plain = Scanner { values: [0.0, 1400.0, 1400.0, 0.0], ..SCANNER };
    assert_eq!(segment(tooth.grid(), plain.scan(&tooth), &TISSUES).unwrap_err(), SegmentationError::OneLevel);
    let grid = Grid { spacing: tooth.grid().spacing * 5.0, ..*tooth.grid() };
    assert!(matches!(segment(&grid, SCANNER.scan(&tooth), &TISSUES), Err(SegmentationError::Size(mm)) if mm > 80.0));
}
