//! The operator file: the JSON form of a script that acts as a trainee.

use crate::catalog::CoefficientName;
use crate::scenario::file::SiteFile;
use schemars::JsonSchema;
use serde::Deserialize;
use typodont_formats::diagnostic::Diagnostic;
use typodont_formats::{Library, json};

/// A scripted trainee: a hand, and what it does in each kind of stage.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OperatorFile {
    /// Short name.
    #[schemars(length(min = 1, max = 40), regex(pattern = r"^[a-z0-9_-]+$"))]
    pub id: String,
    /// Description of this kind of trainee.
    #[schemars(length(min = 1, max = 200))]
    pub title: String,
    /// Motion of the hand.
    pub hand: HandFile,
    /// Agreement with statements in favour of the system, 1 to 11; mirrored for statements against it.
    #[schemars(range(min = 1, max = 11))]
    pub agrees: u8,
    /// Rules for the stages. In each stage the first rule that applies is followed.
    #[schemars(length(min = 1, max = 50))]
    pub rules: Vec<RuleFile>,
}

/// Motion of the hand.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HandFile {
    /// Speed in free space, mm/s: 1 to 300.
    #[schemars(range(min = 1.0, max = 300.0))]
    pub speed_mm_s: f32,
    /// Physiological tremor, mm: 0 to 1.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub tremor_mm: f32,
}

/// Actions for one kind of stage.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RuleFile {
    /// Stages to which the rule applies.
    pub when: WhenFile,
    /// Actions, one after another.
    #[serde(rename = "do")]
    #[schemars(length(min = 1, max = 200))]
    pub actions: Vec<ActionFile>,
    /// Repeat all actions until the stage ends.
    #[serde(default)]
    pub repeat: bool,
}

/// Stages to which a rule applies.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum WhenFile {
    /// Every stage.
    Always,
    /// Stages in which burs run.
    Cutting,
    /// Stages that ask for a tooth or a quadrant with decay.
    Searching,
    /// The stage with this id; if it has trials, each of them.
    Stage(String),
}

/// One action of a rule.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ActionFile {
    /// Hold still for this time, s: 0 to 3600.
    WaitS(#[schemars(range(min = 0.0, max = 3600.0))] f32),
    /// Take an instrument from the tray: its id, or "bur", "explorer" or "probe" for the first of that kind.
    Take(String),
    Approach(ApproachFile),
    Press(PressFile),
    Follow(FollowFile),
    Probe(ProbeFile),
    Cut(CutFile),
    Fill(FillFile),
    Condense(CondenseFile),
    Carve(CarveFile),
    /// Walk a periodontal probe around the tooth and chart the depth at each site.
    Chart(ChartActionFile),
    /// Slide an explorer down into the sulcus at each site and chart calculus where the tip passes over a bump.
    Explore(ExploreFile),
    Answer(AnswerActionFile),
    /// Change one coefficient of a tissue, where the stage allows it.
    Adjust(AdjustFile),
    /// Confirm that the stage is done.
    Confirm,
}

/// New value of a tissue's coefficient.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AdjustFile {
    /// Name of the tissue, such as "enamel".
    pub tissue: String,
    pub coefficient: CoefficientName,
    /// New value, in the coefficient's unit: 0 to 50.
    #[schemars(range(min = 0.0, max = 50.0))]
    pub value: f32,
}

/// Location on a tooth.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PlaceFile {
    /// Centre of the occlusal surface of the first tooth.
    Crown,
    /// Centre of the occlusal surface of a tooth, by its id.
    Tooth(String),
    /// Surface above a decay, by its id.
    Decay(String),
    /// One of the possible sites of the stage's draw, chosen at random and without regard to the draw. In a stage
    /// without a draw, the centre of the occlusal surface of the first tooth.
    Site,
    /// Quadrant of the first tooth, 1 to 4 as seen from above.
    Quadrant(#[schemars(range(min = 1, max = 4))] u8),
}

/// Move to a point above a location.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ApproachFile {
    pub at: PlaceFile,
    /// Height above the surface, mm: 0.5 to 30.
    #[schemars(range(min = 0.5, max = 30.0))]
    pub above_mm: f32,
}

/// Press on a location, perpendicular to its surface.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PressFile {
    pub at: PlaceFile,
    /// Pressing force, N: 0.05 to 10.
    #[schemars(range(min = 0.05, max = 10.0))]
    pub force_n: f32,
    /// Duration of the press, s: 0 to 60.
    #[schemars(range(min = 0.0, max = 60.0))]
    pub hold_s: f32,
}

/// Slide over the occlusal surface of every tooth in parallel lines.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FollowFile {
    /// Pressing force, N: 0.05 to 10.
    #[schemars(range(min = 0.05, max = 10.0))]
    pub press_n: f32,
    /// Speed, mm/s: 0.5 to 100.
    #[schemars(range(min = 0.5, max = 100.0))]
    pub speed_mm_s: f32,
    /// Number of lines per tooth, 1 to 50.
    #[schemars(range(min = 1, max = 50))]
    pub lines: u32,
}

/// Press on a grid of points on every tooth and compare their stiffness.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ProbeFile {
    /// Number of points along each side of the grid, 2 to 20.
    #[schemars(range(min = 2, max = 20))]
    pub side: u32,
    /// Pressing force, N: 0.1 to 5.
    #[schemars(range(min = 0.1, max = 5.0))]
    pub press_n: f32,
    /// Share of the median stiffness below which a point is noticed as soft: 0.05 to 0.99.
    #[schemars(range(min = 0.05, max = 0.99))]
    pub notices_below: f32,
    /// Share of the crown's width between the outermost points: 0.1 to 0.9. Beyond 0.62 the surface is too steep to
    /// press on.
    #[serde(default = "ProbeFile::usual_width")]
    #[schemars(range(min = 0.1, max = 0.9))]
    pub width: f32,
}

impl ProbeFile {
    fn usual_width() -> f32 {
        0.62
    }
}

/// Cut out every decay, in rings from its floor up its walls.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CutFile {
    /// Maximum force of the hand, N: 0.1 to 10.
    #[schemars(range(min = 0.1, max = 10.0))]
    pub press_n: f32,
    /// Maximum time for which the hand waits where the bur does not advance, s: 0 to 10.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub patience_s: f32,
    /// Speed of the hand, mm/s: 0.5 to 50.
    #[schemars(range(min = 0.5, max = 50.0))]
    pub speed_mm_s: f32,
    /// Distance between rings, mm: 0.1 to 2.
    #[schemars(range(min = 0.1, max = 2.0))]
    pub pitch_mm: f32,
    /// Distance by which the cut extends beyond the decay's border, mm: -3 to 3; negative to stay inside the border.
    #[schemars(range(min = -3.0, max = 3.0))]
    pub margin_mm: f32,
    /// Maximum distance by which the hand leans beyond the bur's target, mm: 0.5 to 12. Decay yields from about 2.2.
    #[schemars(range(min = 0.5, max = 12.0))]
    pub lean_mm: f32,
    /// Maximum number of passes over each decay, 1 to 50. Over an outline, passes after the first visit only what
    /// remains.
    #[schemars(range(min = 1, max = 50))]
    pub passes: u32,
    /// Share of the decay removed at which the operator stops, %: 1 to 100.
    #[schemars(range(min = 1.0, max = 100.0))]
    pub until_cleared_pct: f64,
    /// The hand backs off at once where the bur is beyond its path, as before a thin wall that gives way.
    #[serde(default)]
    pub backs_off: bool,
    /// At rest the hand never presses with more than `press_n`. Without it, the hand presses harder the longer the bur is
    /// held up, as most hands do.
    #[serde(default)]
    pub limits_force: bool,
    /// Distance from the pulp, which a radiograph shows, within which caries is left, mm: 0 to 3. Without effect on
    /// ellipsoidal lesions.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 3.0))]
    pub clear_of_pulp_mm: f32,
}

/// Place a filling into the prepared cavity, press by press, from its floor up.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FillFile {
    /// Pressing force, N: 0.05 to 10.
    #[schemars(range(min = 0.05, max = 10.0))]
    pub press_n: f32,
    /// Duration of each press, s: 0.05 to 10.
    #[schemars(range(min = 0.05, max = 10.0))]
    pub hold_s: f32,
    /// Distance between presses, mm: 0.2 to 4.
    #[schemars(range(min = 0.2, max = 4.0))]
    pub pitch_mm: f32,
    /// Height of the filling above the tooth's contour, mm: -5 to 2; negative for below.
    #[schemars(range(min = -5.0, max = 2.0))]
    pub to_mm: f32,
    /// Maximum number of presses, 1 to 500.
    #[schemars(range(min = 1, max = 500))]
    pub presses: u32,
}

/// Condense the filling, press by press.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CondenseFile {
    /// Pressing force, N: 0.05 to 10.
    #[schemars(range(min = 0.05, max = 10.0))]
    pub press_n: f32,
    /// Duration of each press, s: 0.05 to 10.
    #[schemars(range(min = 0.05, max = 10.0))]
    pub hold_s: f32,
    /// Distance between presses, mm: 0.2 to 4.
    #[schemars(range(min = 0.2, max = 4.0))]
    pub pitch_mm: f32,
}

/// Carve the filling back to the tooth's contour, layer by layer, in alternating strokes over the cavity.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CarveFile {
    /// Maximum force of the hand, N: 0.05 to 10.
    #[schemars(range(min = 0.05, max = 10.0))]
    pub press_n: f32,
    /// Maximum time for which the hand waits where the blade does not advance, s: 0 to 10.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub patience_s: f32,
    /// Speed of the hand, mm/s: 0.5 to 50.
    #[schemars(range(min = 0.5, max = 50.0))]
    pub speed_mm_s: f32,
    /// Distance between strokes, mm: 0.1 to 2.
    #[schemars(range(min = 0.1, max = 2.0))]
    pub pitch_mm: f32,
    /// Maximum distance by which the hand leans beyond the blade's target, mm: 0.1 to 12.
    #[schemars(range(min = 0.1, max = 12.0))]
    pub lean_mm: f32,
    /// Distance by which the strokes extend beyond the cavity's margin, mm: 0 to 3.
    #[schemars(range(min = 0.0, max = 3.0))]
    pub beyond_mm: f32,
    /// Heights above the contour, one per layer, in order, mm: -2 to 3.
    #[schemars(length(max = 10))]
    pub layers_mm: Vec<LayerFile>,
    /// Afterwards, inspect the filling and carve again where it is too high. Omit to carve once.
    #[serde(default)]
    pub again: Option<CarveAgainFile>,
}

/// Inspect a carved filling and carve again where it is too high.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CarveAgainFile {
    /// Maximum number of repetitions, 1 to 20.
    #[schemars(range(min = 1, max = 20))]
    pub times: u32,
    /// Height above the blade's path from which the filling is seen as too high, mm: 0.01 to 1.
    #[schemars(range(min = 0.01, max = 1.0))]
    pub over_mm: f32,
    /// Height of the blade's path above the contour, mm: -0.2 to 0.5.
    #[schemars(range(min = -0.2, max = 0.5))]
    pub to_mm: f32,
}

/// Height of a layer above the contour, mm: -2 to 3.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct LayerFile(#[schemars(range(min = -2.0, max = 3.0))] pub f32);

/// Walk a periodontal probe around the tooth.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ChartActionFile {
    /// Sites, in order. Omit for all six.
    #[serde(default)]
    pub sites: Option<Vec<SiteFile>>,
    /// Force at which the probe is taken to have reached the floor of the sulcus, N: 0.1 to 5.
    #[schemars(range(min = 0.1, max = 5.0))]
    pub press_n: f32,
    /// Speed, mm/s: 0.5 to 30.
    #[schemars(range(min = 0.5, max = 30.0))]
    pub speed_mm_s: f32,
    /// Time for which the probe rests before it is read, s: 0 to 5.
    #[schemars(range(min = 0.0, max = 5.0))]
    pub hold_s: f32,
}

/// Slide an explorer down along the root.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ExploreFile {
    /// Sites, in order. Omit for all six.
    #[serde(default)]
    pub sites: Option<Vec<SiteFile>>,
    /// Force along the root at which the slide ends, N: 0.2 to 5.
    #[schemars(range(min = 0.2, max = 5.0))]
    pub press_n: f32,
    /// Distance by which the hand leans into the root, mm: 0.1 to 2.
    #[schemars(range(min = 0.1, max = 2.0))]
    pub lean_mm: f32,
    /// Speed, mm/s: 0.5 to 30.
    #[schemars(range(min = 0.5, max = 30.0))]
    pub speed_mm_s: f32,
    /// Height of a bump above which it is noticed, mm: 0.05 to 2.
    #[schemars(range(min = 0.05, max = 2.0))]
    pub notices_mm: f32,
}

/// Answer the stage's questions.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum AnswerActionFile {
    /// Answer by the softest point felt while probing; give no answer if no point was noticed.
    Felt,
    /// Answer by the softest point felt while probing, even if it was not noticed.
    Guess,
}

impl OperatorFile {
    /// Reads an operator file of the library by the operator's name.
    ///
    /// # Errors
    /// Returns diagnostics if the file is missing, is not valid JSON or violates the schema.
    pub fn read(library: &Library, name: &str) -> Result<OperatorFile, Vec<Diagnostic>> {
        let source = library.text(&Self::file_name(name)).map_err(|e| vec![e])?;
        Ok(json::read::<OperatorFile>(source)?.value)
    }

    /// Returns the name of an operator's file in a library.
    pub fn file_name(name: &str) -> String {
        format!("content/operators/{name}.json")
    }
}
