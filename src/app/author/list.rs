//! Lists: entries that are added, taken away and moved, each with its own fields.

use super::super::look;
use super::field::{name_ui, named_field_ui, remove_ui};
use super::labels::label;
use super::marks::mark;
use super::said::{count_below, said_ui};
use super::{Ask, Page, choice, tray};
use crate::author::{Field, Kind};
use crate::content::pointer::under;
use eframe::egui;
use serde_json::Value;

/// Entries up to this many are open at first.
const OPEN_AT_FIRST: usize = 2;

/// A list under its name.
pub fn list_ui(ui: &mut egui::Ui, page: &mut Page, pointer: &str, name: &str, field: &Field) {
    let Kind::List { of, least, most } = &field.kind else { return };
    let count = page.value(pointer).and_then(Value::as_array).map_or(0, Vec::len);
    if Some(*least) == *most {
        let is_there = count > 0;
        name_ui(ui, name, &field.about);
        return match is_there || !field.may_be_null {
            true => choice::row_ui(ui, page, pointer, of, *least as usize),
            false => {
                add_ui(ui, page, pointer, name);
            }
        };
    }
    if tray::is_tray(pointer) {
        name_ui(ui, name, &field.about);
        return tray::tray_ui(ui, page, pointer);
    }
    ui.add_space(6.0);
    name_ui(ui, name, &field.about);
    entries_ui(ui, page, pointer);
    if most.is_none_or(|most| (count as u64) < most) {
        add_ui(ui, page, pointer, name);
    }
}

/// Adds an entry, or the first of them.
pub fn add_ui(ui: &mut egui::Ui, page: &mut Page, pointer: &str, name: &str) {
    let add = ui.button(format!("+ {name}"));
    mark(ui, format!("add:{pointer}"), add.rect);
    if add.clicked() {
        page.ask(Ask::Add(pointer.into()));
    }
}

/// Every entry of a list.
pub fn entries_ui(ui: &mut egui::Ui, page: &mut Page, pointer: &str) {
    let authoring = page.authoring;
    let Some(schema) = authoring.form.at(&under(pointer, 0)) else { return };
    let field = authoring.form.field(schema);
    let count = page.value(pointer).and_then(Value::as_array).map_or(0, Vec::len);
    for place in 0..count {
        let at = under(pointer, place);
        match &field.kind {
            Kind::Object(keys) => entry_ui(ui, page, pointer, place, count, |ui, page| {
                for (key, ..) in keys {
                    super::field::field_ui(ui, page, &under(&at, key));
                }
            }),
            _ => {
                ui.horizontal_top(|ui| {
                    ui.vertical(|ui| {
                        ui.set_width((ui.available_width() - 110.0).max(80.0));
                        named_field_ui(ui, page, &at, &(place + 1).to_string(), &field);
                    });
                    remove_ui(ui, page, &at, &(place + 1).to_string());
                });
            }
        }
    }
}

/// One entry with a title, folded away where there are many, and the buttons that move and remove it.
pub fn entry_ui(
    ui: &mut egui::Ui,
    page: &mut Page,
    list: &str,
    place: usize,
    count: usize,
    contents: impl FnOnce(&mut egui::Ui, &mut Page),
) {
    let at = under(list, place);
    let entry = page.value(&at);
    let text = |key: &str| entry.and_then(|e| e.get(key)?.as_str()).filter(|text| !text.trim().is_empty());
    let own = text("title").or(text("text")).or(text("id")).or(text("name")).unwrap_or("…");
    let (wrong, title) = (count_below(page, &at), format!("{}. {own}", place + 1));
    let title = if wrong > 0 { format!("{title}  !{wrong}") } else { title };
    let ink = if wrong > 0 { look::WRONG } else { ui.visuals().text_color() };
    let frame = egui::Frame::NONE.corner_radius(6).inner_margin(8);
    let frame = frame.stroke(egui::Stroke::new(1.0, egui::Color32::from_gray(0xb8)));
    frame.show(ui, |ui| {
        ui.set_width(ui.available_width());
        let title = egui::RichText::new(title).strong().color(ink);
        let header = egui::CollapsingHeader::new(title).id_salt(&at).default_open(count <= OPEN_AT_FIRST || wrong > 0);
        let shown = header.show(ui, |ui| {
            contents(ui, page);
            said_ui(ui, page, &at);
            ui.horizontal_wrapped(|ui| {
                let name = (place + 1).to_string();
                order_ui(ui, page, list, [place, count], &name);
                remove_ui(ui, page, &at, &name);
            });
        });
        mark(ui, format!("entry:{at}"), shown.header_response.rect);
    });
    ui.add_space(4.0);
}

/// Buttons that move an entry of so many up and down.
pub fn order_ui(ui: &mut egui::Ui, page: &mut Page, list: &str, [place, count]: [usize; 2], name: &str) {
    for (key, to) in [("author.up", place.checked_sub(1)), ("author.down", Some(place + 1))] {
        let Some(to) = to.filter(|&to| to < count) else { continue };
        let button = ui.small_button(page.words.of(key));
        button.widget_info(|| {
            egui::WidgetInfo::labeled(egui::Role::Button, true, format!("{}: {name}", page.words.of(key)))
        });
        if button.clicked() {
            page.ask(Ask::Swap(list.into(), place, to));
        }
    }
}

/// Keys of the author's own: numbers of a label map with their tissues.
pub fn map_ui(ui: &mut egui::Ui, page: &mut Page, pointer: &str, name: &str, field: &Field) {
    let Kind::Map(of) = &field.kind else { return };
    let authoring = page.authoring;
    let inner = authoring.form.field(of);
    name_ui(ui, name, &field.about);
    let keys: Vec<String> =
        page.value(pointer).and_then(Value::as_object).into_iter().flat_map(|map| map.keys().cloned()).collect();
    let names = page.authoring.tissue_names();
    for key in &keys {
        let at = under(pointer, key);
        ui.push_id(&at, |ui| match &inner.kind {
            Kind::Text { .. } => {
                ui.horizontal_wrapped(|ui| {
                    let named = ui.label(key.as_str()).id;
                    let now = page.value(&at).and_then(Value::as_str).unwrap_or_default().to_string();
                    let combo = egui::ComboBox::from_id_salt("map").selected_text(now.as_str()).show_ui(ui, |ui| {
                        for (name, title) in &names {
                            if ui.selectable_label(*name == now, title).clicked() {
                                page.ask(Ask::Set(at.clone(), Value::String(name.clone())));
                            }
                        }
                    });
                    combo.response.labelled_by(named);
                    remove_ui(ui, page, &at, key);
                });
                super::said::said_ui(ui, page, &at);
            }
            _ => named_field_ui(ui, page, &at, &label(page.words, key), &inner),
        });
    }
    // The next number of a label map.
    let next = keys.iter().filter_map(|key| key.parse::<u8>().ok()).max().map_or(1, |most| most.saturating_add(1));
    if ui.button(format!("+ {next}")).clicked() {
        page.ask(Ask::Set(under(pointer, next), Value::String("dentine".into())));
    }
}
