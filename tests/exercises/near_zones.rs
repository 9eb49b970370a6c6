//! Force and speed near a zone that an author names.

use crate::support::bundle::{complained, metric, run_anew, session, typodont};
use crate::support::folder::folder;
use serde_json::{Value, json};
use std::path::PathBuf;

/// The exercise of deep caries in large voxels, with three more zones, and with measures of force and speed near these or
/// near one that is named.
fn exercise(name: &str, zone_of_measures: Option<&str>) -> PathBuf {
    let shipped = format!("{}/scenarios/12-deep-caries.json", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(shipped).unwrap().replace("\"spacing_mm\": 0.1", "\"spacing_mm\": 0.25");
    let mut scenario: Value = serde_json::from_str(&text).unwrap();
    scenario["stages"][0]["time_limit_s"] = json!(30);
    let zones = scenario["zones"].as_array_mut().unwrap();
    let apex = json!({ "sphere": { "centre_mm": [0, 0, -12], "radius_mm": 1 } });
    let tissue = |name: &str| json!({ "tissue": name });
    for (id, region) in [("nerve", tissue("pulp")), ("enamel", tissue("enamel")), ("apex", apex)] {
        zones.push(json!({ "id": id, "title": id, "role": "leeway", "region": region }));
    }
    let items = scenario["rubric"]["items"].as_array_mut().unwrap();
    let named = zone_of_measures.map_or(vec!["nerve", "enamel", "apex"], |zone| vec![zone]);
    // The sum of the points stays 100.
    items[0]["points"] = json!(items[0]["points"].as_i64().unwrap() - 2 * named.len() as i64);
    for zone in named {
        for (measure, zero_at) in [("force_max_near_n", 4), ("speed_max_near_mm_s", 200)] {
            let metric = format!("{measure}({zone})");
            items.push(json!({ "title": metric, "metric": metric, "points": 1, "full_at": 1, "zero_at": zero_at }));
        }
    }
    let file = folder(name).join("exercise.json");
    std::fs::write(&file, scenario.to_string()).unwrap();
    file
}

#[test]
fn force_and_speed_are_measured_near_any_zone() {
    // Aim: near a zone that consists of the pulp, the values are those of the measures near the pulp; near enamel, where
    // the work begins, there are some; near the apex nobody was.
    let file = exercise("near_zones", None);
    let made = run_anew(file.to_str().unwrap(), "hasty", &folder("near_zones_out"), &[]);
    let session = session(&made);
    let value = |name: &str| metric(&session, name).unwrap();
    for (measure, near_pulp) in
        [("force_max_near_n", "force_max_near_pulp_n"), ("speed_max_near_mm_s", "speed_max_near_pulp_mm_s")]
    {
        println!("{measure}: {} near the pulp, {} near enamel", value(near_pulp), value(&format!("{measure}(enamel)")));
        assert_eq!(value(&format!("{measure}(nerve)")), value(near_pulp));
        assert!(value(&format!("{measure}(enamel)")) > 0.0);
        assert_eq!(value(&format!("{measure}(apex)")), 0.0);
    }
    assert!(value("force_max_near_n(enamel)") <= value("force_max_n"));
}

#[test]
fn a_measure_near_a_zone_that_is_not_there_is_reported() {
    let file = exercise("near_no_zone", Some("nerv"));
    let output = typodont(&["check", file.to_str().unwrap()]);
    let told = complained(&output);
    assert!(!output.status.success() && told.contains("unknown-zone") && told.contains("nerve"), "{told}");
}
