//! The page on which a supervisor closes a kiosk.

use crate::command::{AppCommand, TextField};
use crate::i18n::Translations;
use crate::kiosk::{KioskExit, KioskOptions};
use crate::ui::text_field::{field_id, push_typed};
use crate::ui::theme;
use eframe::egui;

/// The question for the supervisor's code.
pub fn exit_ui(
    ui: &mut egui::Ui,
    exit: &KioskExit,
    kiosk: &KioskOptions,
    words: &Translations,
    commands: &mut Vec<AppCommand>,
) {
    if kiosk.supervisor_code.is_none() {
        ui.label(words.get("kiosk.no_code"));
        if ui.button(words.get("kiosk.back")).clicked() {
            commands.push(AppCommand::AskToLeaveKiosk(false));
        }
        return;
    }
    let label = ui.label(words.get("kiosk.code")).id;
    let mut typed = exit.code.clone();
    let id = field_id(ui, TextField::SupervisorCode, &exit.code);
    let line = ui.add(egui::TextEdit::singleline(&mut typed).id(id).password(true).desired_width(220.0));
    push_typed(TextField::SupervisorCode, &exit.code, typed, commands);
    let is_entered = line.lost_focus() && ui.input(|input| input.key_pressed(egui::Key::Enter));
    if !is_entered && !line.has_focus() && exit.code.is_empty() {
        line.request_focus();
    }
    line.labelled_by(label);
    if ui.input(|input| input.key_pressed(egui::Key::Escape)) {
        commands.push(AppCommand::AskToLeaveKiosk(false));
    }
    if exit.is_wrong {
        ui.colored_label(theme::ERROR, words.get("kiosk.wrong_code"));
    }
    ui.add_space(8.0);
    ui.horizontal(|ui| {
        if ui.add(theme::primary_button(words.get("kiosk.close"))).clicked() || is_entered {
            commands.push(AppCommand::LeaveKiosk);
        }
        if ui.button(words.get("kiosk.back")).clicked() {
            commands.push(AppCommand::AskToLeaveKiosk(false));
        }
    });
}
