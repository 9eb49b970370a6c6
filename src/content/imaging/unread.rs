//! What can be wrong with a scan, said so that its owner can mend it.

use crate::content::nrrd;
use std::fmt;
use std::path::{Path, PathBuf};

/// Why a scan was not read: what we were at, what happened, what to do, and which file is at fault.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Unread {
    /// As in "reading a NIfTI volume".
    pub doing: &'static str,
    pub what: String,
    pub remedy: String,
    pub path: Option<PathBuf>,
}

impl Unread {
    pub fn new(doing: &'static str, what: impl Into<String>, remedy: impl Into<String>) -> Unread {
        Unread { doing, what: what.into(), remedy: remedy.into(), path: None }
    }

    /// Names the file, unless a more exact one is named already.
    pub fn in_file(mut self, path: &Path) -> Unread {
        self.path.get_or_insert_with(|| path.to_path_buf());
        self
    }

    /// What a shared part of the NRRD reader found, in another format's words.
    pub(super) fn of(doing: &'static str, error: nrrd::Error) -> Unread {
        use nrrd::Problem::{Gzip, NotAFile, Oblique, TooMuch, TooSmallForGzip, Truncated};
        let remedy = match error.problem {
            Truncated { .. } | TooSmallForGzip { .. } => {
                "copy or export the file again: its header promises more than there is".to_string()
            }
            TooMuch { .. } => "export the file again: there is more than its header promises".to_string(),
            Gzip(_) => "copy or export the file again".to_string(),
            NotAFile => "name the file itself".to_string(),
            Oblique { .. } => "give --resample MM, and it is laid anew along the axes of space".to_string(),
            ref problem => problem.remedy(),
        };
        let what = match error.place {
            nrrd::Place::Byte(byte) => format!("byte {byte}: {}", error.problem),
            nrrd::Place::Line(line) => format!("line {line}: {}", error.problem),
            nrrd::Place::Whole => error.problem.to_string(),
        };
        Unread { doing, what, remedy, path: error.path }
    }
}

impl fmt::Display for Unread {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Unread { doing, what, remedy, path } = self;
        write!(f, "{doing} — {what} — {remedy}")?;
        match path {
            // A file's name may hold anything; a terminal obeys control characters.
            Some(path) => write!(f, " — {}", plain(&path.to_string_lossy())),
            None => Ok(()),
        }
    }
}

/// A text out of a file, short enough for a line and harmless in a terminal.
pub(super) fn plain(text: &str) -> String {
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
