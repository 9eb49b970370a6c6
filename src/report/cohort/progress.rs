//! Progress from attempt to attempt, and the agreement of repeated attempts.

use super::{Cohort, POINTS, SpreadFile, points_or_measure};
use serde::Serialize;
use std::collections::BTreeMap;
use typodont_core::statistics;
use typodont_core::statistics::Interval;

/// Measures that are followed from attempt to attempt, if sessions have them.
const TRACKED_MEASURES: [&str; 4] = [POINTS, "decay_cleared_pct", "healthy_per_decay_pct", "time_to_clear_s"];

/// Learning curves of one measure.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LearningCurves {
    /// Everyone who tried more than once, in the order of their codes.
    pub participants: Vec<LearningCurve>,
    /// First, second … attempt of those people, as long as two or more made it.
    pub by_attempt: Vec<SpreadFile>,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LearningCurve {
    pub participant: String,
    /// In the order of time; null for an attempt without this measure.
    pub values: Vec<Option<f64>>,
    /// Change per attempt: slope of the regression line through the values; null for fewer than three values, or if
    /// they do not change.
    pub slope: Option<f64>,
    pub slope_interval: Option<Interval>,
}

/// First and second attempts of the same people.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RepeatedAttempts {
    pub people: usize,
    /// ICC(2,1): two-way random effects, absolute agreement, a single attempt (Shrout & Fleiss 1979).
    pub icc: Option<f64>,
    pub icc_interval: Option<Interval>,
    /// Test–retest: Pearson's correlation of the two.
    pub correlation: Option<f64>,
    /// Mean difference, second attempt minus first.
    pub gain: f64,
    pub gain_interval: Interval,
    /// Standard error of measurement of one attempt: standard deviation of the gains / √2.
    pub error: f64,
}

impl Cohort {
    pub(super) fn progress_by_measure(
        &self,
        own: &[usize],
        attempts: &[Vec<usize>],
    ) -> BTreeMap<String, LearningCurves> {
        let followed = TRACKED_MEASURES
            .iter()
            .filter_map(|measure| Some((measure.to_string(), self.learning_curves(own, attempts, measure)?)));
        followed.collect()
    }

    fn learning_curves(&self, own: &[usize], attempts: &[Vec<usize>], measure: &str) -> Option<LearningCurves> {
        let curve = |person: &Vec<usize>| {
            let values: Vec<Option<f64>> =
                person.iter().map(|&i| points_or_measure(&self.sessions[i].1, measure)).collect();
            let points = (1u32..).zip(&values).filter_map(|(n, v)| Some((f64::from(n), (*v)?))).collect::<Vec<_>>();
            let line = statistics::linear_fit(&points);
            (points.len() > 1).then(|| LearningCurve {
                participant: self.sessions[person[0]].1.participant.clone(),
                values,
                slope: line.map(|l| l.slope),
                slope_interval: line.map(|l| l.slope_interval()),
            })
        };
        let participants: Vec<LearningCurve> = attempts.iter().filter_map(curve).collect();
        let longest = participants.iter().map(|p| p.values.len()).max()?;
        let at = |n: usize| participants.iter().filter_map(|p| *p.values.get(n)?).collect::<Vec<f64>>();
        let range = self.range_of(measure, own);
        let by_attempt = (0..longest).map(at).take_while(|v| v.len() > 1);
        let by_attempt = by_attempt.filter_map(|values| SpreadFile::of(&values, range)).collect();
        Some(LearningCurves { participants, by_attempt })
    }

    pub(super) fn repeated_by_measure(
        &self,
        own: &[usize],
        attempts: &[Vec<usize>],
    ) -> BTreeMap<String, RepeatedAttempts> {
        let repeated = TRACKED_MEASURES.iter().filter_map(|measure| {
            let of = |i: usize| points_or_measure(&self.sessions[i].1, measure);
            let pairs: Vec<(f64, f64)> =
                attempts.iter().filter(|p| p.len() > 1).filter_map(|p| Some((of(p[0])?, of(p[1])?))).collect();
            let retest = statistics::retest(&pairs)?;
            let gains: Vec<f64> = pairs.iter().map(|(first, second)| second - first).collect();
            let possible = self.range_of(measure, own).of_difference();
            let icc = statistics::icc(&pairs.iter().map(|(a, b)| vec![*a, *b]).collect::<Vec<_>>());
            let repeated = RepeatedAttempts {
                people: retest.people,
                icc: icc.map(|i| i.icc),
                icc_interval: icc.and_then(|i| i.interval),
                correlation: retest.correlation,
                gain: retest.gain,
                gain_interval: statistics::mean_interval_in(&gains, possible).unwrap_or(retest.gain_interval),
                error: retest.typical_error,
            };
            Some((measure.to_string(), repeated))
        });
        repeated.collect()
    }
}
