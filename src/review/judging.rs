//! A form that judges: read completely, refused completely, written once.

use super::desk::{Case, Desk, Visit};
use super::exchange::{Response, value};
use super::overrides::{Draft, Entry, ItemRef, Judged, Told, Unwritten};
use crate::report::{GradeFile, Said, harmless};
use std::fmt;

/// Letters of a reason and of a name.
const REASON_MAX: usize = 2000;
const NAME_MAX: usize = 120;

/// Letters of a title that a line of the log repeats for people.
const TITLE_MAX: usize = 200;

/// What a form says.
struct Form {
    /// Of an item by its place, or of the whole grade.
    item: Option<usize>,
    seen: u64,
    reason: String,
    name: String,
}

/// Why it is not written now.
enum Refused {
    /// Somebody else judged in between.
    Overtaken,
    /// The very same stands there already: a second click.
    Said,
    /// There is nothing to withdraw.
    Nothing,
}

/// Gives points of an examiner's own.
pub fn judge(desk: &Desk, visit: &Visit, id: &str) -> Response {
    write(desk, visit, id, |grade, form, item, wrong| {
        let most = item.map_or(grade.max_points, |index| grade.items[index].max_points);
        let points = points(value(form, "points"), most).map_err(|said| wrong.push(said)).ok();
        let passed = match (item, value(form, "passed")) {
            (Some(_), _) => None,
            (None, "yes") => Some(true),
            (None, "no") => Some(false),
            (None, _) => {
                wrong.push(Said::text("complaint.passed", &[]));
                None
            }
        };
        points.map(|points| Judged { points, passed })
    })
}

/// Takes a judgement back: the machine's stands again.
pub fn withdraw(desk: &Desk, visit: &Visit, id: &str) -> Response {
    write(desk, visit, id, |_, _, _, _| None)
}

fn write(
    desk: &Desk,
    visit: &Visit,
    id: &str,
    examiner: impl FnOnce(&GradeFile, &[(String, String)], Option<usize>, &mut Vec<Said>) -> Option<Judged>,
) -> Response {
    let Case { session, listed, .. } = match desk.case(visit, id) {
        Ok(case) => case,
        Err(response) => return *response,
    };
    let Some(grade) = &session.grade else {
        return desk.complain(visit, 422, &[Said::text("complaint.ungraded", &[])]);
    };
    let pairs = visit.request.form();
    let mut wrong = Vec::new();
    let Some(form) = read(&pairs, grade, &mut wrong) else {
        return desk.complain(visit, 422, &[Said::text("complaint.no_item", &[])]);
    };
    let given = examiner(grade, &pairs, form.item, &mut wrong);
    if !wrong.is_empty() {
        return desk.complain(visit, 422, &wrong);
    }
    let machine = match form.item {
        None => Judged { points: grade.points, passed: Some(grade.passed) },
        Some(index) => Judged { points: grade.items[index].points, passed: None },
    };
    let item = form.item.map(|index| ItemRef {
        index,
        metric: grade.items[index].metric.clone(),
        title: harmless(&grade.items[index].title, TITLE_MAX),
    });
    let draft = Draft {
        session: id.to_string(),
        recording: listed.recording.clone(),
        item,
        machine,
        examiner: given,
        reason: form.reason.clone(),
        name: form.name.clone(),
    };
    desk.name_guest(visit, &form.name);
    let anchor = form.item.map_or("grade".to_string(), |index| format!("item-{index}"));
    let done = Response::see(&format!("/session/{id}#{anchor}"));
    match desk.append(visit.request.now, |told| decide(told, draft, form.item, form.seen)) {
        Ok(Entry { number, .. }) => done.telling(format!("judged: line {number} of the log, session {id}")),
        Err(Unwritten::Refused(Refused::Said)) => done,
        Err(Unwritten::Refused(Refused::Overtaken)) => {
            desk.complain(visit, 409, &[Said::text("complaint.overtaken", &[])])
        }
        Err(Unwritten::Refused(Refused::Nothing)) => desk.complain(visit, 409, &[Said::text("complaint.nothing", &[])]),
        Err(Unwritten::Failed(error)) => {
            let why = Said::plain(error.to_string());
            let response = desk.complain(visit, 500, &[Said::text("complaint.unwritten", &[("why", why)])]);
            response.telling(format!("unwritable-log: {error}"))
        }
    }
}

/// What the log takes, having seen what stands there.
fn decide(told: &Told, draft: Draft, item: Option<usize>, seen: u64) -> Result<Draft, Refused> {
    let own = told.lines.iter().filter(|line| line.entry.draft.is_of(&draft.session, item));
    let last = own.map(|line| line.entry.number).max().unwrap_or(0);
    let stands = told.last_of(&draft.session, item);
    if last != seen {
        let is_same = stands.is_some_and(|entry| entry.draft == draft);
        return Err(if is_same { Refused::Said } else { Refused::Overtaken });
    }
    match draft.examiner.is_none() && stands.is_none_or(|entry| entry.draft.examiner.is_none()) {
        true => Err(Refused::Nothing),
        false => Ok(draft),
    }
}

/// What every form says; none where it is about no item.
fn read(pairs: &[(String, String)], grade: &GradeFile, wrong: &mut Vec<Said>) -> Option<Form> {
    let item = match value(pairs, "item") {
        "grade" => None,
        number => Some(number.parse::<usize>().ok().filter(|index| *index < grade.items.len())?),
    };
    let mut text = |name: &str, most: usize| {
        let text = value(pairs, name).replace("\r\n", "\n").trim().to_string();
        let letters = text.chars().count();
        if !text.chars().any(char::is_alphanumeric) {
            wrong.push(Said::text(format!("complaint.no_{name}"), &[]));
        } else if letters > most {
            let numbers = [("letters", number(letters)), ("most", number(most))];
            wrong.push(Said::text(format!("complaint.long_{name}"), &numbers));
        }
        text
    };
    let (reason, name) = (text("reason", REASON_MAX), text("name", NAME_MAX));
    Some(Form { item, seen: value(pairs, "seen").parse().ok()?, reason, name })
}

/// Points from nothing to the most there are; a decimal comma is one.
fn points(text: &str, most: f64) -> Result<f64, Said> {
    let points = text.trim().replace(',', ".").parse::<f64>().ok().filter(|p| p.is_finite());
    match points.map(|p| (p * 1e6).round() / 1e6).filter(|p| (0.0..=most).contains(p)) {
        // Minus nothing is nothing.
        Some(points) => Ok(points + 0.0),
        None => Err(Said::text("complaint.points", &[("most", number(most))])),
    }
}

fn number(value: impl fmt::Display) -> Said {
    Said::plain(value.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_within_their_range() {
        for (text, expected) in [("7.5", 7.5), ("7,5", 7.5), (" 40 ", 40.0), ("0", 0.0), ("-0", 0.0)] {
            assert_eq!(points(text, 40.0), Ok(expected), "{text}");
        }
        for text in ["", "40.1", "-1", "NaN", "inf", "1e99", "seven", "=1+1", "1.000,5"] {
            assert!(points(text, 40.0).is_err(), "{text}");
        }
    }
}
