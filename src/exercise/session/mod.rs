//! The state machine of a session: stages, time limits, stiffness steps, answers, the periodontal chart and the
//! questionnaire.
//!
//! Takes a scenario and events. Gives effects: commands for the simulation and messages for people. Never reads a
//! clock (time is the tick of the events), a device, a file or the screen.

mod run;
mod operator;
mod input_error;
mod trainee_view;

pub use input_error::InputError;
pub use operator::{ActionFile, Operator, OperatorFile};
pub use run::{Observer, RunEnd, Trainee, run};
pub use trainee_view::{MirrorFace, TraineeView};

use crate::catalog::{TissueRole, WorkingEndEntry};
use crate::scenario::{
    Periodontium, ProbingSite, QuestionKind, Scenario, Stage, StiffnessSteps, Workpiece, anatomy_tissues,
};
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use typodont_core::device::DeviceSpec;
use typodont_core::frame::Pose;
use typodont_core::sim::{Command, HandFrame, RAMP_TICKS, Setup, Step};
use typodont_core::tick::Tick;
use typodont_core::touch::{Coefficient, CollisionScene, CuttingLaw};
use typodont_core::volume::{Edit, Label, Volume};

/// Maximum number of ticks between the moment at which a live session issues a command and the tick before which the
/// servo carries it out: the number of events that may be queued for a session's thread.
pub const COMMAND_LAG_TICKS: u64 = 1 << 14;

/// Returns the simulation setup for a scenario, a workpiece and a device.
pub fn setup(scenario: &Scenario, workpiece: &Workpiece, device: DeviceSpec) -> Setup {
    Setup {
        scene: CollisionScene { volume: Volume::clone(&workpiece.volume), colliders: workpiece.surroundings.clone() },
        materials: scenario.tissues.materials(),
        material_scales: scenario.factors.clone(),
        instruments: scenario.instruments.iter().map(|i| i.to_instrument()).collect(),
        carving: scenario.carving,
        fillings: scenario.tissues.fillings(),
        vibration: scenario.vibration,
        guidances: scenario.guidances.clone(),
        world_from_tooth: workpiece.world_from_tooth,
        device,
        ramp: RAMP_TICKS,
    }
}

/// Input of a person other than hand motion.
#[derive(Clone, Debug, PartialEq)]
pub enum Input {
    /// Takes an instrument from the tray, by its index.
    Take { instrument: usize },
    /// Answers a question of the current stage. A second answer replaces the first.
    Answer { question: String, value: AnswerValue },
    /// Changes one coefficient of a tissue, in the coefficient's unit, in a stage that allows it.
    Adjust { label: Label, coefficient: Coefficient, value: f32 },
    /// Records a finding in the periodontal chart, at the site where the instrument is.
    Chart(ChartInput),
    /// Confirms that the stage is done.
    Confirm,
    /// Rates a statement of the questionnaire.
    Rate { item: String, value: u8 },
    /// Ends the session early.
    Abort,
    /// Tells from where the person looks. It changes nothing in the simulation.
    Look(TraineeView),
    /// Places the space in which the hand moves, so that it fits the view.
    PlaceHand(HandFrame),
    /// Presses (true) or releases the clutch, with which the hand moves while the tip stays.
    PressClutch(bool),
}

/// Finding to be recorded in the periodontal chart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChartInput {
    /// The depth that the probe shows now. A second reading at a site replaces the first.
    Depth,
    /// Calculus at the current site. A second input at the same site removes the entry.
    Calculus,
}

/// An answer to a question.
#[derive(Clone, Debug, PartialEq)]
pub enum AnswerValue {
    /// Id of a tooth or of an option, or free text.
    Word(String),
    /// Quadrant of the tooth, 1 to 4 as seen from above.
    Quadrant(u8),
    YesNo(bool),
    Number(f64),
}

/// Event that advances a session.
#[derive(Clone, Copy, Debug)]
pub enum SessionEvent<'a> {
    /// A person's input, before the step of the current tick.
    Input(&'a Input),
    /// A completed tick with its edits.
    Tick { step: &'a Step, edits: &'a [Edit] },
}

/// Consequence of an event.
#[derive(Clone, Debug, PartialEq)]
pub enum Effect {
    /// A command to be applied to the simulation before its next step.
    Command(Command),
    StageStarted {
        stage: usize,
    },
    /// A tissue's stiffness was set to the value of the given step.
    StepStarted {
        stage: usize,
        step: usize,
    },
    Answered {
        stage: usize,
        question: usize,
    },
    /// An entry was added to the chart or replaced (`is_present`), or removed from it (not `is_present`).
    Charted {
        stage: usize,
        record: ChartRecord,
        is_present: bool,
    },
    StageEnded {
        stage: usize,
        by: EndedBy,
    },
    /// All stages are over. The questionnaire, if there is one, may now be answered.
    StagesOver,
    /// An input was refused and changed nothing.
    Refused {
        why: InputError,
    },
}

/// Reason for which a stage ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EndedBy {
    Time,
    Answer,
    Confirmation,
    /// The stage's required share of decay had been removed.
    Cleared,
    Abort,
}

/// Result of a stage.
#[derive(Clone, Debug, PartialEq)]
pub struct StageResult {
    pub started: Tick,
    pub ended: Tick,
    pub ended_by: EndedBy,
    /// Answers in the order of the stage's questions; `None` for a question without an answer.
    pub answers: Vec<Option<AnswerRecord>>,
    /// Tissue coefficients that the person changed, in the order of their first change.
    pub adjusted: Vec<(Label, Coefficient)>,
    /// Entries of the periodontal chart, in the order in which each was first recorded.
    pub charted: Vec<ChartRecord>,
}

/// Entry of a periodontal chart with its site and tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChartRecord {
    pub site: ProbingSite,
    pub at: Tick,
    pub entry: ChartEntry,
}

/// Content of a chart record.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ChartEntry {
    /// Probing depth.
    Depth {
        /// Depth as read off the probe's marks, whole mm.
        reading: u8,
        /// Depth of the probe's end below the gingival margin, mm.
        depth: f32,
        /// Probing force, N.
        force: f32,
    },
    Calculus,
}

impl ChartEntry {
    /// Returns true if both entries record the same kind of finding, as a second reading at a site does.
    pub fn is_same_kind(&self, other: &ChartEntry) -> bool {
        matches!(
            (self, other),
            (ChartEntry::Depth { .. }, ChartEntry::Depth { .. }) | (ChartEntry::Calculus, ChartEntry::Calculus)
        )
    }
}

/// Answer to a question, with its tick and its correctness.
#[derive(Clone, Debug, PartialEq)]
pub struct AnswerRecord {
    pub value: AnswerValue,
    pub at: Tick,
    /// Correctness; `None` for a question without a correct answer.
    pub correct: Option<bool>,
    /// In a stage with stiffness steps: the stiffness coefficient in effect, and the tick at which its step began.
    pub step: Option<(f32, Tick)>,
}

/// Result of a session.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SessionOutcome {
    /// Results of the stages that were started, in order.
    pub stages: Vec<StageResult>,
    /// One rating per item of the questionnaire, in order; `None` for an item that was not rated.
    pub ratings: Vec<Option<u8>>,
    pub aborted: bool,
}

/// State of a running session.
#[derive(Clone, Debug)]
pub struct Session {
    scenario: Arc<Scenario>,
    /// Tooth and quadrant of each lesion: the correct answers to questions about it.
    ground_truths: Vec<GroundTruth>,
    /// For each stage, the lesion that was drawn, as an index into `ground_truths`.
    drawn: Vec<Option<usize>>,
    /// For each lesion, true if an instrument touched it in the current stage.
    touched: Vec<bool>,
    is_decay: [bool; 256],
    now: Tick,
    phase: SessionPhase,
    started: Tick,
    step: usize,
    step_started: Tick,
    answers: Vec<Option<AnswerRecord>>,
    adjusted: Vec<(Label, Coefficient)>,
    charted: Vec<ChartRecord>,
    /// Periodontium, in tooth space; `None` without pockets.
    periodontium: Option<Arc<Periodontium>>,
    tooth_from_world: Pose,
    /// The latest completed tick; `None` before the first.
    last_step: Option<Step>,
    instrument: usize,
    /// Filling material that carriers place.
    filling: Option<Label>,
    /// Latest view of the person; `None` if none was told.
    view: Option<TraineeView>,
    /// Number of decayed voxels at the start.
    decay_at_start: usize,
    /// Number of decayed voxels removed so far.
    decay_gone: usize,
    outcome: SessionOutcome,
}

#[derive(Clone, Debug, PartialEq)]
struct GroundTruth {
    decay: String,
    label: Label,
    tooth: String,
    quadrant: u8,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum SessionPhase {
    Waiting,
    In(usize),
    Over,
}

impl Session {
    /// Creates a session on a workpiece, before its first stage.
    pub fn new(scenario: Arc<Scenario>, workpiece: &Workpiece) -> Session {
        let truth = |l: &crate::scenario::Lesion| GroundTruth {
            decay: l.id.clone(),
            label: l.label,
            tooth: workpiece.teeth[l.tooth].id.clone(),
            quadrant: l.quadrant,
        };
        let is_decay = std::array::from_fn(|l| scenario.tissues.role(Label(l as u8)) == Some(TissueRole::Decay));
        let decay_at_start = workpiece.volume.tissues().filter(|l| is_decay[usize::from(l.0)]).count();
        let ratings = scenario.questionnaire.as_ref().map_or(0, |q| q.items().count());
        Session {
            ground_truths: workpiece.lesions.iter().map(truth).collect(),
            drawn: workpiece.drawn.clone(),
            touched: vec![false; workpiece.lesions.len()],
            scenario,
            is_decay,
            now: Tick::ZERO,
            phase: SessionPhase::Waiting,
            started: Tick::ZERO,
            step: 0,
            step_started: Tick::ZERO,
            answers: Vec::new(),
            adjusted: Vec::new(),
            charted: Vec::new(),
            periodontium: workpiece.periodontium.clone(),
            tooth_from_world: workpiece.world_from_tooth.inverse(),
            last_step: None,
            instrument: 0,
            filling: None,
            view: None,
            decay_at_start,
            decay_gone: 0,
            outcome: SessionOutcome { ratings: vec![None; ratings], ..SessionOutcome::default() },
        }
    }

    /// Starts the first stage. Must be called once, before the first tick.
    pub fn begin(&mut self) -> Vec<Effect> {
        self.start_stage(0)
    }

    /// Processes one event and returns its effects in order.
    pub fn advance(&mut self, event: SessionEvent) -> Vec<Effect> {
        match event {
            SessionEvent::Input(input) => self.input(input),
            SessionEvent::Tick { step, edits } => self.tick(step, edits),
        }
    }

    pub fn scenario(&self) -> &Scenario {
        &self.scenario
    }

    /// Returns the current stage with its index; `None` before the first stage and after the last.
    pub fn stage(&self) -> Option<(usize, &Stage)> {
        match self.phase {
            SessionPhase::In(index) => Some((index, &self.scenario.stages[index])),
            SessionPhase::Waiting | SessionPhase::Over => None,
        }
    }

    /// Returns the time since the current stage began, s.
    pub fn stage_seconds(&self) -> f64 {
        self.now.seconds_since(self.started)
    }

    /// Returns, for each question of the current stage, true if it has been answered.
    pub fn answered(&self) -> impl Iterator<Item = bool> + '_ {
        self.answers.iter().map(Option::is_some)
    }

    /// Returns the share of the initial decay that has been removed, %; `None` without decay.
    pub fn cleared_pct(&self) -> Option<f64> {
        (self.decay_at_start > 0).then(|| 100.0 * self.decay_gone as f64 / self.decay_at_start as f64)
    }

    /// Returns the latest view of the person; `None` if none was told.
    pub fn view(&self) -> Option<&TraineeView> {
        self.view.as_ref()
    }

    pub fn are_stages_over(&self) -> bool {
        self.phase == SessionPhase::Over
    }

    /// Returns true if nothing is left to do: all stages are over, and every item of the questionnaire is rated or
    /// the session was aborted.
    pub fn is_complete(&self) -> bool {
        self.are_stages_over() && (self.outcome.aborted || self.outcome.ratings.iter().all(Option::is_some))
    }

    /// Returns the outcome so far: the finished stages, and the current stage as if it were aborted now.
    pub fn outcome(&self) -> SessionOutcome {
        let mut outcome = self.outcome.clone();
        if let SessionPhase::In(_) = self.phase {
            outcome.aborted = true;
            outcome.stages.push(self.result(EndedBy::Abort));
        }
        outcome
    }

    fn result(&self, ended_by: EndedBy) -> StageResult {
        let (answers, adjusted) = (self.answers.clone(), self.adjusted.clone());
        let charted = self.charted.clone();
        StageResult { started: self.started, ended: self.now, ended_by, answers, adjusted, charted }
    }

    fn start_stage(&mut self, index: usize) -> Vec<Effect> {
        let scenario = self.scenario.clone();
        let Some(stage) = scenario.stages.get(index) else {
            self.phase = SessionPhase::Over;
            return vec![Effect::Command(Command::RunBur { running: false }), Effect::StagesOver];
        };
        self.phase = SessionPhase::In(index);
        self.started = self.now;
        self.answers = vec![None; stage.ask.len()];
        self.charted.clear();
        let mut effects =
            vec![Effect::StageStarted { stage: index }, Effect::Command(Command::RunBur { running: stage.cutting })];
        if !stage.instruments.contains(&self.instrument) {
            self.instrument = stage.instruments[0];
            effects.push(Effect::Command(Command::SelectInstrument { instrument: self.instrument }));
        }
        if stage.filling != self.filling {
            self.filling = stage.filling;
            effects.push(Effect::Command(Command::SetFilling { label: stage.filling }));
        }
        if stage.guidance.is_some() {
            effects.push(Effect::Command(Command::SetGuidance { guidance: stage.guidance }));
        }
        self.touched.fill(false);
        self.place_drawn(index, &mut effects);
        if stage.steps.is_some() {
            self.start_step(0, stage, &mut effects);
        }
        effects
    }

    /// Gives the site that was drawn for a stage the properties of its decay, and all other possible sites those of
    /// sound enamel.
    fn place_drawn(&self, index: usize, effects: &mut Vec<Effect>) {
        let enamel = anatomy_tissues(&self.scenario.tissues).enamel;
        let drawn = self.drawn[index].map(|lesion| self.ground_truths[lesion].label);
        for site in self.scenario.tissues.entries() {
            if let Some(decay) = site.site_of {
                let like = if drawn == Some(site.label()) { decay } else { enamel };
                effects.push(Effect::Command(Command::SetMaterial { label: site.label(), like }));
            }
        }
    }

    /// Returns the label whose stiffness the steps of a stage change: the site that was drawn, if it has their decay.
    fn stepped_label(&self, index: usize, steps: &StiffnessSteps) -> Label {
        let site = self.drawn[index].map(|lesion| self.ground_truths[lesion].label);
        let is_stepped = |label: &Label| {
            self.scenario.tissues.by_label(*label).is_some_and(|entry| entry.site_of == Some(steps.label))
        };
        site.filter(is_stepped).unwrap_or(steps.label)
    }

    fn start_step(&mut self, step: usize, stage: &Stage, effects: &mut Vec<Effect>) {
        let (SessionPhase::In(index), Some(steps)) = (self.phase, &stage.steps) else { return };
        self.step = step;
        self.step_started = self.now;
        effects.push(Effect::StepStarted { stage: index, step });
        let stiffness = steps.coefficients[step];
        let (label, coefficient) = (self.stepped_label(index, steps), Coefficient::Stiffness);
        effects.push(Effect::Command(Command::SetCoefficient { label, coefficient, value: stiffness }));
    }

    fn end_stage(&mut self, index: usize, by: EndedBy) -> Vec<Effect> {
        let result = self.result(by);
        self.outcome.stages.push(result);
        let mut effects = vec![Effect::StageEnded { stage: index, by }];
        if self.scenario.stages[index].guidance.is_some() {
            effects.push(Effect::Command(Command::SetGuidance { guidance: None }));
        }
        // A change of a coefficient lasts for one stage: the next stage starts with the scenario's own values.
        let stepped = self.scenario.stages[index].steps.as_ref().map(|steps| (steps.label, Coefficient::Stiffness));
        for (label, coefficient) in stepped.into_iter().chain(std::mem::take(&mut self.adjusted)) {
            let entry = self.scenario.tissues.by_label(label);
            if let Some(value) = entry.and_then(|entry| entry.material().coefficient(coefficient)) {
                effects.push(Effect::Command(Command::SetCoefficient { label, coefficient, value }));
            }
        }
        if by == EndedBy::Abort {
            self.phase = SessionPhase::Over;
            self.outcome.aborted = true;
            effects.extend([Effect::Command(Command::RunBur { running: false }), Effect::StagesOver]);
        } else {
            effects.extend(self.start_stage(index + 1));
        }
        effects
    }

    fn tick(&mut self, step: &Step, edits: &[Edit]) -> Vec<Effect> {
        self.now = step.tick.next();
        self.last_step = Some(*step);
        self.instrument = step.instrument;
        let decay_gone = |e: &&Edit| e.removes() && self.is_decay[usize::from(e.before.label.0)];
        if let Some(touch) = step.touch {
            // No lesion other than a possible site of a draw needs this: the labels of sites are their own.
            for (lesion, touched) in self.ground_truths.iter().zip(&mut self.touched) {
                *touched |= lesion.label == touch.label;
            }
        }
        self.decay_gone += edits.iter().filter(decay_gone).count();
        let SessionPhase::In(index) = self.phase else { return Vec::new() };
        let scenario = self.scenario.clone();
        let stage = &scenario.stages[index];
        let is_cleared = stage.ends.cleared.zip(self.cleared_pct()).is_some_and(|(wanted, now)| now >= wanted);
        if is_cleared && stage.cutting {
            return self.end_stage(index, EndedBy::Cleared);
        }
        if stage.time_limit.is_some_and(|limit| self.stage_seconds() >= limit) {
            return self.end_stage(index, EndedBy::Time);
        }
        let mut effects = Vec::new();
        if let Some(steps) = &stage.steps
            && self.now.seconds_since(self.step_started) >= steps.step_time
        {
            match self.step + 1 < steps.coefficients.len() {
                true => self.start_step(self.step + 1, stage, &mut effects),
                false => return self.end_stage(index, EndedBy::Time),
            }
        }
        effects
    }

    fn input(&mut self, input: &Input) -> Vec<Effect> {
        let refused = |why| vec![Effect::Refused { why }];
        match (input, self.phase) {
            (Input::Look(view), _) => {
                self.view = Some(*view).filter(TraineeView::is_valid);
                Vec::new()
            }
            (Input::PlaceHand(frame), _) => vec![Effect::Command(Command::PlaceHand { frame: *frame })],
            (Input::PressClutch(is_pressed), _) => {
                vec![Effect::Command(Command::PressClutch { is_pressed: *is_pressed })]
            }
            (Input::Rate { item, value }, SessionPhase::Over) => self.rate(item, *value),
            (Input::Rate { .. }, _) => refused(InputError::TooEarly),
            (_, SessionPhase::Waiting | SessionPhase::Over) => refused(InputError::NoStage),
            (Input::Take { instrument }, SessionPhase::In(index)) => {
                if !self.scenario.stages[index].instruments.contains(instrument) {
                    return refused(InputError::NotOnTray);
                }
                self.instrument = *instrument;
                vec![Effect::Command(Command::SelectInstrument { instrument: *instrument })]
            }
            (Input::Answer { question, value }, SessionPhase::In(index)) => self.answer(index, question, value),
            (Input::Adjust { label, coefficient, value }, SessionPhase::In(index)) => {
                self.adjust(index, *label, *coefficient, *value)
            }
            (Input::Chart(sign), SessionPhase::In(index)) => self.chart(index, *sign),
            (Input::Confirm, SessionPhase::In(index)) if self.scenario.stages[index].ends.confirmed => {
                self.end_stage(index, EndedBy::Confirmation)
            }
            (Input::Confirm, SessionPhase::In(_)) => refused(InputError::NotByConfirmation),
            (Input::Abort, SessionPhase::In(index)) => self.end_stage(index, EndedBy::Abort),
        }
    }

    fn adjust(&mut self, index: usize, label: Label, coefficient: Coefficient, value: f32) -> Vec<Effect> {
        let refused = |why| vec![Effect::Refused { why }];
        let stage = &self.scenario.stages[index];
        if !stage.is_adjustable {
            return refused(InputError::FixedTissues);
        }
        if stage.steps.as_ref().is_some_and(|steps| (steps.label, Coefficient::Stiffness) == (label, coefficient)) {
            return refused(InputError::SteppedStiffness);
        }
        let (least, most) = coefficient.range();
        if !(least..=most).contains(&value) {
            return refused(InputError::OutOfRange);
        }
        let entry = self.scenario.tissues.by_label(label);
        let is_idle = coefficient == Coefficient::CutForce && self.scenario.carving.law != CuttingLaw::Threshold;
        if is_idle || entry.and_then(|entry| entry.material().coefficient(coefficient)).is_none() {
            return refused(InputError::NoCoefficient);
        }
        if !self.adjusted.contains(&(label, coefficient)) {
            self.adjusted.push((label, coefficient));
        }
        vec![Effect::Command(Command::SetCoefficient { label, coefficient, value })]
    }

    fn chart(&mut self, index: usize, sign: ChartInput) -> Vec<Effect> {
        match self.chart_record(index, sign) {
            Err(why) => vec![Effect::Refused { why }],
            Ok(record) => {
                let same = |r: &ChartRecord| r.site == record.site && r.entry.is_same_kind(&record.entry);
                let before = self.charted.iter().position(same);
                match before {
                    Some(place) if sign == ChartInput::Calculus => {
                        self.charted.remove(place);
                    }
                    Some(place) => self.charted[place] = record,
                    None => self.charted.push(record),
                }
                let is_present = before.is_none() || sign != ChartInput::Calculus;
                vec![Effect::Charted { stage: index, record, is_present }]
            }
        }
    }

    /// Returns the chart record for the instrument's current position.
    fn chart_record(&self, index: usize, sign: ChartInput) -> Result<ChartRecord, InputError> {
        /// Distances, mm, at which the instrument's end still counts as being at the neck of the tooth: maximum
        /// distance from the tooth and maximum height above the gingival margin.
        const NECK_TOLERANCE: f32 = 2.0;
        let chart = self.scenario.stages[index].chart;
        let is_asked = match sign {
            ChartInput::Depth => chart.depths,
            ChartInput::Calculus => chart.calculus,
        };
        let (Some(gum), Some(step), true) = (&self.periodontium, &self.last_step, is_asked) else {
            return Err(InputError::NoChart);
        };
        let entry = &self.scenario.instruments[step.instrument];
        let shaft = self.tooth_from_world.rotate(step.shaft());
        let (probe, radius) = match &entry.end {
            WorkingEndEntry::Probe(probe) => (Some(probe), 0.5 * probe.diameter_mm),
            _ => (None, 0.0),
        };
        let end = self.tooth_from_world * step.tip - shaft * radius;
        let depth = gum.depth_along(end, shaft);
        if depth < -NECK_TOLERANCE || gum.distance_to_tooth(end) > NECK_TOLERANCE {
            return Err(InputError::NotAtNeck);
        }
        let finding = match (sign, probe) {
            (ChartInput::Calculus, _) => ChartEntry::Calculus,
            (ChartInput::Depth, None) => return Err(InputError::NoProbe),
            (ChartInput::Depth, Some(_)) if depth <= 0.0 => return Err(InputError::NotInSulcus),
            (ChartInput::Depth, Some(probe)) => {
                let force = step.touch.map_or(0.0, |touch| touch.spring);
                ChartEntry::Depth { reading: probe.reading_at(depth), depth, force }
            }
        };
        Ok(ChartRecord { site: ProbingSite::nearest(gum.azimuth(end)), at: self.now, entry: finding })
    }

    fn answer(&mut self, index: usize, question: &str, value: &AnswerValue) -> Vec<Effect> {
        let scenario = self.scenario.clone();
        let stage = &scenario.stages[index];
        let Some(place) = stage.ask.iter().position(|q| q.id == question) else {
            return vec![Effect::Refused { why: InputError::NotAsked }];
        };
        let Ok(correct) = self.check_answer(index, &stage.ask[place].kind, value) else {
            return vec![Effect::Refused { why: InputError::NoAnswer }];
        };
        if !self.is_examined(stage, &stage.ask[place].kind, value) {
            return vec![Effect::Refused { why: InputError::NotExamined }];
        }
        let step = stage.steps.as_ref().map(|s| (s.coefficients[self.step], self.step_started));
        self.answers[place] = Some(AnswerRecord { value: value.clone(), at: self.now, correct, step });
        let mut effects = vec![Effect::Answered { stage: index, question: place }];
        if stage.ends.answered && self.answers.iter().all(Option::is_some) {
            effects.extend(self.end_stage(index, EndedBy::Answer));
        }
        effects
    }

    /// Returns true unless the answer names a place of a draw at which no possible site was touched in this trial.
    fn is_examined(&self, stage: &Stage, kind: &QuestionKind, value: &AnswerValue) -> bool {
        let (QuestionKind::ToothWith { decay } | QuestionKind::QuadrantOf { decay }) = kind else { return true };
        let Some(draw) = stage.draw.as_ref().filter(|draw| draw.id == *decay) else { return true };
        // A quadrant is one of the tooth that the same stage's other answer names.
        let other = stage.ask.iter().zip(&self.answers).find_map(|(question, answer)| match (&question.kind, answer) {
            (QuestionKind::ToothWith { decay }, Some(answer)) if *decay == draw.id => Some(&answer.value),
            _ => None,
        });
        let is_on = |truth: &GroundTruth, tooth: &AnswerValue| *tooth == AnswerValue::Word(truth.tooth.clone());
        let is_named = |truth: &GroundTruth| match value {
            AnswerValue::Word(_) => is_on(truth, value),
            AnswerValue::Quadrant(quadrant) => {
                truth.quadrant == *quadrant && other.is_none_or(|tooth| is_on(truth, tooth))
            }
            _ => false,
        };
        let sites = self.ground_truths.iter().zip(&self.touched).filter(|(truth, _)| draw.sites.contains(&truth.decay));
        sites.into_iter().any(|(truth, touched)| *touched && is_named(truth))
    }

    /// Checks an answer: `None` for a question without a correct answer, `Err` for an answer that does not fit the
    /// question.
    fn check_answer(&self, stage: usize, kind: &QuestionKind, value: &AnswerValue) -> Result<Option<bool>, ()> {
        let draw = self.scenario.stages[stage].draw.as_ref();
        let truth = |decay: &str| match draw.filter(|draw| draw.id == decay) {
            Some(_) => self.drawn[stage].map(|lesion| &self.ground_truths[lesion]),
            None => self.ground_truths.iter().find(|t| t.decay == decay),
        };
        match (kind, value) {
            (QuestionKind::ToothWith { decay }, AnswerValue::Word(tooth)) => {
                let is_tooth = self.scenario.scene.teeth.iter().any(|t| t.id == *tooth);
                if is_tooth { Ok(truth(decay).map(|t| t.tooth == *tooth)) } else { Err(()) }
            }
            (QuestionKind::QuadrantOf { decay }, AnswerValue::Quadrant(quadrant @ 1..=4)) => {
                Ok(truth(decay).map(|t| t.quadrant == *quadrant))
            }
            (QuestionKind::Choice { options, correct }, AnswerValue::Word(word)) => {
                match options.iter().any(|(id, _)| id == word) {
                    true => Ok(correct.as_ref().map(|c| c == word)),
                    false => Err(()),
                }
            }
            (QuestionKind::YesNo { correct }, AnswerValue::YesNo(value)) => Ok(correct.map(|c| c == *value)),
            (QuestionKind::Number { correct, tolerance, .. }, AnswerValue::Number(value)) if value.is_finite() => {
                Ok(correct.map(|c| (c - value).abs() <= *tolerance))
            }
            (QuestionKind::Text, AnswerValue::Word(text)) if text.len() <= 10_000 => Ok(None),
            _ => Err(()),
        }
    }

    fn rate(&mut self, item: &str, value: u8) -> Vec<Effect> {
        let refused = |why| vec![Effect::Refused { why }];
        let Some(questionnaire) = &self.scenario.questionnaire else { return refused(InputError::NoQuestionnaire) };
        if value < 1 || value > questionnaire.steps {
            return refused(InputError::NoStep);
        }
        match questionnaire.items().position(|i| i.id == item) {
            Some(place) => {
                self.outcome.ratings[place] = Some(value);
                Vec::new()
            }
            None => refused(InputError::NoStatement),
        }
    }
}
