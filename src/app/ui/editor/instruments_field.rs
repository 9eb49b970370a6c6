//! The tray: its instruments, and the one selected at the start.

use crate::editor::EditorCommand;
use crate::ui::editor::FormContext;
use crate::ui::editor::diagnostics::diagnostics_ui;
use crate::ui::editor::field_parts::{last_segment, remove_ui, reorder_ui};
use crate::ui::ui_anchors::anchor;
use eframe::egui;
use serde_json::json;
use typodont_formats::pointer::child;

/// True for the tray of the exercise and for that of a stage.
pub fn is_instrument_list(pointer: &str) -> bool {
    last_segment(pointer) == "instruments"
}

/// The instruments on the tray, in order, and those that can be added.
pub fn instruments_ui(ui: &mut egui::Ui, form: &mut FormContext, pointer: &str) {
    let is_stages = pointer.starts_with("/stages/");
    let ids = |at: &str| -> Option<Vec<String>> {
        let list = form.value(at)?.as_array()?;
        Some(list.iter().filter_map(|v| v.as_str().map(str::to_string)).collect())
    };
    let own = ids(pointer);
    let all: Vec<String> = match is_stages {
        true => ids("/instruments").unwrap_or_default(),
        false => form.editor.instruments.iter().map(|entry| entry.id.clone()).collect(),
    };
    let title = |id: &str| {
        let entry = form.editor.instruments.iter().find(|entry| entry.id == id);
        entry.map_or(id.to_string(), |entry| entry.title.in_language(&form.words.code).to_string())
    };
    let Some(own) = own else {
        ui.horizontal_wrapped(|ui| {
            ui.weak(form.words.get("author.whole_tray"));
            if ui.small_button(form.words.get("author.choose")).clicked() {
                form.send(EditorCommand::SetValue(pointer.into(), json!(all)));
            }
        });
        return;
    };
    for (place, id) in own.iter().enumerate() {
        let at = child(pointer, place);
        let name = title(id);
        ui.horizontal_wrapped(|ui| {
            let text = if place == 0 && !is_stages { form.words.format("author.in_hand", &name) } else { name.clone() };
            ui.add(egui::Label::new(format!("{}. {text}", place + 1)).wrap());
            reorder_ui(ui, form, pointer, [place, own.len()], &name);
            if own.len() > 1 {
                remove_ui(ui, form, &at, &name);
            }
        });
        diagnostics_ui(ui, form, &at);
    }
    let more: Vec<String> = all.into_iter().filter(|id| !own.contains(id)).collect();
    if !more.is_empty() {
        let name = form.words.get("author.add_instrument").to_string();
        let width = (ui.available_width() - 8.0).clamp(80.0, 280.0);
        let combo = egui::ComboBox::from_id_salt("more").width(width).height(360.0).truncate().selected_text(&name);
        let shown = combo.show_ui(ui, |ui| {
            for id in &more {
                let option = ui.selectable_label(false, title(id));
                anchor(ui, format!("{pointer}+{id}"), option.rect);
                if option.clicked() {
                    form.send(EditorCommand::PushEntry(pointer.into(), json!(id)));
                }
            }
        });
        let response = shown.response.accessible_name(name);
        anchor(ui, format!("add:{pointer}"), response.rect);
    }
    if is_stages && ui.small_button(form.words.get("author.whole_tray")).clicked() {
        form.send(EditorCommand::RemoveValue(pointer.into()));
    }
}
