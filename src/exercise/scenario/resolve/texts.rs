//! The texts of an exercise in the languages in which its author wrote them.

use super::super::file::{AnswerFile, ScenarioFile};
use crate::catalog::{InstrumentEntry, TissueTable};
use crate::local_text::{LanguageGap, LocalText, LocalTexts};
use crate::scenario::Questionnaire;

/// Tables whose texts an exercise shows beside its own.
pub(super) struct Tables<'a> {
    pub tissues: &'a TissueTable,
    pub instruments: &'a [InstrumentEntry],
    pub questionnaire: Option<&'a Questionnaire>,
}

/// Returns the texts of an exercise and of its tables, and the places of those texts of the exercise that are translated
/// in two ways, each with the language.
pub(super) fn local_texts(written: &ScenarioFile, tables: &Tables) -> (LocalTexts, Vec<(String, String)>) {
    let mut texts = LocalTexts::default();
    let mut conflicts = Vec::new();
    // The exercise's own texts come first: those of the tables give way to them.
    let own = own_texts(written);
    texts.gap = LanguageGap::find(&own);
    for (path, text) in own {
        conflicts.extend(texts.add(&text).map(|code| (path, code)));
    }
    for stage in &written.stages {
        let trials = stage.draw.as_ref().map_or(1, |draw| draw.trials);
        for number in (1..=trials).filter(|_| trials > 1) {
            texts.add(&stage.title.map(|title| super::stages::trial_title(title, number, trials)));
        }
    }
    for text in table_texts(tables) {
        texts.add(&text);
    }
    (texts, conflicts)
}

/// Texts of the exercise's file, each with its place.
fn own_texts(written: &ScenarioFile) -> Vec<(String, LocalText)> {
    let mut found = vec![("/title".to_string(), written.title.clone()), ("/summary".into(), written.summary.clone())];
    let pictures = written.pictures.iter().enumerate();
    found.extend(pictures.map(|(p, picture)| (format!("/pictures/{p}/title"), picture.title.clone())));
    for (s, stage) in written.stages.iter().enumerate() {
        found.push((format!("/stages/{s}/title"), stage.title.clone()));
        found.push((format!("/stages/{s}/instruction"), stage.instruction.clone()));
        for (q, question) in stage.ask.iter().enumerate() {
            found.push((format!("/stages/{s}/ask/{q}/text"), question.text.clone()));
            if let AnswerFile::Choice(choice) = &question.answer {
                let place = |o: usize| format!("/stages/{s}/ask/{q}/answer/choice/options/{o}/text");
                found.extend(choice.options.iter().enumerate().map(|(o, option)| (place(o), option.text.clone())));
            }
        }
    }
    let zones = written.zones.iter().enumerate();
    found.extend(zones.map(|(z, zone)| (format!("/zones/{z}/title"), zone.title.clone())));
    if let Some(rubric) = &written.rubric {
        let items = rubric.items.iter().enumerate();
        found.extend(items.map(|(i, item)| (format!("/rubric/items/{i}/title"), item.title.clone())));
        let fails = rubric.hard_fails.iter().enumerate();
        found.extend(fails.map(|(f, fail)| (format!("/rubric/hard_fails/{f}/title"), fail.title.clone())));
    }
    found
}

fn table_texts(tables: &Tables) -> Vec<LocalText> {
    let mut found: Vec<LocalText> = tables.tissues.entries().iter().map(|tissue| tissue.title.clone()).collect();
    found.extend(tables.instruments.iter().map(|instrument| instrument.title.clone()));
    if let Some(questionnaire) = tables.questionnaire {
        let Questionnaire { title, instruction, lowest, highest, categories, .. } = questionnaire;
        found.extend([title, instruction, lowest, highest].map(LocalText::clone));
        found.extend(categories.iter().map(|category| category.title.clone()));
        found.extend(questionnaire.items().map(|item| item.text.clone()));
    }
    found
}
