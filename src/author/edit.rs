//! Single changes to a JSON text, which leave all other bytes unchanged.
//!
//! Comments, the order of keys and line breaks are preserved, since only the bytes of the changed value are replaced.
//! Added values are formatted like their neighbours.

use super::json_format::{LineStyle, format_value, key_order, quote};
use jsonc_parser::ast::{Array, Object, ObjectProp, Value};
use jsonc_parser::common::Ranged;
use jsonc_parser::{CollectOptions, ParseOptions, parse_to_ast};
use serde_json::Value as Json;
use std::fmt;
use std::ops::Range;
use typodont_formats::json::strict_parse_options;
use typodont_formats::pointer::{child, split, tokens};

/// Reason for which a change cannot be applied to a text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum EditError {
    /// The text is not JSON and must first be corrected by hand.
    NotJson,
    /// There is no value of the required kind at this pointer.
    NoSuchPlace(String),
}

impl fmt::Display for EditError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            EditError::NotJson => f.write_str("the text is not valid JSON; correct it in the text view first"),
            EditError::NoSuchPlace(pointer) => write!(f, "there is no value to change at {pointer}"),
        }
    }
}

impl std::error::Error for EditError {}

/// Returns the pointer to the innermost value that contains a byte of the text; `None` if the text is not JSON.
pub fn pointer_at(text: &str, byte: usize) -> Option<String> {
    fn within(value: &Value, byte: usize, pointer: String) -> String {
        let has = |range: Range<usize>| range.contains(&byte);
        match value {
            Value::Object(object) => match object.properties.iter().find(|p| has(byte_range(*p))) {
                Some(property) => within(&property.value, byte, child(&pointer, key_of(property))),
                None => pointer,
            },
            Value::Array(array) => match array.elements.iter().position(|e| has(byte_range(e))) {
                Some(index) => within(&array.elements[index], byte, child(&pointer, index)),
                None => pointer,
            },
            _ => pointer,
        }
    }
    Some(within(&parse(text).ok()?, byte, String::new()))
}

/// Returns the value of a text, without comments; `None` if the text is not JSON.
pub(super) fn parse_value(text: &str) -> Option<Json> {
    Some(to_json(&parse(text).ok()?))
}

/// Returns the text with another value at a pointer. A missing key is added at its usual position, with the objects
/// around it; an equal value changes nothing, regardless of its notation.
///
/// # Errors
/// Returns an error if the text is not JSON, or if there is no place for the value.
pub(super) fn set(text: &str, pointer: &str, value: &Json) -> Result<String, EditError> {
    let root = parse(text)?;
    if let Some(old) = find(&root, pointer) {
        if is_equal(&to_json(old), value) {
            return Ok(text.to_string());
        }
        let range = byte_range(old);
        let new = format_value(value, line_indent(text, range.start), LineStyle::detect(text));
        return Ok(splice(text, range, &new));
    }
    let (parent, key) = split(pointer).ok_or_else(|| EditError::NoSuchPlace(pointer.into()))?;
    match find(&root, parent) {
        Some(Value::Object(object)) => Ok(insert_key(text, object, &key, value)),
        Some(_) => Err(EditError::NoSuchPlace(pointer.into())),
        None => set(text, parent, &Json::Object([(key, value.clone())].into_iter().collect())),
    }
}

/// Returns the text without a key or an entry of a list. A missing one changes nothing.
///
/// # Errors
/// Returns an error if the text is not JSON, or if the pointer is that of the whole text.
pub(super) fn remove(text: &str, pointer: &str) -> Result<String, EditError> {
    let root = parse(text)?;
    let (parent, key) = split(pointer).ok_or_else(|| EditError::NoSuchPlace(pointer.into()))?;
    let (parts, at, inside) = match find(&root, parent) {
        Some(Value::Object(object)) => {
            let at = object.properties.iter().position(|p| key_of(p) == key);
            (object.properties.iter().map(byte_range).collect::<Vec<_>>(), at, byte_range(object))
        }
        Some(Value::Array(array)) => {
            (array.elements.iter().map(byte_range).collect(), key.parse().ok(), byte_range(array))
        }
        _ => return Ok(text.to_string()),
    };
    let Some(at) = at.filter(|&at| at < parts.len()) else { return Ok(text.to_string()) };
    let gap = match at {
        0 if parts.len() > 1 => parts[0].end..parts[1].start,
        0 => inside.start + 1..inside.end - 1,
        at => parts[at - 1].end..parts[at].start,
    };
    let own = parts[at].clone();
    let around = if gap.contains(&own.start) {
        [&text[gap.start..own.start], &text[own.end..gap.end]].concat()
    } else {
        text[gap.clone()].to_string()
    };
    if !has_comment(&around) {
        return Ok(splice(text, gap.start.min(own.start)..gap.end.max(own.end), ""));
    }
    // Comments keep their positions: the value is removed with the white space before it and one comma.
    let value = own.start - whitespace_before(text, own.start).len()..own.end;
    Ok(match comma(text, gap).filter(|_| parts.len() > 1) {
        Some(comma) if comma < value.start => splice(&splice(text, value, ""), comma..comma + 1, ""),
        Some(comma) => splice(&splice(text, comma..comma + 1, ""), value, ""),
        None => splice(text, value, ""),
    })
}

/// Returns true if the text between values contains a comment.
fn has_comment(between: &str) -> bool {
    between.contains('/')
}

/// Returns the position of the comma between two values, skipping comments.
fn comma(text: &str, between: Range<usize>) -> Option<usize> {
    let mut at = between.start;
    while at < between.end {
        let rest = &text[at..between.end];
        at += match rest.as_bytes() {
            [b',', ..] => return Some(at),
            [b'/', b'/', ..] => rest.find('\n').unwrap_or(rest.len()),
            [b'/', b'*', ..] => rest.find("*/").map_or(rest.len(), |end| end + 2),
            _ => rest.chars().next().map_or(1, char::len_utf8),
        };
    }
    None
}

/// Returns the text with another entry at the end of a list; a missing list is created.
pub(super) fn push(text: &str, list: &str, value: &Json) -> Result<String, EditError> {
    let root = parse(text)?;
    match find(&root, list) {
        None => set(text, list, &Json::Array(vec![value.clone()])),
        Some(Value::Array(array)) => Ok(append_entry(text, array, value)),
        Some(_) => Err(EditError::NoSuchPlace(list.into())),
    }
}

/// Returns the text with two entries of a list exchanged.
pub(super) fn swap(text: &str, list: &str, a: usize, b: usize) -> Result<String, EditError> {
    let root = parse(text)?;
    let place = || EditError::NoSuchPlace(list.into());
    let Some(Value::Array(array)) = find(&root, list) else { return Err(place()) };
    let (a, b) = (a.min(b), a.max(b));
    let (Some(first), Some(second)) = (array.elements.get(a), array.elements.get(b)) else { return Err(place()) };
    let (first, second) = (byte_range(first), byte_range(second));
    if a == b {
        return Ok(text.to_string());
    }
    let between = &text[first.end..second.start];
    let swapped = format!("{}{between}{}", &text[second.clone()], &text[first.clone()]);
    Ok(splice(text, first.start..second.end, &swapped))
}

/// Comments are accepted here so that they can be kept, although `check` refuses them.
fn parse(text: &str) -> Result<Value<'_>, EditError> {
    let options = ParseOptions { allow_comments: true, ..strict_parse_options() };
    let parsed = parse_to_ast(text, &CollectOptions::default(), &options).map_err(|_| EditError::NotJson)?;
    parsed.value.ok_or(EditError::NotJson)
}

fn byte_range(part: &impl Ranged) -> Range<usize> {
    let range = part.range();
    range.start..range.end
}

fn key_of(property: &ObjectProp) -> String {
    property.name.as_str().to_string()
}

fn find<'v, 't>(root: &'v Value<'t>, pointer: &str) -> Option<&'v Value<'t>> {
    tokens(pointer).try_fold(root, |value, name| match value {
        Value::Object(object) => object.properties.iter().find(|p| key_of(p) == name).map(|p| &p.value),
        Value::Array(array) => array.elements.get(name.parse::<usize>().ok()?),
        _ => None,
    })
}

fn to_json(value: &Value) -> Json {
    match value {
        Value::StringLit(text) => Json::String(text.value.to_string()),
        Value::NumberLit(number) => serde_json::from_str(number.value).unwrap_or(Json::Null),
        Value::BooleanLit(truth) => Json::Bool(truth.value),
        Value::NullKeyword(_) => Json::Null,
        Value::Array(array) => array.elements.iter().map(to_json).collect(),
        Value::Object(object) => {
            Json::Object(object.properties.iter().map(|p| (key_of(p), to_json(&p.value))).collect())
        }
    }
}

/// Returns true for equal values; 1 and 1.0 are equal numbers.
fn is_equal(a: &Json, b: &Json) -> bool {
    match (a, b) {
        (Json::Number(a), Json::Number(b)) => a.as_f64() == b.as_f64(),
        (Json::Array(a), Json::Array(b)) => a.len() == b.len() && a.iter().zip(b).all(|(a, b)| is_equal(a, b)),
        (Json::Object(a), Json::Object(b)) => {
            a.len() == b.len() && a.iter().all(|(key, v)| b.get(key).is_some_and(|other| is_equal(v, other)))
        }
        _ => a == b,
    }
}

fn splice(text: &str, range: Range<usize>, new: &str) -> String {
    format!("{}{new}{}", &text[..range.start], &text[range.end..])
}

/// Returns the number of spaces at the beginning of the line that contains a byte.
fn line_indent(text: &str, byte: usize) -> usize {
    let line = &text[text[..byte].rfind('\n').map_or(0, |i| i + 1)..];
    line.len() - line.trim_start_matches(' ').len()
}

/// Returns the white space before a part of an object or a list.
fn whitespace_before(text: &str, byte: usize) -> &str {
    let start = text[..byte].trim_end().len();
    &text[start..byte]
}

/// Returns the indentation of the line that begins in some white space; without a line break in it, that of the line
/// that contains a byte.
fn indent_after(text: &str, white: &str, byte: usize) -> usize {
    match white.rsplit_once('\n') {
        Some((_, spaces)) => spaces.len(),
        None => line_indent(text, byte),
    }
}

fn insert_key(text: &str, object: &Object, key: &str, value: &Json) -> String {
    let breaks = LineStyle::detect(text);
    let Some(first) = object.properties.first() else {
        let inside = object.range.start + 1;
        if has_comment(&text[inside..object.range.end - 1]) {
            let new = format_value(value, line_indent(text, object.range.start), breaks);
            return splice(text, inside..inside, &format!(" {}: {new}", quote(key)));
        }
        let indent = line_indent(text, object.range.start);
        let whole = Json::Object([(key.to_string(), value.clone())].into_iter().collect());
        return splice(text, byte_range(object), &format_value(&whole, indent, breaks));
    };
    let place = key_order(key);
    let earlier = object.properties.iter().rfind(|p| key_order(&key_of(p)) <= place);
    match earlier {
        Some(earlier) => {
            let range = byte_range(earlier);
            let white = whitespace_before(text, range.start);
            let new = format_value(value, indent_after(text, white, range.start), breaks);
            splice(text, range.end..range.end, &format!(",{white}{}: {new}", quote(key)))
        }
        None => {
            let at = byte_range(first).start;
            let white = whitespace_before(text, at);
            let new = format_value(value, indent_after(text, white, at), breaks);
            splice(text, at..at, &format!("{}: {new},{white}", quote(key)))
        }
    }
}

fn append_entry(text: &str, array: &Array, value: &Json) -> String {
    let breaks = LineStyle::detect(text);
    let Some(last) = array.elements.last() else {
        let inside = array.range.start + 1;
        if has_comment(&text[inside..array.range.end - 1]) {
            let new = format_value(value, line_indent(text, array.range.start), breaks);
            return splice(text, inside..inside, &new);
        }
        let whole = Json::Array(vec![value.clone()]);
        return splice(text, byte_range(array), &format_value(&whole, line_indent(text, array.range.start), breaks));
    };
    let range = byte_range(last);
    let white = match whitespace_before(text, range.start) {
        // `["a"]`: the only entry has no white space before it.
        "" => " ",
        white => white,
    };
    let new = format_value(value, indent_after(text, white, range.start), breaks);
    splice(text, range.end..range.end, &format!(",{white}{new}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    const TEXT: &str = "{\n  // who it is\n  \"id\":   \"a\", \"title\": \"A\",\n  \"list\": [\n    { \"id\": 1 }, // first\n    { \
                        \"id\": 2 }\n  ],\n  \"empty\": [], \"none\": {}\n}\n";

    fn check(new: Result<String, EditError>, old: &str, is: &str) {
        assert!(TEXT.contains(old), "{old}");
        assert_eq!(new.unwrap(), TEXT.replacen(old, is, 1));
    }

    #[test]
    fn only_the_value_that_changes_is_rewritten() {
        check(set(TEXT, "/title", &json!("B")), "\"A\"", "\"B\"");
        check(set(TEXT, "/list/1/id", &json!(3.5)), "\"id\": 2", "\"id\": 3.5");
        check(set(TEXT, "/list/0/id", &json!(1.0)), "1", "1");
    }

    #[test]
    fn what_is_added_stands_where_its_neighbours_do() {
        check(set(TEXT, "/summary", &json!("S")), "\"A\"", "\"A\", \"summary\": \"S\"");
        check(set(TEXT, "/measures/near_mm", &json!(2)), "\"A\"", "\"A\", \"measures\": { \"near_mm\": 2 }");
        check(set(TEXT, "/of_a_later_version", &json!(2)), "{}\n", "{}, \"of_a_later_version\": 2\n");
        check(set(TEXT, "/none/id", &json!("x")), "{}", "{ \"id\": \"x\" }");
        check(push(TEXT, "/list", &json!({ "id": 3 })), "{ \"id\": 2 }", "{ \"id\": 2 },\n    { \"id\": 3 }");
        check(push(TEXT, "/empty", &json!("x")), "[]", "[\"x\"]");
    }

    #[test]
    fn what_goes_takes_its_comma_along() {
        check(remove(TEXT, "/title"), ", \"title\": \"A\"", "");
        check(remove(TEXT, "/id"), "\"id\":   \"a\", ", "");
        check(remove(TEXT, "/list/0"), "[\n    { \"id\": 1 }, // first", "[ // first");
        check(remove(TEXT, "/list/1"), ", // first\n    { \"id\": 2 }", " // first");
        check(remove(TEXT, "/nothing/here"), "a", "a");
    }

    #[test]
    fn comments_outlive_what_they_stand_beside() {
        let text = "{ /* empty */ }";
        assert_eq!(set(text, "/a", &json!(1)).unwrap(), "{ \"a\": 1 /* empty */ }");
        assert_eq!(push("[ // none, yet\n]", "", &json!(1)).unwrap(), "[1 // none, yet\n]");
        assert_eq!(remove("[1 // one, and no more\n]", "/0").unwrap(), "[ // one, and no more\n]");
        assert_eq!(remove("[1 /* , */, 2]", "/0").unwrap(), "[ /* , */ 2]");
        assert_eq!(remove("[1 /* , */, 2]", "/1").unwrap(), "[1 /* , */]");
    }

    #[test]
    fn entries_change_places_and_what_is_between_them_stays() {
        let swapped = "{ \"id\": 2 }, // first\n    { \"id\": 1 }";
        check(swap(TEXT, "/list", 1, 0), "{ \"id\": 1 }, // first\n    { \"id\": 2 }", swapped);
        assert_eq!(swap(TEXT, "/list", 0, 2), Err(EditError::NoSuchPlace("/list".into())));
    }

    #[test]
    fn a_text_that_is_not_json_is_left_alone() {
        assert_eq!(set("{ \"id\": ", "/id", &json!(1)), Err(EditError::NotJson));
        assert_eq!(pointer_at(TEXT, TEXT.find("\"id\": 2").unwrap() + 6).as_deref(), Some("/list/1/id"));
    }
}
