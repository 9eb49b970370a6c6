//! On-disk queue of xAPI statements that are to be sent.
//!
//! Each file is the array of one session's statements, written atomically. It stays in `waiting` until the record
//! store has accepted every statement, then moves to `sent`; or to `refused`, with the reason in a file beside it.
//! Statements that were enqueued before are not enqueued again.

use serde_json::Value as Json;
use sha2::{Digest, Sha256};
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

/// Folders of the spool.
const WAITING: &str = "waiting";
const SENT: &str = "sent";
const REFUSED: &str = "refused";

/// File locked by the program that sends.
const LOCK: &str = "sending.lock";

/// Spool folder of xAPI statements.
#[derive(Clone, Debug)]
pub struct Spool {
    folder: PathBuf,
}

/// Number of sessions in each state.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SpoolCounts {
    pub waiting: usize,
    pub sent: usize,
    pub refused: usize,
}

impl Spool {
    /// Opens a spool, creating its folders where they are missing.
    ///
    /// # Errors
    ///
    /// Returns the I/O error when a folder cannot be created.
    pub fn open(folder: &Path) -> io::Result<Spool> {
        for part in [WAITING, SENT, REFUSED] {
            fs::create_dir_all(folder.join(part))?;
        }
        Ok(Spool { folder: folder.to_path_buf() })
    }

    /// Enqueues a session's statements. Returns `false` when the same statements were enqueued before, whatever their
    /// state is now.
    ///
    /// # Errors
    ///
    /// Returns the I/O error when the file cannot be written.
    pub fn put(&self, session_id: &str, statements: &[Json]) -> io::Result<bool> {
        let text = serde_json::to_string(statements).map_err(io::Error::other)?;
        let digest = Sha256::digest(text.as_bytes());
        let name = format!("{session_id}-{:02x}{:02x}{:02x}{:02x}.json", digest[0], digest[1], digest[2], digest[3]);
        if [WAITING, SENT, REFUSED].iter().any(|part| self.folder.join(part).join(&name).exists()) {
            return Ok(false);
        }
        let place = self.folder.join(WAITING).join(&name);
        typodont_formats::write_atomically(&place, text.as_bytes())?;
        Ok(true)
    }

    /// Returns the files that wait to be sent, sorted by name.
    ///
    /// # Errors
    ///
    /// Returns the I/O error when the folder cannot be read.
    pub fn waiting(&self) -> io::Result<Vec<PathBuf>> {
        let mut files: Vec<PathBuf> =
            fs::read_dir(self.folder.join(WAITING))?.filter_map(|e| Some(e.ok()?.path())).collect();
        files.retain(|path| path.extension().is_some_and(|e| e == "json"));
        files.sort();
        Ok(files)
    }

    /// Reads the statements of a waiting file.
    ///
    /// # Errors
    ///
    /// Returns the I/O error when the file cannot be read or is not a JSON array.
    pub fn statements(&self, file: &Path) -> io::Result<Vec<Json>> {
        serde_json::from_slice(&fs::read(file)?).map_err(io::Error::other)
    }

    /// Moves a file to `sent`: the record store has every statement of it.
    ///
    /// # Errors
    ///
    /// Returns the I/O error when the file cannot be moved.
    pub fn mark_sent(&self, file: &Path) -> io::Result<()> {
        self.move_to(SENT, file).map(drop)
    }

    /// Moves a file to `refused` and writes the reason beside it: the record store will never accept it.
    ///
    /// # Errors
    ///
    /// Returns the I/O error when the file cannot be moved or the reason cannot be written.
    pub fn mark_refused(&self, file: &Path, why: &str) -> io::Result<()> {
        let place = self.move_to(REFUSED, file)?;
        fs::write(place.with_extension("why.txt"), why)
    }

    fn move_to(&self, part: &str, file: &Path) -> io::Result<PathBuf> {
        let name = file.file_name().ok_or(io::ErrorKind::InvalidInput)?;
        let place = self.folder.join(part).join(name);
        fs::rename(file, &place)?;
        Ok(place)
    }

    /// Counts the sessions in each state.
    ///
    /// # Errors
    ///
    /// Returns the I/O error when a folder of the spool cannot be read.
    pub fn counts(&self) -> io::Result<SpoolCounts> {
        let count = |part: &str| -> io::Result<usize> {
            let files = fs::read_dir(self.folder.join(part))?.filter_map(|e| Some(e.ok()?.path()));
            Ok(files.filter(|path| path.extension().is_some_and(|e| e == "json")).count())
        };
        Ok(SpoolCounts { waiting: count(WAITING)?, sent: count(SENT)?, refused: count(REFUSED)? })
    }

    /// Locks the spool for sending until the returned file is dropped. Returns `None` while another program holds the
    /// lock.
    ///
    /// # Errors
    ///
    /// Returns the I/O error when the lock file cannot be created or locked.
    pub fn lock(&self) -> io::Result<Option<File>> {
        let lock = File::create(self.folder.join(LOCK))?;
        match lock.try_lock() {
            Ok(()) => Ok(Some(lock)),
            Err(fs::TryLockError::WouldBlock) => Ok(None),
            Err(fs::TryLockError::Error(error)) => Err(error),
        }
    }
}
