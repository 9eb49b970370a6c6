//! The marks: what earns points, what fails outright, and the sum.

use super::super::look;
use super::field::{drag_ui, field_ui, group_ui, name_ui};
use super::labels::label;
use super::list::{add_ui, entries_ui, entry_ui};
use super::marks::mark;
use super::said::said_ui;
use super::{Ask, Page};
use crate::content::pointer::under;
use crate::scenario::{Metric, metric::Better};
use eframe::egui;
use serde_json::Value;

/// All the points there are.
const ALL: f64 = 100.0;

pub fn rubric_ui(ui: &mut egui::Ui, page: &mut Page) {
    let authoring = page.authoring;
    let Some(schema) = authoring.form.at("/rubric") else { return };
    let field = authoring.form.field(schema);
    let name = label(page.words, "rubric");
    group_ui(ui, page, "/rubric", &name, &field, |ui, page| {
        field_ui(ui, page, "/rubric/pass_points");
        items_ui(ui, page);
        ui.add_space(10.0);
        fails_ui(ui, page);
    });
    said_ui(ui, page, "/rubric");
    ui.add_space(10.0);
    field_ui(ui, page, "/measures");
}

fn items_ui(ui: &mut egui::Ui, page: &mut Page) {
    let list = "/rubric/items";
    let items = page.value(list).and_then(Value::as_array);
    let count = items.map_or(0, Vec::len);
    let sum: f64 = items.into_iter().flatten().filter_map(|item| item.get("points")?.as_f64()).sum();
    ui.add_space(6.0);
    ui.horizontal_wrapped(|ui| {
        ui.strong(label(page.words, "items"));
        let ink = if sum == ALL { look::GOOD } else { look::WRONG };
        ui.colored_label(ink, format!("{} / {ALL}", (sum * 100.0).round() / 100.0));
    });
    said_ui(ui, page, list);
    for place in 0..count {
        entry_ui(ui, page, list, place, count, |ui, page| item_ui(ui, page, &under(list, place)));
    }
    let name = label(page.words, "items");
    add_ui(ui, page, list, &name);
}

/// Title and measure, then the three numbers of the line beside each other.
fn item_ui(ui: &mut egui::Ui, page: &mut Page, at: &str) {
    field_ui(ui, page, &under(at, "title"));
    field_ui(ui, page, &under(at, "metric"));
    let written = page.value(&under(at, "metric")).and_then(Value::as_str).unwrap_or_default();
    let metric = Metric::parse(written).ok();
    let unit = metric.as_ref().map_or("", |m| m.about.unit);
    egui::Grid::new(at).num_columns(3).spacing([16.0, 2.0]).show(ui, |ui| {
        let keys = ["points", "full_at", "zero_at"];
        let names = keys.map(|key| name_ui(ui, &label(page.words, key), "").id);
        ui.end_row();
        for (key, name) in keys.into_iter().zip(names) {
            let pointer = under(at, key);
            let authoring = page.authoring;
            let Some(schema) = authoring.form.at(&pointer) else { continue };
            let field = authoring.form.field(schema);
            let now = page.value(&pointer).and_then(Value::as_f64).unwrap_or_default();
            ui.horizontal(|ui| {
                let drag = drag_ui(ui, &pointer, &field, now, false).labelled_by(name);
                mark(ui, pointer.as_str(), drag.response.rect);
                if let Some(new) = drag.changed {
                    page.ask(Ask::Set(pointer.clone(), new));
                }
                if key != "points" {
                    ui.weak(unit);
                }
            });
        }
        ui.end_row();
    });
    if let Some(metric) = metric {
        let key = match metric.about.better {
            Better::Higher => "author.more_is_better",
            Better::Lower => "author.less_is_better",
            Better::Neither => "author.neither_is_better",
        };
        ui.weak(page.words.of(key));
    }
    for key in ["points", "full_at", "zero_at"] {
        said_ui(ui, page, &under(at, key));
    }
}

fn fails_ui(ui: &mut egui::Ui, page: &mut Page) {
    let list = "/rubric/hard_fails";
    let name = label(page.words, "hard_fails");
    name_ui(ui, &name, "");
    said_ui(ui, page, list);
    entries_ui(ui, page, list);
    add_ui(ui, page, list, &name);
}
