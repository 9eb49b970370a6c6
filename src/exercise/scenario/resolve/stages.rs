//! The stages of an exercise: their instruments, questions and end conditions.

use super::{Resolver, written_teeth};
use crate::catalog::{InstrumentEntry, WorkingEndEntry};
use crate::scenario::file;
use crate::scenario::file::ScenarioFile;
use crate::scenario::{ChartScope, Draw, EndConditions, Question, QuestionKind, Stage, StiffnessSteps};
use typodont_formats::diagnostic::did_you_mean;

impl Resolver<'_> {
    pub(super) fn stages(&mut self, written: &ScenarioFile, lesions: &[String]) -> Vec<Stage> {
        self.unique(written.stages.iter().enumerate().map(|(i, s)| (s.id.as_str(), format!("/stages/{i}/id"))));
        self.check_trial_ids(written);
        let questions = written.stages.iter().enumerate().flat_map(|(i, s)| {
            s.ask.iter().enumerate().map(move |(j, q)| (q.id.as_str(), format!("/stages/{i}/ask/{j}/id")))
        });
        self.unique(questions);
        written
            .stages
            .iter()
            .enumerate()
            .flat_map(|(i, s)| trials(self.stage(s, written, lesions, &format!("/stages/{i}"))))
            .collect()
    }

    /// Reports a stage that has the id of a trial of another stage, which results could not tell apart.
    fn check_trial_ids(&mut self, written: &ScenarioFile) {
        for stage in &written.stages {
            let trials = stage.draw.as_ref().map_or(1, |draw| draw.trials);
            for number in (1..=trials).filter(|_| trials > 1) {
                let id = trial_id(&stage.id, number);
                if let Some(index) = written.stages.iter().position(|other| other.id == id) {
                    let message = format!("\"{id}\" is the id of trial {number} of the stage \"{}\"", stage.id);
                    let help = "give one of the two stages another id";
                    self.complain(&format!("/stages/{index}/id"), "duplicate-id", message, help);
                }
            }
        }
    }

    fn stage(&mut self, written: &file::StageFile, scenario: &ScenarioFile, lesions: &[String], path: &str) -> Stage {
        let tray = &scenario.instruments;
        let instruments = match &written.instruments {
            None => (0..tray.len()).collect(),
            Some(ids) => self.stage_instruments(ids, tray, &format!("{path}/instruments")),
        };
        let ends = self.end_conditions(written, lesions, path);
        self.check_cutting(written, &instruments, tray, path);
        let filling = written.filling.as_ref().and_then(|name| self.filling(name, &instruments, scenario, path));
        let steps = self.stiffness_steps(written, path);
        let draw = written.draw.as_ref().map(|draw| self.draw(draw, written, lesions, path));
        // Questions may refer to the caries that was drawn, and not to a possible site.
        let lesions: Vec<String> = lesions.iter().filter(|id| !self.sites.contains(id)).cloned().collect();
        let lesions: Vec<String> = lesions.into_iter().chain(draw.iter().map(|draw| draw.id.clone())).collect();
        let guidance = written.guidance.as_ref().and_then(|g| self.guidance(g, &format!("{path}/guidance")));
        let chart = self.chart_scope(written, &instruments, scenario, path);
        let questions = written.ask.iter().enumerate();
        let ask = questions.map(|(i, q)| self.question(q, scenario, &lesions, &format!("{path}/ask/{i}"))).collect();
        Stage {
            id: written.id.clone(),
            title: written.title.to_string(),
            instruction: written.instruction.to_string(),
            time_limit: written.time_limit_s,
            instruments,
            cutting: written.cutting,
            filling,
            show_decay: written.show_decay,
            shows_controls: written.shows_controls,
            is_adjustable: written.adjustable,
            draw,
            steps,
            guidance,
            chart,
            ask,
            ends,
        }
    }

    /// Returns the draw of a stage's first trial, and reports a draw whose answer is not asked for or is always the same.
    fn draw(&mut self, written: &file::DrawFile, stage: &file::StageFile, lesions: &[String], path: &str) -> Draw {
        let at = format!("{path}/draw");
        for (index, site) in written.one_of.iter().enumerate() {
            self.lesion(site, lesions, &format!("{at}/one_of/{index}"));
        }
        self.unique(written.one_of.iter().enumerate().map(|(i, id)| (id.as_str(), format!("{at}/one_of/{i}"))));
        if lesions.contains(&written.id) {
            let message = format!("\"{}\" is the id of a decay already", written.id);
            self.complain(&format!("{at}/id"), "duplicate-id", message, "give the draw a name of its own");
        }
        let is_about = |question: &&file::QuestionFile| match &question.answer {
            file::AnswerFile::ToothWith(id) | file::AnswerFile::QuadrantOf(id) => *id == written.id,
            _ => false,
        };
        let asks_for_tooth = |q: &&&file::QuestionFile| matches!(q.answer, file::AnswerFile::ToothWith(_));
        let about: Vec<&file::QuestionFile> = stage.ask.iter().filter(is_about).collect();
        let for_tooth = about.iter().filter(asks_for_tooth).count();
        if about.is_empty() || for_tooth > 1 || about.len() - for_tooth > 1 {
            let message =
                "one question of the stage must ask for the tooth or the quadrant that was drawn, or one for each";
            let help =
                format!("add \"answer\": {{ \"tooth_with\": \"{}\" }} to one question under \"ask\"", written.id);
            self.complain(&at, "no-question", message, help);
        }
        let is_idle = !stage.ends_when.iter().any(|end| matches!(end, file::EndConditionFile::Answered));
        if is_idle {
            let message = "each trial must end with its answer";
            self.complain(&at, "endless-stage", message, "add \"answered\" to \"ends_when\"");
        }
        for (is_given, key) in
            [(stage.cutting, "cutting"), (stage.adjustable, "adjustable"), (stage.show_decay, "show_decay")]
        {
            if is_given {
                let message = format!("a stage with a draw cannot have \"{key}\", which would show the sites");
                self.complain(&format!("{path}/{key}"), "shown-draw", message, format!("remove \"{key}\""));
            }
        }
        Draw { id: written.id.clone(), sites: written.one_of.clone(), trial: 1, trials: written.trials }
    }

    /// Returns the conditions that end a stage, and reports conditions that cannot be met or are missing.
    fn end_conditions(&mut self, written: &file::StageFile, lesions: &[String], path: &str) -> EndConditions {
        let mut ends = EndConditions::default();
        for (index, end) in written.ends_when.iter().enumerate() {
            match *end {
                file::EndConditionFile::Answered => ends.answered = true,
                file::EndConditionFile::Confirmed => ends.confirmed = true,
                file::EndConditionFile::ClearedPct(percent) => ends.cleared = Some(percent),
            }
            self.check_end_condition(end, written, lesions, &format!("{path}/ends_when/{index}"));
        }
        if written.time_limit_s.is_none() && written.ends_when.is_empty() && written.stiffness_steps.is_none() {
            let help =
                "set \"time_limit_s\", or \"ends_when\" to \"confirmed\", \"answered\" or { \"cleared_pct\": … }";
            self.complain(path, "endless-stage", "the stage has no condition for its end", help);
        }
        ends
    }

    /// Reports an end condition that cannot be met in its stage.
    fn check_end_condition(
        &mut self,
        end: &file::EndConditionFile,
        stage: &file::StageFile,
        lesions: &[String],
        path: &str,
    ) {
        match end {
            file::EndConditionFile::Answered if stage.ask.is_empty() => {
                let message = "the stage ends when its questions are answered, but it asks none";
                self.complain(path, "endless-stage", message, "add a question under \"ask\"");
            }
            file::EndConditionFile::ClearedPct(_) if lesions.is_empty() || !stage.cutting => {
                let help = "add \"decay\" to a tooth, and set \"cutting\" to true";
                self.complain(path, "endless-stage", "no caries can be removed in this stage", help);
            }
            file::EndConditionFile::Answered
            | file::EndConditionFile::Confirmed
            | file::EndConditionFile::ClearedPct(_) => {}
        }
    }

    /// Reports a stage that allows cutting without an instrument that cuts.
    fn check_cutting(&mut self, written: &file::StageFile, instruments: &[usize], tray: &[String], path: &str) {
        if written.cutting && !self.has_instrument(instruments, tray, |entry| entry.cuts) {
            let message = "the stage allows cutting, but none of its instruments cuts";
            self.complain(&format!("{path}/cutting"), "nothing-cuts", message, "add a bur to \"instruments\"");
        }
    }

    /// Returns the stiffness steps of a stage, and reports steps of a tissue that the trainee may adjust.
    fn stiffness_steps(&mut self, written: &file::StageFile, path: &str) -> Option<StiffnessSteps> {
        let steps = written.stiffness_steps.as_ref().map(|steps| StiffnessSteps {
            label: self.label(&steps.tissue, &format!("{path}/stiffness_steps/tissue")),
            coefficients: steps.coefficients.iter().map(|c| c.0).collect(),
            step_time: steps.step_time_s,
        });
        if written.adjustable && written.stiffness_steps.is_some() {
            let help = "remove \"adjustable\" or \"stiffness_steps\"";
            let message = "the trainee could adjust the tissue whose stiffness the stage reduces in steps";
            self.complain(&format!("{path}/adjustable"), "adjustable-steps", message, help);
        }
        steps
    }

    /// Returns the scope of a stage's chart, and reports a chart without gingiva or without a periodontal probe.
    fn chart_scope(
        &mut self,
        written: &file::StageFile,
        instruments: &[usize],
        scenario: &ScenarioFile,
        path: &str,
    ) -> ChartScope {
        let path = format!("{path}/chart");
        let chart = ChartScope {
            depths: written.chart.contains(&file::ChartFile::Depth),
            calculus: written.chart.contains(&file::ChartFile::Calculus),
        };
        let has_sulcus = matches!(&scenario.scene, file::SceneFile::Jaw(jaw) if jaw.periodontium.is_some());
        if chart != ChartScope::default() && !has_sulcus {
            let message = "charting requires gingiva with a sulcus, and there is none";
            self.complain(&path, "no-gum", message, "put the tooth into a \"jaw\" with \"periodontium\": {}");
        }
        let is_probe = |entry: &InstrumentEntry| matches!(entry.end, WorkingEndEntry::Probe(_));
        if chart.depths && !self.has_instrument(instruments, &scenario.instruments, is_probe) {
            let message = "the stage charts depths, but none of its instruments is a periodontal probe";
            let help = "add a periodontal probe to \"instruments\": probe_unc15, probe_williams or probe_who";
            self.complain(&path, "no-probe", message, help);
        }
        chart
    }

    /// Returns true if one of a stage's instruments, given as indices in the tray, has a property.
    fn has_instrument(
        &self,
        instruments: &[usize],
        tray: &[String],
        has_property: impl Fn(&InstrumentEntry) -> bool,
    ) -> bool {
        let mut entries = instruments.iter().filter_map(|&index| self.instruments.by_id(tray.get(index)?));
        entries.any(has_property)
    }

    /// Returns the filling material of a stage: a tissue that can be packed. An instrument of the stage must be able to
    /// place it.
    fn filling(
        &mut self,
        name: &str,
        instruments: &[usize],
        scenario: &ScenarioFile,
        path: &str,
    ) -> Option<typodont_core::volume::Label> {
        let at = format!("{path}/filling");
        let label = self.label(name, &at);
        let entry = self.tissues.by_name(name)?;
        if entry.packing.is_none() {
            let packed: Vec<&str> =
                self.tissues.entries().iter().filter(|e| e.packing.is_some()).map(|e| e.name.as_str()).collect();
            let help = format!("add \"packing\" to the tissue, or use one of {}", packed.join(", "));
            self.complain(&at, "no-filling", format!("\"{name}\" cannot be packed"), help);
        }
        let places_material = |entry: &InstrumentEntry| entry.packs.is_some_and(|p| p.mm3_per_s > 0.0);
        if !self.has_instrument(instruments, &scenario.instruments, places_material) {
            let help = "add a carrier or a plastic instrument to \"instruments\"";
            self.complain(&at, "nothing-lays", "none of the instruments of this stage can place a filling", help);
        }
        Some(label)
    }

    /// Returns the indices of a stage's instruments in the tray.
    fn stage_instruments(&mut self, ids: &[String], tray: &[String], path: &str) -> Vec<usize> {
        let mut chosen = Vec::new();
        for (index, id) in ids.iter().enumerate() {
            match tray.iter().position(|t| t == id) {
                Some(place) if !chosen.contains(&place) => chosen.push(place),
                Some(_) => {}
                None => {
                    let help = did_you_mean(id, tray.iter().map(String::as_str));
                    let message = format!("\"{id}\" is not among the instruments of the exercise");
                    self.complain(&format!("{path}/{index}"), "unknown-instrument", message, help);
                }
            }
        }
        chosen
    }

    fn question(
        &mut self,
        written: &file::QuestionFile,
        scenario: &ScenarioFile,
        lesions: &[String],
        path: &str,
    ) -> Question {
        let kind = match &written.answer {
            file::AnswerFile::ToothWith(decay) => {
                self.lesion(decay, lesions, &format!("{path}/answer/tooth_with"));
                let has_one_tooth = match &scenario.scene {
                    file::SceneFile::Tooth(_) => true,
                    file::SceneFile::Jaw(jaw) => jaw.other_teeth.is_none(),
                    file::SceneFile::Pair(_) | file::SceneFile::DentalArch(_) => false,
                };
                if has_one_tooth {
                    let message = "there is only one tooth to choose from";
                    self.complain(
                        &format!("{path}/answer"),
                        "no-choice",
                        message,
                        "use a scene of several teeth: { \"pair\": … }, { \"dental_arch\": … }, or a \"jaw\" with \"other_teeth\"",
                    );
                }
                QuestionKind::ToothWith { decay: decay.clone() }
            }
            file::AnswerFile::QuadrantOf(decay) => {
                self.lesion(decay, lesions, &format!("{path}/answer/quadrant_of"));
                if self.is_between_quadrants(scenario, decay) {
                    let message =
                        format!("\"{decay}\" is in the centre of the surface, or not on the occlusal surface");
                    let help =
                        "place it in a quadrant: \"at\": \"random_quadrant\" on surface O, or { \"quadrant\": 1 }";
                    self.complain(&format!("{path}/answer/quadrant_of"), "no-quadrant", message, help);
                }
                QuestionKind::QuadrantOf { decay: decay.clone() }
            }
            file::AnswerFile::Choice(choice) => {
                self.unique(
                    choice
                        .options
                        .iter()
                        .enumerate()
                        .map(|(i, o)| (o.id.as_str(), format!("{path}/answer/choice/options/{i}/id"))),
                );
                if let Some(correct) = choice.correct.as_ref().filter(|c| !choice.options.iter().any(|o| o.id == **c)) {
                    let help = did_you_mean(correct, choice.options.iter().map(|o| o.id.as_str()));
                    let message = format!("\"{correct}\" is not one of the options");
                    self.complain(&format!("{path}/answer/choice/correct"), "unknown-option", message, help);
                }
                let options = choice.options.iter().map(|o| (o.id.clone(), o.text.to_string())).collect();
                QuestionKind::Choice { options, correct: choice.correct.clone() }
            }
            file::AnswerFile::YesNo(correct) => QuestionKind::YesNo { correct: *correct },
            file::AnswerFile::Number(number) => {
                QuestionKind::Number { unit: number.unit.clone(), correct: number.correct, tolerance: number.tolerance }
            }
            file::AnswerFile::Text => QuestionKind::Text,
        };
        Question { id: written.id.clone(), text: written.text.to_string(), kind }
    }

    /// Reports questions whose answer stands in the file: the same for every trainee and in every session.
    pub(super) fn find_fixed_answers(&mut self, scenario: &ScenarioFile) {
        let decay = |id: &str| written_teeth(&scenario.scene).into_iter().flat_map(|t| &t.decay).find(|d| d.id == id);
        for (stage, number) in scenario.stages.iter().zip(0..) {
            for (question, place) in stage.ask.iter().zip(0..) {
                let (id, key, is_fixed) = match &question.answer {
                    file::AnswerFile::ToothWith(id) => (id, "tooth_with", true),
                    file::AnswerFile::QuadrantOf(id) => {
                        let at = decay(id).map(|d| d.at);
                        let is_drawn =
                            matches!(at, Some(file::DecayPlaceFile::RandomQuadrant | file::DecayPlaceFile::Random));
                        (id, "quadrant_of", !is_drawn)
                    }
                    _ => continue,
                };
                if is_fixed && decay(id).is_some() {
                    let message = "the answer is the same in every session, so trainees need not find it";
                    let help = "add \"draw\" with several possible sites to the stage, and refer to the draw here";
                    let path = format!("/stages/{number}/ask/{place}/answer/{key}");
                    self.complain(&path, "fixed-answer", message, help);
                }
            }
        }
    }

    fn lesion(&mut self, name: &str, lesions: &[String], path: &str) {
        if !lesions.iter().any(|l| l == name) {
            let help = match lesions {
                [] => "no tooth has caries: add an entry under \"decay\"".to_string(),
                _ => did_you_mean(name, lesions.iter().map(String::as_str)),
            };
            self.complain(path, "unknown-decay", format!("there is no decay \"{name}\""), help);
        }
    }

    /// Returns true if no quadrant is the correct answer: for decay in the centre of a surface, or on a side of the
    /// tooth.
    fn is_between_quadrants(&self, scenario: &ScenarioFile, decay: &str) -> bool {
        let mut all = written_teeth(&scenario.scene).into_iter().flat_map(|t| &t.decay);
        all.any(|d| {
            d.id == decay && (d.surface != file::SurfaceFile::O || matches!(d.at, file::DecayPlaceFile::Centre))
        })
    }
}

/// Returns the id of a trial of a stage with several trials.
fn trial_id(id: &str, number: u32) -> String {
    format!("{id}-{number}")
}

/// Returns the title of a trial of a stage.
pub(super) fn trial_title(title: &str, number: u32, trials: u32) -> String {
    format!("{title} ({number}/{trials})")
}

/// Returns the trials of a stage, one stage each: the stage itself unless it has a draw with several trials.
fn trials(stage: Stage) -> Vec<Stage> {
    let Some(draw) = stage.draw.clone().filter(|draw| draw.trials > 1) else { return vec![stage] };
    let trial = |number: u32| Stage {
        id: trial_id(&stage.id, number),
        title: trial_title(&stage.title, number, draw.trials),
        draw: Some(Draw { trial: number, ..draw.clone() }),
        ..stage.clone()
    };
    (1..=draw.trials).map(trial).collect()
}
