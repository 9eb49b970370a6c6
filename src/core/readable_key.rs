//! Random bytes as a key that people can read aloud and copy.
//!
//! Takes random bytes. Gives letters and digits in groups. Never draws the bytes: this crate has no randomness.

/// Letters of a key: 32 that are not mistaken for one another when they are read aloud or copied.
const LETTERS: &[u8; 32] = b"abcdefghjkmnpqrstuvwxyz023456789";

/// Letters in a group.
const GROUP_LETTERS: usize = 5;

/// Number of random bytes for a key of five groups, 125 bits.
pub const KEY_BYTES: usize = 25;

/// Returns one letter for each byte, in groups, such as `k3f9w-…`.
pub fn readable_key(bytes: &[u8]) -> String {
    // 256 is a multiple of 32, so that every letter is equally probable.
    let letters: Vec<char> = bytes.iter().map(|byte| char::from(LETTERS[usize::from(*byte) % LETTERS.len()])).collect();
    letters.chunks(GROUP_LETTERS).map(|group| group.iter().collect::<String>()).collect::<Vec<_>>().join("-")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_byte_has_a_letter_and_every_letter_as_many_bytes() {
        assert_eq!(readable_key(&[0, 1, 31, 32, 255, 7]), "ab9a9-h");
        let all = readable_key(&(0..=255).collect::<Vec<u8>>()).replace('-', "");
        for letter in LETTERS {
            assert_eq!(all.matches(char::from(*letter)).count(), 8);
        }
    }
}
