//! A lesson as the window knows it: its events so far, its scene, and answers not yet submitted.

use crate::answer_draft::parse_draft;
use crate::completion::CompletionState;
use crate::controls_progress::{ControlsProgress, LessonProgress};
use crate::hand_placement::HandPlacement;
use crate::hand_registration::{HandRegistration, REGISTERING_FRAME, RegistrationDraft};
use crate::lesson_backend::{LessonBackend, LessonClient, LessonCommand, LessonConfig, LessonEvent};
#[cfg(not(target_family = "wasm"))]
use crate::lesson_run::LessonRun;
use crate::lesson_scene::{DisplayMode, LessonScene};
#[cfg(not(target_family = "wasm"))]
use crate::lesson_thread::LessonThread;
use crate::messages::{self, PauseReason, SecondHandStatus};
use crate::pointer_hand::{PointedPlace, PointerHand};
use crate::snapshot::LessonSnapshot;
use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;
use typodont_audio::{self as audio, PlaybackOptions, PlayerEvent, SoundPlayer, SoundSender};
use typodont_core::frame::Vec3;
use typodont_core::sim::{Command as Tell, HandFrame};
use typodont_core::touch::{Coefficient, Materials};
use typodont_core::volume::Label;
use typodont_devices::servo::{AssistantTool, SecondHandRole};
use typodont_exercise::scenario::{QuestionKind, Scenario, Stage};
use typodont_exercise::session::{
    AnswerValue, ChartInput, ChartRecord, Effect, EndedBy, Input, InputError, TraineeView,
};
use typodont_formats::Library;
use typodont_lesson::InterruptedSession;
use typodont_lesson::live::LiveEvent;
use typodont_render::{Orbit, PlaneMirror};
use typodont_scene::particles::{AssistantAction, CollisionWorld, Tools};
use typodont_scene::{self as scene};
use web_time::{Duration, Instant};

/// Distance by which an instrument that is put down is lifted along its handle, mm.
const PUT_DOWN_DISTANCE: f32 = 8.0;

/// Maximum number of voxel edits taken over per frame, so that a burst of edits does not delay the frame.
const MAX_EDITS_PER_FRAME: usize = 1 << 16;

pub struct LessonState {
    pub scenario: Arc<Scenario>,
    client: LessonClient,
    /// Dropped after the client, whose end tells it that the window is closed.
    backend: Box<dyn LessonBackend>,
    player: SoundPlayer,
    /// Reason why there is no sound, if there is none.
    pub audio_error: Option<String>,
    /// The workpiece and its drawn scene; `None` until it is built.
    pub scene: Option<LessonScene>,
    pub snapshot: Option<LessonSnapshot>,
    /// The running stage; `None` before the first and after the last.
    pub stage: Option<usize>,
    pub are_stages_over: bool,
    /// True, by question of the stage, once it is answered.
    pub answered: Vec<bool>,
    /// Text typed but not yet submitted, by question.
    pub drafts: BTreeMap<String, String>,
    /// Last accepted answer, by question.
    pub answers: BTreeMap<String, AnswerValue>,
    /// Answers that are neither accepted nor refused yet, in order.
    submitted: VecDeque<(String, AnswerValue)>,
    /// Reason why the last input was not accepted: a key of the language file.
    pub refusal_key: Option<&'static str>,
    /// Reason why the lesson is suspended by the system, if it is.
    pub pause_reason: Option<PauseReason>,
    /// Last status of a second hand.
    pub second_hand: Option<SecondHandStatus>,
    /// The interrupted session that goes on, until its first tick: if that fails, it is still offered.
    pub former: Option<InterruptedSession>,
    pub is_paused: bool,
    /// True while the lesson cannot be seen, and is paused for it.
    is_hidden: bool,
    /// True while the pointer acts as the device.
    pub is_pointer_captured: bool,
    pub pointer_hand: PointerHand,
    /// Placement of an arm's hand; `None` if the hand cannot be placed.
    hand_placement: Option<HandPlacement>,
    pub is_clutch_pressed: bool,
    /// The registration of the hand with the picture, while it is made.
    pub registration: Option<RegistrationDraft>,
    /// True while the hand moves in the frame in which it is registered.
    pub can_touch_cross: bool,
    /// True where an arm may be registered: not in a kiosk, whose settings last as long as its participant.
    pub can_register_hand: bool,
    /// Actions done so far, for a stage that teaches the controls.
    pub controls: ControlsProgress,
    pub is_confirming_abort: bool,
    pub orbit: Orbit,
    /// View of the trainee as the recording has it; `None` until the first image.
    recorded_view: Option<TraineeView>,
    /// Source of the instruments' models.
    library: Library,
    /// Entries of the running stage's periodontal chart.
    pub chart: Vec<ChartRecord>,
    /// Complaints about parts of the scene that could not be drawn as the exercise requires.
    pub complaints: Vec<String>,
    pub display_mode: DisplayMode,
    /// Present coefficients of the tissues, before any instrument's own factors.
    pub materials: Materials,
    /// Ratings chosen on the questionnaire's scale, by statement.
    pub ratings: BTreeMap<String, u8>,
    /// Index of the current statement, which a digit key rates.
    pub statement: usize,
    pub scroll_to_statement: bool,
    /// True while the user is asked to confirm submission with statements not rated.
    pub is_confirming_submit: bool,
    pub is_submitted: bool,
    /// True if the questionnaire is to be answered now.
    pub is_questionnaire_due: bool,
    pub is_scoring: bool,
    /// True while the clock is stopped until the trainee picks the instrument up.
    pub is_awaiting_movement: bool,
    /// True while the user is asked to confirm that the stage is finished.
    pub is_confirming_finish: bool,
    /// Title of the stage that has just ended because its time was up.
    pub timed_out_stage: Option<String>,
    /// The making of the bundle.
    pub completion: CompletionState,
    /// Time at which the last input of the trainee ended the session.
    pub ended: Option<Instant>,
}

/// Radius of the view until the workpiece is built, mm.
const FIRST_RADIUS: f32 = 9.0;

impl LessonState {
    /// Begins a lesson with an audio output and a first display mode.
    pub fn begin(
        config: LessonConfig,
        library: Library,
        output: PlaybackOptions,
        display_mode: DisplayMode,
    ) -> Result<LessonState, String> {
        let scenario = config.scenario.clone();
        let materials = scenario.tissues.materials();
        let hand_placement = config.is_hand_placeable().then(HandPlacement::default);
        let (sound_sender, sound_receiver) = audio::sound_channel();
        let (client, backend) = start_lesson(config, &library, sound_sender)?;
        Ok(LessonState {
            scenario,
            client,
            backend,
            player: SoundPlayer::start(sound_receiver, output),
            audio_error: None,
            scene: None,
            snapshot: None,
            stage: None,
            are_stages_over: false,
            answered: Vec::new(),
            drafts: BTreeMap::new(),
            answers: BTreeMap::new(),
            submitted: VecDeque::new(),
            chart: Vec::new(),
            refusal_key: None,
            pause_reason: None,
            second_hand: None,
            is_paused: false,
            is_hidden: false,
            former: None,
            is_pointer_captured: false,
            pointer_hand: PointerHand::default(),
            hand_placement,
            is_clutch_pressed: false,
            registration: None,
            can_touch_cross: false,
            can_register_hand: false,
            controls: ControlsProgress::default(),
            is_confirming_abort: false,
            orbit: Orbit::around(Vec3::ZERO, FIRST_RADIUS),
            recorded_view: None,
            library,
            display_mode,
            materials,
            ratings: BTreeMap::new(),
            statement: 0,
            scroll_to_statement: false,
            is_confirming_submit: false,
            is_submitted: false,
            is_questionnaire_due: false,
            is_scoring: false,
            is_awaiting_movement: false,
            is_confirming_finish: false,
            timed_out_stage: None,
            complaints: Vec::new(),
            completion: CompletionState::default(),
            ended: None,
        })
    }

    /// The running stage.
    pub fn stage(&self) -> Option<&Stage> {
        self.stage.and_then(|stage| self.scenario.stages.get(stage))
    }

    /// Passes on the commands of a frame to the lesson.
    pub fn pass_on(&mut self) {
        self.backend.pass_on();
    }

    /// True if every frame must be followed by another for the lesson to begin.
    pub fn needs_frames(&self) -> bool {
        self.backend.needs_frames()
    }

    /// True if the pointer can act as the device.
    pub fn has_mouse(&self) -> bool {
        self.client.mouse.is_some()
    }

    pub fn mouse(&self) -> Option<&typodont_devices::mouse::Mouse> {
        self.client.mouse.as_ref()
    }

    /// Passes the view to the recording, if it has changed and a stage runs. `aspect`: width of the image divided by its
    /// height.
    pub fn record_view(&mut self, aspect: f32) {
        let eye = self.orbit.viewpoint().eye(aspect);
        let view = TraineeView {
            eye: eye.position,
            focus: self.orbit.middle,
            up: eye.up,
            half_extent: [eye.window.right, eye.window.top],
            mirror: None,
        };
        if self.stage.is_some()
            && self.recorded_view != Some(view)
            && self.client.send(LessonCommand::Input(Input::Look(view)))
        {
            self.recorded_view = Some(view);
        }
    }

    /// True if an arm's hand can be placed anew, by the view and by the clutch.
    pub fn has_placeable_hand(&self) -> bool {
        self.hand_placement.is_some()
    }

    /// True if an arm's hand is about to be placed anew.
    pub fn is_hand_placement_pending(&self) -> bool {
        self.stage.is_some() && self.hand_placement.is_some_and(|placement| placement.is_pending())
    }

    /// Places the hand of an arm in a frame once that has settled, if a stage runs. For `is_dragging` and `now` see
    /// [`HandPlacement::is_due`].
    pub fn place_hand(&mut self, frame: HandFrame, is_dragging: bool, now: f64) {
        let is_standing_still = self.is_standing_still();
        let LessonState { stage: Some(_), hand_placement: Some(placement), client, registration, .. } = self else {
            return;
        };
        let frame = if registration.is_some() { REGISTERING_FRAME } else { frame };
        if is_standing_still {
            placement.wait(now);
        }
        if placement.is_due(frame, is_dragging, now) && client.send(LessonCommand::Input(Input::PlaceHand(frame))) {
            placement.place(frame, now);
        }
        self.can_touch_cross = placement.has_arrived(REGISTERING_FRAME, now);
    }

    /// Begins the registration of an arm's hand with the picture, or ends it without one.
    pub fn register_hand(&mut self, begins: bool) {
        let can_begin = self.can_register_hand && self.has_placeable_hand() && self.stage.is_some();
        self.registration = (begins && can_begin).then(RegistrationDraft::default);
        self.can_touch_cross = false;
    }

    /// Takes over that the tip is seen at the cross that is shown; returns the registration after the last one.
    pub fn touch_cross(&mut self) -> Option<HandRegistration> {
        let hand = self.snapshot.filter(|_| self.can_touch_cross)?.hand;
        let registration = self.registration.as_mut()?.touch(hand)?;
        self.registration = None;
        Some(registration)
    }

    /// Presses the clutch of an arm, if a stage runs, or releases it.
    pub fn press_clutch(&mut self, is_pressed: bool) {
        let can_press = self.has_placeable_hand() && self.stage.is_some();
        if is_pressed != self.is_clutch_pressed && (can_press || !is_pressed) {
            self.is_clutch_pressed = is_pressed;
            self.send(LessonCommand::PressClutch(is_pressed));
        }
    }

    /// Takes over all events of the lesson since the last frame.
    ///
    /// `volume`: share of full scale, 0 to 1; `elapsed`: time since the last frame, s.
    pub fn poll(&mut self, volume: f32, elapsed: f32) {
        self.player.set_volume(volume);
        while let Some(event) = self.player.next_event() {
            self.audio_error = match event {
                PlayerEvent::Playing { .. } => None,
                PlayerEvent::Silent(silence) => Some(silence.to_string()),
            };
        }
        self.poll_events();
        if let Some(scene) = &mut self.scene {
            for _ in 0..MAX_EDITS_PER_FRAME {
                let Some(edit) = self.client.next_edit() else { break };
                scene.apply_edit(&edit);
            }
            scene.collect_undrawn();
        }
        self.snapshot = self.client.snapshot().or(self.snapshot);
        if self.snapshot.is_some() {
            self.former = None;
        }
        if let Some(seen) = &self.snapshot {
            self.controls.update(&LessonProgress {
                hand: seen.hand,
                is_touching: seen.touch.is_some(),
                force: seen.spring,
                is_cutting: seen.cutting,
                orbit: &self.orbit,
            });
        }
        self.step_particles(elapsed);
        self.check_thread();
    }

    /// Takes over the steps in which the bundle is made.
    pub fn poll_completion(&mut self) {
        self.poll_events();
        self.check_thread();
    }

    fn poll_events(&mut self) {
        self.backend.advance();
        while let Some(event) = self.client.next_event() {
            self.apply_event(event);
        }
    }

    fn check_thread(&mut self) {
        if self.completion.outcome.is_none() && self.client.is_finished() {
            self.completion.outcome = Some(Err(
                "broken-off: the session ended unexpectedly; its recording is in the folder of finished sessions, and \
                 the list of exercises offers to finish it when the program is started again"
                    .into(),
            ));
        }
    }

    /// Time until the clock of the stage shows the next second.
    pub fn time_to_next_second(&self) -> Duration {
        /// Added, so that the second has passed for certain.
        const MARGIN: f32 = 0.02;
        let seconds = self.snapshot.map_or(0.0, |snapshot| snapshot.stage_seconds);
        Duration::from_secs_f32(1.0 - seconds.fract().clamp(0.0, 1.0) + MARGIN)
    }

    /// True while the lesson is suspended, by the trainee or by the system.
    pub fn is_standing_still(&self) -> bool {
        self.is_paused || self.pause_reason.is_some()
    }

    /// The face of the mirror in use, if the instrument is one.
    pub fn mirror(&self) -> Option<PlaneMirror> {
        let seen = self.snapshot.as_ref()?;
        scene::mirror_face(self.scenario.instruments.get(seen.instrument as usize)?, seen.world_from_tip())
    }

    /// Advances dust and water by `elapsed`, s, while the lesson runs.
    fn step_particles(&mut self, elapsed: f32) {
        let does_drill_run = self.stage().is_some_and(|stage| stage.cutting);
        let assistant = self.snapshot.and_then(|seen| seen.assistant);
        let snapshot = self.snapshot.filter(|_| does_drill_run);
        let is_still = self.is_standing_still();
        let mirror = self.mirror();
        let Some(LessonScene { particles: Some(field), volume, workpiece, palette, .. }) = &mut self.scene else {
            return;
        };
        if is_still {
            return;
        }
        let bur = snapshot.and_then(|seen| field.bur(seen.instrument as usize, seen.world_from_tip()));
        let ground =
            CollisionWorld { volume, world_from_tooth: workpiece.world_from_tooth, obstacles: &workpiece.surroundings };
        let aim = workpiece.world_from_tooth * workpiece.crown_bounds().centre();
        let assistant = assistant.and_then(|tool| assistant_action(&tool, aim));
        field.advance(elapsed, Tools { bur, assistant, mirror }, &ground, palette);
    }

    fn apply_event(&mut self, event: LessonEvent) {
        match event {
            LessonEvent::WorkpieceReady(workpiece) => {
                self.orbit = scene::work_view(&workpiece);
                let (scene, complaints) =
                    LessonScene::build(&self.scenario, &self.library, workpiece, self.is_decay_shown());
                (self.scene, self.complaints) = (Some(scene), complaints);
            }
            LessonEvent::Live(LiveEvent::Effect(effect)) => self.apply_effect(&effect),
            LessonEvent::Live(LiveEvent::DeviceState(state)) => {
                self.pause_reason = PauseReason::from_state(state);
            }
            LessonEvent::Live(LiveEvent::DeviceLost(gone)) => self.pause_reason = Some(PauseReason::device_lost(gone)),
            LessonEvent::Live(LiveEvent::ServoStarted(_)) => {}
            LessonEvent::AwaitingSecondHand(address) => {
                self.second_hand = Some(SecondHandStatus::AwaitingConnection(address))
            }
            LessonEvent::SecondHand(news) => self.second_hand = Some(SecondHandStatus::from_event(news)),
            LessonEvent::DifferentDevice => self.pause_reason = Some(PauseReason::different_device()),
            LessonEvent::Live(LiveEvent::AwaitingMovement(is_awaiting)) => self.is_awaiting_movement = is_awaiting,
            LessonEvent::Completing(step) => {
                self.is_scoring = true;
                self.completion.apply(step);
            }
            LessonEvent::Finished(bundle) => self.completion.outcome = Some(Ok(bundle)),
            LessonEvent::Failed(why) => self.completion.outcome = Some(Err(why)),
        }
    }

    fn apply_effect(&mut self, effect: &Effect) {
        match effect {
            Effect::StageStarted { stage } => {
                self.stage = Some(*stage);
                self.answered = vec![false; self.scenario.stages[*stage].ask.len()];
                self.drafts.clear();
                self.answers.clear();
                self.submitted.clear();
                self.chart.clear();
                self.refusal_key = None;
                self.controls.begin_stage();
                self.is_confirming_finish = false;
                self.materials = self.scenario.tissues.materials();
                self.update_palette();
                if !DisplayMode::available(self.stage()).any(|(way, _)| way == self.display_mode) {
                    self.display_mode = DisplayMode::Surface;
                }
            }
            Effect::Answered { question, .. } => {
                if let Some(answered) = self.answered.get_mut(*question) {
                    *answered = true;
                }
                if let Some((id, value)) = self.submitted.pop_front() {
                    let is_other = self.answers.insert(id, value.clone()).is_some_and(|before| before != value);
                    if is_other {
                        self.forget_quarter(*question);
                    }
                }
                self.refusal_key = None;
            }
            Effect::Charted { record: note, is_present: is_there, .. } => {
                let is_like = |n: &ChartRecord| n.site == note.site && n.entry.is_same_kind(&note.entry);
                self.chart.retain(|n| !is_like(n));
                self.chart.extend(is_there.then_some(*note));
                self.refusal_key = None;
            }
            Effect::StagesOver => {
                (self.stage, self.are_stages_over) = (None, true);
                self.register_hand(false);
                self.is_clutch_pressed = false;
                self.is_confirming_finish = false;
                self.ended = Some(Instant::now());
                self.release_pointer();
            }
            Effect::Refused { why } => {
                if matches!(why, InputError::NotAsked | InputError::NoAnswer | InputError::NotExamined) {
                    self.submitted.pop_front();
                }
                self.refusal_key = Some(messages::refusal_key(*why));
            }
            Effect::Command(Tell::SetCoefficient { label, coefficient, value }) => {
                self.materials.set(*label, self.materials.get(*label).with(*coefficient, *value));
            }
            Effect::StageEnded { stage, by } => {
                self.register_hand(false);
                let is_timed_out = *by == EndedBy::Time && self.scenario.stages[*stage].draw.is_none();
                self.timed_out_stage = is_timed_out.then(|| self.scenario.stages[*stage].title.clone());
                if is_timed_out {
                    // A movement would start the clock of the next stage.
                    self.put_down(0.0);
                }
            }
            Effect::Command(_) | Effect::StepStarted { .. } => {}
        }
    }

    /// The display mode after the present one.
    pub fn next_display_mode(&self) -> DisplayMode {
        let modes: Vec<DisplayMode> = DisplayMode::available(self.stage()).map(|(way, _)| way).collect();
        let place = modes.iter().position(|way| *way == self.display_mode).map_or(0, |place| (place + 1) % modes.len());
        modes[place]
    }

    fn update_palette(&mut self) {
        let is_shown = self.is_decay_shown();
        if let Some(scene) = &mut self.scene {
            scene.colour(&self.scenario.tissues, is_shown);
        }
    }

    pub fn is_decay_shown(&self) -> bool {
        self.stage().is_some_and(|stage| stage.show_decay)
    }

    /// Sends an input to the session.
    pub fn submit(&mut self, input: Input) {
        self.send(LessonCommand::Input(input));
    }

    /// Sends a command to the lesson. Returns false, and sets a message, if the lesson has ended.
    fn send(&mut self, command: LessonCommand) -> bool {
        let is_accepted = self.client.send(command);
        if !is_accepted {
            self.refusal_key = Some(messages::NOT_LISTENING);
        }
        is_accepted
    }

    /// Answers a question of the running stage.
    pub fn answer_question(&mut self, question: String, value: AnswerValue) {
        let Some(stage) = self.stage else { return };
        let answer = (question.clone(), value.clone());
        if self.send(LessonCommand::StageInput(stage, Input::Answer { question, value })) {
            self.submitted.push_back(answer);
        }
    }

    /// After another tooth was named, asks for its quarter again: quarters have their names by the tooth.
    fn forget_quarter(&mut self, changed: usize) {
        let questions = self.stage().map(|stage| stage.ask.clone()).unwrap_or_default();
        if !matches!(questions.get(changed).map(|question| &question.kind), Some(QuestionKind::ToothWith { .. })) {
            return;
        }
        for (question, answered) in questions.iter().zip(&mut self.answered) {
            if matches!(question.kind, QuestionKind::QuadrantOf { .. }) {
                self.answers.remove(&question.id);
                *answered = false;
            }
        }
    }

    /// Records an entry in the running stage's periodontal chart, at the site of the instrument.
    pub fn add_to_chart(&mut self, sign: ChartInput) {
        let Some(stage) = self.stage else { return };
        self.send(LessonCommand::StageInput(stage, Input::Chart(sign)));
    }

    /// Sets a coefficient of a tissue; the session accepts it if the stage allows adjustment.
    pub fn adjust(&mut self, label: Label, coefficient: Coefficient, value: f32) {
        let Some(stage) = self.stage else { return };
        if self.send(LessonCommand::StageInput(stage, Input::Adjust { label, coefficient, value })) {
            // The new value is shown at once; the session's answer arrives some milliseconds later.
            self.materials.set(label, self.materials.get(label).with(coefficient, value));
        }
    }

    /// Asks whether the running stage is finished. A trial of several ends at once.
    pub fn finish_stage(&mut self) {
        let is_trial = self.stage().is_some_and(|stage| stage.draw.is_some());
        match self.is_confirming_finish || is_trial {
            true => self.confirm_stage(),
            false => self.is_confirming_finish = true,
        }
        if self.is_confirming_finish {
            self.release_pointer();
        }
    }

    /// Ends the running stage, after submitting typed answers. Does nothing while a typed number is not a number.
    fn confirm_stage(&mut self) {
        self.is_confirming_finish = false;
        let Some((stage, questions)) = self.stage.zip(self.stage().map(|stage| stage.ask.clone())) else { return };
        for question in questions {
            let draft = self.drafts.get(&question.id).map_or("", String::as_str);
            match parse_draft(&question, draft) {
                Some(None) => return,
                Some(Some(answer)) if self.answers.get(&question.id) != Some(&answer) => {
                    self.answer_question(question.id, answer)
                }
                _ => {}
            }
        }
        self.send(LessonCommand::StageInput(stage, Input::Confirm));
    }

    /// Releases the pointer: the instrument is lifted off, without force, so that it touches nothing while nobody holds it.
    /// Before the work has begun it stays, since a movement would start the clock.
    pub fn release_pointer(&mut self) {
        self.put_down(if self.is_awaiting_movement { 0.0 } else { PUT_DOWN_DISTANCE });
    }

    /// Releases the pointer, and moves the instrument along its handle, mm.
    fn put_down(&mut self, distance: f32) {
        let was_captured = std::mem::take(&mut self.is_pointer_captured);
        (self.pointer_hand.is_pressing, self.pointer_hand.spot) = (false, None);
        if let Some((mouse, seen)) = self.mouse().zip(self.snapshot.as_ref()).filter(|_| was_captured) {
            mouse.release_at(seen.tip + seen.orientation * Vec3::Z * distance);
        }
    }

    /// Aims the hand at the surface under the pointer.
    pub fn point_at(&mut self, place: Option<PointedPlace>) {
        let LessonState { client, scene: Some(scene), snapshot: Some(snapshot), scenario, orbit, pointer_hand, .. } =
            self
        else {
            return;
        };
        let Some(mouse) = client.mouse.as_ref().filter(|_| self.is_pointer_captured) else { return };
        if let Some(instrument) = scenario.instruments.get(snapshot.instrument as usize) {
            pointer_hand.point_at(place, mouse, orbit, scene, snapshot, instrument);
        }
    }

    /// Instrument in use, and the maximum force of a press with it, N, if the pointer is the device.
    pub fn press_strength(&self) -> Option<f32> {
        let index = self.snapshot?.instrument as usize;
        let instrument = self.scenario.instruments.get(index)?;
        self.has_mouse().then(|| self.pointer_hand.strength(instrument))
    }

    /// Changes the strength of a press with the instrument in use, by steps of the wheel.
    pub fn change_strength(&mut self, steps: f32) {
        let Some(index) = self.snapshot.map(|seen| seen.instrument as usize) else { return };
        if let Some(instrument) = self.scenario.instruments.get(index) {
            self.pointer_hand.change_strength(steps, instrument);
        }
    }

    /// Presses or releases a button of the pointer; the main one presses the instrument.
    pub fn set_pointer_button(&mut self, bit: u32, is_down: bool) {
        if bit == 0 {
            self.pointer_hand.is_pressing = is_down;
        }
        if let Some(mouse) = self.mouse() {
            mouse.set_button(bit, is_down);
        }
    }

    pub fn rate_statement(&mut self, item: String, value: u8) {
        let questionnaire = self.scenario.questionnaire.as_ref();
        let place = questionnaire.and_then(|q| q.items().position(|i| i.id == item));
        self.statement = place.unwrap_or(self.statement);
        self.ratings.insert(item, value);
        self.is_confirming_submit = false;
    }

    /// Moves to another statement, `by` places further down.
    pub fn select_next_statement(&mut self, by: i32) {
        let count = self.scenario.questionnaire.as_ref().map_or(0, |q| q.items().count());
        self.statement = self.statement.saturating_add_signed(by as isize).min(count.saturating_sub(1));
        self.scroll_to_statement = true;
    }

    /// Number of statements without a rating.
    pub fn unrated_statements(&self) -> usize {
        let count = self.scenario.questionnaire.as_ref().map_or(0, |q| q.items().count());
        count.saturating_sub(self.ratings.len())
    }

    pub fn pause(&mut self, is_paused: bool) {
        self.is_paused = is_paused;
        if is_paused {
            self.release_pointer();
        }
        self.client.send(LessonCommand::Pause(is_paused));
    }

    /// Pauses a lesson that nobody sees or that another page covers, and resumes it when it is seen again.
    pub fn set_hidden(&mut self, is_hidden: bool) {
        if is_hidden == self.is_hidden || is_hidden && self.are_stages_over {
            return;
        }
        self.is_hidden = is_hidden;
        if is_hidden {
            self.release_pointer();
        }
        self.client.send(LessonCommand::Pause(is_hidden || self.is_paused));
        self.pass_on();
    }

    /// Submits the questionnaire with the present ratings.
    pub fn submit_questionnaire(&mut self) {
        if self.is_submitted {
            return;
        }
        for (item, value) in self.ratings.clone() {
            self.submit(Input::Rate { item, value });
        }
        self.ended = Some(Instant::now());
        self.is_submitted = self.client.send(LessonCommand::FinishQuestionnaire);
    }

    /// Aborts the lesson; all actions, answers and ratings so far are kept.
    pub fn abort(&mut self) {
        match self.are_stages_over {
            true => self.submit_questionnaire(),
            false => self.submit(Input::Abort),
        }
    }
}

/// Begins a lesson on a thread of its own. A lesson that cannot begin reports [`LessonEvent::Failed`].
///
/// # Errors
/// A message if the system starts no thread.
#[cfg(not(target_family = "wasm"))]
fn start_lesson(
    config: LessonConfig,
    _: &Library,
    sounds: SoundSender,
) -> Result<(LessonClient, Box<dyn LessonBackend>), String> {
    let (client, run) = LessonRun::new(config, sounds);
    let thread = LessonThread::start(run).map_err(|e| format!("no-thread: the lesson cannot begin: {e}"))?;
    Ok((client, Box::new(thread)))
}

/// Begins a lesson in a worker beside the page.
///
/// # Errors
/// A message if the browser starts no worker.
#[cfg(target_family = "wasm")]
fn start_lesson(
    config: LessonConfig,
    library: &Library,
    sounds: SoundSender,
) -> Result<(LessonClient, Box<dyn LessonBackend>), String> {
    crate::page_worker::start_lesson(config, library, sounds)
}
/// Effect of an assistant's tool on dust and water. A syringe is aimed at a place, world space: not every device can be turned.
fn assistant_action(tool: &AssistantTool, aim: Vec3) -> Option<AssistantAction> {
    match tool.role {
        SecondHandRole::Suction => Some(AssistantAction::Draw { inlet: tool.tip }),
        SecondHandRole::Irrigation => tool.is_pressed.then_some(AssistantAction::Spray { nozzle: tool.tip, aim }),
        SecondHandRole::Instructor => None,
    }
}
