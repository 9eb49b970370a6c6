//! The format of new values, which follows that of the surrounding text.

use serde_json::{Map, Value};

/// Maximum length of a new line, characters, as in the shipped exercises.
const MAX_LINE: usize = 120;

/// Keys in their usual order; keys that are not listed come last.
const KEY_ORDER: &[&str] = &[
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
    "pictures",
    "instruments",
    "zones",
    "instruction",
    "time_limit_s",
    "cutting",
    "show_decay",
    "shows_controls",
    "adjustable",
    "draw",
    "one_of",
    "trials",
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
    "counts_with",
    "when",
    "near_mm",
    "leeway_mm",
    "tolerance_mm",
    "pass_points",
    "items",
    "hard_fails",
    "measures",
    "place",
    "force_n",
    "speed_mm_s",
    "response",
    "warning_force_n",
    "cry_force_n",
    "warning_speed_mm_s",
    "cry_speed_mm_s",
    "near",
    "limits",
    "rubric",
    "questionnaire",
    "questionnaire_time",
];

/// Returns the position of a key among the others of its object.
pub(super) fn key_order(key: &str) -> usize {
    KEY_ORDER.iter().position(|known| *known == key).unwrap_or(KEY_ORDER.len())
}

/// Line breaks and indentation of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct LineStyle {
    pub newline: &'static str,
    /// Number of spaces by which an inner line is indented.
    pub indent_step: usize,
}

impl LineStyle {
    /// Returns the style of a text; two spaces, as in the shipped exercises, if the text has no indentation.
    pub fn detect(text: &str) -> LineStyle {
        let newline = if text.contains("\r\n") { "\r\n" } else { "\n" };
        let indented = text.lines().skip(1).find(|line| !line.trim().is_empty());
        let indent_step = indented.map_or(0, |line| line.len() - line.trim_start_matches(' ').len());
        LineStyle { newline, indent_step: if indent_step == 0 { 2 } else { indent_step } }
    }
}

/// Formats a value. `indent` is the indentation of its first line, in spaces; further lines are indented relative to
/// it.
pub(super) fn format_value(value: &Value, indent: usize, style: LineStyle) -> String {
    let line = format_inline(value);
    if !has_nested_list(value) && indent + line.chars().count() <= MAX_LINE {
        return line;
    }
    let inner = indent + style.indent_step;
    let around = |open: char, lines: Vec<String>, close: char| {
        let margin = format!("{}{}", style.newline, " ".repeat(inner));
        let body = lines.join(&format!(",{margin}"));
        format!("{open}{margin}{body}{}{}{close}", style.newline, " ".repeat(indent))
    };
    match value {
        Value::Array(list) if list.iter().any(is_container) => {
            around('[', list.iter().map(|v| format_value(v, inner, style)).collect(), ']')
        }
        Value::Object(map) => {
            let line = |(key, v): (&String, &Value)| format!("{}: {}", quote(key), format_value(v, inner, style));
            around('{', sorted_entries(map).into_iter().map(line).collect(), '}')
        }
        _ => line,
    }
}

fn is_container(value: &Value) -> bool {
    matches!(value, Value::Object(_) | Value::Array(_))
}

/// Returns true if a value contains a list of objects, which is never written on one line.
fn has_nested_list(value: &Value) -> bool {
    match value {
        Value::Array(list) => list.iter().any(is_container),
        Value::Object(map) => map.values().any(has_nested_list),
        _ => false,
    }
}

fn format_inline(value: &Value) -> String {
    match value {
        Value::Array(list) => format!("[{}]", list.iter().map(format_inline).collect::<Vec<_>>().join(", ")),
        Value::Object(map) if map.is_empty() => "{}".into(),
        Value::Object(map) => {
            let inner: Vec<String> = sorted_entries(map)
                .into_iter()
                .map(|(key, v)| format!("{}: {}", quote(key), format_inline(v)))
                .collect();
            format!("{{ {} }}", inner.join(", "))
        }
        Value::Number(number) => match number.as_f64() {
            // 2.0 is written as 2, which is shorter and the same number.
            Some(v) if number.is_f64() && v.fract() == 0.0 && v.abs() < 1e15 => format!("{}", v as i64),
            _ => number.to_string(),
        },
        Value::String(text) => quote(text),
        Value::Bool(_) | Value::Null => value.to_string(),
    }
}

fn sorted_entries(map: &Map<String, Value>) -> Vec<(&String, &Value)> {
    let mut all: Vec<_> = map.iter().collect();
    all.sort_by_key(|(key, _)| key_order(key));
    all
}

/// Returns a text as a JSON string.
pub(super) fn quote(text: &str) -> String {
    Value::String(text.into()).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn short_things_take_a_line_and_lists_of_things_a_line_each() {
        let breaks = LineStyle { newline: "\n", indent_step: 2 };
        let decay = json!({ "shape": { "sphere": { "radius_mm": 1.5 } }, "id": "a", "depth_mm": 2.0 });
        assert_eq!(
            format_value(&decay, 4, breaks),
            r#"{ "id": "a", "shape": { "sphere": { "radius_mm": 1.5 } }, "depth_mm": 2 }"#
        );
        let list = json!([{ "id": "a" }, { "id": "b" }]);
        assert_eq!(format_value(&list, 2, breaks), "[\n    { \"id\": \"a\" },\n    { \"id\": \"b\" }\n  ]");
        assert_eq!(format_value(&json!(["a", 1]), 2, breaks), "[\"a\", 1]");
    }
}
