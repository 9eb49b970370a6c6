//! Default content of new parts: a whole exercise, a stage, decay, an item of the rubric.
//!
//! Each default is valid as it is, so that an author can change existing values instead of guessing the required ones.

use super::schema_form::{FieldKind, SchemaForm};
use serde_json::{Map, Value, json};
use typodont_formats::pointer::child;

/// Time limit of a new stage, s; the file of an exercise has no default, and a stage without a limit has none.
pub const STAGE_TIME_LIMIT_S: u32 = 300;

/// Voxel size of an arch whose file gives none, mm.
pub const ARCH_SPACING_MM: f64 = 0.2;

/// Returns a short, readable exercise: a molar in its jaw, one decay, one stage, a rubric of three items. The texts are
/// given in the author's language.
pub fn new_exercise(title: &str, stage: &str, instruction: &str, lines: [&str; 3], fail: &str) -> String {
    let [title, stage, instruction] = [title, stage, instruction].map(super::json_format::quote);
    let [cleared, spared, light] = lines.map(super::json_format::quote);
    let fail = super::json_format::quote(fail);
    format!(
        r#"{{
  "id": "new-exercise",
  "title": {title},
  "summary": "",
  "scene": {{
    "jaw": {{
      "tooth": {{
        "id": "tooth",
        "fdi": 36,
        "form": {{ "procedural": {{ "spacing_mm": 0.1 }} }},
        "decay": [
          {{ "id": "lesion-1", "shape": {{ "sphere": {{ "radius_mm": 1.5 }} }}, "surface": "O", "at": "centre", "depth_mm": 0.4 }}
        ]
      }},
      "periodontium": {{}}
    }}
  }},
  "instruments": ["round_bur_014", "explorer"],
  "stages": [
    {{
      "id": "stage-1",
      "title": {stage},
      "instruction": {instruction},
      "time_limit_s": {STAGE_TIME_LIMIT_S},
      "cutting": true,
      "show_decay": true,
      "ends_when": ["confirmed"]
    }}
  ],
  "rubric": {{
    "pass_points": 70,
    "items": [
      {{ "title": {cleared}, "metric": "accessible_decay_cleared_pct", "points": 50, "full_at": 98, "zero_at": 70 }},
      {{
        "title": {spared}, "metric": "healthy_per_decay_pct", "points": 30, "full_at": 20, "zero_at": 100,
        "counts_with": "accessible_decay_cleared_pct"
      }},
      {{
        "title": {light}, "metric": "force_max_n", "points": 20, "full_at": 1.8, "zero_at": 3.3,
        "counts_with": "accessible_decay_cleared_pct"
      }}
    ],
    "hard_fails": [
      {{ "title": {fail}, "metric": "pulp_exposed", "when": {{ "above": 0 }} }}
    ]
  }}
}}
"#
    )
}

/// Returns the default value at a pointer: a new entry if a list is there, otherwise the object itself. `whole` is the
/// scenario so far.
pub fn default_entry(form: &SchemaForm, whole: &Value, pointer: &str) -> Value {
    let list = whole.pointer(pointer).and_then(Value::as_array);
    let key = pointer.rsplit('/').next().unwrap_or_default();
    let id = |stem: &str| unused_id(whole, stem);
    match key {
        "stages" => json!({
            "id": id("stage"), "title": id("stage"), "instruction": "…", "time_limit_s": STAGE_TIME_LIMIT_S, "ends_when": ["confirmed"]
        }),
        "decay" => json!({
            "id": id("lesion"), "shape": { "sphere": { "radius_mm": 1.5 } }, "surface": "O", "at": "centre", "depth_mm": 0.4
        }),
        "teeth" => arch_tooth(whole, unlisted_tooth(whole, list.map_or(&[], Vec::as_slice))),
        "stains" => json!({
            "id": id("stain"), "shape": { "fissure": { "reaches": ["outer_enamel"], "length_mm": 4, "spread_mm": 0.8 } }
        }),
        "zones" => json!({
            "id": id("zone"), "title": id("zone"), "role": "never_remove",
            "region": { "around": { "tissue": "pulp", "within_mm": 0.5 } }
        }),
        "pictures" => json!({ "file": "picture.jpg", "title": id("picture") }),
        "near" => json!({ "place": { "tissue": "pulp" }, "force_n": 1.5, "response": "warning" }),
        "ask" => json!({ "id": id("question"), "text": "…", "answer": { "yes_no": null } }),
        "options" => json!({ "id": id("option"), "text": "…" }),
        "choice" => json!({ "options": [{ "id": "a", "text": "A" }, { "id": "b", "text": "B" }], "correct": null }),
        "number" => json!({ "unit": "mm", "correct": null, "tolerance": 0.5 }),
        "items" => {
            let given: f64 = list.into_iter().flatten().filter_map(|item| item.get("points")?.as_f64()).sum();
            let left = if (0.0..100.0).contains(&given) { 100.0 - given } else { 10.0 };
            json!({ "title": "…", "metric": "force_max_n", "points": left, "full_at": 1.8, "zero_at": 3.3 })
        }
        "hard_fails" => json!({ "title": "…", "metric": "pulp_exposed", "when": { "above": 0 } }),
        "rubric" => json!({
            "pass_points": 70,
            "items": [{ "title": "…", "metric": "decay_cleared_pct", "points": 100, "full_at": 98, "zero_at": 70 }]
        }),
        "stiffness_steps" => json!({ "tissue": "caries", "coefficients": [0.6, 0.4, 0.2], "step_time_s": 60 }),
        "rim" => json!({ "tissue": "firm_caries", "share": 0.4 }),
        "patient" => json!({ "age_years": 30 }),
        "stiffness_ratio" => json!({ "of": "enamel", "to": "dentine", "ratio": 5 }),
        "instruments" => json!("explorer"),
        "ends_when" => json!("confirmed"),
        "reaches" => json!("outer_dentine"),
        "new_tissues" => json!({
            "id": 100, "name": id("tissue"), "title": id("tissue"), "role": "sound", "color": "#d0c0a0", "stiffness": 0.5,
            "damping": 0.5, "static_friction": 0.4, "dynamic_friction": 0.4, "cut_force_n": 1, "hardness_hv": 60
        }),
        _ => {
            let schema = form.schema_at(pointer);
            let schema = match schema.map(|schema| form.field(schema).kind) {
                Some(FieldKind::List { item: of, .. }) => Some(of),
                _ => schema,
            };
            schema.map_or(Value::Null, |schema| minimal_value(form, whole, schema, pointer))
        }
    }
}

/// Returns a sound tooth for the list of an arch; `whole` is the scenario so far.
pub fn arch_tooth(whole: &Value, fdi: u8) -> Value {
    let spacing = whole.pointer("/scene/dental_arch/spacing_mm").cloned().unwrap_or(json!(ARCH_SPACING_MM));
    json!({ "id": fdi.to_string(), "fdi": fdi, "form": { "procedural": { "spacing_mm": spacing } } })
}

/// Returns the first tooth of an arch's jaw that its list does not have.
fn unlisted_tooth(whole: &Value, list: &[Value]) -> u8 {
    let listed: Vec<u64> = list.iter().filter_map(|tooth| tooth.get("fdi")?.as_u64()).collect();
    let missing = whole.pointer("/scene/dental_arch/arch/missing").and_then(Value::as_array);
    let missing: Vec<u64> = missing.into_iter().flatten().filter_map(Value::as_u64).collect();
    let quadrants = if listed.first().is_some_and(|fdi| *fdi < 30) { [1, 2] } else { [3, 4] };
    // Third molars last.
    let numbers = [6, 7, 5, 4, 3, 2, 1, 8];
    let mut all = numbers.into_iter().flat_map(|number| quadrants.map(|quadrant: u8| 10 * quadrant + number));
    let is_free = |fdi: &u8| !listed.contains(&u64::from(*fdi)) && !missing.contains(&u64::from(*fdi));
    all.find(is_free).unwrap_or(10 * quadrants[0] + 6)
}

/// Returns the smallest value that a schema accepts, as far as the schema determines it.
fn minimal_value(form: &SchemaForm, whole: &Value, schema: &Value, pointer: &str) -> Value {
    /// Maximum depth of nesting; no part of a scenario is nested as deeply.
    const MAX_DEPTH: usize = 24;
    if pointer.matches('/').count() > MAX_DEPTH {
        return Value::Null;
    }
    let key = pointer.rsplit('/').next().unwrap_or_default();
    let field = form.field(schema);
    if let Some(usual) = field.default {
        return usual.clone();
    }
    match field.kind {
        FieldKind::Boolean => json!(false),
        FieldKind::Number { min: least, max: most, .. } => {
            let low = least.unwrap_or(0.0);
            match key {
                "fdi" => json!(36),
                _ => json!(1.0f64.clamp(low, most.unwrap_or(f64::MAX).max(low))),
            }
        }
        FieldKind::Text { is_id: true, .. } => json!(unused_id(whole, key)),
        FieldKind::Text { .. } => match key {
            "tissue" | "to" => json!("dentine"),
            "of" => json!("enamel"),
            "tooth_with" | "quadrant_of" => json!(first_decay(whole)),
            _ => json!("…"),
        },
        FieldKind::Choice(variants) => match variants.first() {
            None => Value::Null,
            Some(first) => default_variant(form, whole, pointer, first.name, first.schema),
        },
        FieldKind::Object(keys) => {
            let needed = keys.into_iter().filter(|(_, is_needed, _)| *is_needed);
            let of = |(key, _, inner): (&str, bool, &Value)| {
                (key.to_string(), minimal_value(form, whole, inner, &child(pointer, key)))
            };
            Value::Object(needed.map(of).collect::<Map<_, _>>())
        }
        FieldKind::Map(_) => json!({}),
        FieldKind::List { item: of, min: count, .. } => {
            (0..count).map(|index| minimal_value(form, whole, of, &child(pointer, index))).collect()
        }
        FieldKind::Other => Value::Null,
    }
}

/// Returns the default value of a variant by its name: the name itself, or an object with the required content.
pub fn default_variant(form: &SchemaForm, whole: &Value, pointer: &str, word: &str, holds: Option<&Value>) -> Value {
    match holds {
        None => json!(word),
        Some(holds) => {
            let at = child(pointer, word);
            let known = ["choice", "number"].contains(&word).then(|| default_entry(form, whole, &at));
            let inner = known.unwrap_or_else(|| match word {
                "sphere" => json!({ "radius_mm": 1.5 }),
                "ellipsoid" => json!({ "radii_mm": [1.5, 1.5, 1.0] }),
                "fissure" => json!({ "reaches": ["outer_dentine"], "length_mm": 3, "spread_mm": 1 }),
                "smooth" => json!({ "reaches": ["outer_dentine"], "width_mm": 3, "height_mm": 2, "spread_mm": 1 }),
                "offset_mm" => json!([0, 0]),
                "cleared_pct" => json!(95),
                "rate" => json!({ "rpm": 200_000 }),
                "yes_no" => Value::Null,
                _ => minimal_value(form, whole, holds, &at),
            });
            json!({ word: inner })
        }
    }
}

fn first_decay(whole: &Value) -> String {
    fn within(value: &Value) -> Option<&str> {
        match value {
            Value::Object(map) => match map.get("decay").and_then(|list| list.get(0)?.get("id")?.as_str()) {
                Some(id) => Some(id),
                None => map.values().find_map(within),
            },
            _ => None,
        }
    }
    whole.get("scene").and_then(within).unwrap_or("lesion-1").to_string()
}

/// Returns `stem-1`, or the next number that is not yet an id or a name in the scenario.
fn unused_id(whole: &Value, stem: &str) -> String {
    fn names<'v>(value: &'v Value, found: &mut Vec<&'v str>) {
        match value {
            Value::Object(map) => {
                found.extend(["id", "name"].iter().filter_map(|key| map.get(*key)?.as_str()));
                map.values().for_each(|inner| names(inner, found));
            }
            Value::Array(list) => list.iter().for_each(|inner| names(inner, found)),
            _ => {}
        }
    }
    let mut taken = Vec::new();
    names(whole, &mut taken);
    let name = |number: usize| format!("{stem}-{number}");
    (1..).map(name).find(|name| !taken.contains(&name.as_str())).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ExerciseDraft;
    use typodont_exercise::scenario::{ResolveMode, resolve};
    use typodont_formats::Library;
    use typodont_formats::diagnostic::{SourceText, headlines};

    fn complaints(text: &str) -> String {
        let found = resolve(SourceText::new("new.json", text), &Library::shipped(), ResolveMode::ReadScans).err();
        found.map_or(String::new(), |found| headlines(&found))
    }

    fn new() -> ExerciseDraft {
        ExerciseDraft::new(new_exercise("A \"new\" one", "Stage", "Do it.", ["a", "b", "c"], "d"))
    }

    #[test]
    fn a_new_exercise_is_sound_and_so_is_all_that_is_added_to_it() {
        // Aim: every part that the form adds is valid without changes. Method: each addition by itself.
        assert_eq!(complaints(new().text()), "");
        let tooth = "/scene/jaw/tooth";
        let lists = ["/stages", "/zones", "/stages/0/ask", "/rubric/hard_fails", "/new_tissues"];
        let lists = lists.into_iter().map(String::from).chain([format!("{tooth}/decay"), format!("{tooth}/stains")]);
        for list in lists {
            let (mut draft, form) = (new(), SchemaForm::default());
            for _ in 0..2 {
                draft.push(&list, &default_entry(&form, draft.value(), &list)).unwrap();
                if list == "/new_tissues" {
                    break;
                }
            }
            assert_eq!(complaints(draft.text()), "", "{list}");
        }
        for object in ["/patient", "/stiffness_ratio", "/measures", "/operating_field", "/vibration", "/carving"] {
            let (mut draft, form) = (new(), SchemaForm::default());
            draft.set(object, &default_entry(&form, draft.value(), object)).unwrap();
            assert_eq!(complaints(draft.text()), "", "{object}");
        }
    }

    #[test]
    fn every_shape_of_decay_answer_and_region_begins_sound() {
        for at in [
            "/scene/jaw/tooth/decay/0/shape",
            "/scene/jaw/tooth/decay/0/at",
            "/stages/0/ask/0/answer",
            "/stages/0/ends_when/0",
            "/carving/law",
            "/rubric/hard_fails/0/when",
        ] {
            let form = SchemaForm::default();
            let FieldKind::Choice(variants) = form.field(form.schema_at(at).unwrap()).kind else { panic!("{at}") };
            for variant in variants {
                let mut draft = new();
                draft.set("/scene/jaw/tooth/decay/0/depth_mm", &json!(0)).unwrap();
                draft.set("/scene/jaw/tooth/decay/0/at", &json!({ "quadrant": 1 })).unwrap();
                draft.push("/stages/0/ask", &default_entry(&form, draft.value(), "/stages/0/ask")).unwrap();
                let value = default_variant(&form, draft.value(), at, variant.name, variant.schema);
                draft.set(at, &value).unwrap();
                let found = complaints(draft.text());
                // A jaw has one tooth to be treated, so that a question for the tooth is refused.
                assert!(found.is_empty() || variant.name == "tooth_with", "{at} {}: {found}", variant.name);
            }
        }
    }
}
