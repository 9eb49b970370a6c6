//! The parts of an exercise, as a person goes through them, and the fields of each.

use super::super::look;
use super::field::{field_ui, last, rest_ui};
use super::labels::label;
use super::marks::mark;
use super::said::{count_below, said_ui};
use super::{Ask, Page, chart, decay, list, rubric, text, tissues, tray};
use crate::content::pointer::under;
use eframe::egui;
use serde_json::{Value, json};

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Part {
    Exercise,
    Tooth,
    Decay,
    Tissues,
    Instruments,
    Stages,
    Zones,
    Marks,
    Text,
}

const PARTS: [(Part, &str); 9] = [
    (Part::Exercise, "author.part_exercise"),
    (Part::Tooth, "author.part_tooth"),
    (Part::Decay, "author.part_decay"),
    (Part::Tissues, "author.part_tissues"),
    (Part::Instruments, "author.part_instruments"),
    (Part::Stages, "author.part_stages"),
    (Part::Zones, "author.part_zones"),
    (Part::Marks, "author.part_marks"),
    (Part::Text, "author.part_text"),
];

/// Keys of the whole that have a part of their own; every other one is in the first.
const PLACED: [&str; 15] = [
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
];

impl Part {
    /// Where something at a pointer is shown.
    pub fn of(pointer: &str) -> Part {
        let is_in = |name: &str| pointer.contains(name);
        match pointer.split('/').nth(1).unwrap_or_default() {
            "scene" if is_in("/decay") || is_in("/stains") => Part::Decay,
            "scene" => Part::Tooth,
            "tissues" | "new_tissues" | "stiffness_ratio" | "carving" | "vibration" => Part::Tissues,
            "instruments" => Part::Instruments,
            "stages" => Part::Stages,
            "zones" => Part::Zones,
            "rubric" | "measures" => Part::Marks,
            _ => Part::Exercise,
        }
    }
}

/// The list of parts, with how much is wrong in each.
pub fn parts_ui(ui: &mut egui::Ui, page: &mut Page) {
    ui.spacing_mut().item_spacing.y = 4.0;
    for (part, key) in PARTS {
        let wrong = match part {
            Part::Text => usize::from(!page.authoring.draft.is_json()),
            part => page.authoring.complaints.iter().filter(|c| Part::of(&c.path) == part).count(),
        };
        let name = page.words.of(key).to_string();
        let shown = if wrong > 0 { format!("{name}  !{wrong}") } else { name };
        let text = egui::RichText::new(&shown);
        let text = if wrong > 0 { text.color(look::WRONG).strong() } else { text };
        let is_chosen = page.authoring.part == part;
        let button = egui::Button::selectable(is_chosen, text).min_size(egui::vec2(ui.available_width(), 32.0)).wrap();
        let button = ui.add(button);
        mark(ui, format!("part:{part:?}"), button.rect);
        if button.clicked() {
            page.ask(Ask::Show(part));
        }
    }
}

/// The fields of the part that is chosen.
pub fn part_ui(ui: &mut egui::Ui, page: &mut Page) {
    let part = page.authoring.part;
    let key = PARTS.iter().find(|(own, _)| *own == part).map_or("", |(_, key)| *key);
    ui.heading(page.words.of(key));
    if page.authoring.is_watched {
        ui.colored_label(look::CARE, page.words.of("author.watched"));
    }
    if !page.authoring.draft.is_json() && part != Part::Text {
        ui.colored_label(look::WRONG, page.words.of("author.not_json"));
        if ui.button(page.words.of("author.part_text")).clicked() {
            page.ask(Ask::Show(Part::Text));
        }
        return;
    }
    match part {
        Part::Exercise => {
            said_ui(ui, page, "");
            for key in ["/title", "/summary", "/id"] {
                field_ui(ui, page, key);
            }
            rest_ui(ui, page, "", &PLACED);
        }
        Part::Tooth => tooth_ui(ui, page),
        Part::Decay => decay::decay_ui(ui, page),
        Part::Tissues => tissues::tissues_ui(ui, page),
        Part::Instruments => {
            ui.add(egui::Label::new(page.words.of("author.tray_about")).wrap());
            tray::tray_ui(ui, page, "/instruments");
            said_ui(ui, page, "/instruments");
        }
        Part::Stages => entries_ui(ui, page, "/stages"),
        Part::Zones => {
            ui.add(egui::Label::new(page.words.of("author.zones_about")).wrap());
            entries_ui(ui, page, "/zones");
        }
        Part::Marks => rubric::rubric_ui(ui, page),
        Part::Text => text::text_ui(ui, page),
    }
}

fn entries_ui(ui: &mut egui::Ui, page: &mut Page, pointer: &str) {
    list::entries_ui(ui, page, pointer);
    said_ui(ui, page, pointer);
    let name = label(page.words, last(pointer));
    list::add_ui(ui, page, pointer, &name);
}

/// Which tooth, alone or not, and what it is made from.
fn tooth_ui(ui: &mut egui::Ui, page: &mut Page) {
    scene_ui(ui, page);
    let teeth = page.authoring.teeth();
    for (place, at) in teeth.iter().enumerate() {
        if teeth.len() > 1 {
            ui.add_space(8.0);
            let is_chosen = page.authoring.chosen.0 == place;
            let radio = ui.radio(is_chosen, label(page.words, last(at)));
            if radio.clicked() {
                page.ask(Ask::Choose(place, 0));
            }
            if !is_chosen {
                continue;
            }
        }
        let fdi = page.value(&under(at, "fdi")).and_then(Value::as_u64).unwrap_or_default() as u8;
        ui.add_space(6.0);
        chart::chart_ui(ui, page, fdi);
        said_ui(ui, page, &under(at, "fdi"));
        field_ui(ui, page, &under(at, "form"));
        rest_ui(ui, page, at, &["fdi", "form", "decay", "stains"]);
        said_ui(ui, page, at);
    }
    if page.value("/scene/pair").is_some() {
        field_ui(ui, page, "/scene/pair/gap_mm");
    }
    if page.value("/scene/jaw").is_some() {
        rest_ui(ui, page, "/scene/jaw", &["tooth"]);
    }
}

/// One tooth alone, in its jaw, or two beside each other. The tooth that is there stays.
fn scene_ui(ui: &mut egui::Ui, page: &mut Page) {
    let tooth = page.authoring.teeth().first().and_then(|at| page.value(at)).cloned();
    ui.horizontal_wrapped(|ui| {
        for kind in ["tooth", "jaw", "pair"] {
            let is_it = page.value(&under("/scene", kind)).is_some();
            let radio = ui.radio(is_it, label(page.words, kind));
            mark(ui, format!("scene:{kind}"), radio.rect);
            if radio.clicked()
                && !is_it
                && let Some(tooth) = tooth.clone()
            {
                page.ask(Ask::Set("/scene".into(), json!({ kind: scene_of(kind, tooth) })));
            }
        }
    });
    if count_below(page, "/scene") > 0 {
        said_ui(ui, page, "/scene");
    }
}

fn scene_of(kind: &str, mut tooth: Value) -> Value {
    match kind {
        "tooth" => tooth,
        "jaw" => json!({ "tooth": tooth, "periodontium": {} }),
        _ => {
            // The second is sound: what there is to find is in the first.
            let second = json!({ "id": "right", "fdi": tooth["fdi"], "form": tooth["form"] });
            tooth["id"] = json!("left");
            json!({ "left": tooth, "right": second })
        }
    }
}
