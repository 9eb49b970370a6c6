//! Names that stay: of a session, of a statement, of a person.

use crate::report::SessionFile;
use hmac::{Hmac, KeyInit, Mac};
use sha1::{Digest, Sha1};
use sha2::Sha256;
use std::fmt::Write;

/// RFC 9562's name space of URLs, and what ours hangs from.
const URLS: [u8; 16] = [0x6b, 0xa7, 0xb8, 0x11, 0x9d, 0xad, 0x11, 0xd1, 0x80, 0xb4, 0x00, 0xc0, 0x4f, 0xd4, 0x30, 0xc8];
const OURS: &str = "https://github.com/typodont/typodont/session";

/// Recording's name among a bundle's digests.
const RECORDING: &str = "recording.mcap";

/// Least length of a key that makes pseudonyms, bytes: a shorter one could be found by trying.
pub const KEY_MIN: usize = 16;

/// A session's own identity, the same whenever and wherever it is asked for: UUIDv5 of its recording's SHA-256; of a session that
/// was entered by hand, of its exercise and measures. Scoring it again does not change it.
pub fn session_id(session: &SessionFile) -> String {
    let proof = match session.digests.get(RECORDING) {
        Some(digest) => digest.clone(),
        None => format!("{}\n{:?}", session.scenario.id, session.metrics),
    };
    let name = format!("{proof}\n{}\n{}", session.participant, session.started);
    written(v5(&v5(&URLS, OURS), &name))
}

/// Something's identity within a session.
pub fn part_id(session_id: &str, part: &str) -> String {
    written(v5(&v5(&URLS, OURS), &format!("{session_id}\n{part}")))
}

/// UUID version 5 (RFC 9562, 5.5): SHA-1 of name space and name.
fn v5(space: &[u8; 16], name: &str) -> [u8; 16] {
    let digest = Sha1::new().chain_update(space).chain_update(name.as_bytes()).finalize();
    let mut uuid: [u8; 16] = std::array::from_fn(|i| digest[i]);
    uuid[6] = uuid[6] & 0x0f | 0x50;
    uuid[8] = uuid[8] & 0x3f | 0x80;
    uuid
}

fn written(uuid: [u8; 16]) -> String {
    let mut text = String::with_capacity(36);
    for (index, byte) in uuid.iter().enumerate() {
        if [4, 6, 8, 10].contains(&index) {
            text.push('-');
        }
        let _ = write!(text, "{byte:02x}");
    }
    text
}

/// How people are called outside.
#[derive(Clone, Default)]
pub struct Pseudonyms {
    key: Option<Vec<u8>>,
}

impl Pseudonyms {
    /// Codes as they stand: they should be none's name.
    pub fn codes() -> Pseudonyms {
        Pseudonyms { key: None }
    }

    /// HMAC-SHA256 of the code under a key: whoever lacks the key cannot go back, not even by trying every code.
    ///
    /// `Err` for a key that could be found by trying.
    pub fn keyed(key: &[u8]) -> Result<Pseudonyms, String> {
        match key.len() {
            KEY_MIN.. => Ok(Pseudonyms { key: Some(key.to_vec()) }),
            short => Err(format!("a key of {short} bytes can be found by trying; it takes {KEY_MIN} or more")),
        }
    }

    /// What a participant is called; a session without a code is somebody of its own.
    pub fn of(&self, participant: &str, session_id: &str) -> String {
        match (&self.key, participant) {
            (_, "") => format!("session-{session_id}"),
            (None, code) => code.to_string(),
            (Some(key), code) => {
                let mut hmac = Hmac::<Sha256>::new_from_slice(key).expect("HMAC takes keys of any length");
                hmac.update(code.as_bytes());
                let mark = hmac.finalize().into_bytes();
                mark.iter().take(16).fold("p-".to_string(), |text, byte| text + &format!("{byte:02x}"))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uuids_are_those_of_the_standard() {
        // RFC 9562, A.4: the name www.example.com in the name space of domains.
        let mut domains = URLS;
        domains[3] = 0x10;
        assert_eq!(written(v5(&domains, "www.example.com")), "2ed6657d-e927-568b-95e1-2665a8aea6a2");
    }

    #[test]
    fn pseudonyms_are_the_same_under_one_key_and_others_under_another() {
        let (a, b) = (Pseudonyms::keyed(&[1; 32]).unwrap(), Pseudonyms::keyed(&[2; 32]).unwrap());
        assert_eq!(a.of("student-7", "x"), a.of("student-7", "y"));
        assert_ne!(a.of("student-7", "x"), b.of("student-7", "x"));
        assert!(!a.of("student-7", "x").contains("student"));
        assert_ne!(a.of("", "x"), a.of("", "y"));
        assert!(Pseudonyms::keyed(b"short").is_err());
    }
}
