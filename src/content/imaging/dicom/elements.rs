//! The elements of one DICOM file, as far as a slice needs them.
//!
//! The format: DICOM PS3.5 (data elements, transfer syntaxes) and PS3.10 (files). Lengths are held against the bytes that
//! are there; nothing is copied.

use super::super::unread::{Unread, plain};
use super::DOING;
use std::collections::BTreeMap;

/// Group in the upper half, element in the lower.
pub(super) type Tag = u32;

const PIXELS: Tag = 0x7FE0_0010;
const SYNTAX: Tag = 0x0002_0010;
const ITEM: Tag = 0xFFFE_E000;
const ITEM_END: Tag = 0xFFFE_E00D;
const SEQUENCE_END: Tag = 0xFFFE_E0DD;

/// A length that is not told: an end mark follows instead.
const UNTOLD: u32 = u32::MAX;

/// How deep sequences may stand in sequences; real ones do so three or four times.
const DEPTH_MAX: u32 = 16;

pub(super) struct Elements<'a> {
    /// Values of the outermost level by tag.
    values: BTreeMap<Tag, &'a [u8]>,
    /// Pieces of compressed pixels; empty for plain ones.
    pub fragments: Vec<&'a [u8]>,
    pub syntax: String,
    pub is_big_endian: bool,
}

/// Plain pixels, little or big endian, and what is read beside them.
pub(super) const IMPLICIT: &str = "1.2.840.10008.1.2";
const EXPLICIT: &str = "1.2.840.10008.1.2.1";
const BIG: &str = "1.2.840.10008.1.2.2";
const DEFLATED: &str = "1.2.840.10008.1.2.1.99";

pub(super) fn wrong(what: impl Into<String>, remedy: &str) -> Unread {
    Unread::new(DOING, what, remedy)
}

fn cut_off(at: usize) -> Unread {
    wrong(format!("byte {at}: the file ends within an element"), "copy or export the file again")
}

impl<'a> Elements<'a> {
    pub fn read(bytes: &'a [u8]) -> Result<Elements<'a>, Unread> {
        let mut elements =
            Elements { values: BTreeMap::new(), fragments: Vec::new(), syntax: String::new(), is_big_endian: false };
        let mut reader = Reader { bytes, at: 0, is_explicit: true, is_big_endian: false };
        if bytes.get(128..132) == Some(b"DICM") {
            reader.at = 132;
        }
        // The group that says how all others are written is itself always written in one way.
        while reader.bytes.get(reader.at..reader.at + 2) == Some(&[2, 0]) {
            let (tag, length, _) = reader.head()?;
            let value = reader.take(length)?;
            elements.values.insert(tag, value);
        }
        let syntax = elements.text(SYNTAX).unwrap_or_default();
        reader.is_explicit = match syntax.as_str() {
            // Files without a head, as old archives have them: a code of two letters follows the tag, or it does not.
            "" => bytes.get(reader.at + 4..reader.at + 6).is_some_and(|vr| vr.iter().all(u8::is_ascii_uppercase)),
            IMPLICIT => false,
            DEFLATED => {
                return Err(wrong(
                    format!("its transfer syntax, Deflated Explicit VR Little Endian ({DEFLATED}), is not read"),
                    "export the series uncompressed (Explicit VR Little Endian)",
                ));
            }
            _ => true,
        };
        reader.is_big_endian = syntax == BIG;
        elements.is_big_endian = reader.is_big_endian;
        let implied = if reader.is_explicit { EXPLICIT } else { IMPLICIT };
        elements.syntax = if syntax.is_empty() { implied.to_string() } else { syntax };
        let mut last = 0;
        while reader.at < bytes.len() {
            let start = reader.at;
            let (tag, length, vr) = reader.head()?;
            // Elements stand in ascending order; what does not is no DICOM, or has lost its place.
            if tag <= last || tag >> 16 < 8 {
                let what = format!("byte {start}: element {tag:08x} follows {last:08x}");
                return Err(wrong(what, "copy or export the file again: its elements are out of order"));
            }
            last = tag;
            if tag == PIXELS && length == UNTOLD {
                elements.fragments = reader.fragments()?;
                break;
            }
            match length {
                UNTOLD if matches!(&vr, b"SQ" | b"UN" | b"\0\0") => reader.skip_sequence(vr == *b"UN", 0)?,
                UNTOLD => {
                    return Err(wrong(format!("byte {start}: element {tag:08x} has no length"), "export it again"));
                }
                length => {
                    let value = reader.take(length)?;
                    elements.values.insert(tag, value);
                }
            }
            if tag == PIXELS {
                break;
            }
        }
        match elements.values.len() {
            0 => Err(wrong("there is no element in it", "this is no DICOM slice")),
            _ => Ok(elements),
        }
    }

    pub fn bytes(&self, tag: Tag) -> Option<&'a [u8]> {
        self.values.get(&tag).copied()
    }

    pub fn pixels(&self) -> Option<&'a [u8]> {
        self.bytes(PIXELS)
    }

    /// Text without the spaces and zeros that make its length even.
    pub fn text(&self, tag: Tag) -> Option<String> {
        let text = String::from_utf8_lossy(self.bytes(tag)?);
        Some(text.trim_matches(|c: char| c == '\0' || c.is_whitespace()).to_string())
    }

    /// A number of two bytes.
    pub fn short(&self, tag: Tag) -> Option<u16> {
        let bytes = self.bytes(tag)?.first_chunk()?;
        Some(if self.is_big_endian { u16::from_be_bytes(*bytes) } else { u16::from_le_bytes(*bytes) })
    }

    /// Numbers written as text, parted by backslashes; exactly so many, all finite.
    pub fn numbers<const N: usize>(&self, tag: Tag) -> Option<[f64; N]> {
        let text = self.text(tag)?;
        let numbers: Option<Vec<f64>> = text.split('\\').map(|word| word.trim().parse().ok()).collect();
        let numbers: [f64; N] = numbers?.try_into().ok()?;
        numbers.iter().all(|n| n.is_finite()).then_some(numbers)
    }

    /// A text as it may stand in a message.
    pub fn said(&self, tag: Tag) -> String {
        self.text(tag).map(|text| plain(&text)).unwrap_or_default()
    }
}

struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
    is_explicit: bool,
    is_big_endian: bool,
}

impl<'a> Reader<'a> {
    fn take(&mut self, length: u32) -> Result<&'a [u8], Unread> {
        let end = self.at.checked_add(length as usize).filter(|&end| end <= self.bytes.len());
        let end = end.ok_or_else(|| cut_off(self.at))?;
        let value = &self.bytes[self.at..end];
        self.at = end;
        Ok(value)
    }

    fn short(&mut self) -> Result<u16, Unread> {
        let bytes = *self.take(2)?.first_chunk().ok_or_else(|| cut_off(self.at))?;
        Ok(if self.is_big_endian { u16::from_be_bytes(bytes) } else { u16::from_le_bytes(bytes) })
    }

    fn long(&mut self) -> Result<u32, Unread> {
        let bytes = *self.take(4)?.first_chunk().ok_or_else(|| cut_off(self.at))?;
        Ok(if self.is_big_endian { u32::from_be_bytes(bytes) } else { u32::from_le_bytes(bytes) })
    }

    fn tag(&mut self) -> Result<Tag, Unread> {
        Ok(u32::from(self.short()?) << 16 | u32::from(self.short()?))
    }

    /// Tag, length and the two letters of an element's kind; none in files that leave them out.
    fn head(&mut self) -> Result<(Tag, u32, [u8; 2]), Unread> {
        let tag = self.tag()?;
        if !self.is_explicit || tag >> 16 == 0xFFFE {
            return Ok((tag, self.long()?, [0; 2]));
        }
        let start = self.at;
        let vr = *self.take(2)?.first_chunk().ok_or_else(|| cut_off(start))?;
        let length = match &vr {
            b"OB" | b"OD" | b"OF" | b"OL" | b"OV" | b"OW" | b"SQ" | b"SV" | b"UC" | b"UN" | b"UR" | b"UT" | b"UV" => {
                self.take(2)?;
                self.long()?
            }
            [a, b] if a.is_ascii_uppercase() && b.is_ascii_uppercase() => self.short()?.into(),
            _ => {
                let what = format!("byte {start}: element {tag:08x} has no kind");
                return Err(wrong(what, "copy or export the file again: it is no DICOM, or damaged"));
            }
        };
        Ok((tag, length, vr))
    }

    /// Passes over a sequence of untold length. One of an unknown kind is written without kinds.
    fn skip_sequence(&mut self, is_unknown: bool, depth: u32) -> Result<(), Unread> {
        if depth > DEPTH_MAX {
            let what = format!("byte {}: sequences stand in one another without end", self.at);
            return Err(wrong(what, "export the file again"));
        }
        let was_explicit = self.is_explicit;
        self.is_explicit &= !is_unknown;
        loop {
            let start = self.at;
            match (self.tag()?, self.long()?) {
                (SEQUENCE_END, _) => break,
                (ITEM, UNTOLD) => self.skip_item(depth)?,
                (ITEM, length) => drop(self.take(length)?),
                _ => return Err(wrong(format!("byte {start}: a sequence is broken"), "copy or export the file again")),
            }
        }
        self.is_explicit = was_explicit;
        Ok(())
    }

    fn skip_item(&mut self, depth: u32) -> Result<(), Unread> {
        loop {
            let start = self.at;
            match self.head()? {
                (ITEM_END, ..) => return Ok(()),
                (_, UNTOLD, vr) if matches!(&vr, b"SQ" | b"UN" | b"\0\0") => {
                    self.skip_sequence(vr == *b"UN", depth + 1)?;
                }
                (tag, UNTOLD, _) => {
                    return Err(wrong(format!("byte {start}: element {tag:08x} has no length"), "export it again"));
                }
                (_, length, _) => drop(self.take(length)?),
            }
        }
    }

    /// The pieces of compressed pixels, without the table of offsets that comes first.
    fn fragments(&mut self) -> Result<Vec<&'a [u8]>, Unread> {
        let mut fragments = Vec::new();
        loop {
            let start = self.at;
            match (self.tag()?, self.long()?) {
                (SEQUENCE_END, _) => break,
                (ITEM, length) if length != UNTOLD => fragments.push(self.take(length)?),
                _ => {
                    return Err(wrong(format!("byte {start}: the pixels are broken"), "copy or export the file again"));
                }
            }
        }
        match fragments.len() {
            0 | 1 => Err(wrong("there are no pixels in it", "copy or export the file again")),
            _ => Ok(fragments.split_off(1)),
        }
    }
}
