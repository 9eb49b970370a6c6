//! Estimates of the pass mark from examiners' judgements.

use super::agreement::MACHINE;
use super::{Cohort, POINTS, points_or_measure};
use crate::csv;
use crate::name_folding::{ExaminerNames, examiner_key};
use crate::session_file::mean;
use serde::Serialize;
use std::collections::BTreeMap;
use typodont_core::statistics::{
    BorderlineRegression, ContrastingGroups, Interval, ValueRange, borderline_regression, contrasting_groups,
};

/// The rating that is neither passed nor failed.
const BORDERLINE: f64 = 2.0;

/// Ratings that may be written as words.
const RATING_WORDS: [(&str, f64); 5] =
    [("fail", 1.0), ("borderline", BORDERLINE), ("pass", 3.0), ("good", 4.0), ("excellent", 5.0)];

/// Highest value of the scale where a table does not say.
const SCALE: u8 = 5;

/// An examiner's rating of a participant's work, given without knowledge of the points.
#[derive(Clone, Debug, PartialEq)]
pub struct ExaminerRating {
    /// Empty where the work is named by its recording.
    pub participant: String,
    /// SHA-256 of the recording of the rated session; empty if the rating applies to the participant's last one.
    pub recording: String,
    /// The exercise rated; `None` if the rating applies to every exercise.
    pub scenario: Option<String>,
    /// Title and measure of the rated item of the rubric; `None` for the work as a whole.
    pub item: Option<(String, String)>,
    /// Name of the examiner; empty if the table does not say.
    pub rater: String,
    /// 1 failed, 2 borderline, 3 passed, and better from there.
    pub rating: f64,
    /// Highest value of the scale.
    pub scale: u8,
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

/// Reads examiners' judgements: a table with the columns `rating` and `participant` or `recording`, and where it matters
/// `scenario`, `rater`, `item`, `metric` and `scale`, as the review desk exports it. Ratings are 1 to 5, or to the
/// row's `scale`, or the words fail, borderline, pass, good, excellent.
///
/// `Err` holds every complaint, a line each.
pub fn read_ratings(name: &str, text: &str) -> Result<Vec<ExaminerRating>, Vec<String>> {
    let rows = csv::parse_rows(text).map_err(|e| vec![format!("{name}: wrong-table: {e}")])?;
    let (head, lines) = rows.split_first().ok_or(vec![format!("{name}: wrong-table: the file is empty")])?;
    let column = |title: &str| head.iter().position(|c| c.trim().eq_ignore_ascii_case(title));
    let (participant, recording) = (column("participant"), column("recording"));
    let Some(rating) = column("rating").filter(|_| participant.or(recording).is_some()) else {
        let what = "the first line must contain the columns participant and rating (and, optionally, scenario)";
        return Err(vec![format!("{name}: wrong-table: {what}")]);
    };
    let [scenario, rater, item, metric, scale] = ["scenario", "rater", "item", "metric", "scale"].map(column);
    let (mut read, mut wrong) = (Vec::new(), Vec::new());
    let mut raters = ExaminerNames::default();
    for (number, row) in (2..).zip(lines) {
        let cell = |column: usize| row.get(column).map_or("", |c| c.trim());
        let text = |column: Option<usize>| column.map_or("", cell).to_string();
        let scale =
            scale.map(cell).and_then(|text| text.parse().ok()).filter(|s| (3..=10).contains(s)).unwrap_or(SCALE);
        if examiner_key(&text(rater)) == MACHINE {
            wrong.push(format!("{name}: row {number}: wrong-rater: \"{MACHINE}\" stands for the computed marks"));
            continue;
        }
        match parse_rating(cell(rating), scale) {
            Some(rating) => read.push(ExaminerRating {
                participant: text(participant),
                recording: text(recording),
                scenario: Some(text(scenario)).filter(|s| !s.is_empty()),
                item: Some((text(item), text(metric))).filter(|(title, _)| !title.is_empty()),
                rater: raters.first_spelling(&text(rater)),
                rating,
                scale,
            }),
            None => wrong.push(format!(
                "{name}: row {number}: wrong-rating: \"{}\" is not a rating; write 1 to {scale}, or fail, borderline, pass, \
                good, excellent",
                crate::display_format::sanitize_display(cell(rating), 40)
            )),
        }
    }
    if wrong.is_empty() { Ok(read) } else { Err(wrong) }
}

fn parse_rating(text: &str, scale: u8) -> Option<f64> {
    let most = f64::from(scale);
    let word = RATING_WORDS.iter().find(|(word, _)| text.eq_ignore_ascii_case(word)).map(|(_, value)| value.min(most));
    word.or_else(|| text.replace(',', ".").parse().ok().filter(|v| (1.0..=most).contains(v)))
}

impl Cohort {
    /// Mean of the examiners' ratings of each session as a whole, each examiner with the last one.
    fn mean_ratings(&self, attempts: &[Vec<usize>]) -> BTreeMap<usize, f64> {
        let mut by_work: BTreeMap<usize, BTreeMap<&str, f64>> = BTreeMap::new();
        for rating in self.ratings.iter().filter(|rating| rating.item.is_none()) {
            if let Some(work) = self.rated_work(rating, attempts) {
                by_work.entry(work).or_default().insert(&rating.rater, rating.rating);
            }
        }
        let mean = |(work, by_rater): (usize, BTreeMap<&str, f64>)| Some((work, mean(by_rater.into_values())?));
        by_work.into_iter().filter_map(mean).collect()
    }

    pub(super) fn pass_mark(&self, own: &[usize], attempts: &[Vec<usize>]) -> Option<PassMarkEstimate> {
        // The regression is linear and knows no limits; beyond the possible points its interval means nothing.
        let possible = |points: f64| match self.range_of(POINTS, own) {
            ValueRange::Within(low, high) => points.clamp(low, high),
            _ => points.max(0.0),
        };
        // Of each person the last session with points.
        let graded = |index: usize| {
            let session = &self.sessions[index].1;
            Some((session.participant.as_str(), points_or_measure(session, POINTS)?))
        };
        let last = |person: &Vec<usize>| person.iter().rev().find_map(|&index| graded(index));
        let people: Vec<(&str, f64)> = attempts.iter().filter_map(last).collect();
        // Of each person the last session that was rated.
        let ratings = self.mean_ratings(attempts);
        let rated = |person: &Vec<usize>| {
            person.iter().rev().find_map(|&index| Some((*ratings.get(&index)?, graded(index)?.1)))
        };
        let judged: Vec<(f64, f64)> = attempts.iter().filter_map(rated).collect();
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
                let interval = interval.map(possible);
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
