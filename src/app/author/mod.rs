//! The author's screen: an exercise is made, looked at, tried and saved without writing a line of it.
//!
//! Every field shows what the file's text says and asks for a change of that text; nothing is kept beside it.

mod asking;
mod bar;
mod chart;
mod choice;
mod decay;
mod document;
mod field;
mod labels;
mod list;
mod making;
mod marks;
mod parts;
mod picture;
mod rubric;
mod said;
mod slices;
mod text;
mod tissues;
mod tray;
mod view;

pub use document::{Authoring, Watch};
pub use marks::{mark, note as note_marks};
pub use parts::Part;

use super::command::Command;
use super::language::Words;
use super::viewport::Viewport;
use crate::frame::Vec3;
use eframe::egui;
use serde_json::Value;
use std::path::PathBuf;

/// What the author asks for.
#[derive(Clone, Debug)]
pub enum Ask {
    Show(Part),
    Set(String, Value),
    Remove(String),
    /// One more entry of a list, as such things begin.
    Add(String),
    Push(String, Value),
    Swap(String, usize, usize),
    /// A tooth's number, wherever it stands.
    Tooth(u8),
    /// The decay that is worked on: tooth and place in its list.
    Choose(usize, usize),
    /// Somebody pointed at a place of the tooth, tooth space, with the way out of it.
    Point(Vec3, Vec3),
    /// The cuts go through a point, tooth space.
    CutAt(Vec3),
    /// What chance decides is decided anew.
    DrawAnew,
    Look(view::Way),
    ShowAround(bool),
    Write(String),
    Undo,
    Redo,
    Save,
    /// Asks where to, or takes that back.
    Where(bool),
    SaveAs(PathBuf),
    /// Over whatever stands there.
    SaveOver(PathBuf),
    /// What somebody else made of the file in the meantime.
    TakeTheirs,
    /// One's own, which is then saved over theirs.
    KeepMine,
    Check,
    CloseCheck,
    Try,
    Leave,
}

/// One picture of the screen: what is shown, and what is asked for.
pub struct Page<'a> {
    pub authoring: &'a Authoring,
    pub words: &'a Words,
    pub asked: &'a mut Vec<Command>,
}

impl Page<'_> {
    pub fn ask(&mut self, ask: Ask) {
        self.asked.push(Command::Author(ask));
    }

    pub fn value(&self, pointer: &str) -> Option<&Value> {
        self.authoring.draft.at(pointer)
    }
}

/// The whole screen.
pub fn author_ui(
    ui: &mut egui::Ui,
    authoring: &mut Authoring,
    viewport: Option<&mut Viewport>,
    words: &Words,
    asked: &mut Vec<Command>,
) {
    let frame = egui::Frame::side_top_panel(ui.style()).inner_margin(10);
    let width = ui.available_width();
    egui::Panel::top("author bar").resizable(false).frame(frame).show(ui, |ui| {
        bar::bar_ui(ui, &mut Page { authoring, words, asked });
    });
    egui::Panel::left("author parts")
        .exact_size((0.17 * width).clamp(120.0, 190.0))
        .resizable(false)
        .frame(frame)
        .show(ui, |ui| {
            let scroll = egui::ScrollArea::vertical().auto_shrink([false, false]);
            scroll.show(ui, |ui| parts::parts_ui(ui, &mut Page { authoring, words, asked }));
        });
    let view = egui::Frame::NONE.inner_margin(0);
    egui::Panel::right("author view").exact_size(0.42 * width).resizable(false).frame(view).show(ui, |ui| {
        picture::picture_ui(ui, authoring, viewport, words, asked);
    });
    let middle = egui::Frame::NONE.inner_margin(14);
    egui::CentralPanel::default().frame(middle).show(ui, |ui| {
        // Each part is scrolled by itself.
        let id = (authoring.part, "part");
        let scroll = egui::ScrollArea::vertical().id_salt(id).auto_shrink([false, false]);
        scroll.show(ui, |ui| {
            // Leaves the scroll bar its room.
            ui.set_max_width(ui.available_width() - 12.0);
            parts::part_ui(ui, &mut Page { authoring, words, asked });
        });
    });
    asking::asking_ui(ui.ctx(), authoring, words, asked);
}
