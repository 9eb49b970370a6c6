//! A session as xAPI statements.
//!
//! xAPI 1.0.3, Part Two: <https://github.com/adlnet/xAPI-Spec/blob/master/xAPI-Data.md>. One statement says that the session began,
//! one for each stage and each answer, one for each statement of the questionnaire, one how it ended. Their ids follow from the
//! session, so that a statement sent twice is one statement.

use super::identity::{Pseudonyms, part_id, session_id};
use super::iri;
use crate::report::{AnswerFile, QuestionnaireFile, RatingFile, SessionFile, StageFile};
use crate::scenario::Questionnaire;
use crate::tick::TICK_S;
use jiff::{SignedDuration, Timestamp};
use serde_json::{Map, Value as Json, json};

/// The language of titles: that of whoever wrote the exercise, which no file says.
const LANGUAGE: &str = "und";

/// The scale of a questionnaire whose own words are not to be had.
const STEPS: u8 = 5;

/// The longest scale that a questionnaire may have.
const STEPS_MAX: u8 = 11;

/// How a school calls its people, places and activities.
#[derive(Clone)]
pub struct Naming {
    /// Home page of the accounts, and where activities are named; without a slash at its end.
    home_page: String,
    pub pseudonyms: Pseudonyms,
    /// Which station it was.
    pub platform: Option<String>,
}

impl Naming {
    /// `Err` says what a home page is.
    pub fn at(home_page: &str) -> Result<Naming, String> {
        Ok(Naming { home_page: iri::home_page(home_page)?, pseudonyms: Pseudonyms::codes(), platform: None })
    }

    /// The name of an activity, from parts that people wrote.
    fn activity(&self, parts: &[&str]) -> String {
        parts.iter().fold(format!("{}/typodont", self.home_page), |path, part| path + "/" + &iri::part(part))
    }
}

/// Everything there is to say of a session, in the order in which it happened. `wording` is that of its questionnaire.
pub fn statements(session: &SessionFile, naming: &Naming, wording: Option<&Questionnaire>) -> Vec<Json> {
    let teller = Teller { session, naming, id: session_id(session) };
    let mut told = vec![teller.began()];
    for stage in &session.stages {
        told.extend(stage.answers.iter().map(|answer| teller.answered(stage, answer)));
        told.push(teller.stage(stage));
    }
    if let Some(questionnaire) = &session.questionnaire {
        let given = questionnaire.items.iter().filter_map(|item| teller.rated(questionnaire, item, wording));
        told.extend(given);
    }
    told.push(teller.ended());
    told
}

struct Teller<'a> {
    session: &'a SessionFile,
    naming: &'a Naming,
    id: String,
}

impl Teller<'_> {
    fn began(&self) -> Json {
        self.statement("began", verb("initialized"), self.scenario(), Json::Null, Some(0.0), Vec::new())
    }

    fn stage(&self, stage: &StageFile) -> Json {
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

    fn answered(&self, stage: &StageFile, answer: &AnswerFile) -> Json {
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

    /// A statement of the questionnaire, on its scale; none where it was not answered.
    fn rated(&self, of: &QuestionnaireFile, item: &RatingFile, wording: Option<&Questionnaire>) -> Option<Json> {
        // A step of a scale; whatever else somebody entered by hand is none.
        let value = item.value.filter(|v| v.fract() == 0.0 && (1.0..=f64::from(STEPS_MAX)).contains(v))?;
        let own = wording.and_then(|w| w.items().find(|i| i.id == item.id));
        let steps = wording.map_or(STEPS, |w| w.steps).max(value as u8);
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

    /// How it ended: passed or failed where there is a grade, else completed or broken off. With every measure.
    fn ended(&self) -> Json {
        let whole = matches!(self.session.ended_because.as_str(), "" | "complete");
        let mut extensions: Map<String, Json> = self
            .session
            .metrics
            .iter()
            .filter_map(|(name, value)| Some((iri::metric(name), json!((*value)?))))
            .collect();
        extensions.insert(iri::extension("scorer-version"), json!(self.session.scorer_version));
        let mut result = Map::new();
        result.insert("completion".into(), json!(whole));
        result.insert("duration".into(), json!(duration(self.length())));
        let name = match &self.session.grade {
            Some(grade) => {
                result.insert("success".into(), json!(grade.passed));
                if grade.max_points > 0.0 {
                    let raw = grade.points.clamp(0.0, grade.max_points);
                    let scaled = (raw / grade.max_points).clamp(-1.0, 1.0);
                    result.insert(
                        "score".into(),
                        json!({ "scaled": scaled, "raw": raw, "min": 0.0, "max": grade.max_points }),
                    );
                }
                extensions.insert(iri::extension("hard-fails"), json!(grade.hard_fails));
                if grade.passed { "passed" } else { "failed" }
            }
            None if whole => "completed",
            None => "terminated",
        };
        result.insert("extensions".into(), extensions.into());
        // Scored by other formulae it is another result, not the same one changed.
        let part = format!("ended/scorer-{}", self.session.scorer_version);
        self.statement(&part, verb(name), self.scenario(), result.into(), Some(self.length()), Vec::new())
    }

    /// A statement; `at` counts seconds from the session's beginning.
    fn statement(
        &self,
        part: &str,
        verb: Json,
        object: Json,
        result: Json,
        at: Option<f64>,
        parents: Vec<Json>,
    ) -> Json {
        // Who says it belongs to it: under another home page or pseudonym it is another statement.
        let actor = self.naming.pseudonyms.of(&self.session.participant, &self.id);
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

    fn stage_activity(&self, stage: &StageFile) -> Json {
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

    /// Length of the session, s.
    fn length(&self) -> f64 {
        match self.session.servo.ticks {
            0 => self.session.stages.last().map_or(0.0, |s| s.ended_s),
            ticks => ticks as f64 * TICK_S,
        }
    }

    /// A moment of the session, RFC 3339 in milliseconds; none of a session whose beginning is not known.
    fn timestamp(&self, seconds: f64) -> Option<String> {
        let started: Timestamp = self.session.started.parse().ok()?;
        let moment = started.checked_add(SignedDuration::from_millis((seconds * 1000.0).round() as i64)).ok()?;
        Some(moment.to_string())
    }
}

fn verb(name: &str) -> Json {
    json!({ "id": format!("http://adlnet.gov/expapi/verbs/{name}"), "display": { "en": name } })
}

/// ISO 8601, in hundredths of a second as xAPI compares them.
fn duration(seconds: f64) -> String {
    format!("PT{}S", (seconds.max(0.0) * 100.0).round() / 100.0)
}

/// An answer as a text; none of none.
fn word(value: &Json) -> Option<String> {
    match value {
        Json::Null => None,
        Json::String(text) => Some(text.clone()),
        other => Some(other.to_string()),
    }
}
