//! The application: chooses the screen that is shown, and carries out the commands of every screen.
//!
//! Before each frame [`eframe::App::logic`] takes over events, also while the window is known to be hidden.
//! [`eframe::App::ui`] draws the frame, and then has the commands carried out that were asked for in it.

mod command_handler;
mod events;
mod frame;
mod frame_log;

use crate::AppOptions;
use crate::command::{AppCommand, CameraCommand};
use crate::completion::Completion;
use crate::editor::EditorState;
use crate::exercise_list::ExerciseList;
use crate::gamepad::GamepadPointer;
use crate::given_file::GivenFile;
use crate::i18n::{self, Translations};
use crate::inbox::Inbox;
use crate::kiosk::KioskExit;
use crate::platform;
use crate::platform::DeviceAnswer;
use crate::screen::Screen;
use crate::session_history::SessionHistory;
use crate::settings::{self, Settings};
use crate::state_log::StateLog;
use crate::ui::mirrored_window::MirrorPlugin;
use crate::ui::touches::PointerInUse;
use crate::ui::views::Views;
use crate::ui::{shortcuts, theme, ui_anchors, viewport};
use crate::user_folder::UserFolder;
use eframe::egui;
use std::path::PathBuf;
use std::time::Duration;
use typodont_audio::Replacements;
use typodont_audio::wav_files;
use typodont_formats::diagnostic::{Diagnostic, headlines};

pub struct App {
    options: AppOptions,
    user_folder: UserFolder,
    settings: Settings,
    languages: Vec<Translations>,
    words: Translations,
    exercise_list: ExerciseList,
    history: SessionHistory,
    /// Bundles that are still being made after their results were left.
    completions: Vec<Completion>,
    /// Files that the user gives to the window.
    inbox: Inbox<GivenFile>,
    device_inbox: Inbox<DeviceAnswer>,
    /// The browser's last answer to the question for a device.
    device_answer: Option<DeviceAnswer>,
    participant: String,
    /// Examiner's code for the next session, as typed in the briefing. Forgotten when that session begins.
    examiner_code: String,
    screen: Screen,
    /// The editor to return to after the test run of an exercise.
    test_run_origin: Option<Box<EditorState>>,
    overlay: shortcuts::OverlayState,
    /// Index of the picture of the case that is shown over the briefing or the lesson.
    shown_picture: Option<usize>,
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
    /// Pictures of a tooth as they were last drawn.
    views: Views,
    pointer: PointerInUse,
    /// True once the window was asked to fill the screen for shutter glasses, which read the screen's last rows.
    fills_screen: bool,
    frame_count: u64,
    /// Time of the last input, s.
    last_input: f64,
    gamepad: GamepadPointer,
    has_gamepad: bool,
    /// Movement of the camera by the gamepad in this frame.
    gamepad_camera: Option<CameraCommand>,
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

/// Interval at which events are taken over while the window is hidden: a bundle is completed and a lesson's time is kept.
const HIDDEN_INTERVAL: Duration = Duration::from_millis(100);

/// Interval at which a gamepad is read.
const GAMEPAD_INTERVAL: Duration = Duration::from_millis(16);

impl App {
    pub fn new(context: &eframe::CreationContext, mut options: AppOptions) -> App {
        let ctx = &context.egui_ctx;
        let folder = options.user_folder.take().unwrap_or_else(|| UserFolder::new(platform::config_folder()));
        let (mut settings, languages, mut complaints) = settings::load_with_languages(&folder);
        if let Some(station) = &options.station {
            settings = station.settings(settings);
            complaints.extend(station.complaint.clone());
        }
        let is_known = |code: &String| languages.iter().any(|words| words.code == *code);
        if let Some(code) = options.language.take().filter(is_known) {
            settings.language = code;
        }
        let (replacements, broken) = read_sounds(&folder);
        complaints.extend((!broken.is_empty()).then(|| headlines(&broken)));
        theme::apply(ctx, &settings);
        ctx.add_plugin(MirrorPlugin::default());
        let (exercise_list, screen) = first_screen(&mut options, &settings);
        let begins = options.begins_at_once;
        let state_log = StateLog::new(options.state_log.take());
        let history = SessionHistory::read(&options.out, options.templates.clone(), repaint_waker(ctx));
        let mut app = App {
            history,
            completions: Vec::new(),
            inbox: Inbox::default(),
            device_inbox: Inbox::default(),
            device_answer: None,
            words: i18n::select_language(&languages, &settings.language),
            participant: options.participant.clone(),
            examiner_code: String::new(),
            options,
            user_folder: folder,
            first_settings: settings.clone(),
            kiosk_exit: KioskExit::default(),
            settings,
            languages,
            exercise_list,
            screen,
            test_run_origin: None,
            overlay: shortcuts::OverlayState::default(),
            shown_picture: None,
            closing: CloseState::No,
            had_focus: false,
            has_unsaved_settings: false,
            complaints,
            state_log,
            replacements,
            has_graphics: context.wgpu_render_state.as_ref().is_some_and(viewport::has_graphics),
            views: Views::default(),
            pointer: PointerInUse::default(),
            fills_screen: false,
            frame_count: 0,
            last_input: 0.0,
            gamepad: GamepadPointer::default(),
            has_gamepad: false,
            gamepad_camera: None,
        };
        if let (Some(mode), Some(path)) = (app.options.editor_mode, app.options.exercise.clone()) {
            app.open_editor(&path, mode, ctx);
        } else if begins {
            app.begin_lesson(ctx);
        }
        app
    }

    /// Fills the screen, or no longer, when stereo for shutter glasses is switched; a kiosk fills it anyway.
    fn fill_screen_for_glasses(&mut self, ctx: &egui::Context) {
        let fills = self.settings.is_frame_sequential();
        if fills != self.fills_screen && self.options.kiosk().is_none() {
            self.fills_screen = fills;
            ctx.send_viewport_cmd(egui::ViewportCommand::Fullscreen(fills));
        }
    }

    /// Applies and saves changed settings once the mouse button is released: a text size that changed during a drag
    /// would move the slider away from the pointer.
    fn save_settings(&mut self, ctx: &egui::Context) {
        if self.has_unsaved_settings && !ctx.input(|input| input.pointer.any_down()) {
            theme::apply(ctx, &self.settings);
            let own = match &self.options.station {
                Some(station) if station.kiosk.is_some() => None,
                Some(station) => Some(station.own_settings(&self.settings, Settings::load(&self.user_folder).0)),
                None => Some(self.settings.clone()),
            };
            self.complaints.extend(own.and_then(|own| own.save(&self.user_folder)));
            self.has_unsaved_settings = false;
        }
    }
}

/// The exercises, and the screen that is shown first: the instructions of the exercise that was asked for, or the list.
fn first_screen(options: &mut AppOptions, settings: &Settings) -> (ExerciseList, Screen) {
    let is_one_selected = options.given.is_some() || options.exercise.is_some();
    let mut exercise_list = match options.given.take() {
        Some(given) => ExerciseList::only(given),
        None => ExerciseList::load(&settings.exercises),
    };
    if let Some(path) = &options.exercise {
        exercise_list.add_and_select(path);
        if let Some(scan) = &options.tooth {
            exercise_list.replace_teeth(scan);
        }
    }
    let is_valid = exercise_list.selected_exercise().is_some_and(|exercise| exercise.scenario.is_ok());
    let screen = if is_one_selected && is_valid { Screen::Briefing } else { Screen::ExerciseList };
    (exercise_list, screen)
}

/// A function that makes the window draw a new frame; callable from another thread.
fn repaint_waker(ctx: &egui::Context) -> Box<dyn Fn() + Send + Sync> {
    let ctx = ctx.clone();
    Box::new(move || ctx.request_repaint())
}

/// The school's own sounds, and the files that are not sounds. A page has no folder for them.
fn read_sounds(folder: &UserFolder) -> (Replacements, Vec<Diagnostic>) {
    match platform::IS_PAGE {
        true => Default::default(),
        false => wav_files::read_folder(&sounds_folder(folder)),
    }
}

/// Folder of the school's own sounds: `content/sounds` in the working folder, else `sounds` in the user's.
fn sounds_folder(folder: &UserFolder) -> PathBuf {
    let beside = PathBuf::from("content/sounds");
    folder.sounds().filter(|_| !beside.is_dir()).unwrap_or(beside)
}

impl eframe::App for App {
    fn clear_color(&self, visuals: &egui::Visuals) -> [f32; 4] {
        visuals.panel_fill.to_normalized_gamma_f32()
    }

    fn raw_input_hook(&mut self, ctx: &egui::Context, input: &mut egui::RawInput) {
        let pad = platform::gamepad();
        self.has_gamepad = pad.is_some();
        // One that was disconnected lets go of everything.
        let pad = pad.unwrap_or_default();
        if !self.has_gamepad && self.gamepad.is_at_rest() {
            return;
        }
        let (pointer, screen) = (ctx.pointer_latest_pos(), ctx.content_rect());
        let seconds = input.time.map_or(input.predicted_dt, |now| (now - ctx.input(|before| before.time)) as f32);
        let (events, camera) = self.gamepad.update(pad, pointer, screen, seconds);
        // They are in the window as it is drawn, and are flipped with those of a mouse.
        let mirrored = self.settings.mirrored;
        input.events.extend(events.into_iter().map(|event| mirrored.event(event, screen)));
        self.gamepad_camera = camera;
    }

    fn logic(&mut self, ctx: &egui::Context, _frame: &mut eframe::Frame) {
        self.poll(ctx);
        self.handle_close_request(ctx);
        self.save_settings(ctx);
        self.fill_screen_for_glasses(ctx);
        ctx.plugin::<MirrorPlugin>().lock().mirrored = self.settings.mirrored;
        platform::set_unsaved_work(self.has_unsaved_work());
        // A hidden window has no frame that would ask for the next one.
        if events::is_hidden(ctx) {
            ctx.request_repaint_after(HIDDEN_INTERVAL);
        }
    }

    fn ui(&mut self, ui: &mut egui::Ui, frame: &mut eframe::Frame) {
        let ctx = ui.ctx().clone();
        let mut commands = Vec::new();
        let pointer = self.pointer.update(&ctx);
        if let Screen::Lesson(lesson) = &mut self.screen {
            lesson.pointer_hand.kind = pointer;
        }
        shortcuts::collect_commands(&ctx, &self.screen, self.overlay, self.had_focus, &mut commands);
        self.frame_ui(ui, frame, &mut commands);
        commands.extend(self.gamepad_camera.take().map(AppCommand::Camera));
        // What was seen and typed in this frame counts before what a key asked for in it.
        commands.sort_by_key(|command| !command.is_of_this_frame());
        for command in commands {
            self.execute(command, &ctx);
        }
        self.had_focus = ctx.memory(|memory| memory.focused().is_some());
        self.frame_count += 1;
        if self.frame_count == 2 {
            // The first frame was shown: nothing more is told to a console.
            platform::close_own_console();
        }
        self.state_log.record("frames", self.frame_count);
        self.log_state();
        ui_anchors::log_anchors(&ctx, &mut self.state_log);
        let interval = self.frame_interval(&ctx);
        // A gamepad causes no events by itself.
        ctx.request_repaint_after(if self.has_gamepad { interval.min(GAMEPAD_INTERVAL) } else { interval });
    }
}
