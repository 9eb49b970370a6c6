//! An exercise that is edited keeps every byte that nobody changed.

use serde_json::{Value, json};
use std::fs;
use std::path::{Path, PathBuf};
use typodont_author::{ExerciseDraft, Overwrite, read, save};
use typodont_exercise::local_text::LocalTexts;
use typodont_exercise::scenario::{ResolveMode, Scenario, resolve};
use typodont_formats::pointer::child;
use typodont_lesson::library_for;

use crate::support::folder;

/// Every exercise that ships.
fn shipped() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios");
    let files = typodont_lesson::scenario_files(&folder).unwrap();
    assert!(files.len() >= 9);
    files
}

/// Every word, number and truth of a scenario, by pointer.
fn leaves(value: &Value, pointer: String, found: &mut Vec<(String, Value)>) {
    match value {
        Value::Object(map) => map.iter().for_each(|(key, inner)| leaves(inner, child(&pointer, key), found)),
        Value::Array(list) => list.iter().enumerate().for_each(|(i, inner)| leaves(inner, child(&pointer, i), found)),
        leaf => found.push((pointer, leaf.clone())),
    }
}

#[test]
fn every_shipped_exercise_is_saved_back_byte_for_byte() {
    // Aim: opening and saving loses nothing. Method: read, save beside, compare; and once more over a changed and undone draft.
    let place = folder::folder("authoring-same");
    for file in shipped() {
        let bytes = fs::read(&file).unwrap();
        let (text, _) = read(&file).unwrap();
        let mut draft = ExerciseDraft::new(text);
        let beside = place.join(file.file_name().unwrap());
        let stand = save(&beside, draft.text(), Overwrite::Never).unwrap();
        assert_eq!(fs::read(&beside).unwrap(), bytes, "{}", file.display());
        draft.set("/title", &json!("Another")).unwrap();
        draft.push("/stages", &json!({ "id": "more" })).unwrap();
        draft.undo();
        draft.undo();
        save(&beside, draft.text(), Overwrite::IfUnchanged(&stand)).unwrap();
        assert_eq!(fs::read(&beside).unwrap(), bytes, "{} after undo", file.display());
    }
}

#[test]
fn a_changed_value_changes_its_own_line_and_no_other() {
    // Aim: whoever compares two versions sees what was meant. Method: every value of every shipped exercise, one at a time.
    let mut changed = 0;
    for file in shipped() {
        let text = read(&file).unwrap().0;
        let mut all = Vec::new();
        leaves(ExerciseDraft::new(text.as_str()).value(), String::new(), &mut all);
        for (pointer, old) in all {
            let new = match &old {
                Value::String(_) => json!("another"),
                Value::Number(number) => json!(number.as_f64().unwrap() + 1.123),
                Value::Bool(truth) => json!(!truth),
                _ => json!(true),
            };
            let mut draft = ExerciseDraft::new(text.as_str());
            draft.set(&pointer, &new).unwrap();
            assert_eq!(draft.value_at(&pointer), Some(&new), "{pointer}");
            let differ = text.lines().zip(draft.text().lines()).filter(|(a, b)| a != b).count();
            assert_eq!(
                (differ, draft.text().lines().count()),
                (1, text.lines().count()),
                "{}: {pointer}",
                file.display()
            );
            draft.undo();
            assert_eq!(draft.text(), text, "{pointer}");
            changed += 1;
        }
    }
    assert!(changed > 400, "{changed}");
}

#[test]
fn the_rest_of_a_changed_exercise_means_what_it_meant() {
    // Aim: a change has no effect beside its own. Method: another title and time limit, resolved; with those set back the
    // scenario is the same, apart from the translations of the title.
    let resolved = |file: &Path, text: &str| -> Scenario {
        let source = typodont_formats::diagnostic::SourceText::new(file.display().to_string(), text);
        let scenario = resolve(source, &library_for(file), ResolveMode::ReadScans).unwrap();
        Scenario { text: "".into(), sha256: String::new(), texts: LocalTexts::default(), ..scenario }
    };
    for file in shipped() {
        let text = read(&file).unwrap().0;
        let before = resolved(&file, &text);
        let mut draft = ExerciseDraft::new(text);
        draft.set("/title", &json!("Another \"title\"")).unwrap();
        draft.set("/stages/0/time_limit_s", &json!(77)).unwrap();
        let mut after = resolved(&file, draft.text());
        assert_eq!((after.title.as_str(), after.stages[0].time_limit), ("Another \"title\"", Some(77.0)));
        after.title = before.title.clone();
        // Trials of the first stage are stages of their own.
        let trials = before.stages[0].draw.as_ref().map_or(1, |draw| draw.trials as usize);
        for (after, before) in after.stages.iter_mut().zip(&before.stages).take(trials) {
            after.time_limit = before.time_limit;
        }
        assert_eq!(format!("{after:?}"), format!("{before:?}"), "{}", file.display());
    }
}
