//! What happens in a lesson: stages, time limits, steps, answers.
//!
//! Takes a scenario and events. Gives effects: what to tell the simulation and what to tell people. Never reads a clock
//! (time is the tick of the events), never touches a device, a file or the screen.

mod run;
mod live;
mod operator;
mod refusal;

pub use live::{Broken, COMMAND_LAG_TICKS, Heard, Kept, Live};
pub use operator::{ActionFile, Operator, OperatorFile};
pub use refusal::Refusal;
pub use run::{Observer, Progress, Trainee, run};

use crate::content::{EndEntry, Role};
use crate::device::Spec;
use crate::frame::Pose;
use crate::scenario::{Periodontium, QuestionKind, Scenario, Site, Stage, Workpiece};
use crate::sim::{Command, RAMP_TICKS, Setup, Step};
use crate::tick::Tick;
use crate::touch::{Coefficient, CuttingLaw, Matter};
use crate::volume::{Edit, Label, Volume};
use std::sync::Arc;

/// The simulation of a scenario on a workpiece, for a device.
pub fn setup(scenario: &Scenario, workpiece: &Workpiece, device: Spec) -> Setup {
    Setup {
        matter: Matter { volume: Volume::clone(&workpiece.volume), around: workpiece.around.clone() },
        materials: scenario.tissues.materials(),
        factors: scenario.factors.clone(),
        instruments: scenario.instruments.iter().map(|i| i.make()).collect(),
        carving: scenario.carving,
        fillings: scenario.tissues.fillings(),
        vibration: scenario.vibration,
        guidances: scenario.guidances.clone(),
        world_from_tooth: workpiece.world_from_tooth,
        device,
        ramp: RAMP_TICKS,
    }
}

/// What a person does besides moving the hand.
#[derive(Clone, Debug, PartialEq)]
pub enum Input {
    /// Takes an instrument of the tray, by index.
    Take { instrument: usize },
    /// Answers a question of the current stage. A second answer replaces the first.
    Answer { question: String, value: Answer },
    /// Gives one of a tissue's coefficients another value, where the stage lets people try what they feel like.
    Adjust { label: Label, coefficient: Coefficient, value: f32 },
    /// Notes something in the periodontal chart, at the site where the instrument is.
    Chart(Sign),
    /// Says that the stage is done.
    Confirm,
    /// Rates a statement of the questionnaire.
    Rate { item: String, value: u8 },
    /// Ends the session before its time.
    Abort,
}

/// What is noted in a periodontal chart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sign {
    /// The depth that the probe shows now. A second reading at a site replaces the first.
    Depth,
    /// Calculus is felt here. Said a second time at a site it is taken back.
    Calculus,
}

/// An answer to a question.
#[derive(Clone, Debug, PartialEq)]
pub enum Answer {
    /// Id of a tooth or of an option, or free text.
    Word(String),
    Quadrant(u8),
    YesNo(bool),
    Number(f64),
}

/// What moves a session on.
#[derive(Clone, Copy, Debug)]
pub enum Event<'a> {
    /// A person's input, before the step of the current tick.
    Input(&'a Input),
    /// A turned tick and what fell in it.
    Tick { step: &'a Step, edits: &'a [Edit] },
}

/// What follows from an event.
#[derive(Clone, Debug, PartialEq)]
pub enum Effect {
    /// To be applied to the simulation before its next step.
    Tell(Command),
    StageStarted {
        stage: usize,
    },
    /// A tissue's stiffness has fallen to another step.
    StepStarted {
        stage: usize,
        step: usize,
    },
    Answered {
        stage: usize,
        question: usize,
    },
    /// Something was noted in the chart, or taken back.
    Charted {
        stage: usize,
        note: Note,
        is_there: bool,
    },
    StageEnded {
        stage: usize,
        by: EndedBy,
    },
    /// All stages are over; the questionnaire, if there is one, may be answered.
    StagesOver,
    /// An input that does not fit, and why. It changes nothing.
    Refused {
        why: Refusal,
    },
}

/// Why a stage ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EndedBy {
    Time,
    Answer,
    Confirmation,
    /// So much decay was gone.
    Cleared,
    Abort,
}

/// What came of a stage.
#[derive(Clone, Debug, PartialEq)]
pub struct StageResult {
    pub started: Tick,
    pub ended: Tick,
    pub ended_by: EndedBy,
    /// In the order of the stage's questions; `None` where none was given.
    pub answers: Vec<Option<Given>>,
    /// What the person changed of how tissues feel, in the order in which each was first changed.
    pub adjusted: Vec<(Label, Coefficient)>,
    /// What was noted in the periodontal chart, in the order of its first noting.
    pub charted: Vec<Note>,
}

/// A line of a periodontal chart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Note {
    pub site: Site,
    pub at: Tick,
    pub what: Noted,
}

/// What stands in it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Noted {
    /// As the probe's marks show it, whole mm; as deep as its end was, mm; and how hard it was pressed, N.
    Depth {
        read: u8,
        depth: f32,
        force: f32,
    },
    Calculus,
}

impl Noted {
    /// True when both say of the same thing, as a second reading at a site does.
    pub fn is_like(&self, other: &Noted) -> bool {
        matches!((self, other), (Noted::Depth { .. }, Noted::Depth { .. }) | (Noted::Calculus, Noted::Calculus))
    }
}

/// An answer that was given.
#[derive(Clone, Debug, PartialEq)]
pub struct Given {
    pub value: Answer,
    pub at: Tick,
    /// Whether it was right; `None` where nothing is right or wrong.
    pub right: Option<bool>,
    /// Stiffness coefficient in force, where the stage has steps, and when that step began.
    pub step: Option<(f32, Tick)>,
}

/// What came of a session.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Outcome {
    /// Stages that were started, in order.
    pub stages: Vec<StageResult>,
    /// One per item of the questionnaire, in order.
    pub ratings: Vec<Option<u8>>,
    pub aborted: bool,
}

/// The state of a lesson.
#[derive(Clone, Debug)]
pub struct Session {
    scenario: Arc<Scenario>,
    /// For each lesson's lesion: its tooth's id and its quadrant.
    truths: Vec<Truth>,
    is_decay: [bool; 256],
    now: Tick,
    phase: Phase,
    started: Tick,
    step: usize,
    step_started: Tick,
    answers: Vec<Option<Given>>,
    adjusted: Vec<(Label, Coefficient)>,
    charted: Vec<Note>,
    /// The gum, and what turns the world's places into its own.
    gum: Option<Arc<Periodontium>>,
    tooth_from_world: Pose,
    /// The newest tick, if there was one.
    newest: Option<Step>,
    instrument: usize,
    /// What carriers lay.
    filling: Option<Label>,
    decay_at_start: usize,
    decay_gone: usize,
    outcome: Outcome,
}

#[derive(Clone, Debug, PartialEq)]
struct Truth {
    decay: String,
    tooth: String,
    quadrant: u8,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    Waiting,
    In(usize),
    Over,
}

impl Session {
    /// A lesson about to begin on a workpiece.
    pub fn new(scenario: Arc<Scenario>, workpiece: &Workpiece) -> Session {
        let truth = |l: &crate::scenario::Lesion| Truth {
            decay: l.id.clone(),
            tooth: workpiece.teeth[l.tooth].id.clone(),
            quadrant: l.quadrant,
        };
        let is_decay = std::array::from_fn(|l| scenario.tissues.role(Label(l as u8)) == Some(Role::Decay));
        let decay_at_start = workpiece.volume.tissues().filter(|l| is_decay[usize::from(l.0)]).count();
        let ratings = scenario.questionnaire.as_ref().map_or(0, |q| q.items().count());
        Session {
            truths: workpiece.lesions.iter().map(truth).collect(),
            scenario,
            is_decay,
            now: Tick::ZERO,
            phase: Phase::Waiting,
            started: Tick::ZERO,
            step: 0,
            step_started: Tick::ZERO,
            answers: Vec::new(),
            adjusted: Vec::new(),
            charted: Vec::new(),
            gum: workpiece.periodontium.clone(),
            tooth_from_world: workpiece.world_from_tooth.inverse(),
            newest: None,
            instrument: 0,
            filling: None,
            decay_at_start,
            decay_gone: 0,
            outcome: Outcome { ratings: vec![None; ratings], ..Outcome::default() },
        }
    }

    /// Starts the first stage; to be called once, before the first tick.
    pub fn begin(&mut self) -> Vec<Effect> {
        self.start_stage(0)
    }

    /// Carries out an event.
    pub fn advance(&mut self, event: Event) -> Vec<Effect> {
        match event {
            Event::Input(input) => self.input(input),
            Event::Tick { step, edits } => self.tick(step, edits),
        }
    }

    pub fn scenario(&self) -> &Scenario {
        &self.scenario
    }

    /// The current stage with its index; `None` when all are over.
    pub fn stage(&self) -> Option<(usize, &Stage)> {
        match self.phase {
            Phase::In(index) => Some((index, &self.scenario.stages[index])),
            Phase::Waiting | Phase::Over => None,
        }
    }

    /// Seconds since the current stage began.
    pub fn stage_seconds(&self) -> f64 {
        self.now.seconds_since(self.started)
    }

    /// Which questions of the current stage are answered.
    pub fn answered(&self) -> impl Iterator<Item = bool> + '_ {
        self.answers.iter().map(Option::is_some)
    }

    /// Share of the decay at the start that is gone, %; `None` without decay.
    pub fn cleared_pct(&self) -> Option<f64> {
        (self.decay_at_start > 0).then(|| 100.0 * self.decay_gone as f64 / self.decay_at_start as f64)
    }

    pub fn are_stages_over(&self) -> bool {
        self.phase == Phase::Over
    }

    /// True when nothing is left to do: stages over and, if there is a questionnaire, every item rated.
    pub fn is_complete(&self) -> bool {
        self.are_stages_over() && (self.outcome.aborted || self.outcome.ratings.iter().all(Option::is_some))
    }

    /// What came of the session so far: finished stages, and the current one as if it ended now.
    pub fn outcome(&self) -> Outcome {
        let mut outcome = self.outcome.clone();
        if let Phase::In(_) = self.phase {
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
            self.phase = Phase::Over;
            return vec![Effect::Tell(Command::RunBur { running: false }), Effect::StagesOver];
        };
        self.phase = Phase::In(index);
        self.started = self.now;
        self.answers = vec![None; stage.ask.len()];
        self.charted.clear();
        let mut effects =
            vec![Effect::StageStarted { stage: index }, Effect::Tell(Command::RunBur { running: stage.cutting })];
        if !stage.instruments.contains(&self.instrument) {
            self.instrument = stage.instruments[0];
            effects.push(Effect::Tell(Command::Take { instrument: self.instrument }));
        }
        if stage.filling != self.filling {
            self.filling = stage.filling;
            effects.push(Effect::Tell(Command::Fill { label: stage.filling }));
        }
        if stage.guidance.is_some() {
            effects.push(Effect::Tell(Command::Guide { guidance: stage.guidance }));
        }
        if stage.steps.is_some() {
            self.start_step(0, stage, &mut effects);
        }
        effects
    }

    fn start_step(&mut self, step: usize, stage: &Stage, effects: &mut Vec<Effect>) {
        let (Phase::In(index), Some(steps)) = (self.phase, &stage.steps) else { return };
        self.step = step;
        self.step_started = self.now;
        effects.push(Effect::StepStarted { stage: index, step });
        let stiffness = steps.coefficients[step];
        let (label, coefficient) = (steps.label, Coefficient::Stiffness);
        effects.push(Effect::Tell(Command::Set { label, coefficient, value: stiffness }));
    }

    fn end_stage(&mut self, index: usize, by: EndedBy) -> Vec<Effect> {
        let result = self.result(by);
        self.outcome.stages.push(result);
        let mut effects = vec![Effect::StageEnded { stage: index, by }];
        if self.scenario.stages[index].guidance.is_some() {
            effects.push(Effect::Tell(Command::Guide { guidance: None }));
        }
        // What was changed belongs to its stage: the next one finds the tissues as the scenario describes them.
        let stepped = self.scenario.stages[index].steps.as_ref().map(|steps| (steps.label, Coefficient::Stiffness));
        for (label, coefficient) in stepped.into_iter().chain(std::mem::take(&mut self.adjusted)) {
            let entry = self.scenario.tissues.by_label(label);
            if let Some(value) = entry.and_then(|entry| entry.material().coefficient(coefficient)) {
                effects.push(Effect::Tell(Command::Set { label, coefficient, value }));
            }
        }
        if by == EndedBy::Abort {
            self.phase = Phase::Over;
            self.outcome.aborted = true;
            effects.extend([Effect::Tell(Command::RunBur { running: false }), Effect::StagesOver]);
        } else {
            effects.extend(self.start_stage(index + 1));
        }
        effects
    }

    fn tick(&mut self, step: &Step, edits: &[Edit]) -> Vec<Effect> {
        self.now = step.tick.next();
        self.newest = Some(*step);
        self.instrument = step.instrument;
        let decay_gone = |e: &&Edit| e.removes() && self.is_decay[usize::from(e.before.label.0)];
        self.decay_gone += edits.iter().filter(decay_gone).count();
        let Phase::In(index) = self.phase else { return Vec::new() };
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
            (Input::Rate { item, value }, Phase::Over) => self.rate(item, *value),
            (Input::Rate { .. }, _) => refused(Refusal::TooEarly),
            (_, Phase::Waiting | Phase::Over) => refused(Refusal::NoStage),
            (Input::Take { instrument }, Phase::In(index)) => {
                if !self.scenario.stages[index].instruments.contains(instrument) {
                    return refused(Refusal::NotOnTray);
                }
                self.instrument = *instrument;
                vec![Effect::Tell(Command::Take { instrument: *instrument })]
            }
            (Input::Answer { question, value }, Phase::In(index)) => self.answer(index, question, value),
            (Input::Adjust { label, coefficient, value }, Phase::In(index)) => {
                self.adjust(index, *label, *coefficient, *value)
            }
            (Input::Chart(sign), Phase::In(index)) => self.chart(index, *sign),
            (Input::Confirm, Phase::In(index)) if self.scenario.stages[index].ends.confirmed => {
                self.end_stage(index, EndedBy::Confirmation)
            }
            (Input::Confirm, Phase::In(_)) => refused(Refusal::NotByConfirmation),
            (Input::Abort, Phase::In(index)) => self.end_stage(index, EndedBy::Abort),
        }
    }

    fn adjust(&mut self, index: usize, label: Label, coefficient: Coefficient, value: f32) -> Vec<Effect> {
        let refused = |why| vec![Effect::Refused { why }];
        let stage = &self.scenario.stages[index];
        if !stage.is_adjustable {
            return refused(Refusal::FixedTissues);
        }
        if stage.steps.as_ref().is_some_and(|steps| (steps.label, Coefficient::Stiffness) == (label, coefficient)) {
            return refused(Refusal::SteppedStiffness);
        }
        let (least, most) = coefficient.range();
        if !(least..=most).contains(&value) {
            return refused(Refusal::OutOfRange);
        }
        let entry = self.scenario.tissues.by_label(label);
        let is_idle = coefficient == Coefficient::CutForce && self.scenario.carving.law != CuttingLaw::Threshold;
        if is_idle || entry.and_then(|entry| entry.material().coefficient(coefficient)).is_none() {
            return refused(Refusal::NoCoefficient);
        }
        if !self.adjusted.contains(&(label, coefficient)) {
            self.adjusted.push((label, coefficient));
        }
        vec![Effect::Tell(Command::Set { label, coefficient, value })]
    }

    fn chart(&mut self, index: usize, sign: Sign) -> Vec<Effect> {
        match self.noted(index, sign) {
            Err(why) => vec![Effect::Refused { why }],
            Ok(note) => {
                let before = self.charted.iter().position(|n| n.site == note.site && n.what.is_like(&note.what));
                match before {
                    Some(place) if sign == Sign::Calculus => {
                        self.charted.remove(place);
                    }
                    Some(place) => self.charted[place] = note,
                    None => self.charted.push(note),
                }
                let is_there = before.is_none() || sign != Sign::Calculus;
                vec![Effect::Charted { stage: index, note, is_there }]
            }
        }
    }

    /// What is to be noted now, by where the instrument is.
    fn noted(&self, index: usize, sign: Sign) -> Result<Note, Refusal> {
        /// An end so far above the margin, mm, is not at a tooth's neck any more, nor one that far off the tooth.
        const OFF: f32 = 2.0;
        let chart = self.scenario.stages[index].chart;
        let is_asked = match sign {
            Sign::Depth => chart.depths,
            Sign::Calculus => chart.calculus,
        };
        let (Some(gum), Some(step), true) = (&self.gum, &self.newest, is_asked) else { return Err(Refusal::NoChart) };
        let entry = &self.scenario.instruments[step.instrument];
        let shaft = self.tooth_from_world.turn(step.shaft);
        let (probe, radius) = match &entry.end {
            EndEntry::Probe(probe) => (Some(probe), 0.5 * probe.diameter_mm),
            _ => (None, 0.0),
        };
        let end = self.tooth_from_world * step.tip - shaft * radius;
        let depth = gum.depth_along(end, shaft);
        if depth < -OFF || gum.away(end) > OFF {
            return Err(Refusal::NotAtNeck);
        }
        let what = match (sign, probe) {
            (Sign::Calculus, _) => Noted::Calculus,
            (Sign::Depth, None) => return Err(Refusal::NoProbe),
            (Sign::Depth, Some(_)) if depth <= 0.0 => return Err(Refusal::NotInSulcus),
            (Sign::Depth, Some(probe)) => {
                let force = step.touch.map_or(0.0, |touch| touch.spring);
                Noted::Depth { read: probe.read(depth), depth, force }
            }
        };
        Ok(Note { site: Site::nearest(gum.turn(end)), at: self.now, what })
    }

    fn answer(&mut self, index: usize, question: &str, value: &Answer) -> Vec<Effect> {
        let scenario = self.scenario.clone();
        let stage = &scenario.stages[index];
        let Some(place) = stage.ask.iter().position(|q| q.id == question) else {
            return vec![Effect::Refused { why: Refusal::NotAsked }];
        };
        let Ok(right) = self.judge(&stage.ask[place].kind, value) else {
            return vec![Effect::Refused { why: Refusal::NoAnswer }];
        };
        let step = stage.steps.as_ref().map(|s| (s.coefficients[self.step], self.step_started));
        self.answers[place] = Some(Given { value: value.clone(), at: self.now, right, step });
        let mut effects = vec![Effect::Answered { stage: index, question: place }];
        if stage.ends.answered && self.answers.iter().all(Option::is_some) {
            effects.extend(self.end_stage(index, EndedBy::Answer));
        }
        effects
    }

    /// Whether an answer is right; `Err` when it does not fit the question at all.
    fn judge(&self, kind: &QuestionKind, value: &Answer) -> Result<Option<bool>, ()> {
        let truth = |decay: &str| self.truths.iter().find(|t| t.decay == decay);
        match (kind, value) {
            (QuestionKind::ToothWith { decay }, Answer::Word(tooth)) => {
                let is_tooth = self.scenario.scene.teeth.iter().any(|t| t.id == *tooth);
                if is_tooth { Ok(truth(decay).map(|t| t.tooth == *tooth)) } else { Err(()) }
            }
            (QuestionKind::QuadrantOf { decay }, Answer::Quadrant(quadrant @ 1..=4)) => {
                Ok(truth(decay).map(|t| t.quadrant == *quadrant))
            }
            (QuestionKind::Choice { options, correct }, Answer::Word(word)) => {
                match options.iter().any(|(id, _)| id == word) {
                    true => Ok(correct.as_ref().map(|c| c == word)),
                    false => Err(()),
                }
            }
            (QuestionKind::YesNo { correct }, Answer::YesNo(value)) => Ok(correct.map(|c| c == *value)),
            (QuestionKind::Number { correct, tolerance, .. }, Answer::Number(value)) if value.is_finite() => {
                Ok(correct.map(|c| (c - value).abs() <= *tolerance))
            }
            (QuestionKind::Text, Answer::Word(text)) if text.len() <= 10_000 => Ok(None),
            _ => Err(()),
        }
    }

    fn rate(&mut self, item: &str, value: u8) -> Vec<Effect> {
        let refused = |why| vec![Effect::Refused { why }];
        let Some(questionnaire) = &self.scenario.questionnaire else { return refused(Refusal::NoQuestionnaire) };
        if value < 1 || value > questionnaire.steps {
            return refused(Refusal::NoStep);
        }
        match questionnaire.items().position(|i| i.id == item) {
            Some(place) => {
                self.outcome.ratings[place] = Some(value);
                Vec::new()
            }
            None => refused(Refusal::NoStatement),
        }
    }
}
