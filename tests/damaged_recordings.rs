//! A recording with a flipped bit, or cut anywhere, is refused in words or read up to the cut: never a panic, never more
//! memory than the file is worth.

use std::sync::LazyLock;
use typodont::record::Recording;

static WHOLE: LazyLock<Vec<u8>> = LazyLock::new(|| std::fs::read("tests/golden/version-2.mcap").unwrap());

fn complaint(bytes: &[u8]) -> Option<String> {
    Recording::parse("x.mcap", bytes).err().map(|e| e.to_string())
}

#[test]
fn every_bit_of_the_first_records_and_many_others() {
    let size = WHOLE.len();
    let ends = (0..700).chain(size - 300..size);
    // A walk over the rest whose steps share no factor with any record's length.
    let middle = (0..120).map(|i| 700 + i * 9973 % (size - 1000));
    for at in ends.chain(middle) {
        let mut bytes = WHOLE.clone();
        bytes[at] ^= 1 << (at % 8);
        if let Some(text) = complaint(&bytes) {
            assert!(text.starts_with("x.mcap") && !text.contains('\0'), "byte {at}: {text}");
        }
    }
}

#[test]
fn absurd_lengths_are_damage() {
    // Once: a length near 2⁶⁴ overflowed, and one of 400 GB was asked of the system.
    for at in [44, 562] {
        for length in [u64::MAX, u64::MAX - 8, 1 << 50, 433_875_648_522] {
            let mut bytes = WHOLE.clone();
            bytes[at..at + 8].copy_from_slice(&length.to_le_bytes());
            complaint(&bytes);
        }
    }
    let mut damaged = 0;
    let mut at = 8;
    while at + 9 < WHOLE.len() - 8 {
        let length = u64::from_le_bytes(WHOLE[at + 1..at + 9].try_into().unwrap()) as usize;
        if damaged < 40 {
            let mut bytes = WHOLE.clone();
            bytes[at + 1..at + 9].copy_from_slice(&(u64::MAX - 3).to_le_bytes());
            let text = complaint(&bytes).expect("a length beyond the file");
            assert!(text.contains(&format!("the record at byte {at}")), "{text}");
            damaged += 1;
        }
        at += 9 + length;
    }
    assert_eq!(damaged, 40);
}

#[test]
fn damage_in_the_middle_is_not_a_break_off() {
    // Aim: what comes after intact chunks is not thrown away in silence. Method: one bit within a chunk's data.
    let mut bytes = WHOLE.clone();
    let at = bytes.len() * 2 / 3;
    bytes[at] ^= 8;
    let text = complaint(&bytes).expect("damage");
    assert!(text.contains("damaged-recording") && text.contains("at byte"), "{text}");
}

#[test]
fn a_cut_anywhere_leaves_what_came_before() {
    let whole = Recording::parse("x.mcap", &WHOLE).unwrap().len();
    let mut last = 0;
    for share in [40, 50, 60, 70, 80, 90, 96] {
        match Recording::parse("x.mcap", &WHOLE[..WHOLE.len() * share / 100]) {
            Ok(recording) => {
                assert!(recording.end.is_none() && recording.len() >= last && recording.len() <= whole);
                last = recording.len();
            }
            Err(error) => assert!(error.to_string().contains("missing"), "{error}"),
        }
    }
    assert!(last > whole / 2, "{last} of {whole}");
}
