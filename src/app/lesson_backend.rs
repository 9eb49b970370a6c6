//! A lesson as the window drives it: its messages, and the backend on which it runs.
//!
//! A lesson runs on a thread of its own or, in a page, which has no threads, within the window's frames. The window
//! notices no difference: it sends commands, and reads the newest tick, all events in order, and all changed voxels in
//! order. Nothing else crosses between them, so that a backend may also be a worker that passes these messages on.

use crate::snapshot::{LessonSnapshot, SNAPSHOT_WORDS};
use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::Arc;
use typodont_core::mailbox::{Receiver, Sender, SeqLock};
use typodont_core::volume::Edit;
use typodont_devices::mouse::Mouse;
use typodont_devices::servo::{SecondHandEvent, SecondHandRole};
use typodont_exercise::scenario::{Scenario, Workpiece};
use typodont_exercise::session::Input;
use typodont_lesson::live::LiveEvent;
use typodont_lesson::{OpenDevice, SessionSeed, second_hand};
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
    /// True if a page keeps the recording in case it is closed; an author's test run is not kept.
    pub is_kept: bool,
    /// Called when the window should draw a new frame.
    pub wake: Arc<dyn Fn() + Send + Sync>,
}

impl LessonConfig {
    /// True if the hand can be placed anew for the view: it is an arm's, and not coupled to a second hand, because the
    /// coupling holds in the space of both devices.
    pub fn is_hand_placeable(&self) -> bool {
        matches!(self.input_device, InputDevice::Device(_)) && self.second.is_none()
    }
}

/// The trainee's input device.
pub enum InputDevice {
    /// The pointer of this window.
    Mouse,
    Device(OpenDevice),
}

/// Runner of a lesson. When it is dropped after its [`LessonClient`], the lesson is aborted, the device's force is
/// switched off and the bundle is written.
pub trait LessonBackend {
    /// Does what has become due, unless the lesson has a thread of its own.
    fn advance(&mut self);

    /// True if the lesson runs only within frames, so that every frame must be followed by another.
    fn needs_frames(&self) -> bool;
}

/// The window's ends of a lesson's queues.
pub struct LessonClient {
    pub(super) commands: Sender<LessonCommand>,
    pub(super) events: Receiver<LessonEvent>,
    pub(super) edits: Receiver<Edit>,
    pub(super) snapshot: Arc<SeqLock<SNAPSHOT_WORDS>>,
    /// Receives the pointer's movement if the pointer is the device.
    pub mouse: Option<Mouse>,
}

impl LessonClient {
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
        self.snapshot.read().map(|(_, words)| LessonSnapshot::decode(words))
    }
}
