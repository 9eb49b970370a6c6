//! ZIP archives of a few files, in memory.
//!
//! Takes files by name and gives an archive, or the other way round. Equal files give equal bytes: an archive carries no
//! time. Never gives a file whose checksum is wrong or whose name leads out of its folder.

use flate2::Compression;
use flate2::bufread::DeflateDecoder;
use flate2::write::DeflateEncoder;
use rawzip::{CompressionMethod, ZipArchive, ZipArchiveWriter};
use std::collections::BTreeMap;
use std::io::{Read, Write};

/// Maximum number of files in an archive that is read: many times what a bundle has.
const FILES_MAX: u64 = 1000;

/// Maximum size of the files of an archive that is read, bytes together: a bundle of the largest volumes has a fifth of
/// that, and an archive that claims more is made to fill the memory.
const BYTES_MAX: u64 = 1 << 30;

/// Error in an archive.
#[derive(Debug)]
pub struct ZipError(String);

impl std::fmt::Display for ZipError {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "this is not a readable ZIP archive: {}", self.0)
    }
}

impl std::error::Error for ZipError {}

fn unreadable(why: impl ToString) -> ZipError {
    ZipError(why.to_string())
}

/// Archive of files, in the given order; a name of a file in a subfolder contains a `/`.
///
/// # Errors
///
/// When a name is longer than the format allows.
pub fn write<'a>(files: impl IntoIterator<Item = (String, &'a [u8])>) -> Result<Vec<u8>, ZipError> {
    let failed = |error: &dyn std::fmt::Display| ZipError(error.to_string());
    let mut bytes = Vec::new();
    let mut archive = ZipArchiveWriter::new(&mut bytes);
    for (name, content) in files {
        let builder = archive.new_file(name.as_str()).compression_method(CompressionMethod::DEFLATE);
        let (mut entry, config) = builder.unix_permissions(0o644).start().map_err(|e| failed(&e))?;
        // Most files of a bundle are compressed already.
        let mut writer = config.wrap(DeflateEncoder::new(&mut entry, Compression::fast()));
        writer.write_all(content).map_err(|e| failed(&e))?;
        let (encoder, descriptor) = writer.finish().map_err(|e| failed(&e))?;
        encoder.finish().map_err(|e| failed(&e))?;
        entry.finish(descriptor).map_err(|e| failed(&e))?;
    }
    archive.finish().map_err(|e| failed(&e))?;
    Ok(bytes)
}

/// Files of an archive, by name; folders are left out.
///
/// # Errors
///
/// When the bytes are not an archive, a file is damaged or encrypted, a name leads out of the folder or stands twice, or
/// the archive is too large.
pub fn read(bytes: &[u8]) -> Result<BTreeMap<String, Vec<u8>>, ZipError> {
    let archive = ZipArchive::from_slice(bytes).map_err(unreadable)?;
    let mut files = BTreeMap::new();
    let mut room = BYTES_MAX;
    let mut entries = archive.entries();
    let mut count = 0;
    while let Some(header) = entries.next_entry().map_err(unreadable)? {
        count += 1;
        if count > FILES_MAX {
            return Err(ZipError(format!("it has more than {FILES_MAX} files")));
        }
        if header.is_dir() {
            continue;
        }
        let raw = header.file_path();
        let name = std::str::from_utf8(raw.as_bytes()).map_err(unreadable)?.to_string();
        // The normalized path differs where the name leads out of the folder, or is absolute.
        if raw.try_normalize().map_err(unreadable)?.as_str() != name {
            return Err(ZipError(format!("the name {name:?} leads out of the folder")));
        }
        let entry = archive.get_entry(header.wayfinder()).map_err(unreadable)?;
        // Programs that read an archive from its start would unpack the file under its other name.
        if entry.local_header().file_path().as_bytes() != name.as_bytes() {
            return Err(ZipError(format!("{name} has another name before its content")));
        }
        let decoder: Box<dyn Read + '_> = match header.compression_method() {
            CompressionMethod::STORE => Box::new(entry.data()),
            CompressionMethod::DEFLATE => Box::new(DeflateDecoder::new(entry.data())),
            _ => return Err(ZipError(format!("{name} is compressed in a way that is not supported"))),
        };
        let mut content = Vec::new();
        let mut reader = entry.verifying_reader(decoder).take(room + 1);
        reader.read_to_end(&mut content).map_err(|e| ZipError(format!("{name}: {e}")))?;
        room = room
            .checked_sub(content.len() as u64)
            .ok_or_else(|| ZipError(format!("its files have more than {} MiB", BYTES_MAX >> 20)))?;
        if files.insert(name.clone(), content).is_some() {
            return Err(ZipError(format!("{name} stands in it twice")));
        }
    }
    match count == archive.entries_hint() {
        true => Ok(files),
        false => Err(ZipError("its end is missing".to_string())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn archive(files: &[(&str, &[u8])]) -> Vec<u8> {
        write(files.iter().map(|(name, bytes)| (name.to_string(), *bytes))).unwrap()
    }

    #[test]
    fn files_survive_an_archive_and_equal_files_give_equal_bytes() {
        let noise: Vec<u8> = (0..100_000u32).map(|n| (n.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
        let files: [(&str, &[u8]); 4] =
            [("a/session.json", b"{}"), ("a/views/front.png", &noise), ("a/empty", b""), ("ä.txt", &[b'x'; 10_000])];
        let packed = archive(&files);
        assert_eq!(packed, archive(&files));
        let read_again = read(&packed).unwrap();
        let expected = files.iter().map(|(name, bytes)| (name.to_string(), bytes.to_vec())).collect();
        assert_eq!(read_again, expected);
    }

    #[test]
    fn a_damaged_archive_is_refused() {
        // Aim: no file is taken for one that it is not. Method: every byte of a small archive is changed and every
        // beginning of it is read; whatever is accepted has the same content.
        let whole = archive(&[("a", b"the first file"), ("b", b"the second file")]);
        let original = read(&whole).unwrap();
        for at in 0..whole.len() {
            assert!(read(&whole[..at]).is_err(), "the first {at} bytes");
            let mut changed = whole.clone();
            changed[at] ^= 1;
            if let Ok(files) = read(&changed) {
                assert!(files.values().eq(original.values()), "byte {at}");
            }
        }
    }

    #[test]
    fn names_that_lead_elsewhere_and_files_that_fill_the_memory_are_refused() {
        let whole = archive(&[("aa/b", b"x")]);
        let renamed = |name: &[u8; 4]| {
            let mut bytes = whole.clone();
            for at in 0..bytes.len() - 4 {
                if &bytes[at..at + 4] == b"aa/b" {
                    bytes[at..at + 4].copy_from_slice(name);
                }
            }
            bytes
        };
        assert!(read(&renamed(b"cc/b")).is_ok());
        for name in [b"../b", b"/b/c", b"a/.."] {
            assert!(read(&renamed(name)).is_err(), "{name:?}");
        }
        let first = whole.windows(4).position(|bytes| bytes == b"aa/b").unwrap();
        let mut local_only = whole.clone();
        local_only[first..first + 4].copy_from_slice(b"cc/b");
        assert!(read(&local_only).unwrap_err().to_string().contains("another name"));
        let many = (0..=FILES_MAX).map(|n| (n.to_string(), &b""[..]));
        assert!(read(&write(many).unwrap()).unwrap_err().to_string().contains("more than 1000 files"));
    }
}
