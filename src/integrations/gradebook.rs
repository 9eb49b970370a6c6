//! Grade tables in the CSV formats that Moodle and Canvas import.
//!
//! Moodle identifies students by `Email address` or `ID number`; grades and their feedback must both be mapped, or
//! grades are lost (docs.moodle.org, "Grade import"). Canvas requires its own columns and a row `Points Possible`,
//! and reads a number in round brackets at the end of a title as an assignment id.

use crate::session_id;
use std::collections::{BTreeMap, BTreeSet};
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
    /// Returns a message when the text is not a CSV table, lacks one of these columns, has a column twice, or lists a
    /// participant twice or two participants as the same student.
    pub fn read(name: &str, text: &str) -> Result<StudentTable, String> {
        let rows = csv::parse_rows(text).map_err(|e| format!("{name}: wrong-table: {e}"))?;
        let (head, lines) = rows.split_first().ok_or(format!("{name}: wrong-table: the file is empty"))?;
        let code = head.iter().position(|c| c.trim().eq_ignore_ascii_case("participant"));
        let code =
            code.ok_or(format!("{name}: wrong-table: the first line must contain the column \"participant\""))?;
        let names: Vec<String> = head.iter().map(|c| c.trim().to_lowercase()).collect();
        if let Some(twice) = (0..names.len()).find(|c| !names[*c].is_empty() && names[..*c].contains(&names[*c])) {
            let column = sanitize_display(head[twice].trim(), 40);
            return Err(format!("{name}: wrong-table: the first line contains the column \"{column}\" twice"));
        }
        let others: Vec<usize> = (0..head.len()).filter(|c| *c != code).collect();
        if others.is_empty() {
            return Err(format!(
                "{name}: wrong-table: besides \"participant\", the table needs a column that identifies students"
            ));
        }
        let cell =
            |row: &Vec<String>, column: usize| row.get(column).map_or_else(String::new, |c| c.trim().to_string());
        let mut cells = BTreeMap::new();
        let mut students: BTreeMap<Vec<String>, String> = BTreeMap::new();
        for (number, row) in (2..).zip(lines) {
            let participant = cell(row, code);
            let own: Vec<String> = others.iter().map(|c| cell(row, *c)).collect();
            let is_identified = own.iter().any(|text| !text.is_empty());
            let same = students.insert(own.clone(), participant.clone()).filter(|_| is_identified);
            if let Some(other) = same.filter(|other| *other != participant) {
                let [one, two] = [&other, &participant].map(|code| sanitize_display(code, 40));
                return Err(format!(
                    "{name}: row {number}: duplicate-student: \"{one}\" and \"{two}\" are the same student"
                ));
            }
            let duplicate = sanitize_display(&participant, 40);
            if cells.insert(participant, own).is_some() {
                return Err(format!("{name}: row {number}: duplicate-participant: \"{duplicate}\" is listed twice"));
            }
        }
        Ok(StudentTable { columns: others.iter().map(|c| head[*c].trim().to_string()).collect(), cells })
    }

    /// Returns a participant's cells in the given columns, empty for columns that the table lacks; `None` for a
    /// participant who is not listed, or whom none of these columns identifies.
    fn of(&self, participant: &str, columns: &[String]) -> Option<Vec<String>> {
        let own = self.cells.get(participant)?;
        let place = |column: &String| self.columns.iter().position(|c| c.eq_ignore_ascii_case(column));
        let cells: Vec<String> =
            columns.iter().map(|c| place(c).map_or_else(String::new, |p| own[p].clone())).collect();
        cells.iter().any(|text| !text.is_empty()).then_some(cells)
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
    let graded: Vec<GradedSession> = cohort
        .sessions
        .iter()
        .filter_map(|(path, session)| {
            Some(GradedSession { session, grade: session.grade.as_ref()?, status: cohort.status(path) })
        })
        .collect();
    let columns = GradebookColumns::of(&graded, options);
    let mut warnings = Vec::new();
    let nameless = graded.iter().filter(|g| g.session.participant.is_empty()).count();
    if nameless > 0 {
        warnings.push(format!("{nameless} graded sessions have no participant code and were left out"));
    }
    warnings.extend(columns.exercises.iter().filter_map(ExerciseColumn::warning));
    let people: BTreeSet<&str> =
        graded.iter().map(|g| g.session.participant.as_str()).filter(|code| !code.is_empty()).collect();
    let mut table = columns.head_rows(options.lms);
    let mut count = 0;
    let mut doubtful = DoubtfulGrades::default();
    for person in people {
        let Some(mut line) = columns.identity_cells(person, options.students) else {
            warnings.push(format!(
                "\"{}\" is not in the table of students, or not identified by it, and was left out",
                sanitize_display(person, 40)
            ));
            continue;
        };
        for ExerciseColumn { exercise, .. } in &columns.exercises {
            let own: Vec<GradedSession> = graded.iter().copied().filter(|g| is_of(g, person, exercise)).collect();
            let selected = SelectedGrade::of(&own, options);
            doubtful.count(&selected);
            warnings.extend(selected.warning(person, &title(exercise, options.lms)));
            line.extend(selected.cells(options));
        }
        table += &csv::format_row(&line);
        count += 1;
    }
    warnings.extend(doubtful.warnings(options));
    Gradebook { csv: table, students: count, warnings }
}

/// Columns of a grade table: those that identify students, then those of the exercises.
struct GradebookColumns<'a> {
    identity: Vec<String>,
    exercises: Vec<ExerciseColumn<'a>>,
}

/// Column of an exercise; for Moodle, a column with the feedback follows it.
struct ExerciseColumn<'a> {
    /// First graded session of the exercise.
    exercise: &'a SessionFile,
    /// Title that no other exercise has.
    title: String,
    /// Maximum points of each session that does not differ from its recording.
    max_points: Vec<f64>,
}

impl<'a> GradebookColumns<'a> {
    fn of(graded: &[GradedSession<'a>], options: &GradebookOptions) -> GradebookColumns<'a> {
        let identity = match (options.lms, options.students) {
            (Lms::Canvas, _) => CANVAS.map(String::from).to_vec(),
            (Lms::Moodle, Some(students)) => students.columns.clone(),
            (Lms::Moodle, None) => vec!["ID number".to_string()],
        };
        let mut exercises: Vec<&'a SessionFile> = Vec::new();
        for session in graded.iter().map(|g| g.session) {
            if !exercises.iter().any(|e| e.scenario.id == session.scenario.id) {
                exercises.push(session);
            }
        }
        let titles = unique_titles(&exercises, options.lms);
        let column = |(exercise, title): (&'a SessionFile, String)| {
            let own = graded.iter().filter(|g| g.session.scenario.id == exercise.scenario.id && !g.status.differs());
            ExerciseColumn { exercise, title, max_points: own.map(|g| g.grade.max_points).collect() }
        };
        GradebookColumns { identity, exercises: exercises.into_iter().zip(titles).map(column).collect() }
    }

    /// Returns the row of titles, and for Canvas that of the possible points.
    fn head_rows(&self, lms: Lms) -> String {
        let mut head = self.identity.clone();
        let mut possible = vec![String::new(); self.identity.len()];
        for column in &self.exercises {
            head.push(column.title.clone());
            if lms == Lms::Moodle {
                head.push(format!("{} (feedback)", column.title));
            }
            possible.push(column.max_points.iter().copied().fold(0.0, f64::max).to_string());
        }
        let mut rows = csv::format_row(&head);
        if lms == Lms::Canvas {
            possible[0] = "    Points Possible".into();
            rows += &csv::format_row(&possible);
        }
        rows
    }

    /// Returns the cells that identify a participant; `None` for one who is not in the table of students.
    fn identity_cells(&self, person: &str, students: Option<&StudentTable>) -> Option<Vec<String>> {
        match students {
            Some(students) => students.of(person, &self.identity),
            None => {
                let is_code = |column: &str| ["ID number", "SIS User ID"].contains(&column);
                let cell = |column: &String| if is_code(column) { person.to_string() } else { String::new() };
                Some(self.identity.iter().map(cell).collect())
            }
        }
    }
}

impl ExerciseColumn<'_> {
    /// Returns the warning about sessions with different maximum points.
    fn warning(&self) -> Option<String> {
        let are_different = self.max_points.windows(2).any(|pair| pair[0] != pair[1]);
        are_different.then(|| {
            format!("the sessions of \"{}\" have different maximum points: export them separately", self.title)
        })
    }
}

/// Grade of a participant in an exercise, as far as there is one to export.
struct SelectedGrade<'a> {
    graded: Option<GradedSession<'a>>,
    changes: &'a [GradeChange],
    /// Number of sessions that differ from their recordings.
    differing: usize,
}

impl<'a> SelectedGrade<'a> {
    /// Selects a grade from one participant's sessions of an exercise, which are in chronological order.
    fn of(sessions: &[GradedSession<'a>], options: &GradebookOptions<'a>) -> SelectedGrade<'a> {
        // A result that its recording does not give is nobody's grade; an earlier or later attempt may be.
        let (differing, own): (Vec<GradedSession>, Vec<GradedSession>) =
            sessions.iter().copied().partition(|g| g.status.differs());
        let graded = select_grade(&own, options.policy);
        let changes = graded.and_then(|g| options.changes.get(&session_id(g.session)));
        SelectedGrade { graded, changes: changes.map(Vec::as_slice).unwrap_or_default(), differing: differing.len() }
    }

    /// Returns the points, and for Moodle the feedback; empty without a grade.
    fn cells(&self, options: &GradebookOptions) -> Vec<String> {
        let GradebookOptions { lms, critical, translator, .. } = *options;
        let mut cells = vec![self.graded.map_or_else(String::new, |g| critical.points(g.grade).to_string())];
        if lms == Lms::Moodle {
            cells.push(match self.graded {
                Some(graded) => feedback(graded, critical, self.changes, translator),
                None if self.differing > 0 => translator.text("gradebook.differs", &[]),
                None => String::new(),
            });
        }
        cells
    }

    /// Returns the warning about sessions that differ from their recordings.
    fn warning(&self, person: &str, title: &str) -> Option<String> {
        let (person, count) = (sanitize_display(person, 40), self.differing);
        (count > 0).then(|| {
            format!(
                "\"{person}\", \"{title}\": {count} sessions differ from their recordings, and their points are not \
                 exported; typodont verify lists the differences"
            )
        })
    }
}

/// Numbers of exported grades that the table does not show as they are.
#[derive(Default)]
struct DoubtfulGrades {
    critical_errors: usize,
    not_verified: usize,
    changed: usize,
}

impl DoubtfulGrades {
    fn count(&mut self, selected: &SelectedGrade) {
        let Some(GradedSession { grade, status, .. }) = selected.graded else { return };
        self.critical_errors += usize::from(!grade.hard_fails.is_empty() && !grade.passed);
        self.not_verified += usize::from(!status.is_verified());
        self.changed += usize::from(!selected.changes.is_empty());
    }

    fn warnings(&self, options: &GradebookOptions) -> Vec<String> {
        let DoubtfulGrades { critical_errors, not_verified, changed } = *self;
        let mut warnings = Vec::new();
        if not_verified > 0 {
            warnings.push(format!(
                "{not_verified} of these grades are not verified: no replay of the recording has confirmed them"
            ));
        }
        if critical_errors > 0 {
            warnings.push(options.critical.warning(critical_errors));
        }
        if changed > 0 && options.lms == Lms::Canvas {
            warnings.push(format!(
                "{changed} of these grades were changed by an examiner; names and reasons are in the export of the \
                 review desk, because this table has no place for them"
            ));
        }
        warnings
    }
}

/// Returns a column title for each exercise: with its id where others have the same title, and with a number where even
/// that is another's title. A learning management system would treat two columns of the same name as one assignment.
fn unique_titles(exercises: &[&SessionFile], lms: Lms) -> Vec<String> {
    let plain: Vec<String> = exercises.iter().map(|exercise| title(exercise, lms)).collect();
    let mut titles: Vec<String> = Vec::new();
    for (exercise, own) in exercises.iter().zip(&plain) {
        let is_alone = plain.iter().filter(|title| *title == own).count() == 1;
        let with_id = || format!("{own} · {}", sanitize_display(&exercise.scenario.id, TITLE_MAX));
        let wanted = if is_alone { own.clone() } else { with_id() };
        let numbered = (2..).map(|number| format!("{wanted} · {number}"));
        let is_free = |title: &String| !titles.contains(title) && (*title == *own || !plain.contains(title));
        let free = std::iter::once(wanted.clone()).chain(numbered).find(is_free);
        titles.extend(free);
    }
    titles
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

    #[test]
    fn no_two_columns_have_the_same_title() {
        // Aim: a learning management system takes columns of one name for one assignment. Method: two exercises of the same
        // title, a third whose title is what the first becomes with its id, and one that stands alone.
        let session = |id: &str, title: &str| {
            let text = serde_json::json!({ "version": 1, "scenario": { "id": id, "title": title }, "metrics": {} });
            SessionFile::from_json(&text.to_string()).unwrap()
        };
        let sessions =
            [session("a", "Caries"), session("b", "Caries"), session("c", "Caries · a"), session("d", "Amalgam")];
        let titles = unique_titles(&sessions.iter().collect::<Vec<_>>(), Lms::Moodle);
        assert_eq!(titles, ["Caries · a · 2", "Caries · b", "Caries · a", "Amalgam"]);
    }

    #[test]
    fn a_table_of_students_identifies_each_participant_as_one_student() {
        let read = |text: &str| StudentTable::read("students.csv", text);
        let table = read("participant,email\nP-1,a@school\nP-2,\n").unwrap();
        let columns = |names: &[&str]| names.iter().map(|name| name.to_string()).collect::<Vec<_>>();
        assert_eq!(table.of("P-1", &columns(&["ID", "email"])), Some(columns(&["", "a@school"])));
        // Whom nothing identifies would be a row that belongs to nobody.
        assert_eq!(table.of("P-2", &columns(&["ID", "email"])), None);
        assert_eq!(table.of("P-1", &columns(&CANVAS)), None);
        for (text, code) in [
            ("participant,email,EMAIL\nP-1,a@school,b\n", "column \"EMAIL\" twice"),
            ("participant,Participant,email\nP-1,x,a@school\n", "column \"Participant\" twice"),
            ("participant,email\nP-1,a@school\nP-2,a@school\n", "duplicate-student"),
            ("participant,email\nP-1,a@school\nP-1,a@school\n", "duplicate-participant"),
        ] {
            assert!(read(text).unwrap_err().contains(code), "{text}");
        }
    }
}
