//! Effective grade: the scorer's grade combined with the examiners' overrides.
//!
//! An overridden item counts with the examiner's points. An item that depends on it (`counts_with`) follows: it is
//! multiplied by the share of the points that the examiner gave, unless it is overridden itself. The grade is a pass
//! under the exercise's own rules: enough points, no critical error, and the session finished. An override of the whole
//! grade replaces both points and result.

use super::overrides::{OverrideEntry, OverrideSnapshot};
use typodont_report::{GradeFile, ItemResultFile};

/// Item of a rubric after overrides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EffectiveItem<'a> {
    /// Override in effect for this item.
    pub judged: Option<&'a OverrideEntry>,
    /// Resulting points; the scorer's if no override concerns the item.
    pub points: f64,
    /// Share of its points, 0 to 1, that an examiner gave to the item on which this one depends; `None` if this item's
    /// points do not follow from an override of another one.
    pub followed_share: Option<f64>,
}

/// Grade after overrides.
#[derive(Clone, Debug, PartialEq)]
pub struct EffectiveGrade<'a> {
    /// Items, in the rubric's order.
    pub items: Vec<EffectiveItem<'a>>,
    /// Override in effect for the whole grade.
    pub whole: Option<&'a OverrideEntry>,
    /// Resulting points; the scorer's without overrides.
    pub points: f64,
    pub passed: bool,
    /// Number of overrides of items that this grade does not have, because the session was rescored with another
    /// rubric.
    pub orphaned: usize,
}

impl EffectiveGrade<'_> {
    /// Returns the overrides in effect, that of the whole grade first.
    pub fn entries(&self) -> impl Iterator<Item = &OverrideEntry> {
        self.whole.into_iter().chain(self.items.iter().filter_map(|item| item.judged))
    }

    /// Returns the number of overrides in effect.
    pub fn overrides(&self) -> usize {
        self.items.iter().filter(|item| item.judged.is_some()).count() + usize::from(self.whole.is_some())
    }
}

/// Reason for which a session is not passed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FailureReason {
    CriticalError,
    /// The session was ended early or interrupted.
    Unfinished,
    TooFewPoints,
    /// An examiner decided so, regardless of points and critical errors.
    Examiner,
}

impl FailureReason {
    /// Returns the reason for a result that is not a pass. `overridden` is the effective number of points if an
    /// examiner has changed them.
    pub fn of(grade: &GradeFile, overridden: Option<f64>) -> FailureReason {
        match overridden {
            _ if !grade.hard_fails.is_empty() => FailureReason::CriticalError,
            _ if !grade.finished => FailureReason::Unfinished,
            points if points.unwrap_or(grade.points) < grade.pass_points => FailureReason::TooFewPoints,
            _ => FailureReason::Examiner,
        }
    }

    /// Last part of the reason's key in the language files.
    pub fn key(self) -> &'static str {
        match self {
            FailureReason::CriticalError => "critical",
            FailureReason::Unfinished => "unfinished",
            FailureReason::TooFewPoints => "points",
            FailureReason::Examiner => "examiner",
        }
    }
}

/// Computes the effective grade of a session.
pub fn effective_grade<'a>(grade: &GradeFile, session: &str, log: &'a OverrideSnapshot) -> EffectiveGrade<'a> {
    let mut by_item: Vec<Option<&OverrideEntry>> = vec![None; grade.items.len()];
    let mut whole = None;
    let mut orphaned = vec![];
    for entry in log.valid_entries().filter(|entry| entry.draft.session == session) {
        let judged = entry.draft.examiner.is_some().then_some(entry);
        match &entry.draft.item {
            None => whole = judged,
            Some(item) => match grade.items.get(item.index).filter(|own| own.metric == item.metric) {
                Some(_) => by_item[item.index] = judged,
                None => {
                    orphaned.retain(|index| *index != item.index);
                    orphaned.extend(judged.map(|_| item.index));
                }
            },
        }
    }
    let items: Vec<EffectiveItem> =
        (0..grade.items.len()).map(|index| effective_item(grade, &by_item, index)).collect();
    let mut points = grade.points;
    let mut passed = grade.passed;
    if items.iter().any(|item| item.judged.is_some()) {
        let more: f64 = items.iter().zip(&grade.items).map(|(item, machine)| item.points - machine.points).sum();
        points = tidy(grade.points + more).min(grade.max_points).max(0.0);
        passed = grade.finished && grade.hard_fails.is_empty() && points >= grade.pass_points;
    }
    if let Some(judged) = whole.and_then(|entry| entry.draft.examiner) {
        points = judged.points;
        passed = judged.passed.unwrap_or(passed);
    }
    EffectiveGrade { items, whole, points, passed, orphaned: orphaned.len() }
}

/// Returns an item after the overrides, which are given by item.
fn effective_item<'a>(grade: &GradeFile, by_item: &[Option<&'a OverrideEntry>], index: usize) -> EffectiveItem<'a> {
    let machine = &grade.items[index];
    let given = |entry: &OverrideEntry| entry.draft.examiner.map(|examiner| examiner.points);
    let judged = by_item[index];
    if let Some(points) = judged.and_then(given) {
        return EffectiveItem { judged, points, followed_share: None };
    }
    let other = machine.counts_with.as_ref().and_then(|metric| {
        let is_other = |(_, item): &(usize, &ItemResultFile)| item.metric == *metric && item.counts_with.is_none();
        grade.items.iter().enumerate().find(is_other)
    });
    let followed_share = other
        .filter(|(_, item)| item.max_points > 0.0)
        .and_then(|(other, item)| Some((by_item[other].and_then(given)? / item.max_points).clamp(0.0, 1.0)));
    let points = followed_share.map_or(machine.points, |share| tidy(machine.own_points() * share));
    EffectiveItem { judged, points, followed_share }
}

/// Returns the grade with all overrides applied, for consumers that take a single grade, and the number of overrides
/// in effect.
pub fn with_overrides(grade: &GradeFile, session: &str, log: &OverrideSnapshot) -> (GradeFile, usize) {
    let effective = effective_grade(grade, session, log);
    let mut overridden = grade.clone();
    for (item, now) in overridden.items.iter_mut().zip(&effective.items) {
        item.points = now.points;
        item.counts_with_share = now.followed_share.or(item.counts_with_share);
    }
    (overridden.points, overridden.passed) = (effective.points, effective.passed);
    if effective.passed {
        // Only an override of the whole grade can pass a session with a critical error.
        overridden.hard_fails.clear();
    }
    (overridden, effective.overrides())
}

/// Rounds to nine decimals, as in `session.json`: 62.2 instead of 62.2000000001.
fn tidy(points: f64) -> f64 {
    (points * 1e9).round() / 1e9
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chained_log::{LogEntry, LogLine};
    use crate::overrides::{GivenPoints, OverrideDraft, RubricItemRef};

    fn grade() -> GradeFile {
        let item = |metric: &str, points: f64| ItemResultFile {
            title: metric.into(),
            metric: metric.into(),
            value: None,
            points,
            max_points: 50.0,
            full_at: 1.0,
            zero_at: 0.0,
            counts_with: None,
            counts_with_share: None,
        };
        GradeFile {
            points: 60.0,
            max_points: 100.0,
            pass_points: 70.0,
            finished: true,
            passed: false,
            hard_fails: vec![],
            items: vec![item("dice", 25.0), item("jerk", 35.0)],
            hard_fail_checks: vec![],
        }
    }

    /// Override of an item, given by index and metric, or of the whole grade.
    type TestOverride = (Option<(usize, &'static str)>, Option<GivenPoints>);

    /// Builds a log with these overrides, in order.
    fn log_of(judged: &[TestOverride]) -> OverrideSnapshot {
        let line = |(number, (item, examiner)): (usize, &TestOverride)| LogLine {
            is_invalid: false,
            entry: LogEntry {
                version: 1,
                number: number as u64 + 1,
                previous: String::new(),
                at: String::new(),
                draft: OverrideDraft {
                    session: "s".into(),
                    recording: String::new(),
                    item: item.map(|(index, m)| RubricItemRef { index, metric: m.into(), title: m.into() }),
                    machine: GivenPoints { points: 0.0, passed: None },
                    examiner: *examiner,
                    reason: "r".into(),
                    name: "n".into(),
                },
            },
        };
        OverrideSnapshot { lines: judged.iter().enumerate().map(line).collect(), ..OverrideSnapshot::default() }
    }

    fn points(points: f64) -> Option<GivenPoints> {
        Some(GivenPoints { points, passed: None })
    }

    #[test]
    fn the_grade_follows_from_the_overrides_in_effect() {
        let check = |log: OverrideSnapshot, expected: (f64, bool, usize)| {
            let now = effective_grade(&grade(), "s", &log);
            assert_eq!((now.points, now.passed, now.overrides()), expected, "{log:?}");
        };
        let dice = Some((0, "dice"));
        check(log_of(&[]), (60.0, false, 0));
        check(log_of(&[(dice, points(34.5))]), (69.5, false, 1));
        check(log_of(&[(dice, points(35.0))]), (70.0, true, 1));
        check(log_of(&[(dice, points(35.0)), (dice, points(30.0))]), (65.0, false, 1));
        check(log_of(&[(dice, points(35.0)), (dice, None)]), (60.0, false, 0));
        check(
            log_of(&[(dice, points(50.0)), (None, Some(GivenPoints { points: 69.0, passed: Some(true) }))]),
            (69.0, true, 2),
        );
        // After rescoring with a rubric whose first item is a different one.
        check(log_of(&[(Some((0, "jaccard")), points(50.0))]), (60.0, false, 0));
        assert_eq!(effective_grade(&grade(), "s", &log_of(&[(Some((7, "x")), points(1.0))])).orphaned, 1);
        assert_eq!(effective_grade(&grade(), "another", &log_of(&[(dice, points(50.0))])).points, 60.0);
    }

    #[test]
    fn an_item_follows_the_override_of_the_item_on_which_it_depends() {
        // Aim: what an examiner gives for the work also decides the share of what depends on it. Method: "jerk" earns 50
        // of 50 by itself and depends on "dice", of which the scorer saw nothing, and the examiner a half.
        let mut own = grade();
        own.points = 0.0;
        own.items[0].points = 0.0;
        let depends = Some("dice".to_string());
        own.items[1] = ItemResultFile {
            value: Some(1.0),
            points: 0.0,
            counts_with: depends,
            counts_with_share: Some(0.0),
            ..own.items[1].clone()
        };
        let now = |log: &OverrideSnapshot| {
            let now = effective_grade(&own, "s", log);
            (now.points, now.items[1].points, now.items[1].followed_share, now.overrides())
        };
        let (dice, jerk) = (Some((0, "dice")), Some((1, "jerk")));
        assert_eq!(now(&log_of(&[])), (0.0, 0.0, None, 0));
        assert_eq!(now(&log_of(&[(dice, points(25.0))])), (50.0, 25.0, Some(0.5), 1));
        assert_eq!(now(&log_of(&[(dice, points(25.0)), (dice, None)])), (0.0, 0.0, None, 0));
        assert_eq!(now(&log_of(&[(dice, points(25.0)), (jerk, points(50.0))])), (75.0, 50.0, None, 2));
        let (exported, _) = with_overrides(&own, "s", &log_of(&[(dice, points(25.0))]));
        assert_eq!((exported.items[1].points, exported.items[1].counts_with_share), (25.0, Some(0.5)));
        // Points for the work that are taken away are taken from what depends on it, too.
        own.items[0].points = 50.0;
        own.items[1].points = 50.0;
        own.items[1].counts_with_share = Some(1.0);
        own.points = 100.0;
        assert_eq!(effective_grade(&own, "s", &log_of(&[(dice, points(0.0))])).points, 0.0);
    }

    #[test]
    fn too_few_points_are_told_from_a_critical_error() {
        let mut own = grade();
        assert_eq!(FailureReason::of(&own, None), FailureReason::TooFewPoints);
        assert_eq!(FailureReason::of(&own, Some(74.8)), FailureReason::Examiner);
        own.finished = false;
        assert_eq!(FailureReason::of(&own, None), FailureReason::Unfinished);
        own.hard_fails = vec!["Pulp exposed".into()];
        own.points = 74.8;
        assert_eq!(FailureReason::of(&own, None), FailureReason::CriticalError);
    }

    #[test]
    fn points_do_not_outweigh_a_critical_error() {
        let mut failed = grade();
        failed.hard_fails = vec!["Pulp exposed".into()];
        let more = log_of(&[(Some((0, "dice")), points(50.0))]);
        assert!(!effective_grade(&failed, "s", &more).passed);
        let whole = log_of(&[(None, Some(GivenPoints { points: 80.0, passed: Some(true) }))]);
        assert!(effective_grade(&failed, "s", &whole).passed, "an override of the whole grade passes it");
    }
}
