//! Cropping and resampling of scans.
//!
//! Takes an image, a box and a voxel spacing, both in mm. Gives the cut or resampled image. Never reads a file.

use crate::imaging::error::ScanError;
use crate::limits::{AXIS_MAX, VOXELS_MAX};
use crate::nrrd::{Geometry, Samples, VoxelImage};
use glam::{DMat3, DVec3};
use typodont_core::parallel::{available_threads, par_rows};

const DOING: &str = "cropping a scan";

/// Maximum number of samples per axis within one new voxel that spans several old ones: with more than four the mean
/// changes by no more than the noise.
const FINE_MAX: f64 = 4.0;

/// Options for cropping and resampling a scan.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CropOptions {
    /// Lowest and highest corner, mm in the scan's space; `None` keeps the whole scan.
    pub crop: Option<[DVec3; 2]>,
    /// Distance between the new voxels, mm, the same along all axes. The new axes are those of space, whatever the
    /// scan's orientation. `None` keeps the voxels.
    pub resample: Option<f64>,
    /// True for a label map: each new voxel takes the value of the nearest old one. Grey values are interpolated
    /// instead.
    pub holds_labels: bool,
}

/// Crops and resamples a scan. Without a crop box and without a spacing the scan is returned unchanged.
///
/// # Errors
/// Fails when no voxel lies in the box, when the result would have too many voxels, or when the scan's axes do not
/// span a volume.
pub fn crop_and_resample(image: VoxelImage, wanted: &CropOptions) -> Result<VoxelImage, ScanError> {
    match (wanted.resample, wanted.crop) {
        (Some(spacing), crop) => resampled(&image, spacing, crop, wanted.holds_labels),
        (None, Some(crop)) => cropped(image, crop),
        (None, None) => Ok(image),
    }
}

/// Returns the lowest and highest corner of the box around all voxel centres, mm.
pub fn extent(geometry: &Geometry) -> [DVec3; 2] {
    let far = geometry.dims.map(|n| n.saturating_sub(1));
    let corners = (0..8u32).map(|n| geometry.position(std::array::from_fn(|axis| far[axis] * (n >> axis & 1))));
    corners.fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[low, high], p| [low.min(p), high.max(p)])
}

fn nothing_in_box(geometry: &Geometry) -> ScanError {
    let [low, high] = extent(geometry);
    let what = format!(
        "the scan extends from ({:.1}, {:.1}, {:.1}) to ({:.1}, {:.1}, {:.1}) mm, and no part of it is in the crop box",
        low.x, low.y, low.z, high.x, high.y, high.z
    );
    ScanError::new(
        DOING,
        what,
        "give positions within it, as a viewer shows them in millimetres (left, posterior, superior)",
    )
}

/// Keeps the voxels whose centres lie in a box; the scan's axes must be parallel to those of space.
fn cropped(image: VoxelImage, [low, high]: [DVec3; 2]) -> Result<VoxelImage, ScanError> {
    let VoxelImage { mut geometry, samples, keys } = image;
    let mut ranges = [0..0, 0..0, 0..0];
    for ((range, axis), (step, dim)) in
        ranges.iter_mut().zip(geometry.axes()).zip(geometry.steps.into_iter().zip(geometry.dims))
    {
        let at = |place: DVec3| (place - geometry.origin)[axis.along] / step[axis.along];
        let [first, last] = if axis.is_reversed { [at(high), at(low)] } else { [at(low), at(high)] };
        let first = first.ceil().clamp(0.0, f64::from(dim)) as u32;
        *range = first..((last.floor() + 1.0).clamp(f64::from(first), f64::from(dim)) as u32);
    }
    if ranges.iter().any(|range| range.is_empty()) {
        return Err(nothing_in_box(&geometry));
    }
    let samples = match samples {
        Samples::U8(all) => Samples::U8(cropped_samples(&all, geometry.dims, &ranges)),
        Samples::I16(all) => Samples::I16(cropped_samples(&all, geometry.dims, &ranges)),
        Samples::U16(all) => Samples::U16(cropped_samples(&all, geometry.dims, &ranges)),
        Samples::F32(all) => Samples::F32(cropped_samples(&all, geometry.dims, &ranges)),
    };
    geometry.origin = geometry.position([ranges[0].start, ranges[1].start, ranges[2].start]);
    geometry.dims = [0, 1, 2].map(|axis| ranges[axis].len() as u32);
    Ok(VoxelImage { geometry, samples, keys })
}

fn cropped_samples<T: Copy>(all: &[T], dims: [u32; 3], [x, y, z]: &[std::ops::Range<u32>; 3]) -> Vec<T> {
    let [nx, ny, _] = dims.map(|n| n as usize);
    let mut part = Vec::with_capacity(x.len() * y.len() * z.len());
    for k in z.clone() {
        for j in y.clone() {
            let row = (k as usize * ny + j as usize) * nx;
            part.extend_from_slice(&all[row + x.start as usize..row + x.end as usize]);
        }
    }
    part
}

fn resampled(
    image: &VoxelImage,
    spacing: f64,
    crop: Option<[DVec3; 2]>,
    holds_labels: bool,
) -> Result<VoxelImage, ScanError> {
    let geometry = &image.geometry;
    let [mut low, mut high] = extent(geometry);
    if let Some([from, to]) = crop {
        [low, high] = [low.max(from), high.min(to)];
    }
    if !low.cmple(high).all() {
        return Err(nothing_in_box(geometry));
    }
    let counts = ((high - low) / spacing + 1e-6).floor() + 1.0;
    let most = counts.max_element();
    let voxels = counts.x * counts.y * counts.z;
    // Written so that NaN is rejected.
    if !(most <= f64::from(AXIS_MAX) && voxels <= VOXELS_MAX as f64) {
        let what = format!(
            "at {spacing} mm the result would have {:.0}×{:.0}×{:.0} voxels, too many",
            counts.x, counts.y, counts.z
        );
        return Err(ScanError::new(
            DOING,
            what,
            "crop the scan to one tooth (--at, --around), or use a larger --resample",
        ));
    }
    let steps = DMat3::from_cols(geometry.steps[0], geometry.steps[1], geometry.steps[2]);
    let volume = geometry.spacing();
    let is_volume = steps.determinant().abs() > 1e-6 * volume.x * volume.y * volume.z;
    if !is_volume {
        let what = "its axes lie in one plane or have no length";
        return Err(ScanError::new(DOING, what, "export the scan again: its orientation is not that of a volume"));
    }
    let cell_from_space = steps.inverse();
    let dims = [counts.x as u32, counts.y as u32, counts.z as u32];
    // The remainder is shared equally by both sides.
    let origin = low + 0.5 * ((high - low) - (counts - 1.0) * spacing);
    let grid = ResampleGrid {
        cell_from_space,
        first: cell_from_space * (origin - geometry.origin),
        spacing,
        dims,
        holds_labels,
    };
    let samples = match &image.samples {
        Samples::U8(all) => Samples::U8(grid.sampled(all, geometry.dims)),
        Samples::I16(all) => Samples::I16(grid.sampled(all, geometry.dims)),
        Samples::U16(all) => Samples::U16(grid.sampled(all, geometry.dims)),
        Samples::F32(all) => Samples::F32(grid.sampled(all, geometry.dims)),
    };
    let steps = DVec3::AXES.map(|axis| axis * spacing);
    let geometry = Geometry { dims, steps, origin, space: geometry.space };
    Ok(VoxelImage { geometry, samples, keys: image.keys.clone() })
}

/// A voxel value that can be averaged with its neighbours.
trait VoxelValue: Copy + Send + Sync + Default + PartialOrd {
    fn value(self) -> f32;
    fn from_value(value: f32) -> Self;
}

impl VoxelValue for u8 {
    fn value(self) -> f32 {
        self.into()
    }
    fn from_value(value: f32) -> u8 {
        value.round() as u8
    }
}

impl VoxelValue for i16 {
    fn value(self) -> f32 {
        self.into()
    }
    fn from_value(value: f32) -> i16 {
        value.round() as i16
    }
}

impl VoxelValue for u16 {
    fn value(self) -> f32 {
        self.into()
    }
    fn from_value(value: f32) -> u16 {
        value.round() as u16
    }
}

impl VoxelValue for f32 {
    fn value(self) -> f32 {
        self
    }
    fn from_value(value: f32) -> f32 {
        value
    }
}

/// A new grid laid over an old one.
struct ResampleGrid {
    cell_from_space: DMat3,
    /// Position of the first new voxel, in voxels of the old grid.
    first: DVec3,
    spacing: f64,
    dims: [u32; 3],
    holds_labels: bool,
}

impl ResampleGrid {
    fn sampled<T: VoxelValue>(&self, all: &[T], old: [u32; 3]) -> Vec<T> {
        let ResampleGrid { cell_from_space, first, spacing, dims, holds_labels } = *self;
        let step = [0, 1, 2].map(|axis| cell_from_space.col(axis) * spacing);
        let fine = step.map(|s| if holds_labels { 1 } else { s.length().min(FINE_MAX).ceil().max(1.0) as u32 });
        let offsets: Vec<DVec3> = (0..fine[0] * fine[1] * fine[2])
            .map(|n| {
                let at = [n % fine[0], n / fine[0] % fine[1], n / (fine[0] * fine[1])];
                (0..3).map(|a| step[a] * ((f64::from(at[a]) + 0.5) / f64::from(fine[a]) - 0.5)).sum()
            })
            .collect();
        // Beyond the border of a rotated scan, the darkest value of the scan is used. Comparisons with NaN are false,
        // so NaN is skipped.
        let least = all.iter().copied().reduce(|a, b| if b < a { b } else { a }).unwrap_or_default();
        let beyond = if holds_labels { T::default() } else { least };
        let mut new = vec![T::default(); dims.iter().map(|&n| n as usize).product()];
        par_rows(&mut new, dims[0], available_threads(), |row, values| {
            let start = first + step[1] * f64::from(row % dims[1]) + step[2] * f64::from(row / dims[1]);
            for (x, value) in values.iter_mut().enumerate() {
                let at = start + step[0] * x as f64;
                *value = match holds_labels {
                    true => nearest(all, old, at).unwrap_or(beyond),
                    false => {
                        let mixed = |offset: &DVec3| trilinear(all, old, at + *offset).unwrap_or(beyond.value());
                        T::from_value(offsets.iter().map(mixed).sum::<f32>() / offsets.len() as f32)
                    }
                };
            }
        });
        new
    }
}

/// Distance beyond a border voxel's centre up to which a point still belongs to the scan, voxels.
const BORDER: f64 = 0.5 + 1e-6;

fn is_in(old: [u32; 3], at: DVec3) -> bool {
    (0..3).all(|axis| at[axis] >= -BORDER && at[axis] <= f64::from(old[axis]) - 1.0 + BORDER)
}

fn nearest<T: VoxelValue>(all: &[T], old: [u32; 3], at: DVec3) -> Option<T> {
    let cell: [usize; 3] = std::array::from_fn(|axis| at[axis].round().clamp(0.0, f64::from(old[axis]) - 1.0) as usize);
    is_in(old, at).then(|| all[(cell[2] * old[1] as usize + cell[1]) * old[0] as usize + cell[0]])
}

/// Interpolates between voxels, linearly along each axis; `None` outside the scan.
fn trilinear<T: VoxelValue>(all: &[T], old: [u32; 3], at: DVec3) -> Option<f32> {
    if !is_in(old, at) {
        return None;
    }
    let mut below = [0usize; 3];
    let mut above = [0usize; 3];
    let mut share = [0f32; 3];
    for axis in 0..3 {
        let last = f64::from(old[axis]) - 1.0;
        let place = at[axis].clamp(0.0, last);
        below[axis] = place as usize;
        above[axis] = (below[axis] + 1).min(last as usize);
        share[axis] = (place - below[axis] as f64) as f32;
    }
    let [nx, ny] = [old[0] as usize, old[1] as usize];
    let value = |x: usize, y: usize, z: usize| all[(z * ny + y) * nx + x].value();
    let along = |a: f32, b: f32, share: f32| a + (b - a) * share;
    let row = |y, z| along(value(below[0], y, z), value(above[0], y, z), share[0]);
    let plane = |z| along(row(below[1], z), row(above[1], z), share[1]);
    Some(along(plane(below[2]), plane(above[2]), share[2]))
}

/// Applies a function to every value; the result has floating-point samples.
pub(super) fn map_values(samples: Samples, map: impl Fn(f32) -> f32) -> Samples {
    Samples::F32(match samples {
        Samples::U8(all) => all.into_iter().map(|v| map(v.into())).collect(),
        Samples::I16(all) => all.into_iter().map(|v| map(v.into())).collect(),
        Samples::U16(all) => all.into_iter().map(|v| map(v.into())).collect(),
        Samples::F32(all) => all.into_iter().map(map).collect(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nrrd::CoordinateSystem;

    /// Values that rise by 1, 10 and 100 along x, y and z of space, in an array that runs along −y, z and x.
    fn turned() -> VoxelImage {
        let steps = [DVec3::NEG_Y * 0.5, DVec3::Z * 0.25, DVec3::X];
        let origin = DVec3::new(-3.0, 2.0, 1.0);
        let geometry = Geometry { dims: [9, 17, 5], steps, origin, space: CoordinateSystem::LeftPosteriorSuperior };
        let rise = DVec3::new(1.0, 10.0, 100.0);
        let mut values = Vec::new();
        for k in 0..5 {
            for j in 0..17 {
                for i in 0..9 {
                    values.push(geometry.position([i, j, k]).dot(rise) as f32);
                }
            }
        }
        VoxelImage { geometry, samples: Samples::F32(values), keys: Vec::new() }
    }

    fn check_values(image: &VoxelImage) {
        let Samples::F32(values) = &image.samples else { panic!("floats") };
        let [nx, ny, _] = image.geometry.dims;
        for (index, value) in (0u32..).zip(values) {
            let place = image.geometry.position([index % nx, index / nx % ny, index / (nx * ny)]);
            let expected = place.dot(DVec3::new(1.0, 10.0, 100.0)) as f32;
            assert!((value - expected).abs() < 1e-2, "{place}: {value} for {expected}");
        }
    }

    #[test]
    fn a_cropped_part_keeps_its_position() {
        let crop = Some([DVec3::new(-2.1, -1.1, 2.2), DVec3::new(0.1, 1.1, 4.1)]);
        let image = crop_and_resample(turned(), &CropOptions { crop, ..CropOptions::default() }).unwrap();
        // y from −1 to 1, z from 2.25 to 4, x from −2 to 0.
        assert_eq!(image.geometry.dims, [5, 8, 3]);
        check_values(&image);
        let away = Some([DVec3::splat(50.0), DVec3::splat(60.0)]);
        let message =
            crop_and_resample(turned(), &CropOptions { crop: away, ..CropOptions::default() }).unwrap_err().to_string();
        assert!(message.contains("from (-3.0, -2.0, 1.0) to (1.0, 2.0, 5.0) mm"), "{message}");
    }

    #[test]
    fn a_linear_field_survives_resampling_and_is_axis_aligned() {
        let crop = Some([DVec3::new(-2.0, -1.0, 2.0), DVec3::new(0.0, 1.0, 4.0)]);
        for spacing in [0.1, 0.3, 0.5] {
            let image =
                crop_and_resample(turned(), &CropOptions { crop, resample: Some(spacing), holds_labels: false })
                    .unwrap();
            assert!(image.geometry.grid().is_some());
            check_values(&image);
        }
        let message = crop_and_resample(turned(), &CropOptions { resample: Some(1e-4), ..CropOptions::default() })
            .unwrap_err()
            .to_string();
        assert!(message.contains("too many") && message.contains("--resample"), "{message}");
    }

    #[test]
    fn a_rotated_scan_is_resampled_along_the_axes_of_space() {
        // Aim: the values of an oblique scan keep their positions. Method: a linear field, the array rotated by 20°
        // about z.
        let mut image = turned();
        let rotation = DMat3::from_rotation_z(0.35);
        image.geometry.steps = image.geometry.steps.map(|step| rotation * step);
        let rise = DVec3::new(1.0, 10.0, 100.0);
        let Samples::F32(values) = &mut image.samples else { panic!("floats") };
        for (index, value) in (0u32..).zip(values.iter_mut()) {
            *value = image.geometry.position([index % 9, index / 9 % 17, index / 153]).dot(rise) as f32;
        }
        let [low, high] = extent(&image.geometry);
        let middle = 0.5 * (low + high);
        let crop = Some([middle - 0.4, middle + 0.4]);
        let laid = crop_and_resample(image, &CropOptions { crop, resample: Some(0.2), holds_labels: false }).unwrap();
        assert_eq!(laid.geometry.dims, [5, 5, 5]);
        check_values(&laid);
    }

    #[test]
    fn labels_are_never_mixed() {
        let mut image = turned();
        image.samples = Samples::U8((0..765).map(|i| if i % 3 == 0 { 7 } else { 2 }).collect());
        let new =
            crop_and_resample(image, &CropOptions { resample: Some(0.13), holds_labels: true, crop: None }).unwrap();
        let Samples::U8(values) = new.samples else { panic!("bytes") };
        assert!(values.iter().all(|v| [2, 7].contains(v)));
    }
}
