//! What a result means, in words that every language has.

use super::language::Said;
use super::session_file::{AnswerFile, EvidenceFile, HardFailFile};
use super::words;
use crate::scenario::metric::Argument;
use crate::scenario::{Metric, distal};
use serde_json::Value as Json;

/// A measure's value with its unit: "right" has a word in every language, "95.2 %" is the same in all.
pub fn value(metric: &str, value: Option<f64>) -> Said {
    worded(words::measure(metric, value))
}

/// What a measure is called.
pub fn measure(metric: &Metric) -> Said {
    let title = Said::word(format!("measure.{}", metric.about.name), metric.about.title);
    match &metric.argument {
        None => title,
        Some(Argument::Zone(zone)) => Said::text("measures.zone", &[("title", title), ("zone", Said::plain(zone))]),
        Some(Argument::ToleranceMm(mm)) => {
            Said::text("measures.within", &[("title", title), ("mm", Said::plain(mm.to_string()))])
        }
    }
}

/// How a measure is computed; nothing for one that is none of ours.
pub fn formula(metric: &str) -> Said {
    let about = Metric::parse(metric).map(|m| m.about);
    about.map_or(Said::plain(""), |a| Said::word(format!("formula.{}", a.name), a.formula))
}

/// Where and when a measure arose, on a tooth of this number.
pub fn place(evidence: &EvidenceFile, tooth_fdi: Option<u8>) -> Said {
    let part = |v: f64, positive: &str, negative: &str| {
        let way = if v >= 0.0 { positive } else { negative };
        Said::text(format!("way.{way}"), &[("mm", Said::plain(format!("{:.1}", v.abs())))])
    };
    let [x, y, z] = evidence.place_mm;
    let distal = y * f64::from(tooth_fdi.map_or(1.0, |fdi| distal(fdi).y));
    let place =
        [("x", part(x, "buccal", "lingual")), ("y", part(distal, "distal", "mesial")), ("z", part(z, "up", "down"))];
    let place = Said::text("place.at", &place);
    match evidence.at_s {
        Some(at) => Said::text("place.when", &[("at", Said::plain(words::duration(at))), ("place", place)]),
        None => place,
    }
}

/// From where on something fails an exercise outright.
pub fn limit(fail: &HardFailFile) -> Said {
    match (fail.above, fail.below) {
        (Some(_), _) if fail.metric == "pulp_exposed" => Said::word("limit.it_is", "it is"),
        (Some(limit), _) => Said::text("limit.more", &[("value", value(&fail.metric, Some(limit)))]),
        (_, Some(limit)) => Said::text("limit.less", &[("value", value(&fail.metric, Some(limit)))]),
        _ => Said::plain(""),
    }
}

/// What ended a stage.
pub fn ended_by(what: &str) -> Said {
    match what {
        known @ ("time" | "answer" | "confirmation" | "cleared") => Said::word(format!("ended.{known}"), known),
        other => Said::word("ended.broken_off", other),
    }
}

/// What was answered.
pub fn answer(value: &Json) -> Said {
    match value {
        Json::String(text) => Said::plain(text),
        Json::Bool(yes) => worded(words::yes_no(*yes).into()),
        other => Said::plain(other.to_string()),
    }
}

/// Whether an answer was right; none where nothing is right or wrong.
pub fn judgement(given: &AnswerFile) -> Option<Said> {
    match given.right? {
        true => Some(Said::text("value.right", &[])),
        false => Some(Said::text("answer.wrong", &[("truth", answer(&given.truth))])),
    }
}

fn worded(text: String) -> Said {
    Said::word(format!("value.{text}"), text)
}
