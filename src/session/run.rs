//! One session from its first tick to its last, as fast as its trainee turns it.

use super::{Effect, Event, Input, Session};
use crate::device::{Device, Gone, Output, Reading};
use crate::sim::{Command, Simulation, Step};
use crate::tick::Tick;
use crate::volume::Edit;

/// Someone who moves a device and answers: a person at the screen, a script, a recording.
pub trait Trainee: Device {
    /// What changed in the last tick, as the picture shows it.
    fn watch(&mut self, _edits: &[Edit]) {}

    /// What they do besides moving, before the step of this tick. `screen` is the tick they see, if there was one.
    fn respond(&mut self, session: &Session, screen: Option<&Step>) -> Vec<Input>;
}

/// Someone who watches a session: a recorder, a progress bar.
///
/// Every tick's calls come in this order: inputs, commands, then the turned tick.
pub trait Observer {
    type Error;

    fn input(&mut self, tick: Tick, input: &Input) -> Result<(), Self::Error>;
    fn command(&mut self, tick: Tick, command: &Command) -> Result<(), Self::Error>;
    fn effect(&mut self, tick: Tick, effect: &Effect, session: &Session) -> Result<(), Self::Error>;
    fn turned(&mut self, reading: &Reading, step: &Step, edits: &[Edit]) -> Result<(), Self::Error>;
}

/// How a run ended.
#[derive(Clone, Debug, PartialEq)]
pub enum Progress {
    /// All stages are over, and whoever was asked for more has said all they wanted to.
    Complete,
    /// The trainee's device gave no more readings.
    DeviceGone(Gone),
}

/// Runs a session to its end; the time of a tick is the device's affair.
pub fn run<O: Observer>(
    session: &mut Session,
    simulation: &mut Simulation,
    trainee: &mut impl Trainee,
    observer: &mut O,
) -> Result<Progress, O::Error> {
    let mut tick = Tick::ZERO;
    let mut output = Output::default();
    let mut screen = None;
    let effects = session.begin();
    carry_out(&effects, tick, session, simulation, observer)?;
    loop {
        let inputs = trainee.respond(session, screen.as_ref());
        for input in &inputs {
            observer.input(tick, input)?;
            let effects = session.advance(Event::Input(input));
            carry_out(&effects, tick, session, simulation, observer)?;
        }
        if session.are_stages_over() {
            // Only the questionnaire may be left: the hand is free and time stands still. Who says nothing more is done.
            match session.is_complete() || inputs.is_empty() {
                true => return Ok(Progress::Complete),
                false => continue,
            }
        }
        let reading = match trainee.exchange(&output) {
            Ok(reading) => reading,
            Err(gone) => return Ok(Progress::DeviceGone(gone)),
        };
        let step = simulation.step(&reading);
        output = step.output();
        trainee.watch(simulation.edits());
        observer.turned(&reading, &step, simulation.edits())?;
        tick = step.tick.next();
        screen = Some(step);
        let effects = session.advance(Event::Tick { step: &step, edits: simulation.edits() });
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
        if let Effect::Tell(command) = effect {
            observer.command(tick, command)?;
            simulation.apply(command);
        }
        observer.effect(tick, effect, session)?;
    }
    Ok(())
}
