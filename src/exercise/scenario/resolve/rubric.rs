//! The rubric: items that earn points, and critical errors.

use super::{Resolver, written_teeth};
use crate::scenario::file;
use crate::scenario::metric::RequiredFeature;
use crate::scenario::{HardFail, Limit, Metric, QuestionKind, Rubric, RubricItem, Stage, Zone, metric};
use typodont_formats::diagnostic::did_you_mean;

/// Features of a scenario on which measures depend.
#[derive(Clone, Copy)]
pub(super) struct Capabilities {
    decay: bool,
    filling: bool,
    tooth_question: bool,
    quadrant_question: bool,
    judged_question: bool,
    stiffness_steps: bool,
    draw: bool,
    depth_chart: bool,
    calculus_chart: bool,
    calculus: bool,
}

impl Capabilities {
    pub fn of(written: &file::ScenarioFile, stages: &[Stage]) -> Capabilities {
        let teeth = written_teeth(&written.scene);
        let asks = |is_meant: fn(&QuestionKind) -> bool| stages.iter().flat_map(|s| &s.ask).any(|q| is_meant(&q.kind));
        // Questions about a draw have measures of their own.
        let asks_once = |is_meant: fn(&QuestionKind) -> bool| {
            stages.iter().filter(|s| s.draw.is_none()).flat_map(|s| &s.ask).any(|q| is_meant(&q.kind))
        };
        Capabilities {
            decay: teeth.iter().any(|t| !t.decay.is_empty()),
            filling: teeth.iter().any(|t| t.cavity.is_some()) && written.stages.iter().any(|s| s.filling.is_some()),
            tooth_question: asks_once(|kind| matches!(kind, QuestionKind::ToothWith { .. })),
            quadrant_question: asks_once(|kind| matches!(kind, QuestionKind::QuadrantOf { .. })),
            judged_question: asks(QuestionKind::is_judged),
            stiffness_steps: stages.iter().any(|s| s.steps.is_some()),
            draw: stages.iter().any(|s| s.draw.is_some()),
            depth_chart: stages.iter().any(|s| s.chart.depths),
            calculus_chart: stages.iter().any(|s| s.chart.calculus),
            calculus: teeth.iter().any(|t| !t.calculus.is_empty()),
        }
    }

    fn has(&self, feature: RequiredFeature) -> bool {
        match feature {
            RequiredFeature::Decay => self.decay,
            RequiredFeature::Filling => self.filling,
            RequiredFeature::ToothQuestion => self.tooth_question,
            RequiredFeature::QuadrantQuestion => self.quadrant_question,
            RequiredFeature::JudgedQuestion => self.judged_question,
            RequiredFeature::StiffnessSteps => self.stiffness_steps,
            RequiredFeature::Draw => self.draw,
            RequiredFeature::DepthChart => self.depth_chart,
            RequiredFeature::CalculusChart => self.calculus_chart,
            RequiredFeature::Calculus => self.calculus,
        }
    }

    /// Returns the first feature that a measure requires but the scenario lacks; `None` if nothing is missing.
    fn missing_for(&self, measure: &metric::MetricInfo) -> Option<RequiredFeature> {
        measure.required_features.iter().copied().find(|&feature| !self.has(feature))
    }
}

/// Returns the diagnostic for a feature that a scenario lacks: code, message after the measure's name, and help.
fn missing_feature_diagnostic(feature: RequiredFeature) -> (&'static str, &'static str, &'static str) {
    match feature {
        RequiredFeature::Decay => (
            "no-decay",
            "requires caries, but no tooth has any",
            "add \"decay\" to a tooth, or use a measure of the target zone such as recall",
        ),
        RequiredFeature::ToothQuestion => (
            "no-question",
            "requires a question about which tooth has the caries, but no stage asks it",
            "add the question to a stage, or use another measure; stages with a draw have detect_corrected_pct",
        ),
        RequiredFeature::StiffnessSteps => (
            "no-steps",
            "requires stiffness steps, but no stage has any",
            "add \"stiffness_steps\" to the stage with the question, or use another measure",
        ),
        RequiredFeature::QuadrantQuestion => (
            "no-question",
            "requires a question about the quadrant of the caries, but no stage asks it",
            "add the question to a stage, or use another measure; stages with a draw have detect_corrected_pct",
        ),
        RequiredFeature::Draw => (
            "no-draw",
            "requires a stage in which the site of the caries is drawn, but no stage has a draw",
            "add \"draw\" to the stage with the question, or use another measure",
        ),
        RequiredFeature::JudgedQuestion => (
            "no-question",
            "requires a question with a correct answer, but no stage asks one",
            "add such a question to a stage, or add the correct answer to a question",
        ),
        RequiredFeature::CalculusChart => (
            "no-chart",
            "requires charting of calculus, but no stage has it",
            "add calculus to \"chart\" of a stage, or use another measure",
        ),
        RequiredFeature::Calculus => (
            "no-calculus",
            "requires calculus, but no tooth has any",
            "add \"calculus\" to the tooth, or use another measure",
        ),
        RequiredFeature::DepthChart => (
            "no-chart",
            "requires charting of probing depths, but no stage has it",
            "add depths to \"chart\" of a stage, or use another measure",
        ),
        RequiredFeature::Filling => (
            "no-filling",
            "requires a prepared cavity that is to be filled",
            "add \"cavity\" to a tooth and \"filling\" to a stage",
        ),
    }
}

/// Sum of the points of all rubric items.
const POINTS: f64 = 100.0;

impl Resolver<'_> {
    pub(super) fn rubric(&mut self, written: &file::RubricFile, zones: &[Zone], capabilities: Capabilities) -> Rubric {
        let sum: f64 = written.items.iter().map(|i| i.points).sum();
        if (sum - POINTS).abs() > 1e-6 {
            let help = "change the points of the items so that their sum is 100";
            self.complain("/rubric/items", "wrong-sum", format!("the sum of the points is {sum}, not 100"), help);
        }
        let mut items: Vec<RubricItem> = Vec::new();
        let mut written_items = Vec::new();
        for (index, item) in written.items.iter().enumerate() {
            let path = format!("/rubric/items/{index}");
            if item.full_at == item.zero_at {
                let message = "full_at and zero_at are equal";
                self.complain(
                    &path,
                    "no-range",
                    message,
                    "use two different values: the points increase in proportion between them",
                );
            }
            if let Some(metric) = self.metric(&item.metric, zones, &format!("{path}/metric")) {
                self.check_direction(&metric, item, &path);
                self.check_needs(&metric, capabilities, &format!("{path}/metric"));
                let &file::RubricItemFile { points, full_at, zero_at, .. } = item;
                let title = item.title.to_string();
                items.push(RubricItem { title, metric, points, full_at, zero_at, counts_with: None });
                written_items.push((index, item));
            }
        }
        // An item without a known measure was reported above; the others may depend on it.
        let is_complete = items.len() == written.items.len();
        for (own, (index, item)) in written_items.into_iter().enumerate().filter(|_| is_complete) {
            if let Some(name) = &item.counts_with {
                let path = format!("/rubric/items/{index}/counts_with");
                items[own].counts_with = self.counts_with(name, own, &items, written, &path);
            }
        }
        let mut hard_fails = Vec::new();
        for (index, fail) in written.hard_fails.iter().enumerate() {
            let path = format!("/rubric/hard_fails/{index}/metric");
            if let Some(metric) = self.metric(&fail.metric, zones, &path) {
                self.check_needs(&metric, capabilities, &path);
                let when = match fail.when {
                    file::FailFile::Above(value) => Limit::Above(value),
                    file::FailFile::Below(value) => Limit::Below(value),
                };
                hard_fails.push(HardFail { title: fail.title.to_string(), metric, when });
            }
        }
        Rubric { pass_points: written.pass_points, items, hard_fails }
    }

    /// Returns the index of the item that uses the measure `name`, by whose share the points of the item `own` are
    /// multiplied; `None` after a diagnostic.
    fn counts_with(
        &mut self,
        name: &str,
        own: usize,
        items: &[RubricItem],
        written: &file::RubricFile,
        path: &str,
    ) -> Option<usize> {
        let names: Vec<String> = items.iter().map(|item| item.metric.name()).collect();
        let found: Vec<usize> = (0..items.len()).filter(|&i| i != own && names[i] == name).collect();
        let depends = |metric: &str| written.items.iter().any(|i| i.metric == metric && i.counts_with.is_some());
        match found[..] {
            [other] if !depends(name) => return Some(other),
            [_] => {
                let message = format!("the item of \"{name}\" depends on another item itself");
                self.complain(path, "chained-item", message, "name an item without \"counts_with\"");
            }
            [] => {
                let others = names.iter().enumerate().filter(|(i, _)| *i != own).map(|(_, n)| n.as_str());
                let others: Vec<&str> = others.filter(|n| !depends(n)).collect();
                let message = format!("no other item of this rubric uses the measure \"{name}\"");
                self.complain(path, "unknown-item", message, did_you_mean(name, others));
            }
            _ => {
                let message = format!("several items of this rubric use the measure \"{name}\"");
                self.complain(path, "ambiguous-item", message, "name a measure that only one other item uses");
            }
        }
        None
    }

    /// Reports a rubric item that rewards the worse end of a measure.
    fn check_direction(&mut self, metric: &Metric, item: &file::RubricItemFile, path: &str) {
        let (is_backward, word) = match metric.info.better {
            metric::Better::Higher => (item.full_at < item.zero_at, "higher"),
            metric::Better::Lower => (item.full_at > item.zero_at, "lower"),
            metric::Better::Neither => (false, ""),
        };
        if is_backward {
            let message = format!("full points are given for the worse value of \"{}\"", metric.name());
            let help = format!("{word} is better: exchange full_at and zero_at");
            self.complain(&format!("{path}/full_at"), "backward-rubric", message, help);
        }
    }

    /// Reports a measure that has no value in this scenario, so that its points could not be earned.
    fn check_needs(&mut self, metric: &Metric, capabilities: Capabilities, path: &str) {
        if let Some(feature) = capabilities.missing_for(metric.info) {
            let (code, message, help) = missing_feature_diagnostic(feature);
            self.complain(path, code, format!("\"{}\" {message}", metric.name()), help);
        }
    }

    fn metric(&mut self, name: &str, zones: &[Zone], path: &str) -> Option<Metric> {
        match Metric::parse(name) {
            Ok(metric) => {
                if let Some(metric::MetricArgument::Zone(zone)) = &metric.argument
                    && !zones.iter().any(|z| z.id == *zone)
                {
                    let help = did_you_mean(zone, zones.iter().map(|z| z.id.as_str()));
                    self.complain(path, "unknown-zone", format!("there is no zone \"{zone}\""), help);
                    return None;
                }
                Some(metric)
            }
            Err(metric::MetricParseError::Name(name)) => {
                let help = did_you_mean(&name, metric::names());
                self.complain(path, "unknown-metric", format!("there is no measure \"{name}\""), help);
                None
            }
            Err(metric::MetricParseError::Argument(help)) => {
                self.complain(path, "unknown-metric", format!("\"{name}\" is not a valid measure"), help);
                None
            }
        }
    }
}
