//! A reader of the records of an MCAP file that checks every length and checksum before use.
//!
//! Takes bytes. Gives records in order, chunks unpacked; for a truncated file, the records before the cut. Never
//! accepts a complete but inconsistent record: that is damage, reported with its byte offset.

use mcap::records::{ChunkHeader, Record, op};
use mcap::{MAGIC, parse_record};

/// Maximum size of an unpacked chunk, bytes. A chunk of this program contains 100 ticks, about 10 kB.
const CHUNK_MAX: u64 = 64 << 20;

/// Size of a record's prefix (kind and length), bytes.
const PREFIX: usize = 9;

/// Passes every record to `visit`.
///
/// # Errors
/// Returns a description of the first damaged record, or the first error of `visit`.
pub(super) fn walk(bytes: &[u8], mut visit: impl FnMut(Record) -> Result<(), String>) -> Result<(), String> {
    if !bytes.starts_with(MAGIC) {
        return Err("not an MCAP file".to_string());
    }
    let mut at = MAGIC.len();
    // A complete file ends with the magic bytes it starts with; the file of a killed session just stops.
    let is_whole = bytes.len() >= 2 * MAGIC.len() && bytes.ends_with(MAGIC);
    while let Some((kind, body)) = next(bytes, at) {
        let damaged = |what: String| format!("the record at byte {at}: {what}");
        if kind == op::ATTACHMENT && !is_attachment(body) {
            return Err(damaged("the lengths of an attachment are inconsistent".to_string()));
        }
        let record = parse_record(kind, body).map_err(|e| damaged(e.to_string()))?;
        let is_last = matches!(record, Record::Footer(_));
        match record {
            Record::Chunk { header, data } => {
                let unpacked = unpack(&header, &data).map_err(damaged)?;
                let mut inside = 0;
                while inside < unpacked.len() {
                    let (kind, body) =
                        next(&unpacked, inside).ok_or_else(|| damaged("a record of the chunk is truncated".into()))?;
                    visit(parse_record(kind, body).map_err(|e| damaged(e.to_string()))?)?;
                    inside += PREFIX + body.len();
                }
            }
            other => visit(other)?,
        }
        at += PREFIX + body.len();
        if is_last {
            return match bytes[at..] == *MAGIC {
                true => Ok(()),
                false => Err(format!("{} bytes follow the footer", bytes.len() - at)),
            };
        }
    }
    match is_whole {
        true => Err(format!("the record at byte {at}: its length {} is wrong", length(bytes, at).unwrap_or_default())),
        false => Ok(()),
    }
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
