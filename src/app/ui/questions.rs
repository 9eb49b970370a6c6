//! Questions of a stage, and the controls that answer them.

use crate::answer_draft::parse_draft;
use crate::command::{AppCommand, PracticeCommand};
use crate::i18n::Translations;
use crate::lesson_state::LessonState;
use crate::ui::theme;
use crate::ui::ui_anchors::anchor;
use eframe::egui;
use typodont_exercise::local_text::LocalTexts;
use typodont_exercise::scenario::{Question, QuestionKind, SceneLayout, Stage, distal};
use typodont_exercise::session::AnswerValue;

/// Every question of a stage.
pub fn questions_ui(
    ui: &mut egui::Ui,
    stage: &Stage,
    lesson: &LessonState,
    words: &Translations,
    commands: &mut Vec<AppCommand>,
) {
    let scenario = &lesson.scenario;
    let mut teeth: Vec<(String, u8)> = lesson.scenario.scene.teeth.iter().map(|t| (t.id.clone(), t.fdi)).collect();
    if let SceneLayout::Mouth { .. } = scenario.scene.layout {
        // As in a dental chart: the patient's right on the left, the upper jaw first.
        teeth.sort_by_key(|(_, fdi)| match fdi / 10 {
            1 => -i16::from(*fdi),
            2 => i16::from(*fdi),
            4 => 100 - i16::from(*fdi),
            _ => 100 + i16::from(*fdi),
        });
    } else if scenario.scene.is_in_mouth() {
        // As they stand before the trainee, from left to right; an upper arch lies on the bench, too.
        teeth.sort_by_key(|(_, fdi)| match fdi / 10 {
            2 | 4 => -i16::from(*fdi),
            1 => i16::from(*fdi),
            _ => i16::from(*fdi) + 100,
        });
    }
    let is_in_arch = scenario.scene.has_whole_arch();
    for (place, question) in stage.ask.iter().enumerate() {
        let is_answered = lesson.answered.get(place).copied().unwrap_or_default();
        ui.add_space(10.0);
        ui.strong(words.own(&scenario.texts, &question.text));
        let draft = lesson.drafts.get(&question.id).map_or("", String::as_str);
        let current = lesson.answers.get(&question.id);
        ui.push_id(place, |ui| {
            let quarters = if is_in_arch { quarter_names(stage, lesson, &teeth) } else { QuarterNames::Numbers };
            let shown = QuestionUi { question, current, texts: &scenario.texts, words, quarters };
            if let Some(answer) = shown.answer_ui(ui, &teeth, draft, commands) {
                commands.push(AppCommand::Practice(PracticeCommand::AnswerQuestion(question.id.clone(), answer)));
            }
        });
        if parse_draft(question, draft).is_some_and(|answer| answer.is_none()) {
            ui.colored_label(theme::ERROR, words.get("questions.not_a_number"));
        }
        if is_answered {
            let noted = match current {
                Some(AnswerValue::Number(number)) => format!(": {number}"),
                _ => String::new(),
            };
            ui.colored_label(theme::SUCCESS, format!("{}{noted}", words.get("questions.noted")));
        }
    }
}

/// Names of the quarters of an occlusal surface.
#[derive(Clone, Copy)]
enum QuarterNames {
    /// 1 to 4 as the trainee sees them.
    Numbers,
    /// None until a tooth of the arch is named.
    ToothFirst,
    /// The anatomical ones on the tooth with this FDI number.
    Anatomical(u8),
}

/// Names of the quarters in an arch: those on the tooth that the trainee has named in this stage.
fn quarter_names(stage: &Stage, lesson: &LessonState, teeth: &[(String, u8)]) -> QuarterNames {
    let asks_tooth = |question: &&Question| matches!(question.kind, QuestionKind::ToothWith { .. });
    let Some(question) = stage.ask.iter().find(asks_tooth) else { return QuarterNames::Numbers };
    let named = lesson.answers.get(&question.id);
    let tooth = teeth.iter().find(|(id, _)| named == Some(&AnswerValue::Word(id.clone())));
    tooth.map_or(QuarterNames::ToothFirst, |(_, fdi)| QuarterNames::Anatomical(*fdi))
}

/// One question with its last accepted answer.
struct QuestionUi<'a> {
    quarters: QuarterNames,
    question: &'a Question,
    current: Option<&'a AnswerValue>,
    texts: &'a LocalTexts,
    words: &'a Translations,
}

/// An answer in the names of screen positions.
fn answer_word(answer: &AnswerValue) -> String {
    match answer {
        AnswerValue::Word(word) => word.clone(),
        AnswerValue::Quadrant(quadrant) => quadrant.to_string(),
        AnswerValue::YesNo(is_yes) => is_yes.to_string(),
        AnswerValue::Number(number) => number.to_string(),
    }
}

/// Room beside the number on a tooth's button, and between two of them, points.
const TOOTH_BUTTON_PADDING: f32 = 5.0;

impl QuestionUi<'_> {
    /// Draws the controls of the question; returns the answer given in this frame, if any.
    fn answer_ui(
        &self,
        ui: &mut egui::Ui,
        teeth: &[(String, u8)],
        draft: &str,
        commands: &mut Vec<AppCommand>,
    ) -> Option<AnswerValue> {
        let words = self.words;
        match &self.question.kind {
            QuestionKind::ToothWith { .. } => {
                let sides = [words.get("questions.left_tooth"), words.get("questions.right_tooth")];
                let title = |place: usize, fdi: u8| match teeth.len() {
                    2 => format!("{} ({fdi})", sides[place.min(1)]),
                    _ => fdi.to_string(),
                };
                let options =
                    teeth.iter().enumerate().map(|(i, (id, fdi))| (AnswerValue::Word(id.clone()), title(i, *fdi)));
                if teeth.len() <= 2 {
                    return self.buttons(ui, options);
                }
                let mut options = options;
                // A row for each quadrant, whose seven or eight teeth have room side by side.
                let mut chosen = None;
                ui.scope(|ui| {
                    ui.spacing_mut().button_padding.x = TOOTH_BUTTON_PADDING;
                    ui.spacing_mut().item_spacing.x = TOOTH_BUTTON_PADDING;
                    for row in teeth.chunk_by(|(_, a), (_, b)| a / 10 == b / 10) {
                        chosen = self.buttons(ui, options.by_ref().take(row.len())).or(chosen.take());
                    }
                });
                chosen
            }
            QuestionKind::QuadrantOf { .. } => self.quadrants(ui),
            QuestionKind::Choice { options, .. } => self.buttons(
                ui,
                options
                    .iter()
                    .map(|(id, title)| (AnswerValue::Word(id.clone()), words.own(self.texts, title).to_string())),
            ),
            QuestionKind::YesNo { .. } => {
                let options = [(true, "questions.yes"), (false, "questions.no")];
                self.buttons(
                    ui,
                    options.into_iter().map(|(yes, key)| (AnswerValue::YesNo(yes), words.get(key).to_string())),
                )
            }
            QuestionKind::Number { unit, .. } => self.line(ui, draft, unit, commands),
            QuestionKind::Text => self.line(ui, draft, "", commands),
        }
    }

    fn buttons(&self, ui: &mut egui::Ui, options: impl Iterator<Item = (AnswerValue, String)>) -> Option<AnswerValue> {
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

    /// Quarters in occlusal view: 1 and 2 are buccal, away from the trainee. In an arch, whose teeth are turned, they have
    /// anatomical names.
    fn quadrants(&self, ui: &mut egui::Ui) -> Option<AnswerValue> {
        let mut chosen = None;
        let name: Box<dyn Fn(u8) -> String> = match self.quarters {
            QuarterNames::Numbers => {
                ui.weak(self.words.get("questions.from_above"));
                Box::new(|quadrant| quadrant.to_string())
            }
            QuarterNames::ToothFirst => {
                ui.weak(self.words.get("questions.tooth_first"));
                return None;
            }
            QuarterNames::Anatomical(fdi) => Box::new(move |quadrant| {
                let is_distal = (quadrant % 2 == 1) == (distal(fdi).y > 0.0);
                let key = match (quadrant <= 2, is_distal) {
                    (true, false) => "questions.mesiobuccal",
                    (true, true) => "questions.distobuccal",
                    (false, false) => "questions.mesiolingual",
                    (false, true) => "questions.distolingual",
                };
                self.words.get(key).to_string()
            }),
        };
        egui::Grid::new("quadrants").spacing([6.0, 6.0]).show(ui, |ui| {
            for row in [[1u8, 2], [3, 4]] {
                for quadrant in row {
                    let answer = AnswerValue::Quadrant(quadrant);
                    if self.button(ui, &answer, &name(quadrant), egui::vec2(64.0, 44.0)) {
                        chosen = Some(answer);
                    }
                }
                ui.end_row();
            }
        });
        chosen
    }

    /// A button that is marked while its answer is the accepted one; returns true when clicked.
    fn button(&self, ui: &mut egui::Ui, answer: &AnswerValue, title: &str, min_size: egui::Vec2) -> bool {
        let is_current = self.current == Some(answer);
        let button = ui.add(egui::Button::selectable(is_current, title).frame_when_inactive(true).min_size(min_size));
        anchor(ui, format!("answer:{}:{}", self.question.id, answer_word(answer)), button.rect);
        button.widget_info(|| {
            let name = format!("{}: {title}", self.words.own(self.texts, &self.question.text));
            egui::WidgetInfo::selected(egui::Role::RadioButton, true, is_current, name)
        });
        button.clicked()
    }

    /// A text field; returns its answer when the user submits it.
    fn line(&self, ui: &mut egui::Ui, draft: &str, unit: &str, commands: &mut Vec<AppCommand>) -> Option<AnswerValue> {
        let mut is_submitted = false;
        let mut typed = draft.to_string();
        ui.horizontal(|ui| {
            let line = ui.add(egui::TextEdit::singleline(&mut typed).desired_width(150.0));
            line.widget_info(|| {
                egui::WidgetInfo::labeled(egui::Role::TextInput, true, self.words.own(self.texts, &self.question.text))
            });
            ui.label(unit);
            let is_entered = line.lost_focus() && ui.input(|input| input.key_pressed(egui::Key::Enter));
            is_submitted = ui.button(self.words.get("questions.say")).clicked() || is_entered;
        });
        let answer = parse_draft(self.question, &typed).flatten().filter(|_| is_submitted);
        if typed != draft {
            let id = self.question.id.clone();
            commands.push(AppCommand::Practice(PracticeCommand::TypeAnswer(id, typed)));
        }
        answer
    }
}
