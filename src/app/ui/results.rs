//! The page of results: the grade, its reasons, and maps of tissue wrongly removed or left.

use crate::command::AppCommand;
use crate::i18n::Translations;
use crate::platform;
use crate::results::{BundleState, LessonResults};
use crate::ui::report_texts::ReportTexts;
use crate::ui::theme;
use crate::ui::ui_anchors;
use eframe::egui;
use typodont_report::display_format::{item_points, plain_number, points};
use typodont_report::{FeedbackFinding, FirstResult, GradeFile, LegendEntry, phrases};

/// Draws the results. `is_test_run`: the lesson was a test run of an author, who returns to the exercise.
pub fn results_ui(
    ui: &mut egui::Ui,
    results: &LessonResults,
    is_test_run: bool,
    texts: &ReportTexts,
    commands: &mut Vec<AppCommand>,
) {
    let words = texts.words;
    let side = egui::Frame::NONE.inner_margin(16);
    let width = 360.0f32.min(0.34 * ui.available_width());
    egui::Panel::right("maps").exact_size(width).resizable(false).frame(side).show(ui, |ui| {
        egui::ScrollArea::vertical().auto_shrink(false).show(ui, |ui| maps_ui(ui, results, texts));
    });
    let below = egui::Frame::NONE.inner_margin(egui::Margin { left: 32, right: 16, top: 8, bottom: 16 });
    egui::Panel::bottom("next").resizable(false).frame(below).show(ui, |ui| {
        bundle_ui(ui, results, words);
        buttons_ui(ui, results, is_test_run, words, commands);
    });
    let middle = egui::Frame::NONE.inner_margin(egui::Margin { left: 32, right: 16, top: 24, bottom: 8 });
    egui::CentralPanel::default().frame(middle).show(ui, |ui| {
        let session = &results.first.session;
        ui.heading(own(texts, &results.first, &session.scenario.title));
        match &session.grade {
            Some(grade) => verdict_ui(ui, grade, &results.first, texts),
            None => {
                ui.label(words.get("results.no_grade"));
                let (key, colour) = match results.is_done() {
                    true => ("results.performed", theme::SUCCESS),
                    false => ("results.not_performed", theme::WARNING),
                };
                ui.label(egui::RichText::new(words.get(key)).size(18.0).strong().color(colour));
            }
        }
        for stage in session.stages.iter().filter(|stage| stage.ended_by == "time") {
            ui.colored_label(theme::WARNING, words.format("results.time_up", own(texts, &results.first, &stage.title)));
        }
        ui.add_space(6.0);
        // Every result begins at its top.
        let area = egui::ScrollArea::vertical().id_salt(("results", &session.scenario.id, &session.started));
        area.auto_shrink(false).show(ui, |ui| {
            theme::scroll_by_keys(ui);
            feedback_ui(ui, &results.first, texts);
            if let Some(grade) = &session.grade {
                items_ui(ui, grade, &results.first, texts);
            }
            let measures = egui::CollapsingHeader::new(words.get("results.measures"));
            let header = measures.show(ui, |ui| measures_ui(ui, &results.first, texts)).header_response;
            if header.gained_focus() {
                header.scroll_to_me(None);
            }
        });
    });
}

/// A text of the exercise in the window's language.
fn own<'a>(texts: &'a ReportTexts, first: &'a FirstResult, text: &'a str) -> &'a str {
    texts.words.own(&first.texts, text)
}

/// Text key and colour of a grade's verdict.
pub fn verdict(grade: &GradeFile) -> (&'static str, egui::Color32) {
    match (grade.finished, grade.passed) {
        (false, _) => ("results.unfinished", theme::WARNING),
        (true, true) => ("results.passed", theme::SUCCESS),
        (true, false) => ("results.failed", theme::ERROR),
    }
}

fn verdict_ui(ui: &mut egui::Ui, grade: &GradeFile, first: &FirstResult, texts: &ReportTexts) {
    let words = texts.words;
    let (key, colour) = verdict(grade);
    ui.horizontal_wrapped(|ui| {
        ui.label(egui::RichText::new(words.get(key)).size(24.0).strong().color(colour));
        ui.label(
            egui::RichText::new(format!(
                "{} / {}",
                points(grade.points, grade.pass_points),
                plain_number(grade.max_points)
            ))
            .size(24.0),
        );
    });
    ui.weak(words.format("results.pass_at", format!("{:.0}", grade.pass_points)));
    for fail in &grade.hard_fails {
        ui.colored_label(theme::ERROR, format!("× {}", own(texts, first, fail)));
    }
}

/// The causes of lost points, the most costly first.
fn feedback_ui(ui: &mut egui::Ui, first: &FirstResult, texts: &ReportTexts) {
    if first.feedback.findings.is_empty() {
        return;
    }
    ui.label(egui::RichText::new(texts.words.get("results.next")).strong().size(18.0));
    for finding in &first.feedback.findings {
        finding_ui(ui, finding, texts);
    }
    ui.add_space(10.0);
}

fn finding_ui(ui: &mut egui::Ui, finding: &FeedbackFinding, texts: &ReportTexts) {
    egui::Frame::NONE.fill(egui::Color32::WHITE).corner_radius(6).inner_margin(10).show(ui, |ui| {
        ui.set_width(ui.available_width());
        ui.horizontal_wrapped(|ui| {
            ui.strong(texts.text(&finding.title));
            if let Some(lost) = finding.lost {
                ui.colored_label(theme::ERROR, format!("−{lost:.1}"));
            }
        });
        for sentence in &finding.sentences {
            ui.label(texts.text(&sentence.message));
        }
        if let Some(advice) = &finding.advice {
            ui.colored_label(theme::ACCENT, texts.text(advice));
        }
    });
    ui.add_space(4.0);
}

fn items_ui(ui: &mut egui::Ui, grade: &GradeFile, first: &FirstResult, texts: &ReportTexts) {
    let width = CRITERIA_WIDTH * ui.available_width();
    egui::Grid::new("items").num_columns(3).spacing([24.0, 8.0]).striped(true).show(ui, |ui| {
        for key in ["results.item", "results.value", "results.points"] {
            ui.strong(texts.words.get(key));
        }
        ui.end_row();
        for item in &grade.items {
            let title = own(texts, first, &item.title);
            criterion_ui(ui, width, title, &texts.text(&first.measure_title(&item.metric)));
            ui.label(texts.text(&phrases::value(&item.metric, item.value)));
            ui.label(format!("{} / {}", item_points(item.points, item.max_points), plain_number(item.max_points)));
            ui.end_row();
        }
    });
    ui.add_space(10.0);
}

/// Share of the room in a table that the criteria take.
pub const CRITERIA_WIDTH: f32 = 0.5;

/// Draws the title of a criterion, and what is measured where the title does not say it, in a column of a width, points.
pub fn criterion_ui(ui: &mut egui::Ui, width: f32, title: &str, measure: &str) {
    ui.vertical(|ui| {
        ui.set_width(width);
        ui.spacing_mut().item_spacing.y = 0.0;
        ui.label(title);
        if measure != title {
            ui.add(egui::Label::new(egui::RichText::new(measure).weak().small()));
        }
    });
}

fn measures_ui(ui: &mut egui::Ui, first: &FirstResult, texts: &ReportTexts) {
    egui::Grid::new("measures").num_columns(2).spacing([24.0, 6.0]).striped(true).show(ui, |ui| {
        for (name, value) in &first.session.metrics {
            ui.label(texts.text(&first.measure_title(name))).on_hover_text(name);
            ui.label(texts.text(&phrases::value(name, *value)));
            ui.end_row();
        }
    });
}

/// The maps and the meaning of their colours.
fn maps_ui(ui: &mut egui::Ui, results: &LessonResults, texts: &ReportTexts) {
    let words = texts.words;
    let heading = words.get(if results.is_judged() { "results.map" } else { "results.after" });
    ui.strong(heading);
    let width = ui.available_width();
    for (number, map) in results.maps.iter().enumerate() {
        ui.add(egui::Image::new(map).max_width(width).alt_text(heading).corner_radius(8));
        if number == 0 && results.is_judged() {
            legend_ui(ui, &results.first.legend, texts);
        }
        ui.add_space(8.0);
    }
    if results.maps.is_empty() {
        if results.is_judged() {
            legend_ui(ui, &results.first.legend, texts);
        }
        if results.is_pending() {
            ui.weak(words.get("results.map_pending"));
        }
    }
    ui.weak(words.get("results.map_about"));
}

fn legend_ui(ui: &mut egui::Ui, legend: &[LegendEntry], texts: &ReportTexts) {
    const SIDE: f32 = 22.0;
    for entry in legend {
        ui.horizontal(|ui| {
            let (rect, _) = ui.allocate_exact_size(egui::vec2(SIDE, SIDE), egui::Sense::hover());
            let [r, g, b] = entry.color;
            let ink = if entry.is_dark { egui::Color32::WHITE } else { egui::Color32::BLACK };
            ui.painter().rect_filled(rect, 4, egui::Color32::from_rgb(r, g, b));
            sign_ui(ui.painter(), rect, entry.sign, ink);
            let text = format!("{} · {:.2} mm³", texts.text(&entry.title), entry.volume);
            ui.add(egui::Label::new(text).wrap());
        });
    }
}

/// Draws the sign of a verdict. The window's fonts lack the cross, too.
fn sign_ui(painter: &egui::Painter, rect: egui::Rect, sign: &str, ink: egui::Color32) {
    let at = |x: f32, y: f32| rect.lerp_inside(egui::vec2(x, y));
    let stroke = egui::Stroke::new(2.0, ink);
    match sign {
        "✓" => theme::tick(painter, rect, stroke),
        "✗" => {
            painter.line_segment([at(0.28, 0.28), at(0.72, 0.72)], stroke);
            painter.line_segment([at(0.72, 0.28), at(0.28, 0.72)], stroke);
        }
        sign => {
            let font = egui::FontId::proportional(14.0);
            painter.text(rect.center(), egui::Align2::CENTER_CENTER, sign, font, ink);
        }
    }
}

/// Progress of the bundle, and its folder in the end.
fn bundle_ui(ui: &mut egui::Ui, results: &LessonResults, words: &Translations) {
    match &results.state {
        BundleState::Pending(completion) => {
            let progress = completion.state().progress;
            theme::progress_bar(ui, words.get(progress.key), progress.share);
        }
        BundleState::Finished(bundle) => {
            let text = match platform::IS_PAGE {
                true => words.get("results.in_page").to_string(),
                false => words.format("results.bundle", bundle.path().display()),
            };
            ui.add(egui::Label::new(egui::RichText::new(text).weak()).wrap());
        }
        BundleState::Failed(why) => {
            ui.colored_label(theme::ERROR, why);
        }
    }
}

fn buttons_ui(
    ui: &mut egui::Ui,
    results: &LessonResults,
    is_test_run: bool,
    words: &Translations,
    commands: &mut Vec<AppCommand>,
) {
    ui.add_space(6.0);
    ui.horizontal_wrapped(|ui| {
        let leave = words.get(if is_test_run { "author.back" } else { "results.again" });
        // What most want to do next: another attempt, or the next exercise.
        let (retry, is_left_first) = match results.invites_retry() {
            true => (theme::primary_button(words.get("results.retry")), false),
            false => (egui::Button::new(words.get("results.retry")), true),
        };
        if is_left_first && ui.add(theme::primary_button(leave)).clicked() {
            commands.push(AppCommand::BackToList);
        }
        if results.has_retry && ui.add(retry).clicked() {
            commands.push(AppCommand::TryAgain);
        }
        let is_finished = matches!(results.state, BundleState::Finished(_));
        // A browser leads out of a kiosk.
        let report = egui::Button::new(words.get("results.report"));
        if results.has_report && ui.add_enabled(is_finished, report).clicked() {
            commands.push(AppCommand::OpenReport);
        }
        if platform::IS_PAGE {
            let button = ui.add_enabled(is_finished, egui::Button::new(words.get("results.download")));
            ui_anchors::anchor(ui, "results.download", button.rect);
            if button.clicked() {
                commands.push(AppCommand::DownloadBundle);
            }
        }
        if !is_left_first && ui.button(leave).clicked() {
            commands.push(AppCommand::BackToList);
        }
    });
}
