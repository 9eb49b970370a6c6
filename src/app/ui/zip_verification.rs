//! The page that verifies a result which was handed in as a ZIP file, and the way to it from the list.

use crate::command::AppCommand;
use crate::exercise_list::ExerciseList;
use crate::i18n::Translations;
use crate::platform;
use crate::ui::results;
use crate::ui::theme;
use crate::ui::ui_anchors;
use crate::zip_verification::{BundleFindings, ZipAnswer, ZipVerification};
use eframe::egui;
use typodont_report::SessionFile;
use typodont_report::bundle::VerificationOutcome;
use typodont_report::display_format::{plain_number, points};

/// Digits of an exercise's digest that are shown.
const SHOWN_DIGITS: usize = 16;

/// Maximum number of findings that are listed.
const FINDINGS_MAX: usize = 50;

/// The way to the page, below the list of exercises: a button where the browser offers its files, and a hint.
pub fn verify_button_ui(ui: &mut egui::Ui, words: &Translations, commands: &mut Vec<AppCommand>) {
    ui.horizontal_wrapped(|ui| {
        if platform::IS_PAGE {
            let button = ui.button(words.get("verify.choose"));
            ui_anchors::anchor(ui, "verify.choose", button.rect);
            if button.clicked() {
                commands.push(AppCommand::ChooseZip);
            }
        }
        ui.weak(words.get("verify.drop"));
    });
}

/// Draws the page.
pub fn zip_verification_ui(
    ui: &mut egui::Ui,
    verification: &ZipVerification,
    list: &ExerciseList,
    words: &Translations,
    commands: &mut Vec<AppCommand>,
) {
    theme::centered_column(ui, |ui| {
        ui.heading(words.get("verify.title"));
        ui.label(&verification.file_name);
        if verification.left_out > 0 {
            ui.colored_label(theme::WARNING, words.format("verify.left_out", verification.left_out));
        }
        ui.add_space(8.0);
        match &verification.answer {
            None => {
                ui.label(words.get(if platform::IS_PAGE { "verify.running_page" } else { "verify.running" }));
                theme::progress_dots(ui);
            }
            Some(answer) => answer_ui(ui, answer, list, words),
        }
        ui.add_space(16.0);
        ui.horizontal(|ui| {
            if ui.add(theme::primary_button(words.get("results.again"))).clicked() {
                commands.push(AppCommand::BackToList);
            }
        });
        if verification.answer.is_some() {
            verify_button_ui(ui, words, commands);
        }
    });
}

fn answer_ui(ui: &mut egui::Ui, answer: &ZipAnswer, list: &ExerciseList, words: &Translations) {
    match &answer.findings {
        Ok(findings) => findings_ui(ui, findings, list, words),
        Err(why) => {
            verdict_ui(ui, "verify.unreadable", theme::ERROR, words);
            ui.label(why);
        }
    }
    if let Some(digest) = &answer.sha256 {
        ui.add_space(8.0);
        ui.weak(words.get("verify.digest"));
        ui.add(egui::Label::new(egui::RichText::new(digest).monospace()).wrap());
    }
}

fn verdict_ui(ui: &mut egui::Ui, key: &str, colour: egui::Color32, words: &Translations) {
    ui.label(egui::RichText::new(words.get(key)).size(24.0).strong().color(colour));
}

fn findings_ui(ui: &mut egui::Ui, findings: &BundleFindings, list: &ExerciseList, words: &Translations) {
    let (key, about, colour) = match findings.outcome() {
        VerificationOutcome::Verified => ("verify.verified", "verify.verified_about", theme::SUCCESS),
        VerificationOutcome::PartlyVerified => ("verify.partly", "verify.partly_about", theme::WARNING),
        VerificationOutcome::Differs => ("verify.differs", "verify.differs_about", theme::ERROR),
    };
    verdict_ui(ui, key, colour, words);
    ui.label(words.get(about));
    if let Some(session) = &findings.session {
        ui.add_space(8.0);
        session_ui(ui, session, words);
        // Whoever hands in a result may have changed the exercise before.
        match list.has_same(&session.scenario.id, &session.scenario.sha256) {
            Some(true) => ui.label(words.get("verify.exercise_same")),
            Some(false) => ui.colored_label(theme::WARNING, words.get("verify.exercise_other")),
            None => ui.colored_label(theme::WARNING, words.get("verify.exercise_unknown")),
        };
    }
    let count = findings.lines().count();
    if count > 0 {
        ui.add_space(8.0);
        egui::ScrollArea::vertical().max_height(0.4 * ui.available_height()).show(ui, |ui| {
            for line in findings.lines().take(FINDINGS_MAX) {
                ui.label(format!("• {line}"));
            }
            if count > FINDINGS_MAX {
                ui.weak(words.format("verify.more", count - FINDINGS_MAX));
            }
        });
    }
}

/// The session that was verified: exercise, participant, time and grade, and the script if no person performed it.
fn session_ui(ui: &mut egui::Ui, session: &SessionFile, words: &Translations) {
    let when = session.started.get(..16).unwrap_or_default().replace('T', " ");
    let grade = session.grade.as_ref().map_or_else(
        || words.get("results.no_grade").to_string(),
        |grade| {
            let (verdict, _) = results::verdict(grade);
            let earned = points(grade.points, grade.pass_points);
            format!("{} / {} · {}", earned, plain_number(grade.max_points), words.get(verdict))
        },
    );
    let rows = [
        ("verify.exercise", format!("{} ({})", session.scenario.title, session.scenario.id)),
        ("verify.exercise_digest", session.scenario.sha256.chars().take(SHOWN_DIGITS).collect()),
        ("briefing.participant", session.participant.clone()),
        ("verify.began", format!("{when} UTC")),
        ("results.points", grade),
    ];
    egui::Grid::new("verified").num_columns(2).spacing([24.0, 6.0]).show(ui, |ui| {
        for (key, value) in rows {
            ui.strong(words.get(key));
            ui.label(value);
            ui.end_row();
        }
    });
    if let Some(script) = &session.operator {
        ui.colored_label(theme::WARNING, words.format("verify.script", script));
    }
}
