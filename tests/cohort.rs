//! The ten dentists of the thesis (Table 8.1), entered as sessions, come out with the means the thesis prints.

mod bundle;
mod folder;

use bundle::*;
use folder::folder;
use serde_json::{Value, json};
use std::path::Path;

/// Scenario 3: stiffness at the answer, whether it was right, time. Scenario 4: quadrant's truth, time. Scenario 5: time
/// to clear, decay cleared %, healthy per decay %. Times in minutes and seconds as printed.
type Row = (f64, bool, &'static str, bool, &'static str, &'static str, f64, f64);

#[rustfmt::skip]
const TABLE: [Row; 10] = [
    (0.4, true,  "1:35", false, "5:00", "3:16", 98.74,  75.84),
    (0.4, true,  "5:00", false, "5:00", "5:00", 97.75,  96.89),
    (0.7, true,  "1:12", true,  "1:20", "5:00", 72.92,  47.88),
    (0.1, true,  "0:40", false, "3:56", "3:38", 96.03,  91.22),
    (0.4, true,  "1:46", true,  "5:00", "5:00", 97.54,  99.06),
    (0.7, true,  "1:09", true,  "1:40", "3:18", 95.52,  44.94),
    (0.7, true,  "0:57", true,  "4:22", "4:12", 99.70, 125.0),
    (0.7, false, "1:38", true,  "1:05", "4:30", 97.40,  67.89),
    (0.4, false, "1:40", true,  "3:15", "4:10", 97.49,  76.07),
    (0.7, true,  "0:53", true,  "3:20", "4:20", 98.84,  88.14),
];

fn seconds(time: &str) -> f64 {
    let (minutes, seconds) = time.split_once(':').unwrap();
    minutes.parse::<f64>().unwrap() * 60.0 + seconds.parse::<f64>().unwrap()
}

fn enter(folder: &Path, scenario: &str, user: usize, metrics: Value) {
    let folder = folder.join(scenario).join(format!("user-{user:02}"));
    std::fs::create_dir_all(&folder).unwrap();
    let session = json!({
        "version": 1, "scenario": { "id": scenario }, "participant": format!("{user}"), "metrics": metrics
    });
    std::fs::write(folder.join("session.json"), session.to_string()).unwrap();
}

#[test]
fn table_8_1_comes_out_as_printed() {
    let folder = folder("table_8_1");
    for (row, &(level, tooth, found, quadrant, located, cleared_in, cleared, healthy)) in TABLE.iter().enumerate() {
        let flag = |right: bool| f64::from(u8::from(right));
        enter(
            &folder,
            "3-detection",
            row + 1,
            json!({ "detect_tooth": flag(tooth), "detect_level": level, "detect_level_time_s": seconds(found) }),
        );
        enter(
            &folder,
            "4-diagnosis",
            row + 1,
            json!({ "detect_quadrant": flag(quadrant), "detect_quadrant_time_s": seconds(located) }),
        );
        let metrics = json!({
            "decay_cleared_pct": cleared, "healthy_per_decay_pct": healthy, "time_to_clear_s": seconds(cleared_in)
        });
        enter(&folder, "5-grinding", row + 1, metrics);
    }
    let [html, csv, json] = ["html", "csv", "json"].map(|e| folder.join(format!("cohort.{e}")));
    let path = |p: &Path| p.to_str().unwrap().to_string();
    let arguments = ["cohort", &path(&folder), "--html", &path(&html), "--csv", &path(&csv), "--json", &path(&json)];
    let output = typodont(&arguments);
    assert!(output.status.success(), "{}", complained(&output));

    let summary: Value = serde_json::from_str(&std::fs::read_to_string(&json).unwrap()).unwrap();
    let scenario = |id: &str| {
        let all = summary["scenarios"].as_array().unwrap();
        all.iter().find(|s| s["id"] == id).unwrap().clone()
    };
    let mean = |name: &str| scenario("5-grinding")["metrics"][name]["mean"].as_f64().unwrap();
    assert_eq!(format!("{:.2}", mean("decay_cleared_pct")), "95.19");
    assert_eq!(format!("{:.2}", mean("healthy_per_decay_pct")), "81.29");
    assert_eq!(mean("time_to_clear_s").floor(), 4.0 * 60.0 + 14.0);
    let right = |id: &str, flag: &str| scenario(id)["right"][flag].clone();
    let (tooth, quadrant) = (right("3-detection", "detect_tooth"), right("4-diagnosis", "detect_quadrant"));
    assert_eq!((&tooth["right"], &tooth["of"]), (&json!(8), &json!(10)));
    assert_eq!(tooth["levels"], json!({ "0.1": 1, "0.4": 3, "0.7": 4 }));
    assert_eq!((&quadrant["right"], &quadrant["of"]), (&json!(7), &json!(10)));

    // The same in words, on the page and in the terminal.
    let page = std::fs::read_to_string(&html).unwrap();
    for text in [page, told(&output)] {
        for expected in ["95.19", "81.29", "4:14", "8 of 10", "7 of 10"] {
            assert!(text.contains(expected), "{expected} is missing in\n{text}");
        }
    }
    let table = std::fs::read_to_string(&csv).unwrap();
    assert_eq!(table.lines().count(), 31);
    assert!(table.contains("125"));
}

#[test]
fn what_is_no_session_is_named_and_left_out() {
    let folder = folder("odd_cohort");
    enter(&folder, "5-grinding", 1, json!({ "decay_cleared_pct": 50.0 }));
    for (name, text) in [("broken", "{"), ("newer", r#"{"version":9,"scenario":{"id":"x"},"metrics":{}}"#)] {
        std::fs::create_dir_all(folder.join(name)).unwrap();
        std::fs::write(folder.join(name).join("session.json"), text).unwrap();
    }
    let output = typodont(&["cohort", folder.to_str().unwrap()]);
    assert!(output.status.success());
    let complaints = complained(&output);
    assert!(complaints.contains("broken") && complaints.contains("newer program (version 9)"), "{complaints}");
    assert!(told(&output).contains("(1 session"), "{}", told(&output));
}

#[test]
fn a_participant_is_never_a_formula() {
    // Aim: a code that a spreadsheet would run as a formula, or a browser as a script, stays a text.
    let folder = folder("formula");
    let bundle = folder.join("one");
    std::fs::create_dir_all(&bundle).unwrap();
    let code = "=cmd|'/c calc'!A1 <script>alert(1)</script>";
    let session = json!({ "version": 1, "scenario": { "id": "x" }, "participant": code, "metrics": { "dice": 1.0 } });
    std::fs::write(bundle.join("session.json"), session.to_string()).unwrap();
    let [html, csv] = ["html", "csv"].map(|e| folder.join(format!("cohort.{e}")).to_str().unwrap().to_string());
    let output = typodont(&["cohort", folder.to_str().unwrap(), "--html", &html, "--csv", &csv]);
    assert!(output.status.success(), "{}", complained(&output));
    assert!(std::fs::read_to_string(csv).unwrap().contains(",'=cmd"));
    assert!(!std::fs::read_to_string(html).unwrap().contains("<script>alert"));
}
