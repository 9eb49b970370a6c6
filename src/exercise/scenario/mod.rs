//! Scenarios: the files that authors write, and the checked exercises made from them.
//!
//! Takes a scenario's text and the files it names. Gives a complete, valid [`Scenario`] or every diagnostic, and the
//! [`Workpiece`] from which a session starts. Never runs anything.

mod arch_file;
mod arch_volume;
mod cavity;
mod cavity_file;
mod contact_limit;
mod decay_file;
mod periodontium_file;
mod calculus_and_fillings;
pub mod file;
mod generated_teeth;
mod lesion;
mod other_teeth;
mod limits_file;
pub mod metric;
pub mod metric_id;
mod questionnaire;
mod resolve;
mod schema;
mod soft_neighbours;
mod tooth_bounds;
mod tooth_words;
mod workpiece;
mod workpiece_error;

/// Names under which a recording keeps its own parts; no file of an exercise may have one of them.
pub const RECORDING_PARTS: [&str; 5] =
    [SCENARIO_PART, INITIAL_DENSITY_PART, INITIAL_LABEL_PART, ORIGINAL_DENSITY_PART, ORIGINAL_LABEL_PART];
/// The exercise itself.
pub const SCENARIO_PART: &str = "scenario.json";
/// Densities and labels at the start of the session.
pub const INITIAL_DENSITY_PART: &str = "initial.density.nrrd";
pub const INITIAL_LABEL_PART: &str = "initial.label.nrrd";
/// Densities and labels of the tooth before its cavity was cut.
pub const ORIGINAL_DENSITY_PART: &str = "original.density.nrrd";
pub const ORIGINAL_LABEL_PART: &str = "original.label.nrrd";

pub use cavity::{PreparedCavity, ProximalBox};
pub use contact_limit::{ContactLimit, LimitPlace, LimitedQuantity};
pub use file::QuestionnaireTime;
pub use lesion::{Lesion, seeded_random};
pub use metric::Metric;
pub use other_teeth::MouthArches;
pub use questionnaire::{Questionnaire, QuestionnaireCategory, QuestionnaireItem};
pub use resolve::{ResolveMode, hex, resolve};
pub use schema::schema_text;
pub use tooth_bounds::{ToothBounds, anatomy_tissues};
pub use typodont_anatomy::jaw::Jaw;
pub use typodont_anatomy::periodontium::{Periodontium, Pockets, ProbingSite};
pub use workpiece::{NeighbourTooth, Workpiece};
pub use workpiece_error::WorkpieceError;

use crate::catalog::{InstrumentEntry, TissueTable};
use crate::local_text::LocalTexts;
use file::{AngleClassFile, SurfaceFile, ZoneRole};
use std::collections::BTreeMap;
use std::sync::Arc;
use typodont_anatomy::caries::LesionDepth;
use typodont_anatomy::cheek_and_tongue::SoftNeighbour;
use typodont_anatomy::jaw::{ArchPlan, CUSP_WIDTH, DentalArch, Occlusion};
use typodont_core::aabb::Aabb;
use typodont_core::frame::Vec3;
use typodont_core::touch::{CarvingParameters, Collider, Guidance, MaterialScales, Vibration};
use typodont_core::volume::Label;
use typodont_formats::import::ImportedTooth;

/// A complete, valid exercise, as returned by [`resolve`]. No later code checks for missing parts.
#[derive(Clone, Debug)]
pub struct Scenario {
    pub id: String,
    pub title: String,
    pub summary: String,
    /// Photographs and radiographs of the case.
    pub pictures: Vec<CasePicture>,
    /// The text of the scenario file.
    pub text: Arc<str>,
    /// SHA-256 of that text, hexadecimal.
    pub sha256: String,
    /// The tables and other files from which the scenario was made, by name: a recording must contain them in order to
    /// be scored again. Scans are not among them; the volume made from a scan is part of the recording.
    pub files: BTreeMap<String, Arc<[u8]>>,
    pub scene: Scene,
    /// FDI number of a tooth that replaced the exercise's own, if it has another number; see
    /// [`Scenario::renumber_teeth`].
    pub substituted_fdi: Option<u8>,
    pub tissues: TissueTable,
    pub carving: CarvingParameters,
    pub vibration: Vibration,
    pub operating_field: OperatingField,
    /// Instruments of the tray. Stages and results refer to them by index.
    pub instruments: Vec<InstrumentEntry>,
    /// Factors by which each instrument and the patient's age change the tissues' tactile properties, one entry per
    /// instrument.
    pub factors: Vec<MaterialScales>,
    pub zones: Vec<Zone>,
    /// Haptic guidances. Stages refer to them by index.
    pub guidances: Vec<Guidance>,
    pub stages: Vec<Stage>,
    pub measures: MeasureParams,
    /// Limits of force and speed, those near a zone or a tissue first.
    pub limits: Vec<ContactLimit>,
    pub rubric: Option<Rubric>,
    pub questionnaire: Option<Questionnaire>,
    pub questionnaire_time: QuestionnaireTime,
    /// Translations of the texts of the exercise and of its tables. All other fields hold the base texts.
    pub texts: LocalTexts,
}

/// A photograph or a radiograph of the case; its bytes are among [`Scenario::files`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CasePicture {
    pub title: String,
    /// Name of the file.
    pub file: String,
}

/// Visible effects of drilling. They are drawn only, and do not influence any measure.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OperatingField {
    pub dust: bool,
    pub water_spray: bool,
    pub suction: bool,
}

impl OperatingField {
    /// Returns true if debris or water is drawn.
    pub fn is_any(self) -> bool {
        self.dust || self.water_spray
    }
}

/// The tooth or teeth of an exercise and their surroundings.
#[derive(Clone, Debug)]
pub struct Scene {
    pub layout: SceneLayout,
    /// One tooth, two from left to right, all teeth of an arch, or one and then all others of the mouth.
    pub teeth: Vec<ToothSpec>,
    /// Objects around a tooth in its jaw, tooth space; `None` for simple shapes of average size.
    pub surroundings: Option<Vec<Collider>>,
    /// True if these are a jaw of the exercise's own, in place of the generated one.
    pub own_jaw: bool,
    /// True if a rubber dam covers the jaw, all but the tooth and those beside it.
    pub rubber_dam: bool,
    /// True if retractors hold the corners of the mouth.
    pub retractors: bool,
    /// Gingiva with pockets; `None` outside a jaw.
    pub pockets: Option<Pockets>,
    pub arch: DentalArches,
    /// The cheek and the tongue beside the tooth, if they are there.
    pub soft_neighbours: Vec<SoftNeighbour>,
}

impl Scene {
    /// Returns true if all teeth of one jaw can be worked on.
    pub fn is_arch(&self) -> bool {
        matches!(self.layout, SceneLayout::Arch { .. })
    }

    /// Returns true if all teeth of an arch can be touched.
    pub fn has_whole_arch(&self) -> bool {
        matches!(self.layout, SceneLayout::Mouth { .. } | SceneLayout::Arch { .. })
    }

    /// Returns true if the teeth stand in a jaw that is drawn around them.
    pub fn is_in_mouth(&self) -> bool {
        matches!(self.layout, SceneLayout::Jaw | SceneLayout::Mouth { .. } | SceneLayout::Arch { .. })
    }

    /// Returns the teeth that are in the workpiece's volume, and so can be cut.
    pub fn teeth_in_volume(&self) -> &[ToothSpec] {
        let count = if let SceneLayout::Mouth { .. } = self.layout { 1 } else { self.teeth.len() };
        &self.teeth[..count.min(self.teeth.len())]
    }
}

/// Positions of the teeth in both jaws; mm.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DentalArches {
    pub upper: ArchForm,
    pub lower: ArchForm,
    pub angle_class: AngleClassFile,
    /// FDI numbers of missing teeth.
    pub missing: Vec<u8>,
    /// FDI numbers of rotated teeth, each with its rotation, degrees.
    pub rotated: Vec<(u8, f32)>,
    /// Age shown by teeth and gingiva, years; `None` for unworn teeth with the pulp and the gingiva of an adult of 30
    /// years.
    pub age: Option<f32>,
}

impl DentalArches {
    /// Returns what differs in one jaw from the average.
    pub fn plan(&self, jaw: Jaw) -> ArchPlan {
        let form = match jaw {
            Jaw::Upper => self.upper,
            Jaw::Lower => self.lower,
        };
        ArchPlan { width: form.width, depth: form.depth, rotated: self.rotated.clone(), age: self.age }
    }

    /// Returns the arch of one jaw, with third molars if one is among the given teeth.
    pub fn of_jaw(&self, jaw: Jaw, teeth: impl IntoIterator<Item = u8>) -> DentalArch {
        let count = if teeth.into_iter().any(|fdi| fdi % 10 == 8) { 8 } else { 7 };
        DentalArch::new(jaw, count, None, &self.plan(jaw))
    }

    /// Returns how the opposite jaw stands to the one that is worked on.
    pub fn occlusion(&self, near: &DentalArch, opposite: &DentalArch) -> Occlusion {
        let ahead = match self.angle_class {
            AngleClassFile::I => 0.0,
            AngleClassFile::II => -CUSP_WIDTH,
            AngleClassFile::III => CUSP_WIDTH,
        };
        Occlusion::new(near, opposite, ahead)
    }
}

/// Arch form of one jaw, mm; `None` for the average.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ArchForm {
    pub width: Option<f32>,
    pub depth: Option<f32>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SceneLayout {
    Single,
    /// Two teeth side by side; `gap` is the distance between them, mm.
    Pair {
        gap: f32,
    },
    /// A tooth with gingiva and neighbouring teeth.
    Jaw,
    /// A tooth, the first one, among all others of both jaws, which can be examined but not cut; `spacing` is their voxel
    /// size, mm.
    Mouth {
        spacing: f32,
    },
    /// All teeth of one jaw in their arch, with its gingiva; `spacing` is the voxel size, mm.
    Arch {
        spacing: f32,
    },
}

/// Specification of a tooth.
#[derive(Clone, Debug)]
pub struct ToothSpec {
    pub id: String,
    pub fdi: u8,
    pub source: ToothSource,
    pub decay: Vec<Decay>,
    /// Stains: discoloured but sound places.
    pub stains: Vec<Decay>,
    /// Cavity cut before the session begins.
    pub cavity: Option<PreparedCavity>,
    pub calculus: Vec<Calculus>,
    pub fillings: Vec<OldFilling>,
}

/// A deposit of calculus on a root; lengths in mm.
#[derive(Clone, Debug, PartialEq)]
pub struct Calculus {
    pub id: String,
    pub label: Label,
    pub site: ProbingSite,
    /// Distance of the deposit's centre below the gingival margin.
    pub below_margin: f32,
    pub thickness: f32,
    pub width: f32,
    pub height: f32,
}

/// An existing filling in the occlusal surface; lengths in mm.
#[derive(Clone, Debug, PartialEq)]
pub struct OldFilling {
    pub id: String,
    pub label: Label,
    /// Offset of the filling's centre from the centre of the crown: buccal and distal.
    pub offset: [f32; 2],
    pub size: [f32; 2],
    pub depth: f32,
}

/// Unit vector toward distal in the tooth space of the tooth with this FDI number: +y or −y.
pub fn distal(fdi: u8) -> Vec3 {
    Vec3::Y * typodont_anatomy::teeth::distal_sign(fdi)
}

/// Source of a tooth's shape.
#[derive(Clone, Debug)]
pub enum ToothSource {
    /// Generated by the program from the tooth's FDI number; voxel size in mm, age in years.
    Procedural { spacing: f32, age: Option<f32> },
    /// Read from a file: crown up, tissues labelled.
    Given(Arc<ImportedTooth>),
    /// Taken from a recording; nothing is generated.
    Recorded,
}

/// Decay to be placed in a tooth; lengths in mm.
#[derive(Clone, Debug, PartialEq)]
pub struct Decay {
    pub id: String,
    pub label: Label,
    pub shape: DecayShape,
    pub surface: SurfaceFile,
    pub place: DecayPlace,
}

#[derive(Clone, Debug, PartialEq)]
pub enum DecayShape {
    Ellipsoid {
        /// Semi-axes: buccolingual, mesiodistal, occlusoapical.
        radii: [f32; 3],
        /// Depth of the centre below the surface.
        depth: f32,
    },
    Grown(GrownDecay),
}

/// Decay that follows the tooth's tissues; see [`typodont_anatomy::caries`].
#[derive(Clone, Debug, PartialEq)]
pub struct GrownDecay {
    pub origin: DecayOrigin,
    /// Possible depths, of which the session's seed selects one.
    pub depths: Vec<LesionDepth>,
    pub spread: f32,
    /// Tissue of the rim, and its extent from the border toward the core, 0 to 1.
    pub rim: Option<(Label, f32)>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DecayOrigin {
    Fissure {
        length: f32,
    },
    /// Semi-axes on the surface.
    Smooth {
        half: [f32; 2],
    },
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DecayPlace {
    Centre,
    RandomQuadrant,
    Random,
    /// Quadrant, 1–4 as seen from above.
    Quadrant(u8),
    Offset([f32; 2]),
}

/// A named region.
#[derive(Clone, Debug)]
pub struct Zone {
    pub id: String,
    pub title: String,
    pub role: ZoneRole,
    pub region: ZoneRegion,
}

/// Voxels that belong to a zone; points in tooth space, mm.
#[derive(Clone, Debug)]
pub enum ZoneRegion {
    Tissue(Label),
    Around { label: Label, within: f32 },
    Sphere { centre: [f32; 3], radius: f32 },
    Box { min: [f32; 3], max: [f32; 3] },
    Cylinder { from: [f32; 3], to: [f32; 3], radius: f32 },
    Mask(Arc<Mask>),
}

impl ZoneRegion {
    /// Returns the smallest box around a geometric region, tooth space, mm; `None` for a region defined
    /// by tissues or a label map.
    pub fn bounding_box(&self) -> Option<Aabb> {
        let around = |a: [f32; 3], b: [f32; 3], radius: f32| {
            let (a, b) = (Vec3::from(a), Vec3::from(b));
            Aabb::around([a, b]).grown(Vec3::splat(radius))
        };
        match self {
            ZoneRegion::Sphere { centre, radius } => Some(around(*centre, *centre, *radius)),
            ZoneRegion::Box { min, max } => Some(around(*min, *max, 0.0)),
            ZoneRegion::Cylinder { from, to, radius } => Some(around(*from, *to, *radius)),
            ZoneRegion::Tissue(_) | ZoneRegion::Around { .. } | ZoneRegion::Mask(_) => None,
        }
    }

    /// Returns true for a point (tooth space, mm) within a geometric region; false for a region defined by tissues or a
    /// label map.
    pub fn contains(&self, point_in_tooth: Vec3) -> bool {
        let p = point_in_tooth;
        match self {
            ZoneRegion::Sphere { centre, radius } => p.distance_squared(Vec3::from(*centre)) <= radius * radius,
            ZoneRegion::Box { min, max } => p.cmpge(Vec3::from(*min)).all() && p.cmple(Vec3::from(*max)).all(),
            ZoneRegion::Cylinder { from, to, radius } => {
                let (from, axis) = (Vec3::from(*from), Vec3::from(*to) - Vec3::from(*from));
                let along = (p - from).dot(axis) / axis.length_squared();
                (0.0..=1.0).contains(&along) && (p - from - axis * along).length_squared() <= radius * radius
            }
            ZoneRegion::Tissue(_) | ZoneRegion::Around { .. } | ZoneRegion::Mask(_) => false,
        }
    }

    /// Returns the size of the label map that defines the region, in voxels; `None` for other regions.
    pub fn map_dims(&self) -> Option<[u32; 3]> {
        if let ZoneRegion::Mask(mask) = self { Some(mask.dims) } else { None }
    }
}

/// Marked voxels of a label map, on the label map's own grid.
#[derive(Clone, Debug)]
pub struct Mask {
    pub dims: [u32; 3],
    pub is_inside: Vec<bool>,
}

/// A stage of an exercise.
#[derive(Clone, Debug)]
pub struct Stage {
    pub id: String,
    pub title: String,
    pub instruction: String,
    /// Time limit, s.
    pub time_limit: Option<f64>,
    /// Indices into [`Scenario::instruments`]; never empty.
    pub instruments: Vec<usize>,
    pub cutting: bool,
    /// Filling material that carriers place.
    pub filling: Option<Label>,
    pub show_decay: bool,
    /// True if a card teaches how the trainee's device is used.
    pub shows_controls: bool,
    /// True if the trainee may change the tissues' coefficients.
    pub is_adjustable: bool,
    pub draw: Option<Draw>,
    pub steps: Option<StiffnessSteps>,
    /// Index into [`Scenario::guidances`].
    pub guidance: Option<usize>,
    pub chart: ChartScope,
    pub ask: Vec<Question>,
    pub ends: EndConditions,
}

/// One trial of a stage in which the site of the caries is drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct Draw {
    /// Name by which the question refers to the caries that was drawn.
    pub id: String,
    /// Ids of the possible sites, in the order of the file; never fewer than two.
    pub sites: Vec<String>,
    /// Number of the trial, from 1. Trials of one stage follow one another as stages of the scenario.
    pub trial: u32,
    /// Number of trials of the stage.
    pub trials: u32,
}

#[derive(Clone, Debug, PartialEq)]
pub struct StiffnessSteps {
    pub label: Label,
    /// Coefficients, one step after the other; never empty.
    pub coefficients: Vec<f32>,
    /// Duration of a step, s.
    pub step_time: f64,
}

/// Findings to be recorded in the periodontal chart during a stage.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ChartScope {
    pub depths: bool,
    pub calculus: bool,
}

/// Conditions that end a stage, besides its time limit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EndConditions {
    pub answered: bool,
    pub confirmed: bool,
    /// Share of the decay to be removed, %.
    pub cleared: Option<f64>,
}

#[derive(Clone, Debug, PartialEq)]
pub struct Question {
    pub id: String,
    pub text: String,
    pub kind: QuestionKind,
}

/// Kind of answer, and the correct answer.
#[derive(Clone, Debug, PartialEq)]
pub enum QuestionKind {
    /// The tooth that has the decay with this id.
    ToothWith {
        decay: String,
    },
    /// The quadrant in which the decay with this id lies.
    QuadrantOf {
        decay: String,
    },
    Choice {
        options: Vec<(String, String)>,
        correct: Option<String>,
    },
    YesNo {
        correct: Option<bool>,
    },
    Number {
        unit: String,
        correct: Option<f64>,
        tolerance: f64,
    },
    Text,
}

/// Parameters of the measures, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeasureParams {
    pub pulp_proximity: f32,
    pub leeway: f32,
    pub tolerance: f32,
}

#[derive(Clone, Debug, PartialEq)]
pub struct Rubric {
    pub pass_points: f64,
    pub items: Vec<RubricItem>,
    pub hard_fails: Vec<HardFail>,
}

impl Rubric {
    /// Returns every measure of the rubric, those of critical errors last.
    pub fn metrics(&self) -> impl Iterator<Item = &Metric> {
        self.items.iter().map(|item| &item.metric).chain(self.hard_fails.iter().map(|fail| &fail.metric))
    }
}

#[derive(Clone, Debug, PartialEq)]
pub struct RubricItem {
    pub title: String,
    pub metric: Metric,
    pub points: f64,
    pub full_at: f64,
    pub zero_at: f64,
    /// Index of the item of the same rubric by whose earned share the points are multiplied.
    pub counts_with: Option<usize>,
}

#[derive(Clone, Debug, PartialEq)]
pub struct HardFail {
    pub title: String,
    pub metric: Metric,
    pub when: Limit,
}

/// Condition on a measure under which an exercise is failed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Limit {
    Above(f64),
    Below(f64),
}

impl QuestionKind {
    /// Returns true if an answer can be correct or incorrect.
    pub fn is_judged(&self) -> bool {
        match self {
            QuestionKind::ToothWith { .. } | QuestionKind::QuadrantOf { .. } => true,
            QuestionKind::Choice { correct, .. } => correct.is_some(),
            QuestionKind::YesNo { correct } => correct.is_some(),
            QuestionKind::Number { correct, .. } => correct.is_some(),
            QuestionKind::Text => false,
        }
    }
}

impl Scenario {
    /// Gives the teeth of the exercise another FDI number, and changes the words for the tooth in its summary,
    /// instructions, questions and zones accordingly. The title remains: it identifies the exercise.
    ///
    /// # Errors
    /// Returns a message if there is no tooth with this number, or if the exercise has all teeth of a jaw.
    pub fn renumber_teeth(&mut self, fdi: u8) -> Result<(), String> {
        if let (SceneLayout::Mouth { .. }, Some(treated)) = (self.scene.layout, self.scene.teeth.first())
            && treated.fdi == fdi
        {
            return Ok(());
        }
        if self.scene.has_whole_arch() {
            return Err("the exercise has all teeth of a jaw, none of which can take another's number".into());
        }
        let Some(former) = self.scene.teeth.first().map(|tooth| tooth.fdi) else { return Ok(()) };
        let Some(words) = tooth_words::Replacement::of(former, fdi) else {
            return Err(format!("there is no tooth {fdi}; the FDI number must be one of 11–18, 21–28, 31–38 or 41–48"));
        };
        self.scene.teeth.iter_mut().for_each(|tooth| tooth.fdi = fdi);
        self.substituted_fdi = Some(fdi);
        let stages = self.stages.iter_mut().flat_map(|stage| {
            let questions = stage.ask.iter_mut().map(|question| &mut question.text);
            [&mut stage.title, &mut stage.instruction].into_iter().chain(questions)
        });
        let zones = self.zones.iter_mut().map(|zone| &mut zone.title);
        for text in stages.chain(zones).chain([&mut self.summary]) {
            *text = words.apply(text);
        }
        Ok(())
    }

    /// Returns the index of the last stage in which burs run.
    pub fn cutting_stage(&self) -> Option<usize> {
        self.stages.iter().rposition(|s| s.cutting)
    }

    /// Returns the index, in the scenario file, of the stage to which a stage belongs: trials are stages of their own.
    pub fn written_stage(&self, stage: usize) -> usize {
        let is_first = |s: &&Stage| s.draw.as_ref().is_none_or(|draw| draw.trial == 1);
        self.stages.iter().take(stage + 1).filter(is_first).count().saturating_sub(1)
    }

    /// Returns true if the seed decides anything about the volume: a position, or one of several depths.
    pub fn is_workpiece_drawn(&self) -> bool {
        let is_drawn = |place: &DecayPlace| matches!(place, DecayPlace::Random | DecayPlace::RandomQuadrant);
        let has_depths = |shape: &DecayShape| matches!(shape, DecayShape::Grown(grown) if grown.depths.len() > 1);
        self.scene.teeth.iter().any(|tooth| {
            let mut patches = tooth.decay.iter().chain(&tooth.stains);
            let is_cavity_drawn = tooth.cavity.as_ref().is_some_and(|cavity| is_drawn(&cavity.place));
            is_cavity_drawn || patches.any(|patch| is_drawn(&patch.place) || has_depths(&patch.shape))
        })
    }

    /// Returns true if something is to be removed: decay, or tissue in a target zone.
    pub fn has_target(&self) -> bool {
        let has_zone = self.zones.iter().any(|zone| zone.role == ZoneRole::Target);
        has_zone || self.scene.teeth_in_volume().iter().any(|tooth| !tooth.decay.is_empty())
    }

    /// Returns true if a tooth has a prepared cavity, so that a filling can be compared with the tooth's contour.
    pub fn has_cavity(&self) -> bool {
        self.scene.teeth.iter().any(|tooth| tooth.cavity.is_some())
    }

    /// Returns true if a prepared cavity is to be filled.
    pub fn has_filling(&self) -> bool {
        self.has_cavity() && self.stages.iter().any(|stage| stage.filling.is_some())
    }

    /// Returns every decay with the index of its tooth.
    pub fn decay(&self) -> impl Iterator<Item = (usize, &Decay)> {
        self.scene.teeth.iter().enumerate().flat_map(|(tooth, t)| t.decay.iter().map(move |d| (tooth, d)))
    }
}
