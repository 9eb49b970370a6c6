//! A scenario exactly as an author writes it.
//!
//! Every key, unit and range here is the contract with authors: the JSON Schema for editors and the reader's complaints
//! both come from these types. What the keys mean together is decided in [`super::resolve`].

pub use super::arch_file::*;
pub use super::cavity_file::*;
pub use super::decay_file::*;
pub use super::gum_file::*;

use crate::content::TissueEntry;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// An exercise: what is on the screen, what the trainee is asked to do, and how it is scored.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ScenarioFile {
    /// Where an editor finds the description of this kind of file; "scenario.schema.json" beside the shipped ones.
    #[serde(default, rename = "$schema")]
    pub schema: Option<String>,
    /// Short name for file names and tables: small letters a–z, digits, hyphens and underscores.
    #[schemars(length(min = 1, max = 60), regex(pattern = r"^[a-z0-9_-]+$"))]
    pub id: String,
    /// Title shown to trainees.
    #[schemars(length(min = 1, max = 120))]
    pub title: String,
    /// What the exercise is for, in a sentence or two.
    #[serde(default)]
    #[schemars(length(max = 2000))]
    pub summary: String,
    /// What there is to see and touch.
    pub scene: SceneFile,
    /// Instruments of the school's own, besides those of `content/instruments.json`: a file with the same keys, relative to
    /// the scenario's folder.
    #[serde(default)]
    #[schemars(length(min = 1, max = 500), regex(pattern = r"\.json$"))]
    pub instrument_file: Option<String>,
    /// Changes to tissues of the table in `content/tissues.json`, by name.
    #[serde(default)]
    pub tissues: BTreeMap<String, TissueChange>,
    /// Tissues that the table does not have.
    #[serde(default)]
    #[schemars(length(max = 100))]
    pub new_tissues: Vec<TissueEntry>,
    /// Sets one tissue's stiffness as a fraction of another's.
    #[serde(default)]
    pub stiffness_ratio: Option<StiffnessRatio>,
    /// Whose mouth it is; without it tissues feel as their table says.
    #[serde(default)]
    pub patient: Option<PatientFile>,
    /// How a bur takes matter away.
    #[serde(default)]
    pub carving: CarvingFile,
    /// How a bur trembles while it cuts.
    #[serde(default)]
    pub vibration: VibrationFile,
    /// What drilling brings before the eye besides the tooth.
    #[serde(default)]
    pub operating_field: OperatingFieldFile,
    /// Instruments on the tray, by the ids of `content/instruments.json`; the first is in the hand at the start.
    #[schemars(length(min = 1, max = 50))]
    pub instruments: Vec<String>,
    /// Named regions of the tooth that measures can refer to.
    #[serde(default)]
    #[schemars(length(max = 20))]
    pub zones: Vec<ZoneFile>,
    /// The parts of the exercise, in order.
    #[schemars(length(min = 1, max = 50))]
    pub stages: Vec<StageFile>,
    /// Numbers that measures need.
    #[serde(default)]
    pub measures: MeasuresFile,
    /// How points are given; without it the exercise is measured but not graded.
    #[serde(default)]
    pub rubric: Option<RubricFile>,
    /// Name of a questionnaire in `content/questionnaires/`, asked at the end: small letters, digits, hyphens, underscores.
    #[serde(default)]
    #[schemars(regex(pattern = r"^[a-z0-9_-]+$"))]
    pub questionnaire: Option<String>,
}

/// What there is to see and touch.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SceneFile {
    /// One tooth alone.
    Tooth(ToothFile),
    /// Two teeth side by side, to be compared.
    Pair(PairFile),
    /// One tooth in its jaw, with gum and neighbours.
    Jaw(JawFile),
}

/// Two teeth side by side.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PairFile {
    /// The tooth on the left as the trainee sees it.
    pub left: ToothFile,
    /// The tooth on the right.
    pub right: ToothFile,
    /// Space between the two, mm: 0.5 to 30.
    #[serde(default = "four_mm")]
    #[schemars(range(min = 0.5, max = 30.0))]
    pub gap_mm: f32,
}

fn four_mm() -> f32 {
    4.0
}

/// A tooth in its jaw.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct JawFile {
    /// The tooth that is worked on.
    pub tooth: ToothFile,
    /// What stands around it, as closed meshes; without it a plain gum and two plain neighbours, and nothing for an empty
    /// list.
    #[serde(default)]
    #[schemars(length(max = 20))]
    pub around: Option<Vec<ObstacleFile>>,
    /// Gum round the tooth with a sulcus or pockets that a probe finds. Without it a plain gum that has none.
    #[serde(default)]
    pub periodontium: Option<PeriodontiumFile>,
    /// How the teeth of both jaws stand.
    #[serde(default)]
    pub arch: ArchFile,
}

/// Something that can be touched but is never carved.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ObstacleFile {
    /// Wavefront OBJ file of a closed surface in millimetres, relative to the scenario's folder.
    #[schemars(length(min = 1, max = 500))]
    pub mesh: String,
    /// Tissue that it feels like.
    pub tissue: String,
    /// Where the mesh's origin lies in tooth space: buccal, distal (mesial for 21–28 and 41–48), occlusal, from the crown's
    /// middle at the neck.
    #[serde(default = "ObstacleFile::origin")]
    pub position_mm: [CoordinateFile; 3],
    /// How far the mesh is turned about tooth space's x, then y, then z.
    #[serde(default = "ObstacleFile::unturned")]
    pub orientation_deg: [AngleFile; 3],
}

impl ObstacleFile {
    fn origin() -> [CoordinateFile; 3] {
        [CoordinateFile(0.0); 3]
    }

    fn unturned() -> [AngleFile; 3] {
        [AngleFile(0.0); 3]
    }
}

/// degrees, -180 to 180.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(transparent)]
pub struct AngleFile(#[schemars(range(min = -180.0, max = 180.0))] pub f32);

/// A tooth made of voxels.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ToothFile {
    /// Name by which questions and results refer to the tooth: small letters, digits, hyphens, underscores.
    #[schemars(length(min = 1, max = 40), regex(pattern = r"^[a-z0-9_-]+$"))]
    pub id: String,
    /// Number of the tooth by ISO 3950 (FDI): 11–18, 21–28, 31–38, 41–48.
    #[schemars(range(min = 11, max = 48))]
    pub fdi: u8,
    /// Where the tooth's shape comes from.
    pub form: FormFile,
    /// Decay in this tooth.
    #[serde(default)]
    #[schemars(length(max = 20))]
    pub decay: Vec<DecayFile>,
    /// A cavity that is prepared already, to be filled.
    #[serde(default)]
    pub cavity: Option<CavityFile>,
    /// Colour without softness: what looks like decay and is sound. Written as decay is; its tissue must be a sound one.
    #[serde(default)]
    #[schemars(length(max = 20))]
    pub stains: Vec<StainFile>,
    /// Hard deposits on root and neck; the tooth must stand in a jaw with "periodontium".
    #[serde(default)]
    #[schemars(length(max = 20))]
    pub calculus: Vec<CalculusFile>,
    /// Fillings that the tooth has had for long.
    #[serde(default)]
    #[schemars(length(max = 10))]
    pub old_fillings: Vec<FillingFile>,
}

/// Where a tooth's shape comes from.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FormFile {
    /// Made by the program from the average measures of its kind.
    Procedural(ProceduralFile),
    /// A CT scan of one tooth, divided into enamel, dentine and pulp by the program.
    Ct(ScanFile),
    /// A volume in which every voxel is labelled already.
    Labels(LabelsFile),
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ProceduralFile {
    /// Size of a voxel, mm: 0.04 (fine) to 0.4 (coarse).
    #[serde(default = "tenth_of_mm")]
    #[schemars(range(min = 0.04, max = 0.4))]
    pub spacing_mm: f32,
}

fn tenth_of_mm() -> f32 {
    0.1
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ScanFile {
    /// NRRD file, relative to the scenario's folder.
    #[schemars(length(min = 1, max = 500))]
    pub file: String,
    /// Distance between voxels along x, y and z, mm, where the file's own is wrong.
    #[serde(default)]
    pub spacing_mm: Option<[SpacingFile; 3]>,
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LabelsFile {
    /// NRRD file of labels (such as 3D Slicer's .seg.nrrd), relative to the scenario's folder.
    #[schemars(length(min = 1, max = 500))]
    pub file: String,
    /// Distance between voxels along x, y and z, mm, where the file's own is wrong.
    #[serde(default)]
    pub spacing_mm: Option<[SpacingFile; 3]>,
    /// Which number in the file is which tissue: { "1": "enamel", "2": "dentine", "3": "pulp" }. 0 is air; every other
    /// number in the file must be named.
    pub tissues: BTreeMap<String, String>,
}

/// Distance between voxels, mm: 0.01 to 2.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct SpacingFile(#[schemars(range(min = 0.01, max = 2.0))] pub f32);

/// New values for a tissue of the table; what is left out stays.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TissueChange {
    /// Share of the device's greatest stiffness, 0 to 1.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1.0))]
    pub stiffness: Option<f32>,
    /// Share of the device's greatest damping, 0 to 1.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1.0))]
    pub damping: Option<f32>,
    /// Coulomb coefficient to be overcome before sliding, 0 to 2.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 2.0))]
    pub static_friction: Option<f32>,
    /// Coulomb coefficient while sliding, 0 to 2.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 2.0))]
    pub dynamic_friction: Option<f32>,
    /// Spring force from which a bur takes the tissue away, N: 0.01 to 50.
    #[serde(default)]
    #[schemars(range(min = 0.01, max = 50.0))]
    pub cut_force_n: Option<f32>,
    /// Vickers hardness for the rate law of carving, HV: 0.1 to 2000.
    #[serde(default)]
    #[schemars(range(min = 0.1, max = 2000.0))]
    pub hardness_hv: Option<f32>,
}

/// One tissue's stiffness as a fraction of another's.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StiffnessRatio {
    /// The stiffer tissue, whose stiffness stays.
    pub of: String,
    /// The tissue whose stiffness is set.
    pub to: String,
    /// How many times stiffer the first is: 1 to 100. Measured between enamel and dentine: about 5.
    #[schemars(range(min = 1.0, max = 100.0))]
    pub ratio: f32,
}

/// Whose mouth it is.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PatientFile {
    /// Age in years, 3 to 110: a child below 18, a young adult below 36, an adult below 61, then old. What age makes of a
    /// tissue is in `content/touch.json`.
    #[schemars(range(min = 3.0, max = 110.0))]
    pub age_years: f32,
    /// True: the mouth looks its age too, from 12 to 90 years. Pulps of the teeth that the program grows are as narrow, cusps as worn and
    /// healthy gum as far back as they usually are then. Without it teeth are unworn, with the pulp and the gum of an adult of 30.
    #[serde(default)]
    pub shows_age: bool,
}

/// How a bur takes matter away.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CarvingFile {
    /// Time on one spot after which less force suffices, s: 0 to 60.
    #[serde(default = "CarvingFile::dwell")]
    #[schemars(range(min = 0.0, max = 60.0))]
    pub dwell_s: f32,
    /// Share of the cutting force that suffices then, 0 to 1.
    #[serde(default = "CarvingFile::dwell_share")]
    #[schemars(range(min = 0.0, max = 1.0))]
    pub dwell_share: f32,
    /// Fastest way of a bur into matter, mm/s: 0.1 to 100.
    #[serde(default = "CarvingFile::max_feed")]
    #[schemars(range(min = 0.1, max = 100.0))]
    pub max_feed_mm_s: f32,
    /// What decides how far a bur advances.
    #[serde(default)]
    pub law: CuttingLawFile,
}

/// What decides how far a bur advances.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum CuttingLawFile {
    /// The tissues' cutting forces: beyond them a bur advances as far as the hand has pushed; dwell lowers them.
    #[default]
    Threshold,
    /// The bur's work: volume per second grows with force and surface speed and falls with the tissue's hardness; there is
    /// no least force and no dwell.
    Rate(RateFile),
}

#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RateFile {
    /// Turns of the bur, 1/min: 0 (it stands still) to 500 000. Air turbines under load: 150 000 to 300 000.
    #[schemars(range(min = 0.0, max = 500_000.0))]
    pub rpm: f32,
    /// How many times more than a medium diamond all burs take, 0.05 to 10, besides their own "grit".
    #[serde(default = "RateFile::grit")]
    #[schemars(range(min = 0.05, max = 10.0))]
    pub grit: f32,
}

impl RateFile {
    fn grit() -> f32 {
        1.0
    }
}

impl CarvingFile {
    fn dwell() -> f32 {
        0.5
    }

    fn dwell_share() -> f32 {
        1.0 / 3.0
    }

    fn max_feed() -> f32 {
        10.0
    }
}

impl Default for CarvingFile {
    fn default() -> Self {
        CarvingFile {
            dwell_s: Self::dwell(),
            dwell_share: Self::dwell_share(),
            max_feed_mm_s: Self::max_feed(),
            law: CuttingLawFile::default(),
        }
    }
}

/// How a bur trembles while it cuts.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VibrationFile {
    /// Hz, 1 to 500.
    #[serde(default = "VibrationFile::frequency")]
    #[schemars(range(min = 1.0, max = 500.0))]
    pub frequency_hz: f32,
    /// N, 0 (none) to 1.
    #[serde(default = "VibrationFile::amplitude")]
    #[schemars(range(min = 0.0, max = 1.0))]
    pub amplitude_n: f32,
}

impl VibrationFile {
    fn frequency() -> f32 {
        500.0
    }

    fn amplitude() -> f32 {
        0.3
    }
}

impl Default for VibrationFile {
    fn default() -> Self {
        VibrationFile { frequency_hz: Self::frequency(), amplitude_n: Self::amplitude() }
    }
}

/// What drilling brings before the eye besides the tooth. Only a picture: no measure knows of it.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OperatingFieldFile {
    /// Chips of what is carved fly, and lie on tooth and gum.
    #[serde(default)]
    pub dust: bool,
    /// The handpiece sprays while it runs: water washes dust away, and hides what it stands over.
    #[serde(default)]
    pub water_spray: bool,
    /// A saliva ejector beside the tooth takes dust and water near it.
    #[serde(default)]
    pub suction: bool,
}

/// A named region of the tooth.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ZoneFile {
    /// Name by which measures refer to the zone, as in "zone_removed_pct(target)": small letters, digits, hyphens, underscores.
    #[schemars(length(min = 1, max = 40), regex(pattern = r"^[a-z0-9_-]+$"))]
    pub id: String,
    /// Name shown to people.
    #[schemars(length(min = 1, max = 80))]
    pub title: String,
    /// What the zone means.
    pub role: ZoneRole,
    /// Which voxels belong to it.
    pub region: RegionFile,
}

/// What a zone means.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ZoneRole {
    /// To be taken away: the reference preparation.
    Target,
    /// May be taken away without harm.
    Leeway,
    /// The sides or the bottom that must stay whole.
    Container,
    /// Must never be touched.
    NeverRemove,
}

/// Which voxels belong to a zone. Points in tooth space: x buccal, y distal (mesial for 21–28 and 41–48), z occlusal, from the
/// crown's middle at the neck.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum RegionFile {
    /// All voxels of a tissue.
    Tissue(String),
    /// Everything near a tissue, the tissue itself left out.
    Around(AroundFile),
    Sphere(SphereRegionFile),
    Box(BoxRegionFile),
    Cylinder(CylinderRegionFile),
    /// The voxels with one number in a label map of the same size as the tooth.
    Labels(LabelsRegionFile),
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AroundFile {
    pub tissue: String,
    /// mm, 0.01 to 10.
    #[schemars(range(min = 0.01, max = 10.0))]
    pub within_mm: f32,
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SphereRegionFile {
    pub centre_mm: [CoordinateFile; 3],
    /// mm, 0.05 to 20.
    #[schemars(range(min = 0.05, max = 20.0))]
    pub radius_mm: f32,
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BoxRegionFile {
    pub min_mm: [CoordinateFile; 3],
    pub max_mm: [CoordinateFile; 3],
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CylinderRegionFile {
    pub from_mm: [CoordinateFile; 3],
    pub to_mm: [CoordinateFile; 3],
    /// mm, 0.05 to 20.
    #[schemars(range(min = 0.05, max = 20.0))]
    pub radius_mm: f32,
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LabelsRegionFile {
    /// NRRD file, relative to the scenario's folder.
    #[schemars(length(min = 1, max = 500))]
    pub file: String,
    /// 1 to 255.
    #[schemars(range(min = 1, max = 255))]
    pub value: u8,
}

/// mm, -60 to 60.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(transparent)]
pub struct CoordinateFile(#[schemars(range(min = -60.0, max = 60.0))] pub f32);

/// One part of an exercise.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StageFile {
    /// Name in results: small letters, digits, hyphens, underscores.
    #[schemars(length(min = 1, max = 40), regex(pattern = r"^[a-z0-9_-]+$"))]
    pub id: String,
    /// Title shown to trainees.
    #[schemars(length(min = 1, max = 120))]
    pub title: String,
    /// What the trainee is to do, in plain words.
    #[schemars(length(min = 1, max = 2000))]
    pub instruction: String,
    /// Time after which the stage ends by itself, s: 1 to 7200; null: no limit.
    #[serde(default)]
    #[schemars(range(min = 1.0, max = 7200.0))]
    pub time_limit_s: Option<f64>,
    /// Instruments offered in this stage; without it all of the exercise's.
    #[serde(default)]
    #[schemars(length(min = 1, max = 50))]
    pub instruments: Option<Vec<String>>,
    /// Whether burs run, and whether blades such as spoon excavators and carvers cut.
    #[serde(default)]
    pub cutting: bool,
    /// The filling that carriers and plastic instruments lay in this stage: a tissue with "packing", such as
    /// "fresh_amalgam" or "fresh_composite".
    #[serde(default)]
    pub filling: Option<String>,
    /// Whether decay is shown in its colour.
    #[serde(default)]
    pub show_decay: bool,
    /// Whether the trainee may change how tissues feel, in the menu, to learn what the coefficients do. The report says
    /// what was changed; the next stage finds the tissues as they were. Not together with `stiffness_steps`.
    #[serde(default)]
    pub adjustable: bool,
    /// Stiffness that falls in steps until the trainee answers.
    #[serde(default)]
    pub stiffness_steps: Option<StiffnessStepsFile>,
    /// What leads the trainee's hand during the stage.
    #[serde(default)]
    pub guidance: Option<GuidanceFile>,
    /// What the trainee notes in the tooth's periodontal chart: the site is the one where the instrument is. The tooth must stand in
    /// a jaw with "periodontium".
    #[serde(default)]
    #[schemars(length(max = 2))]
    pub chart: Vec<ChartFile>,
    /// What the trainee is asked; can be answered at any time during the stage.
    #[serde(default)]
    #[schemars(length(max = 20))]
    pub ask: Vec<QuestionFile>,
    /// What ends the stage besides its time limit; the first to happen counts.
    #[serde(default)]
    #[schemars(length(max = 10))]
    pub ends_when: Vec<EndFile>,
}

/// Stiffness that falls in steps.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StiffnessStepsFile {
    /// Tissue whose stiffness changes.
    pub tissue: String,
    /// Stiffness coefficients, one step after the other.
    #[schemars(length(min = 1, max = 20))]
    pub coefficients: Vec<CoefficientFile>,
    /// How long each step lasts, s: 1 to 3600.
    #[schemars(range(min = 1.0, max = 3600.0))]
    pub step_time_s: f64,
}

/// What leads a hand.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum GuidanceFile {
    /// A spring to a path, such as an expert's.
    Path(FixtureFile),
    /// Forces as somebody felt them, played from the stage's beginning.
    Forces(ForcesFile),
}

/// A spring to a path.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FixtureFile {
    /// CSV file with the header x_mm,y_mm,z_mm (time_s may come first), relative to the scenario's folder; tooth space: x
    /// buccal, y distal (mesial for 21–28 and 41–48), z occlusal. `typodont path` makes one of a session.
    #[schemars(length(min = 1, max = 500), regex(pattern = r"\.csv$"))]
    pub file: String,
    /// Where on the path the hand is drawn to.
    pub kind: FixtureKind,
    /// Distance from the path within which the hand is free, mm: 0 to 20; without it 0.5 for a tube, 0 for a path to follow.
    /// The spring comes in over the first 0.3 mm outside.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 20.0))]
    pub radius_mm: Option<f32>,
    /// N/mm, 0.01 to 1.
    #[serde(default = "FixtureFile::stiffness")]
    #[schemars(range(min = 0.01, max = 1.0))]
    pub stiffness_n_per_mm: f32,
    /// N·s/mm, up to 0.01; without it 0.005 s times the stiffness. At least 0.004 s times the stiffness: less would push the hand about.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 0.01))]
    pub damping_n_s_per_mm: Option<f32>,
    /// Most that the spring pulls, N: 0.05 to 3. A hand must be able to win.
    #[serde(default = "FixtureFile::max_force")]
    #[schemars(range(min = 0.05, max = 3.0))]
    pub max_force_n: f32,
    /// Only to follow: how much of the path may be left out at once, mm: 0.2 to 20; 2 without it. Less than the distance, along
    /// the path, between places where it crosses or meets itself.
    #[serde(default)]
    #[schemars(range(min = 0.2, max = 20.0))]
    pub look_ahead_mm: Option<f32>,
    /// Only to follow: speed at which the hand is pulled along, mm/s: 0.1 to 100; without it the hand sets the pace.
    #[serde(default)]
    #[schemars(range(min = 0.1, max = 100.0))]
    pub speed_mm_s: Option<f32>,
}

impl FixtureFile {
    fn stiffness() -> f32 {
        0.2
    }

    fn max_force() -> f32 {
        1.0
    }
}

/// Where on a path the hand is drawn to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FixtureKind {
    /// From the path's beginning to its end: to the nearest place from where the hand has come so far.
    Follow,
    /// To the nearest place, back and forth as the hand likes.
    Tube,
}

/// Forces over time.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ForcesFile {
    /// CSV file with the header time_s,fx_n,fy_n,fz_n, relative to the scenario's folder. The first row is the stage's
    /// beginning; between rows forces change evenly.
    #[schemars(length(min = 1, max = 500), regex(pattern = r"\.csv$"))]
    pub file: String,
    /// Whether the forces begin again, half a second after the last row.
    #[serde(default)]
    pub repeat: bool,
    /// Factor for all forces, 0.01 to 100; no force may then be more than 5 N.
    #[serde(default = "one")]
    #[schemars(range(min = 0.01, max = 100.0))]
    pub scale: f32,
    /// Space in which the forces are written.
    pub space: SpaceFile,
}

fn one() -> f32 {
    1.0
}

/// A space in which forces are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SpaceFile {
    /// x right, y up, z toward the trainee.
    World,
    /// x buccal, y distal (mesial for 21–28 and 41–48), z occlusal.
    Tooth,
}

/// 0 to 1.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct CoefficientFile(#[schemars(range(min = 0.0, max = 1.0))] pub f32);

/// What ends a stage.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum EndFile {
    /// Every question of the stage is answered.
    Answered,
    /// The trainee says so.
    Confirmed,
    /// So much of the decay is gone, %.
    ClearedPct(#[schemars(range(min = 1.0, max = 100.0))] f64),
}

/// A question to the trainee.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct QuestionFile {
    /// Name in results: small letters, digits, hyphens, underscores.
    #[schemars(length(min = 1, max = 40), regex(pattern = r"^[a-z0-9_-]+$"))]
    pub id: String,
    /// The question, as the trainee reads it.
    #[schemars(length(min = 1, max = 500))]
    pub text: String,
    /// What can be answered, and what is right.
    pub answer: AnswerFile,
}

/// What can be answered, and what is right.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum AnswerFile {
    /// Which tooth has the decay of a name.
    ToothWith(String),
    /// In which quadrant of the occlusal surface, seen from above, the decay of a name lies: 1 upper left, 2 upper right,
    /// 3 lower left, 4 lower right.
    QuadrantOf(String),
    /// One of several texts.
    Choice(ChoiceFile),
    /// Yes or no; the value is the right one, null where none is.
    YesNo(Option<bool>),
    /// A number.
    Number(NumberFile),
    /// Free text, which is kept and not judged.
    Text,
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ChoiceFile {
    /// What can be chosen.
    #[schemars(length(min = 2, max = 30))]
    pub options: Vec<OptionFile>,
    /// Id of the right option; null where none is.
    #[serde(default)]
    pub correct: Option<String>,
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OptionFile {
    #[schemars(length(min = 1, max = 40), regex(pattern = r"^[a-z0-9_-]+$"))]
    pub id: String,
    #[schemars(length(min = 1, max = 200))]
    pub text: String,
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NumberFile {
    /// Unit shown behind the number, such as "mm".
    #[serde(default)]
    #[schemars(length(max = 20))]
    pub unit: String,
    /// The right number; null where none is.
    #[serde(default)]
    pub correct: Option<f64>,
    /// How far an answer may be from it and still be right.
    #[serde(default)]
    #[schemars(range(min = 0.0))]
    pub tolerance: f64,
}

/// Numbers that measures need.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MeasuresFile {
    /// Distance from the pulp within which force and speed are measured apart, mm: 0.1 to 10.
    #[serde(default = "MeasuresFile::near")]
    #[schemars(range(min = 0.1, max = 10.0))]
    pub near_mm: f32,
    /// Sound tissue this near to decay may be taken away without harm, mm: 0 to 5.
    #[serde(default = "MeasuresFile::leeway")]
    #[schemars(range(min = 0.0, max = 5.0))]
    pub leeway_mm: f32,
    /// Distance at which two surfaces count as the same, mm: 0.01 to 5.
    #[serde(default = "MeasuresFile::tolerance")]
    #[schemars(range(min = 0.01, max = 5.0))]
    pub tolerance_mm: f32,
}

impl MeasuresFile {
    fn near() -> f32 {
        1.0
    }

    fn leeway() -> f32 {
        0.3
    }

    fn tolerance() -> f32 {
        0.3
    }
}

impl Default for MeasuresFile {
    fn default() -> Self {
        MeasuresFile { near_mm: Self::near(), leeway_mm: Self::leeway(), tolerance_mm: Self::tolerance() }
    }
}

/// How points are given.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RubricFile {
    /// Points from which the exercise is passed, if nothing fails it outright.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub pass_points: f64,
    /// What earns points; the points of all items sum to 100.
    #[schemars(length(min = 1, max = 50))]
    pub items: Vec<RubricItemFile>,
    /// What fails the exercise outright, whatever the points.
    #[serde(default)]
    #[schemars(length(max = 20))]
    pub hard_fails: Vec<HardFailFile>,
}

/// One line of a rubric: full points at one value of a measure, none at another, in proportion between.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RubricItemFile {
    /// Name shown in the report.
    #[schemars(length(min = 1, max = 120))]
    pub title: String,
    /// The measure, such as "decay_cleared_pct".
    pub metric: String,
    /// Points for full marks, more than 0 to 100.
    #[schemars(range(max = 100.0), extend("exclusiveMinimum" = 0.0))]
    pub points: f64,
    /// Value that earns all points.
    pub full_at: f64,
    /// Value that earns none.
    pub zero_at: f64,
}

/// What fails an exercise outright.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HardFailFile {
    /// Name shown in the report.
    #[schemars(length(min = 1, max = 120))]
    pub title: String,
    /// The measure, such as "pulp_exposed".
    pub metric: String,
    /// When the measure fails.
    pub when: FailFile,
}

/// When a measure fails an exercise.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FailFile {
    /// The measure is more than this.
    Above(f64),
    /// The measure is less than this.
    Below(f64),
}
