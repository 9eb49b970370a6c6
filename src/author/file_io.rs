//! The file on disk: reading, atomic writing without overwriting changes by others, and an automatic copy of unsaved
//! text.

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::fmt;
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::time::SystemTime;
use typodont_formats::diagnostic::Diagnostic;
use typodont_formats::json::TEXT_MAX;
use typodont_formats::write_atomically;

/// Byte order mark, which some editors write before a text.
const MARK: &str = "\u{feff}";

/// State of a file when it was last read or written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FileStamp {
    modified: Option<SystemTime>,
    length: u64,
    digest: [u8; 32],
}

impl FileStamp {
    fn new(path: &Path, bytes: &[u8]) -> FileStamp {
        let modified = fs::metadata(path).and_then(|meta| meta.modified()).ok();
        FileStamp { modified, length: bytes.len() as u64, digest: digest(bytes) }
    }

    /// Checks whether the file has changed: first by its time and size, and by its bytes only if these differ. `None`
    /// if the file has not changed; otherwise its new text, or the reason for which it cannot be read.
    pub fn poll_change(&mut self, path: &Path) -> Option<Result<String, Diagnostic>> {
        let meta = fs::metadata(path).ok();
        let now = meta.as_ref().map(|meta| (meta.modified().ok(), meta.len()));
        if now == Some((self.modified, self.length)) {
            return None;
        }
        match read(path) {
            Ok((_, stand)) if stand.digest == self.digest => {
                *self = stand;
                None
            }
            Ok((text, stand)) => {
                *self = stand;
                Some(Ok(text))
            }
            // Some editors remove a file before they replace it; the next check looks for the file again.
            Err(complaint) => Some(Err(complaint)),
        }
    }
}

/// Reads a file for editing and returns its text and its state.
///
/// # Errors
/// Returns a diagnostic if the file cannot be read, is larger than 4 MiB, or is not valid text.
pub fn read(path: &Path) -> Result<(String, FileStamp), Diagnostic> {
    let bytes = typodont_formats::read_file(path)?;
    let stand = FileStamp::new(path, &bytes);
    let name = path.display().to_string();
    if bytes.len() > TEXT_MAX {
        let message = format!("the file has {} bytes", bytes.len());
        let help = "a file of this kind may have at most 4 MiB".to_string();
        return Err(Diagnostic::about_file(&name, "too-large", message, Some(help)));
    }
    Ok((typodont_formats::decode_text(&name, bytes)?.text.clone(), stand))
}

/// Reason for which a text was not written.
#[derive(Debug)]
pub enum SaveError {
    /// Another file exists at this path, or this file has been changed by others; the user must be asked.
    Taken(PathBuf),
    Unwritable {
        path: PathBuf,
        why: String,
    },
}

impl fmt::Display for SaveError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            SaveError::Taken(path) => write!(f, "{}: file-exists: another file has this name", path.display()),
            SaveError::Unwritable { path, why } => write!(f, "{}: unwritable-file: {why}", path.display()),
        }
    }
}

impl std::error::Error for SaveError {}

/// Permission to overwrite.
#[derive(Clone, Copy, Debug)]
pub enum Overwrite<'s> {
    /// Overwrites nothing: the file must not exist.
    Never,
    /// Overwrites the file only if it is unchanged since it was read.
    IfUnchanged(&'s FileStamp),
    /// Overwrites any file, after the user has been asked.
    Always,
}

/// Writes a text under another name and renames the file, so that the file is always complete, either the old or the
/// new one.
///
/// # Errors
/// Returns an error if the file may not be overwritten, or if it cannot be written.
pub fn save(path: &Path, text: &str, overwrite: Overwrite) -> Result<FileStamp, SaveError> {
    let unwritable = |why: &dyn fmt::Display| SaveError::Unwritable { path: path.to_path_buf(), why: why.to_string() };
    // A link remains a link: its target is written.
    let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf());
    let existing = match fs::read(&target) {
        Ok(bytes) => Some(bytes),
        Err(error) if error.kind() == ErrorKind::NotFound => None,
        // A file that cannot be read is not overwritten without asking.
        Err(_) if matches!(overwrite, Overwrite::Always) => None,
        Err(error) => return Err(unwritable(&error)),
    };
    let is_free = match (overwrite, &existing) {
        (Overwrite::Always, _) | (_, None) => true,
        (Overwrite::Never, Some(_)) => false,
        (Overwrite::IfUnchanged(stand), Some(bytes)) => digest(bytes) == stand.digest,
    };
    if !is_free {
        return Err(SaveError::Taken(path.to_path_buf()));
    }
    if target.parent().is_some_and(|folder| !folder.as_os_str().is_empty() && !folder.is_dir()) {
        return Err(unwritable(&"its folder does not exist"));
    }
    // A byte order mark is preserved.
    let has_byte_order_mark = existing.as_ref().is_some_and(|bytes| bytes.starts_with(MARK.as_bytes()));
    let bytes = if has_byte_order_mark { format!("{MARK}{text}") } else { text.to_string() };
    write_atomically(&target, bytes.as_bytes()).map_err(|e| unwritable(&e))?;
    Ok(FileStamp::new(&target, bytes.as_bytes()))
}

fn digest(bytes: &[u8]) -> [u8; 32] {
    Sha256::digest(bytes).into()
}

/// Automatic copies of unsaved text in the settings folder, which survive a closed window and a power failure.
pub mod autosave {
    use super::{Deserialize, Path, PathBuf, Serialize, digest, fs, write_atomically};
    use typodont_exercise::scenario::hex;

    #[derive(Serialize, Deserialize)]
    struct DraftFile {
        /// The edited file; `None` for a new exercise without a file name.
        path: Option<PathBuf>,
        text: String,
    }

    fn file(folder: &Path, path: Option<&Path>) -> PathBuf {
        let name = match path {
            None => "new".to_string(),
            Some(path) => {
                let path = std::path::absolute(path).unwrap_or(path.to_path_buf());
                hex(&digest(path.as_os_str().as_encoded_bytes())[..8])
            }
        };
        folder.join(format!("{name}.draft.json"))
    }

    /// Stores an unsaved text; `path` is the file to which it belongs.
    ///
    /// # Errors
    /// Returns a message if the copy cannot be written.
    pub fn store(folder: &Path, path: Option<&Path>, text: &str) -> Result<(), String> {
        let file = file(folder, path);
        let draft = DraftFile { path: path.map(Path::to_path_buf), text: text.to_string() };
        let bytes = serde_json::to_vec_pretty(&draft).unwrap_or_default();
        let result = fs::create_dir_all(folder).and_then(|()| write_atomically(&file, &bytes));
        result.map_err(|e| format!("{}: unwritable-file: {e}; save the exercise before you close it", file.display()))
    }

    /// Returns the unsaved text; `None` if there is none.
    pub fn load(folder: &Path, path: Option<&Path>) -> Option<String> {
        let bytes = fs::read(file(folder, path)).ok()?;
        Some(serde_json::from_slice::<DraftFile>(&bytes).ok()?.text)
    }

    /// Deletes the copy after its text has been saved or discarded.
    pub fn remove(folder: &Path, path: Option<&Path>) {
        let _ = fs::remove_file(file(folder, path));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(name: &str) -> PathBuf {
        let folder = std::env::temp_dir().join(format!("typodont-keep-{}-{name}", std::process::id()));
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(&folder).unwrap();
        folder
    }

    #[test]
    fn nobody_elses_change_is_written_over_unasked() {
        let folder = folder("taken");
        let file = folder.join("a.json");
        let mine = save(&file, "1", Overwrite::Never).unwrap();
        assert!(matches!(save(&file, "2", Overwrite::Never), Err(SaveError::Taken(_))));
        fs::write(&file, "theirs").unwrap();
        assert!(matches!(save(&file, "2", Overwrite::IfUnchanged(&mine)), Err(SaveError::Taken(_))));
        assert_eq!(fs::read_to_string(&file).unwrap(), "theirs");
        let mut now = save(&file, "2", Overwrite::Always).unwrap();
        assert_eq!(fs::read_to_string(&file).unwrap(), "2");
        assert!(now.poll_change(&file).is_none());
        fs::write(&file, "another").unwrap();
        assert_eq!(now.poll_change(&file).unwrap().unwrap(), "another");
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 1, "nothing is left beside it");
        fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn a_byte_order_mark_stays_and_is_no_part_of_the_text() {
        let folder = folder("mark");
        let file = folder.join("a.json");
        fs::write(&file, "\u{feff}{}").unwrap();
        let (text, stand) = read(&file).unwrap();
        assert_eq!(text, "{}");
        save(&file, "{ }", Overwrite::IfUnchanged(&stand)).unwrap();
        assert_eq!(fs::read_to_string(&file).unwrap(), "\u{feff}{ }");
        fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn what_is_not_saved_is_found_again() {
        let folder = folder("drafts");
        let file = folder.join("a.json");
        for path in [None, Some(file.as_path())] {
            assert_eq!(autosave::load(&folder, path), None);
            autosave::store(&folder, path, "half").unwrap();
            assert_eq!(autosave::load(&folder, path).as_deref(), Some("half"));
            autosave::remove(&folder, path);
            assert_eq!(autosave::load(&folder, path), None);
        }
        fs::remove_dir_all(&folder).unwrap();
    }
}
