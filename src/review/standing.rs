//! What a grade comes to, the examiner's judgements beside the machine's.
//!
//! An item that an examiner judged counts with the examiner's points; the grade is passed as the exercise says: points enough,
//! nothing that fails it outright, and done to its end. Where the examiner judged the whole grade, that is the grade.

use super::overrides::{Entry, Told};
use crate::report::GradeFile;

/// A grade as it stands.
#[derive(Clone, Debug, PartialEq)]
pub struct Standing<'a> {
    /// The judgement of each item, in the rubric's order.
    pub items: Vec<Option<&'a Entry>>,
    pub whole: Option<&'a Entry>,
    /// What they come to; the machine's where nothing was judged.
    pub points: f64,
    pub passed: bool,
    /// Judgements of items that this grade no longer has: it was scored again by another rubric.
    pub homeless: usize,
}

impl Standing<'_> {
    pub fn overrides(&self) -> usize {
        self.items.iter().flatten().count() + usize::from(self.whole.is_some())
    }
}

/// How a session's grade stands.
pub fn standing<'a>(grade: &GradeFile, session: &str, told: &'a Told) -> Standing<'a> {
    let mut items: Vec<Option<&Entry>> = vec![None; grade.items.len()];
    let mut whole = None;
    let mut homeless = vec![];
    for entry in told.counting().filter(|entry| entry.draft.session == session) {
        let judged = entry.draft.examiner.is_some().then_some(entry);
        match &entry.draft.item {
            None => whole = judged,
            Some(item) => match grade.items.get(item.index).filter(|own| own.metric == item.metric) {
                Some(_) => items[item.index] = judged,
                None => {
                    homeless.retain(|index| *index != item.index);
                    homeless.extend(judged.map(|_| item.index));
                }
            },
        }
    }
    let more = grade.items.iter().zip(&items).filter_map(|(item, entry)| {
        let judged = entry.as_ref()?.draft.examiner?;
        Some(judged.points - item.points)
    });
    let more: Vec<f64> = more.collect();
    let mut points = grade.points;
    let mut passed = grade.passed;
    if !more.is_empty() {
        points = tidy(grade.points + more.iter().sum::<f64>()).min(grade.max_points).max(0.0);
        passed = grade.finished && grade.hard_fails.is_empty() && points >= grade.pass_points;
    }
    if let Some(judged) = whole.and_then(|entry| entry.draft.examiner) {
        points = judged.points;
        passed = judged.passed.unwrap_or(passed);
    }
    Standing { items, whole, points, passed, homeless: homeless.len() }
}

/// The grade with the examiner's judgements in it, for whoever takes one grade and no more; how many stand.
pub fn applied(grade: &GradeFile, session: &str, told: &Told) -> (GradeFile, usize) {
    let now = standing(grade, session, told);
    let mut taken = grade.clone();
    for (item, entry) in taken.items.iter_mut().zip(&now.items) {
        if let Some(judged) = entry.and_then(|entry| entry.draft.examiner) {
            item.points = judged.points;
        }
    }
    (taken.points, taken.passed) = (now.points, now.passed);
    if now.passed {
        // Only an examiner's word on the whole grade passes what had failed outright.
        taken.hard_fails.clear();
    }
    (taken, now.overrides())
}

/// Nine decimals, as in `session.json`: 62.2 and not 62.2000000001.
fn tidy(points: f64) -> f64 {
    (points * 1e9).round() / 1e9
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::ItemFile;
    use crate::review::overrides::{Draft, ItemRef, Judged, Line};

    fn grade() -> GradeFile {
        let item = |metric: &str, points: f64| ItemFile {
            title: metric.into(),
            metric: metric.into(),
            value: None,
            points,
            max_points: 50.0,
            full_at: 1.0,
            zero_at: 0.0,
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

    /// Of an item, by its place and measure, or of the whole grade.
    type Judgement = (Option<(usize, &'static str)>, Option<Judged>);

    /// Judgements of item or grade, in their order.
    fn told(judged: &[Judgement]) -> Told {
        let line = |(number, (item, examiner)): (usize, &Judgement)| Line {
            doubtful: false,
            entry: Entry {
                version: 1,
                number: number as u64 + 1,
                previous: String::new(),
                at: String::new(),
                draft: Draft {
                    session: "s".into(),
                    recording: String::new(),
                    item: item.map(|(index, m)| ItemRef { index, metric: m.into(), title: m.into() }),
                    machine: Judged { points: 0.0, passed: None },
                    examiner: *examiner,
                    reason: "r".into(),
                    name: "n".into(),
                },
            },
        };
        Told { lines: judged.iter().enumerate().map(line).collect(), ..Told::default() }
    }

    fn points(points: f64) -> Option<Judged> {
        Some(Judged { points, passed: None })
    }

    #[test]
    fn the_grade_follows_from_what_stands() {
        let check = |told: Told, expected: (f64, bool, usize)| {
            let now = standing(&grade(), "s", &told);
            assert_eq!((now.points, now.passed, now.overrides()), expected, "{told:?}");
        };
        let dice = Some((0, "dice"));
        check(told(&[]), (60.0, false, 0));
        check(told(&[(dice, points(34.5))]), (69.5, false, 1));
        check(told(&[(dice, points(35.0))]), (70.0, true, 1));
        check(told(&[(dice, points(35.0)), (dice, points(30.0))]), (65.0, false, 1));
        check(told(&[(dice, points(35.0)), (dice, None)]), (60.0, false, 0));
        check(
            told(&[(dice, points(50.0)), (None, Some(Judged { points: 69.0, passed: Some(true) }))]),
            (69.0, true, 2),
        );
        // Scored again by a rubric whose first item is another.
        check(told(&[(Some((0, "jaccard")), points(50.0))]), (60.0, false, 0));
        assert_eq!(standing(&grade(), "s", &told(&[(Some((7, "x")), points(1.0))])).homeless, 1);
        assert_eq!(standing(&grade(), "another", &told(&[(dice, points(50.0))])).points, 60.0);
    }

    #[test]
    fn what_fails_outright_is_not_outweighed_by_points() {
        let mut failed = grade();
        failed.hard_fails = vec!["Pulp exposed".into()];
        let more = told(&[(Some((0, "dice")), points(50.0))]);
        assert!(!standing(&failed, "s", &more).passed);
        let whole = told(&[(None, Some(Judged { points: 80.0, passed: Some(true) }))]);
        assert!(standing(&failed, "s", &whole).passed, "unless the examiner says so of the whole grade");
    }
}
