//! A station's own copy of the school's exercises, brought up to date by digest.
//!
//! Takes the source, a folder or an address, and the folder of the copy. Gives the numbers of files that changed. The
//! copy is replaced as a whole, or stays as it is: no trainee meets half of a new course, and without the network the
//! last copy is used.

use super::station_file::ExerciseSource;
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// File with the digests of all others, as `sha256sum` writes it.
pub const DIGEST_FILE: &str = "SHA256SUMS";

/// Maximum number of files of a course, and of folders in one another.
pub const FILES_MAX: usize = 2000;
const DEPTH_MAX: usize = 8;

/// Digests in hexadecimal, by the path of the file with `/` between its parts.
pub type Digests = BTreeMap<String, String>;

/// Number of files that a copy gained, changed and lost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CopyChanges {
    pub added: usize,
    pub changed: usize,
    pub removed: usize,
}

impl CopyChanges {
    /// Number of files that differ.
    pub fn count(self) -> usize {
        self.added + self.changed + self.removed
    }

    fn between(wanted: &Digests, present: &Digests) -> CopyChanges {
        let is_changed = |(path, digest): &(&String, &String)| present.get(*path).is_some_and(|own| own != *digest);
        CopyChanges {
            added: wanted.keys().filter(|path| !present.contains_key(*path)).count(),
            changed: wanted.iter().filter(is_changed).count(),
            removed: present.keys().filter(|path| !wanted.contains_key(*path)).count(),
        }
    }
}

/// Reader of the files of a source.
pub trait ExerciseFiles {
    /// Digests of all files.
    ///
    /// # Errors
    /// The reason why they are not known.
    fn digests(&self) -> Result<Digests, String>;

    /// Bytes of a file.
    ///
    /// # Errors
    /// The reason why it cannot be read.
    fn bytes(&self, path: &str) -> Result<Vec<u8>, String>;
}

/// Reader of a source.
///
/// # Errors
/// This build cannot read addresses.
pub fn files_of(source: &ExerciseSource) -> Result<Box<dyn ExerciseFiles>, String> {
    match source {
        ExerciseSource::Folder(folder) => Ok(Box::new(FolderFiles { folder: folder.clone() })),
        #[cfg(feature = "integrations")]
        ExerciseSource::Address(address) => Ok(Box::new(super::exercise_server::ExerciseServer::at(address))),
        #[cfg(not(feature = "integrations"))]
        ExerciseSource::Address(address) => {
            Err(format!("{address}: this build cannot read addresses (feature `integrations`); name a folder"))
        }
    }
}

/// Differences between the source and its copy.
///
/// # Errors
/// The source cannot be read.
pub fn compare(files: &dyn ExerciseFiles, copy: &Path) -> Result<CopyChanges, String> {
    Ok(CopyChanges::between(&files.digests()?, &digests_of_folder(copy).unwrap_or_default()))
}

/// Makes `copy` the same as the source, file by file by digest.
///
/// # Errors
/// The reason; the copy is then as it was.
pub fn update(files: &dyn ExerciseFiles, copy: &Path) -> Result<CopyChanges, String> {
    let wanted = files.digests()?;
    let present = digests_of_folder(copy).unwrap_or_default();
    let changes = CopyChanges::between(&wanted, &present);
    if changes.count() == 0 && copy.is_dir() {
        return Ok(changes);
    }
    let beside =
        |suffix: &str| copy.with_file_name(format!("{}.{suffix}", copy.file_name().unwrap_or_default().display()));
    let (new, old) = (beside("new"), beside("old"));
    let failed = |path: &Path, error: io::Error| format!("{}: unwritable-file: {error}", path.display());
    remove_folder(&new).map_err(|error| failed(&new, error))?;
    fs::create_dir_all(&new).map_err(|error| failed(&new, error))?;
    for (path, digest) in &wanted {
        let bytes = match present.get(path) == Some(digest) {
            true => fs::read(copy.join(path)).map_err(|error| format!("{path}: unreadable-file: {error}"))?,
            false => files.bytes(path)?,
        };
        let found = digest_of(&bytes);
        if found != *digest {
            return Err(format!("{path}: wrong-digest: the file has {found}, and {digest} was announced"));
        }
        let target = new.join(path);
        let parent = target.parent().unwrap_or(&new);
        fs::create_dir_all(parent).and_then(|()| fs::write(&target, bytes)).map_err(|error| failed(&target, error))?;
    }
    remove_folder(&old).map_err(|error| failed(&old, error))?;
    if copy.exists() {
        fs::rename(copy, &old).map_err(|error| failed(copy, error))?;
    }
    fs::rename(&new, copy).map_err(|error| failed(copy, error))?;
    // What remains of the old copy is removed by the next update.
    let _ = remove_folder(&old);
    Ok(changes)
}

fn remove_folder(folder: &Path) -> io::Result<()> {
    match fs::remove_dir_all(folder) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}

pub fn digest_of(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// True for a path that leads to a file inside its folder on every system.
pub fn is_inside(path: &str) -> bool {
    let path = path.strip_prefix("./").unwrap_or(path);
    let is_plain = |part: &str| {
        !part.is_empty()
            && !part.starts_with('.')
            && !part.ends_with(['.', ' '])
            && part.chars().all(|c| !c.is_control() && !r#"\:*?"<>|%"#.contains(c))
    };
    path.len() <= 200 && path.split('/').count() <= DEPTH_MAX && path.split('/').all(is_plain)
}

/// A folder, such as one on a network drive.
struct FolderFiles {
    folder: PathBuf,
}

impl ExerciseFiles for FolderFiles {
    fn digests(&self) -> Result<Digests, String> {
        let digests = digests_of_folder(&self.folder)
            .map_err(|error| format!("{}: unreadable-folder: {error}", self.folder.display()))?;
        // An empty folder is an unmounted drive rather than a school without exercises.
        match digests.len() {
            0 => Err(format!("{}: no-files: the folder is empty", self.folder.display())),
            1..=FILES_MAX => Ok(digests),
            count => Err(format!("{}: too-many: {count} files; a course may have {FILES_MAX}", self.folder.display())),
        }
    }

    fn bytes(&self, path: &str) -> Result<Vec<u8>, String> {
        let path = self.folder.join(path);
        fs::read(&path).map_err(|error| format!("{}: unreadable-file: {error}", path.display()))
    }
}

/// Digests of all files of a folder, except hidden ones and the list of digests.
fn digests_of_folder(folder: &Path) -> io::Result<Digests> {
    let mut digests = Digests::new();
    add_digests(folder, "", 1, &mut digests)?;
    Ok(digests)
}

fn add_digests(folder: &Path, prefix: &str, depth: usize, digests: &mut Digests) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let inside = format!("{prefix}{name}");
        if name == DIGEST_FILE || name.starts_with('.') {
            continue;
        }
        if path.is_dir() && depth < DEPTH_MAX {
            add_digests(&path, &format!("{inside}/"), depth + 1, digests)?;
        } else if path.is_file() && is_inside(&inside) && digests.len() <= FILES_MAX {
            digests.insert(inside, digest_of(&fs::read(&path)?));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Folders(PathBuf);

    impl Folders {
        fn new(name: &str) -> Folders {
            let folder = std::env::temp_dir().join(format!("typodont-copy-{name}-{}", std::process::id()));
            remove_folder(&folder).unwrap();
            fs::create_dir_all(folder.join("source/sub")).unwrap();
            Folders(folder)
        }

        fn write(&self, path: &str, text: &str) {
            fs::write(self.0.join(path), text).unwrap();
        }

        fn update(&self) -> Result<CopyChanges, String> {
            update(&FolderFiles { folder: self.0.join("source") }, &self.0.join("copy"))
        }

        fn copied(&self, path: &str) -> Option<String> {
            fs::read_to_string(self.0.join("copy").join(path)).ok()
        }
    }

    impl Drop for Folders {
        fn drop(&mut self) {
            let _ = remove_folder(&self.0);
        }
    }

    #[test]
    fn a_copy_follows_its_source_file_by_file() {
        let folders = Folders::new("follow");
        folders.write("source/1.json", "one");
        folders.write("source/sub/tooth.nrrd", "tooth");
        let changes = |added, changed, removed| Ok(CopyChanges { added, changed, removed });
        assert_eq!(folders.update(), changes(2, 0, 0));
        assert_eq!(folders.update(), changes(0, 0, 0));
        folders.write("source/1.json", "two");
        folders.write("source/2.json", "new");
        fs::remove_file(folders.0.join("source/sub/tooth.nrrd")).unwrap();
        assert_eq!(folders.update(), changes(1, 1, 1));
        assert_eq!(folders.copied("1.json").as_deref(), Some("two"));
        assert_eq!(folders.copied("sub/tooth.nrrd"), None);
        // A copy that somebody has changed is mended.
        folders.write("copy/2.json", "easier");
        assert_eq!(folders.update(), changes(0, 1, 0));
        assert_eq!(folders.copied("2.json").as_deref(), Some("new"));
    }

    #[test]
    fn a_source_that_is_away_leaves_the_copy_as_it_is() {
        let folders = Folders::new("away");
        folders.write("source/1.json", "one");
        folders.update().unwrap();
        remove_folder(&folders.0.join("source")).unwrap();
        assert!(folders.update().unwrap_err().contains("unreadable-folder"));
        fs::create_dir(folders.0.join("source")).unwrap();
        assert!(folders.update().unwrap_err().contains("the folder is empty"), "an unmounted drive");
        assert_eq!(folders.copied("1.json").as_deref(), Some("one"));
    }

    /// A server whose file is not the one that it announced.
    struct Forged;

    impl ExerciseFiles for Forged {
        fn digests(&self) -> Result<Digests, String> {
            Ok([("1.json".to_string(), digest_of(b"announced"))].into())
        }

        fn bytes(&self, _: &str) -> Result<Vec<u8>, String> {
            Ok(b"another".to_vec())
        }
    }

    #[test]
    fn a_file_with_another_digest_is_refused() {
        let folders = Folders::new("forged");
        folders.write("source/1.json", "one");
        folders.update().unwrap();
        assert!(update(&Forged, &folders.0.join("copy")).unwrap_err().contains("wrong-digest"));
        assert_eq!(folders.copied("1.json").as_deref(), Some("one"));
    }
}
