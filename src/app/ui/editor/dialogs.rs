//! Dialogs of the author's screen: questions before any work is lost, and the results of a check.

use crate::command::AppCommand;
use crate::editor::EditorCommand;
use crate::editor::EditorSection;
use crate::editor::{Dialog, EditorState};
use crate::i18n::Translations;
use crate::ui::editor::FormContext;
use crate::ui::editor::diagnostics::diagnostic_ui;
use crate::ui::theme;
use crate::ui::ui_anchors::anchor;
use eframe::egui;
use std::path::PathBuf;

pub fn dialog_ui(ctx: &egui::Context, editor: &EditorState, words: &Translations, commands: &mut Vec<AppCommand>) {
    let Some(dialog) = &editor.dialog else { return };
    let title = match dialog {
        Dialog::SaveAs(_) => "author.save_as",
        Dialog::ConfirmOverwrite(_) => "author.over_title",
        Dialog::FileChanged(_) => "author.changed_title",
        Dialog::CheckResults => "author.check",
    };
    let room = ctx.content_rect().size();
    let frame = egui::Frame::popup(&ctx.global_style()).inner_margin(20);
    egui::Modal::new(egui::Id::unique("author asking")).frame(frame).show(ctx, |ui| {
        ui.set_width((room.x - 120.0).clamp(240.0, 620.0));
        ui.heading(words.get(title));
        ui.add_space(8.0);
        // Without the second bound the area would keep the height of its first pass, and hide the buttons.
        let height = (room.y - 200.0).max(140.0);
        let scroll = egui::ScrollArea::vertical().max_height(height).min_scrolled_height(height);
        scroll.show(ui, |ui| match dialog {
            Dialog::SaveAs(path) => save_as_ui(ui, path, words, commands),
            Dialog::ConfirmOverwrite(path) => {
                ui.add(egui::Label::new(words.format("author.over", path.display())).wrap());
                let over = (words.get("author.over_yes"), "over", EditorCommand::SaveOverExisting(path.clone()));
                let other = (words.get("author.save_as"), "other", EditorCommand::ShowSaveAs(true));
                answers_ui(
                    ui,
                    [over, other, (words.get("author.cancel"), "cancel", EditorCommand::ShowSaveAs(false))],
                    commands,
                );
            }
            Dialog::FileChanged(_) => {
                ui.add(egui::Label::new(words.get("author.changed_by_other")).wrap());
                let theirs = (words.get("author.take_theirs"), "theirs", EditorCommand::ReloadFromDisk);
                answers_ui(ui, [theirs, (words.get("author.keep_mine"), "mine", EditorCommand::KeepLocal)], commands);
            }
            Dialog::CheckResults => check_results_ui(ui, &mut FormContext { editor, words, commands }),
        });
    });
}

fn answers_ui<const N: usize>(
    ui: &mut egui::Ui,
    answers: [(&str, &str, EditorCommand); N],
    commands: &mut Vec<AppCommand>,
) {
    ui.add_space(8.0);
    ui.horizontal_wrapped(|ui| {
        for (text, name, command) in answers {
            let button = ui.button(text);
            anchor(ui, format!("answer:{name}"), button.rect);
            if button.clicked() {
                commands.push(AppCommand::Editor(command));
            }
        }
    });
}

fn save_as_ui(ui: &mut egui::Ui, path: &str, words: &Translations, commands: &mut Vec<AppCommand>) {
    let named = ui.label(words.get("author.where")).id;
    let mut typed = path.to_string();
    let line = ui.add(egui::TextEdit::singleline(&mut typed).desired_width(f32::INFINITY)).labelled_by(named);
    if typed != path {
        commands.push(AppCommand::Editor(EditorCommand::TypePath(typed.clone())));
    }
    focus_at_first(ui, &line);
    let path = typed.trim();
    anchor(ui, "where", line.rect);
    let is_entered = line.lost_focus() && ui.input(|input| input.key_pressed(egui::Key::Enter));
    let is_json = path.ends_with(".json");
    if !is_json {
        ui.colored_label(theme::ERROR, words.get("author.where_json"));
    }
    ui.add_space(8.0);
    ui.horizontal_wrapped(|ui| {
        let save = ui.add_enabled(is_json, egui::Button::new(words.get("author.save")));
        anchor(ui, "answer:save", save.rect);
        if save.clicked() || (is_entered && is_json) {
            commands.push(AppCommand::Editor(EditorCommand::SaveAs(PathBuf::from(path))));
        }
        if ui.button(words.get("author.cancel")).clicked() {
            commands.push(AppCommand::Editor(EditorCommand::ShowSaveAs(false)));
        }
    });
}

/// Moves the focus to a field in the first pass in which it is shown.
fn focus_at_first(ui: &egui::Ui, field: &egui::Response) {
    let pass = ui.ctx().cumulative_pass_nr();
    let shown_in = ui.data_mut(|data| std::mem::replace(data.get_temp_mut_or(field.id, 0), pass));
    if shown_in + 1 < pass {
        field.request_focus();
    }
}

/// Every complaint, with the section in which it can be corrected.
fn check_results_ui(ui: &mut egui::Ui, form: &mut FormContext) {
    let editor = form.editor;
    if !editor.is_checked {
        ui.label(form.words.get("author.checking"));
        theme::progress_dots(ui);
    } else if editor.complaints.is_empty() {
        ui.colored_label(theme::SUCCESS, form.words.get("author.nothing_wrong"));
    }
    for complaint in &editor.complaints {
        let line = complaint.line_and_column().map_or(String::new(), |(line, _)| format!("{line}: "));
        ui.horizontal_wrapped(|ui| {
            ui.strong(format!("{line}{}", complaint.path));
            if ui.small_button(form.words.get("author.show")).clicked() {
                let part = if editor.draft.is_json() {
                    EditorSection::of_pointer(&complaint.path)
                } else {
                    EditorSection::Text
                };
                form.send(EditorCommand::ShowSection(part));
                form.send(EditorCommand::CloseCheck);
            }
        });
        diagnostic_ui(ui, form, complaint);
    }
    let answer = (form.words.get("settings.close"), "close", EditorCommand::CloseCheck);
    answers_ui(ui, [answer], form.commands);
}
