//! One field for whatever the schema has at a place: a line, a number with its unit and range, a tick, a choice, a group.

use super::super::look;
use super::labels::{label, unit};
use super::list::{list_ui, map_ui};
use super::marks::mark;
use super::said::{count_below, said_ui};
use super::{Ask, Page, choice};
use crate::author::{Field, Kind};
use crate::content::pointer::under;
use eframe::egui;
use serde_json::{Value, json};

/// Texts of several lines.
const LONG: [&str; 2] = ["instruction", "summary"];

/// Decimals that are kept of a number somebody drags.
const DECIMALS: usize = 3;

/// Everything about the value at a pointer: its name, its field, and what is wrong with it.
pub fn field_ui(ui: &mut egui::Ui, page: &mut Page, pointer: &str) {
    let authoring = page.authoring;
    if let Some(schema) = authoring.form.at(pointer) {
        let field = authoring.form.field(schema);
        let key = last(pointer).to_string();
        named_field_ui(ui, page, pointer, &label(page.words, &key), &field);
    }
}

/// Those keys of an object that are not shown elsewhere, each with its field.
pub fn rest_ui(ui: &mut egui::Ui, page: &mut Page, pointer: &str, shown_elsewhere: &[&str]) {
    let authoring = page.authoring;
    let Some(schema) = authoring.form.at(pointer) else { return };
    if let Kind::Object(keys) = authoring.form.field(schema).kind {
        for (key, ..) in keys.into_iter().filter(|(key, ..)| !shown_elsewhere.contains(key)) {
            field_ui(ui, page, &under(pointer, key));
        }
    }
}

pub fn last(pointer: &str) -> &str {
    pointer.rsplit('/').next().unwrap_or_default()
}

pub fn named_field_ui(ui: &mut egui::Ui, page: &mut Page, pointer: &str, name: &str, field: &Field) {
    ui.push_id(pointer, |ui| {
        let value = page.value(pointer).cloned();
        match &field.kind {
            Kind::YesNo => yes_no_ui(ui, page, pointer, name, field, value.as_ref()),
            Kind::Number { .. } => number_ui(ui, page, pointer, name, field, value.as_ref()),
            Kind::Text { .. } => match choice::suggestions(page, pointer) {
                Some(known) => choice::known_ui(ui, page, pointer, name, field, &known),
                None => text_ui(ui, page, pointer, name, field, value.as_ref()),
            },
            Kind::Choice(variants) => choice::choice_ui(ui, page, pointer, name, field, variants),
            Kind::Object(keys) => {
                group_ui(ui, page, pointer, name, field, |ui, page| {
                    for (key, ..) in keys {
                        field_ui(ui, page, &under(pointer, key));
                    }
                });
            }
            Kind::List { .. } => list_ui(ui, page, pointer, name, field),
            Kind::Map(_) => map_ui(ui, page, pointer, name, field),
            Kind::Other => {}
        }
        said_ui(ui, page, pointer);
    });
}

/// A name above a field; hovering says what it is for.
pub fn name_ui(ui: &mut egui::Ui, name: &str, about: &str) -> egui::Response {
    ui.add_space(2.0);
    let text = ui.add(egui::Label::new(egui::RichText::new(name).size(14.0).strong()).wrap());
    if about.is_empty() { text } else { text.on_hover_text(about) }
}

fn text_ui(ui: &mut egui::Ui, page: &mut Page, pointer: &str, name: &str, field: &Field, value: Option<&Value>) {
    let named = name_ui(ui, name, &field.about);
    let mut text = value.and_then(Value::as_str).unwrap_or_default().to_string();
    ui.horizontal(|ui| {
        let room = ui.available_width() - if can_go(field, value) { 44.0 } else { 0.0 };
        let edit = match LONG.contains(&last(pointer)) {
            true => egui::TextEdit::multiline(&mut text).desired_rows(3),
            false => egui::TextEdit::singleline(&mut text),
        };
        let edit = ui.add(edit.desired_width(room.max(60.0))).labelled_by(named.id).on_hover_text(&field.about);
        mark(ui, pointer, edit.rect);
        if edit.changed() {
            page.ask(Ask::Set(pointer.into(), json!(text)));
        }
        go_ui(ui, page, pointer, name, field, value);
    });
}

fn number_ui(ui: &mut egui::Ui, page: &mut Page, pointer: &str, name: &str, field: &Field, value: Option<&Value>) {
    let named = name_ui(ui, name, &field.about);
    let written = value.and_then(Value::as_f64);
    ui.horizontal_wrapped(|ui| {
        let Some(now) = written.or(field.usual.and_then(Value::as_f64)) else {
            ui.weak(page.words.of("author.none"));
            let set = ui.small_button(page.words.of("author.set"));
            set.widget_info(|| {
                egui::WidgetInfo::labeled(egui::Role::Button, true, format!("{}: {name}", page.words.of("author.set")))
            });
            mark(ui, format!("set:{pointer}"), set.rect);
            if set.clicked() {
                page.ask(Ask::Set(pointer.into(), json!(first_number(pointer, field))));
            }
            return;
        };
        let drag = drag_ui(ui, pointer, field, now, written.is_none()).labelled_by(named.id);
        mark(ui, pointer, drag.response.rect);
        if let Some(new) = drag.changed {
            page.ask(Ask::Set(pointer.into(), new));
        }
        let range = range_of(page, field);
        if !range.is_empty() {
            ui.add(egui::Label::new(egui::RichText::new(range).weak().size(13.0)).wrap());
        }
        go_ui(ui, page, pointer, name, field, value);
    });
}

pub struct Dragged {
    pub response: egui::Response,
    /// The number as it is now, where it was changed.
    pub changed: Option<Value>,
}

impl Dragged {
    pub fn labelled_by(self, id: egui::Id) -> Dragged {
        Dragged { response: self.response.labelled_by(id), ..self }
    }
}

/// A number to drag or to type, with its unit. What is typed stays as it is typed; what is dragged stays in its range.
pub fn drag_ui(ui: &mut egui::Ui, pointer: &str, field: &Field, now: f64, is_usual: bool) -> Dragged {
    let Kind::Number { least, most, is_whole, .. } = field.kind else {
        return Dragged { response: ui.label(""), changed: None };
    };
    let (low, high) = (least.unwrap_or(f64::MIN), most.unwrap_or(f64::MAX));
    let spread = if least.is_some() && most.is_some() { high - low } else { now.abs().max(1.0) * 4.0 };
    let speed = if is_whole { 0.1 } else { (spread / 300.0).clamp(0.001, 10.0) };
    let mut number = now;
    let unit = unit(last(pointer).trim_start_matches(char::is_numeric));
    let unit = if unit.is_empty() { unit_above(pointer) } else { unit };
    let drag = egui::DragValue::new(&mut number)
        .speed(speed)
        .max_decimals(if is_whole { 0 } else { DECIMALS })
        .update_while_editing(false)
        .custom_parser(|typed| typed.trim().replace(',', ".").parse().ok());
    let drag = if unit.is_empty() { drag } else { drag.suffix(format!(" {unit}")) };
    let response = ui.scope(|ui| {
        if is_usual {
            ui.visuals_mut().override_text_color = Some(ui.visuals().weak_text_color());
        }
        ui.add(drag)
    });
    let response = response.inner.on_hover_text(&field.about);
    if response.dragged() {
        number = number.clamp(low, high);
    }
    let changed = (number != now).then(|| written_number(number, is_whole));
    Dragged { response, changed }
}

/// The unit of a list that an entry belongs to.
fn unit_above(pointer: &str) -> &'static str {
    match pointer.rsplit_once('/') {
        Some((list, entry)) if entry.parse::<usize>().is_ok() => unit(last(list)),
        _ => "",
    }
}

pub fn written_number(number: f64, is_whole: bool) -> Value {
    let power = 10f64.powi(DECIMALS as i32);
    match is_whole {
        true => json!(number.round() as i64),
        false => json!((number * power).round() / power),
    }
}

/// A sensible number for a limit that is set for the first time.
fn first_number(pointer: &str, field: &Field) -> f64 {
    let Kind::Number { least, most, .. } = field.kind else { return 0.0 };
    let wished: f64 = if last(pointer) == "time_limit_s" { 300.0 } else { 1.0 };
    wished.clamp(least.unwrap_or(f64::MIN), most.unwrap_or(f64::MAX))
}

/// "0.2 to 6", in the person's language.
fn range_of(page: &Page, field: &Field) -> String {
    let Kind::Number { least, most, is_open, .. } = field.kind else { return String::new() };
    let more = if is_open { "> " } else { "" };
    match (least, most) {
        (Some(low), Some(high)) => format!("{more}{low} – {high}"),
        (Some(low), None) => page.words.with("author.at_least", low),
        (None, Some(high)) => page.words.with("author.at_most", high),
        (None, None) => String::new(),
    }
}

fn yes_no_ui(ui: &mut egui::Ui, page: &mut Page, pointer: &str, name: &str, field: &Field, value: Option<&Value>) {
    if field.may_be_null {
        // Right, wrong, or neither of both.
        let named = name_ui(ui, name, &field.about);
        ui.horizontal_wrapped(|ui| {
            let options =
                [(json!(true), "questions.yes"), (json!(false), "questions.no"), (Value::Null, "author.not_judged")];
            for (option, key) in options {
                let is_it = value == Some(&option);
                if ui.radio(is_it, page.words.of(key)).labelled_by(named.id).clicked() && !is_it {
                    page.ask(Ask::Set(pointer.into(), option));
                }
            }
        });
        return;
    }
    let was = value.or(field.usual).and_then(Value::as_bool).unwrap_or_default();
    let mut is = was;
    let tick = ui.checkbox(&mut is, name).on_hover_text(&field.about);
    mark(ui, pointer, tick.rect);
    if is != was {
        page.ask(Ask::Set(pointer.into(), json!(is)));
    }
}

/// A group of fields under a name; where it may be left out it is added and taken away as a whole.
pub fn group_ui(
    ui: &mut egui::Ui,
    page: &mut Page,
    pointer: &str,
    name: &str,
    field: &Field,
    contents: impl FnOnce(&mut egui::Ui, &mut Page),
) {
    let is_there = page.value(pointer).is_some_and(|v| !v.is_null());
    if field.may_be_null && !is_there {
        ui.horizontal_wrapped(|ui| {
            let add = ui.button(format!("+ {name}")).on_hover_text(&field.about);
            mark(ui, format!("add:{pointer}"), add.rect);
            if add.clicked() {
                page.ask(Ask::Add(pointer.into()));
            }
        });
        return;
    }
    let wrong = count_below(page, pointer);
    let title = if wrong > 0 { format!("{name}  !{wrong}") } else { name.to_string() };
    let title = egui::RichText::new(title).size(14.0).strong();
    let title = if wrong > 0 { title.color(look::WRONG) } else { title };
    let header = egui::CollapsingHeader::new(title).id_salt(pointer).default_open(is_there || wrong > 0);
    let shown = header.show(ui, |ui| {
        contents(ui, page);
        if field.may_be_null {
            remove_ui(ui, page, pointer, name);
        }
    });
    if !field.about.is_empty() {
        shown.header_response.on_hover_text(&field.about);
    }
}

/// True where what is written can be left out.
fn can_go(field: &Field, value: Option<&Value>) -> bool {
    value.is_some() && (field.usual.is_some() || field.may_be_null)
}

/// Takes a value away, where the exercise needs none: then the usual counts.
fn go_ui(ui: &mut egui::Ui, page: &mut Page, pointer: &str, name: &str, field: &Field, value: Option<&Value>) {
    if !can_go(field, value) {
        return;
    }
    let about = match field.usual {
        Some(usual) => page.words.with("author.as_usual", usual),
        None => page.words.of("author.leave_out").to_string(),
    };
    let button = ui.small_button("×").on_hover_text(&about);
    button.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, format!("{name}: {about}")));
    if button.clicked() {
        page.ask(Ask::Remove(pointer.into()));
    }
}

/// A button that takes a thing away as a whole.
pub fn remove_ui(ui: &mut egui::Ui, page: &mut Page, pointer: &str, name: &str) {
    let text = page.words.of("author.remove").to_string();
    let button = ui.small_button(&text);
    button.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, format!("{text}: {name}")));
    mark(ui, format!("remove:{pointer}"), button.rect);
    if button.clicked() {
        page.ask(Ask::Remove(pointer.into()));
    }
}
