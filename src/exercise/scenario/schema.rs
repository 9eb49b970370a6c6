//! The JSON Schema of scenarios, for authors' editors.

use super::file::ScenarioFile;
use typodont_formats::json;

/// Returns the schema as indented JSON with a final newline: the content of `scenarios/scenario.schema.json`.
pub fn schema_text() -> String {
    let mut schema = json::schema_of::<ScenarioFile>();
    schema.insert("title".into(), "Typodont scenario".into());
    // A schema is a tree of strings and numbers; writing it cannot fail.
    serde_json::to_string_pretty(&schema).unwrap_or_default() + "\n"
}
