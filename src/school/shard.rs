//! A share of the work for each of several machines that know nothing of one another.

use sha2::{Digest, Sha256};
use std::str::FromStr;

/// The first of four: `1/4`. Every session is in exactly one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// From 1.
    pub number: u64,
    pub of: u64,
}

impl Shard {
    /// Whether a session is this one's: by a digest of its id, so that shares are even and stay as they are.
    pub fn has(self, session: &str) -> bool {
        let digest = Sha256::digest(session.as_bytes());
        let mark = digest.iter().take(8).fold(0u64, |mark, byte| mark << 8 | u64::from(*byte));
        mark % self.of + 1 == self.number
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Shard, String> {
        let wrong = || format!("\"{text}\" is no share; write 1/8 for the first of eight");
        let (number, of) = text.split_once('/').ok_or_else(wrong)?;
        let shard = Shard { number: number.parse().map_err(|_| wrong())?, of: of.parse().map_err(|_| wrong())? };
        match shard.number >= 1 && shard.number <= shard.of {
            true => Ok(shard),
            false => Err(wrong()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_session_is_in_one_share_and_shares_are_even() {
        let mut counts = [0; 8];
        for n in 0..8000 {
            let id = format!("session {n}");
            let own: Vec<u64> = (1..=8).filter(|&number| Shard { number, of: 8 }.has(&id)).collect();
            assert_eq!(own.len(), 1);
            counts[own[0] as usize - 1] += 1;
        }
        assert!(counts.iter().all(|count| (850..1150).contains(count)), "{counts:?}");
        assert!(["0/4", "5/4", "1", "a/b", "1/0", "-1/4"].iter().all(|text| text.parse::<Shard>().is_err()));
        assert_eq!("4/4".parse(), Ok(Shard { number: 4, of: 4 }));
    }
}
