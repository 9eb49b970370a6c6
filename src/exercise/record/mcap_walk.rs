//! A reader of the records of an MCAP file that checks every length and checksum before use.
//!
//! Takes bytes. Gives records in order, chunks unpacked, up to the end of the file or the first damage, and says where
//! and why it stopped. Never gives a record that is incomplete or whose checksum is wrong.

use mcap::records::{ChunkHeader, Record, op};
use mcap::{MAGIC, parse_record};

/// Maximum size of an unpacked chunk, bytes. A chunk of this program contains 100 ticks, about 10 kB.
const CHUNK_MAX: u64 = 64 << 20;

/// Size of a record's prefix (kind and length), bytes.
const PREFIX: usize = 9;

/// First kind of record that other programs may define; unknown kinds below it are damage.
const FIRST_PRIVATE_KIND: u8 = 0x80;

/// Offset of the name of the compression in a chunk record: after the prefix, two times, a size and a checksum.
const CHUNK_COMPRESSION: usize = PREFIX + 28;

/// Name of the compression of this program's chunks, as it stands in a chunk record.
const ZSTD: &[u8] = b"\x04\0\0\0zstd";

/// Reason for which reading stopped before the regular end of a file.
#[derive(Debug)]
pub(super) struct Stop {
    /// Byte at which the first record begins that was not read.
    pub at: usize,
    pub what: String,
}

/// Passes every record to `visit`, up to the regular end of the file.
///
/// # Errors
/// Returns where and why reading stopped: the file ends early, a record is damaged, or `visit` refused it.
pub(super) fn walk(bytes: &[u8], mut visit: impl FnMut(Record) -> Result<(), String>) -> Result<(), Stop> {
    if !bytes.starts_with(MAGIC) {
        return Err(Stop { at: 0, what: "not an MCAP file".to_string() });
    }
    let mut at = MAGIC.len();
    while let Some((kind, body)) = next(bytes, at) {
        let is_last = visit_record(kind, body, &mut visit)
            .map_err(|what| Stop { at, what: format!("the record at byte {at}: {what}") })?;
        at += PREFIX + body.len();
        if is_last {
            let rest = &bytes[at..];
            return match () {
                () if rest == MAGIC => Ok(()),
                () if MAGIC.starts_with(rest) => Err(Stop {
                    at,
                    what: format!("the last {} bytes of the file are missing", MAGIC.len() - rest.len()),
                }),
                () => Err(Stop { at, what: format!("{} bytes follow the footer", rest.len()) }),
            };
        }
    }
    let what = match (bytes.len() - at, length(bytes, at)) {
        (0, _) => format!("the file ends at byte {at}, before the footer"),
        (_, Some(length)) => format!("the record at byte {at}: its length {length} exceeds the file"),
        (rest, None) => format!("the record at byte {at} is cut off after {rest} bytes"),
    };
    Err(Stop { at, what })
}

/// Passes a record, or the records of a chunk, to `visit`. Returns true for the last record of a file.
fn visit_record(kind: u8, body: &[u8], visit: &mut impl FnMut(Record) -> Result<(), String>) -> Result<bool, String> {
    if kind == op::ATTACHMENT && !is_attachment(body) {
        return Err("the lengths of an attachment are inconsistent".to_string());
    }
    match parse_record(kind, body).map_err(|e| e.to_string())? {
        Record::Chunk { header, data } => {
            let unpacked = unpack(&header, &data)?;
            let mut inside = 0;
            while inside < unpacked.len() {
                let (kind, body) = next(&unpacked, inside).ok_or("a record of the chunk is truncated")?;
                visit(parse_record(kind, body).map_err(|e| e.to_string())?)?;
                inside += PREFIX + body.len();
            }
        }
        // Zeros, which a file system leaves after a power cut, would otherwise be empty records.
        Record::Unknown { opcode, .. } if opcode < FIRST_PRIVATE_KIND => {
            return Err(format!("there is no kind of record {opcode}"));
        }
        Record::Footer(_) => return Ok(true),
        other => visit(other)?,
    }
    Ok(false)
}

/// Time of the last message in a chunk at or after byte `from`, ns, by the chunk's own header; `None` without a chunk.
pub(super) fn last_time_after(bytes: &[u8], from: usize) -> Option<u64> {
    (from..bytes.len()).rev().find_map(|at| {
        let is_chunk = bytes[at] == op::CHUNK && bytes[at..].get(CHUNK_COMPRESSION..)?.starts_with(ZSTD);
        let (kind, body) = if is_chunk { next(bytes, at)? } else { return None };
        match parse_record(kind, body) {
            Ok(Record::Chunk { header, .. }) => Some(header.message_end_time),
            _ => None,
        }
    })
}

/// Returns the length of a record's body as its prefix states it.
fn length(bytes: &[u8], at: usize) -> Option<u64> {
    let prefix = bytes.get(at..at + PREFIX)?;
    prefix[1..].try_into().ok().map(u64::from_le_bytes)
}

/// Returns the kind and the body of a record; `None` if the bytes end before the record does.
fn next(bytes: &[u8], at: usize) -> Option<(u8, &[u8])> {
    let length = usize::try_from(length(bytes, at)?).ok()?;
    let start = at + PREFIX;
    Some((bytes[at], bytes.get(start..start.checked_add(length)?)?))
}

/// Returns true if the parts of an attachment fit into its body: two times, two texts, the data, a checksum.
fn is_attachment(body: &[u8]) -> bool {
    let text_after = |at: usize| {
        let length = u32::from_le_bytes(body.get(at..at + 4)?.try_into().ok()?);
        Some(at + 4 + length as usize)
    };
    let texts_end = text_after(16).and_then(text_after);
    texts_end.is_some_and(|at| at + 8 + 4 <= body.len())
}

fn unpack(header: &ChunkHeader, data: &[u8]) -> Result<Vec<u8>, String> {
    if header.uncompressed_size > CHUNK_MAX {
        return Err(format!("a chunk of {} bytes exceeds the maximum of {CHUNK_MAX}", header.uncompressed_size));
    }
    let unpacked = match header.compression.as_str() {
        "" => data.to_vec(),
        "zstd" => unzstd(data, header.uncompressed_size as usize)?,
        other => return Err(format!("unsupported chunk compression \"{other}\"")),
    };
    if unpacked.len() as u64 != header.uncompressed_size {
        return Err(format!("a chunk has {} bytes instead of {}", unpacked.len(), header.uncompressed_size));
    }
    if header.uncompressed_crc != 0 && crc32fast::hash(&unpacked) != header.uncompressed_crc {
        return Err("the checksum of a chunk does not match".to_string());
    }
    Ok(unpacked)
}

/// Decompresses Zstandard data of at most `size` bytes.
#[cfg(not(target_family = "wasm"))]
fn unzstd(data: &[u8], size: usize) -> Result<Vec<u8>, String> {
    zstd::bulk::decompress(data, size).map_err(|e| e.to_string())
}

/// The same without C.
#[cfg(target_family = "wasm")]
fn unzstd(data: &[u8], size: usize) -> Result<Vec<u8>, String> {
    use std::io::Read;
    let decoder = ruzstd::decoding::StreamingDecoder::new(data).map_err(|e| e.to_string())?;
    let mut unpacked = Vec::new();
    // One byte more than the header promises is enough to notice.
    decoder.take(size as u64 + 1).read_to_end(&mut unpacked).map_err(|e| e.to_string())?;
    Ok(unpacked)
}
