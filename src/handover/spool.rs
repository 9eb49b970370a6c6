//! Statements on disk that wait to be sent.
//!
//! One file per session: an array of statements. It is whole or absent, stands in `waiting` until a record store has taken every
//! statement, and moves to `sent`; or to `refused`, with the reason beside it. What was put once is not put again.

use serde_json::Value as Json;
use sha2::{Digest, Sha256};
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

/// Folders within the spool.
const WAITING: &str = "waiting";
const SENT: &str = "sent";
const REFUSED: &str = "refused";

/// Held by whoever sends.
const LOCK: &str = "sending.lock";

/// A folder of statements.
#[derive(Clone, Debug)]
pub struct Spool {
    folder: PathBuf,
}

/// How many sessions stand where.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    pub waiting: usize,
    pub sent: usize,
    pub refused: usize,
}

impl Spool {
    /// Opens a spool, or makes one.
    pub fn open(folder: &Path) -> io::Result<Spool> {
        for part in [WAITING, SENT, REFUSED] {
            fs::create_dir_all(folder.join(part))?;
        }
        Ok(Spool { folder: folder.to_path_buf() })
    }

    /// Puts a session's statements; `false` when these very ones were put before, wherever they are now.
    pub fn put(&self, session_id: &str, statements: &[Json]) -> io::Result<bool> {
        let text = serde_json::to_string(statements).map_err(io::Error::other)?;
        let digest = Sha256::digest(text.as_bytes());
        let name = format!("{session_id}-{:02x}{:02x}{:02x}{:02x}.json", digest[0], digest[1], digest[2], digest[3]);
        if [WAITING, SENT, REFUSED].iter().any(|part| self.folder.join(part).join(&name).exists()) {
            return Ok(false);
        }
        let place = self.folder.join(WAITING).join(&name);
        let partial = place.with_extension("partial");
        fs::write(&partial, text)?;
        File::open(&partial)?.sync_all()?;
        fs::rename(&partial, &place)?;
        Ok(true)
    }

    /// What waits, in the order of names.
    pub fn waiting(&self) -> io::Result<Vec<PathBuf>> {
        let mut files: Vec<PathBuf> =
            fs::read_dir(self.folder.join(WAITING))?.filter_map(|e| Some(e.ok()?.path())).collect();
        files.retain(|path| path.extension().is_some_and(|e| e == "json"));
        files.sort();
        Ok(files)
    }

    /// The statements of a file that waits.
    pub fn statements(&self, file: &Path) -> io::Result<Vec<Json>> {
        serde_json::from_slice(&fs::read(file)?).map_err(io::Error::other)
    }

    /// The store has every statement of a file.
    pub fn sent(&self, file: &Path) -> io::Result<()> {
        self.move_to(SENT, file).map(drop)
    }

    /// The store will never take a file; why not.
    pub fn refused(&self, file: &Path, why: &str) -> io::Result<()> {
        let place = self.move_to(REFUSED, file)?;
        fs::write(place.with_extension("why.txt"), why)
    }

    fn move_to(&self, part: &str, file: &Path) -> io::Result<PathBuf> {
        let name = file.file_name().ok_or(io::ErrorKind::InvalidInput)?;
        let place = self.folder.join(part).join(name);
        fs::rename(file, &place)?;
        Ok(place)
    }

    pub fn tally(&self) -> io::Result<Tally> {
        let count = |part: &str| -> io::Result<usize> {
            let files = fs::read_dir(self.folder.join(part))?.filter_map(|e| Some(e.ok()?.path()));
            Ok(files.filter(|path| path.extension().is_some_and(|e| e == "json")).count())
        };
        Ok(Tally { waiting: count(WAITING)?, sent: count(SENT)?, refused: count(REFUSED)? })
    }

    /// Holds the spool for sending, as long as the file is kept; `None` while another program sends from it.
    pub fn hold(&self) -> io::Result<Option<File>> {
        let lock = File::create(self.folder.join(LOCK))?;
        match lock.try_lock() {
            Ok(()) => Ok(Some(lock)),
            Err(fs::TryLockError::WouldBlock) => Ok(None),
            Err(fs::TryLockError::Error(error)) => Err(error),
        }
    }
}
