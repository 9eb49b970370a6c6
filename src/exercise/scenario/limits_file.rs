//! Limits of force and speed in the scenario file.

use crate::scenario::ContactLimit;
use schemars::JsonSchema;
use serde::Deserialize;

/// Greatest force and speed, with what follows when they are exceeded: a warning on the screen, or the patient's cry. They
/// influence no measure and no score.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LimitsFile {
    /// Force in contact above which a warning is shown, anywhere, N: 0.05 to 20.
    #[serde(default = "LimitsFile::warning_force")]
    #[schemars(range(min = 0.05, max = 20.0))]
    pub warning_force_n: f32,
    /// Force in contact above which the patient cries, anywhere, N: 0.05 to 20.
    #[serde(default = "LimitsFile::cry_force")]
    #[schemars(range(min = 0.05, max = 20.0))]
    pub cry_force_n: f32,
    /// Speed of the instrument in contact above which a warning is shown, anywhere, mm/s: 0.5 to 500. If omitted, speed
    /// causes no warning.
    #[serde(default)]
    #[schemars(range(min = 0.5, max = 500.0))]
    pub warning_speed_mm_s: Option<f32>,
    /// Speed of the instrument in contact above which the patient cries, anywhere, mm/s: 0.5 to 500. If omitted, speed
    /// causes no cry.
    #[serde(default)]
    #[schemars(range(min = 0.5, max = 500.0))]
    pub cry_speed_mm_s: Option<f32>,
    /// Limits near a zone or a tissue, in addition to the others.
    #[serde(default)]
    #[schemars(length(max = 20))]
    pub near: Vec<NearLimitFile>,
}

/// Greatest force and speed near a zone or a tissue: within `near_mm` of the measures, as the zone or tissue is at the
/// start.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NearLimitFile {
    /// The zone or tissue.
    pub place: LimitPlaceFile,
    /// Greatest force in contact there, N: 0.05 to 20. If omitted, the force is not limited.
    #[serde(default)]
    #[schemars(range(min = 0.05, max = 20.0))]
    pub force_n: Option<f32>,
    /// Greatest speed of the instrument in contact there, mm/s: 0.5 to 500. If omitted, the speed is not limited.
    #[serde(default)]
    #[schemars(range(min = 0.5, max = 500.0))]
    pub speed_mm_s: Option<f32>,
    /// Response to a value above the limit.
    #[serde(default)]
    pub response: LimitResponseFile,
}

/// Place of a limit.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LimitPlaceFile {
    /// Id of a zone of the exercise.
    Zone(String),
    /// Name of a tissue. Contact with the tissue itself counts, too, as with gingiva, which is no part of the tooth.
    Tissue(String),
}

/// Response to a value above a limit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LimitResponseFile {
    /// A warning on the screen.
    #[default]
    Warning,
    /// The patient's cry.
    Cry,
    /// The warning and the cry.
    Both,
}

impl LimitsFile {
    fn warning_force() -> f32 {
        ContactLimit::WARNING_FORCE
    }

    fn cry_force() -> f32 {
        ContactLimit::CRY_FORCE
    }
}

impl Default for LimitsFile {
    fn default() -> Self {
        LimitsFile {
            warning_force_n: Self::warning_force(),
            cry_force_n: Self::cry_force(),
            warning_speed_mm_s: None,
            cry_speed_mm_s: None,
            near: Vec::new(),
        }
    }
}
