//! The loop that runs one session from its first tick to its last, at the pace of the trainee's device.
//!
//! Takes a session, a simulation, a trainee and an observer. Gives the reason for the end of the run. Never reads a
//! clock.

use crate::session::{Effect, Input, Session, SessionEvent};
use typodont_core::device::{Device, DeviceError, Reading, Wrench};
use typodont_core::sim::{Command, Simulation, Step};
use typodont_core::tick::Tick;
use typodont_core::volume::Edit;

/// A source of hand motion and inputs: a person at the screen, a script or a recording.
pub trait Trainee: Device {
    /// Receives the edits of the last tick, as the display shows them.
    fn observe_edits(&mut self, _edits: &[Edit]) {}

    /// Returns the inputs to be given before the step of this tick. `screen` is the latest completed tick, which the
    /// display shows; `None` before the first.
    fn respond(&mut self, session: &Session, screen: Option<&Step>) -> Vec<Input>;
}

/// Receiver of everything that happens in a session, such as a recorder or a progress bar.
///
/// The calls of a tick come in this order: inputs, commands, completed tick.
pub trait Observer {
    type Error;

    /// Receives an input given before `tick`.
    fn input(&mut self, tick: Tick, input: &Input) -> Result<(), Self::Error>;
    /// Receives a command applied to the simulation before `tick`.
    fn command(&mut self, tick: Tick, command: &Command) -> Result<(), Self::Error>;
    /// Receives an effect of the session, commands included.
    fn effect(&mut self, tick: Tick, effect: &Effect, session: &Session) -> Result<(), Self::Error>;
    /// Receives a completed tick with its reading and its edits.
    fn tick_completed(&mut self, reading: &Reading, step: &Step, edits: &[Edit]) -> Result<(), Self::Error>;
}

/// Reason for the end of a run.
#[derive(Clone, Debug, PartialEq)]
pub enum RunEnd {
    /// All stages are over, and the questionnaire is complete or no more ratings were given.
    Complete,
    /// The trainee's device stopped giving readings.
    DeviceGone(DeviceError),
}

/// Runs a session to its end. The trainee's device determines the duration of a tick.
///
/// # Errors
/// Returns the first error of the observer.
pub fn run<O: Observer>(
    session: &mut Session,
    simulation: &mut Simulation,
    trainee: &mut impl Trainee,
    observer: &mut O,
) -> Result<RunEnd, O::Error> {
    let mut tick = Tick::ZERO;
    let mut output = Wrench::default();
    let mut screen = None;
    let effects = session.begin();
    carry_out(&effects, tick, session, simulation, observer)?;
    loop {
        let inputs = trainee.respond(session, screen.as_ref());
        for input in &inputs {
            observer.input(tick, input)?;
            let effects = session.advance(SessionEvent::Input(input));
            carry_out(&effects, tick, session, simulation, observer)?;
        }
        if session.are_stages_over() {
            // Only the questionnaire can remain. No tick is run for it, so a trainee without further input is done.
            match session.is_complete() || inputs.is_empty() {
                true => return Ok(RunEnd::Complete),
                false => continue,
            }
        }
        let reading = match trainee.exchange(&output) {
            Ok(reading) => reading,
            Err(gone) => return Ok(RunEnd::DeviceGone(gone)),
        };
        let step = simulation.step(&reading);
        output = step.wrench();
        trainee.observe_edits(simulation.edits());
        observer.tick_completed(&reading, &step, simulation.edits())?;
        tick = step.tick.next();
        screen = Some(step);
        let effects = session.advance(SessionEvent::Tick { step: &step, edits: simulation.edits() });
        carry_out(&effects, tick, session, simulation, observer)?;
    }
}

fn carry_out<O: Observer>(
    effects: &[Effect],
    tick: Tick,
    session: &Session,
    simulation: &mut Simulation,
    observer: &mut O,
) -> Result<(), O::Error> {
    for effect in effects {
        if let Effect::Command(command) = effect {
            observer.command(tick, command)?;
            simulation.apply(command);
        }
        observer.effect(tick, effect, session)?;
    }
    Ok(())
}
