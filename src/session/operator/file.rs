//! An operator as written: a script that plays a trainee.

use crate::content::{CoefficientName, Library, json};
use crate::diagnostic::Diagnostic;
use crate::scenario::file::SiteFile;
use schemars::JsonSchema;
use serde::Deserialize;

/// A scripted trainee: a hand, and what it does in each kind of stage.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OperatorFile {
    /// Short name.
    #[schemars(length(min = 1, max = 40), regex(pattern = r"^[a-z0-9_-]+$"))]
    pub id: String,
    /// What kind of trainee this is.
    #[schemars(length(min = 1, max = 200))]
    pub title: String,
    /// How the hand moves.
    pub hand: HandFile,
    /// How far the operator agrees with statements in favour of the system, 1 to 11; mirrored for the others.
    #[schemars(range(min = 1, max = 11))]
    pub agrees: u8,
    /// What to do; in each stage the first rule that fits is followed.
    #[schemars(length(min = 1, max = 50))]
    pub rules: Vec<RuleFile>,
}

/// How a hand moves.
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

/// What to do in a kind of stage.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RuleFile {
    pub when: WhenFile,
    /// One after the other.
    #[serde(rename = "do")]
    #[schemars(length(min = 1, max = 200))]
    pub actions: Vec<ActionFile>,
    /// Begin again when all is done, until the stage ends.
    #[serde(default)]
    pub repeat: bool,
}

/// Which stages a rule is for.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum WhenFile {
    Always,
    /// Burs run.
    Cutting,
    /// A question about teeth or quadrants is asked.
    Searching,
    /// The stage with this id.
    Stage(String),
}

/// Something to do.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ActionFile {
    /// Hold still, s.
    WaitS(#[schemars(range(min = 0.0, max = 3600.0))] f32),
    /// Take an instrument of the tray by its id; the first bur or the first explorer by "bur" or "explorer".
    Take(String),
    Approach(ApproachFile),
    Press(PressFile),
    Follow(FollowFile),
    Probe(ProbeFile),
    Cut(CutFile),
    Fill(FillFile),
    Condense(CondenseFile),
    Carve(CarveFile),
    /// Walk a periodontal probe round the tooth and note the depth at each site.
    Chart(ChartActionFile),
    /// Slide an explorer down into the sulcus at each site and note calculus where it clicks.
    Explore(ExploreFile),
    Answer(AnswerActionFile),
    /// Give one of a tissue's coefficients another value, where the stage allows it.
    Adjust(AdjustFile),
    /// Say that the stage is done.
    Confirm,
}

/// Another value for a tissue's coefficient.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AdjustFile {
    /// The tissue's name, such as "enamel".
    pub tissue: String,
    pub coefficient: CoefficientName,
    /// In the coefficient's unit.
    #[schemars(range(min = 0.0, max = 50.0))]
    pub value: f32,
}

/// A place on a tooth.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PlaceFile {
    /// The middle of the occlusal surface of the first tooth.
    Crown,
    /// The middle of the occlusal surface of a tooth, by its id.
    Tooth(String),
    /// The surface over a decay, by its id.
    Decay(String),
    /// A quadrant of the first tooth, 1 to 4 as seen from above.
    Quadrant(#[schemars(range(min = 1, max = 4))] u8),
}

/// Go above a place.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ApproachFile {
    pub at: PlaceFile,
    /// mm, 0.5 to 30.
    #[schemars(range(min = 0.5, max = 30.0))]
    pub above_mm: f32,
}

/// Press straight down on a place.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PressFile {
    pub at: PlaceFile,
    /// N, 0.05 to 10.
    #[schemars(range(min = 0.05, max = 10.0))]
    pub force_n: f32,
    /// s, 0 to 60.
    #[schemars(range(min = 0.0, max = 60.0))]
    pub hold_s: f32,
}

/// Slide over the occlusal surface of every tooth in lines.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FollowFile {
    /// N, 0.05 to 10.
    #[schemars(range(min = 0.05, max = 10.0))]
    pub press_n: f32,
    /// mm/s, 0.5 to 100.
    #[schemars(range(min = 0.5, max = 100.0))]
    pub speed_mm_s: f32,
    /// Number of lines per tooth, 1 to 50.
    #[schemars(range(min = 1, max = 50))]
    pub lines: u32,
}

/// Press on a grid of points of every tooth and compare how stiff each feels.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ProbeFile {
    /// Points along each side of the grid, 2 to 20.
    #[schemars(range(min = 2, max = 20))]
    pub side: u32,
    /// N, 0.1 to 5.
    #[schemars(range(min = 0.1, max = 5.0))]
    pub press_n: f32,
    /// A place is noticed when it feels softer than this share of the typical place: 0.05 to 0.99.
    #[schemars(range(min = 0.05, max = 0.99))]
    pub notices_below: f32,
}

/// Cut out every decay, round and round from its floor up its walls.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CutFile {
    /// Force at which the hand gives way, N: 0.1 to 10.
    #[schemars(range(min = 0.1, max = 10.0))]
    pub press_n: f32,
    /// How long the hand waits where the bur does not get on, s: 0 to 10.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub patience_s: f32,
    /// Speed of the hand, mm/s: 0.5 to 50.
    #[schemars(range(min = 0.5, max = 50.0))]
    pub speed_mm_s: f32,
    /// Distance between rounds, mm: 0.1 to 2.
    #[schemars(range(min = 0.1, max = 2.0))]
    pub pitch_mm: f32,
    /// How far the rounds reach beyond the decay's border, mm; negative: how far they stay inside.
    #[schemars(range(min = -3.0, max = 3.0))]
    pub margin_mm: f32,
    /// How far the hand leans beyond where the bur is to go, mm: 0.5 to 12. Decay yields from about 2.2 on.
    #[schemars(range(min = 0.5, max = 12.0))]
    pub lean_mm: f32,
    /// Most passes over each decay, 1 to 50. Over an outline all but the first go only to what still stands.
    #[schemars(range(min = 1, max = 50))]
    pub passes: u32,
    /// Share of the decay gone that the operator is content with, %: 1 to 100.
    #[schemars(range(min = 1.0, max = 100.0))]
    pub until_cleared_pct: f64,
}

/// Lay a filling into the prepared cavity, press by press, from its floor up.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FillFile {
    /// N, 0.05 to 10.
    #[schemars(range(min = 0.05, max = 10.0))]
    pub press_n: f32,
    /// How long each press lasts, s: 0.05 to 10.
    #[schemars(range(min = 0.05, max = 10.0))]
    pub hold_s: f32,
    /// Distance between places, mm: 0.2 to 4.
    #[schemars(range(min = 0.2, max = 4.0))]
    pub pitch_mm: f32,
    /// How far above the tooth's contour the filling is to reach, mm; negative: below it. -5 to 2.
    #[schemars(range(min = -5.0, max = 2.0))]
    pub to_mm: f32,
    /// Most presses, 1 to 500.
    #[schemars(range(min = 1, max = 500))]
    pub presses: u32,
}

/// Press the filling together, place by place.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CondenseFile {
    /// N, 0.05 to 10.
    #[schemars(range(min = 0.05, max = 10.0))]
    pub press_n: f32,
    /// How long each press lasts, s: 0.05 to 10.
    #[schemars(range(min = 0.05, max = 10.0))]
    pub hold_s: f32,
    /// Distance between places, mm: 0.2 to 4.
    #[schemars(range(min = 0.2, max = 4.0))]
    pub pitch_mm: f32,
}

/// Carve the filling back to the tooth's contour, layer by layer, to and fro over the cavity.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CarveFile {
    /// Force at which the hand gives way, N: 0.05 to 10.
    #[schemars(range(min = 0.05, max = 10.0))]
    pub press_n: f32,
    /// How long the hand waits where the blade does not get on, s: 0 to 10.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub patience_s: f32,
    /// Speed of the hand, mm/s: 0.5 to 50.
    #[schemars(range(min = 0.5, max = 50.0))]
    pub speed_mm_s: f32,
    /// Distance between strokes, mm: 0.1 to 2.
    #[schemars(range(min = 0.1, max = 2.0))]
    pub pitch_mm: f32,
    /// How far the hand leans beyond where the blade is to go, mm: 0.1 to 12.
    #[schemars(range(min = 0.1, max = 12.0))]
    pub lean_mm: f32,
    /// How far beyond the cavity's rim the strokes reach, mm: 0 to 3.
    #[schemars(range(min = 0.0, max = 3.0))]
    pub beyond_mm: f32,
    /// Heights above the contour, one layer after the other, mm: -2 to 3.
    #[schemars(length(max = 10))]
    pub layers_mm: Vec<LayerFile>,
    /// Then look, and carve again where the filling stands too high; without it, not.
    #[serde(default)]
    pub again: Option<CarveAgainFile>,
}

/// Look at a carved filling and carve again where it stands too high.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CarveAgainFile {
    /// Most often, 1 to 20.
    #[schemars(range(min = 1, max = 20))]
    pub times: u32,
    /// How far over the blade's own way the filling must stand to be seen as too high, mm: 0.01 to 1.
    #[schemars(range(min = 0.01, max = 1.0))]
    pub over_mm: f32,
    /// Height of that way above the contour, mm: -0.2 to 0.5.
    #[schemars(range(min = -0.2, max = 0.5))]
    pub to_mm: f32,
}

/// mm, -2 to 3.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct LayerFile(#[schemars(range(min = -2.0, max = 3.0))] pub f32);

/// Walk a periodontal probe round the tooth.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ChartActionFile {
    /// Sites, in their order; without it all six.
    #[serde(default)]
    pub sites: Option<Vec<SiteFile>>,
    /// Force at which the floor is taken to be felt, N: 0.1 to 5.
    #[schemars(range(min = 0.1, max = 5.0))]
    pub press_n: f32,
    /// mm/s: 0.5 to 30.
    #[schemars(range(min = 0.5, max = 30.0))]
    pub speed_mm_s: f32,
    /// How long the probe rests before it is read, s: 0 to 5.
    #[schemars(range(min = 0.0, max = 5.0))]
    pub hold_s: f32,
}

/// Slide an explorer down along the root.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ExploreFile {
    /// Sites, in their order; without it all six.
    #[serde(default)]
    pub sites: Option<Vec<SiteFile>>,
    /// Force along the root at which it is taken to have ended, N: 0.2 to 5.
    #[schemars(range(min = 0.2, max = 5.0))]
    pub press_n: f32,
    /// How far the hand leans into the root, mm: 0.1 to 2.
    #[schemars(range(min = 0.1, max = 2.0))]
    pub lean_mm: f32,
    /// mm/s: 0.5 to 30.
    #[schemars(range(min = 0.5, max = 30.0))]
    pub speed_mm_s: f32,
    /// A bump is noticed that lifts the tip by more than this, mm: 0.05 to 2.
    #[schemars(range(min = 0.05, max = 2.0))]
    pub notices_mm: f32,
}

/// Answer the stage's questions.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum AnswerActionFile {
    /// By what was felt while probing; without having noticed anything, not at all.
    Felt,
    /// As felt, and by the softest place even if it was not noticed.
    Guess,
}

impl OperatorFile {
    /// Reads an operator of the library by its name.
    pub fn read(library: &Library, name: &str) -> Result<OperatorFile, Vec<Diagnostic>> {
        let source = library.text(&Self::file(name)).map_err(|e| vec![e])?;
        Ok(json::read::<OperatorFile>(source)?.value)
    }

    /// Name of an operator's file in a library.
    pub fn file(name: &str) -> String {
        format!("content/operators/{name}.json")
    }
}
