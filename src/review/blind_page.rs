//! Page of a session whose examiner has not rated it yet: the work, and nothing that the scorer or anybody else made
//! of it.
//!
//! The page has a template of its own and is given no measure, mark, correctness of an answer, map, reason for an end,
//! or name. Nothing of these can appear in it by a change to the page of a rated session.

use super::app::{RequestContext, ReviewApp, SHOWN_MAX};
use super::bundle::{self, VIEWS};
use super::http::Response;
use super::index::IndexedSession;
use super::overrides::OverrideSnapshot;
use super::query::Query;
use super::rating_form::{self, RatingFields};
use super::session_page::{MapView, picture_view};
use serde::Serialize;
use std::sync::Arc;
use typodont_report::{SessionFile, display_format, phrases, sanitize_display};

#[derive(Serialize)]
struct BlindPage {
    id: String,
    exercise: String,
    code: String,
    began: String,
    /// Images before and after the session, of each view.
    views: Vec<[Option<MapView>; 2]>,
    stages: Vec<BlindStage>,
    rating: RatingFields,
}

#[derive(Serialize)]
struct BlindStage {
    title: String,
    took: String,
    /// Questions and the trainee's answers.
    answers: Vec<[String; 2]>,
}

pub fn page(
    app: &ReviewApp,
    context: &RequestContext,
    log: &OverrideSnapshot,
    indexed: &IndexedSession,
    session: &SessionFile,
) -> Response {
    let has = |stem: &str| bundle::file_within(&app.folder, &indexed.path, &bundle::picture_path(stem)).is_ok();
    let picture =
        |moment: &str, view: &str| has(&format!("{moment}-{view}")).then(|| picture_view(app, context, moment, view));
    let views = VIEWS.iter().map(|view| ["before", "after"].map(|moment| picture(moment, view)));
    let text = |text: &str| sanitize_display(text, 1000);
    let answer = |answer: &typodont_report::AnswerResultFile| {
        let question = if answer.text.is_empty() { &answer.question } else { &answer.text };
        [text(question), text(&app.translate(context, &phrases::answer(&answer.value)))]
    };
    let stages = session.stages.iter().map(|stage| BlindStage {
        title: text(if stage.title.is_empty() { &stage.id } else { &stage.title }),
        took: display_format::duration(stage.ended_s - stage.started_s),
        answers: stage.answers.iter().map(answer).collect(),
    });
    let body = BlindPage {
        id: indexed.id.clone(),
        exercise: sanitize_display(&indexed.title, 200),
        code: sanitize_display(&indexed.code, SHOWN_MAX),
        began: app.display_start(indexed),
        views: views.filter(|pair| pair.iter().any(Option::is_some)).collect(),
        stages: stages.collect(),
        rating: rating_form::fields(app, context, session.grade.as_ref()),
    };
    app.page(context, log, "blind.html", body)
}

/// Maximum number of sessions that are searched for the next one to rate.
const SEARCHED_MAX: usize = 100_000;

/// Returns the id of the first session in the order of the list that the examiner has not rated.
pub(super) fn next_unrated(app: &ReviewApp, context: &RequestContext) -> Option<String> {
    let state = app.state();
    let ratings = Arc::clone(&state.ratings);
    let all = Query { length: SEARCHED_MAX, ..Query::parse(&[]) };
    let (rows, _) = state.index.query_sessions(&all, app.anonymous, None).ok()?;
    drop(state);
    let unrated = rows.into_iter().find(|listed| !ratings.has_overall(&context.login.display_name, &listed.id));
    unrated.map(|listed| listed.id)
}
