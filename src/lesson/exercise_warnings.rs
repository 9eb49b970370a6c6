//! Warnings about an exercise that can be run, but may not be fair.
//!
//! Takes a resolved exercise. Gives warnings with their place in the exercise's file. Never changes anything.

use std::sync::Arc;
use typodont_exercise::local_text::LanguageGap;
use typodont_exercise::scenario::{QuestionKind, Scenario, Workpiece};
use typodont_exercise::score::{decay_in_zones, decay_on_vulnerable_mm3, idle_grade};

/// Points of 100 that a trainee who does nothing may earn before the rubric is reported.
pub const IDLE_POINTS_MAX: f64 = 10.0;

/// Seeds that are tried where the seed determines the caries: each gives another place or depth.
const DRAWN: std::ops::RangeInclusive<u64> = 1..=4;

/// A warning about an exercise.
#[derive(Clone, Debug, PartialEq)]
pub struct ExerciseWarning {
    /// Stable name of the warning, in kebab case.
    pub code: &'static str,
    /// JSON pointer to the part of the exercise's file.
    pub path: String,
    pub message: String,
    pub help: String,
}

/// Returns the warnings about an exercise: answers that can be guessed, caries within protected zones or on the pulp, and
/// points that are paid for doing nothing.
///
/// # Errors
/// Returns a message if the workpiece cannot be made.
pub fn exercise_warnings(scenario: &Arc<Scenario>) -> Result<Vec<ExerciseWarning>, String> {
    let seeds = if scenario.is_workpiece_drawn() { DRAWN } else { 1..=1 };
    let mut found = guessable_answers(scenario);
    found.extend(language_warning(scenario));
    for seed in seeds {
        let workpiece = Workpiece::make(scenario, seed).map_err(|e| e.to_string())?;
        let mut here = caries_warnings(scenario, &workpiece);
        if seed == 1 {
            here.extend(idle_warning(scenario, &workpiece, seed)?);
        }
        // The volumes differ from seed to seed: one warning for each place suffices.
        here.retain(|w| !found.iter().any(|known| (known.code, &known.path) == (w.code, &w.path)));
        found.append(&mut here);
    }
    Ok(found)
}

/// Returns the warnings about questions that are asked once and whose answer is one of a few: a trainee who guesses is
/// often right, and no measure corrects the result for chance, as those of a draw do.
fn guessable_answers(scenario: &Scenario) -> Vec<ExerciseWarning> {
    let mut found = Vec::new();
    for (index, stage) in scenario.stages.iter().enumerate().filter(|(_, stage)| stage.draw.is_none()) {
        for (number, question) in stage.ask.iter().enumerate() {
            let (key, choices, of) = match question.kind {
                QuestionKind::ToothWith { .. } => ("tooth_with", scenario.scene.teeth.len(), "teeth"),
                QuestionKind::QuadrantOf { .. } => ("quadrant_of", 4, "quadrants"),
                _ => continue,
            };
            found.push(ExerciseWarning {
                code: "guessable-answer",
                path: format!("/stages/{}/ask/{number}/answer/{key}", scenario.written_stage(index)),
                message: format!(
                    "the question is asked only once, about {choices} {of}, so a trainee who guesses is right \
                     in 1 of {choices} sessions"
                ),
                help: "add \"draw\" with several possible sites and at least 8 trials to the stage; its results are \
                       corrected for chance"
                    .to_string(),
            });
        }
    }
    found
}

/// Returns a warning if a text lacks a language in which others are written.
fn language_warning(scenario: &Scenario) -> Option<ExerciseWarning> {
    let LanguageGap { path, code } = scenario.texts.gap.clone()?;
    Some(ExerciseWarning {
        code: "missing-translation",
        path,
        message: format!("this text lacks the language \"{code}\", in which others of the exercise are written"),
        help: format!("write it as {{ \"{code}\": \"…\" }} with the other languages, as every text of the exercise"),
    })
}

/// Returns the warnings about caries that lies within a zone that protects tissue, or on the pulp.
pub fn caries_warnings(scenario: &Scenario, workpiece: &Workpiece) -> Vec<ExerciseWarning> {
    let in_zone = decay_in_zones(scenario, workpiece).into_iter().map(|found| ExerciseWarning {
        code: "caries-in-zone",
        path: format!("/zones/{}", found.index),
        message: format!("{:.2} mm³ of caries lies within the protected zone \"{}\"", found.decay_mm3, found.zone),
        help: "only sound tissue of the zone counts as harmed; to protect this caries too, name its tissue as the \
               region of a zone"
            .to_string(),
    });
    let on_pulp = decay_on_vulnerable_mm3(scenario, workpiece);
    let exposes = (on_pulp > 0.0).then(|| ExerciseWarning {
        code: "caries-on-pulp",
        path: "/scene".to_string(),
        message: format!("{on_pulp:.2} mm³ of caries lies directly on the pulp: removing all of the caries exposes it"),
        help: "make the lesion shallower, or allow caries to remain (see the measure decay_cleared_pct)".to_string(),
    });
    in_zone.chain(exposes).collect()
}

/// Returns a warning if the rubric awards points to a trainee who does nothing.
fn idle_warning(scenario: &Arc<Scenario>, workpiece: &Workpiece, seed: u64) -> Result<Option<ExerciseWarning>, String> {
    let Some(grade) = idle_grade(scenario, workpiece, seed)? else { return Ok(None) };
    if grade.points < IDLE_POINTS_MAX {
        return Ok(None);
    }
    let paid = grade.items.iter().enumerate().filter(|(_, item)| item.points > 0.0);
    let titles: Vec<String> = paid.clone().map(|(_, i)| format!("\"{}\" {:.0}", i.title, i.points)).collect();
    let index = paid.map(|(index, _)| index).next().unwrap_or(0);
    Ok(Some(ExerciseWarning {
        code: "idle-points",
        path: format!("/rubric/items/{index}"),
        message: format!("a trainee who does nothing earns {:.0} of 100 points: {}", grade.points, titles.join(", ")),
        help: "add \"counts_with\" to these items, with the measure of the item that pays for the work itself"
            .to_string(),
    }))
}
