//! The briefing before an exercise: the task, the time allowed, the instruments and the marking scheme.

use crate::command::{AppCommand, TextField};
use crate::completion::CompletionProgress;
use crate::i18n::Translations;
use crate::ui::case_pictures::{CasePictures, thumbnails_ui};
use crate::ui::report_texts::ReportTexts;
use crate::ui::results::{CRITERIA_WIDTH, criterion_ui};
use crate::ui::text_field::{field_id, participant_field, push_typed};
use crate::ui::theme;
use crate::ui::ui_anchors;
use eframe::egui;
use typodont_exercise::scenario::{Metric, Rubric, Scenario, Stage};
use typodont_lesson as lesson;
use typodont_report::display_format::plain_number;
use typodont_report::{Message, phrases};

/// Texts typed before an exercise.
pub struct BriefingFields<'a> {
    pub participant: &'a str,
    /// True if a session needs a participant's code, as in a kiosk.
    pub is_code_required: bool,
    /// Examiner's code, empty for a session without one; `None` where the code was given at the command line.
    pub examiner_code: Option<&'a str>,
}

/// Returns true if a session with this examiner's code, which may be empty, can begin.
pub fn is_valid_examiner_code(code: &str) -> bool {
    code.is_empty() || lesson::is_long_enough(code)
}

/// Draws the exercise's instructions, and the fields for the participant code and for the examiner's code.
pub fn briefing_ui(
    ui: &mut egui::Ui,
    scenario: &Scenario,
    fields: BriefingFields,
    completion: Option<CompletionProgress>,
    pictures: &mut CasePictures,
    texts: &ReportTexts,
    commands: &mut Vec<AppCommand>,
) {
    let words = texts.words;
    let BriefingFields { participant, is_code_required, examiner_code } = fields;
    let examiner_code = examiner_code.filter(|_| lesson::is_sealable(scenario));
    theme::centered_column(ui, |ui| {
        ui.heading(words.own(&scenario.texts, &scenario.title));
        ui.label(words.own(&scenario.texts, &scenario.summary));
        ui.add_space(16.0);
        thumbnails_ui(ui, scenario, pictures, words, commands);
        let below = [(true, 140.0), (completion.is_some(), 70.0), (examiner_code.is_some(), 60.0)];
        let below: f32 = below.iter().filter(|(is_shown, _)| *is_shown).map(|(_, height)| height).sum();
        let room = (ui.available_height() - below).max(160.0);
        let area = egui::ScrollArea::vertical().id_salt(("briefing", &scenario.id));
        area.max_height(room).auto_shrink([false, true]).show(ui, |ui| {
            for (number, stage) in scenario.stages.iter().enumerate() {
                stage_ui(ui, scenario, stage, number + 1, words);
            }
            if let Some(rubric) = &scenario.rubric {
                rubric_ui(ui, scenario, rubric, texts);
            }
        });
        ui.add_space(16.0);
        ui.horizontal(|ui| {
            let label = ui.label(words.get("briefing.participant")).id;
            participant_field(ui, participant, is_code_required, label, words, commands);
        });
        if !lesson::is_valid_participant_code(participant) {
            ui.colored_label(theme::ERROR, words.get("briefing.participant_wrong"));
        }
        let is_code_missing = is_code_required && participant.is_empty();
        if is_code_missing {
            ui.label(words.get("kiosk.code_required"));
        }
        let has_valid_code = examiner_code.is_none_or(is_valid_examiner_code);
        if let Some(code) = examiner_code {
            examiner_code_ui(ui, code, words, commands);
        }
        ui.add_space(8.0);
        if let Some(progress) = completion {
            // Drawing images takes all processors, and the next session's force would suffer.
            ui.weak(words.get("briefing.report_first"));
            theme::progress_bar(ui, words.get(progress.key), progress.share);
        }
        ui.horizontal(|ui| {
            let has_participant = !is_code_missing && lesson::is_valid_participant_code(participant);
            let is_ready = completion.is_none() && has_valid_code && has_participant;
            let begin = ui.add_enabled(is_ready, theme::primary_button(words.get("briefing.begin")));
            ui_anchors::anchor(ui, "briefing.begin", begin.rect);
            if begin.clicked() {
                commands.push(AppCommand::BeginLesson);
            }
            if ui.button(words.get("briefing.back")).clicked() {
                commands.push(AppCommand::BackToList);
            }
        });
    });
}

/// Draws the field for the code that makes an examination of the session.
fn examiner_code_ui(ui: &mut egui::Ui, code: &str, words: &Translations, commands: &mut Vec<AppCommand>) {
    ui.horizontal(|ui| {
        let label = ui.label(words.get("briefing.code")).id;
        let mut typed = code.to_string();
        let id = field_id(ui, TextField::ExaminerCode, code);
        let edit = egui::TextEdit::singleline(&mut typed).id(id).password(true).char_limit(200).desired_width(180.0);
        ui.add(edit.hint_text(words.get("briefing.code_hint"))).labelled_by(label);
        push_typed(TextField::ExaminerCode, code, typed, commands);
    });
    match is_valid_examiner_code(code) {
        true => ui.weak(words.get("briefing.code_about")),
        false => ui.colored_label(theme::ERROR, words.get("briefing.code_short")),
    };
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
            ui.weak(words.format("briefing.limit", crate::ui::practice::format_time(limit)));
        }
    });
    ui.add_space(6.0);
}

/// Draws the marking scheme: each criterion with its points and the values that give all and none of them, the critical
/// errors and the pass mark.
fn rubric_ui(ui: &mut egui::Ui, scenario: &Scenario, rubric: &Rubric, texts: &ReportTexts) {
    let words = texts.words;
    egui::Frame::NONE.fill(egui::Color32::WHITE).corner_radius(8).inner_margin(14).show(ui, |ui| {
        ui.set_width(ui.available_width());
        ui.label(egui::RichText::new(words.get("briefing.marking")).strong().size(18.0));
        let width = CRITERIA_WIDTH * ui.available_width();
        egui::Grid::new("rubric").num_columns(4).spacing([24.0, 4.0]).show(ui, |ui| {
            for key in ["results.item", "results.points", "label.full_at", "label.zero_at"] {
                ui.weak(words.get(key));
            }
            ui.end_row();
            for item in &rubric.items {
                criterion_ui(
                    ui,
                    width,
                    words.own(&scenario.texts, &item.title),
                    &measure_title(scenario, &item.metric, texts),
                );
                ui.label(plain_number(item.points));
                for value in [item.full_at, item.zero_at] {
                    ui.label(texts.text(&phrases::written(&item.metric.to_string(), value)));
                }
                ui.end_row();
            }
        });
        for (index, item) in rubric.items.iter().enumerate() {
            let dependent = rubric.items.iter().filter(|other| other.counts_with == Some(index));
            let titles: Vec<&str> = dependent.map(|other| words.own(&scenario.texts, &other.title)).collect();
            if !titles.is_empty() {
                let title = words.own(&scenario.texts, &item.title);
                ui.weak(words.format_all("briefing.counts_with", &[&titles.join(", "), title]));
            }
        }
        if !rubric.hard_fails.is_empty() {
            let errors = rubric.hard_fails.iter().map(|fail| words.own(&scenario.texts, &fail.title));
            let errors = errors.collect::<Vec<_>>().join(", ");
            ui.label(words.format("briefing.critical_errors", errors));
        }
        ui.weak(words.format("results.pass_at", format!("{:.0}", rubric.pass_points)));
    });
    ui.add_space(6.0);
}

/// Title of a measure, with that of its zone.
fn measure_title(scenario: &Scenario, metric: &Metric, texts: &ReportTexts) -> String {
    let zone_title = |id: &str| {
        let zone = scenario.zones.iter().find(|zone| zone.id == id)?;
        Some(Message::plain(texts.words.own(&scenario.texts, &zone.title)))
    };
    texts.text(&phrases::measure_of_zone(metric, zone_title))
}
