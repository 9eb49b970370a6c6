//! The chart of teeth: 32 teeth to choose from, numbered by ISO 3950, as seen when facing the patient.

use crate::editor::EditorCommand;
use crate::ui::editor::FormContext;
use crate::ui::theme;
use crate::ui::ui_anchors::anchor;
use eframe::egui::{self, Align2, Color32, FontId, Rect, Sense, Stroke};

/// Quadrants of each row, with the direction in which they are counted: the patient's right is on the left.
const ROWS: [[(u8, bool); 2]; 2] = [[(1, true), (2, false)], [(4, true), (3, false)]];

/// Height of a tooth, points.
const HEIGHT: f32 = 40.0;

pub fn tooth_chart_ui(ui: &mut egui::Ui, form: &mut FormContext, chosen: u8) {
    let words = form.words;
    let width = ui.available_width().min(560.0);
    ui.horizontal(|ui| {
        ui.set_width(width);
        ui.small(words.get("author.patients_right"));
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            ui.small(words.get("author.patients_left"))
        });
    });
    let step = width / 16.0;
    for (row, quadrants) in ROWS.into_iter().enumerate() {
        let (rect, _) = ui.allocate_exact_size(egui::vec2(width, HEIGHT), Sense::hover());
        let teeth = quadrants.into_iter().flat_map(|(quadrant, is_backward)| {
            (1..=8u8).map(move |n| quadrant * 10 + if is_backward { 9 - n } else { n })
        });
        for (place, fdi) in teeth.enumerate() {
            let left = rect.left() + place as f32 * step;
            let cell = Rect::from_min_size(egui::pos2(left, rect.top()), egui::vec2(step, HEIGHT));
            tooth_ui(ui, form, fdi, cell.shrink2(egui::vec2(1.0, 2.0)), row == 0, fdi == chosen);
        }
    }
}

fn tooth_ui(ui: &mut egui::Ui, form: &mut FormContext, fdi: u8, cell: Rect, is_upper: bool, is_chosen: bool) {
    let tooth = ui.interact(cell, ui.scope_id().with(("tooth", fdi)), Sense::click());
    let name = form.words.format("author.tooth_number", fdi);
    tooth.widget_info(|| egui::WidgetInfo::selected(egui::Role::RadioButton, true, is_chosen, &name));
    anchor(ui, format!("tooth:{fdi}"), cell);
    let fill = match (is_chosen, tooth.hovered()) {
        (true, _) => theme::ACCENT,
        (false, true) => theme::ACCENT.gamma_multiply(0.20),
        (false, false) => Color32::WHITE,
    };
    let edge =
        if tooth.has_focus() { Stroke::new(3.0, theme::WARNING) } else { Stroke::new(1.0, Color32::from_gray(0x99)) };
    // Molars are wide, incisors narrow; the roots point away from the line between the jaws.
    let share = [0.0, 0.72, 0.62, 0.68, 0.72, 0.76, 1.0, 0.96, 0.88][usize::from(fdi % 10)];
    let share = if is_upper || fdi % 10 > 2 { share } else { 0.55 };
    let body = Rect::from_center_size(cell.center(), egui::vec2(cell.width() * share, cell.height()));
    let (crown, root) = (6, 10);
    let rounding = match is_upper {
        true => egui::CornerRadius { nw: root, ne: root, sw: crown, se: crown },
        false => egui::CornerRadius { nw: crown, ne: crown, sw: root, se: root },
    };
    ui.painter().rect(body, rounding, fill, edge, egui::StrokeKind::Inside);
    let ink = if is_chosen { Color32::WHITE } else { ui.visuals().text_color() };
    let size = (cell.width() * 0.55).clamp(9.0, 14.0);
    ui.painter().text(cell.center(), Align2::CENTER_CENTER, fdi.to_string(), FontId::proportional(size), ink);
    if tooth.clicked() && !is_chosen {
        form.send(EditorCommand::SetToothNumber(fdi));
    }
}
