//! `verify` detects every later change of a bundle, and an interrupted session can be finished.

use crate::support::bundle;
use crate::support::folder;

use bundle::*;
use folder::folder;
use mcap::{Attachment, MessageStream, WriteOptions};
use sha2::{Digest, Sha256};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// A short exercise with cutting.
const GRINDING: &str = "scenarios/5-grinding.json";

/// Copies a bundle, so that each forgery starts from an intact one.
fn copy(bundle: &Path, name: &str) -> PathBuf {
    let to = folder(name);
    for file in files(bundle) {
        let target = to.join(&file);
        fs::create_dir_all(target.parent().unwrap()).unwrap();
        fs::copy(bundle.join(&file), target).unwrap();
    }
    to
}

/// Returns the paths of all files of a bundle, relative to the bundle, sorted.
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
        // The first and the last byte; for the recording also some in between.
        let places = if file == Path::new("recording.mcap") { 8 } else { 1 };
        for n in 0..=places {
            let at = (bytes.len() - 1) * n / places;
            let mut flipped = bytes.clone();
            flipped[at] ^= 1;
            fs::write(forged.join(&file), flipped).unwrap();
            let complaint = verify(&forged).expect_err(&format!("{}: changed byte {at} not detected", file.display()));
            assert!(complaint.contains(file.to_str().unwrap()), "{}, byte {at}: {complaint}", file.display());
        }
        fs::write(forged.join(&file), bytes).unwrap();
    }
    verify(&forged).unwrap();
}

/// Rewrites a recording as a forger who knows the format would. `change` receives each message's topic, its index
/// within the topic and its data; a message whose data is emptied is dropped.
fn rewritten(bytes: &[u8], change: impl FnMut(&str, usize, &mut Vec<u8>)) -> Vec<u8> {
    rewritten_with(bytes, |head| head.to_string(), change)
}

/// Rewrites a recording like [`rewritten`], and its head too.
fn rewritten_with(
    bytes: &[u8],
    head: impl Fn(&str) -> String,
    mut change: impl FnMut(&str, usize, &mut Vec<u8>),
) -> Vec<u8> {
    let mut out = std::io::Cursor::new(Vec::new());
    let mut writer = WriteOptions::new().profile("ros2").create(&mut out).unwrap();
    let summary = mcap::Summary::read(bytes).unwrap().unwrap();
    for index in &summary.metadata_indexes {
        let mut metadata = mcap::read::metadata(bytes, index).unwrap();
        if metadata.name == "session" {
            metadata.metadata.values_mut().for_each(|text| *text = head(text));
        }
        writer.write_metadata(&metadata).unwrap();
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
        if !data.is_empty() {
            message.data = Cow::Owned(data);
            writer.write(&message).unwrap();
        }
    }
    writer.finish().unwrap();
    drop(writer);
    out.into_inner()
}

/// Copies a bundle with another recording and adapts the digest in `session.json`.
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
fn a_forgery_in_the_right_format_is_located_by_its_tick() {
    let whole = run(GRINDING, "careful", &folder("forger_whole"), &[]);
    let bytes = fs::read(whole.join("recording.mcap")).unwrap();
    // A message has the encapsulation (4 bytes), the tick (8), the hand's position at byte 12 and the force at byte
    // 44.
    let unchanged = forge(&whole, "forger_unchanged", &rewritten(&bytes, |_, _, _| {}));
    // The page contains the digest of the original bytes, so only the page is refused, not the recording.
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
    // A changed digest.
    let forged = rewritten(&bytes, |topic, n, data| {
        if topic == "/digest" && n == 3 {
            *data = String::from_utf8(data.clone()).unwrap().replace("sha256\":\"", "sha256\":\"0").into_bytes();
        }
    });
    let complaint = verify(&forge(&whole, "forger_digest", &forged)).expect_err("digest");
    assert!(complaint.contains("tick 4000"), "{complaint}");
}

#[test]
fn changes_of_the_session_metadata_are_detected() {
    // Aim: the seed determines the correct quadrant, and the head the device and the participant; none can be
    // changed.
    let whole = run("scenarios/4-diagnosis.json", "careful", &folder("seal_whole"), &[]);
    let bytes = fs::read(whole.join("recording.mcap")).unwrap();
    let heads: [(&str, &str, &str); 3] = [
        ("seed", "\"seed\":1,", "\"seed\":2,"),
        ("participant", "\"participant\":\"\"", "\"participant\":\"7\""),
        ("stiffness", "\"max_stiffness_n_per_mm\":1.02", "\"max_stiffness_n_per_mm\":1.03"),
    ];
    for (name, from, to) in heads {
        let head = |text: &str| {
            assert!(text.contains(from), "{text}");
            text.replace(from, to)
        };
        let forged = forge(&whole, &format!("seal_{name}"), &rewritten_with(&bytes, head, |_, _, _| {}));
        let complaint = verify(&forged).expect_err(name);
        assert!(complaint.contains("recording.mcap: tick"), "{name}: {complaint}");
    }
}

#[test]
fn events_added_after_the_end_or_dropped_are_detected() {
    let whole = run("scenarios/4-diagnosis.json", "careful", &folder("strays_whole"), &[]);
    let bytes = fs::read(whole.join("recording.mcap")).unwrap();
    // Ratings come after the last tick. In one forgery the last is moved to a later tick, in the other it is dropped.
    let mut last = 0;
    rewritten(&bytes, |topic, n, _| last = if topic == "/event" { n } else { last });
    let late = rewritten(&bytes, |topic, n, data| {
        if topic == "/event" && n == last {
            let text = String::from_utf8(data.clone()).unwrap();
            let (_, rest) = text.split_once(',').unwrap();
            *data = format!("{{\"tick\":1000000000,{rest}").into_bytes();
        }
    });
    let complaint = verify(&forge(&whole, "strays_late", &late)).expect_err("late");
    assert!(complaint.contains("an event of tick 1000000000"), "{complaint}");
    let dropped = rewritten(&bytes, |topic, n, data| {
        if topic == "/event" && n == last {
            data.clear();
        }
    });
    verify(&forge(&whole, "strays_dropped", &dropped)).expect_err("dropped");
}

#[test]
fn a_forged_version_does_not_avoid_the_check() {
    // Aim: a forged result is detected even if it claims to come from another scorer, program or template.
    let whole = run(GRINDING, "hasty", &folder("accused_whole"), &[]);
    for (name, part, value) in [
        ("scorer", "scorer_version", serde_json::json!(0)),
        ("program", "typodont_version", serde_json::json!("0.0.9")),
        ("template", "template_sha256", serde_json::json!("00")),
    ] {
        let forged = copy(&whole, &format!("accused_{name}"));
        let mut better = session(&whole);
        better[part] = value;
        better["metrics"]["healthy_per_decay_pct"] = 0.0.into();
        better["grade"]["passed"] = true.into();
        fs::write(forged.join("session.json"), serde_json::to_string_pretty(&better).unwrap() + "\n").unwrap();
        let complaint = verify(&forged).expect_err(name);
        assert!(complaint.contains("metrics.healthy_per_decay_pct"), "{name}: {complaint}");
    }
    // A different page alone is accepted, since a school may have changed its template, but it is reported as
    // unverified.
    let forged = copy(&whole, "accused_page");
    let page = "<h1>Passed</h1>";
    fs::write(forged.join("report.html"), page).unwrap();
    let mut other = session(&whole);
    other["template_sha256"] = "00".into();
    let digest: String = Sha256::digest(page).iter().map(|b| format!("{b:02x}")).collect();
    other["digests"]["report.html"] = digest.into();
    let text = fs::read_to_string(whole.join("session.json")).unwrap();
    let text = text.replace(session(&whole)["template_sha256"].as_str().unwrap(), "00");
    let text = text.replace(
        session(&whole)["digests"]["report.html"].as_str().unwrap(),
        other["digests"]["report.html"].as_str().unwrap(),
    );
    fs::write(forged.join("session.json"), text).unwrap();
    let output = typodont(&["verify", forged.to_str().unwrap()]);
    assert!(output.status.success(), "{}", complained(&output));
    assert!(told(&output).contains("except: report.html"), "{}", told(&output));
    // A file that does not belong to a bundle.
    let forged = copy(&whole, "accused_unlisted");
    fs::write(forged.join("views/zz.png"), "x").unwrap();
    assert!(verify(&forged).expect_err("unlisted file").contains("views/zz.png: this file is not part of a bundle"));
}

#[test]
fn an_interrupted_session_can_be_finished_but_not_passed() {
    let whole = run(GRINDING, "careful", &folder("cut_whole"), &[]);
    let bytes = fs::read(whole.join("recording.mcap")).unwrap();
    let partial = folder("cut_off").join("session.partial");
    fs::create_dir_all(&partial).unwrap();
    fs::write(partial.join("recording.mcap"), &bytes[..bytes.len() * 97 / 100]).unwrap();
    let output = typodont(&["finish", partial.to_str().unwrap()]);
    assert!(output.status.success(), "{}", complained(&output));
    let finished = PathBuf::from(told(&output).trim());
    assert!(!partial.exists() && finished.ends_with("session"));
    let grade = &session(&finished)["grade"];
    assert_eq!((&grade["finished"], &grade["passed"]), (&false.into(), &false.into()), "{grade}");
}

#[test]
fn a_forged_grade_is_named() {
    let whole = run(GRINDING, "hasty", &folder("grade_whole"), &[]);
    let forged = copy(&whole, "grade_forged");
    let mut better = session(&whole);
    better["metrics"]["healthy_per_decay_pct"] = 0.0.into();
    better["grade"]["points"] = 100.0.into();
    fs::write(forged.join("session.json"), serde_json::to_string_pretty(&better).unwrap() + "\n").unwrap();
    let complaint = verify(&forged).expect_err("a forged grade must be detected");
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
