//! A session with a person in it: the servo turns the world, the session listens a few milliseconds behind.
//!
//! Takes a device and what the person says. Gives what is to be shown, and tells an observer everything in the order in
//! which a replay will turn it: a command stands before the tick before which the servo carried it out, which may be later
//! than the one for which the session gave it.

use super::{Effect, Event, Input, Observer, Session};
use crate::device::realtime::Priority;
use crate::device::{Device, Gone, Spec, State};
use crate::sim::{BeatSummary, Beats, Command, Ended, Letter, Order, Second, Servo, Simulation, Step, Turn};
use crate::tick::Tick;
use crate::touch::Gate;
use crate::volume::Edit;
use std::collections::VecDeque;

/// Ticks that a command may lie between being given and being carried out: as many letters as wait for a session's thread.
pub const COMMAND_LAG_TICKS: u64 = 1 << 14;

/// Something to show or to say.
#[derive(Clone, Debug, PartialEq)]
pub enum Heard {
    /// The servo has begun to turn, with this priority.
    Begun(Priority),
    Effect(Effect),
    /// The device is in another state; unless it is ready, time stands still.
    Device(State),
    /// The device is gone and time stands still, until [`Live::go_on`].
    Gone(Gone),
}

/// A live session's servo and what lies between it and the session.
pub struct Live {
    at_work: Work,
    /// The tick that comes next in the recording.
    tick: Tick,
    /// Commands given and not carried out yet.
    given: VecDeque<Command>,
    edits: Vec<Edit>,
    gate: Gate,
    screen: Option<Step>,
    buttons: u32,
    interruptions: u64,
    pauses: u64,
    /// What the recording's head says of the device.
    spec: Spec,
    is_paused: bool,
    was_ready: bool,
    /// How the beats went, once nothing turns any more.
    kept_beats: Option<BeatSummary>,
}

/// Who has the simulation.
enum Work {
    Servo(Servo),
    /// Nobody turns it: the device is gone.
    Waiting(Box<Left>),
    Over,
}

/// What goes on with the next servo.
struct Left {
    simulation: Simulation,
    second: Option<Second>,
    beats: Beats,
}

impl From<Ended> for Left {
    fn from(ended: Ended) -> Left {
        let Ended { simulation, second, beats, .. } = ended;
        Left { simulation, second, beats }
    }
}

/// What a live session leaves: how its beat was kept, and what the gates changed in what was recorded.
#[derive(Clone, Debug)]
pub struct Kept {
    pub ticks: u64,
    pub gate: Gate,
    pub beats: Option<BeatSummary>,
    /// Times the device was gone or not ready in the middle.
    pub interruptions: u64,
    /// Times a person let time stand still.
    pub pauses: u64,
}

/// Why a live session cannot go on.
#[derive(Debug)]
pub enum Broken<E> {
    /// The observer failed: nothing more can be recorded.
    Observer(E),
    /// The servo failed, or could not be started.
    Servo(String),
}

impl<E> From<E> for Broken<E> {
    fn from(error: E) -> Broken<E> {
        Broken::Observer(error)
    }
}

impl Live {
    /// Begins a session and starts the servo.
    pub fn begin<O: Observer>(
        session: &mut Session,
        mut simulation: Simulation,
        device: Box<dyn Device + Send>,
        second: Option<Second>,
        observer: &mut O,
    ) -> Result<(Live, Vec<Heard>), Broken<O::Error>> {
        let mut live = Live {
            at_work: Work::Over,
            tick: Tick::ZERO,
            given: VecDeque::new(),
            edits: Vec::new(),
            gate: Gate::default(),
            screen: None,
            buttons: 0,
            interruptions: 0,
            pauses: 0,
            spec: device.spec().clone(),
            is_paused: false,
            was_ready: false,
            kept_beats: None,
        };
        let mut heard = Vec::new();
        for effect in session.begin() {
            if let Effect::Tell(command) = &effect {
                // Nothing turns yet: what the first stage begins with is in force from the first tick on.
                observer.command(live.tick, command)?;
                simulation.apply(command);
            }
            observer.effect(live.tick, &effect, session)?;
            heard.push(Heard::Effect(effect));
        }
        live.start(simulation, device, second, Beats::default())?;
        Ok((live, heard))
    }

    fn start<E>(
        &mut self,
        simulation: Simulation,
        device: Box<dyn Device + Send>,
        second: Option<Second>,
        beats: Beats,
    ) -> Result<(), Broken<E>> {
        let mut servo = Servo::start(simulation, device, second, beats).map_err(Broken::Servo)?;
        if self.is_paused {
            servo.order(Order::Pause);
        }
        for command in &self.given {
            servo.order(Order::Command(*command));
        }
        self.at_work = Work::Servo(servo);
        Ok(())
    }

    /// Goes on after the device was gone. False when this is another device than the session began with: what a spring may be
    /// and what the recording says of it would not be true any more.
    pub fn go_on<O: Observer>(&mut self, device: Box<dyn Device + Send>) -> Result<bool, Broken<O::Error>> {
        if *device.spec() != self.spec {
            return Ok(false);
        }
        match std::mem::replace(&mut self.at_work, Work::Over) {
            Work::Waiting(left) => {
                let Left { simulation, second, beats } = *left;
                self.start(simulation, device, second, beats).map(|()| true)
            }
            other => {
                self.at_work = other;
                Ok(true)
            }
        }
    }

    /// Hears everything the servo did since last asked.
    pub fn listen<O: Observer>(
        &mut self,
        session: &mut Session,
        observer: &mut O,
    ) -> Result<Vec<Heard>, Broken<O::Error>> {
        let mut heard = Vec::new();
        // Asked before the letters are fetched: a servo that has ended posts no more of them.
        let has_ended = self.servo().is_some_and(|servo| servo.has_ended());
        while !session.are_stages_over() {
            let Some(letter) = self.servo_mut().and_then(Servo::next_letter) else { break };
            match letter {
                Letter::Begun(priority) => heard.push(Heard::Begun(priority)),
                Letter::Commanded(_, command) => {
                    self.given.pop_front();
                    observer.command(self.tick, &command)?;
                }
                Letter::Turned(turn) => self.turned(&turn, session, observer, &mut heard)?,
                Letter::Device(state) => {
                    self.ready(state.is_ready());
                    heard.push(Heard::Device(state));
                }
            }
        }
        if session.are_stages_over() {
            // Only the questionnaire may be left: the hand is free and time stands still.
            self.rest()?;
        } else if has_ended && let Some(ended) = self.stop()? {
            self.ready(false);
            heard.push(Heard::Gone(ended.gone.unwrap_or(Gone::Ended)));
            self.at_work = Work::Waiting(Box::new(Left::from(ended)));
        }
        Ok(heard)
    }

    /// Being away is one interruption, however many states it goes through.
    fn ready(&mut self, is_ready: bool) {
        self.interruptions += u64::from(self.was_ready && !is_ready);
        self.was_ready = is_ready;
    }

    fn turned<O: Observer>(
        &mut self,
        turn: &Turn,
        session: &mut Session,
        observer: &mut O,
        heard: &mut Vec<Heard>,
    ) -> Result<(), Broken<O::Error>> {
        if turn.step.tick != self.tick {
            let lost =
                "ticks were lost because this machine stood still for too long; what was recorded up to then is kept";
            return Err(Broken::Servo(lost.into()));
        }
        let mut edits = std::mem::take(&mut self.edits);
        edits.clear();
        if let Some(servo) = self.servo_mut() {
            servo.take_edits(turn, &mut edits);
        }
        observer.turned(&turn.reading, &turn.step, &edits)?;
        (self.tick, self.gate) = (turn.step.tick.next(), turn.gate);
        (self.screen, self.buttons) = (Some(turn.step), turn.reading.buttons);
        let effects = session.advance(Event::Tick { step: &turn.step, edits: &edits });
        self.edits = edits;
        self.carry_out(effects, session, observer, heard)
    }

    /// What the person says, as of the last tick that was heard.
    pub fn say<O: Observer>(
        &mut self,
        input: &Input,
        session: &mut Session,
        observer: &mut O,
    ) -> Result<Vec<Heard>, Broken<O::Error>> {
        let mut heard = Vec::new();
        observer.input(self.tick, input)?;
        let effects = session.advance(Event::Input(input));
        self.carry_out(effects, session, observer, &mut heard)?;
        Ok(heard)
    }

    fn carry_out<O: Observer>(
        &mut self,
        effects: Vec<Effect>,
        session: &Session,
        observer: &mut O,
        heard: &mut Vec<Heard>,
    ) -> Result<(), Broken<O::Error>> {
        for effect in effects {
            if let Effect::Tell(command) = &effect {
                self.given.push_back(*command);
                if session.are_stages_over() {
                    // Nothing that is turned from here on is recorded: what was given last is in force at the end.
                    for command in self.given.drain(..) {
                        observer.command(self.tick, &command)?;
                    }
                } else if let Some(servo) = self.servo_mut() {
                    servo.order(Order::Command(*command));
                }
            }
            observer.effect(self.tick, &effect, session)?;
            heard.push(Heard::Effect(effect));
        }
        Ok(())
    }

    /// Lets time stand still and the hand go, or ends that.
    pub fn pause(&mut self, is_paused: bool) {
        self.pauses += u64::from(is_paused && !self.is_paused);
        self.is_paused = is_paused;
        if let Some(servo) = self.servo_mut() {
            servo.order(if is_paused { Order::Pause } else { Order::Resume });
        }
    }

    /// The newest tick that was heard.
    pub fn screen(&self) -> Option<&Step> {
        self.screen.as_ref()
    }

    /// Buttons as of that tick.
    pub fn buttons(&self) -> u32 {
        self.buttons
    }

    /// True when the device is gone and somebody should look for it again.
    pub fn is_waiting(&self) -> bool {
        matches!(self.at_work, Work::Waiting(_))
    }

    /// How the beats go.
    pub fn beats(&self) -> Option<BeatSummary> {
        match &self.at_work {
            Work::Servo(servo) => servo.beats(),
            Work::Waiting(left) => Some(left.beats.summary()),
            Work::Over => self.kept_beats,
        }
    }

    /// Stops the servo and lets the hand go.
    pub fn end<O: Observer>(mut self) -> Result<Kept, Broken<O::Error>> {
        self.rest()?;
        let beats = self.beats();
        let Live { tick, gate, interruptions, pauses, .. } = self;
        Ok(Kept { ticks: tick.0, gate, beats, interruptions, pauses })
    }

    fn rest<E>(&mut self) -> Result<(), Broken<E>> {
        if let Some(ended) = self.stop()? {
            self.kept_beats = Some(ended.beats.summary());
        }
        Ok(())
    }

    fn stop<E>(&mut self) -> Result<Option<Ended>, Broken<E>> {
        match std::mem::replace(&mut self.at_work, Work::Over) {
            Work::Servo(servo) => servo.stop().map(Some).map_err(Broken::Servo),
            other => {
                self.at_work = other;
                Ok(None)
            }
        }
    }

    fn servo(&self) -> Option<&Servo> {
        if let Work::Servo(servo) = &self.at_work { Some(servo) } else { None }
    }

    fn servo_mut(&mut self) -> Option<&mut Servo> {
        if let Work::Servo(servo) = &mut self.at_work { Some(servo) } else { None }
    }
}
