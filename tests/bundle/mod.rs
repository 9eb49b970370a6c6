//! Bundles made by the program itself, for tests that look into them.

#![allow(dead_code)]

use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// The program, started in the repository's root. Whole sessions are played by an optimised program where there is one, named
/// by `TYPODONT_OPTIMISED`: it says the same, sooner.
pub fn typodont(arguments: &[&str]) -> Output {
    let program = std::env::var("TYPODONT_OPTIMISED").unwrap_or_else(|_| env!("CARGO_BIN_EXE_typodont").to_string());
    Command::new(program).args(arguments).current_dir(env!("CARGO_MANIFEST_DIR")).output().unwrap()
}

pub fn told(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

pub fn complained(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Runs an exercise and returns the path it prints last.
pub fn run(scenario: &str, operator: &str, out: &Path, more: &[&str]) -> PathBuf {
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
