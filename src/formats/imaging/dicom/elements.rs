//! The elements of one DICOM file, as far as a slice needs them.
//!
//! Takes the bytes of a file. Gives the values of its outermost elements. Never copies a value. Lengths are checked
//! against the available bytes. The format: DICOM PS3.5 (data elements, transfer syntaxes) and PS3.10 (files).

use crate::imaging::dicom::DOING;
use crate::imaging::error::{ScanError, sanitized_excerpt};
use std::collections::BTreeMap;

/// Element tag: the group in the upper half, the element in the lower.
pub(super) type Tag = u32;

const PIXELS: Tag = 0x7FE0_0010;
const SYNTAX: Tag = 0x0002_0010;
const ITEM: Tag = 0xFFFE_E000;
const ITEM_END: Tag = 0xFFFE_E00D;
const SEQUENCE_END: Tag = 0xFFFE_E0DD;

/// Undefined length: an end delimiter follows instead.
const UNDEFINED_LENGTH: u32 = u32::MAX;

/// Maximum nesting depth of sequences; real files have three or four levels.
const DEPTH_MAX: u32 = 16;

pub(super) struct DicomElements<'a> {
    /// Values of the outermost level, by tag.
    values: BTreeMap<Tag, &'a [u8]>,
    /// Fragments of compressed pixel data; empty for uncompressed data.
    pub fragments: Vec<&'a [u8]>,
    pub syntax: String,
    pub is_big_endian: bool,
}

/// Transfer syntaxes of uncompressed pixels, little and big endian, and the deflated one, which is named in a
/// complaint.
pub(super) const IMPLICIT: &str = "1.2.840.10008.1.2";
const EXPLICIT: &str = "1.2.840.10008.1.2.1";
const BIG: &str = "1.2.840.10008.1.2.2";
const DEFLATED: &str = "1.2.840.10008.1.2.1.99";

pub(super) fn wrong(what: impl Into<String>, remedy: &str) -> ScanError {
    ScanError::new(DOING, what, remedy)
}

fn cut_off(at: usize) -> ScanError {
    wrong(format!("byte {at}: the file ends within an element"), "copy or export the file again")
}

/// First group of a data set; a directory file (DICOMDIR) has one of its own before it.
const FIRST_GROUP: u32 = 8;
const DIRECTORY_GROUP: u32 = 4;

impl<'a> DicomElements<'a> {
    /// Reads the data elements of a DICOM file.
    ///
    /// # Errors
    /// Fails when the file ends within an element, is not DICOM, or uses a deflated transfer syntax.
    pub fn read(bytes: &'a [u8]) -> Result<DicomElements<'a>, ScanError> {
        let mut elements = DicomElements {
            values: BTreeMap::new(),
            fragments: Vec::new(),
            syntax: String::new(),
            is_big_endian: false,
        };
        let mut reader = ElementReader { bytes, at: 0, is_explicit: true, is_big_endian: false };
        if bytes.get(128..132) == Some(b"DICM") {
            reader.at = 132;
        }
        elements.read_meta_group(&mut reader)?;
        elements.read_data_set(&mut reader)?;
        match elements.values.len() {
            0 => Err(wrong("the file contains no elements", "give a DICOM slice")),
            _ => Ok(elements),
        }
    }

    /// Reads the file meta group, if there is one, and prepares the reader for the data set that follows.
    fn read_meta_group(&mut self, reader: &mut ElementReader<'a>) -> Result<(), ScanError> {
        // The group, which declares the transfer syntax of the rest, is itself always explicit VR little endian.
        while reader.bytes.get(reader.at..reader.at + 2) == Some(&[2, 0]) {
            let (tag, length, _) = reader.element_header()?;
            let value = reader.take(length)?;
            self.values.insert(tag, value);
        }
        let syntax = self.text(SYNTAX).unwrap_or_default();
        reader.is_explicit = match syntax.as_str() {
            // Files without a preamble, as in old archives: explicit when the two letters of a value representation
            // follow the tag.
            "" => {
                reader.bytes.get(reader.at + 4..reader.at + 6).is_some_and(|vr| vr.iter().all(u8::is_ascii_uppercase))
            }
            IMPLICIT => false,
            DEFLATED => {
                return Err(wrong(
                    format!("its transfer syntax, Deflated Explicit VR Little Endian ({DEFLATED}), is not supported"),
                    "export the series uncompressed (Explicit VR Little Endian)",
                ));
            }
            _ => true,
        };
        reader.is_big_endian = syntax == BIG;
        self.is_big_endian = reader.is_big_endian;
        let implied = if reader.is_explicit { EXPLICIT } else { IMPLICIT };
        self.syntax = if syntax.is_empty() { implied.to_string() } else { syntax };
        Ok(())
    }

    /// Reads the elements of the data set, up to and including the pixels.
    fn read_data_set(&mut self, reader: &mut ElementReader<'a>) -> Result<(), ScanError> {
        let mut last = 0;
        while reader.at < reader.bytes.len() {
            let start = reader.at;
            let (tag, length, vr) = reader.element_header()?;
            // Elements are in ascending order; a violation means that the file is not DICOM or that the reader has
            // lost its position.
            let group = tag >> 16;
            if tag <= last || (group < FIRST_GROUP && group != DIRECTORY_GROUP) {
                let what = format!("byte {start}: element {tag:08x} follows {last:08x}");
                return Err(wrong(what, "copy or export the file again: its elements are out of order"));
            }
            last = tag;
            if tag == PIXELS && length == UNDEFINED_LENGTH {
                self.fragments = reader.fragments()?;
                break;
            }
            match length {
                UNDEFINED_LENGTH if matches!(&vr, b"SQ" | b"UN" | b"\0\0") => reader.skip_sequence(vr == *b"UN", 0)?,
                UNDEFINED_LENGTH => {
                    return Err(wrong(
                        format!("byte {start}: element {tag:08x} has no length"),
                        "export the file again",
                    ));
                }
                length => {
                    let value = reader.take(length)?;
                    self.values.insert(tag, value);
                }
            }
            if tag == PIXELS {
                break;
            }
        }
        Ok(())
    }

    pub fn bytes(&self, tag: Tag) -> Option<&'a [u8]> {
        self.values.get(&tag).copied()
    }

    pub fn pixels(&self) -> Option<&'a [u8]> {
        self.bytes(PIXELS)
    }

    /// Returns a text value without the spaces and zeros that pad it to an even length.
    pub fn text(&self, tag: Tag) -> Option<String> {
        let text = String::from_utf8_lossy(self.bytes(tag)?);
        Some(text.trim_matches(|c: char| c == '\0' || c.is_whitespace()).to_string())
    }

    /// Returns a two-byte number.
    pub fn short(&self, tag: Tag) -> Option<u16> {
        let bytes = self.bytes(tag)?.first_chunk()?;
        Some(if self.is_big_endian { u16::from_be_bytes(*bytes) } else { u16::from_le_bytes(*bytes) })
    }

    /// Returns numbers written as text and separated by backslashes; `None` unless there are exactly `N`, all finite.
    pub fn numbers<const N: usize>(&self, tag: Tag) -> Option<[f64; N]> {
        let text = self.text(tag)?;
        let numbers: Option<Vec<f64>> = text.split('\\').map(|word| word.trim().parse().ok()).collect();
        let numbers: [f64; N] = numbers?.try_into().ok()?;
        numbers.iter().all(|n| n.is_finite()).then_some(numbers)
    }

    /// Returns a text value, sanitized for a message.
    pub fn display_text(&self, tag: Tag) -> String {
        self.text(tag).map(|text| sanitized_excerpt(&text)).unwrap_or_default()
    }
}

struct ElementReader<'a> {
    bytes: &'a [u8],
    at: usize,
    is_explicit: bool,
    is_big_endian: bool,
}

impl<'a> ElementReader<'a> {
    fn take(&mut self, length: u32) -> Result<&'a [u8], ScanError> {
        let end = self.at.checked_add(length as usize).filter(|&end| end <= self.bytes.len());
        let end = end.ok_or_else(|| cut_off(self.at))?;
        let value = &self.bytes[self.at..end];
        self.at = end;
        Ok(value)
    }

    fn short(&mut self) -> Result<u16, ScanError> {
        let bytes = *self.take(2)?.first_chunk().ok_or_else(|| cut_off(self.at))?;
        Ok(if self.is_big_endian { u16::from_be_bytes(bytes) } else { u16::from_le_bytes(bytes) })
    }

    fn long(&mut self) -> Result<u32, ScanError> {
        let bytes = *self.take(4)?.first_chunk().ok_or_else(|| cut_off(self.at))?;
        Ok(if self.is_big_endian { u32::from_be_bytes(bytes) } else { u32::from_le_bytes(bytes) })
    }

    fn tag(&mut self) -> Result<Tag, ScanError> {
        Ok(u32::from(self.short()?) << 16 | u32::from(self.short()?))
    }

    /// Reads the tag, the length and the two letters of the value representation; zeros where the file omits the
    /// latter.
    fn element_header(&mut self) -> Result<(Tag, u32, [u8; 2]), ScanError> {
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
                let what = format!("byte {start}: element {tag:08x} has no value representation");
                return Err(wrong(what, "copy or export the file again: it is not DICOM, or it is damaged"));
            }
        };
        Ok((tag, length, vr))
    }

    /// Skips a sequence of undefined length. A sequence of unknown kind (UN) is encoded with implicit VR.
    fn skip_sequence(&mut self, is_unknown: bool, depth: u32) -> Result<(), ScanError> {
        if depth > DEPTH_MAX {
            let what = format!("byte {}: sequences are nested too deeply", self.at);
            return Err(wrong(what, "export the file again"));
        }
        let was_explicit = self.is_explicit;
        self.is_explicit &= !is_unknown;
        loop {
            let start = self.at;
            match (self.tag()?, self.long()?) {
                (SEQUENCE_END, _) => break,
                (ITEM, UNDEFINED_LENGTH) => self.skip_item(depth)?,
                (ITEM, length) => drop(self.take(length)?),
                _ => {
                    return Err(wrong(format!("byte {start}: a sequence is damaged"), "copy or export the file again"));
                }
            }
        }
        self.is_explicit = was_explicit;
        Ok(())
    }

    fn skip_item(&mut self, depth: u32) -> Result<(), ScanError> {
        loop {
            let start = self.at;
            match self.element_header()? {
                (ITEM_END, ..) => return Ok(()),
                (_, UNDEFINED_LENGTH, vr) if matches!(&vr, b"SQ" | b"UN" | b"\0\0") => {
                    self.skip_sequence(vr == *b"UN", depth + 1)?;
                }
                (tag, UNDEFINED_LENGTH, _) => {
                    return Err(wrong(
                        format!("byte {start}: element {tag:08x} has no length"),
                        "export the file again",
                    ));
                }
                (_, length, _) => drop(self.take(length)?),
            }
        }
    }

    /// Reads the fragments of compressed pixel data, without the offset table that precedes them.
    fn fragments(&mut self) -> Result<Vec<&'a [u8]>, ScanError> {
        let mut fragments = Vec::new();
        loop {
            let start = self.at;
            match (self.tag()?, self.long()?) {
                (SEQUENCE_END, _) => break,
                (ITEM, length) if length != UNDEFINED_LENGTH => fragments.push(self.take(length)?),
                _ => {
                    return Err(wrong(
                        format!("byte {start}: the pixel data are damaged"),
                        "copy or export the file again",
                    ));
                }
            }
        }
        match fragments.len() {
            0 | 1 => Err(wrong("the file contains no pixel data", "copy or export the file again")),
            _ => Ok(fragments.split_off(1)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An element with explicit value representation, little endian.
    fn element(tag: Tag, representation: &[u8; 2], value: &[u8]) -> Vec<u8> {
        let [group, number] = [(tag >> 16) as u16, tag as u16].map(u16::to_le_bytes);
        let length = (value.len() as u16).to_le_bytes();
        [&group[..], &number, representation, &length, value].concat()
    }

    #[test]
    fn a_directory_file_is_read_and_a_lost_position_is_noticed() {
        // Aim: a hospital's disc holds a DICOMDIR beside its slices, whose elements are of group 4. Method: such a file; and
        // the same with an element of a group that no data set has.
        let file = |tag: Tag| {
            let syntax = element(SYNTAX, b"UI", b"1.2.840.10008.1.2.1\0");
            [&[0; 128][..], b"DICM", &syntax, &element(tag, b"CS", b"SERIES")].concat()
        };
        assert_eq!(DicomElements::read(&file(0x0004_1130)).unwrap().text(0x0004_1130).as_deref(), Some("SERIES"));
        assert!(DicomElements::read(&file(0x0006_0010)).is_err());
    }
}
