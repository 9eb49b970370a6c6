//! Division of sessions among machines that do not communicate.

use sha2::{Digest, Sha256};
use std::str::FromStr;

/// One of `of` disjoint subsets of all sessions, written `1/4` for the first of four. Every session is in exactly one
/// shard.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// Number of this shard, from 1 to `of`.
    pub number: u64,
    pub of: u64,
}

impl Shard {
    /// Returns true if the session with this id belongs to this shard. The digest of the id decides, so shards have
    /// equal sizes on average and never change.
    pub fn contains(self, session: &str) -> bool {
        let digest = Sha256::digest(session.as_bytes());
        let hash = digest.iter().take(8).fold(0u64, |hash, byte| hash << 8 | u64::from(*byte));
        hash % self.of + 1 == self.number
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Shard, String> {
        let wrong = || format!("\"{text}\" is not a shard; write 1/8 for the first of eight");
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
    fn every_session_is_in_one_shard_and_shards_are_even() {
        let mut counts = [0; 8];
        for n in 0..8000 {
            let id = format!("session {n}");
            let own: Vec<u64> = (1..=8).filter(|&number| Shard { number, of: 8 }.contains(&id)).collect();
            assert_eq!(own.len(), 1);
            counts[own[0] as usize - 1] += 1;
        }
        assert!(counts.iter().all(|count| (850..1150).contains(count)), "{counts:?}");
        assert!(["0/4", "5/4", "1", "a/b", "1/0", "-1/4"].iter().all(|text| text.parse::<Shard>().is_err()));
        assert_eq!("4/4".parse(), Ok(Shard { number: 4, of: 4 }));
    }
}
