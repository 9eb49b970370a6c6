//! Estimates of the pass mark from examiners' judgements.

use super::{Cohort, POINTS, points_or_measure};
use crate::csv;
use serde::Serialize;
use typodont_core::statistics::{
    BorderlineRegression, ContrastingGroups, Interval, borderline_regression, contrasting_groups,
};

/// The rating that is neither passed nor failed.
const BORDERLINE: f64 = 2.0;

/// Ratings that may be written as words.
const RATING_WORDS: [(&str, f64); 5] =
    [("fail", 1.0), ("borderline", BORDERLINE), ("pass", 3.0), ("good", 4.0), ("excellent", 5.0)];

/// An examiner's global rating of a participant's work, given without knowledge of the points.
#[derive(Clone, Debug, PartialEq)]
pub struct ExaminerRating {
    pub participant: String,
    /// The exercise rated; `None` if the rating applies to every exercise.
    pub scenario: Option<String>,
    /// 1 failed, 2 borderline, 3 passed, and better from there.
    pub rating: f64,
}

/// Pass marks as the judgements give them. Whoever sets the mark still decides.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PassMarkEstimate {
    /// The mark in force; null where sessions disagree about it.
    pub pass_points: Option<f64>,
    /// People with points and a judgement: their last session counts.
    pub people: usize,
    /// "examiners", or "experts": the named experts taken for competent, everyone else for not yet.
    pub judged_by: &'static str,
    pub contrasting_groups: Option<ContrastingGroupsFile>,
    /// Null without examiners' ratings.
    pub borderline_regression: Option<BorderlineRegressionFile>,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ContrastingGroupsFile {
    pub cut: f64,
    pub not_yet: RatedGroup,
    pub competent: RatedGroup,
    pub failed_wrongly: usize,
    pub passed_wrongly: usize,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RatedGroup {
    pub people: usize,
    pub mean: f64,
    pub sd: f64,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BorderlineRegressionFile {
    pub people: usize,
    pub cut: f64,
    pub interval: Interval,
    pub points_per_step: f64,
    pub explained: f64,
}

/// Reads examiners' judgements: a table with the columns `participant`, `rating` and, where it matters, `scenario`. Ratings are
/// 1 to 5 or the words fail, borderline, pass, good, excellent.
///
/// `Err` holds every complaint, a line each.
pub fn read_ratings(name: &str, text: &str) -> Result<Vec<ExaminerRating>, Vec<String>> {
    let rows = csv::parse_rows(text).map_err(|e| vec![format!("{name}: wrong-table: {e}")])?;
    let (head, lines) = rows.split_first().ok_or(vec![format!("{name}: wrong-table: the file is empty")])?;
    let column = |title: &str| head.iter().position(|c| c.trim().eq_ignore_ascii_case(title));
    let (Some(participant), Some(rating)) = (column("participant"), column("rating")) else {
        let what = "the first line must contain the columns participant and rating (and, optionally, scenario)";
        return Err(vec![format!("{name}: wrong-table: {what}")]);
    };
    let scenario = column("scenario");
    let (mut read, mut wrong) = (Vec::new(), Vec::new());
    for (number, row) in (2..).zip(lines) {
        let cell = |column: usize| row.get(column).map_or("", |c| c.trim());
        match parse_rating(cell(rating)) {
            Some(rating) => read.push(ExaminerRating {
                participant: cell(participant).into(),
                scenario: scenario.map(cell).filter(|s| !s.is_empty()).map(String::from),
                rating,
            }),
            None => wrong.push(format!(
                "{name}: row {number}: wrong-rating: \"{}\" is not a rating; write 1 to 5, or fail, borderline, pass, \
                good, excellent",
                crate::display_format::sanitize_display(cell(rating), 40)
            )),
        }
    }
    if wrong.is_empty() { Ok(read) } else { Err(wrong) }
}

fn parse_rating(text: &str) -> Option<f64> {
    let word = RATING_WORDS.iter().find(|(word, _)| text.eq_ignore_ascii_case(word)).map(|(_, value)| *value);
    word.or_else(|| text.replace(',', ".").parse().ok().filter(|v| (1.0..=5.0).contains(v)))
}

impl Cohort {
    pub(super) fn pass_mark(&self, scenario: &str, attempts: &[Vec<usize>]) -> Option<PassMarkEstimate> {
        // Of each person the last session with points.
        let last = |person: &Vec<usize>| {
            let graded = person.iter().rev().map(|&i| &self.sessions[i].1);
            graded.filter_map(|s| Some((s.participant.as_str(), points_or_measure(s, POINTS)?))).next()
        };
        let people: Vec<(&str, f64)> = attempts.iter().filter_map(last).collect();
        let rating = |participant: &str| {
            let of = |r: &&ExaminerRating| {
                r.participant == participant && r.scenario.as_deref().is_none_or(|s| s == scenario)
            };
            self.ratings.iter().rev().find(of).map(|r| r.rating)
        };
        let judged: Vec<(f64, f64)> =
            people.iter().filter_map(|(code, points)| Some((rating(code)?, *points))).collect();
        let (judged_by, judged) = match (judged.is_empty(), self.experts.is_empty()) {
            (false, _) => ("examiners", judged),
            (true, false) => {
                let side = |code: &str| if self.experts.iter().any(|e| e == code) { 3.0 } else { 1.0 };
                ("experts", people.iter().map(|(code, points)| (side(code), *points)).collect())
            }
            (true, true) => return None,
        };
        let group = |side: fn(f64) -> bool| judged.iter().filter(|j| side(j.0)).map(|j| j.1).collect::<Vec<f64>>();
        let groups = contrasting_groups(&group(|r| r < BORDERLINE), &group(|r| r > BORDERLINE));
        let regression = (judged_by == "examiners").then(|| borderline_regression(&judged, BORDERLINE)).flatten();
        let mut marks: Vec<f64> =
            attempts.iter().flatten().filter_map(|&i| Some(self.sessions[i].1.grade.as_ref()?.pass_points)).collect();
        marks.dedup();
        Some(PassMarkEstimate {
            pass_points: (marks.len() == 1).then(|| marks[0]),
            people: judged.len(),
            judged_by,
            contrasting_groups: groups.map(contrasting_groups_file),
            borderline_regression: regression.map(|r| {
                let BorderlineRegression { people, cut, interval, slope, r_squared: explained } = r;
                BorderlineRegressionFile { people, cut, interval, points_per_step: slope, explained }
            }),
        })
    }
}

fn contrasting_groups_file(groups: ContrastingGroups) -> ContrastingGroupsFile {
    let group = |(people, mean, sd): (usize, f64, f64)| RatedGroup { people, mean, sd };
    ContrastingGroupsFile {
        cut: groups.cut,
        not_yet: group(groups.below),
        competent: group(groups.above),
        failed_wrongly: groups.failed_wrongly,
        passed_wrongly: groups.passed_wrongly,
    }
}
