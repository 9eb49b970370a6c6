//! What the author is asked before anything is lost, and what a check found.

use super::super::command::Command;
use super::super::language::Words;
use super::super::look;
use super::document::Authoring;
use super::marks::mark;
use super::parts::Part;
use super::said::complaint_ui;
use super::{Ask, Page};
use eframe::egui;
use std::path::PathBuf;

/// A question over the screen.
pub enum Asking {
    /// Where to save: a path as it is being typed.
    Where(String),
    /// Whether to write over what stands there.
    Over(PathBuf),
    /// Somebody else has changed the file: their text.
    Changed(String),
    /// What a check found.
    Checked,
}

pub fn asking_ui(ctx: &egui::Context, authoring: &mut Authoring, words: &Words, asked: &mut Vec<Command>) {
    let Some(mut asking) = authoring.asking.take() else { return };
    let title = match &asking {
        Asking::Where(_) => "author.save_as",
        Asking::Over(_) => "author.over_title",
        Asking::Changed(_) => "author.changed_title",
        Asking::Checked => "author.check",
    };
    let room = ctx.content_rect().size();
    let frame = egui::Frame::popup(&ctx.global_style()).inner_margin(20);
    egui::Modal::new(egui::Id::unique("author asking")).frame(frame).show(ctx, |ui| {
        ui.set_width((room.x - 120.0).clamp(240.0, 620.0));
        ui.heading(words.of(title));
        ui.add_space(8.0);
        let scroll = egui::ScrollArea::vertical().max_height((room.y - 200.0).max(140.0));
        scroll.show(ui, |ui| match &mut asking {
            Asking::Where(path) => where_ui(ui, path, words, asked),
            Asking::Over(path) => {
                ui.add(egui::Label::new(words.with("author.over", path.display())).wrap());
                let over = (words.of("author.over_yes"), "over", Ask::SaveOver(path.clone()));
                let other = (words.of("author.save_as"), "other", Ask::Where(true));
                answers_ui(ui, [over, other, (words.of("author.cancel"), "cancel", Ask::Where(false))], asked);
            }
            Asking::Changed(_) => {
                ui.add(egui::Label::new(words.of("author.changed_by_other")).wrap());
                let theirs = (words.of("author.take_theirs"), "theirs", Ask::TakeTheirs);
                answers_ui(ui, [theirs, (words.of("author.keep_mine"), "mine", Ask::KeepMine)], asked);
            }
            Asking::Checked => checked_ui(ui, &mut Page { authoring, words, asked }),
        });
    });
    authoring.asking = Some(asking);
}

fn answers_ui<const N: usize>(ui: &mut egui::Ui, answers: [(&str, &str, Ask); N], asked: &mut Vec<Command>) {
    ui.add_space(8.0);
    ui.horizontal_wrapped(|ui| {
        for (text, name, ask) in answers {
            let button = ui.button(text);
            mark(ui, format!("answer:{name}"), button.rect);
            if button.clicked() {
                asked.push(Command::Author(ask));
            }
        }
    });
}

fn where_ui(ui: &mut egui::Ui, path: &mut String, words: &Words, asked: &mut Vec<Command>) {
    let named = ui.label(words.of("author.where")).id;
    let line = ui.add(egui::TextEdit::singleline(path).desired_width(f32::INFINITY)).labelled_by(named);
    mark(ui, "where", line.rect);
    let is_entered = line.lost_focus() && ui.input(|input| input.key_pressed(egui::Key::Enter));
    let is_json = path.trim().ends_with(".json");
    if !is_json {
        ui.colored_label(look::WRONG, words.of("author.where_json"));
    }
    ui.add_space(8.0);
    ui.horizontal_wrapped(|ui| {
        let save = ui.add_enabled(is_json, egui::Button::new(words.of("author.save")));
        mark(ui, "answer:save", save.rect);
        if save.clicked() || (is_entered && is_json) {
            asked.push(Command::Author(Ask::SaveAs(PathBuf::from(path.trim()))));
        }
        if ui.button(words.of("author.cancel")).clicked() {
            asked.push(Command::Author(Ask::Where(false)));
        }
    });
}

/// Every complaint with the part in which it is mended.
fn checked_ui(ui: &mut egui::Ui, page: &mut Page) {
    let authoring = page.authoring;
    if !authoring.is_checked {
        ui.label(page.words.of("author.checking"));
        look::waiting(ui);
    } else if authoring.complaints.is_empty() {
        ui.colored_label(look::GOOD, page.words.of("author.nothing_wrong"));
    }
    for complaint in &authoring.complaints {
        let line = complaint.line_and_column().map_or(String::new(), |(line, _)| format!("{line}: "));
        ui.horizontal_wrapped(|ui| {
            ui.strong(format!("{line}{}", complaint.path));
            if ui.small_button(page.words.of("author.show")).clicked() {
                let part = if authoring.draft.is_json() { Part::of(&complaint.path) } else { Part::Text };
                page.ask(Ask::Show(part));
                page.ask(Ask::CloseCheck);
            }
        });
        complaint_ui(ui, page, complaint);
    }
    let answer = (page.words.of("settings.close"), "close", Ask::CloseCheck);
    answers_ui(ui, [answer], page.asked);
}
