//! What the author wrote, and what it means.
//!
//! Takes a scenario's text and the files it names. Gives a complete, valid [`Scenario`], or every complaint there is; and
//! the [`Workpiece`] a session starts from. Never runs anything.

mod arch_file;
mod cavity;
mod cavity_file;
mod decay_file;
mod gum_file;
mod deposit;
pub mod file;
mod lesion;
pub mod metric;
mod questionnaire;
mod resolve;
mod schema;
mod workpiece;

pub use crate::anatomy::periodontium::{Periodontium, Pockets, Site};
pub use cavity::{Cavity, Proximal};
pub use lesion::Lesion;
pub use metric::Metric;
pub use questionnaire::{Category, Item, Questionnaire};
pub use resolve::{Forms, hex, resolve};
pub use schema::schema_text;
pub use workpiece::{ToothPlace, Unmakeable, Workpiece, anatomy_tissues};

use crate::anatomy::{self, caries::Reach};
use crate::content::{InstrumentEntry, TissueTable};
use crate::frame::Vec3;
use crate::touch::{Carving, Factors, Guidance, Shape, Vibration};
use crate::volume::{Label, Volume};
use file::{AngleClassFile, SurfaceFile, ZoneRole};
use std::collections::BTreeMap;
use std::sync::Arc;

/// A complete, valid exercise. Beyond [`resolve`] nobody asks again whether something is there.
#[derive(Clone, Debug)]
pub struct Scenario {
    pub id: String,
    pub title: String,
    pub summary: String,
    /// The text it was read from.
    pub text: Arc<str>,
    /// SHA-256 of that text, hexadecimal.
    pub sha256: String,
    /// The tables and other files it was made from, by name: what a recording must hold to be scored again. Scans are not
    /// among them; what became of a scan is in the recording's own volume.
    pub files: BTreeMap<String, Arc<[u8]>>,
    pub scene: Scene,
    pub tissues: TissueTable,
    pub carving: Carving,
    pub vibration: Vibration,
    pub operating_field: OperatingField,
    /// The tray; stages and results refer to it by index.
    pub instruments: Vec<InstrumentEntry>,
    /// What each of them and the patient's age make of the tissues.
    pub factors: Vec<Factors>,
    pub zones: Vec<Zone>,
    /// What leads the hand; stages refer to it by index.
    pub guidances: Vec<Guidance>,
    pub stages: Vec<Stage>,
    pub measures: Measures,
    pub rubric: Option<Rubric>,
    pub questionnaire: Option<Questionnaire>,
}

/// What drilling brings before the eye besides the tooth. Drawn, and nothing else.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OperatingField {
    pub dust: bool,
    pub water_spray: bool,
    pub suction: bool,
}

impl OperatingField {
    /// True when there is anything to draw.
    pub fn is_any(self) -> bool {
        self.dust || self.water_spray
    }
}

/// What there is to see and touch.
#[derive(Clone, Debug)]
pub struct Scene {
    pub layout: Layout,
    /// One tooth, or two from left to right.
    pub teeth: Vec<Tooth>,
    /// What stands around a tooth in its jaw, tooth space; `None` for plain shapes of average size.
    pub around: Option<Vec<Shape>>,
    /// Gum with pockets, only in a jaw.
    pub pockets: Option<Pockets>,
    pub arch: Arch,
}

/// How the teeth of both jaws stand; mm.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Arch {
    pub upper: ArchForm,
    pub lower: ArchForm,
    pub angle_class: AngleClassFile,
    /// Numbers of teeth that are not there.
    pub missing: Vec<u8>,
    /// Numbers of teeth that are turned, and by how much, degrees.
    pub rotated: Vec<(u8, f32)>,
    /// The age that teeth and gum show, years; `None`: as written.
    pub age: Option<f32>,
}

/// Of one jaw; `None` for the average.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ArchForm {
    pub width: Option<f32>,
    pub depth: Option<f32>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Layout {
    Single,
    /// Two teeth side by side, so many mm apart.
    Pair {
        gap: f32,
    },
    /// With gum and neighbours.
    Jaw,
}

/// A tooth to be made.
#[derive(Clone, Debug)]
pub struct Tooth {
    pub id: String,
    pub fdi: u8,
    pub form: Form,
    pub decay: Vec<Decay>,
    /// Colour without softness.
    pub stains: Vec<Decay>,
    /// Cut out before the session begins.
    pub cavity: Option<Cavity>,
    pub calculus: Vec<Calculus>,
    pub fillings: Vec<Filling>,
}

/// A hard deposit on a root; mm.
#[derive(Clone, Debug, PartialEq)]
pub struct Calculus {
    pub id: String,
    pub label: Label,
    pub site: Site,
    /// Of its middle below the gum's margin.
    pub below_margin: f32,
    pub thickness: f32,
    pub width: f32,
    pub height: f32,
}

/// A filling from long ago, in the chewing surface; mm.
#[derive(Clone, Debug, PartialEq)]
pub struct Filling {
    pub id: String,
    pub label: Label,
    /// Of its middle from the crown's: buccal and distal.
    pub offset: [f32; 2],
    pub size: [f32; 2],
    pub depth: f32,
}

/// Which way is distal in the tooth space of a tooth of this number: +y or −y.
pub fn distal(fdi: u8) -> Vec3 {
    Vec3::Y * anatomy::teeth::distal(fdi)
}

/// Where a tooth's shape comes from.
#[derive(Clone, Debug)]
pub enum Form {
    /// Made by the program from its number, at a voxel size in mm and an age in years.
    Procedural { spacing: f32, age: Option<f32> },
    /// Read from a file and made ready: enamel up, tissues labelled.
    Given(Arc<Volume>),
    /// To be found in a recording: nothing is made anew.
    Recorded,
}

/// Decay to be put into a tooth; lengths in mm.
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
        /// Half axes: buccolingual, mesiodistal, occlusoapical.
        radii: [f32; 3],
        /// Of the centre below the surface.
        depth: f32,
    },
    Grown(Grown),
}

/// Decay that follows the tooth's tissues; see [`crate::anatomy::caries`].
#[derive(Clone, Debug, PartialEq)]
pub struct Grown {
    pub entry: GrownEntry,
    /// The seed draws one.
    pub reaches: Vec<Reach>,
    pub spread: f32,
    /// The rim's tissue, and how far it reaches from the border to the core, 0 to 1.
    pub rim: Option<(Label, f32)>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum GrownEntry {
    Fissure {
        length: f32,
    },
    /// Half axes on the surface.
    Smooth {
        half: [f32; 2],
    },
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DecayPlace {
    Centre,
    RandomQuadrant,
    Random,
    /// 1–4 as seen from above.
    Quadrant(u8),
    Offset([f32; 2]),
}

/// A named region.
#[derive(Clone, Debug)]
pub struct Zone {
    pub id: String,
    pub title: String,
    pub role: ZoneRole,
    pub region: Region,
}

/// Which voxels belong to a zone; points in tooth space, mm.
#[derive(Clone, Debug)]
pub enum Region {
    Tissue(Label),
    Around { label: Label, within: f32 },
    Sphere { centre: [f32; 3], radius: f32 },
    Box { min: [f32; 3], max: [f32; 3] },
    Cylinder { from: [f32; 3], to: [f32; 3], radius: f32 },
    Mask(Arc<Mask>),
}

impl Region {
    /// Corners of the smallest box around a region of a given shape, tooth space, mm; `None` where matter decides.
    pub fn extent(&self) -> Option<[Vec3; 2]> {
        let around = |a: [f32; 3], b: [f32; 3], radius: f32| {
            let (a, b) = (Vec3::from(a), Vec3::from(b));
            [a.min(b) - radius, a.max(b) + radius]
        };
        match self {
            Region::Sphere { centre, radius } => Some(around(*centre, *centre, *radius)),
            Region::Box { min, max } => Some(around(*min, *max, 0.0)),
            Region::Cylinder { from, to, radius } => Some(around(*from, *to, *radius)),
            Region::Tissue(_) | Region::Around { .. } | Region::Mask(_) => None,
        }
    }

    /// True for a point within a region of a given shape, tooth space, mm; false where matter decides.
    pub fn holds(&self, point_in_tooth: Vec3) -> bool {
        let p = point_in_tooth;
        match self {
            Region::Sphere { centre, radius } => p.distance_squared(Vec3::from(*centre)) <= radius * radius,
            Region::Box { min, max } => p.cmpge(Vec3::from(*min)).all() && p.cmple(Vec3::from(*max)).all(),
            Region::Cylinder { from, to, radius } => {
                let (from, axis) = (Vec3::from(*from), Vec3::from(*to) - Vec3::from(*from));
                let along = (p - from).dot(axis) / axis.length_squared();
                (0.0..=1.0).contains(&along) && (p - from - axis * along).length_squared() <= radius * radius
            }
            Region::Tissue(_) | Region::Around { .. } | Region::Mask(_) => false,
        }
    }

    /// The size of the label map that marks the region, if one does.
    pub fn map_dims(&self) -> Option<[u32; 3]> {
        if let Region::Mask(mask) = self { Some(mask.dims) } else { None }
    }
}

/// Voxels of a label map, on the grid it was read with.
#[derive(Clone, Debug)]
pub struct Mask {
    pub dims: [u32; 3],
    pub is_inside: Vec<bool>,
}

/// One part of an exercise.
#[derive(Clone, Debug)]
pub struct Stage {
    pub id: String,
    pub title: String,
    pub instruction: String,
    /// s
    pub time_limit: Option<f64>,
    /// Indices into [`Scenario::instruments`]; never empty.
    pub instruments: Vec<usize>,
    pub cutting: bool,
    /// What carriers lay.
    pub filling: Option<Label>,
    pub show_decay: bool,
    /// The trainee may change the tissues' coefficients.
    pub is_adjustable: bool,
    pub steps: Option<StiffnessSteps>,
    /// Index into [`Scenario::guidances`].
    pub guidance: Option<usize>,
    pub chart: Charted,
    pub ask: Vec<Question>,
    pub ends: Ends,
}

#[derive(Clone, Debug, PartialEq)]
pub struct StiffnessSteps {
    pub label: Label,
    /// Coefficients, one step after the other; never empty.
    pub coefficients: Vec<f32>,
    /// s
    pub step_time: f64,
}

/// What is noted in the periodontal chart during a stage.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Charted {
    pub depths: bool,
    pub calculus: bool,
}

/// What ends a stage besides its time limit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Ends {
    pub answered: bool,
    pub confirmed: bool,
    /// %
    pub cleared: Option<f64>,
}

#[derive(Clone, Debug, PartialEq)]
pub struct Question {
    pub id: String,
    pub text: String,
    pub kind: QuestionKind,
}

/// What can be answered, and what is right.
#[derive(Clone, Debug, PartialEq)]
pub enum QuestionKind {
    /// The tooth with the decay of this name.
    ToothWith {
        decay: String,
    },
    /// The quadrant of the decay of this name.
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

/// Numbers that measures need, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measures {
    pub near: f32,
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
    /// Every measure that is asked for, those of hard fails last.
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
}

#[derive(Clone, Debug, PartialEq)]
pub struct HardFail {
    pub title: String,
    pub metric: Metric,
    pub when: Limit,
}

/// When a measure fails an exercise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Limit {
    Above(f64),
    Below(f64),
}

impl QuestionKind {
    /// True when an answer can be right or wrong.
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
    /// The last stage in which burs run.
    pub fn cutting_stage(&self) -> Option<usize> {
        self.stages.iter().rposition(|s| s.cutting)
    }

    /// Something is to be removed: decay, or what lies in a target zone.
    pub fn has_target(&self) -> bool {
        let has_zone = self.zones.iter().any(|zone| zone.role == ZoneRole::Target);
        has_zone || self.scene.teeth.iter().any(|tooth| !tooth.decay.is_empty())
    }

    /// True where a tooth begins with a prepared cavity: a filling can be held against its contour.
    pub fn has_cavity(&self) -> bool {
        self.scene.teeth.iter().any(|tooth| tooth.cavity.is_some())
    }

    /// True where a prepared cavity is to be filled.
    pub fn has_filling(&self) -> bool {
        self.has_cavity() && self.stages.iter().any(|stage| stage.filling.is_some())
    }

    /// Every decay with the index of its tooth.
    pub fn decay(&self) -> impl Iterator<Item = (usize, &Decay)> {
        self.scene.teeth.iter().enumerate().flat_map(|(tooth, t)| t.decay.iter().map(move |d| (tooth, d)))
    }
}
