//! The sections of an exercise in the order in which an author completes them, and the fields of each.

use crate::editor::{ARCH_TEETH, EditorCommand, EditorSection};
use crate::ui::editor::diagnostics::{count_below, diagnostics_ui};
use crate::ui::editor::field::{field_ui, remaining_fields_ui};
use crate::ui::editor::field_parts::{last_segment, remove_ui};
use crate::ui::editor::labels::label;
use crate::ui::editor::{FormContext, decay, instruments_field, list, rubric, source_view, tissues, tooth_chart};
use crate::ui::theme;
use crate::ui::ui_anchors::anchor;
use eframe::egui;
use serde_json::{Value, json};
use typodont_author::ARCH_SPACING_MM;
use typodont_formats::pointer::child;

const SECTIONS: [(EditorSection, &str); 9] = [
    (EditorSection::Exercise, "author.part_exercise"),
    (EditorSection::Tooth, "author.part_tooth"),
    (EditorSection::Decay, "author.part_decay"),
    (EditorSection::Tissues, "author.part_tissues"),
    (EditorSection::Instruments, "author.part_instruments"),
    (EditorSection::Stages, "author.part_stages"),
    (EditorSection::Zones, "author.part_zones"),
    (EditorSection::Marks, "author.part_marks"),
    (EditorSection::Text, "author.part_text"),
];

/// Number of teeth that an arch can list.
const ARCH_TEETH_MAX: usize = 16;

/// Top-level keys that are shown in a section of their own; all others are in the first section.
const KEYS_WITH_SECTION: [&str; 16] = [
    "$schema",
    "id",
    "title",
    "summary",
    "scene",
    "tissues",
    "new_tissues",
    "stiffness_ratio",
    "carving",
    "vibration",
    "instruments",
    "stages",
    "zones",
    "rubric",
    "measures",
    "limits",
];

/// The list of sections, with the number of complaints in each.
pub fn sections_ui(ui: &mut egui::Ui, form: &mut FormContext) {
    ui.spacing_mut().item_spacing.y = 4.0;
    for (part, key) in SECTIONS {
        let wrong = match part {
            EditorSection::Text => usize::from(!form.editor.draft.is_json()),
            part => form.editor.complaints.iter().filter(|c| EditorSection::of_pointer(&c.path) == part).count(),
        };
        let name = form.words.get(key).to_string();
        let shown = if wrong > 0 { format!("{name}  !{wrong}") } else { name };
        let text = egui::RichText::new(&shown);
        let text = if wrong > 0 { text.color(theme::ERROR).strong() } else { text };
        let is_chosen = form.editor.section == part;
        let button = egui::Button::selectable(is_chosen, text).min_size(egui::vec2(ui.available_width(), 32.0)).wrap();
        let button = ui.add(button);
        anchor(ui, format!("part:{part:?}"), button.rect);
        if button.clicked() {
            form.send(EditorCommand::ShowSection(part));
        }
    }
}

/// The fields of the selected section.
pub fn section_ui(ui: &mut egui::Ui, form: &mut FormContext) {
    let section = form.editor.section;
    let key = SECTIONS.iter().find(|(own, _)| *own == section).map_or("", |(_, key)| *key);
    ui.heading(form.words.get(key));
    if form.editor.is_read_only {
        ui.colored_label(theme::WARNING, form.words.get("author.watched"));
    }
    if !form.editor.draft.is_json() && section != EditorSection::Text {
        ui.colored_label(theme::ERROR, form.words.get("author.not_json"));
        if ui.button(form.words.get("author.part_text")).clicked() {
            form.send(EditorCommand::ShowSection(EditorSection::Text));
        }
        return;
    }
    match section {
        EditorSection::Exercise => {
            diagnostics_ui(ui, form, "");
            for key in ["/title", "/summary", "/id"] {
                field_ui(ui, form, key);
            }
            remaining_fields_ui(ui, form, "", &KEYS_WITH_SECTION);
        }
        EditorSection::Tooth => tooth_ui(ui, form),
        EditorSection::Decay => decay::decay_ui(ui, form),
        EditorSection::Tissues => tissues::tissues_ui(ui, form),
        EditorSection::Instruments => {
            ui.add(egui::Label::new(form.words.get("author.tray_about")).wrap());
            instruments_field::instruments_ui(ui, form, "/instruments");
            diagnostics_ui(ui, form, "/instruments");
        }
        EditorSection::Stages => entries_ui(ui, form, "/stages"),
        EditorSection::Zones => {
            ui.add(egui::Label::new(form.words.get("author.zones_about")).wrap());
            entries_ui(ui, form, "/zones");
            ui.add_space(8.0);
            field_ui(ui, form, "/limits");
        }
        EditorSection::Marks => rubric::rubric_ui(ui, form),
        EditorSection::Text => source_view::source_ui(ui, form),
    }
}

fn entries_ui(ui: &mut egui::Ui, form: &mut FormContext, pointer: &str) {
    list::entries_ui(ui, form, pointer);
    diagnostics_ui(ui, form, pointer);
    let name = label(form.words, last_segment(pointer));
    list::add_ui(ui, form, pointer, &name);
}

/// Fields of the tooth: its number, its surroundings and its source.
fn tooth_ui(ui: &mut egui::Ui, form: &mut FormContext) {
    scene_ui(ui, form);
    let teeth = form.editor.tooth_pointers();
    for (place, at) in teeth.iter().enumerate() {
        if teeth.len() > 1 {
            ui.add_space(8.0);
            let is_chosen = form.editor.selected_decay.0 == place;
            let radio = ui.radio(is_chosen, tooth_name(form, at));
            if radio.clicked() {
                form.send(EditorCommand::SelectDecay(place, 0));
            }
            if !is_chosen {
                continue;
            }
            if at.starts_with(ARCH_TEETH) {
                remove_ui(ui, form, at, &tooth_name(form, at));
            }
        }
        let fdi = form.value(&child(at, "fdi")).and_then(Value::as_u64).unwrap_or_default() as u8;
        ui.add_space(6.0);
        tooth_chart::tooth_chart_ui(ui, form, fdi);
        diagnostics_ui(ui, form, &child(at, "fdi"));
        field_ui(ui, form, &child(at, "form"));
        remaining_fields_ui(ui, form, at, &["fdi", "form", "decay", "stains"]);
        diagnostics_ui(ui, form, at);
    }
    if form.value("/scene/pair").is_some() {
        field_ui(ui, form, "/scene/pair/gap_mm");
    }
    if form.value("/scene/jaw").is_some() {
        remaining_fields_ui(ui, form, "/scene/jaw", &["tooth"]);
    }
    if form.value("/scene/dental_arch").is_some() {
        if teeth.len() < ARCH_TEETH_MAX {
            list::add_ui(ui, form, ARCH_TEETH, &label(form.words, "tooth"));
        }
        remaining_fields_ui(ui, form, "/scene/dental_arch", &["teeth"]);
    }
}

/// Name of one of several teeth: its side or, in an arch, its number.
pub fn tooth_name(form: &FormContext, at: &str) -> String {
    match form.value(&child(at, "fdi")) {
        Some(fdi) if at.starts_with(ARCH_TEETH) => format!("{} {fdi}", label(form.words, "tooth")),
        _ => label(form.words, last_segment(at)),
    }
}

/// Choice between one tooth alone, one in its jaw, two beside each other, and a whole arch. The first tooth is kept.
fn scene_ui(ui: &mut egui::Ui, form: &mut FormContext) {
    let tooth = form.editor.tooth_pointers().first().and_then(|at| form.value(at)).cloned();
    ui.horizontal_wrapped(|ui| {
        for kind in ["tooth", "jaw", "pair", "dental_arch"] {
            let is_it = form.value(&child("/scene", kind)).is_some();
            let radio = ui.radio(is_it, label(form.words, kind));
            anchor(ui, format!("scene:{kind}"), radio.rect);
            if radio.clicked()
                && !is_it
                && let Some(tooth) = tooth.clone()
            {
                form.send(EditorCommand::SetValue("/scene".into(), json!({ kind: scene_value(kind, tooth) })));
            }
        }
    });
    if count_below(form, "/scene") > 0 {
        diagnostics_ui(ui, form, "/scene");
    }
}

fn scene_value(kind: &str, mut tooth: Value) -> Value {
    match kind {
        "tooth" => tooth,
        "jaw" => json!({ "tooth": tooth, "periodontium": {} }),
        "dental_arch" => {
            if let Some(spacing) = tooth.pointer_mut("/form/procedural/spacing_mm") {
                *spacing = json!(ARCH_SPACING_MM);
            }
            json!({ "teeth": [tooth], "spacing_mm": ARCH_SPACING_MM })
        }
        _ => {
            // The second tooth is sound: the decay to be found is in the first.
            let second = json!({ "id": "right", "fdi": tooth["fdi"], "form": tooth["form"] });
            tooth["id"] = json!("left");
            json!({ "left": tooth, "right": second })
        }
    }
}
