//! JSON that people write: read against its schema, with every complaint at its place.
//!
//! Takes a text and a type. Gives the value and where each of its parts stands, or all that is wrong with it. The schema
//! that the complaints come from is the one that is printed for editors: what it accepts is what is read.

use super::{pointer, syntax};
use crate::diagnostic::{Diagnostic, Source, did_you_mean};
use jsonc_parser::ast::{ObjectPropName, Value};
use jsonc_parser::common::{Range as AstRange, Ranged};
use jsonc_parser::{CollectOptions, ParseOptions, parse_to_ast};
use regex_lite::Regex;
use schemars::{JsonSchema, Schema, SchemaGenerator, generate::SchemaSettings};
use serde::de::DeserializeOwned;
use serde_json::Value as Json;
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

/// Longest text that is read, bytes. The longest shipped file is about 20 kB; a text of this size takes a second.
pub const TEXT_MAX: usize = 4 << 20;

/// A value that was read, with its places.
#[derive(Clone, Debug)]
pub struct Read<T> {
    pub value: T,
    pub places: Places,
}

/// Where the parts of a text stand, by JSON pointer.
#[derive(Clone, Debug)]
pub struct Places {
    source: Arc<Source>,
    spans: BTreeMap<String, Range<usize>>,
}

impl Places {
    pub fn source(&self) -> &Arc<Source> {
        &self.source
    }

    /// A complaint about the value at a JSON pointer; an unknown pointer falls back to the nearest enclosing value.
    pub fn complain(&self, path: &str, code: &'static str, message: String, help: Option<String>) -> Diagnostic {
        let mut at = path;
        let span = loop {
            if let Some(span) = self.spans.get(at) {
                break Some(span.clone());
            }
            match at.rfind('/') {
                Some(cut) => at = &at[..cut],
                None => break None,
            }
        };
        Diagnostic { code, source: self.source.clone(), span, path: path.to_string(), message, help }
    }
}

/// The schema of a type, as printed for editors and as used by [`read`].
pub fn schema_of<T: JsonSchema>() -> Schema {
    SchemaGenerator::new(SchemaSettings::draft2020_12()).into_root_schema_for::<T>()
}

/// Reads a text as a value of a type; otherwise every structural complaint, in order of place.
pub fn read<T: DeserializeOwned + JsonSchema>(source: Arc<Source>) -> Result<Read<T>, Vec<Diagnostic>> {
    let whole = |code, message: String, help: &str| {
        let help = (!help.is_empty()).then(|| help.to_string());
        Diagnostic { code, source: source.clone(), span: None, path: String::new(), message, help }
    };
    if source.text.len() > TEXT_MAX {
        let message = format!("the file has {} bytes", source.text.len());
        return Err(vec![whole("too-large", message, "a file of this kind has at most 4 MiB")]);
    }
    let parsed = parse_to_ast(&source.text, &CollectOptions::default(), &strict()).map_err(|error| {
        let message = error.kind().to_string().to_lowercase();
        let span = clip(error.range(), source.text.len());
        let help = syntax::remedy(&source.text, span.start);
        vec![Diagnostic { span: Some(span), ..whole("syntax", message, help) }]
    })?;
    let Some(value) = parsed.value else {
        return Err(vec![whole("syntax", "the file is empty".into(), "")]);
    };
    let root = schema_of::<T>();
    let mut check = Check { source: source.clone(), root: root.as_value(), found: Vec::new(), spans: BTreeMap::new() };
    check.value(&value, root.as_value(), &mut String::new());
    let Check { mut found, spans, .. } = check;
    if !found.is_empty() {
        found.sort_by_key(|d| d.span.as_ref().map(|s| s.start));
        return Err(found);
    }
    let value = serde_json::from_str(&source.text).map(with_whole_numbers).and_then(serde_json::from_value);
    match value {
        Ok(value) => Ok(Read { value, places: Places { source, spans } }),
        // A control character within a text: the one thing that the two readers of JSON see differently.
        Err(error) if error.is_syntax() => {
            let at = syntax::offset(&source.text, error.line(), error.column());
            let message = error.to_string();
            Err(vec![Diagnostic { span: Some(at..at), ..whole("syntax", message, syntax::remedy(&source.text, at)) }])
        }
        Err(error) => {
            // Nothing known gets here: the schema says all that serde asks. Should it ever, the author still hears of it.
            let help = "this is a gap in the schema of this kind of file; please report it";
            Err(vec![whole("unreadable", error.to_string(), help)])
        }
    }
}

/// Writes 36.0 as 36: the same number to JSON Schema, but not to every reader of whole numbers.
fn with_whole_numbers(value: Json) -> Json {
    /// Beyond 2⁵³ not every whole number is one of JSON's.
    const EXACT: f64 = 9_007_199_254_740_992.0;
    match value {
        Json::Number(number) => match number.as_f64() {
            Some(v) if number.is_f64() && v.fract() == 0.0 && v.abs() <= EXACT => Json::from(v as i64),
            _ => Json::Number(number),
        },
        Json::Array(list) => list.into_iter().map(with_whole_numbers).collect(),
        Json::Object(map) => map.into_iter().map(|(k, v)| (k, with_whole_numbers(v))).collect(),
        other => other,
    }
}

/// JSON as everyone else understands it: no comments, no trailing commas.
pub(crate) fn strict() -> ParseOptions {
    ParseOptions {
        allow_comments: false,
        allow_loose_object_property_names: false,
        allow_trailing_commas: false,
        allow_missing_commas: false,
        allow_single_quoted_strings: false,
        allow_hexadecimal_numbers: false,
        allow_unary_plus_numbers: false,
        allow_bare_decimal_point_numbers: false,
        allow_non_finite_numbers: false,
        allow_extended_string_escapes: false,
    }
}

fn clip(range: AstRange, length: usize) -> Range<usize> {
    let start = range.start.min(length);
    start..range.end.clamp(start, length)
}

/// A walk over text and schema at once.
struct Check<'s> {
    source: Arc<Source>,
    root: &'s Json,
    found: Vec<Diagnostic>,
    spans: BTreeMap<String, Range<usize>>,
}

impl<'s> Check<'s> {
    fn complain(&mut self, at: &impl Ranged, path: &str, code: &'static str, message: String, help: Option<String>) {
        let span = Some(clip(at.range(), self.source.text.len()));
        let source = self.source.clone();
        self.found.push(Diagnostic { code, source, span, path: path.to_string(), message, help });
    }

    /// Follows `$ref`s to the schema that says something.
    fn resolve(&self, mut schema: &'s Json) -> &'s Json {
        while let Some(name) = schema.get("$ref").and_then(Json::as_str) {
            match name.strip_prefix('#').and_then(|pointer| self.root.pointer(pointer)) {
                Some(target) => schema = target,
                None => break,
            }
        }
        schema
    }

    fn value(&mut self, value: &Value, schema: &'s Json, path: &mut String) {
        self.spans.insert(path.clone(), clip(value.range(), self.source.text.len()));
        let schema = self.resolve(schema);
        if let Some(choices) = schema.get("oneOf").or(schema.get("anyOf")).and_then(Json::as_array) {
            return self.choice(value, choices, path);
        }
        if let Some(expected) = schema.get("const") {
            if json_of(value).as_ref() != Some(expected) {
                let message = format!("expected {expected}, found {}", shown(value));
                self.complain(value, path, "wrong-value", message, None);
            }
            return;
        }
        if !self.has_right_type(value, schema) {
            let message = format!("expected {}, found {}", described(schema), shown(value));
            return self.complain(value, path, "wrong-type", message, description(schema));
        }
        match value {
            Value::Object(object) => self.object(object, schema, path),
            Value::Array(array) => self.array(array, schema, path),
            Value::NumberLit(number) => self.number(number, schema, path),
            Value::StringLit(text) => self.text(text, schema, path),
            Value::BooleanLit(_) | Value::NullKeyword(_) => {}
        }
    }

    fn has_right_type(&self, value: &Value, schema: &Json) -> bool {
        let is = |name: &str| match (name, value) {
            ("object", Value::Object(_)) | ("array", Value::Array(_)) | ("string", Value::StringLit(_)) => true,
            ("boolean", Value::BooleanLit(_)) | ("null", Value::NullKeyword(_)) | ("number", Value::NumberLit(_)) => {
                true
            }
            ("integer", Value::NumberLit(n)) => n.value.parse::<f64>().is_ok_and(|v| v.fract() == 0.0),
            _ => false,
        };
        match schema.get("type") {
            Some(Json::String(name)) => is(name),
            Some(Json::Array(names)) => names.iter().filter_map(Json::as_str).any(is),
            _ => true,
        }
    }

    fn object(&mut self, object: &jsonc_parser::ast::Object, schema: &'s Json, path: &mut String) {
        let known = schema.get("properties").and_then(Json::as_object);
        let others = schema.get("additionalProperties");
        let mut seen = Vec::new();
        for property in &object.properties {
            let name = name_of(&property.name);
            if seen.contains(&name) {
                self.complain(&property.name, path, "duplicate-key", format!("\"{name}\" stands here twice"), None);
                continue;
            }
            seen.push(name.clone());
            let length = path.len();
            path.push('/');
            path.push_str(&pointer::escaped(&name));
            match (known.and_then(|k| k.get(&name)), others) {
                (Some(inner), _) => self.value(&property.value, inner, path),
                (None, Some(Json::Object(_))) => self.value(&property.value, others.unwrap_or(&Json::Null), path),
                (None, Some(Json::Bool(false))) => {
                    let names = known.into_iter().flat_map(|k| k.keys().map(String::as_str)).collect::<Vec<_>>();
                    let help = did_you_mean(&name, names);
                    self.complain(
                        &property.name,
                        path,
                        "unknown-key",
                        format!("no key is named \"{name}\" here"),
                        Some(help),
                    );
                }
                _ => {}
            }
            path.truncate(length);
        }
        let required = schema.get("required").and_then(Json::as_array);
        for name in required.into_iter().flatten().filter_map(Json::as_str) {
            if !seen.iter().any(|s| s == name) {
                let help =
                    known.and_then(|k| k.get(name)).and_then(|s| description(s).or(description(self.resolve(s))));
                self.complain(object, path, "missing-key", format!("the key \"{name}\" is missing"), help);
            }
        }
    }

    fn array(&mut self, array: &jsonc_parser::ast::Array, schema: &'s Json, path: &mut String) {
        let count = array.elements.len() as u64;
        let bound = |key: &str| schema.get(key).and_then(Json::as_u64);
        let (least, most) = (bound("minItems").unwrap_or(0), bound("maxItems").unwrap_or(u64::MAX));
        if count < least || count > most {
            let wanted = match (least, most) {
                (a, b) if a == b => format!("exactly {a}"),
                (a, u64::MAX) => format!("at least {a}"),
                (a, b) => format!("{a} to {b}"),
            };
            self.complain(
                array,
                path,
                "wrong-count",
                format!("{count} entries, expected {wanted}"),
                description(schema),
            );
        }
        let Some(items) = schema.get("items") else { return };
        for (index, element) in array.elements.iter().enumerate() {
            let length = path.len();
            path.push_str(&format!("/{index}"));
            self.value(element, items, path);
            path.truncate(length);
        }
    }

    fn number(&mut self, number: &jsonc_parser::ast::NumberLit, schema: &Json, path: &str) {
        let Ok(value) = number.value.parse::<f64>() else { return };
        let bound = |key: &str| schema.get(key).and_then(Json::as_f64);
        let too_small =
            bound("minimum").is_some_and(|b| value < b) || bound("exclusiveMinimum").is_some_and(|b| value <= b);
        let too_large =
            bound("maximum").is_some_and(|b| value > b) || bound("exclusiveMaximum").is_some_and(|b| value >= b);
        if too_small || too_large || !value.is_finite() {
            let message = format!("{} is out of range: expected {}", number.value, described(schema));
            self.complain(number, path, "out-of-range", message, description(schema));
        }
    }

    fn text(&mut self, text: &jsonc_parser::ast::StringLit, schema: &Json, path: &str) {
        if let Some(words) = schema.get("enum").and_then(Json::as_array) {
            let words: Vec<&str> = words.iter().filter_map(Json::as_str).collect();
            if !words.contains(&text.value.as_ref()) {
                let message = format!("\"{}\" is not one of the possible words", abridged(&text.value));
                self.complain(text, path, "unknown-word", message, Some(did_you_mean(&text.value, words)));
            }
        }
        let length = text.value.chars().count() as u64;
        let bound = |key: &str| schema.get(key).and_then(Json::as_u64);
        if bound("minLength").is_some_and(|least| length < least) {
            self.complain(text, path, "too-short", "the text is empty".into(), description(schema));
            return;
        }
        let pattern = schema.get("pattern").and_then(Json::as_str).and_then(|p| Regex::new(p).ok());
        if pattern.is_some_and(|p| !p.is_match(&text.value)) {
            let message = format!("\"{}\" does not have the right form", abridged(&text.value));
            self.complain(text, path, "wrong-form", message, description(schema));
        }
        if let Some(most) = bound("maxLength").filter(|&most| length > most) {
            let message = format!("the text has {length} characters, expected at most {most}");
            self.complain(text, path, "too-long", message, description(schema));
        }
    }

    /// One of several shapes: for our files either a word or an object whose single key names the shape.
    fn choice(&mut self, value: &Value, choices: &'s [Json], path: &mut String) {
        let choices: Vec<&'s Json> = choices.iter().map(|c| self.resolve(c)).collect();
        if matches!(value, Value::NullKeyword(_)) && choices.iter().any(|c| self.has_right_type(value, c)) {
            return;
        }
        let choices: Vec<&'s Json> =
            choices.into_iter().filter(|c| c.get("type") != Some(&Json::from("null"))).collect();
        if let [only] = choices[..] {
            return self.value(value, only, path);
        }
        let words: Vec<&'s str> = choices.iter().flat_map(|c| words_of(c)).collect();
        let names: Vec<&'s str> = choices.iter().filter_map(|c| sole_key(c)).collect();
        match value {
            Value::StringLit(text) if words.contains(&text.value.as_ref()) => {}
            Value::StringLit(text) if names.contains(&text.value.as_ref()) => {
                let message = format!("\"{0}\" needs more: {{ \"{0}\": … }}", text.value);
                self.complain(value, path, "wrong-type", message, None);
            }
            Value::StringLit(text) => {
                let known: Vec<&str> = words.iter().chain(&names).copied().collect();
                let message = format!("\"{}\" is not one of the possibilities", abridged(&text.value));
                self.complain(value, path, "unknown-word", message, Some(did_you_mean(&text.value, known)));
            }
            Value::Object(object) if object.properties.len() == 1 => {
                let property = &object.properties[0];
                let name = name_of(&property.name);
                match choices.iter().find(|c| sole_key(c) == Some(&name)) {
                    Some(chosen) => self.object(object, chosen, path),
                    None => {
                        let known: Vec<&str> = names.iter().chain(&words).copied().collect();
                        let message = format!("\"{}\" is not one of the possibilities", abridged(&name));
                        self.complain(&property.name, path, "unknown-word", message, Some(did_you_mean(&name, known)));
                    }
                }
            }
            _ => {
                let known =
                    names.iter().map(|n| format!("{{ \"{n}\": … }}")).chain(words.iter().map(|w| format!("\"{w}\"")));
                let help = format!("one of: {}", known.collect::<Vec<_>>().join(", "));
                let message = format!("expected one of several forms, found {}", shown(value));
                self.complain(value, path, "wrong-type", message, Some(help));
            }
        }
    }
}

fn name_of(name: &ObjectPropName) -> String {
    match name {
        ObjectPropName::String(text) => text.value.to_string(),
        ObjectPropName::Word(word) => word.value.to_string(),
    }
}

/// The words that a schema of words accepts.
fn words_of(schema: &Json) -> Vec<&str> {
    let listed = schema.get("enum").and_then(Json::as_array).into_iter().flatten();
    listed.chain(schema.get("const")).filter_map(Json::as_str).collect()
}

/// The key of a schema that asks for exactly one.
fn sole_key(schema: &Json) -> Option<&str> {
    match schema.get("required")?.as_array()?.as_slice() {
        [only] => only.as_str(),
        _ => None,
    }
}

fn description(schema: &Json) -> Option<String> {
    Some(schema.get("description")?.as_str()?.split_whitespace().collect::<Vec<_>>().join(" "))
}

/// What a schema asks for, in words.
fn described(schema: &Json) -> String {
    let kind = match schema.get("type") {
        Some(Json::Array(names)) => names.iter().filter_map(Json::as_str).find(|n| *n != "null"),
        Some(Json::String(name)) => Some(name.as_str()),
        _ => None,
    };
    let noun = match kind {
        Some("object") => "an object { … }",
        Some("array") => "a list [ … ]",
        Some("string") => "a text in quotes",
        Some("integer") => "a whole number",
        Some("number") => "a number",
        Some("boolean") => "true or false",
        _ => "something else",
    };
    let bound = |key: &str| schema.get(key).and_then(Json::as_f64);
    let low = bound("minimum")
        .map(|b| format!("at least {b}"))
        .or(bound("exclusiveMinimum").map(|b| format!("more than {b}")));
    let high = bound("maximum")
        .map(|b| format!("at most {b}"))
        .or(bound("exclusiveMaximum").map(|b| format!("less than {b}")));
    let range = [low, high].into_iter().flatten().collect::<Vec<_>>().join(" and ");
    if range.is_empty() { noun.to_string() } else { format!("{noun}, {range}") }
}

fn shown(value: &Value) -> String {
    match value {
        Value::Object(_) => "an object".into(),
        Value::Array(_) => "a list".into(),
        Value::StringLit(text) => format!("the text \"{}\"", abridged(&text.value)),
        Value::NumberLit(number) => format!("the number {}", abridged(number.value)),
        Value::BooleanLit(boolean) => boolean.value.to_string(),
        Value::NullKeyword(_) => "null".into(),
    }
}

fn abridged(text: &str) -> String {
    let mut short: String = text.chars().take(60).collect();
    if short.len() < text.len() {
        short.push('…');
    }
    short
}

/// A scalar as JSON, to compare with a `const`.
fn json_of(value: &Value) -> Option<Json> {
    match value {
        Value::StringLit(text) => Some(Json::from(text.value.as_ref())),
        Value::NumberLit(number) => serde_json::from_str(number.value).ok(),
        Value::BooleanLit(boolean) => Some(Json::from(boolean.value)),
        Value::NullKeyword(_) => Some(Json::Null),
        Value::Object(_) | Value::Array(_) => None,
    }
}
