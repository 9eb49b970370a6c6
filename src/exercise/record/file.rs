//! The JSON parts of a recording. Readers ignore unknown keys.

use crate::catalog::CoefficientName;
use crate::scenario::Scenario;
use crate::session::{AnswerValue, ChartInput, EndedBy, Input, MirrorFace, TraineeView};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use typodont_core::device::{DeviceSpec, PageForce};
use typodont_core::frame::{Quat, Vec3};
use typodont_core::sim::{Command, HandFrame, Simulation};
use typodont_core::tick::TICK_S;
use typodont_core::touch::Coefficient;
use typodont_core::volume::Label;

/// Version of the recording format. A reader refuses a newer version, and replays an older one as its program did:
/// version 1 has no torque, no force ramp at the start of contact and no second hand. Version 2 has no draws, no sealed
/// seeds, no substituted tooth with a number of its own and no placed hand.
pub const VERSION: u32 = 3;

/// Name of the metadata record written before the first tick.
pub(super) const HEAD: &str = "session";
/// Name of the metadata record written after the last tick.
pub(super) const END: &str = "end";

/// Metadata known before the first tick.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RecordingHeadFile {
    pub version: u32,
    pub typodont_version: String,
    pub scenario_id: String,
    pub scenario_sha256: String,
    /// Code of the participant, never a name.
    pub participant: String,
    /// Seed of everything that the exercise leaves to chance. The file of a sealed session has 0 here.
    pub seed: u64,
    /// Source of the seed; `None` in recordings made before it was recorded.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seed_origin: Option<SeedOriginFile>,
    /// Digest of the seed of a sealed session, hexadecimal; the seed itself follows at the end of the recording.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seed_sha256: Option<String>,
    /// Duration of a tick, s.
    pub tick_s: f64,
    /// Start of the session, RFC 3339; for information, not used by the score.
    pub started: String,
    /// Id of the scripted operator; `None` for a person.
    pub operator: Option<String>,
    /// True for a session with a person: the session ran on a thread other than the servo's, and a command was
    /// carried out some ticks after it was issued.
    #[serde(default)]
    pub live: bool,
    /// Moments at which the session went on after it had been interrupted; left out if it never was.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub resumed: Vec<ResumptionFile>,
    /// FDI number of the tooth that replaced the exercise's own; left out if the number is the exercise's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tooth_fdi: Option<u8>,
    pub device: DeviceSpecFile,
    /// SHA-256 of the files from which the session was made, by name.
    pub digests: BTreeMap<String, String>,
}

impl RecordingHeadFile {
    /// Returns the head of a session run by this program. Participant, operator and start are left empty.
    pub fn of(scenario: &Scenario, device: &DeviceSpec, seed: u64) -> RecordingHeadFile {
        RecordingHeadFile {
            version: VERSION,
            typodont_version: env!("CARGO_PKG_VERSION").to_string(),
            scenario_id: scenario.id.clone(),
            scenario_sha256: scenario.sha256.clone(),
            participant: String::new(),
            seed,
            seed_origin: None,
            seed_sha256: None,
            tick_s: TICK_S,
            started: String::new(),
            operator: None,
            live: false,
            resumed: Vec::new(),
            tooth_fdi: scenario.substituted_fdi,
            device: DeviceSpecFile::from(device),
            digests: BTreeMap::new(),
        }
    }
}

/// Moment at which an interrupted session went on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ResumptionFile {
    /// The first tick after the interruption.
    pub tick: u64,
    /// Date and time, RFC 3339; for information, not used by the score.
    pub at: String,
}

/// Source of a session's seed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SeedOriginFile {
    /// Drawn from the operating system when the session began.
    System,
    /// Given by the person who started the session, who can have known what it draws.
    Given,
    /// Derived from an examiner's code, and revealed at the end of the session.
    Sealed,
}

/// Metadata known after the last tick.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RecordingEndFile {
    /// "complete", or the reason for an early end of the session.
    pub reason: String,
    pub servo: ServoStatsFile,
}

/// Counts and timing of the servo; times in µs. A headless run has no clock and therefore no times.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ServoStatsFile {
    pub ticks: u64,
    #[serde(default)]
    pub late_p50_us: Option<f64>,
    pub late_p99_us: Option<f64>,
    pub late_max_us: Option<f64>,
    /// Longest computation of a tick.
    #[serde(default)]
    pub work_max_us: Option<f64>,
    /// Number of missed servo cycles.
    pub missed: u64,
    /// Number of ticks that did not reach the session; if not 0, the recording is incomplete.
    pub dropped: u64,
    /// Number of times the forces were switched off because a servo cycle was too late.
    #[serde(default)]
    pub let_go: u64,
    /// Number of times the device was absent or not ready during the session; no ticks ran meanwhile.
    #[serde(default)]
    pub interruptions: u64,
    /// Number of times a person paused the session.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub pauses: u64,
    /// Number of refused readings and of forces that were not finite.
    pub faults: u64,
    /// Number of forces clamped to the device's limit.
    pub clamped: u64,
    /// Number of torques clamped to the device's limit.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub clamped_torques: u64,
}

/// Returns true for a count that is omitted, so that files stay identical to those written before the count existed.
fn is_zero(count: &u64) -> bool {
    *count == 0
}

impl ServoStatsFile {
    /// Returns the counts of a simulation, without timing.
    pub fn of(simulation: &Simulation) -> ServoStatsFile {
        let gate = simulation.gate();
        ServoStatsFile {
            ticks: simulation.tick().0,
            faults: gate.faults(),
            clamped: gate.clamped_forces,
            clamped_torques: gate.clamped_torques,
            ..ServoStatsFile::default()
        }
    }

    /// Returns true if the counts of both simulations are equal, whatever their timing.
    pub fn has_same_counts(&self, other: &ServoStatsFile) -> bool {
        let counts = |file: &ServoStatsFile| (file.ticks, file.faults, file.clamped, file.clamped_torques);
        counts(self) == counts(other)
    }
}

/// Device specification; each key names its unit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DeviceSpecFile {
    pub name: String,
    pub max_force_n: f32,
    pub continuous_force_n: f32,
    #[serde(default)]
    pub max_torque_nmm: f32,
    pub max_stiffness_n_per_mm: f32,
    pub max_damping_n_s_per_mm: f32,
    pub resolution_mm: f32,
    pub workspace_half_mm: [f32; 3],
    pub apparent_mass_kg: f32,
    /// Force that was left in a browser's page; absent outside of a page, and for a device that renders none anyway.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub page_force: Option<PageForceFile>,
}

/// Force of a device in a browser's page.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PageForceFile {
    /// A part of it was rendered.
    Reduced,
    /// It was not rendered.
    Off,
}

impl From<&DeviceSpec> for DeviceSpecFile {
    fn from(spec: &DeviceSpec) -> DeviceSpecFile {
        DeviceSpecFile {
            name: spec.name.clone(),
            max_force_n: spec.max_force,
            continuous_force_n: spec.continuous_force,
            max_torque_nmm: spec.max_torque,
            max_stiffness_n_per_mm: spec.max_stiffness,
            max_damping_n_s_per_mm: spec.max_damping,
            resolution_mm: spec.resolution,
            workspace_half_mm: spec.workspace_half.to_array(),
            apparent_mass_kg: spec.apparent_mass,
            page_force: spec.page_force.map(|force| match force {
                PageForce::Reduced => PageForceFile::Reduced,
                PageForce::Off => PageForceFile::Off,
            }),
        }
    }
}

impl From<&DeviceSpecFile> for DeviceSpec {
    fn from(file: &DeviceSpecFile) -> DeviceSpec {
        DeviceSpec {
            name: file.name.clone(),
            max_force: file.max_force_n,
            continuous_force: file.continuous_force_n,
            max_torque: file.max_torque_nmm,
            max_stiffness: file.max_stiffness_n_per_mm,
            max_damping: file.max_damping_n_s_per_mm,
            resolution: file.resolution_mm,
            workspace_half: Vec3::from_array(file.workspace_half_mm),
            apparent_mass: file.apparent_mass_kg,
            page_force: file.page_force.map(|force| match force {
                PageForceFile::Reduced => PageForce::Reduced,
                PageForceFile::Off => PageForce::Off,
            }),
        }
    }
}

/// A message on `/event`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EventFile {
    /// Tick before whose step the event happened.
    pub tick: u64,
    #[serde(flatten)]
    pub what: EventKindFile,
}

/// Content of an event.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EventKindFile {
    /// Input of a person.
    Input(InputFile),
    /// Command applied to the simulation.
    Command(CommandFile),
    /// Command of a sealed session that would reveal a draw. A replay issues it again.
    SealedCommand {},
    StageStarted {
        stage: String,
    },
    StageEnded {
        stage: String,
        by: String,
    },
    StagesOver {},
    /// An input was refused.
    Refused {
        why: String,
    },
}

/// File form of [`Input`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum InputFile {
    Take { instrument: usize },
    AnswerWord { question: String, value: String },
    AnswerQuadrant { question: String, value: u8 },
    AnswerYesNo { question: String, value: bool },
    AnswerNumber { question: String, value: f64 },
    Adjust { label: u8, coefficient: CoefficientName, value: f32 },
    Chart { sign: ChartInputFile },
    Confirm {},
    Rate { item: String, value: u8 },
    Abort {},
    Look(ViewFile),
    PlaceHand(HandFrameFile),
    PressClutch { is_pressed: bool },
}

/// File form of [`HandFrame`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct HandFrameFile {
    pub world_from_device_xyzw: [f32; 4],
    pub scale: f32,
    /// Absent unless the hand is registered with the picture.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub middle_mm: Option<[f32; 3]>,
    /// Absent unless it is being registered.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub free: bool,
}

impl From<&HandFrame> for HandFrameFile {
    fn from(frame: &HandFrame) -> HandFrameFile {
        HandFrameFile {
            world_from_device_xyzw: frame.orientation.to_array(),
            scale: frame.scale,
            middle_mm: frame.middle.map(|middle| middle.to_array()),
            free: frame.is_free,
        }
    }
}

impl From<&HandFrameFile> for HandFrame {
    fn from(file: &HandFrameFile) -> HandFrame {
        HandFrame {
            orientation: Quat::from_array(file.world_from_device_xyzw),
            scale: file.scale,
            middle: file.middle_mm.map(Vec3::from_array),
            is_free: file.free,
        }
    }
}

/// File form of [`TraineeView`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ViewFile {
    pub eye_mm: [f32; 3],
    pub focus_mm: [f32; 3],
    pub up: [f32; 3],
    /// Half the width and half the height of the picture at a depth of 1 mm.
    pub half_extent: [f32; 2],
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mirror: Option<MirrorFaceFile>,
}

/// File form of [`MirrorFace`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MirrorFaceFile {
    pub centre_mm: [f32; 3],
    pub normal: [f32; 3],
    pub radius_mm: f32,
}

impl From<&TraineeView> for ViewFile {
    fn from(view: &TraineeView) -> ViewFile {
        ViewFile {
            eye_mm: view.eye.to_array(),
            focus_mm: view.focus.to_array(),
            up: view.up.to_array(),
            half_extent: view.half_extent,
            mirror: view.mirror.map(|face| MirrorFaceFile {
                centre_mm: face.centre.to_array(),
                normal: face.normal.to_array(),
                radius_mm: face.radius,
            }),
        }
    }
}

impl From<ViewFile> for TraineeView {
    fn from(file: ViewFile) -> TraineeView {
        TraineeView {
            eye: Vec3::from_array(file.eye_mm),
            focus: Vec3::from_array(file.focus_mm),
            up: Vec3::from_array(file.up),
            half_extent: file.half_extent,
            mirror: file.mirror.map(|face| MirrorFace {
                centre: Vec3::from_array(face.centre_mm),
                normal: Vec3::from_array(face.normal),
                radius: face.radius_mm,
            }),
        }
    }
}

/// File form of [`ChartInput`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ChartInputFile {
    Depth,
    Calculus,
}

impl From<&Input> for InputFile {
    fn from(input: &Input) -> InputFile {
        match input.clone() {
            Input::Take { instrument } => InputFile::Take { instrument },
            Input::Answer { question, value } => match value {
                AnswerValue::Word(value) => InputFile::AnswerWord { question, value },
                AnswerValue::Quadrant(value) => InputFile::AnswerQuadrant { question, value },
                AnswerValue::YesNo(value) => InputFile::AnswerYesNo { question, value },
                AnswerValue::Number(value) => InputFile::AnswerNumber { question, value },
            },
            Input::Adjust { label, coefficient, value } => {
                InputFile::Adjust { label: label.0, coefficient: coefficient.into(), value }
            }
            Input::Chart(ChartInput::Depth) => InputFile::Chart { sign: ChartInputFile::Depth },
            Input::Chart(ChartInput::Calculus) => InputFile::Chart { sign: ChartInputFile::Calculus },
            Input::Confirm => InputFile::Confirm {},
            Input::Rate { item, value } => InputFile::Rate { item, value },
            Input::Abort => InputFile::Abort {},
            Input::Look(view) => InputFile::Look(ViewFile::from(&view)),
            Input::PlaceHand(frame) => InputFile::PlaceHand(HandFrameFile::from(&frame)),
            Input::PressClutch(is_pressed) => InputFile::PressClutch { is_pressed },
        }
    }
}

impl From<InputFile> for Input {
    fn from(file: InputFile) -> Input {
        match file {
            InputFile::Take { instrument } => Input::Take { instrument },
            InputFile::AnswerWord { question, value } => Input::Answer { question, value: AnswerValue::Word(value) },
            InputFile::AnswerQuadrant { question, value } => {
                Input::Answer { question, value: AnswerValue::Quadrant(value) }
            }
            InputFile::AnswerYesNo { question, value } => Input::Answer { question, value: AnswerValue::YesNo(value) },
            InputFile::AnswerNumber { question, value } => {
                Input::Answer { question, value: AnswerValue::Number(value) }
            }
            InputFile::Adjust { label, coefficient, value } => {
                Input::Adjust { label: Label(label), coefficient: coefficient.into(), value }
            }
            InputFile::Chart { sign: ChartInputFile::Depth } => Input::Chart(ChartInput::Depth),
            InputFile::Chart { sign: ChartInputFile::Calculus } => Input::Chart(ChartInput::Calculus),
            InputFile::Confirm {} => Input::Confirm,
            InputFile::Rate { item, value } => Input::Rate { item, value },
            InputFile::Abort {} => Input::Abort,
            InputFile::Look(view) => Input::Look(TraineeView::from(view)),
            InputFile::PlaceHand(frame) => Input::PlaceHand(HandFrame::from(&frame)),
            InputFile::PressClutch { is_pressed } => Input::PressClutch(is_pressed),
        }
    }
}

/// File form of [`Command`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CommandFile {
    Take {
        instrument: usize,
    },
    /// Change of a stiffness. It has its own name because it is older than changes of other coefficients.
    SetStiffness {
        label: u8,
        stiffness: f32,
    },
    Set {
        label: u8,
        coefficient: CoefficientName,
        value: f32,
    },
    /// Properties of one tissue given to another.
    SetMaterial {
        label: u8,
        like: u8,
    },
    RunBur {
        running: bool,
    },
    Guide {
        guidance: Option<usize>,
    },
    Fill {
        label: Option<u8>,
    },
    PlaceHand(HandFrameFile),
    PressClutch {
        is_pressed: bool,
    },
}

impl From<&Command> for CommandFile {
    fn from(command: &Command) -> CommandFile {
        match *command {
            Command::SelectInstrument { instrument } => CommandFile::Take { instrument },
            Command::SetCoefficient { label, coefficient: Coefficient::Stiffness, value } => {
                CommandFile::SetStiffness { label: label.0, stiffness: value }
            }
            Command::SetCoefficient { label, coefficient, value } => {
                CommandFile::Set { label: label.0, coefficient: coefficient.into(), value }
            }
            Command::SetMaterial { label, like } => CommandFile::SetMaterial { label: label.0, like: like.0 },
            Command::RunBur { running } => CommandFile::RunBur { running },
            Command::SetGuidance { guidance } => CommandFile::Guide { guidance },
            Command::SetFilling { label } => CommandFile::Fill { label: label.map(|l| l.0) },
            Command::PlaceHand { frame } => CommandFile::PlaceHand(HandFrameFile::from(&frame)),
            Command::PressClutch { is_pressed } => CommandFile::PressClutch { is_pressed },
        }
    }
}

impl From<&CommandFile> for Command {
    fn from(file: &CommandFile) -> Command {
        match *file {
            CommandFile::Take { instrument } => Command::SelectInstrument { instrument },
            CommandFile::SetStiffness { label, stiffness } => {
                Command::SetCoefficient { label: Label(label), coefficient: Coefficient::Stiffness, value: stiffness }
            }
            CommandFile::Set { label, coefficient, value } => {
                Command::SetCoefficient { label: Label(label), coefficient: coefficient.into(), value }
            }
            CommandFile::SetMaterial { label, like } => Command::SetMaterial { label: Label(label), like: Label(like) },
            CommandFile::RunBur { running } => Command::RunBur { running },
            CommandFile::Guide { guidance } => Command::SetGuidance { guidance },
            CommandFile::Fill { label } => Command::SetFilling { label: label.map(Label) },
            CommandFile::PlaceHand(ref frame) => Command::PlaceHand { frame: HandFrame::from(frame) },
            CommandFile::PressClutch { is_pressed } => Command::PressClutch { is_pressed },
        }
    }
}

/// A message on `/digest`: the running digest.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DigestFile {
    /// Number of ticks covered.
    pub tick: u64,
    /// SHA-256 over the head, the attachments, all tick messages, all events and all changed voxels so far; the last
    /// digest also covers the end metadata. Hexadecimal.
    pub sha256: String,
}

/// Returns the name of a stage's end as written in recordings and results.
pub fn ended_by_name(by: EndedBy) -> &'static str {
    match by {
        EndedBy::Time => "time",
        EndedBy::Answer => "answer",
        EndedBy::Confirmation => "confirmation",
        EndedBy::Cleared => "cleared",
        EndedBy::Abort => "abort",
    }
}
