//! Position and orientation of the voxels of a file.

use crate::limits::{AXIS_MAX, VOXELS_MAX};
use crate::nrrd::error::NrrdErrorKind;
use glam::DVec3;
use typodont_core::frame::Vec3;
use typodont_core::volume::Grid;

/// Valid voxel spacings, mm: voxels closer than 0.1 µm or farther apart than 1 m are in another unit.
const SPACING_MM: std::ops::RangeInclusive<f64> = 1e-4..=1e3;

/// Maximum deviation of an axis from the nearest axis of space, as a fraction of its length. At 1 % the far end of a
/// tooth is one voxel off; scanners round to far less.
const LEAN_MAX: f64 = 0.01;

/// One kilometre, mm: beyond it positions lose their tenths of a millimetre in single precision.
const ORIGIN_MAX: f64 = 1e6;

/// The regular grid of a file. Unlike a [`Grid`], its axes may be parallel to any axis of space, in either direction.
#[derive(Clone, Debug, PartialEq)]
pub struct Geometry {
    /// Number of voxels along each axis of the array; the first varies fastest.
    pub dims: [u32; 3],
    /// Vector from one voxel to the next along each axis of the array, mm in `space`. In NRRD files each is parallel
    /// to one axis of space, within 1 %; other formats may have oblique axes.
    pub steps: [DVec3; 3],
    /// Centre of the first voxel, mm in `space`; zero if the file does not state it.
    pub origin: DVec3,
    pub space: CoordinateSystem,
}

/// Meaning of the x, y and z of positions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CoordinateSystem {
    /// x to the patient's left, y to the back, z to the head. Files in right-anterior-superior or
    /// left-anterior-superior are converted on reading, so that positions agree.
    LeftPosteriorSuperior,
    ScannerXyz,
    RightHanded,
    LeftHanded,
    /// Not stated in the file.
    Unspecified,
}

/// Direction of one axis of the array.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Axis {
    /// Axis of space that it is parallel to: 0, 1 or 2.
    pub along: usize,
    /// True when it runs from high coordinates to low ones.
    pub is_reversed: bool,
}

impl Geometry {
    /// Returns the geometry of a grid, whose tooth space is taken for `space`.
    pub fn of(grid: &Grid, space: CoordinateSystem) -> Geometry {
        let [x, y, z] = grid.spacing.to_array().map(widen);
        Geometry {
            dims: grid.dims,
            steps: [DVec3::X * x, DVec3::Y * y, DVec3::Z * z],
            origin: DVec3::from_array(grid.origin.to_array().map(widen)),
            space,
        }
    }

    /// Returns the grid if the array's axes run along +x, +y and +z. Otherwise, the samples must be reordered first.
    pub fn grid(&self) -> Option<Grid> {
        let is_upright = self.axes().iter().enumerate().all(|(i, axis)| axis.along == i && !axis.is_reversed);
        let narrow = |v: DVec3| Vec3::new(v.x as f32, v.y as f32, v.z as f32);
        is_upright.then(|| Grid { dims: self.dims, spacing: narrow(self.spacing()), origin: narrow(self.origin) })
    }

    /// Returns the number of voxels.
    pub fn len(&self) -> usize {
        self.dims.iter().map(|&n| n as usize).product()
    }

    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns the distance between voxel centres along each axis of the array, mm.
    pub fn spacing(&self) -> DVec3 {
        DVec3::from_array(self.steps.map(|step| step.length()))
    }

    /// Returns the direction of each axis of the array.
    pub fn axes(&self) -> [Axis; 3] {
        self.steps.map(|step| {
            let along = longest(step);
            Axis { along, is_reversed: step[along] < 0.0 }
        })
    }

    /// Returns the centre of a voxel of the array, mm in `space`.
    pub fn position(&self, [i, j, k]: [u32; 3]) -> DVec3 {
        let [a, b, c] = self.steps;
        self.origin + a * f64::from(i) + b * f64::from(j) + c * f64::from(k)
    }

    /// Multiplies x, y and z by signs, to convert from spaces with opposite axes.
    pub(super) fn flip(&mut self, signs: [f64; 3]) {
        // Adding zero turns −0 into +0.
        let flipped = |v: DVec3| v * DVec3::from_array(signs) + DVec3::ZERO;
        self.steps = self.steps.map(flipped);
        self.origin = flipped(self.origin);
    }
}

/// Checks sizes; shared by the readers and the writer.
pub(crate) fn check_dims(dims: [u64; 3]) -> Result<[u32; 3], NrrdErrorKind> {
    for (axis, voxels) in (1..).zip(dims) {
        if voxels > u64::from(AXIS_MAX) {
            return Err(NrrdErrorKind::TooLarge { axis: Some(axis), voxels });
        }
    }
    match dims.iter().product() {
        voxels if voxels > VOXELS_MAX => Err(NrrdErrorKind::TooLarge { axis: None, voxels }),
        _ => Ok(dims.map(|n| n as u32)),
    }
}

pub(crate) fn check_steps(steps: [DVec3; 3]) -> Result<(), NrrdErrorKind> {
    let mut owners = [0; 3];
    for (axis, step) in (1..).zip(steps) {
        let mm = step.length();
        // Written so that NaN is rejected.
        if !SPACING_MM.contains(&mm) {
            return Err(NrrdErrorKind::Spacing { axis, mm });
        }
        let along = longest(step);
        let off = (step - DVec3::AXES[along] * step[along]).length() / mm;
        if off > LEAN_MAX {
            return Err(NrrdErrorKind::Oblique { axis, percent: off * 100.0 });
        }
        match owners[along] {
            0 => owners[along] = axis,
            other => return Err(NrrdErrorKind::Parallel { axes: [other, axis] }),
        }
    }
    Ok(())
}

pub(crate) fn check_origin(origin: DVec3) -> Result<(), NrrdErrorKind> {
    let is_near = |v: f64| v.abs() <= ORIGIN_MAX;
    match origin.to_array().into_iter().all(is_near) {
        true => Ok(()),
        false => Err(NrrdErrorKind::Origin),
    }
}

/// Returns the axis of space that is closest to a step.
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

/// Converts a float to the double that a person would write for it: 0.2 and not 0.20000000298, provided that it is
/// the same float.
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
    fn a_grid_survives_the_conversion_to_a_geometry() {
        // Aim: f32 → written double → f32 changes no bit. Method: floats of every magnitude that a grid may have.
        let mut state = 1u32;
        for _ in 0..20_000 {
            state = state.wrapping_mul(1664525).wrapping_add(1013904223);
            let value = f32::from_bits(state >> 2);
            assert_eq!(widen(value) as f32, value);
        }
        let grid = Grid::centred([3, 4, 5], Vec3::new(0.2, 0.1, 0.05));
        let geometry = Geometry::of(&grid, CoordinateSystem::LeftPosteriorSuperior);
        assert_eq!(geometry.steps[0], DVec3::new(0.2, 0.0, 0.0));
        assert_eq!(geometry.grid(), Some(grid));
    }

    #[test]
    fn a_rotated_array_reports_its_axes_and_has_no_grid() {
        let geometry = Geometry {
            dims: [2, 3, 4],
            steps: [DVec3::Z * 0.5, DVec3::X * -0.25, DVec3::Y],
            origin: DVec3::new(1.0, 2.0, 3.0),
            space: CoordinateSystem::LeftPosteriorSuperior,
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
        assert!(matches!(leaning(0.011), Err(NrrdErrorKind::Oblique { axis: 1, .. })));
    }
}
