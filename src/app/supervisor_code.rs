//! The code with which a supervisor closes a kiosk.
//!
//! Takes a code that somebody typed. Gives a digest that a file may hold although every user of the machine can read it:
//! it is stretched by Argon2id, so that trying codes takes time and memory. Never keeps the code.

use argon2::{Algorithm, Argon2, Params, Version};
use std::fmt;

/// Cost of one try: 19 MiB and two passes in one lane, as OWASP recommends; less than a tenth of a second.
const MEMORY_KIB: u32 = 19 << 10;
const PASSES: u32 = 2;
const LANES: u32 = 1;

/// Shortest code, characters.
const LENGTH_MIN: usize = 6;

/// Name of the digest's form, in front of it.
const FORM: &str = "argon2id";

/// Digest of a supervisor's code.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SupervisorCode {
    salt: [u8; 16],
    hash: [u8; 32],
}

impl SupervisorCode {
    /// Digest of a new code.
    ///
    /// # Errors
    /// The code is too short, or the system's random number generator failed.
    pub fn of(code: &str) -> Result<SupervisorCode, String> {
        let length = code.chars().count();
        if length < LENGTH_MIN {
            return Err(format!("short-code: the code has {length} characters; use at least {LENGTH_MIN}"));
        }
        let mut salt = [0; 16];
        getrandom::fill(&mut salt)
            .map_err(|error| format!("no-random: the system's random number generator failed: {error}"))?;
        Ok(SupervisorCode { salt, hash: stretched(code, &salt) })
    }

    /// Reads what [`fmt::Display`] writes; `None` for any other text.
    pub fn parse(text: &str) -> Option<SupervisorCode> {
        let (salt, hash) = text.strip_prefix(FORM)?.strip_prefix(':')?.split_once(':')?;
        Some(SupervisorCode { salt: bytes(salt)?, hash: bytes(hash)? })
    }

    /// True if this is the code.
    pub fn matches(&self, typed: &str) -> bool {
        // Whoever could measure the time of this comparison sits at the machine and can read the digest.
        stretched(typed, &self.salt) == self.hash
    }
}

impl fmt::Display for SupervisorCode {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let hexadecimal = |bytes: &[u8]| bytes.iter().map(|byte| format!("{byte:02x}")).collect::<String>();
        write!(f, "{FORM}:{}:{}", hexadecimal(&self.salt), hexadecimal(&self.hash))
    }
}

fn stretched(code: &str, salt: &[u8]) -> [u8; 32] {
    let params = Params::new(MEMORY_KIB, PASSES, LANES, Some(32)).expect("the costs are within Argon2's limits");
    let mut hash = [0; 32];
    Argon2::new(Algorithm::Argon2id, Version::V0x13, params)
        .hash_password_into(code.as_bytes(), salt, &mut hash)
        .expect("the code, the salt and the output have lengths that Argon2 takes");
    hash
}

fn bytes<const COUNT: usize>(hexadecimal: &str) -> Option<[u8; COUNT]> {
    let is_right = hexadecimal.len() == 2 * COUNT && hexadecimal.bytes().all(|letter| letter.is_ascii_hexdigit());
    let mut found = [0; COUNT];
    for (place, byte) in found.iter_mut().enumerate().take_while(|_| is_right) {
        *byte = u8::from_str_radix(&hexadecimal[2 * place..2 * place + 2], 16).ok()?;
    }
    is_right.then_some(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_code_matches_its_digest() {
        let digest = SupervisorCode::of("lab 2, müdür").unwrap();
        let read = SupervisorCode::parse(&digest.to_string()).unwrap();
        assert_eq!(read, digest);
        assert!(read.matches("lab 2, müdür"));
        assert!(!read.matches("lab 2, müdur") && !read.matches(""));
        assert_ne!(SupervisorCode::of("lab 2, müdür").unwrap(), digest, "every digest has a salt of its own");
        assert!(SupervisorCode::of("short").unwrap_err().contains("at least 6"));
    }

    #[test]
    fn a_digest_of_another_form_is_refused() {
        let digest = SupervisorCode::of("a long code").unwrap().to_string();
        for wrong in [&digest[1..], &digest[..digest.len() - 1], "argon2id:zz:zz", "", &digest.replace(':', "$")] {
            assert_eq!(SupervisorCode::parse(wrong), None, "{wrong}");
        }
    }
}
