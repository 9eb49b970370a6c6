//! Statistics of questionnaires, by statement.

use super::{Cohort, SpreadFile, is_same_person};
use crate::session_file::QuestionnaireFile;
use serde::Serialize;
use std::collections::BTreeMap;
use typodont_core::statistics;
use typodont_core::statistics::{Interval, ValueRange};
use typodont_exercise::record;
use typodont_exercise::record::Recording;
use typodont_exercise::scenario::Questionnaire;
use typodont_formats::Library;

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct QuestionnaireSummary {
    pub id: String,
    /// Empty where the questionnaire's own words are not to be had.
    pub title: String,
    /// Forms with any answer.
    pub n: usize,
    /// Mean of each category, negative statements mirrored.
    pub categories: BTreeMap<String, SpreadFile>,
    /// Mean of each statement as answered.
    pub items: BTreeMap<String, SpreadFile>,
    /// Every statement in its order.
    pub statements: Vec<QuestionnaireStatement>,
    /// Internal consistency (Cronbach's α) of each category and of all statements, as far as it can be computed.
    pub alphas: Vec<AlphaFile>,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct QuestionnaireStatement {
    pub id: String,
    pub category: String,
    /// Empty where the questionnaire's own words are not to be had.
    pub text: String,
    /// True if agreement is a negative judgement; null if neither the wording nor an answer shows it.
    pub mirrored: Option<bool>,
    /// As answered, and as counted.
    pub answered: Option<SpreadFile>,
    pub counted: Option<SpreadFile>,
    /// Number of people by answer.
    pub counts: BTreeMap<String, usize>,
    /// Correlation with the rest of its category, and α of the category without it.
    pub with_rest: Option<f64>,
    pub alpha_without: Option<f64>,
}

/// Cronbach's α.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AlphaFile {
    /// A category; empty for all statements.
    pub category: String,
    /// People who answered every statement that anybody answered; their last form counts.
    pub people: usize,
    pub statements: usize,
    pub alpha: f64,
    pub interval: Interval,
}

impl QuestionnaireSummary {
    pub fn of(cohort: &Cohort, id: &str) -> QuestionnaireSummary {
        let filled: Vec<&QuestionnaireFile> = answered_forms(cohort, id).map(|(_, form)| form).collect();
        let wording = wording(cohort, id);
        let answers = answer_range(&filled, wording.as_ref());
        let mut statements = statements(&filled, wording.as_ref(), answers);
        let last = last_forms(cohort, id);
        let mut alphas = Vec::new();
        let mut categories: Vec<String> = Vec::new();
        for statement in &statements {
            if !categories.contains(&statement.category) {
                categories.push(statement.category.clone());
            }
        }
        for category in categories.iter().map(String::as_str).chain([""]) {
            let asked: Vec<usize> = (0..statements.len())
                .filter(|&s| category.is_empty() || statements[s].category == category)
                .filter(|&s| statements[s].counted.is_some())
                .collect();
            let answers = complete_answers(&last, asked.iter().map(|&s| statements[s].id.as_str()).collect());
            let Some(found) = statistics::cronbach_alpha(&answers) else { continue };
            let statistics::CronbachAlpha { people, statements: count, alpha, interval, items } = found;
            alphas.push(AlphaFile { category: category.into(), people, statements: count, alpha, interval });
            if !category.is_empty() {
                for (&statement, fit) in asked.iter().zip(items) {
                    statements[statement].with_rest = fit.item_rest_correlation;
                    statements[statement].alpha_without = fit.alpha_if_deleted;
                }
            }
        }
        let mut means: BTreeMap<String, Vec<f64>> = BTreeMap::new();
        for (name, value) in filled.iter().flat_map(|form| &form.categories) {
            means.entry(name.clone()).or_default().extend(value);
        }
        let items = statements.iter().filter_map(|s| Some((s.id.clone(), s.answered.clone()?)));
        QuestionnaireSummary {
            id: id.into(),
            title: wording.map_or_else(String::new, |w| w.title.to_string()),
            n: filled.len(),
            categories: means
                .into_iter()
                .filter_map(|(name, values)| Some((name, SpreadFile::of(&values, answers)?)))
                .collect(),
            items: items.collect(),
            statements,
            alphas,
        }
    }
}

/// Every form of a questionnaire with an answer, and whose session it is.
fn answered_forms<'a>(cohort: &'a Cohort, id: &'a str) -> impl Iterator<Item = (usize, &'a QuestionnaireFile)> {
    let form = move |(index, (_, session)): (usize, &'a (std::path::PathBuf, crate::SessionFile))| {
        let form = session.questionnaire.as_ref()?;
        (form.id == id && form.items.iter().any(|i| i.value.is_some())).then_some((index, form))
    };
    cohort.sessions.iter().enumerate().filter_map(form)
}

/// Of each participant the form filled in last: answers must come from different people.
fn last_forms<'a>(cohort: &'a Cohort, id: &'a str) -> Vec<&'a QuestionnaireFile> {
    let mut last: Vec<(usize, &QuestionnaireFile)> = Vec::new();
    for (index, form) in answered_forms(cohort, id) {
        let session = &cohort.sessions[index].1;
        match last.iter_mut().find(|(other, _)| is_same_person(&cohort.sessions[*other].1, session)) {
            Some(found) if cohort.sessions[found.0].1.started <= session.started => *found = (index, form),
            Some(_) => {}
            None => last.push((index, form)),
        }
    }
    last.into_iter().map(|(_, form)| form).collect()
}

/// The answers, as they count, of everyone who answered all these statements.
fn complete_answers(forms: &[&QuestionnaireFile], statements: Vec<&str>) -> Vec<Vec<f64>> {
    let answer = |form: &QuestionnaireFile, id: &str| form.items.iter().find(|i| i.id == id).and_then(|i| i.counted);
    forms.iter().filter_map(|form| statements.iter().map(|id| answer(form, id)).collect()).collect()
}

/// Range of an answer: from 1 to the questionnaire's steps; without its words, to 5 or the greatest answer.
fn answer_range(filled: &[&QuestionnaireFile], wording: Option<&Questionnaire>) -> ValueRange {
    let given = filled.iter().flat_map(|form| &form.items).filter_map(|item| item.value);
    ValueRange::Within(1.0, wording.map_or_else(|| given.fold(5.0, f64::max), |words| f64::from(words.steps)))
}

fn statements(
    filled: &[&QuestionnaireFile],
    wording: Option<&Questionnaire>,
    answers: ValueRange,
) -> Vec<QuestionnaireStatement> {
    let mut ids: Vec<(&str, &str)> = Vec::new();
    for item in filled.iter().flat_map(|form| &form.items) {
        if !ids.contains(&(item.id.as_str(), item.category.as_str())) {
            ids.push((&item.id, &item.category));
        }
    }
    let statement = |(id, category): (&str, &str)| {
        let own = filled.iter().flat_map(|form| &form.items).filter(|i| i.id == id && i.category == category);
        let own: Vec<_> = own.collect();
        let answered: Vec<f64> = own.iter().filter_map(|i| i.value).collect();
        let counted: Vec<f64> = own.iter().filter_map(|i| i.counted).collect();
        let mut counts = BTreeMap::new();
        answered.iter().for_each(|v| *counts.entry(v.to_string()).or_insert(0) += 1);
        let words = wording.and_then(|w| w.items().find(|i| i.id == id));
        let is_answered_mirrored = own.iter().any(|i| i.value.is_some() && i.value != i.counted);
        QuestionnaireStatement {
            id: id.into(),
            category: category.into(),
            text: words.map_or_else(String::new, |w| w.text.to_string()),
            mirrored: words.map(|w| w.negative).or(is_answered_mirrored.then_some(true)),
            answered: SpreadFile::of(&answered, answers),
            counted: SpreadFile::of(&counted, answers),
            counts,
            with_rest: None,
            alpha_without: None,
        }
    };
    ids.into_iter().map(statement).collect()
}

/// A questionnaire's own words: those that ship with the program if they fit, else those in one of the recordings.
pub fn wording(cohort: &Cohort, id: &str) -> Option<Questionnaire> {
    let asked = cohort.sessions.iter().find_map(|(_, s)| s.questionnaire.as_ref().filter(|q| q.id == id))?;
    let fits = |q: &Questionnaire| {
        q.items().count() == asked.items.len() && q.items().zip(&asked.items).all(|(own, given)| own.id == given.id)
    };
    let shipped = is_plain_id(id).then(|| Questionnaire::read(&Library::shipped(), id).ok()).flatten();
    if let Some(shipped) = shipped.filter(&fits) {
        return Some(shipped);
    }
    let with_recording = |(path, session): &&(std::path::PathBuf, crate::SessionFile)| {
        session.questionnaire.as_ref().is_some_and(|q| q.id == id) && path.join(record::FILE_NAME).is_file()
    };
    let (path, _) = cohort.sessions.iter().find(with_recording)?;
    let recording = Recording::read(&path.join(record::FILE_NAME)).ok()?;
    recording.scenario.questionnaire.clone().filter(fits)
}

fn is_plain_id(id: &str) -> bool {
    id.chars().all(|c| c.is_ascii_alphanumeric() || c == '-' || c == '_')
}
