//! Where the voxels of a file lie.

use super::error::Problem;
use super::{AXIS_MAX, VOXELS_MAX};
use crate::frame::Vec3;
use crate::volume::Grid;
use glam::DVec3;

/// Voxels closer than a tenth of a micrometre or farther apart than a metre are in another unit than mm.
const SPACING_MM: std::ops::RangeInclusive<f64> = 1e-4..=1e3;

/// How far an axis may lean from the nearest axis of space, as a share of its length. At 1 % the far end of a tooth is a
/// voxel off; scanners round to far less.
const LEAN_MAX: f64 = 0.01;

/// A kilometre, mm: beyond it positions lose their tenths of a millimetre in single precision.
const ORIGIN_MAX: f64 = 1e6;

/// The regular grid of a file. Unlike a [`Grid`], its axes may run along any axis of space, in either direction.
#[derive(Clone, Debug, PartialEq)]
pub struct Geometry {
    /// Voxels along each axis of the array, the fastest first.
    pub dims: [u32; 3],
    /// The way from one voxel to the next along each axis of the array, mm in `space`. Each lies along one axis of space,
    /// within 1 %.
    pub steps: [DVec3; 3],
    /// Centre of the first voxel, mm in `space`; zero where the file does not say.
    pub origin: DVec3,
    pub space: Space,
}

/// What the x, y and z of positions mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Space {
    /// x to the patient's left, y to the back, z to the head. Files in right-anterior-superior or left-anterior-superior
    /// are turned into it on reading, so that positions agree.
    LeftPosteriorSuperior,
    ScannerXyz,
    RightHanded,
    LeftHanded,
    /// The file does not say.
    Untold,
}

/// How one axis of the array runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Axis {
    /// The axis of space it runs along: 0, 1 or 2.
    pub along: usize,
    /// True when it runs from high coordinates to low.
    pub is_reversed: bool,
}

impl Geometry {
    /// The place of a grid in a file, with tooth space taken for `space`.
    pub fn of(grid: &Grid, space: Space) -> Geometry {
        let [x, y, z] = grid.spacing.to_array().map(widen);
        Geometry {
            dims: grid.dims,
            steps: [DVec3::X * x, DVec3::Y * y, DVec3::Z * z],
            origin: DVec3::from_array(grid.origin.to_array().map(widen)),
            space,
        }
    }

    /// The grid, if the array's axes run along +x, +y and +z; otherwise the samples have to be put in order first.
    pub fn grid(&self) -> Option<Grid> {
        let is_upright = self.axes().iter().enumerate().all(|(i, axis)| axis.along == i && !axis.is_reversed);
        let narrow = |v: DVec3| Vec3::new(v.x as f32, v.y as f32, v.z as f32);
        is_upright.then(|| Grid { dims: self.dims, spacing: narrow(self.spacing()), origin: narrow(self.origin) })
    }

    /// Number of voxels.
    pub fn len(&self) -> usize {
        self.dims.iter().map(|&n| n as usize).product()
    }

    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Distance between voxel centres along each axis of the array, mm.
    pub fn spacing(&self) -> DVec3 {
        DVec3::from_array(self.steps.map(|step| step.length()))
    }

    pub fn axes(&self) -> [Axis; 3] {
        self.steps.map(|step| {
            let along = longest(step);
            Axis { along, is_reversed: step[along] < 0.0 }
        })
    }

    /// Centre of a voxel of the array, mm in `space`.
    pub fn position(&self, [i, j, k]: [u32; 3]) -> DVec3 {
        let [a, b, c] = self.steps;
        self.origin + a * f64::from(i) + b * f64::from(j) + c * f64::from(k)
    }

    /// Turns x, y or both around, for spaces that name them the other way.
    pub(super) fn flip(&mut self, signs: [f64; 3]) {
        // Adding zero makes +0 of -0.
        let flipped = |v: DVec3| v * DVec3::from_array(signs) + DVec3::ZERO;
        self.steps = self.steps.map(flipped);
        self.origin = flipped(self.origin);
    }
}

/// The gates of reader and writer alike.
pub(in crate::content) fn check_dims(dims: [u64; 3]) -> Result<[u32; 3], Problem> {
    for (axis, voxels) in (1..).zip(dims) {
        if voxels > u64::from(AXIS_MAX) {
            return Err(Problem::TooLarge { axis: Some(axis), voxels });
        }
    }
    match dims.iter().product() {
        voxels if voxels > VOXELS_MAX => Err(Problem::TooLarge { axis: None, voxels }),
        _ => Ok(dims.map(|n| n as u32)),
    }
}

pub(in crate::content) fn check_steps(steps: [DVec3; 3]) -> Result<(), Problem> {
    let mut owners = [0; 3];
    for (axis, step) in (1..).zip(steps) {
        let mm = step.length();
        // Written so that a NaN does not pass.
        if !SPACING_MM.contains(&mm) {
            return Err(Problem::Spacing { axis, mm });
        }
        let along = longest(step);
        let off = (step - DVec3::AXES[along] * step[along]).length() / mm;
        if off > LEAN_MAX {
            return Err(Problem::Oblique { axis, percent: off * 100.0 });
        }
        match owners[along] {
            0 => owners[along] = axis,
            other => return Err(Problem::Parallel { axes: [other, axis] }),
        }
    }
    Ok(())
}

pub(in crate::content) fn check_origin(origin: DVec3) -> Result<(), Problem> {
    let is_near = |v: f64| v.abs() <= ORIGIN_MAX;
    match origin.to_array().into_iter().all(is_near) {
        true => Ok(()),
        false => Err(Problem::Origin),
    }
}

/// The axis of space a step runs along.
fn longest(step: DVec3) -> usize {
    let [x, y, z] = step.abs().to_array();
    if x >= y && x >= z {
        0
    } else if y >= z {
        1
    } else {
        2
    }
}

/// The double that a person would write for a float: 0.2 and not 0.20000000298, as long as it is the same float.
fn widen(value: f32) -> f64 {
    match value.to_string().parse::<f64>() {
        Ok(written) if written as f32 == value => written,
        _ => f64::from(value),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_grid_survives_the_way_through_a_geometry() {
        // Aim: f32 → written double → f32 changes no bit. Method: many floats of every size a grid has.
        let mut state = 1u32;
        for _ in 0..20_000 {
            state = state.wrapping_mul(1664525).wrapping_add(1013904223);
            let value = f32::from_bits(state >> 2);
            assert_eq!(widen(value) as f32, value);
        }
        let grid = Grid::centred([3, 4, 5], Vec3::new(0.2, 0.1, 0.05));
        let geometry = Geometry::of(&grid, Space::LeftPosteriorSuperior);
        assert_eq!(geometry.steps[0], DVec3::new(0.2, 0.0, 0.0));
        assert_eq!(geometry.grid(), Some(grid));
    }

    #[test]
    fn a_turned_array_says_how_it_is_turned_and_makes_no_grid() {
        let geometry = Geometry {
            dims: [2, 3, 4],
            steps: [DVec3::Z * 0.5, DVec3::X * -0.25, DVec3::Y],
            origin: DVec3::new(1.0, 2.0, 3.0),
            space: Space::LeftPosteriorSuperior,
        };
        assert!(check_steps(geometry.steps).is_ok());
        assert_eq!(geometry.axes().map(|axis| axis.along), [2, 0, 1]);
        assert_eq!(geometry.axes().map(|axis| axis.is_reversed), [false, true, false]);
        assert_eq!(geometry.grid(), None);
        assert_eq!(geometry.position([1, 2, 3]), DVec3::new(0.5, 5.0, 3.5));
    }

    #[test]
    fn an_axis_may_lean_by_one_percent_and_no_more() {
        let leaning = |off: f64| check_steps([DVec3::new(1.0, off, 0.0), DVec3::Y, DVec3::Z]);
        assert!(leaning(0.009).is_ok());
        assert!(matches!(leaning(0.011), Err(Problem::Oblique { axis: 1, .. })));
    }
}
