//! Type and colours: calm, clear, and enough of a difference between what is read and what lies behind.

use super::settings::Settings;
use eframe::egui::{self, Color32, FontFamily, FontId, TextStyle};
use std::time::Duration;

/// The colour of what is done next. Its contrast with white is 5.2:1, above the 4.5:1 that WCAG 2.2 asks of text.
pub const ACCENT: Color32 = Color32::from_rgb(0x1f, 0x6f, 0x8b);

/// What is right, what needs care, what is wrong; told apart by more than colour wherever they stand.
pub const GOOD: Color32 = Color32::from_rgb(0x2e, 0x7d, 0x4f);
pub const CARE: Color32 = Color32::from_rgb(0xb2, 0x6a, 0x00);
pub const WRONG: Color32 = Color32::from_rgb(0xb3, 0x26, 0x1e);

/// Text in full contrast and in the usual, on paper.
const INK: [Color32; 2] = [Color32::BLACK, Color32::from_rgb(0x22, 0x2b, 0x33)];

/// Behind everything.
const PAPER: Color32 = Color32::from_rgb(0xf5, 0xf7, 0xf8);

/// Lets a window look as a person set it.
pub fn wear(context: &egui::Context, settings: &Settings) {
    context.set_theme(egui::Theme::Light);
    context.set_zoom_factor(settings.font_size);
    let mut visuals = egui::Visuals::light();
    visuals.panel_fill = if settings.high_contrast { Color32::WHITE } else { PAPER };
    visuals.window_fill = Color32::WHITE;
    visuals.override_text_color = Some(INK[usize::from(!settings.high_contrast)]);
    visuals.weak_text_color = Some(if settings.high_contrast { Color32::BLACK } else { Color32::from_gray(0x60) });
    visuals.selection.bg_fill = ACCENT.gamma_multiply(0.30);
    visuals.selection.stroke = egui::Stroke::new(if settings.high_contrast { 3.0 } else { 2.0 }, ACCENT);
    visuals.hyperlink_color = ACCENT;
    context.set_visuals_of(egui::Theme::Light, visuals);
    context.all_styles_mut(|style| {
        let sizes = [
            (TextStyle::Heading, 26.0, FontFamily::Proportional),
            (TextStyle::Body, 16.0, FontFamily::Proportional),
            (TextStyle::Button, 16.0, FontFamily::Proportional),
            (TextStyle::Small, 13.0, FontFamily::Proportional),
            (TextStyle::Monospace, 15.0, FontFamily::Monospace),
        ];
        style.text_styles = sizes.map(|(style, size, family)| (style, FontId::new(size, family))).into();
        style.spacing.item_spacing = egui::vec2(10.0, 8.0);
        style.spacing.button_padding = egui::vec2(14.0, 7.0);
        style.spacing.interact_size.y = 30.0;
    });
}

/// The button for what is done next on a screen.
pub fn main_button(text: impl Into<String>) -> egui::Button<'static> {
    let text = egui::RichText::new(text).color(Color32::WHITE).strong();
    egui::Button::new(text).fill(ACCENT).min_size(egui::vec2(180.0, 40.0))
}

/// A column of readable width in the middle of a wide window.
pub fn column(ui: &mut egui::Ui, contents: impl FnOnce(&mut egui::Ui)) {
    /// Points: some 80 letters.
    const WIDTH: f32 = 760.0;
    let aside = (0.5 * (ui.available_width() - WIDTH)).max(0.0);
    ui.horizontal_top(|ui| {
        ui.add_space(aside);
        ui.vertical(|ui| {
            ui.set_width(WIDTH.min(ui.available_width()));
            ui.add_space(28.0);
            contents(ui);
        });
    });
}

/// How soon [`waiting`] has something new to show.
pub const WAITING_STEP: Duration = Duration::from_millis(333);

/// A sign of life beside a text: a dot more every third of a second. A turning wheel would take, where there is no graphics
/// processor, the very processor that is waited for.
pub fn waiting(ui: &mut egui::Ui) {
    let steps = (ui.input(|input| input.time) / WAITING_STEP.as_secs_f64()) as usize;
    ui.label(".".repeat(1 + steps % 3));
}
