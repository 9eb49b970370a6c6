//! The grade: points and a pass or fail from measures.

use super::measures::Measures;
use crate::scenario::{Limit, Rubric, RubricItem};

/// Grade of a session by a rubric.
#[derive(Clone, Debug, PartialEq)]
pub struct Grade {
    pub points: f64,
    pub max_points: f64,
    pub pass_points: f64,
    /// False for a session that was not finished, regardless of its points.
    pub finished: bool,
    pub passed: bool,
    pub items: Vec<ItemResult>,
    pub hard_fails: Vec<HardFailResult>,
}

/// Result of one item of a rubric.
#[derive(Clone, Debug, PartialEq)]
pub struct ItemResult {
    pub title: String,
    pub metric: String,
    pub value: Option<f64>,
    pub points: f64,
    pub max_points: f64,
    pub full_at: f64,
    pub zero_at: f64,
    /// Dependence on another item; `None` for an item that counts by itself.
    pub counts_with: Option<ItemFactor>,
}

/// Dependence of an item's points on another item.
#[derive(Clone, Debug, PartialEq)]
pub struct ItemFactor {
    /// Measure of the other item.
    pub metric: String,
    /// Share of its points that the other item earned, 0 to 1: the factor of this item's points.
    pub share: f64,
}

/// Result of one critical error of a rubric.
#[derive(Clone, Debug, PartialEq)]
pub struct HardFailResult {
    pub title: String,
    pub metric: String,
    pub value: Option<f64>,
    pub limit: Limit,
    pub failed: bool,
}

/// Returns the grade of a session. A session that was aborted or interrupted (not `finished`) cannot be passed.
pub fn of(rubric: &Rubric, measures: &Measures, finished: bool) -> Grade {
    let value_of = |item: &RubricItem| measures.value(&item.metric.name());
    let own_share = |item: &RubricItem| {
        value_of(item).map_or(0.0, |v| ((v - item.zero_at) / (item.full_at - item.zero_at)).clamp(0.0, 1.0))
    };
    let result = |item: &RubricItem| {
        let other = item.counts_with.and_then(|other| rubric.items.get(other));
        let counts_with = other.map(|other| ItemFactor { metric: other.metric.name(), share: own_share(other) });
        let factor = counts_with.as_ref().map_or(1.0, |c| c.share);
        ItemResult {
            title: item.title.clone(),
            metric: item.metric.name(),
            value: value_of(item),
            points: own_share(item) * factor * item.points,
            max_points: item.points,
            full_at: item.full_at,
            zero_at: item.zero_at,
            counts_with,
        }
    };
    let items: Vec<ItemResult> = rubric.items.iter().map(result).collect();
    let hard_fails: Vec<HardFailResult> = rubric
        .hard_fails
        .iter()
        .map(|fail| {
            let metric = fail.metric.name();
            let value = measures.value(&metric);
            let failed = value.is_some_and(|v| match fail.when {
                Limit::Above(limit) => v > limit,
                Limit::Below(limit) => v < limit,
            });
            HardFailResult { title: fail.title.clone(), metric, value, limit: fail.when, failed }
        })
        .collect();
    // Rounded, so that a sum of thirds does not miss the pass mark by a rounding error.
    let points = (items.iter().map(|i| i.points).sum::<f64>() * 1e9).round() / 1e9;
    let passed = finished && points >= rubric.pass_points && !hard_fails.iter().any(|f| f.failed);
    let max_points = items.iter().map(|i| i.max_points).sum();
    Grade { points, max_points, pass_points: rubric.pass_points, finished, passed, items, hard_fails }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::Metric;
    use crate::score::Measure;

    #[test]
    fn an_item_earns_no_more_than_the_share_of_the_item_it_counts_with() {
        // Aim: gentle force earns points in proportion to the caries removed, and nothing by itself. Method: a rubric
        // of two items; none, half and all of the work, all without force.
        let item = |name: &str, points: f64, [full_at, zero_at]: [f64; 2], counts_with: Option<usize>| RubricItem {
            title: name.to_string(),
            metric: Metric::parse(name).unwrap(),
            points,
            full_at,
            zero_at,
            counts_with,
        };
        let items =
            vec![item("force_max_n", 40.0, [2.0, 4.0], Some(1)), item("decay_cleared_pct", 60.0, [90.0, 50.0], None)];
        let rubric = Rubric { pass_points: 70.0, items, hard_fails: Vec::new() };
        let points = |cleared: f64, force: f64| {
            let measure = |name: &str, value: f64| Measure {
                metric: Metric::parse(name).unwrap(),
                value: Some(value),
                evidence: None,
            };
            let measures = Measures { all: vec![measure("decay_cleared_pct", cleared), measure("force_max_n", force)] };
            of(&rubric, &measures, true).points
        };
        assert_eq!([points(0.0, 0.0), points(70.0, 0.0), points(95.0, 0.0)], [0.0, 50.0, 100.0]);
        assert_eq!(points(95.0, 3.0), 80.0);
    }
}
