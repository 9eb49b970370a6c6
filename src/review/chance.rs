//! Values that nobody guesses, and comparing them without telling how near a guess came.

use hmac::{Hmac, KeyInit, Mac};
use sha2::Sha256;

/// 32 bytes from the system's source of chance.
pub fn bytes() -> Result<[u8; 32], String> {
    let mut bytes = [0; 32];
    getrandom::fill(&mut bytes).map_err(|e| format!("no-chance: the system has no random numbers for keys: {e}"))?;
    Ok(bytes)
}

/// A key's mark of a text: HMAC-SHA256.
pub fn mark(key: &[u8; 32], text: &[u8]) -> [u8; 32] {
    hmac(key, text).finalize().into_bytes().into()
}

/// Whether a text is the one that was marked. Takes as long for a near guess as for a far one.
pub fn is_marked(key: &[u8; 32], text: &[u8], mark: &[u8; 32]) -> bool {
    hmac(key, text).verify_slice(mark).is_ok()
}

fn hmac(key: &[u8; 32], text: &[u8]) -> Hmac<Sha256> {
    let mut hmac = Hmac::<Sha256>::new_from_slice(key).expect("HMAC takes keys of any length");
    hmac.update(text);
    hmac
}
