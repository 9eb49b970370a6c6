//! The thread on which a lesson runs, and its messages to and from the window.
//!
//! The thread polls the servo every few milliseconds, whatever the window does; messages that do not fit into a full
//! queue wait on this side. The window reads the newest tick, all events in order, and all changed voxels in order.

use super::lesson_sound::LessonSound;
use super::snapshot::{LessonSnapshot, SNAPSHOT_WORDS};
use std::collections::{BTreeMap, VecDeque};
use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use typodont_audio::SoundSender;
use typodont_core::device::Device;
use typodont_core::mailbox;
use typodont_core::mailbox::{Receiver, Sender, SeqLock};
use typodont_core::volume::Edit;
use typodont_devices::mouse::Mouse;
use typodont_devices::servo::{SecondHandEvent, SecondHandRole};
use typodont_exercise::scenario::{Scenario, Workpiece};
use typodont_exercise::session::Input;
use typodont_lesson::live::LiveEvent;
use typodont_lesson::{
    Lesson, LessonError, OpenDevice, PendingSecondHand, PreparedSession, SessionConfig, SessionSeed, second_hand,
};
use typodont_report::Templates;
use typodont_report::bundle::CompletionStep;

/// Poll interval of the thread; a screen cannot show changes faster.
const POLL_INTERVAL: Duration = Duration::from_millis(4);

/// Minimum time between two frames that movement of the hand requests.
const WAKE_INTERVAL: Duration = Duration::from_millis(16);

/// Interval between attempts to find a disconnected device.
const RECONNECT_INTERVAL: Duration = Duration::from_millis(500);

/// Capacity of the command queue and of the event queue, messages.
const EVENT_CAPACITY: usize = 256;

/// Capacity of the queue of changed voxels: some seconds of the hardest cutting. Further ones wait in the thread.
const EDIT_CAPACITY: usize = 1 << 16;

/// A command from the window to the lesson.
pub enum LessonCommand {
    Input(Input),
    /// An input for the stage that the window showed. It is ignored if another stage runs by then, so that a second
    /// click does not end the next stage.
    StageInput(usize, Input),
    Pause(bool),
    /// Finishes the questionnaire, even if statements are not rated.
    FinishQuestionnaire,
}

/// An event of the lesson; the window receives all events in order.
pub enum LessonEvent {
    /// The workpiece is built; the servo is about to start.
    WorkpieceReady(Arc<Workpiece>),
    Live(LiveEvent),
    /// A second station with the key may connect to this address.
    AwaitingSecondHand(SocketAddr),
    SecondHand(SecondHandEvent),
    /// The device that was connected again is a different one.
    DifferentDevice,
    /// A step in the making of the bundle, after the session.
    Completing(CompletionStep),
    Finished(PathBuf),
    Failed(String),
}

/// Configuration of a lesson in the window.
pub struct LessonConfig {
    pub scenario: Arc<Scenario>,
    pub seed: SessionSeed,
    pub participant: String,
    pub out: PathBuf,
    pub templates: Templates,
    pub started: jiff::Timestamp,
    pub input_device: InputDevice,
    /// Source and role of a second hand that may join.
    pub second: Option<(second_hand::SecondHandSource, SecondHandRole)>,
    /// SHA-256 of files that the exercise does not name, by name.
    pub digests: BTreeMap<String, String>,
    /// Called when the window should draw a new frame.
    pub wake: Arc<dyn Fn() + Send + Sync>,
}

/// The trainee's input device.
pub enum InputDevice {
    /// The pointer of this window.
    Mouse,
    Device(OpenDevice),
}

/// The window's side of a lesson. When it is dropped, the lesson is aborted, the device's force is switched off and the
/// bundle is written.
pub struct LessonThread {
    commands: Option<Sender<LessonCommand>>,
    events: Receiver<LessonEvent>,
    edits: Receiver<Edit>,
    snapshot: Arc<SeqLock<SNAPSHOT_WORDS>>,
    /// Receives the pointer's movement if the pointer is the device.
    pub mouse: Option<Mouse>,
    thread: Option<JoinHandle<()>>,
}

impl LessonThread {
    /// Begins a lesson. A lesson that cannot begin reports [`LessonEvent::Failed`].
    ///
    /// # Errors
    /// The system's error if the thread cannot be started.
    pub fn start(config: LessonConfig, sounds: SoundSender) -> std::io::Result<LessonThread> {
        let (command_sender, inbox) = mailbox::channel(EVENT_CAPACITY);
        let (event_sender, events) = mailbox::channel(EVENT_CAPACITY);
        let (edit_sender, edits) = mailbox::channel(EDIT_CAPACITY);
        let snapshot = Arc::new(SeqLock::new());
        let worker = LessonWorker {
            inbox,
            events: BufferedSender::new(event_sender),
            edits: BufferedSender::new(edit_sender),
            snapshot: snapshot.clone(),
            sound: LessonSound::new(&config.scenario, sounds),
            is_paused: false,
            shown: None,
            wake: config.wake.clone(),
        };
        let LessonConfig { input_device, .. } = &config;
        let (mouse, device): (_, Option<Box<dyn Device + Send>>) = match input_device {
            InputDevice::Mouse => {
                let (mouse, device) = Mouse::new();
                (Some(mouse), Some(Box::new(device)))
            }
            InputDevice::Device(_) => (None, None),
        };
        let thread =
            std::thread::Builder::new().name("lesson".into()).spawn(move || run_worker(worker, config, device))?;
        Ok(LessonThread { commands: Some(command_sender), events, edits, snapshot, mouse, thread: Some(thread) })
    }

    /// Sends a command; returns false if the lesson has ended.
    pub fn send(&mut self, command: LessonCommand) -> bool {
        self.commands.as_mut().is_some_and(|post| post.try_send(command).is_ok())
    }

    pub fn next_event(&mut self) -> Option<LessonEvent> {
        self.events.try_recv()
    }

    pub fn next_edit(&mut self) -> Option<Edit> {
        self.edits.try_recv()
    }

    /// True when the lesson has ended and all its events have been read.
    pub fn is_finished(&self) -> bool {
        self.events.is_abandoned() && self.events.pending() == 0
    }

    /// The newest tick; `None` before the first, and while one is being written.
    pub fn snapshot(&self) -> Option<LessonSnapshot> {
        self.snapshot.read().map(|(_, words)| LessonSnapshot::decode(words))
    }
}

impl Drop for LessonThread {
    fn drop(&mut self) {
        // The commands' sender is dropped: the thread ends its lesson as aborted.
        self.commands = None;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// A bounded queue with a buffer before it: messages that do not fit wait in order.
struct BufferedSender<T> {
    sender: Sender<T>,
    queue: VecDeque<T>,
}

impl<T> BufferedSender<T> {
    fn new(sender: Sender<T>) -> BufferedSender<T> {
        BufferedSender { sender, queue: VecDeque::new() }
    }

    fn send(&mut self, item: T) {
        self.queue.push_back(item);
        self.flush();
    }

    /// Moves as many buffered messages into the queue as fit.
    fn flush(&mut self) {
        for _ in 0..self.sender.free_slots().min(self.queue.len()) {
            if let Some(item) = self.queue.pop_front() {
                // There is room: only this side fills it.
                let _ = self.sender.try_send(item);
            }
        }
    }
}

/// The thread's side of a lesson.
struct LessonWorker {
    inbox: Receiver<LessonCommand>,
    events: BufferedSender<LessonEvent>,
    edits: BufferedSender<Edit>,
    snapshot: Arc<SeqLock<SNAPSHOT_WORDS>>,
    sound: LessonSound,
    is_paused: bool,
    /// The newest tick for which a frame was requested, and the time of the request.
    shown: Option<(LessonSnapshot, Instant)>,
    wake: Arc<dyn Fn() + Send + Sync>,
}

fn run_worker(mut worker: LessonWorker, config: LessonConfig, mouse: Option<Box<dyn Device + Send>>) {
    let last = match run_lesson(&mut worker, config, mouse) {
        Ok(path) => LessonEvent::Finished(path),
        Err(failed) => LessonEvent::Failed(failed.to_string()),
    };
    worker.send_event(last);
    while !worker.events.queue.is_empty() && !worker.inbox.is_abandoned() {
        std::thread::sleep(POLL_INTERVAL);
        worker.events.flush();
    }
}

fn run_lesson(
    worker: &mut LessonWorker,
    config: LessonConfig,
    mouse: Option<Box<dyn Device + Send>>,
) -> Result<PathBuf, LessonError> {
    let LessonConfig { scenario, seed, participant, out, templates, started, input_device, second, digests, wake: _ } =
        config;
    let open_device = match input_device {
        InputDevice::Mouse => None,
        InputDevice::Device(held) => Some(held),
    };
    let (name, device, reconnect) = match (open_device, mouse) {
        (Some(held), _) => (held.name, held.device, Some((held.driver, held.argument))),
        (None, Some(mouse)) => ("mouse".to_string(), mouse, None),
        (None, None) => {
            return Err(LessonError::NoDevice { name: "mouse".into(), why: "no device is connected".into() });
        }
    };
    let second = second.map(|(from, role)| PendingSecondHand::join(&from, role, (&name, device.spec()))).transpose()?;
    if let Some(address) = second.as_ref().and_then(PendingSecondHand::address) {
        worker.send_event(LessonEvent::AwaitingSecondHand(address));
    }
    let opening =
        SessionConfig { scenario, seed, participant: &participant, out: Some(&out), digests, templates, started };
    let workpiece = opening.make_workpiece()?;
    // It is drawn while its recording is opened.
    worker.send_event(LessonEvent::WorkpieceReady(workpiece.clone()));
    let prepared: PreparedSession = opening.prepare(workpiece, device.spec().clone(), None)?;
    let (mut lesson, events) = prepared.begin(device, second)?;
    worker.send_events(events);
    lesson.await_movement();
    let mut last_attempt = Instant::now();
    while !lesson.session().is_complete() {
        std::thread::sleep(POLL_INTERVAL);
        worker.publish(&mut lesson)?;
        if lesson.live().is_suspended()
            && last_attempt.elapsed() > RECONNECT_INTERVAL
            && let Some((driver, argument)) = &reconnect
        {
            last_attempt = Instant::now();
            if let Ok(device) = driver.open(argument.as_deref())
                && !lesson.resume_with(device)?
            {
                worker.send_event(LessonEvent::DifferentDevice);
            }
        }
        if worker.handle_commands(&mut lesson)? {
            break;
        }
    }
    worker.publish(&mut lesson)?;
    worker.sound.silence();
    let recorded = lesson.end()?;
    let bundle = recorded.complete(&mut |step| worker.send_event(LessonEvent::Completing(step)))?;
    Ok(bundle.path().to_path_buf())
}

impl LessonWorker {
    /// Passes events, edits and the newest tick of the servo to the window.
    fn publish(&mut self, lesson: &mut Lesson) -> Result<(), LessonError> {
        let events = lesson.poll()?;
        self.send_events(events);
        while let Some(event) = lesson.next_assist_event() {
            self.send_event(LessonEvent::SecondHand(event));
        }
        for edit in lesson.edits() {
            self.edits.queue.push_back(*edit);
        }
        self.edits.flush();
        self.events.flush();
        let (session, live) = (lesson.session(), lesson.live());
        if let Some(step) = live.latest_step() {
            let snapshot = LessonSnapshot::new(
                step,
                lesson.handle_orientation(),
                session.stage_seconds(),
                session.cleared_pct(),
                live.timing(),
            );
            self.snapshot.write(snapshot.encode());
            match session.stage() {
                Some((_, stage)) if !self.is_paused && !live.is_suspended() => self.sound.update(step, stage.cutting),
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
        let is_abandoned = self.inbox.is_abandoned();
        while let Some(command) = self.inbox.try_recv() {
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
        self.events.send(event);
        (self.wake)();
    }
}
