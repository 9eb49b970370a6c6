//! The course of a lesson, from its exercise to its bundle, in steps that a backend asks for.
//!
//! Takes the window's commands. Gives events, edits and the newest tick; messages that do not fit into a full queue wait
//! here. Never waits: a step does what is due and returns.

use crate::lesson_backend::{InputDevice, LessonClient, LessonCommand, LessonConfig, LessonEvent, LessonQueues};
use crate::lesson_sound::LessonSound;
use crate::platform;
use crate::snapshot::{LessonSnapshot, LimitWarning};
use std::sync::Arc;
use typodont_audio::SoundSender;
use typodont_core::device::Device;
use typodont_devices::Driver;
use typodont_devices::mouse::Mouse;
use typodont_exercise::session::Input;
use typodont_lesson::live::LiveEvent;
use typodont_lesson::{Lesson, LessonError, PendingSecondHand, RecordedSession, SessionConfig};
use typodont_report::bundle::{CompletionStep, RecordingGrowth};
use web_time::{Duration, Instant};

/// Minimum time between two frames that movement of the hand requests.
const WAKE_INTERVAL: Duration = Duration::from_millis(16);

/// Interval between attempts to find a disconnected device.
const RECONNECT_INTERVAL: Duration = Duration::from_millis(500);

/// Interval at which the growth of a recording in memory is kept.
const KEEP_INTERVAL: Duration = Duration::from_millis(500);

/// A lesson that a backend runs.
pub struct LessonRun {
    port: LessonPort,
    phase: LessonPhase,
}

/// Phase of a lesson, and what is needed for it.
enum LessonPhase {
    Opening(Box<LessonConfig>, PointerDevice),
    Running(Box<RunningLesson>),
    /// The session is over, and its recording is closed.
    Recorded(Box<RecordedSession>),
    Over,
}

/// The window's pointer as a device, if it is the device of the lesson.
type PointerDevice = Option<Box<dyn Device + Send>>;

struct RunningLesson {
    lesson: Lesson,
    /// Opens the device again when it was disconnected.
    reconnect: Option<(&'static dyn Driver, Option<String>)>,
    last_attempt: Instant,
    /// Copy of the recording that is kept beyond this program's memory; `None` where the recording is in a folder.
    kept: Option<KeptRecording>,
}

/// Copy of a growing recording, which the browser keeps.
struct KeptRecording {
    session: String,
    growth: RecordingGrowth,
    /// Number of changes so far.
    changes: u32,
    last_change: Instant,
}

impl KeptRecording {
    fn new(session: String, growth: RecordingGrowth) -> KeptRecording {
        platform::begin_keeping(&session);
        let mut kept = KeptRecording { session, growth, changes: 0, last_change: Instant::now() };
        kept.keep();
        kept
    }

    /// Keeps what was written since the last time, if that was long enough ago.
    fn keep_if_due(&mut self) {
        if self.last_change.elapsed() >= KEEP_INTERVAL {
            self.keep();
        }
    }

    /// Keeps everything so far in place of the recording with which the session goes on.
    fn replace(&mut self, former: &str) {
        self.keep();
        platform::replace_recording(former);
    }

    fn keep(&mut self) {
        self.last_change = Instant::now();
        if let Some(change) = self.growth.take_change() {
            platform::keep_change(&self.session, self.changes, &change);
            self.changes += 1;
        }
    }
}

impl Drop for KeptRecording {
    /// Keeps the rest, also where the lesson ends with an error.
    fn drop(&mut self) {
        self.keep();
    }
}

impl LessonRun {
    /// Creates a lesson that has not begun, and the window's ends of its queues.
    pub fn new(config: LessonConfig, sounds: SoundSender) -> (LessonClient, LessonRun) {
        let (mouse, device): (_, PointerDevice) = match &config.input_device {
            InputDevice::Mouse => {
                let (mouse, device) = Mouse::new();
                (Some(mouse), Some(Box::new(device)))
            }
            InputDevice::Device(_) | InputDevice::InWorker(_) => (None, None),
        };
        let (client, queues) = LessonClient::with_queues(mouse);
        let port = LessonPort {
            queues,
            sound: LessonSound::new(&config.scenario, sounds),
            is_paused: false,
            shown: None,
            wake: config.wake.clone(),
        };
        (client, LessonRun { port, phase: LessonPhase::Opening(Box::new(config), device) })
    }

    /// Does what is due. Returns false once the lesson is over and the window has room for all its events, or is closed.
    pub fn advance(&mut self) -> bool {
        self.phase = match std::mem::replace(&mut self.phase, LessonPhase::Over) {
            LessonPhase::Over => {
                self.port.queues.events.flush();
                LessonPhase::Over
            }
            phase => self.port.advance(phase).unwrap_or_else(|failed| {
                self.port.send_event(LessonEvent::Failed(failed.to_string()));
                LessonPhase::Over
            }),
        };
        let is_over = matches!(self.phase, LessonPhase::Over);
        !is_over || !(self.port.queues.events.is_flushed() || self.port.queues.inbox.is_abandoned())
    }
}

/// The lesson's ends of its queues.
struct LessonPort {
    queues: LessonQueues,
    sound: LessonSound,
    is_paused: bool,
    /// The newest tick for which a frame was requested, and the time of the request.
    shown: Option<(LessonSnapshot, Instant)>,
    wake: Arc<dyn Fn() + Send + Sync>,
}

impl LessonPort {
    /// Does what is due in a phase, and returns the next one.
    fn advance(&mut self, phase: LessonPhase) -> Result<LessonPhase, LessonError> {
        match phase {
            LessonPhase::Opening(config, mouse) => {
                self.open(*config, mouse).map(|lesson| LessonPhase::Running(Box::new(lesson)))
            }
            LessonPhase::Running(running) => self.run(running),
            LessonPhase::Recorded(recorded) => {
                let bundle = recorded.complete(&mut |step| self.send_event(LessonEvent::Completing(step)))?;
                self.send_event(LessonEvent::Finished(bundle));
                Ok(LessonPhase::Over)
            }
            LessonPhase::Over => Ok(LessonPhase::Over),
        }
    }

    /// Makes the workpiece and begins the session.
    fn open(&mut self, config: LessonConfig, mouse: PointerDevice) -> Result<RunningLesson, LessonError> {
        let LessonConfig {
            scenario,
            seed,
            participant,
            out,
            templates,
            started,
            input_device,
            second,
            digests,
            resumed,
            is_kept,
            ..
        } = config;
        let open_device = match input_device {
            InputDevice::Mouse => None,
            InputDevice::Device(held) => Some(held),
            InputDevice::InWorker(name) => {
                return Err(LessonError::NoDevice { name, why: "the lesson's worker opens it".into() });
            }
        };
        let (name, device, reconnect) = match (open_device, mouse) {
            (Some(held), _) => (held.name, held.device, Some((held.driver, held.argument))),
            (None, Some(mouse)) => ("mouse".to_string(), mouse, None),
            (None, None) => {
                return Err(LessonError::NoDevice { name: "mouse".into(), why: "no device is connected".into() });
            }
        };
        let second =
            second.map(|(from, role)| PendingSecondHand::join(&from, role, (&name, device.spec()))).transpose()?;
        if let Some(address) = second.as_ref().and_then(PendingSecondHand::address) {
            self.send_event(LessonEvent::AwaitingSecondHand(address));
        }
        let former = resumed.as_ref().and_then(|reopened| reopened.session().kept_recording());
        let former = former.map(|(name, _)| name.to_string());
        let prepared = match resumed {
            Some(reopened) => {
                let workpiece = reopened.make_workpiece()?;
                self.send_event(LessonEvent::WorkpieceReady(workpiece.clone()));
                reopened.prepare(workpiece, device.spec().clone(), templates, started)?
            }
            None => {
                let opening = SessionConfig {
                    scenario,
                    seed,
                    participant: &participant,
                    out: out.as_deref(),
                    digests,
                    templates,
                    started,
                };
                let workpiece = opening.make_workpiece()?;
                // It is drawn while its recording is opened.
                self.send_event(LessonEvent::WorkpieceReady(workpiece.clone()));
                opening.prepare(workpiece, device.spec().clone(), None)?
            }
        };
        let mut kept = prepared.growth().filter(|_| is_kept).map(|growth| KeptRecording::new(prepared.name(), growth));
        let (mut lesson, events) = prepared.begin(device, second)?;
        if let Some((former, kept)) = former.zip(kept.as_mut()) {
            kept.replace(&former);
        }
        self.send_events(events);
        for edit in lesson.edits() {
            self.queues.edits.send(*edit);
        }
        lesson.await_movement();
        if reconnect.is_some() {
            // The buttons of a mouse have other functions.
            lesson.use_clutch_button();
        }
        Ok(RunningLesson { lesson, reconnect, last_attempt: Instant::now(), kept })
    }

    /// Passes on what happened; ends the session when it is complete or the window asks for it.
    fn run(&mut self, mut running: Box<RunningLesson>) -> Result<LessonPhase, LessonError> {
        let mut is_over = running.lesson.session().is_complete();
        if !is_over {
            self.publish(&mut running.lesson)?;
            self.reconnect(&mut running)?;
            is_over = self.handle_commands(&mut running.lesson)? || running.lesson.session().is_complete();
        }
        if !is_over {
            if let Some(kept) = &mut running.kept {
                kept.keep_if_due();
            }
            return Ok(LessonPhase::Running(running));
        }
        self.publish(&mut running.lesson)?;
        self.sound.silence();
        // What is kept receives the recording's end when it is dropped.
        let RunningLesson { lesson, kept: _kept, .. } = *running;
        let recorded = lesson.end()?;
        self.send_event(LessonEvent::Completing(CompletionStep::Scoring));
        Ok(LessonPhase::Recorded(Box::new(recorded)))
    }

    /// Looks for a disconnected device.
    fn reconnect(&mut self, running: &mut RunningLesson) -> Result<(), LessonError> {
        let RunningLesson { lesson, reconnect, last_attempt, .. } = running;
        if lesson.live().is_suspended()
            && last_attempt.elapsed() > RECONNECT_INTERVAL
            && let Some((driver, argument)) = reconnect
        {
            *last_attempt = Instant::now();
            if let Ok(device) = driver.open(argument.as_deref())
                && !lesson.resume_with(device)?
            {
                self.send_event(LessonEvent::DifferentDevice);
            }
        }
        Ok(())
    }

    /// Passes events, edits and the newest tick of the servo to the window.
    fn publish(&mut self, lesson: &mut Lesson) -> Result<(), LessonError> {
        let events = lesson.poll()?;
        self.send_events(events);
        while let Some(event) = lesson.next_assist_event() {
            self.send_event(LessonEvent::SecondHand(event));
        }
        let queues = &mut self.queues;
        for edit in lesson.edits() {
            queues.edits.send(*edit);
        }
        queues.edits.flush();
        queues.events.flush();
        let (session, live) = (lesson.session(), lesson.live());
        if let Some(step) = live.latest_step() {
            let snapshot = LessonSnapshot::new(
                step,
                lesson.handle_orientation(),
                session.stage_seconds(),
                session.cleared_pct(),
                live.timing(),
            );
            let limits = lesson.limits();
            let warning = limits.warning(step.tick).map(LimitWarning::from);
            let snapshot = LessonSnapshot { warning, assistant: live.assistant(), ..snapshot };
            self.queues.snapshot.write(snapshot.encode());
            match session.stage() {
                Some((_, stage)) if !self.is_paused && !live.is_suspended() => {
                    self.sound.update(step, stage.cutting, limits);
                }
                _ => self.sound.silence(),
            }
            if self.is_worth_a_frame(snapshot) {
                (self.wake)();
            }
        }
        Ok(())
    }

    /// True if a tick looks different from the last for which a frame was requested, and that is not too recent.
    fn is_worth_a_frame(&mut self, snapshot: LessonSnapshot) -> bool {
        let is_news = match &self.shown {
            None => true,
            Some((shown, at)) => at.elapsed() >= WAKE_INTERVAL && snapshot.looks_different(shown),
        };
        if is_news {
            self.shown = Some((snapshot, Instant::now()));
        }
        is_news
    }

    /// Carries out the window's commands; returns true when the lesson is to end.
    fn handle_commands(&mut self, lesson: &mut Lesson) -> Result<bool, LessonError> {
        // Checked first, so that commands sent before the window was closed are still carried out.
        let is_abandoned = self.queues.inbox.is_abandoned();
        while let Some(command) = self.queues.inbox.try_recv() {
            match command {
                LessonCommand::StageInput(stage, _)
                    if lesson.session().stage().map(|(running, _)| running) != Some(stage) => {}
                LessonCommand::Input(input) | LessonCommand::StageInput(_, input) => {
                    let events = lesson.submit(&input)?;
                    self.send_events(events);
                }
                LessonCommand::Pause(is_paused) => {
                    self.is_paused = is_paused;
                    lesson.set_paused(is_paused);
                }
                LessonCommand::PressClutch(is_down) => {
                    let events = lesson.press_clutch_key(is_down)?;
                    self.send_events(events);
                }
                LessonCommand::FinishQuestionnaire if lesson.session().are_stages_over() => return Ok(true),
                LessonCommand::FinishQuestionnaire => {}
            }
        }
        if is_abandoned {
            // The window was closed.
            lesson.submit(&Input::Abort)?;
            return Ok(true);
        }
        Ok(false)
    }

    fn send_events(&mut self, events: Vec<LiveEvent>) {
        for event in events {
            self.send_event(LessonEvent::Live(event));
        }
    }

    /// Sends an event, and requests a frame that shows it.
    fn send_event(&mut self, event: LessonEvent) {
        self.queues.events.send(event);
        (self.wake)();
    }
}
