//! Raw voxels without a header, whose layout the user supplies.

use crate::imaging::error::ScanError;
use crate::nrrd::{
    ByteSkip, ByteSource, CoordinateSystem, ErrorLocation, Geometry, NrrdError, NrrdErrorKind, SampleLayout,
    SampleType, VoxelImage,
};
use crate::nrrd::{check_dims, check_steps, decode};
use glam::DVec3;
use std::path::Path;

const DOING: &str = "reading raw voxels";

/// The layout of a raw file, which a header would otherwise give.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RawLayout {
    /// Number of voxels along x, y and z; x varies fastest.
    pub size: [u64; 3],
    pub sample_type: RawSampleType,
    pub is_big_endian: bool,
    /// Number of bytes before the first voxel.
    pub skip: u64,
    /// Distance between voxels, mm.
    pub spacing: [f64; 3],
}

/// Storage type of one voxel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RawSampleType {
    Uint8,
    Int8,
    Uint16,
    Int16,
    Uint32,
    Int32,
    Float,
    Double,
}

/// Reads the voxels of a file; the anatomical directions of its axes are unknown.
///
/// # Errors
/// Fails when the file cannot be read, or when its length does not match the layout.
pub fn read(path: &Path, layout: &RawLayout) -> Result<VoxelImage, ScanError> {
    let source = ByteSource::of_file(path).map_err(|problem| from_nrrd_problem(problem).in_file(path))?;
    load(source, layout).map_err(|unread| unread.in_file(path))
}

/// Parses voxels in memory.
///
/// # Errors
/// Fails when the length does not match the layout.
pub fn parse(bytes: &[u8], layout: &RawLayout) -> Result<VoxelImage, ScanError> {
    load(ByteSource::of_slice(bytes), layout)
}

fn from_nrrd_problem(problem: NrrdErrorKind) -> ScanError {
    ScanError::from_nrrd(DOING, NrrdError { doing: DOING, kind: problem, location: ErrorLocation::Whole, path: None })
}

fn load(mut source: ByteSource, raw_layout: &RawLayout) -> Result<VoxelImage, ScanError> {
    let RawLayout { size, sample_type: number, is_big_endian, skip, spacing: [x, y, z] } = *raw_layout;
    if size.contains(&0) {
        return Err(ScanError::new(DOING, "a volume has at least one voxel along each axis", "correct --size"));
    }
    let steps = [DVec3::X * x, DVec3::Y * y, DVec3::Z * z];
    check_steps(steps).map_err(from_nrrd_problem)?;
    let dims = check_dims(size).map_err(from_nrrd_problem)?;
    let geometry = Geometry { dims, steps, origin: DVec3::ZERO, space: CoordinateSystem::Unspecified };
    let sample_type = match number {
        RawSampleType::Uint8 => SampleType::U8,
        RawSampleType::Int8 => SampleType::I8,
        RawSampleType::Uint16 => SampleType::U16,
        RawSampleType::Int16 => SampleType::I16,
        RawSampleType::Uint32 => SampleType::U32,
        RawSampleType::Int32 => SampleType::I32,
        RawSampleType::Float => SampleType::F32,
        RawSampleType::Double => SampleType::F64,
    };
    let byte_skip = ByteSkip::Bytes(skip);
    let layout =
        SampleLayout { geometry, sample_type, is_big_endian, is_gzip: false, line_skip: 0, byte_skip, data_file: None };
    let (found, wanted) = (source.remaining(), layout.bytes().saturating_add(skip));
    if found != wanted {
        let what = format!("the file has {found} bytes, but --size and --type require {wanted}");
        let remedy = match found.checked_sub(wanted) {
            Some(extra) => format!("correct them, or give --skip-bytes {extra} if it begins with a header"),
            None => "correct them, or copy the file again".to_string(),
        };
        return Err(ScanError::new(DOING, what, remedy));
    }
    let samples = decode(&layout, &mut source).map_err(|error| ScanError::from_nrrd(DOING, error))?;
    Ok(VoxelImage { geometry: layout.geometry, samples, keys: Vec::new() })
}
