//! The author's screen: an exercise is created, viewed, tried and saved without writing any JSON.

mod choice_field;
mod decay;
mod diagnostics;
mod dialogs;
mod field;
mod field_parts;
mod instruments_field;
mod labels;
mod list;
mod projection;
mod rubric;
mod sections;
mod slice_views;
mod source_view;
mod tissues;
mod toolbar;
mod tooth_chart;
mod tooth_view;

use crate::command::AppCommand;
use crate::editor::{EditorCommand, EditorState};
use crate::i18n::Translations;
use crate::settings::Settings;
use crate::ui::views::Views;
use eframe::egui;
use serde_json::Value;

/// Context of one frame: the state that is shown, and the commands that are requested.
pub struct FormContext<'a> {
    pub editor: &'a EditorState,
    pub words: &'a Translations,
    pub commands: &'a mut Vec<AppCommand>,
}

impl FormContext<'_> {
    pub fn send(&mut self, command: EditorCommand) {
        self.commands.push(AppCommand::Editor(command));
    }

    pub fn value(&self, pointer: &str) -> Option<&Value> {
        self.editor.draft.value_at(pointer)
    }
}

/// The whole screen.
pub fn editor_ui(
    ui: &mut egui::Ui,
    editor: &EditorState,
    settings: &Settings,
    views: &mut Views,
    words: &Translations,
    commands: &mut Vec<AppCommand>,
) {
    let frame = egui::Frame::side_top_panel(ui.style()).inner_margin(10);
    let width = ui.available_width();
    egui::Panel::top("author bar").resizable(false).frame(frame).show(ui, |ui| {
        toolbar::toolbar_ui(ui, &mut FormContext { editor, words, commands });
    });
    egui::Panel::left("author parts")
        .exact_size((0.17 * width).clamp(120.0, 190.0))
        .resizable(false)
        .frame(frame)
        .show(ui, |ui| {
            let scroll = egui::ScrollArea::vertical().auto_shrink([false, false]);
            scroll.show(ui, |ui| sections::sections_ui(ui, &mut FormContext { editor, words, commands }));
        });
    let view = egui::Frame::NONE.inner_margin(0);
    egui::Panel::right("author view").exact_size(0.42 * width).resizable(false).frame(view).show(ui, |ui| {
        tooth_view::tooth_view_ui(ui, editor, settings, views, words, commands);
    });
    let middle = egui::Frame::NONE.inner_margin(14);
    egui::CentralPanel::default().frame(middle).show(ui, |ui| {
        // Each part is scrolled by itself.
        let id = (editor.section, "part");
        let scroll = egui::ScrollArea::vertical().id_salt(id).auto_shrink([false, false]);
        scroll.show(ui, |ui| {
            // Leaves the scroll bar its room.
            ui.set_max_width(ui.available_width() - 12.0);
            sections::section_ui(ui, &mut FormContext { editor, words, commands });
        });
    });
    dialogs::dialog_ui(ui.ctx(), editor, words, commands);
}
