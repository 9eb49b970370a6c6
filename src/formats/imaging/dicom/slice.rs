//! The header of one slice, and its values.

use crate::imaging::dicom::elements::{DicomElements, Tag, wrong};
use crate::imaging::dicom::pixels;
use crate::imaging::error::{ScanError, sanitized_excerpt};
use glam::DVec3;
use std::path::PathBuf;

const CLASS: Tag = 0x0008_0016;
const MODALITY: Tag = 0x0008_0060;
const DESCRIPTION: Tag = 0x0008_103E;
const SERIES: Tag = 0x0020_000E;
const SERIES_NUMBER: Tag = 0x0020_0011;
const POSITION: Tag = 0x0020_0032;
const ORIENTATION: Tag = 0x0020_0037;
const SAMPLES: Tag = 0x0028_0002;
const PHOTOMETRIC: Tag = 0x0028_0004;
const FRAMES: Tag = 0x0028_0008;
const ROWS: Tag = 0x0028_0010;
const COLUMNS: Tag = 0x0028_0011;
const SPACING: Tag = 0x0028_0030;
const ALLOCATED: Tag = 0x0028_0100;
const STORED: Tag = 0x0028_0101;
const HIGH_BIT: Tag = 0x0028_0102;
const SIGNED: Tag = 0x0028_0103;
const INTERCEPT: Tag = 0x0028_1052;
const SLOPE: Tag = 0x0028_1053;

/// Class UID of a directory file (DICOMDIR), which lists other files, as on a hospital's disc.
const DIRECTORY: &str = "1.2.840.10008.1.3.10";

/// Header of a slice; the pixel values stay in the file until they are needed.
#[derive(Clone, Debug)]
pub(super) struct DicomSlice {
    pub path: PathBuf,
    pub series: DicomSeries,
    pub modality: String,
    pub pixel_layout: PixelLayout,
    /// Distance between columns and distance between rows, mm.
    pub spacing: [f64; 2],
    /// Unit vectors along a row and along a column, in left-posterior-superior space.
    pub orientation: [DVec3; 2],
    /// Centre of the first pixel, mm, in left-posterior-superior space.
    pub position: DVec3,
    pub slope: f64,
    pub intercept: f64,
}

/// The series that a slice belongs to.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct DicomSeries {
    pub uid: String,
    pub number: String,
    pub description: String,
}

/// Storage layout of a slice's numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct PixelLayout {
    pub rows: u32,
    pub columns: u32,
    /// Bits allocated for each number (8 or 16), bits of the number itself, and the position of its highest bit.
    pub allocated: u16,
    pub bits: u16,
    pub high_bit: u16,
    pub is_signed: bool,
}

/// Parses the header of a slice; `None` for a directory file.
pub(super) fn read_header(bytes: &[u8]) -> Result<Option<DicomSlice>, ScanError> {
    let elements = DicomElements::read(bytes)?;
    const MEDIA_CLASS: Tag = 0x0002_0002;
    if [CLASS, MEDIA_CLASS].iter().any(|tag| elements.text(*tag).as_deref() == Some(DIRECTORY)) {
        return Ok(None);
    }
    pixels::check_syntax(&elements.syntax)?;
    let missing =
        |name: &str| wrong(format!("it has no {name}"), "export the series as CT slices with their positions");
    if let Some(frames) = elements.numbers::<1>(FRAMES).filter(|[n]| *n > 1.0) {
        let what = format!("it contains {} frames in one file", frames[0]);
        return Err(wrong(what, "export the volume as a series of single slices (\"classic\", not \"enhanced\", CT)"));
    }
    let photometric = elements.text(PHOTOMETRIC).unwrap_or_default();
    // Old archives omit attributes that have only one possible value for their slices.
    let is_grey = photometric.is_empty() || photometric.starts_with("MONOCHROME");
    if elements.short(SAMPLES).is_some_and(|n| n != 1) || !is_grey {
        let what = format!("its pixels are in colour (\"{}\")", sanitized_excerpt(&photometric));
        return Err(wrong(what, "export the greyscale series, not a picture of it"));
    }
    if photometric == "MONOCHROME1" {
        return Err(wrong("its grey values run from bright to dark (MONOCHROME1)", "export the series as MONOCHROME2"));
    }
    let pixel_layout = pixel_layout(&elements)?;
    pixels::check_size(&elements, &pixel_layout)?;
    let [rows_apart, columns_apart] = elements.numbers::<2>(SPACING).ok_or_else(|| missing("pixel spacing"))?;
    let along = elements.numbers::<6>(ORIENTATION).ok_or_else(|| missing("orientation"))?;
    let position = elements.numbers::<3>(POSITION).ok_or_else(|| missing("position"))?;
    let along = [DVec3::from_slice(&along), DVec3::from_slice(&along[3..])];
    let is_square = |v: DVec3| (v.length() - 1.0).abs() < 0.01;
    if !along.into_iter().all(is_square) || along[0].dot(along[1]).abs() > 0.01 {
        return Err(wrong("its orientation is not a pair of perpendicular directions", "export the series again"));
    }
    if !(rows_apart > 0.0 && columns_apart > 0.0) {
        return Err(wrong(format!("its pixel spacing is {rows_apart}, {columns_apart} mm"), "export the series again"));
    }
    let scale = |tag, usual| elements.bytes(tag).map_or(Some(usual), |_| elements.numbers::<1>(tag).map(|[n]| n));
    let (slope, intercept) =
        scale(SLOPE, 1.0).zip(scale(INTERCEPT, 0.0)).ok_or_else(|| missing("readable rescaling"))?;
    Ok(Some(DicomSlice {
        path: PathBuf::new(),
        series: DicomSeries {
            uid: elements.text(SERIES).unwrap_or_default(),
            number: elements.display_text(SERIES_NUMBER),
            description: elements.display_text(DESCRIPTION),
        },
        modality: elements.display_text(MODALITY),
        pixel_layout,
        spacing: [columns_apart, rows_apart],
        orientation: along,
        position: DVec3::from(position),
        slope,
        intercept,
    }))
}

fn pixel_layout(elements: &DicomElements) -> Result<PixelLayout, ScanError> {
    let need = |tag, name: &str| {
        elements.short(tag).ok_or_else(|| wrong(format!("it has no {name}"), "copy or export the file again"))
    };
    let (rows, columns) = (need(ROWS, "rows")?, need(COLUMNS, "columns")?);
    let allocated = need(ALLOCATED, "bits allocated")?;
    let bits = elements.short(STORED).unwrap_or(allocated);
    let high_bit = elements.short(HIGH_BIT).unwrap_or(bits.saturating_sub(1));
    let is_fit = [8, 16].contains(&allocated) && (1..=allocated).contains(&bits);
    if !is_fit || !(bits - 1..allocated).contains(&high_bit) {
        let what = format!("its numbers use {bits} of {allocated} bits, the highest being bit {high_bit}");
        return Err(wrong(what, "export the series with 8 or 16 bits per pixel"));
    }
    if rows == 0 || columns == 0 {
        return Err(wrong(format!("its size is {columns}×{rows} pixels"), "copy or export the file again"));
    }
    let is_signed = elements.short(SIGNED) == Some(1);
    Ok(PixelLayout { rows: rows.into(), columns: columns.into(), allocated, bits, high_bit, is_signed })
}

/// Returns the rescaled values of a slice, row by row.
pub(super) fn values(bytes: &[u8], slice: &DicomSlice) -> Result<impl Iterator<Item = f32> + use<>, ScanError> {
    let elements = DicomElements::read(bytes)?;
    let stored = pixels::stored(&elements, &slice.pixel_layout)?;
    let (slope, intercept) = (slice.slope, slice.intercept);
    Ok(stored.into_iter().map(move |n| (f64::from(n) * slope + intercept) as f32))
}
