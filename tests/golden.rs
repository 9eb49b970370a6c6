//! A recording of a released exercise still replays to the last bit and still scores the same, in every build.
//!
//! When touch, carving or a formula changes on purpose, the newest recording no longer holds: record it anew
//! (`typodont run scenarios/5-grinding.json --headless --operator hasty --seed 4 --participant golden`), say so in the
//! changelog, and raise `SCORER_VERSION` if a formula changed.

mod bundle;

use bundle::*;
use serde_json::Value;
use std::path::Path;
use std::process::Command;
use typodont::record::{self, Recording, Watch};
use typodont::report::SessionFile;
use typodont::score;

/// One of each version that recordings have had.
const VERSIONS: [&str; 2] = ["tests/golden/version-1", "tests/golden/version-2"];
const GOLDEN: &str = "tests/golden/version-2.mcap";

#[test]
fn the_golden_recording_replays_and_scores_as_ever() {
    for version in VERSIONS {
        let recording = Recording::read(Path::new(&format!("{version}.mcap"))).unwrap();
        let scored = score::score(&recording, Watch::Everything).unwrap();
        assert_eq!(scored.replay.difference, None, "{version}");
        let expected: Value =
            serde_json::from_str(&std::fs::read_to_string(format!("{version}.json")).unwrap()).unwrap();
        let now: Value = serde_json::from_str(&SessionFile::of(&recording, &scored).text()).unwrap();
        assert_eq!(now["metrics"], expected["metrics"], "{version}");
        assert_eq!(now["grade"]["points"], expected["points"], "{version}");
        assert_eq!(now["grade"]["hard_fails"], expected["hard_fails"], "{version}");
    }
}

#[test]
fn little_and_much_optimisation_turn_it_to_the_same_digest() {
    // Every second's digest and every force is compared with what is recorded: two builds that both hold agree.
    let here = env!("CARGO_BIN_EXE_typodont").to_string();
    let optimised = std::env::var("TYPODONT_OPTIMISED").ok();
    for program in [Some(here), optimised].into_iter().flatten() {
        for version in VERSIONS {
            let output = Command::new(&program).args(["verify", &format!("{version}.mcap")]).output().unwrap();
            assert!(output.status.success(), "{program}: {version}: {}", complained(&output));
        }
    }
}

#[test]
fn a_single_tick_that_differs_is_named() {
    // Aim: the comparison of the test above can fail. Method: another reading in one tick.
    let mut recording = Recording::read(Path::new(GOLDEN)).unwrap();
    recording.ticks[7_000].reading.pose.position.x += 0.01;
    let replay = record::replay(&recording, recording.workpiece().unwrap(), Watch::Everything, |_, _, _, _| ());
    let difference = replay.difference.expect("the digests know the reading").to_string();
    let tick: u64 = difference.split("tick ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
    assert!((7_000..=8_000).contains(&tick), "{difference}");
}
