//! The decay: its fields, and on the tooth its outline with handles that are dragged to size.

use super::super::command::Command;
use super::super::language::Words;
use super::super::look;
use super::document::Authoring;
use super::field::{last, rest_ui};
use super::labels::label;
use super::list::{add_ui, entries_ui, entry_ui};
use super::marks::mark;
use super::picture::seen_at;
use super::{Ask, Page};
use crate::content::pointer::under;
use crate::frame::Vec3;
use crate::render::Eye;
use crate::scenario::Workpiece;
use eframe::egui::{self, Color32, Pos2, Rect, Sense, Stroke};
use serde_json::{Value, json};

/// Half the width of a handle, points: a finger's tip is larger, a mouse's smaller.
const HANDLE: f32 = 8.0;

/// Every decay and stain of every tooth.
pub fn decay_ui(ui: &mut egui::Ui, page: &mut Page) {
    ui.add(egui::Label::new(page.words.of("author.decay_about")).wrap());
    ui.add_space(6.0);
    let teeth = page.authoring.teeth();
    for (tooth, at) in teeth.iter().enumerate() {
        if teeth.len() > 1 {
            ui.strong(label(page.words, last(at)));
        }
        let list = under(at, "decay");
        let count = page.value(&list).and_then(Value::as_array).map_or(0, Vec::len);
        for place in 0..count {
            entry_ui(ui, page, &list, place, count, |ui, page| {
                let is_chosen = page.authoring.chosen == (tooth, place);
                if (count > 1 || teeth.len() > 1) && ui.radio(is_chosen, page.words.of("author.chosen")).clicked() {
                    page.ask(Ask::Choose(tooth, place));
                }
                rest_ui(ui, page, &under(&list, place), &[]);
            });
        }
        add_ui(ui, page, &list, &label(page.words, "decay"));
        ui.add_space(8.0);
        let stains = under(at, "stains");
        entries_ui(ui, page, &stains);
        add_ui(ui, page, &stains, &label(page.words, "stains"));
        ui.add_space(12.0);
    }
}

/// A size of the chosen decay that can be dragged: the value's pointer, the way it is measured, how long it is now, mm, and
/// how much of it lies on one side of the middle.
struct Handle {
    pointer: String,
    along: Vec3,
    now: f32,
    share: f32,
    limits: [f32; 2],
}

/// Outline and handles of the chosen decay. True while one of them is dragged or pressed.
pub fn handles_ui(
    ui: &mut egui::Ui,
    authoring: &Authoring,
    eye: &Eye,
    rect: Rect,
    words: &Words,
    asked: &mut Vec<Command>,
) -> bool {
    let Some((at, made)) = authoring.chosen_decay().zip(authoring.made.as_ref()) else { return false };
    let id = authoring.draft.at(&under(&at, "id")).and_then(Value::as_str).unwrap_or_default();
    let Some(lesion) = made.workpiece.lesions.iter().find(|lesion| lesion.id == id) else { return false };
    let Some((middle, scale)) = seen_at(authoring, eye, rect, lesion.centre) else { return false };
    let painter = ui.painter_at(rect);
    let pen = Stroke::new(2.0, Color32::from_rgb(0xff, 0xd0, 0x40));
    painter.circle_filled(middle, 4.0, pen.color);
    let handles = handles(authoring, &made.workpiece, &at, lesion.tooth);
    let mut is_busy = false;
    for handle in handles {
        // A ball is dragged by its rim on the right, whatever way it is looked at.
        let along = if handle.along == Vec3::ZERO {
            made.workpiece.world_from_tooth.inverse().turn(eye.right)
        } else {
            handle.along
        };
        let reach = handle.now * handle.share;
        let tip = seen_at(authoring, eye, rect, lesion.centre + along * reach).map_or(middle, |(at, _)| at);
        if handle.along == Vec3::ZERO {
            painter.circle_stroke(middle, reach * scale, pen);
        } else {
            painter.line_segment([middle, tip], pen);
        }
        // Seen along its own way a handle would lie on the middle; it is drawn where it can be taken.
        let (tip, across) = match (tip - middle).length() {
            length if length > 6.0 => (tip, (tip - middle) / length),
            _ => (middle + egui::vec2(0.0, -14.0), egui::vec2(0.0, -1.0)),
        };
        is_busy |= handle_ui(ui, &handle, &Grip { tip, across, scale }, words, asked);
    }
    is_busy
}

/// Where a handle is on the screen: its middle, the way in which it grows (a unit), and how many points a millimetre is.
struct Grip {
    tip: Pos2,
    across: egui::Vec2,
    scale: f32,
}

fn handle_ui(ui: &mut egui::Ui, handle: &Handle, at: &Grip, words: &Words, asked: &mut Vec<Command>) -> bool {
    let Grip { tip, across, scale } = *at;
    let rect = ui.max_rect();
    let place = Rect::from_center_size(tip, egui::Vec2::splat(2.0 * HANDLE));
    if !rect.contains_rect(place) {
        return false;
    }
    let grip = ui.interact(place, ui.scope_id().with(&handle.pointer), Sense::drag());
    let name = label(words, last(&handle.pointer));
    grip.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Slider, true, format!("{name} {:.1} mm", handle.now)));
    mark(ui, format!("handle:{}", handle.pointer), place);
    let is_hot = grip.hovered() || grip.dragged();
    ui.painter().circle(tip, if is_hot { HANDLE } else { 6.0 }, Color32::WHITE, Stroke::new(2.5, look::ACCENT));
    let by = grip.drag_delta().dot(across) / (scale * handle.share);
    // What is dragged less than the last digit is added up by the memory of the pointer's way.
    let key = grip.id.with("way");
    if grip.drag_started() {
        ui.data_mut(|data| data.insert_temp(key, handle.now));
    }
    if grip.dragged() {
        let size = ui.data(|data| data.get_temp::<f32>(key)).unwrap_or(handle.now) + by;
        ui.data_mut(|data| data.insert_temp(key, size));
        let size = (f64::from(size.clamp(handle.limits[0], handle.limits[1])) * 20.0).round() / 20.0;
        asked.push(Command::Author(Ask::Set(handle.pointer.clone(), json!(size))));
        let text = format!("{name} {size} mm");
        ui.painter().text(
            tip + egui::vec2(12.0, -12.0),
            egui::Align2::LEFT_BOTTOM,
            text,
            egui::FontId::proportional(15.0),
            look::ACCENT,
        );
    }
    is_hot
}

/// What can be dragged of a decay's shape.
fn handles(authoring: &Authoring, workpiece: &Workpiece, decay: &str, tooth: usize) -> Vec<Handle> {
    let number = |pointer: &str| Some(authoring.draft.at(pointer)?.as_f64()? as f32);
    let one = |pointer: String, along: Vec3, share: f32, limits: [f32; 2]| {
        let now = number(&pointer)?;
        Some(Handle { pointer, along, now, share, limits })
    };
    let distal = workpiece.teeth.get(tooth).map_or(Vec3::Y, |tooth| tooth.distal());
    let shape = format!("{decay}/shape");
    let surface = authoring.draft.at(&format!("{decay}/surface")).and_then(Value::as_str).unwrap_or("O");
    let [wide, high] = match surface {
        "O" => [Vec3::X, distal],
        "B" | "L" => [distal, Vec3::Z],
        _ => [Vec3::X, Vec3::Z],
    };
    let all = [
        one(format!("{shape}/sphere/radius_mm"), Vec3::ZERO, 1.0, [0.2, 6.0]),
        one(format!("{shape}/ellipsoid/radii_mm/0"), Vec3::X, 1.0, [0.2, 6.0]),
        one(format!("{shape}/ellipsoid/radii_mm/1"), Vec3::Y, 1.0, [0.2, 6.0]),
        one(format!("{shape}/ellipsoid/radii_mm/2"), Vec3::Z, 1.0, [0.2, 6.0]),
        one(format!("{shape}/smooth/width_mm"), wide, 0.5, [0.4, 10.0]),
        one(format!("{shape}/smooth/height_mm"), high, 0.5, [0.4, 10.0]),
        one(format!("{shape}/fissure/length_mm"), distal, 0.5, [0.5, 15.0]),
    ];
    all.into_iter().flatten().collect()
}
