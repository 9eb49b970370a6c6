//! A report in a real browser: opened from the disk, without a network, by mouse and by keyboard.
//!
//! Needs `TYPODONT_PLAYWRIGHT` (the folder of playwright-core) and `TYPODONT_CHROMIUM`, as `scripts/test` sets them.

use crate::support::browser;
use crate::support::bundle;
use crate::support::coarse_exercise::coarse_exercise;
use crate::support::folder;

use browser::browser;
use bundle::*;
use folder::folder;
use std::path::Path;
use std::process::Command;
use typodont_exercise::record::Recording;

fn opens(bundle: &Path, pictures: &Path, part: &str) {
    let Some([playwright, chromium]) = browser() else { return };
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/browser/report_page.js");
    let mut node = Command::new("node");
    node.arg(script).args([playwright, chromium]).arg(bundle).arg(pictures).arg(part);
    let output = node.output().unwrap();
    assert!(output.status.success(), "{}{}", told(&output), complained(&output));
    println!("{}", told(&output));
}

/// Voxel size of a micro-CT, mm: some 10 million voxels.
const FINE: f32 = 0.067;

#[test]
fn a_report_is_explored_in_a_browser() {
    // Aim: time, marks, sections, voxels, keyboard and languages do in Chromium what they promise, and every voxel that is
    // clicked says what the label maps say.
    if browser().is_none() {
        return;
    }
    let exercise = coarse_exercise("5-grinding", FINE, "report_explored");
    let bundle = run(&exercise, "hasty", &folder("report_explored_bundle"), &["--participant", "P07"]);
    opens(&bundle, &folder("report_explored"), "explored");
}

#[test]
fn a_report_plays_the_hand_back_in_a_browser() {
    // Aim: the hand that is played back is the recorded one; deviations, paper, narrow windows and browsers without WebGL show
    // what they promise.
    if browser().is_none() {
        return;
    }
    let pictures = folder("report_played");
    let exercise = coarse_exercise("5-grinding", 0.2, "report_played");
    let bundle = run(&exercise, "hasty", &folder("report_played_bundle"), &["--participant", "P07"]);
    std::fs::write(pictures.join("poses.json"), recorded_poses(&bundle).to_string()).unwrap();
    opens(&bundle, &pictures, "played");
}

/// Poses of the instrument in tooth space at some thirty ticks of a recording, in no regular order.
fn recorded_poses(bundle: &Path) -> serde_json::Value {
    let recording = Recording::read(&bundle.join("recording.mcap")).unwrap();
    let tooth_from_world = recording.workpiece().unwrap().world_from_tooth.inverse();
    let count = recording.ticks.len();
    let pose = |number: usize| {
        let record = &recording.ticks[number * 7919 % (count - 1)];
        let orientation = tooth_from_world.orientation * record.reading.pose.orientation.normalize();
        serde_json::json!({
            "tick": record.tick.0,
            "tool": record.instrument,
            "position": (tooth_from_world * record.tip).to_array(),
            "orientation": orientation.to_array(),
        })
    };
    (0..30).map(pose).collect()
}

#[test]
fn a_hostile_exercise_does_no_harm_in_a_browser() {
    // Aim: what an author writes is shown and never run, however it is written. Method: markup, text in Hebrew and a
    // word without end in every text of an exercise; the browser reports dialogs, errors and requests.
    if browser().is_none() {
        return;
    }
    let out = folder("hostile_page");
    let text = std::fs::read_to_string("scenarios/5-grinding.json").unwrap();
    let mut scenario: serde_json::Value = serde_json::from_str(&text).unwrap();
    let hostile = "<script>alert(1)</script>";
    scenario.as_object_mut().unwrap().remove("$schema");
    scenario["title"] = format!("{hostile}\u{200f}תרגיל").into();
    scenario["summary"] = format!("</script>{hostile}{}", "w".repeat(1900)).into();
    scenario["scene"]["jaw"]["tooth"]["form"]["procedural"]["spacing_mm"] = 0.2.into();
    scenario["stages"][0]["title"] = format!("{hostile}<img src=x onerror=alert(2)>").into();
    scenario["zones"][0]["title"] = hostile.into();
    for item in scenario["rubric"]["items"].as_array_mut().unwrap() {
        item["title"] = format!("{hostile}{}", "w".repeat(90)).into();
    }
    let path = out.join("hostile.json");
    std::fs::write(&path, scenario.to_string()).unwrap();
    let bundle = run(path.to_str().unwrap(), "hasty", &out, &["--participant", "P07"]);
    opens(&bundle, &out, "hostile");
}

#[test]
fn a_school_has_its_own_sentences_and_languages() {
    // Aim: sentences, texts and languages are files; a mistake in them is named before anything is played. Method: a folder of
    // templates with a rule and a language of its own, and the program started there.
    let out = folder("school_page");
    let templates = out.join("reports/templates");
    std::fs::create_dir_all(templates.join("languages")).unwrap();
    let text = std::fs::read_to_string("scenarios/5-grinding.json").unwrap();
    let coarse = text
        .replace("\"spacing_mm\": 0.1", "\"spacing_mm\": 0.25")
        .replace(r#""$schema": "scenario.schema.json","#, "");
    std::fs::write(out.join("coarse.json"), coarse).unwrap();
    let play = |rules: &str| {
        std::fs::write(templates.join("feedback.json"), rules).unwrap();
        std::fs::write(
            templates.join("languages/de.json"),
            r#"{"language.name": "Deutsch", "result.title": "Ergebnis"}"#,
        )
        .unwrap();
        let mut program = Command::new(env!("CARGO_BIN_EXE_typodont"));
        program.args(["run", "coarse.json", "--headless", "--operator", "hasty", "--seed", "1", "--out", "out"]);
        program.current_dir(&out).output().unwrap()
    };
    let refused = play(r#"{"rules": [{"metric": "dise", "otherwise": {"en": "x"}}]}"#);
    let why = complained(&refused);
    assert!(!refused.status.success() && why.contains("feedback.json:1:23: unknown-metric"), "{why}");
    assert!(!out.join("out").exists(), "nothing was played");
    let rule = r#"{"rules": [{"metric": "*", "otherwise": {"en": "Look at {title}.", "de": "Achte auf {title}."}}]}"#;
    let played = play(rule);
    assert!(played.status.success(), "{}", complained(&played));
    let page = std::fs::read_to_string(out.join(told(&played).lines().last().unwrap()).join("report.html")).unwrap();
    for own in ["Ergebnis", ">Deutsch</button>", "<span lang=\"de\">Achte auf ", "<span lang=\"en\">Look at "] {
        assert!(page.contains(own), "{own}");
    }
}
