//! A recording of a released exercise replays to the last bit and scores the same, in every build.
//!
//! When contact, carving or a formula changes on purpose, the newest recording no longer replays: record it again
//! (`typodont run scenarios/5-grinding.json --headless --operator hasty --seed 4 --participant golden`), note it in
//! the changelog, and raise `SCORER_VERSION` if a formula changed.

use crate::support::bundle;

use bundle::*;
use serde_json::Value;
use std::path::Path;
use std::process::Command;
use typodont_exercise::record;
use typodont_exercise::record::{Recording, ReplayCheck};
use typodont_exercise::scenario::metric::{PLAIN, RequiredFeature};
use typodont_exercise::score;
use typodont_report::SessionFile;

/// One recording of each version of the format.
const VERSIONS: [&str; 3] = ["tests/golden/version-1", "tests/golden/version-2", "tests/golden/version-3"];
const GOLDEN: &str = "tests/golden/version-3.mcap";

#[test]
fn golden_recordings_replay_and_score_unchanged() {
    for version in VERSIONS {
        let recording = Recording::read(Path::new(&format!("{version}.mcap"))).unwrap();
        let scored = score::score(&recording, ReplayCheck::Full).unwrap();
        assert_eq!(scored.replay.difference, None, "{version}");
        let expected: Value =
            serde_json::from_str(&std::fs::read_to_string(format!("{version}.json")).unwrap()).unwrap();
        let now: Value = serde_json::from_str(&SessionFile::of(&recording, &scored).to_json()).unwrap();
        assert_eq!(now["metrics"], expected["metrics"], "{version}");
        // A formula that forgets its value looks like a measure without one. What requires no more than caries has a
        // value in each of these recordings.
        let is_always = |feature: &RequiredFeature| *feature == RequiredFeature::Decay;
        for about in PLAIN.iter().filter(|about| about.required_features.iter().all(is_always)) {
            assert!(!now["metrics"][about.name].is_null(), "{version}: {} has no value", about.name);
        }
        assert_eq!(now["grade"]["points"], expected["points"], "{version}");
        assert_eq!(now["grade"]["hard_fails"], expected["hard_fails"], "{version}");
    }
}

#[test]
fn builds_with_different_optimization_replay_to_the_same_digest() {
    // Every digest and every force is compared with the recording, so two builds that both pass agree with each
    // other. The other build, with a different optimization level, is made by `scripts/test --long`.
    let here = env!("CARGO_BIN_EXE_typodont").to_string();
    let other = std::env::var("TYPODONT_OTHER_BUILD").ok();
    for program in [Some(here), other].into_iter().flatten() {
        for version in VERSIONS {
            let output = Command::new(&program).args(["verify", &format!("{version}.mcap")]).output().unwrap();
            assert!(output.status.success(), "{program}: {version}: {}", complained(&output));
        }
    }
}

#[test]
fn a_single_tick_that_differs_is_named() {
    // Aim: the comparison of the test above can fail. Method: a changed reading in one tick.
    let mut recording = Recording::read(Path::new(GOLDEN)).unwrap();
    recording.ticks[7_000].reading.pose.position.x += 0.01;
    let replay = record::replay(&recording, recording.workpiece().unwrap(), ReplayCheck::Full, |_, _, _, _| ());
    let difference = replay.difference.expect("the changed reading must be detected").to_string();
    let tick: u64 = difference.split("tick ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
    assert!((7_000..=8_000).contains(&tick), "{difference}");
}
