//! `verify` detects every later change of a bundle, and an interrupted session can be finished.

use crate::support::bundle;
use crate::support::coarse_exercise::coarse_exercise;
use crate::support::folder;

use bundle::*;
use folder::folder;
use mcap::{Attachment, MessageStream, WriteOptions};
use sha2::{Digest, Sha256};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// A short exercise with cutting, of large voxels: what is proved does not depend on their size.
fn grinding(test: &str) -> String {
    coarse_exercise("5-grinding", 0.2, test)
}

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
        Some(0) => {
            assert!(told(&output).contains(": verified"), "{}", told(&output));
            Ok(())
        }
        Some(1) => Err(complained(&output)),
        other => panic!("exit status {other:?}: {}", complained(&output)),
    }
}

/// The bytes of a file with one bit changed in the byte at a place.
fn flipped(file: &Path, at: usize) -> Vec<u8> {
    let mut bytes = fs::read(file).unwrap();
    bytes[at] ^= 1;
    bytes
}

#[test]
fn one_flipped_bit_anywhere_makes_verify_fail_and_name_the_file() {
    // Aim: no byte of a bundle is left out. Method: in the recording and in the session's file one bit at a time; in all
    // the others, which are compared one by one, the first byte of each at once, then the last, and one file alone.
    let whole = run(&grinding("flip"), "careful", &folder("flip_whole"), &[]);
    verify(&whole).unwrap();
    let forged = copy(&whole, "flip_forged");
    let size = |file: &Path| fs::metadata(whole.join(file)).unwrap().len() as usize;
    let is_named = |flips: &[(&Path, usize)]| {
        for (file, at) in flips {
            fs::write(forged.join(file), flipped(&whole.join(file), *at)).unwrap();
        }
        let complaint = verify(&forged).expect_err(&format!("not detected: {flips:?}"));
        for (file, at) in flips {
            let is_complained_of = complaint.lines().any(|line| line.contains(file.to_str().unwrap()));
            assert!(is_complained_of, "{}, byte {at}: {complaint}", file.display());
            fs::copy(whole.join(file), forged.join(file)).unwrap();
        }
        complaint
    };
    let (sources, derived): (Vec<PathBuf>, Vec<PathBuf>) = files(&whole)
        .into_iter()
        .partition(|file| [Path::new("recording.mcap"), Path::new("session.json")].contains(&file.as_path()));
    assert_eq!(sources.len(), 2);
    for file in &sources {
        let places = if file == Path::new("recording.mcap") { 8 } else { 1 };
        for n in 0..=places {
            is_named(&[(file, (size(file) - 1) * n / places)]);
        }
    }
    is_named(&derived.iter().map(|file| (file.as_path(), 0)).collect::<Vec<_>>());
    is_named(&derived.iter().map(|file| (file.as_path(), size(file) - 1)).collect::<Vec<_>>());
    let complaint = is_named(&[(&derived[0], size(&derived[0]) / 2)]);
    assert!(derived[1..].iter().all(|file| !complaint.contains(file.to_str().unwrap())), "{complaint}");
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
    let whole = run(&grinding("forger"), "careful", &folder("forger_whole"), &[]);
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
    let whole = run("scenarios/4-diagnosis.json", "hasty", &folder("seal_whole"), &[]);
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
    let whole = run("scenarios/4-diagnosis.json", "hasty", &folder("strays_whole"), &[]);
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
    let whole = run(&grinding("accused"), "hasty", &folder("accused_whole"), &[]);
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
    // A page made from templates that are not here cannot be judged: it neither passes nor fails.
    let forged = copy(&whole, "accused_page");
    change_page(&forged, "<h1>Passed</h1>", "00");
    assert_eq!(exit_status(&forged, &[]), (Some(3), true));
    // A file that does not belong to a bundle.
    let forged = copy(&whole, "accused_unlisted");
    fs::write(forged.join("views/zz.png"), "x").unwrap();
    assert!(verify(&forged).expect_err("unlisted file").contains("views/zz.png: this file is not part of a bundle"));
}

/// Exit status of `verify` with further arguments, and whether it says that the page was not judged.
fn exit_status(bundle: &Path, more: &[&str]) -> (Option<i32>, bool) {
    let output = typodont(&[&["verify", bundle.to_str().unwrap()], more].concat());
    (output.status.code(), told(&output).contains("holds, but this was not judged: report.html"))
}

/// Replaces the page of a bundle, and adapts its digest and the digest of its templates, as text.
fn change_page(bundle: &Path, page: &str, template_sha256: &str) {
    fs::write(bundle.join("report.html"), page).unwrap();
    let file = bundle.join("session.json");
    let text = fs::read_to_string(&file).unwrap();
    let before = session(bundle);
    let digest: String = Sha256::digest(page).iter().map(|b| format!("{b:02x}")).collect();
    let text = text.replace(before["template_sha256"].as_str().unwrap(), template_sha256);
    let text = text.replace(before["digests"]["report.html"].as_str().unwrap(), &digest);
    fs::write(file, text).unwrap();
}

#[test]
fn a_school_s_own_page_is_judged_where_its_templates_are() {
    // Aim: 0 only when everything was judged, 3 where the templates are missing, 1 for a forged page. Method: a bundle made
    // in a folder with a template of its own.
    let school = folder("own_templates");
    let templates = school.join("reports/templates");
    fs::create_dir_all(&templates).unwrap();
    let style = fs::read_to_string("reports/templates/report.css").unwrap();
    fs::write(templates.join("report.css"), style + "\nbody { letter-spacing: 0.01em }\n").unwrap();
    let program = |arguments: &[&str]| {
        std::process::Command::new(program()).args(arguments).current_dir(&school).output().unwrap()
    };
    let scenario = coarse_exercise("4-diagnosis", 0.3, "own_templates");
    let output = program(&["run", &scenario, "--headless", "--seed", "1", "--out", "sessions"]);
    assert!(output.status.success(), "{}", complained(&output));
    let bundle = school.join(told(&output).trim());
    let of_school = ["--templates", templates.to_str().unwrap()];
    assert_eq!(exit_status(&bundle, &[]), (Some(3), true));
    assert_eq!(exit_status(&bundle, &of_school), (Some(0), false));
    let here = program(&["verify", bundle.to_str().unwrap()]);
    assert_eq!(here.status.code(), Some(0), "{}", complained(&here));
    // The same templates named for another page.
    let forged = copy(&bundle, "own_templates_forged");
    let digest = session(&bundle)["template_sha256"].as_str().unwrap().to_string();
    change_page(&forged, "<h1>Passed</h1>", &digest);
    assert_eq!(exit_status(&forged, &of_school), (Some(1), false));
    assert_eq!(exit_status(&forged, &["--templates", "no-such-folder"]), (Some(2), false));
}

/// Finishes a recording as an interrupted session. Returns the bundle and what was said about the loss.
fn finish(name: &str, recording: &[u8]) -> (PathBuf, String) {
    let partial = folder(name).join("session.partial");
    fs::create_dir_all(&partial).unwrap();
    fs::write(partial.join("recording.mcap"), recording).unwrap();
    let output = typodont(&["finish", partial.to_str().unwrap()]);
    assert!(output.status.success(), "{name}: {}", complained(&output));
    let finished = PathBuf::from(told(&output).trim());
    assert!(!partial.exists() && finished.ends_with("session"), "{name}");
    (finished, complained(&output))
}

/// Byte within the data of the last chunk that begins before `place`. Between the chunks stand indexes, which no replay
/// needs: a changed bit there is no loss.
fn inside_a_chunk(recording: &[u8], place: usize) -> usize {
    let (mut at, mut chunk) = (8, 0);
    while at < place {
        let length = u64::from_le_bytes(recording[at + 1..at + 9].try_into().unwrap()) as usize;
        if recording[at] == 6 {
            chunk = at;
        }
        at += 9 + length;
    }
    chunk + 200
}

#[test]
fn an_interrupted_session_can_be_finished_but_not_passed() {
    // Aim: whatever a power cut leaves, the session before it is kept, its loss is told, and the bundle verifies as what
    // it is.
    let whole = run(&coarse_exercise("5-grinding", 0.3, "cut"), "hasty", &folder("cut_whole"), &[]);
    let bytes = fs::read(whole.join("recording.mcap")).unwrap();
    let size = bytes.len();
    let mut flipped = bytes.clone();
    flipped[inside_a_chunk(&bytes, size * 9 / 10)] ^= 1;
    let with_zeros = [&bytes[..inside_a_chunk(&bytes, size * 95 / 100)], &[0; 4096]].concat();
    for (name, recording, words) in [
        ("cut_off", &bytes[..size * 97 / 100], "cut off before its end: what followed"),
        ("cut_zeros", &with_zeros, "s were lost"),
        ("cut_flipped", &flipped, "s were lost"),
    ] {
        let (finished, complaint) = finish(name, recording);
        assert!(complaint.contains(words), "{name}: {complaint}");
        let grade = &session(&finished)["grade"];
        assert_eq!((&grade["finished"], &grade["passed"]), (&false.into(), &false.into()), "{name}: {grade}");
        verify(&finished).unwrap_or_else(|e| panic!("{name}: {e}"));
        let output = typodont(&["score", finished.to_str().unwrap()]);
        assert!(output.status.success() && complained(&output).contains(words), "{name}: {}", complained(&output));
        // A recording alone does not say that it was meant to end there.
        let output = typodont(&["verify", finished.join("recording.mcap").to_str().unwrap()]);
        assert_eq!(output.status.code(), Some(3), "{name}: {}", complained(&output));
        // It is no way to hide the end of a complete session.
        let forged = forge(&whole, &format!("{name}_forged"), recording);
        let complaint = verify(&forged).expect_err(name);
        assert!(complaint.contains("session.json: grade") && complaint.contains(words), "{name}: {complaint}");
    }
    // A torn end takes nothing from the session.
    let (finished, complaint) = finish("cut_torn", &bytes[..size - 3]);
    assert!(complaint.contains("nothing of it was lost"), "{complaint}");
    assert_eq!(session(&finished)["grade"], session(&whole)["grade"]);
    verify(&finished).unwrap();
}

#[test]
fn an_unfinished_session_names_what_to_do() {
    let partial = folder("unfinished").join("session.partial");
    fs::create_dir_all(&partial).unwrap();
    let path = partial.to_str().unwrap();
    // Killed in its first milliseconds: no recording, an empty one, or one without a tick.
    let whole = run(&grinding("unfinished"), "careful", &folder("unfinished_whole"), &[]);
    let bytes = fs::read(whole.join("recording.mcap")).unwrap();
    for content in [None, Some(&bytes[..0]), Some(&bytes[..60])] {
        if let Some(content) = content {
            fs::write(partial.join("recording.mcap"), content).unwrap();
        }
        let output = typodont(&["finish", path]);
        assert_eq!(output.status.code(), Some(1));
        let complaint = complained(&output);
        assert!(complaint.contains("nothing was recorded") && complaint.contains("may be deleted"), "{complaint}");
        assert_eq!(complaint.lines().count(), 1, "{complaint}");
    }
    fs::write(partial.join("recording.mcap"), &bytes).unwrap();
    let complaint = verify(&partial).expect_err("unfinished");
    assert!(complaint.contains(&format!("`typodont finish {path}` makes its bundle")), "{complaint}");
    let output = typodont(&["finish", partial.with_file_name("other.partial").to_str().unwrap()]);
    assert!(complained(&output).contains("there is no folder of this name"), "{}", complained(&output));
}

#[test]
fn a_file_in_the_place_of_the_output_folder_is_named() {
    let file = folder("file_as_folder").join("file");
    fs::write(&file, "x").unwrap();
    for out in [file.clone(), file.join("below")] {
        let output = typodont(&["run", "scenarios/5-grinding.json", "--headless", "--out", out.to_str().unwrap()]);
        assert_eq!(output.status.code(), Some(2));
        let expected = format!("--out: {} is a file, not a folder", file.display());
        assert_eq!(complained(&output).trim(), expected);
    }
}

#[cfg(unix)]
#[test]
fn a_size_limit_ends_a_session_with_a_sentence_and_without_a_loss() {
    // Aim: the limit for files, like a full disk, is met while the session is recorded and while its report is made. Method:
    // `ulimit -f` in units of 512 bytes; first below the size of the recording, then between that and the report's.
    // Of a short session: its report is larger than its recording.
    let exercise = grinding("limit");
    let whole = run(&exercise, "hasty", &folder("limit_whole"), &[]);
    let size = |name: &str| fs::metadata(whole.join(name)).unwrap().len();
    let (recording, page) = (size("recording.mcap"), size("report.html"));
    assert!(page > recording + 20_000, "the page has {page} bytes, the recording {recording}");
    for (name, limit, words) in [
        ("limit_recording", recording * 9 / 10, "the recording cannot be written: the file has reached the size limit"),
        ("limit_report", recording + 10_000, "the file has reached the size limit"),
    ] {
        let out = folder(name);
        let command = format!("ulimit -f {}; exec \"$0\" \"$@\"", limit / 512);
        let session = ["--operator", "hasty", "--seed", "1", "--out", out.to_str().unwrap()];
        let arguments = [&[program(), "run", &exercise, "--headless"], &session[..]].concat();
        let output = std::process::Command::new("sh").arg("-c").arg(command).args(arguments).output().unwrap();
        let complaint = complained(&output);
        assert_eq!(output.status.code(), Some(1), "{name}: {complaint}");
        assert!(complaint.contains(words), "{name}: {complaint}");
        let partial = fs::read_dir(&out).unwrap().next().unwrap().unwrap().path();
        assert!(
            complaint.contains(&format!("`typodont finish {}` makes the bundle", partial.display())),
            "{complaint}"
        );
        let output = typodont(&["finish", partial.to_str().unwrap()]);
        assert!(output.status.success(), "{name}: {}", complained(&output));
        verify(Path::new(told(&output).trim())).unwrap_or_else(|e| panic!("{name}: {e}"));
    }
}

#[test]
fn a_forged_grade_is_named() {
    let whole = run(&grinding("grade"), "hasty", &folder("grade_whole"), &[]);
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
    let bundle = run("scenarios/4-diagnosis.json", "hasty", &folder("again"), &[]);
    let output = typodont(&["score", bundle.to_str().unwrap()]);
    let again: serde_json::Value = serde_json::from_str(&told(&output)).unwrap();
    let first = session(&bundle);
    for part in ["metrics", "grade", "stages", "questionnaire"] {
        assert_eq!(again[part], first[part], "{part}");
    }
}
