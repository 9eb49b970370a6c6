//! The exercise on the author's desk: its draft, its file, what is made of it, and what was complained about.

use super::super::settings;
use super::Ask;
use super::asking::Asking;
use super::making::{Job, Made, Making};
use super::parts::Part;
use super::view::View;
use crate::author::{Draft, Form, Kept, Stand, Unkept, beginning, drafts, read, save, spot_of};
use crate::content::{InstrumentEntry, InstrumentTable, Library, TissueEntry, TissueTable};
use crate::diagnostic::{Diagnostic, Source};
use crate::lesson::{library_for, scenario_files};
use crate::scenario::file::SurfaceFile;
use crate::scenario::{self, Forms, Scenario};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// How often the file is looked at for somebody else's changes, s.
const LOOK_EVERY: f64 = 1.0;

/// How long a change rests before it is kept beside the settings, s.
const KEEP_AFTER: f64 = 1.0;

pub struct Authoring {
    pub draft: Draft,
    /// Where it is saved; none while it is new.
    pub path: Option<PathBuf>,
    /// Stands for the shipped exercise that a new one was copied from.
    copied: Option<PathBuf>,
    /// The text of the file as it was last read or written.
    saved: Option<String>,
    stand: Option<Stand>,
    /// Where the files that it names are found.
    pub library: Library,
    pub form: Form,
    pub tissues: Vec<TissueEntry>,
    pub instruments: Vec<InstrumentEntry>,
    pub questionnaires: Vec<String>,
    pub part: Part,
    /// The decay that is worked on: tooth and place in its list.
    pub chosen: (usize, usize),
    pub view: View,
    making: Making,
    job: u64,
    /// What the job is to make, and what was last made well: the same is not made twice, for its picture takes a while.
    wanted: String,
    made_of: String,
    pub seed: u64,
    /// What was last made, of the newest text that could be.
    pub made: Option<Made>,
    pub complaints: Vec<Diagnostic>,
    /// The complaints are those of the text as it stands.
    pub is_checked: bool,
    pub asking: Option<Asking>,
    /// What was last done, or why it was not: a key of the language's texts and what it is about.
    pub told: Option<(&'static str, String)>,
    /// Only shown, as an editor elsewhere changes it.
    pub is_watched: bool,
    looked_at: f64,
    changed_at: f64,
    is_kept: bool,
}

/// Whether the file is edited here or only shown.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Watch {
    Edit,
    Only,
}

impl Authoring {
    /// A new exercise of this text; what was once begun and not saved comes back.
    pub fn new(text: String, wake: Box<dyn Fn() + Send>) -> Authoring {
        Authoring::of(text, None, Library::shipped(), wake).brought_back()
    }

    /// One that ships: a copy, which is saved elsewhere. What was once begun with it and not saved comes back.
    pub fn copy(name: &str, text: &str, wake: Box<dyn Fn() + Send>) -> Authoring {
        let mut authoring = Authoring::of(text.to_string(), None, Library::shipped(), wake);
        authoring.copied = Some(Path::new("/shipped").join(name));
        authoring.brought_back()
    }

    /// A file.
    pub fn open(path: &Path, watch: Watch, wake: Box<dyn Fn() + Send>) -> Result<Authoring, Diagnostic> {
        let (text, stand) = read(path)?;
        let mut authoring = Authoring::of(text.clone(), Some(path.to_path_buf()), library_for(path), wake);
        (authoring.saved, authoring.stand) = (Some(text), Some(stand));
        authoring.is_watched = watch == Watch::Only;
        Ok(if authoring.is_watched { authoring } else { authoring.brought_back() })
    }

    /// With the text that was not saved the last time, if there is one: a step that can be taken back.
    fn brought_back(mut self) -> Authoring {
        let kept = folder().and_then(|folder| drafts::find(&folder, self.drafted()));
        if let Some(kept) = kept.filter(|kept| kept != self.draft.text()) {
            self.draft.replace(kept);
            self.told = Some(("author.brought_back", String::new()));
            self.make();
        }
        self
    }

    /// What its draft is kept by: its file, or the shipped one that it was copied from.
    fn drafted(&self) -> Option<&Path> {
        self.path.as_deref().or(self.copied.as_deref())
    }

    fn of(text: String, path: Option<PathBuf>, library: Library, wake: Box<dyn Fn() + Send>) -> Authoring {
        let mut authoring = Authoring {
            draft: Draft::of(text),
            path,
            copied: None,
            saved: None,
            stand: None,
            tissues: TissueTable::read(&library).map(|table| table.entries().to_vec()).unwrap_or_default(),
            instruments: InstrumentTable::read(&library).map(|t| t.entries().to_vec()).unwrap_or_default(),
            questionnaires: questionnaires(),
            library,
            form: Form::default(),
            part: Part::Exercise,
            chosen: (0, 0),
            view: View::default(),
            making: Making::begin(wake),
            job: 0,
            wanted: String::new(),
            made_of: String::new(),
            seed: 0,
            made: None,
            complaints: Vec::new(),
            is_checked: false,
            asking: None,
            told: None,
            is_watched: false,
            looked_at: 0.0,
            changed_at: 0.0,
            is_kept: true,
        };
        authoring.make();
        authoring
    }

    /// True while the text is another than the file's.
    pub fn is_unsaved(&self) -> bool {
        self.saved.as_deref() != Some(self.draft.text())
    }

    /// The pointers to the exercise's teeth.
    pub fn teeth(&self) -> Vec<&'static str> {
        let all = ["/scene/tooth", "/scene/jaw/tooth", "/scene/pair/left", "/scene/pair/right"];
        all.into_iter().filter(|at| self.draft.at(at).is_some()).collect()
    }

    /// The pointer to the decay that is worked on.
    pub fn chosen_decay(&self) -> Option<String> {
        let at = format!("{}/decay/{}", self.teeth().get(self.chosen.0)?, self.chosen.1);
        self.draft.at(&at).is_some().then_some(at)
    }

    /// The name by which the file's complaints call it.
    fn name(&self) -> String {
        self.path.as_ref().map_or("new.json".to_string(), |path| path.display().to_string())
    }

    /// The scenario as it stands, if nothing is wrong with it.
    pub fn scenario(&self) -> Result<Scenario, Vec<Diagnostic>> {
        scenario::resolve(Source::new(self.name(), self.draft.text()), &self.library, Forms::Read)
    }

    /// Takes over what was made and what happened to the file. `now`: since the window opened, s.
    pub fn follow(&mut self, now: f64) {
        while let Some(news) = self.making.next_news() {
            if news.number == self.job {
                if let Some(complaints) = news.complaints {
                    self.complaints = complaints;
                }
                self.is_checked |= news.is_over;
                if let Some(made) = news.made {
                    if !made.is_quick {
                        self.made_of = self.wanted.clone();
                    }
                    self.view.take(&made);
                    self.made = Some(made);
                }
            }
        }
        if !self.is_kept {
            if self.changed_at == 0.0 {
                self.changed_at = now;
            } else if now - self.changed_at > KEEP_AFTER {
                self.keep();
            }
        }
        if now - self.looked_at > LOOK_EVERY {
            self.looked_at = now;
            self.look_at_file();
        }
    }

    /// What somebody else made of the file is shown; asked about first where something of one's own would be lost.
    fn look_at_file(&mut self) {
        let Some((path, stand)) = self.path.clone().zip(self.stand.as_mut()) else { return };
        match stand.changed(&path) {
            None => {}
            Some(Err(complaint)) => self.told = Some(("author.gone", complaint.message)),
            Some(Ok(text)) if text == self.draft.text() => self.saved = Some(text),
            Some(Ok(text)) if self.is_unsaved() => self.asking = Some(Asking::Changed(text)),
            Some(Ok(text)) => self.take_over(text),
        }
    }

    fn take_over(&mut self, text: String) {
        self.draft.replace(text.clone());
        self.saved = Some(text);
        self.told = Some(("author.shown_anew", String::new()));
        self.forget();
        self.make();
    }

    /// Lets the newest text be checked and made.
    fn make(&mut self) {
        self.job += 1;
        self.is_checked = false;
        let parts = ["/scene", "/new_tissues"].map(|at| self.draft.at(at).map(Value::to_string).unwrap_or_default());
        self.wanted = format!("{parts:?} {} {:?}", self.seed, self.path);
        let job = Job {
            number: self.job,
            source: Source::new(self.name(), self.draft.text()),
            library: self.library.clone(),
            seed: self.seed,
            makes: self.wanted != self.made_of,
        };
        self.making.ask(job);
    }

    /// Keeps what is not saved beside the settings. Called when the window closes, too.
    pub fn keep(&mut self) {
        let Some(folder) = folder().filter(|_| !self.is_watched) else { return };
        self.is_kept = true;
        if self.is_unsaved() && self.draft.can_undo() {
            if let Err(why) = drafts::keep(&folder, self.drafted(), self.draft.text()) {
                self.told = Some(("author.failed", why));
            }
        } else {
            self.forget();
        }
    }

    fn forget(&mut self) {
        self.is_kept = true;
        // Who only looks on has no draft: one that is there is the author's.
        if let Some(folder) = folder().filter(|_| !self.is_watched) {
            drafts::forget(&folder, self.drafted());
        }
    }

    /// Everything but what concerns other screens.
    pub fn carry_out(&mut self, ask: Ask) {
        let before = self.draft.text().to_string();
        let done = match ask {
            Ask::Show(part) => {
                self.part = part;
                Ok(())
            }
            Ask::Set(pointer, value) => self.draft.set(&pointer, &value),
            Ask::Remove(pointer) => self.draft.remove(&pointer),
            Ask::Add(pointer) => {
                let new = beginning(&self.form, self.draft.value(), &pointer);
                let is_list = matches!(
                    self.form.at(&pointer).map(|schema| self.form.field(schema).kind),
                    Some(crate::author::Kind::List { .. })
                );
                if is_list { self.draft.push(&pointer, &new) } else { self.draft.set(&pointer, &new) }
            }
            Ask::Push(list, value) => self.draft.push(&list, &value),
            Ask::Swap(list, a, b) => self.draft.swap(&list, a, b),
            Ask::Tooth(fdi) => match self.teeth().get(self.chosen.0).or(self.teeth().first()) {
                Some(tooth) => self.draft.set(&format!("{tooth}/fdi"), &json!(fdi)),
                None => Ok(()),
            },
            Ask::Choose(tooth, place) => {
                self.chosen = (tooth, place);
                Ok(())
            }
            Ask::Point(point, outward) => self.point(point, outward),
            Ask::CutAt(point) => {
                self.view.cut = point;
                Ok(())
            }
            Ask::DrawAnew => {
                self.seed += 1;
                self.make();
                Ok(())
            }
            Ask::Look(way) => {
                self.view.way = way;
                Ok(())
            }
            Ask::ShowAround(is_shown) => {
                self.view.has_around = is_shown;
                Ok(())
            }
            Ask::Write(text) => {
                self.draft.write(text);
                Ok(())
            }
            Ask::Undo => {
                self.draft.undo();
                Ok(())
            }
            Ask::Redo => {
                self.draft.redo();
                Ok(())
            }
            Ask::Save => {
                match self.path.clone() {
                    Some(path) => self.save(path, false),
                    None => self.ask_where(),
                }
                Ok(())
            }
            Ask::Where(true) => {
                self.ask_where();
                Ok(())
            }
            Ask::Where(false) | Ask::CloseCheck => {
                self.asking = None;
                Ok(())
            }
            Ask::SaveAs(path) => {
                self.save(path, false);
                Ok(())
            }
            Ask::SaveOver(path) => {
                self.save(path, true);
                Ok(())
            }
            Ask::TakeTheirs => {
                if let Some(Asking::Changed(text)) = self.asking.take() {
                    self.take_over(text);
                }
                Ok(())
            }
            Ask::KeepMine => {
                self.asking = None;
                Ok(())
            }
            Ask::Check => {
                self.asking = Some(Asking::Checked);
                Ok(())
            }
            // The desk's own.
            Ask::Try | Ask::Leave => Ok(()),
        };
        if let Err(unfit) = done {
            self.told = Some(("author.failed", unfit.to_string()));
        }
        if self.draft.text() != before {
            (self.is_kept, self.changed_at) = (false, 0.0);
            self.told = None;
            self.make();
        }
    }

    /// Puts the decay that is worked on where somebody pointed; a first one where there is none.
    fn point(&mut self, point: crate::frame::Vec3, outward: crate::frame::Vec3) -> Result<(), crate::author::Unfit> {
        self.view.cut = point;
        let Some(made) = &self.made else { return Ok(()) };
        // Of two teeth side by side the left one has y > 0.
        let tooth = usize::from(made.workpiece.teeth.len() == 2 && point.y <= 0.0);
        let Some((place, &at)) = made.workpiece.teeth.get(tooth).zip(self.teeth().get(tooth)) else { return Ok(()) };
        let spot = spot_of(place, point, outward);
        if self.chosen.0 != tooth || self.chosen_decay().is_none() {
            self.chosen = (tooth, 0);
        }
        let decay = format!("{at}/decay/{}", self.chosen.1);
        if self.draft.at(&decay).is_none() {
            let list = format!("{at}/decay");
            self.draft.push(&list, &beginning(&self.form, self.draft.value(), &list))?;
        }
        let tenths = spot.offset.map(|mm| (f64::from(mm) * 10.0).round() / 10.0);
        // Grooves are in the chewing surface only: what follows one stays there.
        let is_fissure = self.draft.at(&format!("{decay}/shape/fissure")).is_some();
        let surface = if is_fissure { SurfaceFile::O } else { spot.surface };
        let values = [
            (format!("{decay}/surface"), json!(format!("{surface:?}"))),
            (format!("{decay}/at"), json!({ "offset_mm": tenths })),
        ];
        self.draft.set_all(&decay, &values)
    }

    fn ask_where(&mut self) {
        let id = self.draft.at("/id").and_then(Value::as_str).unwrap_or("exercise");
        let name = format!("{id}.json");
        let suggested = match &self.path {
            Some(path) => path.clone(),
            None => exercises_folder().join(name),
        };
        self.asking = Some(Asking::Where(suggested.display().to_string()));
    }

    fn save(&mut self, path: PathBuf, is_over: bool) {
        let is_own = self.path.as_ref() == Some(&path);
        let over = match &self.stand {
            _ if is_over => Kept::Anything,
            Some(stand) if is_own => Kept::Known(stand),
            _ => Kept::New,
        };
        if let Some(folder) = path.parent().filter(|_| !is_own) {
            // A folder that cannot be made is said by the file that cannot be written.
            let _ = std::fs::create_dir_all(folder);
        }
        self.asking = None;
        match save(&path, self.draft.text(), over) {
            Ok(stand) => {
                self.forget();
                self.library = library_for(&path);
                self.told = Some(("author.saved", path.display().to_string()));
                (self.saved, self.stand) = (Some(self.draft.text().to_string()), Some(stand));
                self.path = Some(path);
                // Files that it names are looked for beside it now.
                self.make();
            }
            Err(Unkept::Taken(path)) => self.asking = Some(Asking::Over(path)),
            Err(why) => self.told = Some(("author.failed", why.to_string())),
        }
    }

    /// What was made is to be drawn again by a painter that has drawn something else since.
    pub fn come_back(&mut self) {
        self.view.forget_picture();
    }

    /// Tissues of the table and of the exercise itself.
    pub fn tissue_names(&self) -> Vec<(String, String)> {
        let own = self.draft.at("/new_tissues").and_then(Value::as_array).into_iter().flatten();
        let own = own.filter_map(|entry| {
            let name = entry.get("name")?.as_str()?;
            Some((name.to_string(), entry.get("title").and_then(Value::as_str).unwrap_or(name).to_string()))
        });
        self.tissues.iter().map(|entry| (entry.name.clone(), entry.title.clone())).chain(own).collect()
    }

    /// Names of everything with an id in the lists at some pointers.
    pub fn ids(&self, lists: &[String]) -> Vec<String> {
        let all = lists.iter().filter_map(|list| self.draft.at(list)?.as_array()).flatten();
        all.filter_map(|entry| entry.get("id")?.as_str().map(str::to_string)).collect()
    }
}

/// Where drafts are kept.
fn folder() -> Option<PathBuf> {
    settings::folder().map(|folder| folder.join("drafts"))
}

/// Where an author's exercises go unless told otherwise.
fn exercises_folder() -> PathBuf {
    let dirs = directories::UserDirs::new();
    let home = dirs.as_ref().map(|dirs| dirs.document_dir().unwrap_or(dirs.home_dir()).to_path_buf());
    home.unwrap_or_default().join("Typodont").join("exercises")
}

/// Those that ship, and those of the folder in which the program runs.
fn questionnaires() -> Vec<String> {
    let found = scenario_files(Path::new("content/questionnaires")).unwrap_or_default();
    let mut names: Vec<String> =
        found.iter().filter_map(|path| Some(path.file_stem()?.to_str()?.to_string())).collect();
    names.push("simulator".into());
    names.sort();
    names.dedup();
    names
}
