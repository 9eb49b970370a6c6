//! What participants are called where their work is judged without their names.
//!
//! A code is the same in every session of a person, as long as the folder keeps its secret; without the secret nobody finds the
//! person, not even by trying every name.

use super::chance;
use crate::scenario::hex;
use std::fs::{self, OpenOptions};
use std::io::{ErrorKind, Write};
use std::path::Path;

pub const FILE_NAME: &str = "review.secret";

/// Crockford's letters: no I, L, O, U, so that a code can be read aloud.
const LETTERS: &[u8; 32] = b"0123456789ABCDEFGHJKMNPQRSTVWXYZ";

#[derive(Clone)]
pub struct Codes {
    secret: [u8; 32],
}

impl Codes {
    /// The folder's secret, where there is one.
    ///
    /// `Err` when it cannot be read, is none, or can be read by others.
    pub fn of(folder: &Path) -> Result<Option<Codes>, String> {
        let path = folder.join(FILE_NAME);
        let wrong = |what: &str| format!("{}: {what}", path.display());
        let text = match fs::read_to_string(&path) {
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(wrong(&format!("unreadable-file: {error}"))),
            Ok(text) => text,
        };
        if is_open_to_others(&path) {
            return Err(wrong("open-secret: others can read it; chmod 600 it, or delete it for new codes"));
        }
        let digits = text.trim().as_bytes();
        let byte = |pair: &[u8]| u8::from_str_radix(std::str::from_utf8(pair).unwrap_or_default(), 16).ok();
        let bytes: Vec<u8> = digits.chunks(2).map_while(byte).collect();
        match <[u8; 32]>::try_from(bytes) {
            Ok(secret) if digits.len() == 64 => Ok(Some(Codes { secret })),
            _ => Err(wrong("wrong-secret: it is not 64 hexadecimal digits; delete it for new codes")),
        }
    }

    /// The folder's secret; a new one where there is none. Only its owner can read it.
    pub fn of_or_new(folder: &Path) -> Result<Codes, String> {
        if let Some(codes) = Codes::of(folder)? {
            return Ok(codes);
        }
        let path = folder.join(FILE_NAME);
        let unwritable = |e: std::io::Error| format!("{}: unwritable-file: {e}", path.display());
        // Whole under its own name or not there at all, even where two programs make one at once: the first to link it wins.
        let partial = folder.join(format!("{FILE_NAME}.{}.partial", std::process::id()));
        let _ = fs::remove_file(&partial);
        let mut options = OpenOptions::new();
        options.write(true).create_new(true);
        #[cfg(unix)]
        std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
        let mut file = options.open(&partial).map_err(unwritable)?;
        file.write_all(format!("{}\n", hex(&chance::bytes()?)).as_bytes()).map_err(unwritable)?;
        file.sync_all().map_err(unwritable)?;
        let linked = fs::hard_link(&partial, &path);
        // A disk without hard links has no second program in practice.
        let placed = match linked {
            Err(error) if error.kind() == ErrorKind::AlreadyExists => Ok(()),
            Err(_) => fs::rename(&partial, &path),
            Ok(()) => Ok(()),
        };
        let _ = fs::remove_file(&partial);
        placed.map_err(unwritable)?;
        Codes::of(folder)?.ok_or_else(|| format!("{}: unreadable-file: it is gone again", path.display()))
    }

    /// A participant's code; a session without a participant is somebody of its own.
    pub fn of_participant(&self, participant: &str, session_id: &str) -> String {
        let mark = match participant {
            "" => chance::mark(&self.secret, format!("session\n{session_id}").as_bytes()),
            code => chance::mark(&self.secret, format!("participant\n{code}").as_bytes()),
        };
        // 40 bits: among ten thousand people two are called alike once in twenty thousand folders.
        let number = mark.iter().take(5).fold(0u64, |number, byte| number << 8 | u64::from(*byte));
        let letters: Vec<u8> = (0..8).rev().map(|place| LETTERS[(number >> (5 * place) & 31) as usize]).collect();
        let text = String::from_utf8_lossy(&letters);
        format!("{}-{}", &text[..4], &text[4..])
    }

    /// Tells this secret from another, and nothing else.
    pub fn fingerprint(&self) -> String {
        hex(&chance::mark(&self.secret, b"fingerprint")[..8])
    }
}

#[cfg(unix)]
fn is_open_to_others(path: &Path) -> bool {
    use std::os::unix::fs::PermissionsExt;
    fs::metadata(path).is_ok_and(|meta| meta.permissions().mode() & 0o077 != 0)
}

/// Elsewhere a folder's own permissions rule.
#[cfg(not(unix))]
fn is_open_to_others(_: &Path) -> bool {
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_are_stable_and_say_nothing() {
        let (a, b) = (Codes { secret: [1; 32] }, Codes { secret: [2; 32] });
        let code = a.of_participant("student-7", "x");
        assert_eq!(code, a.of_participant("student-7", "y"));
        assert_ne!(code, b.of_participant("student-7", "x"));
        assert_ne!(a.of_participant("", "x"), a.of_participant("", "y"));
        assert!(code.len() == 9 && code.bytes().all(|b| LETTERS.contains(&b) || b == b'-'), "{code}");
    }
}
