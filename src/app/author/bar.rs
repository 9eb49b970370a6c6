//! What can be done with the whole exercise: try, check, save, take back, leave.

use super::super::look;
use super::marks::mark;
use super::{Ask, Page};
use eframe::egui;

pub fn bar_ui(ui: &mut egui::Ui, page: &mut Page) {
    let authoring = page.authoring;
    let words = page.words;
    // As many rows as the window needs.
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().button_padding = egui::vec2(10.0, 6.0);
        ui.spacing_mut().item_spacing.x = 6.0;
        let buttons: [(&str, &str, Ask, bool); 7] = [
            ("leave", "author.leave", Ask::Leave, true),
            ("undo", "author.undo", Ask::Undo, authoring.draft.can_undo()),
            ("redo", "author.redo", Ask::Redo, authoring.draft.can_redo()),
            ("check", "author.check", Ask::Check, true),
            ("save", "author.save", Ask::Save, authoring.is_unsaved() && !authoring.is_watched),
            ("save_as", "author.save_as", Ask::Where(true), !authoring.is_watched),
            ("try", "author.try", Ask::Try, true),
        ];
        for (name, key, ask, is_enabled) in buttons {
            let text = egui::RichText::new(words.of(key));
            let button = match name {
                "try" => egui::Button::new(text.color(egui::Color32::WHITE).strong()).fill(look::ACCENT),
                _ => egui::Button::new(text),
            };
            let button = ui.add_enabled(is_enabled, button);
            mark(ui, name, button.rect);
            if button.clicked() {
                page.ask(ask);
            }
        }
        let count = authoring.complaints.len();
        if count > 0 {
            ui.colored_label(look::WRONG, words.with("author.wrong_count", count));
        } else if authoring.is_checked {
            ui.colored_label(look::GOOD, words.of("author.nothing_wrong"));
        }
    });
    ui.horizontal_wrapped(|ui| {
        let name = authoring.path.as_ref().map_or(words.of("author.unnamed").to_string(), |p| p.display().to_string());
        let more = if authoring.is_unsaved() { format!(" · {}", words.of("author.unsaved")) } else { String::new() };
        ui.small(format!("{name}{more}"));
        if let Some((key, about)) = &authoring.told {
            let ink = if *key == "author.failed" { look::WRONG } else { look::ACCENT };
            let text = egui::RichText::new(words.with(key, about)).size(13.0).color(ink);
            ui.add(egui::Label::new(text).wrap());
        }
    });
}
