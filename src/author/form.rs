//! What the schema says of a place in a scenario: its kind, its range, and what it is for.
//!
//! A form drawn from it has a field for every key that can be written, also for those that come with a later version.

use crate::content::{json, pointer};
use crate::scenario::file::ScenarioFile;
use serde_json::Value;

/// The schema of scenarios.
#[derive(Clone, Debug)]
pub struct Form {
    root: Value,
}

/// What can be written at one place.
#[derive(Clone, Debug)]
pub struct Field<'f> {
    pub kind: Kind<'f>,
    /// What it is for, in the schema's words.
    pub about: String,
    /// What counts where nothing is written.
    pub usual: Option<&'f Value>,
    /// May be null.
    pub may_be_null: bool,
}

#[derive(Clone, Debug)]
pub enum Kind<'f> {
    Text {
        /// Most letters.
        most: Option<u64>,
        /// Only small letters, digits, hyphens and underscores.
        is_id: bool,
    },
    Number {
        least: Option<f64>,
        most: Option<f64>,
        /// The least itself is not allowed.
        is_open: bool,
        is_whole: bool,
    },
    YesNo,
    /// One of several shapes, each under its word.
    Choice(Vec<Variant<'f>>),
    /// Keys, whether each must be there, and their schemas.
    Object(Vec<(&'f str, bool, &'f Value)>),
    /// Keys of the author's own, and what each holds.
    Map(&'f Value),
    List {
        of: &'f Value,
        least: u64,
        most: Option<u64>,
    },
    /// Nothing that a form could show.
    Other,
}

/// One of several shapes.
#[derive(Clone, Debug)]
pub struct Variant<'f> {
    pub word: &'f str,
    pub about: String,
    /// What stands under the word, where it is more than the word itself.
    pub holds: Option<&'f Value>,
}

impl Default for Form {
    fn default() -> Form {
        Form { root: json::schema_of::<ScenarioFile>().as_value().clone() }
    }
}

impl Form {
    pub fn root(&self) -> &Value {
        &self.root
    }

    /// What a schema asks for.
    pub fn field<'f>(&'f self, schema: &'f Value) -> Field<'f> {
        let usual = schema.get("default").filter(|v| !v.is_null());
        let (inner, may_be_null) = self.followed(schema);
        let about = about(schema).or(about(inner)).unwrap_or_default();
        let is_nullable = may_be_null || has_type(inner, "null");
        Field { kind: self.kind(inner), about, usual: usual.or(inner.get("default")), may_be_null: is_nullable }
    }

    /// The schema of what stands at a pointer of a scenario; `None` where nothing can stand. Asked for every field of every
    /// picture: it looks, and makes nothing.
    pub fn at(&self, pointer: &str) -> Option<&Value> {
        pointer::names(pointer).try_fold(&self.root, |schema, name| {
            let schema = self.followed(schema).0;
            if let Some(shapes) = schema.get("oneOf").and_then(Value::as_array) {
                let of = |shape| self.followed(shape).0.get("properties")?.get(&name);
                return shapes.iter().find_map(of);
            }
            match schema.get("properties") {
                Some(properties) => properties.get(&name),
                None => schema.get("additionalProperties").filter(|inner| inner.is_object()).or(schema.get("items")),
            }
        })
    }

    /// Through references and "or null" to the schema that says something.
    fn followed<'f>(&'f self, mut schema: &'f Value) -> (&'f Value, bool) {
        let mut may_be_null = false;
        loop {
            if let Some(name) = schema.get("$ref").and_then(Value::as_str)
                && let Some(target) = name.strip_prefix('#').and_then(|pointer| self.root.pointer(pointer))
            {
                schema = target;
            } else if let Some([one, other]) = schema.get("anyOf").and_then(Value::as_array).map(Vec::as_slice)
                && has_type(other, "null")
            {
                (schema, may_be_null) = (one, true);
            } else {
                return (schema, may_be_null);
            }
        }
    }

    fn kind<'f>(&'f self, schema: &'f Value) -> Kind<'f> {
        let number = |key: &str| schema.get(key).and_then(Value::as_f64);
        if let Some(shapes) = schema.get("oneOf").and_then(Value::as_array) {
            return Kind::Choice(shapes.iter().filter_map(|shape| self.variant(shape)).flatten().collect());
        }
        if let Some(words) = schema.get("enum").and_then(Value::as_array) {
            return Kind::Choice(words.iter().filter_map(Value::as_str).map(word).collect());
        }
        match schema {
            s if has_type(s, "boolean") => Kind::YesNo,
            s if has_type(s, "number") || has_type(s, "integer") => Kind::Number {
                least: number("minimum").or(number("exclusiveMinimum")),
                most: number("maximum"),
                is_open: number("exclusiveMinimum").is_some(),
                is_whole: has_type(s, "integer"),
            },
            s if has_type(s, "string") => Kind::Text {
                most: s.get("maxLength").and_then(Value::as_u64),
                is_id: s.get("pattern").and_then(Value::as_str) == Some("^[a-z0-9_-]+$"),
            },
            s if has_type(s, "array") => Kind::List {
                of: s.get("items").unwrap_or(&Value::Null),
                least: s.get("minItems").and_then(Value::as_u64).unwrap_or(0),
                most: s.get("maxItems").and_then(Value::as_u64),
            },
            s if has_type(s, "object") => match s.get("properties").and_then(Value::as_object) {
                Some(properties) => {
                    let required: Vec<&str> = words_of(s.get("required"));
                    let mut keys: Vec<_> =
                        properties.iter().map(|(k, v)| (k.as_str(), required.contains(&k.as_str()), v)).collect();
                    keys.sort_by_cached_key(|(key, ..)| super::layout::place_of(key));
                    Kind::Object(keys)
                }
                None => s.get("additionalProperties").map_or(Kind::Other, Kind::Map),
            },
            _ => Kind::Other,
        }
    }

    /// A word, several words, or an object with one key.
    fn variant<'f>(&'f self, shape: &'f Value) -> Option<Vec<Variant<'f>>> {
        let shape = self.followed(shape).0;
        let about = about(shape).unwrap_or_default();
        if let Some(only) = shape.get("const").and_then(Value::as_str) {
            return Some(vec![Variant { word: only, about, holds: None }]);
        }
        if let Some(words) = shape.get("enum") {
            return Some(words_of(Some(words)).into_iter().map(word).collect());
        }
        let (key, inner) = shape.get("properties")?.as_object()?.iter().next()?;
        Some(vec![Variant { word: key, about, holds: Some(inner) }])
    }
}

fn word(word: &str) -> Variant<'_> {
    Variant { word, about: String::new(), holds: None }
}

fn words_of(list: Option<&Value>) -> Vec<&str> {
    list.and_then(Value::as_array).into_iter().flatten().filter_map(Value::as_str).collect()
}

fn has_type(schema: &Value, name: &str) -> bool {
    match schema.get("type") {
        Some(Value::String(own)) => own == name,
        Some(Value::Array(own)) => own.iter().any(|n| n == name),
        _ => false,
    }
}

fn about(schema: &Value) -> Option<String> {
    Some(schema.get("description")?.as_str()?.split_whitespace().collect::<Vec<_>>().join(" "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_place_of_a_scenario_has_a_field_of_a_kind() {
        // Aim: the form leaves nothing out. Method: from the root through every key, variant and entry.
        let form = Form::default();
        let mut open = vec![form.root()];
        let mut fields = 0;
        while let Some(schema) = open.pop() {
            fields += 1;
            assert!(fields < 2000, "schemas that hold themselves");
            match form.field(schema).kind {
                Kind::Object(keys) => open.extend(keys.into_iter().map(|(_, _, inner)| inner)),
                Kind::Choice(variants) => open.extend(variants.into_iter().filter_map(|v| v.holds)),
                Kind::Map(inner) | Kind::List { of: inner, .. } => open.push(inner),
                Kind::Other => panic!("no field for {schema}"),
                Kind::Text { .. } | Kind::Number { .. } | Kind::YesNo => {}
            }
        }
        assert!(fields > 150, "{fields}");
    }

    #[test]
    fn a_number_has_its_range_its_usual_value_and_its_purpose() {
        let form = Form::default();
        let field = form.field(form.at("/measures/near_mm").unwrap());
        assert!(matches!(field.kind, Kind::Number { least: Some(0.1), most: Some(10.0), .. }), "{:?}", field.kind);
        assert_eq!(field.usual.and_then(Value::as_f64), Some(1.0));
        assert!(field.about.starts_with("Distance from the pulp"));
        let limit = form.field(form.at("/stages/0/time_limit_s").unwrap());
        assert!(limit.may_be_null);
        assert!(form.at("/scene/jaw/tooth/decay/0/shape/sphere/radius_mm").is_some());
        assert!(form.at("/stages/0/nothing").is_none());
    }
}
