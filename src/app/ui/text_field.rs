//! Text fields whose texts the application keeps: it shows a text, and asks for the text that is typed.

use crate::command::{AppCommand, TextField};
use crate::i18n::Translations;
use eframe::egui;

/// Draws the field for the participant code, after its label.
pub fn participant_field(
    ui: &mut egui::Ui,
    participant: &str,
    is_required: bool,
    label: egui::Id,
    words: &Translations,
    commands: &mut Vec<AppCommand>,
) {
    let mut typed = participant.to_string();
    let id = field_id(ui, TextField::Participant, participant);
    let edit = egui::TextEdit::singleline(&mut typed).id(id).char_limit(64).desired_width(250.0);
    let hint = if is_required { "briefing.participant_hint" } else { "briefing.participant_optional" };
    ui.add(edit.hint_text(words.get(hint))).labelled_by(label);
    push_typed(TextField::Participant, participant, typed, commands);
}

/// Id of a field whose text the application keeps. While the text is empty, undoing brings nothing back: it may have been
/// a code of somebody else.
pub fn field_id(ui: &egui::Ui, field: TextField, text: &str) -> egui::Id {
    let id = egui::Id::unique(field);
    if text.is_empty()
        && let Some(mut state) = egui::TextEdit::load_state(ui.ctx(), id)
    {
        state.clear_undoer();
        state.store(ui.ctx(), id);
    }
    id
}

/// Pushes the text of a field if it has been changed.
pub fn push_typed(field: TextField, text: &str, typed: String, commands: &mut Vec<AppCommand>) {
    if typed != text {
        commands.push(AppCommand::TypeText(field, typed));
    }
}
