//! Fields with a fixed choice: words of the schema, variants with fields of their own, and names from the exercise or
//! its tables.

use crate::editor::EditorCommand;
use crate::ui::editor::FormContext;
use crate::ui::editor::field::{drag_ui, field_ui, named_field_ui};
use crate::ui::editor::field_parts::{last_segment, name_ui};
use crate::ui::editor::labels::label;
use crate::ui::ui_anchors::anchor;
use eframe::egui;
use serde_json::{Value, json};
use typodont_author::{FieldKind, SchemaField, SchemaVariant, default_variant};
use typodont_exercise::scenario::{Metric, metric};
use typodont_formats::pointer::child;

/// A name that can be chosen, with its meaning.
pub struct NamedChoice {
    pub name: String,
    pub title: String,
    pub description: String,
}

/// The names from which a text field is chosen; `None` if any text is allowed.
pub fn named_choices(form: &FormContext, pointer: &str) -> Option<Vec<NamedChoice>> {
    let editor = form.editor;
    let plain = |names: Vec<String>| {
        names.into_iter().map(|name| NamedChoice { title: name.clone(), name, description: String::new() }).collect()
    };
    let decay = || {
        let teeth = editor.tooth_pointers();
        editor.ids(&teeth.iter().map(|tooth| format!("{tooth}/decay")).collect::<Vec<_>>())
    };
    match last_segment(pointer) {
        "tissue" | "of" | "to" => Some(
            editor
                .tissue_names()
                .into_iter()
                .map(|(name, title)| NamedChoice { description: name.clone(), name, title })
                .collect(),
        ),
        "zone" => Some(plain(editor.ids(&["/zones".to_string()]))),
        "metric" => Some(metric_choices(form)),
        "counts_with" => Some(other_item_choices(form, pointer)),
        "tooth_with" | "quadrant_of" => Some(plain(editor.draw_ids().into_iter().chain(decay()).collect())),
        _ if is_entry_of(pointer, "one_of") => Some(plain(decay())),
        "questionnaire" => Some(plain(editor.questionnaires.clone())),
        "correct" => {
            let (choice, _) = pointer.rsplit_once('/')?;
            Some(plain(editor.ids(&[format!("{choice}/options")])))
        }
        _ if is_entry_of(pointer, "instruments") => Some(
            editor
                .instruments
                .iter()
                .map(|e| NamedChoice { name: e.id.clone(), title: e.title.to_string(), description: e.id.clone() })
                .collect(),
        ),
        _ => None,
    }
}

fn is_entry_of(pointer: &str, list: &str) -> bool {
    pointer.rsplit_once('/').is_some_and(|(above, _)| last_segment(above) == list)
}

/// Metrics of the other items of the rubric, with the titles of these items.
fn other_item_choices(form: &FormContext, pointer: &str) -> Vec<NamedChoice> {
    let items = form.value("/rubric/items").and_then(Value::as_array);
    let own = pointer.strip_prefix("/rubric/items/").and_then(|rest| rest.split('/').next()?.parse::<usize>().ok());
    let others = items
        .into_iter()
        .flatten()
        .enumerate()
        .filter(|(index, item)| Some(*index) != own && item.get("counts_with").is_none_or(Value::is_null));
    let text = |item: &Value, key: &str| item.get(key).and_then(Value::as_str).unwrap_or_default().to_string();
    others
        .map(|(_, item)| NamedChoice {
            name: text(item, "metric"),
            title: text(item, "title"),
            description: String::new(),
        })
        .collect()
}

/// All metrics; those with an argument are listed for each zone of the exercise.
fn metric_choices(form: &FormContext) -> Vec<NamedChoice> {
    let titled = |about: &metric::MetricInfo, name: String, of: &str| {
        let unit = if about.unit.is_empty() { String::new() } else { format!(" [{}]", about.unit) };
        NamedChoice { name, title: format!("{}{of}{unit}", about.title), description: about.formula.to_string() }
    };
    let mut all: Vec<NamedChoice> =
        metric::without_argument().map(|about| titled(about, about.name.into(), "")).collect();
    for about in metric::WITH_ARGUMENT {
        match about.name {
            _ if about.takes_zone() => {
                for zone in form.editor.ids(&["/zones".to_string()]) {
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

/// A text field with a choice of known names. An unknown name is shown as it is written.
pub fn named_choice_ui(
    ui: &mut egui::Ui,
    form: &mut FormContext,
    pointer: &str,
    name: &str,
    field: &SchemaField,
    choices: &[NamedChoice],
) {
    let named = name_ui(ui, name, &field.description);
    let now = form.value(pointer).or(field.default).and_then(Value::as_str).map(str::to_string);
    let entry = now.as_ref().and_then(|now| choices.iter().find(|k| k.name == *now));
    let none = form.words.get("author.none").to_string();
    let shown = entry.map_or(now.clone().unwrap_or(none.clone()), |k| k.title.clone());
    let width = (ui.available_width() - 8.0).max(80.0);
    let combo = egui::ComboBox::from_id_salt("known").width(width).truncate().height(360.0).selected_text(shown);
    let response = combo.show_ui(ui, |ui| {
        if field.is_nullable && ui.selectable_label(now.is_none(), &none).clicked() {
            form.send(EditorCommand::RemoveValue(pointer.into()));
        }
        for k in choices {
            let option = ui.selectable_label(now.as_ref() == Some(&k.name), &k.title);
            let option = if k.description.is_empty() { option } else { option.on_hover_text(&k.description) };
            anchor(ui, format!("{pointer}={}", k.name), option.rect);
            if option.clicked() {
                form.send(EditorCommand::SetValue(pointer.into(), json!(k.name)));
            }
        }
    });
    let response = response.response.labelled_by(named.id);
    anchor(ui, pointer, response.rect);
    // The metric's own formula is shown: an author must know what the points are awarded for.
    if let Some(about) = entry.map(|k| &k.description).filter(|_| last_segment(pointer) == "metric") {
        ui.add(egui::Label::new(egui::RichText::new(about).weak().size(13.0)).wrap());
    }
}

/// A choice of variants, with the fields of the selected one.
pub fn choice_ui(
    ui: &mut egui::Ui,
    form: &mut FormContext,
    pointer: &str,
    name: &str,
    field: &SchemaField,
    variants: &[SchemaVariant],
) {
    let editor = form.editor;
    let now = form.value(pointer).or(field.default);
    let word = now.and_then(variant_name).map(str::to_string);
    let is_entry = last_segment(pointer).parse::<usize>().is_ok();
    let named = (!is_entry).then(|| name_ui(ui, name, &field.description));
    let chosen = word.as_ref().and_then(|word| variants.iter().find(|v| v.name == word));
    let shown = word.as_ref().map_or(form.words.get("author.none").to_string(), |word| label(form.words, word));
    let room = ui.available_width() - if is_entry { 130.0 } else { 8.0 };
    let combo = egui::ComboBox::from_id_salt("choice").width(room.max(80.0)).truncate().selected_text(shown);
    let response = combo.show_ui(ui, |ui| {
        for variant in variants {
            let is_it = word.as_deref() == Some(variant.name);
            let option = ui.selectable_label(is_it, label(form.words, variant.name));
            let option =
                if variant.description.is_empty() { option } else { option.on_hover_text(&variant.description) };
            anchor(ui, format!("{pointer}={}", variant.name), option.rect);
            if option.clicked() && !is_it {
                let new = default_variant(&editor.form, editor.draft.value(), pointer, variant.name, variant.schema);
                form.send(EditorCommand::SetValue(pointer.into(), new));
            }
        }
    });
    let response = match named {
        Some(named) => response.response.labelled_by(named.id),
        None => response.response.accessible_name(name),
    };
    anchor(ui, pointer, response.rect);
    if let Some((word, holds)) = chosen.and_then(|v| Some((v.name, v.schema?))) {
        variant_ui(ui, form, &child(pointer, word), holds, word);
    }
}

/// Name of a variant: the word itself, or the only key of its object.
fn variant_name(value: &Value) -> Option<&str> {
    match value {
        Value::String(word) => Some(word),
        Value::Object(map) => map.keys().next().map(String::as_str),
        _ => None,
    }
}

/// Fields of the chosen variant: its keys one below the other, or its single value.
fn variant_ui(ui: &mut egui::Ui, form: &mut FormContext, pointer: &str, schema: &Value, word: &str) {
    let editor = form.editor;
    let field = editor.form.field(schema);
    ui.indent(pointer, |ui| match &field.kind {
        FieldKind::Object(keys) => {
            for (key, ..) in keys {
                field_ui(ui, form, &child(pointer, key));
            }
            crate::ui::editor::diagnostics::diagnostics_ui(ui, form, pointer);
        }
        FieldKind::List { item: of, min: least, max: most } if Some(*least) == *most => {
            number_row_ui(ui, form, pointer, of, *least as usize)
        }
        _ => named_field_ui(ui, form, pointer, &label(form.words, word), &field),
    });
}

/// Numbers that belong together, in one row, such as a point or half axes.
pub fn number_row_ui(ui: &mut egui::Ui, form: &mut FormContext, pointer: &str, of: &Value, count: usize) {
    let editor = form.editor;
    let field = editor.form.field(of);
    ui.horizontal_wrapped(|ui| {
        for place in 0..count {
            let at = child(pointer, place);
            let now = form.value(&at).and_then(Value::as_f64).unwrap_or_default();
            let drag = drag_ui(ui, &at, &field, now, false);
            anchor(ui, at.as_str(), drag.response.rect);
            if let Some(new) = drag.changed {
                form.send(EditorCommand::SetValue(at, new));
            }
        }
    });
    for place in 0..count {
        crate::ui::editor::diagnostics::diagnostics_ui(ui, form, &child(pointer, place));
    }
}
