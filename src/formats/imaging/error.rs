//! Errors about scans, each with a remedy that the owner of the file can apply.

use crate::nrrd;
use std::fmt;
use std::path::{Path, PathBuf};

/// An error while a scan was read: the activity, the problem, the remedy, and the file at fault.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ScanError {
    /// Activity, as in "reading a NIfTI volume".
    pub doing: &'static str,
    /// Problem.
    pub what: String,
    /// Advice for the owner of the file.
    pub remedy: String,
    pub path: Option<PathBuf>,
}

impl ScanError {
    pub fn new(doing: &'static str, what: impl Into<String>, remedy: impl Into<String>) -> ScanError {
        ScanError { doing, what: what.into(), remedy: remedy.into(), path: None }
    }

    /// Sets the path of the file, unless a more specific one is already set.
    pub fn in_file(mut self, path: &Path) -> ScanError {
        self.path.get_or_insert_with(|| path.to_path_buf());
        self
    }

    /// Converts an error of the shared NRRD code, with a remedy that fits another format.
    pub(super) fn from_nrrd(doing: &'static str, error: nrrd::NrrdError) -> ScanError {
        use nrrd::NrrdErrorKind::{Gzip, NotAFile, Oblique, TooMuch, TooSmallForGzip, Truncated};
        let remedy = match error.kind {
            Truncated { .. } | TooSmallForGzip { .. } => {
                "copy or export the file again: its header declares more data than it contains".to_string()
            }
            TooMuch { .. } => "export the file again: it contains more data than its header declares".to_string(),
            Gzip(_) => "copy or export the file again".to_string(),
            NotAFile => "name the file itself".to_string(),
            Oblique { .. } => "give --resample MM to resample it along the axes of space".to_string(),
            ref problem => problem.remedy(),
        };
        let what = match error.location {
            nrrd::ErrorLocation::Byte(byte) => format!("byte {byte}: {}", error.kind),
            nrrd::ErrorLocation::Line(line) => format!("line {line}: {}", error.kind),
            nrrd::ErrorLocation::Whole => error.kind.to_string(),
        };
        ScanError { doing, what, remedy, path: error.path }
    }
}

impl fmt::Display for ScanError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let ScanError { doing, what, remedy, path } = self;
        write!(f, "{doing} — {what} — {remedy}")?;
        match path {
            // A file name may contain control characters, which a terminal would obey.
            Some(path) => write!(f, " — {}", sanitized_excerpt(&path.to_string_lossy())),
            None => Ok(()),
        }
    }
}

impl std::error::Error for ScanError {}

/// Makes a text from a file short enough for one line and harmless in a terminal.
pub(super) fn sanitized_excerpt(text: &str) -> String {
    const MOST: usize = 120;
    let harmless = |c: char| match c {
        c if c.is_control() || ('\u{202a}'..='\u{202e}').contains(&c) || ('\u{2066}'..='\u{2069}').contains(&c) => '·',
        c => c,
    };
    let mut plain: String = text.chars().take(MOST).map(harmless).collect();
    if text.chars().count() > MOST {
        plain.push('…');
    }
    plain
}
