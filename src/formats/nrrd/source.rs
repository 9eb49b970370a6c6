//! A byte stream of known length, from memory or from disk.

use crate::nrrd::error::{NrrdErrorKind, excerpt};
use std::fs::{self, File};
use std::io::{self, BufRead, BufReader, Cursor, Read};
use std::path::{Path, PathBuf};

/// Source of a header and its data. Its known length allows sizes to be checked before memory is allocated.
pub(crate) struct ByteSource<'a> {
    bytes: Box<dyn BufRead + 'a>,
    len: u64,
    consumed: u64,
    /// Path for error messages.
    pub path: Option<PathBuf>,
}

impl<'a> ByteSource<'a> {
    pub fn of_slice(bytes: &'a [u8]) -> ByteSource<'a> {
        ByteSource { bytes: Box::new(bytes), len: bytes.len() as u64, consumed: 0, path: None }
    }

    pub fn of_vec(bytes: Vec<u8>, name: &str) -> ByteSource<'a> {
        let len = bytes.len() as u64;
        ByteSource { bytes: Box::new(Cursor::new(bytes)), len, consumed: 0, path: Some(PathBuf::from(name)) }
    }

    /// Opens a regular file; anything else is refused, because a pipe has no length and may never end.
    ///
    /// # Errors
    /// Fails when the file cannot be opened or is not a regular file.
    pub fn of_file(path: &Path) -> Result<ByteSource<'a>, NrrdErrorKind> {
        let metadata = fs::metadata(path).map_err(NrrdErrorKind::Unreadable)?;
        if !metadata.is_file() {
            return Err(NrrdErrorKind::NotAFile);
        }
        let file = File::open(path).map_err(NrrdErrorKind::Unreadable)?;
        Ok(ByteSource {
            bytes: Box::new(BufReader::new(file)),
            len: metadata.len(),
            consumed: 0,
            path: Some(path.into()),
        })
    }

    /// Opens the data file that the header at `header` names. `name` is relative and without `..`; symbolic links are
    /// followed, but not out of the header's folder.
    ///
    /// # Errors
    /// Fails when the file cannot be opened, is outside the header's folder, or is the header itself.
    pub fn open_beside(header: &Path, name: &str) -> Result<ByteSource<'a>, NrrdErrorKind> {
        let refuse = |why| NrrdErrorKind::DataFile { name: excerpt(name), why };
        let resolve = |path: &Path| {
            path.canonicalize().map_err(|error| NrrdErrorKind::DataFileUnreadable { name: excerpt(name), error })
        };
        let folder = match header.parent() {
            Some(parent) if parent != Path::new("") => resolve(parent)?,
            _ => resolve(Path::new("."))?,
        };
        let file = resolve(&folder.join(name))?;
        if !file.starts_with(&folder) {
            return Err(refuse("is outside the header's folder"));
        }
        if file == resolve(header)? {
            return Err(refuse("is the header itself"));
        }
        ByteSource::of_file(&file).map_err(|problem| match problem {
            NrrdErrorKind::NotAFile => refuse("is a folder or a device"),
            NrrdErrorKind::Unreadable(error) => NrrdErrorKind::DataFileUnreadable { name: excerpt(name), error },
            other => other,
        })
    }

    /// Returns the number of bytes read so far.
    pub fn position(&self) -> u64 {
        self.consumed
    }

    /// Returns the number of remaining bytes.
    pub fn remaining(&self) -> u64 {
        self.len.saturating_sub(self.consumed)
    }
}

impl Read for ByteSource<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.bytes.read(buffer)?;
        self.consumed += count as u64;
        Ok(count)
    }
}

impl BufRead for ByteSource<'_> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        self.bytes.fill_buf()
    }

    fn consume(&mut self, count: usize) {
        self.consumed += count as u64;
        self.bytes.consume(count);
    }
}
