//! Page with the agreement of the examiners with each other and with the computed marks.

use super::app::{RequestContext, ReviewApp};
use super::bundle;
use super::http::Response;
use super::index::IndexedSession;
use super::query::Query;
use super::ratings::{RatingEntry, RatingSnapshot};
use serde::Serialize;
use std::sync::Arc;
use typodont_report::cohort::{AgreementTables, Cohort, ExaminerRating, recording_of};
use typodont_report::name_folding::ExaminerNames;

#[derive(Serialize)]
struct AgreementPage {
    exercises: Vec<AgreementTables>,
    /// Number of rated sessions that are counted, and of those that are left out because their marks are hidden.
    counted: usize,
    hidden: usize,
}

/// Maximum number of sessions that are searched for ratings.
const SESSIONS_MAX: usize = 1_000_000;

/// Renders the page. In blind mode, sessions that the examiner has not rated are left out.
pub fn page(app: &ReviewApp, context: &RequestContext) -> Response {
    let (state, log) = match app.refresh(context) {
        Ok(now) => now,
        Err(response) => return *response,
    };
    let everything = Query { length: SESSIONS_MAX, ..Query::parse(&[]) };
    let listed = state.index.query_sessions(&everything, app.anonymous, None);
    let ratings = Arc::clone(&state.ratings);
    drop(state);
    let Ok((listed, _)) = listed else { return app.index_failure(context) };
    let rated = listed.iter().filter(|session| !ratings.counting(&session.id).is_empty());
    let (shown, hidden): (Vec<_>, Vec<_>) =
        rated.partition(|session| app.may_see_marks(context, &ratings, &session.id));
    let cohort = rated_cohort(app, &shown, &ratings);
    let counted = cohort.sessions.len();
    match app.renderer.agreement_tables(&context.language, &cohort) {
        Ok(exercises) => {
            app.page(context, &log, "agreement.html", AgreementPage { exercises, counted, hidden: hidden.len() })
        }
        Err(why) => Response::plain_error(500, &why).with_log(why.clone()),
    }
}

/// Reads the rated sessions with the ratings that count.
fn rated_cohort(app: &ReviewApp, shown: &[&IndexedSession], ratings: &RatingSnapshot) -> Cohort {
    let mut cohort = Cohort::default();
    let mut names = ExaminerNames::default();
    for indexed in shown {
        let Ok(session) = bundle::read_bundle_session(&app.folder, &indexed.path) else { continue };
        for entry in ratings.counting(&indexed.id) {
            let name = names.first_spelling(&entry.draft.name);
            let about = |item, rating: u8| ExaminerRating {
                participant: session.participant.clone(),
                recording: recording_of(&session).to_string(),
                scenario: Some(session.scenario.id.clone()),
                item,
                rater: name.clone(),
                rating: f64::from(rating),
                scale: entry.draft.scale,
            };
            cohort.ratings.extend(rated_parts(entry).map(|(item, rating)| about(item, rating)));
        }
        cohort.sessions.push((indexed.path.clone(), session));
    }
    cohort.sort();
    cohort
}

/// Returns the rating of the work as a whole (`None`) and those of items, by title and measure.
fn rated_parts(entry: &RatingEntry) -> impl Iterator<Item = (Option<(String, String)>, u8)> {
    let items = entry.draft.items.iter();
    let items = items.map(|rated| (Some((rated.item.title.clone(), rated.item.metric.clone())), rated.rating));
    entry.draft.overall.into_iter().map(|rating| (None, rating)).chain(items)
}
