//! Bundles made by the program itself, for tests that look into them.

#![allow(dead_code)]

use serde_json::Value;
use sha2::{Digest, Sha256};
use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// The program under test.
pub fn program() -> &'static str {
    env!("CARGO_BIN_EXE_typodont")
}

/// The program, started in the repository's root.
pub fn typodont(arguments: &[&str]) -> Output {
    Command::new(program()).args(arguments).current_dir(env!("CARGO_MANIFEST_DIR")).output().unwrap()
}

pub fn told(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

pub fn complained(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// A bundle in a folder of its own below `out`: made by this program once, from the same exercise, operator and further
/// arguments, and copied from then on.
pub fn run(scenario: &str, operator: &str, out: &Path, more: &[&str]) -> PathBuf {
    let kept = Path::new(env!("CARGO_TARGET_TMPDIR")).join("bundles").join(key(scenario, operator, more));
    std::fs::create_dir_all(&kept).unwrap();
    let lock = File::create(kept.join("lock")).unwrap();
    lock.lock().unwrap();
    let done = kept.join("bundle.txt");
    if !done.exists() {
        let bundle = run_anew(scenario, operator, &kept, more);
        std::fs::write(&done, bundle.file_name().unwrap().to_str().unwrap()).unwrap();
    }
    drop(lock);
    let name = std::fs::read_to_string(done).unwrap();
    let copy = out.join(&name);
    copy_folder(&kept.join(&name), &copy);
    copy
}

/// Everything that decides the bytes of a bundle, apart from the time at which it is made.
fn key(scenario: &str, operator: &str, more: &[&str]) -> String {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let program = std::fs::metadata(program()).unwrap();
    let mut digest = Sha256::new();
    digest.update(format!("{:?} {} {more:?} {operator}", program.modified().unwrap(), program.len()));
    for path in [scenario, operator].map(|file| root.join(file)) {
        digest.update(std::fs::read(&path).unwrap_or_default());
        // A test's own exercise may name files beside it. Shipped ones come with the program.
        let beside = if path.starts_with(root.join("scenarios")) { None } else { path.parent() };
        let files = beside.and_then(|folder| std::fs::read_dir(folder).ok()).into_iter().flatten().flatten();
        let mut files: Vec<PathBuf> = files.map(|entry| entry.path()).filter(|path| path.is_file()).collect();
        files.sort();
        files.iter().for_each(|file| digest.update(std::fs::read(file).unwrap_or_default()));
    }
    digest.finalize()[..8].iter().map(|byte| format!("{byte:02x}")).collect()
}

fn copy_folder(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap().map(Result::unwrap) {
        let (from, to) = (entry.path(), to.join(entry.file_name()));
        if from.is_dir() { copy_folder(&from, &to) } else { std::fs::copy(&from, &to).map(|_| ()).unwrap() }
    }
}

/// Runs an exercise and returns the path it prints last.
pub fn run_anew(scenario: &str, operator: &str, out: &Path, more: &[&str]) -> PathBuf {
    let arguments = ["run", scenario, "--headless", "--operator", operator, "--out", out.to_str().unwrap()];
    let seed: &[&str] = if more.contains(&"--seed") { &[] } else { &["--seed", "1"] };
    let output = typodont(&[&arguments, seed, more].concat());
    assert!(output.status.success(), "{scenario} by {operator}: {}", complained(&output));
    PathBuf::from(told(&output).lines().last().unwrap())
}

/// `session.json` of a bundle.
pub fn session(bundle: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(bundle.join("session.json")).unwrap()).unwrap()
}

pub fn metric(session: &Value, name: &str) -> Option<f64> {
    session["metrics"].get(name).unwrap_or_else(|| panic!("no metric {name}")).as_f64()
}
