//! A recording with a flipped bit, or truncated anywhere, is refused with a message or read up to the cut. The reader
//! never panics and never allocates memory out of proportion to the file.

use std::sync::LazyLock;
use typodont_exercise::record::Recording;

static WHOLE: LazyLock<Vec<u8>> = LazyLock::new(|| std::fs::read("tests/golden/version-2.mcap").unwrap());

fn complaint(bytes: &[u8]) -> Option<String> {
    Recording::parse("x.mcap", bytes).err().map(|e| e.to_string())
}

#[test]
fn flipped_bits_in_the_first_records_and_many_others_never_panic() {
    let size = WHOLE.len();
    let ends = (0..700).chain(size - 300..size);
    // Covers the rest in steps that share no factor with the length of any record.
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
    // Regression: a length near 2⁶⁴ overflowed, and one of 400 GB was allocated.
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
            let text = complaint(&bytes).expect("a length beyond the file must be refused");
            assert!(text.contains(&format!("the record at byte {at}")), "{text}");
            damaged += 1;
        }
        at += 9 + length;
    }
    assert_eq!(damaged, 40);
}

#[test]
fn damage_in_the_middle_is_not_mistaken_for_truncation() {
    // Aim: records after intact chunks are not dropped silently. Method: one flipped bit within a chunk's data.
    let mut bytes = WHOLE.clone();
    let at = bytes.len() * 2 / 3;
    bytes[at] ^= 8;
    let text = complaint(&bytes).expect("damage must be refused");
    assert!(text.contains("damaged-recording") && text.contains("at byte"), "{text}");
}

#[test]
fn a_truncated_recording_is_read_up_to_the_cut() {
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
