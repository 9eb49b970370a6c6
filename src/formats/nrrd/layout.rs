//! Interpretation of a header's fields: the layout of the bytes that follow it.

use crate::nrrd::error::{NrrdError, NrrdErrorKind};
use crate::nrrd::geometry;
use crate::nrrd::geometry::{CoordinateSystem, Geometry};
use crate::nrrd::header::{HeaderField, NrrdHeader};
use glam::DVec3;
use std::path::{Component, Path};

/// Maximum number of bytes skipped before compressed data: enough for another format's header, too little for a long
/// inflation.
const SKIP_MAX: u64 = 1 << 20;

/// An interpreted header: complete and within bounds.
pub(crate) struct SampleLayout {
    pub geometry: Geometry,
    pub sample_type: SampleType,
    pub is_big_endian: bool,
    pub is_gzip: bool,
    pub line_skip: u64,
    pub byte_skip: ByteSkip,
    pub data_file: Option<DataFile>,
}

/// The type of one sample in the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum SampleType {
    I8,
    U8,
    I16,
    U16,
    /// The following types do not occur in supported NRRD files, but in other formats.
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

pub(crate) enum ByteSkip {
    Bytes(u64),
    /// The data are the last bytes of the file.
    ToEnd,
}

pub(crate) struct DataFile {
    pub name: String,
    pub line: usize,
}

impl SampleLayout {
    pub(super) fn of(header: &NrrdHeader) -> Result<SampleLayout, NrrdError> {
        let sample_type = sample_type(header)?;
        let shape = ArrayShape::of(header)?;
        let is_gzip = is_gzip(header)?;
        Ok(SampleLayout {
            geometry: geometry_of(header, &shape)?,
            sample_type,
            is_big_endian: is_big_endian(header, sample_type)?,
            is_gzip,
            line_skip: line_skip(header)?,
            byte_skip: byte_skip(header, is_gzip)?,
            data_file: data_file(header)?,
        })
    }

    /// Returns the size of the uncompressed samples, bytes.
    pub fn bytes(&self) -> u64 {
        self.geometry.len() as u64 * self.sample_type.width()
    }
}

impl SampleType {
    pub fn width(self) -> u64 {
        match self {
            SampleType::I8 | SampleType::U8 => 1,
            SampleType::I16 | SampleType::U16 => 2,
            SampleType::I32 | SampleType::U32 | SampleType::F32 => 4,
            SampleType::I64 | SampleType::U64 | SampleType::F64 => 8,
        }
    }
}

fn sample_type(header: &NrrdHeader) -> Result<SampleType, NrrdError> {
    let entry = header.required("type")?;
    match entry.text.to_ascii_lowercase().as_str() {
        "signed char" | "int8" | "int8_t" => Ok(SampleType::I8),
        "uchar" | "unsigned char" | "uint8" | "uint8_t" => Ok(SampleType::U8),
        "short" | "short int" | "signed short" | "signed short int" | "int16" | "int16_t" => Ok(SampleType::I16),
        "ushort" | "unsigned short" | "unsigned short int" | "uint16" | "uint16_t" => Ok(SampleType::U16),
        "float" => Ok(SampleType::F32),
        "double" => Ok(SampleType::F64),
        _ => Err(entry.unsupported(&entry.text, "save it as uint8, int8, uint16, int16, float or double")),
    }
}

fn is_gzip(header: &NrrdHeader) -> Result<bool, NrrdError> {
    let entry = header.required("encoding")?;
    match entry.text.to_ascii_lowercase().as_str() {
        "raw" => Ok(false),
        "gz" | "gzip" => Ok(true),
        _ => Err(entry.unsupported(&entry.text, "re-save it with `encoding: gzip` or `encoding: raw`")),
    }
}

fn is_big_endian(header: &NrrdHeader, sample_type: SampleType) -> Result<bool, NrrdError> {
    let entry = match sample_type.width() {
        1 => header.get("endian"),
        _ => Some(header.required("endian")?),
    };
    match entry.map(|entry| (entry, entry.text.to_ascii_lowercase())) {
        None => Ok(false),
        Some((_, text)) if text == "little" => Ok(false),
        Some((_, text)) if text == "big" => Ok(true),
        Some((entry, _)) => Err(entry.invalid(&entry.text, "`little` or `big`")),
    }
}

/// The number of axes of the array and their lengths.
struct ArrayShape {
    /// Number of axes in the file, 3 or 4. A fourth axis comes first and has length 1.
    axes: usize,
    dims: [u32; 3],
}

impl ArrayShape {
    fn of(header: &NrrdHeader) -> Result<ArrayShape, NrrdError> {
        let entry = header.required("dimension")?;
        let axes = match entry.text.parse::<u32>() {
            Ok(3) => 3,
            Ok(4) => 4,
            Ok(2) => return Err(entry.unsupported("2", "a flat image is not a volume: stack its slices into one file")),
            Ok(_) => return Err(entry.unsupported(&entry.text, "export a single volume of three axes")),
            Err(_) => return Err(entry.invalid(&entry.text, "the number of axes, 3")),
        };
        let sizes = sizes(header, axes)?;
        if axes == 4 && sizes[0] != 1 {
            let line = header.required("sizes")?.line;
            return Err(NrrdErrorKind::Layered { layers: sizes[0] }.on(line));
        }
        check_kinds(header, axes)?;
        let spatial = [sizes[axes - 3], sizes[axes - 2], sizes[axes - 1]];
        let dims = geometry::check_dims(spatial).map_err(|problem| match header.get("sizes") {
            Some(entry) => problem.on(entry.line),
            None => problem.in_whole(),
        })?;
        Ok(ArrayShape { axes, dims })
    }

    /// Returns the entries of the three axes of space.
    fn spatial<T: Copy>(&self, entries: &[T]) -> [T; 3] {
        std::array::from_fn(|i| entries[self.axes - 3 + i])
    }
}

fn sizes(header: &NrrdHeader, axes: usize) -> Result<Vec<u64>, NrrdError> {
    const WANTED: &str = "a whole number above 0 for each axis, up to 4096";
    let entry = header.required("sizes")?;
    let size = |word: &&str| {
        let is_plain = word.bytes().all(|b| b.is_ascii_digit());
        let size = word.parse().ok().filter(|&size: &u64| is_plain && size > 0);
        size.ok_or_else(|| entry.invalid(word, WANTED))
    };
    entry.words(axes)?.iter().map(size).collect()
}

/// Checks for three axes of space, preceded by at most one other axis.
fn check_kinds(header: &NrrdHeader, axes: usize) -> Result<(), NrrdError> {
    let Some(entry) = header.get("kinds") else { return Ok(()) };
    for (index, kind) in entry.words(axes)?.into_iter().enumerate() {
        let is_spatial = ["domain", "space"].iter().any(|known| known.eq_ignore_ascii_case(kind));
        let is_unspecified = ["???", "none"].contains(&kind);
        let should_be_spatial = index >= axes - 3;
        if !is_unspecified && is_spatial != should_be_spatial {
            let remedy = "export a single volume of three axes of space (`kinds: domain domain domain`)";
            return Err(entry.unsupported(&entry.text, remedy));
        }
    }
    Ok(())
}

fn geometry_of(header: &NrrdHeader, shape: &ArrayShape) -> Result<Geometry, NrrdError> {
    check_millimetres(header, "space units", 3)?;
    check_millimetres(header, "units", shape.axes)?;
    let space = space(header)?;
    let directions = directions(header, shape)?;
    let spacings = spacings(header, shape)?;
    let (steps, line) = match (space, directions, spacings) {
        (Some(_), Some(directions), spacings) => {
            check_agreement(directions.value, spacings)?;
            (directions.value, directions.line)
        }
        (None, Some(_), _) => return Err(NrrdErrorKind::Missing("space").in_whole()),
        // In a named space, spacings alone do not determine the directions of the axes.
        (Some(_), None, _) => return Err(NrrdErrorKind::Missing("space directions").in_whole()),
        (None, None, Some(spacings)) => {
            let [x, y, z] = spacings.value;
            // A direction may be negative; a distance may not.
            if let Some((axis, mm)) = (1..).zip(spacings.value).find(|(_, mm)| *mm < 0.0) {
                return Err(NrrdErrorKind::Spacing { axis, mm }.on(spacings.line));
            }
            ([DVec3::new(x, 0.0, 0.0), DVec3::new(0.0, y, 0.0), DVec3::new(0.0, 0.0, z)], spacings.line)
        }
        (None, None, None) => return Err(NrrdErrorKind::Missing("spacings").in_whole()),
    };
    geometry::check_steps(steps).map_err(|problem| problem.on(line))?;
    let origin = origin(header, space.is_some())?;
    let (space, signs) = space.unwrap_or((CoordinateSystem::Unspecified, AS_IS));
    let mut geometry = Geometry { dims: shape.dims, steps, origin, space };
    geometry.flip(signs);
    Ok(geometry)
}

/// A value, with the header line that states it.
#[derive(Clone, Copy)]
struct HeaderValue<T> {
    value: T,
    line: usize,
}

const AS_IS: [f64; 3] = [1.0, 1.0, 1.0];

/// Returns the space, and the signs that convert its positions into the space that is kept.
fn space(header: &NrrdHeader) -> Result<Option<(CoordinateSystem, [f64; 3])>, NrrdError> {
    let dimension = header.get("space dimension");
    if let Some(entry) = dimension.filter(|entry| entry.text != "3") {
        return Err(entry.unsupported(&entry.text, "export a single volume in a space of three dimensions"));
    }
    let Some(entry) = header.get("space") else {
        return Ok(dimension.map(|_| (CoordinateSystem::Unspecified, AS_IS)));
    };
    let anatomical = |signs| Ok(Some((CoordinateSystem::LeftPosteriorSuperior, signs)));
    // "left-posterior-superior", "left posterior superior" and "leftposteriorsuperior" are the same name.
    match entry.text.to_ascii_lowercase().replace(['-', ' '], "").as_str() {
        "leftposteriorsuperior" | "lps" => anatomical(AS_IS),
        "rightanteriorsuperior" | "ras" => anatomical([-1.0, -1.0, 1.0]),
        "leftanteriorsuperior" | "las" => anatomical([1.0, -1.0, 1.0]),
        "scannerxyz" => Ok(Some((CoordinateSystem::ScannerXyz, AS_IS))),
        "3drighthanded" => Ok(Some((CoordinateSystem::RightHanded, AS_IS))),
        "3dlefthanded" => Ok(Some((CoordinateSystem::LeftHanded, AS_IS))),
        _ => Err(entry.unsupported(&entry.text, "save it in left-posterior-superior")),
    }
}

fn check_millimetres(header: &NrrdHeader, field: &'static str, count: usize) -> Result<(), NrrdError> {
    let Some(entry) = header.get(field) else { return Ok(()) };
    let spatial = entry.quoted(count)?.split_off(count - 3);
    let is_mm = |unit: &&str| {
        ["", "???", "mm", "millimeter", "millimeters", "millimetre", "millimetres"]
            .iter()
            .any(|known| known.eq_ignore_ascii_case(unit.trim()))
    };
    match spatial.iter().find(|unit| !is_mm(unit)) {
        Some(unit) => Err(entry.unsupported(unit, "convert the spacing and the origin to mm")),
        None => Ok(()),
    }
}

fn spacings(header: &NrrdHeader, shape: &ArrayShape) -> Result<Option<HeaderValue<[f64; 3]>>, NrrdError> {
    let Some(entry) = header.get("spacings") else { return Ok(None) };
    let words = shape.spatial(&entry.words(shape.axes)?);
    let mut value = [0.0; 3];
    for (slot, word) in value.iter_mut().zip(words) {
        *slot = number(entry, word, "a distance in mm for each axis")?;
    }
    Ok(Some(HeaderValue { value, line: entry.line }))
}

fn directions(header: &NrrdHeader, shape: &ArrayShape) -> Result<Option<HeaderValue<[DVec3; 3]>>, NrrdError> {
    const WANTED: &str = "a vector for each axis, as in (0.2,0,0) (0,0.2,0) (0,0,0.2)";
    let Some(entry) = header.get("space directions") else { return Ok(None) };
    let texts = entry.vectors(shape.axes, WANTED)?;
    let is_none = |text: &str| text.eq_ignore_ascii_case("none");
    let lead = texts.iter().take(shape.axes - 3);
    if let Some(text) =
        lead.copied().find(|text| !is_none(text) && vector(entry, text, WANTED).is_ok_and(|v| v.is_finite()))
    {
        return Err(entry.unsupported(text, "export a single volume: the first of four axes must be `none`"));
    }
    let mut value = [DVec3::ZERO; 3];
    for (slot, text) in value.iter_mut().zip(shape.spatial(&texts)) {
        if is_none(text) {
            return Err(entry.unsupported(text, "export a single volume: three axes must be spatial"));
        }
        *slot = vector(entry, text, WANTED)?;
    }
    Ok(Some(HeaderValue { value, line: entry.line }))
}

/// Checks that the directions have the lengths of the spacings, since a file may state both.
fn check_agreement(directions: [DVec3; 3], spacings: Option<HeaderValue<[f64; 3]>>) -> Result<(), NrrdError> {
    /// Writers round to six digits or more.
    const TOLERANCE: f64 = 1e-3;
    let Some(spacings) = spacings else { return Ok(()) };
    for (axis, (stated, direction)) in (1..).zip(spacings.value.into_iter().zip(directions)) {
        let length = direction.length();
        // NaN is the format's notation for an axis without spacing.
        if !stated.is_nan() && (stated - length).abs() > TOLERANCE * length {
            return Err(NrrdErrorKind::SpacingsDisagree { axis, stated, length }.on(spacings.line));
        }
    }
    Ok(())
}

fn origin(header: &NrrdHeader, has_space: bool) -> Result<DVec3, NrrdError> {
    const WANTED: &str = "a position in mm, as in (0,0,0)";
    let Some(entry) = header.get("space origin") else { return Ok(DVec3::ZERO) };
    if !has_space {
        return Err(NrrdErrorKind::Missing("space").in_whole());
    }
    let inside = entry.text.strip_prefix('(').and_then(|text| text.strip_suffix(')'));
    let origin = match inside {
        Some(text) if !text.contains(['(', ')']) => vector(entry, text, WANTED)?,
        _ => return Err(entry.invalid(&entry.text, WANTED)),
    };
    geometry::check_origin(origin).map_err(|problem| problem.on(entry.line))?;
    Ok(origin)
}

fn vector(entry: &HeaderField, text: &str, wanted: &'static str) -> Result<DVec3, NrrdError> {
    let mut words = text.split(',');
    let mut next = || match words.next() {
        Some(word) => number(entry, word.trim(), wanted),
        None => Err(entry.invalid(text, wanted)),
    };
    let vector = DVec3::new(next()?, next()?, next()?);
    match words.next() {
        None => Ok(vector),
        Some(_) => Err(entry.invalid(text, wanted)),
    }
}

fn number(entry: &HeaderField, word: &str, wanted: &'static str) -> Result<f64, NrrdError> {
    word.parse().map_err(|_| entry.invalid(word, wanted))
}

fn line_skip(header: &NrrdHeader) -> Result<u64, NrrdError> {
    let Some(entry) = header.get("line skip") else { return Ok(0) };
    entry.text.parse().map_err(|_| entry.invalid(&entry.text, "a number of lines"))
}

fn byte_skip(header: &NrrdHeader, is_gzip: bool) -> Result<ByteSkip, NrrdError> {
    let Some(entry) = header.get("byte skip") else { return Ok(ByteSkip::Bytes(0)) };
    match entry.text.parse::<i64>() {
        Ok(-1) if !is_gzip => Ok(ByteSkip::ToEnd),
        Ok(-1) => Err(entry.unsupported(
            "-1",
            "only raw data can be located from the end of the file: give the number of bytes to skip",
        )),
        Ok(bytes @ 0..) if !is_gzip || bytes as u64 <= SKIP_MAX => Ok(ByteSkip::Bytes(bytes as u64)),
        Ok(0..) => Err(entry.unsupported(&entry.text, "save the volume without the preceding data")),
        _ => Err(entry.invalid(&entry.text, "a number of bytes, or -1 for data at the end of the file")),
    }
}

fn data_file(header: &NrrdHeader) -> Result<Option<DataFile>, NrrdError> {
    let Some(entry) = header.get("data file") else { return Ok(None) };
    let name = entry.text.as_str();
    let one_file = "join the slices into one file (`unu save`, or 3D Slicer: Save as .nrrd)";
    if name.split_whitespace().next() == Some("LIST") || is_pattern(name) {
        return Err(entry.unsupported(name, one_file));
    }
    let refuse = |why| Err(NrrdErrorKind::DataFile { name: crate::nrrd::error::excerpt(name), why }.on(entry.line));
    let mut parts = Path::new(name).components();
    if name.is_empty() {
        refuse("has no name")
    } else if name.contains('\0') {
        refuse("has an invalid name")
    } else if Path::new(name).is_absolute() || name.starts_with(['/', '\\']) {
        refuse("is named by an absolute path")
    } else if !parts.all(|part| matches!(part, Component::Normal(_) | Component::CurDir)) {
        refuse("is outside the header's folder")
    } else {
        Ok(Some(DataFile { name: name.to_string(), line: entry.line }))
    }
}

/// Detects patterns such as `slice%03d.raw 1 161 1` as NrrdIO does: a `%`, digits and a `d`.
fn is_pattern(name: &str) -> bool {
    let is_number = |rest: &str| rest.trim_start_matches(|c: char| c.is_ascii_digit()).starts_with('d');
    name.split('%').skip(1).any(is_number)
}
