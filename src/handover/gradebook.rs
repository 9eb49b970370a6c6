//! Grades as a table that Moodle and Canvas import.
//!
//! Moodle maps any column by `Email address` or `ID number`; grades and their feedback must both be mapped, or grades are lost
//! (docs.moodle.org, "Grade import"). Canvas wants its own columns and a row `Points Possible`, and takes a number in brackets at
//! the end of a title for an assignment's id.

use crate::report::cohort::Cohort;
use crate::report::{GradeFile, SessionFile, csv, harmless};
use std::collections::BTreeMap;

/// Whose gradebook.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum System {
    Moodle,
    Canvas,
}

/// Which of somebody's sessions gives the grade.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Take {
    Last,
    Best,
    First,
}

/// A table, and what it leaves out.
#[derive(Clone, Debug, PartialEq)]
pub struct Gradebook {
    pub csv: String,
    pub students: usize,
    /// A sentence each.
    pub left_out: Vec<String>,
}

/// The school's own names of people: code to the cells of the identifying columns.
#[derive(Clone, Debug, PartialEq)]
pub struct Students {
    columns: Vec<String>,
    cells: BTreeMap<String, Vec<String>>,
}

/// Columns by which Canvas knows people, in its order.
const CANVAS: [&str; 5] = ["Student", "ID", "SIS User ID", "SIS Login ID", "Section"];

/// Letters of a title or a feedback: what gradebooks show of one.
const TITLE_MAX: usize = 120;
const FEEDBACK_MAX: usize = 1000;

impl Students {
    /// Reads a table with the column `participant` and any others; these stand before the grades as they are.
    pub fn read(name: &str, text: &str) -> Result<Students, String> {
        let rows = csv::rows(text).map_err(|e| format!("{name}: wrong-table: {e}"))?;
        let (head, lines) = rows.split_first().ok_or(format!("{name}: wrong-table: it is empty"))?;
        let code = head.iter().position(|c| c.trim().eq_ignore_ascii_case("participant"));
        let code = code.ok_or(format!("{name}: wrong-table: its first line must name a column participant"))?;
        let others: Vec<usize> = (0..head.len()).filter(|c| *c != code).collect();
        if others.is_empty() {
            return Err(format!(
                "{name}: wrong-table: beside participant it needs a column that the school knows people by"
            ));
        }
        let cell =
            |row: &Vec<String>, column: usize| row.get(column).map_or_else(String::new, |c| c.trim().to_string());
        let mut cells = BTreeMap::new();
        for (number, row) in (2..).zip(lines) {
            let own = others.iter().map(|c| cell(row, *c)).collect();
            if cells.insert(cell(row, code), own).is_some() {
                let twice = harmless(&cell(row, code), 40);
                return Err(format!("{name}: row {number}: duplicate-participant: \"{twice}\" stands there twice"));
            }
        }
        Ok(Students { columns: others.iter().map(|c| head[*c].trim().to_string()).collect(), cells })
    }

    /// The cells of somebody under some columns; none where the table does not have them.
    fn of(&self, participant: &str, columns: &[String]) -> Option<Vec<String>> {
        let own = self.cells.get(participant)?;
        let place = |column: &String| self.columns.iter().position(|c| c.eq_ignore_ascii_case(column));
        Some(columns.iter().map(|c| place(c).map_or_else(String::new, |p| own[p].clone())).collect())
    }
}

/// The grades of a cohort, a row per participant and a column per exercise.
pub fn gradebook(cohort: &Cohort, system: System, take: Take, students: Option<&Students>) -> Gradebook {
    let graded: Vec<(&SessionFile, &GradeFile)> =
        cohort.sessions.iter().filter_map(|(_, s)| Some((s, s.grade.as_ref()?))).collect();
    let mut left_out = Vec::new();
    let mut exercises: Vec<&SessionFile> = Vec::new();
    let mut people: Vec<&str> = Vec::new();
    for (session, _) in &graded {
        if !exercises.iter().any(|e| e.scenario.id == session.scenario.id) {
            exercises.push(session);
        }
        if !session.participant.is_empty() && !people.contains(&session.participant.as_str()) {
            people.push(&session.participant);
        }
    }
    people.sort_unstable();
    let nameless = graded.iter().filter(|(s, _)| s.participant.is_empty()).count();
    if nameless > 0 {
        left_out.push(format!("{nameless} graded sessions have no participant's code"));
    }
    let known = match (system, students) {
        (System::Canvas, _) => CANVAS.map(String::from).to_vec(),
        (System::Moodle, Some(students)) => students.columns.clone(),
        (System::Moodle, None) => vec!["ID number".to_string()],
    };
    let mut head = known.clone();
    let mut possible = vec![String::new(); known.len()];
    for exercise in &exercises {
        let plain = |e: &SessionFile| title(e, system);
        let is_alone = exercises.iter().filter(|e| plain(e) == plain(exercise)).count() == 1;
        // Two columns of one name would be one assignment to a learning management system.
        let title = match is_alone {
            true => plain(exercise),
            false => format!("{} · {}", plain(exercise), harmless(&exercise.scenario.id, TITLE_MAX)),
        };
        head.push(title.clone());
        if system == System::Moodle {
            head.push(format!("{title} (feedback)"));
        }
        let most: Vec<f64> =
            graded.iter().filter(|(s, _)| s.scenario.id == exercise.scenario.id).map(|(_, g)| g.max_points).collect();
        if most.iter().any(|m| *m != most[0]) {
            left_out.push(format!(
                "nothing, but the sessions of \"{title}\" have different maximum points: do not mix them"
            ));
        }
        possible.push(most.iter().copied().fold(0.0, f64::max).to_string());
    }
    let mut table = csv::line(&head);
    if system == System::Canvas {
        possible[0] = "    Points Possible".into();
        table += &csv::line(&possible);
    }
    let mut count = 0;
    let mut outright = 0;
    for person in people {
        let identity =
            match students {
                Some(students) => students.of(person, &known),
                None => Some(
                    known
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
            left_out.push(format!("\"{}\" is not in the table of students", harmless(person, 40)));
            continue;
        };
        for exercise in &exercises {
            let own = graded.iter().filter(|(s, _)| s.participant == person && s.scenario.id == exercise.scenario.id);
            let grade = taken(&own.copied().collect::<Vec<_>>(), take);
            outright += usize::from(grade.is_some_and(|g| !g.hard_fails.is_empty()));
            line.push(grade.map_or_else(String::new, |g| g.points.to_string()));
            if system == System::Moodle {
                line.push(grade.map_or_else(String::new, feedback));
            }
        }
        table += &csv::line(&line);
        count += 1;
    }
    if outright > 0 {
        left_out.push(format!(
            "nothing, but {outright} of these grades failed outright whatever their points, which a gradebook does not know"
        ));
    }
    Gradebook { csv: table, students: count, left_out }
}

fn title(session: &SessionFile, system: System) -> String {
    let title = if session.scenario.title.is_empty() { &session.scenario.id } else { &session.scenario.title };
    let title = harmless(title, TITLE_MAX);
    let number =
        title.strip_suffix(')').and_then(|t| t.rsplit_once('(')).filter(|(_, n)| n.chars().all(|c| c.is_ascii_digit()));
    match (system, number) {
        (System::Canvas, Some((before, number))) => format!("{before}[{number}]"),
        _ => title,
    }
}

/// Sessions come in the order of time; of equally good ones the last counts.
fn taken<'a>(sessions: &[(&'a SessionFile, &'a GradeFile)], take: Take) -> Option<&'a GradeFile> {
    let of = |session: &(&'a SessionFile, &'a GradeFile)| session.1;
    match take {
        Take::First => sessions.first().map(of),
        Take::Last => sessions.last().map(of),
        Take::Best => {
            sessions.iter().map(of).max_by(|a, b| a.passed.cmp(&b.passed).then(a.points.total_cmp(&b.points)))
        }
    }
}

/// A grade in a few words.
fn feedback(grade: &GradeFile) -> String {
    let mut text = if grade.passed { "Passed".to_string() } else { "Not passed".to_string() };
    text += &format!(
        ": {} of {} points, {} to pass.",
        round(grade.points),
        round(grade.max_points),
        round(grade.pass_points)
    );
    if !grade.finished {
        text += " The session was broken off.";
    }
    if !grade.hard_fails.is_empty() {
        text += &format!(" Failed outright: {}.", grade.hard_fails.join("; "));
    }
    for item in &grade.items {
        text += &format!(" {}: {} of {}.", item.title, round(item.points), round(item.max_points));
    }
    harmless(&text, FEEDBACK_MAX)
}

fn round(points: f64) -> f64 {
    (points * 10.0).round() / 10.0
}
