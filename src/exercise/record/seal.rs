//! Sealed seeds: what is drawn in an examination stays unknown to everybody until the session has ended.
//!
//! Takes the examiner's code, and the participant, the start and the exercise of a session. Gives the seed; the digest
//! by which a recording commits itself to the seed from its beginning; and the record that reveals the seed at the end.
//! Never keeps the code.
//!
//! The seed depends on the session as well as on the code, so that the same code gives each participant, and each
//! session of a participant, draws of its own. A recording reveals the seed and not the code, which may be used again.
//! Anybody who knows the code before the session ends can compute the draws, and so can anybody who guesses it. The code
//! is therefore stretched by Argon2id, which takes memory and time for every guess, on any hardware.

use super::file::{RecordingHeadFile, VERSION};
use crate::scenario::hex;
use argon2::{Algorithm, Argon2, Params, Version};
use mcap::MAGIC;
use mcap::records::op;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

/// Name of the metadata record that reveals the seed of a sealed session.
pub(super) const SEED: &str = "seed";

/// Cost of a guess: 64 MiB, three passes, one lane; a tenth of a second to half a second once per session (RFC 9106,
/// section 4, second recommendation, with one lane in place of four). A changed cost changes all seeds, and with them what
/// `finish` needs of a session that was cut off: it belongs to [`VERSION`].
const MEMORY_KIB: u32 = 64 << 10;
const PASSES: u32 = 3;
const LANES: u32 = 1;

/// First version of recordings whose seeds are derived in this way.
const VERSION_MIN: u32 = 3;

/// Fewest characters of an examiner's code.
pub const CODE_MIN: usize = 12;

/// The seed of a session, as revealed at its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct SeedFile {
    pub seed: u64,
}

/// Returns the seed of a session from the examiner's code; below 2⁵³, so that every JSON reader keeps it exactly. Takes
/// 64 MiB of memory and up to half a second.
pub fn sealed_seed(code: &str, participant: &str, started: &str, scenario_sha256: &str) -> u64 {
    let salt = session_digest("seed", participant, started, scenario_sha256);
    let mut stretched = [0; 32];
    let params = Params::new(MEMORY_KIB, PASSES, LANES, Some(stretched.len()));
    Argon2::new(Algorithm::Argon2id, Version::V0x13, params.expect("the costs are within Argon2's limits"))
        .hash_password_into(code.as_bytes(), &salt, &mut stretched)
        .expect("the code, the salt and the output have lengths that Argon2 takes");
    let [a, b, c, d, e, f, g, h, ..] = stretched;
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
/// Returns a message if the bytes are not a recording, if its seed is not sealed, if its version is not one that
/// this program unseals, or if the code is another one.
pub fn reveal(recording: &[u8], code: &str) -> Result<Vec<u8>, String> {
    let (head, is_revealed) = head(recording)?;
    let Some(expected) = head.seed_sha256.as_deref().filter(|_| !is_revealed) else {
        return Err("the seed of this session is not sealed; finish it without a code".to_string());
    };
    if !(VERSION_MIN..=VERSION).contains(&head.version) {
        return Err(format!(
            "its recording has version {}, and this program unseals versions {VERSION_MIN} to {VERSION}; finish the session with \
             the program that recorded it, typodont {}",
            head.version, head.typodont_version
        ));
    }
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
        // Another implementation of Argon2id gives the same seed (argon2-cffi, hash_secret_raw).
        assert_eq!(seed, 667_621_344_426_805);
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
