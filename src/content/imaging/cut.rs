//! One tooth out of a scan, and another distance between voxels.

use super::unread::Unread;
use crate::content::nrrd::{AXIS_MAX, Geometry, Image, Samples, VOXELS_MAX};
use crate::volume::rows::{in_rows, processors};
use glam::{DMat3, DVec3};

const DOING: &str = "cutting a scan";

/// Samples along each side of a new voxel that spans several old ones: beyond four a mean changes no more than noise.
const FINE_MAX: f64 = 4.0;

/// The part of a scan that is wanted, and how fine.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cut {
    /// Lowest and highest corner, mm in the scan's space.
    pub crop: Option<[DVec3; 2]>,
    /// Distance between the new voxels, the same along all axes, mm. Their axes are those of space, however the scan's lie.
    pub resample: Option<f64>,
    /// Numbers of tissues are taken from the nearest voxel, grey values are mixed.
    pub holds_labels: bool,
}

/// Cuts a scan. Without a crop and without a spacing it is left as it is.
pub fn cut(image: Image, wanted: &Cut) -> Result<Image, Unread> {
    match (wanted.resample, wanted.crop) {
        (Some(spacing), crop) => resampled(&image, spacing, crop, wanted.holds_labels),
        (None, Some(crop)) => cropped(image, crop),
        (None, None) => Ok(image),
    }
}

/// The box around all voxels' centres, mm.
pub fn extent(geometry: &Geometry) -> [DVec3; 2] {
    let far = geometry.dims.map(|n| n.saturating_sub(1));
    let corners = (0..8u32).map(|n| geometry.position(std::array::from_fn(|axis| far[axis] * (n >> axis & 1))));
    corners.fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[low, high], p| [low.min(p), high.max(p)])
}

fn outside(geometry: &Geometry) -> Unread {
    let [low, high] = extent(geometry);
    let what = format!(
        "the scan reaches from ({:.1}, {:.1}, {:.1}) to ({:.1}, {:.1}, {:.1}) mm, and nothing of it is in the box to be cut out",
        low.x, low.y, low.z, high.x, high.y, high.z
    );
    Unread::new(DOING, what, "give places within it, as a viewer shows them in millimetres (left, posterior, superior)")
}

/// The voxels whose centres lie in a box; the scan's axes run along those of space.
fn cropped(image: Image, [low, high]: [DVec3; 2]) -> Result<Image, Unread> {
    let Image { mut geometry, samples, keys } = image;
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
        return Err(outside(&geometry));
    }
    let samples = match samples {
        Samples::U8(all) => Samples::U8(part(&all, geometry.dims, &ranges)),
        Samples::I16(all) => Samples::I16(part(&all, geometry.dims, &ranges)),
        Samples::U16(all) => Samples::U16(part(&all, geometry.dims, &ranges)),
        Samples::F32(all) => Samples::F32(part(&all, geometry.dims, &ranges)),
    };
    geometry.origin = geometry.position([ranges[0].start, ranges[1].start, ranges[2].start]);
    geometry.dims = [0, 1, 2].map(|axis| ranges[axis].len() as u32);
    Ok(Image { geometry, samples, keys })
}

fn part<T: Copy>(all: &[T], dims: [u32; 3], [x, y, z]: &[std::ops::Range<u32>; 3]) -> Vec<T> {
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

fn resampled(image: &Image, spacing: f64, crop: Option<[DVec3; 2]>, holds_labels: bool) -> Result<Image, Unread> {
    let geometry = &image.geometry;
    let [mut low, mut high] = extent(geometry);
    if let Some([from, to]) = crop {
        [low, high] = [low.max(from), high.min(to)];
    }
    if !low.cmple(high).all() {
        return Err(outside(geometry));
    }
    let counts = ((high - low) / spacing + 1e-6).floor() + 1.0;
    let most = counts.max_element();
    let voxels = counts.x * counts.y * counts.z;
    // Written so that a NaN does not pass.
    if !(most <= f64::from(AXIS_MAX) && voxels <= VOXELS_MAX as f64) {
        let what = format!("at {spacing} mm it has {:.0}×{:.0}×{:.0} voxels, too many", counts.x, counts.y, counts.z);
        return Err(Unread::new(DOING, what, "crop it to one tooth (--at, --around), or take a larger --resample"));
    }
    let steps = DMat3::from_cols(geometry.steps[0], geometry.steps[1], geometry.steps[2]);
    let volume = geometry.spacing();
    let is_volume = steps.determinant().abs() > 1e-6 * volume.x * volume.y * volume.z;
    if !is_volume {
        let what = "its axes lie in one plane or have no length";
        return Err(Unread::new(DOING, what, "export the scan again: its orientation is not that of a volume"));
    }
    let cell_from_space = steps.inverse();
    let dims = [counts.x as u32, counts.y as u32, counts.z as u32];
    // What is left over is shared by both sides.
    let origin = low + 0.5 * ((high - low) - (counts - 1.0) * spacing);
    let grid =
        Laid { cell_from_space, first: cell_from_space * (origin - geometry.origin), spacing, dims, holds_labels };
    let samples = match &image.samples {
        Samples::U8(all) => Samples::U8(grid.sampled(all, geometry.dims)),
        Samples::I16(all) => Samples::I16(grid.sampled(all, geometry.dims)),
        Samples::U16(all) => Samples::U16(grid.sampled(all, geometry.dims)),
        Samples::F32(all) => Samples::F32(grid.sampled(all, geometry.dims)),
    };
    let steps = DVec3::AXES.map(|axis| axis * spacing);
    let geometry = Geometry { dims, steps, origin, space: geometry.space };
    Ok(Image { geometry, samples, keys: image.keys.clone() })
}

/// A number that can be mixed with its neighbours.
trait Sample: Copy + Send + Sync + Default + PartialOrd {
    fn value(self) -> f32;
    fn of(value: f32) -> Self;
}

impl Sample for u8 {
    fn value(self) -> f32 {
        self.into()
    }
    fn of(value: f32) -> u8 {
        value.round() as u8
    }
}

impl Sample for i16 {
    fn value(self) -> f32 {
        self.into()
    }
    fn of(value: f32) -> i16 {
        value.round() as i16
    }
}

impl Sample for u16 {
    fn value(self) -> f32 {
        self.into()
    }
    fn of(value: f32) -> u16 {
        value.round() as u16
    }
}

impl Sample for f32 {
    fn value(self) -> f32 {
        self
    }
    fn of(value: f32) -> f32 {
        value
    }
}

/// A new grid laid over an old one.
struct Laid {
    cell_from_space: DMat3,
    /// The first new voxel, in old voxels.
    first: DVec3,
    spacing: f64,
    dims: [u32; 3],
    holds_labels: bool,
}

impl Laid {
    fn sampled<T: Sample>(&self, all: &[T], old: [u32; 3]) -> Vec<T> {
        let Laid { cell_from_space, first, spacing, dims, holds_labels } = *self;
        let step = [0, 1, 2].map(|axis| cell_from_space.col(axis) * spacing);
        let fine = step.map(|s| if holds_labels { 1 } else { s.length().min(FINE_MAX).ceil().max(1.0) as u32 });
        let offsets: Vec<DVec3> = (0..fine[0] * fine[1] * fine[2])
            .map(|n| {
                let at = [n % fine[0], n / fine[0] % fine[1], n / (fine[0] * fine[1])];
                (0..3).map(|a| step[a] * ((f64::from(at[a]) + 0.5) / f64::from(fine[a]) - 0.5)).sum()
            })
            .collect();
        // Beyond a turned scan there is what is darkest in it; NaN compares with nothing and so is passed over.
        let least = all.iter().copied().reduce(|a, b| if b < a { b } else { a }).unwrap_or_default();
        let beyond = if holds_labels { T::default() } else { least };
        let mut new = vec![T::default(); dims.iter().map(|&n| n as usize).product()];
        in_rows(&mut new, dims[0], processors(), |row, values| {
            let start = first + step[1] * f64::from(row % dims[1]) + step[2] * f64::from(row / dims[1]);
            for (x, value) in values.iter_mut().enumerate() {
                let at = start + step[0] * x as f64;
                *value = match holds_labels {
                    true => nearest(all, old, at).unwrap_or(beyond),
                    false => {
                        let mixed = |offset: &DVec3| mixed(all, old, at + *offset).unwrap_or(beyond.value());
                        T::of(offsets.iter().map(mixed).sum::<f32>() / offsets.len() as f32)
                    }
                };
            }
        });
        new
    }
}

/// How far beyond a border voxel's centre it still counts, voxels.
const BORDER: f64 = 0.5 + 1e-6;

fn is_in(old: [u32; 3], at: DVec3) -> bool {
    (0..3).all(|axis| at[axis] >= -BORDER && at[axis] <= f64::from(old[axis]) - 1.0 + BORDER)
}

fn nearest<T: Sample>(all: &[T], old: [u32; 3], at: DVec3) -> Option<T> {
    let cell: [usize; 3] = std::array::from_fn(|axis| at[axis].round().clamp(0.0, f64::from(old[axis]) - 1.0) as usize);
    is_in(old, at).then(|| all[(cell[2] * old[1] as usize + cell[1]) * old[0] as usize + cell[0]])
}

/// The value between voxels, linear along each axis.
fn mixed<T: Sample>(all: &[T], old: [u32; 3], at: DVec3) -> Option<f32> {
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

/// Every value changed; they become floating-point numbers.
pub(super) fn mapped(samples: Samples, map: impl Fn(f32) -> f32) -> Samples {
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
    use crate::content::nrrd::Space;

    /// Values that rise by 1, 10 and 100 along x, y and z of space, in an array that runs along −y, z and x.
    fn turned() -> Image {
        let steps = [DVec3::NEG_Y * 0.5, DVec3::Z * 0.25, DVec3::X];
        let origin = DVec3::new(-3.0, 2.0, 1.0);
        let geometry = Geometry { dims: [9, 17, 5], steps, origin, space: Space::LeftPosteriorSuperior };
        let rise = DVec3::new(1.0, 10.0, 100.0);
        let mut values = Vec::new();
        for k in 0..5 {
            for j in 0..17 {
                for i in 0..9 {
                    values.push(geometry.position([i, j, k]).dot(rise) as f32);
                }
            }
        }
        Image { geometry, samples: Samples::F32(values), keys: Vec::new() }
    }

    fn check_values(image: &Image) {
        let Samples::F32(values) = &image.samples else { panic!("floats") };
        let [nx, ny, _] = image.geometry.dims;
        for (index, value) in (0u32..).zip(values) {
            let place = image.geometry.position([index % nx, index / nx % ny, index / (nx * ny)]);
            let expected = place.dot(DVec3::new(1.0, 10.0, 100.0)) as f32;
            assert!((value - expected).abs() < 1e-2, "{place}: {value} for {expected}");
        }
    }

    #[test]
    fn what_is_cut_out_stays_where_it_was() {
        let crop = Some([DVec3::new(-2.1, -1.1, 2.2), DVec3::new(0.1, 1.1, 4.1)]);
        let image = cut(turned(), &Cut { crop, ..Cut::default() }).unwrap();
        // y from −1 to 1, z from 2.25 to 4, x from −2 to 0.
        assert_eq!(image.geometry.dims, [5, 8, 3]);
        check_values(&image);
        let away = Some([DVec3::splat(50.0), DVec3::splat(60.0)]);
        let told = cut(turned(), &Cut { crop: away, ..Cut::default() }).unwrap_err().to_string();
        assert!(told.contains("from (-3.0, -2.0, 1.0) to (1.0, 2.0, 5.0) mm"), "{told}");
    }

    #[test]
    fn a_plane_of_values_survives_another_spacing_and_comes_upright() {
        let crop = Some([DVec3::new(-2.0, -1.0, 2.0), DVec3::new(0.0, 1.0, 4.0)]);
        for spacing in [0.1, 0.3, 0.5] {
            let image = cut(turned(), &Cut { crop, resample: Some(spacing), holds_labels: false }).unwrap();
            assert!(image.geometry.grid().is_some());
            check_values(&image);
        }
        let told = cut(turned(), &Cut { resample: Some(1e-4), ..Cut::default() }).unwrap_err().to_string();
        assert!(told.contains("too many") && told.contains("--resample"), "{told}");
    }

    #[test]
    fn a_turned_scan_is_laid_along_the_axes_of_space() {
        // Aim: an oblique scan's values stay in their place. Method: a plane of values, the array turned by 20° about z.
        let mut image = turned();
        let turn = DMat3::from_rotation_z(0.35);
        image.geometry.steps = image.geometry.steps.map(|step| turn * step);
        let rise = DVec3::new(1.0, 10.0, 100.0);
        let Samples::F32(values) = &mut image.samples else { panic!("floats") };
        for (index, value) in (0u32..).zip(values.iter_mut()) {
            *value = image.geometry.position([index % 9, index / 9 % 17, index / 153]).dot(rise) as f32;
        }
        let [low, high] = extent(&image.geometry);
        let middle = 0.5 * (low + high);
        let crop = Some([middle - 0.4, middle + 0.4]);
        let laid = cut(image, &Cut { crop, resample: Some(0.2), holds_labels: false }).unwrap();
        assert_eq!(laid.geometry.dims, [5, 5, 5]);
        check_values(&laid);
    }

    #[test]
    fn labels_are_never_mixed() {
        let mut image = turned();
        image.samples = Samples::U8((0..765).map(|i| if i % 3 == 0 { 7 } else { 2 }).collect());
        let new = cut(image, &Cut { resample: Some(0.13), holds_labels: true, crop: None }).unwrap();
        let Samples::U8(values) = new.samples else { panic!("bytes") };
        assert!(values.iter().all(|v| [2, 7].contains(v)));
    }
}
