//! The messages between a window and a lesson that runs in a worker, as texts and bytes.
//!
//! Takes and gives what crosses between [`crate::remote_lesson`] and [`crate::lesson_host`]. The events of a second hand have no
//! message: a page has one hand.

use crate::lesson_backend::{InputDevice, LessonCommand, LessonConfig, LessonEvent};
use crate::snapshot::SNAPSHOT_WORDS;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Mutex, PoisonError};
use typodont_audio::LOAD_WORDS;
use typodont_core::device::{DeviceError, DeviceState};
use typodont_core::frame::Vec3;
use typodont_core::sim::Command;
use typodont_core::tick::Tick;
use typodont_core::volume::{Density, Edit, Label, Voxel};
use typodont_devices::mouse::{HandTarget, MouseTarget};
use typodont_devices::realtime::Priority;
use typodont_exercise::record::{CommandFile, InputFile, SeedOriginFile};
use typodont_exercise::scenario::{self, ProbingSite, ResolveMode, Scenario};
use typodont_exercise::score::Verdict;
use typodont_exercise::session::{ChartEntry, ChartRecord, Effect, EndedBy, Input, InputError};
use typodont_formats::Library;
use typodont_formats::diagnostic::{SourceText, headlines};
use typodont_lesson::live::LiveEvent;
use typodont_lesson::{InterruptedSession, ReopenedSession, SessionSeed};
use typodont_report::bundle::{BundleFolder, CompletionStep};
use typodont_report::{FirstResult, SessionFile, Templates};

/// A message: a text, and bytes to which it refers by their order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LessonMessage {
    pub text: String,
    pub bytes: Vec<Vec<u8>>,
}

impl LessonMessage {
    /// # Errors
    /// A message if `content` cannot be written as a text.
    pub fn new(content: &impl Serialize, bytes: Vec<Vec<u8>>) -> Result<LessonMessage, String> {
        let text = serde_json::to_string(content).map_err(|error| format!("unreadable-message: {error}"))?;
        Ok(LessonMessage { text, bytes })
    }

    /// # Errors
    /// A message if the text is of another kind.
    pub fn content<T: DeserializeOwned>(&self) -> Result<T, String> {
        serde_json::from_str(&self.text).map_err(|error| format!("unreadable-message: {error}"))
    }
}

/// The first message to the lesson; its bytes are those of `files`.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
pub struct StartMessage {
    scenario: String,
    pub seed: u64,
    pub seed_origin: SeedOriginFile,
    pub participant: String,
    /// Start of the session, RFC 3339.
    pub started: String,
    pub digests: BTreeMap<String, String>,
    pub is_kept: bool,
    /// Device that the lesson opens; `None` for the pointer.
    pub device: Option<String>,
    /// Name of the interrupted session that goes on; its recording is the last of the bytes.
    resumed: Option<String>,
    /// Names of the files that the exercise names, as far as they are not shipped.
    files: Vec<String>,
}

impl StartMessage {
    /// The message that begins a lesson in an exercise whose files are in `library`.
    ///
    /// # Errors
    /// A message if it cannot be written.
    pub fn of(config: &LessonConfig, library: &Library) -> Result<LessonMessage, String> {
        let shipped: BTreeMap<String, Vec<u8>> = owned_files(&Library::shipped());
        let own = owned_files(library).into_iter().filter(|(name, bytes)| shipped.get(name) != Some(bytes));
        let (files, mut bytes): (_, Vec<_>) = own.unzip();
        let former = config.resumed.as_ref().and_then(|reopened| reopened.session().kept_recording());
        bytes.extend(former.map(|(_, recording)| recording.to_vec()));
        let start = StartMessage {
            scenario: config.scenario.text.to_string(),
            seed: config.seed.value,
            seed_origin: config.seed.origin,
            participant: config.participant.clone(),
            started: config.started.to_string(),
            digests: config.digests.clone(),
            is_kept: config.is_kept,
            device: match &config.input_device {
                InputDevice::InWorker(name) => Some(name.clone()),
                InputDevice::Mouse | InputDevice::Device(_) => None,
            },
            resumed: former.map(|(name, _)| name.to_string()),
            files,
        };
        LessonMessage::new(&start, bytes)
    }

    pub fn seed(&self) -> SessionSeed {
        SessionSeed { value: self.seed, origin: self.seed_origin }
    }

    /// The interrupted session that goes on, if one does; takes its recording from the bytes of the message.
    ///
    /// # Errors
    /// The reason why it cannot go on.
    pub fn reopen(&self, bytes: &mut Vec<Vec<u8>>) -> Result<Option<ReopenedSession>, String> {
        let Some(name) = &self.resumed else { return Ok(None) };
        let recording = bytes.pop().unwrap_or_default();
        let session = InterruptedSession::kept(name, recording).ok_or("unreadable-message: no recording")?;
        session.reopen().map(Some).map_err(|why| why.to_string())
    }

    /// The exercise; `bytes` are those of its files.
    ///
    /// # Errors
    /// The complaints about an exercise that cannot be used.
    pub fn scenario(&self, bytes: Vec<Vec<u8>>) -> Result<Scenario, String> {
        let mut library = Library::shipped();
        for (name, bytes) in self.files.iter().zip(bytes) {
            library.insert(name, bytes);
        }
        // The window has named the exercise already if there is anything to complain about.
        let source = SourceText::new("exercise", self.scenario.clone());
        scenario::resolve(source, &library, ResolveMode::ReadScans).map_err(|found| headlines(&found))
    }
}

fn owned_files(library: &Library) -> BTreeMap<String, Vec<u8>> {
    library.files_in_memory().map(|(name, bytes)| (name.to_string(), bytes.to_vec())).collect()
}

/// Commands and pointer of a frame of the window.
#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct WindowMessage {
    pub commands: Vec<CommandMessage>,
    pub mouse: Option<MouseMessage>,
}

/// Message form of [`LessonCommand`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CommandMessage {
    Input(InputFile),
    StageInput(usize, InputFile),
    Pause(bool),
    PressClutch(bool),
    FinishQuestionnaire,
}

impl From<&LessonCommand> for CommandMessage {
    fn from(command: &LessonCommand) -> CommandMessage {
        match command {
            LessonCommand::Input(input) => CommandMessage::Input(InputFile::from(input)),
            LessonCommand::StageInput(stage, input) => CommandMessage::StageInput(*stage, InputFile::from(input)),
            LessonCommand::Pause(is_paused) => CommandMessage::Pause(*is_paused),
            LessonCommand::PressClutch(is_pressed) => CommandMessage::PressClutch(*is_pressed),
            LessonCommand::FinishQuestionnaire => CommandMessage::FinishQuestionnaire,
        }
    }
}

impl From<CommandMessage> for LessonCommand {
    fn from(message: CommandMessage) -> LessonCommand {
        match message {
            CommandMessage::Input(input) => LessonCommand::Input(Input::from(input)),
            CommandMessage::StageInput(stage, input) => LessonCommand::StageInput(stage, Input::from(input)),
            CommandMessage::Pause(is_paused) => LessonCommand::Pause(is_paused),
            CommandMessage::PressClutch(is_pressed) => LessonCommand::PressClutch(is_pressed),
            CommandMessage::FinishQuestionnaire => LessonCommand::FinishQuestionnaire,
        }
    }
}

/// Message form of [`MouseTarget`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MouseMessage {
    place_mm: [f32; 3],
    max_force_n: f32,
    yaw_rad: f32,
    lean: [f32; 2],
    buttons: u32,
}

impl From<MouseTarget> for MouseMessage {
    fn from(target: MouseTarget) -> MouseMessage {
        let MouseTarget { hand: HandTarget { place, max_force, yaw, lean }, buttons } = target;
        MouseMessage { place_mm: place.to_array(), max_force_n: max_force, yaw_rad: yaw, lean, buttons }
    }
}

impl From<MouseMessage> for MouseTarget {
    fn from(message: MouseMessage) -> MouseTarget {
        let MouseMessage { place_mm, max_force_n, yaw_rad, lean, buttons } = message;
        let hand = HandTarget { place: Vec3::from_array(place_mm), max_force: max_force_n, yaw: yaw_rad, lean };
        MouseTarget { hand, buttons }
    }
}

/// News of the lesson since its last message. The first bytes are the changed voxels.
#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LessonNews {
    /// True if the window should draw a frame.
    pub is_worth_a_frame: bool,
    pub snapshot: Option<[u32; SNAPSHOT_WORDS]>,
    /// The load that is to be heard from now on.
    pub load: Option<[u32; LOAD_WORDS]>,
    /// Strengths of new cries of the patient.
    pub cries: Vec<f32>,
    pub events: Vec<EventMessage>,
    /// True if the lesson is over, and this is its last message.
    pub is_over: bool,
}

/// Message form of [`LessonEvent`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EventMessage {
    ServoStarted,
    Effect(EffectMessage),
    DeviceState(DeviceStateMessage),
    DeviceLost {
        why: String,
        code: i32,
    },
    DifferentDevice,
    AwaitingMovement(bool),
    Completing(StepMessage),
    /// The bundle; the bytes of its files follow those of the changed voxels.
    Finished {
        name: String,
        files: Vec<String>,
    },
    Failed(String),
}

/// Message form of [`DeviceState`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DeviceStateMessage {
    Ready,
    Calibrate(String),
    Homing(String),
    ForceOff(String),
}

impl From<DeviceState> for DeviceStateMessage {
    fn from(state: DeviceState) -> DeviceStateMessage {
        match state {
            DeviceState::Ready => DeviceStateMessage::Ready,
            DeviceState::Calibrate { how } => DeviceStateMessage::Calibrate(how.into()),
            DeviceState::Homing { what } => DeviceStateMessage::Homing(what.into()),
            DeviceState::ForceOff { why } => DeviceStateMessage::ForceOff(why.into()),
        }
    }
}

impl From<DeviceStateMessage> for DeviceState {
    fn from(message: DeviceStateMessage) -> DeviceState {
        match message {
            DeviceStateMessage::Ready => DeviceState::Ready,
            DeviceStateMessage::Calibrate(how) => DeviceState::Calibrate { how: driver_text(how) },
            DeviceStateMessage::Homing(what) => DeviceState::Homing { what: driver_text(what) },
            DeviceStateMessage::ForceOff(why) => DeviceState::ForceOff { why: driver_text(why) },
        }
    }
}

/// A driver's text that has crossed. Drivers have some dozens of constant texts; each is kept once.
fn driver_text(text: String) -> &'static str {
    static TEXTS: Mutex<BTreeSet<&str>> = Mutex::new(BTreeSet::new());
    let mut texts = TEXTS.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(known) = texts.get(&*text) {
        return known;
    }
    let kept = text.leak();
    texts.insert(kept);
    kept
}

/// Message form of [`Effect`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EffectMessage {
    Command(CommandFile),
    StageStarted(usize),
    StepStarted { stage: usize, step: usize },
    Answered { stage: usize, question: usize },
    Charted { stage: usize, record: ChartMessage, is_present: bool },
    StageEnded { stage: usize, by: EndedBy },
    StagesOver,
    Refused(InputError),
}

/// Message form of [`ChartRecord`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ChartMessage {
    /// Place in [`ProbingSite::ALL`].
    site: usize,
    tick: u64,
    /// Reading, depth in mm and force in N of a probing; `None` for calculus.
    probing: Option<(u8, f32, f32)>,
}

/// Message form of [`CompletionStep`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StepMessage {
    Scoring,
    Scored {
        session: Box<SessionFile>,
        /// Ids of the verdicts of the legend, and the volume of each, mm³.
        legend: Vec<(String, f64)>,
    },
    Maps,
    Surfaces,
    Pictures {
        done: usize,
        all: usize,
    },
    Page,
    Saving,
}

impl EventMessage {
    /// The message of an event, and the bytes that belong to it; `None` for an event of a second hand, which a page does not
    /// have, and for the workpiece, which the window makes by itself.
    pub fn of(event: LessonEvent) -> Option<(EventMessage, Vec<Vec<u8>>)> {
        let message = match event {
            LessonEvent::Live(LiveEvent::ServoStarted(_)) => EventMessage::ServoStarted,
            LessonEvent::Live(LiveEvent::Effect(effect)) => EventMessage::Effect(EffectMessage::from(&effect)),
            LessonEvent::Live(LiveEvent::DeviceState(state)) => EventMessage::DeviceState(state.into()),
            LessonEvent::Live(LiveEvent::DeviceLost(DeviceError::Lost { why, code })) => {
                EventMessage::DeviceLost { why: why.into(), code }
            }
            LessonEvent::DifferentDevice => EventMessage::DifferentDevice,
            LessonEvent::Live(LiveEvent::AwaitingMovement(is_awaiting)) => EventMessage::AwaitingMovement(is_awaiting),
            LessonEvent::Completing(step) => EventMessage::Completing(StepMessage::from(step)),
            LessonEvent::Failed(why) => EventMessage::Failed(why),
            LessonEvent::Finished(BundleFolder::InMemory { name, files }) => {
                let (files, bytes) = files.into_iter().unzip();
                return Some((EventMessage::Finished { name, files }, bytes));
            }
            LessonEvent::Finished(BundleFolder::OnDisk(_))
            | LessonEvent::WorkpieceReady(_)
            | LessonEvent::AwaitingSecondHand(_)
            | LessonEvent::SecondHand(_)
            // Only a script or a recording ends.
            | LessonEvent::Live(LiveEvent::DeviceLost(DeviceError::Ended)) => return None,
        };
        Some((message, Vec::new()))
    }

    /// Takes the bytes that belong to the event from those of the message.
    pub fn take_bytes(&self, bytes: &mut impl Iterator<Item = Vec<u8>>) -> Vec<Vec<u8>> {
        let count = if let EventMessage::Finished { files, .. } = self { files.len() } else { 0 };
        bytes.take(count).collect()
    }

    /// The event; `bytes` are those that belong to it.
    pub fn event(self, bytes: Vec<Vec<u8>>, scenario: &Scenario, templates: &Templates) -> LessonEvent {
        match self {
            EventMessage::ServoStarted => LessonEvent::Live(LiveEvent::ServoStarted(Priority::Ordinary)),
            EventMessage::Effect(effect) => LessonEvent::Live(LiveEvent::Effect(Effect::from(effect))),
            EventMessage::DeviceState(state) => LessonEvent::Live(LiveEvent::DeviceState(state.into())),
            EventMessage::DeviceLost { why, code } => {
                LessonEvent::Live(LiveEvent::DeviceLost(DeviceError::Lost { why: driver_text(why), code }))
            }
            EventMessage::DifferentDevice => LessonEvent::DifferentDevice,
            EventMessage::AwaitingMovement(is_awaiting) => LessonEvent::Live(LiveEvent::AwaitingMovement(is_awaiting)),
            EventMessage::Completing(step) => LessonEvent::Completing(step.step(scenario, templates)),
            EventMessage::Finished { name, files } => {
                LessonEvent::Finished(BundleFolder::InMemory { name, files: files.into_iter().zip(bytes).collect() })
            }
            EventMessage::Failed(why) => LessonEvent::Failed(why),
        }
    }
}

impl From<&Effect> for EffectMessage {
    fn from(effect: &Effect) -> EffectMessage {
        match *effect {
            Effect::Command(ref command) => EffectMessage::Command(CommandFile::from(command)),
            Effect::StageStarted { stage } => EffectMessage::StageStarted(stage),
            Effect::StepStarted { stage, step } => EffectMessage::StepStarted { stage, step },
            Effect::Answered { stage, question } => EffectMessage::Answered { stage, question },
            Effect::Charted { stage, ref record, is_present } => {
                EffectMessage::Charted { stage, record: ChartMessage::from(record), is_present }
            }
            Effect::StageEnded { stage, by } => EffectMessage::StageEnded { stage, by },
            Effect::StagesOver => EffectMessage::StagesOver,
            Effect::Refused { why } => EffectMessage::Refused(why),
        }
    }
}

impl From<EffectMessage> for Effect {
    fn from(message: EffectMessage) -> Effect {
        match message {
            EffectMessage::Command(command) => Effect::Command(Command::from(&command)),
            EffectMessage::StageStarted(stage) => Effect::StageStarted { stage },
            EffectMessage::StepStarted { stage, step } => Effect::StepStarted { stage, step },
            EffectMessage::Answered { stage, question } => Effect::Answered { stage, question },
            EffectMessage::Charted { stage, record, is_present } => {
                Effect::Charted { stage, record: ChartRecord::from(record), is_present }
            }
            EffectMessage::StageEnded { stage, by } => Effect::StageEnded { stage, by },
            EffectMessage::StagesOver => Effect::StagesOver,
            EffectMessage::Refused(why) => Effect::Refused { why },
        }
    }
}

impl From<&ChartRecord> for ChartMessage {
    fn from(record: &ChartRecord) -> ChartMessage {
        let probing = match record.entry {
            ChartEntry::Depth { reading, depth, force } => Some((reading, depth, force)),
            ChartEntry::Calculus => None,
        };
        let site = ProbingSite::ALL.iter().position(|site| *site == record.site).unwrap_or(0);
        ChartMessage { site, tick: record.at.0, probing }
    }
}

impl From<ChartMessage> for ChartRecord {
    fn from(message: ChartMessage) -> ChartRecord {
        let ChartMessage { site, tick, probing } = message;
        let entry = match probing {
            Some((reading, depth, force)) => ChartEntry::Depth { reading, depth, force },
            None => ChartEntry::Calculus,
        };
        let site = ProbingSite::ALL.get(site).copied().unwrap_or(ProbingSite::ALL[0]);
        ChartRecord { site, at: Tick(tick), entry }
    }
}

impl From<CompletionStep> for StepMessage {
    fn from(step: CompletionStep) -> StepMessage {
        match step {
            CompletionStep::Scoring => StepMessage::Scoring,
            CompletionStep::Scored(first) => {
                let FirstResult { session, legend, .. } = *first;
                let legend = legend.iter().map(|entry| (entry.verdict.id().to_string(), entry.volume)).collect();
                StepMessage::Scored { session: Box::new(session), legend }
            }
            CompletionStep::Maps => StepMessage::Maps,
            CompletionStep::Surfaces => StepMessage::Surfaces,
            CompletionStep::Pictures { done, all } => StepMessage::Pictures { done, all },
            CompletionStep::Page => StepMessage::Page,
            CompletionStep::Saving => StepMessage::Saving,
        }
    }
}

impl StepMessage {
    fn step(self, scenario: &Scenario, templates: &Templates) -> CompletionStep {
        match self {
            StepMessage::Scoring => CompletionStep::Scoring,
            StepMessage::Scored { session, legend } => {
                let volumes: Vec<(Verdict, f64)> =
                    legend.into_iter().filter_map(|(id, mm3)| Some((verdict(&id)?, mm3))).collect();
                CompletionStep::Scored(Box::new(FirstResult::of_session(*session, &volumes, scenario, templates)))
            }
            StepMessage::Maps => CompletionStep::Maps,
            StepMessage::Surfaces => CompletionStep::Surfaces,
            StepMessage::Pictures { done, all } => CompletionStep::Pictures { done, all },
            StepMessage::Page => CompletionStep::Page,
            StepMessage::Saving => CompletionStep::Saving,
        }
    }
}

/// The verdict of a legend with this id.
fn verdict(id: &str) -> Option<Verdict> {
    Verdict::VISIBLE.into_iter().chain(Verdict::OF_FILLINGS).find(|verdict| verdict.id() == id)
}

/// Bytes of changed voxels, in order.
pub fn edit_bytes(edits: impl Iterator<Item = Edit>) -> Vec<u8> {
    edits.flat_map(|edit| edit.bytes()).collect()
}

/// The changed voxels of [`edit_bytes`].
pub fn edits(bytes: &[u8]) -> impl Iterator<Item = Edit> {
    let voxel = |density: u8, label: u8| Voxel { density: Density::from_bits(density), label: Label(label) };
    bytes.chunks_exact(8).map(move |chunk| Edit {
        index: u32::from_le_bytes([chunk[0], chunk[1], chunk[2], chunk[3]]),
        before: voxel(chunk[4], chunk[5]),
        after: voxel(chunk[6], chunk[7]),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use typodont_core::frame::Quat;
    use typodont_core::sim::HandFrame;
    use typodont_exercise::session::{AnswerValue, ChartInput};

    fn crossed<T: Serialize + DeserializeOwned>(content: &T) -> T {
        LessonMessage::new(content, Vec::new()).unwrap().content().unwrap()
    }

    #[test]
    fn commands_and_effects_come_out_as_they_went_in() {
        let word = |value: AnswerValue| Input::Answer { question: "tooth".into(), value };
        let inputs = [
            Input::Take { instrument: 2 },
            word(AnswerValue::Word("46".into())),
            word(AnswerValue::Quadrant(3)),
            word(AnswerValue::Number(0.1)),
            Input::Chart(ChartInput::Calculus),
            Input::PlaceHand(HandFrame {
                orientation: Quat::from_rotation_y(0.3),
                scale: 1.7,
                middle: Some(Vec3::new(1.0, -2.5, 0.25)),
                is_free: true,
            }),
            Input::Abort,
        ];
        for input in inputs {
            let LessonCommand::StageInput(4, again) =
                crossed(&CommandMessage::from(&LessonCommand::StageInput(4, input.clone()))).into()
            else {
                panic!("another command than {input:?}");
            };
            assert_eq!(again, input);
        }
        let record = |entry| ChartRecord { site: ProbingSite::DistoLingual, at: Tick(77), entry };
        let charted = |entry| Effect::Charted { stage: 1, record: record(entry), is_present: true };
        let effects = [
            Effect::Command(Command::SelectInstrument { instrument: 3 }),
            Effect::StageStarted { stage: 2 },
            Effect::StepStarted { stage: 2, step: 1 },
            Effect::Answered { stage: 0, question: 1 },
            charted(ChartEntry::Depth { reading: 4, depth: 4.3, force: 0.21 }),
            charted(ChartEntry::Calculus),
            Effect::StageEnded { stage: 0, by: EndedBy::Cleared },
            Effect::StagesOver,
            Effect::Refused { why: InputError::NotInSulcus },
        ];
        for effect in effects {
            assert_eq!(Effect::from(crossed(&EffectMessage::from(&effect))), effect);
        }
    }

    #[test]
    fn states_of_a_device_come_out_as_they_went_in() {
        let force_off = DeviceState::ForceOff { why: "its motors are too warm" };
        let states = [
            DeviceState::Ready,
            DeviceState::Calibrate { how: "press its button" },
            DeviceState::Homing { what: "it is starting" },
            force_off,
        ];
        for state in states {
            assert_eq!(DeviceState::from(crossed(&DeviceStateMessage::from(state))), state);
        }
        assert_eq!(driver_text("a".into()).as_ptr(), driver_text("a".into()).as_ptr(), "kept once");
    }

    #[test]
    fn changed_voxels_and_verdicts_come_out_as_they_went_in() {
        let voxel = |density, label| Voxel { density: Density::from_bits(density), label: Label(label) };
        let changed = [
            Edit { index: 70_000, before: voxel(255, 3), after: voxel(120, 3) },
            Edit { index: u32::MAX, before: voxel(1, 9), after: Voxel::AIR },
        ];
        assert_eq!(edits(&edit_bytes(changed.into_iter())).collect::<Vec<_>>(), changed);
        for shown in Verdict::VISIBLE.into_iter().chain(Verdict::OF_FILLINGS) {
            assert_eq!(verdict(shown.id()), Some(shown));
        }
        assert_eq!(verdict("none"), None);
    }
}
