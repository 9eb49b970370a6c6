//! Pages that list the sessions, and the files that are left out.

use super::app::{RequestContext, ReviewApp, SHOWN_MAX};
use super::effective_grade::FailureReason;
use super::http::Response;
use super::index::IndexedSession;
use super::query::{PAGE_LENGTHS, Query, ResultFilter, SortColumn, VerificationFilter};
use super::ratings::RatingSnapshot;
use super::verification::{ShownVerification, VerificationProgress};
use serde::Serialize;
use std::sync::Arc;
use typodont_report::display_format;
use typodont_report::name_folding::examiner_key;
use typodont_report::sanitize_display;

#[derive(Serialize)]
struct ListPage {
    rows: Vec<SessionListRow>,
    /// Number of sessions on all pages, and numbers of the first and last session on this page, from 1.
    count: usize,
    first: usize,
    last: usize,
    before: Option<String>,
    after: Option<String>,
    columns: Vec<ListColumn>,
    asked: FilterForm,
    exercises: Vec<SelectOption>,
    folders: Vec<SelectOption>,
    results: Vec<SelectOption>,
    overridden: Vec<SelectOption>,
    verifications: Vec<SelectOption>,
    lengths: Vec<SelectOption>,
    /// Addresses that export the same sessions.
    csv: String,
    json: String,
    left_out: usize,
    verification: VerificationProgress,
}

#[derive(Serialize)]
struct SessionListRow {
    id: String,
    exercise: String,
    who: String,
    began: String,
    graded: bool,
    points: String,
    max_points: String,
    passed: bool,
    /// Examiner's points, if anything is overridden.
    examiner: Option<String>,
    stands_passed: bool,
    /// Keys of the reasons for results that are not a pass: `critical`, `unfinished`, `points` or `examiner`.
    reason: &'static str,
    stands_reason: &'static str,
    overrides: usize,
    /// True if the marks are hidden until the examiner has rated the session.
    hidden: bool,
    /// The examiner's own overall rating; empty if there is none.
    rating: String,
    verification: ShownVerification,
}

#[derive(Serialize)]
struct ListColumn {
    name: &'static str,
    /// Address of the list sorted by this column; empty in blind mode for columns of marks.
    link: String,
    /// Value of `aria-sort`; empty if the list is not sorted by this column.
    order: &'static str,
    number: bool,
}

#[derive(Serialize)]
struct SelectOption {
    value: String,
    title: String,
    chosen: bool,
}

/// Current values of the filter form.
#[derive(Serialize)]
struct FilterForm {
    text: String,
    sort: &'static str,
    down: bool,
    is_narrowed: bool,
}

pub fn page(app: &ReviewApp, context: &RequestContext) -> Response {
    let query = app.list_query(context);
    let (state, log) = match app.refresh(context) {
        Ok(now) => now,
        Err(response) => return *response,
    };
    let found = app.query_sessions(&state.index, &query);
    let choices = state.index.filter_options();
    let left_out = state.index.left_out();
    let listed_count = state.index.paths().map_or(0, |paths| paths.len());
    let ratings = Arc::clone(&state.ratings);
    drop(state);
    let (Ok((rows, count)), Ok(choices), Ok(left_out)) = (found, choices, left_out) else {
        return app.index_failure(context);
    };
    let first = (query.page - 1).saturating_mul(query.length);
    let last = first + rows.len();
    let at = |page: usize| href("/", &Query { page, ..query.clone() });
    let everything = unpaged(&query);
    let body = ListPage {
        rows: rows.iter().map(|listed| session_row(app, context, &ratings, listed)).collect(),
        count,
        first: first + 1,
        last,
        before: (query.page > 1).then(|| at(query.page - 1)),
        after: (last < count).then(|| at(query.page + 1)),
        columns: SortColumn::ALL.iter().map(|sort| column(&query, *sort, app.blind)).collect(),
        exercises: exercise_options(&choices.exercises, &query),
        folders: if app.anonymous { Vec::new() } else { folder_options(&choices.folders, &query) },
        results: ResultFilter::ALL.iter().map(|o| select_option(o.name(), query.result == Some(*o))).collect(),
        overridden: vec![
            select_option("yes", query.overridden == Some(true)),
            select_option("no", query.overridden == Some(false)),
        ],
        verifications: VerificationFilter::ALL
            .iter()
            .map(|o| select_option(o.name(), query.verification == Some(*o)))
            .collect(),
        lengths: PAGE_LENGTHS.iter().map(|l| select_option(&l.to_string(), query.length == *l)).collect(),
        csv: href("/sessions.csv", &everything),
        json: href("/sessions.json", &everything),
        left_out: left_out.len(),
        verification: app.verification_progress(listed_count),
        asked: filter_form(&query),
    };
    app.page(context, &log, "list.html", body)
}

/// Returns the exercises offered by the filter, given as id and title.
fn exercise_options(exercises: &[(String, String)], query: &Query) -> Vec<SelectOption> {
    let offered = exercises.iter().filter(|(id, _)| is_plain_text(id));
    let option = |(id, title): &(String, String)| SelectOption {
        value: id.clone(),
        title: sanitize_display(title, SHOWN_MAX),
        chosen: *id == query.exercise,
    };
    offered.map(option).collect()
}

/// Returns the folders offered by the filter; a single folder is not offered.
fn folder_options(folders: &[String], query: &Query) -> Vec<SelectOption> {
    let offered = folders.iter().filter(|folder| folders.len() > 1 && is_plain_text(folder));
    let option = |folder: &String| SelectOption {
        value: folder.clone(),
        title: sanitize_display(folder, SHOWN_MAX),
        chosen: query.folder.as_ref() == Some(folder),
    };
    offered.map(option).collect()
}

fn filter_form(query: &Query) -> FilterForm {
    let unfiltered = Query { sort: SortColumn::Exercise, is_descending: false, ..unpaged(query) };
    FilterForm {
        is_narrowed: Query::parse(&[]) != unfiltered,
        text: sanitize_display(&query.text, 200),
        sort: query.sort.name(),
        down: query.is_descending,
    }
}

/// Returns a query for the same sessions from the first page, with the default page length.
fn unpaged(query: &Query) -> Query {
    Query { page: 1, length: PAGE_LENGTHS[0], ..query.clone() }
}

/// Returns true if `text` can be the value of a form's option unchanged. Sessions with other exercise ids or folders
/// are found by searching.
fn is_plain_text(text: &str) -> bool {
    sanitize_display(text, 200) == text
}

fn session_row(
    app: &ReviewApp,
    context: &RequestContext,
    ratings: &RatingSnapshot,
    indexed: &IndexedSession,
) -> SessionListRow {
    let hidden = !app.may_see_marks(context, ratings, &indexed.id);
    let grade = indexed.grade.as_ref().filter(|_| !hidden);
    let own = examiner_key(&context.login.display_name);
    let own_rating = ratings.counting(&indexed.id).into_iter().find(|entry| examiner_key(&entry.draft.name) == own);
    let judged = grade.filter(|g| g.overrides > 0);
    SessionListRow {
        id: indexed.id.clone(),
        exercise: sanitize_display(&indexed.title, SHOWN_MAX),
        who: app.display_name(indexed),
        began: app.display_start(indexed),
        graded: grade.is_some(),
        points: grade.map_or_else(String::new, |g| display_format::number(g.machine.points)),
        max_points: grade.map_or_else(String::new, |g| display_format::plain_number(g.machine.max_points)),
        passed: grade.is_some_and(|g| g.machine.passed),
        examiner: judged.map(|g| display_format::number(g.points)),
        stands_passed: grade.is_some_and(|g| g.passed),
        reason: grade.map_or("", |g| FailureReason::of(&g.machine, None).key()),
        stands_reason: grade.map_or("", |g| FailureReason::of(&g.machine, (g.overrides > 0).then_some(g.points)).key()),
        overrides: grade.map_or(0, |g| g.overrides),
        verification: ShownVerification::of(&app.verification(indexed)).without_note_if(hidden),
        hidden,
        rating: own_rating.and_then(|entry| entry.draft.overall).map_or_else(String::new, |r| r.to_string()),
    }
}

fn column(query: &Query, sort: SortColumn, blind: bool) -> ListColumn {
    let order = match (query.sort == sort, query.is_descending) {
        (false, _) => "",
        (true, false) => "ascending",
        (true, true) => "descending",
    };
    let link = if blind && sort.shows_marks() { String::new() } else { href("/", &query.sorted_by(sort)) };
    ListColumn { name: sort.name(), link, order, number: sort.is_number() }
}

fn select_option(name: &str, chosen: bool) -> SelectOption {
    SelectOption { value: name.to_string(), title: name.to_string(), chosen }
}

fn href(path: &str, query: &Query) -> String {
    match query.to_query_string() {
        query if query.is_empty() => path.to_string(),
        query => format!("{path}?{query}"),
    }
}

#[derive(Serialize)]
struct LeftOutPage {
    count: usize,
    /// Path and reason of each file; empty in anonymous mode, where names could identify participants.
    files: Vec<(String, String)>,
}

pub fn left_out(app: &ReviewApp, context: &RequestContext) -> Response {
    let (state, log) = match app.refresh(context) {
        Ok(now) => now,
        Err(response) => return *response,
    };
    let files = state.index.left_out();
    drop(state);
    let Ok(files) = files else { return app.index_failure(context) };
    let count = files.len();
    let shown = files.iter().filter(|_| !app.anonymous);
    let files = shown.map(|(path, why)| (sanitize_display(path, 200), sanitize_display(why, 300))).collect();
    app.page(context, &log, "left_out.html", LeftOutPage { count, files })
}
