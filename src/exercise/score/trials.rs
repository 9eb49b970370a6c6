//! Trials in which the site of the caries was drawn: the share of correct answers, corrected for chance.
//!
//! Takes a scenario, its workpiece and the outcome of a session. Gives counts, the measures of
//! [`OF_DRAWS`](crate::scenario::metric::OF_DRAWS), and the tissue that a possible site felt like. A person who guesses
//! has an expected corrected result of 0, however often and however fast the guesses are made.

use crate::record::Replay;
use crate::scenario::metric_id::TrialMetric;
use crate::scenario::{QuestionKind, Scenario, Stage, Workpiece, anatomy_tissues};
use crate::session::{AnswerRecord, SessionOutcome, StageResult};
use typodont_core::frame::Vec3;
use typodont_core::statistics;
use typodont_core::tick::Tick;
use typodont_core::volume::Label;

/// Answers of all trials of a session.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TrialSummary {
    pub correct: usize,
    pub incorrect: usize,
    /// Trials without an answer, including those that were not reached.
    pub unanswered: usize,
    /// Sum over all trials of the share of correct answers that a person who guesses expects.
    chance_sum: f64,
    /// Sum over the answered trials of their value: 1 for a correct answer, −c/(1−c) for an incorrect one, times the
    /// stiffness at the time of the answer; `None` without stiffness steps.
    level_sum: Option<f64>,
    /// Sum of the times from the start of a trial to its answer, s.
    time_sum: f64,
    /// Tick of the first incorrect answer, with the position of the caries, tooth space, mm.
    pub first_error: Option<(Tick, Vec3)>,
}

impl TrialSummary {
    /// Returns the summary of a session; `None` if the exercise has no draw.
    pub fn of(scenario: &Scenario, workpiece: &Workpiece, outcome: &SessionOutcome) -> Option<TrialSummary> {
        let mut summary = TrialSummary::default();
        for (index, stage) in scenario.stages.iter().enumerate().filter(|(_, stage)| stage.draw.is_some()) {
            let drawn = workpiece.drawn.get(index).copied().flatten();
            let place = drawn.map(|lesion| workpiece.lesions[lesion].centre);
            summary.add(stage, outcome.stages.get(index), chance(stage, workpiece), place);
        }
        (summary.trials() > 0).then_some(summary)
    }

    /// Adds a trial: its result, if it was reached, and the position of the caries.
    fn add(&mut self, stage: &Stage, result: Option<&StageResult>, chance: f64, place: Option<Vec3>) {
        self.chance_sum += chance;
        if stage.steps.is_some() {
            self.level_sum.get_or_insert(0.0);
        }
        // One question, or one for the tooth and one for its quadrant: the trial is correct if all its answers are.
        let questions = stage.ask.iter().enumerate().filter(|(_, question)| is_about_draw(stage, &question.kind));
        let answers: Option<Vec<&AnswerRecord>> =
            questions.map(|(place, _)| result?.answers.get(place)?.as_ref()).collect();
        let last = answers.iter().flatten().copied().max_by_key(|answer| answer.at);
        let (Some(answers), Some(last), Some(result)) = (&answers, last, result) else {
            self.unanswered += 1;
            return;
        };
        let is_correct = answers.iter().all(|answer| answer.correct == Some(true));
        let answer = last;
        self.time_sum += answer.at.seconds_since(result.started);
        let value = match is_correct {
            true => 1.0,
            // Where there is nothing to choose from, an answer shows nothing.
            _ if chance >= 1.0 => 0.0,
            _ => -chance / (1.0 - chance),
        };
        match is_correct {
            true => self.correct += 1,
            false => self.incorrect += 1,
        }
        if let (Some(sum), Some((level, _))) = (&mut self.level_sum, answer.step) {
            // The written coefficient: 0.7, not 0.699999988079071.
            *sum += value * (f64::from(level) * 1e6).round() / 1e6;
        }
        if !is_correct && self.first_error.is_none() {
            self.first_error = place.map(|place| (answer.at, place));
        }
    }

    /// Returns the number of trials of the exercise.
    pub fn trials(&self) -> usize {
        self.correct + self.incorrect + self.unanswered
    }

    /// Returns the share of correct answers, 0 to 1, in which a trial without an answer counts as one that is guessed.
    fn share(&self) -> f64 {
        let n = self.trials() as f64;
        (self.correct as f64 + self.unanswered as f64 * self.chance()) / n
    }

    /// Returns the mean share of correct answers that a person who guesses expects.
    fn chance(&self) -> f64 {
        self.chance_sum / self.trials() as f64
    }

    /// Corrects a share of correct answers for guessing; `None` where a guess is always correct.
    fn corrected_pct(&self, share: f64) -> Option<f64> {
        (self.chance() < 1.0).then(|| 100.0 * (share - self.chance()) / (1.0 - self.chance()))
    }

    /// Computes one of the measures of the trials; `None` if it has no value.
    pub fn measure(&self, metric: TrialMetric) -> Option<f64> {
        let interval = || statistics::wilson_interval(self.share(), self.trials());
        let answered = self.correct + self.incorrect;
        match metric {
            TrialMetric::Corrected => self.corrected_pct(self.share()),
            TrialMetric::CorrectedLow => self.corrected_pct(interval()[0]),
            TrialMetric::CorrectedHigh => self.corrected_pct(interval()[1]),
            TrialMetric::TrialsRight => Some(self.correct as f64),
            TrialMetric::LevelCorrected => self.level_sum.map(|sum| sum / self.trials() as f64),
            TrialMetric::AnswerTime => (answered > 0).then(|| self.time_sum / answered as f64),
        }
    }
}

/// Returns the tissue that a touched tissue felt like at a tick. A possible site of a draw feels like its decay in the
/// trials in which it is drawn, and like enamel in all others.
pub fn tissue_felt(scenario: &Scenario, replay: &Replay, touched: Label, at: Tick) -> Label {
    let Some(decay) = scenario.tissues.by_label(touched).and_then(|entry| entry.site_of) else { return touched };
    let workpiece = &replay.workpiece;
    let stage = replay.outcome.stages.iter().rposition(|stage| stage.started <= at);
    let drawn = stage.and_then(|stage| *workpiece.drawn.get(stage)?);
    let is_drawn = drawn.is_some_and(|lesion| workpiece.lesions[lesion].label == touched);
    if is_drawn { decay } else { anatomy_tissues(&scenario.tissues).enamel }
}

fn is_about_draw(stage: &Stage, kind: &QuestionKind) -> bool {
    let (QuestionKind::ToothWith { decay } | QuestionKind::QuadrantOf { decay }) = kind else { return false };
    stage.draw.as_ref().is_some_and(|draw| draw.id == *decay)
}

/// Returns the share of correct answers that a person expects who gives the most frequent correct answer to a stage's
/// questions without examining anything; 0 without a draw.
fn chance(stage: &Stage, workpiece: &Workpiece) -> f64 {
    let Some(draw) = &stage.draw else { return 0.0 };
    let about = || stage.ask.iter().map(|question| &question.kind).filter(|kind| is_about_draw(stage, kind));
    if about().next().is_none() {
        return 0.0;
    }
    let is_asked = |is_meant: fn(&QuestionKind) -> bool| about().any(is_meant);
    let asks_tooth = is_asked(|kind| matches!(kind, QuestionKind::ToothWith { .. }));
    let asks_quadrant = is_asked(|kind| matches!(kind, QuestionKind::QuadrantOf { .. }));
    let sites = workpiece.lesions.iter().filter(|lesion| draw.sites.contains(&lesion.id));
    let answers: Vec<(Option<usize>, Option<u8>)> =
        sites.map(|lesion| (asks_tooth.then_some(lesion.tooth), asks_quadrant.then_some(lesion.quadrant))).collect();
    let most = answers.iter().map(|answer| answers.iter().filter(|other| *other == answer).count()).max();
    most.unwrap_or(0) as f64 / answers.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn summary(correct: usize, incorrect: usize, unanswered: usize, chance: f64) -> TrialSummary {
        let chance_sum = chance * (correct + incorrect + unanswered) as f64;
        TrialSummary { correct, incorrect, unanswered, chance_sum, ..TrialSummary::default() }
    }

    /// Numbers of Wilson's interval from R: `binom::binom.wilson(6, 8)` and `(2, 8)`.
    #[test]
    fn the_share_of_correct_answers_is_corrected_for_chance() {
        let check = |summary: TrialSummary, metric: TrialMetric, expected: f64| {
            let found = summary.measure(metric).unwrap();
            assert!((found - expected).abs() < 1e-4, "{metric:?}: {found} instead of {expected}");
        };
        check(summary(8, 0, 0, 0.5), TrialMetric::Corrected, 100.0);
        check(summary(4, 4, 0, 0.5), TrialMetric::Corrected, 0.0);
        check(summary(2, 6, 0, 0.25), TrialMetric::Corrected, 0.0);
        check(summary(0, 0, 8, 0.25), TrialMetric::Corrected, 0.0);
        check(summary(0, 8, 0, 0.5), TrialMetric::Corrected, -100.0);
        check(summary(3, 1, 4, 0.5), TrialMetric::Corrected, 25.0);
        check(summary(6, 2, 0, 0.5), TrialMetric::CorrectedLow, 100.0 * (2.0 * 0.409_275 - 1.0));
        check(summary(6, 2, 0, 0.5), TrialMetric::CorrectedHigh, 100.0 * (2.0 * 0.928_521 - 1.0));
    }

    /// Sums the result of every possible session of six guesses, each weighted by its probability.
    #[test]
    fn a_guess_has_an_expected_result_of_zero() {
        for chance in [0.5f64, 0.25, 0.125] {
            let mut expected = 0.0f64;
            for outcome in 0..1u32 << 6 {
                let correct = outcome.count_ones() as usize;
                let probability = chance.powi(correct as i32) * (1.0 - chance).powi(6 - correct as i32);
                let result = summary(correct, 6 - correct, 0, chance).measure(TrialMetric::Corrected).unwrap();
                expected += probability * result;
            }
            assert!(expected.abs() < 1e-9, "{chance}: {expected}");
        }
    }
}
