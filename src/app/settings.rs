//! What a person sets once: kept in a file in the platform's configuration folder.

use super::command::Command;
use super::language::Words;
use crate::device::DRIVERS;
use crate::render::{Layout, Stereo};
use directories::ProjectDirs;
use eframe::egui;
use serde::{Deserialize, Serialize};
use std::fs;
use std::path::PathBuf;

/// Usual distance between eyes for a mouth on a screen, mm: a tenth of people's, for the scene is that much larger than life.
const EYE_DISTANCE: f32 = 6.0;

/// Usual loudness: leaves room for a teacher's voice.
const VOLUME: f32 = 0.6;

/// Sizes of text that still fit the window, as shares of the usual.
const FONT_SIZES: std::ops::RangeInclusive<f32> = 0.8..=1.6;

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Settings {
    /// A code of a language file.
    pub language: String,
    /// What is in the hand: `mouse`, or as `--device` takes it.
    pub device: String,
    pub stereo: StereoMode,
    pub eye_distance_mm: f32,
    /// Whether edges are smoothed; unset as this machine can afford it.
    pub smooth_edges: Option<bool>,
    /// Share of full scale, 0 to 1.
    pub volume: f32,
    pub high_contrast: bool,
    pub font_size: f32,
    /// Another folder with exercises; empty for none.
    pub exercises: PathBuf,
}

/// How two eyes see the tooth.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StereoMode {
    #[default]
    Off,
    SideBySide,
    TopBottom,
    Rows,
    Anaglyph,
    /// The left eye in this window, the right one in a window of its own, for two projectors.
    TwoWindows,
}

const STEREO_MODES: [(StereoMode, &str); 6] = [
    (StereoMode::Off, "settings.stereo_off"),
    (StereoMode::SideBySide, "settings.stereo_side"),
    (StereoMode::TopBottom, "settings.stereo_top"),
    (StereoMode::Rows, "settings.stereo_rows"),
    (StereoMode::Anaglyph, "settings.stereo_anaglyph"),
    (StereoMode::TwoWindows, "settings.stereo_two"),
];

impl Default for Settings {
    fn default() -> Settings {
        Settings {
            language: super::language::of_system(),
            device: "mouse".into(),
            stereo: StereoMode::Off,
            eye_distance_mm: EYE_DISTANCE,
            smooth_edges: None,
            volume: VOLUME,
            high_contrast: false,
            font_size: 1.0,
            exercises: PathBuf::new(),
        }
    }
}

impl Settings {
    /// What was kept; the usual, with a complaint, where it cannot be read.
    pub fn read() -> (Settings, Option<String>) {
        let Some(path) = file() else { return (Settings::default(), None) };
        match fs::read_to_string(&path) {
            Ok(text) => match serde_json::from_str::<Settings>(&text) {
                Ok(settings) => (settings.in_range(), None),
                Err(error) => {
                    let what = format!("{}: wrong-settings: {error}; the usual settings are used", path.display());
                    (Settings::default(), Some(what))
                }
            },
            Err(_) => (Settings::default(), None),
        }
    }

    /// Keeps them; a complaint where that fails.
    pub fn keep(&self) -> Option<String> {
        let path = file()?;
        let folder = path.parent()?;
        let text = serde_json::to_string_pretty(self).ok()?;
        let kept = fs::create_dir_all(folder).and_then(|()| fs::write(&path, text + "\n"));
        kept.err().map(|e| format!("{}: unwritable-file: {e}; settings last until the window closes", path.display()))
    }

    /// Numbers that somebody wrote by hand, brought to where they make a picture.
    fn in_range(mut self) -> Settings {
        self.eye_distance_mm = self.eye_distance_mm.clamp(0.0, 80.0);
        self.volume = self.volume.clamp(0.0, 1.0);
        self.font_size = self.font_size.clamp(*FONT_SIZES.start(), *FONT_SIZES.end());
        self
    }

    pub fn stereo(&self) -> Option<Stereo> {
        let layout = match self.stereo {
            StereoMode::Off => return None,
            StereoMode::SideBySide => Layout::SideBySide,
            StereoMode::TopBottom => Layout::TopBottom,
            StereoMode::Rows => Layout::Rows,
            StereoMode::Anaglyph => Layout::Anaglyph,
            StereoMode::TwoWindows => Layout::Left,
        };
        Some(Stereo { layout, eye_distance: self.eye_distance_mm })
    }

    /// Whether edges are smoothed. Where nobody has chosen, a graphics processor does it; in software it costs too much of
    /// each picture.
    pub fn is_smooth(&self, has_graphics: bool) -> bool {
        self.smooth_edges.unwrap_or(has_graphics)
    }

    /// What the second window shows, if there is one.
    pub fn second_eye(&self) -> Option<Stereo> {
        let has_two = self.stereo == StereoMode::TwoWindows;
        has_two.then_some(Stereo { layout: Layout::Right, eye_distance: self.eye_distance_mm })
    }
}

/// Folder of the settings on this platform; `None` where there is no home.
pub fn folder() -> Option<PathBuf> {
    ProjectDirs::from("", "", "typodont").map(|dirs| dirs.config_dir().to_path_buf())
}

fn file() -> Option<PathBuf> {
    folder().map(|folder| folder.join("settings.json"))
}

/// Everything that can be set. Asks for a change, never makes one.
pub fn settings_ui(
    ui: &mut egui::Ui,
    settings: &Settings,
    has_graphics: bool,
    languages: &[Words],
    words: &Words,
    asked: &mut Vec<Command>,
) {
    let mut new = settings.clone();
    egui::Grid::new("settings").num_columns(2).spacing([24.0, 12.0]).show(ui, |ui| {
        let label = ui.label(words.of("settings.language")).id;
        let current = languages.iter().find(|w| w.code == new.language).map_or("English", |w| w.name());
        egui::ComboBox::from_id_salt("language")
            .selected_text(current)
            .show_ui(ui, |ui| {
                for language in languages {
                    ui.selectable_value(&mut new.language, language.code.clone(), language.name());
                }
            })
            .response
            .labelled_by(label);
        ui.end_row();

        let label = ui.label(words.of("settings.device")).id;
        egui::ComboBox::from_id_salt("device")
            .selected_text(new.device.clone())
            .show_ui(ui, |ui| {
                for driver in DRIVERS {
                    let name = driver.name().to_string();
                    ui.selectable_value(&mut new.device, name.clone(), name).on_hover_text(driver.about());
                }
            })
            .response
            .labelled_by(label);
        ui.end_row();

        let label = ui.label(words.of("settings.stereo")).id;
        let current = STEREO_MODES.iter().find(|(mode, _)| *mode == new.stereo).map_or("", |(_, key)| words.of(key));
        egui::ComboBox::from_id_salt("stereo")
            .selected_text(current)
            .show_ui(ui, |ui| {
                for (mode, key) in STEREO_MODES {
                    ui.selectable_value(&mut new.stereo, mode, words.of(key));
                }
            })
            .response
            .labelled_by(label);
        ui.end_row();

        let label = ui.label(words.of("settings.eyes")).id;
        let slider = egui::Slider::new(&mut new.eye_distance_mm, 0.0..=80.0).suffix(" mm").fixed_decimals(0);
        ui.add_enabled(new.stereo != StereoMode::Off, slider).labelled_by(label);
        ui.end_row();

        let label = ui.label(words.of("settings.volume")).id;
        let percent = |share: f64, _| format!("{:.0} %", 100.0 * share);
        ui.add(egui::Slider::new(&mut new.volume, 0.0..=1.0).custom_formatter(percent)).labelled_by(label);
        ui.end_row();

        let label = ui.label(words.of("settings.font")).id;
        let slider = egui::Slider::new(&mut new.font_size, FONT_SIZES).step_by(0.1).fixed_decimals(1);
        ui.add(slider).labelled_by(label);
        ui.end_row();

        ui.label("");
        let mut is_smooth = settings.is_smooth(has_graphics);
        if ui.checkbox(&mut is_smooth, words.of("settings.smooth")).changed() {
            new.smooth_edges = Some(is_smooth);
        }
        ui.end_row();

        ui.label("");
        ui.checkbox(&mut new.high_contrast, words.of("settings.contrast"));
        ui.end_row();
    });
    if new != *settings {
        asked.push(Command::Set(Box::new(new)));
    }
    ui.add_space(12.0);
    if let Some(path) = file() {
        ui.weak(words.with("settings.kept", path.display()));
    }
    ui.add_space(8.0);
    if ui.button(words.of("settings.close")).clicked() {
        asked.push(Command::ShowSettings(false));
    }
}
