//! The review pages in a real browser, by mouse and by keyboard.
//!
//! Needs `TYPODONT_PLAYWRIGHT` (the folder of playwright-core) and `TYPODONT_CHROMIUM`, as `scripts/test` sets them.

use crate::support::browser;
use crate::support::desk;
use crate::support::folder;

use browser::browser;
use desk::Desk;
use folder::folder;
use serde_json::{Value, json};
use std::fs;
use std::path::Path;
use std::process::Command;

/// Copies a folder with all that is in it.
fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap().map(Result::unwrap) {
        let place = to.join(entry.file_name());
        match entry.path().is_dir() {
            true => copy(&entry.path(), &place),
            false => _ = fs::copy(entry.path(), place).unwrap(),
        }
    }
}

#[test]
fn an_examiner_works_in_a_browser() {
    // Aim: the door, the list, comparing, overriding, the report in its room and the other language do in Chromium what they
    // promise, without a script of ours and without an error. Method: the example's bundle under several names, and keys and clicks.
    let Some([playwright, chromium]) = browser() else { return };
    let folder = folder("review_page");
    let bundles = folder.join("bundles");
    for (number, points) in [62.210396649, 81.5, 55.0, 90.25, 71.0, 40.0].into_iter().enumerate() {
        let bundle = bundles.join(if number % 2 == 0 { "2026-a" } else { "2026-b" }).join(format!("session-{number}"));
        copy(&Path::new(env!("CARGO_MANIFEST_DIR")).join("reports/example"), &bundle);
        let file = bundle.join("session.json");
        let mut one: Value = serde_json::from_str(&fs::read_to_string(&file).unwrap()).unwrap();
        one["participant"] = json!(format!("student-{number}"));
        one["started"] = json!(format!("2026-11-2{number}T08:15:00Z"));
        one["metrics"]["force_max_n"] = json!(1.5 + 0.3 * number as f64);
        one["grade"]["points"] = json!(points);
        one["grade"]["passed"] = json!(points >= 70.0);
        fs::write(&file, one.to_string()).unwrap();
    }
    fs::create_dir_all(bundles.join("damaged")).unwrap();
    fs::write(bundles.join("damaged/session.json"), "{").unwrap();
    let works = |more: &[&str], script: &str| {
        let desk = Desk::open(&bundles, more);
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/browser").join(script);
        let mut node = Command::new("node");
        node.arg(script).args([&playwright, &chromium, &desk.address]).arg(&folder);
        let output = node.output().unwrap();
        let (told, complained) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
        assert!(output.status.success(), "{told}{complained}{}", desk.all_told());
        println!("{told}");
    };
    works(&[], "review_page.js");
}
