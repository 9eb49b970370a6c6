//! The periodontal chart in progress: six sites, the reading at each, and the sites at which calculus was felt.

use crate::command::{AppCommand, PracticeCommand};
use crate::i18n::Translations;
use crate::lesson_state::LessonState;
use eframe::egui;
use typodont_exercise::scenario::{ProbingSite, Stage};
use typodont_exercise::session::{ChartEntry, ChartInput};

/// The chart of a stage that requires one, laid out as on paper: buccal above, lingual below, mesial on the left.
pub fn periodontal_chart_ui(
    ui: &mut egui::Ui,
    stage: &Stage,
    lesson: &LessonState,
    words: &Translations,
    commands: &mut Vec<AppCommand>,
) {
    if !stage.chart.depths && !stage.chart.calculus {
        return;
    }
    ui.add_space(10.0);
    ui.strong(words.get("chart.title"));
    egui::Grid::new("chart").num_columns(4).spacing([14.0, 4.0]).striped(true).show(ui, |ui| {
        for (side, sites) in [("chart.buccal", &ProbingSite::ALL[..3]), ("chart.lingual", &ProbingSite::ALL[3..])] {
            ui.label(words.get(side));
            for &site in sites {
                ui.monospace(cell(lesson, site));
            }
            ui.end_row();
        }
    });
    ui.horizontal_wrapped(|ui| {
        if stage.chart.depths && ui.button(words.get("chart.read")).clicked() {
            commands.push(AppCommand::Practice(PracticeCommand::AddToChart(ChartInput::Depth)));
        }
        if stage.chart.calculus && ui.button(words.get("chart.calculus")).clicked() {
            commands.push(AppCommand::Practice(PracticeCommand::AddToChart(ChartInput::Calculus)));
        }
    });
}

/// A site with its reading, and an asterisk for calculus.
fn cell(lesson: &LessonState, site: ProbingSite) -> String {
    let here = || lesson.chart.iter().filter(|note| note.site == site).map(|note| note.entry);
    let depth = here().find_map(|what| match what {
        ChartEntry::Depth { reading: read, .. } => Some(read),
        ChartEntry::Calculus => None,
    });
    let star = if here().any(|what| what == ChartEntry::Calculus) { "*" } else { "" };
    let read = depth.map_or("–".to_string(), |mm| mm.to_string());
    format!("{} {read}{star}", site.code())
}
