//! A lesson as the window knows it: what has happened, what is seen, and what the person is about to say.

use super::chair::{Chair, News, Order, Said};
use super::questions;
use super::seen::Seen;
use super::told::{self, OfSecond, Standstill};
use super::transfer::{Curves, Histogram};
use crate::audio::{self, News as SoundNews, Output, Player};
use crate::content::{Library, Role, TissueTable};
use crate::diagnostic::Diagnostic;
use crate::frame::{Pose, Vec3};
use crate::render::{Orbit, Palette, Shown, Solid, TransferFunction};
use crate::scenario::{Layout, Scenario, Stage, Workpiece};
use crate::scene::field::{self, Field, Ground};
use crate::scene::{self, Mouth};
use crate::session::{Answer, Effect, Heard, Input, Note, Sign};
use crate::sim::Command as Tell;
use crate::touch::{Coefficient, Materials};
use crate::volume::{Label, Volume};
use std::cell::OnceCell;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

/// Most edits taken over for one picture, so that a burst of them does not stop it.
const EDITS_AT_ONCE: usize = 1 << 16;

pub struct Sitting {
    pub scenario: Arc<Scenario>,
    chair: Chair,
    player: Player,
    /// Why nothing is heard, where that is so.
    pub silence: Option<String>,
    /// Mean time between pictures, s.
    picture_seconds: f32,
    pub pictures_per_second: f32,
    /// The matter and what is drawn of it; `None` until it is made.
    pub matter: Option<Matter>,
    pub seen: Option<Seen>,
    /// The running stage; `None` before the first and after the last.
    pub stage: Option<usize>,
    pub are_stages_over: bool,
    /// Which questions of the stage are answered.
    pub answered: Vec<bool>,
    /// What is typed and not yet said, by question.
    pub drafts: BTreeMap<String, String>,
    /// What was last said, by question.
    pub said: BTreeMap<String, Answer>,
    /// Why something that was said is not taken: a key of the language's texts.
    pub refused: Option<&'static str>,
    /// Why time stands still, if it does by itself.
    pub standstill: Option<Standstill>,
    /// What was last heard of a second hand.
    pub second: Option<OfSecond>,
    pub is_paused: bool,
    /// The pointer is the hand.
    pub is_pointer_held: bool,
    pub is_giving_up: bool,
    pub orbit: Orbit,
    /// Where the instruments' pictures come from.
    library: Library,
    /// What stands in the running stage's periodontal chart.
    pub charted: Vec<Note>,
    /// What could not be drawn as the exercise asks.
    pub complaints: Vec<String>,
    pub shown: Way,
    /// How the tissues feel now, before any instrument's own factors.
    pub felt: Materials,
    /// Steps chosen on the questionnaire's scale, by statement.
    pub ratings: BTreeMap<String, u8>,
    /// The statement that a digit rates, and whether it was just come to.
    pub statement: usize,
    pub is_statement_new: bool,
    /// Asked once whether to hand in with statements open.
    pub is_handing_in: bool,
    pub is_handed_in: bool,
    pub is_scoring: bool,
    /// The bundle, or why there is none.
    pub end: Option<Result<PathBuf, String>>,
}

/// What is drawn of the lesson's matter.
pub struct Matter {
    pub workpiece: Arc<Workpiece>,
    /// The window's own copy, as far as edits have come.
    pub volume: Volume,
    pub palette: Palette,
    /// The jaws around the tooth, where the exercise has one.
    pub mouth: Option<Mouth>,
    /// How far the mouth is open, degrees.
    pub open: f32,
    /// What stands around the tooth.
    pub around: Vec<Solid>,
    pub instruments: Vec<Solid>,
    /// The dust and the water, where the exercise has any.
    pub field: Option<Field>,
    /// What takes them away, drawn.
    pub ejector: Option<Solid>,
    /// Nothing of the volume has been drawn yet.
    pub is_new: bool,
    histogram: OnceCell<Histogram>,
    pub curves: Curves,
    presets: Presets,
}

impl Matter {
    /// Opens the mouth farther by so many degrees, where there is one.
    pub fn open_mouth(&mut self, by: f32) {
        let Some(mouth) = &self.mouth else { return };
        self.open = (self.open + by).clamp(0.0, OPEN_MOST);
        self.around = mouth.solids(self.open);
    }

    /// Of the matter as it was when somebody first asked: few do, and counting a fine tooth takes a while.
    pub fn histogram(&self) -> &Histogram {
        self.histogram.get_or_init(|| Histogram::of(&self.volume))
    }

    pub fn shown(&self, way: Way) -> Shown {
        match way {
            Way::Surface => Shown::Surface,
            Way::Iso => Shown::Iso,
            Way::Tissue => Shown::Volume(self.presets.tissue.clone()),
            Way::Xray => Shown::Volume(self.presets.x_ray.clone()),
            Way::Decay => Shown::Volume(self.presets.decay.clone()),
            Way::Drawn => Shown::Volume(self.curves.function.clone()),
        }
    }
}

/// The transfer functions that nobody draws: made anew with the palette, not with each picture.
struct Presets {
    tissue: Arc<TransferFunction>,
    x_ray: Arc<TransferFunction>,
    decay: Arc<TransferFunction>,
}

impl Presets {
    fn of(tissues: &TissueTable, palette: &Palette) -> Presets {
        let decay: Vec<Label> = tissues.entries().iter().filter(|e| e.role == Role::Decay).map(|e| e.label()).collect();
        Presets {
            tissue: Arc::new(TransferFunction::tissue(palette)),
            x_ray: Arc::new(TransferFunction::x_ray()),
            decay: Arc::new(TransferFunction::only(&decay, palette)),
        }
    }
}

/// The way in which the tooth is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    Surface,
    Iso,
    Tissue,
    Xray,
    /// Decay alone, the rest like glass: where the exercise shows decay.
    Decay,
    /// The transfer function that the person drew.
    Drawn,
}

impl Way {
    const ALL: [(Way, &str); 6] = [
        (Way::Surface, "menu.surface"),
        (Way::Iso, "menu.iso"),
        (Way::Tissue, "menu.clear"),
        (Way::Xray, "menu.xray"),
        (Way::Decay, "menu.decay"),
        (Way::Drawn, "menu.drawn"),
    ];

    /// Those that a stage allows, with their texts: nobody finds hidden decay by looking through the tooth.
    pub fn offered(stage: Option<&Stage>) -> impl Iterator<Item = (Way, &'static str)> {
        let is_decay_shown = stage.is_some_and(|stage| stage.show_decay);
        Way::ALL.into_iter().filter(move |(way, _)| is_decay_shown || !way.looks_inside())
    }

    /// True when tissues beneath the surface are seen.
    pub fn looks_inside(self) -> bool {
        !matches!(self, Way::Surface | Way::Iso)
    }
}

/// Half of what is seen until the matter is made, mm.
const FIRST_RADIUS: f32 = 9.0;

/// Widest that the mouth opens, degrees: 50 mm between the incisors.
const OPEN_MOST: f32 = 35.0;

impl Sitting {
    /// Begins a lesson that is heard through an output and shown in a way at first.
    pub fn begin(order: Order, library: Library, output: Output, shown: Way) -> Result<Sitting, String> {
        let scenario = order.scenario.clone();
        let felt = scenario.tissues.materials();
        let (sounds, heard) = audio::sounds();
        let chair = Chair::take(order, sounds).map_err(|e| format!("no-thread: the lesson cannot begin: {e}"))?;
        Ok(Sitting {
            scenario,
            chair,
            player: Player::start(heard, output),
            silence: None,
            picture_seconds: 0.0,
            pictures_per_second: 0.0,
            matter: None,
            seen: None,
            stage: None,
            are_stages_over: false,
            answered: Vec::new(),
            drafts: BTreeMap::new(),
            said: BTreeMap::new(),
            charted: Vec::new(),
            refused: None,
            standstill: None,
            second: None,
            is_paused: false,
            is_pointer_held: false,
            is_giving_up: false,
            orbit: Orbit::around(Vec3::ZERO, FIRST_RADIUS),
            library,
            shown,
            felt,
            ratings: BTreeMap::new(),
            statement: 0,
            is_statement_new: false,
            is_handing_in: false,
            is_handed_in: false,
            is_scoring: false,
            complaints: Vec::new(),
            end: None,
        })
    }

    /// The running stage.
    pub fn stage(&self) -> Option<&Stage> {
        self.stage.and_then(|stage| self.scenario.stages.get(stage))
    }

    /// True when the pointer can be the hand.
    pub fn has_mouse(&self) -> bool {
        self.chair.mouse.is_some()
    }

    pub fn mouse(&self) -> Option<&crate::device::mouse::Mouse> {
        self.chair.mouse.as_ref()
    }

    /// Takes over what the lesson brought since the last picture.
    ///
    /// `volume`: share of full scale; `since`: time since the last picture, s.
    pub fn follow(&mut self, volume: f32, since: f32) {
        /// Pictures over which their number is made even.
        const EVEN: f32 = 8.0;
        self.picture_seconds += (since - self.picture_seconds) / EVEN;
        self.pictures_per_second = 1.0 / self.picture_seconds.max(1e-3);
        self.player.volume(volume);
        while let Some(news) = self.player.news() {
            self.silence = match news {
                SoundNews::Playing { .. } => None,
                SoundNews::Silent(silence) => Some(silence.to_string()),
            };
        }
        while let Some(news) = self.chair.next_news() {
            self.learn(news);
        }
        if let Some(matter) = &mut self.matter {
            for _ in 0..EDITS_AT_ONCE {
                let Some(edit) = self.chair.next_edit() else { break };
                if let Some(field) = &mut matter.field {
                    field.carved(&edit, matter.volume.grid());
                }
                matter.volume.repeat(&edit);
            }
        }
        self.seen = self.chair.seen().or(self.seen);
        self.stir_field(since);
        if self.end.is_none() && self.chair.is_empty() {
            self.end = Some(Err(
                "broken-off: the lesson ended without a word; what was recorded lies in the folder of finished \
                 sessions, and `typodont finish` makes a bundle of it"
                    .into(),
            ));
        }
    }

    /// Lets dust and water go on while the lesson does.
    fn stir_field(&mut self, since: f32) {
        let does_drill_run = self.stage().is_some_and(|stage| stage.cutting);
        let seen = self.seen.filter(|_| does_drill_run);
        let is_still = self.is_paused || self.standstill.is_some();
        let Some(Matter { field: Some(field), volume, workpiece, palette, .. }) = &mut self.matter else { return };
        if is_still {
            return;
        }
        let held = |seen: Seen| Pose { position: seen.tip, orientation: seen.held };
        let bur = seen.and_then(|seen| field.bur(seen.instrument as usize, held(seen)));
        let ground = Ground { volume, world_from_tooth: workpiece.world_from_tooth, around: &workpiece.around };
        field.pass(since, bur.as_ref(), &ground, palette);
    }

    fn learn(&mut self, news: News) {
        match news {
            News::Made(workpiece) => {
                self.orbit = scene::work_view(&workpiece);
                self.matter = Some(self.matter_of(workpiece));
            }
            News::Heard(Heard::Effect(effect)) => self.effect(&effect),
            News::Heard(Heard::Device(state)) => {
                self.standstill = Standstill::of(state);
            }
            News::Heard(Heard::Gone(gone)) => self.standstill = Some(Standstill::gone(gone)),
            News::Heard(Heard::Begun(_)) => {}
            News::MayJoin(address) => self.second = Some(OfSecond::MayJoin(address)),
            News::Second(news) => self.second = Some(OfSecond::of(news)),
            News::OtherDevice => self.standstill = Some(Standstill::other_device()),
            News::Scoring => self.is_scoring = true,
            News::Done(path) => self.end = Some(Ok(path)),
            News::Failed(why) => self.end = Some(Err(why)),
        }
    }

    fn effect(&mut self, effect: &Effect) {
        match effect {
            Effect::StageStarted { stage } => {
                self.stage = Some(*stage);
                self.answered = vec![false; self.scenario.stages[*stage].ask.len()];
                self.drafts.clear();
                self.said.clear();
                self.charted.clear();
                self.refused = None;
                self.felt = self.scenario.tissues.materials();
                self.repaint_tissues();
                if !Way::offered(self.stage()).any(|(way, _)| way == self.shown) {
                    self.shown = Way::Surface;
                }
            }
            Effect::Answered { question, .. } => {
                if let Some(answered) = self.answered.get_mut(*question) {
                    *answered = true;
                }
                self.refused = None;
            }
            Effect::Charted { note, is_there, .. } => {
                let is_like = |n: &Note| n.site == note.site && n.what.is_like(&note.what);
                self.charted.retain(|n| !is_like(n));
                self.charted.extend(is_there.then_some(*note));
                self.refused = None;
            }
            Effect::StagesOver => {
                (self.stage, self.are_stages_over) = (None, true);
                self.let_go();
            }
            Effect::Refused { why } => self.refused = Some(told::refusal(*why)),
            Effect::Tell(Tell::Set { label, coefficient, value }) => {
                self.felt.set(*label, self.felt.get(*label).with(*coefficient, *value));
            }
            Effect::Tell(_) | Effect::StepStarted { .. } | Effect::StageEnded { .. } => {}
        }
    }

    fn matter_of(&mut self, workpiece: Arc<Workpiece>) -> Matter {
        let tissues = &self.scenario.tissues;
        let mut volume = Volume::clone(&workpiece.volume);
        volume.take_dirty();
        let palette = scene::palette(tissues, self.is_decay_shown());
        let is_in_jaw = self.scenario.scene.layout == Layout::Jaw;
        let mouth = Mouth::around(&workpiece, tissues).filter(|_| is_in_jaw);
        let drawn = self.scenario.instruments.iter().map(|entry| scene::instrument(entry, &self.library));
        let (instruments, complaints): (Vec<Solid>, Vec<_>) = drawn.unzip();
        self.complaints = complaints.iter().flatten().map(Diagnostic::headline).collect();
        let options = self.scenario.operating_field;
        let (ejector, mouth_of_suction) = match options.suction {
            true => Some(field::ejector(&workpiece)).unzip(),
            false => (None, None),
        };
        Matter {
            histogram: OnceCell::new(),
            curves: Curves::from(TransferFunction::tissue(&palette)),
            presets: Presets::of(tissues, &palette),
            volume,
            palette,
            around: match &mouth {
                Some(mouth) => mouth.solids(scene::OPEN),
                None => scene::around(&workpiece, tissues),
            },
            mouth,
            open: scene::OPEN,
            field: options.is_any().then(|| Field::new(options, &self.scenario.instruments, mouth_of_suction)),
            ejector,
            instruments,
            workpiece,
            is_new: true,
        }
    }

    /// The way after the one in which the tooth is shown.
    pub fn next_way(&self) -> Way {
        let ways: Vec<Way> = Way::offered(self.stage()).map(|(way, _)| way).collect();
        let place = ways.iter().position(|way| *way == self.shown).map_or(0, |place| (place + 1) % ways.len());
        ways[place]
    }

    fn repaint_tissues(&mut self) {
        let is_shown = self.is_decay_shown();
        if let Some(matter) = &mut self.matter {
            matter.palette = scene::palette(&self.scenario.tissues, is_shown);
            matter.presets = Presets::of(&self.scenario.tissues, &matter.palette);
        }
    }

    pub fn is_decay_shown(&self) -> bool {
        self.stage().is_some_and(|stage| stage.show_decay)
    }

    /// Says something to the session.
    pub fn say(&mut self, input: Input) {
        self.tell(Said::Input(input));
    }

    /// False, and said so, when the lesson does not hear it.
    fn tell(&mut self, said: Said) -> bool {
        let is_heard = self.chair.say(said);
        if !is_heard {
            self.refused = Some(told::NOT_LISTENING);
        }
        is_heard
    }

    /// Answers a question of the running stage.
    pub fn answer(&mut self, question: String, value: Answer) {
        let Some(stage) = self.stage else { return };
        self.said.insert(question.clone(), value.clone());
        self.tell(Said::InStage(stage, Input::Answer { question, value }));
    }

    /// Notes something in the running stage's periodontal chart, where the instrument is.
    pub fn note(&mut self, sign: Sign) {
        let Some(stage) = self.stage else { return };
        self.tell(Said::InStage(stage, Input::Chart(sign)));
    }

    /// Gives a coefficient another value, where the stage allows it.
    pub fn adjust(&mut self, label: Label, coefficient: Coefficient, value: f32) {
        let Some(stage) = self.stage else { return };
        if self.tell(Said::InStage(stage, Input::Adjust { label, coefficient, value })) {
            // Shown at once; what the session says of it comes some milliseconds later.
            self.felt.set(label, self.felt.get(label).with(coefficient, value));
        }
    }

    /// The running stage is done; what was typed and not said is said first. Not while a number is none.
    pub fn confirm(&mut self) {
        let Some((stage, questions)) = self.stage.zip(self.stage().map(|stage| stage.ask.clone())) else { return };
        for question in questions {
            let draft = self.drafts.get(&question.id).map_or("", String::as_str);
            match questions::written(&question, draft) {
                Some(None) => return,
                Some(Some(answer)) if self.said.get(&question.id) != Some(&answer) => self.answer(question.id, answer),
                _ => {}
            }
        }
        self.tell(Said::InStage(stage, Input::Confirm));
    }

    /// The instrument stays where it is, and nothing presses any more.
    pub fn let_go(&mut self) {
        self.is_pointer_held = false;
        if let Some((mouse, seen)) = self.mouse().zip(self.seen.as_ref()) {
            mouse.rest_at(seen.tip);
        }
    }

    pub fn rate(&mut self, item: String, value: u8) {
        let questionnaire = self.scenario.questionnaire.as_ref();
        let place = questionnaire.and_then(|q| q.items().position(|i| i.id == item));
        self.statement = place.unwrap_or(self.statement);
        self.ratings.insert(item, value);
        self.is_handing_in = false;
    }

    /// Marks another statement, some places further down.
    pub fn next_statement(&mut self, by: i32) {
        let count = self.scenario.questionnaire.as_ref().map_or(0, |q| q.items().count());
        self.statement = self.statement.saturating_add_signed(by as isize).min(count.saturating_sub(1));
        self.is_statement_new = true;
    }

    /// Statements without a rating.
    pub fn open_statements(&self) -> usize {
        let count = self.scenario.questionnaire.as_ref().map_or(0, |q| q.items().count());
        count.saturating_sub(self.ratings.len())
    }

    pub fn pause(&mut self, is_paused: bool) {
        self.is_paused = is_paused;
        if is_paused {
            self.let_go();
        }
        self.chair.say(Said::Pause(is_paused));
    }

    /// Hands in the questionnaire as it is.
    pub fn hand_in(&mut self) {
        if self.is_handed_in {
            return;
        }
        for (item, value) in self.ratings.clone() {
            self.say(Input::Rate { item, value });
        }
        self.is_handed_in = self.chair.say(Said::Leave);
    }

    /// Gives the lesson up; what was done, answered and rated is kept.
    pub fn give_up(&mut self) {
        match self.are_stages_over {
            true => self.hand_in(),
            false => self.say(Input::Abort),
        }
    }
}
