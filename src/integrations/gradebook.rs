//! Grade tables in the CSV formats that Moodle and Canvas import.
//!
//! Moodle identifies students by `Email address` or `ID number`; grades and their feedback must both be mapped, or
//! grades are lost (docs.moodle.org, "Grade import"). Canvas requires its own columns and a row `Points Possible`,
//! and reads a number in round brackets at the end of a title as an assignment id.

use crate::session_id;
use std::collections::BTreeMap;
use typodont_report::cohort::Cohort;
use typodont_report::{GradeFile, SessionFile, Translator, VerificationStatus, csv, sanitize_display};

/// Learning management system that imports the table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lms {
    Moodle,
    Canvas,
}

/// Rule that selects the graded session when a participant has several of one exercise.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AttemptPolicy {
    Last,
    Best,
    First,
}

/// Rule for the points of a session with a critical error, which a gradebook cannot show as such.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CriticalErrorPolicy {
    /// The points are written unchanged.
    #[default]
    Keep,
    /// The points are limited to [`CAP_BELOW_PASS`] below the pass mark.
    Cap,
    /// 0 points are written.
    Zero,
}

/// Number of points below the pass mark to which [`CriticalErrorPolicy::Cap`] limits a grade.
pub const CAP_BELOW_PASS: f64 = 1.0;

impl CriticalErrorPolicy {
    /// Returns the points to be written for a grade. A grade that an examiner passed in spite of the error is kept.
    pub fn points(self, grade: &GradeFile) -> f64 {
        let applies = !grade.hard_fails.is_empty() && !grade.passed;
        match self {
            CriticalErrorPolicy::Cap if applies => grade.points.min((grade.pass_points - CAP_BELOW_PASS).max(0.0)),
            CriticalErrorPolicy::Zero if applies => 0.0,
            _ => grade.points,
        }
    }

    /// Returns the warning about `count` grades with a critical error.
    fn warning(self, count: usize) -> String {
        let effect = match self {
            CriticalErrorPolicy::Keep => {
                "their points are exported unchanged, which a gradebook cannot tell from a pass (--critical zero or \
                 cap changes them)"
            }
            CriticalErrorPolicy::Cap => "their points are limited to one below the pass mark",
            CriticalErrorPolicy::Zero => "0 points are exported for them",
        };
        format!("{count} of these grades failed because of a critical error; {effect}")
    }
}

/// Change of a grade by an examiner.
#[derive(Clone, Debug, PartialEq)]
pub struct GradeChange {
    /// Title of the changed item; `None` for the grade as a whole.
    pub item: Option<String>,
    /// Points before and after.
    pub points: [f64; 2],
    pub name: String,
    pub reason: String,
}

/// Contents of a grade table.
#[derive(Clone, Copy, Debug)]
pub struct GradebookOptions<'a> {
    pub lms: Lms,
    pub policy: AttemptPolicy,
    pub critical: CriticalErrorPolicy,
    /// Identities of the students; without them, participant codes are written to `ID number` (Moodle) or
    /// `SIS User ID` (Canvas).
    pub students: Option<&'a StudentTable>,
    /// Changes in effect by session id: the cohort's grades include them.
    pub changes: &'a BTreeMap<String, Vec<GradeChange>>,
    /// Translator into the language of the feedback. The titles of the columns are the same in every language.
    pub translator: Translator<'a>,
}

/// Grade table and the warnings raised while it was built.
#[derive(Clone, Debug, PartialEq)]
pub struct Gradebook {
    pub csv: String,
    /// Number of student rows.
    pub students: usize,
    /// One sentence per warning: sessions or participants left out, and grades that the target system cannot
    /// represent.
    pub warnings: Vec<String>,
}

/// The school's own identification of students: maps a participant code to the cells of the identifying columns.
#[derive(Clone, Debug, PartialEq)]
pub struct StudentTable {
    columns: Vec<String>,
    cells: BTreeMap<String, Vec<String>>,
}

/// Columns by which Canvas identifies students, in the order it requires.
const CANVAS: [&str; 5] = ["Student", "ID", "SIS User ID", "SIS Login ID", "Section"];

/// Maximum lengths, characters, of a title and of a feedback text: as much as gradebooks display.
const TITLE_MAX: usize = 120;
const FEEDBACK_MAX: usize = 1000;

impl StudentTable {
    /// Reads a CSV table with the column `participant` and one or more identifying columns, which are copied before
    /// the grades.
    ///
    /// `name` is the file name used in error messages.
    ///
    /// # Errors
    ///
    /// Returns a message when the text is not a CSV table, lacks one of these columns, or lists a participant twice.
    pub fn read(name: &str, text: &str) -> Result<StudentTable, String> {
        let rows = csv::parse_rows(text).map_err(|e| format!("{name}: wrong-table: {e}"))?;
        let (head, lines) = rows.split_first().ok_or(format!("{name}: wrong-table: the file is empty"))?;
        let code = head.iter().position(|c| c.trim().eq_ignore_ascii_case("participant"));
        let code =
            code.ok_or(format!("{name}: wrong-table: the first line must contain the column \"participant\""))?;
        let others: Vec<usize> = (0..head.len()).filter(|c| *c != code).collect();
        if others.is_empty() {
            return Err(format!(
                "{name}: wrong-table: besides \"participant\", the table needs a column that identifies students"
            ));
        }
        let cell =
            |row: &Vec<String>, column: usize| row.get(column).map_or_else(String::new, |c| c.trim().to_string());
        let mut cells = BTreeMap::new();
        for (number, row) in (2..).zip(lines) {
            let own = others.iter().map(|c| cell(row, *c)).collect();
            if cells.insert(cell(row, code), own).is_some() {
                let duplicate = sanitize_display(&cell(row, code), 40);
                return Err(format!("{name}: row {number}: duplicate-participant: \"{duplicate}\" is listed twice"));
            }
        }
        Ok(StudentTable { columns: others.iter().map(|c| head[*c].trim().to_string()).collect(), cells })
    }

    /// Returns a participant's cells in the given columns, empty for columns that the table lacks; `None` for an
    /// unlisted participant.
    fn of(&self, participant: &str, columns: &[String]) -> Option<Vec<String>> {
        let own = self.cells.get(participant)?;
        let place = |column: &String| self.columns.iter().position(|c| c.eq_ignore_ascii_case(column));
        Some(columns.iter().map(|c| place(c).map_or_else(String::new, |p| own[p].clone())).collect())
    }
}

/// Graded session of a cohort.
#[derive(Clone, Copy)]
struct GradedSession<'a> {
    session: &'a SessionFile,
    grade: &'a GradeFile,
    status: &'a VerificationStatus,
}

fn is_of(graded: &GradedSession, participant: &str, exercise: &SessionFile) -> bool {
    graded.session.participant == participant && graded.session.scenario.id == exercise.scenario.id
}

/// Builds the grade table of a cohort: one row per participant, one column per exercise (for Moodle also its
/// feedback).
pub fn gradebook(cohort: &Cohort, options: &GradebookOptions) -> Gradebook {
    let GradebookOptions { lms, policy, critical, students, changes, translator } = *options;
    let graded: Vec<GradedSession> = cohort
        .sessions
        .iter()
        .filter_map(|(path, session)| {
            Some(GradedSession { session, grade: session.grade.as_ref()?, status: cohort.status(path) })
        })
        .collect();
    let mut warnings = Vec::new();
    let mut exercises: Vec<&SessionFile> = Vec::new();
    let mut people: Vec<&str> = Vec::new();
    for GradedSession { session, .. } in &graded {
        if !exercises.iter().any(|e| e.scenario.id == session.scenario.id) {
            exercises.push(session);
        }
        if !session.participant.is_empty() && !people.contains(&session.participant.as_str()) {
            people.push(&session.participant);
        }
    }
    people.sort_unstable();
    let nameless = graded.iter().filter(|g| g.session.participant.is_empty()).count();
    if nameless > 0 {
        warnings.push(format!("{nameless} graded sessions have no participant code and were left out"));
    }
    let identity_columns = match (lms, students) {
        (Lms::Canvas, _) => CANVAS.map(String::from).to_vec(),
        (Lms::Moodle, Some(students)) => students.columns.clone(),
        (Lms::Moodle, None) => vec!["ID number".to_string()],
    };
    let mut head = identity_columns.clone();
    let mut possible = vec![String::new(); identity_columns.len()];
    for exercise in &exercises {
        let plain = |e: &SessionFile| title(e, lms);
        let is_alone = exercises.iter().filter(|e| plain(e) == plain(exercise)).count() == 1;
        // A learning management system would treat two columns of the same name as one assignment.
        let title = match is_alone {
            true => plain(exercise),
            false => format!("{} · {}", plain(exercise), sanitize_display(&exercise.scenario.id, TITLE_MAX)),
        };
        head.push(title.clone());
        if lms == Lms::Moodle {
            head.push(format!("{title} (feedback)"));
        }
        let max_points: Vec<f64> = graded
            .iter()
            .filter(|g| g.session.scenario.id == exercise.scenario.id && !g.status.differs())
            .map(|g| g.grade.max_points)
            .collect();
        if max_points.windows(2).any(|pair| pair[0] != pair[1]) {
            warnings.push(format!("the sessions of \"{title}\" have different maximum points: export them separately"));
        }
        possible.push(max_points.iter().copied().fold(0.0, f64::max).to_string());
    }
    let mut table = csv::format_row(&head);
    if lms == Lms::Canvas {
        possible[0] = "    Points Possible".into();
        table += &csv::format_row(&possible);
    }
    let mut count = 0;
    let (mut critical_errors, mut not_verified, mut changed) = (0, 0, 0);
    for person in people {
        let identity =
            match students {
                Some(students) => students.of(person, &identity_columns),
                None => Some(
                    identity_columns
                        .iter()
                        .map(|c| {
                            if ["ID number", "SIS User ID"].contains(&c.as_str()) {
                                person.into()
                            } else {
                                String::new()
                            }
                        })
                        .collect(),
                ),
            };
        let Some(mut line) = identity else {
            warnings
                .push(format!("\"{}\" is not in the table of students and was left out", sanitize_display(person, 40)));
            continue;
        };
        for exercise in &exercises {
            let own = graded.iter().copied().filter(|g| is_of(g, person, exercise));
            // A result that its recording does not give is nobody's grade; an earlier or later attempt may be.
            let (differing, own): (Vec<GradedSession>, Vec<GradedSession>) = own.partition(|g| g.status.differs());
            let selected = select_grade(&own, policy);
            critical_errors += usize::from(selected.is_some_and(|g| !g.grade.hard_fails.is_empty() && !g.grade.passed));
            not_verified += usize::from(selected.is_some_and(|g| !g.status.is_verified()));
            let own_changes = selected.and_then(|g| changes.get(&session_id(g.session))).map_or(&[][..], |c| c);
            changed += usize::from(!own_changes.is_empty());
            line.push(selected.map_or_else(String::new, |g| critical.points(g.grade).to_string()));
            if !differing.is_empty() {
                let (person, count) = (sanitize_display(person, 40), differing.len());
                let title = title(exercise, lms);
                warnings.push(format!(
                    "\"{person}\", \"{title}\": {count} sessions differ from their recordings, and their points are not \
                     exported; typodont verify lists the differences"
                ));
            }
            if lms == Lms::Moodle {
                let without =
                    if differing.is_empty() { String::new() } else { translator.text("gradebook.differs", &[]) };
                line.push(selected.map_or(without, |g| feedback(g, critical, own_changes, translator)));
            }
        }
        table += &csv::format_row(&line);
        count += 1;
    }
    if not_verified > 0 {
        warnings.push(format!(
            "{not_verified} of these grades are not verified: no replay of the recording has confirmed them"
        ));
    }
    if critical_errors > 0 {
        warnings.push(critical.warning(critical_errors));
    }
    if changed > 0 && lms == Lms::Canvas {
        warnings.push(format!(
            "{changed} of these grades were changed by an examiner; names and reasons are in the export of the review \
             desk, because this table has no place for them"
        ));
    }
    Gradebook { csv: table, students: count, warnings }
}

/// Returns the column title of an exercise; for Canvas, a final number in round brackets is put in square brackets.
fn title(session: &SessionFile, lms: Lms) -> String {
    let title = if session.scenario.title.is_empty() { &session.scenario.id } else { &session.scenario.title };
    let title = sanitize_display(title, TITLE_MAX);
    let number =
        title.strip_suffix(')').and_then(|t| t.rsplit_once('(')).filter(|(_, n)| n.chars().all(|c| c.is_ascii_digit()));
    match (lms, number) {
        (Lms::Canvas, Some((before, number))) => format!("{before}[{number}]"),
        _ => title,
    }
}

/// Selects a grade from one participant's `sessions`, which are in chronological order; among equally good ones the
/// last counts.
fn select_grade<'a>(sessions: &[GradedSession<'a>], policy: AttemptPolicy) -> Option<GradedSession<'a>> {
    match policy {
        AttemptPolicy::First => sessions.first().copied(),
        AttemptPolicy::Last => sessions.last().copied(),
        AttemptPolicy::Best => sessions
            .iter()
            .copied()
            .max_by(|a, b| a.grade.passed.cmp(&b.grade.passed).then(a.grade.points.total_cmp(&b.grade.points))),
    }
}

/// Summarises a grade as the feedback text of a gradebook.
fn feedback(
    session: GradedSession,
    critical: CriticalErrorPolicy,
    changes: &[GradeChange],
    translator: Translator,
) -> String {
    let grade = session.grade;
    let key = if grade.passed { "gradebook.passed" } else { "gradebook.not_passed" };
    let (points, most) = (round_beside(grade.points, grade.pass_points), round(grade.max_points));
    let mut sentences =
        vec![translator.text(key, &[("points", points), ("most", most), ("needed", round(grade.pass_points))])];
    if !session.status.is_verified() {
        sentences.push(translator.text("gradebook.not_verified", &[]));
    }
    if !grade.finished {
        sentences.push(translator.text("gradebook.unfinished", &[]));
    }
    if !grade.hard_fails.is_empty() {
        sentences.push(translator.text("gradebook.critical_errors", &[("titles", grade.hard_fails.join("; "))]));
    }
    let exported = critical.points(grade);
    if exported != grade.points {
        sentences.push(translator.text("gradebook.critical_points", &[("points", round(exported))]));
    }
    // Before the items, so that a long list of them does not cut it off.
    sentences.extend(changes.iter().map(|change| {
        let [from, to] = change.points.map(round);
        let title = change.item.clone().unwrap_or_else(|| translator.text("gradebook.grade", &[]));
        let reason = change.reason.lines().collect::<Vec<_>>().join(" ");
        let values = [("name", change.name.clone()), ("title", title), ("from", from), ("to", to), ("reason", reason)];
        translator.text("gradebook.changed", &values)
    }));
    sentences.extend(grade.items.iter().map(|item| {
        let (points, most) = (round(item.points), round(item.max_points));
        translator.text("gradebook.item", &[("title", item.title.clone()), ("points", points), ("most", most)])
    }));
    sanitize_display(&sentences.join(" "), FEEDBACK_MAX)
}

/// Formats points, rounded to one decimal place unless that would move them across the pass mark.
fn round_beside(points: f64, pass_points: f64) -> String {
    let rounded = (points * 10.0).round() / 10.0;
    if (rounded < pass_points) == (points < pass_points) { rounded.to_string() } else { points.to_string() }
}

/// Formats points, rounded to one decimal place.
fn round(points: f64) -> String {
    ((points * 10.0).round() / 10.0).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_critical_error_changes_exported_points_only_if_asked() {
        let failed = GradeFile {
            points: 82.5,
            max_points: 100.0,
            pass_points: 70.0,
            finished: true,
            passed: false,
            hard_fails: vec!["Pulp exposed".into()],
            items: Vec::new(),
            hard_fail_checks: Vec::new(),
        };
        let policies = [CriticalErrorPolicy::Keep, CriticalErrorPolicy::Cap, CriticalErrorPolicy::Zero];
        assert_eq!(policies.map(|p| p.points(&failed)), [82.5, 69.0, 0.0]);
        let low = GradeFile { points: 12.0, ..failed.clone() };
        assert_eq!(policies.map(|p| p.points(&low)), [12.0, 12.0, 0.0]);
        // An examiner may pass a session in spite of the error.
        let excused = GradeFile { passed: true, ..failed };
        assert_eq!(policies.map(|p| p.points(&excused)), [82.5; 3]);
        assert!(CriticalErrorPolicy::Keep.warning(2).contains("unchanged"));
    }
}
