//! Statistics of a cohort, by exercise: `cohort.json`.

use super::agreement::AgreementFile;
use super::measurement_error::MeasurementErrorFile;
use super::pass_mark::PassMarkEstimate;
use super::progress::{LearningCurves, RepeatedAttempts};
use super::questionnaire::QuestionnaireSummary;
use super::removal::RemovalSummary;
use super::trust::VerificationCounts;
use super::{Cohort, ComparableGroup, POINTS, dedup, english, points_or_measure};
use crate::language::{COUNT, Message, Translator};
use crate::session_file::{SessionFile, mean};
use crate::{display_format, phrases};
use serde::{Serialize, Serializer};
use std::collections::BTreeMap;
use typodont_core::statistics;
use typodont_core::statistics::{Interval, ValueRange};

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CohortSummary {
    pub version: u32,
    pub sessions: usize,
    pub scenarios: Vec<ScenarioSummary>,
    pub questionnaires: Vec<QuestionnaireSummary>,
    pub skipped: Vec<SkippedFile>,
    /// Number of sessions by the relation of their results to their recordings.
    pub verification: VerificationCounts,
    /// Sessions that are not verified.
    pub not_verified: Vec<UnverifiedSession>,
}

/// Session whose result a replay of its recording has not confirmed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct UnverifiedSession {
    pub bundle: String,
    pub participant: String,
    /// `not verified` or `differs`.
    pub verification: &'static str,
    pub note: String,
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
    /// Conditions that all these sessions share; sessions under other conditions are an entry of their own. Null where
    /// the sessions do not say; the scorer version is 0 for values entered by hand.
    pub tooth_fdi: Option<u8>,
    pub tooth_sha256: Option<String>,
    pub voxel_mm: Option<[f64; 3]>,
    pub scorer_version: u32,
    /// The conditions in words; null if all sessions of the exercise share them. In English in the file.
    #[serde(serialize_with = "text_in_english")]
    pub conditions: Option<Message>,
    #[serde(skip)]
    pub group: ComparableGroup,
    pub sessions: usize,
    /// People: a code counts once, a session without a code for itself.
    pub participants: usize,
    /// Sessions that were passed, of those that were graded.
    pub passed: usize,
    pub graded: usize,
    /// Of the share passed; null where nothing was graded.
    pub passed_interval: Option<Interval>,
    pub points_mean: Option<f64>,
    pub points: Option<SpreadFile>,
    pub metrics: BTreeMap<String, SpreadFile>,
    /// Of the named experts' sessions alone, `points` among them; empty without experts.
    pub expert_metrics: BTreeMap<String, SpreadFile>,
    /// Why these sessions should not be compared without a second look; in English in the file.
    #[serde(serialize_with = "in_english")]
    pub cautions: Vec<Message>,
    /// Answers that were right, of those that were asked for, by the measure that says so.
    pub right: BTreeMap<String, RightCount>,
    /// Learning curves by measure; empty if nobody made a second attempt.
    pub progress: BTreeMap<String, LearningCurves>,
    /// Agreement of first and second attempts, by measure.
    pub repeated: BTreeMap<String, RepeatedAttempts>,
    /// Pass mark as estimated from examiners' judgements; null without judgements.
    pub standard: Option<PassMarkEstimate>,
    /// Agreement of examiners with each other and with the computed marks; empty without judgements.
    pub agreement: Vec<AgreementFile>,
    /// Error of measurement around the pass mark; null with too few people.
    pub measurement_error: Option<MeasurementErrorFile>,
    /// Summary of the removed volume, for each tooth as it was at the start.
    pub removals: Vec<RemovalSummary>,
}

/// Distribution of a measure over sessions.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SpreadFile {
    pub n: usize,
    pub mean: f64,
    /// Standard deviation of the sample; none of one session.
    pub sd: Option<f64>,
    /// Of the mean, at 95 %, within the values that are possible ([`statistics::mean_interval_in`]); none of one session.
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
    /// Sum of the times of right answers divided by the number of people asked, s; null if everyone was right. The
    /// thesis prints such a figure (8.1.2). It is no mean time, and is given only for comparison with that figure.
    pub time_over_all_s: Option<f64>,
    /// Number of right answers by stiffness coefficient, if the stage lowers the stiffness in steps.
    pub levels: BTreeMap<String, usize>,
}

/// Measures that say whether an answer was right, with the measure of its time and of its level.
const ANSWER_MEASURES: [(&str, &str, Option<&str>); 2] = [
    ("detect_tooth", "detect_level_time_s", Some("detect_level")),
    ("detect_quadrant", "detect_quadrant_time_s", None),
];

impl SpreadFile {
    pub fn of(values: &[f64], range: ValueRange) -> Option<SpreadFile> {
        let statistics::DescriptiveStatistics { n, mean, sd, mean_interval, min, median, quartiles, max } =
            statistics::describe_in(values, range)?;
        Some(SpreadFile { n, mean, sd, mean_interval, min, quartiles, median, max })
    }
}

impl Cohort {
    pub fn summary(&self) -> CohortSummary {
        let ids = dedup(self.sessions.iter().map(|(_, s)| s.scenario.id.as_str()));
        let questionnaires =
            dedup(self.sessions.iter().filter_map(|(_, s)| Some(s.questionnaire.as_ref()?.id.as_str())));
        let skipped = self.skipped.iter();
        CohortSummary {
            version: 1,
            sessions: self.sessions.len(),
            scenarios: ids.into_iter().flat_map(|id| self.scenarios(id)).collect(),
            questionnaires: questionnaires.into_iter().map(|id| QuestionnaireSummary::of(self, id)).collect(),
            skipped: skipped.map(|(p, r)| SkippedFile { file: p.display().to_string(), reason: r.clone() }).collect(),
            verification: self.verification_counts(),
            not_verified: self.unverified_sessions(),
        }
    }

    fn unverified_sessions(&self) -> Vec<UnverifiedSession> {
        let open = self.sessions.iter().map(|(path, session)| (path, session, self.status(path)));
        open.filter(|(_, _, status)| !status.is_verified())
            .map(|(path, session, status)| UnverifiedSession {
                bundle: path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned()),
                participant: session.participant.clone(),
                verification: status.name(),
                note: status.note(),
            })
            .collect()
    }

    /// Numbers of sessions that differ from their recordings, and that are not verified.
    fn verification_cautions(&self, sessions: &[usize]) -> Vec<Message> {
        let statuses = sessions.iter().map(|&index| self.status(&self.sessions[index].0));
        let (mut differing, mut open) = (0, 0);
        for status in statuses {
            differing += usize::from(status.differs());
            open += usize::from(!status.differs() && !status.is_verified());
        }
        let caution = |key: &str, count: usize| {
            (count > 0).then(|| Message::text(key, &[(COUNT, Message::plain(count.to_string()))]))
        };
        [caution("cohort.caution_differs", differing), caution("cohort.caution_unverified", open)]
            .into_iter()
            .flatten()
            .collect()
    }

    /// Summaries of the sessions of an exercise: one for each group that may be compared.
    fn scenarios(&self, id: &str) -> Vec<ScenarioSummary> {
        let groups = self.groups_of(id);
        groups.iter().map(|group| self.scenario(group, &groups)).collect()
    }

    fn scenario(&self, group: &ComparableGroup, all: &[ComparableGroup]) -> ScenarioSummary {
        let own = self.sessions_of(group);
        let sessions: Vec<&SessionFile> = own.iter().map(|&index| &self.sessions[index].1).collect();
        let spread = |name: &str, values: &[f64]| SpreadFile::of(values, self.range_of(name, &own));
        let attempts = self.attempts_by_participant(group);
        let grades: Vec<_> = sessions.iter().filter_map(|s| s.grade.as_ref()).collect();
        let passed = grades.iter().filter(|g| g.passed).count();
        let names = dedup(sessions.iter().flat_map(|s| s.metrics.keys().map(String::as_str)));
        let metrics = names.into_iter().filter_map(|name| {
            let values: Vec<f64> = sessions.iter().filter_map(|s| s.metric(name)).collect();
            Some((name.to_string(), spread(name, &values)?))
        });
        let expert_sessions: Vec<&&SessionFile> = sessions.iter().filter(|s| self.is_expert(s)).collect();
        let measures = dedup(expert_sessions.iter().flat_map(|s| s.metrics.keys().map(String::as_str)))
            .into_iter()
            .chain([POINTS]);
        let expert_metrics = measures.filter_map(|name| {
            let values: Vec<f64> = expert_sessions.iter().filter_map(|s| points_or_measure(s, name)).collect();
            Some((name.to_string(), spread(name, &values)?))
        });
        let points: Vec<f64> = grades.iter().map(|g| g.points).collect();
        let points = spread(POINTS, &points);
        let titles = sessions.iter().map(|s| s.scenario.title.as_str());
        let repeated = self.repeated_by_measure(&own, &attempts);
        ScenarioSummary {
            id: group.scenario.clone(),
            title: titles.into_iter().find(|t| !t.is_empty()).unwrap_or(&group.scenario).into(),
            tooth_fdi: group.tooth_fdi,
            tooth_sha256: group.tooth_sha256.clone(),
            voxel_mm: group.voxel_mm(),
            scorer_version: group.scorer_version,
            group: group.clone(),
            conditions: (all.len() > 1).then(|| group.description(all)),
            sessions: sessions.len(),
            participants: attempts.len(),
            passed,
            graded: grades.len(),
            passed_interval: statistics::proportion(passed, grades.len()).map(|s| s.interval),
            points_mean: points.as_ref().map(|p| p.mean),
            points,
            metrics: metrics.collect(),
            expert_metrics: expert_metrics.collect(),
            cautions: self.verification_cautions(&own).into_iter().chain(cautions(&sessions, all.len())).collect(),
            right: right_counts(&sessions),
            progress: self.progress_by_measure(&own, &attempts),
            measurement_error: self
                .measurement_error(&attempts, repeated.get(POINTS).map(|found| (found.error, found.people))),
            repeated,
            agreement: self.agreement(&attempts),
            standard: self.pass_mark(&own, &attempts),
            removals: self.removals.iter().filter(|r| r.group == *group).map(|r| RemovalSummary::of(self, r)).collect(),
        }
    }
}

fn right_counts(sessions: &[&SessionFile]) -> BTreeMap<String, RightCount> {
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
            interval: statistics::proportion(right.len(), asked).map(|s| s.interval),
            time_mean_s: mean(times.into_iter()),
            time_over_all_s: over_all,
            levels,
        };
        (asked > 0).then(|| (flag.to_string(), count))
    };
    ANSWER_MEASURES.iter().filter_map(count).collect()
}

/// Reasons why sessions of an exercise may not be comparable. `groups` is the number of groups that are kept apart.
fn cautions(sessions: &[&SessionFile], groups: usize) -> Vec<Message> {
    let mut found = Vec::new();
    if groups > 1 {
        found.push(Message::text("cohort.caution_apart", &[(COUNT, Message::plain(groups.to_string()))]));
    }
    let versions = dedup(sessions.iter().map(|s| s.scenario.sha256.as_str()).filter(|s| !s.is_empty())).len();
    if versions > 1 {
        found.push(Message::text("cohort.caution_versions", &[(COUNT, Message::plain(versions.to_string()))]));
    }
    let ended_early = |s: &&&SessionFile| !matches!(s.ended_because.as_str(), "" | "complete");
    let unfinished = sessions.iter().filter(ended_early).count();
    if unfinished > 0 {
        found.push(Message::text("cohort.caution_early", &[(COUNT, Message::plain(unfinished.to_string()))]));
    }
    found
}

fn text_in_english<S: Serializer>(message: &Option<Message>, serializer: S) -> Result<S::Ok, S::Error> {
    message.as_ref().map(|message| english().translate(message)).serialize(serializer)
}

fn in_english<S: Serializer>(messages: &[Message], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(messages.iter().map(|message| english().translate(message)))
}

/// A summary's numbers in words, for pages and the terminal: lines of (title of the measure, text).
pub fn summary_lines(summary: &ScenarioSummary, translator: Translator) -> Vec<(String, String)> {
    let line = |(name, count): (&String, &RightCount)| {
        (translator.translate(&phrases::measure_title(name)), right_text(count, translator))
    };
    summary.right.iter().map(line).collect()
}

fn right_text(count: &RightCount, translator: Translator) -> String {
    let (right, of) = (count.right.to_string(), count.of.to_string());
    let mut text = translator.text("cohort.right", &[("right", right.clone()), ("of", of.clone())]);
    if !count.levels.is_empty() {
        let mut levels: Vec<_> = count.levels.iter().collect();
        levels.sort_by(|a, b| b.0.cmp(a.0));
        let level = |(level, n): (&String, &usize)| {
            translator.text("cohort.right_level", &[(COUNT, n.to_string()), ("level", level.clone())])
        };
        let levels: Vec<String> = levels.into_iter().map(level).collect();
        text = translator.text("cohort.right_levels", &[("answers", text), ("levels", levels.join(", "))]);
    }
    if let Some(time) = count.time_mean_s {
        let time = display_format::duration(time);
        text = translator.text("cohort.right_time", &[("answers", text), ("time", time)]);
    }
    if let Some(over_all) = count.time_over_all_s {
        let time = display_format::duration(over_all);
        let values = [("answers", text), (COUNT, right), ("of", of), ("time", time)];
        text = translator.text("cohort.right_time_over_all", &values);
    }
    text
}
