//! Errors about NRRD volumes, each with a remedy that the owner of the file can apply.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

/// An error while a volume was read or written: the problem, its location, and (through [`NrrdErrorKind::remedy`])
/// advice.
#[derive(Debug)]
pub struct NrrdError {
    /// Activity, as in "reading an NRRD volume".
    pub doing: &'static str,
    pub kind: NrrdErrorKind,
    pub location: ErrorLocation,
    /// File at fault; the data file if the fault is there and not in the header.
    pub path: Option<PathBuf>,
}

/// Location of a fault in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ErrorLocation {
    /// Line of the header, counted from 1.
    Line(usize),
    /// Offset from the start of the file, bytes.
    Byte(u64),
    /// The file as a whole.
    Whole,
}

/// Kind of problem. Texts quoted from the file are shortened and free of control characters.
#[derive(Debug)]
pub enum NrrdErrorKind {
    /// The operating system did not open the file, or failed while reading it.
    Unreadable(io::Error),
    /// The path leads to a folder, a pipe or a device.
    NotAFile,
    Empty,
    /// The file does not begin with the NRRD magic string.
    NotNrrd,
    /// The version of the format is unknown.
    Version(String),
    /// Lines end with a carriage return only.
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
    /// A line is neither `field: text` nor `key:=value` nor a comment.
    NoSuchLine(String),
    UnknownField {
        name: String,
        nearest: Option<&'static str>,
    },
    /// A field is present twice, or a key is present twice with different values.
    Twice {
        name: String,
        first_line: usize,
    },
    Missing(&'static str),
    /// The text of a field is not valid for the field.
    Value {
        field: &'static str,
        text: String,
        wanted: &'static str,
    },
    /// The number of entries differs from the number of axes.
    Count {
        field: &'static str,
        found: usize,
        wanted: usize,
    },
    /// Valid, but not supported.
    Unsupported {
        field: &'static str,
        text: String,
        remedy: &'static str,
    },
    /// Several values per voxel: overlapping segments, a series, or colours.
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
    /// `spacings` and `space directions` contradict each other.
    SpacingsDisagree {
        axis: usize,
        stated: f64,
        length: f64,
    },
    Oblique {
        axis: usize,
        percent: f64,
    },
    /// Two axes of the array are parallel to the same axis of space.
    Parallel {
        axes: [usize; 2],
    },
    Origin,
    /// The data file that a header names must not be opened.
    DataFile {
        name: String,
        why: &'static str,
    },
    DataFileUnreadable {
        name: String,
        error: io::Error,
    },
    /// The data have fewer bytes than `sizes` and `type` require.
    Truncated {
        found: u64,
        wanted: u64,
    },
    /// The compressed data are too small to contain the required bytes; nothing was inflated.
    TooSmallForGzip {
        compressed: u64,
        wanted: u64,
    },
    /// The data have more bytes than `sizes` and `type` require; `extra` is the excess, if known.
    TooMuch {
        wanted: u64,
        extra: Option<u64>,
    },
    Gzip(String),
    /// The volume has none of the keys of a segmentation.
    NoSegments,
    /// A key of a segment is missing or invalid.
    Segment {
        key: String,
        text: Option<String>,
        wanted: &'static str,
    },
    /// Two segments have the same label value or the same id.
    SameSegment {
        what: &'static str,
        shared: String,
        segments: [usize; 2],
    },
    /// A voxel has a label that no segment names.
    Unnamed {
        label: i64,
        voxel: [u32; 3],
    },
    NotLabels(&'static str),
    /// The volume could not be read back if it were written.
    Unwritable(String),
    /// Writing to the destination failed.
    Unwritten(io::Error),
}

impl NrrdError {
    pub(super) fn reading(kind: NrrdErrorKind, location: ErrorLocation) -> NrrdError {
        NrrdError { doing: "reading an NRRD volume", kind, location, path: None }
    }

    pub(super) fn segmenting(kind: NrrdErrorKind) -> NrrdError {
        NrrdError { doing: "reading a segmentation", kind, location: ErrorLocation::Whole, path: None }
    }

    pub(super) fn writing(kind: NrrdErrorKind) -> NrrdError {
        NrrdError { doing: "writing an NRRD volume", kind, location: ErrorLocation::Whole, path: None }
    }

    /// Sets the path of the file, unless a more specific one is already set.
    pub(super) fn in_file(mut self, path: &Path) -> NrrdError {
        self.path.get_or_insert_with(|| path.to_path_buf());
        self
    }
}

impl NrrdErrorKind {
    /// Locates the problem at a line of the header.
    pub(super) fn on(self, line: usize) -> NrrdError {
        NrrdError::reading(self, ErrorLocation::Line(line))
    }

    pub(super) fn at_byte(self, byte: u64) -> NrrdError {
        NrrdError::reading(self, ErrorLocation::Byte(byte))
    }

    pub(super) fn in_whole(self) -> NrrdError {
        NrrdError::reading(self, ErrorLocation::Whole)
    }

    /// Returns advice for the owner of the file.
    pub fn remedy(&self) -> String {
        let text = match self {
            NrrdErrorKind::Unreadable(_) => "check that the file is there and that you may read it",
            NrrdErrorKind::NotAFile => "name the .nrrd or .nhdr file itself",
            NrrdErrorKind::Empty | NrrdErrorKind::HeaderCutOff => "copy or export the file again",
            NrrdErrorKind::NotNrrd => "export the volume as NRRD (3D Slicer: Save as .nrrd)",
            NrrdErrorKind::Version(_) => "re-save it as NRRD0005 or older",
            NrrdErrorKind::BareReturns => "re-save the header with LF or CR LF line ends",
            NrrdErrorKind::HeaderTooLong { .. } | NrrdErrorKind::HeaderTooManyLines { .. } => {
                "remove unused comments and keys; a header needs about twenty lines"
            }
            NrrdErrorKind::NotUtf8 { .. } => "re-save the header as UTF-8 or plain ASCII",
            NrrdErrorKind::NoSuchLine(_) => {
                "write `field: text` or `key:=value`, or begin the line with # for a comment"
            }
            NrrdErrorKind::UnknownField { nearest: Some(nearest), .. } => {
                return format!("did you mean `{nearest}`? A custom entry is written `key:=value`");
            }
            NrrdErrorKind::UnknownField { nearest: None, .. } => "a custom entry is written `key:=value`",
            NrrdErrorKind::Twice { .. } => "keep only the correct one",
            NrrdErrorKind::Missing(field) => return missing_remedy(field),
            NrrdErrorKind::Value { wanted, .. } => return format!("expected {wanted}"),
            NrrdErrorKind::Count { wanted, .. } => return format!("give {wanted}, one per axis"),
            NrrdErrorKind::Unsupported { remedy, .. } => remedy,
            NrrdErrorKind::Layered { .. } => {
                "export a single volume (3D Slicer: export the segmentation to a labelmap, or let no segments overlap)"
            }
            NrrdErrorKind::TooLarge { .. } => "crop the volume to the teeth, or save it at half the resolution",
            NrrdErrorKind::Spacing { .. } => "give the distance between voxels along each axis, 0.0001 to 1000 mm",
            NrrdErrorKind::SpacingsDisagree { .. } => "remove the `spacings` line if the directions are right",
            NrrdErrorKind::Oblique { .. } => {
                "resample it along the axes of space first (3D Slicer: Resample Scalar/Vector/DWI Volume)"
            }
            NrrdErrorKind::Parallel { .. } => "give each axis of the array a different direction",
            NrrdErrorKind::Origin => "give the centre of the first voxel in mm, as in (0,0,0)",
            NrrdErrorKind::DataFile { .. } | NrrdErrorKind::DataFileUnreadable { .. } => {
                "put the single data file beside the header and name it without a parent folder"
            }
            NrrdErrorKind::Truncated { .. } | NrrdErrorKind::TooSmallForGzip { .. } => {
                "copy or export the file again, or correct `sizes` and `type`"
            }
            NrrdErrorKind::TooMuch { .. } => "correct `sizes` and `type`, or save the volume again",
            NrrdErrorKind::Gzip(_) => "copy or export the file again; if it is not compressed, write `encoding: raw`",
            NrrdErrorKind::NoSegments | NrrdErrorKind::NotLabels(_) => {
                "save it from 3D Slicer's Segment Editor as .seg.nrrd, or import it as a scan"
            }
            NrrdErrorKind::Segment { wanted, .. } => return format!("expected {wanted}"),
            NrrdErrorKind::SameSegment { .. } => "give each segment a different one",
            NrrdErrorKind::Unnamed { .. } => "add a segment for this label, or set its voxels to 0",
            NrrdErrorKind::Unwritable(_) => "correct it before saving",
            NrrdErrorKind::Unwritten(_) => "check that the disk has free space and that you may write there",
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
    format!("add the line with the true value of this volume, as in `{example}`")
}

impl fmt::Display for NrrdError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{} — ", self.doing)?;
        match self.location {
            ErrorLocation::Line(line) => write!(f, "line {line}: ")?,
            ErrorLocation::Byte(byte) => write!(f, "byte {byte}: ")?,
            ErrorLocation::Whole => {}
        }
        write!(f, "{} — {}", self.kind, self.kind.remedy())?;
        match &self.path {
            Some(path) => write!(f, " — {}", sanitized(&path.to_string_lossy())),
            None => Ok(()),
        }
    }
}

impl fmt::Display for NrrdErrorKind {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            NrrdErrorKind::Unreadable(error) => write!(f, "the file cannot be read ({error})"),
            NrrdErrorKind::NotAFile => f.write_str("this is a folder or a device, not a file"),
            NrrdErrorKind::Empty => f.write_str("the file is empty"),
            NrrdErrorKind::NotNrrd => f.write_str("the file does not begin with NRRD0001 to NRRD0005"),
            NrrdErrorKind::Version(found) => write!(f, "\"{found}\" is not a known version"),
            NrrdErrorKind::BareReturns => f.write_str("the header's lines end with CR alone"),
            NrrdErrorKind::HeaderTooLong { bytes_max } => write!(f, "the header is longer than {bytes_max} bytes"),
            NrrdErrorKind::HeaderTooManyLines { lines_max } => write!(f, "the header has more than {lines_max} lines"),
            NrrdErrorKind::HeaderCutOff => f.write_str("the file ends before the blank line that ends a header"),
            NrrdErrorKind::NotUtf8 { column } => write!(f, "column {column} is not UTF-8 text"),
            NrrdErrorKind::NoSuchLine(text) => write!(f, "\"{text}\" is neither a field nor a key"),
            NrrdErrorKind::UnknownField { name, .. } => write!(f, "there is no field \"{name}\""),
            NrrdErrorKind::Twice { name, first_line } => write!(f, "`{name}` is already present on line {first_line}"),
            NrrdErrorKind::Missing(field) => write!(f, "the header has no `{field}`"),
            NrrdErrorKind::Value { field, text, .. } => write!(f, "`{field}` cannot be \"{text}\""),
            NrrdErrorKind::Count { field, found, wanted } => {
                write!(f, "`{field}` has {found} entries, but the volume has {wanted} axes")
            }
            NrrdErrorKind::Unsupported { field, text, .. } => write!(f, "`{field}: {text}` is not supported"),
            NrrdErrorKind::Layered { layers } => write!(f, "the volume contains {layers} values per voxel, not one"),
            NrrdErrorKind::TooLarge { axis: Some(axis), voxels } => {
                write!(f, "{voxels} voxels along axis {axis} are more than {}", crate::limits::AXIS_MAX)
            }
            NrrdErrorKind::TooLarge { axis: None, voxels } => {
                write!(f, "{voxels} voxels are more than {}", crate::limits::VOXELS_MAX)
            }
            NrrdErrorKind::Spacing { axis, mm } => write!(f, "the spacing along axis {axis} is {mm} mm"),
            NrrdErrorKind::SpacingsDisagree { axis, stated, length } => {
                write!(f, "along axis {axis} the spacing is {stated} mm, but the direction is {length} mm long")
            }
            NrrdErrorKind::Oblique { axis, percent } => {
                write!(f, "axis {axis} is oblique: {percent:.1} % away from the nearest axis of space")
            }
            NrrdErrorKind::Parallel { axes: [a, b] } => {
                write!(f, "axes {a} and {b} of the array run along the same direction")
            }
            NrrdErrorKind::Origin => f.write_str("the space origin is not a position within one kilometre"),
            NrrdErrorKind::DataFile { name, why } => write!(f, "the data file \"{name}\" {why}"),
            NrrdErrorKind::DataFileUnreadable { name, error } => {
                write!(f, "the data file \"{name}\" cannot be read ({error})")
            }
            NrrdErrorKind::Truncated { found, wanted } => {
                let missing = wanted.saturating_sub(*found);
                write!(f, "the data end after {found} of {wanted} bytes: {missing} missing")
            }
            NrrdErrorKind::TooSmallForGzip { compressed, wanted } => {
                write!(f, "{compressed} compressed bytes cannot contain the {wanted} that sizes and type require")
            }
            NrrdErrorKind::TooMuch { wanted, extra: Some(extra) } => {
                write!(f, "{extra} bytes too many after the {wanted} that sizes and type require")
            }
            NrrdErrorKind::TooMuch { wanted, extra: None } => {
                write!(f, "the data inflate to more than the {wanted} bytes that sizes and type require")
            }
            NrrdErrorKind::Gzip(what) => write!(f, "the compressed data are damaged ({what})"),
            NrrdErrorKind::NoSegments => f.write_str("the volume names no segments (`Segment0_ID`)"),
            NrrdErrorKind::Segment { key, text: Some(text), .. } => write!(f, "the key `{key}` cannot be \"{text}\""),
            NrrdErrorKind::Segment { key, text: None, .. } => write!(f, "the key `{key}` is missing"),
            NrrdErrorKind::SameSegment { what, shared, segments: [a, b] } => {
                write!(f, "segments {a} and {b} share the {what} \"{shared}\"")
            }
            NrrdErrorKind::Unnamed { label, voxel: [x, y, z] } => {
                write!(f, "voxel ({x}, {y}, {z}) has label {label}, which no segment names")
            }
            NrrdErrorKind::NotLabels(kind) => write!(f, "the samples are {kind}, not labels from 0 to 255"),
            NrrdErrorKind::Unwritable(what) => f.write_str(what),
            NrrdErrorKind::Unwritten(error) => write!(f, "the bytes could not be written ({error})"),
        }
    }
}

impl std::error::Error for NrrdError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match &self.kind {
            NrrdErrorKind::Unreadable(error)
            | NrrdErrorKind::DataFileUnreadable { error, .. }
            | NrrdErrorKind::Unwritten(error) => Some(error),
            _ => None,
        }
    }
}

/// Shortens and sanitizes a text from the file for a message.
pub(super) fn excerpt(text: &str) -> String {
    /// Enough to recognize a line.
    const CHARS_MAX: usize = 60;
    match text.char_indices().nth(CHARS_MAX) {
        Some((end, _)) => sanitized(&text[..end]) + "…",
        None => sanitized(text),
    }
}

/// Escapes characters that move a terminal's cursor or change the writing direction.
fn sanitized(text: &str) -> String {
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
