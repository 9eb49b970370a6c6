//! A scripted trainee: turns what an operator file says into moves of a hand, and closes the loop through what it feels.
//!
//! It sees what a person sees (surfaces as they are now, decay where the scenario shows it) and otherwise knows only what it felt.

mod charting;
mod excavation;
mod feeling;
mod file;
mod mouth;
mod places;
mod preparing;
mod restoring;
mod sounding;

pub use file::{ActionFile, OperatorFile};

use super::{Input, Session, Sign, Trainee};
use crate::content::EndEntry;
use crate::device::{Device, Gone, HandModel, Move, Output, Reading, Scripted, Spec, Tremor};
use crate::frame::Vec3;
use crate::scenario::file::ZoneRole;
use crate::scenario::{QuestionKind, Scenario, Stage, Workpiece};
use crate::sim::Step;
use crate::volume::{Edit, Label, Volume};
use feeling::FeltPlace;
use file::{AnswerActionFile, WhenFile};
use preparing::Preparing;
use restoring::{Filling, Recarving};
use std::collections::VecDeque;
use std::sync::Arc;

/// How far above a tooth the hand travels, mm.
const TRAVEL_HEIGHT: f32 = 4.0;

/// How far before the surface a hand slows down to touch, mm.
const TOUCH_HEIGHT: f32 = 0.6;

/// Speed of touching, mm/s.
const TOUCH_SPEED: f32 = 8.0;

/// A scripted trainee at work.
#[derive(Clone, Debug)]
pub struct Operator {
    file: OperatorFile,
    scenario: Arc<Scenario>,
    workpiece: Arc<Workpiece>,
    device: Scripted,
    /// Index of the stage the plan is for.
    stage: Option<usize>,
    /// Ticks since the stage began.
    stage_ticks: u64,
    plan: VecDeque<Task>,
    /// Places felt in this stage.
    felt: Vec<FeltPlace>,
    /// The place being felt.
    feeling: Option<(usize, Vec3)>,
    has_rated: bool,
    /// Heights and distances from the tooth's middle of the tip on its way down a root, tooth space, mm.
    trail: Option<Vec<[f32; 2]>>,
    /// Where the tip was seen last, world space.
    tip: Vec3,
    /// The tooth as the picture shows it now, where work is looked at and done again.
    seen: Option<Volume>,
}

/// What is left to do.
#[derive(Clone, Debug)]
enum Task {
    Move(Move),
    /// A move whose feeling is remembered: tooth, and place in tooth space.
    Feel(Move, usize, Vec3),
    Input(Input),
    Answer(AnswerActionFile),
    /// Begins to follow the tip down a root.
    Trail,
    /// Notes calculus if the tip was lifted by more than this on its way down, mm.
    Notice(f32),
    /// Along a way up, from the place of it that is nearest.
    Withdraw {
        up: Vec<Vec3>,
        speed: f32,
    },
    /// Drops the following so many tasks if the decay gone suffices.
    SkipIfCleared {
        percent: f64,
        tasks: usize,
    },
    /// Goes on filling where the surface is still too low.
    Fill(Filling),
    /// Carves once more where the filling is seen to stand too high.
    CarveAgain(Recarving),
    /// Leads the bur once more to where something still stands that is to go.
    PrepareAgain(Preparing),
    /// Begins the stage's rule again.
    Again,
}

/// How long a script stays in a stage without a time limit before it gives the session up: 20 minutes. A script that
/// does nothing more would otherwise fill the disk.
const PATIENCE_TICKS: u64 = 20 * 60 * 1000;

impl Operator {
    /// An operator holding a device above the workpiece. The seed decides its tremor.
    pub fn new(
        file: OperatorFile,
        scenario: Arc<Scenario>,
        workpiece: Arc<Workpiece>,
        spec: Spec,
        seed: u64,
    ) -> Operator {
        let start = Vec3::Y * (2.0 * TRAVEL_HEIGHT);
        let model = HandModel::holding(spec.apparent_mass, spec.resolution);
        let tremor = Tremor::new(file.hand.tremor_mm, seed);
        let has_outline = scenario.zones.iter().any(|zone| zone.role == ZoneRole::Target);
        let seen = (has_outline || workpiece.original.is_some()).then(|| Volume::clone(&workpiece.volume));
        Operator {
            device: Scripted::new(spec, model, tremor, start),
            file,
            scenario,
            workpiece,
            stage: None,
            stage_ticks: 0,
            plan: VecDeque::new(),
            felt: Vec::new(),
            feeling: None,
            has_rated: false,
            trail: None,
            tip: start,
            seen,
        }
    }

    fn begin_stage(&mut self, index: usize) {
        self.stage = Some(index);
        self.stage_ticks = 0;
        self.felt.clear();
        self.feeling = None;
        self.device.stop();
        self.plan.clear();
        self.follow_rule(index);
    }

    fn follow_rule(&mut self, index: usize) {
        let scenario = self.scenario.clone();
        let stage = &scenario.stages[index];
        let file = self.file.clone();
        let Some(rule) = file.rules.iter().find(|r| fits(&r.when, stage)) else { return };
        let mut instrument = stage.instruments[0];
        for action in &rule.actions {
            self.compile(action, stage, &mut instrument);
        }
        if rule.repeat {
            self.plan.push_back(Task::Again);
        }
    }

    fn compile(&mut self, action: &ActionFile, stage: &Stage, instrument: &mut usize) {
        match action {
            ActionFile::WaitS(seconds) => self.plan.push_back(Task::Move(Move::Wait { seconds: *seconds })),
            ActionFile::Take(name) => {
                if let Some(chosen) = self.choose(name, stage) {
                    *instrument = chosen;
                    self.lift_off();
                    self.plan.push_back(Task::Input(Input::Take { instrument: chosen }));
                }
            }
            ActionFile::Approach(approach) => {
                let (_, surface, _) = self.place(&approach.at);
                self.travel_to(surface + Vec3::Z * approach.above_mm);
            }
            ActionFile::Press(press) => self.press(press, self.radius(*instrument)),
            ActionFile::Follow(follow) => self.follow(follow, self.radius(*instrument)),
            ActionFile::Probe(probe) => self.probe(probe, self.radius(*instrument)),
            ActionFile::Cut(cut) => self.cut(cut, *instrument),
            ActionFile::Fill(fill) => self.fill(fill, *instrument),
            ActionFile::Condense(condense) => self.condense(condense, *instrument),
            ActionFile::Carve(carve) => self.carve(carve, *instrument),
            ActionFile::Chart(chart) => self.chart(chart),
            ActionFile::Explore(explore) => self.explore(explore),
            ActionFile::Answer(answer) => self.plan.push_back(Task::Answer(answer.clone())),
            ActionFile::Adjust(adjust) => {
                // What the exercise does not know is air, which the session refuses to change.
                let label = self.scenario.tissues.by_name(&adjust.tissue).map_or(Label::AIR, |tissue| tissue.label());
                let (coefficient, value) = (adjust.coefficient.into(), adjust.value);
                self.plan.push_back(Task::Input(Input::Adjust { label, coefficient, value }));
            }
            ActionFile::Confirm => {
                self.lift_off();
                self.plan.push_back(Task::Input(Input::Confirm));
            }
        }
    }

    /// An instrument of the stage by id, or the first bur or explorer.
    fn choose(&self, name: &str, stage: &Stage) -> Option<usize> {
        let is_meant = |&&index: &&usize| {
            let entry = &self.scenario.instruments[index];
            let is_probe = matches!(entry.end, EndEntry::Probe(_));
            let kind = match name {
                "bur" => entry.is_bur(),
                "explorer" => !entry.cuts && !is_probe && entry.packs.is_none(),
                "probe" => is_probe,
                _ => false,
            };
            entry.id == name || kind
        };
        stage.instruments.iter().find(is_meant).copied()
    }

    /// Rates every statement as the operator feels about the system.
    fn ratings(&mut self) -> Vec<Input> {
        if std::mem::replace(&mut self.has_rated, true) {
            return Vec::new();
        }
        let Some(questionnaire) = &self.scenario.questionnaire else { return Vec::new() };
        let agrees = self.file.agrees.min(questionnaire.steps);
        let rate = |item| Input::Rate {
            item: crate::scenario::Item::clone(item).id,
            value: questionnaire.counted(item, agrees),
        };
        questionnaire.items().map(rate).collect()
    }

    /// Puts tasks before what else is left to do.
    fn do_next(&mut self, tasks: impl IntoIterator<Item = Task, IntoIter: DoubleEndedIterator>) {
        tasks.into_iter().rev().for_each(|task| self.plan.push_front(task));
    }

    /// Goes on with the plan until the hand is busy or something is to be said.
    fn go_on(&mut self, session: &Session, index: usize) -> Vec<Input> {
        while self.device.is_idle() {
            self.remember();
            match self.plan.pop_front() {
                None => break,
                Some(Task::Move(next)) => self.device.push(next),
                Some(Task::Feel(next, tooth, place)) => {
                    self.feeling = Some((tooth, place));
                    self.device.push(next);
                }
                Some(Task::Input(input)) => return vec![input],
                Some(Task::Withdraw { up, speed }) => {
                    // From where the tip is: the hand may lean far deeper.
                    let from = up.iter().position(|p| p.y > self.tip.y).unwrap_or(up.len());
                    let way = up[from..].iter().step_by(4);
                    way.for_each(|to| self.device.push(Move::Reach { to: *to, speed }));
                }
                Some(Task::Trail) => self.trail = Some(Vec::new()),
                Some(Task::Notice(more_than)) => {
                    let trail = self.trail.take().unwrap_or_default();
                    if sounding::bump(&trail) > more_than {
                        return vec![Input::Chart(Sign::Calculus)];
                    }
                }
                Some(Task::Answer(kind)) => {
                    let inputs = self.answers(&kind, &self.scenario.stages[index]);
                    if !inputs.is_empty() {
                        return inputs;
                    }
                }
                Some(Task::SkipIfCleared { percent, tasks }) => {
                    if session.cleared_pct().is_none_or(|now| now >= percent) {
                        self.plan.drain(..tasks.min(self.plan.len()));
                    }
                }
                Some(Task::Fill(filling)) => self.go_on_filling(filling),
                Some(Task::CarveAgain(carving)) => self.carve_again(carving),
                Some(Task::PrepareAgain(preparing)) => self.prepare_again(preparing),
                Some(Task::Again) => {
                    self.felt.clear();
                    self.follow_rule(index);
                    // A rule without any move would go round for ever within this tick.
                    break;
                }
            }
        }
        Vec::new()
    }
}

fn fits(when: &WhenFile, stage: &Stage) -> bool {
    match when {
        WhenFile::Always => true,
        WhenFile::Cutting => stage.cutting,
        WhenFile::Searching => {
            stage.ask.iter().any(|q| matches!(q.kind, QuestionKind::ToothWith { .. } | QuestionKind::QuadrantOf { .. }))
        }
        WhenFile::Stage(id) => stage.id == *id,
    }
}

impl Device for Operator {
    fn spec(&self) -> &Spec {
        self.device.spec()
    }

    fn exchange(&mut self, output: &Output) -> Result<Reading, Gone> {
        self.device.exchange(output)
    }
}

impl Trainee for Operator {
    fn watch(&mut self, edits: &[Edit]) {
        if let Some(seen) = &mut self.seen {
            edits.iter().for_each(|edit| _ = seen.repeat(edit));
        }
    }

    fn respond(&mut self, session: &Session, screen: Option<&Step>) -> Vec<Input> {
        if let Some(step) = screen {
            self.device.see(step.tip);
            self.tip = step.tip;
            self.follow_trail(step.tip);
        }
        match session.stage() {
            None => self.ratings(),
            Some((index, _)) => {
                if self.stage != Some(index) {
                    self.begin_stage(index);
                }
                self.stage_ticks += 1;
                match self.scenario.stages[index].time_limit {
                    None if self.stage_ticks > PATIENCE_TICKS => vec![Input::Abort],
                    _ => self.go_on(session, index),
                }
            }
        }
    }
}
