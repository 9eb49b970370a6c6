//! The grade of a session that is run in memory, and of one in which nothing was done.
//!
//! Takes an exercise, its workpiece and a trainee. Gives the trainee's grade; of an idle trainee, the points that the
//! rubric pays for absence: of contact, of force, of cuts. Never guesses: the session is recorded in memory and scored
//! like any other.

use super::{Grade, Scored};
use crate::record::{Recording, RecordingEndFile, RecordingHeadFile, ReplayCheck, ServoStatsFile, TickRecord};
use crate::scenario::{Scenario, Workpiece};
use crate::session::{self, Effect, Input, Observer, Session, Trainee};
use std::convert::Infallible;
use std::sync::Arc;
use typodont_core::device::{Device, DeviceError, DeviceSpec, Reading, Wrench};
use typodont_core::frame::Vec3;
use typodont_core::sim::{Command, Simulation, Step};
use typodont_core::tick::Tick;
use typodont_core::volume::Edit;

/// Height at which the idle hand rests, world space, mm: above any tooth.
const REST_MM: f32 = 20.0;

/// Number of ticks that each stage lasts before it is confirmed.
const STAGE_TICKS: u64 = 100;

/// Returns the grade of a trainee who touches nothing and confirms every stage at once; `None` without a rubric.
///
/// A stage that cannot be confirmed ends the session early: waiting for its time limit would earn nothing more.
///
/// # Errors
/// Returns a message if the workpiece does not fit the scenario.
pub fn idle_grade(scenario: &Arc<Scenario>, workpiece: &Workpiece, seed: u64) -> Result<Option<Grade>, String> {
    if scenario.rubric.is_none() {
        return Ok(None);
    }
    let trainee = IdleTrainee { spec: DeviceSpec::phantom_omni(), stage: None, ticks: 0 };
    Ok(score_trainee(scenario, workpiece, seed, trainee)?.grade)
}

/// Runs a session in memory and scores it.
///
/// # Errors
/// Returns a message if the workpiece does not fit the scenario.
pub fn score_trainee(
    scenario: &Arc<Scenario>,
    workpiece: &Workpiece,
    seed: u64,
    mut trainee: impl Trainee,
) -> Result<Scored, String> {
    let spec = trainee.spec().clone();
    let head = RecordingHeadFile::of(scenario, &spec, seed);
    let mut simulation = Simulation::new(session::setup(scenario, workpiece, spec));
    let mut session = Session::new(scenario.clone(), workpiece);
    let mut log = SessionLog::default();
    let Ok(_) = session::run(&mut session, &mut simulation, &mut trainee, &mut log);
    let end = RecordingEndFile { reason: "complete".into(), servo: ServoStatsFile::of(&simulation) };
    let mut recording = Recording::unverified(head, scenario.clone(), workpiece);
    recording.end = Some(end);
    recording.ticks = log.ticks;
    recording.inputs = log.inputs;
    recording.commands = log.commands;
    super::score(&recording, ReplayCheck::Skip)
}

/// A trainee whose hand rests above the teeth.
struct IdleTrainee {
    spec: DeviceSpec,
    /// Index of the current stage.
    stage: Option<usize>,
    /// Ticks since the stage began.
    ticks: u64,
}

impl Device for IdleTrainee {
    fn spec(&self) -> &DeviceSpec {
        &self.spec
    }

    fn exchange(&mut self, _output: &Wrench) -> Result<Reading, DeviceError> {
        Ok(Reading::at(Vec3::Y * REST_MM))
    }
}

impl Trainee for IdleTrainee {
    fn respond(&mut self, session: &Session, _screen: Option<&Step>) -> Vec<Input> {
        let Some((index, stage)) = session.stage() else { return Vec::new() };
        if self.stage != Some(index) {
            (self.stage, self.ticks) = (Some(index), 0);
        }
        self.ticks += 1;
        match self.ticks {
            STAGE_TICKS if stage.ends.confirmed => vec![Input::Confirm],
            // A confirmation may be refused, for example before a question is answered.
            ticks if ticks >= STAGE_TICKS => vec![Input::Abort],
            _ => Vec::new(),
        }
    }
}

/// Everything that a recording needs of a session.
#[derive(Default)]
struct SessionLog {
    ticks: Vec<TickRecord>,
    inputs: Vec<(Tick, Input)>,
    commands: Vec<(Tick, Option<Command>)>,
}

impl Observer for SessionLog {
    type Error = Infallible;

    fn input(&mut self, tick: Tick, input: &Input) -> Result<(), Infallible> {
        self.inputs.push((tick, input.clone()));
        Ok(())
    }

    fn command(&mut self, tick: Tick, command: &Command) -> Result<(), Infallible> {
        self.commands.push((tick, Some(*command)));
        Ok(())
    }

    fn effect(&mut self, _: Tick, _: &Effect, _: &Session) -> Result<(), Infallible> {
        Ok(())
    }

    fn tick_completed(&mut self, reading: &Reading, step: &Step, _: &[Edit]) -> Result<(), Infallible> {
        self.ticks.push(TickRecord::of(reading, step));
        Ok(())
    }
}
