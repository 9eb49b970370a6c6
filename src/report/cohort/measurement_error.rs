//! Standard error of measurement of the points, and the sessions that it leaves in doubt at the pass mark.

use super::Cohort;
use crate::session_file::SessionFile;
use serde::Serialize;
use typodont_core::statistics::{cronbach_alpha, describe};

/// Fewest people from whom an error of measurement is estimated.
const PEOPLE_MIN: usize = 5;

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MeasurementErrorFile {
    /// Standard error of measurement, points.
    pub sem: f64,
    /// "repeated_attempts": standard deviation of the gains from first to second attempts / √2. "rubric_items":
    /// SD·√(1−α), with Cronbach's α of the items' points.
    pub method: &'static str,
    /// Number of people from whom it is estimated.
    pub people: usize,
    pub pass_points: f64,
    /// Number of sessions whose result the points decide: finished, without a critical error.
    pub decided: usize,
    /// Those of them within one standard error of the pass mark, by points.
    pub in_doubt: Vec<DoubtfulResult>,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DoubtfulResult {
    pub participant: String,
    pub started: String,
    pub points: f64,
    pub passed: bool,
}

impl Cohort {
    /// Estimates the error of the points of one exercise. `attempts` holds each person's sessions, as indices; `repeated`
    /// the error by repeated attempts and the number of people who made them. `None` with too few people, or if sessions disagree about the pass mark.
    pub(super) fn measurement_error(
        &self,
        attempts: &[Vec<usize>],
        repeated: Option<(f64, usize)>,
    ) -> Option<MeasurementErrorFile> {
        let sessions: Vec<&SessionFile> = attempts.iter().flatten().map(|&index| &self.sessions[index].1).collect();
        let mut marks: Vec<f64> = sessions.iter().filter_map(|s| Some(s.grade.as_ref()?.pass_points)).collect();
        marks.dedup();
        let [pass_points] = marks[..] else { return None };
        let (sem, method, people) = match repeated.filter(|(_, people)| *people >= PEOPLE_MIN) {
            Some((error, people)) => (error, "repeated_attempts", people),
            None => {
                let (sem, people) = self.error_by_items(attempts)?;
                (sem, "rubric_items", people)
            }
        };
        let mut decided: Vec<DoubtfulResult> = sessions.iter().filter_map(|s| decided_by_points(s)).collect();
        let count = decided.len();
        decided.retain(|result| (result.points - pass_points).abs() <= sem);
        decided.sort_by(|a, b| a.points.total_cmp(&b.points));
        Some(MeasurementErrorFile { sem, method, people, pass_points, decided: count, in_doubt: decided })
    }

    /// Error of measurement by the consistency of the rubric's items, in each person's last graded session; with the
    /// number of people.
    fn error_by_items(&self, attempts: &[Vec<usize>]) -> Option<(f64, usize)> {
        let last = |person: &Vec<usize>| {
            person.iter().rev().find_map(|&index| self.sessions[index].1.grade.as_ref()).filter(|g| !g.items.is_empty())
        };
        let grades: Vec<_> = attempts.iter().filter_map(last).collect();
        let items =
            |grade: &&crate::session_file::GradeFile| grade.items.iter().map(|item| item.points).collect::<Vec<f64>>();
        let answers: Vec<Vec<f64>> = grades.iter().map(items).collect();
        if grades.len() < PEOPLE_MIN || answers.iter().any(|own| own.len() != answers[0].len()) {
            return None;
        }
        let sd = describe(&grades.iter().map(|grade| grade.points).collect::<Vec<_>>())?.sd?;
        // Items that contradict each other have a negative α; the error is then no smaller than without consistency.
        let alpha = cronbach_alpha(&answers)?.alpha.clamp(0.0, 1.0);
        Some((sd * (1.0 - alpha).sqrt(), grades.len()))
    }
}

/// Returns a session's result if its points decide it.
fn decided_by_points(session: &SessionFile) -> Option<DoubtfulResult> {
    let grade = session.grade.as_ref().filter(|grade| grade.finished && grade.hard_fails.is_empty())?;
    Some(DoubtfulResult {
        participant: session.participant.clone(),
        started: session.started.clone(),
        points: grade.points,
        passed: grade.passed,
    })
}
