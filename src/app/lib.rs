//! Desktop program: the window in which a trainee works and an author edits exercises.
//!
//! Takes pointer and keyboard input and the trainee's choices. Gives lessons on a thread of their own, and pictures of
//! their progress. Never computes a score and never carves: the crates below do, and no session waits for a picture.
//!
//! ```no_run
//! use typodont_app::{AppOptions, open_window};
//! use typodont_report::Templates;
//!
//! let options = AppOptions::at_exercise_list("sessions", Templates::shipped());
//! assert!(options.exercise.is_none());
//! open_window(options)?;
//! # Ok::<(), String>(())
//! ```

mod editor;
mod lesson_backend;
mod lesson_run;
#[cfg(not(target_family = "wasm"))]
mod lesson_thread;
#[cfg(any(target_family = "wasm", test))]
mod lesson_message;
#[cfg(any(target_family = "wasm", test))]
mod lesson_host;
#[cfg(any(target_family = "wasm", test))]
mod remote_lesson;
#[cfg(target_family = "wasm")]
mod page_worker;
#[cfg(target_family = "wasm")]
mod page_hid;
mod command;
mod screen;
mod ui;
mod controls_progress;
mod app;
mod platform;
mod state_log;
mod i18n;
mod answer_draft;
mod results;
mod completion;
mod given_file;
mod inbox;
mod gamepad;
mod zip_verification;
mod session_history;
mod snapshot;
mod settings;
mod user_folder;
mod exercise_list;
mod kiosk;
mod supervisor_code;
mod lesson_state;
mod lesson_scene;
mod pointer_hand;
mod hand_placement;
mod hand_registration;
mod lesson_sound;
mod messages;
mod transfer_function_draft;
mod camera_preset;
#[cfg(not(target_family = "wasm"))]
pub mod readiness;

pub use app::App;
pub use editor::OpenMode;
pub use kiosk::{KioskOptions, StationOptions};
#[cfg(target_family = "wasm")]
pub use page_worker::serve_lesson;
pub use platform::LogSink;
pub use supervisor_code::SupervisorCode;
pub use user_folder::UserFolder;

#[cfg(not(target_family = "wasm"))]
use eframe::egui;
use std::path::PathBuf;
use std::sync::Arc;
use typodont_devices::servo::SecondHandRole;
use typodont_formats::Library;
use typodont_formats::diagnostic::SourceText;
use typodont_lesson::{ToothScan, second_hand};
use typodont_report::Templates;
use typodont_report::bundle::BundleFolder;

/// An exercise from elsewhere than a folder: the page is opened with one by a learning platform.
pub struct GivenExercise {
    pub source: Arc<SourceText>,
    /// Finds the files that the exercise names.
    pub library: Library,
}

/// Receiver of each bundle when it is finished.
pub type BundleListener = Box<dyn Fn(&BundleFolder)>;

/// Options with which the window opens.
pub struct AppOptions {
    /// The exercise that is selected first; without one the exercise list is shown.
    pub exercise: Option<PathBuf>,
    /// The only exercise that is offered, in place of those shipped.
    pub given: Option<GivenExercise>,
    /// Code of the language, in place of that of the settings, if there are texts in it.
    pub language: Option<String>,
    pub on_bundle: Option<BundleListener>,
    /// A scan that replaces the teeth of that exercise.
    pub tooth: Option<ToothScan>,
    /// Source and role of a second hand that may join every lesson.
    pub second: Option<(second_hand::SecondHandSource, SecondHandRole)>,
    /// True if that exercise begins at once, without its instructions.
    pub begins_at_once: bool,
    /// Opens that exercise at the author's screen instead, for editing or for display only.
    pub editor_mode: Option<OpenMode>,
    /// The input device, as in `--device`; without it that of the settings.
    pub device: Option<String>,
    /// Seed of the random choices of exercises; without one it is drawn from the operating system.
    pub seed: Option<u64>,
    /// Examiner's code, from which the seed is derived and sealed until the session ends.
    pub seed_code: Option<String>,
    /// A code for the trainee; never a name.
    pub participant: String,
    /// Folder in which bundles are written.
    pub out: PathBuf,
    pub templates: Templates,
    /// The station that this machine is, if its administrator has made it one.
    pub station: Option<StationOptions>,
    /// Folder of the user's own files, in place of the platform's.
    pub user_folder: Option<UserFolder>,
    /// Receiver of the state log's lines, in place of the file that the environment names.
    pub state_log: Option<LogSink>,
}

impl AppOptions {
    /// The kiosk that the station is, if it is one.
    pub fn kiosk(&self) -> Option<&KioskOptions> {
        self.station.as_ref()?.kiosk.as_ref()
    }

    /// Options of a window that opens at the exercise list.
    pub fn at_exercise_list(out: impl Into<PathBuf>, templates: Templates) -> AppOptions {
        AppOptions {
            exercise: None,
            given: None,
            language: None,
            on_bundle: None,
            tooth: None,
            second: None,
            begins_at_once: false,
            editor_mode: None,
            device: None,
            seed: None,
            seed_code: None,
            participant: String::new(),
            out: out.into(),
            templates,
            station: None,
            user_folder: None,
            state_log: None,
        }
    }
}

/// Width and height of a new window, points: fits a small laptop's screen.
#[cfg(not(target_family = "wasm"))]
const SIZE: [f32; 2] = [1280.0, 780.0];

/// Minimum width and height, points; below it parts of the window would be cut off.
#[cfg(not(target_family = "wasm"))]
const SIZE_LEAST: [f32; 2] = [960.0, 640.0];

/// Opens the window; returns when it is closed.
///
/// # Errors
/// A message with the reason why the window cannot be opened, and the remedy.
#[cfg(not(target_family = "wasm"))]
pub fn open_window(options: AppOptions) -> Result<(), String> {
    let viewport = egui::ViewportBuilder::default()
        .with_title("Typodont")
        .with_app_id("typodont")
        .with_inner_size(SIZE)
        .with_min_inner_size(SIZE_LEAST);
    let viewport = match options.kiosk() {
        Some(_) => viewport.with_fullscreen(true).with_decorations(false),
        None => viewport,
    };
    // With rendering in software, dithering takes a large part of the time of a frame, and pages have few flat colours.
    let native = eframe::NativeOptions { viewport, dithering: false, ..Default::default() };
    let made = Box::new(|context: &eframe::CreationContext| -> Result<Box<dyn eframe::App>, _> {
        Ok(Box::new(App::new(context, options)))
    });
    eframe::run_native("typodont", native, made).map_err(|error| {
        let why = without_source_line(&error.to_string());
        let needed = if cfg!(windows) {
            "a window requires a graphics driver; the environment variable WGPU_BACKEND=vulkan or WGPU_BACKEND=gl chooses \
             another one"
        } else {
            "a window requires a display and a graphics driver (Debian: mesa-vulkan-drivers)"
        };
        format!("no-window: {why}; {needed}. Without it, use `typodont run SCENARIO --headless` in a terminal")
    })
}

/// Runs the program in a canvas of a page; returns once it has begun.
///
/// # Errors
/// The browser's reason why nothing can be drawn.
#[cfg(target_family = "wasm")]
pub async fn open_page(canvas: web_sys::HtmlCanvasElement, options: AppOptions) -> Result<(), String> {
    let made = Box::new(|context: &eframe::CreationContext| -> Result<Box<dyn eframe::App>, _> {
        Ok(Box::new(App::new(context, options)))
    });
    platform::listen_to_pens(&canvas);
    // As in a window: rendering in software is common, and dithering would take a large part of it.
    let web = eframe::WebOptions { dithering: false, ..Default::default() };
    let began = eframe::WebRunner::new().start(canvas, web, made).await;
    began.map_err(|error| error.as_string().unwrap_or_else(|| format!("{error:?}")))
}

/// The text of an error without the line of winit's own source with which it begins, which is of no use to the user.
#[cfg(not(target_family = "wasm"))]
fn without_source_line(message: &str) -> String {
    let after_place = message.rsplit_once(".rs:").and_then(|(_, rest)| rest.split_once(": "));
    after_place.map_or(message, |(_, why)| why).trim_end_matches('.').to_string()
}
