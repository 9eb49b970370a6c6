//! The lower left first molar, FDI 36, as a [`form`](crate::form).
//!
//! Sizes: Wheeler's table (Ash & Nelson), row 36/46. Shape: the same book's description of the tooth (five cusps, the
//! mesial ones the largest, the distal the smallest; buccal height of contour in the cervical third, lingual in the
//! middle third; mesial root broad, grooved and curved distally, distal root rounder and straighter), put into numbers
//! by eye. Chamber and furcation: Deutsch & Musikant 2004.

use crate::form::{
    CanalForm, Crest, Cusp, Enamel, FissureForm, LoftForm, OcclusalForm, PulpForm, SideMetric, Sizes, ToothForm,
    beside_ridge, place, section,
};
use crate::{TissueLabels, grid_of_spacing, grow};
use typodont_core::volume::Volume;

/// Generates a lower left first molar on its own grid with a spacing in mm.
pub fn lower_first(spacing: f32, tissues: &TissueLabels) -> Volume {
    grow(&LOWER_FIRST, grid_of_spacing(&LOWER_FIRST, spacing), tissues)
}

pub const LOWER_FIRST: ToothForm = ToothForm {
    sizes: Sizes {
        crown: 7.5,
        root: 14.0,
        mesiodistal: [11.0, 9.0],
        buccolingual: [10.5, 9.0],
        neckline_rise: [1.0, 0.0],
    },
    body: BODY,
    roots: &[MESIAL_ROOT, DISTAL_ROOT],
    occlusal: OcclusalForm {
        cusps: CUSPS,
        crests: &[RIM],
        fissures: FISSURES,
        floor: 0.60,
        flanks: [1.0, 0.7],
        edge: 0.5,
    },
    enamel: Enamel { cusp: 2.15, fissure: 1.12, side: 1.05, full_at: 0.8, follows: 0.0 },
    pulp: PULP,
    side_metric: SideMetric::AlongRays,
    is_mirrored: false,
    age_effects: None,
};

/// Body from the roof of the furcation to the cusps.
const BODY: LoftForm = LoftForm {
    sections: &[
        section(-0.25, [-0.66, 0.70], [-0.72, 0.70], 0.5, [0.0, 0.0]),
        section(-0.13, [-0.87, 0.89], [-0.91, 0.87], 0.5, [-0.04, 0.02]),
        section(-0.05, [-0.95, 0.965], [-0.965, 0.935], 0.5, [-0.05, 0.03]),
        section(0.0, [-0.99, 1.0], [-1.0, 0.97], 0.5, [-0.05, 0.03]),
        section(0.13, [-0.90, 0.94], [-0.83, 0.84], 0.5, [-0.06, 0.04]),
        section(0.28, [-0.95, 0.99], [-0.88, 0.89], 0.52, [-0.08, 0.05]),
        section(0.48, [-0.99, 0.96], [-0.95, 0.96], 0.52, [-0.10, 0.06]),
        section(0.66, [-0.98, 0.88], [-0.995, 1.0], 0.55, [-0.12, 0.06]),
        section(0.84, [-0.92, 0.76], [-0.96, 0.93], 0.55, [-0.13, 0.06]),
        section(1.0, [-0.84, 0.66], [-0.89, 0.84], 0.55, [-0.14, 0.06]),
    ],
    furrows: &[
        // Between mesiobuccal and distobuccal cusp, between distobuccal and distal, between the lingual ones.
        &[
            place([0.95, -0.17, 0.95], 0.5, 1.0),
            place([1.0, -0.17, 0.55], 0.3, 0.8),
            place([1.0, -0.17, 0.35], 0.0, 0.6),
        ],
        &[place([0.80, 0.58, 0.95], 0.4, 0.9), place([0.86, 0.60, 0.6], 0.25, 0.8), place([0.88, 0.60, 0.4], 0.0, 0.6)],
        &[
            place([-0.98, -0.02, 0.98], 0.4, 1.0),
            place([-1.0, -0.02, 0.7], 0.2, 0.9),
            place([-1.0, -0.02, 0.5], 0.0, 0.7),
        ],
        // Toward the furcation, buccal and lingual.
        &[
            place([1.0, 0.02, -0.04], 0.0, 1.6),
            place([0.95, 0.02, -0.14], 0.6, 1.8),
            place([0.80, 0.02, -0.25], 1.2, 2.0),
            place([0.80, 0.02, -0.35], 1.2, 2.0),
        ],
        &[
            place([-1.0, 0.02, -0.05], 0.0, 1.6),
            place([-0.95, 0.02, -0.15], 0.5, 1.8),
            place([-0.78, 0.02, -0.25], 1.1, 2.0),
            place([-0.78, 0.02, -0.35], 1.1, 2.0),
        ],
    ],
    rounding: 0.8,
};

const MESIAL_ROOT: LoftForm = LoftForm {
    sections: &[
        section(-0.04, [-0.94, 0.955], [-0.96, -0.04], 0.5, [0.0, 0.0]),
        section(-0.13, [-0.885, 0.905], [-0.93, -0.06], 0.5, [0.0, 0.0]),
        section(-0.28, [-0.83, 0.85], [-0.93, -0.13], 0.5, [0.0, 0.0]),
        section(-0.55, [-0.70, 0.72], [-0.93, -0.28], 0.45, [0.0, 0.0]),
        section(-0.78, [-0.52, 0.52], [-0.82, -0.28], 0.3, [0.0, 0.0]),
        section(-0.93, [-0.34, 0.34], [-0.64, -0.20], 0.2, [0.0, 0.0]),
        section(-1.0, [-0.24, 0.24], [-0.52, -0.16], 0.1, [0.0, 0.0]),
    ],
    furrows: &[
        &[
            place([0.02, -1.0, -0.15], 0.0, 1.2),
            place([0.02, -1.03, -0.4], 0.3, 1.3),
            place([0.0, -1.0, -0.7], 0.25, 1.1),
            place([0.0, -0.75, -0.9], 0.0, 0.9),
        ],
        &[
            place([0.02, -0.2, -0.2], 0.2, 1.4),
            place([0.02, -0.3, -0.5], 0.45, 1.3),
            place([0.0, -0.3, -0.75], 0.3, 1.1),
            place([0.0, -0.27, -0.92], 0.0, 0.9),
        ],
    ],
    rounding: 0.75,
};

const DISTAL_ROOT: LoftForm = LoftForm {
    sections: &[
        section(-0.04, [-0.86, 0.88], [0.08, 0.93], 0.45, [0.0, 0.0]),
        section(-0.13, [-0.81, 0.83], [0.10, 0.895], 0.45, [0.0, 0.0]),
        section(-0.28, [-0.71, 0.73], [0.18, 0.90], 0.4, [0.0, 0.0]),
        section(-0.55, [-0.54, 0.56], [0.42, 1.04], 0.3, [0.0, 0.0]),
        section(-0.78, [-0.38, 0.40], [0.56, 1.06], 0.2, [0.0, 0.0]),
        section(-0.95, [-0.22, 0.24], [0.68, 1.04], 0.1, [0.0, 0.0]),
    ],
    furrows: &[&[
        place([0.0, 0.18, -0.2], 0.1, 1.3),
        place([0.0, 0.40, -0.5], 0.25, 1.2),
        place([0.0, 0.60, -0.8], 0.0, 1.0),
    ]],
    rounding: 0.75,
};

const MESIOBUCCAL: [f32; 3] = [0.48, -0.47, 0.985];
const MESIOLINGUAL: [f32; 3] = [-0.61, -0.43, 1.02];
const DISTOBUCCAL: [f32; 3] = [0.50, 0.15, 0.96];
const DISTOLINGUAL: [f32; 3] = [-0.58, 0.38, 0.995];
const DISTAL: [f32; 3] = [0.30, 0.66, 0.90];

const CUSPS: &[Cusp] = &[
    Cusp { tip: MESIOBUCCAL, foot: [0.08, -0.30, 0.70], horn: 1.0 },
    Cusp { tip: MESIOLINGUAL, foot: [-0.20, -0.26, 0.70], horn: 0.9 },
    Cusp { tip: DISTOBUCCAL, foot: [0.14, 0.16, 0.69], horn: 0.7 },
    Cusp { tip: DISTOLINGUAL, foot: [-0.18, 0.30, 0.70], horn: 0.7 },
    Cusp { tip: DISTAL, foot: [0.08, 0.50, 0.71], horn: 0.3 },
];

/// Crest around the occlusal surface: from the mesiobuccal cusp distally and back along the lingual side.
const RIM: Crest = &[
    MESIOBUCCAL,
    [0.54, -0.15, 0.79],
    DISTOBUCCAL,
    [0.45, 0.45, 0.78],
    DISTAL,
    [0.06, 0.80, 0.775],
    [-0.28, 0.72, 0.82],
    DISTOLINGUAL,
    [-0.62, -0.01, 0.80],
    MESIOLINGUAL,
    [-0.40, -0.77, 0.88],
    [-0.06, -0.84, 0.83],
    [0.26, -0.79, 0.87],
    MESIOBUCCAL,
];

const FISSURES: &[FissureForm] = &[
    // The central groove, from the mesial to the distal pit.
    FissureForm {
        line: &[
            [-0.08, -0.62, 1.0],
            [-0.03, -0.46, 0.8],
            [-0.07, -0.28, 0.7],
            [-0.02, -0.06, 1.0],
            [-0.05, 0.10, 0.8],
            [0.0, 0.30, 0.8],
            [-0.06, 0.45, 0.7],
            [-0.02, 0.60, 0.9],
        ],
        depth: 0.42,
        width: 0.34,
    },
    // The mesiobuccal, the distobuccal and the lingual groove.
    FissureForm {
        line: &[[-0.02, -0.06, 1.0], [0.18, -0.12, 0.8], [0.36, -0.11, 0.7], [0.54, -0.15, 0.6], [0.95, -0.17, 0.5]],
        depth: 0.40,
        width: 0.36,
    },
    FissureForm {
        line: &[[0.0, 0.30, 0.8], [0.18, 0.34, 0.8], [0.32, 0.42, 0.6], [0.45, 0.45, 0.6], [0.85, 0.58, 0.4]],
        depth: 0.38,
        width: 0.34,
    },
    FissureForm {
        line: &[[-0.05, 0.10, 0.9], [-0.22, 0.04, 0.8], [-0.40, 0.03, 0.6], [-0.62, -0.01, 0.5], [-1.0, -0.02, 0.4]],
        depth: 0.40,
        width: 0.36,
    },
    // The branches of the mesial and of the distal pit.
    FissureForm {
        line: &[[0.20, -0.66, 0.0], [0.06, -0.64, 0.6], [-0.08, -0.62, 1.0], [-0.22, -0.66, 0.6], [-0.36, -0.62, 0.0]],
        depth: 0.38,
        width: 0.36,
    },
    FissureForm {
        line: &[[0.14, 0.70, 0.0], [-0.02, 0.60, 1.0], [-0.16, 0.62, 0.5], [-0.26, 0.56, 0.0]],
        depth: 0.36,
        width: 0.36,
    },
    beside_ridge(&[[-0.06, -0.50, 0.8], [0.16, -0.57, 0.9], [0.34, -0.66, 0.0]]),
    beside_ridge(&[[-0.04, -0.18, 0.8], [0.16, -0.28, 0.9], [0.38, -0.27, 0.0]]),
    beside_ridge(&[[-0.08, -0.46, 0.8], [-0.26, -0.54, 0.9], [-0.46, -0.62, 0.0]]),
    beside_ridge(&[[-0.06, -0.12, 0.8], [-0.26, -0.20, 0.9], [-0.46, -0.20, 0.0]]),
    beside_ridge(&[[-0.03, 0.20, 0.8], [-0.24, 0.20, 0.9], [-0.44, 0.18, 0.0]]),
    beside_ridge(&[[-0.05, 0.46, 0.8], [-0.24, 0.46, 0.9], [-0.40, 0.56, 0.0]]),
    beside_ridge(&[[0.0, 0.06, 0.8], [0.20, 0.04, 0.9], [0.40, 0.02, 0.0]]),
];

/// Pulp with its roof at the height of the mesial cervical line and its floor 3 mm above the furcation.
const PULP: PulpForm = PulpForm {
    chamber: LoftForm {
        sections: &[
            section(-0.04, [-0.44, 0.48], [-0.60, 0.54], 0.35, [-0.22, 0.0]),
            section(0.133, [-0.44, 0.48], [-0.58, 0.52], 0.35, [-0.22, 0.0]),
        ],
        furrows: &[],
        rounding: 0.5,
    },
    horn_spread: 0.6,
    canals: &[
        CanalForm { root: 0, at: [0.45, 0.0], orifice: [0.4, 0.35], end: 0.15, closed: 0.8 },
        CanalForm { root: 0, at: [-0.45, 0.0], orifice: [0.4, 0.35], end: 0.15, closed: 0.8 },
        CanalForm { root: 1, at: [0.0, 0.0], orifice: [0.8, 0.4], end: 0.18, closed: 0.8 },
    ],
};

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{grid_fitting, grow};
    use typodont_core::frame::Vec3;
    use typodont_core::volume::CellBox;
    use typodont_core::volume::components::Components;
    use typodont_core::volume::{Grid, Label, distance};

    const TISSUES: TissueLabels = TissueLabels { enamel: Label(4), dentine: Label(2), pulp: Label(7) };

    /// Returns the voxels of a tissue, as cells.
    fn cells(volume: &Volume, is_wanted: impl Fn(Label) -> bool) -> Vec<[u32; 3]> {
        volume.grid().cells().zip(volume.tissues()).filter(|&(_, t)| is_wanted(t)).map(|(cell, _)| cell).collect()
    }

    /// Returns the range from the lower face of the lowest voxel to the upper face of the highest, mm.
    fn extent(grid: &Grid, cells: &[[u32; 3]], axis: usize) -> [f32; 2] {
        let places = || cells.iter().map(|&cell| grid.centre(cell)[axis]);
        let half = 0.5 * grid.spacing[axis];
        [places().fold(f32::MAX, f32::min) - half, places().fold(f32::MIN, f32::max) + half]
    }

    fn width([low, high]: [f32; 2]) -> f32 {
        high - low
    }

    #[test]
    fn it_has_the_sizes_of_the_table() {
        // Aim: every size within 5 % of the row 36/46. Method: a caliper on the voxels; the neck is where enamel ends.
        let volume = lower_first(0.1, &TISSUES);
        let grid = *volume.grid();
        let solid = cells(&volume, |t| t != Label::AIR);
        let enamel = cells(&volume, |t| t == TISSUES.enamel);
        let neck_at = |is_there: &dyn Fn(Vec3) -> bool| {
            let there: Vec<[u32; 3]> = enamel.iter().copied().filter(|&c| is_there(grid.centre(c))).collect();
            extent(&grid, &there, 2)[0]
        };
        let buccal = neck_at(&|p| p.x > 3.0 && p.y.abs() < 0.5);
        let (mesial, distal) =
            (neck_at(&|p| p.y < -3.0 && p.x.abs() < 0.5), neck_at(&|p| p.y > 3.0 && p.x.abs() < 0.5));
        let slab = |low: f32, high: f32| -> Vec<[u32; 3]> {
            solid.iter().copied().filter(|&c| (low..high).contains(&grid.centre(c).z)).collect()
        };
        let crown = slab(buccal, 99.0);
        let level = 0.5 * (mesial + distal);
        let [lowest, highest] = extent(&grid, &solid, 2);
        for (name, measured, table) in [
            ("crown", highest - buccal, 7.5),
            ("root", buccal - lowest, 14.0),
            ("mesiodistal", width(extent(&grid, &crown, 1)), 11.0),
            ("buccolingual", width(extent(&grid, &crown, 0)), 10.5),
            ("mesiodistal at the neck", width(extent(&grid, &slab(level - 0.051, level + 0.051), 1)), 9.0),
            ("buccolingual at the neck", width(extent(&grid, &slab(buccal - 0.051, buccal + 0.051), 0)), 9.0),
        ] {
            println!("{name}: {measured:.2} mm, table {table}");
            assert!((measured / table - 1.0).abs() < 0.05, "{name}: {measured} mm, table {table}");
        }
        println!("neckline: buccal {buccal:.2}, mesial {mesial:.2}, distal {distal:.2}");
        assert!((mesial - buccal - 1.0).abs() < 0.25 && (distal - buccal).abs() < 0.25, "the neckline rises mesially");
    }

    #[test]
    fn enamel_is_as_thick_as_in_life() {
        // Mean over enamel voxels that face air, of the distance to the nearest dentine voxel.
        let volume = lower_first(0.1, &TISSUES);
        let grid = volume.grid();
        let tissues: Vec<Label> = volume.tissues().collect();
        let from_dentine = distance::to_set(grid, |i| tissues[i] == TISSUES.dentine);
        let faces_air = |i: usize| grid.neighbours(i).any(|n| tissues[n] == Label::AIR);
        let outer: Vec<usize> = (0..grid.len()).filter(|&i| tissues[i] == TISSUES.enamel && faces_air(i)).collect();
        let mean = outer.iter().map(|&i| f64::from(from_dentine[i])).sum::<f64>() / outer.len() as f64;
        println!("mean enamel thickness {mean:.3} mm");
        assert!((0.8..1.4).contains(&mean), "{mean} mm");
        let thickest = outer.iter().map(|&i| from_dentine[i]).fold(0.0, f32::max);
        assert!((1.9..2.6).contains(&thickest), "under the cusps {thickest} mm");
    }

    #[test]
    fn five_cusps_stand_around_the_fossa() {
        // Method: heights of the surface seen from above; a cusp is the highest place within 0.8 mm around it.
        let volume = lower_first(0.1, &TISSUES);
        let grid = volume.grid();
        let [nx, ny, nz] = grid.dims;
        let height = |x: u32, y: u32| {
            let top = (0..nz).rev().find(|&z| volume.tissue(grid.index([x, y, z])) != Label::AIR)?;
            // Height between the last solid voxel and the one above it at which the density is one half.
            let [inside, outside] = [top, top + 1].map(|z| volume.voxel(grid.index([x, y, z])).density.unit());
            Some(grid.centre([x, y, top]).z + (inside - 0.5) / (inside - outside).max(1e-3) * grid.spacing.z)
        };
        let reach = 8;
        let mut cusps = Vec::new();
        for y in reach..ny - reach {
            for x in reach..nx - reach {
                let Some(here) = height(x, y).filter(|&h| h > 5.5) else { continue };
                let around = (y - reach..=y + reach).flat_map(|v| (x - reach..=x + reach).map(move |u| (u, v)));
                if around.filter(|&at| at != (x, y)).all(|(u, v)| height(u, v).is_none_or(|h| h < here)) {
                    cusps.push(grid.centre([x, y, 0]).with_z(here));
                }
            }
        }
        println!("{cusps:?}");
        let quadrants = |buccal: bool| cusps.iter().filter(|c| (c.x > 0.0) == buccal).count();
        assert_eq!((quadrants(true), quadrants(false)), (3, 2), "{cusps:?}");
        let fossa = height(grid.nearest(Vec3::ZERO).unwrap()[0], grid.nearest(Vec3::ZERO).unwrap()[1]).unwrap();
        assert!(cusps.iter().all(|c| c.z > fossa + 1.5), "fossa at {fossa}");
    }

    #[test]
    fn every_tissue_is_one_piece_and_the_pulp_lies_in_dentine() {
        for spacing in [0.1, 0.067] {
            let volume = lower_first(spacing, &TISSUES);
            let grid = volume.grid();
            let tissues: Vec<Label> = volume.tissues().collect();
            let pieces = |is_in: &dyn Fn(Label) -> bool| Components::of(grid, |i| is_in(tissues[i])).sizes().len();
            assert_eq!(pieces(&|t| t != Label::AIR), 1);
            for tissue in [TISSUES.enamel, TISSUES.dentine, TISSUES.pulp] {
                assert_eq!(pieces(&|t| t == tissue), 1, "{tissue:?} at {spacing} mm");
            }
            for index in (0..grid.len()).filter(|&i| tissues[i] == TISSUES.pulp) {
                let wall = |n: usize| tissues[n] == TISSUES.pulp || tissues[n] == TISSUES.dentine;
                assert!(grid.neighbours(index).all(wall), "{:?}", grid.centre(grid.cell(index)));
            }
        }
    }

    #[test]
    fn the_pulp_chamber_lies_where_it_was_measured() {
        // Deutsch & Musikant 2004, lower molars, mean ± SD: buccal cusp to roof 6.36 ± 0.93, chamber height 1.57,
        // floor to furcation 2.96. Along the tooth's axis.
        let volume = lower_first(0.1, &TISSUES);
        let grid = volume.grid();
        let [x, y, _] = grid.nearest(Vec3::ZERO).unwrap();
        let heights = |tissue: Label| -> Vec<[u32; 3]> {
            let column = (0..grid.dims[2]).map(|z| [x, y, z]);
            column.filter(|&cell| volume.tissue(grid.index(cell)) == tissue).collect()
        };
        let [floor, roof] = extent(grid, &heights(TISSUES.pulp), 2);
        let [furcation, _] = extent(grid, &heights(TISSUES.dentine), 2);
        let cusp = LOWER_FIRST.occlusal.cusps[0].tip[2] * LOWER_FIRST.sizes.crown;
        println!("roof {roof:.2}, floor {floor:.2}, furcation {furcation:.2}, mesiobuccal cusp {cusp:.2}");
        for (measured, mean) in [(cusp - roof, 6.36), (roof - floor, 1.57), (floor - furcation, 2.96)] {
            assert!((measured - mean).abs() < 0.4, "{measured} {mean}");
        }
    }

    #[test]
    fn the_same_tooth_twice_has_the_same_bits() {
        let [a, b] = [0, 1].map(|_| lower_first(0.15, &TISSUES));
        assert!(a.densities() == b.densities() && a.labels() == b.labels());
    }

    #[test]
    fn a_grid_of_given_size_holds_the_whole_tooth() {
        let grid = grid_fitting(&LOWER_FIRST, [120, 100, 161]);
        let fitted = grow(&LOWER_FIRST, grid, &TISSUES);
        let own = lower_first(grid.spacing.x, &TISSUES);
        let CellBox { low, high } = fitted.bounding_box().unwrap();
        assert!((0..3).all(|a| low[a] > 0 && high[a] + 1 < grid.dims[a]), "{low:?} {high:?}");
        for tissue in [TISSUES.enamel, TISSUES.dentine, TISSUES.pulp] {
            let ratio = fitted.count(tissue) as f64 / own.count(tissue) as f64;
            assert!((ratio - 1.0).abs() < 0.01, "{tissue:?}: {ratio}");
        }
    }

    #[test]
    #[ignore = "a measurement: run with --release --ignored --nocapture"]
    fn growing_takes_less_than_two_seconds() {
        for grid in [
            grid_of_spacing(&LOWER_FIRST, 0.1),
            grid_fitting(&LOWER_FIRST, [512, 512, 322]),
            Grid::centred([512, 512, 322], Vec3::splat(0.043)),
        ] {
            let start = std::time::Instant::now();
            grow(&LOWER_FIRST, grid, &TISSUES);
            println!("{:?} at {:.4} mm: {:.2?}", grid.dims, grid.spacing.x, start.elapsed());
        }
    }
}
