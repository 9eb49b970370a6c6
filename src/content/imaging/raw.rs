//! Plain voxels without any header, of which a person says what they are.

use super::unread::Unread;
use crate::content::nrrd::{Element, Error, Geometry, Image, Layout, Place, Problem, Skip, Source, Space};
use crate::content::nrrd::{check_dims, check_steps, decode};
use glam::DVec3;
use std::path::Path;

const DOING: &str = "reading raw voxels";

/// What the header would have said.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Told {
    /// Voxels along x, y and z, x fastest.
    pub size: [u64; 3],
    pub number: Number,
    pub is_big_endian: bool,
    /// Bytes before the first voxel.
    pub skip: u64,
    /// Distance between voxels, mm.
    pub spacing: [f64; 3],
}

/// How a voxel's number is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Number {
    Uint8,
    Int8,
    Uint16,
    Int16,
    Uint32,
    Int32,
    Float,
    Double,
}

/// Reads the voxels of a file; which way its axes run is not known.
pub fn read(path: &Path, told: &Told) -> Result<Image, Unread> {
    let source = Source::of_file(path).map_err(|problem| shared(problem).in_file(path))?;
    load(source, told).map_err(|unread| unread.in_file(path))
}

/// Reads voxels from memory.
pub fn parse(bytes: &[u8], told: &Told) -> Result<Image, Unread> {
    load(Source::of_slice(bytes), told)
}

fn shared(problem: Problem) -> Unread {
    Unread::of(DOING, Error { doing: DOING, problem, place: Place::Whole, path: None })
}

fn load(mut source: Source, told: &Told) -> Result<Image, Unread> {
    let Told { size, number, is_big_endian, skip, spacing: [x, y, z] } = *told;
    if size.contains(&0) {
        return Err(Unread::new(DOING, "a volume has at least one voxel along each axis", "correct --size"));
    }
    let steps = [DVec3::X * x, DVec3::Y * y, DVec3::Z * z];
    check_steps(steps).map_err(shared)?;
    let dims = check_dims(size).map_err(shared)?;
    let geometry = Geometry { dims, steps, origin: DVec3::ZERO, space: Space::Untold };
    let element = match number {
        Number::Uint8 => Element::U8,
        Number::Int8 => Element::I8,
        Number::Uint16 => Element::U16,
        Number::Int16 => Element::I16,
        Number::Uint32 => Element::U32,
        Number::Int32 => Element::I32,
        Number::Float => Element::F32,
        Number::Double => Element::F64,
    };
    let byte_skip = Skip::Bytes(skip);
    let layout = Layout { geometry, element, is_big_endian, is_gzip: false, line_skip: 0, byte_skip, data_file: None };
    let (found, wanted) = (source.left(), layout.bytes().saturating_add(skip));
    if found != wanted {
        let what = format!("the file has {found} bytes, and --size and --type make {wanted}");
        let remedy = match found.checked_sub(wanted) {
            Some(extra) => format!("correct them, or give --skip-bytes {extra} if it begins with a header"),
            None => "correct them, or copy the file again".to_string(),
        };
        return Err(Unread::new(DOING, what, remedy));
    }
    let samples = decode(&layout, &mut source).map_err(|error| Unread::of(DOING, error))?;
    Ok(Image { geometry: layout.geometry, samples, keys: Vec::new() })
}
