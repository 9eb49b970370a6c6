//! The briefing before an exercise: the task, the time allowed and the instruments.

use super::command::AppCommand;
use super::completion::CompletionProgress;
use super::i18n::Translations;
use super::theme;
use eframe::egui;
use typodont_exercise::scenario::{Scenario, Stage};
use typodont_lesson as lesson;

/// Draws the exercise's instructions, and the field for the participant code.
pub fn briefing_ui(
    ui: &mut egui::Ui,
    scenario: &Scenario,
    participant: &mut String,
    completion: Option<CompletionProgress>,
    words: &Translations,
    commands: &mut Vec<AppCommand>,
) {
    theme::centered_column(ui, |ui| {
        ui.heading(words.own(&scenario.texts, &scenario.title));
        ui.label(words.own(&scenario.texts, &scenario.summary));
        ui.add_space(16.0);
        let room = (ui.available_height() - if completion.is_some() { 210.0 } else { 140.0 }).max(160.0);
        egui::ScrollArea::vertical().max_height(room).auto_shrink([false, true]).show(ui, |ui| {
            for (number, stage) in scenario.stages.iter().enumerate() {
                stage_ui(ui, scenario, stage, number + 1, words);
            }
        });
        ui.add_space(16.0);
        ui.horizontal(|ui| {
            let label = ui.label(words.get("briefing.participant")).id;
            let edit = egui::TextEdit::singleline(participant).char_limit(64).desired_width(180.0);
            ui.add(edit.hint_text(words.get("briefing.participant_hint"))).labelled_by(label);
        });
        if !lesson::is_valid_participant_code(participant) {
            ui.colored_label(theme::ERROR, words.get("briefing.participant_wrong"));
        }
        ui.add_space(8.0);
        if let Some(progress) = completion {
            // Drawing images takes all processors, and the next session's force would suffer.
            ui.weak(words.get("briefing.report_first"));
            theme::progress_bar(ui, words.get(progress.key), progress.share);
        }
        ui.horizontal(|ui| {
            let is_ready = completion.is_none() && lesson::is_valid_participant_code(participant);
            if ui.add_enabled(is_ready, theme::primary_button(words.get("briefing.begin"))).clicked() {
                commands.push(AppCommand::BeginLesson);
            }
            if ui.button(words.get("briefing.back")).clicked() {
                commands.push(AppCommand::BackToList);
            }
        });
    });
}

fn stage_ui(ui: &mut egui::Ui, scenario: &Scenario, stage: &Stage, number: usize, words: &Translations) {
    egui::Frame::NONE.fill(egui::Color32::WHITE).corner_radius(8).inner_margin(14).show(ui, |ui| {
        ui.set_width(ui.available_width());
        ui.label(
            egui::RichText::new(format!("{number}. {}", words.own(&scenario.texts, &stage.title))).strong().size(18.0),
        );
        ui.label(words.own(&scenario.texts, &stage.instruction));
        let title = |&i: &usize| words.own(&scenario.texts, &scenario.instruments[i].title);
        let tray: Vec<&str> = stage.instruments.iter().map(title).collect();
        ui.weak(words.format("briefing.tray", tray.join(", ")));
        if let Some(limit) = stage.time_limit {
            ui.weak(words.format("briefing.limit", super::practice::format_time(limit)));
        }
    });
    ui.add_space(6.0);
}
