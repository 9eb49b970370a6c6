//! A recording is a proof: whatever is changed afterwards shows, and what was written survives a kill.

mod bundle;

use bundle::*;
use mcap::{Attachment, MessageStream, WriteOptions};
use sha2::{Digest, Sha256};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// A short exercise in which something is cut.
const GRINDING: &str = "scenarios/5-grinding.json";

/// Copies a bundle, so that each forgery starts from a whole one.
fn copy(bundle: &Path, name: &str) -> PathBuf {
    let to = folder(name);
    for file in files(bundle) {
        let target = to.join(&file);
        fs::create_dir_all(target.parent().unwrap()).unwrap();
        fs::copy(bundle.join(&file), target).unwrap();
    }
    to
}

/// Every file of a bundle, relative to it.
fn files(bundle: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut open = vec![bundle.to_path_buf()];
    while let Some(folder) = open.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            match path.is_dir() {
                true => open.push(path),
                false => found.push(path.strip_prefix(bundle).unwrap().to_path_buf()),
            }
        }
    }
    found.sort();
    found
}

fn verify(bundle: &Path) -> Result<(), String> {
    let output = typodont(&["verify", bundle.to_str().unwrap()]);
    match output.status.code() {
        Some(0) => Ok(()),
        Some(1) => Err(complained(&output)),
        other => panic!("exit status {other:?}: {}", complained(&output)),
    }
}

#[test]
fn one_flipped_bit_anywhere_makes_verify_fail_and_name_the_file() {
    let whole = run(GRINDING, "careful", &folder("flip_whole"), &[]);
    verify(&whole).unwrap();
    let forged = copy(&whole, "flip_forged");
    for file in files(&whole) {
        let bytes = fs::read(whole.join(&file)).unwrap();
        // The first and last bytes and some between; of the recording more.
        let places = if file == Path::new("recording.mcap") { 12 } else { 2 };
        for n in 0..=places {
            let at = (bytes.len() - 1) * n / places;
            let mut flipped = bytes.clone();
            flipped[at] ^= 1;
            fs::write(forged.join(&file), flipped).unwrap();
            let complaint = verify(&forged).expect_err(&format!("{} byte {at} may not change", file.display()));
            assert!(complaint.contains(file.to_str().unwrap()), "{}, byte {at}: {complaint}", file.display());
        }
        fs::write(forged.join(&file), bytes).unwrap();
    }
    verify(&forged).unwrap();
}

/// Writes a recording again with some message changed, as a forger would who knows the format.
fn rewritten(bytes: &[u8], mut change: impl FnMut(&str, usize, &mut Vec<u8>)) -> Vec<u8> {
    let mut out = std::io::Cursor::new(Vec::new());
    let mut writer = WriteOptions::new().profile("ros2").create(&mut out).unwrap();
    let summary = mcap::Summary::read(bytes).unwrap().unwrap();
    for index in &summary.metadata_indexes {
        writer.write_metadata(&mcap::read::metadata(bytes, index).unwrap()).unwrap();
    }
    for index in &summary.attachment_indexes {
        let Attachment { name, media_type, data, .. } = mcap::read::attachment(bytes, index).unwrap();
        let copy = Attachment { log_time: 0, create_time: 0, name, media_type, data: Cow::Owned(data.into_owned()) };
        writer.attach(&copy).unwrap();
    }
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    for message in MessageStream::new(bytes).unwrap() {
        let mut message = message.unwrap();
        let topic = message.channel.topic.clone();
        let count = counts.entry(topic.clone()).or_default();
        let mut data = message.data.into_owned();
        change(&topic, *count, &mut data);
        *count += 1;
        message.data = Cow::Owned(data);
        writer.write(&message).unwrap();
    }
    writer.finish().unwrap();
    drop(writer);
    out.into_inner()
}

/// Puts another recording into a bundle and makes `session.json` agree with it.
fn forge(whole: &Path, name: &str, recording: &[u8]) -> PathBuf {
    let forged = copy(whole, name);
    fs::write(forged.join("recording.mcap"), recording).unwrap();
    let mut session = session(&forged);
    let digest: String = Sha256::digest(recording).iter().map(|b| format!("{b:02x}")).collect();
    session["digests"]["recording.mcap"] = digest.into();
    fs::write(forged.join("session.json"), serde_json::to_string_pretty(&session).unwrap() + "\n").unwrap();
    forged
}

#[test]
fn a_forger_who_knows_the_format_is_told_the_tick() {
    let whole = run(GRINDING, "careful", &folder("forger_whole"), &[]);
    let bytes = fs::read(whole.join("recording.mcap")).unwrap();
    // After the encapsulation (4 bytes) and the tick (8) comes the hand's place (12); 44 bytes in, the force.
    let unchanged = forge(&whole, "forger_unchanged", &rewritten(&bytes, |_, _, _| {}));
    // The page names the very bytes it was made from; of the recording itself nothing is wrong.
    let complaint = verify(&unchanged).unwrap_err();
    assert!(!complaint.contains("recording.mcap:") && complaint.contains("report.html"), "{complaint}");
    for (name, offset) in [("hand", 12), ("force", 44)] {
        let forged = rewritten(&bytes, |topic, n, data| {
            if topic == "/haptic" && n == 9000 {
                data[offset] ^= 0x10;
            }
        });
        let complaint = verify(&forge(&whole, &format!("forger_{name}"), &forged)).expect_err(name);
        let line =
            complaint.lines().find(|l| l.contains("recording.mcap: tick")).unwrap_or_else(|| panic!("{complaint}"));
        let tick: u64 = line.split("tick ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
        assert!((9000..9010).contains(&tick), "{name}: {line}");
    }
    // An answer, a confirmation: what a person did is sealed as well.
    let forged = rewritten(&bytes, |topic, n, data| {
        if topic == "/digest" && n == 3 {
            *data = String::from_utf8(data.clone()).unwrap().replace("sha256\":\"", "sha256\":\"0").into_bytes();
        }
    });
    let complaint = verify(&forge(&whole, "forger_digest", &forged)).expect_err("digest");
    assert!(complaint.contains("tick 4000"), "{complaint}");
}

#[test]
fn a_better_grade_written_by_hand_is_named() {
    let whole = run(GRINDING, "hasty", &folder("grade_whole"), &[]);
    let forged = copy(&whole, "grade_forged");
    let mut better = session(&whole);
    better["metrics"]["healthy_per_decay_pct"] = 0.0.into();
    better["grade"]["points"] = 100.0.into();
    fs::write(forged.join("session.json"), serde_json::to_string_pretty(&better).unwrap() + "\n").unwrap();
    let complaint = verify(&forged).expect_err("a grade cannot be written");
    assert!(complaint.contains("metrics.healthy_per_decay_pct") && complaint.contains("grade"), "{complaint}");
}

#[test]
fn scoring_again_gives_the_same_metrics() {
    let bundle = run("scenarios/4-diagnosis.json", "careful", &folder("again"), &[]);
    let output = typodont(&["score", bundle.to_str().unwrap()]);
    let again: serde_json::Value = serde_json::from_str(&told(&output)).unwrap();
    let first = session(&bundle);
    for part in ["metrics", "grade", "stages", "questionnaire"] {
        assert_eq!(again[part], first[part], "{part}");
    }
}
