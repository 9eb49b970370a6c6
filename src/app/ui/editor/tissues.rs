//! Haptic properties of the tissues: the values of the tissue table, and the changes made by this exercise.

use crate::editor::EditorCommand;
use crate::ui::editor::FormContext;
use crate::ui::editor::diagnostics::{count_below, diagnostics_ui};
use crate::ui::editor::field::{field_ui, named_field_ui};
use crate::ui::editor::labels::label;
use eframe::egui;
use serde_json::{Value, json};
use typodont_author::SchemaField;
use typodont_exercise::catalog::TissueEntry;
use typodont_formats::pointer::child;

/// Coefficients in the order of the tissue table, with their values there.
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

pub fn tissues_ui(ui: &mut egui::Ui, form: &mut FormContext) {
    ui.add(egui::Label::new(form.words.get("author.tissues_about")).wrap());
    ui.add_space(6.0);
    let editor = form.editor;
    for entry in &editor.tissues {
        tissue_ui(ui, form, entry);
    }
    ui.add_space(10.0);
    for key in ["/stiffness_ratio", "/carving", "/vibration", "/new_tissues"] {
        field_ui(ui, form, key);
    }
}

fn tissue_ui(ui: &mut egui::Ui, form: &mut FormContext, entry: &TissueEntry) {
    let at = child("/tissues", &entry.name);
    let changed = form.value(&at).and_then(Value::as_object).map_or(0, |map| map.len());
    let is_wrong = count_below(form, &at) > 0;
    let own = entry.title.in_language(&form.words.code);
    let title = match changed {
        0 => own.to_string(),
        count => format!("{own} · {}", form.words.format("author.changed", count)),
    };
    let header = egui::CollapsingHeader::new(title).id_salt(&at).default_open(changed > 0 || is_wrong);
    header.show(ui, |ui| {
        for (key, of_table) in coefficients(entry) {
            let pointer = child(&at, key);
            let Some(schema) = form.editor.form.schema_at(&pointer) else { continue };
            // Rounded to the digits of an `f32`, without those that the conversion to `f64` adds.
            let usual = of_table.map(|number| json!((f64::from(number) * 1e4).round() / 1e4));
            let Some(usual) = usual else { continue };
            let field = form.editor.form.field(schema);
            let field = SchemaField { default: Some(&usual), is_nullable: false, ..field };
            named_field_ui(ui, form, &pointer, &label(form.words, key), &field);
        }
        if changed > 0 && ui.small_button(form.words.get("author.as_table")).clicked() {
            form.send(EditorCommand::RemoveValue(at.clone()));
        }
    });
    diagnostics_ui(ui, form, &at);
}
