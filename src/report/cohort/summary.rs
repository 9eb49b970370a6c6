//! What a cohort's numbers say, exercise by exercise: `cohort.json`.

use super::progress::{Progress, Repeated};
use super::questionnaire::QuestionnaireSummary;
use super::removal::RemovalSummary;
use super::standard::Standard;
use super::{Cohort, POINTS, dedup, value};
use crate::report::session_file::{SessionFile, mean};
use crate::report::words;
use crate::statistics::{self, Interval};
use serde::Serialize;
use std::collections::BTreeMap;

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Summary {
    pub version: u32,
    pub sessions: usize,
    pub scenarios: Vec<ScenarioSummary>,
    pub questionnaires: Vec<QuestionnaireSummary>,
    pub skipped: Vec<SkippedFile>,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SkippedFile {
    pub file: String,
    pub reason: String,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ScenarioSummary {
    pub id: String,
    pub title: String,
    pub sessions: usize,
    /// People: a code counts once, a session without a code for itself.
    pub participants: usize,
    /// Sessions that were passed, of those that were graded.
    pub passed: usize,
    pub graded: usize,
    /// Of the share passed; null where nothing was graded.
    pub passed_interval: Option<Interval>,
    pub points_mean: Option<f64>,
    pub points: Option<Spread>,
    pub metrics: BTreeMap<String, Spread>,
    /// Of the named experts' sessions alone, `points` among them; empty without experts.
    pub expert_metrics: BTreeMap<String, Spread>,
    /// Why these sessions should not be compared without a second look.
    pub cautions: Vec<String>,
    /// Answers that were right, of those that were asked for, by the measure that says so.
    pub right: BTreeMap<String, RightCount>,
    /// How people came on from attempt to attempt, by measure; empty where nobody tried twice.
    pub progress: BTreeMap<String, Progress>,
    /// Whether first and second attempts agree, by measure.
    pub repeated: BTreeMap<String, Repeated>,
    /// Where examiners' judgements put the pass mark; null without judgements.
    pub standard: Option<Standard>,
    /// What was removed, for each tooth as it stood at the start.
    pub removals: Vec<RemovalSummary>,
}

/// How a measure is spread over sessions.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Spread {
    pub n: usize,
    pub mean: f64,
    /// Standard deviation of the sample; none of one session.
    pub sd: Option<f64>,
    /// Of the mean, at 95 %; none of one session.
    pub mean_interval: Option<Interval>,
    pub min: f64,
    pub quartiles: Interval,
    pub median: f64,
    pub max: f64,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RightCount {
    pub right: usize,
    pub of: usize,
    /// Of the share of right answers.
    pub interval: Option<Interval>,
    /// Mean time of the right answers, s.
    pub time_mean_s: Option<f64>,
    /// Their times added up and divided by everyone who was asked, s; null where everyone was right. The thesis prints such a
    /// figure (8.1.2): it is no one's time, and is told only so that both can be compared.
    pub time_over_all_s: Option<f64>,
    /// Where the stiffness fell in steps: how many right answers came at which coefficient.
    pub levels: BTreeMap<String, usize>,
}

/// Measures that say whether an answer was right, with the measure of its time and of its level.
const ANSWERS: [(&str, &str, Option<&str>); 2] = [
    ("detect_tooth", "detect_level_time_s", Some("detect_level")),
    ("detect_quadrant", "detect_quadrant_time_s", None),
];

impl Spread {
    pub fn of(values: &[f64]) -> Option<Spread> {
        let statistics::Spread { n, mean, sd, mean_interval, min, median, quartiles, max } =
            statistics::spread(values)?;
        Some(Spread { n, mean, sd, mean_interval, min, quartiles, median, max })
    }
}

impl Cohort {
    pub fn summary(&self) -> Summary {
        let ids = dedup(self.sessions.iter().map(|(_, s)| s.scenario.id.as_str()));
        let questionnaires =
            dedup(self.sessions.iter().filter_map(|(_, s)| Some(s.questionnaire.as_ref()?.id.as_str())));
        let skipped = self.skipped.iter();
        Summary {
            version: 1,
            sessions: self.sessions.len(),
            scenarios: ids.into_iter().map(|id| self.scenario(id)).collect(),
            questionnaires: questionnaires.into_iter().map(|id| QuestionnaireSummary::of(self, id)).collect(),
            skipped: skipped.map(|(p, r)| SkippedFile { file: p.display().to_string(), reason: r.clone() }).collect(),
        }
    }

    fn scenario(&self, id: &str) -> ScenarioSummary {
        let sessions: Vec<&SessionFile> =
            self.sessions.iter().map(|(_, s)| s).filter(|s| s.scenario.id == id).collect();
        let attempts = self.attempts(id);
        let grades: Vec<_> = sessions.iter().filter_map(|s| s.grade.as_ref()).collect();
        let passed = grades.iter().filter(|g| g.passed).count();
        let names = dedup(sessions.iter().flat_map(|s| s.metrics.keys().map(String::as_str)));
        let metrics = names.into_iter().filter_map(|name| {
            let values: Vec<f64> = sessions.iter().filter_map(|s| s.metric(name)).collect();
            Some((name.to_string(), Spread::of(&values)?))
        });
        let theirs: Vec<&&SessionFile> = sessions.iter().filter(|s| self.is_expert(s)).collect();
        let measures =
            dedup(theirs.iter().flat_map(|s| s.metrics.keys().map(String::as_str))).into_iter().chain([POINTS]);
        let expert_metrics = measures.filter_map(|name| {
            let values: Vec<f64> = theirs.iter().filter_map(|s| value(s, name)).collect();
            Some((name.to_string(), Spread::of(&values)?))
        });
        let points: Vec<f64> = grades.iter().map(|g| g.points).collect();
        let points = Spread::of(&points);
        ScenarioSummary {
            id: id.into(),
            title: sessions.iter().map(|s| s.scenario.title.as_str()).find(|t| !t.is_empty()).unwrap_or(id).into(),
            sessions: sessions.len(),
            participants: attempts.len(),
            passed,
            graded: grades.len(),
            passed_interval: statistics::share(passed, grades.len()).map(|s| s.interval),
            points_mean: points.as_ref().map(|p| p.mean),
            points,
            metrics: metrics.collect(),
            expert_metrics: expert_metrics.collect(),
            cautions: cautions(&sessions),
            right: right(&sessions),
            progress: self.progress(&attempts),
            repeated: self.repeated(&attempts),
            standard: self.standard(id, &attempts),
            removals: self.removals.iter().filter(|r| r.scenario == id).map(|r| RemovalSummary::of(self, r)).collect(),
        }
    }
}

fn right(sessions: &[&SessionFile]) -> BTreeMap<String, RightCount> {
    let count = |&(flag, time, level): &(&str, &str, Option<&str>)| {
        let asked = sessions.iter().filter(|s| s.metric(flag).is_some()).count();
        let right: Vec<&&SessionFile> = sessions.iter().filter(|s| s.metric(flag) == Some(1.0)).collect();
        let mut levels = BTreeMap::new();
        for value in level.iter().flat_map(|level| right.iter().filter_map(|s| s.metric(level))) {
            *levels.entry(value.to_string()).or_insert(0) += 1;
        }
        let times: Vec<f64> = right.iter().filter_map(|s| s.metric(time)).collect();
        let over_all = (right.len() < asked && !times.is_empty()).then(|| times.iter().sum::<f64>() / asked as f64);
        let count = RightCount {
            right: right.len(),
            of: asked,
            interval: statistics::share(right.len(), asked).map(|s| s.interval),
            time_mean_s: mean(times.into_iter()),
            time_over_all_s: over_all,
            levels,
        };
        (asked > 0).then(|| (flag.to_string(), count))
    };
    ANSWERS.iter().filter_map(count).collect()
}

/// What keeps sessions of an exercise from being alike.
fn cautions(sessions: &[&SessionFile]) -> Vec<String> {
    let mut found = Vec::new();
    let versions = dedup(sessions.iter().map(|s| s.scenario.sha256.as_str()).filter(|s| !s.is_empty())).len();
    if versions > 1 {
        found.push(format!("the exercise was changed between these sessions: {versions} versions of it"));
    }
    let mut formulae: Vec<u32> = sessions.iter().map(|s| s.scorer_version).filter(|v| *v > 0).collect();
    formulae.sort_unstable();
    formulae.dedup();
    if formulae.len() > 1 {
        found.push(format!("scored by different versions of the formulae: {formulae:?}"));
    }
    let ended_early = |s: &&&SessionFile| !matches!(s.ended_because.as_str(), "" | "complete");
    let unfinished = sessions.iter().filter(ended_early).count();
    if unfinished > 0 {
        found.push(format!("{unfinished} of them ended before their time"));
    }
    found
}

/// A summary's numbers in words, for pages: title, and lines of (what, value).
pub fn in_words(summary: &ScenarioSummary) -> Vec<(String, String)> {
    let mut lines = Vec::new();
    for (name, count) in &summary.right {
        let mut text = format!("{} of {}", count.right, count.of);
        if !count.levels.is_empty() {
            let mut levels: Vec<_> = count.levels.iter().collect();
            levels.sort_by(|a, b| b.0.cmp(a.0));
            let levels: Vec<String> = levels.iter().map(|(level, n)| format!("{n} at stiffness {level}")).collect();
            text += &format!(" ({})", levels.join(", "));
        }
        if let Some(time) = count.time_mean_s {
            text += &format!("; right answers after {} on average", words::duration(time));
        }
        if let Some(over_all) = count.time_over_all_s {
            text += &format!(
                ", over the {} that were right (divided by all {}, as the founding thesis prints it, it would read {}, \
                 which is nobody's time)",
                count.right,
                count.of,
                words::duration(over_all)
            );
        }
        lines.push((words::title(name), text));
    }
    lines
}
