//! What came of a lesson: the grade, its reasons, and where tissue was wrongly taken or left.

use super::command::Command;
use super::language::Words;
use super::look;
use crate::report::bundle::{REPORT_FILE, SESSION_FILE};
use crate::report::{GradeFile, SessionFile, measure_in_words};
use crate::scenario::Metric;
use eframe::egui;
use std::fs;
use std::path::{Path, PathBuf};

/// A bundle as far as the window shows it.
pub struct Results {
    pub bundle: PathBuf,
    pub session: SessionFile,
    /// The maps from above and in the cut, as far as they are there.
    pub maps: Vec<egui::TextureHandle>,
}

/// The maps that a trainee sees first; the page has all.
const MAPS: [&str; 2] = ["map-occlusal", "after-occlusal"];

impl Results {
    /// Reads a bundle that was just made.
    pub fn read(bundle: PathBuf, ctx: &egui::Context) -> Result<Results, String> {
        let wrong = |what: &dyn std::fmt::Display| format!("{}: unreadable-bundle: {what}", bundle.display());
        let text = fs::read(bundle.join(SESSION_FILE)).map_err(|e| wrong(&e))?;
        let session = serde_json::from_slice(&text).map_err(|e| wrong(&e))?;
        let maps = MAPS.iter().filter_map(|name| picture(&bundle, name, ctx)).collect();
        Ok(Results { bundle, session, maps })
    }

    /// The page, as a browser is told of it; `None` where its folder has no address.
    pub fn page(&self) -> Option<String> {
        let path = std::path::absolute(self.bundle.join(REPORT_FILE)).ok()?;
        url::Url::from_file_path(path).ok().map(String::from)
    }
}

fn picture(bundle: &Path, name: &str, ctx: &egui::Context) -> Option<egui::TextureHandle> {
    let bytes = fs::read(bundle.join("views").join(format!("{name}.png"))).ok()?;
    let image = image::load_from_memory(&bytes).ok()?.to_rgba8();
    let size = [image.width() as usize, image.height() as usize];
    let pixels = egui::ColorImage::from_rgba_unmultiplied(size, image.as_raw());
    Some(ctx.load_texture(name, pixels, egui::TextureOptions::LINEAR))
}

/// `is_tried`: an author has tried their exercise, and goes back to it.
pub fn results_ui(ui: &mut egui::Ui, results: &Results, is_tried: bool, words: &Words, asked: &mut Vec<Command>) {
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
                ui.label(words.of("results.no_grade"));
            }
        }
        ui.add_space(10.0);
        let room = (ui.available_height() - 110.0).max(160.0);
        egui::ScrollArea::vertical().max_height(room).auto_shrink([false, true]).show(ui, |ui| {
            if let Some(grade) = &session.grade {
                items_ui(ui, grade, words);
            }
            egui::CollapsingHeader::new(words.of("results.measures")).show(ui, |ui| measures_ui(ui, session));
        });
        ui.add_space(10.0);
        ui.horizontal(|ui| {
            if ui.add(look::main_button(words.of("results.report"))).clicked() {
                asked.push(Command::ShowReport);
            }
            if ui.button(words.of(if is_tried { "author.back" } else { "results.again" })).clicked() {
                asked.push(Command::ToShelf);
            }
        });
        ui.weak(words.with("results.bundle", results.bundle.display()));
    });
}

fn verdict_ui(ui: &mut egui::Ui, grade: &GradeFile, words: &Words) {
    let (key, colour) = match (grade.finished, grade.passed) {
        (false, _) => ("results.unfinished", look::CARE),
        (true, true) => ("results.passed", look::GOOD),
        (true, false) => ("results.failed", look::WRONG),
    };
    ui.horizontal(|ui| {
        ui.label(egui::RichText::new(words.of(key)).size(24.0).strong().color(colour));
        ui.label(egui::RichText::new(format!("{:.1} / {:.0}", grade.points, grade.max_points)).size(24.0));
    });
    ui.weak(words.with("results.pass_at", format!("{:.0}", grade.pass_points)));
    for fail in &grade.hard_fails {
        ui.colored_label(look::WRONG, format!("× {fail}"));
    }
}

fn items_ui(ui: &mut egui::Ui, grade: &GradeFile, words: &Words) {
    egui::Grid::new("items").num_columns(3).spacing([24.0, 8.0]).striped(true).show(ui, |ui| {
        for key in ["results.item", "results.value", "results.points"] {
            ui.strong(words.of(key));
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
            let title = Metric::parse(name).map_or(name.clone(), |metric| metric.about.title.to_string());
            ui.label(title).on_hover_text(name);
            ui.label(measure_in_words(name, *value));
            ui.end_row();
        }
    });
}

fn maps_ui(ui: &mut egui::Ui, results: &Results, words: &Words) {
    ui.strong(words.of("results.map"));
    for map in &results.maps {
        ui.add(egui::Image::new(map).max_width(330.0).alt_text(words.of("results.map")).corner_radius(8));
        ui.add_space(8.0);
    }
    ui.weak(words.of("results.map_about"));
}
