//! Page that lists all lines of the override log.

use super::app::{RequestContext, ReviewApp, SHOWN_MAX};
use super::chained_log::LogLine;
use super::http::Response;
use super::overrides::{GivenPoints, OverrideDraft};
use serde::Serialize;
use typodont_report::display_format;
use typodont_report::sanitize_display;

/// Displayed line of the log.
#[derive(Serialize)]
pub(super) struct HistoryRow {
    pub number: u64,
    pub at: String,
    pub session: String,
    /// Title of the item; empty for the whole grade.
    pub item: String,
    pub machine: HistoryPoints,
    /// `None` where the line withdraws an override.
    pub examiner: Option<HistoryPoints>,
    pub reason: String,
    pub name: String,
    pub doubtful: bool,
}

#[derive(Serialize)]
pub(super) struct HistoryPoints {
    pub points: String,
    pub passed: Option<bool>,
}

#[derive(Serialize)]
struct HistoryPage {
    history: Vec<HistoryEntry>,
}

/// Line of the log with the exercise and participant of its session, both empty if the session is no longer in the
/// folder.
#[derive(Serialize)]
struct HistoryEntry {
    #[serde(flatten)]
    told: HistoryRow,
    exercise: String,
    who: String,
}

/// Renders the page, with the latest line first.
pub fn page(app: &ReviewApp, context: &RequestContext) -> Response {
    let (state, log) = match app.refresh(context) {
        Ok(now) => now,
        Err(response) => return *response,
    };
    let named = |row: HistoryRow| {
        let listed = state.index.session(&row.session).ok().flatten();
        let exercise = listed.as_ref().map_or_else(String::new, |l| sanitize_display(&l.title, SHOWN_MAX));
        HistoryEntry { exercise, who: listed.as_ref().map_or_else(String::new, |l| app.display_name(l)), told: row }
    };
    // In blind mode a line about a session that the examiner has not rated would tell what others think of it.
    let shown = log.lines.iter().filter(|line| app.may_see_marks(context, &state.ratings, &line.entry.draft.session));
    let history: Vec<HistoryEntry> = rows(shown).into_iter().rev().map(named).collect();
    drop(state);
    app.page(context, &log, "history.html", HistoryPage { history })
}

pub(super) fn rows<'a>(lines: impl Iterator<Item = &'a LogLine<OverrideDraft>>) -> Vec<HistoryRow> {
    lines.map(history_row).collect()
}

fn history_row(line: &LogLine<OverrideDraft>) -> HistoryRow {
    let draft = &line.entry.draft;
    let points =
        |judged: &GivenPoints| HistoryPoints { points: display_format::number(judged.points), passed: judged.passed };
    HistoryRow {
        number: line.entry.number,
        at: format_time(&line.entry.at),
        session: draft.session.clone(),
        item: draft.item.as_ref().map_or_else(String::new, |item| sanitize_display(&item.title, 200)),
        machine: points(&draft.machine),
        examiner: draft.examiner.as_ref().map(points),
        reason: sanitize_lines(&draft.reason),
        name: sanitize_display(&draft.name, 120),
        doubtful: line.is_invalid,
    }
}

/// Sanitizes a longer text and keeps its line breaks.
pub(super) fn sanitize_lines(text: &str) -> String {
    text.lines().take(100).map(|line| sanitize_display(line, 2000)).collect::<Vec<_>>().join("\n")
}

/// Formats an RFC 3339 timestamp as "2026-11-22 09:05 UTC".
pub(super) fn format_time(at: &str) -> String {
    let minutes: String = at.chars().take(16).collect();
    sanitize_display(&format!("{} UTC", minutes.replace('T', " ")), 40)
}
