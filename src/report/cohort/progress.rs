//! How people come on from attempt to attempt, and whether their attempts agree.

use super::{Cohort, POINTS, Spread, value};
use crate::statistics::{self, Interval};
use serde::Serialize;
use std::collections::BTreeMap;

/// What is followed from attempt to attempt, where there is any of it.
const FOLLOWED: [&str; 4] = [POINTS, "decay_cleared_pct", "healthy_per_decay_pct", "time_to_clear_s"];

/// Learning curves of one measure.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Progress {
    /// Everyone who tried more than once, in the order of their codes.
    pub participants: Vec<Curve>,
    /// First, second … attempt of those people, as long as two or more made it.
    pub by_attempt: Vec<Spread>,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Curve {
    pub participant: String,
    /// In the order of time; null for an attempt without this measure.
    pub values: Vec<Option<f64>>,
    /// Change per attempt, of the straight line through them; null of fewer than three, or where nothing changes.
    pub slope: Option<f64>,
    pub slope_interval: Option<Interval>,
}

/// First and second attempts of the same people.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Repeated {
    pub people: usize,
    /// ICC(2,1): two-way random effects, absolute agreement, a single attempt (Shrout & Fleiss 1979).
    pub icc: Option<f64>,
    pub icc_interval: Option<Interval>,
    /// Test–retest: Pearson's correlation of the two.
    pub correlation: Option<f64>,
    /// Second less first, on average.
    pub gain: f64,
    pub gain_interval: Interval,
    /// By how much one attempt misses what the person can do: the gains' standard deviation / √2.
    pub error: f64,
}

impl Cohort {
    pub(super) fn progress(&self, attempts: &[Vec<usize>]) -> BTreeMap<String, Progress> {
        let followed =
            FOLLOWED.iter().filter_map(|measure| Some((measure.to_string(), self.curves(attempts, measure)?)));
        followed.collect()
    }

    fn curves(&self, attempts: &[Vec<usize>], measure: &str) -> Option<Progress> {
        let curve = |person: &Vec<usize>| {
            let values: Vec<Option<f64>> = person.iter().map(|&i| value(&self.sessions[i].1, measure)).collect();
            let points = (1u32..).zip(&values).filter_map(|(n, v)| Some((f64::from(n), (*v)?))).collect::<Vec<_>>();
            let line = statistics::line(&points);
            (points.len() > 1).then(|| Curve {
                participant: self.sessions[person[0]].1.participant.clone(),
                values,
                slope: line.map(|l| l.slope),
                slope_interval: line.map(|l| l.slope_interval()),
            })
        };
        let participants: Vec<Curve> = attempts.iter().filter_map(curve).collect();
        let longest = participants.iter().map(|p| p.values.len()).max()?;
        let at = |n: usize| participants.iter().filter_map(|p| *p.values.get(n)?).collect::<Vec<f64>>();
        let by_attempt = (0..longest).map(at).take_while(|v| v.len() > 1).filter_map(|v| Spread::of(&v)).collect();
        Some(Progress { participants, by_attempt })
    }

    pub(super) fn repeated(&self, attempts: &[Vec<usize>]) -> BTreeMap<String, Repeated> {
        let repeated = FOLLOWED.iter().filter_map(|measure| {
            let of = |i: usize| value(&self.sessions[i].1, measure);
            let pairs: Vec<(f64, f64)> =
                attempts.iter().filter(|p| p.len() > 1).filter_map(|p| Some((of(p[0])?, of(p[1])?))).collect();
            let again = statistics::retest(&pairs)?;
            let icc = statistics::icc(&pairs.iter().map(|(a, b)| vec![*a, *b]).collect::<Vec<_>>());
            let repeated = Repeated {
                people: again.people,
                icc: icc.map(|i| i.icc),
                icc_interval: icc.and_then(|i| i.interval),
                correlation: again.correlation,
                gain: again.gain,
                gain_interval: again.gain_interval,
                error: again.error,
            };
            Some((measure.to_string(), repeated))
        });
        repeated.collect()
    }
}
