//! A bundle as one run of bytes, cut into parts that are stored one by one.
//!
//! The run is a tar archive (POSIX.1-1988, ustar), the recording first: `cat` of the parts in the order of their names, into `tar`,
//! gives the bundle back without this program. A part's name holds its digest, so that whoever resumes knows what is there already.

use crate::record;
use crate::report::SessionFile;
use crate::report::bundle::SESSION_FILE;
use crate::scenario::hex;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::fmt;
use std::fs::{self, File};
use std::io::{self, Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::{Component, Path, PathBuf};

/// Bytes of a part but the last: what is sent again after a break, and what is held in memory. 1 to 64 MiB work.
pub const PART_BYTES: u64 = 8 << 20;

/// The recording within a pack.
pub const FILE: &str = record::FILE_NAME;

/// Tar's unit, bytes.
const BLOCK: u64 = 512;

/// Where a bundle's bytes lie in the store. It stands beside the session's row.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    /// Of the store: the station's name and the session's id.
    pub folder: String,
    pub files: Vec<PackedFile>,
    pub parts: Vec<PackedPart>,
}

/// A file of the bundle, and where it begins in the run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PackedFile {
    pub name: String,
    pub offset: u64,
    pub bytes: u64,
    pub sha256: String,
}

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PackedPart {
    pub bytes: u64,
    pub sha256: String,
}

/// Why a bundle is not sent.
#[derive(Debug)]
pub enum Changed {
    /// It is not what its `session.json` says.
    Wrong(String),
    Unreadable(PathBuf, io::Error),
}

impl fmt::Display for Changed {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Changed::Wrong(why) => write!(f, "changed-bundle: {why}; typodont verify says what else differs"),
            Changed::Unreadable(path, error) => write!(f, "unreadable-file: {error}: {}", path.display()),
        }
    }
}

/// A bundle that is about to be sent.
#[derive(Debug)]
pub struct Pack {
    pub manifest: Manifest,
    segments: Vec<Segment>,
}

/// A piece of the run.
#[derive(Debug)]
struct Segment {
    begin: u64,
    bytes: u64,
    source: Source,
}

#[derive(Debug)]
enum Source {
    Header(Box<[u8; BLOCK as usize]>),
    File(PathBuf),
    Zeros,
}

impl Manifest {
    /// A part's name within the store.
    pub fn part_name(&self, index: usize) -> String {
        format!("{}/{index:05}-{}.tar-part", self.folder, self.parts[index].sha256)
    }

    pub fn file(&self, name: &str) -> Option<&PackedFile> {
        self.files.iter().find(|file| file.name == name)
    }

    /// Parts that hold a file, and its place within them put together.
    pub fn parts_of(&self, file: &PackedFile) -> Option<(Range<usize>, Range<usize>)> {
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

    /// A file out of the parts that hold it, if it is the one that is named.
    pub fn take(
        &self,
        file: &PackedFile,
        mut part: impl FnMut(usize) -> Result<Vec<u8>, String>,
    ) -> Result<Vec<u8>, String> {
        let (parts, own) = self.parts_of(file).ok_or(format!("{}: it lies beyond its parts", file.name))?;
        let mut bytes = Vec::new();
        for index in parts {
            let read = part(index)?;
            if sha256(&read) != self.parts[index].sha256 {
                return Err(format!("{}: its bytes are not those that were stored", self.part_name(index)));
            }
            bytes.extend_from_slice(&read);
        }
        let bytes = bytes.get(own).ok_or(format!("{}: it lies beyond its parts", file.name))?.to_vec();
        match sha256(&bytes) == file.sha256 {
            true => Ok(bytes),
            false => Err(format!("{}: its bytes are not those that were packed", file.name)),
        }
    }
}

impl Pack {
    /// Reads a bundle through and cuts it; `folder` is the store's. Each file that its `session.json` names must have the digest
    /// that stands there.
    pub fn of(bundle: &Path, session: &SessionFile, folder: String) -> Result<Pack, Changed> {
        let mut names: Vec<&str> = session.digests.keys().map(String::as_str).filter(|name| *name != FILE).collect();
        names.insert(0, SESSION_FILE);
        if session.digests.contains_key(FILE) {
            names.insert(0, FILE);
        }
        let mut segments = Vec::new();
        let mut files = Vec::new();
        let mut at = 0;
        let mut add = |source: Source, bytes: u64, at: &mut u64| {
            if bytes > 0 {
                segments.push(Segment { begin: *at, bytes, source });
            }
            *at += bytes;
        };
        for name in names {
            if Path::new(name).components().any(|c| !matches!(c, Component::Normal(_))) || !name.is_ascii() {
                return Err(Changed::Wrong(format!("\"{}\" is not a file of a bundle", name.escape_debug())));
            }
            let path = bundle.join(name);
            let unreadable = |e| Changed::Unreadable(path.clone(), e);
            let meta = fs::symlink_metadata(&path).map_err(unreadable)?;
            if !meta.is_file() {
                return Err(Changed::Wrong(format!("{name} is no plain file")));
            }
            let bytes = meta.len();
            let header = header(name, bytes).ok_or(Changed::Wrong(format!("{name}: its name or size is too long")))?;
            add(Source::Header(Box::new(header)), BLOCK, &mut at);
            files.push(PackedFile { name: name.to_string(), offset: at, bytes, sha256: String::new() });
            add(Source::File(path), bytes, &mut at);
            add(Source::Zeros, bytes.next_multiple_of(BLOCK) - bytes, &mut at);
        }
        add(Source::Zeros, 2 * BLOCK, &mut at);
        let mut pack = Pack { manifest: Manifest { folder, files, parts: Vec::new() }, segments };
        pack.digest(at)?;
        for file in &pack.manifest.files {
            match session.digests.get(&file.name) {
                Some(named) if *named != file.sha256 => {
                    return Err(Changed::Wrong(format!("{} is not the one that {SESSION_FILE} names", file.name)));
                }
                _ => {}
            }
        }
        Ok(pack)
    }

    /// Reads everything once: a digest of each part and of each file.
    fn digest(&mut self, length: u64) -> Result<(), Changed> {
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
            self.manifest.parts.push(PackedPart { bytes: end - at, sha256: sha256(&bytes) });
            at = end;
        }
        for (file, digest) in self.manifest.files.iter_mut().zip(file_digests) {
            file.sha256 = hex(&digest.finalize());
        }
        Ok(())
    }

    /// A part's bytes. `Err` where a file changed since the pack was made.
    pub fn part(&self, index: usize) -> Result<Vec<u8>, Changed> {
        let begin: u64 = self.manifest.parts[..index].iter().map(|p| p.bytes).sum();
        let part = &self.manifest.parts[index];
        let bytes = self.read(begin..begin + part.bytes)?;
        match sha256(&bytes) == part.sha256 {
            true => Ok(bytes),
            false => Err(Changed::Wrong("a file changed while it was sent".into())),
        }
    }

    fn read(&self, range: Range<u64>) -> Result<Vec<u8>, Changed> {
        let mut bytes = Vec::with_capacity((range.end - range.start) as usize);
        for segment in &self.segments {
            let (begin, end) = (segment.begin.max(range.start), (segment.begin + segment.bytes).min(range.end));
            if begin >= end {
                continue;
            }
            let (skip, count) = (begin - segment.begin, end - begin);
            match &segment.source {
                Source::Header(header) => bytes.extend_from_slice(&header[skip as usize..(skip + count) as usize]),
                Source::Zeros => bytes.resize(bytes.len() + count as usize, 0),
                Source::File(path) => {
                    let before = bytes.len();
                    let read = File::open(path).and_then(|mut file| {
                        file.seek(SeekFrom::Start(skip))?;
                        file.take(count).read_to_end(&mut bytes)
                    });
                    read.map_err(|e| Changed::Unreadable(path.clone(), e))?;
                    if (bytes.len() - before) as u64 != count {
                        return Err(Changed::Wrong(format!("{} became shorter", path.display())));
                    }
                }
            }
        }
        Ok(bytes)
    }
}

/// A file's header in ustar; none for names of more than 100 bytes or files of 8 GiB and more.
fn header(name: &str, bytes: u64) -> Option<[u8; BLOCK as usize]> {
    let mut header = [0; BLOCK as usize];
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
        let bundle = Path::new(env!("CARGO_MANIFEST_DIR")).join("reports/example");
        let session = crate::report::cohort::read_session(&bundle.join(SESSION_FILE)).unwrap();
        (bundle, session)
    }

    #[test]
    fn a_pack_is_an_archive_that_tar_opens() {
        // Aim: bundles can be had back without this program. Method: the parts, put together, into tar.
        let (bundle, session) = example();
        let pack = Pack::of(&bundle, &session, "station/id".into()).unwrap();
        let bytes: Vec<u8> = (0..pack.manifest.parts.len()).flat_map(|n| pack.part(n).unwrap()).collect();
        let folder = std::env::temp_dir().join(format!("typodont-pack-{}", std::process::id()));
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(&folder).unwrap();
        fs::write(folder.join("all.tar"), &bytes).unwrap();
        let Ok(output) = Command::new("tar").args(["-xf", "all.tar"]).current_dir(&folder).output() else {
            eprintln!("SKIPPED: no tar here");
            return;
        };
        assert!(output.status.success() && output.stderr.is_empty(), "{}", String::from_utf8_lossy(&output.stderr));
        for file in &pack.manifest.files {
            assert_eq!(fs::read(folder.join(&file.name)).unwrap(), fs::read(bundle.join(&file.name)).unwrap());
        }
        fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn every_file_is_found_again_in_its_parts() {
        // Aim: the arithmetic of parts, whatever their size. Method: the example's run cut anew, each file taken out of it.
        let (bundle, session) = example();
        let pack = Pack::of(&bundle, &session, "station/id".into()).unwrap();
        let whole: Vec<u8> = (0..pack.manifest.parts.len()).flat_map(|n| pack.part(n).unwrap()).collect();
        for size in [700, 4096, 100_000, whole.len()] {
            let pieces: Vec<&[u8]> = whole.chunks(size).collect();
            let parts = pieces.iter().map(|p| PackedPart { bytes: p.len() as u64, sha256: sha256(p) }).collect();
            let manifest = Manifest { parts, ..pack.manifest.clone() };
            for file in &manifest.files {
                let bytes = manifest.take(file, |n| Ok(pieces[n].to_vec())).unwrap();
                assert_eq!(bytes, fs::read(bundle.join(&file.name)).unwrap(), "{} in parts of {size}", file.name);
            }
            let first = &manifest.files[0];
            assert!(manifest.take(first, |n| Ok(pieces[n][1..].to_vec())).is_err(), "a bent part is noticed");
        }
    }

    #[test]
    fn a_bundle_that_was_changed_is_not_packed() {
        let (bundle, mut session) = example();
        session.digests.insert("views/map-occlusal.png".into(), "00".into());
        assert!(matches!(Pack::of(&bundle, &session, "s/i".into()), Err(Changed::Wrong(_))));
        session.digests = [("../escape".to_string(), String::new())].into();
        assert!(matches!(Pack::of(&bundle, &session, "s/i".into()), Err(Changed::Wrong(_))));
    }
}
