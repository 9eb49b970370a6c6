//! Results of a lesson: the grade, its reasons, and maps of tissue wrongly removed or left.

use super::command::AppCommand;
use super::i18n::Translations;
use super::theme;
use eframe::egui;
use std::fs;
use std::path::{Path, PathBuf};
use typodont_exercise::scenario::Metric;
use typodont_report::bundle::{REPORT_FILE, SESSION_FILE};
use typodont_report::{GradeFile, SessionFile, measure_in_words};

/// The parts of a bundle that the window shows.
pub struct LessonResults {
    pub bundle: PathBuf,
    pub session: SessionFile,
    /// The maps listed in `MAPS`, as far as the bundle contains them.
    pub maps: Vec<egui::TextureHandle>,
}

/// Names of the maps shown in the window; the report page shows all.
const MAPS: [&str; 2] = ["map-occlusal", "after-occlusal"];

impl LessonResults {
    /// Reads a bundle that was just written.
    ///
    /// # Errors
    /// A message with the reason if the bundle cannot be read.
    pub fn load(bundle: PathBuf, ctx: &egui::Context) -> Result<LessonResults, String> {
        let wrong = |what: &dyn std::fmt::Display| format!("{}: unreadable-bundle: {what}", bundle.display());
        let text = fs::read(bundle.join(SESSION_FILE)).map_err(|e| wrong(&e))?;
        let session = serde_json::from_slice(&text).map_err(|e| wrong(&e))?;
        let maps = MAPS.iter().filter_map(|name| load_map(&bundle, name, ctx)).collect();
        Ok(LessonResults { bundle, session, maps })
    }

    /// URL of the report page; `None` if its path cannot be written as a URL.
    pub fn report_url(&self) -> Option<String> {
        let path = std::path::absolute(self.bundle.join(REPORT_FILE)).ok()?;
        url::Url::from_file_path(path).ok().map(String::from)
    }
}

fn load_map(bundle: &Path, name: &str, ctx: &egui::Context) -> Option<egui::TextureHandle> {
    let bytes = fs::read(bundle.join("views").join(format!("{name}.png"))).ok()?;
    let image = image::load_from_memory(&bytes).ok()?.to_rgba8();
    let size = [image.width() as usize, image.height() as usize];
    let pixels = egui::ColorImage::from_rgba_unmultiplied(size, image.as_raw());
    Some(ctx.load_texture(name, pixels, egui::TextureOptions::LINEAR))
}

/// Draws the results. `is_test_run`: the lesson was a test run of an author, who returns to the exercise.
pub fn results_ui(
    ui: &mut egui::Ui,
    results: &LessonResults,
    is_test_run: bool,
    words: &Translations,
    commands: &mut Vec<AppCommand>,
) {
    let side = egui::Frame::NONE.inner_margin(24);
    egui::Panel::right("maps").exact_size(380.0).resizable(false).frame(side).show(ui, |ui| {
        egui::ScrollArea::vertical().show(ui, |ui| maps_ui(ui, results, words));
    });
    egui::CentralPanel::default().frame(egui::Frame::NONE.inner_margin(32)).show(ui, |ui| {
        let session = &results.session;
        ui.heading(&session.scenario.title);
        match &session.grade {
            Some(grade) => verdict_ui(ui, grade, words),
            None => {
                ui.label(words.get("results.no_grade"));
            }
        }
        ui.add_space(10.0);
        let room = (ui.available_height() - 110.0).max(160.0);
        egui::ScrollArea::vertical().max_height(room).auto_shrink([false, true]).show(ui, |ui| {
            if let Some(grade) = &session.grade {
                items_ui(ui, grade, words);
            }
            egui::CollapsingHeader::new(words.get("results.measures")).show(ui, |ui| measures_ui(ui, session));
        });
        ui.add_space(10.0);
        ui.horizontal(|ui| {
            if ui.add(theme::primary_button(words.get("results.report"))).clicked() {
                commands.push(AppCommand::OpenReport);
            }
            if ui.button(words.get(if is_test_run { "author.back" } else { "results.again" })).clicked() {
                commands.push(AppCommand::BackToList);
            }
        });
        ui.weak(words.format("results.bundle", results.bundle.display()));
    });
}

fn verdict_ui(ui: &mut egui::Ui, grade: &GradeFile, words: &Translations) {
    let (key, colour) = match (grade.finished, grade.passed) {
        (false, _) => ("results.unfinished", theme::WARNING),
        (true, true) => ("results.passed", theme::SUCCESS),
        (true, false) => ("results.failed", theme::ERROR),
    };
    ui.horizontal(|ui| {
        ui.label(egui::RichText::new(words.get(key)).size(24.0).strong().color(colour));
        ui.label(egui::RichText::new(format!("{:.1} / {:.0}", grade.points, grade.max_points)).size(24.0));
    });
    ui.weak(words.format("results.pass_at", format!("{:.0}", grade.pass_points)));
    for fail in &grade.hard_fails {
        ui.colored_label(theme::ERROR, format!("× {fail}"));
    }
}

fn items_ui(ui: &mut egui::Ui, grade: &GradeFile, words: &Translations) {
    egui::Grid::new("items").num_columns(3).spacing([24.0, 8.0]).striped(true).show(ui, |ui| {
        for key in ["results.item", "results.value", "results.points"] {
            ui.strong(words.get(key));
        }
        ui.end_row();
        for item in &grade.items {
            ui.label(&item.title);
            ui.label(measure_in_words(&item.metric, item.value));
            ui.label(format!("{:.1} / {:.0}", item.points, item.max_points));
            ui.end_row();
        }
    });
    ui.add_space(10.0);
}

fn measures_ui(ui: &mut egui::Ui, session: &SessionFile) {
    egui::Grid::new("measures").num_columns(2).spacing([24.0, 6.0]).striped(true).show(ui, |ui| {
        for (name, value) in &session.metrics {
            let title = Metric::parse(name).map_or(name.clone(), |metric| metric.info.title.to_string());
            ui.label(title).on_hover_text(name);
            ui.label(measure_in_words(name, *value));
            ui.end_row();
        }
    });
}

fn maps_ui(ui: &mut egui::Ui, results: &LessonResults, words: &Translations) {
    ui.strong(words.get("results.map"));
    for map in &results.maps {
        ui.add(egui::Image::new(map).max_width(330.0).alt_text(words.get("results.map")).corner_radius(8));
        ui.add_space(8.0);
    }
    ui.weak(words.get("results.map_about"));
}
