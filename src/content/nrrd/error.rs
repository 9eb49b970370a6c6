//! What can be wrong with a volume, said so that its owner can mend it.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

/// Why a volume was not read or written: what, where, and (through [`Problem::remedy`]) what to do about it.
#[derive(Debug)]
pub struct Error {
    /// What we were at, as in "reading an NRRD volume".
    pub doing: &'static str,
    pub problem: Problem,
    pub place: Place,
    /// The file at fault; the header's data file when the fault is in there.
    pub path: Option<PathBuf>,
}

/// Where in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// A line of the header, counted from 1.
    Line(usize),
    /// Bytes from the start of the file.
    Byte(u64),
    /// The file as a whole.
    Whole,
}

/// What is wrong. Texts taken from the file are shortened and free of control characters.
#[derive(Debug)]
pub enum Problem {
    /// The operating system would not give the file, or gave it up half-way.
    Unreadable(io::Error),
    /// A folder, a pipe, a device.
    NotAFile,
    Empty,
    /// The file does not begin as NRRD files do.
    NotNrrd,
    /// An NRRD of a version we have not heard of.
    Version(String),
    /// Lines that end with a carriage return and nothing else.
    BareReturns,
    HeaderTooLong {
        bytes_max: u64,
    },
    HeaderTooManyLines {
        lines_max: usize,
    },
    /// The file ends before the blank line that ends a header.
    HeaderCutOff,
    NotUtf8 {
        column: usize,
    },
    /// A line that is neither `field: text` nor `key:=value` nor a comment.
    NoSuchLine(String),
    UnknownField {
        name: String,
        nearest: Option<&'static str>,
    },
    /// A field, or a key with another value, stands twice.
    Twice {
        name: String,
        first_line: usize,
    },
    Missing(&'static str),
    /// A field whose text is not what the field holds.
    Value {
        field: &'static str,
        text: String,
        wanted: &'static str,
    },
    /// As many entries as axes were wanted.
    Count {
        field: &'static str,
        found: usize,
        wanted: usize,
    },
    /// Correct, but nothing we read.
    Unsupported {
        field: &'static str,
        text: String,
        remedy: &'static str,
    },
    /// Several values per voxel: overlapping segments, a series, colours.
    Layered {
        layers: u64,
    },
    TooLarge {
        axis: Option<usize>,
        voxels: u64,
    },
    Spacing {
        axis: usize,
        mm: f64,
    },
    /// `spacings` and `space directions` tell different stories.
    SpacingsDisagree {
        axis: usize,
        told: f64,
        length: f64,
    },
    Oblique {
        axis: usize,
        percent: f64,
    },
    /// Two axes of the array run along the same axis of space.
    Parallel {
        axes: [usize; 2],
    },
    Origin,
    /// The data file a header names is not one we open.
    DataFile {
        name: String,
        why: &'static str,
    },
    DataFileUnreadable {
        name: String,
        error: io::Error,
    },
    /// Fewer bytes than sizes and type demand.
    Truncated {
        found: u64,
        wanted: u64,
    },
    /// So small a compressed file cannot hold so much: nothing was inflated.
    TooSmallForGzip {
        compressed: u64,
        wanted: u64,
    },
    /// More than sizes and type demand; `extra` bytes follow where that is known.
    TooMuch {
        wanted: u64,
        extra: Option<u64>,
    },
    Gzip(String),
    /// A volume without the keys that make it a segmentation.
    NoSegments,
    /// A key of a segment that is missing or says nothing we understand.
    Segment {
        key: String,
        text: Option<String>,
        wanted: &'static str,
    },
    /// Two segments claim the same label value or the same id.
    SameSegment {
        what: &'static str,
        shared: String,
        segments: [usize; 2],
    },
    /// Voxels whose label no segment names.
    Unnamed {
        label: i64,
        voxel: [u32; 3],
    },
    NotLabels(&'static str),
    /// What was to be written could not be read back.
    Unwritable(String),
    /// The destination did not take the bytes.
    Unwritten(io::Error),
}

impl Error {
    pub(super) fn reading(problem: Problem, place: Place) -> Error {
        Error { doing: "reading an NRRD volume", problem, place, path: None }
    }

    pub(super) fn segmenting(problem: Problem) -> Error {
        Error { doing: "reading a segmentation", problem, place: Place::Whole, path: None }
    }

    pub(super) fn writing(problem: Problem) -> Error {
        Error { doing: "writing an NRRD volume", problem, place: Place::Whole, path: None }
    }

    /// Names the file, unless a more exact one is named already.
    pub(super) fn in_file(mut self, path: &Path) -> Error {
        self.path.get_or_insert_with(|| path.to_path_buf());
        self
    }
}

impl Problem {
    /// Pins the problem to a line of the header.
    pub(super) fn on(self, line: usize) -> Error {
        Error::reading(self, Place::Line(line))
    }

    pub(super) fn at_byte(self, byte: u64) -> Error {
        Error::reading(self, Place::Byte(byte))
    }

    pub(super) fn in_whole(self) -> Error {
        Error::reading(self, Place::Whole)
    }

    /// What the file's owner can do.
    pub fn remedy(&self) -> String {
        let text = match self {
            Problem::Unreadable(_) => "check that the file is there and that you may read it",
            Problem::NotAFile => "name the .nrrd or .nhdr file itself",
            Problem::Empty | Problem::HeaderCutOff => "copy or export the file again",
            Problem::NotNrrd => "export the volume as NRRD (3D Slicer: Save as .nrrd)",
            Problem::Version(_) => "re-save it as NRRD0005 or older",
            Problem::BareReturns => "re-save the header with LF or CR LF line ends",
            Problem::HeaderTooLong { .. } | Problem::HeaderTooManyLines { .. } => {
                "take the comments and keys out that nobody reads; a header needs about twenty lines"
            }
            Problem::NotUtf8 { .. } => "re-save the header as UTF-8 or plain ASCII",
            Problem::NoSuchLine(_) => "write `field: text` or `key:=value`, or begin the line with # for a comment",
            Problem::UnknownField { nearest: Some(nearest), .. } => {
                return format!("did you mean `{nearest}`? A remark of your own is written `key:=value`");
            }
            Problem::UnknownField { nearest: None, .. } => "a remark of your own is written `key:=value`",
            Problem::Twice { .. } => "leave the one that is right",
            Problem::Missing(field) => return missing_remedy(field),
            Problem::Value { wanted, .. } => return format!("it takes {wanted}"),
            Problem::Count { wanted, .. } => return format!("give {wanted}, one per axis"),
            Problem::Unsupported { remedy, .. } => remedy,
            Problem::Layered { .. } => {
                "export a single volume (3D Slicer: export the segmentation to a labelmap, or let no segments overlap)"
            }
            Problem::TooLarge { .. } => "crop the volume to the teeth, or save it at half the resolution",
            Problem::Spacing { .. } => "say how far voxels lie apart along each axis, 0.0001 to 1000 mm",
            Problem::SpacingsDisagree { .. } => "take the `spacings` line out if the directions are right",
            Problem::Oblique { .. } => {
                "resample it along the axes of space first (3D Slicer: Resample Scalar/Vector/DWI Volume)"
            }
            Problem::Parallel { .. } => "give each axis of the array a direction of its own",
            Problem::Origin => "give the centre of the first voxel in mm, as in (0,0,0)",
            Problem::DataFile { .. } | Problem::DataFileUnreadable { .. } => {
                "put the one data file beside the header and name it without any folder above"
            }
            Problem::Truncated { .. } | Problem::TooSmallForGzip { .. } => {
                "copy or export the file again, or correct `sizes` and `type`"
            }
            Problem::TooMuch { .. } => "correct `sizes` and `type`, or save the volume again",
            Problem::Gzip(_) => "copy or export the file again; if it is not compressed, write `encoding: raw`",
            Problem::NoSegments | Problem::NotLabels(_) => {
                "save it from 3D Slicer's Segment Editor as .seg.nrrd, or import it as a scan"
            }
            Problem::Segment { wanted, .. } => return format!("it takes {wanted}"),
            Problem::SameSegment { .. } => "give each segment its own",
            Problem::Unnamed { .. } => "add a segment for this label, or set its voxels to 0",
            Problem::Unwritable(_) => "correct it before saving",
            Problem::Unwritten(_) => "check that the disk has room and that you may write there",
        };
        text.to_string()
    }
}

fn missing_remedy(field: &str) -> String {
    let example = match field {
        "type" => "type: uint8",
        "dimension" => "dimension: 3",
        "sizes" => "sizes: 512 512 322",
        "encoding" => "encoding: raw",
        "endian" => "endian: little",
        "space" => "space: left-posterior-superior",
        "space directions" => "space directions: (0.2,0,0) (0,0.2,0) (0,0,0.2)",
        _ => "spacings: 0.2 0.2 0.2",
    };
    format!("add the line that is true of this volume, as in `{example}`")
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{} — ", self.doing)?;
        match self.place {
            Place::Line(line) => write!(f, "line {line}: ")?,
            Place::Byte(byte) => write!(f, "byte {byte}: ")?,
            Place::Whole => {}
        }
        write!(f, "{} — {}", self.problem, self.problem.remedy())?;
        match &self.path {
            Some(path) => write!(f, " — {}", plain(&path.to_string_lossy())),
            None => Ok(()),
        }
    }
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Problem::Unreadable(error) => write!(f, "the file cannot be read ({error})"),
            Problem::NotAFile => f.write_str("this is a folder or a device, not a file"),
            Problem::Empty => f.write_str("the file is empty"),
            Problem::NotNrrd => f.write_str("the file does not begin with NRRD0001 to NRRD0005"),
            Problem::Version(found) => write!(f, "\"{found}\" is no version we know"),
            Problem::BareReturns => f.write_str("the header's lines end with CR alone"),
            Problem::HeaderTooLong { bytes_max } => write!(f, "the header is longer than {bytes_max} bytes"),
            Problem::HeaderTooManyLines { lines_max } => write!(f, "the header has more than {lines_max} lines"),
            Problem::HeaderCutOff => f.write_str("the file ends before the blank line that ends a header"),
            Problem::NotUtf8 { column } => write!(f, "column {column} is not UTF-8 text"),
            Problem::NoSuchLine(text) => write!(f, "\"{text}\" is neither a field nor a key"),
            Problem::UnknownField { name, .. } => write!(f, "there is no field \"{name}\""),
            Problem::Twice { name, first_line } => write!(f, "`{name}` stands on line {first_line} already"),
            Problem::Missing(field) => write!(f, "the header has no `{field}`"),
            Problem::Value { field, text, .. } => write!(f, "`{field}` cannot be \"{text}\""),
            Problem::Count { field, found, wanted } => {
                write!(f, "`{field}` has {found} entries, but the volume has {wanted} axes")
            }
            Problem::Unsupported { field, text, .. } => write!(f, "`{field}: {text}` is not read here"),
            Problem::Layered { layers } => write!(f, "the volume holds {layers} values per voxel, not one"),
            Problem::TooLarge { axis: Some(axis), voxels } => {
                write!(f, "{voxels} voxels along axis {axis} are more than {}", super::AXIS_MAX)
            }
            Problem::TooLarge { axis: None, voxels } => {
                write!(f, "{voxels} voxels are more than {}", super::VOXELS_MAX)
            }
            Problem::Spacing { axis, mm } => write!(f, "the spacing along axis {axis} is {mm} mm"),
            Problem::SpacingsDisagree { axis, told, length } => {
                write!(f, "along axis {axis} the spacing is {told} mm, but the direction {length} mm long")
            }
            Problem::Oblique { axis, percent } => {
                write!(f, "axis {axis} is oblique: {percent:.1} % off the nearest axis of space")
            }
            Problem::Parallel { axes: [a, b] } => {
                write!(f, "axes {a} and {b} of the array run along the same direction")
            }
            Problem::Origin => f.write_str("the space origin is not a place within a kilometre"),
            Problem::DataFile { name, why } => write!(f, "the data file \"{name}\" {why}"),
            Problem::DataFileUnreadable { name, error } => {
                write!(f, "the data file \"{name}\" cannot be read ({error})")
            }
            Problem::Truncated { found, wanted } => {
                let missing = wanted.saturating_sub(*found);
                write!(f, "the data end after {found} of {wanted} bytes: {missing} missing")
            }
            Problem::TooSmallForGzip { compressed, wanted } => {
                write!(f, "{compressed} compressed bytes cannot hold the {wanted} that sizes and type demand")
            }
            Problem::TooMuch { wanted, extra: Some(extra) } => {
                write!(f, "{extra} bytes too many after the {wanted} that sizes and type demand")
            }
            Problem::TooMuch { wanted, extra: None } => {
                write!(f, "the data inflate to more than the {wanted} bytes that sizes and type demand")
            }
            Problem::Gzip(what) => write!(f, "the compressed data are damaged ({what})"),
            Problem::NoSegments => f.write_str("the volume names no segments (`Segment0_ID`)"),
            Problem::Segment { key, text: Some(text), .. } => write!(f, "the key `{key}` cannot be \"{text}\""),
            Problem::Segment { key, text: None, .. } => write!(f, "the key `{key}` is missing"),
            Problem::SameSegment { what, shared, segments: [a, b] } => {
                write!(f, "segments {a} and {b} share the {what} \"{shared}\"")
            }
            Problem::Unnamed { label, voxel: [x, y, z] } => {
                write!(f, "voxel ({x}, {y}, {z}) has label {label}, which no segment names")
            }
            Problem::NotLabels(kind) => write!(f, "the samples are {kind}, not labels from 0 to 255"),
            Problem::Unwritable(what) => f.write_str(what),
            Problem::Unwritten(error) => write!(f, "the bytes could not be written ({error})"),
        }
    }
}

impl std::error::Error for Error {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match &self.problem {
            Problem::Unreadable(error) | Problem::DataFileUnreadable { error, .. } | Problem::Unwritten(error) => {
                Some(error)
            }
            _ => None,
        }
    }
}

/// Text of a file as a complaint may show it: short and plain.
pub(super) fn excerpt(text: &str) -> String {
    /// Enough to recognise a line by.
    const CHARS_MAX: usize = 60;
    match text.char_indices().nth(CHARS_MAX) {
        Some((end, _)) => plain(&text[..end]) + "…",
        None => plain(text),
    }
}

/// Text without what would move a terminal's cursor or turn the direction of writing.
fn plain(text: &str) -> String {
    let is_plain = |c: char| !c.is_control() && !matches!(c, '\u{200b}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    let mut shown = String::with_capacity(text.len());
    for c in text.chars() {
        match is_plain(c) {
            true => shown.push(c),
            false => shown.extend(c.escape_unicode()),
        }
    }
    shown
}
