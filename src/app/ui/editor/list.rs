//! Lists, with entries that can be added, removed and moved, each with its own fields.

use crate::editor::EditorCommand;
use crate::ui::editor::diagnostics::{count_below, diagnostics_ui};
use crate::ui::editor::field::named_field_ui;
use crate::ui::editor::field_parts::{name_ui, remove_ui, reorder_ui};
use crate::ui::editor::labels::label;
use crate::ui::editor::{FormContext, choice_field, instruments_field};
use crate::ui::theme;
use crate::ui::ui_anchors::anchor;
use eframe::egui;
use serde_json::Value;
use typodont_author::{FieldKind, SchemaField};
use typodont_formats::pointer::child;

/// Maximum number of entries that are shown expanded at first.
const OPEN_AT_FIRST: usize = 2;

/// Draws a list under its name.
pub fn list_ui(ui: &mut egui::Ui, form: &mut FormContext, pointer: &str, name: &str, field: &SchemaField) {
    let FieldKind::List { item: of, min: least, max: most } = &field.kind else { return };
    let count = form.value(pointer).and_then(Value::as_array).map_or(0, Vec::len);
    if Some(*least) == *most {
        let is_there = count > 0;
        name_ui(ui, name, &field.description);
        return match is_there || !field.is_nullable {
            true => choice_field::number_row_ui(ui, form, pointer, of, *least as usize),
            false => {
                add_ui(ui, form, pointer, name);
            }
        };
    }
    if instruments_field::is_instrument_list(pointer) {
        name_ui(ui, name, &field.description);
        return instruments_field::instruments_ui(ui, form, pointer);
    }
    ui.add_space(6.0);
    name_ui(ui, name, &field.description);
    entries_ui(ui, form, pointer);
    if most.is_none_or(|most| (count as u64) < most) {
        add_ui(ui, form, pointer, name);
    }
}

/// Button that adds an entry, and the list itself if it is missing.
pub fn add_ui(ui: &mut egui::Ui, form: &mut FormContext, pointer: &str, name: &str) {
    let add = ui.button(format!("+ {name}"));
    anchor(ui, format!("add:{pointer}"), add.rect);
    if add.clicked() {
        form.send(EditorCommand::AddDefault(pointer.into()));
    }
}

/// Draws all entries of a list.
pub fn entries_ui(ui: &mut egui::Ui, form: &mut FormContext, pointer: &str) {
    let editor = form.editor;
    let Some(schema) = editor.form.schema_at(&child(pointer, 0)) else { return };
    let field = editor.form.field(schema);
    let count = form.value(pointer).and_then(Value::as_array).map_or(0, Vec::len);
    for place in 0..count {
        let at = child(pointer, place);
        match &field.kind {
            FieldKind::Object(keys) => entry_ui(ui, form, pointer, place, count, |ui, form| {
                for (key, ..) in keys {
                    crate::ui::editor::field::field_ui(ui, form, &child(&at, key));
                }
            }),
            _ => {
                ui.horizontal_top(|ui| {
                    ui.vertical(|ui| {
                        ui.set_width((ui.available_width() - 110.0).max(80.0));
                        named_field_ui(ui, form, &at, &(place + 1).to_string(), &field);
                    });
                    remove_ui(ui, form, &at, &(place + 1).to_string());
                });
            }
        }
    }
}

/// Draws one entry with its title, collapsed if there are many, and the buttons that move and remove it.
pub fn entry_ui(
    ui: &mut egui::Ui,
    form: &mut FormContext,
    list: &str,
    place: usize,
    count: usize,
    contents: impl FnOnce(&mut egui::Ui, &mut FormContext),
) {
    let at = child(list, place);
    let entry = form.value(&at);
    let text = |key: &str| entry.and_then(|e| e.get(key)?.as_str()).filter(|text| !text.trim().is_empty());
    let own = text("title").or(text("text")).or(text("id")).or(text("name")).unwrap_or("…");
    let (wrong, title) = (count_below(form, &at), format!("{}. {own}", place + 1));
    let title = if wrong > 0 { format!("{title}  !{wrong}") } else { title };
    let ink = if wrong > 0 { theme::ERROR } else { ui.visuals().text_color() };
    let frame = egui::Frame::NONE.corner_radius(6).inner_margin(8);
    let frame = frame.stroke(egui::Stroke::new(1.0, egui::Color32::from_gray(0xb8)));
    frame.show(ui, |ui| {
        ui.set_width(ui.available_width());
        let title = egui::RichText::new(title).strong().color(ink);
        let header = egui::CollapsingHeader::new(title).id_salt(&at).default_open(count <= OPEN_AT_FIRST || wrong > 0);
        let shown = header.show(ui, |ui| {
            contents(ui, form);
            diagnostics_ui(ui, form, &at);
            ui.horizontal_wrapped(|ui| {
                let name = (place + 1).to_string();
                reorder_ui(ui, form, list, [place, count], &name);
                remove_ui(ui, form, &at, &name);
            });
        });
        anchor(ui, format!("entry:{at}"), shown.header_response.rect);
    });
    ui.add_space(4.0);
}

/// Map with keys chosen by the author: numbers of a label map with their tissues.
pub fn map_ui(ui: &mut egui::Ui, form: &mut FormContext, pointer: &str, name: &str, field: &SchemaField) {
    let FieldKind::Map(of) = &field.kind else { return };
    let editor = form.editor;
    let inner = editor.form.field(of);
    name_ui(ui, name, &field.description);
    let keys: Vec<String> =
        form.value(pointer).and_then(Value::as_object).into_iter().flat_map(|map| map.keys().cloned()).collect();
    let names = form.editor.tissue_names();
    for key in &keys {
        let at = child(pointer, key);
        ui.push_id(&at, |ui| match &inner.kind {
            FieldKind::Text { .. } => {
                ui.horizontal_wrapped(|ui| {
                    let named = ui.label(key.as_str()).id;
                    let now = form.value(&at).and_then(Value::as_str).unwrap_or_default().to_string();
                    let combo = egui::ComboBox::from_id_salt("map").selected_text(now.as_str()).show_ui(ui, |ui| {
                        for (name, title) in &names {
                            if ui.selectable_label(*name == now, title).clicked() {
                                form.send(EditorCommand::SetValue(at.clone(), Value::String(name.clone())));
                            }
                        }
                    });
                    combo.response.labelled_by(named);
                    remove_ui(ui, form, &at, key);
                });
                crate::ui::editor::diagnostics::diagnostics_ui(ui, form, &at);
            }
            _ => named_field_ui(ui, form, &at, &label(form.words, key), &inner),
        });
    }
    // The next free number of a label map.
    let next = keys.iter().filter_map(|key| key.parse::<u8>().ok()).max().map_or(1, |most| most.saturating_add(1));
    if ui.button(format!("+ {next}")).clicked() {
        form.send(EditorCommand::SetValue(child(pointer, next), Value::String("dentine".into())));
    }
}
