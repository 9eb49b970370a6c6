//! The grade: points and a pass or fail from measures.

use super::measures::Measures;
use crate::scenario::{Limit, Rubric};

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
    let items: Vec<ItemResult> = rubric
        .items
        .iter()
        .map(|item| {
            let metric = item.metric.name();
            let value = measures.value(&metric);
            let share = value.map_or(0.0, |v| ((v - item.zero_at) / (item.full_at - item.zero_at)).clamp(0.0, 1.0));
            ItemResult {
                title: item.title.clone(),
                metric,
                value,
                points: share * item.points,
                max_points: item.points,
                full_at: item.full_at,
                zero_at: item.zero_at,
            }
        })
        .collect();
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
