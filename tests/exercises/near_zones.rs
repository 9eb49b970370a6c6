//! Force and speed near a zone that an author names.

use crate::support::bundle::{complained, metric, run_anew, session, typodont};
use crate::support::folder::folder;
use serde_json::{Value, json};
use std::path::PathBuf;
use typodont_core::tick::Tick;
use typodont_exercise::record::{self, Recording, ReplayCheck};
use typodont_exercise::scenario::{LimitPlace, LimitedQuantity};
use typodont_exercise::score::{self, EXCEEDANCE_GAP_TICKS, LimitMonitor};

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

#[test]
fn warnings_and_measures_agree_about_every_limit() {
    // Aim: whoever is warned near a zone finds the same value in the result, and nobody is warned of what the result does not
    // have. Method: a hasty session in an exercise with limits near three zones, at one of which nobody was, and anywhere; the
    // peaks that a monitor of its ticks finds beside the measures, and the warnings that it raises, tick by tick.
    let file = exercise("near_limits", None);
    let mut scenario: Value = serde_json::from_str(&std::fs::read_to_string(&file).unwrap()).unwrap();
    let near = |zone: &str, response: &str| json!({ "place": { "zone": zone }, "force_n": 1.0, "speed_mm_s": 20, "response": response });
    let limits = [near("nerve", "warning"), near("enamel", "cry"), near("apex", "both")];
    scenario["limits"] = json!({ "warning_force_n": 20, "cry_force_n": 0.9, "cry_speed_mm_s": 30, "near": limits });
    std::fs::write(&file, scenario.to_string()).unwrap();
    let made = run_anew(file.to_str().unwrap(), "hasty", &folder("near_limits_out"), &[]);
    let session = session(&made);
    let recording = Recording::read(&made.join("recording.mcap")).unwrap();
    let scenario = &recording.scenario;
    let workpiece = recording.workpiece().unwrap();
    let mut monitor = LimitMonitor::new(scenario, &workpiece);
    let (mut raised, mut shown) = (Vec::new(), None);
    record::replay(&recording, workpiece, ReplayCheck::Skip, |_, step, _, _| {
        monitor.observe(step);
        let warning = monitor.warning(step.tick).map(|e| (e.limit, e.span[0]));
        raised.extend(warning.filter(|_| warning != shown));
        shown = warning;
    });
    let exceedances = monitor.exceedances();
    let mut exceeded = 0;
    for (index, limit) in scenario.limits.iter().enumerate() {
        let name = match limit.quantity {
            LimitedQuantity::Force => ["force_max_n", "force_max_near_n"],
            LimitedQuantity::Speed => ["speed_max_mm_s", "speed_max_near_mm_s"],
        };
        let name = match limit.place {
            LimitPlace::Anywhere => name[0].to_string(),
            LimitPlace::Zone(zone) => format!("{}({})", name[1], scenario.zones[zone].id),
            LimitPlace::Tissue(_) => unreachable!("the exercise limits no tissue"),
        };
        let measured = metric(&session, &name).unwrap();
        let peak = exceedances.iter().filter(|e| e.limit == index).map(|e| e.peak).reduce(f32::max);
        println!("{name}: {measured}, limit {}, exceeded up to {peak:?}", limit.most);
        match measured > f64::from(limit.most) {
            true => assert!((f64::from(peak.unwrap()) - measured).abs() < 1e-3, "{name}"),
            false => assert_eq!(peak, None, "{name}"),
        }
        exceeded += usize::from(peak.is_some());
    }
    assert!(exceeded >= 5 && exceeded < scenario.limits.len(), "{exceeded}");
    // The first limit that warns is the force near the nerve, and nothing hides its warnings.
    let of_first = |all: &[(usize, Tick)]| all.iter().filter(|(limit, _)| *limit == 0).copied().collect::<Vec<_>>();
    let expected: Vec<_> = exceedances.iter().map(|e| (e.limit, e.span[0])).collect();
    assert_eq!(of_first(&raised), of_first(&expected));
    let ends = |e: &score::Exceedance| e.span[1].0 + EXCEEDANCE_GAP_TICKS;
    let of_one = |limit: usize| exceedances.iter().filter(move |e| e.limit == limit).collect::<Vec<_>>();
    for limit in 0..scenario.limits.len() {
        assert!(of_one(limit).windows(2).all(|pair| ends(pair[0]) <= pair[1].span[0].0), "two in one pause: {limit}");
    }
    assert!(!raised.iter().any(|(limit, _)| !scenario.limits[*limit].warns), "a cry is no warning");
}
