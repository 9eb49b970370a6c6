//! Bytes in order, from memory or from disk, that know how many they are.

use super::error::{Problem, excerpt};
use std::fs::{self, File};
use std::io::{self, BufRead, BufReader, Cursor, Read};
use std::path::{Path, PathBuf};

/// What a header and its data are read from. Knowing the length is what lets sizes be checked before memory is taken.
pub(in crate::content) struct Source<'a> {
    bytes: Box<dyn BufRead + 'a>,
    len: u64,
    consumed: u64,
    /// Named in complaints.
    pub path: Option<PathBuf>,
}

impl<'a> Source<'a> {
    pub fn of_slice(bytes: &'a [u8]) -> Source<'a> {
        Source { bytes: Box::new(bytes), len: bytes.len() as u64, consumed: 0, path: None }
    }

    pub fn of_vec(bytes: Vec<u8>, name: &str) -> Source<'a> {
        let len = bytes.len() as u64;
        Source { bytes: Box::new(Cursor::new(bytes)), len, consumed: 0, path: Some(PathBuf::from(name)) }
    }

    /// Only plain files: a pipe has no length and may never end.
    pub fn of_file(path: &Path) -> Result<Source<'a>, Problem> {
        let told = fs::metadata(path).map_err(Problem::Unreadable)?;
        if !told.is_file() {
            return Err(Problem::NotAFile);
        }
        let file = File::open(path).map_err(Problem::Unreadable)?;
        Ok(Source { bytes: Box::new(BufReader::new(file)), len: told.len(), consumed: 0, path: Some(path.into()) })
    }

    /// The data file that the header at `header` names. `name` is relative and without `..`; links are followed, but
    /// not out of the header's folder.
    pub fn beside(header: &Path, name: &str) -> Result<Source<'a>, Problem> {
        let refuse = |why| Problem::DataFile { name: excerpt(name), why };
        let resolve = |path: &Path| {
            path.canonicalize().map_err(|error| Problem::DataFileUnreadable { name: excerpt(name), error })
        };
        let folder = match header.parent() {
            Some(parent) if parent != Path::new("") => resolve(parent)?,
            _ => resolve(Path::new("."))?,
        };
        let file = resolve(&folder.join(name))?;
        if !file.starts_with(&folder) {
            return Err(refuse("leads out of the header's folder"));
        }
        if file == resolve(header)? {
            return Err(refuse("is the header itself"));
        }
        Source::of_file(&file).map_err(|problem| match problem {
            Problem::NotAFile => refuse("is a folder or a device"),
            Problem::Unreadable(error) => Problem::DataFileUnreadable { name: excerpt(name), error },
            other => other,
        })
    }

    /// Bytes read so far.
    pub fn at(&self) -> u64 {
        self.consumed
    }

    /// Bytes left.
    pub fn left(&self) -> u64 {
        self.len.saturating_sub(self.consumed)
    }
}

impl Read for Source<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.bytes.read(buffer)?;
        self.consumed += count as u64;
        Ok(count)
    }
}

impl BufRead for Source<'_> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        self.bytes.fill_buf()
    }

    fn consume(&mut self, count: usize) {
        self.consumed += count as u64;
        self.bytes.consume(count);
    }
}
