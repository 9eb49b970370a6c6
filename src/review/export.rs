//! Exports of the session list as CSV and JSON, with all overrides.

use super::app::{RequestContext, ReviewApp};
use super::http::{CSP_NONE, Response};
use super::index::IndexedSession;
use super::overrides::{OverrideEntry, OverrideSnapshot};
use super::query::Query;
use super::ratings::{ItemRating, RatingEntry};
use serde::Serialize;
use std::sync::Arc;
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
    let ratings = Arc::clone(&app.state().ratings);
    for listed in &rows {
        let may_see = app.may_see_marks(context, &ratings, &listed.id);
        table += &csv::format_row(&line(app, listed, &log, may_see));
    }
    download(context, "sessions.csv", "text/csv; charset=utf-8", table)
}

/// Returns a session's cells; those of marks are empty where the examiner may not see them.
fn line(app: &ReviewApp, indexed: &IndexedSession, log: &OverrideSnapshot, may_see: bool) -> Vec<String> {
    let shown = |text: &str| sanitize_display(text, CELL_MAX);
    let mut cells = vec![indexed.id.clone(), shown(&indexed.exercise), shown(&indexed.title)];
    if !app.anonymous {
        cells.push(shown(&indexed.participant));
    }
    cells.extend([indexed.code.clone(), app.display_start(indexed)]);
    let result = |passed: bool| if passed { "passed" } else { "not passed" }.to_string();
    match indexed.grade.as_ref().filter(|_| may_see) {
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
    // What differs is told with its numbers.
    let note = if may_see { shown(&status.note()) } else { String::new() };
    cells.extend([status.name().to_string(), note]);
    cells
}

/// Returns the overrides of a session that are in effect.
fn effective_overrides<'a>(
    indexed: &'a IndexedSession,
    log: &'a OverrideSnapshot,
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
    /// True if marks and judgements are left out until the examiner has rated the session.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    hidden: bool,
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
    let ratings = Arc::clone(&app.state().ratings);
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
        sessions: rows
            .iter()
            .map(|listed| session(app, listed, &log, app.may_see_marks(context, &ratings, &listed.id)))
            .collect(),
    };
    // Numbers are finite and keys are strings, so serialization cannot fail.
    let text = serde_json::to_string_pretty(&export).unwrap_or_default() + "\n";
    download(context, "sessions.json", "application/json", text)
}

fn session<'a>(
    app: &ReviewApp,
    indexed: &'a IndexedSession,
    log: &'a OverrideSnapshot,
    may_see: bool,
) -> ExportedSession<'a> {
    let of = |points: f64, passed: bool, machine: &typodont_report::GradeFile| ExportedGrade {
        points,
        max_points: machine.max_points,
        pass_points: machine.pass_points,
        passed,
    };
    let grade = indexed.grade.as_ref().filter(|_| may_see);
    let status = app.verification(indexed);
    ExportedSession {
        hidden: !may_see,
        id: &indexed.id,
        exercise: &indexed.exercise,
        title: &indexed.title,
        participant: (!app.anonymous).then_some(indexed.participant.as_str()),
        code: &indexed.code,
        began: app.display_start(indexed),
        machine: grade.map(|g| of(g.machine.points, g.machine.passed, &g.machine)),
        examiner: grade.filter(|g| g.overrides > 0).map(|g| of(g.points, g.passed, &g.machine)),
        verification: status.name(),
        // What differs is told with its numbers.
        verification_note: if may_see { status.note() } else { String::new() },
        history: log.valid_entries().filter(|entry| may_see && entry.draft.session == indexed.id).collect(),
    }
}

/// Exports the ratings that count, one row per examiner, session and rated item, as `typodont cohort --ratings` reads
/// them. An empty item stands for the work as a whole.
pub fn ratings_csv(app: &ReviewApp, context: &RequestContext) -> Response {
    let (rows, _) = match query_all(app, context) {
        Ok(found) => found,
        Err(response) => return *response,
    };
    let ratings = Arc::clone(&app.state().ratings);
    let who: &[&str] = if app.anonymous { &["code"] } else { &["participant", "code"] };
    let head = ["session", "recording", "scenario"]
        .iter()
        .chain(who)
        .chain(&["rater", "item", "metric", "rating", "scale", "blind", "at", "note"]);
    let mut table = csv::format_row(&head.map(|c| c.to_string()).collect::<Vec<_>>());
    let shown = |text: &str| sanitize_display(text, CELL_MAX);
    for listed in rows.iter().filter(|listed| app.may_see_marks(context, &ratings, &listed.id)) {
        for entry in ratings.counting(&listed.id) {
            let draft = &entry.draft;
            let mut row = |title: &str, metric: &str, rating: u8| {
                let mut cells = vec![listed.id.clone(), shown(&draft.recording), shown(&listed.exercise)];
                if !app.anonymous {
                    cells.push(shown(&listed.participant));
                }
                let blind = if draft.blind { "yes" } else { "no" };
                cells.extend([listed.code.clone(), shown(&draft.name), shown(title), shown(metric)]);
                cells.extend([rating.to_string(), draft.scale.to_string(), blind.into(), shown(&entry.at)]);
                cells.push(shown(&draft.note.lines().collect::<Vec<_>>().join(" ")));
                table += &csv::format_row(&cells);
            };
            draft.overall.into_iter().for_each(|rating| row("", "", rating));
            for ItemRating { item, rating } in &draft.items {
                row(&item.title, &item.metric, *rating);
            }
        }
    }
    download(context, "ratings.csv", "text/csv; charset=utf-8", table)
}

#[derive(Serialize)]
struct RatingsFile<'a> {
    version: u32,
    typodont_version: &'static str,
    exported: String,
    log: LogState<'a>,
    /// All lines about sessions whose marks the examiner may see, in order, including those that do not count.
    ratings: Vec<&'a RatingEntry>,
}

/// Exports the history of all ratings.
pub fn ratings_json(app: &ReviewApp, context: &RequestContext) -> Response {
    let (rows, _) = match query_all(app, context) {
        Ok(found) => found,
        Err(response) => return *response,
    };
    let ratings = Arc::clone(&app.state().ratings);
    let may_see = |id: &str| rows.iter().any(|listed| listed.id == id) && app.may_see_marks(context, &ratings, id);
    let export = RatingsFile {
        version: VERSION,
        typodont_version: env!("CARGO_PKG_VERSION"),
        exported: context.request.now.strftime("%Y-%m-%dT%H:%M:%SZ").to_string(),
        log: LogState {
            lines: ratings.head.lines,
            sha256: &ratings.head.sha256,
            troubles: ratings.issues.iter().map(ToString::to_string).collect(),
        },
        ratings: ratings.valid_entries().filter(|entry| may_see(&entry.draft.session)).collect(),
    };
    // Numbers are finite and keys are strings, so serialization cannot fail.
    let text = serde_json::to_string_pretty(&export).unwrap_or_default() + "\n";
    download(context, "ratings.json", "application/json", text)
}

fn query_all(
    app: &ReviewApp,
    context: &RequestContext,
) -> Result<(Vec<IndexedSession>, OverrideSnapshot), Box<Response>> {
    let query = Query { page: 1, length: ALL_SESSIONS, ..app.list_query(context) };
    let (state, log) = app.refresh(context)?;
    let found = app.query_sessions(&state.index, &query);
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
