//! The exercise being edited: its draft, its file, its built workpiece and the complaints about it.

use crate::editor::build_worker::{BuildJob, BuildResult, BuildWorker};
use crate::editor::editor_command::EditorCommand;
use crate::editor::editor_section::EditorSection;
use crate::editor::preview::PreviewState;
use crate::exercise_list::OpenedExercise;
use crate::platform;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use typodont_author::{
    EditError, ExerciseDraft, FieldKind, FileStamp, Overwrite, SaveError, SchemaForm, arch_tooth, default_entry, read,
    save, surface_location,
};
use typodont_core::frame::Vec3;
use typodont_exercise::catalog::{InstrumentEntry, InstrumentTable, TissueEntry, TissueTable};
use typodont_exercise::scenario;
use typodont_exercise::scenario::file::SurfaceFile;
use typodont_exercise::scenario::{ResolveMode, Scenario};
use typodont_formats::Library;
use typodont_formats::diagnostic::{Diagnostic, SourceText};
use typodont_lesson::{library_for, scenario_files};

/// Interval at which the file is checked for changes made elsewhere, s.
const FILE_POLL_S: f64 = 1.0;

/// Delay after the last change before the draft is saved automatically beside the settings, s.
const AUTOSAVE_DELAY_S: f64 = 1.0;

/// Folder that stands for that of the shipped exercises, which have no path.
const SHIPPED: &str = "/shipped";

/// The listed teeth of an arch.
pub const ARCH_TEETH: &str = "/scene/dental_arch/teeth";

/// Stands for a new exercise that was never saved.
const NEW: &str = "new";

pub struct EditorState {
    pub draft: ExerciseDraft,
    /// File in which the exercise is saved; `None` while it is new.
    pub path: Option<PathBuf>,
    /// Stands for an exercise without a path, a copy of a shipped one or one of a page; names the automatically saved draft.
    copied_from: Option<PathBuf>,
    /// Key under which a page's list has the exercise.
    list_key: Option<PathBuf>,
    /// Name of the file that a page opened or saved.
    opened_name: Option<String>,
    /// The text without unsaved changes, in a page.
    first_text: String,
    /// True if the last change could not be saved as a draft.
    is_draft_lost: bool,
    /// The text of the file as it was last read or written.
    saved_text: Option<String>,
    file_stamp: Option<FileStamp>,
    /// Finds the files that the exercise names.
    pub library: Library,
    /// Folder of the automatically saved drafts; without one none are saved.
    drafts_folder: Option<PathBuf>,
    pub form: SchemaForm,
    pub tissues: Vec<TissueEntry>,
    pub instruments: Vec<InstrumentEntry>,
    pub questionnaires: Vec<String>,
    pub section: EditorSection,
    /// The selected decay: index of the tooth, and index in that tooth's list.
    pub selected_decay: (usize, usize),
    pub preview: PreviewState,
    worker: BuildWorker,
    job_number: u64,
    /// Identifies the wanted build. It is compared with the last full build, so that the same tooth is not built twice.
    wanted_build: String,
    last_build: String,
    pub seed: u64,
    /// The last build, of the newest text that could be built.
    pub build: Option<BuildResult>,
    pub complaints: Vec<Diagnostic>,
    /// True if the complaints are those of the present text.
    pub is_checked: bool,
    pub dialog: Option<Dialog>,
    /// Result of the last action, or the reason why it failed: a key of the language file and its argument.
    pub notice: Option<(&'static str, String)>,
    /// The file is only shown here; another program edits it.
    pub is_read_only: bool,
    file_polled_at: f64,
    changed_at: f64,
    is_autosaved: bool,
}

/// A dialog over the author's screen.
pub enum Dialog {
    /// Asks for the path to save to; holds the path as it is being typed.
    SaveAs(String),
    /// Asks for permission to overwrite the existing file.
    ConfirmOverwrite(PathBuf),
    /// The file was changed by another program or person; holds the new text.
    FileChanged(String),
    /// Shows the results of a check.
    CheckResults,
}

/// Editing here, or display only.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum OpenMode {
    Edit,
    ReadOnly,
}

impl EditorState {
    /// A new exercise with this text; an unsaved draft of an earlier run is restored.
    pub fn new(text: String, drafts_folder: Option<PathBuf>, wake: Box<dyn Fn() + Send>) -> EditorState {
        EditorState::from_text(text, None, Library::shipped(), drafts_folder, wake).with_restored_draft()
    }

    /// A copy of a shipped exercise, which is saved elsewhere; an unsaved draft of an earlier run is restored.
    pub fn copy(name: &str, text: &str, drafts_folder: Option<PathBuf>, wake: Box<dyn Fn() + Send>) -> EditorState {
        let mut editor = EditorState::from_text(text.to_string(), None, Library::shipped(), drafts_folder, wake);
        editor.copied_from = Some(Path::new(SHIPPED).join(name));
        editor.with_restored_draft()
    }

    /// An exercise of a page's list, with its unsaved changes as a step that can be undone; if it has none, an unsaved draft of an
    /// earlier visit is restored.
    pub fn opened(opened: &OpenedExercise, library: Library, wake: Box<dyn Fn() + Send>) -> EditorState {
        let OpenedExercise { source, first_text, is_saved, key, .. } = opened;
        let mut editor = EditorState::from_text(first_text.clone(), None, library, None, wake);
        editor.saved_text = is_saved.then(|| first_text.clone());
        editor.opened_name = is_saved.then(|| source.name.clone());
        (editor.copied_from, editor.list_key) = (Some(key.clone()), Some(key.clone()));
        if source.text == *first_text {
            return editor.with_restored_draft();
        }
        editor.draft.replace(source.text.clone());
        editor.is_autosaved = false;
        editor.request_build();
        editor
    }

    /// The exercise as a page's list has it, and the key of the one whose place it takes there.
    pub fn to_opened(&self) -> (OpenedExercise, Option<&Path>) {
        let opened = OpenedExercise {
            source: SourceText::new(self.file_name(), self.draft.text()),
            first_text: self.first_text.clone(),
            is_saved: self.saved_text.is_some(),
            key: self.draft_path().map_or(PathBuf::from(NEW), Path::to_path_buf),
            is_unkept: self.has_unsaved_draft(),
        };
        (opened, self.list_key.as_deref())
    }

    /// True if a page's list has this exercise, or will have it because something was changed.
    pub fn is_for_list(&self) -> bool {
        self.list_key.is_some() || self.draft.can_undo()
    }

    /// Opens a file; an unsaved draft of an earlier run is restored unless the file is read-only.
    ///
    /// # Errors
    /// The complaint if the file cannot be read.
    pub fn open(
        path: &Path,
        mode: OpenMode,
        drafts_folder: Option<PathBuf>,
        wake: Box<dyn Fn() + Send>,
    ) -> Result<EditorState, Diagnostic> {
        let (text, stamp) = read(path)?;
        let mut editor =
            EditorState::from_text(text.clone(), Some(path.to_path_buf()), library_for(path), drafts_folder, wake);
        (editor.saved_text, editor.file_stamp) = (Some(text), Some(stamp));
        editor.is_read_only = mode == OpenMode::ReadOnly;
        Ok(if editor.is_read_only { editor } else { editor.with_restored_draft() })
    }

    /// Restores the automatically saved draft, if there is one, as a step that can be undone.
    fn with_restored_draft(mut self) -> EditorState {
        let draft = platform::load_draft(self.drafts_folder.as_deref(), self.draft_path());
        if let Some(kept) = draft.filter(|kept| kept != self.draft.text()) {
            self.draft.replace(kept);
            self.notice = Some(("author.brought_back", String::new()));
            self.request_build();
        }
        self
    }

    /// The path that identifies the automatically saved draft: the file, or what stands for an exercise without one.
    fn draft_path(&self) -> Option<&Path> {
        self.path.as_deref().or(self.copied_from.as_deref())
    }

    fn from_text(
        text: String,
        path: Option<PathBuf>,
        library: Library,
        drafts_folder: Option<PathBuf>,
        wake: Box<dyn Fn() + Send>,
    ) -> EditorState {
        let mut editor = EditorState {
            draft: ExerciseDraft::new(text.clone()),
            path,
            copied_from: None,
            list_key: None,
            opened_name: None,
            first_text: text,
            is_draft_lost: false,
            saved_text: None,
            file_stamp: None,
            tissues: TissueTable::read(&library).map(|table| table.entries().to_vec()).unwrap_or_default(),
            instruments: InstrumentTable::read(&library).map(|t| t.entries().to_vec()).unwrap_or_default(),
            questionnaires: questionnaire_names(),
            library,
            drafts_folder,
            form: SchemaForm::default(),
            section: EditorSection::Exercise,
            selected_decay: (0, 0),
            preview: PreviewState::default(),
            worker: BuildWorker::start(wake),
            job_number: 0,
            wanted_build: String::new(),
            last_build: String::new(),
            seed: 0,
            build: None,
            complaints: Vec::new(),
            is_checked: false,
            dialog: None,
            notice: None,
            is_read_only: false,
            file_polled_at: 0.0,
            changed_at: 0.0,
            is_autosaved: true,
        };
        editor.request_build();
        editor
    }

    /// True while the text differs from that of the file.
    pub fn is_unsaved(&self) -> bool {
        self.saved_text.as_deref() != Some(self.draft.text())
    }

    /// JSON pointers to the exercise's teeth.
    pub fn tooth_pointers(&self) -> Vec<String> {
        let all = ["/scene/tooth", "/scene/jaw/tooth", "/scene/pair/left", "/scene/pair/right"];
        let listed = self.draft.value_at(ARCH_TEETH).and_then(Value::as_array).map_or(0, Vec::len);
        let single = all.into_iter().map(String::from).filter(|at| self.draft.value_at(at).is_some());
        single.chain((0..listed).map(|index| format!("{ARCH_TEETH}/{index}"))).collect()
    }

    /// JSON pointer to the selected decay.
    pub fn selected_decay_pointer(&self) -> Option<String> {
        let at = format!("{}/decay/{}", self.tooth_pointers().get(self.selected_decay.0)?, self.selected_decay.1);
        self.draft.value_at(&at).is_some().then_some(at)
    }

    /// The name under which complaints cite the file.
    fn name(&self) -> String {
        self.path.as_ref().map_or("new.json".to_string(), |path| path.display().to_string())
    }

    /// The scenario of the present text.
    ///
    /// # Errors
    /// All complaints if the text is not a valid scenario.
    pub fn scenario(&self) -> Result<Scenario, Vec<Diagnostic>> {
        scenario::resolve(SourceText::new(self.name(), self.draft.text()), &self.library, ResolveMode::ReadScans)
    }

    /// Takes over finished builds and changes of the file. `now`: time since the window opened, s.
    pub fn poll(&mut self, now: f64) {
        while let Some(event) = self.worker.next_event(now) {
            if event.number == self.job_number {
                if let Some(complaints) = event.complaints {
                    self.complaints = complaints;
                }
                self.is_checked |= event.is_last;
                if let Some(build) = event.result {
                    if !build.is_quick {
                        self.last_build = self.wanted_build.clone();
                    }
                    self.preview.update(&build);
                    self.build = Some(build);
                }
            }
        }
        if !self.is_autosaved {
            if self.changed_at == 0.0 {
                self.changed_at = now;
            } else if now - self.changed_at > AUTOSAVE_DELAY_S {
                self.autosave();
            }
        }
        if now - self.file_polled_at > FILE_POLL_S {
            self.file_polled_at = now;
            self.poll_file();
        }
    }

    /// Loads a text that was changed elsewhere; asks first if unsaved changes would be lost.
    fn poll_file(&mut self) {
        let Some((path, stamp)) = self.path.clone().zip(self.file_stamp.as_mut()) else { return };
        match stamp.poll_change(&path) {
            None => {}
            Some(Err(complaint)) => self.notice = Some(("author.gone", complaint.message)),
            Some(Ok(text)) if text == self.draft.text() => self.saved_text = Some(text),
            Some(Ok(text)) if self.is_unsaved() => self.dialog = Some(Dialog::FileChanged(text)),
            Some(Ok(text)) => self.reload(text),
        }
    }

    fn reload(&mut self, text: String) {
        self.draft.replace(text.clone());
        self.saved_text = Some(text);
        self.notice = Some(("author.shown_anew", String::new()));
        self.discard_autosave();
        self.request_build();
    }

    /// Submits the newest text to be checked and built.
    fn request_build(&mut self) {
        self.job_number += 1;
        self.is_checked = false;
        let parts =
            ["/scene", "/new_tissues"].map(|at| self.draft.value_at(at).map(Value::to_string).unwrap_or_default());
        self.wanted_build = format!("{parts:?} {} {:?}", self.seed, self.path);
        let job = BuildJob {
            number: self.job_number,
            source: SourceText::new(self.name(), self.draft.text()),
            library: self.library.clone(),
            seed: self.seed,
            builds_tooth: self.wanted_build != self.last_build,
        };
        self.worker.submit(job);
    }

    /// Saves unsaved changes as a draft beside the settings. Also called when the window closes.
    pub fn autosave(&mut self) {
        if self.is_read_only {
            return;
        }
        self.is_autosaved = true;
        if self.is_unsaved() && self.draft.can_undo() {
            let (folder, path) = (self.drafts_folder.as_deref(), self.draft_path());
            let stored = platform::store_draft(folder, path, self.draft.text());
            self.is_draft_lost = stored.is_err();
            if let Err(why) = stored {
                self.notice = Some(("author.failed", why));
            }
        } else {
            self.discard_autosave();
        }
    }

    fn discard_autosave(&mut self) {
        (self.is_autosaved, self.is_draft_lost) = (true, false);
        // A read-only view has no draft of its own: an existing one belongs to the author.
        if !self.is_read_only {
            platform::remove_draft(self.drafts_folder.as_deref(), self.draft_path());
        }
    }

    /// Carries out every command except those that concern other screens.
    pub fn execute(&mut self, command: EditorCommand) {
        let before = self.draft.text().to_string();
        let mut result = Ok(());
        match command {
            EditorCommand::ShowSection(part) => self.section = part,
            EditorCommand::SetValue(pointer, value) => result = self.draft.set(&pointer, &value),
            EditorCommand::RemoveValue(pointer) => result = self.draft.remove(&pointer),
            EditorCommand::AddDefault(pointer) => result = self.add_default(&pointer),
            EditorCommand::PushEntry(list, value) => result = self.draft.push(&list, &value),
            EditorCommand::SwapEntries(list, a, b) => result = self.draft.swap(&list, a, b),
            EditorCommand::SetToothNumber(fdi) => result = self.set_tooth_number(fdi),
            EditorCommand::SelectDecay(tooth, place) => self.selected_decay = (tooth, place),
            EditorCommand::PlaceDecay(point, outward) => result = self.place_decay(point, outward),
            EditorCommand::MoveSlices(point) => self.preview.slice_point = point,
            EditorCommand::Reroll => self.reroll(),
            EditorCommand::SetPreviewMode(way) => self.preview.mode = way,
            EditorCommand::ShowSurroundings(is_shown) => self.preview.shows_surroundings = is_shown,
            EditorCommand::ReplaceText(text) => self.draft.type_text(text),
            EditorCommand::Undo => self.draft.undo(),
            EditorCommand::Redo => self.draft.redo(),
            EditorCommand::Save => self.save_or_ask_path(),
            EditorCommand::ShowSaveAs(true) => self.show_save_as(),
            EditorCommand::TypePath(path) => {
                if let Some(Dialog::SaveAs(typed)) = &mut self.dialog {
                    *typed = path;
                }
            }
            EditorCommand::SaveAs(path) => self.save(path, false),
            EditorCommand::SaveOverExisting(path) => self.save(path, true),
            EditorCommand::ReloadFromDisk => self.reload_from_disk(),
            EditorCommand::Check => self.dialog = Some(Dialog::CheckResults),
            EditorCommand::ShowSaveAs(false) | EditorCommand::CloseCheck | EditorCommand::KeepLocal => {
                self.dialog = None
            }
            // Carried out by the application itself.
            EditorCommand::TestRun | EditorCommand::Leave => {}
        }
        if let Err(error) = result {
            self.notice = Some(("author.failed", error.to_string()));
        }
        if self.draft.text() != before {
            (self.is_autosaved, self.changed_at) = (false, 0.0);
            self.notice = None;
            self.request_build();
        }
    }

    /// Adds a list entry, or an optional value, with its default content.
    fn add_default(&mut self, pointer: &str) -> Result<(), EditError> {
        let new = default_entry(&self.form, self.draft.value(), pointer);
        let kind = self.form.schema_at(pointer).map(|schema| self.form.field(schema).kind);
        let is_list = matches!(kind, Some(FieldKind::List { .. }));
        if is_list { self.draft.push(pointer, &new) } else { self.draft.set(pointer, &new) }
    }

    /// Sets the FDI number of the tooth with the selected decay, or of the first tooth.
    fn set_tooth_number(&mut self, fdi: u8) -> Result<(), EditError> {
        let teeth = self.tooth_pointers();
        let Some(tooth) = teeth.get(self.selected_decay.0).or(teeth.first()) else { return Ok(()) };
        let (number, id) = (format!("{tooth}/fdi"), format!("{tooth}/id"));
        let former = self.draft.value_at(&number).map(Value::to_string);
        if tooth.starts_with(ARCH_TEETH) && self.draft.value_at(&id).and_then(Value::as_str) == former.as_deref() {
            // A tooth of an arch that is named by its number keeps a name that no other tooth has.
            return self.draft.set_all(&number, &[(number.clone(), json!(fdi)), (id, json!(fdi.to_string()))]);
        }
        self.draft.set(&number, &json!(fdi))
    }

    fn reroll(&mut self) {
        self.seed += 1;
        self.request_build();
    }

    /// True until the last change is saved as a draft.
    pub fn has_unsaved_draft(&self) -> bool {
        !self.is_autosaved || self.is_draft_lost
    }

    /// True if the tooth of the present text is still to be built.
    pub fn is_tooth_pending(&self) -> bool {
        !self.is_checked && self.wanted_build != self.last_build
    }

    /// True if the build goes on only with further frames.
    pub fn needs_frames(&self) -> bool {
        self.worker.needs_frames()
    }

    /// Name of the file in which the exercise is saved, without a folder.
    pub fn file_name(&self) -> String {
        let name = self.path.as_ref().and_then(|path| path.file_name());
        let name = name.map(|name| name.to_string_lossy().into_owned()).or(self.opened_name.clone());
        let id = self.draft.value_at("/id").and_then(Value::as_str).unwrap_or("exercise");
        name.unwrap_or_else(|| format!("{id}.json"))
    }

    /// Saves in the exercise's file; asks for a path if it has none. A page has the browser save it.
    fn save_or_ask_path(&mut self) {
        match self.path.clone() {
            Some(path) => self.save(path, false),
            None if platform::IS_PAGE => self.download(),
            None => self.show_save_as(),
        }
    }

    /// Has the browser save the text.
    fn download(&mut self) {
        let name = self.file_name();
        match platform::download_text(&name, self.draft.text()) {
            Some(why) => self.notice = Some(("author.failed", why)),
            None => {
                self.discard_autosave();
                self.first_text = self.draft.text().to_string();
                self.saved_text = Some(self.first_text.clone());
                self.copied_from = Some(OpenedExercise::key_of_file(&name, &self.first_text));
                self.opened_name = Some(name.clone());
                self.notice = Some(("author.saved", name));
            }
        }
    }

    /// Takes over the text that was changed elsewhere, and closes the dialog that offers it.
    fn reload_from_disk(&mut self) {
        if let Some(Dialog::FileChanged(text)) = self.dialog.take() {
            self.reload(text);
        }
    }

    /// Moves the selected decay to the point (tooth space, mm) that was clicked; adds one if there is none.
    fn place_decay(&mut self, point: Vec3, outward: Vec3) -> Result<(), EditError> {
        self.preview.slice_point = point;
        let Some(build) = &self.build else { return Ok(()) };
        let Some(tooth) = build.workpiece.nearest_tooth(point) else { return Ok(()) };
        let place = &build.workpiece.teeth[tooth];
        let listed = self.tooth_pointers();
        let has_number = |at: &String| self.draft.value_at(&format!("{at}/fdi")) == Some(&json!(place.fdi));
        let tooth = match self.draft.value_at(ARCH_TEETH) {
            None => tooth,
            // The build may be of an older text, in which other teeth were listed.
            Some(_) => listed.iter().position(has_number).unwrap_or(listed.len()),
        };
        let at = match listed.get(tooth) {
            Some(at) => at.clone(),
            // A tooth of an arch that is not listed yet.
            None if self.draft.value_at(ARCH_TEETH).is_none() => return Ok(()),
            None => {
                self.draft.push(ARCH_TEETH, &arch_tooth(self.draft.value(), place.fdi))?;
                format!("{ARCH_TEETH}/{tooth}")
            }
        };
        let location = surface_location(place, point, outward);
        if self.selected_decay.0 != tooth || self.selected_decay_pointer().is_none() {
            self.selected_decay = (tooth, 0);
        }
        let decay = format!("{at}/decay/{}", self.selected_decay.1);
        if self.draft.value_at(&decay).is_none() {
            let list = format!("{at}/decay");
            self.draft.push(&list, &default_entry(&self.form, self.draft.value(), &list))?;
        }
        let tenths = location.offset.map(|mm| (f64::from(mm) * 10.0).round() / 10.0);
        // Fissures exist on the occlusal surface only: a decay that follows one stays there.
        let is_fissure = self.draft.value_at(&format!("{decay}/shape/fissure")).is_some();
        let surface = if is_fissure { SurfaceFile::O } else { location.surface };
        let values = [
            (format!("{decay}/surface"), json!(format!("{surface:?}"))),
            (format!("{decay}/at"), json!({ "offset_mm": tenths })),
        ];
        self.draft.set_all(&decay, &values)
    }

    fn show_save_as(&mut self) {
        let id = self.draft.value_at("/id").and_then(Value::as_str).unwrap_or("exercise");
        let name = format!("{id}.json");
        let suggested = match &self.path {
            Some(path) => path.clone(),
            None => exercises_folder().join(name),
        };
        self.dialog = Some(Dialog::SaveAs(suggested.display().to_string()));
    }

    fn save(&mut self, path: PathBuf, overwrites: bool) {
        let is_own = self.path.as_ref() == Some(&path);
        let overwrite = match &self.file_stamp {
            _ if overwrites => Overwrite::Always,
            Some(stand) if is_own => Overwrite::IfUnchanged(stand),
            _ => Overwrite::Never,
        };
        // Only the folder that was suggested is created: a mistyped path shall not leave folders behind. If it cannot be
        // created, writing the file fails and reports it.
        if path.parent() == Some(&exercises_folder()) {
            let _ = std::fs::create_dir_all(exercises_folder());
        }
        self.dialog = None;
        match save(&path, self.draft.text(), overwrite) {
            Ok(stamp) => {
                self.discard_autosave();
                self.library = library_for(&path);
                self.notice = Some(("author.saved", path.display().to_string()));
                (self.saved_text, self.file_stamp) = (Some(self.draft.text().to_string()), Some(stamp));
                self.path = Some(path);
                // The files that the exercise names are now looked for beside its new path.
                self.request_build();
            }
            Err(SaveError::Taken(path)) => self.dialog = Some(Dialog::ConfirmOverwrite(path)),
            Err(why) => self.notice = Some(("author.failed", why.to_string())),
        }
    }

    /// Name and title of each tissue, of the table and of the exercise itself.
    pub fn tissue_names(&self) -> Vec<(String, String)> {
        let own = self.draft.value_at("/new_tissues").and_then(Value::as_array).into_iter().flatten();
        let own = own.filter_map(|entry| {
            let name = entry.get("name")?.as_str()?;
            let title = entry.get("title").and_then(base_text).unwrap_or(name);
            Some((name.to_string(), title.to_string()))
        });
        self.tissues.iter().map(|entry| (entry.name.clone(), entry.title.to_string())).chain(own).collect()
    }

    /// The `id` of every entry in the lists at the given JSON pointers.
    pub fn ids(&self, lists: &[String]) -> Vec<String> {
        let all = lists.iter().filter_map(|list| self.draft.value_at(list)?.as_array()).flatten();
        all.filter_map(|entry| entry.get("id")?.as_str().map(str::to_string)).collect()
    }

    /// Returns the ids of the draws of all stages.
    pub fn draw_ids(&self) -> Vec<String> {
        let stages = self.draft.value_at("/stages").and_then(|stages| stages.as_array()).into_iter().flatten();
        stages.filter_map(|stage| stage.pointer("/draw/id")?.as_str().map(str::to_string)).collect()
    }
}

/// Folder that is suggested for an author's new exercises.
fn exercises_folder() -> PathBuf {
    platform::documents_folder().unwrap_or_default().join("Typodont").join("exercises")
}

/// The text of a value that is a text, or texts by language; English if it is among them.
fn base_text(value: &Value) -> Option<&str> {
    let by_language = || value.as_object().and_then(|texts| texts.get("en").or(texts.values().next()));
    value.as_str().or_else(|| by_language()?.as_str())
}

/// Names of the shipped questionnaires and of those in the folder in which the program runs.
fn questionnaire_names() -> Vec<String> {
    let found = scenario_files(Path::new("content/questionnaires")).unwrap_or_default();
    let mut names: Vec<String> =
        found.iter().filter_map(|path| Some(path.file_stem()?.to_str()?.to_string())).collect();
    names.push("simulator".into());
    names.sort();
    names.dedup();
    names
}
