//! Turning a recording's readings again.

use super::file::{END, ServoFile, SpecFile};
use super::haptic::{Haptic, Layout};
use super::reader::Recording;
use super::writer::DIGEST_TICKS;
use crate::device::{Device, Output, Playback, Spec};
use crate::scenario::Workpiece;
use crate::session::{self, COMMAND_LAG_TICKS, Effect, Event, Outcome, Session};
use crate::sim::{Command, Simulation, Step};
use crate::tick::Tick;
use crate::volume::{Edit, Volume};
use sha2::{Digest, Sha256};
use std::collections::VecDeque;
use std::fmt;

/// The digest of a session while it runs.
#[derive(Clone, Debug, Default)]
pub(super) struct Running(Sha256);

impl Running {
    pub fn new() -> Running {
        Running(Sha256::new())
    }

    /// Something a session is made of, or what became of it: the head, a file, the end.
    pub fn part(&mut self, name: &str, bytes: &[u8]) {
        for part in [name.as_bytes(), bytes] {
            self.0.update((part.len() as u64).to_le_bytes());
            self.0.update(part);
        }
    }

    pub fn event(&mut self, bytes: &[u8]) {
        self.0.update(b"E");
        self.0.update(bytes);
    }

    pub fn tick(&mut self, bytes: &[u8], edits: &[Edit]) {
        self.0.update(b"T");
        self.0.update(bytes);
        for edit in edits {
            self.0.update(edit.bytes());
        }
    }

    pub fn sha256(&self) -> String {
        crate::scenario::hex(&self.0.clone().finalize())
    }
}

/// What came of turning a recording again.
#[derive(Clone, Debug)]
pub struct Replay {
    pub workpiece: Workpiece,
    /// The matter at the end.
    pub volume: Volume,
    pub outcome: Outcome,
    /// Where the replay first differs from what was recorded.
    pub difference: Option<Difference>,
}

/// Where a replay differs from its recording.
#[derive(Clone, Debug, PartialEq)]
pub enum Difference {
    /// The step of this tick gives another result; which part of it.
    Tick { tick: Tick, what: &'static str },
    /// The digest at this tick is another.
    Digest { tick: Tick },
    /// The session tells the simulation something else than was recorded.
    Command { tick: Tick },
    /// The counts at the end are not those of the replay.
    Counts,
    /// Events or digests stand where no session would have put them.
    Strays,
    /// The recording has no digest at its end.
    Unsealed,
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let at = |tick: &Tick| format!("tick {} ({:.3} s)", tick.0, tick.seconds());
        match self {
            Difference::Tick { tick, what } => write!(f, "{}: the {what} differs from what was recorded", at(tick)),
            Difference::Digest { tick } => write!(f, "{}: the digest of everything so far differs", at(tick)),
            Difference::Command { tick } => write!(f, "{}: the session would have given another command", at(tick)),
            Difference::Counts => f.write_str("the counts of ticks and faults at the end are not those of the replay"),
            Difference::Strays => f.write_str("events or digests stand beyond the session's end"),
            Difference::Unsealed => f.write_str("the recording breaks off before its end"),
        }
    }
}

/// How closely a replay is watched.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Watch {
    /// Every force, command and digest is compared: for verification.
    Everything,
    /// Nothing is compared: for scoring what was verified before, or will be.
    Nothing,
}

/// Turns a recording again; `visit` sees every tick.
///
/// `workpiece` is the recording's own. Stops comparing, but not turning, at the first difference.
pub fn replay(
    recording: &Recording,
    workpiece: Workpiece,
    watch: Watch,
    mut visit: impl FnMut(&Haptic, &Step, &[Edit], &Session),
) -> Replay {
    let spec = Spec::from(&recording.head.device as &SpecFile);
    let mut setup = session::setup(&recording.scenario, &workpiece, spec.clone());
    if recording.head.version < 2 {
        setup.ramp = 0;
    }
    let mut simulation = Simulation::new(setup);
    let mut session = Session::new(recording.scenario.clone(), &workpiece);
    let lag = if recording.head.live { COMMAND_LAG_TICKS } else { 0 };
    let mut told = Told { expected: VecDeque::new(), lag };
    told.expect(Tick::ZERO, &session.begin());
    let mut witness = Witness::new(recording, watch);
    let mut hand = Playback::new(spec, recording.ticks.iter().map(|t| t.reading));
    let mut output = Output::default();
    let mut inputs = recording.inputs.iter().peekable();
    let mut commands = recording.commands.iter().peekable();
    for haptic in &recording.ticks {
        let tick = haptic.tick;
        while let Some((_, input)) = inputs.next_if(|(at, _)| *at <= tick) {
            told.expect(tick, &session.advance(Event::Input(input)));
        }
        while let Some((at, command)) = commands.next_if(|(at, _)| *at <= tick) {
            witness.command(tick, told.matches(*at, command));
            simulation.apply(command);
        }
        let Ok(reading) = hand.exchange(&output) else { break };
        simulation.lead(haptic.lead);
        let step = simulation.step(&reading);
        output = step.output();
        witness.tick(haptic, &step, simulation.edits());
        visit(haptic, &step, simulation.edits(), &session);
        told.expect(tick.next(), &session.advance(Event::Tick { step: &step, edits: simulation.edits() }));
    }
    let last = Tick(recording.ticks.len() as u64);
    for (_, input) in inputs {
        told.expect(last, &session.advance(Event::Input(input)));
    }
    for (at, command) in commands {
        witness.command(last, told.matches(*at, command));
    }
    let counted = ServoFile::of(&simulation);
    let is_counted = recording.end.as_ref().is_none_or(|end| end.servo.counts_like(&counted));
    let difference = witness.conclude(last, told.is_empty(), is_counted);
    Replay { volume: simulation.into_volume(), outcome: session.outcome(), workpiece, difference }
}

/// Commands the session has given that the recording must have as well, in this order and at these ticks, or up to so many
/// ticks later where the session was live.
struct Told {
    expected: VecDeque<(Tick, Command)>,
    lag: u64,
}

impl Told {
    fn expect(&mut self, at: Tick, effects: &[Effect]) {
        let told = effects.iter().filter_map(|e| if let Effect::Tell(command) = e { Some(*command) } else { None });
        self.expected.extend(told.map(|command| (at, command)));
    }

    fn matches(&mut self, at: Tick, command: &Command) -> bool {
        let Some((given, expected)) = self.expected.pop_front() else { return false };
        expected == *command && (given..=Tick(given.0 + self.lag)).contains(&at)
    }

    fn is_empty(&self) -> bool {
        self.expected.is_empty()
    }
}

/// Compares a replay with its recording and remembers the first difference.
struct Witness<'a> {
    recording: &'a Recording,
    watch: Watch,
    layout: Layout,
    running: Running,
    events_seen: usize,
    digests_seen: usize,
    difference: Option<Difference>,
}

impl<'a> Witness<'a> {
    fn new(recording: &'a Recording, watch: Watch) -> Witness<'a> {
        Witness {
            recording,
            watch,
            layout: Layout::of(recording.head.version),
            running: recording.begun.clone(),
            events_seen: 0,
            digests_seen: 0,
            difference: None,
        }
    }

    fn is_watching(&self) -> bool {
        self.watch == Watch::Everything && self.difference.is_none()
    }

    fn command(&mut self, tick: Tick, matches: bool) {
        if self.is_watching() && !matches {
            self.difference = Some(Difference::Command { tick });
        }
    }

    fn tick(&mut self, recorded: &Haptic, step: &Step, edits: &[Edit]) {
        if !self.is_watching() {
            return;
        }
        let tick = recorded.tick;
        self.see_events(tick);
        let again = Haptic::of(&recorded.reading, step);
        if let Some(what) = differing_part(recorded, &again) {
            self.difference = Some(Difference::Tick { tick, what });
            return;
        }
        self.running.tick(&again.bytes(self.layout), edits);
        let turned = tick.0 + 1;
        if turned.is_multiple_of(DIGEST_TICKS) {
            self.see_digest(Tick(turned));
        }
    }

    fn see_events(&mut self, tick: Tick) {
        let events = &self.recording.events[self.events_seen..];
        for (_, bytes) in events.iter().take_while(|(at, _)| *at <= tick) {
            self.running.event(bytes);
            self.events_seen += 1;
        }
    }

    fn see_digest(&mut self, tick: Tick) {
        let recorded = self.recording.digests.get(self.digests_seen);
        self.digests_seen += 1;
        if recorded.is_none_or(|d| d.tick != tick.0 || d.sha256 != self.running.sha256()) {
            self.difference = Some(Difference::Digest { tick });
        }
    }

    fn conclude(mut self, last: Tick, told_all: bool, is_counted: bool) -> Option<Difference> {
        if !self.is_watching() {
            return self.difference;
        }
        self.see_events(last);
        if self.recording.end.is_none() {
            return Some(Difference::Unsealed);
        }
        self.running.part(END, &self.recording.end_bytes);
        self.see_digest(last);
        let is_whole =
            self.events_seen == self.recording.events.len() && self.digests_seen == self.recording.digests.len();
        let told = if told_all { None } else { Some(Difference::Command { tick: last }) };
        let counts = if is_counted { None } else { Some(Difference::Counts) };
        self.difference.or(told).or(counts).or(if is_whole { None } else { Some(Difference::Strays) })
    }
}

/// Which part of a tick differs, to the last bit.
fn differing_part(recorded: &Haptic, again: &Haptic) -> Option<&'static str> {
    let bits = |v: crate::frame::Vec3| v.to_array().map(f32::to_bits);
    let parts = [
        (bits(recorded.force) != bits(again.force), "force"),
        (bits(recorded.torque) != bits(again.torque), "torque"),
        (bits(recorded.lead) != bits(again.lead), "other hand's lead"),
        (bits(recorded.tip) != bits(again.tip), "place of the tip"),
        (recorded.spring.to_bits() != again.spring.to_bits(), "spring's force"),
        (recorded.removed != again.removed, "number of voxels removed"),
        (recorded.touched != again.touched, "tissue touched"),
        (recorded.instrument != again.instrument, "instrument"),
        (recorded.cutting != again.cutting, "state of cutting"),
    ];
    parts.into_iter().find_map(|(differs, name)| differs.then_some(name))
}
