//! The commands of every screen, each carried out in one place.

use super::{App, CloseState, repaint_waker};
use crate::command::{AppCommand, CameraCommand, PracticeCommand, TextField};
use crate::completion::Completion;
use crate::editor::{EditorCommand, EditorState, OpenMode};
use crate::exercise_list::{self, ExerciseList};
use crate::i18n::{self};
use crate::kiosk::{self};
use crate::lesson_backend::{InputDevice, LessonConfig};
use crate::lesson_scene::DisplayMode;
use crate::lesson_state::LessonState;
use crate::platform;
use crate::results::BundleState;
use crate::screen::Screen;
use crate::settings::Settings;
use crate::ui::{briefing, shortcuts, theme};
use eframe::egui::{self, ViewportCommand};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use typodont_audio::PlaybackOptions;
use typodont_author::new_exercise;
use typodont_devices::driver_by_name;
use typodont_exercise::scenario::Scenario;
use typodont_exercise::session::Input;
use typodont_formats::Library;
use typodont_lesson as lesson;
use typodont_lesson::SessionSeed;

impl App {
    /// Shows the list without a participant. In a kiosk, the language and the size of the last one are forgotten, too.
    pub(super) fn change_participant(&mut self, ctx: &egui::Context) {
        self.go_back();
        self.participant.clear();
        self.examiner_code.clear();
        if self.options.kiosk().is_some() {
            self.exercise_list.selected = 0;
            self.overlay = shortcuts::OverlayState::default();
            self.kiosk_exit.ask(false);
            self.apply_settings(self.first_settings.clone(), ctx);
        }
    }

    /// Closes a kiosk if what was typed is the supervisor's code.
    pub(super) fn leave_kiosk(&mut self, ctx: &egui::Context) {
        let App { kiosk_exit, options, .. } = self;
        if options.kiosk().is_some_and(|kiosk| kiosk_exit.try_code(kiosk)) {
            ctx.send_viewport_cmd(ViewportCommand::Close);
        }
    }

    /// Leaves the results; a bundle that is still being made is completed in the background. A page keeps no bundle: one
    /// that was not saved is saved now.
    pub(super) fn leave_results(&mut self) {
        // Of a test run the author has seen the results.
        let is_kept = platform::IS_PAGE && self.test_run_origin.is_none();
        if is_kept && matches!(&self.screen, Screen::Results(results) if !results.is_downloaded) {
            self.download_bundle();
        }
        if let Screen::Results(results) = std::mem::replace(&mut self.screen, Screen::ExerciseList)
            && let BundleState::Pending(completion) = results.state
        {
            self.completions.push(completion);
        }
    }

    /// Scores the interrupted session that the list offers.
    pub(super) fn finish_interrupted(&mut self, ctx: &egui::Context) {
        let Some(session) = self.history.take_interrupted() else { return };
        let templates = self.options.templates.clone();
        self.screen = match Completion::of_interrupted(session, templates, repaint_waker(ctx)) {
            Ok(completion) => Screen::Completion(Box::new(completion)),
            Err(e) => Screen::Failed(format!("no-thread: the session cannot be scored: {e}")),
        };
    }

    /// Goes on with the interrupted session that the list offers. If it cannot go on, the user learns why, and the list still
    /// offers it.
    pub(super) fn resume_interrupted(&mut self, ctx: &egui::Context) {
        if !self.completions.is_empty() {
            return;
        }
        let Some(session) = self.history.interrupted().cloned() else { return };
        if self.options.kiosk().is_some() && session.participant != self.participant {
            return;
        }
        let reopened = match session.reopen() {
            Ok(reopened) => reopened,
            Err(why) => return self.complaints.push(why.to_string()),
        };
        let Some(input_device) = self.open_input_device() else { return };
        let former = self.history.take_interrupted();
        let mut library = Library::shipped();
        for (name, bytes) in &reopened.scenario().files {
            library.insert(name.clone(), bytes.clone());
        }
        self.participant = reopened.session().participant.clone();
        let config = LessonConfig {
            scenario: reopened.scenario().clone(),
            seed: reopened.seed(),
            participant: self.participant.clone(),
            out: None,
            templates: self.options.templates.clone(),
            started: jiff::Timestamp::now(),
            input_device,
            second: None,
            digests: BTreeMap::new(),
            resumed: Some(reopened),
            is_kept: true,
            wake: Arc::from(repaint_waker(ctx)),
        };
        self.show_lesson(config, library);
        if let Screen::Lesson(lesson) = &mut self.screen {
            lesson.former = former;
        }
    }

    pub(super) fn set_interrupted_aside(&mut self) {
        let Some(session) = self.history.take_interrupted() else { return };
        self.complaints.extend(session.set_aside().err());
        if let Some((name, recording)) = session.kept_recording() {
            match platform::download_recording(name, recording) {
                Some(complaint) => self.complaints.push(complaint),
                None => platform::forget_recording(name),
            }
        }
    }

    pub(super) fn execute(&mut self, command: AppCommand, ctx: &egui::Context) {
        if self.options.kiosk().is_some() && kiosk::is_refused(&command) {
            return;
        }
        match command {
            AppCommand::SelectExercise(place) => self.exercise_list.selected = place,
            AppCommand::SelectNextExercise(by) => self.select_next_exercise(by),
            AppCommand::OpenBriefing => self.open_briefing(),
            AppCommand::OpenFolder(folder) => {
                self.exercise_list = ExerciseList::load(&folder);
                self.apply_settings(Settings { exercises: folder, ..self.settings.clone() }, ctx);
            }
            AppCommand::TypeText(field, text) => self.set_text(field, text),
            AppCommand::BackToList => self.go_back(),
            AppCommand::ShowPicture(index) => self.shown_picture = index,
            AppCommand::BeginLesson => self.begin_lesson(ctx),
            AppCommand::NewExercise => self.create_exercise(ctx),
            AppCommand::EditExercise => self.edit_selected(ctx),
            AppCommand::Editor(EditorCommand::TestRun) => self.test_run(ctx),
            AppCommand::Editor(EditorCommand::Leave) => self.leave_editor(),
            AppCommand::Editor(ask) => {
                if let Screen::Editor(editor) = &mut self.screen {
                    editor.execute(ask);
                }
            }
            AppCommand::OpenReport => self.open_report(ctx),
            AppCommand::DownloadBundle => self.download_bundle(),
            AppCommand::ChooseZip => platform::ask_for_file(".zip", self.inbox.clone(), ctx),
            AppCommand::AllowDevice => self.ask_for_device(ctx),
            AppCommand::ChooseExercise => platform::ask_for_file(".json", self.inbox.clone(), ctx),
            AppCommand::TryAgain => {
                self.leave_results();
                self.screen = Screen::Briefing;
            }
            AppCommand::FinishInterrupted => self.finish_interrupted(ctx),
            AppCommand::ResumeInterrupted => self.resume_interrupted(ctx),
            AppCommand::SetAsideInterrupted => self.set_interrupted_aside(),
            AppCommand::ShowShortcuts(is_open) => {
                self.overlay = shortcuts::OverlayState { shortcuts: is_open, settings: false };
            }
            AppCommand::ShowSettings(is_open) => {
                self.overlay = shortcuts::OverlayState { shortcuts: false, settings: is_open };
            }
            AppCommand::ChangeParticipant => self.change_participant(ctx),
            AppCommand::AskToLeaveKiosk(is_asked) => self.kiosk_exit.ask(is_asked),
            AppCommand::LeaveKiosk => self.leave_kiosk(ctx),
            AppCommand::CloseWindow(is_closing) => self.confirm_close(is_closing, ctx),
            AppCommand::ApplySettings(settings) => self.apply_settings(*settings, ctx),
            AppCommand::Practice(PracticeCommand::TouchCross) => self.touch_cross(ctx),
            AppCommand::Practice(command) => {
                if let Screen::Lesson(lesson) = &mut self.screen {
                    execute_in_lesson(lesson, command);
                    lesson.pass_on();
                }
            }
            AppCommand::Camera(command) => self.move_camera(command),
        }
    }

    /// Moves the selection down the list by this many places; negative is up.
    pub(super) fn select_next_exercise(&mut self, by: i32) {
        let last = self.exercise_list.exercises.len().saturating_sub(1);
        self.exercise_list.selected = self.exercise_list.selected.saturating_add_signed(by as isize).min(last);
        self.exercise_list.scroll_to_selected = true;
    }

    /// Shows the instructions of the selected exercise, if it is valid.
    pub(super) fn open_briefing(&mut self) {
        let App { exercise_list: list, history, participant, settings, .. } = self;
        if list.can_open_selected(history, participant, settings) {
            self.examiner_code.clear();
            self.shown_picture = None;
            self.screen = Screen::Briefing;
        }
    }

    /// Returns to the author's screen after a test run, otherwise to the list of exercises.
    pub(super) fn go_back(&mut self) {
        if let Screen::Results(results) = &self.screen
            && results.is_done()
            && self.test_run_origin.is_none()
        {
            self.exercise_list.select_after(&results.first.session.scenario.id);
        }
        self.leave_results();
        self.examiner_code.clear();
        self.shown_picture = None;
        if let Some(editor) = self.test_run_origin.take() {
            return self.show_editor(editor);
        }
        self.exercise_list.scroll_to_selected = true;
        self.screen = Screen::ExerciseList;
    }

    /// Opens the report of the results in the browser.
    pub(super) fn open_report(&self, ctx: &egui::Context) {
        if let Screen::Results(results) = &self.screen
            && let Some(page) = results.report_url()
        {
            ctx.open_url(egui::OpenUrl::new_tab(page));
        }
    }

    /// Gives the bundle of the results to the user as one file.
    pub(super) fn download_bundle(&mut self) {
        if let Screen::Results(results) = &mut self.screen
            && let BundleState::Finished(bundle) = &results.state
        {
            let complaint = platform::download(bundle);
            results.is_downloaded = complaint.is_none();
            if results.is_downloaded {
                platform::forget_recording(&bundle.name());
            }
            self.complaints.extend(complaint);
        }
    }

    /// Moves the camera of a lesson or of the author's preview.
    pub(super) fn move_camera(&mut self, command: CameraCommand) {
        let orbit = match &mut self.screen {
            Screen::Lesson(lesson) => &mut lesson.orbit,
            Screen::Editor(editor) => &mut editor.preview.orbit,
            Screen::ExerciseList
            | Screen::Briefing
            | Screen::Completion(_)
            | Screen::Results(_)
            | Screen::Verification(_)
            | Screen::Failed(_) => return,
        };
        *orbit = match command {
            CameraCommand::Orbit { right, up } => orbit.rotated(right, up),
            CameraCommand::Zoom(factor) => orbit.zoomed(factor),
            CameraCommand::Pan { right, up } => orbit.panned(right, up),
        };
    }

    /// Aborts the lesson and closes the window when its bundle is written, or continues the lesson.
    pub(super) fn confirm_close(&mut self, is_closing: bool, ctx: &egui::Context) {
        self.closing = CloseState::No;
        match &mut self.screen {
            _ if !is_closing => self.kiosk_exit.is_allowed = false,
            Screen::Lesson(lesson) => {
                lesson.abort();
                self.closing = CloseState::AfterLesson;
            }
            _ => ctx.send_viewport_cmd(ViewportCommand::Close),
        }
    }

    /// Opens the author's screen with a new exercise in the user's language.
    pub(super) fn create_exercise(&mut self, ctx: &egui::Context) {
        let words = &self.words;
        let lines = ["author.new_cleared", "author.new_spared", "author.new_light"].map(|key| words.get(key));
        let [title, stage, instruction] =
            ["author.new_title", "author.new_stage", "author.new_instruction"].map(|key| words.get(key));
        let text = new_exercise(title, stage, instruction, lines, words.get("author.new_fail"));
        self.show_editor(Box::new(EditorState::new(text, self.user_folder.drafts(), repaint_waker(ctx))));
    }

    /// Opens the selected exercise at the author's screen; a shipped exercise is opened as a copy.
    pub(super) fn edit_selected(&mut self, ctx: &egui::Context) {
        let Some(exercise) = self.exercise_list.selected_exercise() else { return };
        if let Some(opened) = &exercise.opened {
            let editor = EditorState::opened(opened, exercise.library.clone(), repaint_waker(ctx));
            return self.show_editor(Box::new(editor));
        }
        match (exercise.path.clone(), exercise_list::shipped_text(&exercise.name)) {
            (Some(path), _) => self.open_editor(&path, OpenMode::Edit, ctx),
            (None, Some(text)) => {
                let editor = EditorState::copy(&exercise.name, text, self.user_folder.drafts(), repaint_waker(ctx));
                self.show_editor(Box::new(editor));
            }
            (None, None) => {}
        }
    }

    pub(super) fn open_editor(&mut self, path: &Path, mode: OpenMode, ctx: &egui::Context) {
        match EditorState::open(path, mode, self.user_folder.drafts(), repaint_waker(ctx)) {
            Ok(editor) => self.show_editor(Box::new(editor)),
            Err(complaint) => self.screen = Screen::Failed(complaint.headline()),
        }
    }

    /// Shows the author's screen; what was drawn on another screen is drawn anew.
    fn show_editor(&mut self, editor: Box<EditorState>) {
        self.screen = Screen::Editor(editor);
        self.views.forget();
    }

    /// Takes over the text of a field as it is being typed.
    fn set_text(&mut self, field: TextField, text: String) {
        *match field {
            TextField::Participant => &mut self.participant,
            TextField::ExaminerCode => &mut self.examiner_code,
            TextField::SupervisorCode => &mut self.kiosk_exit.code,
            TextField::ExerciseFolder => &mut self.exercise_list.folder,
        } = text;
    }

    /// Returns to the exercise list, which now includes the edited exercise. Unsaved changes are kept as a draft.
    pub(super) fn leave_editor(&mut self) {
        let Screen::Editor(editor) = &mut self.screen else { return };
        editor.autosave();
        if platform::IS_PAGE {
            if editor.is_for_list() {
                let (opened, replaced) = editor.to_opened();
                self.exercise_list.put_opened(opened, editor.library.clone(), replaced);
            }
        } else {
            let path = editor.path.clone();
            self.exercise_list = ExerciseList::load(&self.settings.exercises);
            if let Some(path) = path {
                self.exercise_list.select_file(&path);
            }
        }
        self.screen = Screen::ExerciseList;
    }

    /// Begins a lesson with the exercise being edited. Its bundle replaces that of the test run before.
    pub(super) fn test_run(&mut self, ctx: &egui::Context) {
        let Screen::Editor(editor) = &mut self.screen else { return };
        editor.autosave();
        if !self.completions.is_empty() {
            // Both would write into the same folder.
            editor.notice = Some(("briefing.report_first", String::new()));
            return;
        }
        let scenario = match editor.scenario() {
            Ok(scenario) => scenario,
            Err(_) => return editor.execute(EditorCommand::Check),
        };
        let library = editor.library.clone();
        // A page has no folders.
        let out = if platform::IS_PAGE { PathBuf::new() } else { self.user_folder.test_runs() };
        let _ = std::fs::remove_dir_all(&out);
        let left = std::mem::replace(&mut self.screen, Screen::ExerciseList);
        if let Screen::Editor(editor) = left {
            self.test_run_origin = Some(editor);
        }
        self.begin_lesson_with(Arc::new(scenario), library, BTreeMap::new(), out, ctx);
    }

    pub(super) fn begin_lesson(&mut self, ctx: &egui::Context) {
        if !self.completions.is_empty() {
            return;
        }
        if self.options.kiosk().is_some() && self.participant.is_empty() {
            return;
        }
        let Some(exercise) = self.exercise_list.selected_exercise() else { return };
        let (Ok(scenario), library) = (&exercise.scenario, exercise.library.clone()) else { return };
        let is_code_valid = briefing::is_valid_examiner_code(&self.examiner_code);
        if !lesson::is_valid_participant_code(&self.participant) || !is_code_valid {
            return;
        }
        let (scenario, digests, out) = (scenario.clone(), exercise.digests.clone(), self.options.out.clone());
        self.begin_lesson_with(scenario, library, digests, out, ctx);
    }

    pub(super) fn begin_lesson_with(
        &mut self,
        scenario: Arc<Scenario>,
        library: Library,
        digests: BTreeMap<String, String>,
        out: PathBuf,
        ctx: &egui::Context,
    ) {
        let Some(input_device) = self.open_input_device() else { return };
        let started = jiff::Timestamp::now();
        let typed = Some(std::mem::take(&mut self.examiner_code)).filter(|code| !code.is_empty());
        let seed = match (typed.as_ref().or(self.options.seed_code.as_ref()), self.options.seed) {
            (Some(code), _) => SessionSeed::sealed(code, &self.participant, started, &scenario),
            (None, Some(seed)) => Ok(SessionSeed::given(seed)),
            (None, None) => SessionSeed::drawn(),
        };
        let seed = match seed {
            Ok(seed) => seed,
            Err(why) => {
                self.screen = Screen::Failed(why.to_string());
                return;
            }
        };
        let config = LessonConfig {
            scenario,
            seed,
            participant: self.participant.clone(),
            // A page has no folders.
            out: (!platform::IS_PAGE).then_some(out),
            templates: self.options.templates.clone(),
            started,
            input_device,
            second: self.options.second.clone(),
            digests,
            resumed: None,
            is_kept: self.test_run_origin.is_none(),
            wake: Arc::from(repaint_waker(ctx)),
        };
        self.show_lesson(config, library);
    }

    /// Lets the browser ask for a device of the chosen kind.
    fn ask_for_device(&mut self, ctx: &egui::Context) {
        self.device_answer = None;
        if let Some(driver) = driver_by_name(&self.settings.device) {
            platform::ask_for_device(driver.hid_kinds(), self.device_inbox.clone(), ctx);
        }
    }

    /// Opens the device of a lesson; if that fails, the screen says why.
    fn open_input_device(&mut self) -> Option<InputDevice> {
        match self.options.device.as_deref().unwrap_or(&self.settings.device) {
            "mouse" => Some(InputDevice::Mouse),
            device if platform::IS_PAGE => Some(InputDevice::InWorker(device.into())),
            device => match lesson::open_device(device) {
                Ok(held) => Some(InputDevice::Device(held)),
                Err(failed) => {
                    self.screen = Screen::Failed(failed.to_string());
                    None
                }
            },
        }
    }

    fn show_lesson(&mut self, config: LessonConfig, library: Library) {
        // A sealed seed is shown nowhere; the sound does not need it.
        let shown_seed = if config.seed.is_sealed() { 0 } else { config.seed.value };
        self.state_log.record("seed", shown_seed);
        let output =
            PlaybackOptions { seed: shown_seed, replacements: self.replacements.clone(), ..PlaybackOptions::default() };
        let mode = if self.has_graphics { DisplayMode::Iso } else { DisplayMode::Surface };
        self.views.forget();
        self.screen = match LessonState::begin(config, library, output, mode) {
            Ok(mut lesson) => {
                lesson.can_register_hand = self.options.kiosk().is_none();
                Screen::Lesson(Box::new(lesson))
            }
            Err(why) => Screen::Failed(why),
        };
    }

    /// Takes over that an arm's tip is seen at a cross of the picture; after the last one the hand is registered.
    fn touch_cross(&mut self, ctx: &egui::Context) {
        if let Screen::Lesson(lesson) = &mut self.screen
            && let Some(registration) = lesson.touch_cross()
        {
            let settings = Settings { hand_registration: Some(registration), ..self.settings.clone() };
            self.apply_settings(settings, ctx);
        }
    }

    pub(super) fn apply_settings(&mut self, mut settings: Settings, ctx: &egui::Context) {
        if (&settings.device, settings.mirrored) != (&self.settings.device, self.settings.mirrored) {
            // It held for that arm, and for what was seen then.
            settings.hand_registration = None;
        }
        self.words = i18n::select_language(&self.languages, &settings.language);
        if settings.font_size == self.settings.font_size {
            theme::apply(ctx, &settings);
        }
        if settings.device != self.settings.device {
            self.device_answer = None;
        }
        self.settings = settings;
        self.has_unsaved_settings = true;
    }
}

/// Carries out commands of a lesson.
fn execute_in_lesson(lesson: &mut LessonState, command: PracticeCommand) {
    match command {
        PracticeCommand::SelectInstrument(instrument) => lesson.submit(Input::Take { instrument }),
        PracticeCommand::AnswerQuestion(question, value) => lesson.answer_question(question, value),
        PracticeCommand::TypeAnswer(question, text) => _ = lesson.drafts.insert(question, text),
        PracticeCommand::AddToChart(sign) => lesson.add_to_chart(sign),
        PracticeCommand::FinishStage => lesson.finish_stage(),
        PracticeCommand::ContinueStage => lesson.is_confirming_finish = false,
        PracticeCommand::Pause(is_paused) => lesson.pause(is_paused),
        PracticeCommand::AskToAbort(is_giving_up) => {
            // One question at a time: two keys of one frame may ask for both.
            lesson.is_confirming_abort = is_giving_up && !lesson.is_confirming_finish;
            lesson.release_pointer();
        }
        PracticeCommand::Abort => lesson.abort(),
        PracticeCommand::AdjustCoefficient(label, coefficient, value) => lesson.adjust(label, coefficient, value),
        PracticeCommand::SetDisplayMode(way) => lesson.display_mode = way,
        PracticeCommand::SetTransferFunction(curves) => {
            if let Some(scene) = &mut lesson.scene {
                scene.set_transfer_function(*curves);
                lesson.display_mode = DisplayMode::Drawn;
            }
        }
        PracticeCommand::CapturePointer(is_held) => capture_pointer(lesson, is_held),
        PracticeCommand::PointAt(place) => lesson.point_at(place),
        PracticeCommand::ChangeStrength(steps) => lesson.change_strength(steps),
        // A key of the same frame may have put the instrument down.
        PracticeCommand::SetPressure(_) | PracticeCommand::SetDeviceButton { .. } if !lesson.is_pointer_captured => {}
        PracticeCommand::Lean { right, near } => lesson.pointer_hand.lean(right, near),
        PracticeCommand::HoldUpright => lesson.pointer_hand.hold_upright(),
        PracticeCommand::SetPenDirection(pen) => lesson.pointer_hand.pen = pen,
        PracticeCommand::SetPressure(share) => lesson.pointer_hand.pressure = share,
        PracticeCommand::SetDeviceButton { bit, is_down } => lesson.set_pointer_button(bit, is_down),
        PracticeCommand::PressClutch(is_pressed) => lesson.press_clutch(is_pressed),
        PracticeCommand::RegisterHand(begins) => lesson.register_hand(begins),
        // The settings keep what the last cross gives: `App::touch_cross`.
        PracticeCommand::TouchCross => {}
        PracticeCommand::AdjustMouthOpening(by) => {
            if let Some(scene) = &mut lesson.scene {
                scene.open_mouth(by);
            }
        }
        PracticeCommand::SetCamera(view) => {
            if let Some(orbit) = lesson.scene.as_ref().and_then(|matter| view.orbit(matter)) {
                lesson.orbit = orbit;
            }
        }
        PracticeCommand::RecordView(aspect) => lesson.record_view(aspect),
        PracticeCommand::PictureDrawn => {
            if let Some(scene) = &mut lesson.scene {
                scene.undrawn.clear();
            }
        }
        PracticeCommand::RateStatement(item, value) => {
            lesson.rate_statement(item, value);
        }
        PracticeCommand::SelectNextStatement(by) => lesson.select_next_statement(by),
        PracticeCommand::SubmitQuestionnaire if lesson.unrated_statements() > 0 && !lesson.is_confirming_submit => {
            lesson.is_confirming_submit = true
        }
        PracticeCommand::SubmitQuestionnaire => lesson.submit_questionnaire(),
    }
}

/// Makes the pointer act as the device if the lesson has a mouse and is not paused, or releases it.
fn capture_pointer(lesson: &mut LessonState, is_held: bool) {
    match is_held && lesson.has_mouse() && !lesson.is_paused {
        true => lesson.is_pointer_captured = true,
        false => lesson.release_pointer(),
    }
}
