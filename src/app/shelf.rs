//! The shelf: every exercise there is to choose from.

use super::author;
use super::command::Command;
use super::language::Words;
use super::look;
use crate::content::Library;
use crate::diagnostic::{Source, headlines};
use crate::lesson::{self, Scan};
use crate::scenario::{self, Forms, Scenario};
use eframe::egui;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Exercises that ship with the program, so that it has some wherever it is installed.
const SHIPPED: [(&str, &str); 5] = [
    ("1-introduction.json", include_str!("../../scenarios/1-introduction.json")),
    ("2-decay.json", include_str!("../../scenarios/2-decay.json")),
    ("3-detection.json", include_str!("../../scenarios/3-detection.json")),
    ("4-diagnosis.json", include_str!("../../scenarios/4-diagnosis.json")),
    ("5-grinding.json", include_str!("../../scenarios/5-grinding.json")),
];

/// An exercise, or why a file is none.
pub struct Exercise {
    /// The file.
    pub name: String,
    /// Where it is; none for one that ships within the program.
    pub path: Option<PathBuf>,
    /// Where the files that it names are found.
    pub library: Library,
    pub read: Result<Arc<Scenario>, String>,
    /// SHA-256 of files that the exercise does not name, by name.
    pub digests: BTreeMap<String, String>,
}

impl Exercise {
    /// The exercise's own short name, else the file's.
    pub fn id(&self) -> &str {
        self.read.as_ref().map_or(&self.name, |scenario| &scenario.id)
    }
}

/// All exercises, and which is chosen.
pub struct Shelf {
    pub exercises: Vec<Exercise>,
    pub chosen: usize,
    /// The chosen one is to be brought into sight.
    pub is_sought: bool,
    /// The folder as it is being typed.
    pub folder: String,
    /// Why the folder shows nothing.
    pub complaint: Option<String>,
}

impl Shelf {
    /// Those that ship, and those of a folder if its path is not empty.
    pub fn stock(folder: &Path) -> Shelf {
        let library = Library::shipped();
        let shipped = SHIPPED.map(|(name, text)| {
            let read = scenario::resolve(Source::new(name, text), &library, Forms::Read);
            Exercise {
                name: name.into(),
                path: None,
                library: library.clone(),
                read: read.map(Arc::new).map_err(|found| headlines(&found)),
                digests: BTreeMap::new(),
            }
        });
        let mut shelf = Shelf {
            exercises: shipped.into(),
            chosen: 0,
            is_sought: false,
            folder: folder.display().to_string(),
            complaint: None,
        };
        if !folder.as_os_str().is_empty() {
            match lesson::scenario_files(folder) {
                Ok(files) => shelf.exercises.extend(files.iter().map(|path| from_file(path))),
                Err(failed) => shelf.complaint = Some(failed.to_string()),
            }
        }
        shelf
    }

    /// Puts one more file on the shelf and chooses it.
    pub fn choose_file(&mut self, path: &Path) {
        self.exercises.push(from_file(path));
        self.chosen = self.exercises.len() - 1;
        self.is_sought = true;
    }

    /// Puts a scan in the place of the chosen exercise's teeth.
    pub fn replace_teeth(&mut self, scan: &Scan) {
        let Some(exercise) = self.exercises.get_mut(self.chosen) else { return };
        if let Ok(scenario) = &mut exercise.read {
            match scan.replace_teeth(Arc::make_mut(scenario)) {
                Ok(()) => drop(exercise.digests.insert("tooth".into(), scan.digest().into())),
                Err(failed) => exercise.read = Err(failed.to_string()),
            }
        }
    }

    /// Chooses a file, which is put on the shelf where it is not there yet.
    pub fn find_file(&mut self, path: &Path) {
        match self.exercises.iter().position(|exercise| exercise.path.as_deref() == Some(path)) {
            Some(place) => (self.chosen, self.is_sought) = (place, true),
            None => self.choose_file(path),
        }
    }

    pub fn exercise(&self) -> Option<&Exercise> {
        self.exercises.get(self.chosen)
    }
}

/// The text of an exercise that ships within the program.
pub fn shipped_text(name: &str) -> Option<&'static str> {
    SHIPPED.iter().find(|(own, _)| *own == name).map(|(_, text)| *text)
}

fn from_file(path: &Path) -> Exercise {
    let read = lesson::read(path, Forms::Read).map(Arc::new).map_err(|found| headlines(&found));
    Exercise {
        name: path.display().to_string(),
        path: Some(path.to_path_buf()),
        library: lesson::library_for(path),
        read,
        digests: BTreeMap::new(),
    }
}

/// The list. Asks for one, or for another folder.
pub fn shelf_ui(ui: &mut egui::Ui, shelf: &mut Shelf, words: &Words, asked: &mut Vec<Command>) {
    look::column(ui, |ui| {
        ui.heading(words.of("shelf.title"));
        ui.label(words.of("shelf.about"));
        ui.add_space(16.0);
        let room = (ui.available_height() - 180.0).max(160.0);
        egui::ScrollArea::vertical().max_height(room).auto_shrink([false, true]).show(ui, |ui| {
            for (place, exercise) in shelf.exercises.iter().enumerate() {
                let card = exercise_ui(ui, exercise, place, shelf.chosen == place, asked);
                if card.gained_focus() || (shelf.is_sought && shelf.chosen == place) {
                    card.scroll_to_me(None);
                }
            }
            shelf.is_sought = false;
        });
        ui.add_space(16.0);
        let is_sound = shelf.exercise().is_some_and(|e| e.read.is_ok());
        ui.horizontal(|ui| {
            if ui.add_enabled(is_sound, look::main_button(words.of("shelf.open"))).clicked() {
                asked.push(Command::Open);
            }
            for (key, command) in [("shelf.edit", Command::EditExercise), ("shelf.new", Command::NewExercise)] {
                let button = ui.button(words.of(key));
                author::mark(ui, key, button.rect);
                if button.clicked() {
                    asked.push(command);
                }
            }
        });
        ui.horizontal_wrapped(|ui| {
            let label = ui.label(words.of("shelf.folder")).id;
            let edit = egui::TextEdit::singleline(&mut shelf.folder).desired_width(260.0);
            let typed = ui.add(edit.hint_text(words.of("shelf.folder_hint"))).labelled_by(label);
            if typed.lost_focus() && ui.input(|input| input.key_pressed(egui::Key::Enter)) {
                asked.push(Command::LookInto(shelf.folder.clone().into()));
            }
        });
        if let Some(complaint) = &shelf.complaint {
            ui.colored_label(look::WRONG, complaint);
        }
    });
}

fn exercise_ui(
    ui: &mut egui::Ui,
    exercise: &Exercise,
    place: usize,
    is_chosen: bool,
    asked: &mut Vec<Command>,
) -> egui::Response {
    let (title, about, colour) = match &exercise.read {
        Ok(scenario) => (scenario.title.as_str(), scenario.summary.as_str(), None),
        Err(complaint) => (exercise.name.as_str(), complaint.as_str(), Some(look::WRONG)),
    };
    let fill = if is_chosen { look::ACCENT.gamma_multiply(0.14) } else { egui::Color32::WHITE };
    let edge = if is_chosen {
        egui::Stroke::new(2.0, look::ACCENT)
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
    card.widget_info(|| egui::WidgetInfo::selected(egui::Role::Button, true, is_chosen, title));
    if card.clicked() {
        asked.push(Command::Choose(place));
    }
    if card.double_clicked() {
        asked.push(Command::Open);
    }
    if card.has_focus() {
        ui.painter().rect_stroke(card.rect, 8, egui::Stroke::new(2.0, look::ACCENT), egui::StrokeKind::Outside);
    }
    ui.add_space(4.0);
    card
}
