//! The tray: which instruments lie on it, and which is in the hand at the start.

use super::field::{last, remove_ui};
use super::list::order_ui;
use super::marks::mark;
use super::said::said_ui;
use super::{Ask, Page};
use crate::content::pointer::under;
use eframe::egui;
use serde_json::json;

/// True for the exercise's tray, and for that of a stage.
pub fn is_tray(pointer: &str) -> bool {
    last(pointer) == "instruments"
}

/// What lies on the tray in order, and what can be put there.
pub fn tray_ui(ui: &mut egui::Ui, page: &mut Page, pointer: &str) {
    let is_stages = pointer.starts_with("/stages/");
    let ids = |at: &str| -> Option<Vec<String>> {
        let list = page.value(at)?.as_array()?;
        Some(list.iter().filter_map(|v| v.as_str().map(str::to_string)).collect())
    };
    let own = ids(pointer);
    let all: Vec<String> = match is_stages {
        true => ids("/instruments").unwrap_or_default(),
        false => page.authoring.instruments.iter().map(|entry| entry.id.clone()).collect(),
    };
    let title = |id: &str| {
        let entry = page.authoring.instruments.iter().find(|entry| entry.id == id);
        entry.map_or(id.to_string(), |entry| entry.title.clone())
    };
    let Some(own) = own else {
        ui.horizontal_wrapped(|ui| {
            ui.weak(page.words.of("author.whole_tray"));
            if ui.small_button(page.words.of("author.choose")).clicked() {
                page.ask(Ask::Set(pointer.into(), json!(all)));
            }
        });
        return;
    };
    for (place, id) in own.iter().enumerate() {
        let at = under(pointer, place);
        let name = title(id);
        ui.horizontal_wrapped(|ui| {
            let text = if place == 0 && !is_stages { page.words.with("author.in_hand", &name) } else { name.clone() };
            ui.add(egui::Label::new(format!("{}. {text}", place + 1)).wrap());
            order_ui(ui, page, pointer, [place, own.len()], &name);
            if own.len() > 1 {
                remove_ui(ui, page, &at, &name);
            }
        });
        said_ui(ui, page, &at);
    }
    let more: Vec<String> = all.into_iter().filter(|id| !own.contains(id)).collect();
    if !more.is_empty() {
        let shown = page.words.of("author.add_instrument").to_string();
        let width = (ui.available_width() - 8.0).clamp(80.0, 280.0);
        let combo = egui::ComboBox::from_id_salt("more").width(width).height(360.0).truncate().selected_text(&shown);
        let shown = combo.show_ui(ui, |ui| {
            for id in &more {
                let option = ui.selectable_label(false, title(id));
                mark(ui, format!("{pointer}+{id}"), option.rect);
                if option.clicked() {
                    page.ask(Ask::Push(pointer.into(), json!(id)));
                }
            }
        });
        mark(ui, format!("add:{pointer}"), shown.response.rect);
    }
    if is_stages && ui.small_button(page.words.of("author.whole_tray")).clicked() {
        page.ask(Ask::Remove(pointer.into()));
    }
}
