//! The lines of a header, told apart but not yet understood.

use super::error::{Error, Problem, excerpt};
use super::source::Source;
use std::collections::BTreeMap;
use std::io::{BufRead, Read, Take};

/// Longest header, bytes. A segmentation of two hundred structures with all of Slicer's keys has a tenth of it.
pub(super) const BYTES_MAX: u64 = 1 << 20;

/// Most lines of a header, by the same measure.
pub(super) const LINES_MAX: usize = 1 << 14;

/// The fields of the format, each under the name we call it by and the others it goes by.
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
    // What follows is known, and of no use to us.
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

/// What a field says, and where.
pub(super) struct Entry {
    pub field: &'static str,
    pub text: String,
    pub line: usize,
}

pub(super) struct Header {
    fields: BTreeMap<&'static str, Entry>,
    pub keys: Vec<(String, String)>,
}

impl Header {
    /// Reads up to and including the blank line. Only a header that names a data file may end without one.
    pub fn read(source: &mut Source) -> Result<Header, Error> {
        check_beginning(source)?;
        let mut header = Header { fields: BTreeMap::new(), keys: Vec::new() };
        let mut seen = BTreeMap::new();
        let mut lines = source.take(BYTES_MAX);
        let magic = next_line(&mut lines, 1)?.unwrap_or_default();
        check_version(&magic)?;
        for number in 2..=LINES_MAX {
            let Some(line) = next_line(&mut lines, number)? else {
                return match header.fields.contains_key("data file") {
                    true => Ok(header),
                    false => Err(Problem::HeaderCutOff.on(number)),
                };
            };
            if line.is_empty() {
                return Ok(header);
            }
            // A comment may be in any encoding: nobody reads it.
            if !line.starts_with(b"#") {
                let text = std::str::from_utf8(&line)
                    .map_err(|error| Problem::NotUtf8 { column: error.valid_up_to() + 1 }.on(number))?;
                header.add(text, number, &mut seen).map_err(|problem| problem.on(number))?;
            }
        }
        Err(Problem::HeaderTooManyLines { lines_max: LINES_MAX }.on(LINES_MAX))
    }

    pub fn get(&self, field: &'static str) -> Option<&Entry> {
        debug_assert!(FIELDS.iter().any(|names| names[0] == field), "{field} is in the table");
        self.fields.get(field)
    }

    pub fn need(&self, field: &'static str) -> Result<&Entry, Error> {
        self.get(field).ok_or_else(|| Problem::Missing(field).in_whole())
    }

    /// Files a line away. `seen` knows where each key stands: its line, and its place among the keys.
    fn add(&mut self, line: &str, number: usize, seen: &mut BTreeMap<String, [usize; 2]>) -> Result<(), Problem> {
        match parse_line(line)? {
            Line::Field(field, text) => match self.fields.get(field) {
                Some(first) => return Err(Problem::Twice { name: field.to_string(), first_line: first.line }),
                None => {
                    self.fields.insert(field, Entry { field, text: text.to_string(), line: number });
                }
            },
            Line::Key(key, value) => match seen.get(&key) {
                None => {
                    seen.insert(key.clone(), [number, self.keys.len()]);
                    self.keys.push((key, value));
                }
                Some(&[_, index]) if self.keys[index].1 == value => {}
                Some(&[first_line, _]) => return Err(Problem::Twice { name: excerpt(&key), first_line }),
            },
        }
        Ok(())
    }
}

impl Entry {
    /// The text is not what the field holds.
    pub fn cannot_be(&self, text: &str, wanted: &'static str) -> Error {
        Problem::Value { field: self.field, text: excerpt(text), wanted }.on(self.line)
    }

    pub fn not_read_here(&self, text: &str, remedy: &'static str) -> Error {
        Problem::Unsupported { field: self.field, text: excerpt(text), remedy }.on(self.line)
    }

    /// The text's words, one for each of `count` axes.
    pub fn words(&self, count: usize) -> Result<Vec<&str>, Error> {
        self.counted(self.text.split_whitespace(), count)
    }

    /// The text's vectors and `none`s, one for each of `count` axes, without their parentheses.
    pub fn vectors(&self, count: usize, wanted: &'static str) -> Result<Vec<&str>, Error> {
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
            false => Err(self.cannot_be(&self.text, wanted)),
        }
    }

    /// The text's quoted strings, one for each of `count` axes, escaped quotes left as they are.
    pub fn quoted(&self, count: usize) -> Result<Vec<&str>, Error> {
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
            false => Err(self.cannot_be(&self.text, "texts in double quotes, as in \"mm\" \"mm\" \"mm\"")),
        }
    }

    /// Keeps no more entries than are wanted, however many there are.
    fn counted<'a>(&self, mut entries: impl Iterator<Item = &'a str>, wanted: usize) -> Result<Vec<&'a str>, Error> {
        let kept: Vec<&str> = entries.by_ref().take(wanted).collect();
        match kept.len() + entries.count() {
            found if found == wanted => Ok(kept),
            found => Err(Problem::Count { field: self.field, found, wanted }.on(self.line)),
        }
    }
}

/// Looks at the first bytes before any line is read, so that noise is called noise.
fn check_beginning(source: &mut Source) -> Result<(), Error> {
    let start = source.fill_buf().map_err(|error| Problem::Unreadable(error).in_whole())?;
    let after_magic = [start.get(8), start.get(9)];
    match start {
        [] => Err(Problem::Empty.in_whole()),
        _ if !start.starts_with(b"NRRD") => Err(Problem::NotNrrd.at_byte(0)),
        _ if after_magic[0] == Some(&b'\r') && after_magic[1] != Some(&b'\n') => Err(Problem::BareReturns.on(1)),
        _ => Ok(()),
    }
}

fn check_version(magic: &[u8]) -> Result<(), Error> {
    match magic {
        b"NRRD0001" | b"NRRD0002" | b"NRRD0003" | b"NRRD0004" | b"NRRD0005" => Ok(()),
        _ => Err(Problem::Version(excerpt(&String::from_utf8_lossy(magic))).on(1)),
    }
}

/// The next line without its end; `None` where the file ends.
fn next_line(lines: &mut Take<&mut Source>, number: usize) -> Result<Option<Vec<u8>>, Error> {
    let mut line = Vec::new();
    lines.read_until(b'\n', &mut line).map_err(|error| Problem::Unreadable(error).on(number))?;
    let is_whole = line.ends_with(b"\n");
    if !is_whole && lines.limit() == 0 {
        return Err(Problem::HeaderTooLong { bytes_max: BYTES_MAX }.on(number));
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

enum Line<'a> {
    Field(&'static str, &'a str),
    Key(String, String),
}

/// Tells a field from a key. As in NrrdIO, a known field before `: ` comes first, so that a key may hold colons.
fn parse_line(line: &str) -> Result<Line<'_>, Problem> {
    let as_field = line.split_once(": ").or_else(|| Some((line.strip_suffix(':')?, "")));
    if let Some((field, text)) = as_field.and_then(|(name, text)| Some((field_named(name)?, text))) {
        return Ok(Line::Field(field, text.trim()));
    }
    if let Some((key, value)) = line.split_once(":=") {
        return Ok(Line::Key(unescape(key), unescape(value)));
    }
    match as_field {
        Some((name, _)) => Err(Problem::UnknownField { name: excerpt(name), nearest: nearest_field(name) }),
        None => Err(Problem::NoSuchLine(excerpt(line))),
    }
}

/// The field of that name, in whatever case.
pub(super) fn field_named(name: &str) -> Option<&'static str> {
    let names = FIELDS.iter().find(|names| names.iter().any(|known| known.eq_ignore_ascii_case(name)))?;
    Some(names[0])
}

fn nearest_field(name: &str) -> Option<&'static str> {
    /// Two slips of the finger; three make another word of most fields.
    const SLIPS_MAX: usize = 2;
    let name: String = name.chars().take(40).flat_map(char::to_lowercase).collect();
    let slips = |known: &str| strsim::damerau_levenshtein(known, &name);
    let nearest = FIELDS.iter().map(|names| names[0]).min_by_key(|known| slips(known))?;
    (slips(nearest) <= SLIPS_MAX).then_some(nearest)
}

/// `\n` is a line break and `\\` a backslash; any other backslash stands for itself.
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

/// The reverse of [`unescape`].
pub(super) fn escape(text: &str) -> String {
    text.replace('\\', "\\\\").replace('\n', "\\n")
}
