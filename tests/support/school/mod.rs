//! A school for tests: sessions, the rules of xAPI, and record stores that behave badly or well.

#![allow(dead_code, unused_imports)]

mod rules;
mod store;

pub use rules::wrong_with;
pub use store::{Ralph, Store, free_port};

use serde_json::{Value, json};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

/// A finished session with a grade, answers and a questionnaire. Passed from 70 points on.
pub fn session(scenario: &str, participant: &str, points: f64) -> Value {
    let items = ["u1", "u2", "u3"].map(|id| {
        let negative = id == "u2";
        json!({ "id": id, "category": "usability", "value": if negative { 2.0 } else { 4.0 }, "counted": 4.0 })
    });
    // The items add up to the points.
    let of_caries = f64::min(25.0, points).max(points - 60.0);
    json!({
        "version": 1, "typodont_version": "0.2.0", "scorer_version": 1,
        "scenario": { "id": scenario, "title": "Caries removal", "sha256": "ab12" },
        "participant": participant, "seed": 1, "started": "2026-11-21T12:17:00Z", "ended_because": "complete",
        "stages": [{
            "id": "find", "title": "Find it", "started_s": 0.0, "ended_s": 61.25, "ended_by": "answer",
            "answers": [
                { "question": "where", "text": "Which tooth?", "value": "left", "at_s": 60.5, "right": true, "truth": "left", "level": 0.4 },
                { "question": "quadrant", "text": "Which quadrant?", "value": 3, "at_s": 61.0, "right": false, "truth": 2 },
                { "question": "sure", "text": "Are you sure?", "value": true, "at_s": 61.25, "right": null, "truth": null },
            ],
        }],
        "metrics": { "decay_cleared_pct": 87.5 + points / 100.0, "surface_within_tol(0.3)": 0.8, "detect_level": null },
        "evidence": { "decay_cleared_pct": { "at_s": 31.5, "place_mm": [1.0, 2.0, 3.0] } },
        "grade": {
            "points": points, "max_points": 100.0, "pass_points": 70.0, "finished": true, "passed": points >= 70.0,
            "hard_fails": [], "items": [
                { "title": "Caries removed", "metric": "decay_cleared_pct", "value": 87.5,
                    "points": of_caries, "max_points": 40.0, "full_at": 98.0, "zero_at": 70.0 },
                { "title": "Gentle force", "metric": "force_max_n", "value": null,
                    "points": points - of_caries, "max_points": 60.0, "full_at": 1.0, "zero_at": 3.0 },
            ],
        },
        "questionnaire": { "id": "simulator", "items": items, "categories": { "usability": 4.0 } },
        "servo": { "ticks": 61_250, "late_p50_us": null, "late_p99_us": null, "late_max_us": null, "work_max_us": null,
            "missed": 0, "dropped": 0, "let_go": 0, "interruptions": 0, "faults": 0, "clamped": 0 },
    })
}

/// Writes a session as a bundle of its own, begun a minute after the one before it.
pub fn enter(folder: &Path, session: &Value) -> PathBuf {
    static ENTERED: AtomicU32 = AtomicU32::new(0);
    let number = ENTERED.fetch_add(1, Ordering::Relaxed);
    let mut session = session.clone();
    if session["started"] == "2026-11-21T12:17:00Z" {
        session["started"] = json!(format!("2026-11-21T{:02}:{:02}:00Z", 8 + number / 60, number % 60));
    }
    let bundle = folder.join(format!("bundle-{number:04}"));
    fs::create_dir_all(&bundle).unwrap();
    fs::write(bundle.join("session.json"), session.to_string()).unwrap();
    bundle
}

/// Every statement in a folder of a spool.
pub fn statements_below(folder: &Path) -> Vec<Value> {
    let mut files: Vec<PathBuf> = fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    files.sort();
    files.iter().flat_map(|f| serde_json::from_str::<Vec<Value>>(&fs::read_to_string(f).unwrap()).unwrap()).collect()
}
