//! Exports of the session list as CSV and JSON, with all overrides.

use super::app::{RequestContext, ReviewApp};
use super::http::{CSP_NONE, Response};
use super::index::IndexedSession;
use super::overrides::{LogSnapshot, OverrideEntry};
use super::query::Query;
use serde::Serialize;
use typodont_report::{csv, sanitize_display};

/// Version of the JSON format.
const VERSION: u32 = 1;

/// Maximum length of a CSV cell, characters: longer than any reason, shorter than the length at which spreadsheets
/// truncate.
const CELL_MAX: usize = 8000;

/// Page length that includes every session.
const ALL_SESSIONS: usize = 1_000_000;

/// Exports one row per session. In anonymous mode, rows contain codes instead of participants.
pub fn csv(app: &ReviewApp, context: &RequestContext) -> Response {
    let (rows, log) = match query_all(app, context) {
        Ok(found) => found,
        Err(response) => return *response,
    };
    let who: &[&str] = if app.anonymous { &["code"] } else { &["participant", "code"] };
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
        "verification",
        "verification_note",
    ]);
    let mut table = csv::format_row(&head.map(|c| c.to_string()).collect::<Vec<_>>());
    for listed in &rows {
        table += &csv::format_row(&line(app, listed, &log));
    }
    download(context, "sessions.csv", "text/csv; charset=utf-8", table)
}

fn line(app: &ReviewApp, indexed: &IndexedSession, log: &LogSnapshot) -> Vec<String> {
    let shown = |text: &str| sanitize_display(text, CELL_MAX);
    let mut cells = vec![indexed.id.clone(), shown(&indexed.exercise), shown(&indexed.title)];
    if !app.anonymous {
        cells.push(shown(&indexed.participant));
    }
    cells.extend([indexed.code.clone(), app.display_start(indexed)]);
    let result = |passed: bool| if passed { "passed" } else { "not passed" }.to_string();
    match &indexed.grade {
        None => cells.extend(std::iter::repeat_n(String::new(), 8)),
        Some(grade) => {
            let machine = &grade.machine;
            let is_judged = grade.overrides > 0;
            cells.extend([machine.points, machine.max_points, machine.pass_points].map(|p| p.to_string()));
            cells.push(result(machine.passed));
            cells.push(if is_judged { grade.points.to_string() } else { String::new() });
            cells.push(if is_judged { result(grade.passed) } else { String::new() });
            cells.push(grade.overrides.to_string());
            cells.push(shown(&effective_overrides(indexed, log).map(reason).collect::<Vec<_>>().join("; ")));
        }
    }
    let status = app.verification(indexed);
    cells.extend([status.name().to_string(), shown(&status.note())]);
    cells
}

/// Returns the overrides of a session that are in effect.
fn effective_overrides<'a>(
    indexed: &'a IndexedSession,
    log: &'a LogSnapshot,
) -> impl Iterator<Item = &'a OverrideEntry> {
    let own = log.valid_entries().filter(|entry| entry.draft.session == indexed.id && entry.draft.examiner.is_some());
    own.filter(|entry| {
        let item = entry.draft.item.as_ref().map(|item| item.index);
        log.latest_for(&indexed.id, item).is_some_and(|last| last.number == entry.number)
    })
}

/// Formats an override: "Caries removed: 25 → 30, the wall was sound (Dr. Öz, 2026-11-22)".
fn reason(entry: &OverrideEntry) -> String {
    let draft = &entry.draft;
    let of = draft.item.as_ref().map_or("grade", |item| item.title.as_str());
    let examiner = draft.examiner.map_or_else(String::new, |judged| judged.points.to_string());
    let day: String = entry.at.chars().take(10).collect();
    let why = draft.reason.lines().collect::<Vec<_>>().join(" ");
    format!("{of}: {} → {examiner}, {why} ({}, {day})", draft.machine.points, draft.name)
}

#[derive(Serialize)]
struct ExportFile<'a> {
    version: u32,
    typodont_version: &'static str,
    exported: String,
    anonymous: bool,
    log: LogState<'a>,
    sessions: Vec<ExportedSession<'a>>,
}

/// Length of the log and digest of its last line. A copy of the digest reveals whether the log is rewritten later.
#[derive(Serialize)]
struct LogState<'a> {
    lines: u64,
    sha256: &'a str,
    troubles: Vec<String>,
}

#[derive(Serialize)]
struct ExportedSession<'a> {
    id: &'a str,
    exercise: &'a str,
    title: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    participant: Option<&'a str>,
    #[serde(skip_serializing_if = "str::is_empty")]
    code: &'a str,
    began: String,
    machine: Option<ExportedGrade>,
    /// `None` without overrides.
    examiner: Option<ExportedGrade>,
    /// `verified`, `not verified` or `differs`.
    verification: &'static str,
    /// Differences from the recording, or the reason for which the result is not verified.
    #[serde(skip_serializing_if = "String::is_empty")]
    verification_note: String,
    /// All overrides of the session ever made, including withdrawn ones, in order.
    history: Vec<&'a OverrideEntry>,
}

#[derive(Serialize)]
struct ExportedGrade {
    points: f64,
    max_points: f64,
    pass_points: f64,
    passed: bool,
}

/// Exports the sessions, their grades and the history of their overrides.
pub fn json(app: &ReviewApp, context: &RequestContext) -> Response {
    let (rows, log) = match query_all(app, context) {
        Ok(found) => found,
        Err(response) => return *response,
    };
    let export = ExportFile {
        version: VERSION,
        typodont_version: env!("CARGO_PKG_VERSION"),
        exported: context.request.now.strftime("%Y-%m-%dT%H:%M:%SZ").to_string(),
        anonymous: app.anonymous,
        log: LogState {
            lines: log.head.lines,
            sha256: &log.head.sha256,
            troubles: log.issues.iter().map(ToString::to_string).collect(),
        },
        sessions: rows.iter().map(|listed| session(app, listed, &log)).collect(),
    };
    // Numbers are finite and keys are strings, so serialization cannot fail.
    let text = serde_json::to_string_pretty(&export).unwrap_or_default() + "\n";
    download(context, "sessions.json", "application/json", text)
}

fn session<'a>(app: &ReviewApp, indexed: &'a IndexedSession, log: &'a LogSnapshot) -> ExportedSession<'a> {
    let of = |points: f64, passed: bool, machine: &typodont_report::GradeFile| ExportedGrade {
        points,
        max_points: machine.max_points,
        pass_points: machine.pass_points,
        passed,
    };
    let grade = indexed.grade.as_ref();
    let status = app.verification(indexed);
    ExportedSession {
        id: &indexed.id,
        exercise: &indexed.exercise,
        title: &indexed.title,
        participant: (!app.anonymous).then_some(indexed.participant.as_str()),
        code: &indexed.code,
        began: app.display_start(indexed),
        machine: grade.map(|g| of(g.machine.points, g.machine.passed, &g.machine)),
        examiner: grade.filter(|g| g.overrides > 0).map(|g| of(g.points, g.passed, &g.machine)),
        verification: status.name(),
        verification_note: status.note(),
        history: log.valid_entries().filter(|entry| entry.draft.session == indexed.id).collect(),
    }
}

fn query_all(app: &ReviewApp, context: &RequestContext) -> Result<(Vec<IndexedSession>, LogSnapshot), Box<Response>> {
    let query = Query { page: 1, length: ALL_SESSIONS, ..Query::parse(&context.request.query_pairs()) };
    let (state, log) = app.refresh(context)?;
    let found = state.index.query_sessions(&query, app.anonymous);
    drop(state);
    match found {
        Ok((rows, _)) => Ok((rows, log)),
        Err(_) => Err(Box::new(app.index_failure(context))),
    }
}

fn download(context: &RequestContext, name: &str, kind: &str, text: String) -> Response {
    let day = context.request.now.strftime("%Y-%m-%d");
    let disposition = format!("attachment; filename=\"{day}-{name}\"");
    Response::new(200, kind, CSP_NONE, text).with_header("content-disposition", disposition)
}
