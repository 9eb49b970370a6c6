//! The jaws around the tooth as an author writes them. What is drawn follows; of what is felt only a missing neighbour.

use schemars::JsonSchema;
use serde::Deserialize;

/// How the teeth of both jaws stand; what is left out is as in the average of adults.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ArchFile {
    #[serde(default)]
    pub upper: ArchFormFile,
    #[serde(default)]
    pub lower: ArchFormFile,
    /// How the lower first molar stands to the upper one (Angle): in its place, behind it, before it.
    #[serde(default)]
    pub angle_class: AngleClassFile,
    /// Teeth that are not there, by their numbers.
    #[serde(default)]
    #[schemars(length(max = 27))]
    pub missing: Vec<u8>,
    /// Teeth that are turned about their own axes.
    #[serde(default)]
    #[schemars(length(max = 27))]
    pub rotated: Vec<RotatedFile>,
}

/// One jaw's arch, by Braun's beta function.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ArchFormFile {
    /// Between the middles of the second molars, mm: 40 to 62. Average: 54 above, 50.3 below.
    #[serde(default)]
    #[schemars(range(min = 40.0, max = 62.0))]
    pub width_mm: Option<f32>,
    /// From the incisors back to the second molars' middles, mm: 28 to 52; without it as the teeth's widths ask for.
    #[serde(default)]
    #[schemars(range(min = 28.0, max = 52.0))]
    pub depth_mm: Option<f32>,
}

/// Angle's classes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
pub enum AngleClassFile {
    /// The upper first molar's mesiobuccal cusp meets the lower one's buccal groove.
    #[default]
    I,
    /// The lower jaw stands back by the width of a cusp.
    II,
    /// The lower jaw stands forward by the width of a cusp.
    III,
}

/// A tooth that is turned.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RotatedFile {
    /// Number of the tooth.
    #[schemars(range(min = 11, max = 48))]
    pub fdi: u8,
    /// -60 to 60; positive: its mesial side comes toward lip or cheek.
    #[schemars(range(min = -60.0, max = 60.0))]
    pub degrees: f32,
}
