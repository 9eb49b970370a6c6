//! Random secrets, and HMAC tags with constant-time verification.

use hmac::{Hmac, KeyInit, Mac};
use sha2::Sha256;

/// Returns 32 bytes from the system's cryptographic random number generator.
///
/// # Errors
///
/// Returns a message when the generator is not available.
pub fn random_bytes() -> Result<[u8; 32], String> {
    let mut bytes = [0; 32];
    getrandom::fill(&mut bytes).map_err(|e| format!("no-chance: the system's random number generator failed: {e}"))?;
    Ok(bytes)
}

/// Computes the HMAC-SHA256 of a text.
pub fn hmac_tag(key: &[u8; 32], text: &[u8]) -> [u8; 32] {
    keyed_hmac(key, text).finalize().into_bytes().into()
}

/// Returns true if `tag` is the HMAC-SHA256 of `text`. The comparison takes constant time.
pub fn verify_tag(key: &[u8; 32], text: &[u8], tag: &[u8; 32]) -> bool {
    keyed_hmac(key, text).verify_slice(tag).is_ok()
}

fn keyed_hmac(key: &[u8; 32], text: &[u8]) -> Hmac<Sha256> {
    let mut hmac = Hmac::<Sha256>::new_from_slice(key).expect("HMAC accepts keys of any length");
    hmac.update(text);
    hmac
}
