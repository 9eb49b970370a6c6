//! What is wrong, said beside the field that it is about.

use super::super::look;
use super::Page;
use crate::diagnostic::Diagnostic;
use eframe::egui;

/// Complaints that are said in the person's own language, by code. The others are said as `typodont check` says them.
const SAID: [(&str, &str); 13] = [
    ("out-of-range", "said.out_of_range"),
    ("wrong-type", "said.wrong_type"),
    ("too-short", "said.too_short"),
    ("too-long", "said.too_long"),
    ("wrong-form", "said.wrong_form"),
    ("missing-key", "said.missing_key"),
    ("wrong-count", "said.wrong_count"),
    ("duplicate-id", "said.duplicate_id"),
    ("unknown-metric", "said.unknown_metric"),
    ("wrong-sum", "said.wrong_sum"),
    ("endless-stage", "said.endless_stage"),
    ("backward-rubric", "said.backward_rubric"),
    ("impossible-scene", "said.impossible_scene"),
];

/// Everything that is said about exactly this place.
pub fn said_ui(ui: &mut egui::Ui, page: &Page, pointer: &str) {
    for complaint in page.authoring.complaints.iter().filter(|c| c.path == pointer) {
        complaint_ui(ui, page, complaint);
    }
}

/// One complaint: the sentence, and on hovering what exactly was found and what would be right.
pub fn complaint_ui(ui: &mut egui::Ui, page: &Page, complaint: &Diagnostic) {
    let exact = match &complaint.help {
        Some(help) => format!("{} — {help}", complaint.message),
        None => complaint.message.clone(),
    };
    let known = SAID.iter().find(|(code, _)| *code == complaint.code);
    // English is what the checker speaks: its own sentence names the very value.
    let text = match known {
        Some((_, key)) if page.words.code != "en" => page.words.of(key).to_string(),
        _ => exact.clone(),
    };
    let label = egui::Label::new(egui::RichText::new(format!("! {text}")).color(look::WRONG).size(14.0)).wrap();
    ui.add(label).on_hover_text(exact);
}

/// How many complaints are about something below a pointer, or the pointer itself.
pub fn count_below(page: &Page, pointer: &str) -> usize {
    let is_below = |path: &str| path == pointer || path.strip_prefix(pointer).is_some_and(|rest| rest.starts_with('/'));
    page.authoring.complaints.iter().filter(|c| is_below(&c.path)).count()
}
