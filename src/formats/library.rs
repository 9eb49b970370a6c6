//! The files of a session, by name: shipped with the program, from a folder, or from a recording.

use crate::diagnostic::{Diagnostic, SourceText};
use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::io::ErrorKind;
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

/// Maximum size of a file that is read into memory, bytes: one and a half times a scan of 512×512×512 voxels of 16
/// bits.
const FILE_MAX: u64 = 400 << 20;

/// Source of files: those in memory, such as the shipped tables, and then folders on disk.
#[derive(Clone, Debug, Default)]
pub struct Library {
    /// Files in memory, by name; they take precedence over folders.
    in_memory: BTreeMap<String, Arc<[u8]>>,
    /// Folders that names are relative to, searched in order.
    folders: Vec<PathBuf>,
}

/// Tables that are shipped with the program.
const SHIPPED: &[(&str, &str)] = &[
    ("content/tissues.json", include_str!("../../content/tissues.json")),
    ("content/instruments.json", include_str!("../../content/instruments.json")),
    ("content/touch.json", include_str!("../../content/touch.json")),
    ("content/operators/careful.json", include_str!("../../content/operators/careful.json")),
    ("content/operators/expert.json", include_str!("../../content/operators/expert.json")),
    ("content/operators/guess.json", include_str!("../../content/operators/guess.json")),
    ("content/operators/hasty.json", include_str!("../../content/operators/hasty.json")),
    ("content/operators/timid.json", include_str!("../../content/operators/timid.json")),
    ("content/questionnaires/simulator.json", include_str!("../../content/questionnaires/simulator.json")),
];

impl Library {
    /// Creates a library of the shipped files only.
    pub fn shipped() -> Library {
        let in_memory = SHIPPED.iter().map(|(name, text)| (name.to_string(), Arc::from(text.as_bytes()))).collect();
        Library { in_memory, folders: Vec::new() }
    }

    /// Creates an empty library, for example to be filled from a recording.
    pub fn empty() -> Library {
        Library::default()
    }

    /// Adds a folder, which is searched for every file that is not in memory.
    pub fn with_folder(mut self, folder: impl Into<PathBuf>) -> Library {
        self.folders.push(folder.into());
        self
    }

    /// Adds a file to memory and replaces any file of the same name there.
    pub fn insert(&mut self, name: impl Into<String>, bytes: impl Into<Arc<[u8]>>) {
        self.in_memory.insert(name.into(), bytes.into());
    }

    /// Returns every file in memory, ordered by name.
    pub fn files_in_memory(&self) -> impl Iterator<Item = (&str, &[u8])> {
        self.in_memory.iter().map(|(name, bytes)| (name.as_str(), bytes.as_ref()))
    }

    /// Returns the bytes of a file. The name is relative and must not lead out of the folder.
    ///
    /// # Errors
    /// Fails when the name leads out of the folder, or when the file is missing, unreadable or too large.
    pub fn bytes(&self, name: &str) -> Result<Arc<[u8]>, Diagnostic> {
        if let Some(bytes) = self.in_memory.get(name) {
            return Ok(bytes.clone());
        }
        let is_inside = Path::new(name).components().all(|c| matches!(c, Component::Normal(_) | Component::CurDir));
        if !is_inside {
            let help = "give a path below the folder of the file that names it".to_string();
            return Err(Diagnostic::about_file(name, "outside-folder", "the path is outside the folder", Some(help)));
        }
        for folder in &self.folders {
            let path = folder.join(name);
            if path.is_file() {
                require_inside(&path, folder, name)?;
                return read_file(&path).map(Arc::from);
            }
        }
        let looked = self.folders.iter().map(|f| f.display().to_string()).collect::<Vec<_>>().join(", ");
        let help = if looked.is_empty() { None } else { Some(format!("looked in: {looked}")) };
        Err(Diagnostic::about_file(name, "missing-file", "the file does not exist", help))
    }

    /// Returns a file as text.
    ///
    /// # Errors
    /// Fails like [`Library::bytes`], or when the file is not UTF-8.
    pub fn text(&self, name: &str) -> Result<Arc<SourceText>, Diagnostic> {
        decode_text(name, self.bytes(name)?.to_vec())
    }
}

/// Fails when a symbolic link leads a file out of its folder: an exercise from somebody else could otherwise name any
/// file of the computer, and a complaint would quote it.
fn require_inside(path: &Path, folder: &Path, name: &str) -> Result<(), Diagnostic> {
    let resolved = |path: &Path| {
        fs::canonicalize(path).map_err(|error| {
            Diagnostic::about_file(name, "unreadable-file", format!("the file cannot be read: {error}"), None)
        })
    };
    // The folder itself may be a link.
    let folder = resolved(if folder.as_os_str().is_empty() { Path::new(".") } else { folder })?;
    if resolved(path)?.starts_with(folder) {
        return Ok(());
    }
    let help = "copy the file itself into the folder".to_string();
    let message = "the file is a symbolic link that leads out of the folder";
    Err(Diagnostic::about_file(name, "outside-folder", message, Some(help)))
}

/// Reads a file that the user named; the path is relative to the current folder and may lead anywhere on disk.
///
/// # Errors
/// Fails when the path does not lead to a readable file, or when the file is too large.
pub fn read_file(path: &Path) -> Result<Vec<u8>, Diagnostic> {
    let name = path.display().to_string();
    let refused = |what: String| Diagnostic::about_file(&name, "unreadable-file", what, None);
    let meta = fs::metadata(path).map_err(|error| refused(format!("the file cannot be read: {error}")))?;
    if !meta.is_file() {
        return Err(refused("this is not a file".into()));
    }
    if meta.len() > FILE_MAX {
        return Err(refused(format!(
            "the file has {} MiB, and the maximum is {} MiB",
            meta.len() >> 20,
            FILE_MAX >> 20
        )));
    }
    fs::read(path).map_err(|error| refused(format!("the file cannot be read: {error}")))
}

/// Returns the reason for which a file could not be written, in words that name what to do about it.
pub fn write_failure(error: &io::Error) -> String {
    let cause = match error.kind() {
        ErrorKind::StorageFull => "the disk is full",
        ErrorKind::QuotaExceeded => "the disk quota of this account is used up",
        ErrorKind::FileTooLarge => "the file has reached the size limit for files (see `ulimit -f`)",
        ErrorKind::ReadOnlyFilesystem => "the disk is read-only",
        _ => return error.to_string(),
    };
    format!("{cause} ({error})")
}

/// Reads a text file that the user named.
///
/// # Errors
/// Fails like [`read_file`], or when the file is not UTF-8.
pub fn read_text(path: &Path) -> Result<Arc<SourceText>, Diagnostic> {
    decode_text(&path.display().to_string(), read_file(path)?)
}

/// Decodes bytes as UTF-8 text and strips a byte order mark.
///
/// # Errors
/// Fails when the bytes are not UTF-8.
pub fn decode_text(name: &str, bytes: Vec<u8>) -> Result<Arc<SourceText>, Diagnostic> {
    const MARK: char = '\u{feff}';
    let error = match String::from_utf8(bytes) {
        Ok(text) => return Ok(SourceText::new(name, text.strip_prefix(MARK).unwrap_or(&text))),
        Err(error) => error,
    };
    let (at, bytes) = (error.utf8_error().valid_up_to(), error.as_bytes());
    let wrong = bytes[at];
    // The text up to the end of the line shows the place; the rest may be hundreds of megabytes of something else.
    let end = bytes[at..].iter().take(LINE_REST_MAX).position(|b| *b == b'\n');
    let until = end.map_or(bytes.len().min(at + LINE_REST_MAX), |line_end| at + line_end);
    let shown = String::from_utf8_lossy(&bytes[..until]);
    let text = shown.strip_prefix(MARK).unwrap_or(&shown);
    let start = at - (shown.len() - text.len());
    Err(Diagnostic {
        code: "not-text",
        source: SourceText::new(name, text),
        span: Some(start..start + char::REPLACEMENT_CHARACTER.len_utf8()),
        path: String::new(),
        message: format!("the byte 0x{wrong:02X} is not UTF-8 text"),
        help: Some("save the file as UTF-8".to_string()),
    })
}

/// Maximum length of the shown rest of a line that is not UTF-8, bytes.
const LINE_REST_MAX: usize = 80;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_byte_that_is_not_text_is_named_by_line_and_column() {
        // Aim: an author finds the letter that an old editor saved as Latin-1. Method: the wrong byte in the second
        // line, after letters of two bytes, with and without a byte order mark; and as the last byte of the file.
        for mark in ["", "\u{feff}"] {
            let bytes = [mark.as_bytes(), "{\n  \"öü".as_bytes(), b"\xe9\"\n}"].concat();
            let found = decode_text("a.json", bytes).unwrap_err();
            assert_eq!(found.headline(), "a.json:2:6: not-text: the byte 0xE9 is not UTF-8 text");
            assert!(found.to_string().contains("2 |   \"öü"), "{found}");
        }
        let found = decode_text("a.json", b"\xff".to_vec()).unwrap_err();
        assert_eq!(found.line_and_column(), Some((1, 1)));
        let found = decode_text("a.json", vec![0xff; 10_000_000]).unwrap_err();
        assert!(found.source.text.len() < 1000, "{}", found.source.text.len());
    }

    #[cfg(unix)]
    #[test]
    fn a_link_out_of_the_folder_is_refused() {
        // Aim: an exercise from somebody else reads no file of the computer. Method: links to a file outside and to a
        // folder outside; a link within the folder, and the same folder through a link, are read.
        use std::os::unix::fs::symlink;
        let folder = std::env::temp_dir().join(format!("typodont-links-{}", std::process::id()));
        let _ = fs::remove_dir_all(&folder);
        let own = folder.join("own");
        fs::create_dir_all(&own).unwrap();
        fs::create_dir_all(folder.join("other")).unwrap();
        fs::write(folder.join("other/secret.csv"), "root:x:0:0\n").unwrap();
        fs::write(own.join("path.csv"), "x\n").unwrap();
        symlink(folder.join("other/secret.csv"), own.join("link.csv")).unwrap();
        symlink(folder.join("other"), own.join("linked")).unwrap();
        symlink("path.csv", own.join("inside.csv")).unwrap();
        symlink(&own, folder.join("same")).unwrap();
        for root in [&own, &folder.join("same")] {
            let library = Library::empty().with_folder(root);
            for name in ["link.csv", "linked/secret.csv"] {
                let found = library.text(name).unwrap_err();
                assert_eq!(found.code, "outside-folder");
                assert!(!found.to_string().contains("root:x"), "{found}");
            }
            assert_eq!(library.text("inside.csv").unwrap().text, "x\n");
        }
        fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn a_failed_write_says_what_to_make_room_for() {
        // Aim: the system's own words are not enough. Method: the error numbers of Linux.
        let check = |number: i32, words: &str| {
            let why = write_failure(&io::Error::from_raw_os_error(number));
            assert!(why.starts_with(words), "{why}");
        };
        check(28, "the disk is full (");
        check(122, "the disk quota of this account is used up (");
        check(27, "the file has reached the size limit for files (see `ulimit -f`) (");
        check(30, "the disk is read-only (");
        check(5, "Input/output error");
    }
}
