//! Splitting of a header into fields and keys, without interpreting them.

use crate::nrrd::error::{NrrdError, NrrdErrorKind, excerpt};
use crate::nrrd::source::ByteSource;
use std::collections::BTreeMap;
use std::io::{BufRead, Read, Take};

/// Maximum header length, bytes: ten times that of a segmentation of two hundred structures with all of Slicer's
/// keys.
pub(super) const BYTES_MAX: u64 = 1 << 20;

/// Maximum number of header lines, by the same measure.
pub(super) const LINES_MAX: usize = 1 << 14;

/// Fields of the format, each under our name and its other spellings.
const FIELDS: [&[&str]; 30] = [
    &["type"],
    &["dimension"],
    &["sizes"],
    &["encoding"],
    &["endian"],
    &["space"],
    &["space dimension", "spacedimension"],
    &["space directions", "spacedirections"],
    &["space origin", "spaceorigin"],
    &["space units", "spaceunits"],
    &["spacings"],
    &["units"],
    &["kinds"],
    &["data file", "datafile"],
    &["line skip", "lineskip"],
    &["byte skip", "byteskip"],
    // The following fields are known but not used.
    &["content"],
    &["number"],
    &["block size", "blocksize"],
    &["thicknesses"],
    &["axis mins", "axismins"],
    &["axis maxs", "axismaxs"],
    &["centerings", "centers"],
    &["labels"],
    &["min"],
    &["max"],
    &["old min", "oldmin"],
    &["old max", "oldmax"],
    &["sample units", "sampleunits"],
    &["measurement frame", "measurementframe"],
];

/// The text of a field and its line.
pub(super) struct HeaderField {
    pub field: &'static str,
    pub text: String,
    pub line: usize,
}

pub(super) struct NrrdHeader {
    fields: BTreeMap<&'static str, HeaderField>,
    pub keys: Vec<(String, String)>,
}

impl NrrdHeader {
    /// Reads up to and including the blank line. Only a header that names a data file may end without one.
    ///
    /// # Errors
    /// Fails when the header is incomplete, too long, or not valid NRRD; the error names the line.
    pub fn read(source: &mut ByteSource) -> Result<NrrdHeader, NrrdError> {
        check_beginning(source)?;
        let mut header = NrrdHeader { fields: BTreeMap::new(), keys: Vec::new() };
        let mut seen = BTreeMap::new();
        let mut lines = source.take(BYTES_MAX);
        let magic = next_line(&mut lines, 1)?.unwrap_or_default();
        check_version(&magic)?;
        for number in 2..=LINES_MAX {
            let Some(line) = next_line(&mut lines, number)? else {
                return match header.fields.contains_key("data file") {
                    true => Ok(header),
                    false => Err(NrrdErrorKind::HeaderCutOff.on(number)),
                };
            };
            if line.is_empty() {
                return Ok(header);
            }
            // A comment may be in any encoding, because it is not decoded.
            if !line.starts_with(b"#") {
                let text = std::str::from_utf8(&line)
                    .map_err(|error| NrrdErrorKind::NotUtf8 { column: error.valid_up_to() + 1 }.on(number))?;
                header.add(text, number, &mut seen).map_err(|problem| problem.on(number))?;
            }
        }
        Err(NrrdErrorKind::HeaderTooManyLines { lines_max: LINES_MAX }.on(LINES_MAX))
    }

    pub fn get(&self, field: &'static str) -> Option<&HeaderField> {
        debug_assert!(FIELDS.iter().any(|names| names[0] == field), "{field} is in the table");
        self.fields.get(field)
    }

    /// Returns a field that every header must have.
    ///
    /// # Errors
    /// Fails when the field is missing.
    pub fn required(&self, field: &'static str) -> Result<&HeaderField, NrrdError> {
        self.get(field).ok_or_else(|| NrrdErrorKind::Missing(field).in_whole())
    }

    /// Adds a line. `seen` maps each key to its line and its index among the keys.
    fn add(&mut self, line: &str, number: usize, seen: &mut BTreeMap<String, [usize; 2]>) -> Result<(), NrrdErrorKind> {
        match parse_line(line)? {
            HeaderLine::Field(field, text) => match self.fields.get(field) {
                Some(first) => return Err(NrrdErrorKind::Twice { name: field.to_string(), first_line: first.line }),
                None => {
                    self.fields.insert(field, HeaderField { field, text: text.to_string(), line: number });
                }
            },
            HeaderLine::Key(key, value) => match seen.get(&key) {
                None => {
                    seen.insert(key.clone(), [number, self.keys.len()]);
                    self.keys.push((key, value));
                }
                Some(&[_, index]) if self.keys[index].1 == value => {}
                Some(&[first_line, _]) => return Err(NrrdErrorKind::Twice { name: excerpt(&key), first_line }),
            },
        }
        Ok(())
    }
}

impl HeaderField {
    /// Creates an error: the text is not valid for the field.
    pub fn invalid(&self, text: &str, wanted: &'static str) -> NrrdError {
        NrrdErrorKind::Value { field: self.field, text: excerpt(text), wanted }.on(self.line)
    }

    pub fn unsupported(&self, text: &str, remedy: &'static str) -> NrrdError {
        NrrdErrorKind::Unsupported { field: self.field, text: excerpt(text), remedy }.on(self.line)
    }

    /// Returns the words of the text, one for each of `count` axes.
    ///
    /// # Errors
    /// Fails when their number is not `count`.
    pub fn words(&self, count: usize) -> Result<Vec<&str>, NrrdError> {
        self.counted(self.text.split_whitespace(), count)
    }

    /// Returns the vectors and `none`s of the text, one for each of `count` axes, without their parentheses.
    ///
    /// # Errors
    /// Fails when their number is not `count`, or other text remains.
    pub fn vectors(&self, count: usize, wanted: &'static str) -> Result<Vec<&str>, NrrdError> {
        let mut rest = self.text.trim();
        let next = || {
            let (vector, after) = match rest.strip_prefix('(') {
                Some(inside) => inside.split_once(')')?,
                None => rest.split_at(rest.find([' ', '\t', '(']).unwrap_or(rest.len())),
            };
            let is_there = !rest.is_empty();
            rest = after.trim_start();
            is_there.then_some(vector)
        };
        let vectors = self.counted(std::iter::from_fn(next), count);
        match rest.is_empty() {
            true => vectors,
            false => Err(self.invalid(&self.text, wanted)),
        }
    }

    /// Returns the quoted strings of the text, one for each of `count` axes; escaped quotes are left as they are.
    ///
    /// # Errors
    /// Fails when their number is not `count`, or other text remains.
    pub fn quoted(&self, count: usize) -> Result<Vec<&str>, NrrdError> {
        let mut rest = self.text.trim();
        let next = || {
            let inside = rest.strip_prefix('"')?;
            let is_end = |(at, _): &(usize, &str)| !inside[..*at].ends_with('\\');
            let (end, _) = inside.match_indices('"').find(is_end)?;
            rest = inside[end + 1..].trim_start();
            Some(&inside[..end])
        };
        let strings = self.counted(std::iter::from_fn(next), count);
        match rest.is_empty() {
            true => strings,
            false => Err(self.invalid(&self.text, "strings in double quotes, as in \"mm\" \"mm\" \"mm\"")),
        }
    }

    /// Collects exactly `wanted` entries; keeps no more than that in memory, however many there are.
    fn counted<'a>(
        &self,
        mut entries: impl Iterator<Item = &'a str>,
        wanted: usize,
    ) -> Result<Vec<&'a str>, NrrdError> {
        let kept: Vec<&str> = entries.by_ref().take(wanted).collect();
        match kept.len() + entries.count() {
            found if found == wanted => Ok(kept),
            found => Err(NrrdErrorKind::Count { field: self.field, found, wanted }.on(self.line)),
        }
    }
}

/// Checks the first bytes before any line is read, so that a file of another kind is reported as such.
fn check_beginning(source: &mut ByteSource) -> Result<(), NrrdError> {
    let start = source.fill_buf().map_err(|error| NrrdErrorKind::Unreadable(error).in_whole())?;
    let after_magic = [start.get(8), start.get(9)];
    match start {
        [] => Err(NrrdErrorKind::Empty.in_whole()),
        _ if !start.starts_with(b"NRRD") => Err(NrrdErrorKind::NotNrrd.at_byte(0)),
        _ if after_magic[0] == Some(&b'\r') && after_magic[1] != Some(&b'\n') => Err(NrrdErrorKind::BareReturns.on(1)),
        _ => Ok(()),
    }
}

fn check_version(magic: &[u8]) -> Result<(), NrrdError> {
    match magic {
        b"NRRD0001" | b"NRRD0002" | b"NRRD0003" | b"NRRD0004" | b"NRRD0005" => Ok(()),
        _ => Err(NrrdErrorKind::Version(excerpt(&String::from_utf8_lossy(magic))).on(1)),
    }
}

/// Reads the next line without its line end; `None` at the end of the file.
fn next_line(lines: &mut Take<&mut ByteSource>, number: usize) -> Result<Option<Vec<u8>>, NrrdError> {
    let mut line = Vec::new();
    lines.read_until(b'\n', &mut line).map_err(|error| NrrdErrorKind::Unreadable(error).on(number))?;
    let is_whole = line.ends_with(b"\n");
    if !is_whole && lines.limit() == 0 {
        return Err(NrrdErrorKind::HeaderTooLong { bytes_max: BYTES_MAX }.on(number));
    }
    if line.is_empty() {
        return Ok(None);
    }
    for end in [b'\n', b'\r'] {
        if is_whole && line.last() == Some(&end) {
            line.pop();
        }
    }
    Ok(Some(line))
}

enum HeaderLine<'a> {
    Field(&'static str, &'a str),
    Key(String, String),
}

/// Distinguishes fields from keys. As in NrrdIO, a known field before `: ` takes precedence, so that a key may
/// contain colons.
fn parse_line(line: &str) -> Result<HeaderLine<'_>, NrrdErrorKind> {
    let as_field = line.split_once(": ").or_else(|| Some((line.strip_suffix(':')?, "")));
    if let Some((field, text)) = as_field.and_then(|(name, text)| Some((field_named(name)?, text))) {
        return Ok(HeaderLine::Field(field, text.trim()));
    }
    if let Some((key, value)) = line.split_once(":=") {
        return Ok(HeaderLine::Key(unescape(key), unescape(value)));
    }
    match as_field {
        Some((name, _)) => Err(NrrdErrorKind::UnknownField { name: excerpt(name), nearest: nearest_field(name) }),
        None => Err(NrrdErrorKind::NoSuchLine(excerpt(line))),
    }
}

/// Returns the field with a name, ignoring case.
pub(super) fn field_named(name: &str) -> Option<&'static str> {
    let names = FIELDS.iter().find(|names| names.iter().any(|known| known.eq_ignore_ascii_case(name)))?;
    Some(names[0])
}

fn nearest_field(name: &str) -> Option<&'static str> {
    /// Two typing errors; three would turn most field names into another word.
    const SLIPS_MAX: usize = 2;
    let name: String = name.chars().take(40).flat_map(char::to_lowercase).collect();
    let slips = |known: &str| strsim::damerau_levenshtein(known, &name);
    let nearest = FIELDS.iter().map(|names| names[0]).min_by_key(|known| slips(known))?;
    (slips(nearest) <= SLIPS_MAX).then_some(nearest)
}

/// Decodes `\n` as a line break and `\\` as a backslash; any other backslash stands for itself.
fn unescape(text: &str) -> String {
    let mut plain = String::with_capacity(text.len());
    let mut chars = text.chars();
    while let Some(c) = chars.next() {
        let escaped = match c {
            '\\' => chars.as_str().chars().next(),
            _ => None,
        };
        match escaped {
            Some('n') => plain.push('\n'),
            Some('\\') => plain.push('\\'),
            _ => plain.push(c),
        }
        if matches!(escaped, Some('n' | '\\')) {
            chars.next();
        }
    }
    plain
}

/// Encodes a text as the inverse of [`unescape`].
pub(super) fn escape(text: &str) -> String {
    text.replace('\\', "\\\\").replace('\n', "\\n")
}
