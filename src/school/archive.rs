//! Tar archive of a bundle, divided into parts that are stored as separate objects.
//!
//! The archive is POSIX.1-1988 ustar, with the recording first. Concatenating the parts in the order of their names
//! and piping them into `tar` restores the bundle without this program. The name of a part contains its digest, so an
//! interrupted upload can be resumed without sending stored parts again.

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::fmt;
use std::fs::{self, File};
use std::io::{self, Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::{Component, Path, PathBuf};
use typodont_exercise::record;
use typodont_exercise::scenario::hex;
use typodont_report::SessionFile;
use typodont_report::bundle::SESSION_FILE;

/// Size of every part except the last, bytes: the amount held in memory, and sent again after an interruption. 1 to
/// 64 MiB are practical.
pub const PART_BYTES: u64 = 8 << 20;

/// Name of the recording within an archive.
pub const RECORDING_FILE: &str = record::FILE_NAME;

/// Block size of tar, bytes.
const TAR_BLOCK: u64 = 512;

/// Location of a bundle's bytes in the store. It is saved in the session's row.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    /// Folder of the store: the station's name and the session's id.
    pub folder: String,
    pub files: Vec<ArchivedFile>,
    pub parts: Vec<ArchivedPart>,
}

/// File of the bundle, and its offset in the archive, bytes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ArchivedFile {
    pub name: String,
    pub offset: u64,
    pub bytes: u64,
    pub sha256: String,
}

/// Size and digest of one part.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ArchivedPart {
    pub bytes: u64,
    pub sha256: String,
}

/// Reason for which a bundle cannot be archived.
#[derive(Debug)]
pub enum ArchiveError {
    /// The files differ from what `session.json` states.
    Mismatch(String),
    /// A file cannot be read.
    Unreadable(PathBuf, io::Error),
}

impl fmt::Display for ArchiveError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            ArchiveError::Mismatch(why) => write!(f, "changed-bundle: {why}; typodont verify lists all differences"),
            ArchiveError::Unreadable(path, error) => write!(f, "unreadable-file: {error}: {}", path.display()),
        }
    }
}

impl std::error::Error for ArchiveError {}

/// Archive of a bundle, whose parts are read from the bundle's files on demand.
#[derive(Debug)]
pub struct BundleArchive {
    pub manifest: Manifest,
    segments: Vec<ArchiveSegment>,
}

/// Contiguous piece of the archive.
#[derive(Debug)]
struct ArchiveSegment {
    offset: u64,
    bytes: u64,
    source: SegmentSource,
}

#[derive(Debug)]
enum SegmentSource {
    Header(Box<[u8; TAR_BLOCK as usize]>),
    File(PathBuf),
    Zeros,
}

impl Manifest {
    /// Returns the object name of a part.
    ///
    /// # Panics
    ///
    /// Panics if there is no part `index`.
    pub fn part_name(&self, index: usize) -> String {
        format!("{}/{index:05}-{}.tar-part", self.folder, self.parts[index].sha256)
    }

    /// Returns the bundle's file of this name.
    pub fn file(&self, name: &str) -> Option<&ArchivedFile> {
        self.files.iter().find(|file| file.name == name)
    }

    /// Returns the indices of the parts that contain a file, and the file's byte range within their concatenation.
    /// `None` for a file that extends beyond the parts.
    pub fn parts_containing(&self, file: &ArchivedFile) -> Option<(Range<usize>, Range<usize>)> {
        let end = file.offset.checked_add(file.bytes)?;
        let (mut begin_at, mut first, mut at) = (0, None, 0u64);
        for (index, part) in self.parts.iter().enumerate() {
            let next = at.checked_add(part.bytes)?;
            if first.is_none() && next > file.offset {
                (first, begin_at) = (Some(index), at);
            }
            if let Some(first) = first.filter(|_| next >= end) {
                let own = (file.offset - begin_at) as usize..(end - begin_at) as usize;
                return Some((first..index + 1, own));
            }
            at = next;
        }
        None
    }

    /// Extracts a file from its parts, which `part` reads by index, and checks the digests of parts and file.
    ///
    /// # Errors
    ///
    /// Returns a message when `part` fails, the file extends beyond its parts, or a digest differs.
    pub fn extract(
        &self,
        file: &ArchivedFile,
        mut part: impl FnMut(usize) -> Result<Vec<u8>, String>,
    ) -> Result<Vec<u8>, String> {
        let (parts, own) =
            self.parts_containing(file).ok_or(format!("{}: the file extends beyond its parts", file.name))?;
        let mut bytes = Vec::new();
        for index in parts {
            let read = part(index)?;
            if sha256(&read) != self.parts[index].sha256 {
                return Err(format!("{}: the bytes differ from those that were stored", self.part_name(index)));
            }
            bytes.extend_from_slice(&read);
        }
        let bytes = bytes.get(own).ok_or(format!("{}: the file extends beyond its parts", file.name))?.to_vec();
        match sha256(&bytes) == file.sha256 {
            true => Ok(bytes),
            false => Err(format!("{}: the bytes differ from those that were archived", file.name)),
        }
    }
}

impl BundleArchive {
    /// Reads all files of a bundle and computes the archive's manifest. `folder` is the destination folder in the
    /// store.
    ///
    /// # Errors
    ///
    /// Returns an error when a file cannot be read, is not a regular file of the bundle, does not fit into a tar
    /// header, or differs from the digest that `session.json` states.
    pub fn of(bundle: &Path, session: &SessionFile, folder: String) -> Result<BundleArchive, ArchiveError> {
        let mut names: Vec<&str> =
            session.digests.keys().map(String::as_str).filter(|name| *name != RECORDING_FILE).collect();
        names.insert(0, SESSION_FILE);
        if session.digests.contains_key(RECORDING_FILE) {
            names.insert(0, RECORDING_FILE);
        }
        let mut segments = Vec::new();
        let mut files = Vec::new();
        let mut at = 0;
        let mut add = |source: SegmentSource, bytes: u64, at: &mut u64| {
            if bytes > 0 {
                segments.push(ArchiveSegment { offset: *at, bytes, source });
            }
            *at += bytes;
        };
        for name in names {
            if Path::new(name).components().any(|c| !matches!(c, Component::Normal(_))) || !name.is_ascii() {
                return Err(ArchiveError::Mismatch(format!("\"{}\" is not a file of a bundle", name.escape_debug())));
            }
            let path = bundle.join(name);
            let unreadable = |e| ArchiveError::Unreadable(path.clone(), e);
            let meta = fs::symlink_metadata(&path).map_err(unreadable)?;
            if !meta.is_file() {
                return Err(ArchiveError::Mismatch(format!("{name} is not a regular file")));
            }
            let bytes = meta.len();
            let header = tar_header(name, bytes)
                .ok_or(ArchiveError::Mismatch(format!("{name}: the name is too long, or the file too large")))?;
            add(SegmentSource::Header(Box::new(header)), TAR_BLOCK, &mut at);
            files.push(ArchivedFile { name: name.to_string(), offset: at, bytes, sha256: String::new() });
            add(SegmentSource::File(path), bytes, &mut at);
            add(SegmentSource::Zeros, bytes.next_multiple_of(TAR_BLOCK) - bytes, &mut at);
        }
        add(SegmentSource::Zeros, 2 * TAR_BLOCK, &mut at);
        let mut archive = BundleArchive { manifest: Manifest { folder, files, parts: Vec::new() }, segments };
        archive.digest(at)?;
        for file in &archive.manifest.files {
            match session.digests.get(&file.name) {
                Some(named) if *named != file.sha256 => {
                    return Err(ArchiveError::Mismatch(format!(
                        "{} does not have the digest stated in {SESSION_FILE}",
                        file.name
                    )));
                }
                _ => {}
            }
        }
        Ok(archive)
    }

    /// Reads the whole archive once and computes the digests of all parts and files.
    fn digest(&mut self, length: u64) -> Result<(), ArchiveError> {
        let mut file_digests = vec![Sha256::new(); self.manifest.files.len()];
        let mut at = 0;
        while at < length {
            let end = (at + PART_BYTES).min(length);
            let bytes = self.read(at..end)?;
            for (file, digest) in self.manifest.files.iter().zip(&mut file_digests) {
                let (begin, stop) = (file.offset.max(at), (file.offset + file.bytes).min(end));
                if begin < stop {
                    digest.update(&bytes[(begin - at) as usize..(stop - at) as usize]);
                }
            }
            self.manifest.parts.push(ArchivedPart { bytes: end - at, sha256: sha256(&bytes) });
            at = end;
        }
        for (file, digest) in self.manifest.files.iter_mut().zip(file_digests) {
            file.sha256 = hex(&digest.finalize());
        }
        Ok(())
    }

    /// Reads a part's bytes.
    ///
    /// # Errors
    ///
    /// Returns an error when a file cannot be read or was changed after the archive was created.
    ///
    /// # Panics
    ///
    /// Panics if there is no part `index`.
    pub fn part(&self, index: usize) -> Result<Vec<u8>, ArchiveError> {
        let begin: u64 = self.manifest.parts[..index].iter().map(|p| p.bytes).sum();
        let part = &self.manifest.parts[index];
        let bytes = self.read(begin..begin + part.bytes)?;
        match sha256(&bytes) == part.sha256 {
            true => Ok(bytes),
            false => Err(ArchiveError::Mismatch("a file was changed while the bundle was being sent".into())),
        }
    }

    /// Reads a byte range of the archive.
    fn read(&self, range: Range<u64>) -> Result<Vec<u8>, ArchiveError> {
        let mut bytes = Vec::with_capacity((range.end - range.start) as usize);
        for segment in &self.segments {
            let (begin, end) = (segment.offset.max(range.start), (segment.offset + segment.bytes).min(range.end));
            if begin >= end {
                continue;
            }
            let (skip, count) = (begin - segment.offset, end - begin);
            match &segment.source {
                SegmentSource::Header(header) => {
                    bytes.extend_from_slice(&header[skip as usize..(skip + count) as usize])
                }
                SegmentSource::Zeros => bytes.resize(bytes.len() + count as usize, 0),
                SegmentSource::File(path) => {
                    let before = bytes.len();
                    let read = File::open(path).and_then(|mut file| {
                        file.seek(SeekFrom::Start(skip))?;
                        file.take(count).read_to_end(&mut bytes)
                    });
                    read.map_err(|e| ArchiveError::Unreadable(path.clone(), e))?;
                    if (bytes.len() - before) as u64 != count {
                        return Err(ArchiveError::Mismatch(format!("{} was truncated", path.display())));
                    }
                }
            }
        }
        Ok(bytes)
    }
}

/// Builds a file's ustar header; `None` for names longer than 100 bytes and files of 8 GiB or more.
fn tar_header(name: &str, bytes: u64) -> Option<[u8; TAR_BLOCK as usize]> {
    let mut header = [0; TAR_BLOCK as usize];
    header.get_mut(..100)?.get_mut(..name.len())?.copy_from_slice(name.as_bytes());
    let mut field = |at: usize, text: &str| header[at..at + text.len()].copy_from_slice(text.as_bytes());
    field(100, "0000644\0");
    field(108, "0000000\0");
    field(116, "0000000\0");
    let size = format!("{bytes:011o}\0");
    if size.len() > 12 {
        return None;
    }
    field(124, &size);
    field(136, "00000000000\0");
    field(148, "        ");
    field(156, "0");
    field(257, "ustar");
    field(263, "00");
    let sum: u32 = header.iter().map(|b| u32::from(*b)).sum();
    header[148..156].copy_from_slice(format!("{sum:06o}\0 ").as_bytes());
    Some(header)
}

fn sha256(bytes: &[u8]) -> String {
    hex(&Sha256::digest(bytes))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::process::Command;

    fn example() -> (PathBuf, SessionFile) {
        let bundle = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../reports/example");
        let session = typodont_report::cohort::read_session(&bundle.join(SESSION_FILE)).unwrap();
        (bundle, session)
    }

    #[test]
    fn tar_opens_the_concatenated_parts() {
        // Aim: bundles can be restored without this program. Method: concatenate the parts and extract them with tar.
        let (bundle, session) = example();
        let archive = BundleArchive::of(&bundle, &session, "station/id".into()).unwrap();
        let bytes: Vec<u8> = (0..archive.manifest.parts.len()).flat_map(|n| archive.part(n).unwrap()).collect();
        let folder = std::env::temp_dir().join(format!("typodont-pack-{}", std::process::id()));
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(&folder).unwrap();
        fs::write(folder.join("all.tar"), &bytes).unwrap();
        let Ok(output) = Command::new("tar").args(["-xf", "all.tar"]).current_dir(&folder).output() else {
            eprintln!("SKIPPED: tar is not installed");
            return;
        };
        assert!(output.status.success() && output.stderr.is_empty(), "{}", String::from_utf8_lossy(&output.stderr));
        for file in &archive.manifest.files {
            assert_eq!(fs::read(folder.join(&file.name)).unwrap(), fs::read(bundle.join(&file.name)).unwrap());
        }
        fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn every_file_is_extracted_from_its_parts() {
        // Aim: the offsets are right for any part size. Method: divide the example's archive into parts of several
        // sizes and extract every file.
        let (bundle, session) = example();
        let archive = BundleArchive::of(&bundle, &session, "station/id".into()).unwrap();
        let whole: Vec<u8> = (0..archive.manifest.parts.len()).flat_map(|n| archive.part(n).unwrap()).collect();
        for size in [700, 4096, 100_000, whole.len()] {
            let pieces: Vec<&[u8]> = whole.chunks(size).collect();
            let parts = pieces.iter().map(|p| ArchivedPart { bytes: p.len() as u64, sha256: sha256(p) }).collect();
            let manifest = Manifest { parts, ..archive.manifest.clone() };
            for file in &manifest.files {
                let bytes = manifest.extract(file, |n| Ok(pieces[n].to_vec())).unwrap();
                assert_eq!(bytes, fs::read(bundle.join(&file.name)).unwrap(), "{} in parts of {size}", file.name);
            }
            let first = &manifest.files[0];
            assert!(manifest.extract(first, |n| Ok(pieces[n][1..].to_vec())).is_err(), "a truncated part is detected");
        }
    }

    #[test]
    fn a_changed_bundle_is_not_archived() {
        let (bundle, mut session) = example();
        session.digests.insert("views/map-occlusal.png".into(), "00".into());
        assert!(matches!(BundleArchive::of(&bundle, &session, "s/i".into()), Err(ArchiveError::Mismatch(_))));
        session.digests = [("../escape".to_string(), String::new())].into();
        assert!(matches!(BundleArchive::of(&bundle, &session, "s/i".into()), Err(ArchiveError::Mismatch(_))));
    }
}
