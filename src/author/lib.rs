//! Editing of an exercise file: its text, with every formatting choice of its author preserved.
//!
//! Takes the text of a scenario and one change at a time, addressed by JSON pointer. Gives the text with only that
//! value changed, the schema of each value, and the file, written completely or not at all. Never knows a window or a
//! clock, and never repairs a text that a person wrote.
//!
//! ```
//! use typodont_author::ExerciseDraft;
//!
//! let mut draft = ExerciseDraft::new(r#"{ "id":"class-1",   "title": "Class I" }"#);
//! draft.set("/title", &serde_json::Value::from("Class II")).unwrap();
//! assert_eq!(draft.text(), r#"{ "id":"class-1",   "title": "Class II" }"#);
//! draft.undo();
//! assert_eq!(draft.value_at("/title").unwrap(), "Class I");
//! ```

mod defaults;
mod draft;
mod edit;
mod schema_form;
mod file_io;
mod json_format;
mod picking;

pub use defaults::{ARCH_SPACING_MM, STAGE_TIME_LIMIT_S, arch_tooth, default_entry, default_variant, new_exercise};
pub use draft::ExerciseDraft;
pub use edit::{EditError, pointer_at};
pub use file_io::{FileStamp, Overwrite, SaveError, autosave, read, save};
pub use picking::{SurfaceLocation, surface_location};
pub use schema_form::{FieldKind, SchemaField, SchemaForm, SchemaVariant};
