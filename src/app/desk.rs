//! The desk: which screen is shown, and everything that happens when one of them asks for it.

use super::author::{self, Ask, Authoring, Watch};
use super::chair::{Hand, Order};
use super::command::{Command, Screen};
use super::diary::Diary;
use super::language::{self, Words};
use super::results::{Results, results_ui};
use super::settings::{self, Settings, settings_ui};
use super::shelf::{self, Shelf, shelf_ui};
use super::sitting::{Sitting, Way};
use super::told::OfSecond;
use super::viewport::Viewport;
use super::{Options, briefing, keys, look, practice, questionnaire, viewport};
use crate::audio::{Output, Replacements};
use crate::author::new_exercise;
use crate::content::{Library, sounds};
use crate::diagnostic::headlines;
use crate::lesson;
use crate::scenario::Scenario;
use crate::session::Input;
use eframe::egui::{self, ViewportCommand};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

pub struct Desk {
    options: Options,
    settings: Settings,
    languages: Vec<Words>,
    words: Words,
    shelf: Shelf,
    participant: String,
    screen: Screen,
    /// The exercise that is tried, to come back to.
    tried_from: Option<Box<Authoring>>,
    open: keys::Open,
    closing: Closing,
    /// A widget had the keys when the last picture was finished.
    had_focus: bool,
    /// Settings changed and are not kept yet.
    is_unkept: bool,
    /// What went wrong beside the screen's own affairs.
    complaints: Vec<String>,
    diary: Diary,
    /// A graphics processor draws, not this one.
    has_graphics: bool,
    /// Sounds that the school brought.
    replacements: Replacements,
    /// Made for the first lesson, kept for the next.
    viewport: Option<Viewport>,
    pictures: u64,
}

/// How far somebody has come with closing the window.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Closing {
    No,
    /// Asked whether to give the lesson up.
    Asked,
    /// As soon as its bundle is made.
    AfterLesson,
}

/// How soon the next picture of a running lesson is wanted.
const NEXT_PICTURE: Duration = Duration::from_millis(16);

/// How soon a screen looks again for something that it waits for.
const NEXT_LOOK: Duration = Duration::from_millis(100);

impl Desk {
    pub fn new(context: &eframe::CreationContext, options: Options) -> Desk {
        let ctx = &context.egui_ctx;
        let (settings, complaint) = Settings::read();
        let folder = settings::folder().map(|folder| folder.join("languages"));
        let (languages, mut complaints) = language::all(folder.as_deref());
        complaints.extend(complaint);
        let (replacements, broken) = sounds::read(&sounds_folder());
        complaints.extend((!broken.is_empty()).then(|| headlines(&broken)));
        look::wear(ctx, &settings);
        let mut shelf = Shelf::stock(&settings.exercises);
        let mut screen = Screen::Shelf;
        if let Some(path) = &options.exercise {
            shelf.choose_file(path);
            if let Some(scan) = &options.tooth {
                shelf.replace_teeth(scan);
            }
            if shelf.exercise().is_some_and(|e| e.read.is_ok()) {
                screen = Screen::Briefing;
            }
        }
        let begins = options.begins;
        let mut desk = Desk {
            words: language::choose(&languages, &settings.language),
            participant: options.participant.clone(),
            options,
            settings,
            languages,
            shelf,
            screen,
            tried_from: None,
            open: keys::Open::default(),
            closing: Closing::No,
            had_focus: false,
            is_unkept: false,
            complaints,
            diary: Diary::from_environment(),
            replacements,
            has_graphics: context.wgpu_render_state.as_ref().is_some_and(viewport::has_graphics),
            viewport: None,
            pictures: 0,
        };
        match (desk.options.author, desk.options.exercise.clone()) {
            (Some(watch), Some(path)) => desk.open_author(&path, watch, ctx),
            _ if begins => desk.begin(ctx),
            _ => {}
        }
        desk
    }

    /// Takes over what happened since the last picture.
    fn follow(&mut self, ctx: &egui::Context) {
        if let Screen::Author(authoring) = &mut self.screen {
            authoring.follow(ctx.input(|input| input.time));
        }
        let Screen::Lesson(sitting) = &mut self.screen else { return };
        let was_held = sitting.is_pointer_held;
        sitting.follow(self.settings.volume, ctx.input(|input| input.unstable_dt));
        if was_held && !sitting.is_pointer_held {
            hold(ctx, false);
        }
        let end = sitting.end.take();
        if end.is_some() {
            hold(ctx, false);
        }
        match end {
            Some(Ok(bundle)) => match Results::read(bundle, ctx) {
                Ok(results) => self.screen = Screen::Results(Box::new(results)),
                Err(why) => self.screen = Screen::Failed(why),
            },
            Some(Err(why)) => self.screen = Screen::Failed(why),
            None => {}
        }
    }

    fn carry_out(&mut self, command: Command, ctx: &egui::Context) {
        match command {
            Command::Choose(place) => self.shelf.chosen = place,
            Command::ChooseNext(by) => {
                let last = self.shelf.exercises.len().saturating_sub(1);
                self.shelf.chosen = self.shelf.chosen.saturating_add_signed(by as isize).min(last);
                self.shelf.is_sought = true;
            }
            Command::Open if self.shelf.exercise().is_some_and(|e| e.read.is_ok()) => self.screen = Screen::Briefing,
            Command::Open => {}
            Command::LookInto(folder) => {
                self.shelf = Shelf::stock(&folder);
                self.set(Settings { exercises: folder, ..self.settings.clone() }, ctx);
            }
            Command::ToShelf if self.tried_from.is_some() => {
                if let Some(mut authoring) = self.tried_from.take() {
                    authoring.come_back();
                    self.screen = Screen::Author(authoring);
                }
            }
            Command::ToShelf => {
                if !matches!(self.screen, Screen::Briefing) {
                    // The next one at this desk is somebody else.
                    self.participant = self.options.participant.clone();
                }
                self.screen = Screen::Shelf;
            }
            Command::Begin => self.begin(ctx),
            Command::NewExercise => self.write_new(ctx),
            Command::EditExercise => self.edit_chosen(ctx),
            Command::Author(Ask::Try) => self.try_out(ctx),
            Command::Author(Ask::Leave) => self.leave_author(),
            Command::Author(ask) => {
                if let Screen::Author(authoring) = &mut self.screen {
                    authoring.carry_out(ask);
                }
            }
            Command::ShowReport => {
                if let Screen::Results(results) = &self.screen
                    && let Some(page) = results.page()
                {
                    ctx.open_url(egui::OpenUrl::new_tab(page));
                }
            }
            Command::ShowKeys(is_open) => self.open_over(keys::Open { keys: is_open, settings: false }, ctx),
            Command::ShowSettings(is_open) => self.open_over(keys::Open { keys: false, settings: is_open }, ctx),
            Command::Close(is_closing) => self.close(is_closing, ctx),
            Command::Set(settings) => self.set(*settings, ctx),
            other => match &mut self.screen {
                Screen::Lesson(sitting) => carry_out_in(sitting, other, ctx),
                Screen::Author(authoring) => carry_out_at_author(authoring, &other),
                _ => {}
            },
        }
    }

    /// Shows one page over the screen, or none. Whoever reads has no instrument in the hand.
    fn open_over(&mut self, open: keys::Open, ctx: &egui::Context) {
        self.open = open;
        if let Screen::Lesson(sitting) = &mut self.screen
            && sitting.is_pointer_held
        {
            sitting.let_go();
            hold(ctx, false);
        }
    }

    /// Gives the lesson up and closes the window when its bundle is made, or goes on.
    fn close(&mut self, is_closing: bool, ctx: &egui::Context) {
        self.closing = Closing::No;
        match &mut self.screen {
            _ if !is_closing => {}
            Screen::Lesson(sitting) => {
                sitting.give_up();
                self.closing = Closing::AfterLesson;
            }
            _ => ctx.send_viewport_cmd(ViewportCommand::Close),
        }
    }

    /// The author's screen with a new exercise, in the person's language.
    fn write_new(&mut self, ctx: &egui::Context) {
        let words = &self.words;
        let lines = ["author.new_cleared", "author.new_spared", "author.new_light"].map(|key| words.of(key));
        let [title, stage, instruction] =
            ["author.new_title", "author.new_stage", "author.new_instruction"].map(|key| words.of(key));
        let text = new_exercise(title, stage, instruction, lines, words.of("author.new_fail"));
        self.screen = Screen::Author(Box::new(Authoring::new(text, wake(ctx))));
    }

    /// The chosen exercise; of one that ships within the program a copy.
    fn edit_chosen(&mut self, ctx: &egui::Context) {
        let Some(exercise) = self.shelf.exercise() else { return };
        match (exercise.path.clone(), shelf::shipped_text(&exercise.name)) {
            (Some(path), _) => self.open_author(&path, Watch::Edit, ctx),
            (None, Some(text)) => {
                self.screen = Screen::Author(Box::new(Authoring::copy(&exercise.name, text, wake(ctx))));
            }
            (None, None) => {}
        }
    }

    fn open_author(&mut self, path: &Path, watch: Watch, ctx: &egui::Context) {
        self.screen = match Authoring::open(path, watch, wake(ctx)) {
            Ok(authoring) => Screen::Author(Box::new(authoring)),
            Err(complaint) => Screen::Failed(complaint.headline()),
        };
    }

    /// Back to the shelf, where the exercise stands now. What is not saved is kept.
    fn leave_author(&mut self) {
        let Screen::Author(authoring) = &mut self.screen else { return };
        authoring.keep();
        let path = authoring.path.clone();
        self.shelf = Shelf::stock(&self.settings.exercises);
        if let Some(path) = path {
            self.shelf.find_file(&path);
        }
        self.screen = Screen::Shelf;
    }

    /// A lesson of what is being written, to come back from. Its bundle replaces that of the try before.
    fn try_out(&mut self, ctx: &egui::Context) {
        let Screen::Author(authoring) = &mut self.screen else { return };
        authoring.keep();
        let scenario = match authoring.scenario() {
            Ok(scenario) => scenario,
            Err(_) => return authoring.carry_out(Ask::Check),
        };
        let library = authoring.library.clone();
        let out = settings::folder().unwrap_or_else(std::env::temp_dir).join("tried");
        let _ = std::fs::remove_dir_all(&out);
        let left = std::mem::replace(&mut self.screen, Screen::Shelf);
        if let Screen::Author(authoring) = left {
            self.tried_from = Some(authoring);
        }
        self.begin_with(Arc::new(scenario), library, BTreeMap::new(), out, ctx);
    }

    /// Answers whoever closes the window: not in the middle of a lesson, and not before its bundle is made.
    fn hear_close(&mut self, ctx: &egui::Context) {
        let is_in_lesson = matches!(self.screen, Screen::Lesson(_));
        if ctx.input(|input| input.viewport().close_requested())
            && let Screen::Author(authoring) = &mut self.screen
        {
            authoring.keep();
        }
        if ctx.input(|input| input.viewport().close_requested()) && is_in_lesson {
            ctx.send_viewport_cmd(ViewportCommand::CancelClose);
            if self.closing == Closing::No {
                self.open_over(keys::Open::default(), ctx);
                self.closing = Closing::Asked;
            }
        }
        if self.closing == Closing::AfterLesson && !is_in_lesson {
            ctx.send_viewport_cmd(ViewportCommand::Close);
        }
    }

    fn begin(&mut self, ctx: &egui::Context) {
        let Some(exercise) = self.shelf.exercise() else { return };
        let (Ok(scenario), library) = (&exercise.read, exercise.library.clone()) else { return };
        if !lesson::is_code(&self.participant) {
            return;
        }
        let (scenario, digests, out) = (scenario.clone(), exercise.digests.clone(), self.options.out.clone());
        self.begin_with(scenario, library, digests, out, ctx);
    }

    fn begin_with(
        &mut self,
        scenario: Arc<Scenario>,
        library: Library,
        digests: BTreeMap<String, String>,
        out: PathBuf,
        ctx: &egui::Context,
    ) {
        let hand = match self.options.device.as_deref().unwrap_or(&self.settings.device) {
            "mouse" => Hand::Mouse,
            device => match lesson::open(device) {
                Ok(held) => Hand::Device(held),
                Err(failed) => {
                    self.screen = Screen::Failed(failed.to_string());
                    return;
                }
            },
        };
        let started = jiff::Timestamp::now();
        let order = Order {
            scenario,
            seed: self.options.seed.unwrap_or_else(|| lesson::seed_from(started)),
            participant: self.participant.clone(),
            out,
            templates: self.options.templates.clone(),
            started,
            hand,
            second: self.options.second.clone(),
            digests,
            wake: wake(ctx),
        };
        self.diary.note("seed", order.seed);
        let output = Output { seed: order.seed, replacements: self.replacements.clone(), ..Output::default() };
        let way = if self.has_graphics { Way::Iso } else { Way::Surface };
        self.screen = match Sitting::begin(order, library, output, way) {
            Ok(sitting) => Screen::Lesson(Box::new(sitting)),
            Err(why) => Screen::Failed(why),
        };
    }

    fn set(&mut self, settings: Settings, ctx: &egui::Context) {
        self.words = language::choose(&self.languages, &settings.language);
        if settings.font_size == self.settings.font_size {
            look::wear(ctx, &settings);
        }
        self.settings = settings;
        self.is_unkept = true;
    }

    /// Keeps what was changed, once the mouse has let go of it: a size that changed under the mouse would run away from it.
    fn keep_settings(&mut self, ctx: &egui::Context) {
        if self.is_unkept && !ctx.input(|input| input.pointer.any_down()) {
            look::wear(ctx, &self.settings);
            self.complaints.extend(self.settings.keep());
            self.is_unkept = false;
        }
    }

    fn screen_ui(&mut self, ui: &mut egui::Ui, frame: &eframe::Frame, asked: &mut Vec<Command>) {
        let is_tried = self.tried_from.is_some();
        let Desk { screen, shelf, words, settings, participant, viewport, .. } = self;
        match screen {
            Screen::Shelf => shelf_ui(ui, shelf, words, asked),
            Screen::Author(authoring) => {
                if let (None, Some(state)) = (&viewport, frame.wgpu_render_state()) {
                    *viewport = Some(Viewport::new(state));
                }
                author::author_ui(ui, authoring, viewport.as_mut(), words, asked);
            }
            Screen::Briefing => {
                if let Some(Ok(scenario)) = shelf.exercise().map(|exercise| &exercise.read) {
                    briefing::briefing_ui(ui, scenario, participant, words, asked);
                }
            }
            Screen::Lesson(sitting) if sitting.are_stages_over && !sitting.is_handed_in => {
                questionnaire::questionnaire_ui(ui, sitting, words, asked);
                sitting.is_statement_new = false;
            }
            Screen::Lesson(sitting) if sitting.are_stages_over || sitting.is_scoring => look::column(ui, |ui| {
                ui.heading(words.of("practice.scoring"));
                look::waiting(ui);
            }),
            Screen::Lesson(sitting) => {
                if let (None, Some(state)) = (&viewport, frame.wgpu_render_state()) {
                    *viewport = Some(Viewport::new(state));
                }
                practice::practice_ui(ui, sitting, settings, viewport.as_mut(), words, asked);
            }
            Screen::Results(results) => results_ui(ui, results, is_tried, words, asked),
            Screen::Failed(why) => look::column(ui, |ui| {
                ui.heading(words.of("desk.failed"));
                ui.label(why.as_str());
                ui.add_space(12.0);
                if ui.add(look::main_button(words.of("results.again"))).clicked() {
                    asked.push(Command::ToShelf);
                }
            }),
        }
    }

    /// What lies over the screen: keys, settings, complaints.
    fn over_ui(&self, ctx: &egui::Context, asked: &mut Vec<Command>) {
        let words = &self.words;
        if self.open.keys {
            page(ctx, words.of("keys.title"), |ui| keys::keys_ui(ui, words, asked));
        }
        if self.open.settings {
            page(ctx, words.of("settings.title"), |ui| {
                settings_ui(ui, &self.settings, self.has_graphics, &self.languages, words, asked);
            });
        }
        if self.closing == Closing::Asked {
            page(ctx, words.of("desk.close"), |ui| {
                ui.label(words.of("practice.give_up_sure"));
                ui.add_space(8.0);
                ui.horizontal(|ui| {
                    for (key, is_closing) in [("desk.close_yes", true), ("practice.give_up_no", false)] {
                        if ui.button(words.of(key)).clicked() {
                            asked.push(Command::Close(is_closing));
                        }
                    }
                });
            });
        }
    }

    /// A line per change for whoever cannot see the screen.
    fn note(&mut self) {
        let Desk { diary, screen, shelf, open, closing, pictures, .. } = self;
        diary.note(
            "over",
            if open.keys {
                "keys"
            } else if open.settings {
                "settings"
            } else if *closing == Closing::Asked {
                "close"
            } else {
                "nothing"
            },
        );
        match screen {
            Screen::Shelf => {
                diary.note("screen", "shelf");
                diary.note("chosen", shelf.exercise().map_or("", |e| e.id()));
            }
            Screen::Author(authoring) => {
                note_author(diary, authoring);
                diary.note("turn", *pictures);
            }
            Screen::Briefing => diary.note("screen", "briefing"),
            Screen::Lesson(sitting) => note_lesson(diary, sitting),
            Screen::Results(results) => {
                diary.note("bundle", results.bundle.display());
                diary.note("screen", "results");
            }
            Screen::Failed(why) => diary.note("screen", format!("failed {why}")),
        }
    }
}

/// A page over the screen that takes the keys and the pointer for itself.
fn page(ctx: &egui::Context, title: &str, contents: impl FnOnce(&mut egui::Ui)) {
    let room = ctx.content_rect().size() - egui::vec2(80.0, 120.0);
    let height = room.y.max(200.0);
    let frame = egui::Frame::popup(&ctx.global_style()).inner_margin(24);
    egui::Modal::new(egui::Id::unique(title)).frame(frame).show(ctx, |ui| {
        ui.heading(title);
        ui.add_space(10.0);
        // As high as it needs to be, up to the window's own height.
        egui::ScrollArea::vertical().max_height(height).min_scrolled_height(height).show(ui, contents);
    });
}

fn note_author(diary: &mut Diary, authoring: &Authoring) {
    diary.note("part", format!("{:?}", authoring.part));
    diary.note("file", authoring.path.as_ref().map_or(String::new(), |path| path.display().to_string()));
    diary.note("unsaved", authoring.is_unsaved());
    diary.note("complaints", authoring.complaints.len());
    diary.note("checked", authoring.is_checked);
    diary.note("teeth", authoring.view.generation);
    diary.note("told", authoring.told.as_ref().map_or("", |(key, _)| key));
    let chosen = authoring.chosen_decay().and_then(|at| Some(authoring.draft.at(&at)?.to_string()));
    diary.note("decay", chosen.unwrap_or_default());
    diary.note("screen", "author");
}

/// What wakes the window from another thread.
fn wake(ctx: &egui::Context) -> Box<dyn Fn() + Send> {
    let ctx = ctx.clone();
    Box::new(move || ctx.request_repaint())
}

/// What moves the camera at the author's screen.
fn carry_out_at_author(authoring: &mut Authoring, command: &Command) {
    let orbit = authoring.view.orbit;
    authoring.view.orbit = match *command {
        Command::Turn { right, up } => orbit.turned(right, up),
        Command::Nearer(factor) => orbit.zoomed(factor),
        Command::Shift { right, up } => orbit.panned(right, up),
        _ => orbit,
    };
}

fn note_lesson(diary: &mut Diary, sitting: &Sitting) {
    if sitting.is_scoring {
        diary.note("screen", "scoring");
    } else if sitting.are_stages_over {
        diary.note("statement", sitting.statement);
        diary.note("rated", sitting.ratings.len());
        diary.note("screen", "questionnaire");
    } else {
        diary.note("screen", if sitting.stage.is_some() { "practice" } else { "making" });
    }
    diary.note("pointer", if sitting.is_pointer_held { "held" } else { "free" });
    diary.note("paused", sitting.is_paused);
    if let Some(OfSecond::MayJoin(address)) = sitting.second {
        diary.note("may_join", address);
    }
    diary.note("view", format!("{:.4} {:.4}", sitting.orbit.turn, sitting.orbit.tilt));
    if let Some(matter) = &sitting.matter {
        diary.note("open", matter.open);
        let specks = matter.field.as_ref().map_or((0, 0), |field| (field.grains().len(), field.drops().len()));
        diary.note("dust", specks.0);
        diary.note("water", specks.1);
        diary.note("tooth", if matter.is_new { "made" } else { "drawn" });
    }
    diary.note("shown", format!("{:?}", sitting.shown));
    if let Some(seen) = sitting.seen {
        let [x, y, z] = seen.hand.to_array();
        diary.note("hand", format!("{x:.2} {y:.2} {z:.2}"));
        let [x, y, z] = seen.tip.to_array();
        diary.note("tip", format!("{x:.2} {y:.2} {z:.2}"));
        diary.note("cleared", format!("{:.0}", seen.cleared_pct.unwrap_or_default()));
        diary.note("instrument", seen.instrument);
        diary.note("ticks", seen.beats.ticks);
        diary.note("late", format!("{} {} {}", seen.beats.late_p99, seen.beats.late_max, seen.beats.missed));
    }
}

/// What is asked for in a lesson.
fn carry_out_in(sitting: &mut Sitting, command: Command, ctx: &egui::Context) {
    match command {
        Command::Take(instrument) => sitting.say(Input::Take { instrument }),
        Command::Answer(question, value) => sitting.answer(question, value),
        Command::Chart(sign) => sitting.note(sign),
        Command::Confirm => sitting.confirm(),
        Command::Pause(is_paused) => {
            sitting.pause(is_paused);
            hold(ctx, sitting.is_pointer_held);
        }
        Command::GiveUp(is_giving_up) => sitting.is_giving_up = is_giving_up,
        Command::Abort => sitting.give_up(),
        Command::Adjust(label, coefficient, value) => sitting.adjust(label, coefficient, value),
        Command::Show(way) => sitting.shown = way,
        Command::Draw(curves) => {
            if let Some(matter) = &mut sitting.matter {
                matter.curves = *curves;
                sitting.shown = Way::Drawn;
            }
        }
        Command::HoldPointer(is_held) => {
            sitting.is_pointer_held = is_held && sitting.has_mouse() && !sitting.is_paused;
            if !is_held {
                sitting.let_go();
            }
            hold(ctx, sitting.is_pointer_held);
        }
        Command::CentrePointer(at) => ctx.send_viewport_cmd(ViewportCommand::CursorPosition(at)),
        Command::MoveHand { right, down } => {
            if let Some(mouse) = sitting.mouse() {
                mouse.moved(right, down, sitting.orbit.world_from_view());
            }
        }
        Command::MoveDeeper(steps) => {
            if let Some(mouse) = sitting.mouse() {
                mouse.wheel(steps, sitting.orbit.world_from_view());
            }
        }
        Command::PressHandle { bit, is_down } => {
            if let Some(mouse) = sitting.mouse() {
                mouse.button(bit, is_down);
            }
        }
        Command::OpenMouth(by) => {
            if let Some(matter) = &mut sitting.matter {
                matter.open_mouth(by);
            }
        }
        Command::Look(view) => {
            if let Some(orbit) = sitting.matter.as_ref().and_then(|matter| view.orbit(matter)) {
                sitting.orbit = orbit;
            }
        }
        Command::Turn { right, up } => sitting.orbit = sitting.orbit.turned(right, up),
        Command::Nearer(factor) => sitting.orbit = sitting.orbit.zoomed(factor),
        Command::Shift { right, up } => sitting.orbit = sitting.orbit.panned(right, up),
        Command::Rate(item, value) => {
            sitting.rate(item, value);
        }
        Command::NextStatement(by) => sitting.next_statement(by),
        Command::HandIn if sitting.open_statements() > 0 && !sitting.is_handing_in => sitting.is_handing_in = true,
        Command::HandIn => sitting.hand_in(),
        // The others are the desk's own.
        _ => {}
    }
}

/// The school's own sounds: where the program is run, as in its sources, else in the settings' folder.
fn sounds_folder() -> PathBuf {
    let beside = PathBuf::from("content/sounds");
    match settings::folder() {
        Some(folder) if !beside.is_dir() => folder.join("sounds"),
        _ => beside,
    }
}

/// Keeps the pointer in the window and out of sight while it is the hand.
fn hold(ctx: &egui::Context, is_held: bool) {
    // X11 cannot lock a pointer, and while it is confined tells of each movement twice; there it is brought back to the middle.
    let kept = egui::CursorGrab::Locked;
    ctx.send_viewport_cmd(ViewportCommand::CursorGrab(if is_held { kept } else { egui::CursorGrab::None }));
    ctx.send_viewport_cmd(ViewportCommand::CursorVisible(!is_held));
}

impl eframe::App for Desk {
    fn clear_color(&self, visuals: &egui::Visuals) -> [f32; 4] {
        visuals.panel_fill.to_normalized_gamma_f32()
    }

    fn ui(&mut self, ui: &mut egui::Ui, frame: &mut eframe::Frame) {
        let ctx = ui.ctx().clone();
        let mut asked = Vec::new();
        self.follow(&ctx);
        self.hear_close(&ctx);
        keys::asked(&ctx, &self.screen, self.open, self.had_focus, &mut asked);
        for complaint in &self.complaints {
            ui.colored_label(look::WRONG, complaint);
        }
        self.screen_ui(ui, frame, &mut asked);
        self.over_ui(&ctx, &mut asked);
        for command in asked {
            self.carry_out(command, &ctx);
        }
        self.keep_settings(&ctx);
        self.had_focus = ctx.memory(|memory| memory.focused().is_some());
        self.pictures += 1;
        self.diary.note("pictures", self.pictures / 10);
        self.note();
        author::note_marks(&ctx, &mut self.diary);
        if let Some(wait) = self.options.slow_picture {
            std::thread::sleep(wait);
        }
        ctx.request_repaint_after(match &self.screen {
            // While the matter is made the processors are for that; when it is, the lesson's thread asks for a picture.
            Screen::Lesson(sitting) if sitting.matter.is_none() => look::WAITING_STEP,
            Screen::Lesson(sitting) if !sitting.are_stages_over => NEXT_PICTURE,
            _ => NEXT_LOOK,
        });
    }
}
