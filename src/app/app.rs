//! The application: chooses the screen that is shown, and carries out the commands of every screen.

use super::briefing::BriefingFields;
use super::command::{AppCommand, CameraCommand, PracticeCommand};
use super::completion::{Completion, CompletionProgress};
use super::editor::{self, EditorCommand, EditorState, OpenMode};
use super::exercise_list::{self, ExerciseList, ListContext, exercise_list_ui};
use super::i18n::{self, Translations};
use super::kiosk::{self, KioskExit};
use super::lesson_backend::{InputDevice, LessonConfig};
use super::lesson_scene::DisplayMode;
use super::lesson_state::LessonState;
use super::messages::SecondHandStatus;
use super::platform;
use super::results::{BundleState, LessonResults, ResultTexts, results_ui};
use super::screen::Screen;
use super::session_history::SessionHistory;
use super::settings::{self, Settings};
use super::settings_screen::{kiosk_settings_ui, settings_ui};
use super::state_log::StateLog;
use super::viewport::Viewport;
use super::{AppOptions, briefing, practice, questionnaire, shortcuts, theme, viewport};
use eframe::egui::{self, ViewportCommand};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;
use typodont_audio::wav_files;
use typodont_audio::{PlaybackOptions, Replacements};
use typodont_author::new_exercise;
use typodont_exercise::scenario::{QuestionnaireTime, Scenario};
use typodont_exercise::session::Input;
use typodont_formats::Library;
use typodont_formats::diagnostic::{Diagnostic, headlines};
use typodont_lesson as lesson;
use typodont_lesson::SessionSeed;
use typodont_report::FirstResult;
use typodont_report::bundle::BundleFolder;

pub struct App {
    options: AppOptions,
    settings: Settings,
    languages: Vec<Translations>,
    words: Translations,
    exercise_list: ExerciseList,
    history: SessionHistory,
    /// Bundles that are still being made after their results were left.
    completions: Vec<Completion>,
    participant: String,
    /// Examiner's code for the next session, as typed in the briefing. Forgotten when that session begins.
    examiner_code: String,
    screen: Screen,
    /// The editor to return to after the test run of an exercise.
    test_run_origin: Option<Box<EditorState>>,
    overlay: shortcuts::OverlayState,
    closing: CloseState,
    /// A supervisor's attempt to close a kiosk.
    kiosk_exit: KioskExit,
    /// Settings with which the window opened.
    first_settings: Settings,
    /// True if a widget had the keyboard focus at the end of the last frame.
    had_focus: bool,
    /// True if settings were changed and are not saved yet.
    has_unsaved_settings: bool,
    /// Errors that concern no single screen, such as unreadable settings, languages or sounds.
    complaints: Vec<String>,
    state_log: StateLog,
    /// True if a graphics processor draws; false for rendering in software.
    has_graphics: bool,
    /// Sound files with which the school replaces the built-in sounds.
    replacements: Replacements,
    /// Created for the first lesson and kept for the next.
    viewport: Option<Viewport>,
    frame_count: u64,
    /// Time of the last input, s.
    last_input: f64,
}

/// State of a request to close the window.
#[derive(Clone, Copy, PartialEq, Eq)]
enum CloseState {
    No,
    /// The user is asked to confirm that the lesson is aborted.
    Asked,
    /// The window closes as soon as the lesson's bundle is written.
    AfterLesson,
}

/// Frame interval of a running lesson.
const LESSON_FRAME_INTERVAL: Duration = Duration::from_millis(16);

/// Frame interval of the other screens: soon after an input, and at rest.
const BUSY_FRAME_INTERVAL: Duration = Duration::from_millis(100);
const IDLE_FRAME_INTERVAL: Duration = Duration::from_secs(1);

/// Time after an input during which a screen is busy, s.
const BUSY_TIME: f64 = 2.0;

impl App {
    pub fn new(context: &eframe::CreationContext, mut options: AppOptions) -> App {
        let ctx = &context.egui_ctx;
        let (mut settings, languages, mut complaints) = settings::load_with_languages();
        if let Some(station) = &options.station {
            settings = station.settings(settings);
            complaints.extend(station.complaint.clone());
        }
        let is_known = |code: &String| languages.iter().any(|words| words.code == *code);
        if let Some(code) = options.language.take().filter(is_known) {
            settings.language = code;
        }
        let (replacements, broken) = read_sounds();
        complaints.extend((!broken.is_empty()).then(|| headlines(&broken)));
        theme::apply(ctx, &settings);
        let is_given = options.given.is_some();
        let mut exercise_list = match options.given.take() {
            Some(given) => ExerciseList::only(given),
            None => ExerciseList::load(&settings.exercises),
        };
        let mut screen = Screen::ExerciseList;
        if let Some(path) = &options.exercise {
            exercise_list.add_and_select(path);
            if let Some(scan) = &options.tooth {
                exercise_list.replace_teeth(scan);
            }
        }
        let is_one_selected = is_given || options.exercise.is_some();
        if is_one_selected && exercise_list.selected_exercise().is_some_and(|e| e.scenario.is_ok()) {
            screen = Screen::Briefing;
        }
        let begins = options.begins_at_once;
        let history = SessionHistory::read(&options.out, options.templates.clone(), repaint_waker(ctx));
        let mut app = App {
            history,
            completions: Vec::new(),
            words: i18n::select_language(&languages, &settings.language),
            participant: options.participant.clone(),
            examiner_code: String::new(),
            options,
            first_settings: settings.clone(),
            kiosk_exit: KioskExit::default(),
            settings,
            languages,
            exercise_list,
            screen,
            test_run_origin: None,
            overlay: shortcuts::OverlayState::default(),
            closing: CloseState::No,
            had_focus: false,
            has_unsaved_settings: false,
            complaints,
            state_log: StateLog::from_environment(),
            replacements,
            has_graphics: context.wgpu_render_state.as_ref().is_some_and(viewport::has_graphics),
            viewport: None,
            frame_count: 0,
            last_input: 0.0,
        };
        if let (Some(mode), Some(path)) = (app.options.editor_mode, app.options.exercise.clone()) {
            app.open_editor(&path, mode, ctx);
        } else if begins {
            app.begin_lesson(ctx);
        }
        app
    }

    /// Time until the next frame, if nothing requests one before.
    fn frame_interval(&mut self, ctx: &egui::Context) -> Duration {
        let now = ctx.input(|input| input.time);
        if ctx.input(|input| !input.events.is_empty()) {
            self.last_input = now;
        }
        match &self.screen {
            Screen::Lesson(lesson) if lesson.needs_frames() => Duration::ZERO,
            // Building the workpiece needs the processors; when it is built, the lesson's thread requests a frame.
            Screen::Lesson(lesson) if lesson.scene.is_none() => theme::PROGRESS_DOT_INTERVAL,
            Screen::Lesson(lesson) if !lesson.are_stages_over => {
                match lesson.view_refresh.is_active(now) || lesson.pointer_hand.is_pressing {
                    true => LESSON_FRAME_INTERVAL,
                    // Only the clock moves. Movement of the hand requests a frame at once.
                    false => lesson.time_to_next_second(),
                }
            }
            _ if now - self.last_input < BUSY_TIME => BUSY_FRAME_INTERVAL,
            _ => IDLE_FRAME_INTERVAL,
        }
    }

    /// Takes over all events since the last frame.
    fn poll(&mut self, ctx: &egui::Context) {
        if let Screen::Editor(editor) = &mut self.screen {
            editor.poll(ctx.input(|input| input.time));
        }
        self.history.poll();
        self.poll_kiosk(ctx);
        for completion in &mut self.completions {
            completion.poll();
            match &completion.state().outcome {
                Some(Ok(bundle)) => finish_bundle(&self.options, bundle),
                Some(Err(why)) => self.complaints.push(why.clone()),
                None => {}
            }
        }
        self.completions.retain(|completion| completion.state().outcome.is_none());
        match &mut self.screen {
            Screen::Lesson(lesson) => {
                lesson.poll(self.settings.volume, ctx.input(|input| input.unstable_dt));
                self.skip_questionnaire();
                self.poll_lesson();
            }
            Screen::Completion(completion) => {
                completion.poll();
                self.poll_interrupted();
            }
            Screen::Results(results) if results.is_pending() => {
                results.poll(ctx);
                if let BundleState::Finished(bundle) = &results.state {
                    finish_bundle(&self.options, bundle);
                }
            }
            _ => {}
        }
    }

    /// Makes a kiosk ready for the next participant after some time without input, and keeps it on the whole screen.
    fn poll_kiosk(&mut self, ctx: &egui::Context) {
        let Some(kiosk) = self.options.kiosk() else { return };
        let now = ctx.input(|input| input.time);
        let is_at_rest = matches!(self.screen, Screen::Briefing | Screen::Results(_) | Screen::Failed(_))
            || (matches!(self.screen, Screen::ExerciseList) && !self.participant.is_empty());
        let idle_limit = kiosk.idle.as_secs_f64();
        if !is_at_rest {
            // Whoever moves a haptic device touches neither the mouse nor the keyboard.
            self.last_input = now;
        } else if now - self.last_input > idle_limit {
            self.change_participant(ctx);
        }
        let (is_full, is_minimized) =
            ctx.input(|input| (input.viewport().fullscreen, input.viewport().minimized.unwrap_or(false)));
        if is_full == Some(false) || is_minimized {
            ctx.send_viewport_cmd(ViewportCommand::Minimized(false));
            ctx.send_viewport_cmd(ViewportCommand::Fullscreen(true));
        }
    }

    /// Shows the list without a participant. In a kiosk, the language and the size of the last one are forgotten, too.
    fn change_participant(&mut self, ctx: &egui::Context) {
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
    fn leave_kiosk(&mut self, ctx: &egui::Context) {
        let App { kiosk_exit, options, .. } = self;
        if options.kiosk().is_some_and(|kiosk| kiosk_exit.try_code(kiosk)) {
            ctx.send_viewport_cmd(ViewportCommand::Close);
        }
    }

    /// Shows the result of the lesson once it is scored, or the reason why there is none.
    fn poll_lesson(&mut self) {
        let Screen::Lesson(lesson) = &mut self.screen else { return };
        if let Some(first) = lesson.completion.first_result.take() {
            if let Some(ended) = lesson.ended {
                self.state_log.record("result_after_ms", ended.elapsed().as_millis());
            }
            if let Screen::Lesson(lesson) = std::mem::replace(&mut self.screen, Screen::ExerciseList) {
                let is_test_run = self.test_run_origin.is_some();
                self.show_results(*first, Completion::of_lesson(lesson), !is_test_run);
            }
        } else if let Some(Err(why)) = lesson.completion.outcome.take() {
            self.screen = Screen::Failed(why);
        }
    }

    /// Shows the result of an interrupted session once it is scored, or the reason why there is none.
    fn poll_interrupted(&mut self) {
        let Screen::Completion(completion) = &mut self.screen else { return };
        if let Some(first) = completion.take_first_result() {
            let has_retry = self.exercise_list.select_id(&first.session.scenario.id);
            if let Screen::Completion(completion) = std::mem::replace(&mut self.screen, Screen::ExerciseList) {
                self.show_results(*first, *completion, has_retry);
            }
        } else if let Some(Err(why)) = completion.state().outcome.clone() {
            self.screen = Screen::Failed(why);
        }
    }

    fn show_results(&mut self, first: FirstResult, completion: Completion, has_retry: bool) {
        if self.test_run_origin.is_none() {
            self.complaints.extend(self.history.add(&first.session));
        }
        let has_report = self.options.kiosk().is_none();
        self.screen = Screen::Results(Box::new(LessonResults::new(first, completion, has_retry, has_report)));
    }

    /// Ends a lesson without its questionnaire if the exercise asks it at the end of the course, and that is not yet.
    fn skip_questionnaire(&mut self) {
        let Screen::Lesson(lesson) = &mut self.screen else { return };
        if !lesson.are_stages_over || lesson.is_submitted || lesson.is_questionnaire_due {
            return;
        }
        let course = self.exercise_list.course();
        let scenario = &lesson.scenario;
        lesson.is_questionnaire_due = self.test_run_origin.is_some()
            || scenario.questionnaire_time == QuestionnaireTime::EachTime
            || self.history.is_course_over(scenario, &course, &self.participant);
        if !lesson.is_questionnaire_due {
            lesson.submit_questionnaire();
        }
    }

    /// Leaves the results; a bundle that is still being made is completed in the background. A page keeps no bundle: one
    /// that was not saved is saved now.
    fn leave_results(&mut self) {
        if platform::IS_PAGE && matches!(&self.screen, Screen::Results(results) if !results.is_downloaded) {
            self.download_bundle();
        }
        if let Screen::Results(results) = std::mem::replace(&mut self.screen, Screen::ExerciseList)
            && let BundleState::Pending(completion) = results.state
        {
            self.completions.push(completion);
        }
    }

    /// Progress of a bundle that is being made in the background.
    fn background_progress(&self) -> Option<CompletionProgress> {
        self.completions.first().map(|completion| completion.state().progress)
    }

    /// Scores the interrupted session that the list offers.
    fn finish_interrupted(&mut self, ctx: &egui::Context) {
        let Some(session) = self.history.take_interrupted() else { return };
        let templates = self.options.templates.clone();
        self.screen = match Completion::of_interrupted(session, templates, repaint_waker(ctx)) {
            Ok(completion) => Screen::Completion(Box::new(completion)),
            Err(e) => Screen::Failed(format!("no-thread: the session cannot be scored: {e}")),
        };
    }

    fn set_interrupted_aside(&mut self) {
        let moved = self.history.take_interrupted().map(|session| session.set_aside());
        if let Some(Err(why)) = moved {
            self.complaints.push(why);
        }
    }

    fn execute(&mut self, command: AppCommand, ctx: &egui::Context) {
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
            AppCommand::BackToList => self.go_back(),
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
            AppCommand::TryAgain => {
                self.leave_results();
                self.screen = Screen::Briefing;
            }
            AppCommand::FinishInterrupted => self.finish_interrupted(ctx),
            AppCommand::SetAsideInterrupted => self.set_interrupted_aside(),
            AppCommand::ShowShortcuts(is_open) => {
                self.open_overlay(shortcuts::OverlayState { shortcuts: is_open, settings: false })
            }
            AppCommand::ShowSettings(is_open) => {
                self.open_overlay(shortcuts::OverlayState { shortcuts: false, settings: is_open })
            }
            AppCommand::ChangeParticipant => self.change_participant(ctx),
            AppCommand::AskToLeaveKiosk(is_asked) => self.kiosk_exit.ask(is_asked),
            AppCommand::LeaveKiosk => self.leave_kiosk(ctx),
            AppCommand::CloseWindow(is_closing) => self.confirm_close(is_closing, ctx),
            AppCommand::ApplySettings(settings) => self.apply_settings(*settings, ctx),
            AppCommand::Practice(command) => {
                if let Screen::Lesson(lesson) = &mut self.screen {
                    execute_in_lesson(lesson, command);
                }
            }
            AppCommand::Camera(command) => self.move_camera(command),
        }
    }

    /// Moves the selection down the list by this many places; negative is up.
    fn select_next_exercise(&mut self, by: i32) {
        let last = self.exercise_list.exercises.len().saturating_sub(1);
        self.exercise_list.selected = self.exercise_list.selected.saturating_add_signed(by as isize).min(last);
        self.exercise_list.scroll_to_selected = true;
    }

    /// Shows the instructions of the selected exercise, if it is valid.
    fn open_briefing(&mut self) {
        let App { exercise_list: list, history, participant, settings, .. } = self;
        if list.can_open_selected(history, participant, settings) {
            self.examiner_code.clear();
            self.screen = Screen::Briefing;
        }
    }

    /// Returns to the author's screen after a test run, otherwise to the list of exercises.
    fn go_back(&mut self) {
        self.leave_results();
        self.examiner_code.clear();
        if let Some(mut editor) = self.test_run_origin.take() {
            editor.invalidate_preview();
            self.screen = Screen::Editor(editor);
            return;
        }
        self.exercise_list.scroll_to_selected = true;
        self.screen = Screen::ExerciseList;
    }

    /// Opens the report of the results in the browser.
    fn open_report(&self, ctx: &egui::Context) {
        if let Screen::Results(results) = &self.screen
            && let Some(page) = results.report_url()
        {
            ctx.open_url(egui::OpenUrl::new_tab(page));
        }
    }

    /// Gives the bundle of the results to the user as one file.
    fn download_bundle(&mut self) {
        if let Screen::Results(results) = &mut self.screen
            && let BundleState::Finished(bundle) = &results.state
        {
            let complaint = platform::download(bundle);
            results.is_downloaded = complaint.is_none();
            self.complaints.extend(complaint);
        }
    }

    /// True if work would be lost with a page that is closed now.
    fn has_unsaved_work(&self) -> bool {
        match &self.screen {
            Screen::Lesson(_) | Screen::Completion(_) => true,
            Screen::Results(results) => !results.is_downloaded,
            _ => !self.completions.is_empty(),
        }
    }

    /// Moves the camera of a lesson or of the author's preview.
    fn move_camera(&mut self, command: CameraCommand) {
        let orbit = match &mut self.screen {
            Screen::Lesson(lesson) => &mut lesson.orbit,
            Screen::Editor(editor) => &mut editor.preview.orbit,
            Screen::ExerciseList
            | Screen::Briefing
            | Screen::Completion(_)
            | Screen::Results(_)
            | Screen::Failed(_) => return,
        };
        *orbit = match command {
            CameraCommand::Orbit { right, up } => orbit.rotated(right, up),
            CameraCommand::Zoom(factor) => orbit.zoomed(factor),
            CameraCommand::Pan { right, up } => orbit.panned(right, up),
        };
    }

    /// Shows one page over the screen, or none. The pointer is released while a page is shown.
    fn open_overlay(&mut self, overlay: shortcuts::OverlayState) {
        self.overlay = overlay;
        if let Screen::Lesson(lesson) = &mut self.screen
            && lesson.is_pointer_captured
        {
            lesson.release_pointer();
        }
    }

    /// Aborts the lesson and closes the window when its bundle is written, or continues the lesson.
    fn confirm_close(&mut self, is_closing: bool, ctx: &egui::Context) {
        self.closing = CloseState::No;
        match &mut self.screen {
            _ if !is_closing => {}
            Screen::Lesson(lesson) => {
                lesson.abort();
                self.closing = CloseState::AfterLesson;
            }
            _ => ctx.send_viewport_cmd(ViewportCommand::Close),
        }
    }

    /// Opens the author's screen with a new exercise in the user's language.
    fn create_exercise(&mut self, ctx: &egui::Context) {
        let words = &self.words;
        let lines = ["author.new_cleared", "author.new_spared", "author.new_light"].map(|key| words.get(key));
        let [title, stage, instruction] =
            ["author.new_title", "author.new_stage", "author.new_instruction"].map(|key| words.get(key));
        let text = new_exercise(title, stage, instruction, lines, words.get("author.new_fail"));
        self.screen = Screen::Editor(Box::new(EditorState::new(text, repaint_waker(ctx))));
    }

    /// Opens the selected exercise at the author's screen; a shipped exercise is opened as a copy.
    fn edit_selected(&mut self, ctx: &egui::Context) {
        let Some(exercise) = self.exercise_list.selected_exercise() else { return };
        match (exercise.path.clone(), exercise_list::shipped_text(&exercise.name)) {
            (Some(path), _) => self.open_editor(&path, OpenMode::Edit, ctx),
            (None, Some(text)) => {
                self.screen = Screen::Editor(Box::new(EditorState::copy(&exercise.name, text, repaint_waker(ctx))));
            }
            (None, None) => {}
        }
    }

    fn open_editor(&mut self, path: &Path, mode: OpenMode, ctx: &egui::Context) {
        self.screen = match EditorState::open(path, mode, repaint_waker(ctx)) {
            Ok(editor) => Screen::Editor(Box::new(editor)),
            Err(complaint) => Screen::Failed(complaint.headline()),
        };
    }

    /// Returns to the exercise list, which now includes the edited exercise. Unsaved changes are kept as a draft.
    fn leave_editor(&mut self) {
        let Screen::Editor(editor) = &mut self.screen else { return };
        editor.autosave();
        let path = editor.path.clone();
        self.exercise_list = ExerciseList::load(&self.settings.exercises);
        if let Some(path) = path {
            self.exercise_list.select_file(&path);
        }
        self.screen = Screen::ExerciseList;
    }

    /// Begins a lesson with the exercise being edited. Its bundle replaces that of the test run before.
    fn test_run(&mut self, ctx: &egui::Context) {
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
        let out = platform::config_folder().unwrap_or_else(std::env::temp_dir).join("tried");
        let _ = std::fs::remove_dir_all(&out);
        let left = std::mem::replace(&mut self.screen, Screen::ExerciseList);
        if let Screen::Editor(editor) = left {
            self.test_run_origin = Some(editor);
        }
        self.begin_lesson_with(Arc::new(scenario), library, BTreeMap::new(), out, ctx);
    }

    /// Delays a request to close the window while a lesson runs and until its bundle is written.
    fn handle_close_request(&mut self, ctx: &egui::Context) {
        let is_asked = ctx.input(|input| input.viewport().close_requested());
        if is_asked && self.options.kiosk().is_some() && !self.kiosk_exit.is_allowed {
            ctx.send_viewport_cmd(ViewportCommand::CancelClose);
            self.open_overlay(shortcuts::OverlayState::default());
            return self.kiosk_exit.ask(true);
        }
        let is_in_lesson = matches!(self.screen, Screen::Lesson(_));
        let is_completing = !self.completions.is_empty()
            || match &self.screen {
                Screen::Lesson(lesson) => lesson.is_scoring,
                Screen::Completion(_) => true,
                Screen::Results(results) => results.is_pending(),
                _ => false,
            };
        if ctx.input(|input| input.viewport().close_requested())
            && let Screen::Editor(editor) = &mut self.screen
        {
            editor.autosave();
        }
        if ctx.input(|input| input.viewport().close_requested()) && (is_in_lesson || is_completing) {
            ctx.send_viewport_cmd(ViewportCommand::CancelClose);
            if is_completing {
                self.closing = CloseState::AfterLesson;
            } else if self.closing == CloseState::No {
                self.open_overlay(shortcuts::OverlayState::default());
                self.closing = CloseState::Asked;
            }
        }
        if self.closing == CloseState::AfterLesson && !is_in_lesson && !is_completing {
            ctx.send_viewport_cmd(ViewportCommand::Close);
        }
    }

    fn begin_lesson(&mut self, ctx: &egui::Context) {
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

    fn begin_lesson_with(
        &mut self,
        scenario: Arc<Scenario>,
        library: Library,
        digests: BTreeMap<String, String>,
        out: PathBuf,
        ctx: &egui::Context,
    ) {
        let input_device = match self.options.device.as_deref().unwrap_or(&self.settings.device) {
            "mouse" => InputDevice::Mouse,
            device => match lesson::open_device(device) {
                Ok(held) => InputDevice::Device(held),
                Err(failed) => {
                    self.screen = Screen::Failed(failed.to_string());
                    return;
                }
            },
        };
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
            wake: Arc::from(repaint_waker(ctx)),
        };
        // A sealed seed is shown nowhere; the sound does not need it.
        let shown_seed = if seed.is_sealed() { 0 } else { seed.value };
        self.state_log.record("seed", shown_seed);
        let output =
            PlaybackOptions { seed: shown_seed, replacements: self.replacements.clone(), ..PlaybackOptions::default() };
        let mode = if self.has_graphics { DisplayMode::Iso } else { DisplayMode::Surface };
        self.screen = match LessonState::begin(config, library, output, mode) {
            Ok(lesson) => Screen::Lesson(Box::new(lesson)),
            Err(why) => Screen::Failed(why),
        };
    }

    fn apply_settings(&mut self, settings: Settings, ctx: &egui::Context) {
        self.words = i18n::select_language(&self.languages, &settings.language);
        if settings.font_size == self.settings.font_size {
            theme::apply(ctx, &settings);
        }
        self.settings = settings;
        self.has_unsaved_settings = true;
    }

    /// Applies and saves changed settings once the mouse button is released: a text size that changed during a drag
    /// would move the slider away from the pointer.
    fn save_settings(&mut self, ctx: &egui::Context) {
        if self.has_unsaved_settings && !ctx.input(|input| input.pointer.any_down()) {
            theme::apply(ctx, &self.settings);
            let own = match &self.options.station {
                Some(station) if station.kiosk.is_some() => None,
                Some(station) => Some(station.own_settings(&self.settings, Settings::load().0)),
                None => Some(self.settings.clone()),
            };
            self.complaints.extend(own.and_then(|own| own.save()));
            self.has_unsaved_settings = false;
        }
    }

    fn screen_ui(&mut self, ui: &mut egui::Ui, frame: &eframe::Frame, commands: &mut Vec<AppCommand>) {
        let is_test_run = self.test_run_origin.is_some();
        let completion = self.background_progress();
        let App { screen, exercise_list, history, options, words, settings, participant, viewport, .. } = self;
        let examiner_code = options.seed_code.is_none().then_some(&mut self.examiner_code);
        match screen {
            Screen::ExerciseList => {
                let context = ListContext { history, settings, words, is_kiosk: options.kiosk().is_some() };
                exercise_list_ui(ui, exercise_list, participant, &context, commands);
            }
            Screen::Editor(editor) => {
                if let (None, Some(state)) = (&viewport, frame.wgpu_render_state()) {
                    *viewport = Some(Viewport::new(state));
                }
                editor::editor_ui(ui, editor, viewport.as_mut(), words, commands);
            }
            Screen::Briefing => {
                if let Some(Ok(scenario)) = exercise_list.selected_exercise().map(|exercise| &exercise.scenario) {
                    let is_code_required = options.kiosk().is_some();
                    let fields = BriefingFields { participant, is_code_required, examiner_code };
                    briefing::briefing_ui(ui, scenario, fields, completion, words, commands);
                }
            }
            Screen::Lesson(lesson) if lesson.are_stages_over && !lesson.is_submitted => {
                questionnaire::questionnaire_ui(ui, lesson, words, commands);
                lesson.scroll_to_statement = false;
            }
            Screen::Lesson(lesson) if lesson.are_stages_over || lesson.is_scoring => {
                let texts = &lesson.scenario.texts;
                let timed_out = lesson.timed_out_stage.as_deref().map(|stage| words.own(texts, stage));
                scoring_ui(ui, lesson.completion.progress, timed_out, words);
            }
            Screen::Completion(completion) => scoring_ui(ui, completion.state().progress, None, words),
            Screen::Lesson(lesson) => {
                if let (None, Some(state)) = (&viewport, frame.wgpu_render_state()) {
                    *viewport = Some(Viewport::new(state));
                }
                practice::practice_ui(ui, lesson, settings, viewport.as_mut(), words, commands);
            }
            Screen::Results(results) => {
                let texts = ResultTexts { words, languages: options.templates.languages() };
                results_ui(ui, results, is_test_run, &texts, commands);
            }
            Screen::Failed(why) => theme::centered_column(ui, |ui| {
                ui.heading(words.get("desk.failed"));
                ui.label(why.as_str());
                ui.add_space(12.0);
                if ui.add(theme::primary_button(words.get("results.again"))).clicked() {
                    commands.push(AppCommand::BackToList);
                }
            }),
        }
    }

    /// Pages over the screen: shortcuts, settings, the question before closing.
    fn overlay_ui(&mut self, ctx: &egui::Context, commands: &mut Vec<AppCommand>) {
        let words = &self.words;
        if let Some(kiosk) = self.options.kiosk().filter(|_| self.kiosk_exit.is_asked) {
            let exit = &mut self.kiosk_exit;
            modal_page(ctx, words.get("kiosk.close_title"), |ui| kiosk::exit_ui(ui, exit, kiosk, words, commands));
        }
        if self.overlay.shortcuts {
            modal_page(ctx, words.get("keys.title"), |ui| shortcuts::shortcuts_ui(ui, words, commands));
        }
        if self.overlay.settings {
            modal_page(ctx, words.get("settings.title"), |ui| match self.options.kiosk() {
                Some(_) => kiosk_settings_ui(ui, &self.settings, &self.languages, words, commands),
                None => settings_ui(ui, &self.settings, self.has_graphics, &self.languages, words, commands),
            });
        }
        if self.closing == CloseState::Asked {
            modal_page(ctx, words.get("desk.close"), |ui| {
                ui.label(words.get("practice.give_up_sure"));
                ui.add_space(8.0);
                ui.horizontal(|ui| {
                    for (key, is_closing) in [("desk.close_yes", true), ("practice.give_up_no", false)] {
                        if ui.button(words.get(key)).clicked() {
                            commands.push(AppCommand::CloseWindow(is_closing));
                        }
                    }
                });
            });
        }
    }

    /// Writes the state of the screen to the state log, a line per change.
    fn log_state(&mut self) {
        let App { state_log, screen, exercise_list, overlay: open, closing, frame_count, kiosk_exit, .. } = self;
        state_log.record("kiosk", kiosk_exit.state());
        let (history, participant, settings) = (&self.history, &self.participant, &self.settings);
        state_log.record(
            "over",
            if open.shortcuts {
                "keys"
            } else if open.settings {
                "settings"
            } else if *closing == CloseState::Asked {
                "close"
            } else {
                "nothing"
            },
        );
        match screen {
            Screen::ExerciseList => {
                state_log.record("unfinished", u8::from(history.interrupted().is_some()));
                let chosen = exercise_list.selected_exercise().map_or("", |e| e.id());
                let summary = history.summary(chosen, participant);
                state_log.record("done", format!("{} {}", summary.count, summary.is_passed));
                let required = exercise_list.required_before(exercise_list.selected, history, participant, settings);
                state_log.record("required", required.map_or("nothing", |first| first.id()));
                state_log.record("screen", "shelf");
                state_log.record("chosen", exercise_list.selected_exercise().map_or("", |e| e.id()));
            }
            Screen::Editor(editor) => {
                log_editor(state_log, editor);
                state_log.record("turn", *frame_count);
            }
            Screen::Briefing => state_log.record("screen", "briefing"),
            Screen::Lesson(lesson) => log_lesson(state_log, lesson),
            Screen::Completion(_) => state_log.record("screen", "scoring"),
            Screen::Results(results) => {
                if let BundleState::Finished(bundle) = &results.state {
                    state_log.record("bundle", bundle.path().display());
                }
                state_log.record("screen", "results");
            }
            Screen::Failed(why) => state_log.record("screen", format!("failed {why}")),
        }
    }
}

/// The bar above every screen, with the buttons for help and settings.
fn top_bar_ui(ui: &mut egui::Ui, words: &Translations, commands: &mut Vec<AppCommand>) {
    let frame = egui::Frame::NONE.inner_margin(egui::Margin::symmetric(12, 4));
    egui::Panel::top("top").resizable(false).frame(frame).show_separator_line(false).show(ui, |ui| {
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            for (key, command) in
                [("menu.settings", AppCommand::ShowSettings(true)), ("menu.keys", AppCommand::ShowShortcuts(true))]
            {
                let button = ui.add(egui::Button::new(words.get(key)).small());
                editor::anchor(ui, key, button.rect);
                if button.clicked() {
                    commands.push(command);
                }
            }
        });
    });
}

/// The page that is shown until the result is known.
fn scoring_ui(ui: &mut egui::Ui, progress: CompletionProgress, timed_out: Option<&str>, words: &Translations) {
    theme::centered_column(ui, |ui| {
        if let Some(stage) = timed_out {
            ui.label(egui::RichText::new(words.format("results.time_up", stage)).size(20.0).color(theme::WARNING));
        }
        ui.heading(words.get("practice.scoring"));
        theme::progress_bar(ui, words.get(progress.key), progress.share);
        theme::progress_dots(ui);
    });
}

/// A modal page over the screen; it takes all keyboard and pointer input.
fn modal_page(ctx: &egui::Context, title: &str, contents: impl FnOnce(&mut egui::Ui)) {
    let room = ctx.content_rect().size() - egui::vec2(80.0, 120.0);
    let height = room.y.max(200.0);
    let frame = egui::Frame::popup(&ctx.global_style()).inner_margin(24);
    egui::Modal::new(egui::Id::unique(title)).frame(frame).show(ctx, |ui| {
        ui.heading(title);
        ui.add_space(10.0);
        // As high as it needs to be, up to the window's own height.
        egui::ScrollArea::vertical().max_height(height).min_scrolled_height(height).show(ui, contents);
    });
}

fn log_editor(log: &mut StateLog, editor: &EditorState) {
    log.record("part", format!("{:?}", editor.section));
    log.record("file", editor.path.as_ref().map_or(String::new(), |path| path.display().to_string()));
    log.record("unsaved", editor.is_unsaved());
    log.record("complaints", editor.complaints.len());
    log.record("checked", editor.is_checked);
    log.record("teeth", editor.preview.generation);
    log.record("told", editor.notice.as_ref().map_or("", |(key, _)| key));
    let chosen = editor.selected_decay_pointer().and_then(|at| Some(editor.draft.value_at(&at)?.to_string()));
    log.record("decay", chosen.unwrap_or_default());
    log.record("screen", "author");
}

/// Tells of a bundle that has just been finished.
fn finish_bundle(options: &AppOptions, bundle: &BundleFolder) {
    if let Some(listener) = &options.on_bundle {
        listener(bundle);
    }
}

/// A function that makes the window draw a new frame; callable from another thread.
fn repaint_waker(ctx: &egui::Context) -> Box<dyn Fn() + Send + Sync> {
    let ctx = ctx.clone();
    Box::new(move || ctx.request_repaint())
}

fn log_lesson(log: &mut StateLog, lesson: &LessonState) {
    if lesson.is_scoring {
        log.record("screen", "scoring");
    } else if lesson.are_stages_over {
        log.record("statement", lesson.statement);
        log.record("rated", lesson.ratings.len());
        log.record("screen", "questionnaire");
    } else {
        log.record("screen", if lesson.stage.is_some() { "practice" } else { "making" });
    }
    log.record("pointer", if lesson.is_pointer_captured { "held" } else { "free" });
    log.record("paused", lesson.is_paused);
    log.record("clock", if lesson.is_awaiting_movement { "stopped" } else { "running" });
    log.record("asked", if lesson.is_confirming_finish { "finish" } else { "nothing" });
    if let Some(SecondHandStatus::AwaitingConnection(address)) = lesson.second_hand {
        log.record("may_join", address);
    }
    log.record("view", format!("{:.4} {:.4}", lesson.orbit.azimuth, lesson.orbit.elevation));
    if let Some(scene) = &lesson.scene {
        log.record("open", scene.mouth_opening);
        let specks = scene.particles.as_ref().map_or((0, 0), |field| (field.opaque().len(), field.translucent().len()));
        log.record("dust", specks.0);
        log.record("water", specks.1);
        log.record("tooth", if scene.is_new { "made" } else { "drawn" });
    }
    log.record("shown", format!("{:?}", lesson.display_mode));
    if let Some(snapshot) = lesson.snapshot {
        let [x, y, z] = snapshot.hand.to_array();
        log.record("hand", format!("{x:.2} {y:.2} {z:.2}"));
        let [x, y, z] = snapshot.tip.to_array();
        log.record("tip", format!("{x:.2} {y:.2} {z:.2}"));
        log.record("cleared", format!("{:.0}", snapshot.cleared_pct.unwrap_or_default()));
        log.record("instrument", snapshot.instrument);
        log.record("ticks", snapshot.timing.ticks);
        log.record(
            "late",
            format!("{} {} {}", snapshot.timing.late_p99, snapshot.timing.late_max, snapshot.timing.missed),
        );
    }
}

/// Carries out commands of a lesson.
fn execute_in_lesson(lesson: &mut LessonState, command: PracticeCommand) {
    match command {
        PracticeCommand::SelectInstrument(instrument) => lesson.submit(Input::Take { instrument }),
        PracticeCommand::AnswerQuestion(question, value) => lesson.answer_question(question, value),
        PracticeCommand::AddToChart(sign) => lesson.add_to_chart(sign),
        PracticeCommand::FinishStage => lesson.finish_stage(),
        PracticeCommand::ContinueStage => lesson.is_confirming_finish = false,
        PracticeCommand::Pause(is_paused) => lesson.pause(is_paused),
        PracticeCommand::AskToAbort(is_giving_up) => lesson.is_confirming_abort = is_giving_up,
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
        PracticeCommand::SetPressure(share) => lesson.pointer_hand.pressure = share,
        PracticeCommand::SetDeviceButton { bit, is_down } => lesson.set_pointer_button(bit, is_down),
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
    lesson.is_pointer_captured = is_held && lesson.has_mouse() && !lesson.is_paused;
    if !is_held {
        lesson.release_pointer();
    }
}

/// The school's own sounds, and the files that are not sounds. A page has no folder for them.
fn read_sounds() -> (Replacements, Vec<Diagnostic>) {
    match platform::IS_PAGE {
        true => Default::default(),
        false => wav_files::read_folder(&sounds_folder()),
    }
}

/// Folder of the school's own sounds: `content/sounds` in the working folder, else `sounds` in the settings folder.
fn sounds_folder() -> PathBuf {
    let beside = PathBuf::from("content/sounds");
    match platform::config_folder() {
        Some(folder) if !beside.is_dir() => folder.join("sounds"),
        _ => beside,
    }
}

impl eframe::App for App {
    fn clear_color(&self, visuals: &egui::Visuals) -> [f32; 4] {
        visuals.panel_fill.to_normalized_gamma_f32()
    }

    fn ui(&mut self, ui: &mut egui::Ui, frame: &mut eframe::Frame) {
        let ctx = ui.ctx().clone();
        let mut commands = Vec::new();
        self.poll(&ctx);
        self.handle_close_request(&ctx);
        shortcuts::collect_commands(&ctx, &self.screen, self.overlay, self.had_focus, &mut commands);
        top_bar_ui(ui, &self.words, &mut commands);
        for complaint in &self.complaints {
            ui.colored_label(theme::ERROR, complaint);
        }
        self.screen_ui(ui, frame, &mut commands);
        self.overlay_ui(&ctx, &mut commands);
        for command in commands {
            self.execute(command, &ctx);
        }
        self.save_settings(&ctx);
        platform::set_unsaved_work(self.has_unsaved_work());
        self.had_focus = ctx.memory(|memory| memory.focused().is_some());
        self.frame_count += 1;
        self.state_log.record("frames", self.frame_count);
        self.log_state();
        editor::log_anchors(&ctx, &mut self.state_log);
        if let Some(wait) = self.options.frame_delay {
            std::thread::sleep(wait);
        }
        ctx.request_repaint_after(self.frame_interval(&ctx));
    }
}
