//! Factors by which the kind of instrument and the patient's age change the tactile properties of tissues.
//!
//! Takes `content/touch.json`. Gives factors by tissue, instrument kind and age band; 1 for a combination that is not
//! in the table. Every row names its source, or states that its values were chosen by feel.

use crate::catalog::ToolKind;
use schemars::JsonSchema;
use serde::Deserialize;
use typodont_core::touch::MaterialScale;
use typodont_formats::Library;
use typodont_formats::diagnostic::Diagnostic;
use typodont_formats::json;

/// Age bands with different tissue properties.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum AgeBand {
    Child,
    YoungAdult,
    Adult,
    Old,
}

impl AgeBand {
    /// Returns the band of an age in years. The bands begin at 0, 18, 36 and 61 years.
    pub fn of(years: f32) -> AgeBand {
        match years {
            y if y < 18.0 => AgeBand::Child,
            y if y < 36.0 => AgeBand::YoungAdult,
            y if y < 61.0 => AgeBand::Adult,
            _ => AgeBand::Old,
        }
    }
}

/// File form of `content/touch.json`.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct TouchFactorsFile {
    /// Factors for tissues by kind of instrument.
    #[schemars(length(max = 1000))]
    by_tool: Vec<ToolFactorRow>,
    /// Factors for tissues by age band.
    #[schemars(length(max = 1000))]
    by_age: Vec<AgeFactorRow>,
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct ToolFactorRow {
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
    /// Factor for the force from which the tissue is cut. A hand instrument cuts only tissues for which this factor is
    /// given.
    #[serde(default)]
    #[schemars(range(min = 0.1, max = 10.0))]
    cut_force: Option<f32>,
    /// Source of the values, and the range in which they are plausible.
    #[schemars(length(min = 1, max = 500))]
    #[allow(dead_code)]
    source: String,
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct AgeFactorRow {
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
    /// Source of the values, and the range in which they are plausible.
    #[schemars(length(min = 1, max = 500))]
    #[allow(dead_code)]
    source: String,
}

fn one() -> f32 {
    1.0
}

/// Factors by tissue, kind of instrument and age.
#[derive(Clone, Debug)]
pub struct TouchFactorTable {
    by_tool: Vec<(String, ToolKind, MaterialScale)>,
    by_age: Vec<(String, AgeBand, MaterialScale)>,
}

impl TouchFactorTable {
    /// Name of the table in a [`Library`].
    pub const NAME: &str = "content/touch.json";

    /// Reads the table; `None` if there is none, as in recordings of older programs.
    ///
    /// # Errors
    /// Returns diagnostics if the file is invalid.
    pub fn read(library: &Library) -> Result<Option<TouchFactorTable>, Vec<Diagnostic>> {
        let source = match library.text(Self::NAME) {
            Ok(source) => source,
            Err(complaint) if complaint.code == "missing-file" => return Ok(None),
            Err(complaint) => return Err(vec![complaint]),
        };
        let TouchFactorsFile { by_tool, by_age } = json::read::<TouchFactorsFile>(source)?.value;
        let by_tool = by_tool.into_iter().map(|row| {
            let ToolFactorRow {
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
            // Tissues that are not listed for a blade are handled in `factor`, below.
            let cut_force = cut_force.unwrap_or(if kind.is_blade() { f32::INFINITY } else { 1.0 });
            (tissue, kind, MaterialScale { stiffness, damping, static_friction, dynamic_friction, hardness, cut_force })
        });
        let by_age = by_age.into_iter().map(|row| {
            let AgeFactorRow { tissue, band, stiffness, damping, static_friction, dynamic_friction, hardness, .. } =
                row;
            let cut_force = 1.0;
            (tissue, band, MaterialScale { stiffness, damping, static_friction, dynamic_friction, hardness, cut_force })
        });
        Ok(Some(TouchFactorTable { by_tool: by_tool.collect(), by_age: by_age.collect() }))
    }

    /// Returns the combined factors of an instrument kind and an age band for a tissue; `None` stands for no change.
    pub fn factor(&self, tissue: &str, kind: Option<ToolKind>, band: Option<AgeBand>) -> MaterialScale {
        let tool = self.by_tool.iter().filter(|(t, k, _)| t == tissue && Some(*k) == kind).map(|(.., f)| *f);
        let is_listed = tool.clone().next().is_some();
        let cut_force = if kind.is_some_and(ToolKind::is_blade) && !is_listed { f32::INFINITY } else { 1.0 };
        let default_factor = MaterialScale { cut_force, ..MaterialScale::ONE };
        let age = self.by_age.iter().filter(|(t, b, _)| t == tissue && Some(*b) == band).map(|(.., f)| *f);
        tool.chain(age).fold(default_factor, MaterialScale::combined_with)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shipped_table_says_what_it_says() {
        let table = TouchFactorTable::read(&Library::shipped()).unwrap().unwrap();
        assert_eq!(table.factor("enamel", None, None), MaterialScale::ONE);
        assert_eq!(table.factor("amalgam", Some(ToolKind::DiamondBur), Some(AgeBand::Old)), MaterialScale::ONE);
        let (tool, age) = (Some(ToolKind::DiamondBur), Some(AgeBand::Old));
        let both = table.factor("dentine", tool, age);
        assert_eq!(both, table.factor("dentine", tool, None).combined_with(table.factor("dentine", None, age)));
        assert!(both.hardness > 1.0 && both != MaterialScale::ONE);
    }
}
