//! What earns points, and what fails a session at once.

use super::{Resolver, written_teeth};
use crate::diagnostic::did_you_mean;
use crate::scenario::file;
use crate::scenario::{HardFail, Limit, Metric, QuestionKind, Rubric, RubricItem, Stage, Zone, metric};

/// What there is to measure.
#[derive(Clone, Copy)]
pub(super) struct Has {
    decay: bool,
    filling: bool,
    tooth_question: bool,
    quadrant_question: bool,
    judged_question: bool,
    stiffness_steps: bool,
    depth_chart: bool,
    calculus_chart: bool,
    calculus: bool,
}

impl Has {
    pub fn of(written: &file::ScenarioFile, stages: &[Stage]) -> Has {
        let teeth = written_teeth(&written.scene);
        let asks = |is_meant: fn(&QuestionKind) -> bool| stages.iter().flat_map(|s| &s.ask).any(|q| is_meant(&q.kind));
        Has {
            decay: teeth.iter().any(|t| !t.decay.is_empty()),
            filling: teeth.iter().any(|t| t.cavity.is_some()) && written.stages.iter().any(|s| s.filling.is_some()),
            tooth_question: asks(|kind| matches!(kind, QuestionKind::ToothWith { .. })),
            quadrant_question: asks(|kind| matches!(kind, QuestionKind::QuadrantOf { .. })),
            judged_question: asks(QuestionKind::is_judged),
            stiffness_steps: stages.iter().any(|s| s.steps.is_some()),
            depth_chart: stages.iter().any(|s| s.chart.depths),
            calculus_chart: stages.iter().any(|s| s.chart.calculus),
            calculus: teeth.iter().any(|t| !t.calculus.is_empty()),
        }
    }

    /// What a measure lacks to have a value: a code, what it needs, and what to do.
    fn lacks(&self, measure: &str) -> Option<(&'static str, &'static str, &'static str)> {
        let is_of = |table: &[metric::About]| table.iter().any(|about| about.name == measure);
        let needs: &[(bool, &str, &str, &str)] = match measure {
            "decay_cleared_pct" | "healthy_per_decay_pct" | "efficiency_pct_s" => &[(
                self.decay,
                "no-decay",
                "needs decay, and no tooth has any",
                "give a tooth decay, or take a measure of the target zone such as recall",
            )],
            "detect_tooth" => &[(
                self.tooth_question,
                "no-question",
                "needs a question which tooth has the decay, and no stage asks one",
                "let a stage ask it, or take another measure",
            )],
            "detect_level" | "detect_level_time_s" => &[
                (
                    self.tooth_question,
                    "no-question",
                    "needs a question which tooth has the decay, and no stage asks one",
                    "let a stage ask it, or take another measure",
                ),
                (
                    self.stiffness_steps || measure == "detect_level_time_s",
                    "no-steps",
                    "needs stiffness steps, and no stage has any",
                    "give the stage that asks \"stiffness_steps\", or take another measure",
                ),
            ],
            "detect_quadrant" | "detect_quadrant_time_s" => &[(
                self.quadrant_question,
                "no-question",
                "needs a question in which quadrant the decay is, and no stage asks one",
                "let a stage ask it, or take another measure",
            )],
            "questions_right_pct" => &[(
                self.judged_question,
                "no-question",
                "needs a question with a right answer, and no stage asks one",
                "let a stage ask one, or give a question its right answer",
            )],
            "calculus_found_pct" => &[
                (
                    self.calculus_chart,
                    "no-chart",
                    "needs a chart of calculus, and no stage asks for one",
                    "let a stage \"chart\" calculus, or take another measure",
                ),
                (
                    self.calculus,
                    "no-calculus",
                    "needs calculus, and no tooth has any",
                    "give the tooth \"calculus\", or take another measure",
                ),
            ],
            "calculus_false_alarms" => &[(
                self.calculus_chart,
                "no-chart",
                "needs a chart of calculus, and no stage asks for one",
                "let a stage \"chart\" calculus, or take another measure",
            )],
            _ if is_of(metric::CHARTING) => &[(
                self.depth_chart,
                "no-chart",
                "needs a chart of depths, and no stage asks for one",
                "let a stage \"chart\" depths, or take another measure",
            )],
            _ if is_of(metric::OF_FILLINGS) => &[(
                self.filling,
                "no-filling",
                "needs a prepared cavity that is to be filled",
                "give a tooth a \"cavity\", and a stage a \"filling\"",
            )],
            _ => &[],
        };
        needs.iter().find(|(has, ..)| !has).map(|&(_, code, message, help)| (code, message, help))
    }
}

/// Points of all rubric items together.
const POINTS: f64 = 100.0;

impl Resolver<'_> {
    pub(super) fn rubric(&mut self, written: &file::RubricFile, zones: &[Zone], has: Has) -> Rubric {
        let sum: f64 = written.items.iter().map(|i| i.points).sum();
        if (sum - POINTS).abs() > 1e-6 {
            let help = "change the items' points so that together they make 100";
            self.complain("/rubric/items", "wrong-sum", format!("the points sum to {sum}, not 100"), help);
        }
        let mut items = Vec::new();
        for (index, item) in written.items.iter().enumerate() {
            let path = format!("/rubric/items/{index}");
            if item.full_at == item.zero_at {
                let message = "full_at and zero_at are equal";
                self.complain(
                    &path,
                    "no-range",
                    message,
                    "between the two values the points rise in proportion: they must differ",
                );
            }
            if let Some(metric) = self.metric(&item.metric, zones, &format!("{path}/metric")) {
                self.check_direction(&metric, item, &path);
                self.check_needs(&metric, has, &format!("{path}/metric"));
                let &file::RubricItemFile { points, full_at, zero_at, .. } = item;
                items.push(RubricItem { title: item.title.clone(), metric, points, full_at, zero_at });
            }
        }
        let mut hard_fails = Vec::new();
        for (index, fail) in written.hard_fails.iter().enumerate() {
            let path = format!("/rubric/hard_fails/{index}/metric");
            if let Some(metric) = self.metric(&fail.metric, zones, &path) {
                self.check_needs(&metric, has, &path);
                let when = match fail.when {
                    file::FailFile::Above(value) => Limit::Above(value),
                    file::FailFile::Below(value) => Limit::Below(value),
                };
                hard_fails.push(HardFail { title: fail.title.clone(), metric, when });
            }
        }
        Rubric { pass_points: written.pass_points, items, hard_fails }
    }

    /// A rubric that rewards the wrong end of a measure is a slip of the pen.
    fn check_direction(&mut self, metric: &Metric, item: &file::RubricItemFile, path: &str) {
        let (is_backward, word) = match metric.about.better {
            metric::Better::Higher => (item.full_at < item.zero_at, "higher"),
            metric::Better::Lower => (item.full_at > item.zero_at, "lower"),
            metric::Better::Neither => (false, ""),
        };
        if is_backward {
            let message = format!("the worse value of \"{}\" earns the points", metric.name());
            let help = format!("{word} is better: exchange full_at and zero_at");
            self.complain(&format!("{path}/full_at"), "backward-rubric", message, help);
        }
    }

    /// A measure of what is not there has no value: nobody could earn its points.
    fn check_needs(&mut self, metric: &Metric, has: Has, path: &str) {
        if let Some((code, message, help)) = has.lacks(metric.about.name) {
            self.complain(path, code, format!("\"{}\" {message}", metric.name()), help);
        }
    }

    fn metric(&mut self, name: &str, zones: &[Zone], path: &str) -> Option<Metric> {
        match Metric::parse(name) {
            Ok(metric) => {
                if let Some(metric::Argument::Zone(zone)) = &metric.argument
                    && !zones.iter().any(|z| z.id == *zone)
                {
                    let help = did_you_mean(zone, zones.iter().map(|z| z.id.as_str()));
                    self.complain(path, "unknown-zone", format!("no zone is named \"{zone}\""), help);
                    return None;
                }
                Some(metric)
            }
            Err(metric::Unknown::Name(name)) => {
                let help = did_you_mean(&name, metric::names());
                self.complain(path, "unknown-metric", format!("no measure is named \"{name}\""), help);
                None
            }
            Err(metric::Unknown::Argument(help)) => {
                self.complain(path, "unknown-metric", format!("\"{name}\" is not complete"), help);
                None
            }
        }
    }
}
