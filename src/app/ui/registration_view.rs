//! The crosses over the picture at which an arm's hand is registered with it.

use crate::command::{AppCommand, PracticeCommand};
use crate::hand_registration::{CROSSES, RegistrationDraft, RegistrationRefusal};
use crate::i18n::Translations;
use crate::ui::theme;
use eframe::egui::{self, Color32, Pos2, Rect, Stroke};

/// Length of a cross's arms, points.
const ARM: f32 = 18.0;

/// Width and height of the card with the instruction, points.
const CARD: egui::Vec2 = egui::vec2(360.0, 150.0);

/// Draws the cross that is to be touched, and what to do. `is_ready`: the hand is in the frame in which it is registered.
pub fn registration_ui(
    ui: &mut egui::Ui,
    view: Rect,
    draft: &RegistrationDraft,
    is_ready: bool,
    words: &Translations,
    commands: &mut Vec<AppCommand>,
) {
    ui.painter().rect_filled(view, 0, Color32::from_black_alpha(120));
    for (index, [right, up]) in CROSSES.into_iter().enumerate() {
        let at = view.center() + egui::vec2(right, -up) * view.height();
        let is_next = index == draft.next_cross();
        let colour = if is_next && is_ready { Color32::WHITE } else { Color32::from_white_alpha(60) };
        cross(ui.painter(), at, colour, is_next);
    }
    let card = Rect::from_center_size(view.center(), CARD.min(view.size() * 0.6));
    ui.painter().rect_filled(card, 8, Color32::from_black_alpha(190));
    let mut inside = ui.new_child(egui::UiBuilder::new().max_rect(card.shrink(14.0)));
    let white = |text: String| egui::RichText::new(text).color(Color32::WHITE);
    let number = format!("{} / {}", draft.next_cross() + 1, CROSSES.len());
    inside.label(white(words.format("register.cross", number)).strong());
    match draft.refused {
        Some(why) if draft.next_cross() == 0 => {
            let length = |length: f32| format!("{length:.0} mm");
            let text = match why {
                RegistrationRefusal::TooSmall(height) => words.format("register.too_small", length(height)),
                RegistrationRefusal::DoesNotFit(error) => words.format("register.does_not_fit", length(error)),
                RegistrationRefusal::Mirrored => words.get("register.mirrored").to_string(),
            };
            inside.colored_label(theme::WARNING, text);
        }
        _ => _ = inside.label(white(words.get("register.how").to_string())),
    }
    inside.horizontal_wrapped(|ui| {
        let touch = egui::Button::new(words.get("register.touch"));
        if ui.add_enabled(is_ready, touch).clicked() {
            commands.push(AppCommand::Practice(PracticeCommand::TouchCross));
        }
        if ui.button(words.get("register.stop")).clicked() {
            commands.push(AppCommand::Practice(PracticeCommand::RegisterHand(false)));
        }
    });
    if !is_ready {
        ui.ctx().request_repaint();
    }
}

fn cross(painter: &egui::Painter, at: Pos2, colour: Color32, is_next: bool) {
    let reach = if is_next { ARM } else { 0.5 * ARM };
    let stroke = Stroke::new(if is_next { 3.0 } else { 1.5 }, colour);
    painter.line_segment([at - egui::vec2(reach, 0.0), at + egui::vec2(reach, 0.0)], stroke);
    painter.line_segment([at - egui::vec2(0.0, reach), at + egui::vec2(0.0, reach)], stroke);
    painter.circle_stroke(at, 0.6 * reach, stroke);
}
