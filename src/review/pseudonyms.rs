//! Pseudonymous codes of participants for anonymous marking.
//!
//! A participant has the same code in every session as long as the folder's secret is kept. Without the secret a code
//! cannot be traced back to the participant, not even by trying every name.

use super::crypto;
use std::fs::{self, OpenOptions};
use std::io::{ErrorKind, Write};
use std::path::Path;
use typodont_exercise::scenario::hex;

/// Name of the file that contains the secret.
pub const FILE_NAME: &str = "review.secret";

/// Alphabet of Crockford's Base32: without I, L, O and U, so that codes can be read aloud.
const LETTERS: &[u8; 32] = b"0123456789ABCDEFGHJKMNPQRSTVWXYZ";

/// Generator of codes under a folder's secret.
#[derive(Clone)]
pub struct Pseudonymizer {
    secret: [u8; 32],
}

impl Pseudonymizer {
    /// Loads the folder's secret, or returns `None` if there is none.
    ///
    /// # Errors
    ///
    /// Returns a message when the file cannot be read, does not contain a secret, or is accessible to other users.
    pub fn load(folder: &Path) -> Result<Option<Pseudonymizer>, String> {
        let path = folder.join(FILE_NAME);
        let wrong = |what: &str| format!("{}: {what}", path.display());
        let text = match fs::read_to_string(&path) {
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(wrong(&format!("unreadable-file: {error}"))),
            Ok(text) => text,
        };
        if is_open_to_others(&path) {
            return Err(wrong("open-secret: other users can read the file; run chmod 600, or delete it for new codes"));
        }
        let digits = text.trim().as_bytes();
        let byte = |pair: &[u8]| u8::from_str_radix(std::str::from_utf8(pair).unwrap_or_default(), 16).ok();
        let bytes: Vec<u8> = digits.chunks(2).map_while(byte).collect();
        match <[u8; 32]>::try_from(bytes) {
            Ok(secret) if digits.len() == 64 => Ok(Some(Pseudonymizer { secret })),
            _ => Err(wrong("wrong-secret: the file does not contain 64 hexadecimal digits; delete it for new codes")),
        }
    }

    /// Loads the folder's secret, or creates one that only its owner can read.
    ///
    /// # Errors
    ///
    /// Returns a message when the secret cannot be read, created or used.
    pub fn load_or_create(folder: &Path) -> Result<Pseudonymizer, String> {
        if let Some(codes) = Pseudonymizer::load(folder)? {
            return Ok(codes);
        }
        let path = folder.join(FILE_NAME);
        let unwritable = |e: std::io::Error| format!("{}: unwritable-file: {e}", path.display());
        // The file appears atomically, even if two programs create it at the same time: the first to link it wins.
        let partial = folder.join(format!("{FILE_NAME}.{}.partial", std::process::id()));
        let _ = fs::remove_file(&partial);
        let mut options = OpenOptions::new();
        options.write(true).create_new(true);
        #[cfg(unix)]
        std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
        let mut file = options.open(&partial).map_err(unwritable)?;
        file.write_all(format!("{}\n", hex(&crypto::random_bytes()?)).as_bytes()).map_err(unwritable)?;
        file.sync_all().map_err(unwritable)?;
        let linked = fs::hard_link(&partial, &path);
        // File systems without hard links are in practice not shared by two programs.
        let placed = match linked {
            Err(error) if error.kind() == ErrorKind::AlreadyExists => Ok(()),
            Err(_) => fs::rename(&partial, &path),
            Ok(()) => Ok(()),
        };
        let _ = fs::remove_file(&partial);
        placed.map_err(unwritable)?;
        Pseudonymizer::load(folder)?
            .ok_or_else(|| format!("{}: unreadable-file: the file has disappeared", path.display()))
    }

    /// Returns a participant's code. A session without a participant gets a code of its own.
    pub fn code_for(&self, participant: &str, session_id: &str) -> String {
        let tag = match participant {
            "" => crypto::hmac_tag(&self.secret, format!("session\n{session_id}").as_bytes()),
            code => crypto::hmac_tag(&self.secret, format!("participant\n{code}").as_bytes()),
        };
        // 40 bits: among 10 000 participants, two have the same code in one of 20 000 folders.
        let number = tag.iter().take(5).fold(0u64, |number, byte| number << 8 | u64::from(*byte));
        let letters: Vec<u8> = (0..8).rev().map(|place| LETTERS[(number >> (5 * place) & 31) as usize]).collect();
        let text = String::from_utf8_lossy(&letters);
        format!("{}-{}", &text[..4], &text[4..])
    }

    /// Returns an identifier of the secret that reveals nothing about it.
    pub fn fingerprint(&self) -> String {
        hex(&crypto::hmac_tag(&self.secret, b"fingerprint")[..8])
    }
}

/// Returns true if other users have access to the file.
#[cfg(unix)]
fn is_open_to_others(path: &Path) -> bool {
    use std::os::unix::fs::PermissionsExt;
    fs::metadata(path).is_ok_and(|meta| meta.permissions().mode() & 0o077 != 0)
}

/// Always returns false: on other systems the permissions of the folder apply.
#[cfg(not(unix))]
fn is_open_to_others(_: &Path) -> bool {
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_are_stable_and_reveal_nothing() {
        let (a, b) = (Pseudonymizer { secret: [1; 32] }, Pseudonymizer { secret: [2; 32] });
        let code = a.code_for("student-7", "x");
        assert_eq!(code, a.code_for("student-7", "y"));
        assert_ne!(code, b.code_for("student-7", "x"));
        assert_ne!(a.code_for("", "x"), a.code_for("", "y"));
        assert!(code.len() == 9 && code.bytes().all(|b| LETTERS.contains(&b) || b == b'-'), "{code}");
    }
}
