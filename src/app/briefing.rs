//! Before an exercise: what is asked, in how much time, and with what.

use super::command::Command;
use super::language::Words;
use super::look;
use crate::lesson;
use crate::scenario::{Scenario, Stage};
use eframe::egui;

/// The exercise's instructions, and whose work it will be.
pub fn briefing_ui(
    ui: &mut egui::Ui,
    scenario: &Scenario,
    participant: &mut String,
    words: &Words,
    asked: &mut Vec<Command>,
) {
    look::column(ui, |ui| {
        ui.heading(&scenario.title);
        ui.label(&scenario.summary);
        ui.add_space(16.0);
        let room = (ui.available_height() - 140.0).max(160.0);
        egui::ScrollArea::vertical().max_height(room).auto_shrink([false, true]).show(ui, |ui| {
            for (number, stage) in scenario.stages.iter().enumerate() {
                stage_ui(ui, scenario, stage, number + 1, words);
            }
        });
        ui.add_space(16.0);
        ui.horizontal(|ui| {
            let label = ui.label(words.of("briefing.participant")).id;
            let edit = egui::TextEdit::singleline(participant).char_limit(64).desired_width(180.0);
            ui.add(edit.hint_text(words.of("briefing.participant_hint"))).labelled_by(label);
        });
        if !lesson::is_code(participant) {
            ui.colored_label(look::WRONG, words.of("briefing.participant_wrong"));
        }
        ui.add_space(8.0);
        ui.horizontal(|ui| {
            if ui.add_enabled(lesson::is_code(participant), look::main_button(words.of("briefing.begin"))).clicked() {
                asked.push(Command::Begin);
            }
            if ui.button(words.of("briefing.back")).clicked() {
                asked.push(Command::ToShelf);
            }
        });
    });
}

fn stage_ui(ui: &mut egui::Ui, scenario: &Scenario, stage: &Stage, number: usize, words: &Words) {
    egui::Frame::NONE.fill(egui::Color32::WHITE).corner_radius(8).inner_margin(14).show(ui, |ui| {
        ui.set_width(ui.available_width());
        ui.label(egui::RichText::new(format!("{number}. {}", stage.title)).strong().size(18.0));
        ui.label(&stage.instruction);
        let tray: Vec<&str> = stage.instruments.iter().map(|&i| scenario.instruments[i].title.as_str()).collect();
        ui.weak(words.with("briefing.tray", tray.join(", ")));
        if let Some(limit) = stage.time_limit {
            ui.weak(words.with("briefing.limit", super::practice::clock(limit)));
        }
    });
    ui.add_space(6.0);
}
