//! Many sessions, one table.
//!
//! Takes the `session.json` of every bundle below a folder. Gives means and spreads per exercise, and what trainees said of
//! it. A file that cannot be read is listed and left out; it never stops the rest.

use super::html::{self, Templates};
use super::session_file::{SessionFile, mean};
use super::words;
use crate::scenario::metric::PLAIN;
use serde::Serialize;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// Folders are looked into this deep: a class of sessions within a year within a school.
const DEPTH_MAX: usize = 4;

/// Sessions that were read, and files that were not.
#[derive(Clone, Debug, Default)]
pub struct Cohort {
    /// In order of exercise, participant and path.
    pub sessions: Vec<(PathBuf, SessionFile)>,
    /// Path and reason.
    pub skipped: Vec<(PathBuf, String)>,
}

/// What a cohort's numbers say.
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
    /// Sessions that were passed, of those that were graded.
    pub passed: usize,
    pub graded: usize,
    pub points_mean: Option<f64>,
    pub metrics: BTreeMap<String, Spread>,
    /// Why these sessions should not be compared without a second look.
    pub cautions: Vec<String>,
    /// Answers that were right, of those that were asked for, by the measure that says so.
    pub right: BTreeMap<String, RightCount>,
}

/// How a measure is spread over sessions.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Spread {
    pub n: usize,
    pub mean: f64,
    /// Standard deviation of the sample; none of one session.
    pub sd: Option<f64>,
    pub min: f64,
    pub median: f64,
    pub max: f64,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RightCount {
    pub right: usize,
    pub of: usize,
    /// Mean time of the right answers, s.
    pub time_mean_s: Option<f64>,
    /// Where the stiffness fell in steps: how many right answers came at which coefficient.
    pub levels: BTreeMap<String, usize>,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct QuestionnaireSummary {
    pub id: String,
    pub n: usize,
    /// Mean of each category, negative statements mirrored.
    pub categories: BTreeMap<String, Spread>,
    /// Mean of each statement as answered.
    pub items: BTreeMap<String, Spread>,
}

/// Measures that say whether an answer was right, with the measure of its time and of its level.
const ANSWERS: [(&str, &str, Option<&str>); 2] = [
    ("detect_tooth", "detect_level_time_s", Some("detect_level")),
    ("detect_quadrant", "detect_quadrant_time_s", None),
];

impl Cohort {
    /// Reads every `session.json` below a folder.
    pub fn read(folder: &Path) -> Cohort {
        let mut cohort = Cohort::default();
        cohort.look_into(folder, 0);
        cohort.sessions.sort_by(|(pa, a), (pb, b)| {
            (&a.scenario.id, &a.participant, pa).cmp(&(&b.scenario.id, &b.participant, pb))
        });
        cohort
    }

    fn look_into(&mut self, folder: &Path, depth: usize) {
        let file = folder.join("session.json");
        if file.is_file() {
            match read_session(&file) {
                Ok(session) => self.sessions.push((folder.to_path_buf(), session)),
                Err(reason) => self.skipped.push((file, reason)),
            }
            return;
        }
        if depth == DEPTH_MAX {
            return;
        }
        let entries = match fs::read_dir(folder) {
            Ok(entries) => entries,
            Err(error) => return self.skipped.push((folder.to_path_buf(), error.to_string())),
        };
        let mut folders: Vec<PathBuf> = entries.filter_map(|e| Some(e.ok()?.path())).filter(|p| p.is_dir()).collect();
        folders.sort();
        // What is still being written is not a session yet.
        for folder in folders.iter().filter(|f| f.extension().is_none_or(|e| e != "partial")) {
            self.look_into(folder, depth + 1);
        }
    }

    pub fn summary(&self) -> Summary {
        let mut scenarios: Vec<ScenarioSummary> = Vec::new();
        let ids: Vec<&str> = dedup(self.sessions.iter().map(|(_, s)| s.scenario.id.as_str()));
        for id in ids {
            let of_it: Vec<&SessionFile> =
                self.sessions.iter().map(|(_, s)| s).filter(|s| s.scenario.id == id).collect();
            scenarios.push(summarize(id, &of_it));
        }
        let names = dedup(self.sessions.iter().filter_map(|(_, s)| Some(s.questionnaire.as_ref()?.id.as_str())));
        let skipped = self.skipped.iter();
        Summary {
            version: 1,
            sessions: self.sessions.len(),
            scenarios,
            questionnaires: names.iter().map(|id| self.questionnaire(id)).collect(),
            skipped: skipped.map(|(p, r)| SkippedFile { file: p.display().to_string(), reason: r.clone() }).collect(),
        }
    }

    fn questionnaire(&self, id: &str) -> QuestionnaireSummary {
        let filled = self.sessions.iter().filter_map(|(_, s)| s.questionnaire.as_ref()).filter(|q| q.id == id);
        let filled: Vec<_> = filled.filter(|q| q.items.iter().any(|i| i.value.is_some())).collect();
        let mut categories: BTreeMap<String, Vec<f64>> = BTreeMap::new();
        let mut items: BTreeMap<String, Vec<f64>> = BTreeMap::new();
        for questionnaire in &filled {
            for (name, value) in &questionnaire.categories {
                categories.entry(name.clone()).or_default().extend(value);
            }
            for item in &questionnaire.items {
                items.entry(item.id.clone()).or_default().extend(item.value);
            }
        }
        let spreads = |all: BTreeMap<String, Vec<f64>>| {
            all.into_iter().filter_map(|(name, values)| Some((name, spread(&values)?))).collect()
        };
        QuestionnaireSummary { id: id.into(), n: filled.len(), categories: spreads(categories), items: spreads(items) }
    }

    /// One line per session, one column per measure.
    pub fn csv(&self) -> String {
        let metrics = self.metric_names();
        let fixed = ["bundle", "scenario", "participant", "started", "points", "passed", "hard_fails"];
        let mut lines = vec![fixed.iter().map(|s| s.to_string()).chain(metrics.iter().cloned()).collect::<Vec<_>>()];
        for (path, session) in &self.sessions {
            let grade = session.grade.as_ref();
            let mut line = vec![
                path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned()),
                session.scenario.id.clone(),
                session.participant.clone(),
                session.started.clone(),
                grade.map_or_else(String::new, |g| g.points.to_string()),
                grade.map_or_else(String::new, |g| g.passed.to_string()),
                grade.map_or_else(String::new, |g| g.hard_fails.join("; ")),
            ];
            line.extend(metrics.iter().map(|m| session.metric(m).map_or_else(String::new, |v| v.to_string())));
            lines.push(line);
        }
        let line = |cells: Vec<String>| cells.iter().map(|c| cell(c)).collect::<Vec<_>>().join(",") + "\r\n";
        lines.into_iter().map(line).collect()
    }

    /// Every measure any session has, those of the table first and in its order.
    pub fn metric_names(&self) -> Vec<String> {
        let used = |name: &str| self.sessions.iter().any(|(_, s)| s.metric(name).is_some());
        let mut names: Vec<String> = PLAIN.iter().map(|a| a.name.to_string()).filter(|n| used(n)).collect();
        let others = dedup(self.sessions.iter().flat_map(|(_, s)| s.metrics.keys().map(String::as_str)));
        let others: Vec<String> =
            others.into_iter().filter(|n| !names.iter().any(|k| k == n) && used(n)).map(String::from).collect();
        names.extend(others);
        names
    }

    /// A page for people. `at` is where the page will be: sessions are linked from there.
    pub fn html(&self, templates: &Templates, at: &Path) -> Result<String, String> {
        html::cohort_page(templates, self, &self.links(at))
    }

    /// Where each session's page is, seen from a file; empty for a session without a page.
    fn links(&self, at: &Path) -> Vec<String> {
        let folder = at.parent().unwrap_or(Path::new(""));
        let link = |path: &PathBuf| {
            let page = path.join("report.html");
            let below = page.strip_prefix(folder).ok().filter(|_| page.is_file());
            let parts = below.map(|b| b.components().map(|c| percent_encoded(&c.as_os_str().to_string_lossy())));
            parts.map_or_else(String::new, |parts| parts.collect::<Vec<_>>().join("/"))
        };
        self.sessions.iter().map(|(path, _)| link(path)).collect()
    }

    /// The main numbers as lines for a terminal.
    pub fn text(&self) -> String {
        let mut lines = Vec::new();
        for scenario in self.summary().scenarios {
            let plural = if scenario.sessions == 1 { "" } else { "s" };
            lines.push(format!("{} ({} session{plural})", scenario.title, scenario.sessions));
            if let Some(points) = scenario.points_mean {
                let (passed, graded) = (scenario.passed, scenario.graded);
                lines.push(format!("  {passed} of {graded} passed, {} points on average", words::number(points)));
            }
            lines.extend(in_words(&scenario).into_iter().map(|(what, text)| format!("  {what}: {text}")));
            for name in ["decay_cleared_pct", "healthy_per_decay_pct", "time_to_clear_s"] {
                if let Some(spread) = scenario.metrics.get(name) {
                    lines.push(format!(
                        "  {}: {} on average",
                        words::title(name),
                        words::measure(name, Some(spread.mean))
                    ));
                }
            }
            lines.extend(scenario.cautions.iter().map(|caution| format!("  caution: {caution}")));
        }
        lines.join("\n") + "\n"
    }

    pub fn json(&self) -> String {
        serde_json::to_string_pretty(&self.summary()).unwrap_or_default() + "\n"
    }
}

fn read_session(file: &Path) -> Result<SessionFile, String> {
    let text = crate::content::read_text(file).map_err(|d| d.message)?;
    let session: SessionFile = serde_json::from_str(&text.text).map_err(|e| format!("not a session: {e}"))?;
    match session.version {
        super::session_file::VERSION => Ok(session),
        version if version > super::session_file::VERSION => {
            Err(format!("made by a newer program (version {version})"))
        }
        version => Err(format!("not a session: version {version}")),
    }
}

fn summarize(id: &str, sessions: &[&SessionFile]) -> ScenarioSummary {
    let grades: Vec<_> = sessions.iter().filter_map(|s| s.grade.as_ref()).collect();
    let cautions = cautions(sessions);
    let names = dedup(sessions.iter().flat_map(|s| s.metrics.keys().map(String::as_str)));
    let metrics = names.into_iter().filter_map(|name| {
        let values: Vec<f64> = sessions.iter().filter_map(|s| s.metric(name)).collect();
        Some((name.to_string(), spread(&values)?))
    });
    let right = ANSWERS.iter().filter_map(|&(flag, time, level)| {
        let asked: Vec<&&SessionFile> = sessions.iter().filter(|s| s.metric(flag).is_some()).collect();
        let right: Vec<&&&SessionFile> = asked.iter().filter(|s| s.metric(flag) == Some(1.0)).collect();
        let mut levels = BTreeMap::new();
        for value in level.iter().flat_map(|level| right.iter().filter_map(|s| s.metric(level))) {
            *levels.entry(value.to_string()).or_insert(0) += 1;
        }
        let time_mean_s = mean(right.iter().filter_map(|s| s.metric(time)));
        let count = RightCount { right: right.len(), of: asked.len(), time_mean_s, levels };
        (!asked.is_empty()).then(|| (flag.to_string(), count))
    });
    ScenarioSummary {
        id: id.into(),
        title: sessions.iter().map(|s| s.scenario.title.as_str()).find(|t| !t.is_empty()).unwrap_or(id).into(),
        sessions: sessions.len(),
        passed: grades.iter().filter(|g| g.passed).count(),
        graded: grades.len(),
        points_mean: mean(grades.iter().map(|g| g.points)),
        metrics: metrics.collect(),
        cautions,
        right: right.collect(),
    }
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

fn spread(values: &[f64]) -> Option<Spread> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let n = sorted.len();
    let mean = mean(sorted.iter().copied())?;
    let squares: f64 = sorted.iter().map(|v| (v - mean).powi(2)).sum();
    let sd = (n > 1).then(|| (squares / (n - 1) as f64).sqrt());
    let median = if n % 2 == 1 { sorted[n / 2] } else { 0.5 * (sorted[n / 2 - 1] + sorted[n / 2]) };
    Some(Spread { n, mean, sd, min: sorted[0], median, max: sorted[n - 1] })
}

fn dedup<'a>(names: impl Iterator<Item = &'a str>) -> Vec<&'a str> {
    let mut seen: Vec<&str> = Vec::new();
    for name in names {
        if !seen.contains(&name) {
            seen.push(name);
        }
    }
    seen
}

/// A cell of a table: quoted, and harmless to spreadsheets, which take a text that begins like a formula for one.
fn cell(text: &str) -> String {
    let is_number = text.parse::<f64>().is_ok();
    let starts_formula = !is_number && text.starts_with(['=', '+', '-', '@', '\t', '\r']);
    let text = if starts_formula { format!("'{text}") } else { text.to_string() };
    match text.contains(['"', ',', '\n', '\r']) {
        true => format!("\"{}\"", text.replace('"', "\"\"")),
        false => text,
    }
}

/// A part of a relative link.
fn percent_encoded(text: &str) -> String {
    let keep = |b: u8| b.is_ascii_alphanumeric() || b"-_.~".contains(&b);
    text.bytes().map(|b| if keep(b) { char::from(b).to_string() } else { format!("%{b:02X}") }).collect()
}

/// A summary's numbers in words, for pages: title, and lines of (what, value).
pub(super) fn in_words(summary: &ScenarioSummary) -> Vec<(String, String)> {
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
        lines.push((words::title(name), text));
    }
    lines
}
