//! The schema that editors get accepts exactly what the program reads.

use proptest::prelude::*;
use serde_json::{Value, json};
use std::fs;
use std::path::PathBuf;
use typodont_exercise::scenario::file::ScenarioFile;
use typodont_exercise::scenario::schema_text;
use typodont_formats::diagnostic::SourceText;
use typodont_formats::json;

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn shipped() -> Vec<Value> {
    let mut files: Vec<PathBuf> = fs::read_dir(root().join("scenarios")).unwrap().map(|e| e.unwrap().path()).collect();
    files.retain(|p| p.extension().is_some_and(|e| e == "json") && !p.to_string_lossy().ends_with(".schema.json"));
    files.sort();
    files.iter().map(|p| serde_json::from_str(&fs::read_to_string(p).unwrap()).unwrap()).collect()
}

fn is_read(value: &Value) -> bool {
    json::read::<ScenarioFile>(SourceText::new("x.json", value.to_string())).is_ok()
}

/// Every pointer into a value.
fn pointers(value: &Value, at: String, all: &mut Vec<String>) {
    all.push(at.clone());
    match value {
        Value::Object(map) => map.iter().for_each(|(k, v)| pointers(v, format!("{at}/{k}"), all)),
        Value::Array(list) => list.iter().enumerate().for_each(|(i, v)| pointers(v, format!("{at}/{i}"), all)),
        _ => {}
    }
}

#[test]
fn the_shipped_schema_is_the_programs_own() {
    // Aim: `scenarios/scenario.schema.json` never lags behind. Rewrite it with `typodont schema > scenarios/…`.
    let shipped = fs::read_to_string(root().join("scenarios/scenario.schema.json")).unwrap();
    assert!(shipped == schema_text(), "run: typodont schema > scenarios/scenario.schema.json");
}

#[test]
fn the_schema_accepts_the_shipped_exercises() {
    let schema: Value = serde_json::from_str(&schema_text()).unwrap();
    let validator = jsonschema::validator_for(&schema).unwrap();
    for scenario in shipped() {
        assert!(validator.is_valid(&scenario), "{}", scenario["id"]);
        assert!(is_read(&scenario), "{}", scenario["id"]);
    }
}

/// Values that authors might put anywhere by mistake.
fn wrong_value() -> impl Strategy<Value = Value> {
    prop_oneof![
        Just(Value::Null),
        any::<bool>().prop_map(Value::from),
        (-5000i64..5000).prop_map(Value::from),
        (-100.0f64..100.0).prop_map(Value::from),
        prop_oneof![Just(0.0), Just(1.0), Just(36.0), Just(100.0), Just(-1.0)].prop_map(Value::from),
        "[a-zA-Z0-9_ #-]{0,12}".prop_map(Value::from),
        Just(json!([])),
        Just(json!({})),
        Just(json!([1, 2, 3])),
        Just(json!({ "sphere": { "radius_mm": 1.0 } })),
        Just(json!({ "quadrant": 2 })),
        Just(json!({ "above": 0 })),
        Just(json!("confirmed")),
        Just(json!("O")),
        Just(json!("#6b4226")),
        Just(json!({ "yes_no": null })),
        Just(json!("text")),
        Just(json!("tube")),
        Just(json!({ "forces": { "file": "felt.csv", "space": "tooth" } })),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1500, failure_persistence: None, ..ProptestConfig::default() })]

    /// Method: put a wrong (or right) value anywhere into a shipped exercise, or take a key away, and ask both.
    #[test]
    fn schema_and_reader_agree(which in 0usize..6, place in any::<prop::sample::Index>(), value in wrong_value(), drop_it in any::<bool>()) {
        thread_local! {
            static VALIDATOR: jsonschema::Validator =
                jsonschema::validator_for(&serde_json::from_str(&schema_text()).unwrap()).unwrap();
        }
        let mut scenario = shipped().swap_remove(which);
        let mut all = Vec::new();
        pointers(&scenario, String::new(), &mut all);
        let pointer = place.get(&all).clone();
        match pointer.rsplit_once('/') {
            Some((parent, key)) if drop_it => match scenario.pointer_mut(parent) {
                Some(Value::Object(map)) => drop(map.remove(key)),
                Some(Value::Array(list)) => drop(list.remove(key.parse().unwrap())),
                _ => {}
            },
            _ => *scenario.pointer_mut(&pointer).unwrap() = value,
        }
        let by_schema = VALIDATOR.with(|v| v.is_valid(&scenario));
        prop_assert_eq!(by_schema, is_read(&scenario), "{} in {}", pointer, scenario);
    }
}
