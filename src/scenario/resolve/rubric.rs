//! What earns points, and what fails a session at once.

use super::Resolver;
use crate::diagnostic::did_you_mean;
use crate::scenario::file;
use crate::scenario::{HardFail, Limit, Metric, Rubric, RubricItem, Zone, metric};

/// Points of all rubric items together.
const POINTS: f64 = 100.0;

impl Resolver<'_> {
    pub(super) fn rubric(&mut self, written: &file::RubricFile, zones: &[Zone], has_decay: bool) -> Rubric {
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
                self.check_decay(&metric, has_decay, &format!("{path}/metric"));
                let &file::RubricItemFile { points, full_at, zero_at, .. } = item;
                items.push(RubricItem { title: item.title.clone(), metric, points, full_at, zero_at });
            }
        }
        let mut hard_fails = Vec::new();
        for (index, fail) in written.hard_fails.iter().enumerate() {
            let path = format!("/rubric/hard_fails/{index}/metric");
            if let Some(metric) = self.metric(&fail.metric, zones, &path) {
                self.check_decay(&metric, has_decay, &path);
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

    /// A measure of decay has no value where there is none.
    fn check_decay(&mut self, metric: &Metric, has_decay: bool, path: &str) {
        let needs_decay = ["decay_cleared_pct", "healthy_per_decay_pct", "efficiency_pct_s"];
        if needs_decay.contains(&metric.about.name) && !has_decay {
            let message = format!("\"{}\" needs decay, and no tooth has any", metric.name());
            let help = "give a tooth decay, or take a measure of the target zone such as recall";
            self.complain(path, "no-decay", message, help);
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
