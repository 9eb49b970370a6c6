//! What examiners judged, line by line, as the log has it.

use super::desk::{Desk, SHOWN_MAX, Visit};
use super::exchange::Response;
use super::overrides::{Judged, Line};
use crate::report::harmless;
use crate::report::words;
use serde::Serialize;

/// A line of the log in words.
#[derive(Serialize)]
pub(super) struct Told {
    pub number: u64,
    pub at: String,
    pub session: String,
    /// The item's title; empty for the whole grade.
    pub item: String,
    pub machine: Given,
    /// None where a judgement was withdrawn.
    pub examiner: Option<Given>,
    pub reason: String,
    pub name: String,
    pub doubtful: bool,
}

#[derive(Serialize)]
pub(super) struct Given {
    pub points: String,
    pub passed: Option<bool>,
}

#[derive(Serialize)]
struct History {
    history: Vec<Named>,
}

/// A line with the session it is about; empty where that is no longer in the folder.
#[derive(Serialize)]
struct Named {
    #[serde(flatten)]
    told: Told,
    exercise: String,
    who: String,
}

/// The last first.
pub fn page(desk: &Desk, visit: &Visit) -> Response {
    let (state, told) = match desk.look_again(visit) {
        Ok(now) => now,
        Err(response) => return *response,
    };
    let named = |told: Told| {
        let listed = state.index.session(&told.session).ok().flatten();
        let exercise = listed.as_ref().map_or_else(String::new, |l| harmless(&l.title, SHOWN_MAX));
        Named { exercise, who: listed.as_ref().map_or_else(String::new, |l| desk.called(l)), told }
    };
    let history: Vec<Named> = of(told.lines.iter()).into_iter().rev().map(named).collect();
    drop(state);
    desk.page(visit, &told, "history.html", History { history })
}

pub(super) fn of<'a>(lines: impl Iterator<Item = &'a Line>) -> Vec<Told> {
    lines.map(told).collect()
}

fn told(line: &Line) -> Told {
    let draft = &line.entry.draft;
    let given = |judged: &Judged| Given { points: words::number(judged.points), passed: judged.passed };
    Told {
        number: line.entry.number,
        at: when(&line.entry.at),
        session: draft.session.clone(),
        item: draft.item.as_ref().map_or_else(String::new, |item| harmless(&item.title, 200)),
        machine: given(&draft.machine),
        examiner: draft.examiner.as_ref().map(given),
        reason: lines(&draft.reason),
        name: harmless(&draft.name, 120),
        doubtful: line.doubtful,
    }
}

/// What was written at length, on its own lines.
pub(super) fn lines(text: &str) -> String {
    text.lines().take(100).map(|line| harmless(line, 2000)).collect::<Vec<_>>().join("\n")
}

/// "2026-11-22 09:05 UTC".
pub(super) fn when(at: &str) -> String {
    let minutes: String = at.chars().take(16).collect();
    harmless(&format!("{} UTC", minutes.replace('T', " ")), 40)
}
