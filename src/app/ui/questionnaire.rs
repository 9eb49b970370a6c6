//! The questionnaire after an exercise: the trainee rates each statement.

use crate::command::{AppCommand, PracticeCommand};
use crate::i18n::Translations;
use crate::lesson_state::LessonState;
use crate::ui::theme;
use eframe::egui;

/// Draws all statements with their scales.
pub fn questionnaire_ui(ui: &mut egui::Ui, lesson: &LessonState, words: &Translations, commands: &mut Vec<AppCommand>) {
    let Some(questionnaire) = &lesson.scenario.questionnaire else {
        theme::centered_column(ui, |ui| {
            ui.heading(words.get("questionnaire.scoring"));
            theme::progress_dots(ui);
        });
        return;
    };
    theme::centered_column(ui, |ui| {
        let texts = &lesson.scenario.texts;
        ui.heading(words.own(texts, &questionnaire.title));
        ui.label(words.own(texts, &questionnaire.instruction));
        let [lowest, highest] = [&questionnaire.lowest, &questionnaire.highest].map(|label| words.own(texts, label));
        ui.weak(format!("1 = {lowest}, {} = {highest}", questionnaire.steps));
        ui.add_space(10.0);
        let room = (ui.available_height() - 100.0).max(200.0);
        egui::ScrollArea::vertical().id_salt("questionnaire").max_height(room).auto_shrink([false, true]).show(
            ui,
            |ui| {
                let mut place = 0;
                for category in &questionnaire.categories {
                    ui.add_space(8.0);
                    ui.label(
                        egui::RichText::new(words.own(texts, &category.title)).strong().size(18.0).color(theme::ACCENT),
                    );
                    for item in &category.items {
                        let is_current = place == lesson.statement;
                        let rating = lesson.ratings.get(&item.id).copied();
                        statement_ui(
                            ui,
                            &item.id,
                            words.own(texts, &item.text),
                            RatingScale {
                                steps: questionnaire.steps,
                                rating,
                                is_current,
                                scroll_into_view: is_current && lesson.scroll_to_statement,
                            },
                            commands,
                        );
                        place += 1;
                    }
                }
            },
        );
        ui.add_space(14.0);
        let (given, all) = (lesson.ratings.len(), questionnaire.items().count());
        ui.horizontal(|ui| {
            let key = if lesson.is_confirming_submit { "questionnaire.hand_in_so" } else { "questionnaire.hand_in" };
            if ui.add(theme::primary_button(words.get(key))).clicked() {
                commands.push(AppCommand::Practice(PracticeCommand::SubmitQuestionnaire));
            }
            ui.weak(format!("{given} / {all} {}", words.get("questionnaire.answered")));
        });
        if lesson.is_confirming_submit {
            ui.colored_label(theme::WARNING, words.format("questionnaire.open", lesson.unrated_statements()));
        }
    });
}

struct RatingScale {
    steps: u8,
    rating: Option<u8>,
    /// True for the statement that a digit key rates.
    is_current: bool,
    /// True if the statement is to be scrolled into view.
    scroll_into_view: bool,
}

fn statement_ui(ui: &mut egui::Ui, id: &str, text: &str, scale: RatingScale, commands: &mut Vec<AppCommand>) {
    let fill = if scale.is_current { theme::ACCENT.gamma_multiply(0.12) } else { egui::Color32::WHITE };
    let shown = egui::Frame::NONE.fill(fill).corner_radius(6).inner_margin(10).show(ui, |ui| {
        ui.set_width(ui.available_width());
        ui.horizontal(|ui| {
            let width = f32::from(scale.steps) * 48.0 + 16.0;
            let text_width = (ui.available_width() - width).max(120.0);
            let middle = egui::Layout::left_to_right(egui::Align::Center);
            ui.allocate_ui_with_layout(egui::vec2(text_width, 34.0), middle, |ui| {
                ui.set_width(text_width);
                ui.add(egui::Label::new(text).wrap());
            });
            for value in 1..=scale.steps {
                let button = egui::Button::selectable(scale.rating == Some(value), value.to_string());
                let button = ui.add(button.min_size(egui::vec2(38.0, 34.0)).frame_when_inactive(true));
                button.widget_info(|| {
                    let name = format!("{text}: {value}");
                    egui::WidgetInfo::selected(egui::Role::RadioButton, true, scale.rating == Some(value), name)
                });
                if button.clicked() {
                    commands.push(AppCommand::Practice(PracticeCommand::RateStatement(id.to_string(), value)));
                }
            }
        });
    });
    if scale.scroll_into_view && !ui.clip_rect().contains_rect(shown.response.rect) {
        shown.response.scroll_to_me(Some(egui::Align::Center));
    }
    ui.add_space(3.0);
}
