//! The file on disk: read and written whole, never over somebody else's change, and a copy of what is not saved yet.

use crate::content::{self, json::TEXT_MAX};
use crate::diagnostic::Diagnostic;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::fmt;
use std::fs::{self, File};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// What some editors write before a text.
const MARK: &str = "\u{feff}";

/// What a file was when it was last read or written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Stand {
    modified: Option<SystemTime>,
    length: u64,
    digest: [u8; 32],
}

impl Stand {
    fn of(path: &Path, bytes: &[u8]) -> Stand {
        let modified = fs::metadata(path).and_then(|meta| meta.modified()).ok();
        Stand { modified, length: bytes.len() as u64, digest: digest(bytes) }
    }

    /// Looks whether the file is another than it was: first at its time and size, and only where they differ at its bytes.
    /// `None` while nothing has changed; what stands there now, or why it cannot be read, when it has.
    pub fn changed(&mut self, path: &Path) -> Option<Result<String, Diagnostic>> {
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
            // Editors take a file away and put another in its place: it is looked for again at the next look.
            Err(complaint) => Some(Err(complaint)),
        }
    }
}

/// Reads a file that is to be edited: its text, and what it was then.
pub fn read(path: &Path) -> Result<(String, Stand), Diagnostic> {
    let bytes = content::read_file(path)?;
    let stand = Stand::of(path, &bytes);
    let name = path.display().to_string();
    if bytes.len() > TEXT_MAX {
        let message = format!("the file has {} bytes", bytes.len());
        let help = "a file of this kind has at most 4 MiB".to_string();
        return Err(Diagnostic::about_file(&name, "too-large", message, Some(help)));
    }
    Ok((content::text_of(&name, bytes)?.text.clone(), stand))
}

/// Why a text was not written.
#[derive(Debug)]
pub enum Unkept {
    /// Another file stands there, or somebody else has changed this one: to be asked about.
    Taken(PathBuf),
    Unwritable {
        path: PathBuf,
        why: String,
    },
}

impl fmt::Display for Unkept {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Unkept::Taken(path) => write!(f, "{}: file-exists: another file stands there", path.display()),
            Unkept::Unwritable { path, why } => write!(f, "{}: unwritable-file: {why}", path.display()),
        }
    }
}

/// What may be written over.
#[derive(Clone, Copy, Debug)]
pub enum Kept<'s> {
    /// Nothing: the file must not exist.
    New,
    /// The file as it was when it was read.
    Known(&'s Stand),
    /// Whatever stands there: the person was asked.
    Anything,
}

/// Writes a text under another name and renames it: the file is the old one or the new one, never half of either.
pub fn save(path: &Path, text: &str, over: Kept) -> Result<Stand, Unkept> {
    let unwritable = |why: &dyn fmt::Display| Unkept::Unwritable { path: path.to_path_buf(), why: why.to_string() };
    // A link stays a link: what it leads to is written.
    let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf());
    let there = match fs::read(&target) {
        Ok(bytes) => Some(bytes),
        Err(error) if error.kind() == ErrorKind::NotFound => None,
        // What cannot be read is not written over unasked.
        Err(_) if matches!(over, Kept::Anything) => None,
        Err(error) => return Err(unwritable(&error)),
    };
    let is_free = match (over, &there) {
        (Kept::Anything, _) | (_, None) => true,
        (Kept::New, Some(_)) => false,
        (Kept::Known(stand), Some(bytes)) => digest(bytes) == stand.digest,
    };
    if !is_free {
        return Err(Unkept::Taken(path.to_path_buf()));
    }
    // A byte order mark stays.
    let has_mark = there.as_ref().is_some_and(|bytes| bytes.starts_with(MARK.as_bytes()));
    let bytes = if has_mark { format!("{MARK}{text}") } else { text.to_string() };
    write_whole(&target, bytes.as_bytes()).map_err(|e| unwritable(&e))?;
    Ok(Stand::of(&target, bytes.as_bytes()))
}

fn write_whole(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let beside = folder.join(format!(".{name}.{}.new", std::process::id()));
    let written = File::create(&beside).and_then(|mut file| {
        file.write_all(bytes)?;
        if let Ok(meta) = fs::metadata(path) {
            file.set_permissions(meta.permissions())?;
        }
        file.sync_all()
    });
    let kept = written.and_then(|()| fs::rename(&beside, path));
    if kept.is_err() {
        let _ = fs::remove_file(&beside);
    }
    kept
}

fn digest(bytes: &[u8]) -> [u8; 32] {
    Sha256::digest(bytes).into()
}

/// What is not saved yet, beside the settings: it outlives the window and the machine's power.
pub mod drafts {
    use super::{Deserialize, Path, PathBuf, Serialize, digest, fs, write_whole};
    use crate::scenario::hex;

    #[derive(Serialize, Deserialize)]
    struct DraftFile {
        /// The file that is edited; none while it has no name.
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

    /// Keeps a text that is not saved yet. `path`: the file it belongs to.
    pub fn keep(folder: &Path, path: Option<&Path>, text: &str) -> Result<(), String> {
        let file = file(folder, path);
        let draft = DraftFile { path: path.map(Path::to_path_buf), text: text.to_string() };
        let bytes = serde_json::to_vec_pretty(&draft).unwrap_or_default();
        let kept = fs::create_dir_all(folder).and_then(|()| write_whole(&file, &bytes));
        kept.map_err(|e| format!("{}: unwritable-file: {e}; save the exercise before you close it", file.display()))
    }

    /// The text that was not saved, if there is one.
    pub fn find(folder: &Path, path: Option<&Path>) -> Option<String> {
        let bytes = fs::read(file(folder, path)).ok()?;
        Some(serde_json::from_slice::<DraftFile>(&bytes).ok()?.text)
    }

    /// Forgets it: it is saved, or not wanted.
    pub fn forget(folder: &Path, path: Option<&Path>) {
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
        let mine = save(&file, "1", Kept::New).unwrap();
        assert!(matches!(save(&file, "2", Kept::New), Err(Unkept::Taken(_))));
        fs::write(&file, "theirs").unwrap();
        assert!(matches!(save(&file, "2", Kept::Known(&mine)), Err(Unkept::Taken(_))));
        assert_eq!(fs::read_to_string(&file).unwrap(), "theirs");
        let mut now = save(&file, "2", Kept::Anything).unwrap();
        assert_eq!(fs::read_to_string(&file).unwrap(), "2");
        assert!(now.changed(&file).is_none());
        fs::write(&file, "another").unwrap();
        assert_eq!(now.changed(&file).unwrap().unwrap(), "another");
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 1, "nothing is left beside it");
    }

    #[test]
    fn a_byte_order_mark_stays_and_is_no_part_of_the_text() {
        let file = folder("mark").join("a.json");
        fs::write(&file, "\u{feff}{}").unwrap();
        let (text, stand) = read(&file).unwrap();
        assert_eq!(text, "{}");
        save(&file, "{ }", Kept::Known(&stand)).unwrap();
        assert_eq!(fs::read_to_string(&file).unwrap(), "\u{feff}{ }");
    }

    #[test]
    fn what_is_not_saved_is_found_again() {
        let folder = folder("drafts");
        let file = folder.join("a.json");
        for path in [None, Some(file.as_path())] {
            assert_eq!(drafts::find(&folder, path), None);
            drafts::keep(&folder, path, "half").unwrap();
            assert_eq!(drafts::find(&folder, path).as_deref(), Some("half"));
            drafts::forget(&folder, path);
            assert_eq!(drafts::find(&folder, path), None);
        }
    }
}
