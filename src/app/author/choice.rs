//! One of several: words that the schema knows, shapes with fields of their own, and names that the exercise or its tables know.

use super::field::{drag_ui, field_ui, last, name_ui, named_field_ui};
use super::labels::label;
use super::marks::mark;
use super::{Ask, Page};
use crate::author::{Field, Kind, Variant, shape};
use crate::content::pointer::under;
use crate::scenario::{Metric, metric};
use eframe::egui;
use serde_json::{Value, json};

/// A name that can be chosen, and what it means.
pub struct Known {
    pub name: String,
    pub title: String,
    pub about: String,
}

/// The names among which a text is chosen; `None` where it is free.
pub fn suggestions(page: &Page, pointer: &str) -> Option<Vec<Known>> {
    let authoring = page.authoring;
    let plain = |names: Vec<String>| {
        names.into_iter().map(|name| Known { title: name.clone(), name, about: String::new() }).collect()
    };
    let teeth = authoring.teeth();
    match last(pointer) {
        "tissue" | "of" | "to" => Some(
            authoring
                .tissue_names()
                .into_iter()
                .map(|(name, title)| Known { about: name.clone(), name, title })
                .collect(),
        ),
        "metric" => Some(metrics(page)),
        "tooth_with" | "quadrant_of" => {
            Some(plain(authoring.ids(&teeth.iter().map(|tooth| format!("{tooth}/decay")).collect::<Vec<_>>())))
        }
        "questionnaire" => Some(plain(authoring.questionnaires.clone())),
        "correct" => {
            let (choice, _) = pointer.rsplit_once('/')?;
            Some(plain(authoring.ids(&[format!("{choice}/options")])))
        }
        _ if is_entry_of(pointer, "instruments") => Some(
            authoring
                .instruments
                .iter()
                .map(|e| Known { name: e.id.clone(), title: e.title.clone(), about: e.id.clone() })
                .collect(),
        ),
        _ => None,
    }
}

fn is_entry_of(pointer: &str, list: &str) -> bool {
    pointer.rsplit_once('/').is_some_and(|(above, _)| last(above) == list)
}

/// Every measure, and those with an argument for each zone of the exercise.
fn metrics(page: &Page) -> Vec<Known> {
    let titled = |about: &metric::About, name: String, of: &str| {
        let unit = if about.unit.is_empty() { String::new() } else { format!(" [{}]", about.unit) };
        Known { name, title: format!("{}{of}{unit}", about.title), about: about.formula.to_string() }
    };
    let mut all: Vec<Known> = metric::without_argument().map(|about| titled(about, about.name.into(), "")).collect();
    for about in metric::WITH_ARGUMENT {
        match about.name {
            "zone_removed_pct" => {
                for zone in page.authoring.ids(&["/zones".to_string()]) {
                    all.push(titled(about, format!("{}({zone})", about.name), &format!(": {zone}")));
                }
            }
            name => {
                let written = format!("{name}(0.3)");
                if Metric::parse(&written).is_ok() {
                    all.push(titled(about, written, " 0.3 mm"));
                }
            }
        }
    }
    all
}

/// A text that is chosen among known names. A name that is none of them is shown as it is written.
pub fn known_ui(ui: &mut egui::Ui, page: &mut Page, pointer: &str, name: &str, field: &Field, known: &[Known]) {
    let named = name_ui(ui, name, &field.about);
    let now = page.value(pointer).or(field.usual).and_then(Value::as_str).map(str::to_string);
    let entry = now.as_ref().and_then(|now| known.iter().find(|k| k.name == *now));
    let none = page.words.of("author.none").to_string();
    let shown = entry.map_or(now.clone().unwrap_or(none.clone()), |k| k.title.clone());
    let width = (ui.available_width() - 8.0).max(80.0);
    let combo = egui::ComboBox::from_id_salt("known").width(width).truncate().height(360.0).selected_text(shown);
    let response = combo.show_ui(ui, |ui| {
        if field.may_be_null && ui.selectable_label(now.is_none(), &none).clicked() {
            page.ask(Ask::Remove(pointer.into()));
        }
        for k in known {
            let option = ui.selectable_label(now.as_ref() == Some(&k.name), &k.title);
            let option = if k.about.is_empty() { option } else { option.on_hover_text(&k.about) };
            mark(ui, format!("{pointer}={}", k.name), option.rect);
            if option.clicked() {
                page.ask(Ask::Set(pointer.into(), json!(k.name)));
            }
        }
    });
    let response = response.response.labelled_by(named.id);
    mark(ui, pointer, response.rect);
    // What a measure is, in its own formula: an author must know what they reward.
    if let Some(about) = entry.map(|k| &k.about).filter(|_| last(pointer) == "metric") {
        ui.add(egui::Label::new(egui::RichText::new(about).weak().size(13.0)).wrap());
    }
}

/// One of several shapes, and the fields of the one that is chosen.
pub fn choice_ui(ui: &mut egui::Ui, page: &mut Page, pointer: &str, name: &str, field: &Field, variants: &[Variant]) {
    let authoring = page.authoring;
    let now = page.value(pointer).or(field.usual);
    let word = now.and_then(word_of).map(str::to_string);
    let is_entry = last(pointer).parse::<usize>().is_ok();
    let named = (!is_entry).then(|| name_ui(ui, name, &field.about));
    let chosen = word.as_ref().and_then(|word| variants.iter().find(|v| v.word == word));
    let shown = word.as_ref().map_or(page.words.of("author.none").to_string(), |word| label(page.words, word));
    let room = ui.available_width() - if is_entry { 130.0 } else { 8.0 };
    let combo = egui::ComboBox::from_id_salt("choice").width(room.max(80.0)).truncate().selected_text(shown);
    let response = combo.show_ui(ui, |ui| {
        for variant in variants {
            let is_it = word.as_deref() == Some(variant.word);
            let option = ui.selectable_label(is_it, label(page.words, variant.word));
            let option = if variant.about.is_empty() { option } else { option.on_hover_text(&variant.about) };
            mark(ui, format!("{pointer}={}", variant.word), option.rect);
            if option.clicked() && !is_it {
                let new = shape(&authoring.form, authoring.draft.value(), pointer, variant.word, variant.holds);
                page.ask(Ask::Set(pointer.into(), new));
            }
        }
    });
    let response = match named {
        Some(named) => response.response.labelled_by(named.id),
        None => response.response,
    };
    mark(ui, pointer, response.rect);
    if let Some((word, holds)) = chosen.and_then(|v| Some((v.word, v.holds?))) {
        held_ui(ui, page, &under(pointer, word), holds, word);
    }
}

/// The word of a shape: itself, or its only key.
fn word_of(value: &Value) -> Option<&str> {
    match value {
        Value::String(word) => Some(word),
        Value::Object(map) => map.keys().next().map(String::as_str),
        _ => None,
    }
}

/// What a shape holds: its keys one below the other, or the one value.
fn held_ui(ui: &mut egui::Ui, page: &mut Page, pointer: &str, schema: &Value, word: &str) {
    let authoring = page.authoring;
    let field = authoring.form.field(schema);
    ui.indent(pointer, |ui| match &field.kind {
        Kind::Object(keys) => {
            for (key, ..) in keys {
                field_ui(ui, page, &under(pointer, key));
            }
            super::said::said_ui(ui, page, pointer);
        }
        Kind::List { of, least, most } if Some(*least) == *most => row_ui(ui, page, pointer, of, *least as usize),
        _ => named_field_ui(ui, page, pointer, &label(page.words, word), &field),
    });
}

/// Numbers that belong together, beside each other: a point, half axes.
pub fn row_ui(ui: &mut egui::Ui, page: &mut Page, pointer: &str, of: &Value, count: usize) {
    let authoring = page.authoring;
    let field = authoring.form.field(of);
    ui.horizontal_wrapped(|ui| {
        for place in 0..count {
            let at = under(pointer, place);
            let now = page.value(&at).and_then(Value::as_f64).unwrap_or_default();
            let drag = drag_ui(ui, &at, &field, now, false);
            mark(ui, at.as_str(), drag.response.rect);
            if let Some(new) = drag.changed {
                page.ask(Ask::Set(at, new));
            }
        }
    });
    for place in 0..count {
        super::said::said_ui(ui, page, &under(pointer, place));
    }
}
