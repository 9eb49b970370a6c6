//! A scripted trainee that follows the rules of an operator file.
//!
//! Takes an operator file, a scenario and a workpiece, then the edits and the latest step of every tick. Gives hand
//! readings and inputs. Never uses more than a person could see (current surfaces, decay where the scenario shows it)
//! or feel.

mod charting;
mod excavation;
mod palpation;
mod file;
mod cavity_map;
mod hand_paths;
mod preparing;
mod restoring;
mod sulcus_path;

pub use file::{ActionFile, OperatorFile};

use crate::catalog::WorkingEndEntry;
use crate::scenario::file::ZoneRole;
use crate::scenario::{Draw, QuestionKind, Scenario, Stage, Workpiece};
use crate::session::{ChartInput, Input, Session, Trainee};
use file::{AnswerActionFile, WhenFile};
use palpation::PalpatedPoint;
use preparing::PreparingTask;
use restoring::{FillingTask, RecarvingTask};
use std::collections::VecDeque;
use std::sync::Arc;
use typodont_core::device::{
    Device, DeviceError, DeviceSpec, HandModel, Move, Reading, ScriptedDevice, Tremor, Wrench,
};
use typodont_core::frame::Vec3;
use typodont_core::sim::Step;
use typodont_core::volume::{Edit, Label, Volume};

/// Height above the teeth at which the hand travels, mm.
const TRAVEL_HEIGHT: f32 = 4.0;

/// Distance from the surface at which the hand slows down before contact, mm.
const TOUCH_HEIGHT: f32 = 0.6;

/// Speed of the hand when it approaches contact, mm/s.
const TOUCH_SPEED: f32 = 8.0;

/// A scripted trainee with its device and its plan for the current stage.
#[derive(Clone, Debug)]
pub struct Operator {
    file: OperatorFile,
    scenario: Arc<Scenario>,
    workpiece: Arc<Workpiece>,
    seed: u64,
    device: ScriptedDevice,
    /// Index of the stage that the plan is for.
    stage: Option<usize>,
    /// Ticks since the stage began.
    stage_ticks: u64,
    plan: VecDeque<OperatorTask>,
    /// Points palpated in this stage.
    palpated: Vec<PalpatedPoint>,
    /// The point being palpated: tooth index, and position in tooth space, mm.
    palpating: Option<(usize, Vec3)>,
    has_rated: bool,
    /// Positions of the tip on its way down a root, as pairs of height and distance from the tooth's axis; tooth
    /// space, mm.
    trail: Option<Vec<[f32; 2]>>,
    /// Last known position of the tip, world space, mm.
    tip: Vec3,
    /// The tooth as displayed now, in exercises in which work is inspected and repeated.
    visible_volume: Option<Volume>,
}

/// Element of the plan.
#[derive(Clone, Debug)]
enum OperatorTask {
    Move(Move),
    /// A move whose measured stiffness is recorded for a tooth (index) and a point (tooth space, mm).
    Palpate(Move, usize, Vec3),
    Input(Input),
    Answer(AnswerActionFile),
    /// Starts recording the tip's trail down a root.
    StartTrail,
    /// Marks calculus if the trail rises over a bump of more than this, mm.
    MarkCalculus(f32),
    /// Moves up along a path (world space, mm) from its first point above the tip; `speed` in mm/s.
    Withdraw {
        up: Vec<Vec3>,
        speed: f32,
    },
    /// Skips the next `tasks` tasks once at least `percent` of the decay has been removed.
    SkipIfCleared {
        percent: f64,
        tasks: usize,
    },
    /// Continues filling where the surface is still too low.
    Fill(FillingTask),
    /// Carves again where the filling is visibly too high.
    CarveAgain(RecarvingTask),
    /// Leads the bur again to visible remnants of the target.
    PrepareAgain(PreparingTask),
    /// Starts the stage's rule again.
    RepeatRule,
}

/// Number of ticks after which a script aborts a stage without a time limit: 20 minutes. A script with nothing left
/// to do would otherwise fill the disk.
const PATIENCE_TICKS: u64 = 20 * 60 * 1000;

impl Operator {
    /// Creates an operator that holds a device above the workpiece. The seed determines its tremor and its random
    /// choices.
    pub fn new(
        file: OperatorFile,
        scenario: Arc<Scenario>,
        workpiece: Arc<Workpiece>,
        spec: DeviceSpec,
        seed: u64,
    ) -> Operator {
        let start = Vec3::Y * (2.0 * TRAVEL_HEIGHT);
        let model = HandModel::holding(spec.apparent_mass, spec.resolution);
        let tremor = Tremor::new(file.hand.tremor_mm, seed);
        let has_outline = scenario.zones.iter().any(|zone| zone.role == ZoneRole::Target);
        let visible_volume = (has_outline || workpiece.original.is_some()).then(|| Volume::clone(&workpiece.volume));
        Operator {
            device: ScriptedDevice::new(spec, model, tremor, start),
            file,
            scenario,
            workpiece,
            seed,
            stage: None,
            stage_ticks: 0,
            plan: VecDeque::new(),
            palpated: Vec::new(),
            palpating: None,
            has_rated: false,
            trail: None,
            tip: start,
            visible_volume,
        }
    }

    fn begin_stage(&mut self, index: usize) {
        self.stage = Some(index);
        self.stage_ticks = 0;
        self.palpated.clear();
        self.palpating = None;
        self.device.stop();
        self.plan.clear();
        self.follow_rule(index);
    }

    fn follow_rule(&mut self, index: usize) {
        let scenario = self.scenario.clone();
        let stage = &scenario.stages[index];
        let file = self.file.clone();
        let Some(rule) = file.rules.iter().find(|r| rule_applies(&r.when, stage)) else { return };
        let mut instrument = stage.instruments[0];
        for action in &rule.actions {
            self.compile(action, stage, &mut instrument);
        }
        if rule.repeat {
            self.plan.push_back(OperatorTask::RepeatRule);
        }
    }

    fn compile(&mut self, action: &ActionFile, stage: &Stage, instrument: &mut usize) {
        match action {
            ActionFile::WaitS(seconds) => self.plan.push_back(OperatorTask::Move(Move::Wait { seconds: *seconds })),
            ActionFile::Take(name) => {
                if let Some(chosen) = self.choose(name, stage) {
                    *instrument = chosen;
                    self.lift_off();
                    self.plan.push_back(OperatorTask::Input(Input::Take { instrument: chosen }));
                }
            }
            ActionFile::Approach(approach) => {
                let (_, surface, _) = self.locate(&approach.at);
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
            ActionFile::Answer(answer) => self.plan.push_back(OperatorTask::Answer(answer.clone())),
            ActionFile::Adjust(adjust) => {
                // A tissue unknown to the exercise maps to air, whose coefficients the session refuses to change.
                let label = self.scenario.tissues.by_name(&adjust.tissue).map_or(Label::AIR, |tissue| tissue.label());
                let (coefficient, value) = (adjust.coefficient.into(), adjust.value);
                self.plan.push_back(OperatorTask::Input(Input::Adjust { label, coefficient, value }));
            }
            ActionFile::Confirm => {
                self.lift_off();
                self.plan.push_back(OperatorTask::Input(Input::Confirm));
            }
        }
    }

    /// Returns an instrument of the stage by its id, or the stage's first bur, explorer or probe.
    fn choose(&self, name: &str, stage: &Stage) -> Option<usize> {
        let is_meant = |&&index: &&usize| {
            let entry = &self.scenario.instruments[index];
            let is_probe = matches!(entry.end, WorkingEndEntry::Probe(_));
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

    /// Rates every statement according to the operator's agreement. Rates once; later calls return nothing.
    fn ratings(&mut self) -> Vec<Input> {
        if std::mem::replace(&mut self.has_rated, true) {
            return Vec::new();
        }
        let Some(questionnaire) = &self.scenario.questionnaire else { return Vec::new() };
        let agrees = self.file.agrees.min(questionnaire.steps);
        let rate = |item| Input::Rate {
            item: crate::scenario::QuestionnaireItem::clone(item).id,
            value: questionnaire.scored_answer(item, agrees),
        };
        questionnaire.items().map(rate).collect()
    }

    /// Inserts tasks at the front of the plan.
    fn do_next(&mut self, tasks: impl IntoIterator<Item = OperatorTask, IntoIter: DoubleEndedIterator>) {
        tasks.into_iter().rev().for_each(|task| self.plan.push_front(task));
    }

    /// Runs the plan until the hand is busy or a task produces inputs, and returns those inputs.
    fn run_plan(&mut self, session: &Session, index: usize) -> Vec<Input> {
        while self.device.is_idle() {
            self.record_palpation();
            match self.plan.pop_front() {
                None => break,
                Some(OperatorTask::Move(next)) => self.device.push(next),
                Some(OperatorTask::Palpate(next, tooth, place)) => {
                    self.palpating = Some((tooth, place));
                    self.device.push(next);
                }
                Some(OperatorTask::Input(input)) => return vec![input],
                Some(OperatorTask::Withdraw { up, speed }) => {
                    // Starts at the tip's height, since the hand may lean far deeper than the tip.
                    let from = up.iter().position(|p| p.y > self.tip.y).unwrap_or(up.len());
                    let path = up[from..].iter().step_by(4);
                    path.for_each(|to| self.device.push(Move::Reach { to: *to, speed }));
                }
                Some(OperatorTask::StartTrail) => self.trail = Some(Vec::new()),
                Some(OperatorTask::MarkCalculus(more_than)) => {
                    let trail = self.trail.take().unwrap_or_default();
                    if sulcus_path::bump(&trail) > more_than {
                        return vec![Input::Chart(ChartInput::Calculus)];
                    }
                }
                Some(OperatorTask::Answer(kind)) => {
                    let inputs = self.answers(&kind, &self.scenario.stages[index]);
                    if !inputs.is_empty() {
                        return inputs;
                    }
                }
                Some(OperatorTask::SkipIfCleared { percent, tasks }) => {
                    if session.cleared_pct().is_none_or(|now| now >= percent) {
                        self.plan.drain(..tasks.min(self.plan.len()));
                    }
                }
                Some(OperatorTask::Fill(filling)) => self.continue_filling(filling),
                Some(OperatorTask::CarveAgain(carving)) => self.carve_again(carving),
                Some(OperatorTask::PrepareAgain(preparing)) => self.prepare_again(preparing),
                Some(OperatorTask::RepeatRule) => {
                    self.palpated.clear();
                    self.follow_rule(index);
                    // Without this break a rule without any move would repeat forever within one tick.
                    break;
                }
            }
        }
        Vec::new()
    }
}

fn rule_applies(when: &WhenFile, stage: &Stage) -> bool {
    match when {
        WhenFile::Always => true,
        WhenFile::Cutting => stage.cutting,
        WhenFile::Searching => {
            stage.ask.iter().any(|q| matches!(q.kind, QuestionKind::ToothWith { .. } | QuestionKind::QuadrantOf { .. }))
        }
        // Each trial is a stage of its own.
        WhenFile::Stage(id) => {
            let is_trial_of = |draw: &Draw| draw.trials > 1 && stage.id == format!("{id}-{}", draw.trial);
            stage.id == *id || stage.draw.as_ref().is_some_and(is_trial_of)
        }
    }
}

impl Device for Operator {
    fn spec(&self) -> &DeviceSpec {
        self.device.spec()
    }

    fn exchange(&mut self, output: &Wrench) -> Result<Reading, DeviceError> {
        self.device.exchange(output)
    }
}

impl Trainee for Operator {
    fn observe_edits(&mut self, edits: &[Edit]) {
        if let Some(visible_volume) = &mut self.visible_volume {
            edits.iter().for_each(|edit| _ = visible_volume.apply_edit(edit));
        }
    }

    fn respond(&mut self, session: &Session, screen: Option<&Step>) -> Vec<Input> {
        if let Some(step) = screen {
            self.device.observe_tip(step.tip);
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
                    _ => self.run_plan(session, index),
                }
            }
        }
    }
}
