//! Sealed seeds: what is drawn in an examination stays unknown to everybody until the session has ended.
//!
//! Takes the examiner's code, and the participant, the start and the exercise of a session. Gives the seed; the digest
//! by which a recording commits itself to the seed from its beginning; and the record that reveals the seed at the end.
//! Never keeps the code.
//!
//! The seed depends on the session as well as on the code, so that the same code gives each participant, and each
//! session of a participant, draws of its own. A recording reveals the seed and not the code, which may be used again.
//! Anybody who knows the code before the session ends can compute the draws, and so can anybody who guesses it, at
//! [`ROUNDS`] digests a guess.

use super::file::RecordingHeadFile;
use crate::scenario::hex;
use mcap::MAGIC;
use mcap::records::op;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

/// Name of the metadata record that reveals the seed of a sealed session.
pub(super) const SEED: &str = "seed";

/// Number of SHA-256 digests between a code and its seed: about 20 ms, which slows down the guessing of codes.
const ROUNDS: u32 = 100_000;

/// Fewest characters of an examiner's code.
pub const CODE_MIN: usize = 12;

/// The seed of a session, as revealed at its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct SeedFile {
    pub seed: u64,
}

/// Returns the seed of a session from the examiner's code; below 2⁵³, so that every JSON reader keeps it exactly.
pub fn sealed_seed(code: &str, participant: &str, started: &str, scenario_sha256: &str) -> u64 {
    let mut digest = session_digest("seed", participant, started, scenario_sha256);
    for _ in 0..ROUNDS {
        digest = Sha256::new().chain_update(digest).chain_update(code).finalize().into();
    }
    let [a, b, c, d, e, f, g, h, ..] = digest;
    u64::from_le_bytes([a, b, c, d, e, f, g, h]) >> 11
}

/// Returns the digest by which a recording commits itself to a seed, hexadecimal.
pub(super) fn commitment(head: &RecordingHeadFile, seed: u64) -> String {
    let session = session_digest("commitment", &head.participant, &head.started, &head.scenario_sha256);
    hex(&Sha256::new().chain_update(session).chain_update(seed.to_le_bytes()).finalize())
}

fn session_digest(purpose: &str, participant: &str, started: &str, scenario_sha256: &str) -> [u8; 32] {
    let mut digest = Sha256::new();
    for part in ["typodont", purpose, participant, started, scenario_sha256] {
        digest.update((part.len() as u64).to_le_bytes());
        digest.update(part);
    }
    digest.finalize().into()
}

/// Returns a recording of a session that was cut off, with its sealed seed revealed by the examiner's code.
///
/// # Errors
/// Returns a message if the bytes are not a recording, if its seed is not sealed, or if the code is another one.
pub fn reveal(recording: &[u8], code: &str) -> Result<Vec<u8>, String> {
    let (head, is_revealed) = head(recording)?;
    let Some(expected) = head.seed_sha256.as_deref().filter(|_| !is_revealed) else {
        return Err("the seed of this session is not sealed; finish it without a code".to_string());
    };
    let seed = sealed_seed(code, &head.participant, &head.started, &head.scenario_sha256);
    if commitment(&head, seed) != expected {
        return Err("this is not the code with which the session was sealed".to_string());
    }
    let text = serde_json::to_string(&SeedFile { seed }).map_err(|e| e.to_string())?;
    // The record stands directly after the header: what follows may be cut off anywhere.
    let header_length = recording.get(MAGIC.len() + 1..MAGIC.len() + 9).and_then(|bytes| bytes.try_into().ok());
    let header_length = header_length.map_or(0, u64::from_le_bytes) as usize;
    let at = MAGIC.len() + 9 + header_length;
    let (before, after) = recording.split_at_checked(at).ok_or("the recording has no header")?;
    Ok([before, &metadata_record(SEED, &text), after].concat())
}

/// Returns the bytes of an MCAP metadata record with one entry, "json".
fn metadata_record(name: &str, json: &str) -> Vec<u8> {
    let text = |text: &str| [&(text.len() as u32).to_le_bytes(), text.as_bytes()].concat();
    let entries = [text("json"), text(json)].concat();
    let body = [text(name), (entries.len() as u32).to_le_bytes().to_vec(), entries].concat();
    [&[op::METADATA][..], &(body.len() as u64).to_le_bytes(), &body].concat()
}

/// Returns the head of a recording, which may be cut off, and true if its seed is revealed.
fn head(recording: &[u8]) -> Result<(RecordingHeadFile, bool), String> {
    let (mut head, mut is_revealed) = (None, false);
    // Damage after the head does not matter here.
    let _ = super::mcap_walk::walk(recording, |record| {
        if let mcap::records::Record::Metadata(metadata) = record {
            let text = metadata.metadata.get("json").map_or("", String::as_str);
            match metadata.name.as_str() {
                super::file::HEAD => head = serde_json::from_str::<RecordingHeadFile>(text).ok(),
                SEED => is_revealed = true,
                _ => {}
            }
        }
        Ok(())
    });
    head.map(|head| (head, is_revealed)).ok_or_else(|| "the session metadata is missing".to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_code_gives_every_session_its_own_seed() {
        let seed = sealed_seed("a code of the school", "anna", "2026-05-01T09:00:00Z", "ab");
        assert_eq!(seed, sealed_seed("a code of the school", "anna", "2026-05-01T09:00:00Z", "ab"));
        assert!(seed < 1 << 53);
        for (code, participant, started, scenario) in [
            ("another code of it", "anna", "2026-05-01T09:00:00Z", "ab"),
            ("a code of the school", "berk", "2026-05-01T09:00:00Z", "ab"),
            ("a code of the school", "anna", "2026-05-01T09:00:01Z", "ab"),
            ("a code of the school", "anna", "2026-05-01T09:00:00Z", "ac"),
        ] {
            assert_ne!(seed, sealed_seed(code, participant, started, scenario));
        }
    }
}
