//! No reader shows a result that does not follow from its recording without saying so.

use crate::support::bundle;
use crate::support::coarse_exercise::coarse_exercise;
use crate::support::folder;

use bundle::*;
use folder::folder;
use serde_json::{Value, json};
use sha2::{Digest, Sha256};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use typodont_report::bundle::BundleFolder;
use typodont_report::cohort::Cohort;
use typodont_report::{Templates, VerificationStatus, Verifier};

const EXERCISE: &str = "scenarios/1-introduction.json";

/// An exercise with a rubric, of large voxels.
fn graded(test: &str) -> String {
    coarse_exercise("5-grinding", 0.2, test)
}

/// The program with a cache of replays of this test alone.
fn reader(cache: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(program());
    command.args(arguments).env("TYPODONT_CACHE", cache).current_dir(env!("CARGO_MANIFEST_DIR"));
    command.output().unwrap()
}

fn copy(from: &Path, to: &Path) -> PathBuf {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap().map(Result::unwrap) {
        let (from, to) = (entry.path(), to.join(entry.file_name()));
        if from.is_dir() {
            copy(&from, &to)
        } else {
            fs::copy(&from, &to).map(|_| to).unwrap()
        };
    }
    to.to_path_buf()
}

/// Changes `session.json` and writes it as this program would.
fn forge(bundle: &Path, change: impl FnOnce(&mut Value)) {
    let mut session = session(bundle);
    change(&mut session);
    let text = serde_json::to_string_pretty(&session).unwrap() + "\n";
    // Keys in the order of the file: read into the program's own type and written again.
    let typed: typodont_report::SessionFile = serde_json::from_str(&text).unwrap();
    fs::write(bundle.join("session.json"), typed.to_json()).unwrap();
}

/// Gives every item its maximum, with sums that agree.
fn full_marks(session: &mut Value) {
    let grade = &mut session["grade"];
    for item in grade["items"].as_array_mut().unwrap() {
        item["points"] = item["max_points"].clone();
    }
    for check in grade["hard_fail_checks"].as_array_mut().unwrap() {
        check["failed"] = json!(false);
    }
    grade["hard_fails"] = json!([]);
    grade["points"] = grade["max_points"].clone();
    (grade["passed"], grade["finished"]) = (json!(true), json!(true));
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

#[test]
fn every_reader_says_which_results_follow_from_their_recordings() {
    // Aim: findings 1 and 6 of an attack. Method: an honest bundle; a copy with full marks whose sums agree, under the
    // participant's own code; a copy under another code; a copy with a recording that is not the one of the digests.
    let out = folder("verification_readers");
    let (sessions, cache) = (out.join("sessions"), out.join("cache"));
    let graded = &graded("readers");
    let honest = run(graded, "hasty", &sessions, &["--participant", "HONEST"]);
    let best = run(graded, "hasty", &sessions, &["--participant", "CHEAT", "--seed", "2"]);
    forge(&best, full_marks);
    let thief = copy(&honest, &sessions.join("thief"));
    forge(&thief, |session| session["participant"] = json!("THIEF"));
    let swapped = run(graded, "hasty", &sessions, &["--participant", "SWAP", "--seed", "3"]);
    fs::copy(honest.join("recording.mcap"), swapped.join("recording.mcap")).unwrap();

    let summary = out.join("cohort.json");
    let (page, table) = (out.join("cohort.html"), out.join("cohort.csv"));
    let output = reader(
        &cache,
        &["cohort", text(&sessions), "--json", text(&summary), "--html", text(&page), "--csv", text(&table)],
    );
    let said = complained(&output);
    assert!(output.status.success(), "{said}");
    let summary: Value = serde_json::from_str(&fs::read_to_string(summary).unwrap()).unwrap();
    assert_eq!(summary["verification"], json!({ "verified": 1, "not_verified": 0, "differs": 2 }), "{said}");
    assert_eq!(summary["sessions"], 3, "one recording counts once");
    for name in ["CHEAT", "SWAP"] {
        let listed = summary["not_verified"].as_array().unwrap();
        assert!(
            listed.iter().any(|s| s["participant"] == name && s["verification"] == "differs"),
            "{name}: {listed:?}"
        );
    }
    assert!(said.contains("participant \"THIEF\" has the same recording as") && said.contains("\"HONEST\""), "{said}");
    assert!(said.contains("grade: differs") && said.contains("differs from the recording that was scored"), "{said}");
    let page = fs::read_to_string(page).unwrap();
    assert!(
        page.contains("differs from the recording")
            && page.contains("2 sessions differ")
            && page.contains(">verified<")
    );
    let table = fs::read_to_string(table).unwrap();
    assert!(table.lines().next().unwrap().contains(",verification,verification_note,"));
    assert_eq!(table.lines().filter(|line| line.contains(",verified,,")).count(), 1, "{table}");

    let grades = out.join("grades.csv");
    let arguments = ["gradebook", text(&sessions), "--for", "moodle", "-o", text(&grades)];
    let output = reader(&cache, &arguments);
    let said = complained(&output);
    let written = fs::read_to_string(&grades).unwrap();
    let points = session(&honest)["grade"]["points"].to_string();
    assert!(written.contains(&format!("HONEST,{points},")), "{written}");
    assert!(written.contains("CHEAT,,\"No points are exported") || written.contains("CHEAT,,No points are exported"));
    assert!(!written.contains("THIEF") && said.contains("\"CHEAT\""), "{said}\n{written}");
    let output = reader(&cache, &[&arguments[..], &["--verified"]].concat());
    let written = fs::read_to_string(&grades).unwrap();
    assert!(
        complained(&output).contains("left out: 0 sessions that are not verified, 2 that differ"),
        "{}",
        complained(&output)
    );
    assert!(!written.contains("CHEAT") && written.contains("HONEST"), "{written}");

    let spool = out.join("spool");
    let made = reader(
        &cache,
        &["xapi", "make", text(&sessions), "--spool", text(&spool), "--home-page", "https://school.example"],
    );
    assert!(made.status.success(), "{}", complained(&made));
    let statements = all_text_below(&spool);
    assert_eq!(statements.matches("\"differs\"").count(), 2, "{statements}");
    assert_eq!(statements.matches("\"verified\"").count(), 1);

    let tables = out.join("tables");
    let made = reader(&cache, &["parquet", text(&sessions), "-o", text(&tables), "--verified"]);
    assert!(told(&made).contains("1 sessions") || told(&made).contains("1 session"), "{}", told(&made));
    let written = fs::read(tables.join("sessions.parquet")).unwrap();
    assert!(written.windows(12).any(|window| window == b"verification"), "the column is in the table");
}

fn all_text_below(folder: &Path) -> String {
    let mut text = String::new();
    for entry in fs::read_dir(folder).unwrap().map(Result::unwrap) {
        match entry.path().is_dir() {
            true => text += &all_text_below(&entry.path()),
            false => text += &fs::read_to_string(entry.path()).unwrap_or_default(),
        }
    }
    text
}

#[test]
fn a_forged_copy_does_not_hide_the_session_that_it_copies() {
    // Aim: of two bundles with the same recording, person and time the one counts that its recording confirms. Method: a copy
    // with full marks in a folder that is read first.
    let place = folder("forged_copy");
    let original = run(&graded("original"), "hasty", &place.join("berk"), &["--participant", "BERK"]);
    let forged = copy(&original, &place.join("aaa"));
    forge(&forged, full_marks);
    let mut cohort = Cohort::read(&place);
    cohort.verify(&Verifier::new(&Templates::shipped()), |_| ());
    let [(counted, _)] = &cohort.sessions[..] else { panic!("{:?}", cohort.skipped) };
    assert_eq!((counted, cohort.status(counted)), (&original, &VerificationStatus::Verified));
    assert!(cohort.skipped[0].1.contains("duplicate"), "{:?}", cohort.skipped);
}

#[test]
fn a_replay_is_done_once_per_recording() {
    // Aim: a folder of copies costs one replay, and a damaged entry of the cache costs one more, never a wrong word.
    // Method: entries of the cache are counted, and one is overwritten by another recording's.
    let out = folder("verification_cache");
    let cache = out.join("cache");
    let bundle = run(EXERCISE, "careful", &out.join("a"), &["--participant", "A"]);
    let read = typodont_report::cohort::read_session(&bundle.join("session.json")).unwrap();
    let verifier = Verifier::new(&Templates::shipped()).with_cache(cache.clone(), "test".into());
    let bundle = BundleFolder::on_disk(bundle);
    assert_eq!(verifier.check(&bundle, &read), VerificationStatus::Pending);
    assert_eq!(verifier.verify(&bundle, &read), VerificationStatus::Verified);
    assert_eq!(verifier.check(&bundle, &read), VerificationStatus::Verified);
    let entries: Vec<PathBuf> = fs::read_dir(&cache).unwrap().map(|e| e.unwrap().path()).collect();
    assert_eq!(entries.len(), 1);
    fs::write(&entries[0], "{}").unwrap();
    assert_eq!(verifier.check(&bundle, &read), VerificationStatus::Pending);
    let other = Verifier::new(&Templates::shipped()).with_cache(cache, "another build".into());
    assert_eq!(other.check(&bundle, &read), VerificationStatus::Pending, "another build replays again");
}

/// A change of a session.
type Change = fn(&mut Value);

/// This many measures.
fn many(count: usize) -> Value {
    Value::Object((0..count).map(|n| (format!("m{n}"), json!(1.0))).collect())
}

fn stage(id: &str) -> Value {
    json!({ "id": id, "started_s": 0.0, "ended_s": 1.0, "ended_by": "answer", "answers": [] })
}

#[test]
fn a_session_with_too_much_in_it_is_refused_at_once() {
    // Aim: finding 8: a million measures made a page of 74 MB. Method: each bound is passed by one; the sentence names
    // what is too long or too many.
    let out = folder("verification_bounds");
    let plain = |more: &dyn Fn(&mut Value)| {
        let mut one = json!({
            "version": 1, "scenario": { "id": "x" }, "metrics": { "a": 1.0 }, "participant": "p",
            "grade": { "points": 1.0, "max_points": 2.0, "pass_points": 1.0, "passed": true, "hard_fails": [] },
        });
        more(&mut one);
        let file = out.join("session.json");
        fs::write(&file, one.to_string()).unwrap();
        typodont_report::cohort::read_session(&file).map(|_| ())
    };
    assert_eq!(plain(&|_| ()), Ok(()));
    assert_eq!(plain(&|one| one["metrics"] = many(2000)), Ok(()));
    assert_eq!(plain(&|one| one["participant"] = json!("x".repeat(64))), Ok(()));
    let cases: [(Change, &str); 11] = [
        (|one| one["metrics"] = many(2001), "it has 2001 measures, and the maximum is 2000"),
        (|one| one["metrics"] = many(1_000_000), "MiB, and the maximum is 4 MiB"),
        (|one| one["participant"] = json!("x".repeat(65)), "participant's code has more than 64 characters"),
        (|one| one["scenario"]["id"] = json!("x".repeat(300)), "has more than 256 characters"),
        (|one| one["metrics"]["y".repeat(300)] = json!(1.0), "has more than 256 characters"),
        (|one| one["stages"] = (0..1001).map(|n| stage(&n.to_string())).collect(), "it has 1001 stages"),
        (|one| one["metrics"]["a"] = json!(1e308), "the measure \"a\" is 1e308"),
        (|one| one["metrics"]["a"] = json!(-1.1e15), "the measure \"a\" is -1.1e15"),
        (|one| one["grade"]["points"] = json!(1e308), "points of its grade are invalid"),
        (|one| one["grade"]["points"] = json!(-1), "points of its grade are invalid"),
        (|one| one["started"] = json!("9999-99-99"), "it began in the year 9999"),
    ];
    for (change, expected) in cases {
        let why = plain(&change).unwrap_err();
        assert!(why.contains(expected) && why.len() < 200, "{expected}: {why}");
    }
    let begun = std::time::Instant::now();
    let _ = plain(&|one| one["metrics"] = many(1_000_000));
    let page = out.join("cohort.html");
    let output = reader(&out.join("cache"), &["cohort", text(&out), "--html", text(&page)]);
    assert!(!output.status.success() && complained(&output).contains("maximum is 4 MiB"), "{}", complained(&output));
    println!("a million measures: refused in {:.1} s", begun.elapsed().as_secs_f64());
}

/// Numbers that scatter, the same in every run.
struct Dice(u64);

impl Dice {
    fn below(&mut self, most: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % most.max(1)
    }
}

/// Every file of a bundle, relative to it.
fn files(bundle: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for folder in [bundle.to_path_buf(), bundle.join("views")] {
        for entry in fs::read_dir(folder).into_iter().flatten().map(Result::unwrap) {
            found.extend(Some(entry.path()).filter(|path| path.is_file()));
        }
    }
    found.sort();
    found
}

/// Changes a file at random; returns what was done.
fn change(dice: &mut Dice, file: &Path, others: &[PathBuf]) -> String {
    let mut bytes = fs::read(file).unwrap();
    let at = dice.below(bytes.len());
    let name = file.file_name().unwrap().to_string_lossy().into_owned();
    let done = match dice.below(8) {
        0 => {
            fs::remove_file(file).unwrap();
            return format!("{name} removed");
        }
        1 => {
            bytes.truncate(at);
            format!("{name} cut off at {at}")
        }
        2 => {
            let end = bytes.len().min(at + 1 + dice.below(4096));
            let were = Sha256::digest(&bytes);
            bytes[at..end].fill(0);
            if Sha256::digest(&bytes) == were {
                bytes[at] = 1;
            }
            format!("{name} zeroed from {at} to {end}")
        }
        3 => {
            bytes.insert(at, b' ');
            format!("{name} with a space at {at}")
        }
        4 => {
            let other = fs::read(&others[dice.below(others.len())]).unwrap();
            if other == bytes {
                bytes.push(0)
            } else {
                bytes = other
            }
            format!("{name} replaced by another file")
        }
        _ => {
            let bit = dice.below(8);
            bytes[at] ^= 1 << bit;
            format!("{name} with bit {bit} of byte {at} flipped")
        }
    };
    fs::write(file, bytes).unwrap();
    done
}

/// Changes files of bundles at random, half of the time `session.json`, and reads them as a cohort after each change.
fn none_is_verified(name: &str, bundles: &[PathBuf], count: usize) {
    let out = folder(name);
    let verifier = Verifier::new(&Templates::shipped()).with_cache(out.join("cache"), "test".into());
    let mut dice = Dice(7);
    let mut statuses = std::collections::BTreeMap::new();
    for bundle in bundles {
        let mut cohort = Cohort::read(bundle);
        cohort.verify(&verifier, |_| ());
        let status = cohort.sessions.first().map(|(path, _)| cohort.status(path).clone());
        assert_eq!(status, Some(VerificationStatus::Verified), "{}", bundle.display());
    }
    for number in 0..count {
        let bundle = &bundles[number % bundles.len()];
        let all = files(bundle);
        let file = match number / bundles.len() % 2 {
            0 => bundle.join("session.json"),
            _ => all[dice.below(all.len())].clone(),
        };
        let before = fs::read(&file).unwrap();
        let done = change(&mut dice, &file, &all);
        let mut cohort = Cohort::read(bundle);
        cohort.verify(&verifier, |_| ());
        for (path, _) in &cohort.sessions {
            assert_ne!(
                *cohort.status(path),
                VerificationStatus::Verified,
                "change {number} of {}: {done}",
                bundle.display()
            );
            *statuses.entry(cohort.status(path).name()).or_insert(0) += 1;
        }
        if cohort.sessions.is_empty() {
            *statuses.entry("skipped").or_insert(0) += 1;
        }
        fs::write(&file, before).unwrap();
    }
    println!("{count} changes of {} bundles: {statuses:?}", bundles.len());
}

#[test]
fn no_random_change_leaves_a_result_verified() {
    // Aim: whatever happens to a bundle, no reader says "verified". Method: random changes of bundles of three
    // exercises, read as a cohort.
    let out = folder("verification_random_bundles");
    let exercises = ["1-introduction", "3-detection", "5-grinding"];
    let bundles = exercises.map(|name| run(&format!("scenarios/{name}.json"), "hasty", &out, &[]));
    none_is_verified("verification_random", &bundles, 120);
}

#[test]
#[ignore = "scripts/test --long"]
fn no_random_change_of_any_shipped_exercise_leaves_a_result_verified() {
    // Aim and method as above: a thousand changes of bundles of all shipped exercises.
    let out = folder("verification_random_all_bundles");
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut exercises: Vec<PathBuf> =
        fs::read_dir(root.join("scenarios")).unwrap().map(|e| e.unwrap().path()).collect();
    exercises.retain(|path| path.extension().is_some_and(|e| e == "json") && !text(path).ends_with("schema.json"));
    exercises.sort();
    let bundles: Vec<PathBuf> = exercises.iter().map(|path| run(text(path), "hasty", &out, &[])).collect();
    assert!(bundles.len() >= 15);
    none_is_verified("verification_random_all", &bundles, 1000);
}
