//! Results in words: titles, formulae, places and answers as [`Message`]s, which every language file translates.

use super::display_format;
use super::language::Message;
use super::session_file::{
    AnswerResultFile, ArchJaw, CriticalErrorFile, EvidenceFile, GradeFile, ItemResultFile, SessionFile,
};
use serde_json::Value as Json;
use typodont_exercise::local_text::LocalTexts;
use typodont_exercise::scenario::metric::MetricArgument;
use typodont_exercise::scenario::{Metric, distal};

/// Value of a measure with its unit. A word such as "right" is translated; "95.2 %" is the same in every language.
pub fn value(metric: &str, value: Option<f64>) -> Message {
    value_text(display_format::measure(metric, value))
}

/// A value that an author wrote for a measure, with its unit.
pub fn written(metric: &str, value: f64) -> Message {
    value_text(display_format::written(metric, value))
}

/// Title of a measure, with the id of its zone or its tolerance where it has one.
pub fn measure(metric: &Metric) -> Message {
    measure_of_zone(metric, |_| None)
}

/// The same with the title of its zone, where it is known.
pub fn measure_of_zone(metric: &Metric, zone_title: impl FnOnce(&str) -> Option<Message>) -> Message {
    let title = Message::text_or(format!("measure.{}", metric.info.name), metric.info.title);
    match &metric.argument {
        None => title,
        Some(MetricArgument::Zone(zone)) => {
            let zone = zone_title(zone).unwrap_or_else(|| Message::plain(zone));
            Message::text("measures.zone", &[("title", title), ("zone", zone)])
        }
        Some(MetricArgument::ToleranceMm(mm)) => {
            Message::text("measures.within", &[("title", title), ("mm", Message::plain(mm.to_string()))])
        }
    }
}

/// Title of the measure of a name; the name itself for an unknown measure.
pub fn measure_title(name: &str) -> Message {
    Metric::parse(name).map_or_else(|_| Message::plain(name), |metric| measure(&metric))
}

/// Formula of a measure, in words; empty for an unknown measure.
pub fn formula(metric: &str) -> Message {
    let info = Metric::parse(metric).map(|m| m.info);
    info.map_or(Message::plain(""), |a| Message::text_or(format!("formula.{}", a.name), a.formula))
}

/// Dependence of an item's points on another item of the same grade; empty for an item that counts by itself.
pub fn counts_with(item: &ItemResultFile, grade: Option<&GradeFile>, texts: &LocalTexts) -> Message {
    item.counts_with_share
        .map_or_else(|| Message::plain(""), |share| share_of_other("points.counts_with", item, share, grade, texts))
}

/// Reason for an item's points after an examiner gave a share of its points, 0 to 1, to the item on which it depends.
pub fn followed_share(item: &ItemResultFile, share: f64, grade: Option<&GradeFile>, texts: &LocalTexts) -> Message {
    share_of_other("judge.followed", item, share, grade, texts)
}

fn share_of_other(
    key: &str,
    item: &ItemResultFile,
    share: f64,
    grade: Option<&GradeFile>,
    texts: &LocalTexts,
) -> Message {
    let Some(metric) = &item.counts_with else { return Message::plain("") };
    let other = grade.and_then(|g| g.items.iter().find(|i| i.metric == *metric && i.counts_with.is_none()));
    let title = other.map_or_else(|| measure_title(metric), |other| Message::authored(texts, &other.title));
    let percent = Message::plain(display_format::plain_number((1000.0 * share).round() / 10.0));
    Message::text(key, &[("title", title), ("percent", percent)])
}

/// Place (directions and mm from the crown's centre; in an arch from its midline; on another tooth its number) and time at which a
/// measure arose in a session.
pub fn place(evidence: &EvidenceFile, session: &SessionFile) -> Message {
    let part = |v: f64, positive: &str, negative: &str| {
        let direction = if v >= 0.0 { positive } else { negative };
        Message::text(format!("way.{direction}"), &[("mm", Message::plain(format!("{:.1}", v.abs())))])
    };
    let [x, y, z] = evidence.place_mm;
    let when = |place: Message| match evidence.at_s {
        Some(at) => {
            Message::text("place.when", &[("at", Message::plain(display_format::duration(at))), ("place", place)])
        }
        None => place,
    };
    if let Some(fdi) = evidence.tooth_fdi {
        return when(Message::text("place.tooth", &[("fdi", Message::plain(fdi.to_string()))]));
    }
    let [x, y] = match session.jaw {
        // The patient's left and right.
        Some(ArchJaw::Lower) => [part(x, "front", "back"), part(y, "left", "right")],
        Some(ArchJaw::Upper) => [part(x, "front", "back"), part(y, "right", "left")],
        None => {
            let distal = session.tooth_fdi.map_or(1.0, |fdi| distal(fdi).y);
            [part(x, "buccal", "lingual"), part(y * f64::from(distal), "distal", "mesial")]
        }
    };
    let place = [("x", x), ("y", y), ("z", part(z, "up", "down"))];
    when(Message::text("place.at", &place))
}

/// Name of a view or a section: of the tooth, or of an arch, whose teeth have no sides in common.
pub fn side(view: &str, session: &SessionFile) -> Message {
    let names = match session.jaw {
        None => "side",
        Some(ArchJaw::Upper) => "upper",
        Some(ArchJaw::Lower) => "lower",
    };
    Message::text(format!("{names}.{view}"), &[])
}

/// Limit beyond which a critical error fails the exercise.
pub fn limit(fail: &CriticalErrorFile) -> Message {
    match (fail.above, fail.below) {
        (Some(_), _) if fail.metric == "pulp_exposed" => Message::text_or("limit.it_is", "it is"),
        (Some(limit), _) => Message::text("limit.more", &[("value", value(&fail.metric, Some(limit)))]),
        (_, Some(limit)) => Message::text("limit.less", &[("value", value(&fail.metric, Some(limit)))]),
        _ => Message::plain(""),
    }
}

/// Reason for the end of a stage: time, answer, confirmation or cleared decay; anything else counts as broken off.
pub fn ended_by(what: &str) -> Message {
    match what {
        known @ ("time" | "answer" | "confirmation" | "cleared") => Message::text_or(format!("ended.{known}"), known),
        other => Message::text_or("ended.broken_off", other),
    }
}

/// Answer of the trainee: a text, a number, or yes/no.
pub fn answer(value: &Json) -> Message {
    match value {
        Json::String(text) => Message::plain(text),
        Json::Bool(yes) => value_text(display_format::yes_no(*yes).into()),
        other => Message::plain(other.to_string()),
    }
}

/// Judgement of an answer, with the correct one if it was wrong; `None` if the question has no correct answer.
pub fn correctness(given: &AnswerResultFile) -> Option<Message> {
    match given.right? {
        true => Some(Message::text("value.right", &[])),
        false => Some(Message::text("answer.wrong", &[("truth", answer(&given.truth))])),
    }
}

/// A value as text, whose words such as "right" are translated.
pub fn value_text(text: String) -> Message {
    Message::text_or(format!("value.{text}"), text)
}
