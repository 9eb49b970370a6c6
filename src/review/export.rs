//! What leaves the desk: the list as a table and as JSON, with everything that was judged.

use super::desk::{Desk, Visit};
use super::exchange::{NOTHING, Response};
use super::index::Listed;
use super::overrides::{Entry, Told};
use super::query::Query;
use crate::report::{csv, harmless};
use serde::Serialize;

/// Version of the JSON file's form.
const VERSION: u32 = 1;

/// Letters of a cell: more than a reason has, less than spreadsheets cut off.
const CELL_MAX: usize = 8000;

/// Sessions of an export: all there are.
const ALL: usize = 1_000_000;

/// A line per session. Of anonymous marking it says codes, and not who.
pub fn csv(desk: &Desk, visit: &Visit) -> Response {
    let (rows, told) = match all(desk, visit) {
        Ok(found) => found,
        Err(response) => return *response,
    };
    let who: &[&str] = if desk.anonymous { &["code"] } else { &["participant", "code"] };
    let head = ["session", "exercise", "title"].iter().chain(who).chain(&[
        "began",
        "machine_points",
        "max_points",
        "pass_points",
        "machine_result",
        "examiner_points",
        "examiner_result",
        "overrides",
        "reasons",
    ]);
    let mut table = csv::line(&head.map(|c| c.to_string()).collect::<Vec<_>>());
    for listed in &rows {
        table += &csv::line(&line(desk, listed, &told));
    }
    file(visit, "sessions.csv", "text/csv; charset=utf-8", table)
}

fn line(desk: &Desk, listed: &Listed, told: &Told) -> Vec<String> {
    let shown = |text: &str| harmless(text, CELL_MAX);
    let mut cells = vec![listed.id.clone(), shown(&listed.exercise), shown(&listed.title)];
    if !desk.anonymous {
        cells.push(shown(&listed.participant));
    }
    cells.extend([listed.code.clone(), desk.began(listed)]);
    let result = |passed: bool| if passed { "passed" } else { "not passed" }.to_string();
    match &listed.grade {
        None => cells.extend(std::iter::repeat_n(String::new(), 8)),
        Some(grade) => {
            let machine = &grade.machine;
            let is_judged = grade.overrides > 0;
            cells.extend([machine.points, machine.max_points, machine.pass_points].map(|p| p.to_string()));
            cells.push(result(machine.passed));
            cells.push(if is_judged { grade.points.to_string() } else { String::new() });
            cells.push(if is_judged { result(grade.passed) } else { String::new() });
            cells.push(grade.overrides.to_string());
            cells.push(shown(&standing_of(listed, told).map(reason).collect::<Vec<_>>().join("; ")));
        }
    }
    cells
}

/// Every judgement of a session that stands now.
fn standing_of<'a>(listed: &'a Listed, told: &'a Told) -> impl Iterator<Item = &'a Entry> {
    let own = told.counting().filter(|entry| entry.draft.session == listed.id && entry.draft.examiner.is_some());
    own.filter(|entry| {
        let item = entry.draft.item.as_ref().map(|item| item.index);
        told.last_of(&listed.id, item).is_some_and(|last| last.number == entry.number)
    })
}

/// "Decay removed: 25 → 30, the wall was sound (Dr. Öz, 2026-11-22)".
fn reason(entry: &Entry) -> String {
    let draft = &entry.draft;
    let of = draft.item.as_ref().map_or("grade", |item| item.title.as_str());
    let examiner = draft.examiner.map_or_else(String::new, |judged| judged.points.to_string());
    let day: String = entry.at.chars().take(10).collect();
    let why = draft.reason.lines().collect::<Vec<_>>().join(" ");
    format!("{of}: {} → {examiner}, {why} ({}, {day})", draft.machine.points, draft.name)
}

#[derive(Serialize)]
struct Export<'a> {
    version: u32,
    typodont_version: &'static str,
    exported: String,
    anonymous: bool,
    log: LogState<'a>,
    sessions: Vec<Session<'a>>,
}

/// How far the log goes: whoever keeps this digest finds out when the log is rewritten.
#[derive(Serialize)]
struct LogState<'a> {
    lines: u64,
    sha256: &'a str,
    troubles: Vec<String>,
}

#[derive(Serialize)]
struct Session<'a> {
    id: &'a str,
    exercise: &'a str,
    title: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    participant: Option<&'a str>,
    #[serde(skip_serializing_if = "str::is_empty")]
    code: &'a str,
    began: String,
    machine: Option<Grade>,
    /// None where nothing was judged.
    examiner: Option<Grade>,
    /// All that was ever judged of it, withdrawn or not, in order.
    history: Vec<&'a Entry>,
}

#[derive(Serialize)]
struct Grade {
    points: f64,
    max_points: f64,
    pass_points: f64,
    passed: bool,
}

pub fn json(desk: &Desk, visit: &Visit) -> Response {
    let (rows, told) = match all(desk, visit) {
        Ok(found) => found,
        Err(response) => return *response,
    };
    let export = Export {
        version: VERSION,
        typodont_version: env!("CARGO_PKG_VERSION"),
        exported: visit.request.now.strftime("%Y-%m-%dT%H:%M:%SZ").to_string(),
        anonymous: desk.anonymous,
        log: LogState {
            lines: told.head.lines,
            sha256: &told.head.sha256,
            troubles: told.troubles.iter().map(ToString::to_string).collect(),
        },
        sessions: rows.iter().map(|listed| session(desk, listed, &told)).collect(),
    };
    // Numbers are finite and keys are texts: writing cannot fail.
    let text = serde_json::to_string_pretty(&export).unwrap_or_default() + "\n";
    file(visit, "sessions.json", "application/json", text)
}

fn session<'a>(desk: &Desk, listed: &'a Listed, told: &'a Told) -> Session<'a> {
    let of = |points: f64, passed: bool, machine: &crate::report::GradeFile| Grade {
        points,
        max_points: machine.max_points,
        pass_points: machine.pass_points,
        passed,
    };
    let grade = listed.grade.as_ref();
    Session {
        id: &listed.id,
        exercise: &listed.exercise,
        title: &listed.title,
        participant: (!desk.anonymous).then_some(listed.participant.as_str()),
        code: &listed.code,
        began: desk.began(listed),
        machine: grade.map(|g| of(g.machine.points, g.machine.passed, &g.machine)),
        examiner: grade.filter(|g| g.overrides > 0).map(|g| of(g.points, g.passed, &g.machine)),
        history: told.counting().filter(|entry| entry.draft.session == listed.id).collect(),
    }
}

fn all(desk: &Desk, visit: &Visit) -> Result<(Vec<Listed>, Told), Box<Response>> {
    let query = Query { page: 1, length: ALL, ..Query::of(&visit.request.asked()) };
    let (state, told) = desk.look_again(visit)?;
    let found = state.index.page(&query, desk.anonymous);
    drop(state);
    match found {
        Ok((rows, _)) => Ok((rows, told)),
        Err(_) => Err(Box::new(desk.lost(visit))),
    }
}

fn file(visit: &Visit, name: &str, kind: &str, text: String) -> Response {
    let day = visit.request.now.strftime("%Y-%m-%d");
    let kept = format!("attachment; filename=\"{day}-{name}\"");
    Response::new(200, kind, NOTHING, text).with("content-disposition", kept)
}
