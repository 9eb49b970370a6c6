//! What one slice says of itself, and its numbers.

use super::super::unread::{Unread, plain};
use super::elements::{Elements, Tag, wrong};
use super::pixels;
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

/// A file that lists others, as on a hospital's disc.
const DIRECTORY: &str = "1.2.840.10008.1.3.10";

/// The head of a slice; its numbers stay in the file until they are wanted.
#[derive(Clone, Debug)]
pub(super) struct Slice {
    pub path: PathBuf,
    pub series: Series,
    pub modality: String,
    pub shape: Shape,
    /// Distance between columns, and between rows, mm.
    pub spacing: [f64; 2],
    /// Unit vectors along a row and along a column, left, posterior, superior.
    pub along: [DVec3; 2],
    /// Centre of the first pixel, mm.
    pub position: DVec3,
    pub slope: f64,
    pub intercept: f64,
}

/// Which series a slice belongs to.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Series {
    pub uid: String,
    pub number: String,
    pub description: String,
}

/// How a slice's numbers are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Shape {
    pub rows: u32,
    pub columns: u32,
    /// Bits of each number's place, 8 or 16; of the number itself; and where its highest is.
    pub allocated: u16,
    pub bits: u16,
    pub high_bit: u16,
    pub is_signed: bool,
}

/// The head of a slice; `None` for a file that lists others.
pub(super) fn head(bytes: &[u8]) -> Result<Option<Slice>, Unread> {
    let elements = Elements::read(bytes)?;
    const MEDIA_CLASS: Tag = 0x0002_0002;
    if [CLASS, MEDIA_CLASS].iter().any(|tag| elements.text(*tag).as_deref() == Some(DIRECTORY)) {
        return Ok(None);
    }
    pixels::check_syntax(&elements.syntax)?;
    let missing =
        |name: &str| wrong(format!("it has no {name}"), "export the series as CT slices with their positions");
    if let Some(frames) = elements.numbers::<1>(FRAMES).filter(|[n]| *n > 1.0) {
        let what = format!("it holds {} frames in one file", frames[0]);
        return Err(wrong(what, "export the volume as a series of single slices (\"classic\", not \"enhanced\", CT)"));
    }
    let photometric = elements.text(PHOTOMETRIC).unwrap_or_default();
    // Old archives leave out what their slices could only be.
    let is_grey = photometric.is_empty() || photometric.starts_with("MONOCHROME");
    if elements.short(SAMPLES).is_some_and(|n| n != 1) || !is_grey {
        let what = format!("its pixels are coloured (\"{}\")", plain(&photometric));
        return Err(wrong(what, "export the grey series, not a picture of it"));
    }
    if photometric == "MONOCHROME1" {
        return Err(wrong("its grey values run from bright to dark (MONOCHROME1)", "export the series as MONOCHROME2"));
    }
    let shape = shape(&elements)?;
    pixels::check_size(&elements, &shape)?;
    let [rows_apart, columns_apart] = elements.numbers::<2>(SPACING).ok_or_else(|| missing("pixel spacing"))?;
    let along = elements.numbers::<6>(ORIENTATION).ok_or_else(|| missing("orientation"))?;
    let position = elements.numbers::<3>(POSITION).ok_or_else(|| missing("position"))?;
    let along = [DVec3::from_slice(&along), DVec3::from_slice(&along[3..])];
    let is_square = |v: DVec3| (v.length() - 1.0).abs() < 0.01;
    if !along.into_iter().all(is_square) || along[0].dot(along[1]).abs() > 0.01 {
        return Err(wrong("its orientation is no pair of directions at right angles", "export the series again"));
    }
    if !(rows_apart > 0.0 && columns_apart > 0.0) {
        return Err(wrong(format!("its pixel spacing is {rows_apart}, {columns_apart} mm"), "export the series again"));
    }
    let scale = |tag, usual| elements.bytes(tag).map_or(Some(usual), |_| elements.numbers::<1>(tag).map(|[n]| n));
    let (slope, intercept) =
        scale(SLOPE, 1.0).zip(scale(INTERCEPT, 0.0)).ok_or_else(|| missing("readable rescaling"))?;
    Ok(Some(Slice {
        path: PathBuf::new(),
        series: Series {
            uid: elements.text(SERIES).unwrap_or_default(),
            number: elements.said(SERIES_NUMBER),
            description: elements.said(DESCRIPTION),
        },
        modality: elements.said(MODALITY),
        shape,
        spacing: [columns_apart, rows_apart],
        along,
        position: DVec3::from(position),
        slope,
        intercept,
    }))
}

fn shape(elements: &Elements) -> Result<Shape, Unread> {
    let need = |tag, name: &str| {
        elements.short(tag).ok_or_else(|| wrong(format!("it has no {name}"), "copy or export the file again"))
    };
    let (rows, columns) = (need(ROWS, "rows")?, need(COLUMNS, "columns")?);
    let allocated = need(ALLOCATED, "bits allocated")?;
    let bits = elements.short(STORED).unwrap_or(allocated);
    let high_bit = elements.short(HIGH_BIT).unwrap_or(bits.saturating_sub(1));
    let is_fit = [8, 16].contains(&allocated) && (1..=allocated).contains(&bits);
    if !is_fit || !(bits - 1..allocated).contains(&high_bit) {
        let what = format!("its numbers have {bits} bits of {allocated}, the highest is {high_bit}");
        return Err(wrong(what, "export the series with 8 or 16 bits per pixel"));
    }
    if rows == 0 || columns == 0 {
        return Err(wrong(format!("it is {columns}×{rows} pixels large"), "copy or export the file again"));
    }
    let is_signed = elements.short(SIGNED) == Some(1);
    Ok(Shape { rows: rows.into(), columns: columns.into(), allocated, bits, high_bit, is_signed })
}

/// The numbers of a slice, rescaled, row by row.
pub(super) fn values(bytes: &[u8], slice: &Slice) -> Result<impl Iterator<Item = f32> + use<>, Unread> {
    let elements = Elements::read(bytes)?;
    let stored = pixels::stored(&elements, &slice.shape)?;
    let (slope, intercept) = (slice.slope, slice.intercept);
    Ok(stored.into_iter().map(move |n| (f64::from(n) * slope + intercept) as f32))
}
