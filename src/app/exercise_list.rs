//! The exercise list: every exercise that can be selected.

use super::command::AppCommand;
use super::editor;
use super::i18n::Translations;
use super::theme;
use eframe::egui;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use typodont_exercise::scenario;
use typodont_exercise::scenario::{ResolveMode, Scenario};
use typodont_formats::Library;
use typodont_formats::diagnostic::{SourceText, headlines};
use typodont_lesson::{self as lesson, ToothScan};

/// Exercises built into the program, so that some are available wherever it is installed.
const SHIPPED: [(&str, &str); 5] = [
    ("1-introduction.json", include_str!("../../scenarios/1-introduction.json")),
    ("2-decay.json", include_str!("../../scenarios/2-decay.json")),
    ("3-detection.json", include_str!("../../scenarios/3-detection.json")),
    ("4-diagnosis.json", include_str!("../../scenarios/4-diagnosis.json")),
    ("5-grinding.json", include_str!("../../scenarios/5-grinding.json")),
];

/// An exercise of the list, or a file that is not a valid exercise.
pub struct Exercise {
    /// Name of the file.
    pub name: String,
    /// Path of the file; `None` for an exercise built into the program.
    pub path: Option<PathBuf>,
    /// Finds the files that the exercise names.
    pub library: Library,
    pub scenario: Result<Arc<Scenario>, String>,
    /// SHA-256 of files that the exercise does not name, by name.
    pub digests: BTreeMap<String, String>,
}

impl Exercise {
    /// The exercise's own short name, else the file's.
    pub fn id(&self) -> &str {
        self.scenario.as_ref().map_or(&self.name, |scenario| &scenario.id)
    }
}

/// All exercises, and the selected one.
pub struct ExerciseList {
    pub exercises: Vec<Exercise>,
    pub selected: usize,
    /// True if the list is to scroll to the selected exercise.
    pub scroll_to_selected: bool,
    /// The folder as it is being typed.
    pub folder: String,
    /// Reason why the folder could not be read.
    pub complaint: Option<String>,
}

impl ExerciseList {
    /// Loads the shipped exercises, and those of `folder` if its path is not empty.
    pub fn load(folder: &Path) -> ExerciseList {
        let library = Library::shipped();
        let shipped = SHIPPED.map(|(name, text)| {
            let read = scenario::resolve(SourceText::new(name, text), &library, ResolveMode::ReadScans);
            Exercise {
                name: name.into(),
                path: None,
                library: library.clone(),
                scenario: read.map(Arc::new).map_err(|found| headlines(&found)),
                digests: BTreeMap::new(),
            }
        });
        let mut list = ExerciseList {
            exercises: shipped.into(),
            selected: 0,
            scroll_to_selected: false,
            folder: folder.display().to_string(),
            complaint: None,
        };
        if !folder.as_os_str().is_empty() {
            match lesson::scenario_files(folder) {
                Ok(files) => list.exercises.extend(files.iter().map(|path| from_file(path))),
                Err(failed) => list.complaint = Some(failed.to_string()),
            }
        }
        list
    }

    /// Adds a file to the list and selects it.
    pub fn add_and_select(&mut self, path: &Path) {
        self.exercises.push(from_file(path));
        self.selected = self.exercises.len() - 1;
        self.scroll_to_selected = true;
    }

    /// Replaces the teeth of the selected exercise by a scan.
    pub fn replace_teeth(&mut self, scan: &ToothScan) {
        let Some(exercise) = self.exercises.get_mut(self.selected) else { return };
        if let Ok(scenario) = &mut exercise.scenario {
            match scan.replace_teeth(Arc::make_mut(scenario)) {
                Ok(()) => drop(exercise.digests.insert("tooth".into(), scan.digest().into())),
                Err(failed) => exercise.scenario = Err(failed.to_string()),
            }
        }
    }

    /// Selects a file, and adds it to the list if it is not there yet.
    pub fn select_file(&mut self, path: &Path) {
        match self.exercises.iter().position(|exercise| exercise.path.as_deref() == Some(path)) {
            Some(place) => (self.selected, self.scroll_to_selected) = (place, true),
            None => self.add_and_select(path),
        }
    }

    pub fn selected_exercise(&self) -> Option<&Exercise> {
        self.exercises.get(self.selected)
    }
}

/// The text of an exercise built into the program; `None` for an unknown name.
pub fn shipped_text(name: &str) -> Option<&'static str> {
    SHIPPED.iter().find(|(own, _)| *own == name).map(|(_, text)| *text)
}

fn from_file(path: &Path) -> Exercise {
    let scenario = lesson::read_scenario(path, ResolveMode::ReadScans).map(Arc::new).map_err(|found| headlines(&found));
    Exercise {
        name: path.display().to_string(),
        path: Some(path.to_path_buf()),
        library: lesson::library_for(path),
        scenario,
        digests: BTreeMap::new(),
    }
}

/// Draws the list. Pushes a command when the user selects an exercise or another folder.
pub fn exercise_list_ui(
    ui: &mut egui::Ui,
    list: &mut ExerciseList,
    words: &Translations,
    commands: &mut Vec<AppCommand>,
) {
    theme::centered_column(ui, |ui| {
        ui.heading(words.get("shelf.title"));
        ui.label(words.get("shelf.about"));
        ui.add_space(16.0);
        let room = (ui.available_height() - 180.0).max(160.0);
        egui::ScrollArea::vertical().max_height(room).auto_shrink([false, true]).show(ui, |ui| {
            for (place, exercise) in list.exercises.iter().enumerate() {
                let card = exercise_ui(ui, exercise, place, list.selected == place, commands);
                if card.gained_focus() || (list.scroll_to_selected && list.selected == place) {
                    card.scroll_to_me(None);
                }
            }
            list.scroll_to_selected = false;
        });
        ui.add_space(16.0);
        let is_valid = list.selected_exercise().is_some_and(|e| e.scenario.is_ok());
        ui.horizontal(|ui| {
            if ui.add_enabled(is_valid, theme::primary_button(words.get("shelf.open"))).clicked() {
                commands.push(AppCommand::OpenBriefing);
            }
            for (key, command) in [("shelf.edit", AppCommand::EditExercise), ("shelf.new", AppCommand::NewExercise)] {
                let button = ui.button(words.get(key));
                editor::anchor(ui, key, button.rect);
                if button.clicked() {
                    commands.push(command);
                }
            }
        });
        ui.horizontal_wrapped(|ui| {
            let label = ui.label(words.get("shelf.folder")).id;
            let edit = egui::TextEdit::singleline(&mut list.folder).desired_width(260.0);
            let typed = ui.add(edit.hint_text(words.get("shelf.folder_hint"))).labelled_by(label);
            if typed.lost_focus() && ui.input(|input| input.key_pressed(egui::Key::Enter)) {
                commands.push(AppCommand::OpenFolder(list.folder.clone().into()));
            }
        });
        if let Some(complaint) = &list.complaint {
            ui.colored_label(theme::ERROR, complaint);
        }
    });
}

fn exercise_ui(
    ui: &mut egui::Ui,
    exercise: &Exercise,
    place: usize,
    is_selected: bool,
    commands: &mut Vec<AppCommand>,
) -> egui::Response {
    let (title, about, colour) = match &exercise.scenario {
        Ok(scenario) => (scenario.title.as_str(), scenario.summary.as_str(), None),
        Err(complaint) => (exercise.name.as_str(), complaint.as_str(), Some(theme::ERROR)),
    };
    let fill = if is_selected { theme::ACCENT.gamma_multiply(0.14) } else { egui::Color32::WHITE };
    let edge = if is_selected {
        egui::Stroke::new(2.0, theme::ACCENT)
    } else {
        egui::Stroke::new(1.0, egui::Color32::from_gray(0xdd))
    };
    let frame = egui::Frame::NONE.fill(fill).stroke(edge).corner_radius(8).inner_margin(14);
    let shown = frame.show(ui, |ui| {
        ui.set_width(ui.available_width());
        ui.add(egui::Label::new(egui::RichText::new(title).strong().size(18.0)).selectable(false));
        let about = egui::RichText::new(about);
        let about = if let Some(colour) = colour { about.color(colour) } else { about };
        ui.add(egui::Label::new(about).wrap().selectable(false));
    });
    let card = ui.interact(shown.response.rect, ui.scope_id().with(("exercise", place)), egui::Sense::click());
    card.widget_info(|| egui::WidgetInfo::selected(egui::Role::Button, true, is_selected, title));
    if card.clicked() {
        commands.push(AppCommand::SelectExercise(place));
    }
    if card.double_clicked() {
        commands.push(AppCommand::OpenBriefing);
    }
    if card.has_focus() {
        ui.painter().rect_stroke(card.rect, 8, egui::Stroke::new(2.0, theme::ACCENT), egui::StrokeKind::Outside);
    }
    ui.add_space(4.0);
    card
}
