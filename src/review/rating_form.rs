//! Form that rates a session: its fields, and the append to the log of ratings.

use super::app::{LoadedSession, RequestContext, ReviewApp};
use super::chained_log::AppendError;
use super::history::{format_time, sanitize_lines};
use super::http::{Response, first_value};
use super::override_form::{parse_name, rubric_item};
use super::ratings::{ItemRating, RatingDraft, RatingEntry, RatingSnapshot};
use serde::Serialize;
use typodont_report::name_folding::examiner_key;
use typodont_report::{GradeFile, Message, phrases, sanitize_display};

/// Maximum length of a note, characters.
const NOTE_MAX: usize = 2000;

/// Values of the form's fields, for the templates.
#[derive(Serialize)]
pub(super) struct RatingFields {
    /// Values of the scale, lowest first, each with the key of its meaning; empty where it has none.
    scale: Vec<(u8, &'static str)>,
    items: Vec<RatedItem>,
}

#[derive(Serialize)]
struct RatedItem {
    index: usize,
    title: String,
    formula: String,
}

/// Rating as shown to those who may see it.
#[derive(Serialize)]
pub(super) struct RatingRow {
    name: String,
    at: String,
    blind: bool,
    overall: Option<u8>,
    scale: u8,
    items: Vec<(String, u8)>,
    note: String,
}

/// Returns the form's fields for a session.
pub(super) fn fields(app: &ReviewApp, context: &RequestContext, grade: Option<&GradeFile>) -> RatingFields {
    let meaning = |value: u8| match value {
        1 => "fail",
        2 => "borderline",
        3 => "pass",
        value if value == app.scale => "excellent",
        _ => "",
    };
    let items = grade.iter().flat_map(|grade| grade.items.iter().enumerate());
    RatingFields {
        scale: (1..=app.scale).map(|value| (value, meaning(value))).collect(),
        items: items
            .map(|(index, item)| RatedItem {
                index,
                title: sanitize_display(&item.title, 200),
                formula: app.translate(context, &phrases::formula(&item.metric)),
            })
            .collect(),
    }
}

pub(super) fn row(entry: &RatingEntry) -> RatingRow {
    let draft = &entry.draft;
    RatingRow {
        name: sanitize_display(&draft.name, 120),
        at: format_time(&entry.at),
        blind: draft.blind,
        overall: draft.overall,
        scale: draft.scale,
        items: draft.items.iter().map(|rated| (sanitize_display(&rated.item.title, 200), rated.rating)).collect(),
        note: sanitize_lines(&draft.note),
    }
}

/// Handles the form.
pub fn rate(app: &ReviewApp, context: &RequestContext, id: &str) -> Response {
    let LoadedSession { log, indexed, session, .. } = match app.load_session(context, id) {
        Ok(case) => case,
        Err(response) => return *response,
    };
    let pairs = context.request.form_pairs();
    let mut errors = Vec::new();
    let name = match app.blind {
        true => context.login.display_name.clone(),
        false => parse_name(&pairs, &mut errors),
    };
    let overall = parse_rating(app, first_value(&pairs, "overall"), &mut errors);
    let mut items = Vec::new();
    for (index, item) in session.grade.iter().flat_map(|grade| grade.items.iter().enumerate()) {
        let rating = parse_rating(app, first_value(&pairs, &format!("item-{index}")), &mut errors);
        items.extend(rating.map(|rating| ItemRating { item: rubric_item(index, item), rating }));
    }
    let note = first_value(&pairs, "note").replace("\r\n", "\n").trim().to_string();
    if overall.is_none() && (app.blind || items.is_empty()) && errors.is_empty() {
        errors.push(Message::text("complaint.no_rating", &[]));
    }
    if note.chars().count() > NOTE_MAX {
        let numbers = [("letters", note.chars().count()), ("most", NOTE_MAX)];
        let numbers = numbers.map(|(name, n)| (name, Message::plain(n.to_string())));
        errors.push(Message::text("complaint.long_note", &numbers));
    }
    if !errors.is_empty() {
        return app.error_page(context, 422, &errors);
    }
    app.set_display_name(context, &name);
    // An examiner who has overridden the session, at another desk, has seen its marks.
    let own = examiner_key(&name);
    let has_overridden =
        log.valid_entries().any(|entry| entry.draft.session == id && examiner_key(&entry.draft.name) == own);
    let draft = RatingDraft {
        session: id.to_string(),
        recording: indexed.recording.clone(),
        scale: app.scale,
        overall,
        items,
        blind: app.blind && !has_overridden,
        note,
        name,
    };
    let done = Response::redirect(&format!("/session/{id}#ratings"));
    match app.append_rating(context.request.now, |log| complete_draft(log, draft)) {
        Ok(RatingEntry { number, .. }) => {
            done.with_log(format!("rating: line {number} of the log of ratings, session {id}"))
        }
        Err(AppendError::Rejected(Duplicate)) => done,
        Err(AppendError::Io(error)) => {
            let why = Message::plain(error.to_string());
            let response = app.error_page(context, 500, &[Message::text("complaint.unwritten", &[("why", why)])]);
            response.with_log(format!("unwritable-log: {error}"))
        }
    }
}

/// The same rating is already the examiner's latest, as after a double click.
struct Duplicate;

/// Completes a draft, given the log's current lines: only the first rating of a session can be blind.
fn complete_draft(log: &RatingSnapshot, draft: RatingDraft) -> Result<RatingDraft, Duplicate> {
    let key = examiner_key(&draft.name);
    let own = |entry: &&RatingEntry| entry.draft.session == draft.session && examiner_key(&entry.draft.name) == key;
    let latest = log.valid_entries().filter(own).last();
    // Only the first rating of an examiner is entered before the marks are shown.
    let is_same = |entry: &RatingEntry| RatingDraft { blind: draft.blind, ..entry.draft.clone() } == draft;
    match latest {
        Some(entry) if is_same(entry) => Err(Duplicate),
        latest => Ok(RatingDraft { blind: draft.blind && latest.is_none(), ..draft }),
    }
}

/// Parses a value of the scale; none for an empty text.
fn parse_rating(app: &ReviewApp, text: &str, errors: &mut Vec<Message>) -> Option<u8> {
    match text.trim() {
        "" => None,
        text => match text.parse::<u8>().ok().filter(|value| (1..=app.scale).contains(value)) {
            Some(value) => Some(value),
            None => {
                let complaint = Message::text("complaint.rating", &[("most", Message::plain(app.scale.to_string()))]);
                if !errors.contains(&complaint) {
                    errors.push(complaint);
                }
                None
            }
        },
    }
}
