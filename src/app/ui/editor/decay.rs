//! The decay: its fields, and its outline on the tooth with handles that change its size.

use crate::command::AppCommand;
use crate::editor::EditorCommand;
use crate::editor::EditorState;
use crate::i18n::Translations;
use crate::ui::editor::FormContext;
use crate::ui::editor::field::remaining_fields_ui;
use crate::ui::editor::field_parts::last_segment;
use crate::ui::editor::labels::label;
use crate::ui::editor::list::{add_ui, entries_ui, entry_ui};
use crate::ui::editor::projection::project;
use crate::ui::editor::sections::tooth_name;
use crate::ui::theme;
use crate::ui::ui_anchors::anchor;
use eframe::egui::{self, Color32, Pos2, Rect, Sense, Stroke};
use serde_json::{Value, json};
use typodont_core::frame::Vec3;
use typodont_exercise::scenario::Workpiece;
use typodont_formats::pointer::child;
use typodont_render::Eye;

/// Half the width of a handle, points: between the sizes that suit a fingertip and a mouse pointer.
const HANDLE: f32 = 8.0;

/// Draws the fields of all decay and stains of all teeth.
pub fn decay_ui(ui: &mut egui::Ui, form: &mut FormContext) {
    ui.add(egui::Label::new(form.words.get("author.decay_about")).wrap());
    ui.add_space(6.0);
    let teeth = form.editor.tooth_pointers();
    for (tooth, at) in teeth.iter().enumerate() {
        if teeth.len() > 1 {
            ui.strong(tooth_name(form, at));
        }
        let list = child(at, "decay");
        let count = form.value(&list).and_then(Value::as_array).map_or(0, Vec::len);
        for place in 0..count {
            entry_ui(ui, form, &list, place, count, |ui, form| {
                let is_chosen = form.editor.selected_decay == (tooth, place);
                if (count > 1 || teeth.len() > 1) && ui.radio(is_chosen, form.words.get("author.chosen")).clicked() {
                    form.send(EditorCommand::SelectDecay(tooth, place));
                }
                remaining_fields_ui(ui, form, &child(&list, place), &[]);
            });
        }
        add_ui(ui, form, &list, &label(form.words, "decay"));
        ui.add_space(8.0);
        let stains = child(at, "stains");
        entries_ui(ui, form, &stains);
        add_ui(ui, form, &stains, &label(form.words, "stains"));
        ui.add_space(12.0);
    }
}

/// A size of the chosen decay that can be dragged: the JSON pointer of the value, the direction in which it is measured
/// (tooth space), its present length, mm, and the share of that length on one side of the centre.
struct SizeHandle {
    pointer: String,
    along: Vec3,
    value: f32,
    share: f32,
    limits: [f32; 2],
}

/// Draws the outline and handles of the selected decay. Returns true while a handle is hovered or dragged.
pub fn handles_ui(
    ui: &mut egui::Ui,
    editor: &EditorState,
    eye: &Eye,
    rect: Rect,
    words: &Translations,
    commands: &mut Vec<AppCommand>,
) -> bool {
    let Some((at, made)) = editor.selected_decay_pointer().zip(editor.build.as_ref()) else { return false };
    let id = editor.draft.value_at(&child(&at, "id")).and_then(Value::as_str).unwrap_or_default();
    let Some(lesion) = made.workpiece.lesions.iter().find(|lesion| lesion.id == id) else { return false };
    let Some((middle, scale)) = project(editor, eye, rect, lesion.centre) else { return false };
    let painter = ui.painter_at(rect);
    let pen = Stroke::new(2.0, Color32::from_rgb(0xff, 0xd0, 0x40));
    painter.circle_filled(middle, 4.0, pen.color);
    let handles = size_handles(editor, &made.workpiece, &at, lesion.tooth);
    let mut is_busy = false;
    for handle in handles {
        // A sphere is dragged by its rim on the right, from whatever side it is seen.
        let along = if handle.along == Vec3::ZERO {
            made.workpiece.world_from_tooth.inverse().rotate(eye.right)
        } else {
            handle.along
        };
        let reach = handle.value * handle.share;
        let tip = project(editor, eye, rect, lesion.centre + along * reach).map_or(middle, |(at, _)| at);
        if handle.along == Vec3::ZERO {
            painter.circle_stroke(middle, reach * scale, pen);
        } else {
            painter.line_segment([middle, tip], pen);
        }
        // Seen along its own direction, a handle would coincide with the centre; it is drawn beside it, within reach.
        let (tip, across) = match (tip - middle).length() {
            length if length > 6.0 => (tip, (tip - middle) / length),
            _ => (middle + egui::vec2(0.0, -14.0), egui::vec2(0.0, -1.0)),
        };
        is_busy |= handle_ui(ui, &handle, &HandleOnScreen { tip, across, scale }, words, commands);
    }
    is_busy
}

/// A handle on the screen: its centre, the direction in which the size grows (a unit vector), and the scale, points
/// per mm.
struct HandleOnScreen {
    tip: Pos2,
    across: egui::Vec2,
    scale: f32,
}

fn handle_ui(
    ui: &mut egui::Ui,
    handle: &SizeHandle,
    on_screen: &HandleOnScreen,
    words: &Translations,
    commands: &mut Vec<AppCommand>,
) -> bool {
    let HandleOnScreen { tip, across, scale } = *on_screen;
    let rect = ui.max_rect();
    let place = Rect::from_center_size(tip, egui::Vec2::splat(2.0 * HANDLE));
    if !rect.contains_rect(place) {
        return false;
    }
    let response = ui.interact(place, ui.scope_id().with(&handle.pointer), Sense::drag());
    let name = label(words, last_segment(&handle.pointer));
    response
        .widget_info(|| egui::WidgetInfo::labeled(egui::Role::Slider, true, format!("{name} {:.1} mm", handle.value)));
    anchor(ui, format!("handle:{}", handle.pointer), place);
    let is_hot = response.hovered() || response.dragged();
    ui.painter().circle(tip, if is_hot { HANDLE } else { 6.0 }, Color32::WHITE, Stroke::new(2.5, theme::ACCENT));
    let by = response.drag_delta().dot(across) / (scale * handle.share);
    // The unrounded size is kept, so that drags shorter than one rounding step (0.05 mm) add up.
    let key = response.id.with("way");
    if response.drag_started() {
        ui.data_mut(|data| data.insert_temp(key, handle.value));
    }
    if response.dragged() {
        let size = ui.data(|data| data.get_temp::<f32>(key)).unwrap_or(handle.value) + by;
        ui.data_mut(|data| data.insert_temp(key, size));
        let size = (f64::from(size.clamp(handle.limits[0], handle.limits[1])) * 20.0).round() / 20.0;
        commands.push(AppCommand::Editor(EditorCommand::SetValue(handle.pointer.clone(), json!(size))));
        let text = format!("{name} {size} mm");
        ui.painter().text(
            tip + egui::vec2(12.0, -12.0),
            egui::Align2::LEFT_BOTTOM,
            text,
            egui::FontId::proportional(15.0),
            theme::ACCENT,
        );
    }
    is_hot
}

/// Sizes of a decay's shape that can be dragged.
fn size_handles(editor: &EditorState, workpiece: &Workpiece, decay: &str, tooth: usize) -> Vec<SizeHandle> {
    let number = |pointer: &str| Some(editor.draft.value_at(pointer)?.as_f64()? as f32);
    let one = |pointer: String, along: Vec3, share: f32, limits: [f32; 2]| {
        let value = number(&pointer)?;
        Some(SizeHandle { pointer, along, value, share, limits })
    };
    let place = workpiece.teeth.get(tooth);
    let [x, y, z] =
        [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| place.map_or(axis, |tooth| tooth.tooth_from_own.rotate(axis)));
    let distal = place.map_or(Vec3::Y, |tooth| tooth.distal());
    let shape = format!("{decay}/shape");
    let surface = editor.draft.value_at(&format!("{decay}/surface")).and_then(Value::as_str).unwrap_or("O");
    let [wide, high] = match surface {
        "O" => [x, distal],
        "B" | "L" => [distal, z],
        _ => [x, z],
    };
    let all = [
        one(format!("{shape}/sphere/radius_mm"), Vec3::ZERO, 1.0, [0.2, 6.0]),
        one(format!("{shape}/ellipsoid/radii_mm/0"), x, 1.0, [0.2, 6.0]),
        one(format!("{shape}/ellipsoid/radii_mm/1"), y, 1.0, [0.2, 6.0]),
        one(format!("{shape}/ellipsoid/radii_mm/2"), z, 1.0, [0.2, 6.0]),
        one(format!("{shape}/smooth/width_mm"), wide, 0.5, [0.4, 10.0]),
        one(format!("{shape}/smooth/height_mm"), high, 0.5, [0.4, 10.0]),
        one(format!("{shape}/fissure/length_mm"), distal, 0.5, [0.5, 15.0]),
    ];
    all.into_iter().flatten().collect()
}
