//! The list of sessions, and of what is none.

use super::desk::{Desk, SHOWN_MAX, Visit};
use super::exchange::Response;
use super::index::Listed;
use super::query::{LENGTHS, Outcome, Query, Sort};
use crate::report::harmless;
use crate::report::words;
use serde::Serialize;

#[derive(Serialize)]
struct List {
    rows: Vec<Line>,
    /// Sessions on all pages, and which of them are on this one, from 1.
    count: usize,
    first: usize,
    last: usize,
    before: Option<String>,
    after: Option<String>,
    columns: Vec<Column>,
    asked: Asked,
    exercises: Vec<Choice>,
    folders: Vec<Choice>,
    results: Vec<Choice>,
    overridden: Vec<Choice>,
    lengths: Vec<Choice>,
    /// The same sessions as tables.
    csv: String,
    json: String,
    left_out: usize,
}

#[derive(Serialize)]
struct Line {
    id: String,
    exercise: String,
    who: String,
    began: String,
    graded: bool,
    points: String,
    max_points: String,
    passed: bool,
    /// The examiner's, where anything was judged.
    examiner: Option<String>,
    stands_passed: bool,
    overrides: usize,
}

#[derive(Serialize)]
struct Column {
    name: &'static str,
    link: String,
    /// As `aria-sort` says it; empty where the list is not in this order.
    order: &'static str,
    number: bool,
}

#[derive(Serialize)]
struct Choice {
    value: String,
    title: String,
    chosen: bool,
}

/// What the form holds.
#[derive(Serialize)]
struct Asked {
    text: String,
    sort: &'static str,
    down: bool,
    is_narrowed: bool,
}

pub fn page(desk: &Desk, visit: &Visit) -> Response {
    let query = Query::of(&visit.request.asked());
    let (state, told) = match desk.look_again(visit) {
        Ok(now) => now,
        Err(response) => return *response,
    };
    let found = state.index.page(&query, desk.anonymous);
    let choices = state.index.choices();
    let left_out = state.index.left_out();
    drop(state);
    let (Ok((rows, count)), Ok(choices), Ok(left_out)) = (found, choices, left_out) else {
        return desk.lost(visit);
    };
    let first = (query.page - 1).saturating_mul(query.length);
    let last = first + rows.len();
    let at = |page: usize| address("/", &Query { page, ..query.clone() });
    let everything = Query { page: 1, length: LENGTHS[0], ..query.clone() };
    let folders: &[String] = if desk.anonymous { &[] } else { &choices.folders };
    let body = List {
        rows: rows.iter().map(|listed| line(desk, listed)).collect(),
        count,
        first: first + 1,
        last,
        before: (query.page > 1).then(|| at(query.page - 1)),
        after: (last < count).then(|| at(query.page + 1)),
        columns: Sort::ALL.iter().map(|sort| column(&query, *sort)).collect(),
        exercises: choices
            .exercises
            .iter()
            .filter(|(id, _)| is_plain(id))
            .map(|(id, title)| Choice {
                value: id.clone(),
                title: harmless(title, SHOWN_MAX),
                chosen: *id == query.exercise,
            })
            .collect(),
        folders: folders
            .iter()
            .filter(|folder| folders.len() > 1 && is_plain(folder))
            .map(|folder| Choice {
                value: folder.clone(),
                title: harmless(folder, SHOWN_MAX),
                chosen: query.folder.as_ref() == Some(folder),
            })
            .collect(),
        results: Outcome::ALL.iter().map(|o| named(o.name(), query.result == Some(*o))).collect(),
        overridden: vec![named("yes", query.overridden == Some(true)), named("no", query.overridden == Some(false))],
        lengths: LENGTHS.iter().map(|l| named(&l.to_string(), query.length == *l)).collect(),
        csv: address("/sessions.csv", &everything),
        json: address("/sessions.json", &everything),
        left_out: left_out.len(),
        asked: Asked {
            is_narrowed: Query::of(&[]) != Query { sort: Sort::Exercise, down: false, ..everything.clone() },
            text: harmless(&query.text, 200),
            sort: query.sort.name(),
            down: query.down,
        },
    };
    desk.page(visit, &told, "list.html", body)
}

/// What can stand in a form's choice: exercises and folders of ours can; of others a search finds them.
fn is_plain(text: &str) -> bool {
    harmless(text, 200) == text
}

fn line(desk: &Desk, listed: &Listed) -> Line {
    let grade = listed.grade.as_ref();
    let judged = grade.filter(|g| g.overrides > 0);
    Line {
        id: listed.id.clone(),
        exercise: harmless(&listed.title, SHOWN_MAX),
        who: desk.called(listed),
        began: desk.began(listed),
        graded: grade.is_some(),
        points: grade.map_or_else(String::new, |g| words::number(g.machine.points)),
        max_points: grade.map_or_else(String::new, |g| words::plain(g.machine.max_points)),
        passed: grade.is_some_and(|g| g.machine.passed),
        examiner: judged.map(|g| words::number(g.points)),
        stands_passed: grade.is_some_and(|g| g.passed),
        overrides: grade.map_or(0, |g| g.overrides),
    }
}

fn column(query: &Query, sort: Sort) -> Column {
    let order = match (query.sort == sort, query.down) {
        (false, _) => "",
        (true, false) => "ascending",
        (true, true) => "descending",
    };
    Column { name: sort.name(), link: address("/", &query.by(sort)), order, number: sort.is_number() }
}

fn named(name: &str, chosen: bool) -> Choice {
    Choice { value: name.to_string(), title: name.to_string(), chosen }
}

fn address(path: &str, query: &Query) -> String {
    match query.written() {
        query if query.is_empty() => path.to_string(),
        query => format!("{path}?{query}"),
    }
}

#[derive(Serialize)]
struct LeftOut {
    count: usize,
    /// Path and reason; none where they could tell who somebody is.
    files: Vec<(String, String)>,
}

pub fn left_out(desk: &Desk, visit: &Visit) -> Response {
    let (state, told) = match desk.look_again(visit) {
        Ok(now) => now,
        Err(response) => return *response,
    };
    let files = state.index.left_out();
    drop(state);
    let Ok(files) = files else { return desk.lost(visit) };
    let count = files.len();
    let shown = files.iter().filter(|_| !desk.anonymous);
    let files = shown.map(|(path, why)| (harmless(path, 200), harmless(why, 300))).collect();
    desk.page(visit, &told, "left_out.html", LeftOut { count, files })
}
