//! The scenario file.
//!
//! Every key, unit and range here is a contract with authors: the JSON Schema for editors and the diagnostics of the
//! reader both follow from these types. Combinations of keys are checked in [`super::resolve`].

pub use super::arch_file::*;
pub use super::cavity_file::*;
pub use super::decay_file::*;
pub use super::limits_file::*;
pub use super::periodontium_file::*;

use super::questionnaire::Questionnaire;
use crate::catalog::{InstrumentTable, TissueEntry, ToothShade};
use crate::local_text::LocalText;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use typodont_formats::Library;

/// An exercise: its scene, the tasks set to the trainee, and the scoring.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ScenarioFile {
    /// Path of the JSON Schema by which a text editor checks this file; for example "scenario.schema.json", which is
    /// shipped beside the scenarios.
    #[serde(default, rename = "$schema")]
    pub schema: Option<String>,
    /// Short name used in file names and tables: lower-case letters a–z, digits, hyphens and underscores.
    #[schemars(length(min = 1, max = 60), regex(pattern = r"^[a-z0-9_-]+$"))]
    pub id: String,
    /// Title shown to trainees.
    #[schemars(length(min = 1, max = 120))]
    pub title: LocalText,
    /// Purpose of the exercise, in one or two sentences.
    #[serde(default)]
    #[schemars(length(max = 2000))]
    pub summary: LocalText,
    /// Photographs and radiographs of the case, which the trainee can look at before and during the exercise.
    #[serde(default)]
    #[schemars(length(max = 12))]
    pub pictures: Vec<PictureFile>,
    /// The tooth or teeth of the exercise and their surroundings.
    pub scene: SceneFile,
    /// File of the school's own instruments, in addition to those of `content/instruments.json`. It has the same keys;
    /// its path is relative to the scenario's folder.
    #[serde(default)]
    #[schemars(length(min = 1, max = 500), regex(pattern = r"\.json$"))]
    pub instrument_file: Option<String>,
    /// Changed values for tissues of `content/tissues.json`, by the tissue's name.
    #[serde(default)]
    pub tissues: BTreeMap<String, TissueChange>,
    /// Additional tissues that `content/tissues.json` does not contain.
    #[serde(default)]
    #[schemars(length(max = 100))]
    pub new_tissues: Vec<TissueEntry>,
    /// Sets the stiffness of one tissue to a fraction of that of another tissue.
    #[serde(default)]
    pub stiffness_ratio: Option<StiffnessRatio>,
    /// The patient. If omitted, tissues have the properties given in their table.
    #[serde(default)]
    pub patient: Option<PatientFile>,
    /// Removal of tissue by burs.
    #[serde(default)]
    pub carving: CarvingFile,
    /// Vibration of a bur while it cuts.
    #[serde(default)]
    pub vibration: VibrationFile,
    /// Visible effects of drilling: debris, water spray and suction.
    #[serde(default)]
    pub operating_field: OperatingFieldFile,
    /// Instruments on the tray, by their ids in `content/instruments.json`. The first instrument is selected at the
    /// start.
    #[schemars(length(min = 1, max = 50))]
    pub instruments: Vec<String>,
    /// Named regions of the tooth, to which measures can refer.
    #[serde(default)]
    #[schemars(length(max = 20))]
    pub zones: Vec<ZoneFile>,
    /// The stages of the exercise, in order.
    #[schemars(length(min = 1, max = 50))]
    pub stages: Vec<StageFile>,
    /// Parameters of the measures.
    #[serde(default)]
    pub measures: MeasuresFile,
    /// Greatest force and speed, and what follows when they are exceeded.
    #[serde(default)]
    pub limits: LimitsFile,
    /// Rules for awarding points. If omitted, the exercise is measured but not graded.
    #[serde(default)]
    pub rubric: Option<RubricFile>,
    /// Name of a questionnaire in `content/questionnaires/` that is asked at the end: lower-case letters, digits,
    /// hyphens, underscores.
    #[serde(default)]
    #[schemars(regex(pattern = r"^[a-z0-9_-]+$"))]
    pub questionnaire: Option<String>,
    /// Time at which the questionnaire is asked.
    #[serde(default)]
    pub questionnaire_time: Option<QuestionnaireTime>,
}

/// A photograph or a radiograph of the case.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PictureFile {
    /// PNG, JPEG or TIFF file, at most 12 MB and 8192 pixels wide and high. Its path is relative to the scenario's folder.
    #[schemars(length(min = 1, max = 500))]
    pub file: String,
    /// Title shown to trainees, such as "Bite-wing radiograph".
    #[schemars(length(min = 1, max = 120))]
    pub title: LocalText,
}

impl ScenarioFile {
    /// Names of all files that the exercise itself names, in order, without those that its instrument file names.
    pub fn named_files(&self) -> BTreeSet<String> {
        let questionnaire = self.questionnaire.as_deref().map(Questionnaire::file_name);
        let labels = self.zones.iter().filter_map(|zone| match &zone.region {
            RegionFile::Labels(labels) => Some(labels.file.clone()),
            _ => None,
        });
        let guidance = self.stages.iter().filter_map(|stage| match stage.guidance.as_ref()? {
            GuidanceFile::Path(path) => Some(path.file.clone()),
            GuidanceFile::Forces(forces) => Some(forces.file.clone()),
        });
        let scans = self.scene.scans().map(str::to_string);
        let own = self.instrument_file.clone().into_iter().chain(questionnaire);
        let pictures = self.pictures.iter().map(|picture| picture.file.clone());
        own.chain(scans).chain(labels).chain(guidance).chain(pictures).collect()
    }

    /// Names of all files that the instruments of the exercise name: pictures and shapes. `library` contains the tables
    /// of instruments; a table that cannot be read names none.
    pub fn instrument_files(&self, library: &Library) -> BTreeSet<String> {
        let shipped = InstrumentTable::read(library);
        let table = shipped.and_then(|table| match &self.instrument_file {
            Some(name) => table.extended_with(library, name),
            None => Ok(table),
        });
        let tray = table.iter().flat_map(|table| self.instruments.iter().filter_map(|id| table.by_id(id)));
        tray.flat_map(|entry| entry.files().map(str::to_string)).collect()
    }
}

/// Time at which a questionnaire is asked.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum QuestionnaireTime {
    /// Every time, after the last stage.
    #[default]
    EachTime,
    /// Once, when the trainee has performed every exercise of the course that names the same questionnaire. The window
    /// knows the course from its list of exercises; at a terminal the questionnaire is asked every time.
    EndOfCourse,
}

/// The tooth or teeth of an exercise and their surroundings.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SceneFile {
    /// A single tooth.
    Tooth(ToothFile),
    /// Two teeth side by side for comparison.
    Pair(PairFile),
    /// One tooth in its jaw, with gingiva and neighbouring teeth.
    Jaw(JawFile),
    /// All teeth of one jaw, each of which can be examined and treated.
    DentalArch(DentalArchFile),
}

impl SceneFile {
    /// Names of the scans and label maps of its teeth.
    pub fn scans(&self) -> impl Iterator<Item = &str> {
        let teeth = match self {
            SceneFile::Tooth(tooth) => vec![tooth],
            SceneFile::Pair(pair) => vec![&pair.left, &pair.right],
            SceneFile::Jaw(jaw) => jaw.teeth().collect(),
            SceneFile::DentalArch(arch) => arch.teeth.iter().collect(),
        };
        teeth.into_iter().flat_map(|tooth| match &tooth.form {
            ToothSourceFile::Procedural(_) => vec![],
            ToothSourceFile::Ct(scan) => vec![scan.file.as_str()],
            ToothSourceFile::Labels(map) => std::iter::once(&map.file).chain(&map.scan).map(String::as_str).collect(),
        })
    }
}

/// Two teeth side by side.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PairFile {
    /// The tooth on the left as the trainee sees it.
    pub left: ToothFile,
    /// The tooth on the right.
    pub right: ToothFile,
    /// Distance between the two teeth, mm: 0.5 to 30.
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
    /// The tooth to be treated.
    pub tooth: ToothFile,
    /// Objects around the tooth, as closed meshes. If omitted, the tooth is surrounded by a simple gingiva and two
    /// simple neighbouring teeth; an empty list leaves it without surroundings.
    #[serde(default)]
    #[schemars(length(max = 20))]
    pub around: Option<Vec<ObstacleFile>>,
    /// True if the objects of `around` are a jaw of the school's own, with its teeth and its gingiva: it is drawn and felt in
    /// place of the generated jaw. A `periodontium` is then the gingiva next to the treated tooth only.
    #[serde(default)]
    pub own_jaw: bool,
    /// Gingiva around the tooth with a sulcus or pockets that can be probed. If omitted, the gingiva is simple and has
    /// no sulcus.
    #[serde(default)]
    pub periodontium: Option<PeriodontiumFile>,
    /// True for the cheek, held aside, which gives way and can be hurt. Beside premolars and molars.
    #[serde(default)]
    pub cheek: bool,
    /// True for the tongue, which gives way and can be hurt. Beside lower premolars and molars.
    #[serde(default)]
    pub tongue: bool,
    /// True for a rubber dam, from which the treated tooth and the three teeth on each side of it stand out. It is drawn only: the
    /// gingiva under it is felt and scored as without it.
    #[serde(default)]
    pub rubber_dam: bool,
    /// True for two retractors at the corners of the mouth. They are drawn only, while one looks into the mouth from in front.
    #[serde(default)]
    pub retractors: bool,
    /// Positions of the teeth in both jaws.
    #[serde(default)]
    pub arch: ArchFile,
    /// All other teeth of both jaws as teeth of voxels, with the gingiva, the palate and the floor of the mouth, which is open:
    /// they can be examined, but not cut. If omitted, only the adjacent teeth can be touched, as simple shapes.
    #[serde(default)]
    pub other_teeth: Option<OtherTeethFile>,
}

impl JawFile {
    /// The tooth to be treated, and the listed ones among the others.
    pub fn teeth(&self) -> impl Iterator<Item = &ToothFile> {
        std::iter::once(&self.tooth).chain(self.other_teeth.iter().flat_map(|others| &others.teeth))
    }
}

/// The other teeth of a mouth.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OtherTeethFile {
    /// The teeth with decay, which is felt but not seen. Those that are not listed are sound; each has its FDI number as its name.
    #[serde(default)]
    #[schemars(length(max = 31))]
    pub teeth: Vec<ToothFile>,
    /// Voxel size of these teeth, mm: 0.1 (fine) to 0.4 (coarse).
    #[serde(default = "OtherTeethFile::spacing")]
    #[schemars(range(min = 0.1, max = 0.4))]
    pub spacing_mm: f32,
}

impl OtherTeethFile {
    fn spacing() -> f32 {
        0.15
    }
}

/// An object that can be touched but not cut.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ObstacleFile {
    /// File of a closed surface in millimetres (.obj, .glb, .gltf, .stl or .ply), relative to the scenario's folder.
    #[schemars(length(min = 1, max = 500))]
    pub mesh: String,
    /// Tissue whose tactile properties the object has.
    pub tissue: String,
    /// Position of the mesh's origin in tooth space, mm: buccal, distal (mesial for 21–28 and 41–48) and occlusal,
    /// measured from the centre of the crown at the neck.
    #[serde(default = "ObstacleFile::origin")]
    pub position_mm: [CoordinateFile; 3],
    /// Rotation of the mesh about the x, then the y, then the z axis of tooth space, degrees.
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

/// Angle, degrees: -180 to 180.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(transparent)]
pub struct AngleFile(#[schemars(range(min = -180.0, max = 180.0))] pub f32);

/// A tooth made of voxels.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ToothFile {
    /// Name by which questions and results refer to the tooth: lower-case letters, digits, hyphens, underscores.
    #[schemars(length(min = 1, max = 40), regex(pattern = r"^[a-z0-9_-]+$"))]
    pub id: String,
    /// Tooth number, ISO 3950 (FDI): 11–18, 21–28, 31–38, 41–48.
    #[schemars(range(min = 11, max = 48))]
    pub fdi: u8,
    /// Source of the tooth's shape.
    pub form: ToothSourceFile,
    /// Decay in this tooth.
    #[serde(default)]
    #[schemars(length(max = 20))]
    pub decay: Vec<DecayFile>,
    /// A prepared cavity to be filled.
    #[serde(default)]
    pub cavity: Option<CavityFile>,
    /// Stained places, which look like decay but are sound. A stain has the same keys as decay, but its tissue must be
    /// a sound one.
    #[serde(default)]
    #[schemars(length(max = 20))]
    pub stains: Vec<StainFile>,
    /// Calculus on the root and the neck. The tooth must stand in a jaw with "periodontium".
    #[serde(default)]
    #[schemars(length(max = 20))]
    pub calculus: Vec<CalculusFile>,
    /// Existing fillings.
    #[serde(default)]
    #[schemars(length(max = 10))]
    pub old_fillings: Vec<FillingFile>,
}

/// Source of a tooth's shape.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ToothSourceFile {
    /// A tooth generated by the program with the average dimensions of its type.
    Procedural(ProceduralFile),
    /// A CT scan of one tooth, segmented into enamel, dentine and pulp by the program.
    Ct(ScanFile),
    /// A label map: a volume in which every voxel is assigned to a tissue.
    Labels(LabelsFile),
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ProceduralFile {
    /// Voxel size, mm: 0.04 (fine) to 0.4 (coarse).
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
    /// Distance between voxels along x, y and z, mm. To be given if the distance stated in the file is wrong.
    #[serde(default)]
    pub spacing_mm: Option<[SpacingFile; 3]>,
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LabelsFile {
    /// NRRD file of labels (such as 3D Slicer's .seg.nrrd), relative to the scenario's folder.
    #[schemars(length(min = 1, max = 500))]
    pub file: String,
    /// Distance between voxels along x, y and z, mm. To be given if the distance stated in the file is wrong.
    #[serde(default)]
    pub spacing_mm: Option<[SpacingFile; 3]>,
    /// Tissue for each number in the file, for example { "1": "enamel", "2": "dentine", "3": "pulp" }. The number 0 is
    /// air; every other number in the file must be listed.
    pub tissues: BTreeMap<String, String>,
    /// NRRD file of the CT scan on which the labels were drawn, voxel by voxel, relative to the scenario's folder. The
    /// radiograph and the user-defined colours then show its grey values.
    #[serde(default)]
    #[schemars(length(min = 1, max = 500))]
    pub scan: Option<String>,
}

/// Distance between voxels, mm: 0.01 to 2.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct SpacingFile(#[schemars(range(min = 0.01, max = 2.0))] pub f32);

/// Changed values for a tissue of the table; omitted values stay as they are.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TissueChange {
    /// Stiffness, as a share of the device's maximum stiffness: 0 to 1.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1.0))]
    pub stiffness: Option<f32>,
    /// Damping, as a share of the device's maximum damping: 0 to 1.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1.0))]
    pub damping: Option<f32>,
    /// Coefficient of static friction (Coulomb): 0 to 2.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 2.0))]
    pub static_friction: Option<f32>,
    /// Coefficient of dynamic friction (Coulomb): 0 to 2.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 2.0))]
    pub dynamic_friction: Option<f32>,
    /// Spring force from which a bur cuts the tissue, N: 0.01 to 50.
    #[serde(default)]
    #[schemars(range(min = 0.01, max = 50.0))]
    pub cut_force_n: Option<f32>,
    /// Vickers hardness for the rate law of cutting, HV: 0.1 to 2000.
    #[serde(default)]
    #[schemars(range(min = 0.1, max = 2000.0))]
    pub hardness_hv: Option<f32>,
}

/// One tissue's stiffness as a fraction of another's.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StiffnessRatio {
    /// The stiffer tissue. Its stiffness is not changed.
    pub of: String,
    /// The tissue whose stiffness is set.
    pub to: String,
    /// Factor by which the first tissue is stiffer than the second: 1 to 100. The measured ratio of enamel to dentine
    /// is about 5.
    #[schemars(range(min = 1.0, max = 100.0))]
    pub ratio: f32,
}

/// The patient.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PatientFile {
    /// Age, years: 3 to 110. Below 18 is a child, below 36 a young adult, below 61 an adult, and from 61 an old
    /// patient. The effect of age on each tissue is given in `content/touch.json`.
    /// Without an age, tissues feel like those of a young adult.
    #[schemars(range(min = 3.0, max = 110.0))]
    #[serde(default)]
    pub age_years: Option<f32>,
    /// True to adapt the anatomy to an age of 12 to 90 years: teeth generated by the program have the pulp size and the
    /// cusp wear, and healthy gingiva the recession, that are usual at that age. If false, teeth are unworn, with the
    /// pulp and the gingiva of an adult of 30 years.
    #[serde(default)]
    pub shows_age: bool,
    /// Shade of the teeth in the picture: "A1" to "D4" of the VITA classical shade guide, or "of_age" for the mean shade at the
    /// patient's age. Without it, enamel and dentine have the colours of `content/tissues.json`.
    #[serde(default)]
    pub shade: Option<ToothShade>,
}

/// Removal of tissue by burs.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CarvingFile {
    /// Time on one spot after which a lower force is sufficient, s: 0 to 60.
    #[serde(default = "CarvingFile::dwell")]
    #[schemars(range(min = 0.0, max = 60.0))]
    pub dwell_s: f32,
    /// Share of the cutting force that is sufficient after that time: 0 to 1.
    #[serde(default = "CarvingFile::dwell_share")]
    #[schemars(range(min = 0.0, max = 1.0))]
    pub dwell_share: f32,
    /// Maximum speed at which a bur advances into tissue, mm/s: 0.1 to 100.
    #[serde(default = "CarvingFile::max_feed")]
    #[schemars(range(min = 0.1, max = 100.0))]
    pub max_feed_mm_s: f32,
    /// Law that determines how far a bur advances.
    #[serde(default)]
    pub law: CuttingLawFile,
}

/// Law that determines how far a bur advances.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum CuttingLawFile {
    /// Threshold of force: above a tissue's cutting force, a bur advances as far as the trainee has pushed it; staying
    /// on one spot lowers the threshold.
    #[default]
    Threshold,
    /// Rate of removal: the volume removed per second increases with force and surface speed and decreases with the
    /// tissue's hardness. There is no minimum force, and the time on one spot has no effect.
    Rate(RateFile),
}

#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RateFile {
    /// Speed of the bur, 1/min: 0 (not rotating) to 500 000. Air turbines under load: 150 000 to 300 000.
    #[schemars(range(min = 0.0, max = 500_000.0))]
    pub rpm: f32,
    /// Factor by which all burs remove more than a medium-grit diamond, 0.05 to 10; multiplied by the "grit" of each
    /// bur.
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

/// Vibration of a bur while it cuts.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VibrationFile {
    /// Frequency, Hz: 1 to 500.
    #[serde(default = "VibrationFile::frequency")]
    #[schemars(range(min = 1.0, max = 500.0))]
    pub frequency_hz: f32,
    /// Amplitude, N: 0 (no vibration) to 1.
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

/// Visible effects of drilling. They do not influence any measure.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OperatingFieldFile {
    /// Debris of the material that is cut flies off and settles on the tooth and the gingiva.
    #[serde(default)]
    pub dust: bool,
    /// The handpiece sprays water while it runs. Water washes debris away and obscures the surface beneath it.
    #[serde(default)]
    pub water_spray: bool,
    /// A saliva ejector beside the tooth removes debris and water near it.
    #[serde(default)]
    pub suction: bool,
}

/// A named region of the tooth.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ZoneFile {
    /// Name by which measures refer to the zone, as in "zone_removed_pct(target)": lower-case letters, digits, hyphens,
    /// underscores.
    #[schemars(length(min = 1, max = 40), regex(pattern = r"^[a-z0-9_-]+$"))]
    pub id: String,
    /// Name shown to users.
    #[schemars(length(min = 1, max = 80))]
    pub title: LocalText,
    /// Role of the zone.
    pub role: ZoneRole,
    /// Voxels that belong to the zone.
    pub region: RegionFile,
}

/// Role of a zone.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ZoneRole {
    /// Tissue to be removed: the reference preparation.
    Target,
    /// Tissue that may be removed without penalty.
    Leeway,
    /// Walls or floor that must remain intact. Decay within them does not count.
    Container,
    /// Tissue that must never be removed. Decay within it does not count, unless the region names that decay as its
    /// tissue.
    NeverRemove,
}

/// Voxels that belong to a zone. Points are in tooth space: x buccal, y distal (mesial for 21–28 and 41–48), z
/// occlusal, measured from the centre of the crown at the neck.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum RegionFile {
    /// All voxels of a tissue.
    Tissue(String),
    /// All voxels within a distance of a tissue, without the tissue itself.
    Around(AroundFile),
    /// All voxels within a sphere.
    Sphere(SphereRegionFile),
    /// All voxels within a box along the axes of tooth space.
    Box(BoxRegionFile),
    /// All voxels within a cylinder.
    Cylinder(CylinderRegionFile),
    /// The voxels with one number in a label map of the same size as the tooth.
    Labels(LabelsRegionFile),
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AroundFile {
    /// Name of the tissue.
    pub tissue: String,
    /// Maximum distance from the tissue, mm: 0.01 to 10.
    #[schemars(range(min = 0.01, max = 10.0))]
    pub within_mm: f32,
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SphereRegionFile {
    /// Centre of the sphere, mm.
    pub centre_mm: [CoordinateFile; 3],
    /// Radius, mm: 0.05 to 20.
    #[schemars(range(min = 0.05, max = 20.0))]
    pub radius_mm: f32,
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BoxRegionFile {
    /// Corner of the box with the lowest coordinates, mm.
    pub min_mm: [CoordinateFile; 3],
    /// Corner of the box with the highest coordinates, mm.
    pub max_mm: [CoordinateFile; 3],
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CylinderRegionFile {
    /// One end of the cylinder's axis, mm.
    pub from_mm: [CoordinateFile; 3],
    /// Other end of the cylinder's axis, mm.
    pub to_mm: [CoordinateFile; 3],
    /// Radius, mm: 0.05 to 20.
    #[schemars(range(min = 0.05, max = 20.0))]
    pub radius_mm: f32,
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LabelsRegionFile {
    /// NRRD file, relative to the scenario's folder.
    #[schemars(length(min = 1, max = 500))]
    pub file: String,
    /// Number in the label map: 1 to 255.
    #[schemars(range(min = 1, max = 255))]
    pub value: u8,
}

/// Coordinate, mm: -60 to 60.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(transparent)]
pub struct CoordinateFile(#[schemars(range(min = -60.0, max = 60.0))] pub f32);

/// A stage of an exercise.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StageFile {
    /// Name used in results: lower-case letters, digits, hyphens, underscores.
    #[schemars(length(min = 1, max = 40), regex(pattern = r"^[a-z0-9_-]+$"))]
    pub id: String,
    /// Title shown to trainees.
    #[schemars(length(min = 1, max = 120))]
    pub title: LocalText,
    /// Task for the trainee, in plain language.
    #[schemars(length(min = 1, max = 2000))]
    pub instruction: LocalText,
    /// Time limit after which the stage ends, s: 1 to 7200; null for no limit.
    #[serde(default)]
    #[schemars(range(min = 1.0, max = 7200.0))]
    pub time_limit_s: Option<f64>,
    /// Instruments available in this stage. If omitted, all instruments of the exercise are available.
    #[serde(default)]
    #[schemars(length(min = 1, max = 50))]
    pub instruments: Option<Vec<String>>,
    /// True if burs run and blades, such as spoon excavators and carvers, cut in this stage.
    #[serde(default)]
    pub cutting: bool,
    /// Filling material that carriers and plastic instruments place in this stage: a tissue with "packing", such as
    /// "fresh_amalgam" or "fresh_composite".
    #[serde(default)]
    pub filling: Option<String>,
    /// True to show decay in its own colour.
    #[serde(default)]
    pub show_decay: bool,
    /// True to show a card beside the tooth that teaches how the trainee's own device (mouse or haptic device) is used,
    /// with a picture of each action and a mark for those done.
    #[serde(default)]
    pub shows_controls: bool,
    /// True to let the trainee change the tactile properties of tissues in the menu, in order to learn the effect of
    /// each coefficient. The report lists the changes; the next stage starts with the original values. Cannot be
    /// combined with `stiffness_steps`.
    #[serde(default)]
    pub adjustable: bool,
    /// Caries at a site that is drawn for each session, in one or several trials.
    #[serde(default)]
    pub draw: Option<DrawFile>,
    /// Stiffness of a tissue that decreases in steps until the trainee answers.
    #[serde(default)]
    pub stiffness_steps: Option<StiffnessStepsFile>,
    /// Haptic guidance of the trainee's hand during the stage.
    #[serde(default)]
    pub guidance: Option<GuidanceFile>,
    /// Findings that the trainee records in the tooth's periodontal chart, at the site where the instrument is. The
    /// tooth must stand in a jaw with "periodontium".
    #[serde(default)]
    #[schemars(length(max = 2))]
    pub chart: Vec<ChartFile>,
    /// Questions to the trainee. They can be answered at any time during the stage.
    #[serde(default)]
    #[schemars(length(max = 20))]
    pub ask: Vec<QuestionFile>,
    /// Conditions that end the stage, besides its time limit. The first condition that is met ends the stage.
    #[serde(default)]
    #[schemars(length(max = 10))]
    pub ends_when: Vec<EndConditionFile>,
}

/// A draw: in each trial of the stage one of several possible sites is carious, and the others feel like sound enamel.
/// The session's seed decides which, so that the answer cannot be read from the exercise.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DrawFile {
    /// Name by which the stage's question refers to the caries that was drawn.
    #[schemars(length(min = 1, max = 40), regex(pattern = r"^[a-z0-9_-]+$"))]
    pub id: String,
    /// Possible sites: ids of "decay" entries with a fixed position. Each is drawn with the same probability.
    #[schemars(length(min = 2, max = 32))]
    pub one_of: Vec<String>,
    /// Number of trials: 1 to 50. The stage is repeated this often, each time with a new draw and a new answer;
    /// `time_limit_s` applies to each trial.
    #[serde(default = "DrawFile::once")]
    #[schemars(range(min = 1, max = 50))]
    pub trials: u32,
}

impl DrawFile {
    fn once() -> u32 {
        1
    }
}

/// Stiffness that decreases in steps.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StiffnessStepsFile {
    /// Tissue whose stiffness changes.
    pub tissue: String,
    /// Stiffness coefficients of the steps, in order.
    #[schemars(length(min = 1, max = 20))]
    pub coefficients: Vec<CoefficientFile>,
    /// Duration of each step, s: 1 to 3600.
    #[schemars(range(min = 1.0, max = 3600.0))]
    pub step_time_s: f64,
}

/// Haptic guidance.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum GuidanceFile {
    /// A spring that draws the trainee's hand to a path, such as that of an expert.
    Path(FixtureFile),
    /// Recorded forces, replayed from the beginning of the stage.
    Forces(ForcesFile),
}

/// A spring that draws the trainee's hand to a path.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FixtureFile {
    /// CSV file with the header x_mm,y_mm,z_mm, which time_s may precede; its path is relative to the scenario's
    /// folder. Points are in tooth space: x buccal, y distal (mesial for 21–28 and 41–48), z occlusal. The command
    /// `typodont path` makes such a file from a recorded session.
    #[schemars(length(min = 1, max = 500), regex(pattern = r"\.csv$"))]
    pub file: String,
    /// Point of the path to which the hand is drawn.
    pub kind: FixtureKindFile,
    /// Distance from the path within which no force acts, mm: 0 to 20. If omitted, 0.5 for `tube` and 0 for `follow`.
    /// The spring sets in gradually over the first 0.3 mm outside this distance.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 20.0))]
    pub radius_mm: Option<f32>,
    /// Stiffness of the spring, N/mm: 0.01 to 1.
    #[serde(default = "FixtureFile::stiffness")]
    #[schemars(range(min = 0.01, max = 1.0))]
    pub stiffness_n_per_mm: f32,
    /// Damping, N·s/mm: up to 0.01, and at least 0.004 s times the stiffness, since a lower value makes the guidance
    /// unstable. If omitted, 0.005 s times the stiffness.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 0.01))]
    pub damping_n_s_per_mm: Option<f32>,
    /// Maximum force of the spring, N: 0.05 to 3. The trainee must be able to overcome it.
    #[serde(default = "FixtureFile::max_force")]
    #[schemars(range(min = 0.05, max = 3.0))]
    pub max_force_n: f32,
    /// For `follow` only: maximum length of path that the trainee may skip at once, mm: 0.2 to 20; 2 if omitted. It
    /// must be less than the distance, along the path, between places where the path crosses or touches itself.
    #[serde(default)]
    #[schemars(range(min = 0.2, max = 20.0))]
    pub look_ahead_mm: Option<f32>,
    /// For `follow` only: speed at which the hand is drawn along the path, mm/s: 0.1 to 100. If omitted, the trainee
    /// sets the pace.
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

/// Point of a path to which the hand is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FixtureKindFile {
    /// The path is followed from its beginning to its end: the hand is drawn to the nearest point at or ahead of the
    /// point that it has reached.
    Follow,
    /// The hand is drawn to the nearest point of the path and may move in both directions.
    Tube,
}

/// Forces over time.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ForcesFile {
    /// CSV file with the header time_s,fx_n,fy_n,fz_n; its path is relative to the scenario's folder. The first row
    /// applies at the beginning of the stage; between rows, forces are interpolated linearly.
    #[schemars(length(min = 1, max = 500), regex(pattern = r"\.csv$"))]
    pub file: String,
    /// True to replay the forces again, half a second after the last row.
    #[serde(default)]
    pub repeat: bool,
    /// Factor applied to all forces: 0.01 to 100. No resulting force may exceed 5 N.
    #[serde(default = "one")]
    #[schemars(range(min = 0.01, max = 100.0))]
    pub scale: f32,
    /// Coordinate system of the forces.
    pub space: SpaceFile,
}

fn one() -> f32 {
    1.0
}

/// Coordinate system of forces.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SpaceFile {
    /// World space: x right, y up, z toward the trainee.
    World,
    /// Tooth space: x buccal, y distal (mesial for 21–28 and 41–48), z occlusal.
    Tooth,
}

/// Coefficient: 0 to 1.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct CoefficientFile(#[schemars(range(min = 0.0, max = 1.0))] pub f32);

/// Condition that ends a stage.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum EndConditionFile {
    /// Every question of the stage has been answered.
    Answered,
    /// The trainee confirms that the stage is complete.
    Confirmed,
    /// This share of the decay has been removed, %: 1 to 100.
    ClearedPct(#[schemars(range(min = 1.0, max = 100.0))] f64),
}

/// A question to the trainee.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct QuestionFile {
    /// Name used in results: lower-case letters, digits, hyphens, underscores.
    #[schemars(length(min = 1, max = 40), regex(pattern = r"^[a-z0-9_-]+$"))]
    pub id: String,
    /// Text of the question, as shown to the trainee.
    #[schemars(length(min = 1, max = 500))]
    pub text: LocalText,
    /// Kind of answer, and the correct answer.
    pub answer: AnswerFile,
}

/// Kind of answer, and the correct answer.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum AnswerFile {
    /// The tooth that has the decay with this id, or the caries of the stage's draw with this id.
    ToothWith(String),
    /// The quadrant of the occlusal surface in which the decay, or the caries of the stage's draw, with this id lies, as
    /// seen from above: 1 upper left, 2 upper right, 3 lower left, 4 lower right.
    QuadrantOf(String),
    /// One of several texts.
    Choice(ChoiceFile),
    /// Yes or no. The value is the correct answer; null if no answer is correct or incorrect.
    YesNo(Option<bool>),
    /// A number.
    Number(NumberFile),
    /// Free text, which is recorded but not marked.
    Text,
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ChoiceFile {
    /// Options to choose from.
    #[schemars(length(min = 2, max = 30))]
    pub options: Vec<OptionFile>,
    /// Id of the correct option; null if no option is correct or incorrect.
    #[serde(default)]
    pub correct: Option<String>,
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OptionFile {
    /// Name used in results: lower-case letters, digits, hyphens, underscores.
    #[schemars(length(min = 1, max = 40), regex(pattern = r"^[a-z0-9_-]+$"))]
    pub id: String,
    /// Text of the option, as shown to the trainee.
    #[schemars(length(min = 1, max = 200))]
    pub text: LocalText,
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NumberFile {
    /// Unit shown after the number, such as "mm".
    #[serde(default)]
    #[schemars(length(max = 20))]
    pub unit: String,
    /// The correct number; null if no number is correct or incorrect.
    #[serde(default)]
    pub correct: Option<f64>,
    /// Maximum difference between an answer and the correct number at which the answer counts as correct.
    #[serde(default)]
    #[schemars(range(min = 0.0))]
    pub tolerance: f64,
}

/// Parameters of the measures.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MeasuresFile {
    /// Distance from the pulp within which force and speed are measured separately, mm: 0.1 to 10.
    #[serde(default = "MeasuresFile::near")]
    #[schemars(range(min = 0.1, max = 10.0))]
    pub near_mm: f32,
    /// Distance from decay within which sound tissue may be removed without penalty, mm: 0 to 5.
    #[serde(default = "MeasuresFile::leeway")]
    #[schemars(range(min = 0.0, max = 5.0))]
    pub leeway_mm: f32,
    /// Distance up to which two surfaces count as equal, mm: 0.01 to 5.
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

/// Rules for awarding points.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RubricFile {
    /// Pass mark, points: 0 to 100. The exercise is passed with at least this number of points and without a critical
    /// error.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub pass_points: f64,
    /// Items for which points are awarded. The points of all items sum to 100.
    #[schemars(length(min = 1, max = 50))]
    pub items: Vec<RubricItemFile>,
    /// Critical errors, which fail the exercise regardless of the points.
    #[serde(default)]
    #[schemars(length(max = 20))]
    pub hard_fails: Vec<HardFailFile>,
}

/// One item of a rubric: full points at one value of a measure, no points at another, and points in proportion between
/// the two.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RubricItemFile {
    /// Name shown in the report.
    #[schemars(length(min = 1, max = 120))]
    pub title: LocalText,
    /// The measure, such as "decay_cleared_pct".
    pub metric: String,
    /// Maximum points of the item: more than 0, up to 100.
    #[schemars(range(max = 100.0), extend("exclusiveMinimum" = 0.0))]
    pub points: f64,
    /// Value of the measure that earns all points.
    pub full_at: f64,
    /// Value of the measure that earns no points.
    pub zero_at: f64,
    /// The measure of another item of this rubric, such as "decay_cleared_pct". The points of this item are
    /// multiplied by the share of its points that the other item earned, so that nobody is rewarded for what was
    /// avoided by not doing the work. The other item must not depend on a third.
    #[serde(default)]
    pub counts_with: Option<String>,
}

/// A critical error, which fails an exercise regardless of the points.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HardFailFile {
    /// Name shown in the report.
    #[schemars(length(min = 1, max = 120))]
    pub title: LocalText,
    /// The measure, such as "pulp_exposed".
    pub metric: String,
    /// Condition under which the error has occurred.
    pub when: FailFile,
}

/// Condition on a measure under which an exercise is failed.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FailFile {
    /// The measure is more than this.
    Above(f64),
    /// The measure is less than this.
    Below(f64),
}
