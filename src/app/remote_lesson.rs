//! The window's side of a lesson that runs in a worker.
//!
//! Takes the messages of the lesson, in order. Gives them to the window as a lesson on a thread would, and passes on the
//! window's commands and its pointer. Makes the workpiece a second time, for the picture: the same exercise and seed give the
//! same one, and meanwhile the worker prepares the session.

use crate::lesson_backend::{InputDevice, LessonBackend, LessonClient, LessonConfig, LessonEvent, LessonQueues};
use crate::lesson_message::{
    CommandMessage, LessonMessage, LessonNews, MouseMessage, StartMessage, WindowMessage, edits,
};
use crate::platform::FRAMES_BEFORE_LONG_STEP;
use std::sync::Arc;
use std::sync::mpsc::Receiver;
use typodont_audio::{DrillLoad, SoundSender};
use typodont_devices::mouse::{Mouse, MouseTarget};
use typodont_exercise::scenario::{Scenario, Workpiece};
use typodont_formats::Library;
use typodont_lesson::ReopenedSession;
use typodont_report::Templates;

/// A message from the worker, or its failure.
pub enum Arrival {
    News(LessonNews, Vec<Vec<u8>>),
    /// The worker could not be started, or has crashed.
    Failed(String),
}

/// Sends a message to the lesson.
pub type MessageSender = Box<dyn FnMut(LessonMessage)>;

pub struct RemoteLesson {
    send: MessageSender,
    arrivals: Receiver<Arrival>,
    /// The ends of the window's queues; `None` when the lesson is over.
    queues: Option<LessonQueues>,
    sounds: SoundSender,
    /// The pointer, if it is the device.
    mouse: Option<Mouse>,
    passed_on: Option<MouseTarget>,
    /// True once the lesson has sent its last message.
    is_over: bool,
    scenario: Arc<Scenario>,
    templates: Templates,
    /// Origin of the workpiece until it is made, and the frames that were drawn since.
    opening: Option<(WorkpieceOrigin, u32)>,
}

/// Origin of the workpiece that is drawn.
enum WorkpieceOrigin {
    Seed(u64),
    /// The recording of a session that goes on.
    Recording(Box<ReopenedSession>),
}

impl RemoteLesson {
    /// Begins a lesson in a worker, to which `send` leads and from which `arrivals` come.
    ///
    /// # Errors
    /// A message if the lesson cannot be described to the worker.
    pub fn start(
        config: LessonConfig,
        library: &Library,
        sounds: SoundSender,
        mut send: MessageSender,
        arrivals: Receiver<Arrival>,
    ) -> Result<(LessonClient, RemoteLesson), String> {
        send(StartMessage::of(&config, library)?);
        let origin = match config.resumed {
            Some(reopened) => WorkpieceOrigin::Recording(Box::new(reopened)),
            None => WorkpieceOrigin::Seed(config.seed.value),
        };
        let mouse = matches!(config.input_device, InputDevice::Mouse).then(|| Mouse::new().0);
        let (client, queues) = LessonClient::with_queues(mouse.clone());
        let lesson = RemoteLesson {
            send,
            arrivals,
            queues: Some(queues),
            sounds,
            mouse,
            passed_on: None,
            is_over: false,
            scenario: config.scenario,
            templates: config.templates,
            opening: Some((origin, 0)),
        };
        Ok((client, lesson))
    }

    /// Makes the workpiece that is drawn, once the screen says so. Returns true when it is made.
    fn open(&mut self) -> bool {
        let Some((origin, frames)) = &mut self.opening else { return true };
        if *frames < FRAMES_BEFORE_LONG_STEP {
            *frames += 1;
            return false;
        }
        let workpiece = match origin {
            WorkpieceOrigin::Seed(seed) => Workpiece::make(&self.scenario, *seed).ok().map(Arc::new),
            WorkpieceOrigin::Recording(reopened) => reopened.make_workpiece().ok(),
        };
        // If it cannot be made, the worker says why.
        if let Some((workpiece, queues)) = workpiece.zip(self.queues.as_mut()) {
            queues.events.send(LessonEvent::WorkpieceReady(workpiece));
        }
        self.opening = None;
        true
    }

    fn receive(&mut self, arrival: Arrival) {
        let Some(queues) = &mut self.queues else { return };
        let (news, bytes) = match arrival {
            Arrival::News(news, bytes) => (news, bytes),
            Arrival::Failed(why) => {
                queues.events.send(LessonEvent::Failed(why));
                self.is_over = true;
                return;
            }
        };
        let mut bytes = bytes.into_iter();
        for edit in edits(&bytes.next().unwrap_or_default()) {
            queues.edits.send(edit);
        }
        if let Some(words) = news.snapshot {
            queues.snapshot.write(words);
        }
        if let Some(words) = news.load {
            self.sounds.set_load(&DrillLoad::decode(words));
        }
        for strength in news.cries {
            self.sounds.cry(strength);
        }
        for event in news.events {
            let file_bytes = event.take_bytes(&mut bytes);
            queues.events.send(event.event(file_bytes, &self.scenario, &self.templates));
        }
        self.is_over |= news.is_over;
    }
}

impl LessonBackend for RemoteLesson {
    fn advance(&mut self) {
        if !self.open() {
            return;
        }
        while let Ok(arrival) = self.arrivals.try_recv() {
            self.receive(arrival);
        }
        if let Some(queues) = &mut self.queues {
            queues.edits.flush();
            queues.events.flush();
            if self.is_over && queues.events.is_flushed() {
                // The window learns from the abandoned queues that nothing follows.
                self.queues = None;
            }
        }
        self.pass_on();
    }

    fn pass_on(&mut self) {
        let Some(queues) = &mut self.queues else { return };
        let mut message = WindowMessage::default();
        while let Some(command) = queues.inbox.try_recv() {
            message.commands.push(CommandMessage::from(&command));
        }
        let target = self.mouse.as_ref().map(Mouse::state);
        if self.passed_on != target {
            message.mouse = target.map(MouseMessage::from);
            self.passed_on = target;
        }
        if message != WindowMessage::default() {
            // Texts and finite numbers can always be written.
            if let Ok(message) = LessonMessage::new(&message, Vec::new()) {
                (self.send)(message);
            }
        }
    }

    fn needs_frames(&self) -> bool {
        self.opening.is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lesson_backend::LessonCommand;
    use crate::lesson_host::LessonHost;
    use std::collections::BTreeMap;
    use std::sync::{LazyLock, mpsc};
    use std::time::{Duration, Instant};
    use typodont_core::frame::Vec3;
    use typodont_core::volume::Volume;
    use typodont_devices::mouse::HandTarget;
    use typodont_exercise::record::{self, FILE_NAME, Recording, ReplayCheck};
    use typodont_exercise::scenario::{self, ResolveMode};
    use typodont_exercise::session::{Effect, Input};
    use typodont_formats::diagnostic::SourceText;
    use typodont_lesson::live::LiveEvent;
    use typodont_lesson::{InterruptedSession, SessionSeed};
    use typodont_report::FirstResult;
    use typodont_report::bundle::{BundleFolder, CompletionStep, VerificationOutcome, verify};

    /// Force with which the test presses the bur into the tooth, N.
    const PRESS: f32 = 1.5;

    /// Changes of voxels that take the bur about half a second.
    const CUT: usize = 4000;

    /// A height above the tooth, mm.
    const ABOVE: f32 = 15.0;

    fn coarse_lesson() -> LessonConfig {
        let text =
            include_str!("../../scenarios/5-grinding.json").replace("\"spacing_mm\": 0.1", "\"spacing_mm\": 0.3");
        let source = SourceText::new("coarse.json", text);
        let scenario = scenario::resolve(source, &Library::shipped(), ResolveMode::MakeWorkpiece).unwrap();
        LessonConfig {
            scenario: Arc::new(scenario),
            seed: SessionSeed::given(1),
            participant: "P01".into(),
            out: None,
            templates: Templates::shipped(),
            started: jiff::Timestamp::UNIX_EPOCH,
            input_device: InputDevice::Mouse,
            second: None,
            digests: BTreeMap::new(),
            resumed: None,
            is_kept: true,
            wake: Arc::new(|| ()),
        }
    }

    /// The lesson in which an interrupted session goes on.
    fn resumed(reopened: ReopenedSession) -> LessonConfig {
        LessonConfig {
            scenario: reopened.scenario().clone(),
            seed: reopened.seed(),
            resumed: Some(reopened),
            ..coarse_lesson()
        }
    }

    /// A lesson of which only messages cross between the two sides, as between a page and its worker.
    struct Crossing {
        client: LessonClient,
        remote: RemoteLesson,
        host: LessonHost,
        to_host: Receiver<LessonMessage>,
        from_host: Receiver<LessonMessage>,
        to_window: mpsc::Sender<Arrival>,
    }

    impl Crossing {
        fn begin(config: LessonConfig) -> Crossing {
            let (window_sends, to_host) = mpsc::channel();
            let (host_sends, from_host) = mpsc::channel();
            let (to_window, arrivals) = mpsc::channel();
            let send = Box::new(move |message| window_sends.send(message).unwrap());
            let sounds = typodont_audio::sound_channel().0;
            let (client, remote) = RemoteLesson::start(config, &Library::shipped(), sounds, send, arrivals).unwrap();
            let send = Box::new(move |message| _ = host_sends.send(message));
            let host = LessonHost::start(to_host.recv().unwrap(), None, Templates::shipped(), send).unwrap();
            Crossing { client, remote, host, to_host, from_host, to_window }
        }

        fn frame(&mut self) {
            self.remote.advance();
            for message in self.to_host.try_iter() {
                self.host.receive(&message).unwrap();
            }
            self.host.advance();
            for message in self.from_host.try_iter() {
                self.to_window.send(Arrival::News(message.content().unwrap(), message.bytes)).unwrap();
            }
        }
    }

    /// Content of a window whose lesson is over.
    struct SeenLesson {
        /// The workpiece with the changes that arrived.
        volume: Volume,
        first: Box<FirstResult>,
        bundle: BundleFolder,
        /// Stages that began, in order.
        stages: Vec<usize>,
    }

    /// Presses the bur onto the tooth from above until `removed` voxels have changed, then ends the lesson.
    fn grind(mut lesson: Crossing, removed: usize) -> SeenLesson {
        let begun = Instant::now();
        let (mut volume, mut bundle, mut first, mut changes) = (None::<Volume>, None, None, 0);
        let (mut is_over, mut has_been_above, mut stages) = (false, false, Vec::new());
        for frame in 0.. {
            assert!(begun.elapsed() < Duration::from_secs(300), "the lesson does not end");
            lesson.frame();
            while let Some(event) = lesson.client.next_event() {
                match event {
                    LessonEvent::WorkpieceReady(workpiece) => {
                        assert_eq!(frame, FRAMES_BEFORE_LONG_STEP, "a long step that no screen has announced");
                        volume = Some(Volume::clone(&workpiece.volume));
                    }
                    LessonEvent::Completing(CompletionStep::Scored(result)) => first = Some(result),
                    LessonEvent::Finished(finished) => bundle = Some(finished),
                    LessonEvent::Failed(why) => panic!("{why}"),
                    LessonEvent::Live(LiveEvent::Effect(effect)) => {
                        assert!(volume.is_some(), "an effect before the scene");
                        stages.extend(if let Effect::StageStarted { stage } = effect { Some(stage) } else { None });
                    }
                    _ => {}
                }
            }
            while let Some(edit) = lesson.client.next_edit() {
                let is_same = volume.as_mut().unwrap().apply_edit(&edit);
                assert!(is_same, "a change of another voxel than is drawn");
                changes += 1;
            }
            if lesson.client.is_finished() {
                break;
            }
            let Some(seen) = lesson.client.snapshot() else { continue };
            has_been_above |= seen.tip.y > ABOVE - 1.0;
            let place = Vec3::Y * if has_been_above { -ABOVE } else { ABOVE };
            lesson.client.mouse.as_ref().unwrap().aim(HandTarget { place, max_force: PRESS, yaw: 0.0, lean: [0.0; 2] });
            if changes > removed && !is_over {
                is_over = lesson.client.send(LessonCommand::Input(Input::Abort));
            }
            std::thread::sleep(Duration::from_millis(2));
        }
        let first = first.expect("the result is told before the bundle");
        assert!(!first.legend.is_empty() && first.session.scenario.id == "5-grinding");
        SeenLesson { volume: volume.unwrap(), first, bundle: bundle.expect("the lesson has a bundle"), stages }
    }

    /// Asserts that a bundle holds, and that the window has drawn the tooth that its recording ends with; returns its name and its
    /// recording.
    fn checked(seen: &SeenLesson) -> (String, Vec<u8>) {
        let verification = verify(&seen.bundle, &[Templates::shipped()]).unwrap();
        assert_eq!(verification.outcome(), VerificationOutcome::Verified, "{:?}", verification.complaints);
        let BundleFolder::InMemory { name, files } = &seen.bundle else { panic!("the bundle is on the disk") };
        let recording = Recording::parse(FILE_NAME, &files[FILE_NAME]).unwrap();
        let replay = record::replay(&recording, recording.workpiece().unwrap(), ReplayCheck::Skip, |_, _, _, _| ());
        let voxels = |volume: &Volume| (0..volume.grid().len()).map(|at| volume.voxel(at)).collect::<Vec<_>>();
        assert!(voxels(&replay.volume) == voxels(&seen.volume), "the window has drawn another tooth than was cut");
        (name.clone(), files[FILE_NAME].clone())
    }

    /// The beginning of a recording up to some moment at which the bur had begun to cut, as a page keeps it that is closed then.
    fn interrupted(recording: &[u8]) -> Vec<u8> {
        let has_cut = |bytes: &[u8]| {
            let recording = Recording::parse(FILE_NAME, bytes).ok()?;
            let is_aborted = recording.inputs.iter().any(|(_, input)| *input == Input::Abort);
            let removed: u32 = recording.ticks.iter().map(|tick| tick.removed).sum();
            (!is_aborted && removed > 0).then_some(())
        };
        const STEP: usize = 500;
        let cut =
            (1..).map(|steps| &recording[..recording.len() - steps * STEP]).find(|bytes| has_cut(bytes).is_some());
        cut.expect("a moment of the cutting").to_vec()
    }

    /// A recording up to its end, which is missing: nothing else is.
    fn without_end(recording: &[u8]) -> Vec<u8> {
        const STEP: usize = 50;
        let has_end = |bytes: &[u8]| Recording::parse(FILE_NAME, bytes).unwrap().end.is_some();
        let cut = (1..).map(|steps| &recording[..recording.len() - steps * STEP]).find(|bytes| !has_end(bytes));
        cut.expect("a recording without an end").to_vec()
    }

    /// A whole lesson with its window, for all tests that need no more of it.
    static WHOLE: LazyLock<SeenLesson> = LazyLock::new(|| grind(Crossing::begin(coarse_lesson()), CUT));

    #[test]
    fn a_lesson_of_messages_makes_a_bundle_that_holds_and_the_window_sees_what_it_cuts() {
        // Aim: a page, whose lesson runs in a worker, gives the same evidence, and draws the tooth as it was cut. Method: a lesson
        // with coarse voxels; the pointer presses the bur into the tooth; the changes that the window receives are applied to the
        // workpiece that it has made by itself, and compared with the recording's last volume.
        let (name, whole) = checked(&WHOLE);

        // A page that was closed before the recording's end has kept the rest of it.
        let kept = InterruptedSession::kept(&name, without_end(&whole)).expect("a person's session");
        assert_eq!((kept.scenario_id.as_str(), kept.participant.as_str()), ("5-grinding", "P01"));
        let finished = kept.finish(&Templates::shipped(), &mut |_| ()).unwrap();
        assert!(!finished.remarks.is_empty(), "the end of the recording is not missed");
        let verification = verify(&finished.folder, &[Templates::shipped()]).unwrap();
        assert_eq!(verification.outcome(), VerificationOutcome::Verified, "{:?}", verification.complaints);
        assert_eq!(InterruptedSession::kept(&name, whole[..20].to_vec()), None);
    }
    #[test]
    fn a_worker_that_crashes_ends_the_lesson_with_a_reason() {
        let mut lesson = Crossing::begin(coarse_lesson());
        while lesson.remote.needs_frames() {
            lesson.frame();
        }
        lesson.to_window.send(Arrival::Failed("broken-off: unreachable".into())).unwrap();
        lesson.remote.advance();
        let mut events = std::iter::from_fn(|| lesson.client.next_event());
        assert!(events.any(|event| matches!(event, LessonEvent::Failed(why) if why.contains("unreachable"))));
        assert!(lesson.client.is_finished());
    }

    #[test]
    fn an_interrupted_lesson_goes_on_as_if_nothing_had_happened_to_the_tooth() {
        // Aim: who was interrupted loses no work, and the evidence of both parts holds as one. Method: a lesson is cut off while the
        // bur cuts; it goes on in a new lesson, in which the bur cuts on; twice.
        let (first_name, first) = checked(&WHOLE);
        let mut former = (first_name, interrupted(&first));
        for times in 1..=2 {
            let (name, cut) = former;
            let before = Recording::parse(FILE_NAME, &cut).unwrap();
            let session = InterruptedSession::kept(&name, cut.clone()).unwrap();
            let reopened = session.reopen().unwrap();
            let seen = grind(Crossing::begin(resumed(reopened)), CUT * (times + 1));
            let (new_name, whole) = checked(&seen);
            assert_ne!(new_name, name, "the new recording would replace the former before it is kept");
            let after = Recording::parse(FILE_NAME, &whole).unwrap();
            assert_eq!(after.head.resumed.len(), times);
            let kept = before.ticks.len();
            // Absent readings are not numbers, and so not equal to themselves.
            let text = |recording: &Recording| format!("{:?}", &recording.ticks[..kept]);
            assert!(text(&after) == text(&before), "what was done before the interruption has changed");
            assert!(!after.ticks[kept].reading.pose.is_valid(), "the hand is not released where it was interrupted");
            assert!(after.ticks.len() > kept + 10, "nothing was done after it");
            assert_eq!(seen.stages[0], 0, "the window does not learn of the stage");
            assert_eq!(seen.first.session.resumed.len(), times);
            former = (new_name, interrupted(&whole));
        }
    }

    #[test]
    fn the_clock_goes_on_while_the_hand_rests() {
        let mut lesson = Crossing::begin(coarse_lesson());
        let begun = Instant::now();
        let seconds = |lesson: &mut Crossing| {
            lesson.frame();
            assert!(begun.elapsed() < Duration::from_secs(100), "the clock does not go on");
            std::thread::sleep(Duration::from_millis(5));
            lesson.client.snapshot().map_or(0.0, |seen| seen.stage_seconds)
        };
        // The first movement starts the clock.
        let place = Vec3::Y * ABOVE;
        lesson.client.mouse.as_ref().unwrap().aim(HandTarget { place, max_force: 0.0, yaw: 0.0, lean: [0.0; 2] });
        while seconds(&mut lesson) < 2.0 {}
    }

    #[test]
    fn a_session_whose_stages_are_over_does_not_go_on() {
        // Aim: nobody cuts on after having finished. Method: the recording without its end, after the trainee has ended the lesson;
        // what followed its last tick is not forgotten.
        let (name, whole) = checked(&WHOLE);
        let session = InterruptedSession::kept(&name, without_end(&whole)).unwrap();
        let reopened = session.reopen().unwrap();
        let mut lesson = Crossing::begin(resumed(reopened));
        let why = loop {
            lesson.frame();
            match lesson.client.next_event() {
                Some(LessonEvent::Failed(why)) => break why,
                Some(LessonEvent::Live(event)) => panic!("it goes on: {event:?}"),
                _ => assert!(!lesson.client.is_finished()),
            }
        };
        assert!(why.starts_with("not-resumable: ") && why.contains("all its stages were performed"), "{why}");
    }

    #[test]
    fn a_session_that_was_recorded_to_its_end_does_not_go_on() {
        let (name, whole) = checked(&WHOLE);
        let why = |recording: &[u8]| {
            let session = InterruptedSession::kept(&name, recording.to_vec()).unwrap();
            session.reopen().err().expect("the session goes on").to_string()
        };
        assert!(why(&whole).contains("all of it was recorded"), "{}", why(&whole));
    }
}
