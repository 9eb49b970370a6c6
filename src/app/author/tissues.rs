//! How the tissues feel: the table's numbers, and what this exercise changes of them.

use super::field::{field_ui, named_field_ui};
use super::labels::label;
use super::said::{count_below, said_ui};
use super::{Ask, Page};
use crate::author::Field;
use crate::content::TissueEntry;
use crate::content::pointer::under;
use eframe::egui;
use serde_json::{Value, json};

/// Coefficients in the order of the table, with what the table says.
fn coefficients(entry: &TissueEntry) -> [(&'static str, Option<f32>); 6] {
    [
        ("stiffness", Some(entry.stiffness)),
        ("damping", Some(entry.damping)),
        ("static_friction", Some(entry.static_friction)),
        ("dynamic_friction", Some(entry.dynamic_friction)),
        ("cut_force_n", entry.cut_force_n),
        ("hardness_hv", entry.hardness_hv),
    ]
}

pub fn tissues_ui(ui: &mut egui::Ui, page: &mut Page) {
    ui.add(egui::Label::new(page.words.of("author.tissues_about")).wrap());
    ui.add_space(6.0);
    let authoring = page.authoring;
    for entry in &authoring.tissues {
        tissue_ui(ui, page, entry);
    }
    ui.add_space(10.0);
    for key in ["/stiffness_ratio", "/carving", "/vibration", "/new_tissues"] {
        field_ui(ui, page, key);
    }
}

fn tissue_ui(ui: &mut egui::Ui, page: &mut Page, entry: &TissueEntry) {
    let at = under("/tissues", &entry.name);
    let changed = page.value(&at).and_then(Value::as_object).map_or(0, |map| map.len());
    let is_wrong = count_below(page, &at) > 0;
    let title = match changed {
        0 => entry.title.clone(),
        count => format!("{} · {}", entry.title, page.words.with("author.changed", count)),
    };
    let header = egui::CollapsingHeader::new(title).id_salt(&at).default_open(changed > 0 || is_wrong);
    header.show(ui, |ui| {
        for (key, of_table) in coefficients(entry) {
            let pointer = under(&at, key);
            let Some(schema) = page.authoring.form.at(&pointer) else { continue };
            // A single's digits, not those of the double it becomes.
            let usual = of_table.map(|number| json!((f64::from(number) * 1e4).round() / 1e4));
            let Some(usual) = usual else { continue };
            let field = page.authoring.form.field(schema);
            let field = Field { usual: Some(&usual), may_be_null: false, ..field };
            named_field_ui(ui, page, &pointer, &label(page.words, key), &field);
        }
        if changed > 0 && ui.small_button(page.words.of("author.as_table")).clicked() {
            page.ask(Ask::Remove(at.clone()));
        }
    });
    said_ui(ui, page, &at);
}
