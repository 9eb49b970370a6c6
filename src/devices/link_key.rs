//! Keys of the link between two hands.
//!
//! Takes the key that two people agreed on. Gives one key for each direction. Never keeps what was typed.
//!
//! A datagram lets anybody who recorded it try keys on a computer of their own. The key is therefore stretched by
//! Argon2id, which takes memory and time for every try, and [`generate_key`] gives keys that no list contains.

use argon2::{Algorithm, Argon2, Params, Version};
use hmac::{Hmac, KeyInit, Mac};
use sha2::Sha256;
use typodont_core::readable_key::{KEY_BYTES, readable_key};

/// Cost of stretching: 64 MiB, three passes, one lane; a tenth of a second to half a second once per connection
/// (RFC 9106, section 4, second recommendation, with one lane in place of four). A try cannot be made cheaper than this.
const MEMORY_KIB: u32 = 64 << 10;
const PASSES: u32 = 3;
const LANES: u32 = 1;

/// Salt of the stretching. Both ends must have the same one before they have exchanged anything.
const SALT: &[u8] = b"typodont second hand, protocol 2";

/// Keys of the two directions.
#[derive(Clone)]
pub struct DirectionKeys {
    pub of_connecting_end: [u8; 32],
    pub of_listening_end: [u8; 32],
}

impl DirectionKeys {
    /// Stretches the agreed key and derives the keys of the directions from it.
    pub fn derive(agreed: &str) -> DirectionKeys {
        let params = Params::new(MEMORY_KIB, PASSES, LANES, Some(32)).expect("the costs are within Argon2's limits");
        let mut stretched = [0; 32];
        Argon2::new(Algorithm::Argon2id, Version::V0x13, params)
            .hash_password_into(agreed.as_bytes(), SALT, &mut stretched)
            .expect("the key, the salt and the output have lengths that Argon2 takes");
        DirectionKeys {
            of_connecting_end: expanded(&stretched, b"from the connecting end"),
            of_listening_end: expanded(&stretched, b"from the listening end"),
        }
    }
}

/// Derives a key for a purpose: HKDF-Expand of RFC 5869 with HMAC-SHA-256, of one block.
fn expanded(key: &[u8; 32], purpose: &[u8]) -> [u8; 32] {
    let mut hmac = Hmac::<Sha256>::new_from_slice(key).expect("HMAC takes keys of any length");
    hmac.update(purpose);
    hmac.update(&[1]);
    hmac.finalize().into_bytes().into()
}

/// Returns a new random key, such as `k3f9w-…`.
///
/// # Errors
///
/// Returns a message when the system's random number generator fails.
pub fn generate_key() -> Result<String, String> {
    let mut bytes = [0; KEY_BYTES];
    getrandom::fill(&mut bytes).map_err(|e| format!("the system's random number generator failed: {e}"))?;
    Ok(readable_key(&bytes))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_differ_by_direction_and_by_what_was_agreed() {
        let keys = DirectionKeys::derive("secret");
        let again = DirectionKeys::derive("secret");
        let other = DirectionKeys::derive("secreu");
        assert_eq!(keys.of_connecting_end, again.of_connecting_end);
        let all = [keys.of_connecting_end, keys.of_listening_end, other.of_connecting_end, other.of_listening_end];
        for (n, key) in all.iter().enumerate() {
            assert!(all[n + 1..].iter().all(|other| other != key));
        }
        // Another implementation of Argon2id gives the same bytes (argon2-cffi 25.1, hash_secret_raw).
        let hex: String = keys.of_connecting_end.iter().map(|byte| format!("{byte:02x}")).collect();
        assert_eq!(hex, "d6130a25e789946fcc442b440c6ecb3c2dc5dcc8d0bef36fa5149f9ed5a43107");
    }

    #[test]
    fn generated_keys_are_long_and_never_the_same() {
        let keys: std::collections::BTreeSet<String> = (0..1000).map(|_| generate_key().unwrap()).collect();
        assert_eq!(keys.len(), 1000);
        assert!(keys.iter().all(|key| key.len() == 29 && key.split('-').all(|group| group.len() == 5)));
        let used: std::collections::BTreeSet<char> = keys.iter().flat_map(|key| key.chars()).collect();
        assert_eq!(used.len(), 33, "every letter, and the dash");
    }
}
