//! After an exercise: how far the trainee agrees with each statement.

use super::command::Command;
use super::language::Words;
use super::look;
use super::sitting::Sitting;
use eframe::egui;

/// Every statement with its scale.
pub fn questionnaire_ui(ui: &mut egui::Ui, sitting: &Sitting, words: &Words, asked: &mut Vec<Command>) {
    let Some(questionnaire) = &sitting.scenario.questionnaire else {
        look::column(ui, |ui| {
            ui.heading(words.of("questionnaire.scoring"));
            look::waiting(ui);
        });
        return;
    };
    look::column(ui, |ui| {
        ui.heading(&questionnaire.title);
        ui.label(&questionnaire.instruction);
        ui.weak(format!("1 = {}, {} = {}", questionnaire.lowest, questionnaire.steps, questionnaire.highest));
        ui.add_space(10.0);
        let room = (ui.available_height() - 100.0).max(200.0);
        egui::ScrollArea::vertical().max_height(room).auto_shrink([false, true]).show(ui, |ui| {
            let mut place = 0;
            for category in &questionnaire.categories {
                ui.add_space(8.0);
                ui.label(egui::RichText::new(&category.title).strong().size(18.0).color(look::ACCENT));
                for item in &category.items {
                    let is_current = place == sitting.statement;
                    let rating = sitting.ratings.get(&item.id).copied();
                    statement_ui(
                        ui,
                        &item.id,
                        &item.text,
                        Scale {
                            steps: questionnaire.steps,
                            rating,
                            is_current,
                            is_sought: is_current && sitting.is_statement_new,
                        },
                        asked,
                    );
                    place += 1;
                }
            }
        });
        ui.add_space(14.0);
        let (given, all) = (sitting.ratings.len(), questionnaire.items().count());
        ui.horizontal(|ui| {
            let key = if sitting.is_handing_in { "questionnaire.hand_in_so" } else { "questionnaire.hand_in" };
            if ui.add(look::main_button(words.of(key))).clicked() {
                asked.push(Command::HandIn);
            }
            ui.weak(format!("{given} / {all} {}", words.of("questionnaire.answered")));
        });
        if sitting.is_handing_in {
            ui.colored_label(look::CARE, words.with("questionnaire.open", sitting.open_statements()));
        }
    });
}

struct Scale {
    steps: u8,
    rating: Option<u8>,
    /// A digit rates this one.
    is_current: bool,
    /// To be brought into sight.
    is_sought: bool,
}

fn statement_ui(ui: &mut egui::Ui, id: &str, text: &str, scale: Scale, asked: &mut Vec<Command>) {
    let fill = if scale.is_current { look::ACCENT.gamma_multiply(0.12) } else { egui::Color32::WHITE };
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
                    asked.push(Command::Rate(id.to_string(), value));
                }
            }
        });
    });
    if scale.is_sought && !ui.clip_rect().contains_rect(shown.response.rect) {
        shown.response.scroll_to_me(Some(egui::Align::Center));
    }
    ui.add_space(3.0);
}
