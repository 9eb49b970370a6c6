//! Forms that override or withdraw: validation with all errors reported at once, and a single append to the log.

use super::app::{LoadedSession, RequestContext, ReviewApp};
use super::chained_log::AppendError;
use super::http::{Response, first_value};
use super::overrides::{GivenPoints, OverrideDraft, OverrideEntry, OverrideSnapshot, RubricItemRef};
use std::fmt;
use typodont_report::{GradeFile, ItemResultFile, Message, sanitize_display};

/// Maximum lengths of a reason and a name, characters.
const REASON_MAX: usize = 2000;
const NAME_MAX: usize = 120;

/// Maximum length of the item title that a log line repeats for readers, characters.
const TITLE_MAX: usize = 200;

/// Validated content of a form.
struct OverrideForm {
    /// Index of the item; `None` for the whole grade.
    item: Option<usize>,
    /// Number of the last log line about this item that the form's page had shown.
    last_seen_line: u64,
    reason: String,
    name: String,
}

/// Reason for which a valid form is not written.
enum Rejection {
    /// Another examiner has overridden the same item since the page was loaded.
    Conflict,
    /// The same override is already in effect, as after a double click.
    Duplicate,
    /// No override is in effect that could be withdrawn.
    NothingToWithdraw,
}

/// Handles a form that overrides an item or the whole grade with the examiner's points.
pub fn override_points(app: &ReviewApp, context: &RequestContext, id: &str) -> Response {
    append_override(app, context, id, |grade, form, item, errors| {
        let most = item.map_or(grade.max_points, |index| grade.items[index].max_points);
        let points = parse_points(first_value(form, "points"), most).map_err(|said| errors.push(said)).ok();
        let passed = match (item, first_value(form, "passed")) {
            (Some(_), _) => None,
            (None, "yes") => Some(true),
            (None, "no") => Some(false),
            (None, _) => {
                errors.push(Message::text("complaint.passed", &[]));
                None
            }
        };
        points.map(|points| GivenPoints { points, passed })
    })
}

/// Handles a form that withdraws an override, so that the scorer's points count again.
pub fn withdraw(app: &ReviewApp, context: &RequestContext, id: &str) -> Response {
    append_override(app, context, id, |_, _, _, _| None)
}

fn append_override(
    app: &ReviewApp,
    context: &RequestContext,
    id: &str,
    examiner: impl FnOnce(&GradeFile, &[(String, String)], Option<usize>, &mut Vec<Message>) -> Option<GivenPoints>,
) -> Response {
    let LoadedSession { session, indexed, ratings, .. } = match app.load_session(context, id) {
        Ok(case) => case,
        Err(response) => return *response,
    };
    if !app.may_see_marks(context, &ratings, id) {
        return app.error_page(context, 403, &[Message::text("complaint.rate_first", &[])]);
    }
    let Some(grade) = &session.grade else {
        return app.error_page(context, 422, &[Message::text("complaint.ungraded", &[])]);
    };
    let pairs = context.request.form_pairs();
    let mut errors = Vec::new();
    let Some(mut form) = parse_form(&pairs, grade, &mut errors) else {
        return app.error_page(context, 422, &[Message::text("complaint.no_item", &[])]);
    };
    if app.blind {
        form.name.clone_from(&context.login.display_name);
    }
    let given = examiner(grade, &pairs, form.item, &mut errors);
    if !errors.is_empty() {
        return app.error_page(context, 422, &errors);
    }
    let item = form.item.map(|index| rubric_item(index, &grade.items[index]));
    let draft = OverrideDraft {
        session: id.to_string(),
        recording: indexed.recording.clone(),
        item,
        machine: machine_points(grade, form.item),
        examiner: given,
        reason: form.reason.clone(),
        name: form.name.clone(),
    };
    app.set_display_name(context, &form.name);
    let anchor = form.item.map_or("grade".to_string(), |index| format!("item-{index}"));
    let done = Response::redirect(&format!("/session/{id}#{anchor}"));
    match app.append_override(context.request.now, |log| check_draft(log, draft, form.item, form.last_seen_line)) {
        Ok(OverrideEntry { number, .. }) => done.with_log(format!("override: line {number} of the log, session {id}")),
        Err(AppendError::Rejected(Rejection::Duplicate)) => done,
        Err(AppendError::Rejected(Rejection::Conflict)) => {
            app.error_page(context, 409, &[Message::text("complaint.overtaken", &[])])
        }
        Err(AppendError::Rejected(Rejection::NothingToWithdraw)) => {
            app.error_page(context, 409, &[Message::text("complaint.nothing", &[])])
        }
        Err(AppendError::Io(error)) => {
            let why = Message::plain(error.to_string());
            let response = app.error_page(context, 500, &[Message::text("complaint.unwritten", &[("why", why)])]);
            response.with_log(format!("unwritable-log: {error}"))
        }
    }
}

/// Returns the scorer's points of an item, or of the whole grade.
fn machine_points(grade: &GradeFile, item: Option<usize>) -> GivenPoints {
    match item {
        None => GivenPoints { points: grade.points, passed: Some(grade.passed) },
        Some(index) => GivenPoints { points: grade.items[index].points, passed: None },
    }
}

/// Returns the reference to an item that a log line contains.
pub(super) fn rubric_item(index: usize, item: &ItemResultFile) -> RubricItemRef {
    RubricItemRef { index, metric: item.metric.clone(), title: sanitize_display(&item.title, TITLE_MAX) }
}

/// Accepts or rejects a draft, given the log's current lines.
fn check_draft(
    log: &OverrideSnapshot,
    draft: OverrideDraft,
    item: Option<usize>,
    last_seen_line: u64,
) -> Result<OverrideDraft, Rejection> {
    let own_lines = log.lines.iter().filter(|line| line.entry.draft.concerns(&draft.session, item));
    let last = own_lines.map(|line| line.entry.number).max().unwrap_or(0);
    let standing_entry = log.latest_for(&draft.session, item);
    if last != last_seen_line {
        let is_same = standing_entry.is_some_and(|entry| entry.draft == draft);
        return Err(if is_same { Rejection::Duplicate } else { Rejection::Conflict });
    }
    match draft.examiner.is_none() && standing_entry.is_none_or(|entry| entry.draft.examiner.is_none()) {
        true => Err(Rejection::NothingToWithdraw),
        false => Ok(draft),
    }
}

/// Parses the fields that all forms have and collects error messages. Returns `None` if the form names no item of the
/// grade.
fn parse_form(pairs: &[(String, String)], grade: &GradeFile, errors: &mut Vec<Message>) -> Option<OverrideForm> {
    let item = match first_value(pairs, "item") {
        "grade" => None,
        number => Some(number.parse::<usize>().ok().filter(|index| *index < grade.items.len())?),
    };
    let reason = parse_text(pairs, "reason", REASON_MAX, errors);
    let name = parse_name(pairs, errors);
    Some(OverrideForm { item, last_seen_line: first_value(pairs, "seen").parse().ok()?, reason, name })
}

/// Parses a required text and collects an error message if it is missing or too long.
fn parse_text(pairs: &[(String, String)], name: &str, most: usize, errors: &mut Vec<Message>) -> String {
    let text = first_value(pairs, name).replace("\r\n", "\n").trim().to_string();
    let letters = text.chars().count();
    if !text.chars().any(char::is_alphanumeric) {
        errors.push(Message::text(format!("complaint.no_{name}"), &[]));
    } else if letters > most {
        let numbers = [("letters", number(letters)), ("most", number(most))];
        errors.push(Message::text(format!("complaint.long_{name}"), &numbers));
    }
    text
}

/// Parses an examiner's name. A name with an error is returned as an empty one.
pub(super) fn parse_name(pairs: &[(String, String)], errors: &mut Vec<Message>) -> String {
    let before = errors.len();
    let name = parse_text(pairs, "name", NAME_MAX, errors);
    if errors.len() == before { name } else { String::new() }
}

/// Parses points from 0 to `most`, with a decimal point or comma.
fn parse_points(text: &str, most: f64) -> Result<f64, Message> {
    let points = text.trim().replace(',', ".").parse::<f64>().ok().filter(|p| p.is_finite());
    match points.map(|p| (p * 1e6).round() / 1e6).filter(|p| (0.0..=most).contains(p)) {
        // Adding 0.0 turns -0.0 into 0.0.
        Some(points) => Ok(points + 0.0),
        None => Err(Message::text("complaint.points", &[("most", number(most))])),
    }
}

fn number(value: impl fmt::Display) -> Message {
    Message::plain(value.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_within_their_range() {
        for (text, expected) in [("7.5", 7.5), ("7,5", 7.5), (" 40 ", 40.0), ("0", 0.0), ("-0", 0.0)] {
            assert_eq!(parse_points(text, 40.0), Ok(expected), "{text}");
        }
        for text in ["", "40.1", "-1", "NaN", "inf", "1e99", "seven", "=1+1", "1.000,5"] {
            assert!(parse_points(text, 40.0).is_err(), "{text}");
        }
    }
}
