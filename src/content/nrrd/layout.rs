//! What a header's fields say about the bytes that follow it.

use super::error::{Error, Problem};
use super::geometry::{self, Geometry, Space};
use super::header::{Entry, Header};
use glam::DVec3;
use std::path::{Component, Path};

/// Most bytes skipped before compressed data: room for another format's header, too little to keep us inflating.
const SKIP_MAX: u64 = 1 << 20;

/// A header understood: complete and within bounds.
pub(in crate::content) struct Layout {
    pub geometry: Geometry,
    pub element: Element,
    pub is_big_endian: bool,
    pub is_gzip: bool,
    pub line_skip: u64,
    pub byte_skip: Skip,
    pub data_file: Option<DataFile>,
}

/// The type of one sample in the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::content) enum Element {
    I8,
    U8,
    I16,
    U16,
    /// The wider ones stand in no NRRD that is read here, but in other formats.
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

pub(in crate::content) enum Skip {
    Bytes(u64),
    /// The data are the file's last bytes.
    ToEnd,
}

pub(in crate::content) struct DataFile {
    pub name: String,
    pub line: usize,
}

impl Layout {
    pub(super) fn of(header: &Header) -> Result<Layout, Error> {
        let element = element(header)?;
        let shape = Shape::of(header)?;
        let is_gzip = is_gzip(header)?;
        Ok(Layout {
            geometry: geometry_of(header, &shape)?,
            element,
            is_big_endian: is_big_endian(header, element)?,
            is_gzip,
            line_skip: line_skip(header)?,
            byte_skip: byte_skip(header, is_gzip)?,
            data_file: data_file(header)?,
        })
    }

    /// Bytes of the samples, uncompressed.
    pub fn bytes(&self) -> u64 {
        self.geometry.len() as u64 * self.element.width()
    }
}

impl Element {
    pub fn width(self) -> u64 {
        match self {
            Element::I8 | Element::U8 => 1,
            Element::I16 | Element::U16 => 2,
            Element::I32 | Element::U32 | Element::F32 => 4,
            Element::I64 | Element::U64 | Element::F64 => 8,
        }
    }
}

fn element(header: &Header) -> Result<Element, Error> {
    let entry = header.need("type")?;
    match entry.text.to_ascii_lowercase().as_str() {
        "signed char" | "int8" | "int8_t" => Ok(Element::I8),
        "uchar" | "unsigned char" | "uint8" | "uint8_t" => Ok(Element::U8),
        "short" | "short int" | "signed short" | "signed short int" | "int16" | "int16_t" => Ok(Element::I16),
        "ushort" | "unsigned short" | "unsigned short int" | "uint16" | "uint16_t" => Ok(Element::U16),
        "float" => Ok(Element::F32),
        "double" => Ok(Element::F64),
        _ => Err(entry.not_read_here(&entry.text, "save it as uint8, int8, uint16, int16, float or double")),
    }
}

fn is_gzip(header: &Header) -> Result<bool, Error> {
    let entry = header.need("encoding")?;
    match entry.text.to_ascii_lowercase().as_str() {
        "raw" => Ok(false),
        "gz" | "gzip" => Ok(true),
        _ => Err(entry.not_read_here(&entry.text, "re-save it with `encoding: gzip` or `encoding: raw`")),
    }
}

fn is_big_endian(header: &Header, element: Element) -> Result<bool, Error> {
    let entry = match element.width() {
        1 => header.get("endian"),
        _ => Some(header.need("endian")?),
    };
    match entry.map(|entry| (entry, entry.text.to_ascii_lowercase())) {
        None => Ok(false),
        Some((_, text)) if text == "little" => Ok(false),
        Some((_, text)) if text == "big" => Ok(true),
        Some((entry, _)) => Err(entry.cannot_be(&entry.text, "`little` or `big`")),
    }
}

/// How many axes the array has and how long they are.
struct Shape {
    /// The axes of the file, 3 or 4. A fourth comes first and has one entry.
    axes: usize,
    dims: [u32; 3],
}

impl Shape {
    fn of(header: &Header) -> Result<Shape, Error> {
        let entry = header.need("dimension")?;
        let axes = match entry.text.parse::<u32>() {
            Ok(3) => 3,
            Ok(4) => 4,
            Ok(2) => return Err(entry.not_read_here("2", "a flat image is no volume: stack its slices into one file")),
            Ok(_) => return Err(entry.not_read_here(&entry.text, "export a single volume of three axes")),
            Err(_) => return Err(entry.cannot_be(&entry.text, "the number of axes, 3")),
        };
        let sizes = sizes(header, axes)?;
        if axes == 4 && sizes[0] != 1 {
            let line = header.need("sizes")?.line;
            return Err(Problem::Layered { layers: sizes[0] }.on(line));
        }
        check_kinds(header, axes)?;
        let spatial = [sizes[axes - 3], sizes[axes - 2], sizes[axes - 1]];
        let dims = geometry::check_dims(spatial).map_err(|problem| match header.get("sizes") {
            Some(entry) => problem.on(entry.line),
            None => problem.in_whole(),
        })?;
        Ok(Shape { axes, dims })
    }

    /// The entries of the three axes of space.
    fn spatial<T: Copy>(&self, entries: &[T]) -> [T; 3] {
        std::array::from_fn(|i| entries[self.axes - 3 + i])
    }
}

fn sizes(header: &Header, axes: usize) -> Result<Vec<u64>, Error> {
    const WANTED: &str = "a whole number above 0 for each axis, up to 4096";
    let entry = header.need("sizes")?;
    let size = |word: &&str| {
        let is_plain = word.bytes().all(|b| b.is_ascii_digit());
        let size = word.parse().ok().filter(|&size: &u64| is_plain && size > 0);
        size.ok_or_else(|| entry.cannot_be(word, WANTED))
    };
    entry.words(axes)?.iter().map(size).collect()
}

/// Three axes of space, and before them at most one of something else.
fn check_kinds(header: &Header, axes: usize) -> Result<(), Error> {
    let Some(entry) = header.get("kinds") else { return Ok(()) };
    for (index, kind) in entry.words(axes)?.into_iter().enumerate() {
        let is_spatial = ["domain", "space"].iter().any(|known| known.eq_ignore_ascii_case(kind));
        let is_untold = ["???", "none"].contains(&kind);
        let should_be_spatial = index >= axes - 3;
        if !is_untold && is_spatial != should_be_spatial {
            let remedy = "export a single volume of three axes of space (`kinds: domain domain domain`)";
            return Err(entry.not_read_here(&entry.text, remedy));
        }
    }
    Ok(())
}

fn geometry_of(header: &Header, shape: &Shape) -> Result<Geometry, Error> {
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
        (None, Some(_), _) => return Err(Problem::Missing("space").in_whole()),
        // In a space, spacings alone leave open which way the axes run.
        (Some(_), None, _) => return Err(Problem::Missing("space directions").in_whole()),
        (None, None, Some(spacings)) => {
            let [x, y, z] = spacings.value;
            // A direction may run backward; a distance may not.
            if let Some((axis, mm)) = (1..).zip(spacings.value).find(|(_, mm)| *mm < 0.0) {
                return Err(Problem::Spacing { axis, mm }.on(spacings.line));
            }
            ([DVec3::new(x, 0.0, 0.0), DVec3::new(0.0, y, 0.0), DVec3::new(0.0, 0.0, z)], spacings.line)
        }
        (None, None, None) => return Err(Problem::Missing("spacings").in_whole()),
    };
    geometry::check_steps(steps).map_err(|problem| problem.on(line))?;
    let origin = origin(header, space.is_some())?;
    let (space, signs) = space.unwrap_or((Space::Untold, AS_IS));
    let mut geometry = Geometry { dims: shape.dims, steps, origin, space };
    geometry.flip(signs);
    Ok(geometry)
}

/// Something a line of the header says.
#[derive(Clone, Copy)]
struct Told<T> {
    value: T,
    line: usize,
}

const AS_IS: [f64; 3] = [1.0, 1.0, 1.0];

/// The space, and the signs that turn positions into the one we keep.
fn space(header: &Header) -> Result<Option<(Space, [f64; 3])>, Error> {
    let dimension = header.get("space dimension");
    if let Some(entry) = dimension.filter(|entry| entry.text != "3") {
        return Err(entry.not_read_here(&entry.text, "export a single volume in a space of three dimensions"));
    }
    let Some(entry) = header.get("space") else {
        return Ok(dimension.map(|_| (Space::Untold, AS_IS)));
    };
    let anatomical = |signs| Ok(Some((Space::LeftPosteriorSuperior, signs)));
    // "left-posterior-superior", "left posterior superior" and "leftposteriorsuperior" are one name.
    match entry.text.to_ascii_lowercase().replace(['-', ' '], "").as_str() {
        "leftposteriorsuperior" | "lps" => anatomical(AS_IS),
        "rightanteriorsuperior" | "ras" => anatomical([-1.0, -1.0, 1.0]),
        "leftanteriorsuperior" | "las" => anatomical([1.0, -1.0, 1.0]),
        "scannerxyz" => Ok(Some((Space::ScannerXyz, AS_IS))),
        "3drighthanded" => Ok(Some((Space::RightHanded, AS_IS))),
        "3dlefthanded" => Ok(Some((Space::LeftHanded, AS_IS))),
        _ => Err(entry.not_read_here(&entry.text, "save it in left-posterior-superior")),
    }
}

fn check_millimetres(header: &Header, field: &'static str, count: usize) -> Result<(), Error> {
    let Some(entry) = header.get(field) else { return Ok(()) };
    let spatial = entry.quoted(count)?.split_off(count - 3);
    let is_mm = |unit: &&str| {
        ["", "???", "mm", "millimeter", "millimeters", "millimetre", "millimetres"]
            .iter()
            .any(|known| known.eq_ignore_ascii_case(unit.trim()))
    };
    match spatial.iter().find(|unit| !is_mm(unit)) {
        Some(unit) => Err(entry.not_read_here(unit, "convert the spacing and the origin to mm")),
        None => Ok(()),
    }
}

fn spacings(header: &Header, shape: &Shape) -> Result<Option<Told<[f64; 3]>>, Error> {
    let Some(entry) = header.get("spacings") else { return Ok(None) };
    let words = shape.spatial(&entry.words(shape.axes)?);
    let mut value = [0.0; 3];
    for (slot, word) in value.iter_mut().zip(words) {
        *slot = number(entry, word, "a distance in mm for each axis")?;
    }
    Ok(Some(Told { value, line: entry.line }))
}

fn directions(header: &Header, shape: &Shape) -> Result<Option<Told<[DVec3; 3]>>, Error> {
    const WANTED: &str = "a vector for each axis, as in (0.2,0,0) (0,0.2,0) (0,0,0.2)";
    let Some(entry) = header.get("space directions") else { return Ok(None) };
    let texts = entry.vectors(shape.axes, WANTED)?;
    let is_none = |text: &str| text.eq_ignore_ascii_case("none");
    let lead = texts.iter().take(shape.axes - 3);
    if let Some(text) =
        lead.copied().find(|text| !is_none(text) && vector(entry, text, WANTED).is_ok_and(|v| v.is_finite()))
    {
        return Err(entry.not_read_here(text, "export a single volume: of four axes the first must be `none`"));
    }
    let mut value = [DVec3::ZERO; 3];
    for (slot, text) in value.iter_mut().zip(shape.spatial(&texts)) {
        if is_none(text) {
            return Err(entry.not_read_here(text, "export a single volume: three axes must lie in space"));
        }
        *slot = vector(entry, text, WANTED)?;
    }
    Ok(Some(Told { value, line: entry.line }))
}

/// A file may give both; then one must be the length of the other.
fn check_agreement(directions: [DVec3; 3], spacings: Option<Told<[f64; 3]>>) -> Result<(), Error> {
    /// Writers round to six digits and more.
    const TOLERANCE: f64 = 1e-3;
    let Some(spacings) = spacings else { return Ok(()) };
    for (axis, (told, direction)) in (1..).zip(spacings.value.into_iter().zip(directions)) {
        let length = direction.length();
        // NaN is the format's word for an axis without spacing.
        if !told.is_nan() && (told - length).abs() > TOLERANCE * length {
            return Err(Problem::SpacingsDisagree { axis, told, length }.on(spacings.line));
        }
    }
    Ok(())
}

fn origin(header: &Header, has_space: bool) -> Result<DVec3, Error> {
    const WANTED: &str = "a position in mm, as in (0,0,0)";
    let Some(entry) = header.get("space origin") else { return Ok(DVec3::ZERO) };
    if !has_space {
        return Err(Problem::Missing("space").in_whole());
    }
    let inside = entry.text.strip_prefix('(').and_then(|text| text.strip_suffix(')'));
    let origin = match inside {
        Some(text) if !text.contains(['(', ')']) => vector(entry, text, WANTED)?,
        _ => return Err(entry.cannot_be(&entry.text, WANTED)),
    };
    geometry::check_origin(origin).map_err(|problem| problem.on(entry.line))?;
    Ok(origin)
}

fn vector(entry: &Entry, text: &str, wanted: &'static str) -> Result<DVec3, Error> {
    let mut words = text.split(',');
    let mut next = || match words.next() {
        Some(word) => number(entry, word.trim(), wanted),
        None => Err(entry.cannot_be(text, wanted)),
    };
    let vector = DVec3::new(next()?, next()?, next()?);
    match words.next() {
        None => Ok(vector),
        Some(_) => Err(entry.cannot_be(text, wanted)),
    }
}

fn number(entry: &Entry, word: &str, wanted: &'static str) -> Result<f64, Error> {
    word.parse().map_err(|_| entry.cannot_be(word, wanted))
}

fn line_skip(header: &Header) -> Result<u64, Error> {
    let Some(entry) = header.get("line skip") else { return Ok(0) };
    entry.text.parse().map_err(|_| entry.cannot_be(&entry.text, "a number of lines"))
}

fn byte_skip(header: &Header, is_gzip: bool) -> Result<Skip, Error> {
    let Some(entry) = header.get("byte skip") else { return Ok(Skip::Bytes(0)) };
    match entry.text.parse::<i64>() {
        Ok(-1) if !is_gzip => Ok(Skip::ToEnd),
        Ok(-1) => {
            Err(entry.not_read_here("-1", "only raw data can be counted from the end: say how many bytes to skip"))
        }
        Ok(bytes @ 0..) if !is_gzip || bytes as u64 <= SKIP_MAX => Ok(Skip::Bytes(bytes as u64)),
        Ok(0..) => Err(entry.not_read_here(&entry.text, "save the volume without what comes before it")),
        _ => Err(entry.cannot_be(&entry.text, "a number of bytes, or -1 for data at the end of the file")),
    }
}

fn data_file(header: &Header) -> Result<Option<DataFile>, Error> {
    let Some(entry) = header.get("data file") else { return Ok(None) };
    let name = entry.text.as_str();
    let one_file = "join the slices into one file (`unu save`, or 3D Slicer: Save as .nrrd)";
    if name.split_whitespace().next() == Some("LIST") || is_pattern(name) {
        return Err(entry.not_read_here(name, one_file));
    }
    let refuse = |why| Err(Problem::DataFile { name: super::error::excerpt(name), why }.on(entry.line));
    let mut parts = Path::new(name).components();
    if name.is_empty() {
        refuse("has no name")
    } else if name.contains('\0') {
        refuse("has a name no file can have")
    } else if Path::new(name).is_absolute() || name.starts_with(['/', '\\']) {
        refuse("is named by an absolute path")
    } else if !parts.all(|part| matches!(part, Component::Normal(_) | Component::CurDir)) {
        refuse("leads out of the header's folder")
    } else {
        Ok(Some(DataFile { name: name.to_string(), line: entry.line }))
    }
}

/// `slice%03d.raw 1 161 1`: as NrrdIO tells it, a `%`, digits and a `d`.
fn is_pattern(name: &str) -> bool {
    let is_number = |rest: &str| rest.trim_start_matches(|c: char| c.is_ascii_digit()).starts_with('d');
    name.split('%').skip(1).any(is_number)
}
