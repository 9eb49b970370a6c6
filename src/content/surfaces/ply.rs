//! PLY (Stanford), as text and binary in either order of bytes. Colours and whatever else stands there are passed over.

use super::wrong;
use crate::content::imaging::Unread;
use crate::frame::Vec3;
use crate::volume::solid::Triangle;

/// Most corners of one face: more is a list gone astray.
const CORNERS_MAX: usize = 1000;

const AGAIN: &str = "copy or export the file again";

pub(super) fn parse(bytes: &[u8]) -> Result<Vec<Triangle>, Unread> {
    let (header, mut from) = Header::read(bytes)?;
    let mut places: Vec<Vec3> = Vec::new();
    let mut triangles = Vec::new();
    for element in &header.elements {
        // However little each takes, there must be that many: nothing is believed that the file has no room for.
        let room = from.left() / element.least(header.form).max(1);
        if element.count > room {
            let what =
                format!("it announces {} entries of \"{}\", and has room for {room}", element.count, element.name);
            return Err(wrong(what, AGAIN));
        }
        let axes =
            ["x", "y", "z"].map(|axis| element.properties.iter().position(|p| p.name == axis && p.list.is_none()));
        let corners = element.properties.iter().position(|p| p.list.is_some() && p.name.starts_with("vert"));
        match element.name.as_str() {
            "vertex" if axes.contains(&None) => return Err(wrong("its corners have no x, y and z", AGAIN)),
            "face" if corners.is_none() => return Err(wrong("its faces have no corners", AGAIN)),
            _ => {}
        }
        let mut values: Vec<Vec<f64>> = vec![Vec::new(); element.properties.len()];
        for _ in 0..element.count {
            for (property, values) in element.properties.iter().zip(&mut values) {
                from.property(property, values)?;
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
enum Form {
    Text,
    Little,
    Big,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Number {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Number {
    fn of(word: &str) -> Option<Number> {
        Some(match word {
            "char" | "int8" => Number::I8,
            "uchar" | "uint8" => Number::U8,
            "short" | "int16" => Number::I16,
            "ushort" | "uint16" => Number::U16,
            "int" | "int32" => Number::I32,
            "uint" | "uint32" => Number::U32,
            "float" | "float32" => Number::F32,
            "double" | "float64" => Number::F64,
            _ => return None,
        })
    }

    fn width(self) -> usize {
        match self {
            Number::I8 | Number::U8 => 1,
            Number::I16 | Number::U16 => 2,
            Number::I32 | Number::U32 | Number::F32 => 4,
            Number::F64 => 8,
        }
    }
}

struct Property {
    name: String,
    number: Number,
    /// How its length is written, of a list.
    list: Option<Number>,
}

struct Element {
    name: String,
    count: usize,
    properties: Vec<Property>,
}

impl Element {
    /// Bytes that one entry takes at least.
    fn least(&self, form: Form) -> usize {
        let least = |p: &Property| match (form, p.list) {
            // A digit and what parts it from the next.
            (Form::Text, _) => 2,
            (_, Some(length)) => length.width(),
            (_, None) => p.number.width(),
        };
        self.properties.iter().map(least).sum()
    }
}

struct Header {
    form: Form,
    elements: Vec<Element>,
}

impl Header {
    fn read(bytes: &[u8]) -> Result<(Header, From<'_>), Unread> {
        /// Most lines of a header: real ones have a dozen or two.
        const LINES_MAX: usize = 1000;
        if !bytes.starts_with(b"ply") {
            return Err(wrong("this is no PLY file", "export the surface again as PLY"));
        }
        let mut form = None;
        let mut elements: Vec<Element> = Vec::new();
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
                ["format", "ascii", _] => form = Some(Form::Text),
                ["format", "binary_little_endian", _] => form = Some(Form::Little),
                ["format", "binary_big_endian", _] => form = Some(Form::Big),
                ["element", name, count] => {
                    let count = count.parse().map_err(|_| not_read())?;
                    elements.push(Element { name: name.to_string(), count, properties: Vec::new() });
                }
                ["property", "list", length, number, name] => {
                    let length = Number::of(length).ok_or_else(not_read)?;
                    let number = Number::of(number).ok_or_else(not_read)?;
                    let property = Property { name: name.to_string(), number, list: Some(length) };
                    elements.last_mut().ok_or_else(not_read)?.properties.push(property);
                }
                ["property", number, name] => {
                    let number = Number::of(number).ok_or_else(not_read)?;
                    let property = Property { name: name.to_string(), number, list: None };
                    elements.last_mut().ok_or_else(not_read)?.properties.push(property);
                }
                ["end_header"] => {
                    let form = form.ok_or_else(|| wrong("its header does not say how it is written", AGAIN))?;
                    return Ok((Header { form, elements }, From { bytes: &bytes[at..], form }));
                }
                _ => return Err(not_read()),
            }
        }
        Err(wrong(format!("its header has more than {LINES_MAX} lines"), AGAIN))
    }
}

/// What follows the header.
struct From<'a> {
    bytes: &'a [u8],
    form: Form,
}

impl From<'_> {
    fn left(&self) -> usize {
        // The last number of a text needs nothing after it.
        self.bytes.len() + usize::from(self.form == Form::Text)
    }

    fn property(&mut self, property: &Property, values: &mut Vec<f64>) -> Result<(), Unread> {
        values.clear();
        let count = match property.list {
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
            values.push(self.number(property.number)?);
        }
        Ok(())
    }

    fn number(&mut self, number: Number) -> Result<f64, Unread> {
        let cut_off = || wrong("the file ends before its last face", AGAIN);
        if self.form == Form::Text {
            self.bytes = self.bytes.trim_ascii_start();
            let end = self.bytes.iter().position(u8::is_ascii_whitespace).unwrap_or(self.bytes.len());
            let (word, rest) = self.bytes.split_at(end);
            self.bytes = rest;
            if word.is_empty() {
                return Err(cut_off());
            }
            let text = String::from_utf8_lossy(word);
            return text.parse().map_err(|_| wrong(format!("\"{}\" in it is no number", text.escape_debug()), AGAIN));
        }
        let (word, rest) = self.bytes.split_at_checked(number.width()).ok_or_else(cut_off)?;
        self.bytes = rest;
        let mut bytes = [0; 8];
        bytes[..word.len()].copy_from_slice(word);
        if self.form == Form::Big {
            bytes[..word.len()].reverse();
        }
        let [a, b, c, d, ..] = bytes;
        Ok(match number {
            Number::I8 => f64::from(a as i8),
            Number::U8 => f64::from(a),
            Number::I16 => f64::from(i16::from_le_bytes([a, b])),
            Number::U16 => f64::from(u16::from_le_bytes([a, b])),
            Number::I32 => f64::from(i32::from_le_bytes([a, b, c, d])),
            Number::U32 => f64::from(u32::from_le_bytes([a, b, c, d])),
            Number::F32 => f64::from(f32::from_le_bytes([a, b, c, d])),
            Number::F64 => f64::from_le_bytes(bytes),
        })
    }
}
