//! The schema of each value in a scenario: its kind, range and purpose.
//!
//! A form based on the schema has a field for every permitted key, including the keys of later versions.

use serde_json::Value;
use typodont_exercise::scenario::file::ScenarioFile;
use typodont_formats::{json, pointer};

/// The schema of scenarios.
#[derive(Clone, Debug)]
pub struct SchemaForm {
    root: Value,
}

/// Field for one value of a scenario.
#[derive(Clone, Debug)]
pub struct SchemaField<'f> {
    pub kind: FieldKind<'f>,
    /// Purpose of the value, from the schema's description.
    pub description: String,
    /// Default that applies if the value is omitted.
    pub default: Option<&'f Value>,
    /// True if the value may be null.
    pub is_nullable: bool,
    /// True for a text that may also be written as texts by language.
    pub is_by_language: bool,
}

#[derive(Clone, Debug)]
pub enum FieldKind<'f> {
    Text {
        /// Maximum length, characters.
        max: Option<u64>,
        /// True if only lower-case letters, digits, hyphens and underscores are permitted.
        is_id: bool,
    },
    Number {
        min: Option<f64>,
        max: Option<f64>,
        /// True if the minimum itself is not permitted.
        is_min_exclusive: bool,
        is_integer: bool,
    },
    Boolean,
    /// One of several variants, each with its name.
    Choice(Vec<SchemaVariant<'f>>),
    /// Keys, each with a flag for required keys and with its schema.
    Object(Vec<(&'f str, bool, &'f Value)>),
    /// Keys chosen by the author, and the schema of their values.
    Map(&'f Value),
    List {
        item: &'f Value,
        min: u64,
        max: Option<u64>,
    },
    /// A value that a form cannot show.
    Other,
}

/// One of several variants.
#[derive(Clone, Debug)]
pub struct SchemaVariant<'f> {
    pub name: &'f str,
    pub description: String,
    /// Schema of the variant's content; `None` if the variant consists of its name alone.
    pub schema: Option<&'f Value>,
}

impl Default for SchemaForm {
    fn default() -> SchemaForm {
        SchemaForm { root: json::schema_of::<ScenarioFile>().as_value().clone() }
    }
}

impl SchemaForm {
    pub fn root(&self) -> &Value {
        &self.root
    }

    /// Returns the field for a schema.
    pub fn field<'f>(&'f self, schema: &'f Value) -> SchemaField<'f> {
        let usual = schema.get("default").filter(|v| !v.is_null());
        let (inner, may_be_null) = self.dereference(schema);
        let description = description_of(schema).or(description_of(inner)).unwrap_or_default();
        let is_nullable = may_be_null || has_type(inner, "null");
        let is_by_language = has_type(inner, "string") && has_type(inner, "object");
        let default = usual.or(inner.get("default"));
        SchemaField { kind: self.kind_of(inner), description, default, is_nullable, is_by_language }
    }

    /// Returns the schema at a pointer of a scenario; `None` if no value is permitted there. It is called for every
    /// field in every frame and therefore does not allocate a schema.
    pub fn schema_at(&self, pointer: &str) -> Option<&Value> {
        pointer::tokens(pointer).try_fold(&self.root, |schema, name| {
            let schema = self.dereference(schema).0;
            if let Some(shapes) = schema.get("oneOf").and_then(Value::as_array) {
                let of = |shape| self.dereference(shape).0.get("properties")?.get(&name);
                return shapes.iter().find_map(of);
            }
            match schema.get("properties") {
                Some(properties) => properties.get(&name),
                None => schema.get("additionalProperties").filter(|inner| inner.is_object()).or(schema.get("items")),
            }
        })
    }

    /// Follows references and "or null" to the actual schema; the flag is true if the value may be null.
    fn dereference<'f>(&'f self, mut schema: &'f Value) -> (&'f Value, bool) {
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

    fn kind_of<'f>(&'f self, schema: &'f Value) -> FieldKind<'f> {
        let number = |key: &str| schema.get(key).and_then(Value::as_f64);
        if let Some(shapes) = schema.get("oneOf").and_then(Value::as_array) {
            return FieldKind::Choice(shapes.iter().filter_map(|shape| self.variants_of(shape)).flatten().collect());
        }
        if let Some(words) = schema.get("enum").and_then(Value::as_array) {
            return FieldKind::Choice(words.iter().filter_map(Value::as_str).map(named_variant).collect());
        }
        match schema {
            s if has_type(s, "boolean") => FieldKind::Boolean,
            s if has_type(s, "number") || has_type(s, "integer") => FieldKind::Number {
                min: number("minimum").or(number("exclusiveMinimum")),
                max: number("maximum"),
                is_min_exclusive: number("exclusiveMinimum").is_some(),
                is_integer: has_type(s, "integer"),
            },
            s if has_type(s, "string") => FieldKind::Text {
                max: s.get("maxLength").and_then(Value::as_u64),
                is_id: s.get("pattern").and_then(Value::as_str) == Some("^[a-z0-9_-]+$"),
            },
            s if has_type(s, "array") => FieldKind::List {
                item: s.get("items").unwrap_or(&Value::Null),
                min: s.get("minItems").and_then(Value::as_u64).unwrap_or(0),
                max: s.get("maxItems").and_then(Value::as_u64),
            },
            s if has_type(s, "object") => match s.get("properties").and_then(Value::as_object) {
                Some(properties) => {
                    let required: Vec<&str> = string_list(s.get("required"));
                    let mut keys: Vec<_> =
                        properties.iter().map(|(k, v)| (k.as_str(), required.contains(&k.as_str()), v)).collect();
                    keys.sort_by_cached_key(|(key, ..)| super::json_format::key_order(key));
                    FieldKind::Object(keys)
                }
                None => s.get("additionalProperties").map_or(FieldKind::Other, FieldKind::Map),
            },
            _ => FieldKind::Other,
        }
    }

    /// Returns the variants of a shape: one name, several names, or an object with one key.
    fn variants_of<'f>(&'f self, shape: &'f Value) -> Option<Vec<SchemaVariant<'f>>> {
        let shape = self.dereference(shape).0;
        let description = description_of(shape).unwrap_or_default();
        if let Some(only) = shape.get("const").and_then(Value::as_str) {
            return Some(vec![SchemaVariant { name: only, description, schema: None }]);
        }
        if let Some(words) = shape.get("enum") {
            return Some(string_list(Some(words)).into_iter().map(named_variant).collect());
        }
        let (key, inner) = shape.get("properties")?.as_object()?.iter().next()?;
        Some(vec![SchemaVariant { name: key, description, schema: Some(inner) }])
    }
}

fn named_variant(name: &str) -> SchemaVariant<'_> {
    SchemaVariant { name, description: String::new(), schema: None }
}

fn string_list(list: Option<&Value>) -> Vec<&str> {
    list.and_then(Value::as_array).into_iter().flatten().filter_map(Value::as_str).collect()
}

fn has_type(schema: &Value, name: &str) -> bool {
    match schema.get("type") {
        Some(Value::String(own)) => own == name,
        Some(Value::Array(own)) => own.iter().any(|n| n == name),
        _ => false,
    }
}

fn description_of(schema: &Value) -> Option<String> {
    Some(schema.get("description")?.as_str()?.split_whitespace().collect::<Vec<_>>().join(" "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_place_of_a_scenario_has_a_field_of_a_kind() {
        // Aim: the form has a field for every value. Method: from the root through every key, variant and entry.
        let form = SchemaForm::default();
        let mut open = vec![form.root()];
        let mut fields = 0;
        while let Some(schema) = open.pop() {
            fields += 1;
            assert!(fields < 2000, "schemas that hold themselves");
            match form.field(schema).kind {
                FieldKind::Object(keys) => open.extend(keys.into_iter().map(|(_, _, inner)| inner)),
                FieldKind::Choice(variants) => open.extend(variants.into_iter().filter_map(|v| v.schema)),
                FieldKind::Map(inner) | FieldKind::List { item: inner, .. } => open.push(inner),
                FieldKind::Other => panic!("no field for {schema}"),
                FieldKind::Text { .. } | FieldKind::Number { .. } | FieldKind::Boolean => {}
            }
        }
        assert!(fields > 150, "{fields}");
    }

    #[test]
    fn a_number_has_its_range_its_usual_value_and_its_purpose() {
        let form = SchemaForm::default();
        let field = form.field(form.schema_at("/measures/near_mm").unwrap());
        assert!(matches!(field.kind, FieldKind::Number { min: Some(0.1), max: Some(10.0), .. }), "{:?}", field.kind);
        assert_eq!(field.default.and_then(Value::as_f64), Some(1.0));
        assert!(field.description.starts_with("Distance from the pulp"));
        let limit = form.field(form.schema_at("/stages/0/time_limit_s").unwrap());
        assert!(limit.is_nullable);
        assert!(form.schema_at("/scene/jaw/tooth/decay/0/shape/sphere/radius_mm").is_some());
        assert!(form.schema_at("/stages/0/nothing").is_none());
    }
}
