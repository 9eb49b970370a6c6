//! A session with a person at a device, recorded while it runs.

use super::continuation::Resumption;
use super::disk_sync::DiskSync;
use super::live::{LiveError, LiveEvent, LiveSession};
use super::preparation::{PreparedSession, RecordedSession};
use super::{LessonError, PendingSecondHand};
use typodont_core::device::{Device, Reading, UPRIGHT};
use typodont_core::frame::Quat;
use typodont_core::sim::{Command, Simulation, Step};
use typodont_core::tick::Tick;
use typodont_core::volume::Edit;
use typodont_devices::servo::{SecondHandEvent, SecondHandServo};
use typodont_exercise::record::{Continuation, Recorder, RecorderError, RecordingEndFile};
use typodont_exercise::score::LimitMonitor;
use typodont_exercise::session::{Effect, Input, Observer, Session};
use typodont_report::Templates;
use typodont_report::bundle::PartialBundle;

/// A running session with a person, recorded continuously.
pub struct Lesson {
    session: Session,
    live: LiveSession,
    /// Servo of the second device, if it is connected to this machine.
    assist: Option<SecondHandServo>,
    observer: RecordingObserver,
    disk_sync: Option<DiskSync>,
    partial_bundle: PartialBundle,
    templates: Templates,
    has_second_hand: bool,
    clutch: ClutchControls,
}

/// Bit of a device's second button, which is the clutch.
const CLUTCH_BUTTON: u32 = 1 << 1;

/// State of the button and of the key that are the clutch: it is pressed while one of them is.
#[derive(Clone, Copy, Debug, Default)]
struct ClutchControls {
    /// True if the second button of the device is the clutch.
    has_button: bool,
    is_key_down: bool,
    /// True once the session was told that the clutch is pressed, until it was told otherwise.
    is_pressed: bool,
}

impl Lesson {
    /// Starts the servo with a device, and with a second device if one joins. Returns the first events.
    pub(super) fn begin(
        prepared: PreparedSession,
        simulation: Simulation,
        device: Box<dyn Device + Send>,
        second: Option<PendingSecondHand>,
    ) -> Result<(Lesson, Vec<LiveEvent>), LessonError> {
        let PreparedSession { scenario, workpiece, recorder, disk_sync, partial_bundle, templates, .. } = prepared;
        let limits = LimitMonitor::new(&scenario, &workpiece);
        let mut session = Session::new(scenario, &workpiece);
        let mut observer = RecordingObserver { recorder, edits: Vec::new(), handle_orientation: UPRIGHT, limits };
        let has_second_hand = second.is_some();
        let (second, assist) = second.map_or((None, None), |hand| (Some(hand.servo_hand), hand.assist));
        let started = LiveSession::begin(&mut session, simulation, device, second, &mut observer);
        let (live, events) = started.map_err(|broken| stopped_error(&partial_bundle, &broken))?;
        let clutch = ClutchControls::default();
        let lesson =
            Lesson { session, live, assist, observer, disk_sync, partial_bundle, templates, has_second_hand, clutch };
        Ok((lesson, events))
    }

    /// Goes on with an interrupted session. Returns its effects so far; [`Lesson::edits`] holds all changed voxels so far.
    pub(super) fn go_on(
        prepared: PreparedSession,
        device: Box<dyn Device + Send>,
    ) -> Result<(Lesson, Vec<LiveEvent>), LessonError> {
        let PreparedSession { scenario, workpiece, recorder, disk_sync, partial_bundle, templates, resumption, .. } =
            prepared;
        let Some(Resumption { continuation, former }) = resumption else {
            return Err(LessonError::NotResumable { why: "nothing was recorded".into() });
        };
        let Continuation { simulation, mut session, pending_commands, is_clutch_pressed, effects, edits } =
            continuation;
        let limits = LimitMonitor::new(&scenario, &workpiece);
        let mut observer = RecordingObserver { recorder, edits, handle_orientation: UPRIGHT, limits };
        let mut events: Vec<LiveEvent> = effects.into_iter().map(LiveEvent::Effect).collect();
        let resumed = LiveSession::resume(&mut session, simulation, pending_commands, device, &mut observer);
        let (live, first_events) = resumed.map_err(|broken| stopped_error(&partial_bundle, &broken))?;
        events.extend(first_events);
        Resumption::replace_former(former, &partial_bundle);
        let lesson = Lesson {
            session,
            live,
            assist: None,
            observer,
            disk_sync,
            partial_bundle,
            templates,
            has_second_hand: false,
            // Released with the first ticks, unless it is pressed again.
            clutch: ClutchControls { is_pressed: is_clutch_pressed, ..ClutchControls::default() },
        };
        Ok((lesson, events))
    }

    /// Returns the events since the last call, in order; [`Lesson::edits`] then holds the edits of that time.
    ///
    /// # Errors
    ///
    /// [`LessonError::Stopped`] if the recording cannot be written or synced to the disk, or the servo failed.
    pub fn poll(&mut self) -> Result<Vec<LiveEvent>, LessonError> {
        self.observer.edits.clear();
        if let Some(why) = self.disk_sync.as_ref().and_then(DiskSync::error) {
            return Err(LessonError::stopped(&self.partial_bundle, &why));
        }
        let events = self.live.poll(&mut self.session, &mut self.observer);
        let mut events = events.map_err(|broken| stopped_error(&self.partial_bundle, &broken))?;
        events.extend(self.update_clutch()?);
        Ok(events)
    }

    /// Makes the second button of the device the clutch. With a second hand there is no clutch: the coupling holds in the
    /// space of both devices.
    pub fn use_clutch_button(&mut self) {
        self.clutch.has_button = !self.has_second_hand;
    }

    /// Presses or releases the clutch by a key, unless there is a second hand.
    ///
    /// # Errors
    ///
    /// [`LessonError::Stopped`] if the recording cannot be written.
    pub fn press_clutch_key(&mut self, is_down: bool) -> Result<Vec<LiveEvent>, LessonError> {
        self.clutch.is_key_down = is_down && !self.has_second_hand;
        self.update_clutch()
    }

    /// Tells the session if the clutch is pressed or released since the last call. Not while no ticks pass: a press has its
    /// length in ticks.
    fn update_clutch(&mut self) -> Result<Vec<LiveEvent>, LessonError> {
        let ClutchControls { has_button, is_key_down, is_pressed } = self.clutch;
        let is_down = is_key_down || (has_button && self.live.buttons() & CLUTCH_BUTTON != 0);
        if is_down == is_pressed || self.session.are_stages_over() || !self.live.is_running() {
            return Ok(Vec::new());
        }
        self.clutch.is_pressed = is_down;
        self.submit(&Input::PressClutch(is_down))
    }

    /// Next event of a second device that is connected to this machine, in order; `None` if there is none.
    pub fn next_assist_event(&mut self) -> Option<SecondHandEvent> {
        self.assist.as_mut()?.next_event()
    }

    /// Passes an input of the person to the session, as of the last tick that was received.
    ///
    /// # Errors
    ///
    /// [`LessonError::Stopped`] if the recording cannot be written.
    pub fn submit(&mut self, input: &Input) -> Result<Vec<LiveEvent>, LessonError> {
        let events = self.live.submit(input, &mut self.session, &mut self.observer);
        events.map_err(|broken| stopped_error(&self.partial_bundle, &broken))
    }

    /// Pauses or resumes the session. During a pause, the simulation stops and the force is switched off.
    pub fn set_paused(&mut self, is_paused: bool) {
        self.live.set_paused(is_paused);
    }

    /// Stops the clock at the beginning of each stage until the trainee moves the device or makes an input; see
    /// [`LiveSession::await_movement`].
    pub fn await_movement(&mut self) {
        self.live.await_movement();
    }

    /// Continues after the device was disconnected. Returns false if `device` is not the device with which the lesson
    /// began.
    ///
    /// # Errors
    ///
    /// [`LessonError::Stopped`] if the servo cannot be started.
    pub fn resume_with(&mut self, device: Box<dyn Device + Send>) -> Result<bool, LessonError> {
        self.live
            .resume_with::<RecordingObserver>(device)
            .map_err(|broken| stopped_error(&self.partial_bundle, &broken))
    }

    pub fn session(&self) -> &Session {
        &self.session
    }

    pub fn live(&self) -> &LiveSession {
        &self.live
    }

    /// Edits that the last [`Lesson::poll`] received, in order.
    pub fn edits(&self) -> &[Edit] {
        &self.observer.edits
    }

    /// The exercise's limits of force and speed, and when they were exceeded.
    pub fn limits(&self) -> &LimitMonitor {
        &self.observer.limits
    }

    /// Orientation of the handle at the newest tick, `world_from_handle`.
    pub fn handle_orientation(&self) -> Quat {
        self.observer.handle_orientation
    }

    /// Stops the servo and closes the recording.
    ///
    /// # Errors
    ///
    /// [`LessonError::Stopped`] if the servo failed or the recording cannot be completed.
    pub fn end(self) -> Result<RecordedSession, LessonError> {
        let Lesson { session, live, observer, disk_sync, partial_bundle, templates, .. } = self;
        let reason = if session.outcome().aborted { "aborted" } else { "complete" };
        let summary = live.end::<RecordingObserver>().map_err(|broken| stopped_error(&partial_bundle, &broken))?;
        let end = RecordingEndFile { reason: reason.into(), servo: summary.servo_file() };
        RecordedSession::close(observer.recorder, disk_sync, &end, partial_bundle, templates)
    }
}

/// Error of a live session that stopped, with the folder of its recording.
fn stopped_error(partial_bundle: &PartialBundle, live_error: &LiveError<RecorderError>) -> LessonError {
    match live_error {
        LiveError::Observer(error) => LessonError::stopped(partial_bundle, error),
        LiveError::Servo(what) => LessonError::stopped(partial_bundle, what),
    }
}

/// Records everything, and keeps the values that a window draws.
struct RecordingObserver {
    recorder: Recorder,
    edits: Vec<Edit>,
    handle_orientation: Quat,
    limits: LimitMonitor,
}

impl Observer for RecordingObserver {
    type Error = RecorderError;

    fn input(&mut self, tick: Tick, input: &Input) -> Result<(), RecorderError> {
        self.recorder.input(tick, input)?;
        // After the last stage, no tick passes on what was written.
        match input {
            Input::Look(_) | Input::PlaceHand(_) | Input::PressClutch(_) => Ok(()),
            _ => self.recorder.flush(),
        }
    }

    fn command(&mut self, tick: Tick, command: &Command) -> Result<(), RecorderError> {
        self.recorder.command(tick, command)
    }

    fn effect(&mut self, tick: Tick, effect: &Effect, session: &Session) -> Result<(), RecorderError> {
        self.recorder.effect(tick, effect, session)?;
        // An interruption must not undo the end of a stage.
        match effect {
            Effect::StageEnded { .. } | Effect::StagesOver => self.recorder.flush(),
            _ => Ok(()),
        }
    }

    fn tick_completed(&mut self, reading: &Reading, step: &Step, edits: &[Edit]) -> Result<(), RecorderError> {
        self.edits.extend_from_slice(edits);
        self.limits.observe(step);
        if reading.pose.is_valid() {
            self.handle_orientation = step.handle;
        }
        self.recorder.tick_completed(reading, step, edits)
    }
}
