//! Commands for the whole exercise: try, check, save, undo, leave.

use crate::editor::EditorCommand;
use crate::platform;
use crate::ui::editor::FormContext;
use crate::ui::theme;
use crate::ui::ui_anchors::anchor;
use eframe::egui;

pub fn toolbar_ui(ui: &mut egui::Ui, form: &mut FormContext) {
    let editor = form.editor;
    let words = form.words;
    // As many rows as the window needs.
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().button_padding = egui::vec2(10.0, 6.0);
        ui.spacing_mut().item_spacing.x = 6.0;
        let buttons: [(&str, &str, EditorCommand, bool); 7] = [
            ("leave", "author.leave", EditorCommand::Leave, true),
            ("undo", "author.undo", EditorCommand::Undo, editor.draft.can_undo()),
            ("redo", "author.redo", EditorCommand::Redo, editor.draft.can_redo()),
            ("check", "author.check", EditorCommand::Check, true),
            ("save", "author.save", EditorCommand::Save, editor.is_unsaved() && !editor.is_read_only),
            ("save_as", "author.save_as", EditorCommand::ShowSaveAs(true), !editor.is_read_only),
            ("try", "author.try", EditorCommand::TestRun, true),
        ];
        // A page has the browser save, which asks for the place itself.
        for (name, key, command, is_enabled) in
            buttons.into_iter().filter(|(name, ..)| !platform::IS_PAGE || *name != "save_as")
        {
            let text = egui::RichText::new(words.get(key));
            let button = match name {
                "try" => egui::Button::new(text.color(egui::Color32::WHITE).strong()).fill(theme::ACCENT),
                _ => egui::Button::new(text),
            };
            let button = ui.add_enabled(is_enabled, button);
            anchor(ui, name, button.rect);
            if button.clicked() {
                form.send(command);
            }
        }
        let count = editor.complaints.len();
        if count > 0 {
            ui.colored_label(theme::ERROR, words.format("author.wrong_count", count));
        } else if editor.is_checked {
            ui.colored_label(theme::SUCCESS, words.get("author.nothing_wrong"));
        } else {
            ui.weak(words.get("author.checking"));
        }
    });
    ui.horizontal_wrapped(|ui| {
        let name = match &editor.path {
            Some(path) => path.display().to_string(),
            None if platform::IS_PAGE => editor.file_name(),
            None => words.get("author.unnamed").to_string(),
        };
        let more = if editor.is_unsaved() { format!(" · {}", words.get("author.unsaved")) } else { String::new() };
        ui.small(format!("{name}{more}"));
        if let Some((key, about)) = &editor.notice {
            let ink = if *key == "author.failed" { theme::ERROR } else { theme::ACCENT };
            let text = egui::RichText::new(words.format(key, about)).size(13.0).color(ink);
            ui.add(egui::Label::new(text).wrap());
        }
    });
}
