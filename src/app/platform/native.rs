//! A computer: settings in a file of the user's configuration folder, bundles in a folder.

use super::{DeviceAnswer, GamepadState, LogSink, Pen};
use crate::given_file::{GivenContent, GivenFile};
use crate::inbox::Inbox;
use crate::user_folder::UserFolder;
use directories::{ProjectDirs, UserDirs};
use eframe::egui;
use std::fs;
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::mpsc::Sender;
use typodont_author::autosave;
use typodont_devices::hid::HidMatch;
use typodont_lesson::InterruptedSession;
use typodont_report::bundle::{BundleFolder, REPORT_FILE, RecordingChange};

/// True for a page in a browser: it has no folders, and only devices that the browser passes on.
pub const IS_PAGE: bool = false;

/// Environment variable that names the file of the state log; without it nothing is written.
const LOG_VARIABLE: &str = "TYPODONT_STATE_LOG";

/// Folder of the user's own files on this platform; `None` if the user has no home folder.
pub fn config_folder() -> Option<PathBuf> {
    ProjectDirs::from("", "", "typodont").map(|dirs| dirs.config_dir().to_path_buf())
}

/// Folder of the user's documents, else the home folder.
pub fn documents_folder() -> Option<PathBuf> {
    let dirs = UserDirs::new();
    dirs.as_ref().map(|dirs| dirs.document_dir().unwrap_or(dirs.home_dir()).to_path_buf())
}

/// URL of a bundle's report; `None` if its path cannot be written as one.
pub fn report_url(bundle: &BundleFolder) -> Option<String> {
    let path = std::path::absolute(bundle.path().join(REPORT_FILE)).ok()?;
    url::Url::from_file_path(path).ok().map(String::from)
}

/// A window asks before it closes, and bundles are in folders.
pub fn set_unsaved_work(_: bool) {}

/// Bundles are in folders here: there is nothing to download.
pub fn download(_: &BundleFolder) -> Option<String> {
    None
}

/// Pens are reported by the window system, without their tilt.
pub fn pen() -> Option<Pen> {
    None
}

/// Gamepads are read in pages only: each system has its own way to them.
pub fn gamepad() -> Option<GamepadState> {
    None
}

/// Exercises are in folders here: none is opened from a file that is given to the window.
pub fn opens_exercises() -> bool {
    false
}

/// Exercises are saved in files here: there is nothing to download.
pub fn download_text(_: &str, _: &str) -> Option<String> {
    None
}

/// This window has no dialog for files: they are dropped into it, or named to the command line.
pub fn ask_for_file(_: &str, _: Inbox<GivenFile>, _: &egui::Context) {}

/// A program opens devices without a question.
pub fn ask_for_device(_: &[HidMatch], _: Inbox<DeviceAnswer>, _: &egui::Context) {}

/// Keeps the unsaved text of an exercise in the folder for drafts; without one, nowhere. `path` identifies the exercise.
///
/// # Errors
/// A message if the text cannot be written.
pub fn store_draft(folder: Option<&Path>, path: Option<&Path>, text: &str) -> Result<(), String> {
    folder.map_or(Ok(()), |folder| autosave::store(folder, path, text))
}

/// The unsaved text of an exercise; `None` if there is none.
pub fn load_draft(folder: Option<&Path>, path: Option<&Path>) -> Option<String> {
    autosave::load(folder?, path)
}

/// Deletes the unsaved text of an exercise.
pub fn remove_draft(folder: Option<&Path>, path: Option<&Path>) {
    if let Some(folder) = folder {
        autosave::remove(folder, path);
    }
}

/// Takes a file that was dropped into the window, with `left_out` others.
pub fn receive_dropped(file: egui::DroppedFileHandle, left_out: usize, inbox: Inbox<GivenFile>, ctx: &egui::Context) {
    let path = file.path();
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let content = match path.is_dir() {
        true => {
            let why = "wrong-zip: this is a folder; give the ZIP file of a bundle, or use `typodont verify FOLDER`";
            GivenContent::Read(Err(why.to_string()))
        }
        false => GivenContent::OnDisk(path.to_path_buf()),
    };
    inbox.put(GivenFile { name, content, left_out }, ctx);
}

/// Recordings grow in folders here: none is kept elsewhere.
pub fn begin_keeping(_: &str) {}

/// Keeps nothing: see [`begin_keeping`].
pub fn keep_change(_: &str, _: u32, _: &RecordingChange) {}

/// Deletes nothing: see [`begin_keeping`].
pub fn forget_recording(_: &str) {}

/// Deletes nothing: see [`begin_keeping`].
pub fn replace_recording(_: &str) {}

/// Never fails: see [`begin_keeping`].
pub fn keeping_failure() -> Option<String> {
    None
}

/// Nothing is kept: see [`begin_keeping`].
pub fn read_kept_recordings(_: Sender<InterruptedSession>, _: Box<dyn Fn() + Send>) {}

/// Recordings are in folders here: there is nothing to download.
pub fn download_recording(_: &str, _: &[u8]) -> Option<String> {
    None
}

/// Name of the place where settings are kept, for messages.
pub fn settings_place(folder: &UserFolder) -> String {
    folder.settings_file().map(|path| path.display().to_string()).unwrap_or_default()
}

/// Text of the settings; `None` if none are kept.
pub fn read_settings(folder: &UserFolder) -> Option<String> {
    fs::read_to_string(folder.settings_file()?).ok()
}

/// Keeps the text of the settings; returns the reason if that fails.
pub fn write_settings(folder: &UserFolder, text: &str) -> Option<String> {
    let path = folder.settings_file()?;
    fs::create_dir_all(folder.path()?).and_then(|()| fs::write(&path, text)).err().map(|e| e.to_string())
}

/// Sessions are in folders here, and their results are read from there.
pub fn read_history() -> Option<String> {
    None
}

/// Keeps nothing: see [`read_history`].
pub fn write_history(_: &str) -> Option<String> {
    None
}

/// Locale of the user, from the system's environment variables.
#[cfg(not(any(windows, target_os = "macos")))]
pub fn locale() -> Option<String> {
    ["LC_ALL", "LC_MESSAGES", "LANG"].into_iter().find_map(|name| std::env::var(name).ok())
}

/// Locale of the user, as set in the system; programs there get no environment variables for it.
#[cfg(any(windows, target_os = "macos"))]
pub fn locale() -> Option<String> {
    sys_locale::get_locale()
}

/// Writer of the state log's lines, to the file that the environment names; `None` unless it names one.
pub fn open_log() -> Option<LogSink> {
    let mut file = File::create(std::env::var_os(LOG_VARIABLE)?).ok()?;
    // The program goes on if the log cannot be written.
    Some(Box::new(move |line| _ = writeln!(file, "{line}")))
}
