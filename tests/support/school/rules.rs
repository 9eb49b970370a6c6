//! Requirements of xAPI 1.0.3 (Part Two: Data) on a statement, as far as this program's statements use them.

use regex_lite::Regex;
use serde_json::{Map, Value};

/// Interaction types that a definition may have (2.4.4.1).
const INTERACTIONS: [&str; 10] = [
    "true-false",
    "choice",
    "fill-in",
    "long-fill-in",
    "matching",
    "performance",
    "sequencing",
    "likert",
    "numeric",
    "other",
];

/// Every rule that a statement breaks.
pub fn wrong_with(statement: &Value) -> Vec<String> {
    let mut judge = Judge { wrong: Vec::new() };
    judge.statement(statement);
    judge.nulls("", statement);
    judge.wrong.iter().map(|what| format!("{what} in {}", statement["id"])).collect()
}

struct Judge {
    wrong: Vec<String>,
}

impl Judge {
    fn claim(&mut self, holds: bool, what: impl Into<String>) {
        if !holds {
            self.wrong.push(what.into());
        }
    }

    fn matches(&mut self, value: &Value, pattern: &str, what: &str) {
        let holds = value.as_str().is_some_and(|text| Regex::new(pattern).unwrap().is_match(text));
        self.claim(holds, format!("{what} is {value}"));
    }

    /// An object whose keys are among these.
    fn object(&mut self, value: &Value, keys: &[&str], what: &str) -> Map<String, Value> {
        let Some(object) = value.as_object() else {
            self.claim(false, format!("{what} is no object: {value}"));
            return Map::new();
        };
        for key in object.keys() {
            self.claim(keys.contains(&key.as_str()), format!("{what} has a key {key}"));
        }
        object.clone()
    }

    fn iri(&mut self, value: &Value, what: &str) {
        // Absolute, and without what no IRI holds (RFC 3987).
        self.matches(value, "^[a-z][a-z0-9+.-]*:[^\\s<>\"{}|\\\\^`\\x00-\\x20]+$", what);
    }

    fn uuid(&mut self, value: &Value, what: &str) {
        self.matches(value, "^[0-9a-f]{8}-[0-9a-f]{4}-[1-5][0-9a-f]{3}-[89ab][0-9a-f]{3}-[0-9a-f]{12}$", what);
    }

    fn language_map(&mut self, value: &Value, what: &str) {
        let object = value.as_object().cloned().unwrap_or_default();
        self.claim(!object.is_empty(), format!("{what} is no language map: {value}"));
        for (language, text) in &object {
            self.matches(&Value::from(language.as_str()), "^[A-Za-z]{2,8}(-[A-Za-z0-9]{1,8})*$", what);
            self.claim(text.is_string(), format!("{what}: {text}"));
        }
    }

    fn extensions(&mut self, value: &Value, what: &str) {
        let object = value.as_object();
        self.claim(object.is_some(), format!("{what} is no object"));
        for key in object.into_iter().flat_map(Map::keys) {
            self.iri(&Value::from(key.as_str()), what);
        }
    }

    fn statement(&mut self, statement: &Value) {
        let keys = ["id", "actor", "verb", "object", "result", "context", "timestamp"];
        let statement = self.object(statement, &keys, "the statement");
        self.uuid(&statement["id"], "id");
        if let Some(timestamp) = statement.get("timestamp") {
            self.matches(timestamp, r"^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d(\.\d{1,9})?(Z|[+-]\d\d:\d\d)$", "timestamp");
        }
        let actor = self.object(&statement["actor"], &["objectType", "name", "account"], "actor");
        self.claim(actor["objectType"] == "Agent", "actor is no Agent");
        let account = self.object(&actor["account"], &["homePage", "name"], "account");
        self.iri(&account["homePage"], "homePage");
        self.claim(account["name"].as_str().is_some_and(|n| !n.is_empty()), "account has no name");
        let verb = self.object(&statement["verb"], &["id", "display"], "verb");
        self.iri(&verb["id"], "verb");
        self.language_map(&verb["display"], "display");
        self.activity(&statement["object"], "object");
        if let Some(result) = statement.get("result") {
            self.result(result, &statement["object"]);
        }
        if let Some(context) = statement.get("context") {
            self.context(context);
        }
    }

    fn activity(&mut self, activity: &Value, what: &str) {
        let activity = self.object(activity, &["objectType", "id", "definition"], what);
        self.claim(activity["objectType"] == "Activity", format!("{what} is no Activity"));
        self.iri(&activity["id"], what);
        let keys = [
            "name",
            "description",
            "type",
            "moreInfo",
            "extensions",
            "interactionType",
            "correctResponsesPattern",
            "scale",
        ];
        let definition = self.object(&activity["definition"], &keys, "definition");
        self.language_map(&definition["name"], "name");
        self.iri(&definition["type"], "type");
        let kind = definition.get("interactionType").and_then(Value::as_str);
        if let Some(kind) = kind {
            self.claim(INTERACTIONS.contains(&kind), format!("interactionType {kind}"));
        }
        let is_interaction = definition["type"] == "http://adlnet.gov/expapi/activities/cmi.interaction";
        self.claim(is_interaction == kind.is_some(), "an interaction and its type go together");
        if let Some(pattern) = definition.get("correctResponsesPattern") {
            let texts = pattern.as_array().is_some_and(|all| all.iter().all(Value::is_string));
            self.claim(kind.is_some() && texts, "correctResponsesPattern");
        }
        if let Some(scale) = definition.get("scale") {
            self.claim(kind == Some("likert"), "a scale belongs to likert");
            let mut ids = Vec::new();
            for step in scale.as_array().cloned().unwrap_or_default() {
                self.matches(&step["id"], r"^\S+$", "step");
                self.claim(!ids.contains(&step["id"]), "a step stands twice");
                self.language_map(&step["description"], "step");
                ids.push(step["id"].clone());
            }
        }
    }

    fn result(&mut self, result: &Value, object: &Value) {
        let keys = ["score", "success", "completion", "response", "duration", "extensions"];
        let result = self.object(result, &keys, "result");
        for flag in ["success", "completion"] {
            self.claim(result.get(flag).is_none_or(Value::is_boolean), format!("{flag} is {:?}", result.get(flag)));
        }
        self.claim(result.get("response").is_none_or(Value::is_string), "response is no text");
        if let Some(duration) = result.get("duration") {
            let iso = r"^P(?:\d+D)?(?:T(?:\d+H)?(?:\d+M)?(?:\d+(?:\.\d+)?S)?)?$";
            self.matches(duration, iso, "duration");
        }
        if let Some(extensions) = result.get("extensions") {
            self.extensions(extensions, "result's extension");
        }
        if let Some(score) = result.get("score") {
            let score = self.object(score, &["scaled", "raw", "min", "max"], "score");
            self.claim(score.values().all(Value::is_number), "score is no number");
            let number = |name: &str| score.get(name).and_then(Value::as_f64);
            self.claim(number("scaled").is_none_or(|s| (-1.0..=1.0).contains(&s)), "scaled is beyond -1 to 1");
            let within = number("min").unwrap_or(f64::MIN)..=number("max").unwrap_or(f64::MAX);
            self.claim(number("raw").is_none_or(|raw| within.contains(&raw)), "raw is beyond min to max");
        }
        let definition = &object["definition"];
        let response = result.get("response").and_then(Value::as_str).unwrap_or_default();
        match definition["interactionType"].as_str() {
            Some("likert") => {
                let steps = definition["scale"].as_array().cloned().unwrap_or_default();
                self.claim(steps.iter().any(|s| s["id"] == response), format!("no step {response}"));
            }
            Some("true-false") => self.claim(["true", "false"].contains(&response), format!("response {response}")),
            Some("numeric") => self.claim(response.parse::<f64>().is_ok(), format!("response {response}")),
            _ => {}
        }
    }

    fn context(&mut self, context: &Value) {
        let context = self.object(
            context,
            &["registration", "contextActivities", "platform", "language", "extensions"],
            "context",
        );
        self.uuid(&context["registration"], "registration");
        self.claim(context.get("platform").is_none_or(Value::is_string), "platform is no text");
        let activities = self.object(
            &context["contextActivities"],
            &["parent", "grouping", "category", "other"],
            "contextActivities",
        );
        for (kind, list) in activities {
            let list = list.as_array().cloned().unwrap_or_default();
            self.claim(!list.is_empty(), format!("{kind} is empty"));
            list.iter().for_each(|activity| self.activity(activity, &kind));
        }
        if let Some(extensions) = context.get("extensions") {
            self.extensions(extensions, "context's extension");
        }
    }

    /// Null stands nowhere but in extensions (2.2).
    fn nulls(&mut self, at: &str, value: &Value) {
        match value {
            Value::Null => self.claim(false, format!("{at} is null")),
            Value::Array(all) => all.iter().for_each(|v| self.nulls(at, v)),
            Value::Object(all) => {
                for (key, value) in all.iter().filter(|(key, _)| *key != "extensions") {
                    self.nulls(&format!("{at}/{key}"), value);
                }
            }
            _ => {}
        }
    }
}
