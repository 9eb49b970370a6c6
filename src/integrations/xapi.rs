//! Conversion of a session to xAPI statements.
//!
//! xAPI 1.0.3, Part Two: <https://github.com/adlnet/xAPI-Spec/blob/master/xAPI-Data.md>. There is one statement for
//! the start of the session, one for each stage, each answer and each rated item of the questionnaire, and one for
//! the end. Statement ids are derived from the session, so a statement that is sent twice is stored once.

use super::identity::{Pseudonyms, part_id, session_id};
use super::iri;
use jiff::{SignedDuration, Timestamp};
use serde_json::{Map, Value as Json, json};
use typodont_core::tick::TICK_S;
use typodont_exercise::scenario::Questionnaire;
use typodont_report::{
    AnswerResultFile, QuestionnaireFile, RatingFile, SessionFile, StageResultFile, VerificationStatus,
};

/// Language tag of titles: "undetermined", because no file states the language in which an exercise was written.
const LANGUAGE: &str = "und";

/// Number of scale points assumed for a questionnaire whose wording is not available.
const DEFAULT_STEPS: u8 = 5;

/// Maximum number of scale points of a questionnaire.
const STEPS_MAX: u8 = 11;

/// Naming scheme for a school's people, stations and activities.
#[derive(Clone)]
pub struct XapiNaming {
    /// Home page of the accounts and prefix of activity IRIs; without a trailing slash.
    home_page: String,
    pub pseudonyms: Pseudonyms,
    /// Name of the station, written as the statement's platform.
    pub platform: Option<String>,
}

impl XapiNaming {
    /// Creates a scheme with plain participant codes and no platform.
    ///
    /// # Errors
    ///
    /// Returns a message when `home_page` is not an absolute http(s) URL without user, query or fragment.
    pub fn with_home_page(home_page: &str) -> Result<XapiNaming, String> {
        Ok(XapiNaming {
            home_page: iri::parse_home_page(home_page)?,
            pseudonyms: Pseudonyms::plain_codes(),
            platform: None,
        })
    }

    /// Returns the IRI of an activity. The parts may be arbitrary text.
    fn activity(&self, parts: &[&str]) -> String {
        parts.iter().fold(format!("{}/typodont", self.home_page), |path, part| path + "/" + &iri::percent_encode(part))
    }
}

/// Returns all statements of a session in chronological order. `wording` is the questionnaire's text, where it is
/// available; `status` is written into the last statement.
pub fn statements(
    session: &SessionFile,
    status: &VerificationStatus,
    naming: &XapiNaming,
    wording: Option<&Questionnaire>,
) -> Vec<Json> {
    let builder = StatementBuilder { session, status, naming, id: session_id(session) };
    let mut statements = vec![builder.initialized()];
    for stage in &session.stages {
        statements.extend(stage.answers.iter().map(|answer| builder.answered(stage, answer)));
        statements.push(builder.stage(stage));
    }
    if let Some(questionnaire) = &session.questionnaire {
        let given = questionnaire.items.iter().filter_map(|item| builder.rating(questionnaire, item, wording));
        statements.extend(given);
    }
    statements.push(builder.ended());
    statements
}

struct StatementBuilder<'a> {
    session: &'a SessionFile,
    status: &'a VerificationStatus,
    naming: &'a XapiNaming,
    id: String,
}

impl StatementBuilder<'_> {
    fn initialized(&self) -> Json {
        self.statement("began", verb("initialized"), self.scenario(), Json::Null, Some(0.0), Vec::new())
    }

    fn stage(&self, stage: &StageResultFile) -> Json {
        let done = stage.ended_by != "abort";
        let result = json!({
            "completion": done,
            "duration": duration(stage.ended_s - stage.started_s),
            "extensions": { iri::extension("ended-by"): stage.ended_by },
        });
        let part = format!("stage/{}", stage.id);
        self.statement(
            &part,
            verb("completed"),
            self.stage_activity(stage),
            result,
            Some(stage.ended_s),
            vec![self.scenario()],
        )
    }

    fn answered(&self, stage: &StageResultFile, answer: &AnswerResultFile) -> Json {
        let (kind, pattern) = match &answer.value {
            Json::Bool(_) => ("true-false", true),
            Json::Number(_) => ("numeric", true),
            _ => ("fill-in", true),
        };
        let mut definition =
            self.definition("cmi.interaction", if answer.text.is_empty() { &answer.question } else { &answer.text });
        definition.insert("interactionType".into(), json!(kind));
        if let Some(truth) = word(&answer.truth).filter(|_| pattern) {
            definition.insert("correctResponsesPattern".into(), json!([truth]));
        }
        let activity = self.naming.activity(&[
            "scenario",
            &self.session.scenario.id,
            "stage",
            &stage.id,
            "question",
            &answer.question,
        ]);
        let mut result = Map::new();
        result.insert("response".into(), json!(word(&answer.value).unwrap_or_default()));
        if let Some(right) = answer.right {
            result.insert("success".into(), json!(right));
        }
        result.insert("duration".into(), json!(duration(answer.at_s - stage.started_s)));
        if let Some(level) = answer.level {
            result.insert("extensions".into(), json!({ iri::extension("stiffness-level"): level }));
        }
        let object = json!({ "objectType": "Activity", "id": activity, "definition": definition });
        let part = format!("stage/{}/answer/{}", stage.id, answer.question);
        self.statement(
            &part,
            verb("answered"),
            object,
            result.into(),
            Some(answer.at_s),
            vec![self.stage_activity(stage)],
        )
    }

    /// Builds the statement for one questionnaire item on its Likert scale; `None` where the item was not answered.
    fn rating(&self, of: &QuestionnaireFile, item: &RatingFile, wording: Option<&Questionnaire>) -> Option<Json> {
        // Only whole scale points; other values can occur in sessions entered by hand.
        let value = item.value.filter(|v| v.fract() == 0.0 && (1.0..=f64::from(STEPS_MAX)).contains(v))?;
        let own = wording.and_then(|w| w.items().find(|i| i.id == item.id));
        let steps = wording.map_or(DEFAULT_STEPS, |w| w.steps).max(value as u8);
        let step = |n: u8| {
            let meaning = wording.filter(|_| n == 1 || n == steps).map(|w| if n == 1 { &w.lowest } else { &w.highest });
            let text = meaning.map_or_else(|| n.to_string(), |m| format!("{n} – {m}"));
            json!({ "id": format!("likert_{n}"), "description": { LANGUAGE: text } })
        };
        let mut definition = self.definition("cmi.interaction", own.map_or(&item.id, |i| &i.text));
        definition.insert("interactionType".into(), json!("likert"));
        definition.insert("scale".into(), (1..=steps).map(step).collect());
        let object = json!({
            "objectType": "Activity",
            "id": self.naming.activity(&["questionnaire", &of.id, &item.id]),
            "definition": definition,
        });
        let counted = item.counted.map(|c| json!({ iri::extension("counted"): c }));
        let result = json!({
            "response": format!("likert_{value}"),
            "score": { "raw": value, "min": 1, "max": steps },
            "extensions": counted.unwrap_or_else(|| json!({})),
        });
        let survey = json!({
            "objectType": "Activity",
            "id": self.naming.activity(&["questionnaire", &of.id]),
            "definition": self.definition("assessment", wording.map_or(&of.id, |w| &w.title)),
        });
        let part = format!("questionnaire/{}/{}", of.id, item.id);
        Some(self.statement(&part, verb("answered"), object, result, Some(self.length()), vec![survey]))
    }

    /// Builds the final statement, with all metrics: passed or failed if the session is graded, otherwise completed
    /// or terminated.
    fn ended(&self) -> Json {
        let whole = matches!(self.session.ended_because.as_str(), "" | "complete");
        let mut extensions: Map<String, Json> = self
            .session
            .metrics
            .iter()
            .filter_map(|(name, value)| Some((iri::metric(name), json!((*value)?))))
            .collect();
        extensions.insert(iri::extension("scorer-version"), json!(self.session.scorer_version));
        extensions.insert(iri::extension("verification"), json!(self.status.name()));
        if !self.status.is_verified() {
            extensions.insert(iri::extension("verification-note"), json!(self.status.note()));
        }
        let mut result = Map::new();
        result.insert("completion".into(), json!(whole));
        result.insert("duration".into(), json!(duration(self.length())));
        let name = match &self.session.grade {
            Some(grade) => {
                if !self.status.differs() {
                    result.insert("success".into(), json!(grade.passed));
                }
                if grade.max_points > 0.0 && !self.status.differs() {
                    let raw = grade.points.clamp(0.0, grade.max_points);
                    let scaled = (raw / grade.max_points).clamp(-1.0, 1.0);
                    result.insert(
                        "score".into(),
                        json!({ "scaled": scaled, "raw": raw, "min": 0.0, "max": grade.max_points }),
                    );
                }
                extensions.insert(iri::extension("hard-fails"), json!(grade.hard_fails));
                match (self.status.differs(), grade.passed) {
                    // A result that its recording does not give is neither.
                    (true, _) if whole => "completed",
                    (true, _) => "terminated",
                    (false, true) => "passed",
                    (false, false) => "failed",
                }
            }
            None if whole => "completed",
            None => "terminated",
        };
        result.insert("extensions".into(), extensions.into());
        // Another scorer version or another result of the verification yields a separate statement, not a changed one.
        let part = match self.status {
            VerificationStatus::Verified => format!("ended/scorer-{}", self.session.scorer_version),
            status => format!("ended/scorer-{}/{}", self.session.scorer_version, status.name()),
        };
        self.statement(&part, verb(name), self.scenario(), result.into(), Some(self.length()), Vec::new())
    }

    /// Builds a statement. `at` is the time since the start of the session, s.
    fn statement(
        &self,
        part: &str,
        verb: Json,
        object: Json,
        result: Json,
        at: Option<f64>,
        parents: Vec<Json>,
    ) -> Json {
        // The actor is part of the identity: another home page or pseudonym yields another statement.
        let actor = self.naming.pseudonyms.name_for(&self.session.participant, &self.id);
        let id = part_id(&self.id, &format!("{}\n{actor}\n{part}", self.naming.home_page));
        let mut context = Map::new();
        context.insert("registration".into(), json!(self.id));
        if let Some(platform) = &self.naming.platform {
            context.insert("platform".into(), json!(platform));
        }
        let mut activities = Map::new();
        if !parents.is_empty() {
            activities.insert("parent".into(), parents.into());
        }
        activities.insert("grouping".into(), json!([self.scenario()]));
        context.insert("contextActivities".into(), activities.into());
        let mut extensions = Map::new();
        for (name, text) in
            [("typodont-version", &self.session.typodont_version), ("scenario-sha256", &self.session.scenario.sha256)]
        {
            if !text.is_empty() {
                extensions.insert(iri::extension(name), json!(text));
            }
        }
        if !extensions.is_empty() {
            context.insert("extensions".into(), extensions.into());
        }
        let mut statement = Map::new();
        statement.insert("id".into(), json!(id));
        statement.insert(
            "actor".into(),
            json!({ "objectType": "Agent", "account": { "homePage": self.naming.home_page, "name": actor } }),
        );
        statement.insert("verb".into(), verb);
        statement.insert("object".into(), object);
        if !result.is_null() {
            statement.insert("result".into(), result);
        }
        statement.insert("context".into(), context.into());
        if let Some(timestamp) = at.and_then(|s| self.timestamp(s)) {
            statement.insert("timestamp".into(), json!(timestamp));
        }
        statement.into()
    }

    fn scenario(&self) -> Json {
        let scenario = &self.session.scenario;
        json!({
            "objectType": "Activity",
            "id": self.naming.activity(&["scenario", &scenario.id]),
            "definition": self.definition("simulation", if scenario.title.is_empty() { &scenario.id } else { &scenario.title }),
        })
    }

    fn stage_activity(&self, stage: &StageResultFile) -> Json {
        json!({
            "objectType": "Activity",
            "id": self.naming.activity(&["scenario", &self.session.scenario.id, "stage", &stage.id]),
            "definition": self.definition("module", if stage.title.is_empty() { &stage.id } else { &stage.title }),
        })
    }

    fn definition(&self, kind: &str, name: &str) -> Map<String, Json> {
        let mut definition = Map::new();
        definition.insert("type".into(), json!(format!("http://adlnet.gov/expapi/activities/{kind}")));
        definition.insert("name".into(), json!({ LANGUAGE: name }));
        definition
    }

    /// Returns the duration of the session, s.
    fn length(&self) -> f64 {
        match self.session.servo.ticks {
            0 => self.session.stages.last().map_or(0.0, |s| s.ended_s),
            ticks => ticks as f64 * TICK_S,
        }
    }

    /// Converts a time since the start of the session, s, to RFC 3339 with milliseconds; `None` if the start is
    /// unknown.
    fn timestamp(&self, seconds: f64) -> Option<String> {
        let started: Timestamp = self.session.started.parse().ok()?;
        let moment = started.checked_add(SignedDuration::from_millis((seconds * 1000.0).round() as i64)).ok()?;
        Some(moment.to_string())
    }
}

fn verb(name: &str) -> Json {
    json!({ "id": format!("http://adlnet.gov/expapi/verbs/{name}"), "display": { "en": name } })
}

/// Formats an ISO 8601 duration to hundredths of a second, the precision at which xAPI compares durations.
fn duration(seconds: f64) -> String {
    format!("PT{}S", (seconds.max(0.0) * 100.0).round() / 100.0)
}

/// Converts an answer to text; `None` for null.
fn word(value: &Json) -> Option<String> {
    match value {
        Json::Null => None,
        Json::String(text) => Some(text.clone()),
        other => Some(other.to_string()),
    }
}
