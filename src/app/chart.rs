//! The periodontal chart as it grows: six sites, what was read at each, and where calculus was felt.

use super::command::Command;
use super::language::Words;
use super::sitting::Sitting;
use crate::scenario::{Site, Stage};
use crate::session::{Noted, Sign};
use eframe::egui;

/// The chart of a stage that asks for one, seen as on paper: cheek above, tongue below, mesial on the left.
pub fn chart_ui(ui: &mut egui::Ui, stage: &Stage, sitting: &Sitting, words: &Words, asked: &mut Vec<Command>) {
    if !stage.chart.depths && !stage.chart.calculus {
        return;
    }
    ui.add_space(10.0);
    ui.strong(words.of("chart.title"));
    egui::Grid::new("chart").num_columns(4).spacing([14.0, 4.0]).striped(true).show(ui, |ui| {
        for (side, sites) in [("chart.buccal", &Site::ALL[..3]), ("chart.lingual", &Site::ALL[3..])] {
            ui.label(words.of(side));
            for &site in sites {
                ui.monospace(cell(sitting, site));
            }
            ui.end_row();
        }
    });
    ui.horizontal_wrapped(|ui| {
        if stage.chart.depths && ui.button(words.of("chart.read")).clicked() {
            asked.push(Command::Chart(Sign::Depth));
        }
        if stage.chart.calculus && ui.button(words.of("chart.calculus")).clicked() {
            asked.push(Command::Chart(Sign::Calculus));
        }
    });
}

/// A site with its reading, and an asterisk for calculus.
fn cell(sitting: &Sitting, site: Site) -> String {
    let here = || sitting.charted.iter().filter(|note| note.site == site).map(|note| note.what);
    let depth = here().find_map(|what| match what {
        Noted::Depth { read, .. } => Some(read),
        Noted::Calculus => None,
    });
    let star = if here().any(|what| what == Noted::Calculus) { "*" } else { "" };
    let read = depth.map_or("–".to_string(), |mm| mm.to_string());
    format!("{} {read}{star}", site.code())
}
