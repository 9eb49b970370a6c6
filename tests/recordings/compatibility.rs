//! What `docs/compatibility.md` promises: everything that a released version offered is still there.
//!
//! `tests/golden/contract-VERSION.txt` lists what a version offered, a line each: commands, options, keys of exercises, keys
//! of `session.json`, files of a bundle. A line is never deleted. For a new release write the list anew:
//! `cargo test --all-features --test recordings write_the_contract -- --ignored --nocapture`.

use crate::support::bundle::{complained, run, told, typodont};
use crate::support::folder::folder;
use serde_json::Value;
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

fn golden() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden")
}

/// Commands and options as the help lists them, below a command.
fn add_commands(words: &[&str], lines: &mut BTreeSet<String>) {
    let output = typodont(&[words, &["--help"]].concat());
    assert!(output.status.success(), "{words:?}: {}", complained(&output));
    let (mut is_command, text) = (false, told(&output));
    for line in text.lines() {
        if !line.starts_with(' ') {
            is_command = line == "Commands:";
        }
        let first = line.split_whitespace().find(|word| !(word.len() == 3 && word.ends_with(','))).unwrap_or_default();
        let indent = line.len() - line.trim_start().len();
        if is_command && indent == 2 && first != "help" {
            let inner = [words, &[first]].concat();
            lines.insert(format!("command {}", inner.join(" ")));
            add_commands(&inner, lines);
        } else if indent <= 6 && first.starts_with("--") {
            lines.insert(format!("option {} {first}", words.join(" ")));
        }
    }
}

/// Keys of a schema, by the names of the types that hold them.
fn add_schema(schema: &Value, place: &str, lines: &mut BTreeSet<String>) {
    if let Some(properties) = schema.get("properties").and_then(Value::as_object) {
        lines.extend(properties.keys().map(|key| format!("exercise {place}.{key}")));
    }
    if let Some(words) = schema.get("enum").and_then(Value::as_array) {
        lines.extend(words.iter().filter_map(Value::as_str).map(|word| format!("exercise {place}=\"{word}\"")));
    }
    for (name, inner) in schema.get("$defs").and_then(Value::as_object).into_iter().flatten() {
        add_schema(inner, name, lines);
    }
    let forms = ["oneOf", "anyOf"].iter().filter_map(|key| schema.get(*key)?.as_array());
    for form in forms.flatten() {
        add_schema(form, place, lines);
    }
}

/// Keys of a value that the program wrote, lists as `[]`.
fn add_keys(kind: &str, value: &Value, place: &str, lines: &mut BTreeSet<String>) {
    match value {
        Value::Object(map) => map.iter().for_each(|(key, inner)| {
            let place = if place.is_empty() { key.clone() } else { format!("{place}.{key}") };
            lines.insert(format!("{kind} {place}"));
            add_keys(kind, inner, &place, lines);
        }),
        Value::Array(list) => list.iter().for_each(|inner| add_keys(kind, inner, &format!("{place}[]"), lines)),
        _ => {}
    }
}

fn add_files(bundle: &Path, prefix: &str, lines: &mut BTreeSet<String>) {
    for entry in fs::read_dir(bundle).unwrap().map(Result::unwrap) {
        let name = format!("{prefix}{}", entry.file_name().display());
        match entry.path().is_dir() {
            true => add_files(&entry.path(), &format!("{name}/"), lines),
            false => drop(lines.insert(format!("file {name}"))),
        }
    }
}

/// Everything that the present program offers.
fn present() -> BTreeSet<String> {
    let mut lines = BTreeSet::new();
    add_commands(&[], &mut lines);
    let schema = typodont(&["schema"]);
    add_schema(&serde_json::from_slice(&schema.stdout).unwrap(), "", &mut lines);
    let bundle = run("scenarios/5-grinding.json", "hasty", &folder("contract"), &[]);
    add_files(&bundle, "", &mut lines);
    let session = fs::read_to_string(bundle.join("session.json")).unwrap();
    add_keys("session", &serde_json::from_str(&session).unwrap(), "", &mut lines);
    lines
}

#[test]
fn everything_that_a_released_version_offered_is_still_there() {
    // Aim: whoever wrote an exercise, a script or an evaluation for an earlier version need not change it. Method: the
    // list of each version, against the program.
    let present = present();
    let mut versions = 0;
    for entry in fs::read_dir(golden()).unwrap().map(Result::unwrap) {
        let name = entry.file_name().to_string_lossy().into_owned();
        if !name.starts_with("contract-") {
            continue;
        }
        versions += 1;
        let text = fs::read_to_string(entry.path()).unwrap();
        let missing: Vec<&str> = text.lines().filter(|line| !present.contains(*line)).collect();
        assert!(missing.is_empty(), "{name} promises what is no longer there: {missing:#?}");
        for kind in ["command run", "option run --seed", "exercise .stages", "session grade.points", "file report.html"]
        {
            assert!(text.lines().any(|line| line == kind), "{name} lacks \"{kind}\"");
        }
    }
    assert!(versions > 0, "no version has a list");
}

#[test]
fn exit_statuses_are_as_promised() {
    let status = |arguments: &[&str]| typodont(arguments).status.code();
    assert_eq!(status(&["check", "scenarios/6-guided-tracing.json"]), Some(0));
    assert_eq!(status(&["check", "Cargo.lock"]), Some(1));
    assert_eq!(status(&["check"]), Some(2));
    assert_eq!(status(&["run", "scenarios/5-grinding.json", "--headless", "--device", "absent"]), Some(2));
    assert_eq!(status(&["verify", "tests/golden/version-1.mcap"]), Some(0));
}

#[test]
#[ignore = "prints the list for a new release"]
fn write_the_contract() {
    present().iter().for_each(|line| println!("{line}"));
}
