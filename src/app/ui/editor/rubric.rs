//! The rubric: items with their points, critical errors, and the sum of points.

use crate::editor::EditorCommand;
use crate::ui::editor::FormContext;
use crate::ui::editor::diagnostics::diagnostics_ui;
use crate::ui::editor::field::{drag_ui, field_ui, group_ui};
use crate::ui::editor::field_parts::name_ui;
use crate::ui::editor::labels::label;
use crate::ui::editor::list::{add_ui, entries_ui, entry_ui};
use crate::ui::theme;
use crate::ui::ui_anchors::anchor;
use eframe::egui;
use serde_json::Value;
use typodont_exercise::scenario::Metric;
use typodont_exercise::scenario::metric::Better;
use typodont_formats::pointer::child;

/// Total of all points.
const ALL: f64 = 100.0;

pub fn rubric_ui(ui: &mut egui::Ui, form: &mut FormContext) {
    let editor = form.editor;
    let Some(schema) = editor.form.schema_at("/rubric") else { return };
    let field = editor.form.field(schema);
    let name = label(form.words, "rubric");
    group_ui(ui, form, "/rubric", &name, &field, |ui, form| {
        field_ui(ui, form, "/rubric/pass_points");
        items_ui(ui, form);
        ui.add_space(10.0);
        fails_ui(ui, form);
    });
    diagnostics_ui(ui, form, "/rubric");
    ui.add_space(10.0);
    field_ui(ui, form, "/measures");
}

fn items_ui(ui: &mut egui::Ui, form: &mut FormContext) {
    let list = "/rubric/items";
    let items = form.value(list).and_then(Value::as_array);
    let count = items.map_or(0, Vec::len);
    let sum: f64 = items.into_iter().flatten().filter_map(|item| item.get("points")?.as_f64()).sum();
    ui.add_space(6.0);
    ui.horizontal_wrapped(|ui| {
        ui.strong(label(form.words, "items"));
        let ink = if sum == ALL { theme::SUCCESS } else { theme::ERROR };
        ui.colored_label(ink, format!("{} / {ALL}", (sum * 100.0).round() / 100.0));
    });
    diagnostics_ui(ui, form, list);
    for place in 0..count {
        entry_ui(ui, form, list, place, count, |ui, form| item_ui(ui, form, &child(list, place)));
    }
    let name = label(form.words, "items");
    add_ui(ui, form, list, &name);
}

/// Draws an item: title and metric, then its three numbers in one row.
fn item_ui(ui: &mut egui::Ui, form: &mut FormContext, at: &str) {
    field_ui(ui, form, &child(at, "title"));
    field_ui(ui, form, &child(at, "metric"));
    let written = form.value(&child(at, "metric")).and_then(Value::as_str).unwrap_or_default();
    let metric = Metric::parse(written).ok();
    let unit = metric.as_ref().map_or("", |m| m.info.unit);
    egui::Grid::new(at).num_columns(3).spacing([16.0, 2.0]).show(ui, |ui| {
        let keys = ["points", "full_at", "zero_at"];
        let names = keys.map(|key| name_ui(ui, &label(form.words, key), "").id);
        ui.end_row();
        for (key, name) in keys.into_iter().zip(names) {
            let pointer = child(at, key);
            let editor = form.editor;
            let Some(schema) = editor.form.schema_at(&pointer) else { continue };
            let field = editor.form.field(schema);
            let now = form.value(&pointer).and_then(Value::as_f64).unwrap_or_default();
            ui.horizontal(|ui| {
                let drag = drag_ui(ui, &pointer, &field, now, false).labelled_by(name);
                anchor(ui, pointer.as_str(), drag.response.rect);
                if let Some(new) = drag.changed {
                    form.send(EditorCommand::SetValue(pointer.clone(), new));
                }
                if key != "points" {
                    ui.weak(unit);
                }
            });
        }
        ui.end_row();
    });
    if let Some(metric) = metric {
        let key = match metric.info.better {
            Better::Higher => "author.more_is_better",
            Better::Lower => "author.less_is_better",
            Better::Neither => "author.neither_is_better",
        };
        ui.weak(form.words.get(key));
    }
    field_ui(ui, form, &child(at, "counts_with"));
    for key in ["points", "full_at", "zero_at"] {
        diagnostics_ui(ui, form, &child(at, key));
    }
}

fn fails_ui(ui: &mut egui::Ui, form: &mut FormContext) {
    let list = "/rubric/hard_fails";
    let name = label(form.words, "hard_fails");
    name_ui(ui, &name, "");
    diagnostics_ui(ui, form, list);
    entries_ui(ui, form, list);
    add_ui(ui, form, list, &name);
}
