//! The files a session is made of, by name: shipped with the program, from a folder, or out of a recording.

use crate::diagnostic::{Diagnostic, Source};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

/// Largest file that is read into memory, bytes: a scan of 512×512×512 in 16 bits, and half as much again.
const FILE_MAX: u64 = 400 << 20;

/// Where files come from: a folder on disk, above the tables that ship with the program.
#[derive(Clone, Debug, Default)]
pub struct Library {
    /// Files held in memory; asked first.
    held: BTreeMap<String, Arc<[u8]>>,
    /// Folders that names are relative to, asked in order.
    folders: Vec<PathBuf>,
}

/// Tables that ship with the program.
const SHIPPED: &[(&str, &str)] = &[
    ("content/tissues.json", include_str!("../../content/tissues.json")),
    ("content/instruments.json", include_str!("../../content/instruments.json")),
    ("content/touch.json", include_str!("../../content/touch.json")),
    ("content/operators/careful.json", include_str!("../../content/operators/careful.json")),
    ("content/operators/expert.json", include_str!("../../content/operators/expert.json")),
    ("content/operators/hasty.json", include_str!("../../content/operators/hasty.json")),
    ("content/operators/timid.json", include_str!("../../content/operators/timid.json")),
    ("content/questionnaires/simulator.json", include_str!("../../content/questionnaires/simulator.json")),
];

impl Library {
    /// Only what ships with the program.
    pub fn shipped() -> Library {
        let held = SHIPPED.iter().map(|(name, text)| (name.to_string(), Arc::from(text.as_bytes()))).collect();
        Library { held, folders: Vec::new() }
    }

    /// Nothing at all: to be filled from a recording.
    pub fn empty() -> Library {
        Library::default()
    }

    /// The same with a folder asked for everything that is not held.
    pub fn with_folder(mut self, folder: impl Into<PathBuf>) -> Library {
        self.folders.push(folder.into());
        self
    }

    /// Holds a file, in place of one of that name.
    pub fn hold(&mut self, name: impl Into<String>, bytes: impl Into<Arc<[u8]>>) {
        self.held.insert(name.into(), bytes.into());
    }

    /// Every held file by name.
    pub fn held(&self) -> impl Iterator<Item = (&str, &[u8])> {
        self.held.iter().map(|(name, bytes)| (name.as_str(), bytes.as_ref()))
    }

    /// A file's bytes. Names are relative and stay inside their folder.
    pub fn bytes(&self, name: &str) -> Result<Arc<[u8]>, Diagnostic> {
        if let Some(bytes) = self.held.get(name) {
            return Ok(bytes.clone());
        }
        let is_inside = Path::new(name).components().all(|c| matches!(c, Component::Normal(_) | Component::CurDir));
        if !is_inside {
            let help = "give a path below the folder of the file that names it".to_string();
            return Err(Diagnostic::about_file(name, "outside-folder", "the path leads out of the folder", Some(help)));
        }
        for folder in &self.folders {
            let path = folder.join(name);
            if path.is_file() {
                return read_file(&path).map(Arc::from);
            }
        }
        let looked = self.folders.iter().map(|f| f.display().to_string()).collect::<Vec<_>>().join(", ");
        let help = if looked.is_empty() { None } else { Some(format!("looked in: {looked}")) };
        Err(Diagnostic::about_file(name, "missing-file", "there is no such file", help))
    }

    /// A file as text.
    pub fn text(&self, name: &str) -> Result<Arc<Source>, Diagnostic> {
        text_of(name, self.bytes(name)?.to_vec())
    }
}

/// Reads a file that the user named; relative to the current folder, anywhere on disk.
pub fn read_file(path: &Path) -> Result<Vec<u8>, Diagnostic> {
    let name = path.display().to_string();
    let refused = |what: String| Diagnostic::about_file(&name, "unreadable-file", what, None);
    let meta = fs::metadata(path).map_err(|error| refused(format!("the file cannot be read: {error}")))?;
    if !meta.is_file() {
        return Err(refused("this is not a file".into()));
    }
    if meta.len() > FILE_MAX {
        return Err(refused(format!(
            "the file has {} MiB, more than {} MiB are not read",
            meta.len() >> 20,
            FILE_MAX >> 20
        )));
    }
    fs::read(path).map_err(|error| refused(format!("the file cannot be read: {error}")))
}

/// Reads a text that the user named.
pub fn read_text(path: &Path) -> Result<Arc<Source>, Diagnostic> {
    text_of(&path.display().to_string(), read_file(path)?)
}

/// Bytes as text, without a byte order mark.
pub fn text_of(name: &str, bytes: Vec<u8>) -> Result<Arc<Source>, Diagnostic> {
    match String::from_utf8(bytes) {
        Ok(text) => Ok(Source::new(name, text.strip_prefix('\u{feff}').unwrap_or(&text))),
        Err(error) => {
            let at = error.utf8_error().valid_up_to();
            let help = Some("save the file as UTF-8".to_string());
            Err(Diagnostic::about_file(name, "not-text", format!("byte {at} is not UTF-8 text"), help))
        }
    }
}
