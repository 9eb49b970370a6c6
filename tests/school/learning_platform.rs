//! Packages for learning platforms: what is in them, and what a platform is told.
//!
//! Needs `TYPODONT_PYTHON`, `TYPODONT_SCORM_SCHEMAS`, `TYPODONT_SCORM_AGAIN`, `TYPODONT_RALPH`, `TYPODONT_PLAYWRIGHT` and
//! `TYPODONT_CHROMIUM`, as `scripts/test` sets them.

use crate::support::folder;
use crate::support::school;
use crate::support::tools;

use crate::support::browser::browser;
use folder::folder;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use typodont_formats::zip;

/// Name of a standard in the tests' scripts, and the arguments that choose it.
const STANDARDS: [(&str, &[&str]); 3] =
    [("1.2", &["scorm"]), ("2004", &["scorm", "--version", "2004"]), ("cmi5", &["cmi5"])];

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// A page that announces the result of the example's session, as the program's own page does at the end of one.
fn page(folder: &Path) -> PathBuf {
    let page = folder.join("page");
    fs::create_dir_all(page.join("parts")).unwrap();
    let html =
        "<!DOCTYPE html><title>Exercise</title><button id=\"finish\">Finish</button><script src=\"page.js\"></script>";
    fs::write(page.join("index.html"), html).unwrap();
    let script = "document.getElementById('finish').onclick = async () => {
        const session = await (await fetch('session.json')).json();
        const zip = { name: 'session.zip', sha256: 'f'.repeat(64) };
        window.parent.postMessage({ typodont: 1, event: 'result', session, zip }, location.origin);
    };";
    fs::write(page.join("page.js"), script).unwrap();
    fs::write(page.join("parts/an odd & name.bin"), [0, 1, 2]).unwrap();
    fs::copy(root().join("reports/example/session.json"), page.join("session.json")).unwrap();
    page
}

fn package(standard: &[&str], exercises: &[&str], page: &Path, output: &Path) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_typodont"));
    command.current_dir(root()).arg("package").args(standard).args(exercises);
    command.arg("--page").arg(page).arg("-o").arg(output).output().unwrap()
}

/// Unpacks an archive into a folder beside it.
fn unpack(archive: &Path) -> PathBuf {
    let folder = archive.with_extension("");
    for (name, bytes) in zip::read(&fs::read(archive).unwrap()).unwrap() {
        let place = folder.join(name);
        fs::create_dir_all(place.parent().unwrap()).unwrap();
        fs::write(place, bytes).unwrap();
    }
    folder
}

fn unpacked(folder: &Path, standard: (&str, &[&str]), exercises: &[&str]) -> PathBuf {
    let archive = folder.join(format!("{}.zip", standard.0));
    let made = package(standard.1, exercises, &page(folder), &archive);
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    unpack(&archive)
}

/// Runs a script, which complains of all that it finds wrong.
fn passes(command: &mut Command) {
    let output = command.output().unwrap();
    let told = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{told}{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn manifests_are_valid_against_the_standards_schemas() {
    // Aim: a platform takes the archive. Method: ADL's schemas, with all shipped exercises in the first package and two in each of
    // the others.
    let Some(python) = tools::named_by("TYPODONT_PYTHON", "a Python with lxml") else { return };
    let Some(schemas) = tools::named_by("TYPODONT_SCORM_SCHEMAS", "ADL's schemas") else { return };
    let folder = folder("package_manifests");
    for (number, standard) in STANDARDS.into_iter().enumerate() {
        let exercises: &[&str] =
            if number == 0 { &["scenarios"] } else { &["scenarios/1-introduction.json", "scenarios/5-grinding.json"] };
        let files = unpacked(&folder, standard, exercises);
        assert!(files.join("page/exercises/5-grinding.json").is_file());
        let script = root().join("tests/python/check_manifest.py");
        passes(Command::new(&python).arg(script).arg(&files).arg(standard.0).arg(&schemas));
    }
}

#[test]
fn the_same_exercises_make_the_same_archive() {
    let folder = folder("package_again");
    let page = page(&folder);
    let archives = ["a.zip", "b.zip"].map(|name| folder.join(name));
    for archive in &archives {
        assert!(package(&["scorm"], &["scenarios/5-grinding.json"], &page, archive).status.success());
    }
    assert!(fs::read(&archives[0]).unwrap() == fs::read(&archives[1]).unwrap());
}

#[test]
fn a_package_contains_the_files_that_its_exercises_name() {
    let folder = folder("package_files");
    let exercise = folder.join("scanned.json");
    let grinding = fs::read_to_string(root().join("scenarios/1-introduction.json")).unwrap();
    fs::write(&exercise, grinding).unwrap();
    let archive = folder.join("package.zip");
    let wrong = package(&["scorm"], &[exercise.to_str().unwrap(), "nowhere.json"], &page(&folder), &archive);
    assert_eq!(wrong.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&wrong.stderr).contains("nowhere.json"), "the missing file is not named");
    assert!(!archive.exists());
    let wrong = package(&["scorm"], &[exercise.to_str().unwrap()], &folder.join("none"), &archive);
    assert!(String::from_utf8_lossy(&wrong.stderr).contains("no-page"), "the missing page is not named");
    assert!(package(&["scorm"], &[exercise.to_str().unwrap()], &page(&folder), &archive).status.success());
    assert!(unpack(&archive).join("page/exercises/scanned.json").is_file());
}

#[test]
fn scorm_again_receives_the_result_and_one_sentence_says_when_it_does_not() {
    let Some([playwright, chromium]) = browser() else { return };
    let Some(again) = tools::named_by("TYPODONT_SCORM_AGAIN", "scorm-again") else { return };
    let folder = folder("package_scorm");
    for standard in &STANDARDS[..2] {
        let files = unpacked(&folder, *standard, &["scenarios/5-grinding.json"]);
        let mut node = Command::new("node");
        node.arg(root().join("tests/browser/learning_platform.js")).args([&playwright, &chromium]);
        passes(node.arg(&again).arg(files).arg(standard.0).arg(root().join("reports/example/session.json")));
    }
}

#[test]
fn a_cmi5_launch_states_the_result_to_the_record_store() {
    let Some([playwright, chromium]) = browser() else { return };
    let Some(python) = tools::named_by("TYPODONT_RALPH", "a Python with the record store Ralph") else { return };
    let folder = folder("package_cmi5");
    let files = unpacked(&folder, STANDARDS[2], &["scenarios/5-grinding.json"]);
    let ralph =
        school::Ralph { python: PathBuf::from(python), folder: folder.join("ralph"), port: school::free_port() };
    let mut server = ralph.start();
    let mut node = Command::new("node");
    node.arg(root().join("tests/browser/learning_platform.js")).args([&playwright, &chromium]).arg("-");
    node.arg(files).arg("cmi5").arg(root().join("reports/example/session.json"));
    let output = node.arg(format!("http://127.0.0.1:{}/xAPI", ralph.port)).output().unwrap();
    server.kill().unwrap();
    server.wait().unwrap();
    let told = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{told}");
    assert!(ralph.kept().len() >= 4, "the record store keeps {:?}", ralph.kept());
}

#[test]
#[ignore = "long: needs the page that scripts/web builds"]
fn a_platform_receives_the_result_of_a_lesson_in_the_page() {
    // Aim: what a learner hands in is what the gradebook names. Method: the program's page in a package, played by
    // scorm-again; the saved bundle has the digest that the platform was told, and holds.
    let Some([playwright, chromium]) = browser() else { return };
    let Some(again) = tools::named_by("TYPODONT_SCORM_AGAIN", "scorm-again") else { return };
    let page = root().join("target/web");
    if !page.join("index.html").is_file() {
        return tools::skip("target/web has no page (scripts/web)");
    }
    let folder = folder("package_played");
    let archive = folder.join("package.zip");
    let made = package(&["scorm"], &["scenarios/5-grinding.json"], &page, &archive);
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    let bundle = folder.join("bundle.zip");
    let mut node = Command::new("node");
    node.arg(root().join("tests/browser/packaged_page.js")).args([&playwright, &chromium]);
    passes(node.arg(&again).arg(unpack(&archive)).arg(&bundle));
    passes(Command::new(env!("CARGO_BIN_EXE_typodont")).arg("verify").arg(&bundle));
}
