//! Label maps with a table of segments: `.seg.nrrd`, as 3D Slicer reads and writes them.
//!
//! Takes a file, bytes or an image. Gives labels and named segments, and the bytes of a file. Never accepts a label
//! without a segment. The keys: Slicer's developer guide, "Segmentations", and the implementation in
//! `vtkMRMLSegmentationStorageNode`.

use crate::nrrd::error::{NrrdError, NrrdErrorKind, excerpt};
use crate::nrrd::geometry::{CoordinateSystem, Geometry};
use crate::nrrd::writer::{BorrowedSamples, Encoding, check_filled, write_parts};
use crate::nrrd::{Samples, VoxelImage};
use std::collections::BTreeMap;
use std::io::Write;
use std::path::Path;

/// Labels of voxels, with the names of the labelled parts.
#[derive(Clone, Debug, PartialEq)]
pub struct Segmentation {
    pub geometry: Geometry,
    /// One label per voxel; the first axis varies fastest. 0 belongs to no segment.
    pub labels: Vec<u8>,
    /// Segments; every label in use except 0 has one.
    pub segments: Vec<NamedSegment>,
}

/// A named segment.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedSegment {
    /// Unique identifier, for programs.
    pub id: String,
    /// Name, for people.
    pub name: String,
    /// Label of the segment's voxels: 1 to 255, unique.
    pub label_value: u8,
    /// Red, green and blue, each 0 to 1; for display only.
    pub color: [f32; 3],
}

/// Reads a segmentation from a file.
///
/// # Errors
/// Fails when the volume cannot be read, or when its labels and segments do not form a segmentation.
pub fn read(path: &Path) -> Result<Segmentation, NrrdError> {
    Segmentation::from_image(crate::nrrd::read(path)?).map_err(|error| error.in_file(path))
}

/// Parses a segmentation in memory.
///
/// # Errors
/// Fails when the volume is invalid, or when its labels and segments do not form a segmentation.
pub fn parse(bytes: &[u8]) -> Result<Segmentation, NrrdError> {
    Segmentation::from_image(crate::nrrd::parse(bytes)?)
}

/// Writes a segmentation, compressed. Its space must be left-posterior-superior, the only one on which Slicer's tools
/// agree.
///
/// The same segmentation always gives the same bytes.
///
/// # Errors
/// Fails before anything is written on a segmentation that could not be read back, and when writing fails.
pub fn write(segmentation: &Segmentation, out: &mut dyn Write) -> Result<(), NrrdError> {
    let Segmentation { geometry, labels, segments } = segmentation;
    if geometry.space != CoordinateSystem::LeftPosteriorSuperior {
        let what = "a segmentation is written in left-posterior-superior only";
        return Err(NrrdError::writing(NrrdErrorKind::Unwritable(what.to_string())));
    }
    check_filled(geometry, labels.len()).and_then(|()| check(segmentation)).map_err(NrrdError::writing)?;
    write_parts(geometry, BorrowedSamples::U8(labels), &keys(geometry, labels, segments), Encoding::Gzip, out)
}

/// Writes a segmentation as [`write()`] does and returns the bytes.
///
/// # Errors
/// Fails on a segmentation that could not be read back.
pub fn bytes(segmentation: &Segmentation) -> Result<Vec<u8>, NrrdError> {
    let mut bytes = Vec::new();
    write(segmentation, &mut bytes)?;
    Ok(bytes)
}

impl Segmentation {
    /// Interprets a volume that has the keys of a segmentation. The key for the source representation is ignored, so
    /// that either of its spellings is accepted.
    ///
    /// # Errors
    /// Fails when the keys are missing or invalid, or when a voxel has a label that no segment names.
    pub fn from_image(image: VoxelImage) -> Result<Segmentation, NrrdError> {
        let segments = segments(&image).map_err(NrrdError::segmenting)?;
        let VoxelImage { geometry, samples, .. } = image;
        let labels = labels(&geometry, samples).map_err(NrrdError::segmenting)?;
        let segmentation = Segmentation { geometry, labels, segments };
        check(&segmentation).map_err(NrrdError::segmenting)?;
        Ok(segmentation)
    }

    /// Returns the number of voxels with a label.
    pub fn count(&self, label_value: u8) -> usize {
        self.labels.iter().filter(|&&label| label == label_value).count()
    }
}

/// Tags of a segment that nobody has classified in Slicer: "tissue".
const TAGS: &str = "TerminologyEntry:Segmentation category and type - 3D Slicer General Anatomy list\
                    ~SCT^85756007^Tissue~SCT^85756007^Tissue~^^~Anatomic codes - DICOM master list~^^~^^|";

fn keys(geometry: &Geometry, labels: &[u8], segments: &[NamedSegment]) -> Vec<(String, String)> {
    let extent = extent_text(geometry, labels);
    let mut keys = vec![
        ("Segmentation_SourceRepresentation".to_string(), "Binary labelmap".to_string()),
        ("Segmentation_ContainedRepresentationNames".to_string(), "Binary labelmap|".to_string()),
        ("Segmentation_ReferenceImageExtentOffset".to_string(), "0 0 0".to_string()),
    ];
    for (index, segment) in segments.iter().enumerate() {
        let NamedSegment { id, name, label_value, color: [r, g, b] } = segment;
        let mut add = |key: &str, value: String| keys.push((format!("Segment{index}_{key}"), value));
        add("ID", id.clone());
        add("Name", name.clone());
        add("NameAutoGenerated", "0".to_string());
        add("Color", format!("{r} {g} {b}"));
        add("ColorAutoGenerated", "0".to_string());
        add("LabelValue", label_value.to_string());
        add("Layer", "0".to_string());
        add("Extent", extent.clone());
        add("Tags", TAGS.to_string());
    }
    keys
}

/// Returns `i0 i1 j0 j1 k0 k1`, the tight bounding box of all labelled voxels, which is the same for every segment.
///
/// Slicer crops a layer on loading to the extent of the layer's first segment, and therefore writes the layer's box
/// for each segment. A tight box per segment would lose the voxels of other segments outside the first one's box. An
/// end before the start denotes an empty box.
fn extent_text(geometry: &Geometry, labels: &[u8]) -> String {
    let [nx, ny, _] = geometry.dims;
    let (mut low, mut high) = ([u32::MAX; 3], [0; 3]);
    for (row, labels) in (0..).zip(labels.chunks_exact(nx as usize)) {
        let is_labelled = |&label: &u8| label != 0;
        let first = labels.iter().position(is_labelled);
        if let (Some(first), Some(last)) = (first, labels.iter().rposition(is_labelled)) {
            let [y, z] = [row % ny, row / ny];
            for (axis, [start, end]) in [[first as u32, last as u32], [y, y], [z, z]].into_iter().enumerate() {
                low[axis] = low[axis].min(start);
                high[axis] = high[axis].max(end);
            }
        }
    }
    match low[0] {
        u32::MAX => "0 -1 0 -1 0 -1".to_string(),
        _ => format!("{} {} {} {} {} {}", low[0], high[0], low[1], high[1], low[2], high[2]),
    }
}

/// Returns the segments in the order of their numbers.
fn segments(image: &VoxelImage) -> Result<Vec<NamedSegment>, NrrdErrorKind> {
    let mut tables: BTreeMap<u32, BTreeMap<&str, &str>> = BTreeMap::new();
    for (key, value) in &image.keys {
        if let Some((index, name)) = segment_key(key) {
            tables.entry(index).or_default().insert(name, value);
        }
    }
    if tables.is_empty() {
        return Err(NrrdErrorKind::NoSegments);
    }
    tables.iter().map(|(&index, table)| segment(index, table)).collect()
}

/// Splits `Segment12_Name` into 12 and `Name`.
fn segment_key(key: &str) -> Option<(u32, &str)> {
    let (index, name) = key.strip_prefix("Segment")?.split_once('_')?;
    let is_number = index.bytes().all(|b| b.is_ascii_digit());
    Some((index.parse().ok().filter(|_| is_number)?, name))
}

fn segment(index: u32, table: &BTreeMap<&str, &str>) -> Result<NamedSegment, NrrdErrorKind> {
    let wrong = |name: &str, text: Option<&str>, wanted| NrrdErrorKind::Segment {
        key: format!("Segment{index}_{name}"),
        text: text.map(excerpt),
        wanted,
    };
    let need = |name: &str, wanted| table.get(name).copied().ok_or_else(|| wrong(name, None, wanted));

    let id = need("ID", "a name for programs, unique in the file")?;
    let name = need("Name", "a name for people")?;

    const LABEL: &str = "a whole number from 1 to 255 (files of Slicer before 4.11 have none: open and save it there)";
    let text = need("LabelValue", LABEL)?;
    let label_value = text.trim().parse().ok().filter(|&value: &u8| value > 0);
    let label_value = label_value.ok_or_else(|| wrong("LabelValue", Some(text), LABEL))?;

    const COLOR: &str = "red, green and blue from 0 to 1, as in `0.95 0.95 0.9`";
    let text = need("Color", COLOR)?;
    let color = color(text).ok_or_else(|| wrong("Color", Some(text), COLOR))?;

    match table.get("Layer") {
        Some(&layer) if layer.trim() != "0" => {
            let wanted = "0: segments on separate layers overlap; export them to one labelmap first";
            Err(wrong("Layer", Some(layer), wanted))
        }
        _ => Ok(NamedSegment { id: id.to_string(), name: name.to_string(), label_value, color }),
    }
}

fn color(text: &str) -> Option<[f32; 3]> {
    let parts: Option<Vec<f32>> = text.split_whitespace().map(|word| word.parse().ok()).collect();
    let color: [f32; 3] = parts?.try_into().ok()?;
    is_color(color).then_some(color)
}

fn is_color(color: [f32; 3]) -> bool {
    color.iter().all(|part| (0.0..=1.0).contains(part))
}

fn labels(geometry: &Geometry, samples: Samples) -> Result<Vec<u8>, NrrdErrorKind> {
    match samples {
        Samples::U8(labels) => Ok(labels),
        Samples::I16(wide) => narrowed(geometry, &wide),
        Samples::U16(wide) => narrowed(geometry, &wide),
        Samples::F32(_) => Err(NrrdErrorKind::NotLabels("fractional numbers")),
    }
}

fn narrowed<T: Copy + Into<i64> + TryInto<u8>>(geometry: &Geometry, wide: &[T]) -> Result<Vec<u8>, NrrdErrorKind> {
    let narrow = |(index, &label): (usize, &T)| {
        label.try_into().map_err(|_| NrrdErrorKind::Unnamed { label: label.into(), voxel: cell(geometry, index) })
    };
    wide.iter().enumerate().map(narrow).collect()
}

/// Checks the invariants of every segmentation, read or written.
fn check(segmentation: &Segmentation) -> Result<(), NrrdErrorKind> {
    let Segmentation { geometry, labels, segments } = segmentation;
    if segments.is_empty() {
        return Err(NrrdErrorKind::NoSegments);
    }
    let mut owners = [None; 256];
    let mut ids = BTreeMap::new();
    owners[0] = Some(usize::MAX);
    for (index, segment) in segments.iter().enumerate() {
        let NamedSegment { id, label_value, color, .. } = segment;
        let unfit = |what: &str| NrrdErrorKind::Unwritable(format!("segment {index} (\"{}\") {what}", excerpt(id)));
        if let Some(first) = ids.insert(id, index) {
            let segments = [first, index];
            return Err(NrrdErrorKind::SameSegment { what: "id", shared: excerpt(id), segments });
        }
        if *label_value == 0 {
            return Err(unfit("has label 0, which is reserved for the background"));
        }
        if !is_color(*color) {
            return Err(unfit("has a colour outside 0 to 1"));
        }
        if let Some(first) = owners[usize::from(*label_value)].replace(index) {
            let segments = [first, index];
            return Err(NrrdErrorKind::SameSegment { what: "label value", shared: label_value.to_string(), segments });
        }
    }
    match labels.iter().position(|&label| owners[usize::from(label)].is_none()) {
        Some(index) => Err(NrrdErrorKind::Unnamed { label: labels[index].into(), voxel: cell(geometry, index) }),
        None => Ok(()),
    }
}

/// Returns the voxel at an array index.
fn cell(geometry: &Geometry, index: usize) -> [u32; 3] {
    let [nx, ny, _] = geometry.dims.map(|n| n as usize);
    [index % nx, index / nx % ny, index / (nx * ny)].map(|v| v as u32)
}
