//! A live session: the servo steps the simulation, and the session follows a few milliseconds behind.
//!
//! Takes a device and the person's inputs. Gives events to show, and passes everything to an observer in the order of a
//! replay: a command comes before the tick before which the servo executed it, which may be later than the tick for
//! which the session issued it.

use core::time::Duration;
use std::collections::VecDeque;
use std::fmt;
use typodont_core::device::{Device, DeviceError, DeviceSpec, DeviceState, Reading};
use typodont_core::sim::{Command, Simulation, Step};
use typodont_core::tick::Tick;
use typodont_core::touch::Gate;
use typodont_core::volume::Edit;
use typodont_devices::realtime::Priority;
use typodont_devices::servo::{
    AssistantTool, SecondHandLink, Servo, ServoCommand, ServoEvent, ServoExit, TickReport, TimingStats, TimingSummary,
};
use typodont_exercise::record::ServoStatsFile;
use typodont_exercise::scenario::Stage;
use typodont_exercise::session::{Effect, Input, Observer, Session, SessionEvent};

/// Event to show to the person.
#[derive(Clone, Debug, PartialEq)]
pub enum LiveEvent {
    /// The servo has started, with this priority.
    ServoStarted(Priority),
    Effect(Effect),
    /// The state of the device has changed; unless the device is ready, the simulation is paused.
    DeviceState(DeviceState),
    /// The device was disconnected; the simulation is paused until [`LiveSession::resume_with`].
    DeviceLost(DeviceError),
    /// The clock is stopped until the device moves, or (false) it runs.
    AwaitingMovement(bool),
}

/// The servo of a live session, and its connection to the [`Session`].
pub struct LiveSession {
    state: LiveState,
    /// Next tick of the recording.
    tick: Tick,
    /// Commands issued and not executed yet.
    pending_commands: VecDeque<Command>,
    edits: Vec<Edit>,
    gate: Gate,
    latest_step: Option<Step>,
    buttons: u32,
    interruptions: u64,
    pauses: u64,
    /// Specification of the device in the recording's head.
    spec: DeviceSpec,
    is_paused: bool,
    /// True if each stage begins with the first movement of the device.
    awaits_movement: bool,
    /// True while the servo waits for it.
    is_awaiting: bool,
    was_ready: bool,
    /// Timing statistics of the servo, after it has ended.
    final_timing: Option<TimingSummary>,
}

/// Owner of the simulation.
enum LiveState {
    Running(Servo),
    /// The servo has stopped because the device was disconnected.
    Suspended(Box<Suspended>),
    Ended,
}

/// State that the next servo takes over.
struct Suspended {
    simulation: Simulation,
    second: Option<SecondHandLink>,
    timing: TimingStats,
}

impl From<ServoExit> for Suspended {
    fn from(ended: ServoExit) -> Suspended {
        let ServoExit { simulation, second, timing: beats, .. } = ended;
        Suspended { simulation, second, timing: beats }
    }
}

/// Summary of a live session: timing of the servo, and the values that its input and force gates changed.
#[derive(Clone, Debug)]
pub struct LiveSummary {
    pub ticks: u64,
    pub gate: Gate,
    pub timing: Option<TimingSummary>,
    /// Number of times that the device was disconnected or not ready during the session.
    pub interruptions: u64,
    /// Number of pauses by a person.
    pub pauses: u64,
}

impl LiveSummary {
    /// Servo statistics for the end of the recording.
    pub fn servo_file(&self) -> ServoStatsFile {
        let LiveSummary { ticks, gate, timing: beats, interruptions, pauses } = self;
        let beats = beats.unwrap_or_default();
        let us = |d: Duration| Some(d.as_secs_f64() * 1e6);
        ServoStatsFile {
            ticks: *ticks,
            late_p50_us: us(beats.late_p50),
            late_p99_us: us(beats.late_p99),
            late_max_us: us(beats.late_max),
            work_max_us: us(beats.work_max),
            missed: beats.missed,
            dropped: beats.dropped_events,
            let_go: beats.late_releases,
            interruptions: *interruptions,
            pauses: *pauses,
            faults: gate.faults(),
            clamped: gate.clamped_forces,
            clamped_torques: gate.clamped_torques,
        }
    }
}

/// Error that ends a live session.
#[derive(Debug)]
pub enum LiveError<E> {
    /// The observer failed: nothing more can be recorded.
    Observer(E),
    /// The servo failed, or could not be started.
    Servo(String),
}

impl<E: fmt::Display> fmt::Display for LiveError<E> {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            LiveError::Observer(error) => error.fmt(f),
            LiveError::Servo(why) => f.write_str(why),
        }
    }
}

impl<E: fmt::Debug + fmt::Display> std::error::Error for LiveError<E> {}

impl<E> From<E> for LiveError<E> {
    fn from(error: E) -> LiveError<E> {
        LiveError::Observer(error)
    }
}

impl LiveSession {
    /// Begins a session and starts the servo. Returns the first events.
    ///
    /// # Errors
    ///
    /// [`LiveError::Observer`] if the observer failed, [`LiveError::Servo`] if the servo cannot be started.
    pub fn begin<O: Observer>(
        session: &mut Session,
        mut simulation: Simulation,
        device: Box<dyn Device + Send>,
        second: Option<SecondHandLink>,
        observer: &mut O,
    ) -> Result<(LiveSession, Vec<LiveEvent>), LiveError<O::Error>> {
        let mut live = LiveSession::before_start(device.spec().clone());
        let mut events = Vec::new();
        for effect in session.begin() {
            if let Effect::Command(command) = &effect {
                // The servo does not run yet, so the commands of the first stage apply from the first tick on.
                observer.command(live.tick, command)?;
                simulation.apply(command);
            }
            observer.effect(live.tick, &effect, session)?;
            events.push(LiveEvent::Effect(effect));
        }
        live.start(simulation, device, second, TimingStats::default())?;
        Ok((live, events))
    }

    /// Goes on with a session that was interrupted before its stages were over: one tick releases the hand, and then the servo starts
    /// with the commands that were not carried out. Returns the events of that tick.
    ///
    /// # Errors
    ///
    /// [`LiveError::Observer`] if the observer failed, [`LiveError::Servo`] if the servo cannot be started.
    pub fn resume<O: Observer>(
        session: &mut Session,
        mut simulation: Simulation,
        pending_commands: VecDeque<Command>,
        device: Box<dyn Device + Send>,
        observer: &mut O,
    ) -> Result<(LiveSession, Vec<LiveEvent>), LiveError<O::Error>> {
        let mut live = LiveSession {
            tick: simulation.tick(),
            pending_commands,
            gate: *simulation.gate(),
            ..LiveSession::before_start(device.spec().clone())
        };
        let mut events = Vec::new();
        let step = simulation.step(&Reading::ABSENT);
        observer.tick_completed(&Reading::ABSENT, &step, simulation.edits())?;
        (live.tick, live.gate, live.latest_step) = (step.tick.next(), *simulation.gate(), Some(step));
        let effects = session.advance(SessionEvent::Tick { step: &step, edits: simulation.edits() });
        live.apply_effects(effects, session, observer, &mut events)?;
        // The tick may have been the last of the last stage.
        if !session.are_stages_over() {
            live.start(simulation, device, None, TimingStats::default())?;
        }
        Ok((live, events))
    }

    /// A session whose servo does not run yet.
    fn before_start(spec: DeviceSpec) -> LiveSession {
        LiveSession {
            state: LiveState::Ended,
            tick: Tick::ZERO,
            pending_commands: VecDeque::new(),
            edits: Vec::new(),
            gate: Gate::default(),
            latest_step: None,
            buttons: 0,
            interruptions: 0,
            pauses: 0,
            spec,
            is_paused: false,
            awaits_movement: false,
            is_awaiting: false,
            was_ready: false,
            final_timing: None,
        }
    }

    fn start<E>(
        &mut self,
        simulation: Simulation,
        device: Box<dyn Device + Send>,
        second: Option<SecondHandLink>,
        timing: TimingStats,
    ) -> Result<(), LiveError<E>> {
        let mut servo = Servo::start(simulation, device, second, timing).map_err(LiveError::Servo)?;
        if self.is_paused {
            servo.send(ServoCommand::Pause);
        }
        if self.is_awaiting {
            servo.send(ServoCommand::AwaitMovement);
        }
        for command in &self.pending_commands {
            servo.send(ServoCommand::Command(*command));
        }
        self.state = LiveState::Running(servo);
        Ok(())
    }

    /// Continues after the device was disconnected. Returns false if `device` has another specification than the one
    /// with which the session began: the stiffness limits and the recording's description of the device would no longer
    /// hold.
    ///
    /// # Errors
    ///
    /// [`LiveError::Servo`] if the servo cannot be started.
    pub fn resume_with<O: Observer>(&mut self, device: Box<dyn Device + Send>) -> Result<bool, LiveError<O::Error>> {
        if *device.spec() != self.spec {
            return Ok(false);
        }
        match std::mem::replace(&mut self.state, LiveState::Ended) {
            LiveState::Suspended(left) => {
                let Suspended { simulation, second, timing: beats } = *left;
                self.start(simulation, device, second, beats).map(|()| true)
            }
            other => {
                self.state = other;
                Ok(true)
            }
        }
    }

    /// Receives everything that the servo did since the last call, and returns the resulting events in order.
    ///
    /// # Errors
    ///
    /// [`LiveError::Observer`] if the observer failed, [`LiveError::Servo`] if the servo failed or ticks were lost.
    pub fn poll<O: Observer>(
        &mut self,
        session: &mut Session,
        observer: &mut O,
    ) -> Result<Vec<LiveEvent>, LiveError<O::Error>> {
        let mut events = Vec::new();
        if let Some(servo) = self.servo_mut() {
            servo.advance();
        }
        // Checked before the events are fetched: a servo that has ended sends no more of them.
        let has_ended = self.servo().is_some_and(|servo| servo.has_ended());
        while !session.are_stages_over() {
            let Some(letter) = self.servo_mut().and_then(Servo::next_event) else { break };
            match letter {
                ServoEvent::Started(priority) => events.push(LiveEvent::ServoStarted(priority)),
                ServoEvent::Commanded(_, command) => {
                    self.pending_commands.pop_front();
                    observer.command(self.tick, &command)?;
                }
                ServoEvent::Ticked(turn) => self.record_tick(&turn, session, observer, &mut events)?,
                ServoEvent::AwaitingMovement(is_awaiting) => {
                    self.is_awaiting = is_awaiting;
                    events.push(LiveEvent::AwaitingMovement(is_awaiting));
                }
                ServoEvent::DeviceState(state) => {
                    self.set_ready(state.is_ready());
                    events.push(LiveEvent::DeviceState(state));
                }
            }
        }
        if session.are_stages_over() {
            // Only the questionnaire may remain: the force is switched off and the simulation stops.
            self.shut_down()?;
        } else if has_ended && let Some(ended) = self.stop_servo()? {
            self.set_ready(false);
            events.push(LiveEvent::DeviceLost(ended.device_error.unwrap_or(DeviceError::Ended)));
            self.state = LiveState::Suspended(Box::new(Suspended::from(ended)));
        }
        Ok(events)
    }

    /// Counts one interruption for each time that the device is not ready, however many states it passes through.
    fn set_ready(&mut self, is_ready: bool) {
        self.interruptions += u64::from(self.was_ready && !is_ready);
        self.was_ready = is_ready;
    }

    fn record_tick<O: Observer>(
        &mut self,
        report: &TickReport,
        session: &mut Session,
        observer: &mut O,
        events: &mut Vec<LiveEvent>,
    ) -> Result<(), LiveError<O::Error>> {
        if report.step.tick != self.tick {
            let lost = "ticks were lost because this computer did not respond for too long; the recording up to that time is \
                kept";
            return Err(LiveError::Servo(lost.into()));
        }
        let mut edits = std::mem::take(&mut self.edits);
        edits.clear();
        if let Some(servo) = self.servo_mut() {
            servo.take_edits(report, &mut edits);
        }
        observer.tick_completed(&report.reading, &report.step, &edits)?;
        (self.tick, self.gate) = (report.step.tick.next(), report.gate);
        (self.latest_step, self.buttons) = (Some(report.step), report.reading.buttons);
        let effects = session.advance(SessionEvent::Tick { step: &report.step, edits: &edits });
        self.edits = edits;
        self.apply_effects(effects, session, observer, events)
    }

    /// Passes an input of the person to the session, as of the last tick that was received.
    ///
    /// # Errors
    ///
    /// [`LiveError::Observer`] if the observer failed.
    pub fn submit<O: Observer>(
        &mut self,
        input: &Input,
        session: &mut Session,
        observer: &mut O,
    ) -> Result<Vec<LiveEvent>, LiveError<O::Error>> {
        let mut events = Vec::new();
        // Whoever looks around, and whose hand follows the view, has not begun.
        if self.awaits_movement
            && !matches!(input, Input::Look(_) | Input::PlaceHand(_))
            && let Some(servo) = self.servo_mut()
        {
            servo.send(ServoCommand::StopAwaiting);
        }
        observer.input(self.tick, input)?;
        let effects = session.advance(SessionEvent::Input(input));
        self.apply_effects(effects, session, observer, &mut events)?;
        Ok(events)
    }

    fn apply_effects<O: Observer>(
        &mut self,
        effects: Vec<Effect>,
        session: &Session,
        observer: &mut O,
        events: &mut Vec<LiveEvent>,
    ) -> Result<(), LiveError<O::Error>> {
        for effect in effects {
            if let Effect::Command(command) = &effect {
                self.pending_commands.push_back(*command);
                if session.are_stages_over() {
                    // No further tick is recorded: the last commands apply at the end of the recording.
                    for command in self.pending_commands.drain(..) {
                        observer.command(self.tick, &command)?;
                    }
                } else if let Some(servo) = self.servo_mut() {
                    servo.send(ServoCommand::Command(*command));
                }
            }
            observer.effect(self.tick, &effect, session)?;
            if let Effect::StageStarted { stage } = effect
                && self.awaits_movement
                && has_own_instruction(&session.scenario().stages, stage)
            {
                self.stop_clock();
            }
            events.push(LiveEvent::Effect(effect));
        }
        Ok(())
    }

    /// Stops the clock at the beginning of each stage with an instruction of its own, until the device moves, one of its
    /// buttons changes or the person makes an input. No tick is recorded while the person reads, and this counts as no
    /// pause. An instrument that presses on something is not released for it.
    pub fn await_movement(&mut self) {
        self.awaits_movement = true;
        self.stop_clock();
    }

    fn stop_clock(&mut self) {
        /// Force above which an instrument counts as being in use, N.
        const IN_USE: f32 = 0.05;
        let is_in_use = self.latest_step.and_then(|step| step.touch).is_some_and(|touch| touch.spring > IN_USE);
        if let Some(servo) = self.servo_mut().filter(|_| !is_in_use) {
            servo.send(ServoCommand::AwaitMovement);
        }
    }

    /// Pauses or resumes the servo. During a pause, the simulation stops and the force is switched off.
    pub fn set_paused(&mut self, is_paused: bool) {
        self.pauses += u64::from(is_paused && !self.is_paused);
        self.is_paused = is_paused;
        if let Some(servo) = self.servo_mut() {
            servo.send(if is_paused { ServoCommand::Pause } else { ServoCommand::Resume });
        }
    }

    /// The newest step that was received.
    pub fn latest_step(&self) -> Option<&Step> {
        self.latest_step.as_ref()
    }

    /// Buttons of the device as of that step, a bit each.
    pub fn buttons(&self) -> u32 {
        self.buttons
    }

    /// True if the device was disconnected; the caller should look for it again.
    pub fn is_suspended(&self) -> bool {
        matches!(self.state, LiveState::Suspended(_))
    }

    /// True while ticks pass: the lesson is neither paused nor without a device, and the hand has begun to move.
    pub fn is_running(&self) -> bool {
        matches!(self.state, LiveState::Running(_)) && !self.is_paused && !self.is_awaiting
    }

    /// Timing statistics of the servo so far; `None` before they are available.
    pub fn timing(&self) -> Option<TimingSummary> {
        match &self.state {
            LiveState::Running(servo) => servo.timing(),
            LiveState::Suspended(left) => Some(left.timing.summary()),
            LiveState::Ended => self.final_timing,
        }
    }

    /// The tool of an assistant's hand; `None` without one.
    pub fn assistant(&self) -> Option<AssistantTool> {
        match &self.state {
            LiveState::Running(servo) => servo.assistant(),
            LiveState::Suspended(_) | LiveState::Ended => None,
        }
    }

    /// Stops the servo and switches the force off.
    ///
    /// # Errors
    ///
    /// [`LiveError::Servo`] if the servo failed.
    pub fn end<O: Observer>(mut self) -> Result<LiveSummary, LiveError<O::Error>> {
        self.shut_down()?;
        let timing = self.timing();
        let LiveSession { tick, gate, interruptions, pauses, .. } = self;
        Ok(LiveSummary { ticks: tick.0, gate, timing, interruptions, pauses })
    }

    fn shut_down<E>(&mut self) -> Result<(), LiveError<E>> {
        if let Some(ended) = self.stop_servo()? {
            self.final_timing = Some(ended.timing.summary());
        }
        Ok(())
    }

    fn stop_servo<E>(&mut self) -> Result<Option<ServoExit>, LiveError<E>> {
        match std::mem::replace(&mut self.state, LiveState::Ended) {
            LiveState::Running(servo) => servo.stop().map(Some).map_err(LiveError::Servo),
            other => {
                self.state = other;
                Ok(None)
            }
        }
    }

    fn servo(&self) -> Option<&Servo> {
        if let LiveState::Running(servo) = &self.state { Some(servo) } else { None }
    }

    fn servo_mut(&mut self) -> Option<&mut Servo> {
        if let LiveState::Running(servo) = &mut self.state { Some(servo) } else { None }
    }
}

/// True if a stage has another instruction than the one before: the trials of a draw follow one another at once.
fn has_own_instruction(stages: &[Stage], stage: usize) -> bool {
    stage.checked_sub(1).is_none_or(|before| stages[before].instruction != stages[stage].instruction)
}
