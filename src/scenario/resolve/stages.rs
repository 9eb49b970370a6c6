//! The parts of an exercise: what is in the tray, what is asked, when a part ends.

use super::{Resolver, written_teeth};
use crate::content::EndEntry;
use crate::diagnostic::did_you_mean;
use crate::scenario::file::{self, ScenarioFile};
use crate::scenario::{Charted, Ends, Question, QuestionKind, Stage, StiffnessSteps};

impl Resolver<'_> {
    pub(super) fn stages(&mut self, written: &ScenarioFile, lesions: &[String]) -> Vec<Stage> {
        self.unique(written.stages.iter().enumerate().map(|(i, s)| (s.id.as_str(), format!("/stages/{i}/id"))));
        let questions = written.stages.iter().enumerate().flat_map(|(i, s)| {
            s.ask.iter().enumerate().map(move |(j, q)| (q.id.as_str(), format!("/stages/{i}/ask/{j}/id")))
        });
        self.unique(questions);
        written
            .stages
            .iter()
            .enumerate()
            .map(|(i, s)| self.stage(s, written, lesions, &format!("/stages/{i}")))
            .collect()
    }

    fn stage(&mut self, written: &file::StageFile, scenario: &ScenarioFile, lesions: &[String], path: &str) -> Stage {
        let all: Vec<usize> = (0..scenario.instruments.len()).collect();
        let instruments = match &written.instruments {
            None => all,
            Some(ids) => self.chosen(ids, &scenario.instruments, &format!("{path}/instruments")),
        };
        let mut ends = Ends::default();
        for (index, end) in written.ends_when.iter().enumerate() {
            let at = format!("{path}/ends_when/{index}");
            match *end {
                file::EndFile::Answered => {
                    ends.answered = true;
                    if written.ask.is_empty() {
                        self.complain(
                            &at,
                            "endless-stage",
                            "the stage asks nothing that could be answered",
                            "add a question under \"ask\"",
                        );
                    }
                }
                file::EndFile::Confirmed => ends.confirmed = true,
                file::EndFile::ClearedPct(percent) => {
                    ends.cleared = Some(percent);
                    if lesions.is_empty() || !written.cutting {
                        let message = "no decay can be cleared in this stage";
                        self.complain(
                            &at,
                            "endless-stage",
                            message,
                            "add decay to a tooth, and set \"cutting\" to true",
                        );
                    }
                }
            }
        }
        if written.time_limit_s.is_none() && written.ends_when.is_empty() && written.stiffness_steps.is_none() {
            let help =
                "set \"time_limit_s\", or \"ends_when\" to \"confirmed\", \"answered\" or { \"cleared_pct\": … }";
            self.complain(path, "endless-stage", "nothing can end this stage", help);
        }
        let cuts = |index: &usize| {
            scenario.instruments.get(*index).and_then(|id| self.instruments.by_id(id)).is_some_and(|e| e.cuts)
        };
        if written.cutting && !instruments.iter().any(cuts) {
            self.complain(
                &format!("{path}/cutting"),
                "nothing-cuts",
                "no instrument of this stage cuts",
                "add a bur to \"instruments\"",
            );
        }
        let filling = written.filling.as_ref().and_then(|name| self.filling(name, &instruments, scenario, path));
        let steps = written.stiffness_steps.as_ref().map(|steps| StiffnessSteps {
            label: self.label(&steps.tissue, &format!("{path}/stiffness_steps/tissue")),
            coefficients: steps.coefficients.iter().map(|c| c.0).collect(),
            step_time: steps.step_time_s,
        });
        if written.adjustable && written.stiffness_steps.is_some() {
            let help = "leave one of both out: what is tested by steps cannot be left to the trainee";
            let message = "the trainee may change the tissue whose stiffness falls in steps";
            self.complain(&format!("{path}/adjustable"), "adjustable-steps", message, help);
        }
        let guidance = written.guidance.as_ref().and_then(|g| self.guidance(g, &format!("{path}/guidance")));
        let chart = Charted {
            depths: written.chart.contains(&file::ChartFile::Depth),
            calculus: written.chart.contains(&file::ChartFile::Calculus),
        };
        if chart != Charted::default()
            && !matches!(&scenario.scene, file::SceneFile::Jaw(jaw) if jaw.periodontium.is_some())
        {
            let help = "put the tooth into a \"jaw\" and give that \"periodontium\": {}";
            self.complain(&format!("{path}/chart"), "no-gum", "there is no gum with a sulcus to be charted", help);
        }
        let is_probe = |index: &usize| {
            let entry = scenario.instruments.get(*index).and_then(|id| self.instruments.by_id(id));
            entry.is_some_and(|e| matches!(e.end, EndEntry::Probe(_)))
        };
        if chart.depths && !instruments.iter().any(is_probe) {
            let help = "add a periodontal probe to \"instruments\": probe_unc15, probe_williams or probe_who";
            self.complain(&format!("{path}/chart"), "no-probe", "no instrument of this stage measures depths", help);
        }
        let ask = written
            .ask
            .iter()
            .enumerate()
            .map(|(i, q)| self.question(q, scenario, lesions, &format!("{path}/ask/{i}")))
            .collect();
        Stage {
            id: written.id.clone(),
            title: written.title.clone(),
            instruction: written.instruction.clone(),
            time_limit: written.time_limit_s,
            instruments,
            cutting: written.cutting,
            filling,
            show_decay: written.show_decay,
            is_adjustable: written.adjustable,
            steps,
            guidance,
            chart,
            ask,
            ends,
        }
    }

    /// What carriers lay: a tissue that can be packed, and an instrument that lays it.
    fn filling(
        &mut self,
        name: &str,
        instruments: &[usize],
        scenario: &ScenarioFile,
        path: &str,
    ) -> Option<crate::volume::Label> {
        let at = format!("{path}/filling");
        let label = self.label(name, &at);
        let entry = self.tissues.by_name(name)?;
        if entry.packing.is_none() {
            let packed: Vec<&str> =
                self.tissues.entries().iter().filter(|e| e.packing.is_some()).map(|e| e.name.as_str()).collect();
            let help = format!("give the tissue \"packing\", or take one of {}", packed.join(", "));
            self.complain(&at, "no-filling", format!("\"{name}\" cannot be packed"), help);
        }
        let lays = |index: &usize| {
            let entry = scenario.instruments.get(*index).and_then(|id| self.instruments.by_id(id));
            entry.is_some_and(|e| e.packs.is_some_and(|p| p.mm3_per_s > 0.0))
        };
        if !instruments.iter().any(lays) {
            let help = "add a carrier or a plastic instrument to \"instruments\"";
            self.complain(&at, "nothing-lays", "no instrument of this stage lays a filling", help);
        }
        Some(label)
    }

    /// Indices of instruments of the tray.
    fn chosen(&mut self, ids: &[String], tray: &[String], path: &str) -> Vec<usize> {
        let mut chosen = Vec::new();
        for (index, id) in ids.iter().enumerate() {
            match tray.iter().position(|t| t == id) {
                Some(place) if !chosen.contains(&place) => chosen.push(place),
                Some(_) => {}
                None => {
                    let help = did_you_mean(id, tray.iter().map(String::as_str));
                    let message = format!("\"{id}\" is not on the exercise's tray");
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
                if !matches!(scenario.scene, file::SceneFile::Pair(_)) {
                    let message = "there is only one tooth to choose from";
                    self.complain(
                        &format!("{path}/answer"),
                        "no-choice",
                        message,
                        "use a scene of two teeth: { \"pair\": … }",
                    );
                }
                QuestionKind::ToothWith { decay: decay.clone() }
            }
            file::AnswerFile::QuadrantOf(decay) => {
                self.lesion(decay, lesions, &format!("{path}/answer/quadrant_of"));
                if self.is_between_quadrants(scenario, decay) {
                    let message = format!("\"{decay}\" lies in the middle, or not on the chewing surface");
                    let help =
                        "put it into a quadrant: \"at\": \"random_quadrant\" on surface O, or { \"quadrant\": 1 }";
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
                let options = choice.options.iter().map(|o| (o.id.clone(), o.text.clone())).collect();
                QuestionKind::Choice { options, correct: choice.correct.clone() }
            }
            file::AnswerFile::YesNo(correct) => QuestionKind::YesNo { correct: *correct },
            file::AnswerFile::Number(number) => {
                QuestionKind::Number { unit: number.unit.clone(), correct: number.correct, tolerance: number.tolerance }
            }
            file::AnswerFile::Text => QuestionKind::Text,
        };
        Question { id: written.id.clone(), text: written.text.clone(), kind }
    }

    fn lesion(&mut self, name: &str, lesions: &[String], path: &str) {
        if !lesions.iter().any(|l| l == name) {
            let help = match lesions {
                [] => "no tooth has decay: add some under \"decay\"".to_string(),
                _ => did_you_mean(name, lesions.iter().map(String::as_str)),
            };
            self.complain(path, "unknown-decay", format!("no decay is named \"{name}\""), help);
        }
    }

    /// True when no quadrant is the right answer: a decay in the middle of a surface, or on a side of the tooth.
    fn is_between_quadrants(&self, scenario: &ScenarioFile, decay: &str) -> bool {
        let mut all = written_teeth(&scenario.scene).into_iter().flat_map(|t| &t.decay);
        all.any(|d| {
            d.id == decay && (d.surface != file::SurfaceFile::O || matches!(d.at, file::DecayPlaceFile::Centre))
        })
    }
}
