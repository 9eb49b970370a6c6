//! Other programs derive the same numbers from a bundle: SimpleITK, slicerio, mcap, and the Khronos validator.
//!
//! Needs `TYPODONT_PYTHON` and `TYPODONT_GLTF_VALIDATOR`, as `scripts/test` sets them.

use crate::support::bundle;
use crate::support::coarse_exercise::coarse_exercise;
use crate::support::folder;

use bundle::*;
use folder::folder;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// External program that a test needs; without it the test prints SKIPPED.
fn needed(name: &str) -> Option<PathBuf> {
    crate::support::tools::named_by(name, "a program that reads our bundles").map(PathBuf::from)
}

#[test]
fn python_derives_the_same_numbers() {
    let Some(python) = needed("TYPODONT_PYTHON") else { return };
    for (scenario, operator) in [("scenarios/5-grinding.json", "hasty"), ("scenarios/5-grinding.json", "timid")] {
        let bundle = run(scenario, operator, &folder(&format!("python_{operator}")), &[]);
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/python/read_bundle.py");
        let output = Command::new(&python).arg(script).arg(&bundle).output().unwrap();
        assert!(output.status.success(), "{operator}: {}{}", told(&output), complained(&output));
        println!("{operator}: {}", complained(&output));
    }
}

#[test]
fn the_khronos_validator_accepts_the_performance_map() {
    let Some(validator) = needed("TYPODONT_GLTF_VALIDATOR") else { return };
    let bundle = run("scenarios/5-grinding.json", "hasty", &folder("gltf"), &[]);
    let script = "
        const [validator, file] = process.argv.slice(1);
        require(validator).validateBytes(new Uint8Array(require('fs').readFileSync(file))).then(report => {
            console.log(JSON.stringify(report));
            process.exit(report.issues.numErrors + report.issues.numWarnings > 0 ? 1 : 0);
        });
    ";
    let output =
        Command::new("node").args(["-e", script]).arg(&validator).arg(bundle.join("performance.glb")).output().unwrap();
    assert!(output.status.success(), "{}{}", told(&output), complained(&output));
    let report: serde_json::Value = serde_json::from_str(&told(&output)).unwrap();
    assert!(report["info"]["totalTriangleCount"].as_u64() > Some(1000), "{report}");
}

/// Exercises in which points can be lost in every way that a sentence describes, and their operators.
const SENTENCES: [(&str, &[&str]); 4] = [
    ("5-grinding", &["hasty", "timid", "careful"]),
    ("12-deep-caries", &["hasty", "expert"]),
    ("7-spray", &["hasty"]),
    ("4-diagnosis", &["hasty"]),
];

/// Size of a voxel, mm, with which many sessions can be run.
const COARSE: f32 = 0.25;

/// Derives the facts of all sentences of some bundles again; `None` without Python.
fn derive_sentences(bundles: &[PathBuf]) -> Option<Output> {
    let python = needed("TYPODONT_PYTHON")?;
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/python/check_feedback.py");
    Some(Command::new(&python).arg(script).args(bundles).output().unwrap())
}

/// Asserts that all facts follow from the recordings, and prints how many there were.
fn check_sentences(bundles: &[PathBuf]) {
    let Some(output) = derive_sentences(bundles) else { return };
    println!("{}", told(&output).lines().last().unwrap_or_default());
    assert!(output.status.success(), "{}{}", told(&output), complained(&output));
}

#[test]
fn a_wrong_fact_in_the_feedback_is_found() {
    // Aim: the test below can fail. Method: one value of the evidence is changed at a time.
    let bundle =
        run(&coarse_exercise("5-grinding", COARSE, "wrong_sentences"), "hasty", &folder("wrong_sentences"), &[]);
    let file = bundle.join("session.json");
    let original = session(&bundle);
    let episodes = original["episodes"].as_array().unwrap();
    let first = |kind: &str| episodes.iter().position(|e| e["kind"] == kind).unwrap();
    let (cut, press) = (first("overcut"), first("force"));
    let changes: [(String, serde_json::Value); 7] = [
        (format!("/episodes/{cut}/tissue"), "pulp".into()),
        (format!("/episodes/{cut}/wall"), "none".into()),
        (format!("/episodes/{cut}/at_s"), 0.001.into()),
        (format!("/episodes/{press}/tissue"), "neighbour".into()),
        (format!("/episodes/{press}/force_n"), 9.0.into()),
        ("/evidence/overcut_depth_max_mm/wall".into(), "none".into()),
        ("/evidence/overcut_depth_max_mm/force_n".into(), 9.0.into()),
    ];
    for (path, value) in changes {
        let mut changed = original.clone();
        *changed.pointer_mut(&path).unwrap() = value;
        std::fs::write(&file, changed.to_string()).unwrap();
        let Some(output) = derive_sentences(std::slice::from_ref(&bundle)) else { return };
        assert_eq!(output.status.code(), Some(1), "{path}: {}{}", told(&output), complained(&output));
        assert!(complained(&output).is_empty(), "{path}: {}", complained(&output));
    }
}

#[test]
fn every_sentence_of_feedback_follows_from_the_recording() {
    // Aim: tissue, wall, place, depth, volume, force and time of a sentence are what happened. Method: another program
    // derives each of them from the recording and the label maps. Regressions: a deepest cut was told of another wall,
    // a force on caries of the adjacent tooth, the loss of a protected zone as an exposed pulp, and caries as left where
    // it was only to be found.
    let mut bundles = Vec::new();
    for (name, operators) in SENTENCES {
        let scenario = coarse_exercise(name, COARSE, "sentences");
        let out = folder(&format!("sentences_{name}"));
        bundles.extend(operators.iter().map(|operator| run(&scenario, operator, &out, &[])));
    }
    check_sentences(&bundles);
}

#[test]
#[ignore = "scripts/test --long"]
fn every_sentence_of_two_hundred_sessions_follows_from_the_recording() {
    // Aim: as above, of all operators, in every exercise whose feedback names places, by many seeds.
    let mut bundles = Vec::new();
    for name in ["5-grinding", "7-spray", "8-fissure", "12-deep-caries", "3-detection", "4-diagnosis", "15-charting"] {
        let scenario = coarse_exercise(name, COARSE, "many_sentences");
        let out = folder(&format!("many_sentences_{name}"));
        for operator in ["expert", "careful", "hasty", "timid"] {
            let seeds: Vec<String> = (1..=8).map(|seed| seed.to_string()).collect();
            bundles.extend(seeds.iter().map(|seed| run(&scenario, operator, &out, &["--seed", seed])));
        }
    }
    assert!(bundles.len() >= 200, "{} sessions", bundles.len());
    check_sentences(&bundles);
}
