//! PLY (Stanford), as text and binary in either byte order. Colours and other properties are skipped.

use crate::imaging::ScanError;
use crate::surfaces::wrong;
use typodont_core::frame::Vec3;
use typodont_core::volume::solid::Triangle;

/// Maximum number of corners of one face: more indicates a damaged list.
const CORNERS_MAX: usize = 1000;

const AGAIN: &str = "copy or export the file again";

pub(super) fn parse(bytes: &[u8]) -> Result<Vec<Triangle>, ScanError> {
    let (header, mut body) = PlyHeader::read(bytes)?;
    let mut places: Vec<Vec3> = Vec::new();
    let mut triangles = Vec::new();
    for element in &header.elements {
        // Before memory is allocated, a declared count is checked against the minimum size of that many entries.
        let room = body.remaining() / element.min_entry_bytes(header.format).max(1);
        if element.count > room {
            let what =
                format!("it declares {} entries of \"{}\", but has space for {room}", element.count, element.name);
            return Err(wrong(what, AGAIN));
        }
        let axes = ["x", "y", "z"]
            .map(|axis| element.properties.iter().position(|p| p.name == axis && p.length_type.is_none()));
        let corners = element.properties.iter().position(|p| p.length_type.is_some() && p.name.starts_with("vert"));
        match element.name.as_str() {
            "vertex" if axes.contains(&None) => return Err(wrong("its corners have no x, y and z", AGAIN)),
            "face" if corners.is_none() => return Err(wrong("its faces have no corners", AGAIN)),
            _ => {}
        }
        let mut values: Vec<Vec<f64>> = vec![Vec::new(); element.properties.len()];
        for _ in 0..element.count {
            for (property, values) in element.properties.iter().zip(&mut values) {
                body.property(property, values)?;
            }
            match element.name.as_str() {
                "vertex" => {
                    let at = |axis: usize| axes[axis].map_or(0.0, |n| values[n][0] as f32);
                    places.push(Vec3::new(at(0), at(1), at(2)));
                }
                "face" => {
                    let numbers = corners.map_or(&[][..], |n| &values[n][..]);
                    let place = |n: &f64| match places.get(*n as usize).filter(|_| *n >= 0.0) {
                        Some(place) => Ok(*place),
                        None => Err(wrong(format!("a face has a corner {n}, and there are {}", places.len()), AGAIN)),
                    };
                    let round: Vec<Vec3> = numbers.iter().map(place).collect::<Result<_, _>>()?;
                    triangles.extend(round.windows(2).skip(1).map(|pair| [round[0], pair[0], pair[1]]));
                }
                _ => {}
            }
        }
    }
    Ok(triangles)
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum PlyFormat {
    Text,
    LittleEndian,
    BigEndian,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum PlyScalarType {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl PlyScalarType {
    fn of(word: &str) -> Option<PlyScalarType> {
        Some(match word {
            "char" | "int8" => PlyScalarType::I8,
            "uchar" | "uint8" => PlyScalarType::U8,
            "short" | "int16" => PlyScalarType::I16,
            "ushort" | "uint16" => PlyScalarType::U16,
            "int" | "int32" => PlyScalarType::I32,
            "uint" | "uint32" => PlyScalarType::U32,
            "float" | "float32" => PlyScalarType::F32,
            "double" | "float64" => PlyScalarType::F64,
            _ => return None,
        })
    }

    fn width(self) -> usize {
        match self {
            PlyScalarType::I8 | PlyScalarType::U8 => 1,
            PlyScalarType::I16 | PlyScalarType::U16 => 2,
            PlyScalarType::I32 | PlyScalarType::U32 | PlyScalarType::F32 => 4,
            PlyScalarType::F64 => 8,
        }
    }
}

struct PlyProperty {
    name: String,
    scalar_type: PlyScalarType,
    /// Type of the length of a list; `None` for a scalar.
    length_type: Option<PlyScalarType>,
}

struct PlyElement {
    name: String,
    count: usize,
    properties: Vec<PlyProperty>,
}

impl PlyElement {
    /// Returns the minimum size of one entry, bytes.
    fn min_entry_bytes(&self, form: PlyFormat) -> usize {
        let least = |p: &PlyProperty| match (form, p.length_type) {
            // A digit and a separator.
            (PlyFormat::Text, _) => 2,
            (_, Some(length)) => length.width(),
            (_, None) => p.scalar_type.width(),
        };
        self.properties.iter().map(least).sum()
    }
}

struct PlyHeader {
    format: PlyFormat,
    elements: Vec<PlyElement>,
}

impl PlyHeader {
    fn read(bytes: &[u8]) -> Result<(PlyHeader, PlyBody<'_>), ScanError> {
        /// Maximum number of header lines: real headers have a dozen or two.
        const LINES_MAX: usize = 1000;
        if !bytes.starts_with(b"ply") {
            return Err(wrong("this is not a PLY file", "export the surface again as PLY"));
        }
        let mut form = None;
        let mut elements: Vec<PlyElement> = Vec::new();
        let mut at = 0;
        for number in 1..=LINES_MAX {
            let end = bytes[at..]
                .iter()
                .position(|&b| b == b'\n')
                .ok_or_else(|| wrong("the file ends within its header", AGAIN))?;
            let line = String::from_utf8_lossy(&bytes[at..at + end]).into_owned();
            at += end + 1;
            let words: Vec<&str> = line.split_ascii_whitespace().collect();
            let not_read = || wrong(format!("line {number} of its header is not understood"), AGAIN);
            match words[..] {
                ["ply"] | ["comment" | "obj_info", ..] | [] => {}
                ["format", "ascii", _] => form = Some(PlyFormat::Text),
                ["format", "binary_little_endian", _] => form = Some(PlyFormat::LittleEndian),
                ["format", "binary_big_endian", _] => form = Some(PlyFormat::BigEndian),
                ["element", name, count] => {
                    let count = count.parse().map_err(|_| not_read())?;
                    elements.push(PlyElement { name: name.to_string(), count, properties: Vec::new() });
                }
                ["property", "list", length, number, name] => {
                    let length = PlyScalarType::of(length).ok_or_else(not_read)?;
                    let number = PlyScalarType::of(number).ok_or_else(not_read)?;
                    let property =
                        PlyProperty { name: name.to_string(), scalar_type: number, length_type: Some(length) };
                    elements.last_mut().ok_or_else(not_read)?.properties.push(property);
                }
                ["property", number, name] => {
                    let number = PlyScalarType::of(number).ok_or_else(not_read)?;
                    let property = PlyProperty { name: name.to_string(), scalar_type: number, length_type: None };
                    elements.last_mut().ok_or_else(not_read)?.properties.push(property);
                }
                ["end_header"] => {
                    let form = form.ok_or_else(|| wrong("its header has no format line", AGAIN))?;
                    return Ok((PlyHeader { format: form, elements }, PlyBody { bytes: &bytes[at..], format: form }));
                }
                _ => return Err(not_read()),
            }
        }
        Err(wrong(format!("its header has more than {LINES_MAX} lines"), AGAIN))
    }
}

/// The data that follow the header.
struct PlyBody<'a> {
    bytes: &'a [u8],
    format: PlyFormat,
}

impl PlyBody<'_> {
    fn remaining(&self) -> usize {
        // The last number of a text file needs no separator.
        self.bytes.len() + usize::from(self.format == PlyFormat::Text)
    }

    fn property(&mut self, property: &PlyProperty, values: &mut Vec<f64>) -> Result<(), ScanError> {
        values.clear();
        let count = match property.length_type {
            None => 1,
            Some(length) => {
                let count = self.number(length)?;
                if !(0.0..=CORNERS_MAX as f64).contains(&count) {
                    return Err(wrong(format!("a list in it has {count} entries"), AGAIN));
                }
                count as usize
            }
        };
        for _ in 0..count {
            values.push(self.number(property.scalar_type)?);
        }
        Ok(())
    }

    fn number(&mut self, number: PlyScalarType) -> Result<f64, ScanError> {
        let cut_off = || wrong("the file ends before its last face", AGAIN);
        if self.format == PlyFormat::Text {
            self.bytes = self.bytes.trim_ascii_start();
            let end = self.bytes.iter().position(u8::is_ascii_whitespace).unwrap_or(self.bytes.len());
            let (word, rest) = self.bytes.split_at(end);
            self.bytes = rest;
            if word.is_empty() {
                return Err(cut_off());
            }
            let text = String::from_utf8_lossy(word);
            return text
                .parse()
                .map_err(|_| wrong(format!("\"{}\" in it is not a number", text.escape_debug()), AGAIN));
        }
        let (word, rest) = self.bytes.split_at_checked(number.width()).ok_or_else(cut_off)?;
        self.bytes = rest;
        let mut bytes = [0; 8];
        bytes[..word.len()].copy_from_slice(word);
        if self.format == PlyFormat::BigEndian {
            bytes[..word.len()].reverse();
        }
        let [a, b, c, d, ..] = bytes;
        Ok(match number {
            PlyScalarType::I8 => f64::from(a as i8),
            PlyScalarType::U8 => f64::from(a),
            PlyScalarType::I16 => f64::from(i16::from_le_bytes([a, b])),
            PlyScalarType::U16 => f64::from(u16::from_le_bytes([a, b])),
            PlyScalarType::I32 => f64::from(i32::from_le_bytes([a, b, c, d])),
            PlyScalarType::U32 => f64::from(u32::from_le_bytes([a, b, c, d])),
            PlyScalarType::F32 => f64::from(f32::from_le_bytes([a, b, c, d])),
            PlyScalarType::F64 => f64::from_le_bytes(bytes),
        })
    }
}
