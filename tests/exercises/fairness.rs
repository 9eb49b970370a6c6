//! Warnings of `typodont check` about unfair rubrics, and grades that do not depend on the voxel size.

use crate::support::bundle;
use crate::support::folder;

use bundle::*;
use folder::folder;
use std::path::Path;
use std::sync::Arc;
use typodont_exercise::scenario::ResolveMode;
use typodont_lesson::{exercise_warnings, read_scenario};

#[test]
#[ignore = "scripts/test --long"]
fn the_same_work_scores_the_same_in_fine_and_in_coarse_voxels() {
    // Aim: the voxel size does not decide a grade; the expert once had 100.0 points at 0.1 mm and 93.3 at 0.25 mm.
    // Method: exercise 5 on three teeth, by the expert and with the same seed, at both sizes.
    let text = std::fs::read_to_string(format!("{}/scenarios/5-grinding.json", env!("CARGO_MANIFEST_DIR"))).unwrap();
    for fdi in [36, 46, 17] {
        let points = [0.1, 0.25].map(|spacing| {
            let out = folder(&format!("voxels_{fdi}_{spacing}"));
            let own = text.replace("\"fdi\": 36", &format!("\"fdi\": {fdi}"));
            let own = own.replace("\"spacing_mm\": 0.1", &format!("\"spacing_mm\": {spacing}"));
            let file = out.join("grinding.json");
            std::fs::write(&file, own).unwrap();
            let session = session(&run(file.to_str().unwrap(), "expert", &out, &["--seed", "1"]));
            session["grade"]["points"].as_f64().unwrap()
        });
        println!("tooth {fdi}: {points:.2?}");
        assert!((points[0] - points[1]).abs() <= 1.0 && points[0] > 90.0, "tooth {fdi}: {points:?}");
    }
}

#[test]
fn check_warns_of_a_rubric_that_pays_for_doing_nothing() {
    // Method: exercise 5 as it was, without the dependence of its items, in coarse voxels.
    let shipped = format!("{}/scenarios/5-grinding.json", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(shipped).unwrap();
    let unfair = text.replace(", \"counts_with\": \"accessible_decay_cleared_pct\"", "").replace("0.1 } }", "0.25 } }");
    assert_ne!(unfair, text);
    let file = folder("unfair").join("unfair.json");
    std::fs::write(&file, unfair).unwrap();
    let path = file.to_str().unwrap();
    let output = typodont(&["check", path]);
    assert!(output.status.success(), "a warning does not forbid the exercise");
    assert!(told(&output).contains("1 files checked, no errors, 1 warning"), "{}", told(&output));
    let warning = complained(&output);
    assert!(warning.contains("warning: ") && warning.contains("idle-points: /rubric/items/1: "), "{warning}");
    assert!(warning.contains("earns 60 of 100 points"), "{warning}");
    let json: serde_json::Value = serde_json::from_str(&told(&typodont(&["check", path, "--format", "json"]))).unwrap();
    assert_eq!((&json[0]["severity"], &json[0]["code"]), (&"warning".into(), &"idle-points".into()), "{json}");
}

#[test]
fn check_says_when_caries_lies_within_a_protected_zone() {
    // Method: exercise 5 with a lesion deep in the dentine.
    let shipped = format!("{}/scenarios/5-grinding.json", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(shipped).unwrap();
    let deep = text.replace("\"depth_mm\": 0.4", "\"depth_mm\": 4.0").replace("0.1 } }", "0.2 } }");
    let file = folder("deep").join("deep.json");
    std::fs::write(&file, deep).unwrap();
    let scenario = Arc::new(read_scenario(&file, ResolveMode::ReadScans).unwrap());
    let warnings = exercise_warnings(&scenario).unwrap();
    let zone = warnings.iter().find(|w| w.code == "caries-in-zone").expect("a warning");
    assert!(zone.path == "/zones/1" && zone.message.contains("Dentine within 0.5 mm of the pulp"), "{zone:?}");
}

#[test]
fn check_says_when_a_trainee_can_guess_the_answer() {
    // Aim: an exercise from the time before draws, whose lesion lies in a random quadrant, is named. Method: exercise 5
    // in coarse voxels, with a question for the quadrant; and exercise 9, whose answers are drawn in several trials.
    let shipped = format!("{}/scenarios/5-grinding.json", env!("CARGO_MANIFEST_DIR"));
    let mut old: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(shipped).unwrap()).unwrap();
    old.as_object_mut().unwrap().remove("$schema");
    old["scene"]["jaw"]["tooth"]["form"]["procedural"]["spacing_mm"] = serde_json::json!(0.3);
    let question =
        serde_json::json!({ "id": "where", "text": "Which quadrant?", "answer": { "quadrant_of": "lesion" } });
    old["stages"][0]["ask"] = serde_json::json!([question]);
    let file = folder("guessable").join("old.json");
    std::fs::write(&file, old.to_string()).unwrap();
    let warnings =
        |file: &Path| exercise_warnings(&Arc::new(read_scenario(file, ResolveMode::ReadScans).unwrap())).unwrap();
    let found = warnings(&file);
    let guessable: Vec<_> = found.iter().filter(|w| w.code == "guessable-answer").collect();
    assert_eq!(guessable.len(), 1, "{found:?}");
    assert_eq!(guessable[0].path, "/stages/0/ask/0/answer/quadrant_of");
    assert!(guessable[0].message.contains("1 of 4 sessions"), "{guessable:?}");
    let drawn = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/9-stain.json");
    assert!(warnings(&drawn).iter().all(|w| w.code != "guessable-answer"));
}
