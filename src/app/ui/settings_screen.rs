//! The screen of the settings.

use crate::command::AppCommand;
use crate::i18n::Translations;
use crate::platform;
use crate::platform::DeviceAnswer;
use crate::settings::{FONT_SIZES, MirroredWindow, Settings, StereoMode};
use crate::ui::{theme, ui_anchors};
use eframe::egui;
use std::path::Path;
use typodont_core::sim::HandFrame;
use typodont_devices::DRIVERS;

const STEREO_MODES: [(StereoMode, &str); 7] = [
    (StereoMode::Off, "settings.stereo_off"),
    (StereoMode::SideBySide, "settings.stereo_side"),
    (StereoMode::TopBottom, "settings.stereo_top"),
    (StereoMode::Rows, "settings.stereo_rows"),
    (StereoMode::Anaglyph, "settings.stereo_anaglyph"),
    (StereoMode::TwoWindows, "settings.stereo_two"),
    (StereoMode::FrameSequential, "settings.stereo_shutter"),
];

const MIRRORED_WINDOWS: [(MirroredWindow, &str); 3] = [
    (MirroredWindow::No, "settings.mirrored_no"),
    (MirroredWindow::LeftRight, "settings.mirrored_left_right"),
    (MirroredWindow::TopBottom, "settings.mirrored_top_bottom"),
];

/// Everything beside the settings that their screen shows.
pub struct SettingsContext<'a> {
    /// File in which the settings are kept.
    pub file: Option<&'a Path>,
    /// True if a graphics processor draws.
    pub has_graphics: bool,
    /// The browser's last answer to the question for a device.
    pub device_answer: Option<&'a DeviceAnswer>,
}

/// Draws all settings. Pushes commands for changes, and changes nothing itself.
pub fn settings_ui(
    ui: &mut egui::Ui,
    settings: &Settings,
    context: &SettingsContext,
    languages: &[Translations],
    words: &Translations,
    commands: &mut Vec<AppCommand>,
) {
    let mut new = settings.clone();
    egui::Grid::new("settings").num_columns(2).spacing([24.0, 12.0]).show(ui, |ui| {
        language_row(ui, &mut new, languages, words);
        device_row(ui, &mut new, words);
        if platform::IS_PAGE && settings.device != "mouse" {
            permission_row(ui, context.device_answer, words, commands);
        }
        left_handed_row(ui, &mut new, words);
        hand_rows(ui, &mut new, words);
        mirrored_row(ui, &mut new, words);
        stereo_row(ui, &mut new, words);
        row(ui, words.get("settings.eyes"), |ui| {
            let slider = egui::Slider::new(&mut new.eye_distance_mm, 0.0..=80.0).suffix(" mm").fixed_decimals(0);
            ui.add_enabled(new.stereo != StereoMode::Off, slider)
        });
        row(ui, words.get("settings.volume"), |ui| {
            let percent = |share: f64, _| format!("{:.0} %", 100.0 * share);
            ui.add(egui::Slider::new(&mut new.volume, 0.0..=1.0).custom_formatter(percent))
        });
        font_row(ui, &mut new, words);
        ui.label("");
        let mut is_smooth = settings.is_smooth(context.has_graphics);
        if ui.checkbox(&mut is_smooth, words.get("settings.smooth")).changed() {
            new.smooth_edges = Some(is_smooth);
        }
        ui.end_row();
        ui.label("");
        ui.horizontal(|ui| {
            let mut has_shadows = settings.has_shadows(context.has_graphics);
            let shadows = ui.checkbox(&mut has_shadows, words.get("settings.shadows"));
            if shadows.on_hover_text(words.get("settings.shadows_hint")).changed() {
                new.shadows = Some(has_shadows);
            }
            let depth_of_field = ui.checkbox(&mut new.depth_of_field, words.get("settings.depth_of_field"));
            depth_of_field.on_hover_text(words.get("settings.depth_of_field_hint"));
        });
        ui.end_row();
        ui.label("");
        ui.checkbox(&mut new.high_contrast, words.get("settings.contrast"));
        ui.end_row();
    });
    if new != *settings {
        commands.push(AppCommand::ApplySettings(Box::new(new)));
    }
    ui.add_space(12.0);
    if let Some(path) = context.file {
        ui.weak(words.format("settings.kept", path.display()));
    }
    ui.add_space(8.0);
    if ui.button(words.get("settings.close")).clicked() {
        commands.push(AppCommand::ShowSettings(false));
    }
}

/// Draws the settings of a kiosk: language, size and the hand, which hold until the next participant; and the way to close it.
pub fn kiosk_settings_ui(
    ui: &mut egui::Ui,
    settings: &Settings,
    languages: &[Translations],
    words: &Translations,
    commands: &mut Vec<AppCommand>,
) {
    let mut new = settings.clone();
    egui::Grid::new("settings").num_columns(2).spacing([24.0, 12.0]).show(ui, |ui| {
        language_row(ui, &mut new, languages, words);
        font_row(ui, &mut new, words);
        left_handed_row(ui, &mut new, words);
    });
    if new != *settings {
        commands.push(AppCommand::ApplySettings(Box::new(new)));
    }
    ui.add_space(12.0);
    ui.horizontal(|ui| {
        if ui.button(words.get("settings.close")).clicked() {
            commands.push(AppCommand::ShowSettings(false));
        }
        let close = ui.button(words.get("kiosk.close_program"));
        ui_anchors::anchor(ui, "kiosk.close_program", close.rect);
        if close.clicked() {
            commands.extend([AppCommand::ShowSettings(false), AppCommand::AskToLeaveKiosk(true)]);
        }
    });
}

/// Draws one row of the settings: a label, and the widget that it names.
fn row(ui: &mut egui::Ui, label: &str, widget: impl FnOnce(&mut egui::Ui) -> egui::Response) {
    let label = ui.label(label).id;
    widget(ui).labelled_by(label);
    ui.end_row();
}

fn language_row(ui: &mut egui::Ui, settings: &mut Settings, languages: &[Translations], words: &Translations) {
    row(ui, words.get("settings.language"), |ui| {
        let current = languages.iter().find(|w| w.code == settings.language).map_or("English", |w| w.name());
        let choice = egui::ComboBox::from_id_salt("language").selected_text(current).show_ui(ui, |ui| {
            for language in languages {
                ui.selectable_value(&mut settings.language, language.code.clone(), language.name());
            }
        });
        choice.response
    });
}

fn font_row(ui: &mut egui::Ui, settings: &mut Settings, words: &Translations) {
    row(ui, words.get("settings.font"), |ui| {
        ui.add(egui::Slider::new(&mut settings.font_size, FONT_SIZES).step_by(0.1).fixed_decimals(1))
    });
}

fn device_row(ui: &mut egui::Ui, settings: &mut Settings, words: &Translations) {
    row(ui, words.get("settings.device"), |ui| {
        let choice = egui::ComboBox::from_id_salt("device").selected_text(settings.device.clone()).show_ui(ui, |ui| {
            for driver in DRIVERS {
                let name = driver.name().to_string();
                let choice = ui.selectable_value(&mut settings.device, name.clone(), name.clone());
                ui_anchors::anchor(ui, format!("settings.device.{name}"), choice.rect);
                choice.on_hover_text(driver.description());
            }
        });
        ui_anchors::anchor(ui, "settings.device", choice.response.rect);
        choice.response
    });
}

/// Draws the button by which the browser asks for the device, and its answer.
fn permission_row(
    ui: &mut egui::Ui,
    answer: Option<&DeviceAnswer>,
    words: &Translations,
    commands: &mut Vec<AppCommand>,
) {
    ui.label("");
    ui.vertical(|ui| {
        let allow =
            ui.button(words.get("settings.allow_device")).on_hover_text(words.get("settings.allow_device_hint"));
        ui_anchors::anchor(ui, "settings.allow_device", allow.rect);
        if allow.clicked() {
            commands.push(AppCommand::AllowDevice);
        }
        match answer {
            None => {}
            Some(Ok(Some(name))) => _ = ui.label(words.format("settings.device_allowed", name)),
            Some(Ok(None)) => _ = ui.label(words.get("settings.no_device_chosen")),
            Some(Err(why)) => _ = ui.colored_label(theme::ERROR, words.format("settings.no_devices", why)),
        }
    });
    ui.end_row();
}

/// Draws which hand holds the handpiece of a mouse; an arm holds its own.
fn left_handed_row(ui: &mut egui::Ui, settings: &mut Settings, words: &Translations) {
    ui.label("");
    let left_handed = egui::Checkbox::new(&mut settings.left_handed, words.get("settings.left_handed"));
    ui.add_enabled(settings.device == "mouse", left_handed);
    ui.end_row();
}

/// Draws how the hand of an arm moves; a mouse works in the picture anyway.
fn hand_rows(ui: &mut egui::Ui, settings: &mut Settings, words: &Translations) {
    let is_arm = settings.device != "mouse";
    if let Some(registration) = &settings.hand_registration {
        let error = format!("{:.1} mm", registration.error_mm);
        ui.label(words.get("settings.registered"));
        let is_kept = ui.horizontal(|ui| {
            ui.label(words.format("settings.registered_error", error));
            !ui.button(words.get("settings.forget_registration")).clicked()
        });
        settings.hand_registration = settings.hand_registration.filter(|_| is_kept.inner);
        ui.end_row();
        return;
    }
    ui.label("");
    let follows = egui::Checkbox::new(&mut settings.hand_follows_view, words.get("settings.hand_follows_view"));
    ui.add_enabled(is_arm, follows);
    ui.end_row();
    row(ui, words.get("settings.hand_scale"), |ui| {
        let [least, most] = HandFrame::SCALES;
        let slider =
            egui::Slider::new(&mut settings.hand_scale, least..=most).step_by(0.1).fixed_decimals(1).suffix(" ×");
        ui.add_enabled(is_arm, slider)
    });
}

/// Draws how the window is flipped for those who see it in a mirror.
fn mirrored_row(ui: &mut egui::Ui, settings: &mut Settings, words: &Translations) {
    row(ui, words.get("settings.mirrored"), |ui| {
        let current =
            MIRRORED_WINDOWS.iter().find(|(way, _)| *way == settings.mirrored).map_or("", |(_, key)| words.get(key));
        let choice = egui::ComboBox::from_id_salt("mirrored").selected_text(current).show_ui(ui, |ui| {
            for (way, key) in MIRRORED_WINDOWS {
                ui.selectable_value(&mut settings.mirrored, way, words.get(key));
            }
        });
        choice.response.on_hover_text(words.get("settings.mirrored_about"))
    });
}

fn stereo_row(ui: &mut egui::Ui, settings: &mut Settings, words: &Translations) {
    row(ui, words.get("settings.stereo"), |ui| {
        let current =
            STEREO_MODES.iter().find(|(mode, _)| *mode == settings.stereo).map_or("", |(_, key)| words.get(key));
        let choice = egui::ComboBox::from_id_salt("stereo").selected_text(current).show_ui(ui, |ui| {
            // A page has one window.
            let modes = STEREO_MODES.into_iter();
            for (mode, key) in modes.filter(|(mode, _)| !platform::IS_PAGE || *mode != StereoMode::TwoWindows) {
                ui.selectable_value(&mut settings.stereo, mode, words.get(key));
            }
        });
        choice.response
    });
}
