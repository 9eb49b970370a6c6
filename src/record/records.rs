//! The records of an MCAP file, one after the other, with every length and checksum checked before it is believed.
//!
//! Takes bytes. Gives records, chunks unpacked; of a file that was cut off those before the cut. A record that is there but
//! does not add up is damage, and is named by its byte.

use mcap::records::{ChunkHeader, Record, op};
use mcap::{MAGIC, parse_record};

/// Longest unpacked chunk, bytes. Ours hold 100 ticks, some 10 kB.
const CHUNK_MAX: u64 = 64 << 20;

/// Bytes before a record's body: what it is, and how long.
const PREFIX: usize = 9;

/// Hands every record to `visit`.
pub(super) fn walk(bytes: &[u8], mut visit: impl FnMut(Record) -> Result<(), String>) -> Result<(), String> {
    if !bytes.starts_with(MAGIC) {
        return Err("this is not an MCAP recording".to_string());
    }
    let mut at = MAGIC.len();
    // A whole file ends as it begins; a session that was killed leaves one that just stops.
    let is_whole = bytes.len() >= 2 * MAGIC.len() && bytes.ends_with(MAGIC);
    while let Some((kind, body)) = next(bytes, at) {
        let damaged = |what: String| format!("the record at byte {at}: {what}");
        if kind == op::ATTACHMENT && !is_attachment(body) {
            return Err(damaged("an attachment's lengths do not add up".to_string()));
        }
        let record = parse_record(kind, body).map_err(|e| damaged(e.to_string()))?;
        let is_last = matches!(record, Record::Footer(_));
        match record {
            Record::Chunk { header, data } => {
                let unpacked = unpack(&header, &data).map_err(damaged)?;
                let mut inside = 0;
                while inside < unpacked.len() {
                    let (kind, body) =
                        next(&unpacked, inside).ok_or_else(|| damaged("a chunk's records are cut".into()))?;
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
        true => Err(format!("the record at byte {at}: its length is {}", length(bytes, at).unwrap_or_default())),
        false => Ok(()),
    }
}

fn length(bytes: &[u8], at: usize) -> Option<u64> {
    let prefix = bytes.get(at..at + PREFIX)?;
    prefix[1..].try_into().ok().map(u64::from_le_bytes)
}

/// Kind and body of a record; `None` when the bytes end before it does.
fn next(bytes: &[u8], at: usize) -> Option<(u8, &[u8])> {
    let length = usize::try_from(length(bytes, at)?).ok()?;
    let start = at + PREFIX;
    Some((bytes[at], bytes.get(start..start.checked_add(length)?)?))
}

/// True when the parts of an attachment fit into its body: two times, two texts, the data, a checksum.
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
        return Err(format!("a chunk of {} bytes", header.uncompressed_size));
    }
    let unpacked = match header.compression.as_str() {
        "" => data.to_vec(),
        "zstd" => zstd::bulk::decompress(data, header.uncompressed_size as usize).map_err(|e| e.to_string())?,
        other => return Err(format!("a chunk is compressed by {other}")),
    };
    if unpacked.len() as u64 != header.uncompressed_size {
        return Err(format!("a chunk of {} bytes where {} belong", unpacked.len(), header.uncompressed_size));
    }
    if header.uncompressed_crc != 0 && crc32fast::hash(&unpacked) != header.uncompressed_crc {
        return Err("a chunk's checksum is wrong".to_string());
    }
    Ok(unpacked)
}
