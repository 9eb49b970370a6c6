//! Complaints about the exercise, each shown beside the field that it concerns.

use crate::ui::editor::FormContext;
use crate::ui::theme;
use eframe::egui;
use typodont_formats::diagnostic::Diagnostic;

/// Complaints that are shown in the user's language, by code. The others are shown in the wording of `typodont check`.
const LOCALIZED_MESSAGES: [(&str, &str); 13] = [
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

/// All complaints about exactly this JSON pointer.
pub fn diagnostics_ui(ui: &mut egui::Ui, form: &FormContext, pointer: &str) {
    for complaint in form.editor.complaints.iter().filter(|c| c.path == pointer) {
        diagnostic_ui(ui, form, complaint);
    }
}

/// One complaint; hovering shows the exact finding and the remedy.
pub fn diagnostic_ui(ui: &mut egui::Ui, form: &FormContext, complaint: &Diagnostic) {
    let exact = match &complaint.help {
        Some(help) => format!("{} — {help}", complaint.message),
        None => complaint.message.clone(),
    };
    let known = LOCALIZED_MESSAGES.iter().find(|(code, _)| *code == complaint.code);
    // The checker writes English, and its own sentence names the value: in English that sentence is shown.
    let text = match known {
        Some((_, key)) if form.words.code != "en" => form.words.get(key).to_string(),
        _ => exact.clone(),
    };
    let label = egui::Label::new(egui::RichText::new(format!("! {text}")).color(theme::ERROR).size(14.0)).wrap();
    ui.add(label).on_hover_text(exact);
}

/// Number of complaints about a JSON pointer or anything below it.
pub fn count_below(form: &FormContext, pointer: &str) -> usize {
    let is_below = |path: &str| path == pointer || path.strip_prefix(pointer).is_some_and(|rest| rest.starts_with('/'));
    form.editor.complaints.iter().filter(|c| is_below(&c.path)).count()
}
