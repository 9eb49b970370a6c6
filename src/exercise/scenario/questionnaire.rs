//! Statements that a trainee agrees or disagrees with after an exercise.

use crate::local_text::LocalText;
use schemars::JsonSchema;
use serde::Deserialize;
use typodont_formats::diagnostic::Diagnostic;
use typodont_formats::{Library, json};

/// A questionnaire: statements by category, answered from 1 (not at all) to `steps` (fully).
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Questionnaire {
    /// Short name: lower-case letters, digits, hyphens, underscores.
    #[schemars(length(min = 1, max = 60), regex(pattern = r"^[a-z0-9_-]+$"))]
    pub id: String,
    /// Title shown to users.
    #[schemars(length(min = 1, max = 120))]
    pub title: LocalText,
    /// Instruction to the trainee.
    #[schemars(length(min = 1, max = 1000))]
    pub instruction: LocalText,
    /// Number of steps of the rating scale: 2 to 11.
    #[schemars(range(min = 2, max = 11))]
    pub steps: u8,
    /// Label of the lowest step.
    #[schemars(length(min = 1, max = 60))]
    pub lowest: LocalText,
    /// Label of the highest step.
    #[schemars(length(min = 1, max = 60))]
    pub highest: LocalText,
    /// Statements whose ratings are averaged together.
    #[schemars(length(min = 1, max = 20))]
    pub categories: Vec<QuestionnaireCategory>,
}

/// Statements whose ratings are averaged together.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct QuestionnaireCategory {
    /// Short name used in results: lower-case letters, digits, hyphens, underscores.
    #[schemars(length(min = 1, max = 40), regex(pattern = r"^[a-z0-9_-]+$"))]
    pub id: String,
    /// Title shown to users.
    #[schemars(length(min = 1, max = 80))]
    pub title: LocalText,
    /// The statements.
    #[schemars(length(min = 1, max = 50))]
    pub items: Vec<QuestionnaireItem>,
}

/// One statement.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct QuestionnaireItem {
    /// Short name used in results: lower-case letters, digits, hyphens, underscores.
    #[schemars(length(min = 1, max = 40), regex(pattern = r"^[a-z0-9_-]+$"))]
    pub id: String,
    /// Text of the statement.
    #[schemars(length(min = 1, max = 300))]
    pub text: LocalText,
    /// True for a statement to which agreement is unfavourable to the system. Such ratings are mirrored before they are
    /// averaged.
    #[serde(default)]
    pub negative: bool,
}

impl Questionnaire {
    /// Reads a questionnaire of the library by its name.
    ///
    /// # Errors
    /// Returns diagnostics if the file is missing or invalid, or if two statements have the same id.
    pub fn read(library: &Library, name: &str) -> Result<Questionnaire, Vec<Diagnostic>> {
        let source = library.text(&Self::file_name(name)).map_err(|e| vec![e])?;
        let read = json::read::<Questionnaire>(source)?;
        let mut found = Vec::new();
        let mut seen = Vec::new();
        for (c, category) in read.value.categories.iter().enumerate() {
            for (i, item) in category.items.iter().enumerate() {
                if seen.contains(&&item.id) {
                    let message = format!("the id \"{}\" belongs to another statement already", item.id);
                    let path = format!("/categories/{c}/items/{i}/id");
                    found.push(read.source_map.complain(&path, "duplicate-id", message, None));
                }
                seen.push(&item.id);
            }
        }
        if found.is_empty() { Ok(read.value) } else { Err(found) }
    }

    /// Returns the name of a questionnaire's file in a library.
    pub fn file_name(name: &str) -> String {
        format!("content/questionnaires/{name}.json")
    }

    /// Returns the rating that counts for an answer: mirrored (v′ = steps + 1 − v) for a statement against the system.
    pub fn scored_answer(&self, item: &QuestionnaireItem, answer: u8) -> u8 {
        if item.negative { self.steps + 1 - answer } else { answer }
    }

    pub fn items(&self) -> impl Iterator<Item = &QuestionnaireItem> {
        self.categories.iter().flat_map(|c| &c.items)
    }
}
