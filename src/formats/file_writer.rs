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
    // The permissions come first: nobody may read in the temporary file what they may not read in the one it replaces.
    let permitted = fs::metadata(path).map_or(Ok(()), |meta| file.set_permissions(meta.permissions()));
    let written = permitted.and_then(|()| file.write_all(bytes)).and_then(|()| file.sync_all());
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
    let mut number = 0;
    loop {
        let temporary = temporary_path(path, number);
        match File::create_new(&temporary) {
            Err(error) if error.kind() == ErrorKind::AlreadyExists && number < NAMES_MAX => number += 1,
            created => return created.map(|file| (temporary, file)),
        }
    }
}

/// Removes the temporary files of a [`write_atomically`] that was killed. No other program may write the file meanwhile.
pub fn remove_unfinished(path: &Path) {
    for number in 0..=NAMES_MAX {
        let _ = fs::remove_file(temporary_path(path, number));
    }
}

/// Returns one of the names under which [`write_atomically`] writes a file first.
fn temporary_path(path: &Path, number: u32) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!(".{name}.{number}.new"))
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
    fn what_a_killed_program_left_is_removed_and_nothing_else() {
        let folder = folder("killed");
        let path = folder.join("recording.mcap");
        write_atomically(&path, b"whole").unwrap();
        fs::write(folder.join("other"), b"another file").unwrap();
        for _ in 0..3 {
            create_beside(&path).unwrap();
        }
        remove_unfinished(&path);
        assert_eq!(fs::read(&path).unwrap(), b"whole");
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 2);
        fs::remove_dir_all(&folder).unwrap();
    }

    #[cfg(unix)]
    #[test]
    fn a_file_keeps_its_permissions_when_it_is_replaced() {
        use std::os::unix::fs::PermissionsExt;
        let folder = folder("permissions");
        let path = folder.join("key");
        fs::write(&path, b"old").unwrap();
        fs::set_permissions(&path, fs::Permissions::from_mode(0o400)).unwrap();
        write_atomically(&path, b"new").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"new");
        assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o400);
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
