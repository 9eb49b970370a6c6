//! What a stage asks, and the ways to answer.

use super::command::Command;
use super::language::Words;
use super::look;
use super::sitting::Sitting;
use crate::scenario::{Question, QuestionKind, Stage};
use crate::session::Answer;
use eframe::egui;

/// Every question of a stage.
pub fn questions_ui(ui: &mut egui::Ui, stage: &Stage, sitting: &mut Sitting, words: &Words, asked: &mut Vec<Command>) {
    let teeth: Vec<(String, u8)> = sitting.scenario.scene.teeth.iter().map(|t| (t.id.clone(), t.fdi)).collect();
    for (place, question) in stage.ask.iter().enumerate() {
        let is_answered = sitting.answered.get(place).copied().unwrap_or_default();
        ui.add_space(10.0);
        ui.strong(&question.text);
        let draft = sitting.drafts.entry(question.id.clone()).or_default();
        let said = sitting.said.get(&question.id);
        ui.push_id(place, |ui| {
            if let Some(answer) = (Asking { question, said, words }).answer_ui(ui, &teeth, draft) {
                asked.push(Command::Answer(question.id.clone(), answer));
            }
        });
        if written(question, draft).is_some_and(|answer| answer.is_none()) {
            ui.colored_label(look::WRONG, words.of("questions.not_a_number"));
        }
        if is_answered {
            let noted = match said {
                Some(Answer::Number(number)) => format!(": {number}"),
                _ => String::new(),
            };
            ui.colored_label(look::GOOD, format!("{}{noted}", words.of("questions.noted")));
        }
    }
}

/// What a line that was typed answers: `None` where nothing is typed or the question is not answered by a line,
/// `Some(None)` where a number is asked and this is none.
pub fn written(question: &Question, draft: &str) -> Option<Option<Answer>> {
    let line = draft.trim();
    match &question.kind {
        _ if line.is_empty() => None,
        QuestionKind::Number { .. } => Some(line.replace(',', ".").parse().ok().map(Answer::Number)),
        QuestionKind::Text => Some(Some(Answer::Word(line.to_string()))),
        _ => None,
    }
}

/// One question with what was last said to it.
struct Asking<'a> {
    question: &'a Question,
    said: Option<&'a Answer>,
    words: &'a Words,
}

impl Asking<'_> {
    /// The ways to answer; what was answered now.
    fn answer_ui(&self, ui: &mut egui::Ui, teeth: &[(String, u8)], draft: &mut String) -> Option<Answer> {
        let words = self.words;
        match &self.question.kind {
            QuestionKind::ToothWith { .. } => {
                let sides = [words.of("questions.left_tooth"), words.of("questions.right_tooth")];
                let title = |place: usize, fdi: u8| match teeth.len() {
                    2 => format!("{} ({fdi})", sides[place.min(1)]),
                    _ => fdi.to_string(),
                };
                let options = teeth.iter().enumerate().map(|(i, (id, fdi))| (Answer::Word(id.clone()), title(i, *fdi)));
                self.buttons(ui, options)
            }
            QuestionKind::QuadrantOf { .. } => self.quadrants(ui),
            QuestionKind::Choice { options, .. } => {
                self.buttons(ui, options.iter().map(|(id, title)| (Answer::Word(id.clone()), title.clone())))
            }
            QuestionKind::YesNo { .. } => {
                let options = [(true, "questions.yes"), (false, "questions.no")];
                self.buttons(ui, options.into_iter().map(|(yes, key)| (Answer::YesNo(yes), words.of(key).to_string())))
            }
            QuestionKind::Number { unit, .. } => self.line(ui, draft, unit),
            QuestionKind::Text => self.line(ui, draft, ""),
        }
    }

    fn buttons(&self, ui: &mut egui::Ui, options: impl Iterator<Item = (Answer, String)>) -> Option<Answer> {
        let mut chosen = None;
        ui.horizontal_wrapped(|ui| {
            for (answer, title) in options {
                if self.button(ui, &answer, &title, egui::Vec2::ZERO) {
                    chosen = Some(answer);
                }
            }
        });
        chosen
    }

    /// Quarters as they lie when one looks from above: 1 and 2 away from the trainee.
    fn quadrants(&self, ui: &mut egui::Ui) -> Option<Answer> {
        let mut chosen = None;
        ui.weak(self.words.of("questions.from_above"));
        egui::Grid::new("quadrants").spacing([6.0, 6.0]).show(ui, |ui| {
            for row in [[1u8, 2], [3, 4]] {
                for quadrant in row {
                    let answer = Answer::Quadrant(quadrant);
                    if self.button(ui, &answer, &quadrant.to_string(), egui::vec2(64.0, 44.0)) {
                        chosen = Some(answer);
                    }
                }
                ui.end_row();
            }
        });
        chosen
    }

    /// A button that stays marked while its answer is the one that was said; true when it is clicked.
    fn button(&self, ui: &mut egui::Ui, answer: &Answer, title: &str, least: egui::Vec2) -> bool {
        let is_said = self.said == Some(answer);
        let button = ui.add(egui::Button::selectable(is_said, title).frame_when_inactive(true).min_size(least));
        button.widget_info(|| {
            let name = format!("{}: {title}", self.question.text);
            egui::WidgetInfo::selected(egui::Role::RadioButton, true, is_said, name)
        });
        button.clicked()
    }

    /// A line to write on; what was written when it is said.
    fn line(&self, ui: &mut egui::Ui, draft: &mut String, unit: &str) -> Option<Answer> {
        let mut is_said = false;
        ui.horizontal(|ui| {
            let line = ui.add(egui::TextEdit::singleline(draft).desired_width(150.0));
            line.widget_info(|| egui::WidgetInfo::labeled(egui::Role::TextInput, true, &self.question.text));
            ui.label(unit);
            let is_entered = line.lost_focus() && ui.input(|input| input.key_pressed(egui::Key::Enter));
            is_said = ui.button(self.words.of("questions.say")).clicked() || is_entered;
        });
        written(self.question, draft).flatten().filter(|_| is_said)
    }
}
