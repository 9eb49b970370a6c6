//! Readiness of a station for the window: its display, its sound, its settings.
//!
//! Takes the system as it is. Gives, for each, a name or the reason why it cannot be used. Never changes a setting, plays
//! nothing and opens no window.

use crate::user_folder::UserFolder;
use crate::{i18n, platform, settings};
use std::path::PathBuf;
use typodont_audio::AudioError;
use winit::event_loop::EventLoop;

/// Connects to the display, as the window does first. Must be called on the main thread, and once.
///
/// # Errors
/// The reason why no window can be opened.
pub fn connect_to_display() -> Result<(), String> {
    match EventLoop::builder().build() {
        Ok(_) => Ok(()),
        // winit's message begins with a line of its own source.
        Err(error) => Err(crate::without_source_line(&error.to_string())),
    }
}

/// Name of the system's sound output.
///
/// # Errors
/// The reason why nothing can be heard.
pub fn sound_output() -> Result<String, String> {
    typodont_audio::output_name().map_err(|error| match error {
        AudioError::Unavailable { why } => why,
        AudioError::Refused { place, why } | AudioError::Lost { place, why } => format!("{place}: {why}"),
    })
}

/// The user's settings, as far as a session depends on them.
pub struct SettingsReview {
    /// Settings file; `None` if the user has no home folder.
    pub file: Option<PathBuf>,
    /// Input device, as in `--device`.
    pub device: String,
    /// Name of the language that the window shows.
    pub language: String,
    /// Further folder with exercises; empty for none.
    pub exercises: PathBuf,
    /// Defects of the settings file and of added language files, and a language that is not installed.
    pub complaints: Vec<String>,
}

fn user_folder() -> UserFolder {
    UserFolder::new(platform::config_folder())
}

/// Codes of the languages that the program and the user's folder have.
pub fn language_codes() -> Vec<String> {
    settings::load_with_languages(&user_folder()).1.into_iter().map(|language| language.code).collect()
}

/// Reads the settings and the languages as the window does.
pub fn review_settings() -> SettingsReview {
    let folder = user_folder();
    let (settings, languages, mut complaints) = settings::load_with_languages(&folder);
    let language = i18n::select_language(&languages, &settings.language);
    let is_system_language = settings.language == i18n::system_language();
    if language.code != settings.language && !is_system_language {
        complaints.push(format!(
            "unknown-language: the settings ask for the language \"{}\", which is not installed",
            settings.language
        ));
    }
    SettingsReview {
        file: folder.settings_file(),
        device: settings.device,
        language: language.name().to_string(),
        exercises: settings.exercises,
        complaints,
    }
}
