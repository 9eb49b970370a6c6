//! The files of a finished bundle, on disk or in memory.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Component, Path, PathBuf};

/// Name of the folder of images within a bundle.
pub(super) const VIEWS: &str = "views";

/// Files of one bundle: of a folder on disk, or in memory.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum BundleFolder {
    OnDisk(PathBuf),
    /// `name` is that of the folder which the files would have on disk; names of files in subfolders contain a `/`.
    InMemory {
        name: String,
        files: BTreeMap<String, Vec<u8>>,
    },
}

impl BundleFolder {
    /// Folder on disk.
    pub fn on_disk(path: impl Into<PathBuf>) -> BundleFolder {
        BundleFolder::OnDisk(path.into())
    }

    /// Path on disk; in memory the name.
    pub fn path(&self) -> &Path {
        match self {
            BundleFolder::OnDisk(path) => path,
            BundleFolder::InMemory { name, .. } => Path::new(name),
        }
    }

    /// Name of the folder, without those above it.
    pub fn name(&self) -> Cow<'_, str> {
        self.path().file_name().unwrap_or_default().to_string_lossy()
    }

    /// Names of all files, in order; files among the images are named `views/NAME`, and other subfolders only by their
    /// names.
    pub fn names(&self) -> Vec<String> {
        let mut names: Vec<String> = match self {
            BundleFolder::OnDisk(path) => {
                let mut names = names_on_disk(path);
                if path.join(VIEWS).is_dir() {
                    names.retain(|name| name != VIEWS);
                    names.extend(names_on_disk(&path.join(VIEWS)).iter().map(|name| format!("{VIEWS}/{name}")));
                }
                names
            }
            BundleFolder::InMemory { files, .. } => files.keys().cloned().collect(),
        };
        names.sort();
        names
    }

    /// Bytes of a file. On disk only a regular file within the folder is read, never a link, a pipe or a device, which
    /// might be endless.
    ///
    /// # Errors
    ///
    /// When there is no such file, or it cannot be read; the message does not name it.
    pub fn read(&self, name: &str) -> Result<Cow<'_, [u8]>, String> {
        match self {
            BundleFolder::OnDisk(path) => {
                if !is_file_name(name) {
                    return Err("this is not the name of a file in a bundle".to_string());
                }
                let file = path.join(name);
                match fs::symlink_metadata(&file) {
                    Err(error) => Err(error.to_string()),
                    Ok(meta) if !meta.is_file() => Err("this is not a regular file".to_string()),
                    Ok(_) => typodont_formats::read_file(&file).map(Cow::Owned).map_err(|d| d.message),
                }
            }
            BundleFolder::InMemory { files, .. } => {
                let bytes = files.get(name).ok_or_else(|| "there is no file of this name".to_string())?;
                Ok(Cow::Borrowed(bytes))
            }
        }
    }

    /// True if the folder has an entry of this name.
    pub fn contains(&self, name: &str) -> bool {
        match self {
            BundleFolder::OnDisk(path) => path.join(name).exists(),
            BundleFolder::InMemory { files, .. } => files.contains_key(name),
        }
    }
}

/// True for a relative name that does not lead out of the folder.
pub(super) fn is_file_name(name: &str) -> bool {
    Path::new(name).components().all(|c| matches!(c, Component::Normal(_)))
}

fn names_on_disk(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    entries.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect()
}
