//! Files that are complete on the disk, or absent.

use std::fs;
use std::fs::File;
use std::io;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

/// Number of temporary names that are tried: programs that write the same file at the same time, and those that were
/// killed while they did.
const NAMES_MAX: u32 = 100;

/// Writes a file under another name, syncs it to the disk and renames it, so that the file is at any time complete,
/// either the old or the new one. It keeps the permissions of a file that it replaces.
///
/// # Errors
/// The system's error; nothing is left beside the file then.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let (temporary, mut file) = create_beside(path)?;
    let written = file.write_all(bytes).and_then(|()| {
        if let Ok(meta) = fs::metadata(path) {
            file.set_permissions(meta.permissions())?;
        }
        file.sync_all()
    });
    // Some systems do not rename an open file.
    drop(file);
    let renamed = written.and_then(|()| fs::rename(&temporary, path));
    match renamed {
        Ok(()) => sync_folder(path.parent().unwrap_or(Path::new("."))),
        Err(_) => drop(fs::remove_file(&temporary)),
    }
    renamed
}

/// Creates a temporary file in the folder of `path`. Its name is hidden, and no other program has it.
fn create_beside(path: &Path) -> io::Result<(PathBuf, File)> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let mut number = 0;
    loop {
        let temporary = path.with_file_name(format!(".{name}.{number}.new"));
        match File::create_new(&temporary) {
            Err(error) if error.kind() == ErrorKind::AlreadyExists && number < NAMES_MAX => number += 1,
            created => return created.map(|file| (temporary, file)),
        }
    }
}

/// Writes a file and syncs it to the disk.
///
/// # Errors
/// The system's error.
pub fn write_synced(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut file = File::create(path)?;
    file.write_all(bytes)?;
    file.sync_data()
}

/// Syncs the names in a folder to the disk, where the system can. A file system that cannot is not an error: the files
/// are written in any case.
pub fn sync_folder(folder: &Path) {
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let _ = File::open(folder).and_then(|folder| folder.sync_all());
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(name: &str) -> PathBuf {
        let folder = std::env::temp_dir().join(format!("typodont-writer-{name}-{}", std::process::id()));
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(&folder).unwrap();
        folder
    }

    #[test]
    fn a_reader_sees_a_whole_file_whoever_writes() {
        // Aim: no reader ever sees a part of a file. Method: four threads write different texts of many blocks to one file,
        // while it is read.
        let folder = folder("readers");
        let path = folder.join("entry.json");
        write_atomically(&path, &[b'0'; 100_000]).unwrap();
        std::thread::scope(|scope| {
            for letter in b'1'..=b'4' {
                let path = &path;
                scope.spawn(move || (0..20).for_each(|_| write_atomically(path, &vec![letter; 100_000]).unwrap()));
            }
            for _ in 0..100 {
                let found = fs::read(&path).unwrap();
                assert!(found.len() == 100_000 && found.iter().all(|b| *b == found[0]));
            }
        });
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 1, "nothing is left beside it");
        fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn a_file_that_cannot_be_replaced_stays_and_leaves_nothing() {
        let folder = folder("unwritable");
        let path = folder.join("taken");
        fs::create_dir_all(path.join("full")).unwrap();
        assert!(write_atomically(&path, b"new").is_err());
        assert!(write_atomically(&folder.join("missing/file"), b"new").is_err());
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 1);
        fs::remove_dir_all(&folder).unwrap();
    }
}
