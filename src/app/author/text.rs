//! The file itself, for those who like to write; and the only way to mend a text that is not JSON.

use super::super::look;
use super::marks::mark;
use super::said::complaint_ui;
use super::{Ask, Page};
use eframe::egui;

pub fn text_ui(ui: &mut egui::Ui, page: &mut Page) {
    let authoring = page.authoring;
    ui.add(egui::Label::new(page.words.of("author.text_about")).wrap());
    if !authoring.draft.is_json() {
        ui.colored_label(look::WRONG, page.words.of("author.not_json"));
    }
    for complaint in &authoring.complaints {
        if let Some((line, column)) = complaint.line_and_column() {
            ui.small(format!("{line}:{column}  {}", complaint.path));
        }
        complaint_ui(ui, page, complaint);
    }
    let mut text = authoring.draft.text().to_string();
    let name = page.words.of("author.part_text");
    // Long lines are scrolled, not broken: what is shown is what is written.
    egui::ScrollArea::horizontal().show(ui, |ui| {
        let edit = egui::TextEdit::multiline(&mut text).code_editor().desired_rows(24);
        let edit = ui.add(edit.desired_width(f32::INFINITY));
        edit.widget_info(|| egui::WidgetInfo::labeled(egui::Role::MultilineTextInput, true, name));
        mark(ui, "text", edit.rect);
        if edit.changed() {
            page.ask(Ask::Write(text));
        }
    });
}
