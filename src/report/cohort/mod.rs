//! Many sessions, compared.
//!
//! Takes the `session.json` of every bundle below a folder, and of each that stands in a map its `removal_time.nrrd`. Gives
//! tables, a page, and maps of what people removed. A file that cannot be read is listed and left out; it never stops the rest.
//! Never shows a result without saying if it follows from its recording.

mod loader;
mod trust;
mod groups;
mod ranges;
mod summary;
mod questionnaire;
mod progress;
mod pass_mark;
mod agreement;
mod measurement_error;
mod removal;
mod csv_export;
mod charts;
mod page;
mod trainee;

pub use agreement::{AgreementFile, AgreementPair, IccFile, KappaFile, MACHINE, RatedItemFile, recording_of};
pub use groups::ComparableGroup;
pub use loader::{FoundBundles, find_bundles, read_session};
pub use measurement_error::{DoubtfulResult, MeasurementErrorFile};
pub use page::AgreementTables;
pub use pass_mark::{ExaminerRating, read_ratings};
pub use progress::LearningCurves;
pub use questionnaire::{QuestionnaireSummary, wording};
pub use removal::{ExpertDistance, RemovalMap};
use summary::summary_lines;
pub use summary::{CohortSummary, RightCount, ScenarioSummary, SpreadFile};
pub use trainee::TraineePage;

use super::display_format;
use super::language::Translator;
use super::session_file::SessionFile;
use super::templates::{Templates, shipped_languages};
use super::verification::VerificationStatus;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Sessions that were read, and files that were not.
#[derive(Clone, Debug, Default)]
pub struct Cohort {
    /// In order of exercise, participant, beginning and path.
    pub sessions: Vec<(PathBuf, SessionFile)>,
    /// Path and reason.
    pub skipped: Vec<(PathBuf, String)>,
    /// Codes of the participants whom the others are compared with.
    pub experts: Vec<String>,
    /// Examiners' judgements of participants, on the scale of [`ExaminerRating::rating`].
    pub ratings: Vec<ExaminerRating>,
    /// Maps of removed voxels; filled by [`Cohort::map_removals`].
    pub removals: Vec<RemovalMap>,
    /// Relation of each session's result to its recording, by the path of its bundle; see [`Cohort::verify`].
    pub verification: BTreeMap<PathBuf, VerificationStatus>,
}

impl Cohort {
    /// Reads every `session.json` below a folder.
    pub fn read(folder: &Path) -> Cohort {
        loader::read_cohort(folder)
    }

    /// Puts the sessions in order, which all statistics require.
    pub fn sort(&mut self) {
        self.sessions.sort_by(|(pa, a), (pb, b)| {
            let key = |s: &SessionFile| (s.scenario.id.clone(), s.participant.clone(), s.started.clone());
            (key(a), pa).cmp(&(key(b), pb))
        });
    }

    /// Agreement of the examiners as text in one language: an entry for each exercise and its conditions that was rated.
    pub fn agreement_tables(&self, translator: Translator) -> Vec<AgreementTables> {
        page::agreement_tables(translator, self)
    }

    /// HTML page of the cohort in the language of a code. `at` is the path of the page, from which sessions are linked.
    ///
    /// # Errors
    ///
    /// When there is no such language, a map of removed voxels cannot be drawn or the template fails.
    pub fn html(&self, templates: &Templates, at: &Path, language: &str) -> Result<String, String> {
        page::html(templates, self, &self.report_links(at), language)
    }

    pub fn json(&self) -> String {
        serde_json::to_string_pretty(&self.summary()).unwrap_or_default() + "\n"
    }

    /// The main numbers as lines for a terminal, in English.
    pub fn text(&self) -> String {
        let mut lines = Vec::new();
        for scenario in self.summary().scenarios {
            let conditions = scenario.conditions.as_ref().map(|said| format!("; {}", english().translate(said)));
            let plural = if scenario.sessions == 1 { "" } else { "s" };
            lines.push(format!(
                "{} ({} session{plural}{})",
                display_format::sanitize_display(&scenario.title, 100),
                scenario.sessions,
                conditions.unwrap_or_default()
            ));
            if let Some(points) = scenario.points_mean {
                let (passed, graded) = (scenario.passed, scenario.graded);
                lines.push(format!(
                    "  {passed} of {graded} passed, {} points on average",
                    display_format::number(points)
                ));
            }
            let right = summary_lines(&scenario, english());
            lines.extend(right.into_iter().map(|(what, text)| format!("  {what}: {text}")));
            for name in ["decay_cleared_pct", "healthy_per_decay_pct", "time_to_clear_s"] {
                if let Some(spread) = scenario.metrics.get(name) {
                    let mean = display_format::measure(name, Some(spread.mean));
                    lines.push(format!("  {}: {mean} on average", display_format::measure_title(name)));
                }
            }
            lines.extend(scenario.agreement.iter().flat_map(|about| page::agreement_lines(english(), about)));
            let cautions = scenario.cautions.iter().map(|caution| english().translate(caution));
            lines.extend(cautions.map(|caution| format!("  caution: {caution}")));
        }
        lines.join("\n") + "\n"
    }

    /// Relative link from a file to each session's page; empty for a session without a page.
    fn report_links(&self, at: &Path) -> Vec<String> {
        let folder = at.parent().unwrap_or(Path::new(""));
        let link = |path: &PathBuf| {
            let page = path.join("report.html");
            let below = page.strip_prefix(folder).ok().filter(|_| page.is_file());
            let parts = below.map(|b| b.components().map(|c| percent_encoded(&c.as_os_str().to_string_lossy())));
            parts.map_or_else(String::new, |parts| parts.collect::<Vec<_>>().join("/"))
        };
        self.sessions.iter().map(|(path, _)| link(path)).collect()
    }

    /// True if the participant of a session is one of the experts.
    fn is_expert(&self, session: &SessionFile) -> bool {
        self.experts.contains(&session.participant)
    }

    /// Distance of a session's cavity from the experts', if known.
    fn distance_to_experts(&self, session: usize) -> Option<&ExpertDistance> {
        self.removals.iter().flat_map(|r| &r.distances).find(|(index, _)| *index == session).map(|(_, d)| d)
    }

    /// Each participant's sessions of a group in the order of time, as indices. People without a code are nobody's second
    /// attempt: each of their sessions stands alone.
    fn attempts_by_participant(&self, group: &ComparableGroup) -> Vec<Vec<usize>> {
        let mut people: Vec<Vec<usize>> = Vec::new();
        // Sessions stand in the order of participant and beginning.
        for index in self.sessions_of(group) {
            let session = &self.sessions[index].1;
            match people.last_mut().filter(|p| is_same_person(&self.sessions[p[0]].1, session)) {
                Some(person) => person.push(index),
                None => people.push(vec![index]),
            }
        }
        people
    }
}

/// Translator into the English that ships with the program, for the terminal and for files that programs read.
fn english() -> Translator<'static> {
    shipped_languages().translator("en").expect("English ships with the program")
}

fn is_same_person(a: &SessionFile, b: &SessionFile) -> bool {
    !a.participant.is_empty() && a.participant == b.participant
}

/// A score or a measure of a session: `points`, or a measure's name.
fn points_or_measure(session: &SessionFile, measure: &str) -> Option<f64> {
    match measure {
        POINTS => session.grade.as_ref().map(|g| g.points),
        name => session.metric(name),
    }
}

/// Name under which the points of the grade are listed with the measures.
const POINTS: &str = "points";

fn dedup<'a>(names: impl Iterator<Item = &'a str>) -> Vec<&'a str> {
    let mut seen = std::collections::BTreeSet::new();
    names.filter(|name| seen.insert(*name)).collect()
}

/// A part of a relative link.
fn percent_encoded(text: &str) -> String {
    let keep = |b: u8| b.is_ascii_alphanumeric() || b"-_.~".contains(&b);
    text.bytes().map(|b| if keep(b) { char::from(b).to_string() } else { format!("%{b:02X}") }).collect()
}
