//! A lesson as the window drives it: its messages, and the backend on which it runs.
//!
//! A lesson runs on a thread of its own or, in a page, which has no threads, in a worker beside it. The window notices no
//! difference: it sends commands, and reads the newest tick, all events in order, and all changed voxels in order. Nothing
//! else crosses between them but the position of the pointer, if that is the device.

use crate::snapshot::{LessonSnapshot, SNAPSHOT_WORDS};
use std::collections::{BTreeMap, VecDeque};
use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::Arc;
use typodont_core::mailbox::{self, Receiver, Sender, SeqLock};
use typodont_core::volume::Edit;
use typodont_devices::mouse::Mouse;
use typodont_devices::servo::{SecondHandEvent, SecondHandRole};
use typodont_exercise::scenario::{Scenario, Workpiece};
use typodont_exercise::session::Input;
use typodont_lesson::live::LiveEvent;
use typodont_lesson::{OpenDevice, ReopenedSession, SessionSeed, second_hand};
use typodont_report::Templates;
use typodont_report::bundle::{BundleFolder, CompletionStep};

/// A command from the window to the lesson.
pub enum LessonCommand {
    Input(Input),
    /// An input for the stage that the window showed. It is ignored if another stage runs by then, so that a second
    /// click does not end the next stage.
    StageInput(usize, Input),
    Pause(bool),
    /// Presses the clutch of an arm by a key, or releases it.
    PressClutch(bool),
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
    Finished(BundleFolder),
    Failed(String),
}

/// Configuration of a lesson in the window.
pub struct LessonConfig {
    pub scenario: Arc<Scenario>,
    pub seed: SessionSeed,
    pub participant: String,
    /// Folder in which the bundle is made; in memory without one.
    pub out: Option<PathBuf>,
    pub templates: Templates,
    pub started: jiff::Timestamp,
    pub input_device: InputDevice,
    /// Source and role of a second hand that may join.
    pub second: Option<(second_hand::SecondHandSource, SecondHandRole)>,
    /// SHA-256 of files that the exercise does not name, by name.
    pub digests: BTreeMap<String, String>,
    /// The interrupted session that goes on; the other fields are then those with which it began.
    pub resumed: Option<ReopenedSession>,
    /// True if a page keeps the recording in case it is closed; an author's test run is not kept.
    pub is_kept: bool,
    /// Called when the window should draw a new frame.
    pub wake: Arc<dyn Fn() + Send + Sync>,
}

impl LessonConfig {
    /// True if the hand can be placed anew for the view: it is an arm's, and not coupled to a second hand, because the
    /// coupling holds in the space of both devices.
    pub fn is_hand_placeable(&self) -> bool {
        !matches!(self.input_device, InputDevice::Mouse) && self.second.is_none()
    }
}

/// The trainee's input device.
pub enum InputDevice {
    /// The pointer of this window.
    Mouse,
    Device(OpenDevice),
    /// The device of this name, which is opened in the lesson's worker.
    InWorker(String),
}

/// Runner of a lesson. When a lesson on a thread is dropped after its [`LessonClient`], it is aborted, the device's force is
/// switched off and the bundle is written; a lesson in a page's worker ends at once.
pub trait LessonBackend {
    /// Takes over what the lesson has sent, unless it reaches the window by itself.
    fn advance(&mut self);

    /// Passes on the commands and the pointer of a frame, unless they reach the lesson by themselves.
    fn pass_on(&mut self);

    /// True if every frame must be followed by another for the lesson to begin.
    fn needs_frames(&self) -> bool;
}

/// Capacity of the command queue and of the event queue, messages.
const EVENT_CAPACITY: usize = 256;

/// Capacity of the queue of changed voxels: some seconds of the hardest cutting. Further ones wait in the lesson.
const EDIT_CAPACITY: usize = 1 << 16;

/// The window's ends of a lesson's queues.
pub struct LessonClient {
    commands: Sender<LessonCommand>,
    events: Receiver<LessonEvent>,
    edits: Receiver<Edit>,
    snapshot: Arc<SeqLock<SNAPSHOT_WORDS>>,
    /// Receives the pointer's movement if the pointer is the device.
    pub mouse: Option<Mouse>,
}

/// The lesson's ends of those queues.
pub(super) struct LessonQueues {
    pub inbox: Receiver<LessonCommand>,
    pub events: BufferedSender<LessonEvent>,
    pub edits: BufferedSender<Edit>,
    pub snapshot: Arc<SeqLock<SNAPSHOT_WORDS>>,
}

impl LessonClient {
    /// Creates the queues of a lesson; `mouse` is the pointer if that is the device.
    pub(super) fn with_queues(mouse: Option<Mouse>) -> (LessonClient, LessonQueues) {
        let (commands, inbox) = mailbox::channel(EVENT_CAPACITY);
        let (event_sender, events) = mailbox::channel(EVENT_CAPACITY);
        let (edit_sender, edits) = mailbox::channel(EDIT_CAPACITY);
        let snapshot = Arc::new(SeqLock::new());
        let queues = LessonQueues {
            inbox,
            events: BufferedSender::new(event_sender),
            edits: BufferedSender::new(edit_sender),
            snapshot: snapshot.clone(),
        };
        (LessonClient { commands, events, edits, snapshot, mouse }, queues)
    }

    /// Sends a command; returns false if the lesson has ended.
    pub fn send(&mut self, command: LessonCommand) -> bool {
        self.commands.try_send(command).is_ok()
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
        self.snapshot_words().map(LessonSnapshot::decode)
    }

    /// The words of [`LessonClient::snapshot`].
    pub fn snapshot_words(&self) -> Option<[u32; SNAPSHOT_WORDS]> {
        self.snapshot.read().map(|(_, words)| words)
    }
}

/// A bounded queue with a buffer before it: messages that do not fit wait in order.
pub(super) struct BufferedSender<T> {
    sender: Sender<T>,
    queue: VecDeque<T>,
}

impl<T> BufferedSender<T> {
    fn new(sender: Sender<T>) -> BufferedSender<T> {
        BufferedSender { sender, queue: VecDeque::new() }
    }

    /// Sends a message, or keeps it until there is room.
    pub fn send(&mut self, item: T) {
        self.queue.push_back(item);
        self.flush();
    }

    /// Moves as many buffered messages into the queue as fit.
    pub fn flush(&mut self) {
        for _ in 0..self.sender.free_slots().min(self.queue.len()) {
            if let Some(item) = self.queue.pop_front() {
                // There is room: only this side fills it.
                let _ = self.sender.try_send(item);
            }
        }
    }

    /// True if no message waits for room.
    pub fn is_flushed(&self) -> bool {
        self.queue.is_empty()
    }
}
