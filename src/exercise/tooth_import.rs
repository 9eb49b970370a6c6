//! The import of CT scans and label maps of teeth.
//!
//! Takes images as stored in files. Gives volumes and masks, or one error message for the author.

use crate::catalog::TissueTable;
use std::collections::{BTreeMap, BTreeSet};
use typodont_anatomy::TissueLabels;
use typodont_core::frame::Vec3;
use typodont_core::volume::{Grid, Label, Volume};
use typodont_formats::import::{GreyValues, ImportedTooth, segment, set_upright, volume_from_label_map};
use typodont_formats::nrrd::segmentation::Segmentation;
use typodont_formats::nrrd::{CoordinateSystem, Geometry, Samples, VoxelImage};

/// Maximum number of values listed in a message.
const LISTED: usize = 8;

/// Returns a tooth from its CT scan, or from a label map that names its tissues; crown up.
///
/// # Errors
/// Returns a message if the voxel spacing or a segment's tissue is unknown, if the numbers of a label map cannot be
/// read as tissues, or if the tooth cannot be segmented.
pub fn tooth_volume(
    image: &VoxelImage,
    spacing: Option<[f32; 3]>,
    table: &TissueTable,
    tissues: &TissueLabels,
) -> Result<ImportedTooth, String> {
    match labels_by_number(image, table)? {
        Some(names) => {
            let volume = set_upright(labelled(image, spacing, &names)?, tissues);
            Ok(ImportedTooth { volume, grey_values: None })
        }
        None => segmented(image, spacing, tissues),
    }
}

/// Segments a CT scan of one tooth into its tissues, crown up.
///
/// `spacing` (mm, along x, y and z) replaces the image's own spacing.
///
/// # Errors
/// Returns a message if the voxel spacing is unknown, or if the tooth cannot be segmented.
pub fn segmented(
    image: &VoxelImage,
    spacing: Option<[f32; 3]>,
    tissues: &TissueLabels,
) -> Result<ImportedTooth, String> {
    let (grid, values) = axis_aligned(image, spacing)?;
    segment::segment(&grid, values, tissues).map_err(|unclear| unclear.to_string())
}

/// Segments a CT scan of one tooth for a label map: large scans are segmented from coarse to fine, and the density is
/// not smoothed; grey values of large scans are kept only if `keeps_grey_values`.
///
/// # Errors
/// Returns a message if the voxel spacing is unknown, or if the tooth cannot be segmented.
pub fn segmented_labels(
    image: VoxelImage,
    tissues: &TissueLabels,
    keeps_grey_values: bool,
) -> Result<ImportedTooth, String> {
    let (grid, values) = axis_aligned(&image, None)?;
    drop(image);
    segment::labels(&grid, values, tissues, keeps_grey_values).map_err(|unclear| unclear.to_string())
}

/// Returns the grey values of a tooth that was drawn as a label map, from the CT scan on which it was drawn, voxel by voxel.
///
/// `map`: where the label map's voxels lie, as its file says. `spacing` (mm, along x, y and z) replaces that of both files.
///
/// # Errors
/// Returns a message if the scan has not the voxels of the map, or if its enamel is not brighter than what surrounds the
/// tooth.
pub fn grey_values_of(
    scan: &VoxelImage,
    map: &Geometry,
    spacing: Option<[f32; 3]>,
    volume: &Volume,
    enamel: Label,
) -> Result<GreyValues, String> {
    if !is_same_place(&scan.geometry, map) {
        return Err("the voxels of the scan are not those of the label map; save the map on the scan's own grid".into());
    }
    // The map's geometry for both: the files may state it with different precision.
    let on_map = VoxelImage { geometry: map.clone(), samples: scan.samples.clone(), keys: Vec::new() };
    let (grid, values) = axis_aligned(&on_map, spacing)?;
    // The volume is larger than the map where its tooth lies at the border.
    let own = volume.grid();
    let at = |cell: [u32; 3]| grid.nearest(own.centre(cell)).map(|cell| values[grid.index(cell)]);
    let scanned: Vec<f32> = own.cells().map(|cell| at(cell).unwrap_or(f32::NAN)).collect();
    GreyValues::of_labelled(&scanned, volume, enamel).ok_or_else(|| {
        "the enamel of the label map is not brighter in the scan than what surrounds the tooth, or there is none".into()
    })
}

/// True if the corners of two images are less than a tenth of a voxel apart, in the same space.
fn is_same_place(a: &Geometry, b: &Geometry) -> bool {
    let last = a.dims.map(|n| n.saturating_sub(1));
    let corners = [0, 1, 2, 3].map(|i| std::array::from_fn(|axis| if axis + 1 == i { last[axis] } else { 0 }));
    let tolerance = 0.1 * a.spacing().min_element();
    let is_near = |corner: [u32; 3]| a.position(corner).distance(b.position(corner)) <= tolerance;
    a.dims == b.dims && a.space == b.space && corners.into_iter().all(is_near)
}

/// Returns the grid and the values of an image along +x, +y and +z of its space.
fn axis_aligned(image: &VoxelImage, spacing: Option<[f32; 3]>) -> Result<(Grid, Vec<f32>), String> {
    let order = AxisOrder::of(&image.geometry);
    let grid = order.grid(&image.geometry, spacing)?;
    let values: Vec<f32> = match &image.samples {
        Samples::U8(samples) => order.reordered(samples, |v| v.into()),
        Samples::I16(samples) => order.reordered(samples, |v| v.into()),
        Samples::U16(samples) => order.reordered(samples, |v| v.into()),
        Samples::F32(samples) => order.reordered(samples, |v| v),
    };
    Ok((grid, values))
}

/// Returns the tissue for each number of a label map whose file names its segments as 3D Slicer does; `None` if the
/// file names no segments.
///
/// # Errors
/// Returns a message if the segments cannot be read, or if a segment's tissue is unknown.
pub fn labels_by_number(image: &VoxelImage, table: &TissueTable) -> Result<Option<BTreeMap<u8, Label>>, String> {
    if image.key("Segment0_ID").is_none() {
        return Ok(None);
    }
    let segments = Segmentation::from_image(image.clone()).map_err(|e| e.to_string())?.segments;
    let tissues = segments.iter().map(|segment| {
        let by_id = table.label_of(&segment.id.to_lowercase());
        let label = by_id.or_else(|_| table.label_of(&segment.name.to_lowercase()))?;
        Ok((segment.label_value, label))
    });
    tissues.collect::<Result<_, String>>().map(Some)
}

/// Returns a label map as a volume, with a smoothed surface. `names` gives the tissue for each number; 0 is air.
///
/// `spacing` (mm, along x, y and z) replaces the image's own spacing. The axes are put in order, but the tooth is not
/// rotated: its crown must point toward +z.
///
/// # Errors
/// Returns a message if the voxel spacing is unknown, if the image contains numbers that are not whole or have no name,
/// or if every voxel is air.
pub fn labelled(image: &VoxelImage, spacing: Option<[f32; 3]>, names: &BTreeMap<u8, Label>) -> Result<Volume, String> {
    let order = AxisOrder::of(&image.geometry);
    let grid = order.grid(&image.geometry, spacing)?;
    let number = number_reader(&image.samples)?;
    let mut unnamed = BTreeSet::new();
    let label_of = |number: i32| match u8::try_from(number) {
        Ok(0) => Some(Label::AIR),
        Ok(number) => names.get(&number).copied(),
        Err(_) => None,
    };
    let mut label = Vec::with_capacity(grid.len());
    for index in order.indices() {
        let number = number(index);
        label.push(label_of(number).unwrap_or_else(|| {
            unnamed.insert(number);
            Label::AIR
        }));
    }
    if !unnamed.is_empty() {
        return Err(format!(
            "no tissue is assigned to {}; assign a tissue to each number of the map",
            listed(&unnamed)
        ));
    }
    volume_from_label_map(&grid, label).ok_or_else(|| {
        "every voxel has the number 0, which is air; draw the tooth in \
    the map"
            .to_string()
    })
}

/// Returns a label map as the volume of one object, with a smoothed surface: 0 is air, every other number the object.
///
/// # Errors
/// Returns a message if the voxel spacing is unknown, if the image contains numbers that are not whole, or if every voxel
/// is air.
pub(crate) fn solid_volume(image: &VoxelImage) -> Result<Volume, String> {
    let order = AxisOrder::of(&image.geometry);
    let grid = order.grid(&image.geometry, None).map_err(|_| "the voxel spacing is unknown".to_string())?;
    let number = number_reader(&image.samples)?;
    let labels = order.indices().map(|index| if number(index) == 0 { Label::AIR } else { Label(1) }).collect();
    volume_from_label_map(&grid, labels).ok_or_else(|| "every voxel has the number 0, which is air".to_string())
}

/// Returns a flag for each voxel, true for voxels with exactly this value, x fastest.
///
/// The file's axes may have either direction, but must be in the order x, y, z, so that the mask has the size of the
/// volume that it marks.
///
/// # Errors
/// Returns a message if the axes are in another order, if the image contains numbers that are not whole, or if no voxel
/// has the value.
pub fn mask(image: &VoxelImage, value: u8) -> Result<Vec<bool>, String> {
    let order = AxisOrder::of(&image.geometry);
    if order.dims != image.geometry.dims {
        return Err(
            "the axes of the map are not in the order x, y, z; save the map on the tooth's own grid".to_string()
        );
    }
    let number = number_reader(&image.samples)?;
    let mask: Vec<bool> = order.indices().map(|index| number(index) == i32::from(value)).collect();
    match mask.contains(&true) {
        true => Ok(mask),
        false => Err(format!("no voxel has the value {value}")),
    }
}

/// Order of an image's samples along +x, +y and +z of its space.
struct AxisOrder {
    /// Voxels along x, y and z.
    dims: [u32; 3],
    /// Index of the sample with the lowest x, y and z.
    first: i64,
    /// Steps in the sample index along x, y and z.
    strides: [i64; 3],
}

impl AxisOrder {
    fn of(geometry: &Geometry) -> AxisOrder {
        let mut order = AxisOrder { dims: [0; 3], first: 0, strides: [0; 3] };
        let mut stride = 1;
        for (axis, dim) in geometry.axes().into_iter().zip(geometry.dims) {
            // A left-handed space would give the mirror image of a tooth.
            let is_reversed = axis.is_reversed != (axis.along == 0 && geometry.space == CoordinateSystem::LeftHanded);
            order.dims[axis.along] = dim;
            order.strides[axis.along] = if is_reversed { -stride } else { stride };
            order.first += if is_reversed { stride * (i64::from(dim) - 1) } else { 0 };
            stride *= i64::from(dim);
        }
        order
    }

    fn indices(&self) -> impl Iterator<Item = usize> + '_ {
        let AxisOrder { dims, first, strides } = self;
        let steps = move |axis: usize| (0..i64::from(dims[axis])).map(move |n| n * strides[axis]);
        steps(2).flat_map(move |z| steps(1).flat_map(move |y| steps(0).map(move |x| (first + x + y + z) as usize)))
    }

    /// Returns all samples in this order, each converted by `change`.
    fn reordered<T: Copy>(&self, samples: &[T], change: impl Fn(T) -> f32) -> Vec<f32> {
        let [nx, ny, _] = self.dims.map(i64::from);
        // Most arrays are already in order and need no index per voxel.
        match self.first == 0 && self.strides == [1, nx, nx * ny] {
            true => samples.iter().map(|&sample| change(sample)).collect(),
            false => self.indices().map(|i| change(samples[i])).collect(),
        }
    }

    /// Returns the grid in this order; a given spacing replaces the image's own.
    fn grid(&self, geometry: &Geometry, spacing: Option<[f32; 3]>) -> Result<Grid, String> {
        let mut stated = Vec3::ZERO;
        for (axis, mm) in geometry.axes().into_iter().zip(geometry.spacing().to_array()) {
            stated[axis.along] = mm as f32;
        }
        let spacing = spacing.map_or(stated, Vec3::from);
        if !(spacing.is_finite() && spacing.cmpgt(Vec3::ZERO).all()) {
            return Err("the voxel spacing is unknown; give the spacing of the tooth in mm".to_string());
        }
        let grid = Grid::centred(self.dims, spacing);
        let corners = [[0; 3], geometry.dims.map(|n| n.saturating_sub(1))].map(|cell| geometry.position(cell));
        let origin = corners[0].min(corners[1]).to_array().map(|mm| mm as f32);
        let is_mirrored = geometry.space == CoordinateSystem::LeftHanded;
        // With another spacing or a mirrored axis, the positions in the file are invalid.
        Ok(if spacing == stated && !is_mirrored { Grid { origin: Vec3::from(origin), ..grid } } else { grid })
    }
}

/// Returns a reader of an image's samples as whole numbers; an error message if a sample is not whole.
fn number_reader(samples: &Samples) -> Result<Box<dyn Fn(usize) -> i32 + '_>, String> {
    match samples {
        Samples::U8(samples) => Ok(Box::new(|i| i32::from(samples[i]))),
        Samples::I16(samples) => Ok(Box::new(|i| i32::from(samples[i]))),
        Samples::U16(samples) => Ok(Box::new(|i| i32::from(samples[i]))),
        Samples::F32(samples) => match samples.iter().find(|v| v.fract() != 0.0 || v.abs() > 65535.0 || v.is_nan()) {
            Some(value) => Err(format!("a label map contains whole numbers only, but this one contains {value}")),
            None => Ok(Box::new(|i| samples[i] as i32)),
        },
    }
}

/// Returns numbers as a readable list.
fn listed(numbers: &BTreeSet<i32>) -> String {
    let mut words: Vec<String> = numbers.iter().take(LISTED).map(i32::to_string).collect();
    let more = numbers.len().saturating_sub(LISTED);
    if more > 0 {
        words.push(format!("{more} more"));
    }
    words.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use typodont_formats::Library;

    /// A box of 2×3×4 voxels, numbered in array order.
    fn image(samples: Samples, steps: [DVec3; 3]) -> VoxelImage {
        let geometry =
            Geometry { dims: [2, 3, 4], steps, origin: DVec3::ZERO, space: CoordinateSystem::LeftPosteriorSuperior };
        VoxelImage { geometry, samples, keys: Vec::new() }
    }

    const UPRIGHT: [DVec3; 3] = [DVec3::X, DVec3::Y, DVec3::Z];

    #[test]
    fn numbers_without_a_name_are_listed() {
        let names = BTreeMap::from([(1, Label(4)), (2, Label(5))]);
        let wrong = labelled(&image(Samples::U8((0..24).collect()), UPRIGHT), None, &names).unwrap_err();
        assert!(wrong.contains("to 3, 4, 5, 6, 7, 8, 9, 10, 13 more"), "{wrong}");
        let wrong = labelled(&image(Samples::I16(vec![-3; 24]), UPRIGHT), None, &names).unwrap_err();
        assert!(wrong.contains("to -3;"), "{wrong}");
        let wrong = labelled(&image(Samples::F32(vec![0.5; 24]), UPRIGHT), None, &names).unwrap_err();
        assert!(wrong.contains("0.5"), "{wrong}");
        let wrong = labelled(&image(Samples::U8(vec![0; 24]), UPRIGHT), None, &names).unwrap_err();
        assert!(wrong.contains("draw the tooth"), "{wrong}");
    }

    #[test]
    fn a_turned_map_is_put_in_order() {
        // Aim: voxels lie at the positions stated in the file. Method: one marked voxel in an array that runs along z,
        // -x and y.
        let steps = [DVec3::Z * 0.5, DVec3::X * -0.25, DVec3::Y];
        let mut samples = vec![1; 24];
        let cell = [1, 2, 3];
        samples[23] = 2;
        let turned = image(Samples::U8(samples), steps);
        let names = BTreeMap::from([(1, Label(4)), (2, Label(5))]);
        let volume = labelled(&turned, None, &names).unwrap();
        let found = volume.tissues().position(|l| l == Label(5)).unwrap();
        let place = volume.grid().centre(volume.grid().cell(found));
        let expected = turned.geometry.position(cell);
        assert!(place.distance(Vec3::from(expected.to_array().map(|mm| mm as f32))) < 1e-5, "{place}");
        assert!(mask(&turned, 2).unwrap_err().contains("order x, y, z"));
    }

    #[test]
    fn a_map_that_names_its_tissues_is_a_tooth_as_drawn() {
        // Aim: a tooth with named tissues is not segmented again. Method: a root drawn with numbers other than the
        // program's own.
        let table = TissueTable::read(&Library::shipped()).unwrap();
        let tissues = TissueLabels { enamel: Label(1), dentine: Label(2), pulp: Label(3) };
        let mut drawn = image(Samples::U8([[7; 12], [9; 12]].concat()), UPRIGHT);
        let mut segment = |n: u32, id: &str, name: &str, value: u8| {
            let value = value.to_string();
            let pairs = [("ID", id), ("Name", name), ("LabelValue", &value), ("Color", "1 1 1")];
            drawn.keys.extend(pairs.map(|(key, value)| (format!("Segment{n}_{key}"), value.to_string())));
        };
        segment(0, "dentine", "Segment_1", 7);
        segment(1, "Segment_2", "Pulp", 9);
        let volume = tooth_volume(&drawn, None, &table, &tissues).unwrap().volume;
        assert_eq!([tissues.enamel, tissues.dentine, tissues.pulp].map(|label| volume.count(label)), [0, 12, 12]);
        drawn.keys.iter_mut().for_each(|(_, value)| *value = value.replace("Pulp", "Nerve"));
        assert!(tooth_volume(&drawn, None, &table, &tissues).unwrap_err().contains("\"nerve\"; known: "));
    }

    #[test]
    fn a_mask_holds_one_value() {
        let numbered = image(Samples::U16((0..24).collect()), UPRIGHT);
        let found = mask(&numbered, 7).unwrap();
        assert_eq!((found.len(), found.iter().position(|&b| b)), (24, Some(7)));
        assert_eq!(mask(&numbered, 99), Err("no voxel has the value 99".to_string()));
        let reversed = image(Samples::U8((0..24).collect()), [DVec3::NEG_X, DVec3::Y, DVec3::Z]);
        assert_eq!(mask(&reversed, 7).unwrap().iter().position(|&b| b), Some(6));
    }

    #[test]
    fn what_is_no_tooth_is_told() {
        let tissues = TissueLabels { enamel: Label(1), dentine: Label(2), pulp: Label(3) };
        let complain = |samples| segmented(&image(samples, UPRIGHT), None, &tissues).unwrap_err();
        assert!(complain(Samples::I16(vec![-1000; 24])).contains("all values are the same"));
        assert!(complain(Samples::F32(vec![f32::NAN; 24])).contains("all values are the same"));
        assert!(complain(Samples::U8((0..24).collect())).contains("give the voxel spacing"));
    }
}
