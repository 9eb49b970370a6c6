//! Stable identifiers of sessions and xAPI statements, and pseudonyms of participants.

use hmac::{Hmac, KeyInit, Mac};
use sha1::{Digest, Sha1};
use sha2::Sha256;
use std::fmt::Write;
use typodont_report::SessionFile;

/// The URL namespace of RFC 9562, and the URL from which the namespace of session ids is derived.
const NAMESPACE_URL: [u8; 16] =
    [0x6b, 0xa7, 0xb8, 0x11, 0x9d, 0xad, 0x11, 0xd1, 0x80, 0xb4, 0x00, 0xc0, 0x4f, 0xd4, 0x30, 0xc8];
const SESSION_NAMESPACE: &str = "https://github.com/typodont/typodont/session";

/// Key of the recording among a bundle's digests.
const RECORDING: &str = "recording.mcap";

/// Minimum length of a pseudonym key, bytes: a shorter key could be found by brute force.
pub const KEY_MIN: usize = 16;

/// Returns a session's id: UUIDv5 of the SHA-256 of its recording, or of its exercise and metrics for a session
/// entered by hand; in both cases together with participant and start time.
///
/// The id is the same on every machine, and rescoring does not change it.
pub fn session_id(session: &SessionFile) -> String {
    let proof = match session.digests.get(RECORDING) {
        Some(digest) => digest.clone(),
        None => format!("{}\n{:?}", session.scenario.id, session.metrics),
    };
    let name = format!("{proof}\n{}\n{}", session.participant, session.started);
    format_uuid(uuid_v5(&uuid_v5(&NAMESPACE_URL, SESSION_NAMESPACE), &name))
}

/// Returns the id of a part of a session, such as one xAPI statement: UUIDv5 of session id and part name.
pub fn part_id(session_id: &str, part: &str) -> String {
    format_uuid(uuid_v5(&uuid_v5(&NAMESPACE_URL, SESSION_NAMESPACE), &format!("{session_id}\n{part}")))
}

/// Computes a version 5 UUID (RFC 9562, 5.5): SHA-1 of namespace and name.
fn uuid_v5(space: &[u8; 16], name: &str) -> [u8; 16] {
    let digest = Sha1::new().chain_update(space).chain_update(name.as_bytes()).finalize();
    let mut uuid: [u8; 16] = std::array::from_fn(|i| digest[i]);
    uuid[6] = uuid[6] & 0x0f | 0x50;
    uuid[8] = uuid[8] & 0x3f | 0x80;
    uuid
}

/// Formats a UUID as 8-4-4-4-12 lower-case hexadecimal digits.
fn format_uuid(uuid: [u8; 16]) -> String {
    let mut text = String::with_capacity(36);
    for (index, byte) in uuid.iter().enumerate() {
        if [4, 6, 8, 10].contains(&index) {
            text.push('-');
        }
        let _ = write!(text, "{byte:02x}");
    }
    text
}

/// Mapping from participant codes to the names under which participants appear in other systems.
#[derive(Clone, Default)]
pub struct Pseudonyms {
    key: Option<Vec<u8>>,
}

impl Pseudonyms {
    /// Uses participant codes unchanged. A code must not be a person's name.
    pub fn plain_codes() -> Pseudonyms {
        Pseudonyms { key: None }
    }

    /// Replaces each code by its HMAC-SHA256 under `key`. Without the key a pseudonym cannot be traced back to its
    /// code, not even by trying every code.
    ///
    /// # Errors
    ///
    /// Returns a message when the key is shorter than 16 bytes.
    pub fn keyed(key: &[u8]) -> Result<Pseudonyms, String> {
        match key.len() {
            KEY_MIN.. => Ok(Pseudonyms { key: Some(key.to_vec()) }),
            short => Err(format!("a key of {short} bytes can be found by brute force; use {KEY_MIN} bytes or more")),
        }
    }

    /// Returns a participant's name in other systems. A session without a code gets a name of its own.
    pub fn name_for(&self, participant: &str, session_id: &str) -> String {
        match (&self.key, participant) {
            (_, "") => format!("session-{session_id}"),
            (None, code) => code.to_string(),
            (Some(key), code) => {
                let mut hmac = Hmac::<Sha256>::new_from_slice(key).expect("HMAC accepts keys of any length");
                hmac.update(code.as_bytes());
                let tag = hmac.finalize().into_bytes();
                tag.iter().take(16).fold("p-".to_string(), |text, byte| text + &format!("{byte:02x}"))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uuids_match_the_standard() {
        // RFC 9562, A.4: the name www.example.com in the DNS namespace.
        let mut domains = NAMESPACE_URL;
        domains[3] = 0x10;
        assert_eq!(format_uuid(uuid_v5(&domains, "www.example.com")), "2ed6657d-e927-568b-95e1-2665a8aea6a2");
    }

    #[test]
    fn pseudonyms_are_stable_under_one_key_and_differ_between_keys() {
        let (a, b) = (Pseudonyms::keyed(&[1; 32]).unwrap(), Pseudonyms::keyed(&[2; 32]).unwrap());
        assert_eq!(a.name_for("student-7", "x"), a.name_for("student-7", "y"));
        assert_ne!(a.name_for("student-7", "x"), b.name_for("student-7", "x"));
        assert!(!a.name_for("student-7", "x").contains("student"));
        assert_ne!(a.name_for("", "x"), a.name_for("", "y"));
        assert!(Pseudonyms::keyed(b"short").is_err());
    }
}
