//! Fonts and colours, with sufficient contrast between text and background.

use crate::settings::Settings;
use eframe::egui::{self, Color32, FontFamily, FontId, Key, Modifiers, TextStyle};
use std::time::Duration;

/// Colour of the primary action. Its contrast with white is 5.2:1, above the 4.5:1 that WCAG 2.2 requires of text.
pub const ACCENT: Color32 = Color32::from_rgb(0x1f, 0x6f, 0x8b);

/// Colour of success. The text beside this colour and the two below always names the state, too.
pub const SUCCESS: Color32 = Color32::from_rgb(0x2e, 0x7d, 0x4f);
pub const WARNING: Color32 = Color32::from_rgb(0xb2, 0x6a, 0x00);
pub const ERROR: Color32 = Color32::from_rgb(0xb3, 0x26, 0x1e);

/// Text in full contrast and in the usual, on paper.
const TEXT_COLOURS: [Color32; 2] = [Color32::BLACK, Color32::from_rgb(0x22, 0x2b, 0x33)];

/// Background colour of the window.
const PAGE_COLOUR: Color32 = Color32::from_rgb(0xf5, 0xf7, 0xf8);

/// Draws a tick, which the window's fonts lack.
pub fn tick(painter: &egui::Painter, rect: egui::Rect, stroke: egui::Stroke) {
    let at = |x: f32, y: f32| rect.lerp_inside(egui::vec2(x, y));
    painter.line(vec![at(0.22, 0.52), at(0.42, 0.72), at(0.78, 0.28)], stroke);
}

/// Applies fonts, colours and text size of the settings to a window.
pub fn apply(context: &egui::Context, settings: &Settings) {
    context.set_theme(egui::Theme::Light);
    context.set_zoom_factor(settings.font_size);
    let mut visuals = egui::Visuals::light();
    visuals.panel_fill = if settings.high_contrast { Color32::WHITE } else { PAGE_COLOUR };
    visuals.window_fill = Color32::WHITE;
    visuals.override_text_color = Some(TEXT_COLOURS[usize::from(!settings.high_contrast)]);
    visuals.weak_text_color = Some(if settings.high_contrast { Color32::BLACK } else { Color32::from_gray(0x60) });
    visuals.selection.bg_fill = ACCENT.gamma_multiply(0.30);
    visuals.selection.stroke = egui::Stroke::new(if settings.high_contrast { 3.0 } else { 2.0 }, ACCENT);
    visuals.hyperlink_color = ACCENT;
    if settings.high_contrast {
        // Fields and buttons have edges.
        let widgets = &mut visuals.widgets;
        for state in [&mut widgets.noninteractive, &mut widgets.inactive, &mut widgets.hovered, &mut widgets.open] {
            state.bg_stroke = egui::Stroke::new(1.5, Color32::BLACK);
        }
        // The one with the keyboard focus has the widest.
        widgets.active.bg_stroke = egui::Stroke::new(3.5, Color32::BLACK);
    }
    // So that one sees which of them has the keyboard focus.
    visuals.collapsing_header_frame = true;
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

/// Scrolls the area around by the arrow and page keys, while no widget has the keyboard focus and no page lies over it.
pub fn scroll_by_keys(ui: &mut egui::Ui) {
    /// Points: of an arrow key, and more than any area has.
    const LINE: f32 = 40.0;
    const WHOLE: f32 = 1e6;
    if ui.ctx().egui_wants_keyboard_input() || ui.memory(|memory| memory.top_modal_layer().is_some()) {
        return;
    }
    let page = (ui.clip_rect().height() - LINE).max(LINE);
    let keys = [
        (Key::ArrowUp, LINE),
        (Key::ArrowDown, -LINE),
        (Key::PageUp, page),
        (Key::PageDown, -page),
        (Key::Home, WHOLE),
        (Key::End, -WHOLE),
    ];
    for (key, by) in keys {
        if ui.input_mut(|input| input.consume_key(Modifiers::NONE, key)) {
            ui.scroll_with_delta(egui::vec2(0.0, by));
        }
    }
}

/// The button for what is done next on a screen.
pub fn primary_button(text: impl Into<String>) -> egui::Button<'static> {
    let text = egui::RichText::new(text).color(Color32::WHITE).strong();
    egui::Button::new(text).fill(ACCENT).min_size(egui::vec2(180.0, 40.0))
}

/// A column of readable width in the middle of a wide window.
pub fn centered_column(ui: &mut egui::Ui, contents: impl FnOnce(&mut egui::Ui)) {
    /// Width, points: about 80 characters.
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

/// A bar that shows which share of a work is done, with the name of its present step.
pub fn progress_bar(ui: &mut egui::Ui, step: &str, share: f32) {
    ui.label(step);
    let bar = ui.add(egui::ProgressBar::new(share).fill(ACCENT).desired_height(12.0).desired_width(420.0));
    bar.widget_info(|| egui::WidgetInfo::labeled(egui::Role::ProgressIndicator, true, step));
}

/// Interval at which [`progress_dots`] changes.
pub const PROGRESS_DOT_INTERVAL: Duration = Duration::from_millis(333);

/// Progress indicator beside a text: one more dot every third of a second. Without a graphics processor, an animated
/// wheel would take processor time from the very work that it waits for.
pub fn progress_dots(ui: &mut egui::Ui) {
    let steps = (ui.input(|input| input.time) / PROGRESS_DOT_INTERVAL.as_secs_f64()) as usize;
    ui.label(".".repeat(1 + steps % 3));
}
