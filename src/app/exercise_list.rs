//! The exercise list: every exercise that can be selected.

use super::GivenExercise;
use super::command::AppCommand;
use super::editor;
use super::i18n::Translations;
use super::platform;
use super::session_history::{AttemptSummary, SessionHistory};
use super::settings::Settings;
use super::theme;
use eframe::egui;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use typodont_exercise::scenario;
use typodont_exercise::scenario::{ResolveMode, Scenario};
use typodont_formats::Library;
use typodont_formats::diagnostic::{SourceText, headlines};
use typodont_lesson::{self as lesson, InterruptedSession, ToothScan};

/// Exercises built into the program, in the order of the course, so that they are available wherever it is installed.
const SHIPPED: [(&str, &str); 15] = [
    ("1-introduction.json", include_str!("../../scenarios/1-introduction.json")),
    ("2-decay.json", include_str!("../../scenarios/2-decay.json")),
    ("3-detection.json", include_str!("../../scenarios/3-detection.json")),
    ("4-diagnosis.json", include_str!("../../scenarios/4-diagnosis.json")),
    ("5-grinding.json", include_str!("../../scenarios/5-grinding.json")),
    ("6-guided-tracing.json", include_str!("../../scenarios/6-guided-tracing.json")),
    ("7-spray.json", include_str!("../../scenarios/7-spray.json")),
    ("8-fissure.json", include_str!("../../scenarios/8-fissure.json")),
    ("9-stain.json", include_str!("../../scenarios/9-stain.json")),
    ("10-class-one.json", include_str!("../../scenarios/10-class-one.json")),
    ("11-class-two.json", include_str!("../../scenarios/11-class-two.json")),
    ("12-deep-caries.json", include_str!("../../scenarios/12-deep-caries.json")),
    ("13-spoon.json", include_str!("../../scenarios/13-spoon.json")),
    ("14-amalgam.json", include_str!("../../scenarios/14-amalgam.json")),
    ("15-charting.json", include_str!("../../scenarios/15-charting.json")),
];

/// File that a shipped exercise names.
const SHIPPED_PATH: (&str, &[u8]) = ("6-guided-tracing.csv", include_bytes!("../../scenarios/6-guided-tracing.csv"));

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
    /// Title in the user's language; the file's name if it is not a valid exercise.
    pub fn title<'a>(&'a self, words: &Translations) -> &'a str {
        self.scenario.as_ref().map_or(&self.name, |scenario| words.own(&scenario.texts, &scenario.title))
    }

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
        let mut library = Library::shipped();
        library.insert(SHIPPED_PATH.0, SHIPPED_PATH.1);
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
                Ok(files) => list.add_files(&files),
                Err(failed) => list.complaint = Some(failed.to_string()),
            }
        }
        list
    }

    /// A list of one exercise only.
    pub fn only(given: GivenExercise) -> ExerciseList {
        let GivenExercise { source, library } = given;
        let name = source.name.clone();
        let read = scenario::resolve(source, &library, ResolveMode::ReadScans);
        let scenario = read.map(Arc::new).map_err(|found| headlines(&found));
        let exercise = Exercise { name, path: None, library, scenario, digests: BTreeMap::new() };
        ExerciseList {
            exercises: vec![exercise],
            selected: 0,
            scroll_to_selected: false,
            folder: String::new(),
            complaint: None,
        }
    }

    /// Adds files, except those that are copies of an exercise that the list has already.
    fn add_files(&mut self, files: &[PathBuf]) {
        for path in files {
            let exercise = from_file(path);
            let digest = |exercise: &Exercise| exercise.scenario.as_ref().ok().map(|scenario| scenario.sha256.clone());
            let own = digest(&exercise);
            if own.is_none() || !self.exercises.iter().any(|other| digest(other) == own) {
                self.exercises.push(exercise);
            }
        }
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

    /// The shipped exercises in order.
    pub fn course(&self) -> Vec<&Scenario> {
        let shipped = self.exercises.iter().filter(|exercise| exercise.path.is_none());
        shipped.filter_map(|exercise| exercise.scenario.as_deref().ok()).collect()
    }

    /// The introduction, if it must be passed before the exercise at `place` opens. Only shipped exercises wait for it.
    pub fn required_before(
        &self,
        place: usize,
        history: &SessionHistory,
        participant: &str,
        settings: &Settings,
    ) -> Option<&Exercise> {
        let (first, asked) = (self.exercises.first()?, self.exercises.get(place)?);
        let is_waiting = settings.introduction_first && place > 0 && asked.path.is_none();
        let is_passed = || history.is_read() && history.summary(first.id(), participant).is_passed;
        (is_waiting && !is_passed()).then_some(first)
    }

    /// True if the selected exercise is valid and waits for no other.
    pub fn can_open_selected(&self, history: &SessionHistory, participant: &str, settings: &Settings) -> bool {
        self.selected_exercise().is_some_and(|exercise| exercise.scenario.is_ok())
            && self.required_before(self.selected, history, participant, settings).is_none()
    }

    /// Selects the exercise with this id, if there is one.
    pub fn select_id(&mut self, id: &str) -> bool {
        let place = self.exercises.iter().position(|exercise| exercise.id() == id);
        (self.selected, self.scroll_to_selected) = (place.unwrap_or(self.selected), true);
        place.is_some()
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

/// Earlier sessions, settings and texts with which the list is drawn.
pub struct ListContext<'a> {
    pub history: &'a SessionHistory,
    pub settings: &'a Settings,
    pub words: &'a Translations,
    /// True if the list has no way to the author's screen or to another folder.
    pub is_kiosk: bool,
}

/// Draws the list. Pushes a command when the user selects an exercise or another folder.
pub fn exercise_list_ui(
    ui: &mut egui::Ui,
    list: &mut ExerciseList,
    participant: &mut String,
    context: &ListContext,
    commands: &mut Vec<AppCommand>,
) {
    let words = context.words;
    theme::centered_column(ui, |ui| {
        ui.heading(words.get("shelf.title"));
        participant_ui(ui, participant, words, commands);
        if let Some(session) = context.history.interrupted() {
            interrupted_ui(ui, list, session, words, commands);
        }
        ui.add_space(8.0);
        let room = (ui.available_height() - 150.0).max(160.0);
        egui::ScrollArea::vertical().max_height(room).auto_shrink([false, true]).show(ui, |ui| {
            for (place, exercise) in list.exercises.iter().enumerate() {
                let required = list.required_before(place, context.history, participant, context.settings);
                let card = ExerciseCard {
                    place,
                    is_selected: list.selected == place,
                    summary: context.history.summary(exercise.id(), participant),
                    required: required.map(|first| first.title(words)),
                };
                let card = exercise_ui(ui, exercise, &card, words, commands);
                if card.gained_focus() || (list.scroll_to_selected && list.selected == place) {
                    card.scroll_to_me(None);
                }
            }
            list.scroll_to_selected = false;
        });
        ui.add_space(12.0);
        let is_valid = list.can_open_selected(context.history, participant, context.settings);
        ui.horizontal(|ui| {
            let open = ui.add_enabled(is_valid, theme::primary_button(words.get("shelf.open")));
            editor::anchor(ui, "shelf.open", open.rect);
            if open.clicked() {
                commands.push(AppCommand::OpenBriefing);
            }
            // The author's screen keeps files and builds teeth on a thread: a page has neither.
            let authoring = [("shelf.edit", AppCommand::EditExercise), ("shelf.new", AppCommand::NewExercise)];
            for (key, command) in authoring.into_iter().filter(|_| !platform::IS_PAGE && !context.is_kiosk) {
                let button = ui.button(words.get(key));
                editor::anchor(ui, key, button.rect);
                if button.clicked() {
                    commands.push(command);
                }
            }
        });
        if platform::IS_PAGE {
            return;
        }
        if !context.is_kiosk {
            folder_ui(ui, &mut list.folder, words, commands);
        }
        if let Some(complaint) = &list.complaint {
            ui.colored_label(theme::ERROR, complaint);
        }
    });
}

/// The field for a further folder with exercises.
fn folder_ui(ui: &mut egui::Ui, folder: &mut String, words: &Translations, commands: &mut Vec<AppCommand>) {
    ui.horizontal_wrapped(|ui| {
        let label = ui.label(words.get("shelf.folder")).id;
        let edit = egui::TextEdit::singleline(folder).desired_width(260.0);
        let typed = ui.add(edit.hint_text(words.get("shelf.folder_hint"))).labelled_by(label);
        if typed.lost_focus() && ui.input(|input| input.key_pressed(egui::Key::Enter)) {
            commands.push(AppCommand::OpenFolder(folder.clone().into()));
        }
    });
}

/// The field for the participant code, whose results the list shows.
fn participant_ui(ui: &mut egui::Ui, participant: &mut String, words: &Translations, commands: &mut Vec<AppCommand>) {
    ui.horizontal_wrapped(|ui| {
        let label = ui.label(words.get("briefing.participant")).id;
        let edit = egui::TextEdit::singleline(participant).char_limit(64).desired_width(180.0);
        ui.add(edit.hint_text(words.get("briefing.participant_hint"))).labelled_by(label);
        if !participant.is_empty() && ui.button(words.get("shelf.someone_else")).clicked() {
            commands.push(AppCommand::ChangeParticipant);
        }
    });
    if !lesson::is_valid_participant_code(participant) {
        ui.colored_label(theme::ERROR, words.get("briefing.participant_wrong"));
    }
}

/// Offers to finish a session that was interrupted.
fn interrupted_ui(
    ui: &mut egui::Ui,
    list: &ExerciseList,
    session: &InterruptedSession,
    words: &Translations,
    commands: &mut Vec<AppCommand>,
) {
    let own = list.exercises.iter().find(|exercise| exercise.id() == session.scenario_id);
    let title = own.map_or(session.scenario_id.as_str(), |own| own.title(words));
    let when = session.started.get(..16).unwrap_or_default().replace('T', " ");
    let frame = egui::Frame::NONE.stroke(egui::Stroke::new(2.0, theme::WARNING)).corner_radius(8).inner_margin(12);
    ui.add_space(8.0);
    frame.show(ui, |ui| {
        ui.set_width(ui.available_width());
        ui.strong(words.format("shelf.interrupted", format!("{title} · {when} UTC")));
        ui.label(words.get(if session.is_sealed { "shelf.interrupted_sealed" } else { "shelf.interrupted_about" }));
        ui.horizontal_wrapped(|ui| {
            let asked =
                [("shelf.finish", AppCommand::FinishInterrupted), ("shelf.aside", AppCommand::SetAsideInterrupted)];
            for (key, command) in asked.into_iter().filter(|(key, _)| *key == "shelf.aside" || !session.is_sealed) {
                let button = ui.button(words.get(key));
                editor::anchor(ui, key, button.rect);
                if button.clicked() {
                    commands.push(command);
                }
            }
        });
    });
}

/// An exercise as its card shows it, beside its own texts.
struct ExerciseCard<'a> {
    place: usize,
    is_selected: bool,
    summary: AttemptSummary,
    /// Title of the exercise that must be passed first, if any.
    required: Option<&'a str>,
}

fn exercise_ui(
    ui: &mut egui::Ui,
    exercise: &Exercise,
    card: &ExerciseCard,
    words: &Translations,
    commands: &mut Vec<AppCommand>,
) -> egui::Response {
    let (title, about, colour) = match &exercise.scenario {
        Ok(scenario) => (exercise.title(words), words.own(&scenario.texts, &scenario.summary), None),
        Err(complaint) => (exercise.name.as_str(), complaint.as_str(), Some(theme::ERROR)),
    };
    let place = card.place;
    let fill = if card.is_selected { theme::ACCENT.gamma_multiply(0.14) } else { egui::Color32::WHITE };
    let edge = if card.is_selected {
        egui::Stroke::new(2.0, theme::ACCENT)
    } else {
        egui::Stroke::new(1.0, egui::Color32::from_gray(0xdd))
    };
    let (state, state_colour) = state_of(card, words);
    let frame = egui::Frame::NONE.fill(fill).stroke(edge).corner_radius(8).inner_margin(14);
    let shown = frame.show(ui, |ui| {
        ui.set_width(ui.available_width());
        let numbered = format!("{}. {title}", place + 1);
        ui.add(egui::Label::new(egui::RichText::new(numbered).strong().size(18.0)).selectable(false));
        let about = egui::RichText::new(about);
        let about = if let Some(colour) = colour { about.color(colour) } else { about };
        ui.add(egui::Label::new(about).wrap().selectable(false));
        if colour.is_none() {
            let state = egui::RichText::new(&state).color(state_colour);
            ui.add(egui::Label::new(state).wrap().selectable(false));
        }
    });
    let response = ui.interact(shown.response.rect, ui.scope_id().with(("exercise", place)), egui::Sense::click());
    response.widget_info(|| {
        egui::WidgetInfo::selected(egui::Role::Button, true, card.is_selected, format!("{title}. {state}"))
    });
    if response.clicked() {
        commands.push(AppCommand::SelectExercise(place));
    }
    if response.double_clicked() {
        commands.push(AppCommand::OpenBriefing);
    }
    if response.has_focus() {
        ui.painter().rect_stroke(response.rect, 8, egui::Stroke::new(2.0, theme::ACCENT), egui::StrokeKind::Outside);
    }
    ui.add_space(4.0);
    response
}

/// Results of the participant at an exercise, or the condition under which it opens, with a colour.
fn state_of(card: &ExerciseCard, words: &Translations) -> (String, egui::Color32) {
    let grey = egui::Color32::from_gray(0x60);
    let AttemptSummary { count, best, last, last_date, is_passed } = &card.summary;
    let points = |(points, most): &(f64, f64)| format!("{points:.0} / {most:.0}");
    match (card.required, count) {
        (Some(first), _) => (words.format("shelf.required", first), theme::WARNING),
        (None, 0) => (words.get("shelf.not_done").to_string(), grey),
        (None, _) => {
            let mut parts = vec![words.get(if *is_passed { "shelf.passed" } else { "shelf.not_passed" }).to_string()];
            parts.extend(best.as_ref().map(|best| words.format("shelf.best", points(best))));
            parts.extend(last.as_ref().map(|last| words.format("shelf.last", points(last))));
            parts.push(words.format("shelf.attempts", count));
            parts.push(last_date.clone());
            (parts.join(" · "), if *is_passed { theme::SUCCESS } else { grey })
        }
    }
}
