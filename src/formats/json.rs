//! JSON that people write: validated against its schema, with the place of every complaint.
//!
//! Takes a text and a type. Gives the value and the position of each of its parts, or all complaints. Never accepts a
//! text that violates the schema. The schema is the same one that is printed for editors.

use crate::diagnostic::{Diagnostic, SourceText, did_you_mean};
use crate::{json_hints, pointer};
use jsonc_parser::ast::{ObjectPropName, Value};
use jsonc_parser::common::{Range as AstRange, Ranged};
use jsonc_parser::{CollectOptions, ParseOptions, parse_to_ast};
use regex_lite::Regex;
use schemars::transform::RecursiveTransform;
use schemars::{JsonSchema, Schema, SchemaGenerator, generate::SchemaSettings};
use serde::de::DeserializeOwned;
use serde_json::Value as Json;
use std::collections::{BTreeMap, HashSet};
use std::ops::Range;
use std::sync::Arc;

/// Maximum text length, bytes. The longest shipped file has about 20 kB; validating a text of this size takes a few
/// seconds.
pub const TEXT_MAX: usize = 4 << 20;

/// Maximum number of complaints about one text: a file with more is the wrong file, and each complaint carries its
/// own help.
const COMPLAINTS_MAX: usize = 1000;

/// A value that was read, with the positions of its parts.
#[derive(Clone, Debug)]
pub struct ParsedJson<T> {
    pub value: T,
    pub source_map: SourceMap,
}

/// Positions of the parts of a text, by JSON pointer.
#[derive(Clone, Debug)]
pub struct SourceMap {
    pub(crate) source: Arc<SourceText>,
    pub(crate) spans: BTreeMap<String, Range<usize>>,
}

impl SourceMap {
    pub fn source(&self) -> &Arc<SourceText> {
        &self.source
    }

    /// Creates a complaint about the value at a JSON pointer. For an unknown pointer, the span is that of the nearest
    /// enclosing value.
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

/// Form of every text for which its type gives no other: no control character except tab and line break, and no
/// character that reverses the direction of what follows it, so that a title reads in every place as its author sees
/// it, and a database can store it.
const TEXT_PATTERN: &str = r"^[^\u0000-\u0008\u000B\u000C\u000E-\u001F\u007F-\u009F\u202A-\u202E\u2066-\u2069]*$";

/// Returns true for a character that [`TEXT_PATTERN`] excludes.
fn is_forbidden(letter: char) -> bool {
    let is_control = letter.is_control() && !matches!(letter, '\t' | '\n' | '\r');
    is_control || matches!(letter, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

/// Returns the schema of a type, as printed for editors and as used by [`read`].
pub fn schema_of<T: JsonSchema>() -> Schema {
    let settings = SchemaSettings::draft2020_12()
        .with_transform(RecursiveTransform(bound_texts_by_language))
        .with_transform(RecursiveTransform(require_plain_text));
    SchemaGenerator::new(settings).into_root_schema_for::<T>()
}

/// Gives the texts of a text by language (a string, or an object of strings) the bounds of the string.
fn bound_texts_by_language(schema: &mut Schema) {
    let is_by_language = schema
        .get("type")
        .and_then(Json::as_array)
        .is_some_and(|names| ["string", "object"].iter().all(|name| names.iter().any(|own| own == name)));
    if !is_by_language {
        return;
    }
    let bounds = ["minLength", "maxLength"].map(|key| (key, schema.get(key).cloned()));
    let Some(Json::Object(texts)) = schema.get_mut("additionalProperties") else { return };
    for (key, bound) in bounds {
        if let Some(bound) = bound {
            texts.insert(key.into(), bound);
        }
    }
}

/// Adds [`TEXT_PATTERN`] to the schema of a text that has no form of its own.
fn require_plain_text(schema: &mut Schema) {
    let accepts_text = match schema.get("type") {
        Some(Json::String(name)) => name == "string",
        Some(Json::Array(names)) => names.iter().any(|name| name == "string"),
        _ => false,
    };
    if accepts_text && ["enum", "const", "pattern"].into_iter().all(|key| schema.get(key).is_none()) {
        schema.insert("pattern".into(), TEXT_PATTERN.into());
    }
}

/// Reads a text as a value of type `T`.
///
/// # Errors
/// Returns every complaint about syntax or structure, in order of position.
pub fn read<T: DeserializeOwned + JsonSchema>(source: Arc<SourceText>) -> Result<ParsedJson<T>, Vec<Diagnostic>> {
    read_with(source, false)
}

/// Reads a text from a recording as [`read`] does, but accepts every character in its texts: an earlier version may
/// have recorded it, and its replay must not change.
///
/// # Errors
/// As [`read`].
pub fn read_recorded<T: DeserializeOwned + JsonSchema>(
    source: Arc<SourceText>,
) -> Result<ParsedJson<T>, Vec<Diagnostic>> {
    read_with(source, true)
}

fn read_with<T: DeserializeOwned + JsonSchema>(
    source: Arc<SourceText>,
    accepts_all_characters: bool,
) -> Result<ParsedJson<T>, Vec<Diagnostic>> {
    let whole = |code, message, help: &str| about_text(&source, code, message, help);
    refuse_large(&source)?;
    let parsed = parse_to_ast(&source.text, &CollectOptions::default(), &strict_parse_options()).map_err(|error| {
        let message = error.kind().to_string().to_lowercase();
        let span = clip(error.range(), source.text.len());
        let help = json_hints::likely_fix(&source.text, span.start);
        vec![Diagnostic { span: Some(span), ..whole("syntax", message, help) }]
    })?;
    let Some(value) = parsed.value else {
        return Err(vec![whole("syntax", "the file is empty".into(), "")]);
    };
    let spans = check::<T>(&source, &value, accepts_all_characters)?;
    let value = serde_json::from_str(&source.text).map(with_whole_numbers).and_then(serde_json::from_value);
    match value {
        Ok(value) => Ok(ParsedJson { value, source_map: SourceMap { source, spans } }),
        // A control character within a string: the only input on which the two JSON parsers disagree.
        Err(error) if error.is_syntax() => {
            let at = json_hints::offset(&source.text, error.line(), error.column());
            let message = error.to_string();
            Err(vec![Diagnostic {
                span: Some(at..at),
                ..whole("syntax", message, json_hints::likely_fix(&source.text, at))
            }])
        }
        Err(error) => Err(vec![gap_in_schema(&source, &error)]),
    }
}

/// Complaint about a text as a whole; without `help` if it is empty.
pub(crate) fn about_text(source: &Arc<SourceText>, code: &'static str, message: String, help: &str) -> Diagnostic {
    let help = (!help.is_empty()).then(|| help.to_string());
    Diagnostic { code, source: source.clone(), span: None, path: String::new(), message, help }
}

/// Refuses a text of more than [`TEXT_MAX`] bytes.
pub(crate) fn refuse_large(source: &Arc<SourceText>) -> Result<(), Vec<Diagnostic>> {
    let length = source.text.len();
    match length > TEXT_MAX {
        true => {
            let help = "a file of this kind may have at most 4 MiB";
            Err(vec![about_text(source, "too-large", format!("the file has {length} bytes"), help)])
        }
        false => Ok(()),
    }
}

/// Complaint about a value that agrees with the schema and that serde refuses. No known input gets here, because the
/// schema states all that serde requires. If one does, the author is told.
pub(crate) fn gap_in_schema(source: &Arc<SourceText>, error: &serde_json::Error) -> Diagnostic {
    let help = "this is a gap in the schema of this kind of file; please report it";
    about_text(source, "unreadable", error.to_string(), help)
}

/// Compares a value with the schema of `T`. Returns the positions of its parts, or all complaints.
pub(crate) fn check<T: JsonSchema>(
    source: &Arc<SourceText>,
    value: &Value,
    accepts_all_characters: bool,
) -> Result<BTreeMap<String, Range<usize>>, Vec<Diagnostic>> {
    let root = schema_of::<T>();
    let (found, spans) = (Vec::new(), BTreeMap::new());
    let mut check = Check { source: source.clone(), root: root.as_value(), accepts_all_characters, found, spans };
    check.value(value, root.as_value(), &mut String::new());
    let Check { mut found, spans, .. } = check;
    found.sort_by_key(|d| d.span.as_ref().map(|s| s.start));
    if found.is_empty() { Ok(spans) } else { Err(found) }
}

/// Writes 36.0 as 36, which is the same number to JSON Schema but not to serde's integer types.
pub(crate) fn with_whole_numbers(value: Json) -> Json {
    /// Beyond 2⁵³ not every whole number is representable as a JSON number.
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

/// Returns parse options for standard JSON: no comments, no trailing commas.
pub fn strict_parse_options() -> ParseOptions {
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

/// Simultaneous traversal of a text and its schema.
struct Check<'s> {
    source: Arc<SourceText>,
    root: &'s Json,
    accepts_all_characters: bool,
    found: Vec<Diagnostic>,
    spans: BTreeMap<String, Range<usize>>,
}

impl<'s> Check<'s> {
    fn complain(&mut self, at: &impl Ranged, path: &str, code: &'static str, message: String, help: Option<String>) {
        let span = Some(clip(at.range(), self.source.text.len()));
        let source = self.source.clone();
        let diagnostic = match self.found.len() {
            0..COMPLAINTS_MAX => Diagnostic { code, source, span, path: path.to_string(), message, help },
            COMPLAINTS_MAX => {
                let message = format!("there are more than {COMPLAINTS_MAX} complaints; the others are not listed");
                Diagnostic { code: "too-many", source, span, path: String::new(), message, help: None }
            }
            _ => return,
        };
        self.found.push(diagnostic);
    }

    /// Follows `$ref`s to the schema that they refer to.
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
        let mut seen = HashSet::new();
        for property in &object.properties {
            let name = name_of(&property.name);
            if !seen.insert(name.clone()) {
                self.complain(
                    &property.name,
                    path,
                    "duplicate-key",
                    format!("the key \"{name}\" is present twice"),
                    None,
                );
                continue;
            }
            let length = path.len();
            path.push('/');
            path.push_str(&pointer::escape(&name));
            match (known.and_then(|k| k.get(&name)), others) {
                (Some(inner), _) => self.value(&property.value, inner, path),
                (None, Some(Json::Object(_))) if self.has_forbidden(&property.name, &name, path) => {}
                (None, Some(Json::Object(_))) => self.value(&property.value, others.unwrap_or(&Json::Null), path),
                (None, Some(Json::Bool(false))) => {
                    let names = known.into_iter().flat_map(|k| k.keys().map(String::as_str)).collect::<Vec<_>>();
                    let help = did_you_mean(&name, names);
                    self.complain(
                        &property.name,
                        path,
                        "unknown-key",
                        format!("there is no key \"{name}\" at this place"),
                        Some(help),
                    );
                }
                _ => {}
            }
            path.truncate(length);
        }
        self.property_names(object, schema, path);
        let required = schema.get("required").and_then(Json::as_array);
        for name in required.into_iter().flatten().filter_map(Json::as_str) {
            if !seen.contains(name) {
                let help =
                    known.and_then(|k| k.get(name)).and_then(|s| description(s).or(description(self.resolve(s))));
                self.complain(object, path, "missing-key", format!("the key \"{name}\" is missing"), help);
            }
        }
    }

    /// Complains about keys without the form that the schema requires of them, and about too few keys.
    fn property_names(&mut self, object: &jsonc_parser::ast::Object, schema: &Json, path: &str) {
        let least = schema.get("minProperties").and_then(Json::as_u64).unwrap_or(0);
        let names = schema.get("propertyNames");
        if (object.properties.len() as u64) < least {
            let help = names.and_then(description).or(description(schema));
            self.complain(object, path, "wrong-count", "the object is empty".to_string(), help);
        }
        let Some(names) = names else { return };
        let Some(form) = names.get("pattern").and_then(Json::as_str).and_then(|p| Regex::new(p).ok()) else { return };
        for property in &object.properties {
            let name = name_of(&property.name);
            if !form.is_match(&name) {
                let message = format!("the key \"{}\" does not have the required form", abridged(&name));
                self.complain(&property.name, path, "wrong-form", message, description(names));
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
                format!("found {count} entries, expected {wanted}"),
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

    /// Complains of the first character of a text that people cannot see or that changes how others are read, and
    /// returns true if there is one.
    fn has_forbidden(&mut self, at: &impl Ranged, text: &str, path: &str) -> bool {
        let Some(letter) = text.chars().find(|c| is_forbidden(*c)).filter(|_| !self.accepts_all_characters) else {
            return false;
        };
        let (what, help) = match letter.is_control() {
            true => ("a control character", "delete the character, or type the text again"),
            false => (
                "a character that changes the direction of the text",
                "delete the character; where the order of a mixed text is wrong, use the marks U+200E and U+200F",
            ),
        };
        let message = format!("the text contains U+{:04X}, {what}", u32::from(letter));
        self.complain(at, path, "forbidden-character", message, Some(help.into()));
        true
    }

    fn text(&mut self, text: &jsonc_parser::ast::StringLit, schema: &Json, path: &str) {
        if self.has_forbidden(text, &text.value, path) {
            return;
        }
        if let Some(words) = schema.get("enum").and_then(Json::as_array) {
            let words: Vec<&str> = words.iter().filter_map(Json::as_str).collect();
            if !words.contains(&text.value.as_ref()) {
                let message = format!("\"{}\" is not one of the allowed words", abridged(&text.value));
                self.complain(text, path, "unknown-word", message, Some(did_you_mean(&text.value, words)));
            }
        }
        let length = text.value.chars().count() as u64;
        let bound = |key: &str| schema.get(key).and_then(Json::as_u64);
        if bound("minLength").is_some_and(|least| length < least) {
            self.complain(text, path, "too-short", "the text is empty".into(), description(schema));
            return;
        }
        let pattern = schema.get("pattern").and_then(Json::as_str).filter(|p| *p != TEXT_PATTERN);
        let pattern = pattern.and_then(|p| Regex::new(p).ok());
        if pattern.is_some_and(|p| !p.is_match(&text.value)) {
            let message = format!("\"{}\" does not have the required form", abridged(&text.value));
            self.complain(text, path, "wrong-form", message, description(schema));
        }
        if let Some(most) = bound("maxLength").filter(|&most| length > most) {
            let message = format!("the text has {length} characters, expected at most {most}");
            self.complain(text, path, "too-long", message, description(schema));
        }
    }

    /// Checks one of several alternatives: in our files either a word, or an object whose only key names the
    /// alternative.
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
                let message = format!("\"{0}\" needs further values: {{ \"{0}\": … }}", text.value);
                self.complain(value, path, "wrong-type", message, None);
            }
            Value::StringLit(text) => {
                let known: Vec<&str> = words.iter().chain(&names).copied().collect();
                let message = format!("\"{}\" is not one of the allowed forms", abridged(&text.value));
                self.complain(value, path, "unknown-word", message, Some(did_you_mean(&text.value, known)));
            }
            Value::Object(object) if object.properties.len() == 1 => {
                let property = &object.properties[0];
                let name = name_of(&property.name);
                match choices.iter().find(|c| sole_key(c) == Some(&name)) {
                    Some(chosen) => self.object(object, chosen, path),
                    None => {
                        let known: Vec<&str> = names.iter().chain(&words).copied().collect();
                        let message = format!("\"{}\" is not one of the allowed forms", abridged(&name));
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

/// Returns the words that a schema of words accepts.
fn words_of(schema: &Json) -> Vec<&str> {
    let listed = schema.get("enum").and_then(Json::as_array).into_iter().flatten();
    listed.chain(schema.get("const")).filter_map(Json::as_str).collect()
}

/// Returns the only required key of a schema; `None` if it requires none or several.
fn sole_key(schema: &Json) -> Option<&str> {
    match schema.get("required")?.as_array()?.as_slice() {
        [only] => only.as_str(),
        _ => None,
    }
}

fn description(schema: &Json) -> Option<String> {
    Some(schema.get("description")?.as_str()?.split_whitespace().collect::<Vec<_>>().join(" "))
}

/// Describes in words the values that a schema accepts.
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

/// Converts a scalar to JSON, to compare it with a `const`.
fn json_of(value: &Value) -> Option<Json> {
    match value {
        Value::StringLit(text) => Some(Json::from(text.value.as_ref())),
        Value::NumberLit(number) => serde_json::from_str(number.value).ok(),
        Value::BooleanLit(boolean) => Some(Json::from(boolean.value)),
        Value::NullKeyword(_) => Some(Json::Null),
        Value::Object(_) | Value::Array(_) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, serde::Deserialize, JsonSchema)]
    #[serde(deny_unknown_fields)]
    #[allow(dead_code)]
    struct TwoNumbers {
        first: f32,
        second: Option<f32>,
    }

    #[test]
    fn keys_by_the_hundred_thousand_are_refused_at_once() {
        // Aim: the work grows linearly with the text. Method: 300 000 different keys, the maximum that fits, and a
        // key that is present twice. Regression: each key was once compared with all keys before it, which took
        // minutes.
        let keys: Vec<String> = (0..300_000).map(|n| format!("\"k{n}\":0")).collect();
        let found =
            read::<TwoNumbers>(SourceText::new("a.json", format!("{{{}}}", keys.join(",")))).expect_err("unknown keys");
        assert_eq!(found.len(), COMPLAINTS_MAX + 1);
        assert!(found[..COMPLAINTS_MAX].iter().all(|d| d.code == "unknown-key"));
        assert_eq!(found[COMPLAINTS_MAX].code, "too-many");
        let found = read::<TwoNumbers>(SourceText::new("a.json", r#"{"first":1,"first":2}"#)).expect_err("a key twice");
        assert_eq!(found.iter().map(|d| d.code).collect::<Vec<_>>(), ["duplicate-key"]);
    }

    #[derive(Debug, serde::Deserialize, JsonSchema)]
    #[allow(dead_code)]
    struct Titled {
        title: String,
        words: BTreeMap<String, String>,
    }

    #[test]
    fn the_form_of_a_text_excludes_the_forbidden_characters() {
        // Aim: editors that know only the schema accept what the program reads. Method: every character of the planes
        // in use as a title, against the pattern and by reading it, as itself and, where JSON demands it, escaped.
        let pattern = Regex::new(TEXT_PATTERN).unwrap();
        for letter in (0..0x2_0000).filter_map(char::from_u32) {
            assert_eq!(pattern.is_match(&letter.to_string()), !is_forbidden(letter), "U+{:04X}", u32::from(letter));
        }
        for (letter, line_column) in [('\0', (1, 10)), ('\u{1b}', (1, 10)), ('\u{9b}', (1, 10)), ('\u{202e}', (1, 10))]
        {
            let text = serde_json::json!({ "title": format!("Cavity{letter}two"), "words": {} }).to_string();
            let found = read::<Titled>(SourceText::new("a.json", text.as_str())).expect_err("a forbidden character");
            let [only] = &found[..] else { panic!("{found:?}") };
            assert_eq!(
                (only.code, only.path.as_str(), only.line_and_column()),
                ("forbidden-character", "/title", Some(line_column))
            );
            assert!(only.message.contains(&format!("U+{:04X}", u32::from(letter))), "{}", only.message);
            assert!(
                read_recorded::<Titled>(SourceText::new("a.json", text)).is_ok(),
                "what was recorded stays readable"
            );
        }
        let key = serde_json::json!({ "title": "a", "words": { "a\u{2066}b": "c" } }).to_string();
        assert_eq!(
            read::<Titled>(SourceText::new("a.json", key)).expect_err("in a key")[0].code,
            "forbidden-character"
        );
        for fine in ["two\nlines\tand more", "مرحبا \u{200f}(2)\u{200e}", "Kavite açma 🦷", ""] {
            let text = serde_json::json!({ "title": fine, "words": { fine: fine } }).to_string();
            assert!(read::<Titled>(SourceText::new("a.json", text)).is_ok(), "{fine}");
        }
    }
}
