//! Answers as they are typed.

use typodont_exercise::scenario::{Question, QuestionKind};
use typodont_exercise::session::AnswerValue;

/// Parses a typed answer. `None` if the line is empty or the question is not answered in writing; `Some(None)` if the
/// question asks for a number and the line is not one.
pub fn parse_draft(question: &Question, draft: &str) -> Option<Option<AnswerValue>> {
    let line = draft.trim();
    match &question.kind {
        _ if line.is_empty() => None,
        QuestionKind::Number { .. } => {
            let number = line.replace(',', ".").parse().ok().filter(|number: &f64| number.is_finite());
            Some(number.map(AnswerValue::Number))
        }
        QuestionKind::Text => Some(Some(AnswerValue::Word(line.to_string()))),
        _ => None,
    }
}
