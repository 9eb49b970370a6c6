//! What the kind of tool and the patient's age make of how tissues feel.
//!
//! Takes `content/touch.json`. Gives factors by tissue, tool and age band; 1 where the table says nothing. Every line names
//! its source, or that it was chosen by feel.

use super::json;
use super::{Library, ToolKind};
use crate::diagnostic::Diagnostic;
use crate::touch::Factor;
use schemars::JsonSchema;
use serde::Deserialize;

/// Ages between which tissues differ.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum AgeBand {
    Child,
    YoungAdult,
    Adult,
    Old,
}

impl AgeBand {
    /// Bands begin at 0, 18, 36 and 61 years.
    pub fn of(years: f32) -> AgeBand {
        match years {
            y if y < 18.0 => AgeBand::Child,
            y if y < 36.0 => AgeBand::YoungAdult,
            y if y < 61.0 => AgeBand::Adult,
            _ => AgeBand::Old,
        }
    }
}

/// `content/touch.json` as written.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct FeelFile {
    /// What a kind of tool makes of a tissue.
    #[schemars(length(max = 1000))]
    by_tool: Vec<ToolRow>,
    /// What an age makes of a tissue.
    #[schemars(length(max = 1000))]
    by_age: Vec<AgeRow>,
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct ToolRow {
    /// Name of the tissue.
    tissue: String,
    kind: ToolKind,
    #[serde(default = "one")]
    #[schemars(range(min = 0.1, max = 10.0))]
    stiffness: f32,
    #[serde(default = "one")]
    #[schemars(range(min = 0.1, max = 10.0))]
    damping: f32,
    #[serde(default = "one")]
    #[schemars(range(min = 0.1, max = 10.0))]
    static_friction: f32,
    #[serde(default = "one")]
    #[schemars(range(min = 0.1, max = 10.0))]
    dynamic_friction: f32,
    #[serde(default = "one")]
    #[schemars(range(min = 0.1, max = 10.0))]
    hardness: f32,
    /// Of the force from which the tissue is cut. A hand instrument cuts only tissues of which this is said.
    #[serde(default)]
    #[schemars(range(min = 0.1, max = 10.0))]
    cut_force: Option<f32>,
    /// Where the values come from, and in what range they make sense.
    #[schemars(length(min = 1, max = 500))]
    #[allow(dead_code)]
    source: String,
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct AgeRow {
    /// Name of the tissue.
    tissue: String,
    band: AgeBand,
    #[serde(default = "one")]
    #[schemars(range(min = 0.1, max = 10.0))]
    stiffness: f32,
    #[serde(default = "one")]
    #[schemars(range(min = 0.1, max = 10.0))]
    damping: f32,
    #[serde(default = "one")]
    #[schemars(range(min = 0.1, max = 10.0))]
    static_friction: f32,
    #[serde(default = "one")]
    #[schemars(range(min = 0.1, max = 10.0))]
    dynamic_friction: f32,
    #[serde(default = "one")]
    #[schemars(range(min = 0.1, max = 10.0))]
    hardness: f32,
    /// Where the values come from, and in what range they make sense.
    #[schemars(length(min = 1, max = 500))]
    #[allow(dead_code)]
    source: String,
}

fn one() -> f32 {
    1.0
}

/// Factors by tissue, tool and age.
#[derive(Clone, Debug)]
pub struct FeelTable {
    by_tool: Vec<(String, ToolKind, Factor)>,
    by_age: Vec<(String, AgeBand, Factor)>,
}

impl FeelTable {
    /// Name of the table in a [`Library`].
    pub const NAME: &str = "content/touch.json";

    /// The table; `None` where there is none, as in recordings of programs that did not know it.
    pub fn read(library: &Library) -> Result<Option<FeelTable>, Vec<Diagnostic>> {
        let source = match library.text(Self::NAME) {
            Ok(source) => source,
            Err(complaint) if complaint.code == "missing-file" => return Ok(None),
            Err(complaint) => return Err(vec![complaint]),
        };
        let FeelFile { by_tool, by_age } = json::read::<FeelFile>(source)?.value;
        let by_tool = by_tool.into_iter().map(|row| {
            let ToolRow {
                tissue,
                kind,
                stiffness,
                damping,
                static_friction,
                dynamic_friction,
                hardness,
                cut_force,
                ..
            } = row;
            // Of what is not said of a blade follows `factor`, below.
            let cut_force = cut_force.unwrap_or(if kind.is_blade() { f32::INFINITY } else { 1.0 });
            (tissue, kind, Factor { stiffness, damping, static_friction, dynamic_friction, hardness, cut_force })
        });
        let by_age = by_age.into_iter().map(|row| {
            let AgeRow { tissue, band, stiffness, damping, static_friction, dynamic_friction, hardness, .. } = row;
            let cut_force = 1.0;
            (tissue, band, Factor { stiffness, damping, static_friction, dynamic_friction, hardness, cut_force })
        });
        Ok(Some(FeelTable { by_tool: by_tool.collect(), by_age: by_age.collect() }))
    }

    /// What a tool and an age make of a tissue; `None` changes nothing.
    pub fn factor(&self, tissue: &str, kind: Option<ToolKind>, band: Option<AgeBand>) -> Factor {
        let tool = self.by_tool.iter().filter(|(t, k, _)| t == tissue && Some(*k) == kind).map(|(.., f)| *f);
        let is_told = tool.clone().next().is_some();
        let cut_force = if kind.is_some_and(ToolKind::is_blade) && !is_told { f32::INFINITY } else { 1.0 };
        let untold = Factor { cut_force, ..Factor::ONE };
        let age = self.by_age.iter().filter(|(t, b, _)| t == tissue && Some(*b) == band).map(|(.., f)| *f);
        tool.chain(age).fold(untold, Factor::times)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shipped_table_says_what_it_says() {
        let table = FeelTable::read(&Library::shipped()).unwrap().unwrap();
        assert_eq!(table.factor("enamel", None, None), Factor::ONE);
        assert_eq!(table.factor("amalgam", Some(ToolKind::DiamondBur), Some(AgeBand::Old)), Factor::ONE);
        let (tool, age) = (Some(ToolKind::DiamondBur), Some(AgeBand::Old));
        let both = table.factor("dentine", tool, age);
        assert_eq!(both, table.factor("dentine", tool, None).times(table.factor("dentine", None, age)));
        assert!(both.hardness > 1.0 && both != Factor::ONE);
    }
}
