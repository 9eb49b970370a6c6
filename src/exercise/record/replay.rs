//! The replay of a recording, its comparison with what was recorded, and the state in which an interrupted session goes on.

use super::file::{DeviceSpecFile, END, ServoStatsFile};
use super::reader::Recording;
use super::tick_record::{TickLayout, TickRecord};
use super::writer::{DIGEST_TICKS, Recorder, RecorderError};
use crate::scenario::Workpiece;
use crate::session::{COMMAND_LAG_TICKS, Effect, Input, Observer, Session, SessionEvent, SessionOutcome};
use sha2::{Digest, Sha256};
use std::collections::VecDeque;
use std::fmt;
use std::iter::Peekable;
use std::slice::Iter;
use typodont_core::device::DeviceSpec;
use typodont_core::sim::{Command, Simulation, Step};
use typodont_core::tick::Tick;
use typodont_core::volume::{Edit, Volume};

/// Digest of everything in a recording so far.
#[derive(Clone, Debug, Default)]
pub(super) struct RunningDigest(Sha256);

impl RunningDigest {
    pub fn new() -> RunningDigest {
        RunningDigest(Sha256::new())
    }

    /// Adds the head, an attachment or the end metadata.
    pub fn part(&mut self, name: &str, bytes: &[u8]) {
        for part in [name.as_bytes(), bytes] {
            self.0.update((part.len() as u64).to_le_bytes());
            self.0.update(part);
        }
    }

    /// Adds an `/event` message.
    pub fn event(&mut self, bytes: &[u8]) {
        self.0.update(b"E");
        self.0.update(bytes);
    }

    /// Adds a `/haptic` message and the edits of its tick.
    pub fn tick(&mut self, bytes: &[u8], edits: &[Edit]) {
        self.0.update(b"T");
        self.0.update(bytes);
        for edit in edits {
            self.0.update(edit.bytes());
        }
    }

    /// Returns the SHA-256 so far, hexadecimal.
    pub fn sha256(&self) -> String {
        crate::scenario::hex(&self.0.clone().finalize())
    }
}

/// Result of a replay.
#[derive(Clone, Debug)]
pub struct Replay {
    pub workpiece: Workpiece,
    /// The volume at the end of the session.
    pub volume: Volume,
    pub outcome: SessionOutcome,
    /// First difference between the replay and the recording; `None` if none was found or nothing was compared.
    pub difference: Option<Difference>,
}

/// Difference between a replay and its recording.
#[derive(Clone, Debug, PartialEq)]
pub enum Difference {
    /// The step of this tick gives a different result, in the part named by `what`.
    Tick { tick: Tick, what: &'static str },
    /// The digest at this tick differs.
    Digest { tick: Tick },
    /// The session's command at this tick differs from the recorded one.
    Command { tick: Tick },
    /// The counts of ticks and faults at the end differ.
    Counts,
    /// The recording has more events or digests than a session produces.
    UnexpectedRecords,
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let at = |tick: &Tick| format!("tick {} ({:.3} s)", tick.0, tick.seconds());
        match self {
            Difference::Tick { tick, what } => write!(f, "{}: the {what} differs from the recording", at(tick)),
            Difference::Digest { tick } => write!(f, "{}: the running digest differs from the recording", at(tick)),
            Difference::Command { tick } => write!(f, "{}: the command differs from the recording", at(tick)),
            Difference::Counts => f.write_str("the final counts of ticks and faults differ from the recording"),
            Difference::UnexpectedRecords => f.write_str("the recording contains unexpected events or digests"),
        }
    }
}

/// Extent of the comparison during a replay.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReplayCheck {
    /// Compares every force, command and digest: for verification.
    Full,
    /// Compares nothing: for scoring a recording that is verified separately.
    Skip,
}

/// Replays a recording and passes every tick to `visit`.
///
/// `workpiece` is the recording's own. After the first difference the replay continues without further comparison.
pub fn replay(
    recording: &Recording,
    workpiece: Workpiece,
    check: ReplayCheck,
    mut visit: impl FnMut(&TickRecord, &Step, &[Edit], &Session),
) -> Replay {
    let mut replayer = Replayer::new(recording, &workpiece, check);
    for haptic in &recording.ticks {
        replayer.apply_events(haptic.tick);
        let step = replayer.step(haptic);
        visit(haptic, &step, replayer.simulation.edits(), &replayer.session);
        replayer.advance(&step);
    }
    let (simulation, session, difference) = replayer.finish();
    Replay { volume: simulation.into_volume(), outcome: session.outcome(), workpiece, difference }
}

/// State in which an interrupted session goes on.
pub struct Continuation {
    pub simulation: Simulation,
    pub session: Session,
    /// Commands that the session has issued and that were not carried out yet.
    pub pending_commands: VecDeque<Command>,
    /// True if the clutch was pressed.
    pub is_clutch_pressed: bool,
    /// All effects so far, in order.
    pub effects: Vec<Effect>,
    /// All changed voxels so far, in order.
    pub edits: Vec<Edit>,
}

/// Repeats the session of a recording without an end and writes it again with a recorder, which has been started with the
/// recording's workpiece. What follows the last tick may be incomplete: its inputs are made again, and what they cause is
/// recorded anew; commands that were carried out after it are pending again.
///
/// # Errors
/// The first difference between the repetition and the recording, the end of the stages, or the failure of the recorder.
pub fn go_on(
    recording: &Recording,
    workpiece: &Workpiece,
    recorder: &mut Recorder,
) -> Result<Continuation, ContinuationError> {
    let mut replayer = Replayer::new(recording, workpiece, ReplayCheck::Full);
    let mut effects = replayer.first_effects();
    let mut edits = Vec::new();
    let mut events = recording.events.iter().peekable();
    let mut newest = Vec::new();
    for haptic in &recording.ticks {
        effects.extend(std::mem::take(&mut newest));
        effects.extend(replayer.apply_events(haptic.tick));
        while let Some((tick, bytes)) = events.next_if(|(at, _)| *at <= haptic.tick) {
            recorder.repeat_event(*tick, bytes)?;
        }
        let step = replayer.step(haptic);
        recorder.tick_completed(&haptic.reading, &step, replayer.simulation.edits())?;
        edits.extend_from_slice(replayer.simulation.edits());
        newest = replayer.advance(&step);
    }
    let next = Tick(recording.ticks.len() as u64);
    let Replayer { simulation, mut session, mut expected_commands, verifier, inputs, .. } = replayer;
    if let Some(difference) = verifier.difference {
        return Err(ContinuationError::Different(difference));
    }
    for effect in &newest {
        recorder.effect(next, effect, &session)?;
    }
    effects.extend(newest);
    let mut is_clutch_pressed = false;
    for (_, input) in &recording.inputs {
        if let Input::PressClutch(is_pressed) = input {
            is_clutch_pressed = *is_pressed;
        }
    }
    for (_, input) in inputs {
        recorder.input(next, input)?;
        let caused = session.advance(SessionEvent::Input(input));
        expected_commands.push_effects(next, &caused);
        for effect in &caused {
            recorder.effect(next, effect, &session)?;
        }
        effects.extend(caused);
    }
    if session.are_stages_over() {
        return Err(ContinuationError::StagesOver);
    }
    let pending_commands = expected_commands.expected.into_iter().map(|(_, command)| command).collect();
    Ok(Continuation { simulation, session, pending_commands, is_clutch_pressed, effects, edits })
}

/// Reason why a session cannot go on.
#[derive(Debug)]
pub enum ContinuationError {
    /// All stages were performed; only the questionnaire may be missing.
    StagesOver,
    /// This program does not repeat the recording bit by bit.
    Different(Difference),
    Recorder(RecorderError),
}

impl From<RecorderError> for ContinuationError {
    fn from(error: RecorderError) -> ContinuationError {
        ContinuationError::Recorder(error)
    }
}

impl fmt::Display for ContinuationError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            ContinuationError::StagesOver => f.write_str("all its stages were performed"),
            ContinuationError::Different(difference) => difference.fmt(f),
            ContinuationError::Recorder(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for ContinuationError {}

/// A simulation and a session that repeat a recording tick by tick.
struct Replayer<'a> {
    simulation: Simulation,
    session: Session,
    expected_commands: ExpectedCommands,
    verifier: ReplayVerifier<'a>,
    inputs: Peekable<Iter<'a, (Tick, Input)>>,
    commands: Peekable<Iter<'a, (Tick, Option<Command>)>>,
    /// Effects of the beginning, until they are taken.
    first_effects: Vec<Effect>,
}

impl<'a> Replayer<'a> {
    fn new(recording: &'a Recording, workpiece: &Workpiece, check: ReplayCheck) -> Replayer<'a> {
        let spec = DeviceSpec::from(&recording.head.device as &DeviceSpecFile);
        let mut setup = crate::session::setup(&recording.scenario, workpiece, spec);
        if recording.head.version < 2 {
            setup.ramp = 0;
        }
        let mut session = Session::new(recording.scenario.clone(), workpiece);
        let lag = if recording.head.live { COMMAND_LAG_TICKS } else { 0 };
        let mut expected_commands = ExpectedCommands { expected: VecDeque::new(), lag };
        let first_effects = session.begin();
        expected_commands.push_effects(Tick::ZERO, &first_effects);
        Replayer {
            simulation: Simulation::new(setup),
            session,
            expected_commands,
            verifier: ReplayVerifier::new(recording, check),
            inputs: recording.inputs.iter().peekable(),
            commands: recording.commands.iter().peekable(),
            first_effects,
        }
    }

    /// Effects of the session's beginning.
    fn first_effects(&mut self) -> Vec<Effect> {
        std::mem::take(&mut self.first_effects)
    }

    /// Repeats the inputs and commands before the step of a tick; returns the effects of the inputs.
    fn apply_events(&mut self, tick: Tick) -> Vec<Effect> {
        let mut effects = Vec::new();
        while let Some((_, input)) = self.inputs.next_if(|(at, _)| *at <= tick) {
            let caused = self.session.advance(SessionEvent::Input(input));
            self.expected_commands.push_effects(tick, &caused);
            effects.extend(caused);
        }
        while let Some((at, command)) = self.commands.next_if(|(at, _)| *at <= tick) {
            let (issued, matches) = self.expected_commands.take_matching(*at, command.as_ref());
            self.verifier.command(tick, matches);
            // A sealed command is not in the recording: the session issues it again.
            if let Some(command) = command.as_ref().or(issued.as_ref()) {
                self.simulation.apply(command);
            }
        }
        effects
    }

    /// Repeats the step of a tick.
    fn step(&mut self, haptic: &TickRecord) -> Step {
        self.simulation.set_coupling_force(haptic.lead);
        let step = self.simulation.step(&haptic.reading);
        self.verifier.tick(haptic, &step, self.simulation.edits());
        step
    }

    /// Passes the step to the session; returns its effects.
    fn advance(&mut self, step: &Step) -> Vec<Effect> {
        let effects = self.session.advance(SessionEvent::Tick { step, edits: self.simulation.edits() });
        self.expected_commands.push_effects(step.tick.next(), &effects);
        effects
    }

    /// Repeats what follows the last tick; returns the first difference from the recording.
    fn finish(mut self) -> (Simulation, Session, Option<Difference>) {
        let recording = self.verifier.recording;
        let last = Tick(recording.ticks.len() as u64);
        for (_, input) in self.inputs {
            self.expected_commands.push_effects(last, &self.session.advance(SessionEvent::Input(input)));
        }
        for (at, command) in self.commands {
            self.verifier.command(last, self.expected_commands.take_matching(*at, command.as_ref()).1);
        }
        let counted = ServoStatsFile::of(&self.simulation);
        let is_counted = recording.end.as_ref().is_none_or(|end| end.servo.has_same_counts(&counted));
        let difference = self.verifier.finish(last, self.expected_commands.is_empty(), is_counted);
        (self.simulation, self.session, difference)
    }
}

/// Commands issued by the replayed session that must still be found in the recording, in the same order.
struct ExpectedCommands {
    expected: VecDeque<(Tick, Command)>,
    /// Maximum number of ticks by which a recorded command may be later: 0 unless the session was live.
    lag: u64,
}

impl ExpectedCommands {
    /// Appends the commands among the effects.
    fn push_effects(&mut self, at: Tick, effects: &[Effect]) {
        let commands =
            effects.iter().filter_map(|e| if let Effect::Command(command) = e { Some(*command) } else { None });
        self.expected.extend(commands.map(|command| (at, command)));
    }

    /// Removes the next expected command and returns it, with true if it equals the recorded one, unless that is
    /// sealed, within the permitted lag.
    fn take_matching(&mut self, at: Tick, command: Option<&Command>) -> (Option<Command>, bool) {
        let Some((given, expected)) = self.expected.pop_front() else { return (None, false) };
        let is_same = command.is_none_or(|command| *command == expected);
        (Some(expected), is_same && (given..=Tick(given.0 + self.lag)).contains(&at))
    }

    fn is_empty(&self) -> bool {
        self.expected.is_empty()
    }
}

/// Comparison of a replay with its recording, up to the first difference.
struct ReplayVerifier<'a> {
    recording: &'a Recording,
    check: ReplayCheck,
    layout: TickLayout,
    running_digest: RunningDigest,
    events_done: usize,
    digests_done: usize,
    difference: Option<Difference>,
}

impl<'a> ReplayVerifier<'a> {
    fn new(recording: &'a Recording, check: ReplayCheck) -> ReplayVerifier<'a> {
        ReplayVerifier {
            recording,
            check,
            layout: TickLayout::of(recording.head.version),
            running_digest: recording.initial_digest.clone(),
            events_done: 0,
            digests_done: 0,
            difference: None,
        }
    }

    fn is_comparing(&self) -> bool {
        self.check == ReplayCheck::Full && self.difference.is_none()
    }

    fn command(&mut self, tick: Tick, matches: bool) {
        if self.is_comparing() && !matches {
            self.difference = Some(Difference::Command { tick });
        }
    }

    fn tick(&mut self, recorded: &TickRecord, step: &Step, edits: &[Edit]) {
        if !self.is_comparing() {
            return;
        }
        let tick = recorded.tick;
        self.digest_events(tick);
        let again = TickRecord::of(&recorded.reading, step);
        if let Some(what) = differing_part(recorded, &again) {
            self.difference = Some(Difference::Tick { tick, what });
            return;
        }
        self.running_digest.tick(&again.bytes(self.layout), edits);
        let ticks_done = tick.0 + 1;
        if ticks_done.is_multiple_of(DIGEST_TICKS) {
            self.check_digest(Tick(ticks_done));
        }
    }

    fn digest_events(&mut self, tick: Tick) {
        let events = &self.recording.events[self.events_done..];
        for (_, bytes) in events.iter().take_while(|(at, _)| *at <= tick) {
            self.running_digest.event(bytes);
            self.events_done += 1;
        }
    }

    fn check_digest(&mut self, tick: Tick) {
        let recorded = self.recording.digests.get(self.digests_done);
        self.digests_done += 1;
        if recorded.is_none_or(|d| d.tick != tick.0 || d.sha256 != self.running_digest.sha256()) {
            self.difference = Some(Difference::Digest { tick });
        }
    }

    fn finish(mut self, last: Tick, are_all_commands_given: bool, is_counted: bool) -> Option<Difference> {
        if !self.is_comparing() {
            return self.difference;
        }
        self.digest_events(last);
        if self.recording.is_cut_off() {
            return self.finish_cut_off(last);
        }
        self.running_digest.part(END, &self.recording.end_bytes);
        self.check_digest(last);
        let is_whole =
            self.events_done == self.recording.events.len() && self.digests_done == self.recording.digests.len();
        let missing_command = if are_all_commands_given { None } else { Some(Difference::Command { tick: last }) };
        let counts = if is_counted { None } else { Some(Difference::Counts) };
        self.difference.or(missing_command).or(counts).or(if is_whole {
            None
        } else {
            Some(Difference::UnexpectedRecords)
        })
    }

    /// [`ReplayVerifier::finish`] for a recording without an end. Its last commands may be missing; of its digests, only
    /// the one that covers the end metadata cannot be compared.
    fn finish_cut_off(self, last: Tick) -> Option<Difference> {
        let rest = self.recording.digests.get(self.digests_done..).unwrap_or_default();
        let are_digests_expected = rest.len() <= 1 && rest.iter().all(|digest| digest.tick == last.0);
        let is_whole = self.events_done == self.recording.events.len() && are_digests_expected;
        if is_whole { None } else { Some(Difference::UnexpectedRecords) }
    }
}

/// Returns the name of the first part of a tick that differs in any bit.
fn differing_part(recorded: &TickRecord, again: &TickRecord) -> Option<&'static str> {
    let bits = |v: typodont_core::frame::Vec3| v.to_array().map(f32::to_bits);
    let parts = [
        (bits(recorded.force) != bits(again.force), "force"),
        (bits(recorded.torque) != bits(again.torque), "torque"),
        (bits(recorded.lead) != bits(again.lead), "coupling force"),
        (bits(recorded.tip) != bits(again.tip), "position of the tip"),
        (recorded.spring.to_bits() != again.spring.to_bits(), "spring force"),
        (recorded.removed != again.removed, "number of removed voxels"),
        (recorded.touched != again.touched, "touched tissue"),
        (recorded.instrument != again.instrument, "instrument"),
        (recorded.cutting != again.cutting, "cutting state"),
    ];
    parts.into_iter().find_map(|(differs, name)| differs.then_some(name))
}
