//! TOML that people write: validated against its schema, with the place of every complaint.
//!
//! Takes a text and a type. Gives the value and the position of each of its parts, or all complaints, in the words in
//! which [`crate::json`] complains. Never accepts a text that violates the schema.

use crate::diagnostic::{Diagnostic, SourceText};
use crate::json::{self, ParsedJson, SourceMap};
use jsonc_parser::ast::{Array, BooleanLit, NumberLit, Object, ObjectProp, ObjectPropName, StringLit, Value};
use jsonc_parser::common::Range as AstRange;
use schemars::JsonSchema;
use serde::de::DeserializeOwned;
use serde_json::Value as Json;
use std::borrow::Cow;
use std::ops::Range;
use std::sync::Arc;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Remedy for a text that is not TOML.
const FORM: &str = "a line has the form  key = \"text\"  or  key = 5; a comment begins with #; a \\ in a text is written twice, or \
                    the text stands between '…'";

/// Radix of the numbers that these files may contain.
const DECIMAL: u32 = 10;

/// Reads a text as a value of type `T`.
///
/// # Errors
/// Returns every complaint about syntax or structure, in order of position.
pub fn read<T: DeserializeOwned + JsonSchema>(source: Arc<SourceText>) -> Result<ParsedJson<T>, Vec<Diagnostic>> {
    json::refuse_large(&source)?;
    let (table, errors) = DeTable::parse_recoverable(&source.text);
    if !errors.is_empty() {
        let complain = |error: &toml::de::Error| {
            let message = error.message().lines().collect::<Vec<_>>().join("; ").to_lowercase();
            let complaint = json::about_text(&source, "syntax", message, FORM);
            Diagnostic { span: error.span().map(|span| within(span, &source.text)), ..complaint }
        };
        return Err(errors.iter().map(complain).collect());
    }
    let value = table_value(table.get_ref(), within(table.span(), &source.text), &source.text);
    let spans = json::check::<T>(&source, &value, false)?;
    match serde_json::from_value(json::with_whole_numbers(json_value(&value))) {
        Ok(value) => Ok(ParsedJson { value, source_map: SourceMap { source: source.clone(), spans } }),
        Err(error) => Err(vec![json::gap_in_schema(&source, &error)]),
    }
}

/// A span at the borders of characters.
fn within(span: Range<usize>, text: &str) -> Range<usize> {
    let start = text.floor_char_boundary(span.start);
    start..text.ceil_char_boundary(span.end.min(text.len())).max(start)
}

fn ast_range(span: &Range<usize>) -> AstRange {
    AstRange { start: span.start, end: span.end }
}

/// The same table as an object of JSON, at its place in the text.
fn table_value<'a>(table: &'a DeTable, span: Range<usize>, text: &'a str) -> Value<'a> {
    let property = |(name, value): (&'a Spanned<Cow<str>>, &'a Spanned<DeValue>)| {
        let range = ast_range(&name.span());
        let name = ObjectPropName::String(StringLit { range, value: Cow::Borrowed(name.get_ref()) });
        ObjectProp { range, name, value: value_at_place(value, text) }
    };
    Value::Object(Object { range: ast_range(&span), properties: table.iter().map(property).collect() })
}

/// The same value in JSON, at its place in the text. A date and a number that is not decimal, which JSON does not have,
/// are the text in which they are written.
fn value_at_place<'a>(value: &'a Spanned<DeValue>, text: &'a str) -> Value<'a> {
    let span = value.span();
    let range = ast_range(&span);
    let written = |value: &'a str| Value::StringLit(StringLit { range, value: Cow::Borrowed(value) });
    match value.get_ref() {
        DeValue::String(own) => written(own),
        DeValue::Integer(number) if number.radix() == DECIMAL => {
            Value::NumberLit(NumberLit { range, value: number.as_str() })
        }
        DeValue::Float(number) => Value::NumberLit(NumberLit { range, value: number.as_str() }),
        DeValue::Boolean(value) => Value::BooleanLit(BooleanLit { range, value: *value }),
        DeValue::Array(list) => {
            let elements = list.iter().map(|element| value_at_place(element, text)).collect();
            Value::Array(Array { range, elements })
        }
        DeValue::Table(table) => table_value(table, span, text),
        DeValue::Integer(_) | DeValue::Datetime(_) => written(text.get(span).unwrap_or_default()),
    }
}

fn json_value(value: &Value) -> Json {
    match value {
        Value::StringLit(text) => Json::from(text.value.as_ref()),
        Value::NumberLit(number) => serde_json::from_str(number.value).unwrap_or_default(),
        Value::BooleanLit(boolean) => Json::from(boolean.value),
        Value::NullKeyword(_) => Json::Null,
        Value::Array(list) => list.elements.iter().map(json_value).collect(),
        Value::Object(object) => {
            let entry = |property: &ObjectProp| (property.name.as_str().to_string(), json_value(&property.value));
            Json::Object(object.properties.iter().map(entry).collect())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, PartialEq, serde::Deserialize, JsonSchema)]
    #[serde(deny_unknown_fields)]
    struct RoomFile {
        seat: String,
        minutes: Option<u32>,
        #[serde(default)]
        is_open: bool,
    }

    fn complaints(text: &str) -> Vec<String> {
        let found = read::<RoomFile>(SourceText::new("room.toml", text)).unwrap_err();
        assert!(found.iter().all(|complaint| !complaint.to_string().is_empty()), "each can be shown");
        found.iter().map(Diagnostic::headline).collect()
    }

    #[test]
    fn a_text_is_read_and_its_places_are_known() {
        // Aim: a check after reading can point at a value. Method: a value and a complaint about it.
        let text = "# A room\nseat = 'a\\b'\nminutes = 1_0\nis_open = true\n";
        let read = read::<RoomFile>(SourceText::new("room.toml", text)).unwrap();
        assert_eq!(read.value, RoomFile { seat: "a\\b".into(), minutes: Some(10), is_open: true });
        let complaint = read.source_map.complain("/seat", "taken", "the seat is taken".into(), None);
        assert_eq!(complaint.headline(), "room.toml:2:8: taken: /seat: the seat is taken");
    }

    #[test]
    fn every_mistake_is_told_at_its_place() {
        let check = |text: &str, expected: &[&str]| {
            let found = complaints(text);
            let all = expected.iter().all(|words| found.iter().any(|line| line.contains(words)));
            assert!(all && found.len() == expected.len(), "{text:?}: {found:#?}");
        };
        check(
            "minutes = \"ten\"\nseet = \"b\"\n",
            &[
                "room.toml:1:1: missing-key: the key \"seat\" is missing",
                "room.toml:1:11: wrong-type: /minutes: expected a whole number",
                "room.toml:2:1: unknown-key: /seet",
            ],
        );
        check("seat = \"a\"\nminutes = -1\n", &["room.toml:2:11: out-of-range: /minutes: -1"]);
        check("seat = \"a\"\nminutes = 0x1F\n", &["room.toml:2:11: wrong-type: /minutes"]);
        check("seat = \"a\"\nminutes = nan\n", &["room.toml:2:11: wrong-type: /minutes"]);
        check("seat = 1979-05-27\n# but a date is not quoted\nseat = \"a\"\n", &["syntax: duplicate key"]);
        check("seat = \"C:\\Users\"\n", &["room.toml:1:13: syntax"]);
        check("seat = \"a\u{202e}\"\n", &["room.toml:1:8: forbidden-character: /seat"]);
        check("seat\n", &["room.toml:1:5: syntax"]);
        check("", &["missing-key"]);
    }
}
