//! Statements that a trainee agrees or disagrees with after an exercise.

use crate::content::{Library, json};
use crate::diagnostic::Diagnostic;
use schemars::JsonSchema;
use serde::Deserialize;

/// A questionnaire: statements by category, answered from 1 (not at all) to `steps` (fully).
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Questionnaire {
    /// Short name.
    #[schemars(length(min = 1, max = 60), regex(pattern = r"^[a-z0-9_-]+$"))]
    pub id: String,
    /// Title shown to people.
    #[schemars(length(min = 1, max = 120))]
    pub title: String,
    /// What is asked of the trainee.
    #[schemars(length(min = 1, max = 1000))]
    pub instruction: String,
    /// Number of steps of the scale: 2 to 11.
    #[schemars(range(min = 2, max = 11))]
    pub steps: u8,
    /// What the lowest step means.
    #[schemars(length(min = 1, max = 60))]
    pub lowest: String,
    /// What the highest step means.
    #[schemars(length(min = 1, max = 60))]
    pub highest: String,
    /// Statements that are averaged together.
    #[schemars(length(min = 1, max = 20))]
    pub categories: Vec<Category>,
}

/// Statements that are averaged together.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Category {
    /// Short name, used in results.
    #[schemars(length(min = 1, max = 40), regex(pattern = r"^[a-z0-9_-]+$"))]
    pub id: String,
    /// Title shown to people.
    #[schemars(length(min = 1, max = 80))]
    pub title: String,
    /// The statements.
    #[schemars(length(min = 1, max = 50))]
    pub items: Vec<Item>,
}

/// One statement.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Item {
    /// Short name, used in results.
    #[schemars(length(min = 1, max = 40), regex(pattern = r"^[a-z0-9_-]+$"))]
    pub id: String,
    /// The statement.
    #[schemars(length(min = 1, max = 300))]
    pub text: String,
    /// True where agreeing speaks against the system: such answers are mirrored before they are averaged.
    #[serde(default)]
    pub negative: bool,
}

impl Questionnaire {
    /// Reads a questionnaire of the library by its name.
    pub fn read(library: &Library, name: &str) -> Result<Questionnaire, Vec<Diagnostic>> {
        let source = library.text(&Self::file(name)).map_err(|e| vec![e])?;
        let read = json::read::<Questionnaire>(source)?;
        let mut found = Vec::new();
        let mut seen = Vec::new();
        for (c, category) in read.value.categories.iter().enumerate() {
            for (i, item) in category.items.iter().enumerate() {
                if seen.contains(&&item.id) {
                    let message = format!("there is already a statement \"{}\"", item.id);
                    let path = format!("/categories/{c}/items/{i}/id");
                    found.push(read.places.complain(&path, "duplicate-id", message, None));
                }
                seen.push(&item.id);
            }
        }
        if found.is_empty() { Ok(read.value) } else { Err(found) }
    }

    /// Name of a questionnaire's file in a library.
    pub fn file(name: &str) -> String {
        format!("content/questionnaires/{name}.json")
    }

    /// An answer as it counts: mirrored (v′ = steps + 1 − v) for statements against the system.
    pub fn counted(&self, item: &Item, answer: u8) -> u8 {
        if item.negative { self.steps + 1 - answer } else { answer }
    }

    pub fn items(&self) -> impl Iterator<Item = &Item> {
        self.categories.iter().flat_map(|c| &c.items)
    }
}
