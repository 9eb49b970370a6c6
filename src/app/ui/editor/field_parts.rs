//! Parts that fields and lists share: names, and buttons that remove and reorder.

use crate::editor::EditorCommand;
use crate::ui::editor::FormContext;
use crate::ui::ui_anchors::anchor;
use eframe::egui;

/// Last segment of a JSON pointer.
pub fn last_segment(pointer: &str) -> &str {
    pointer.rsplit('/').next().unwrap_or_default()
}

/// Draws the name above a field; hovering shows its description.
pub fn name_ui(ui: &mut egui::Ui, name: &str, about: &str) -> egui::Response {
    ui.add_space(2.0);
    let text = ui.add(egui::Label::new(egui::RichText::new(name).size(14.0).strong()).wrap());
    if about.is_empty() { text } else { text.on_hover_text(about) }
}

/// Buttons that move an entry up and down; `[place, count]` are its index and the number of entries.
pub fn reorder_ui(ui: &mut egui::Ui, form: &mut FormContext, list: &str, [place, count]: [usize; 2], name: &str) {
    for (key, to) in [("author.up", place.checked_sub(1)), ("author.down", Some(place + 1))] {
        let Some(to) = to.filter(|&to| to < count) else { continue };
        let button = ui.small_button(form.words.get(key));
        button.widget_info(|| {
            egui::WidgetInfo::labeled(egui::Role::Button, true, format!("{}: {name}", form.words.get(key)))
        });
        if button.clicked() {
            form.send(EditorCommand::SwapEntries(list.into(), place, to));
        }
    }
}

/// Button that removes a value as a whole.
pub fn remove_ui(ui: &mut egui::Ui, form: &mut FormContext, pointer: &str, name: &str) {
    let text = form.words.get("author.remove").to_string();
    let button = ui.small_button(&text);
    button.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, format!("{text}: {name}")));
    anchor(ui, format!("remove:{pointer}"), button.rect);
    if button.clicked() {
        form.send(EditorCommand::RemoveValue(pointer.into()));
    }
}
