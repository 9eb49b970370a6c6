//! One change to a text of JSON, and not a byte beside it.
//!
//! Comments, the order of keys and the way lines are broken stay, for only the changed value's own bytes are replaced. What is
//! added is laid out as its neighbours are.

use super::layout::{Breaks, place_of, quoted, written};
use crate::content::json::strict;
use crate::content::pointer::{names, split, under};
use jsonc_parser::ast::{Array, Object, ObjectProp, Value};
use jsonc_parser::common::Ranged;
use jsonc_parser::{CollectOptions, ParseOptions, parse_to_ast};
use serde_json::Value as Json;
use std::fmt;
use std::ops::Range;

/// Why a change does not fit a text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Unfit {
    /// The text is not JSON: it must be mended by hand first.
    NotJson,
    /// Nothing of the right kind stands there.
    NoSuchPlace(String),
}

impl fmt::Display for Unfit {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Unfit::NotJson => f.write_str("the text is not JSON; mend it in the text first"),
            Unfit::NoSuchPlace(pointer) => write!(f, "nothing that could be changed stands at {pointer}"),
        }
    }
}

/// The pointer to the value that encloses a byte of the text, the innermost one.
pub fn pointer_to(text: &str, byte: usize) -> Option<String> {
    fn within(value: &Value, byte: usize, pointer: String) -> String {
        let has = |range: Range<usize>| range.contains(&byte);
        match value {
            Value::Object(object) => match object.properties.iter().find(|p| has(bytes(*p))) {
                Some(property) => within(&property.value, byte, under(&pointer, name_of(property))),
                None => pointer,
            },
            Value::Array(array) => match array.elements.iter().position(|e| has(bytes(e))) {
                Some(index) => within(&array.elements[index], byte, under(&pointer, index)),
                None => pointer,
            },
            _ => pointer,
        }
    }
    Some(within(&parsed(text).ok()?, byte, String::new()))
}

/// What a text says, comments left out; `None` where it is not JSON.
pub(super) fn value_of(text: &str) -> Option<Json> {
    Some(json_of(&parsed(text).ok()?))
}

/// The text with another value at a pointer. A key that is missing is added where a person expects it, with the objects
/// around it; an equal value changes nothing, however it is written.
pub(super) fn set(text: &str, pointer: &str, value: &Json) -> Result<String, Unfit> {
    let root = parsed(text)?;
    if let Some(old) = find(&root, pointer) {
        if is_equal(&json_of(old), value) {
            return Ok(text.to_string());
        }
        let range = bytes(old);
        let new = written(value, line_indent(text, range.start), Breaks::of(text));
        return Ok(replaced(text, range, &new));
    }
    let (parent, key) = split(pointer).ok_or_else(|| Unfit::NoSuchPlace(pointer.into()))?;
    match find(&root, parent) {
        Some(Value::Object(object)) => Ok(with_key(text, object, &key, value)),
        Some(_) => Err(Unfit::NoSuchPlace(pointer.into())),
        None => set(text, parent, &Json::Object([(key, value.clone())].into_iter().collect())),
    }
}

/// The text without a key or an entry of a list. What is not there is gone already.
pub(super) fn remove(text: &str, pointer: &str) -> Result<String, Unfit> {
    let root = parsed(text)?;
    let (parent, key) = split(pointer).ok_or_else(|| Unfit::NoSuchPlace(pointer.into()))?;
    let (parts, at, inside) = match find(&root, parent) {
        Some(Value::Object(object)) => {
            let at = object.properties.iter().position(|p| name_of(p) == key);
            (object.properties.iter().map(bytes).collect::<Vec<_>>(), at, bytes(object))
        }
        Some(Value::Array(array)) => (array.elements.iter().map(bytes).collect(), key.parse().ok(), bytes(array)),
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
        return Ok(replaced(text, gap.start.min(own.start)..gap.end.max(own.end), ""));
    }
    // Comments stay where they stand: the value goes, with the white space before it and one comma.
    let value = own.start - before(text, own.start).len()..own.end;
    Ok(match comma(text, gap).filter(|_| parts.len() > 1) {
        Some(comma) if comma < value.start => replaced(&replaced(text, value, ""), comma..comma + 1, ""),
        Some(comma) => replaced(&replaced(text, comma..comma + 1, ""), value, ""),
        None => replaced(text, value, ""),
    })
}

/// True where anything stands between values but white space and commas.
fn has_comment(between: &str) -> bool {
    between.contains('/')
}

/// Where the comma between two values stands, past comments.
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

/// The text with one more entry at the end of a list; the list is made where there is none.
pub(super) fn push(text: &str, list: &str, value: &Json) -> Result<String, Unfit> {
    let root = parsed(text)?;
    match find(&root, list) {
        None => set(text, list, &Json::Array(vec![value.clone()])),
        Some(Value::Array(array)) => Ok(with_entry(text, array, value)),
        Some(_) => Err(Unfit::NoSuchPlace(list.into())),
    }
}

/// The text with two entries of a list in each other's place.
pub(super) fn swap(text: &str, list: &str, a: usize, b: usize) -> Result<String, Unfit> {
    let root = parsed(text)?;
    let place = || Unfit::NoSuchPlace(list.into());
    let Some(Value::Array(array)) = find(&root, list) else { return Err(place()) };
    let (a, b) = (a.min(b), a.max(b));
    let (Some(first), Some(second)) = (array.elements.get(a), array.elements.get(b)) else { return Err(place()) };
    let (first, second) = (bytes(first), bytes(second));
    if a == b {
        return Ok(text.to_string());
    }
    let between = &text[first.end..second.start];
    let swapped = format!("{}{between}{}", &text[second.clone()], &text[first.clone()]);
    Ok(replaced(text, first.start..second.end, &swapped))
}

/// Comments are kept where somebody wrote them, though `check` does not take them.
fn parsed(text: &str) -> Result<Value<'_>, Unfit> {
    let options = ParseOptions { allow_comments: true, ..strict() };
    let parsed = parse_to_ast(text, &CollectOptions::default(), &options).map_err(|_| Unfit::NotJson)?;
    parsed.value.ok_or(Unfit::NotJson)
}

fn bytes(part: &impl Ranged) -> Range<usize> {
    let range = part.range();
    range.start..range.end
}

fn name_of(property: &ObjectProp) -> String {
    property.name.as_str().to_string()
}

fn find<'v, 't>(root: &'v Value<'t>, pointer: &str) -> Option<&'v Value<'t>> {
    names(pointer).try_fold(root, |value, name| match value {
        Value::Object(object) => object.properties.iter().find(|p| name_of(p) == name).map(|p| &p.value),
        Value::Array(array) => array.elements.get(name.parse::<usize>().ok()?),
        _ => None,
    })
}

fn json_of(value: &Value) -> Json {
    match value {
        Value::StringLit(text) => Json::String(text.value.to_string()),
        Value::NumberLit(number) => serde_json::from_str(number.value).unwrap_or(Json::Null),
        Value::BooleanLit(truth) => Json::Bool(truth.value),
        Value::NullKeyword(_) => Json::Null,
        Value::Array(array) => array.elements.iter().map(json_of).collect(),
        Value::Object(object) => {
            Json::Object(object.properties.iter().map(|p| (name_of(p), json_of(&p.value))).collect())
        }
    }
}

/// 1 and 1.0 are the same number to a reader.
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

fn replaced(text: &str, range: Range<usize>, new: &str) -> String {
    format!("{}{new}{}", &text[..range.start], &text[range.end..])
}

/// Spaces at the beginning of the line of a byte.
fn line_indent(text: &str, byte: usize) -> usize {
    let line = &text[text[..byte].rfind('\n').map_or(0, |i| i + 1)..];
    line.len() - line.trim_start_matches(' ').len()
}

/// The white space before a part of an object or a list.
fn before(text: &str, byte: usize) -> &str {
    let start = text[..byte].trim_end().len();
    &text[start..byte]
}

/// Spaces that the line begun by some white space stands in by; else those of the line it is in.
fn indent_after(text: &str, white: &str, byte: usize) -> usize {
    match white.rsplit_once('\n') {
        Some((_, spaces)) => spaces.len(),
        None => line_indent(text, byte),
    }
}

fn with_key(text: &str, object: &Object, key: &str, value: &Json) -> String {
    let breaks = Breaks::of(text);
    let Some(first) = object.properties.first() else {
        let inside = object.range.start + 1;
        if has_comment(&text[inside..object.range.end - 1]) {
            let new = written(value, line_indent(text, object.range.start), breaks);
            return replaced(text, inside..inside, &format!(" {}: {new}", quoted(key)));
        }
        let indent = line_indent(text, object.range.start);
        let whole = Json::Object([(key.to_string(), value.clone())].into_iter().collect());
        return replaced(text, bytes(object), &written(&whole, indent, breaks));
    };
    let place = place_of(key);
    let earlier = object.properties.iter().rfind(|p| place_of(&name_of(p)) <= place);
    match earlier {
        Some(earlier) => {
            let range = bytes(earlier);
            let white = before(text, range.start);
            let new = written(value, indent_after(text, white, range.start), breaks);
            replaced(text, range.end..range.end, &format!(",{white}{}: {new}", quoted(key)))
        }
        None => {
            let at = bytes(first).start;
            let white = before(text, at);
            let new = written(value, indent_after(text, white, at), breaks);
            replaced(text, at..at, &format!("{}: {new},{white}", quoted(key)))
        }
    }
}

fn with_entry(text: &str, array: &Array, value: &Json) -> String {
    let breaks = Breaks::of(text);
    let Some(last) = array.elements.last() else {
        let inside = array.range.start + 1;
        if has_comment(&text[inside..array.range.end - 1]) {
            let new = written(value, line_indent(text, array.range.start), breaks);
            return replaced(text, inside..inside, &new);
        }
        let whole = Json::Array(vec![value.clone()]);
        return replaced(text, bytes(array), &written(&whole, line_indent(text, array.range.start), breaks));
    };
    let range = bytes(last);
    let white = match before(text, range.start) {
        // `["a"]`: the only entry has nothing before it.
        "" => " ",
        white => white,
    };
    let new = written(value, indent_after(text, white, range.start), breaks);
    replaced(text, range.end..range.end, &format!(",{white}{new}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    const TEXT: &str = "{\n  // who it is\n  \"id\":   \"a\", \"title\": \"A\",\n  \"list\": [\n    { \"id\": 1 }, // first\n    { \
                        \"id\": 2 }\n  ],\n  \"empty\": [], \"none\": {}\n}\n";

    fn check(new: Result<String, Unfit>, old: &str, is: &str) {
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
        assert_eq!(swap(TEXT, "/list", 0, 2), Err(Unfit::NoSuchPlace("/list".into())));
    }

    #[test]
    fn a_text_that_is_not_json_is_left_alone() {
        assert_eq!(set("{ \"id\": ", "/id", &json!(1)), Err(Unfit::NotJson));
        assert_eq!(pointer_to(TEXT, TEXT.find("\"id\": 2").unwrap() + 6).as_deref(), Some("/list/1/id"));
    }
}
