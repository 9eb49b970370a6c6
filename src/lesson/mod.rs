//! A lesson from its exercise to its bundle: what stands around every session, whoever asks for it.
//!
//! Takes an exercise, who takes part and when it began, and then a device in a hand or a script. Gives a [`Lesson`] to listen
//! to, and in the end its bundle. Never reads the wall clock, prints, or decides what is asked of a person.

mod failed;
mod held;
mod opening;
mod scanned;
pub mod second;

pub use failed::Failed;
pub use held::{Held, is_code, library_for, open, read, scenario_files, seed_from};
pub use opening::{Opening, Prepared, Recorded};
pub use scanned::Scan;
pub use second::SecondHand;

use crate::device::{Device, Reading, UPRIGHT};
use crate::frame::Quat;
use crate::record::{EndFile, Recorder, ServoFile, Unwritable};
use crate::report::Templates;
use crate::report::bundle::Unfinished;
use crate::session::{Broken, Effect, Heard, Input, Live, Observer, Session};
use crate::sim::{Assist, AssistNews, Command, Simulation, Step};
use crate::tick::Tick;
use crate::volume::Edit;

/// A session with a person in it, recorded as it goes.
pub struct Lesson {
    session: Session,
    live: Live,
    /// The second hand's servo, if that turns here.
    assist: Option<Assist>,
    log: Log,
    unfinished: Unfinished,
    templates: Templates,
}

impl Lesson {
    /// Starts the servo with a device, and a second hand if one joins. Gives what is to be said first.
    fn begin(
        prepared: Prepared,
        simulation: Simulation,
        device: Box<dyn Device + Send>,
        second: Option<SecondHand>,
    ) -> Result<(Lesson, Vec<Heard>), Failed> {
        let Prepared { scenario, workpiece, recorder, unfinished, templates, .. } = prepared;
        let mut session = Session::new(scenario, &workpiece);
        let mut log = Log { recorder, edits: Vec::new(), held: UPRIGHT };
        let (second, assist) = second.map_or((None, None), |hand| (Some(hand.end), hand.assist));
        let begun = Live::begin(&mut session, simulation, device, second, &mut log);
        let (live, heard) = begun.map_err(|broken| stopped(&unfinished, &broken))?;
        Ok((Lesson { session, live, assist, log, unfinished, templates }, heard))
    }

    /// Hears everything the servo did since last asked; [`Lesson::edits`] are then those of that time.
    pub fn listen(&mut self) -> Result<Vec<Heard>, Failed> {
        self.log.edits.clear();
        let heard = self.live.listen(&mut self.session, &mut self.log);
        heard.map_err(|broken| stopped(&self.unfinished, &broken))
    }

    /// What happened to a second hand whose device is plugged in here, in order.
    pub fn next_of_second(&mut self) -> Option<AssistNews> {
        self.assist.as_mut()?.next_news()
    }

    /// What the person says, as of the last tick that was heard.
    pub fn say(&mut self, input: &Input) -> Result<Vec<Heard>, Failed> {
        let heard = self.live.say(input, &mut self.session, &mut self.log);
        heard.map_err(|broken| stopped(&self.unfinished, &broken))
    }

    /// Lets time stand still and the hand go, or ends that.
    pub fn pause(&mut self, is_paused: bool) {
        self.live.pause(is_paused);
    }

    /// Goes on after the device was gone. False when this is another device than the lesson began with.
    pub fn go_on(&mut self, device: Box<dyn Device + Send>) -> Result<bool, Failed> {
        self.live.go_on::<Log>(device).map_err(|broken| stopped(&self.unfinished, &broken))
    }

    pub fn session(&self) -> &Session {
        &self.session
    }

    pub fn live(&self) -> &Live {
        &self.live
    }

    /// The voxels that changed before the last [`Lesson::listen`], in order.
    pub fn edits(&self) -> &[Edit] {
        &self.log.edits
    }

    /// How the handle was held at the newest tick, `world_from_handle`.
    pub fn held(&self) -> Quat {
        self.log.held
    }

    /// Stops the servo and closes the recording.
    pub fn end(self) -> Result<Recorded, Failed> {
        let Lesson { session, live, log, unfinished, templates, .. } = self;
        let reason = if session.outcome().aborted { "aborted" } else { "complete" };
        let kept = live.end::<Log>().map_err(|broken| stopped(&unfinished, &broken))?;
        let end = EndFile { reason: reason.into(), servo: ServoFile::of_live(&kept) };
        Recorded::close(log.recorder, &end, unfinished, templates)
    }
}

/// What stopped a live session, and where the recording of it lies.
fn stopped(unfinished: &Unfinished, broken: &Broken<Unwritable>) -> Failed {
    match broken {
        Broken::Observer(error) => Failed::stopped(unfinished, error),
        Broken::Servo(what) => Failed::stopped(unfinished, what),
    }
}

/// Writes everything down, and keeps what else there is to draw.
struct Log {
    recorder: Recorder,
    edits: Vec<Edit>,
    held: Quat,
}

impl Observer for Log {
    type Error = Unwritable;

    fn input(&mut self, tick: Tick, input: &Input) -> Result<(), Unwritable> {
        self.recorder.input(tick, input)
    }

    fn command(&mut self, tick: Tick, command: &Command) -> Result<(), Unwritable> {
        self.recorder.command(tick, command)
    }

    fn effect(&mut self, tick: Tick, effect: &Effect, session: &Session) -> Result<(), Unwritable> {
        self.recorder.effect(tick, effect, session)
    }

    fn turned(&mut self, reading: &Reading, step: &Step, edits: &[Edit]) -> Result<(), Unwritable> {
        self.edits.extend_from_slice(edits);
        if reading.pose.is_sound() {
            self.held = reading.pose.orientation;
        }
        self.recorder.turned(reading, step, edits)
    }
}
