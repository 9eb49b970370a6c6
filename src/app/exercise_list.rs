//! The exercise list: every exercise that can be selected.

use crate::GivenExercise;
use crate::i18n::Translations;
use crate::session_history::SessionHistory;
use crate::settings::Settings;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use typodont_exercise::scenario;
use typodont_exercise::scenario::{ResolveMode, Scenario};
use typodont_formats::Library;
use typodont_formats::diagnostic::{SourceText, headlines};
use typodont_lesson::{self as lesson, ToothScan};
use typodont_report::bundle::sha256;

/// Exercises built into the program, in the order of the course, so that they are available wherever it is installed.
const SHIPPED: [(&str, &str); 17] = [
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
    ("16-arch-diagnosis.json", include_str!("../../scenarios/16-arch-diagnosis.json")),
    ("17-mouth-diagnosis.json", include_str!("../../scenarios/17-mouth-diagnosis.json")),
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
    /// State of an exercise that was opened or written in a page.
    pub opened: Option<OpenedExercise>,
}

/// An exercise that was opened or written in a page, which has no file of it.
#[derive(Clone)]
pub struct OpenedExercise {
    pub source: Arc<SourceText>,
    /// The text without the changes that are not saved: that of the file, or that with which a new exercise began.
    pub first_text: String,
    /// True if `first_text` is that of a file.
    pub is_saved: bool,
    /// Identifies the exercise and its draft.
    pub key: PathBuf,
    /// True if the changes are kept nowhere but here.
    pub is_unkept: bool,
}

impl OpenedExercise {
    /// An exercise as a file has it.
    pub fn of_file(source: Arc<SourceText>) -> OpenedExercise {
        let (first_text, key) = (source.text.clone(), OpenedExercise::key_of_file(&source.name, &source.text));
        OpenedExercise { source, first_text, is_saved: true, key, is_unkept: false }
    }

    /// Identifies a file by its name and content: a page sees no path.
    pub fn key_of_file(name: &str, text: &str) -> PathBuf {
        const DIGITS: usize = 16;
        PathBuf::from(format!("{name} {}", &sha256(text.as_bytes())[..DIGITS]))
    }
}

impl Exercise {
    fn of_source(source: Arc<SourceText>, library: Library) -> Exercise {
        let read = scenario::resolve(source.clone(), &library, ResolveMode::ReadScans);
        Exercise {
            name: source.name.clone(),
            path: None,
            library,
            scenario: read.map(Arc::new).map_err(|found| headlines(&found)),
            digests: BTreeMap::new(),
            opened: None,
        }
    }

    /// True for an exercise that is built into the program.
    fn is_shipped(&self) -> bool {
        self.path.is_none() && self.opened.is_none()
    }

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
    /// True for a page that was opened for one exercise: it has no way to others, nor to the author's screen.
    pub is_only: bool,
    pub selected: usize,
    /// True if the list is to scroll to the selected exercise.
    pub scroll_to_selected: bool,
    /// The folder as it is being typed.
    pub folder: String,
    /// Reason why the folder, or a file that was opened, could not be read.
    pub complaint: Option<String>,
}

impl ExerciseList {
    /// True if the exercise of this id in the list has this digest; `None` if the list has none of this id.
    pub fn has_same(&self, id: &str, sha256: &str) -> Option<bool> {
        let own = self.exercises.iter().filter_map(|exercise| exercise.scenario.as_ref().ok());
        own.filter(|scenario| scenario.id == id).map(|scenario| scenario.sha256 == sha256).reduce(|a, b| a || b)
    }

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
                opened: None,
            }
        });
        let mut list = ExerciseList {
            exercises: shipped.into(),
            is_only: false,
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
        ExerciseList {
            exercises: vec![Exercise::of_source(given.source, given.library)],
            is_only: true,
            selected: 0,
            scroll_to_selected: false,
            folder: String::new(),
            complaint: None,
        }
    }

    /// Adds an exercise that was opened or written in a page and selects it, in place of the one with the key `replaced` or its
    /// own key.
    pub fn put_opened(&mut self, opened: OpenedExercise, library: Library, replaced: Option<&Path>) {
        let is_same = |old: &OpenedExercise| Some(old.key.as_path()) == replaced || old.key == opened.key;
        let place = self.exercises.iter().position(|old| old.opened.as_ref().is_some_and(is_same));
        let exercise = Exercise { opened: Some(opened.clone()), ..Exercise::of_source(opened.source, library) };
        match place {
            Some(place) => (self.exercises[place], self.selected) = (exercise, place),
            None => {
                self.exercises.push(exercise);
                self.selected = self.exercises.len() - 1;
            }
        }
        self.scroll_to_selected = true;
    }

    /// True if changes of an exercise are kept nowhere but in this list.
    pub fn has_unkept(&self) -> bool {
        self.exercises.iter().any(|exercise| exercise.opened.as_ref().is_some_and(|opened| opened.is_unkept))
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
        let shipped = self.exercises.iter().filter(|exercise| exercise.is_shipped());
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
        let is_waiting = settings.introduction_first && place > 0 && asked.is_shipped();
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

    /// Selects the exercise that follows the one with this id, if there is one.
    pub fn select_after(&mut self, id: &str) {
        if self.select_id(id) {
            self.selected = (self.selected + 1).min(self.exercises.len() - 1);
        }
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
        opened: None,
    }
}
