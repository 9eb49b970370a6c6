//! How new values are written, so that they read as those around them.

use serde_json::{Map, Value};

/// Longest line that is made, letters: as the shipped exercises have it.
const LINE: usize = 120;

/// Keys in the order in which a person expects them; those that are not listed come last.
const ORDER: &[&str] = &[
    "$schema",
    "id",
    "title",
    "summary",
    "text",
    "scene",
    "tooth",
    "left",
    "right",
    "gap_mm",
    "fdi",
    "name",
    "form",
    "mesh",
    "file",
    "tissue",
    "shape",
    "surface",
    "at",
    "depth_mm",
    "rim",
    "reaches",
    "length_mm",
    "width_mm",
    "height_mm",
    "spread_mm",
    "decay",
    "stains",
    "around",
    "role",
    "region",
    "tissues",
    "new_tissues",
    "stiffness_ratio",
    "patient",
    "carving",
    "vibration",
    "operating_field",
    "instruments",
    "zones",
    "instruction",
    "time_limit_s",
    "cutting",
    "show_decay",
    "adjustable",
    "stiffness_steps",
    "guidance",
    "ask",
    "answer",
    "ends_when",
    "stages",
    "metric",
    "points",
    "full_at",
    "zero_at",
    "when",
    "near_mm",
    "leeway_mm",
    "tolerance_mm",
    "pass_points",
    "items",
    "hard_fails",
    "measures",
    "rubric",
    "questionnaire",
];

/// Where a key stands among others of its object.
pub(super) fn place_of(key: &str) -> usize {
    ORDER.iter().position(|known| *known == key).unwrap_or(ORDER.len())
}

/// A file's own way of breaking lines.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Breaks {
    pub newline: &'static str,
    /// Spaces by which an inner line stands further in.
    pub step: usize,
}

impl Breaks {
    /// As a text has them; the shipped exercises' way where it has none.
    pub fn of(text: &str) -> Breaks {
        let newline = if text.contains("\r\n") { "\r\n" } else { "\n" };
        let indented = text.lines().skip(1).find(|line| !line.trim().is_empty());
        let step = indented.map_or(0, |line| line.len() - line.trim_start_matches(' ').len());
        Breaks { newline, step: if step == 0 { 2 } else { step } }
    }
}

/// A value as text. `indent`: what its first line begins with, in spaces; further lines stand in from there.
pub(super) fn written(value: &Value, indent: usize, breaks: Breaks) -> String {
    let line = in_line(value);
    if !has_list_of_things(value) && indent + line.chars().count() <= LINE {
        return line;
    }
    let inner = indent + breaks.step;
    let around = |open: char, lines: Vec<String>, close: char| {
        let margin = format!("{}{}", breaks.newline, " ".repeat(inner));
        let body = lines.join(&format!(",{margin}"));
        format!("{open}{margin}{body}{}{}{close}", breaks.newline, " ".repeat(indent))
    };
    match value {
        Value::Array(list) if list.iter().any(is_thing) => {
            around('[', list.iter().map(|v| written(v, inner, breaks)).collect(), ']')
        }
        Value::Object(map) => {
            let line = |(key, v): (&String, &Value)| format!("{}: {}", quoted(key), written(v, inner, breaks));
            around('{', sorted(map).into_iter().map(line).collect(), '}')
        }
        _ => line,
    }
}

fn is_thing(value: &Value) -> bool {
    matches!(value, Value::Object(_) | Value::Array(_))
}

/// True where a list of objects stands within, which is never squeezed into a line.
fn has_list_of_things(value: &Value) -> bool {
    match value {
        Value::Array(list) => list.iter().any(is_thing),
        Value::Object(map) => map.values().any(has_list_of_things),
        _ => false,
    }
}

fn in_line(value: &Value) -> String {
    match value {
        Value::Array(list) => format!("[{}]", list.iter().map(in_line).collect::<Vec<_>>().join(", ")),
        Value::Object(map) if map.is_empty() => "{}".into(),
        Value::Object(map) => {
            let inner: Vec<String> =
                sorted(map).into_iter().map(|(key, v)| format!("{}: {}", quoted(key), in_line(v))).collect();
            format!("{{ {} }}", inner.join(", "))
        }
        Value::Number(number) => match number.as_f64() {
            // 2.0 is written 2: shorter, and the same number.
            Some(v) if number.is_f64() && v.fract() == 0.0 && v.abs() < 1e15 => format!("{}", v as i64),
            _ => number.to_string(),
        },
        Value::String(text) => quoted(text),
        Value::Bool(_) | Value::Null => value.to_string(),
    }
}

fn sorted(map: &Map<String, Value>) -> Vec<(&String, &Value)> {
    let mut all: Vec<_> = map.iter().collect();
    all.sort_by_key(|(key, _)| place_of(key));
    all
}

/// A text in quotes.
pub(super) fn quoted(text: &str) -> String {
    Value::String(text.into()).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn short_things_take_a_line_and_lists_of_things_a_line_each() {
        let breaks = Breaks { newline: "\n", step: 2 };
        let decay = json!({ "shape": { "sphere": { "radius_mm": 1.5 } }, "id": "a", "depth_mm": 2.0 });
        assert_eq!(
            written(&decay, 4, breaks),
            r#"{ "id": "a", "shape": { "sphere": { "radius_mm": 1.5 } }, "depth_mm": 2 }"#
        );
        let list = json!([{ "id": "a" }, { "id": "b" }]);
        assert_eq!(written(&list, 2, breaks), "[\n    { \"id\": \"a\" },\n    { \"id\": \"b\" }\n  ]");
        assert_eq!(written(&json!(["a", 1]), 2, breaks), "[\"a\", 1]");
    }
}
