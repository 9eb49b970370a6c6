//! The field for a value of the schema: a text, a number with its unit and range, a check box, a choice or a group.

use crate::editor::EditorCommand;
use crate::ui::editor::diagnostics::{count_below, diagnostics_ui};
use crate::ui::editor::field_parts::{last_segment, name_ui, remove_ui};
use crate::ui::editor::labels::{label, unit};
use crate::ui::editor::list::{list_ui, map_ui};
use crate::ui::editor::{FormContext, choice_field};
use crate::ui::theme;
use crate::ui::ui_anchors::anchor;
use eframe::egui;
use serde_json::{Value, json};
use typodont_author::{FieldKind, STAGE_TIME_LIMIT_S, SchemaField};
use typodont_formats::pointer::child;

/// Texts of several lines.
const MULTILINE_KEYS: [&str; 2] = ["instruction", "summary"];

/// Decimals to which a dragged number is rounded.
const DECIMALS: usize = 3;

/// Draws the value at a JSON pointer: its name, its field and its complaints.
pub fn field_ui(ui: &mut egui::Ui, form: &mut FormContext, pointer: &str) {
    let editor = form.editor;
    if let Some(schema) = editor.form.schema_at(pointer) {
        let field = editor.form.field(schema);
        let key = last_segment(pointer).to_string();
        named_field_ui(ui, form, pointer, &label(form.words, &key), &field);
    }
}

/// Draws the fields of those keys of an object that are not shown elsewhere.
pub fn remaining_fields_ui(ui: &mut egui::Ui, form: &mut FormContext, pointer: &str, shown_elsewhere: &[&str]) {
    let editor = form.editor;
    let Some(schema) = editor.form.schema_at(pointer) else { return };
    if let FieldKind::Object(keys) = editor.form.field(schema).kind {
        for (key, ..) in keys.into_iter().filter(|(key, ..)| !shown_elsewhere.contains(key)) {
            field_ui(ui, form, &child(pointer, key));
        }
    }
}

pub fn named_field_ui(ui: &mut egui::Ui, form: &mut FormContext, pointer: &str, name: &str, field: &SchemaField) {
    ui.push_id(pointer, |ui| {
        let value = form.value(pointer).cloned();
        match &field.kind {
            FieldKind::Boolean => yes_no_ui(ui, form, pointer, name, field, value.as_ref()),
            FieldKind::Number { .. } => number_ui(ui, form, pointer, name, field, value.as_ref()),
            FieldKind::Text { .. } => match choice_field::named_choices(form, pointer) {
                Some(known) => choice_field::named_choice_ui(ui, form, pointer, name, field, &known),
                None => text_ui(ui, form, pointer, name, field, value.as_ref()),
            },
            FieldKind::Choice(variants) => choice_field::choice_ui(ui, form, pointer, name, field, variants),
            FieldKind::Object(keys) => {
                group_ui(ui, form, pointer, name, field, |ui, form| {
                    for (key, ..) in keys {
                        field_ui(ui, form, &child(pointer, key));
                    }
                });
            }
            FieldKind::List { .. } => list_ui(ui, form, pointer, name, field),
            FieldKind::Map(_) => map_ui(ui, form, pointer, name, field),
            FieldKind::Other => {}
        }
        diagnostics_ui(ui, form, pointer);
    });
}

/// True for a text of several lines, and for one of its languages.
fn is_multiline(pointer: &str) -> bool {
    let above = pointer.rsplit_once('/').map_or("", |(above, _)| last_segment(above));
    [last_segment(pointer), above].iter().any(|key| MULTILINE_KEYS.contains(key))
}

fn text_ui(
    ui: &mut egui::Ui,
    form: &mut FormContext,
    pointer: &str,
    name: &str,
    field: &SchemaField,
    value: Option<&Value>,
) {
    if let Some(Value::Object(texts)) = value {
        let codes: Vec<String> = texts.keys().cloned().collect();
        return texts_by_language_ui(ui, form, pointer, name, field, &codes);
    }
    let named = name_ui(ui, name, &field.description);
    let mut text = value.and_then(Value::as_str).unwrap_or_default().to_string();
    ui.horizontal(|ui| {
        let room = ui.available_width() - if is_removable(field, value) { 44.0 } else { 0.0 };
        let edit = match is_multiline(pointer) {
            true => egui::TextEdit::multiline(&mut text).desired_rows(3),
            false => egui::TextEdit::singleline(&mut text),
        };
        let edit = ui.add(edit.desired_width(room.max(60.0))).labelled_by(named.id).on_hover_text(&field.description);
        anchor(ui, pointer, edit.rect);
        if edit.changed() {
            form.send(EditorCommand::SetValue(pointer.into(), json!(text)));
        }
        clear_button_ui(ui, form, pointer, name, field, value);
    });
    if field.is_by_language && value.is_some() {
        let own = form.words.code.clone();
        let another = if own == BASE_LANGUAGE { SECOND_LANGUAGE } else { &own };
        let add = ui.small_button(form.words.get("author.translate"));
        anchor(ui, format!("translate:{pointer}"), add.rect);
        if add.clicked() {
            let texts = json!({ BASE_LANGUAGE: value, another: value });
            form.send(EditorCommand::SetValue(pointer.into(), texts));
        }
    }
}

/// Languages of a text that gets its first translation, if the window itself is in English.
const BASE_LANGUAGE: &str = "en";
const SECOND_LANGUAGE: &str = "tr";

/// A text in several languages: a field for each.
fn texts_by_language_ui(
    ui: &mut egui::Ui,
    form: &mut FormContext,
    pointer: &str,
    name: &str,
    field: &SchemaField,
    codes: &[String],
) {
    for code in codes {
        let own = child(pointer, code);
        let value = form.value(&own).cloned();
        // Of several languages one may be removed; the last one is the text itself.
        let inner = SchemaField { is_nullable: codes.len() > 1, is_by_language: false, ..field.clone() };
        ui.push_id(code, |ui| text_ui(ui, form, &own, &format!("{name} ({code})"), &inner, value.as_ref()));
        diagnostics_ui(ui, form, &own);
    }
}

fn number_ui(
    ui: &mut egui::Ui,
    form: &mut FormContext,
    pointer: &str,
    name: &str,
    field: &SchemaField,
    value: Option<&Value>,
) {
    let named = name_ui(ui, name, &field.description);
    let written = value.and_then(Value::as_f64);
    ui.horizontal_wrapped(|ui| {
        let Some(now) = written.or(field.default.and_then(Value::as_f64)) else {
            ui.weak(form.words.get("author.none"));
            let set = ui.small_button(form.words.get("author.set"));
            set.widget_info(|| {
                egui::WidgetInfo::labeled(egui::Role::Button, true, format!("{}: {name}", form.words.get("author.set")))
            });
            anchor(ui, format!("set:{pointer}"), set.rect);
            if set.clicked() {
                form.send(EditorCommand::SetValue(pointer.into(), json!(first_number(pointer, field))));
            }
            return;
        };
        let drag = drag_ui(ui, pointer, field, now, written.is_none()).labelled_by(named.id);
        anchor(ui, pointer, drag.response.rect);
        if let Some(new) = drag.changed {
            form.send(EditorCommand::SetValue(pointer.into(), new));
        }
        let range = range_text(form, field);
        if !range.is_empty() {
            ui.add(egui::Label::new(egui::RichText::new(range).weak().size(13.0)).wrap());
        }
        clear_button_ui(ui, form, pointer, name, field, value);
    });
}

pub struct DragResult {
    pub response: egui::Response,
    /// The new number, if it was changed.
    pub changed: Option<Value>,
}

impl DragResult {
    pub fn labelled_by(self, id: egui::Id) -> DragResult {
        DragResult { response: self.response.labelled_by(id), ..self }
    }
}

/// A number to drag or to type, with its unit. A typed number is kept as typed; a dragged one is kept in its range.
pub fn drag_ui(ui: &mut egui::Ui, pointer: &str, field: &SchemaField, now: f64, is_default: bool) -> DragResult {
    let FieldKind::Number { min: least, max: most, is_integer: is_whole, .. } = field.kind else {
        return DragResult { response: ui.label(""), changed: None };
    };
    let (low, high) = (least.unwrap_or(f64::MIN), most.unwrap_or(f64::MAX));
    let spread = if least.is_some() && most.is_some() { high - low } else { now.abs().max(1.0) * 4.0 };
    let speed = if is_whole { 0.1 } else { (spread / 300.0).clamp(0.001, 10.0) };
    let mut number = now;
    let unit = unit(last_segment(pointer).trim_start_matches(char::is_numeric));
    let unit = if unit.is_empty() { unit_above(pointer) } else { unit };
    let drag = egui::DragValue::new(&mut number)
        .speed(speed)
        .max_decimals(if is_whole { 0 } else { DECIMALS })
        .update_while_editing(false)
        .custom_parser(|typed| typed.trim().replace(',', ".").parse().ok());
    let drag = if unit.is_empty() { drag } else { drag.suffix(format!(" {unit}")) };
    let response = ui.scope(|ui| {
        if is_default {
            ui.visuals_mut().override_text_color = Some(ui.visuals().weak_text_color());
        }
        ui.add(drag)
    });
    let response = response.inner.on_hover_text(&field.description);
    if response.dragged() {
        number = number.clamp(low, high);
    }
    let changed = (number != now).then(|| rounded_number(number, is_whole));
    DragResult { response, changed }
}

/// The unit of the list to which an entry belongs.
fn unit_above(pointer: &str) -> &'static str {
    match pointer.rsplit_once('/') {
        Some((list, entry)) if entry.parse::<usize>().is_ok() => unit(last_segment(list)),
        _ => "",
    }
}

pub fn rounded_number(number: f64, is_whole: bool) -> Value {
    let power = 10f64.powi(DECIMALS as i32);
    match is_whole {
        true => json!(number.round() as i64),
        false => json!((number * power).round() / power),
    }
}

/// Default number for a limit that is set for the first time.
fn first_number(pointer: &str, field: &SchemaField) -> f64 {
    let FieldKind::Number { min: least, max: most, .. } = field.kind else { return 0.0 };
    let wished: f64 = if last_segment(pointer) == "time_limit_s" { f64::from(STAGE_TIME_LIMIT_S) } else { 1.0 };
    wished.clamp(least.unwrap_or(f64::MIN), most.unwrap_or(f64::MAX))
}

/// The range as text in the user's language, such as "0.2 to 6".
fn range_text(form: &FormContext, field: &SchemaField) -> String {
    let FieldKind::Number { min: least, max: most, is_min_exclusive: is_open, .. } = field.kind else {
        return String::new();
    };
    let more = if is_open { "> " } else { "" };
    match (least, most) {
        (Some(low), Some(high)) => format!("{more}{low} – {high}"),
        (Some(low), None) => form.words.format("author.at_least", low),
        (None, Some(high)) => form.words.format("author.at_most", high),
        (None, None) => String::new(),
    }
}

fn yes_no_ui(
    ui: &mut egui::Ui,
    form: &mut FormContext,
    pointer: &str,
    name: &str,
    field: &SchemaField,
    value: Option<&Value>,
) {
    if field.is_nullable {
        // True, false, or unset.
        let named = name_ui(ui, name, &field.description);
        ui.horizontal_wrapped(|ui| {
            let options =
                [(json!(true), "questions.yes"), (json!(false), "questions.no"), (Value::Null, "author.not_judged")];
            for (option, key) in options {
                let is_it = value == Some(&option);
                if ui.radio(is_it, form.words.get(key)).labelled_by(named.id).clicked() && !is_it {
                    form.send(EditorCommand::SetValue(pointer.into(), option));
                }
            }
        });
        return;
    }
    let was = value.or(field.default).and_then(Value::as_bool).unwrap_or_default();
    let mut is = was;
    let tick = ui.checkbox(&mut is, name).on_hover_text(&field.description);
    anchor(ui, pointer, tick.rect);
    if is != was {
        form.send(EditorCommand::SetValue(pointer.into(), json!(is)));
    }
}

/// A group of fields under a name; an optional group is added and removed as a whole.
pub fn group_ui(
    ui: &mut egui::Ui,
    form: &mut FormContext,
    pointer: &str,
    name: &str,
    field: &SchemaField,
    contents: impl FnOnce(&mut egui::Ui, &mut FormContext),
) {
    let is_there = form.value(pointer).is_some_and(|v| !v.is_null());
    if field.is_nullable && !is_there {
        ui.horizontal_wrapped(|ui| {
            let add = ui.button(format!("+ {name}")).on_hover_text(&field.description);
            anchor(ui, format!("add:{pointer}"), add.rect);
            if add.clicked() {
                form.send(EditorCommand::AddDefault(pointer.into()));
            }
        });
        return;
    }
    let wrong = count_below(form, pointer);
    let title = if wrong > 0 { format!("{name}  !{wrong}") } else { name.to_string() };
    let title = egui::RichText::new(title).size(14.0).strong();
    let title = if wrong > 0 { title.color(theme::ERROR) } else { title };
    let header = egui::CollapsingHeader::new(title).id_salt(pointer).default_open(is_there || wrong > 0);
    let shown = header.show(ui, |ui| {
        contents(ui, form);
        if field.is_nullable {
            remove_ui(ui, form, pointer, name);
        }
    });
    if !field.description.is_empty() {
        shown.header_response.on_hover_text(&field.description);
    }
}

/// True if there is a value, and it is optional.
fn is_removable(field: &SchemaField, value: Option<&Value>) -> bool {
    value.is_some() && (field.default.is_some() || field.is_nullable)
}

/// Button that removes an optional value, so that the default applies.
fn clear_button_ui(
    ui: &mut egui::Ui,
    form: &mut FormContext,
    pointer: &str,
    name: &str,
    field: &SchemaField,
    value: Option<&Value>,
) {
    if !is_removable(field, value) {
        return;
    }
    let about = match field.default {
        Some(usual) => form.words.format("author.as_usual", usual),
        None => form.words.get("author.leave_out").to_string(),
    };
    let button = ui.small_button("×").on_hover_text(&about);
    button.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, format!("{name}: {about}")));
    if button.clicked() {
        form.send(EditorCommand::RemoveValue(pointer.into()));
    }
}
