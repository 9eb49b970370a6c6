//! A recording with a flipped bit, with zeros or truncated anywhere is read up to the damage, or refused with a message if
//! nothing of it is intact. The reader never panics and never allocates memory out of proportion to the file.

use std::sync::LazyLock;
use typodont_exercise::record::{Recording, RecordingError, ReplayCheck, replay};

static WHOLE: LazyLock<Vec<u8>> = LazyLock::new(|| std::fs::read("tests/golden/version-2.mcap").unwrap());

/// Places at which the chunks of the whole file end, byte by byte from its records' own lengths.
static CHUNK_ENDS: LazyLock<Vec<usize>> = LazyLock::new(|| {
    let mut ends = Vec::new();
    let mut at = 8;
    while at + 9 < WHOLE.len() - 8 {
        let length = u64::from_le_bytes(WHOLE[at + 1..at + 9].try_into().unwrap()) as usize;
        if WHOLE[at] == 6 {
            ends.push(at + 9 + length);
        }
        at += 9 + length;
    }
    ends
});

/// Numbers that look random and are the same in every run (an LCG by Knuth).
struct Numbers(u64);

impl Numbers {
    fn below(&mut self, bound: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) % bound as u64) as usize
    }
}

fn parse(bytes: &[u8]) -> Result<Recording, RecordingError> {
    Recording::parse("x.mcap", bytes)
}

/// Description of the damage that the reader found, whether it could read something or not.
fn damage(bytes: &[u8]) -> Option<String> {
    match parse(bytes) {
        Ok(recording) => recording.loss.map(|loss| loss.what),
        Err(error) => Some(error.to_string()),
    }
}

#[test]
fn flipped_bits_in_the_first_records_and_many_others_never_panic() {
    let size = WHOLE.len();
    let ends = (0..700).chain((size - 300..size).step_by(7));
    // Covers the rest in steps that share no factor with the length of any record.
    let middle = (0..60).map(|i| 700 + i * 9973 * 2 % (size - 1000));
    for at in ends.chain(middle) {
        let mut bytes = WHOLE.clone();
        bytes[at] ^= 1 << (at % 8);
        if let Err(error) = parse(&bytes) {
            let text = error.to_string();
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
            let _ = damage(&bytes);
        }
    }
    let mut damaged = 0;
    let mut at = 8;
    while at + 9 < WHOLE.len() - 8 {
        let length = u64::from_le_bytes(WHOLE[at + 1..at + 9].try_into().unwrap()) as usize;
        if damaged < 40 {
            let mut bytes = WHOLE.clone();
            bytes[at + 1..at + 9].copy_from_slice(&(u64::MAX - 3).to_le_bytes());
            let text = damage(&bytes).expect("a length beyond the file must be noticed");
            assert!(text.contains(&format!("the record at byte {at}")), "{text}");
            damaged += 1;
        }
        at += 9 + length;
    }
    assert_eq!(damaged, 40);
}

#[test]
fn damage_in_the_middle_is_not_mistaken_for_truncation() {
    // Aim: what follows the damage is not dropped silently. Method: one flipped bit within a chunk's data.
    let mut bytes = WHOLE.clone();
    let at = bytes.len() * 2 / 3;
    bytes[at] ^= 8;
    let recording = parse(&bytes).unwrap();
    let loss = recording.loss.as_ref().expect("damage must be noticed");
    assert!(loss.what.contains("at byte") && loss.at_byte <= at && loss.at_byte + loss.bytes == bytes.len());
    assert!(recording.is_cut_off());
    // The last chunk is intact, so the length of the loss is known to its last message.
    let whole = parse(&WHOLE).unwrap().len() as u64;
    assert_eq!(loss.seen_until.unwrap().0, whole);
    let text = recording.describe_loss().unwrap();
    let lost = (whole - recording.len() as u64) as f64 / 1000.0;
    assert!(text.contains(&format!("{lost:.3} s were lost")), "{text}");
}

#[test]
fn a_truncated_recording_is_read_up_to_the_cut() {
    let whole = parse(&WHOLE).unwrap().len();
    let mut last = 0;
    for share in [40, 50, 60, 70, 80, 90, 96] {
        match parse(&WHOLE[..WHOLE.len() * share / 100]) {
            Ok(recording) => {
                assert!(recording.end.is_none() && recording.len() >= last && recording.len() <= whole);
                last = recording.len();
            }
            Err(error) => assert!(matches!(error, RecordingError::NothingRecorded { .. }), "{error}"),
        }
    }
    assert!(last > whole / 2, "{last} of {whole}");
}

#[test]
fn a_session_is_complete_though_the_end_of_its_file_is_torn() {
    // Regression: one to eight missing bytes, or any byte after the end, made the whole recording unreadable.
    let size = WHOLE.len();
    let torn = (1..=8).map(|missing| WHOLE[..size - missing].to_vec());
    let longer = [&b"x"[..], &[0; 40], &[0; 4096]].map(|tail| [&WHOLE, tail].concat());
    let whole = parse(&WHOLE).unwrap();
    assert_eq!(whole.describe_loss(), None);
    for bytes in torn.chain(longer) {
        let recording = parse(&bytes).unwrap();
        assert_eq!((recording.len(), &recording.end), (whole.len(), &whole.end));
        let text = recording.describe_loss().expect("the damage must be named");
        assert!(text.contains("nothing of it was lost"), "{text}");
    }
}

#[test]
fn only_a_file_that_never_held_a_tick_is_called_empty() {
    // Aim: nobody is told to delete a session of which anything was recorded.
    let nothing = [Vec::new(), vec![0; 4096], WHOLE[..60].to_vec(), WHOLE[..CHUNK_ENDS[0] - 1].to_vec()];
    for bytes in nothing {
        let error = parse(&bytes).expect_err("there is nothing to read");
        assert!(matches!(error, RecordingError::NothingRecorded { .. }), "{error}");
    }
    // Damage in the head, in the volume and in the first chunk; and a file of another kind.
    for at in [60, CHUNK_ENDS[0] / 2, CHUNK_ENDS[0] - 50] {
        let mut bytes = WHOLE.clone();
        bytes[at..at + 40].fill(0);
        let error = parse(&bytes).expect_err("no tick can be replayed");
        assert!(matches!(error, RecordingError::Damaged { .. }), "byte {at}: {error}");
    }
    let error = parse(b"not a recording").expect_err("another kind of file");
    assert!(error.to_string().contains("not an MCAP file"), "{error}");
}

/// Damages the recording in one of four ways at `place`: the file ends there; it ends there and zeros follow, as XFS and
/// ext4 leave them; 4 KiB from there on are zero; one bit is flipped.
fn damaged(kind: usize, place: usize) -> Vec<u8> {
    let mut bytes = WHOLE.clone();
    match kind {
        0 => bytes.truncate(place),
        1 => {
            bytes.truncate(place);
            bytes.extend([0; 4096]);
        }
        2 => {
            let end = bytes.len().min(place + 4096);
            bytes[place..end].fill(0);
        }
        _ => bytes[place] ^= 1 << (place % 8),
    }
    bytes
}

/// Damages the recording at `count` places and compares what is read with the chunks that lie before the place.
fn check_damaged(count: usize, seed: u64) {
    let mut numbers = Numbers(seed);
    let ticks = parse(&WHOLE).unwrap().len();
    let first_chunk = CHUNK_ENDS[0];
    let (mut refused, mut replayed) = (0, 0);
    for n in 0..count {
        let kind = n % 4;
        // One in eight places lies anywhere, the others in the ticks: most of the file is the volume.
        let place = match n % 8 {
            0 => numbers.below(WHOLE.len()),
            _ => first_chunk + numbers.below(WHOLE.len() - first_chunk),
        };
        let chunks = CHUNK_ENDS.partition_point(|end| *end <= place);
        let expected = (chunks * 100).min(ticks);
        let bytes = damaged(kind, place);
        match parse(&bytes) {
            Err(error) => {
                assert_eq!(expected, 0, "kind {kind}, byte {place}: {error}");
                refused += 1;
            }
            Ok(recording) => {
                let kept = recording.len();
                assert!(kept >= expected, "kind {kind}, byte {place}: {kept} of {expected} ticks");
                let is_told = recording.loss.is_some() || (kind == 3 && kept == ticks);
                assert!(is_told, "kind {kind}, byte {place}: the damage is not named");
                // A replay compares every force and every digest that was kept.
                if n % 100 < 8 {
                    let again = replay(&recording, recording.workpiece().unwrap(), ReplayCheck::Full, |_, _, _, _| ());
                    assert_eq!(again.difference, None, "kind {kind}, byte {place}");
                    replayed += 1;
                }
            }
        }
    }
    println!("{count} damaged recordings: {refused} without an intact tick, {replayed} replayed without a difference");
    assert!(refused < count / 5 && replayed > count / 20);
}

#[test]
fn every_digest_before_the_damage_is_kept() {
    check_damaged(60, 1);
}

#[test]
#[ignore = "scripts/test --long"]
fn every_digest_before_the_damage_is_kept_at_a_thousand_places() {
    check_damaged(1000, 2);
}
