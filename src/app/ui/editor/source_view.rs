//! The text of the file, for editing by hand; the only way to correct a text that is not valid JSON.

use crate::editor::EditorCommand;
use crate::ui::editor::FormContext;
use crate::ui::editor::diagnostics::diagnostic_ui;
use crate::ui::theme;
use crate::ui::ui_anchors::anchor;
use eframe::egui;

pub fn source_ui(ui: &mut egui::Ui, form: &mut FormContext) {
    let editor = form.editor;
    ui.add(egui::Label::new(form.words.get("author.text_about")).wrap());
    if !editor.draft.is_json() {
        ui.colored_label(theme::ERROR, form.words.get("author.not_json"));
    }
    for complaint in &editor.complaints {
        if let Some((line, column)) = complaint.line_and_column() {
            ui.small(format!("{line}:{column}  {}", complaint.path));
        }
        diagnostic_ui(ui, form, complaint);
    }
    let mut text = editor.draft.text().to_string();
    let name = form.words.get("author.part_text");
    // Long lines are scrolled instead of wrapped, so that lines are shown as in the file.
    egui::ScrollArea::horizontal().show(ui, |ui| {
        let edit = egui::TextEdit::multiline(&mut text).code_editor().desired_rows(24);
        let edit = ui.add(edit.desired_width(f32::INFINITY));
        edit.widget_info(|| egui::WidgetInfo::labeled(egui::Role::MultilineTextInput, true, name));
        anchor(ui, "text", edit.rect);
        if edit.changed() {
            form.send(EditorCommand::ReplaceText(text));
        }
    });
}
