//! The parts of a recording that are text. Readers tolerate additions.

use crate::content::CoefficientName;
use crate::device::Spec;
use crate::frame::Vec3;
use crate::scenario::Scenario;
use crate::session::{Answer, EndedBy, Input, Kept, Sign};
use crate::sim::{Command, Simulation};
use crate::tick::TICK_S;
use crate::touch::Coefficient;
use crate::volume::Label;
use core::time::Duration;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Version of the recording's format. A reader refuses a newer one, and turns an older one as its program did:
/// 1 had no torque, no ramp at the start of touch and no second hand.
pub const VERSION: u32 = 2;

/// Names of the metadata records: what is known before the first tick, and after the last.
pub(super) const HEAD: &str = "session";
pub(super) const END: &str = "end";

/// What is known before the first tick.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct HeadFile {
    pub version: u32,
    pub typodont_version: String,
    pub scenario_id: String,
    pub scenario_sha256: String,
    /// A code, never a name.
    pub participant: String,
    pub seed: u64,
    /// Length of a tick, s.
    pub tick_s: f64,
    /// When the session began, RFC 3339; for people, not for the score.
    pub started: String,
    /// Who moved the hand, if it was a script.
    pub operator: Option<String>,
    /// A person moved it: the session listened to the servo from another thread, and a command was carried out some ticks
    /// after it was given.
    #[serde(default)]
    pub live: bool,
    pub device: SpecFile,
    /// SHA-256 of what the session was made from, by name.
    pub digests: BTreeMap<String, String>,
}

impl HeadFile {
    /// The head of a session that this program runs; whose it is, who plays and when it begins are left blank.
    pub fn of(scenario: &Scenario, device: &Spec, seed: u64) -> HeadFile {
        HeadFile {
            version: VERSION,
            typodont_version: env!("CARGO_PKG_VERSION").to_string(),
            scenario_id: scenario.id.clone(),
            scenario_sha256: scenario.sha256.clone(),
            participant: String::new(),
            seed,
            tick_s: TICK_S,
            started: String::new(),
            operator: None,
            live: false,
            device: SpecFile::from(device),
            digests: BTreeMap::new(),
        }
    }
}

/// What is known after the last tick.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EndFile {
    /// "complete", or why the session ended before its time.
    pub reason: String,
    pub servo: ServoFile,
}

/// How well the beat was kept, µs. A headless run has no clock to be late by.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ServoFile {
    pub ticks: u64,
    #[serde(default)]
    pub late_p50_us: Option<f64>,
    pub late_p99_us: Option<f64>,
    pub late_max_us: Option<f64>,
    /// Longest work of a tick.
    #[serde(default)]
    pub work_max_us: Option<f64>,
    /// Beats that never came.
    pub missed: u64,
    /// Ticks that the session never heard of; with any, the recording is not whole.
    pub dropped: u64,
    /// Times the hand was let go because a beat came too late.
    #[serde(default)]
    pub let_go: u64,
    /// Times the device was gone or not ready in the middle; time stood still.
    #[serde(default)]
    pub interruptions: u64,
    /// Times a person let time stand still.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub pauses: u64,
    /// Readings refused and forces that were not finite.
    pub faults: u64,
    /// Forces shortened to the device's limit.
    pub clamped: u64,
}

/// Left out of files, as recordings before it had none.
fn is_zero(count: &u64) -> bool {
    *count == 0
}

impl ServoFile {
    /// What a live session leaves.
    pub fn of_live(kept: &Kept) -> ServoFile {
        let Kept { ticks, gate, beats, interruptions, pauses } = kept;
        let beats = beats.unwrap_or_default();
        let us = |d: Duration| Some(d.as_secs_f64() * 1e6);
        ServoFile {
            ticks: *ticks,
            late_p50_us: us(beats.late_p50),
            late_p99_us: us(beats.late_p99),
            late_max_us: us(beats.late_max),
            work_max_us: us(beats.work_max),
            missed: beats.missed,
            dropped: beats.dropped,
            let_go: beats.let_go,
            interruptions: *interruptions,
            pauses: *pauses,
            faults: gate.faults(),
            clamped: gate.clamped_forces,
        }
    }

    /// What a simulation counts itself, without any beat.
    pub fn of(simulation: &Simulation) -> ServoFile {
        let gate = simulation.gate();
        let (ticks, faults, clamped) = (simulation.tick().0, gate.faults(), gate.clamped_forces);
        ServoFile { ticks, faults, clamped, ..ServoFile::default() }
    }

    /// True when the simulations counted the same, however their beats were kept.
    pub fn counts_like(&self, other: &ServoFile) -> bool {
        (self.ticks, self.faults, self.clamped) == (other.ticks, other.faults, other.clamped)
    }
}

/// A device's spec with its units.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SpecFile {
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
}

impl From<&Spec> for SpecFile {
    fn from(spec: &Spec) -> SpecFile {
        SpecFile {
            name: spec.name.clone(),
            max_force_n: spec.max_force,
            continuous_force_n: spec.continuous_force,
            max_torque_nmm: spec.max_torque,
            max_stiffness_n_per_mm: spec.max_stiffness,
            max_damping_n_s_per_mm: spec.max_damping,
            resolution_mm: spec.resolution,
            workspace_half_mm: spec.workspace_half.to_array(),
            apparent_mass_kg: spec.apparent_mass,
        }
    }
}

impl From<&SpecFile> for Spec {
    fn from(file: &SpecFile) -> Spec {
        Spec {
            name: file.name.clone(),
            max_force: file.max_force_n,
            continuous_force: file.continuous_force_n,
            max_torque: file.max_torque_nmm,
            max_stiffness: file.max_stiffness_n_per_mm,
            max_damping: file.max_damping_n_s_per_mm,
            resolution: file.resolution_mm,
            workspace_half: Vec3::from_array(file.workspace_half_mm),
            apparent_mass: file.apparent_mass_kg,
        }
    }
}

/// A message on `/event`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EventFile {
    /// Before the step of this tick.
    pub tick: u64,
    #[serde(flatten)]
    pub what: WhatFile,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum WhatFile {
    /// What a person did.
    Input(InputFile),
    /// What the simulation was told.
    Command(CommandFile),
    StageStarted {
        stage: String,
    },
    StageEnded {
        stage: String,
        by: String,
    },
    StagesOver {},
    /// An input that did not fit.
    Refused {
        why: String,
    },
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum InputFile {
    Take { instrument: usize },
    AnswerWord { question: String, value: String },
    AnswerQuadrant { question: String, value: u8 },
    AnswerYesNo { question: String, value: bool },
    AnswerNumber { question: String, value: f64 },
    Adjust { label: u8, coefficient: CoefficientName, value: f32 },
    Chart { sign: SignFile },
    Confirm {},
    Rate { item: String, value: u8 },
    Abort {},
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SignFile {
    Depth,
    Calculus,
}

impl From<&Input> for InputFile {
    fn from(input: &Input) -> InputFile {
        match input.clone() {
            Input::Take { instrument } => InputFile::Take { instrument },
            Input::Answer { question, value } => match value {
                Answer::Word(value) => InputFile::AnswerWord { question, value },
                Answer::Quadrant(value) => InputFile::AnswerQuadrant { question, value },
                Answer::YesNo(value) => InputFile::AnswerYesNo { question, value },
                Answer::Number(value) => InputFile::AnswerNumber { question, value },
            },
            Input::Adjust { label, coefficient, value } => {
                InputFile::Adjust { label: label.0, coefficient: coefficient.into(), value }
            }
            Input::Chart(Sign::Depth) => InputFile::Chart { sign: SignFile::Depth },
            Input::Chart(Sign::Calculus) => InputFile::Chart { sign: SignFile::Calculus },
            Input::Confirm => InputFile::Confirm {},
            Input::Rate { item, value } => InputFile::Rate { item, value },
            Input::Abort => InputFile::Abort {},
        }
    }
}

impl From<InputFile> for Input {
    fn from(file: InputFile) -> Input {
        match file {
            InputFile::Take { instrument } => Input::Take { instrument },
            InputFile::AnswerWord { question, value } => Input::Answer { question, value: Answer::Word(value) },
            InputFile::AnswerQuadrant { question, value } => Input::Answer { question, value: Answer::Quadrant(value) },
            InputFile::AnswerYesNo { question, value } => Input::Answer { question, value: Answer::YesNo(value) },
            InputFile::AnswerNumber { question, value } => Input::Answer { question, value: Answer::Number(value) },
            InputFile::Adjust { label, coefficient, value } => {
                Input::Adjust { label: Label(label), coefficient: coefficient.into(), value }
            }
            InputFile::Chart { sign: SignFile::Depth } => Input::Chart(Sign::Depth),
            InputFile::Chart { sign: SignFile::Calculus } => Input::Chart(Sign::Calculus),
            InputFile::Confirm {} => Input::Confirm,
            InputFile::Rate { item, value } => Input::Rate { item, value },
            InputFile::Abort {} => Input::Abort,
        }
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CommandFile {
    Take {
        instrument: usize,
    },
    /// A stiffness has its own name since before other coefficients could change.
    SetStiffness {
        label: u8,
        stiffness: f32,
    },
    Set {
        label: u8,
        coefficient: CoefficientName,
        value: f32,
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
}

impl From<&Command> for CommandFile {
    fn from(command: &Command) -> CommandFile {
        match *command {
            Command::Take { instrument } => CommandFile::Take { instrument },
            Command::Set { label, coefficient: Coefficient::Stiffness, value } => {
                CommandFile::SetStiffness { label: label.0, stiffness: value }
            }
            Command::Set { label, coefficient, value } => {
                CommandFile::Set { label: label.0, coefficient: coefficient.into(), value }
            }
            Command::RunBur { running } => CommandFile::RunBur { running },
            Command::Guide { guidance } => CommandFile::Guide { guidance },
            Command::Fill { label } => CommandFile::Fill { label: label.map(|l| l.0) },
        }
    }
}

impl From<&CommandFile> for Command {
    fn from(file: &CommandFile) -> Command {
        match *file {
            CommandFile::Take { instrument } => Command::Take { instrument },
            CommandFile::SetStiffness { label, stiffness } => {
                Command::Set { label: Label(label), coefficient: Coefficient::Stiffness, value: stiffness }
            }
            CommandFile::Set { label, coefficient, value } => {
                Command::Set { label: Label(label), coefficient: coefficient.into(), value }
            }
            CommandFile::RunBur { running } => Command::RunBur { running },
            CommandFile::Guide { guidance } => Command::Guide { guidance },
            CommandFile::Fill { label } => Command::Fill { label: label.map(Label) },
        }
    }
}

/// A message on `/digest`: everything up to this tick in one number.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DigestFile {
    pub tick: u64,
    /// SHA-256 over all readings and forces, all events and all changed voxels so far, hexadecimal.
    pub sha256: String,
}

/// The name of an end in results.
pub fn ended_by_name(by: EndedBy) -> &'static str {
    match by {
        EndedBy::Time => "time",
        EndedBy::Answer => "answer",
        EndedBy::Confirmation => "confirmation",
        EndedBy::Cleared => "cleared",
        EndedBy::Abort => "abort",
    }
}
