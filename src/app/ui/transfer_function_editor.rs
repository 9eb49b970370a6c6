//! Editor of the transfer function: red, green, blue and alpha curves over the histogram of densities, for one tissue
//! or for all, each channel by itself or several together, by mouse or by keys.

use crate::command::{AppCommand, PracticeCommand};
use crate::i18n::Translations;
use crate::lesson_scene::LessonScene;
use crate::transfer_function_draft::{TissuePeak, TransferFunctionDraft};
use crate::ui::theme;
use eframe::egui::{self, Color32, Key, Pos2, Rect, Sense, Stroke};
use typodont_core::volume::Label;
use typodont_exercise::catalog::TissueTable;
use typodont_render::{LabelPalette, TransferFunction};

/// The channels with their texts and inks, as they stand in a table's entries.
const CHANNELS: [(&str, Color32); 4] = [
    ("transfer.red", Color32::from_rgb(0xc6, 0x28, 0x28)),
    ("transfer.green", Color32::from_rgb(0x2e, 0x7d, 0x32)),
    ("transfer.blue", Color32::from_rgb(0x15, 0x65, 0xc0)),
    ("transfer.alpha", Color32::from_rgb(0x42, 0x42, 0x42)),
];

/// Step of an arrow key, of 255 densities or shares.
const KEY_STEP: u8 = 8;

/// Height of the curves, points.
const HEIGHT: f32 = 120.0;

/// Presets to begin from, the tissue and channel to draw, and the drawing itself. Asks for the function as it is then.
pub fn transfer_function_ui(
    ui: &mut egui::Ui,
    scene: &LessonScene,
    tissues: &TissueTable,
    words: &Translations,
    commands: &mut Vec<AppCommand>,
) {
    let LessonScene { transfer_function: draft, palette, .. } = scene;
    let histogram = scene.histogram();
    let mut new = draft.clone();
    presets_ui(ui, &mut new, scene, words);
    let title = |label: Label| {
        tissues.by_label(label).map_or(words.get("transfer.all"), |entry| entry.title.in_language(&words.code))
    };
    let label = ui.small(words.get("transfer.tissue")).id;
    egui::ComboBox::from_id_salt("tissue")
        .selected_text(title(new.tissue))
        .show_ui(ui, |ui| {
            for tissue in std::iter::once(Label::AIR).chain(tissues.entries().iter().map(|entry| entry.label())) {
                ui.selectable_value(&mut new.tissue, tissue, title(tissue));
            }
        })
        .response
        .labelled_by(label);
    channels_ui(ui, &mut new, words);
    let (rect, response) = ui.allocate_exact_size(egui::vec2(ui.available_width(), HEIGHT), Sense::click_and_drag());
    let drawn = CHANNELS.iter().zip(new.channels).filter(|(_, is_drawn)| *is_drawn);
    let drawn: Vec<&str> = drawn.map(|((key, _), _)| words.get(key)).collect();
    let name = format!("{}, {}, {}", words.get("transfer.curve"), title(new.tissue), drawn.join(" + "));
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Canvas, true, &name));
    if response.clicked() {
        response.request_focus();
    }
    if response.is_pointer_button_down_on()
        && let Some(to) = response.interact_pointer_pos()
    {
        let from = to - response.drag_delta();
        new = new.with_line(entry_at(from, rect), entry_at(to, rect));
    }
    if response.has_focus() {
        new = edit_by_keys(ui, &new, &response);
    }
    paint(ui, &new, &histogram.heights(new.tissue), rect, response.has_focus());
    let shown = histogram.peaks().into_iter().filter(|peak| new.tissue == Label::AIR || peak.tissue == new.tissue);
    peaks_ui(ui, &shown.collect::<Vec<_>>(), palette, rect, title);
    ui.small(words.get("transfer.about"));
    if new != *draft {
        commands.push(AppCommand::Practice(PracticeCommand::SetTransferFunction(Box::new(new))));
    }
}

/// Buttons that replace the drawing by a preset.
fn presets_ui(ui: &mut egui::Ui, draft: &mut TransferFunctionDraft, scene: &LessonScene, words: &Translations) {
    ui.horizontal_wrapped(|ui| {
        ui.small(words.get("transfer.begin"));
        if ui.small_button(words.get("menu.clear")).clicked() {
            *draft = TransferFunctionDraft::new(scene.tissue_function());
        }
        if ui.small_button(words.get("menu.xray")).clicked() {
            *draft = TransferFunctionDraft::new(TransferFunction::x_ray());
        }
        if ui.small_button("y = x").on_hover_text(words.get("transfer.straight")).clicked() {
            *draft = TransferFunctionDraft::straight_line(&scene.palette);
        }
    });
}

/// Switches of the channels that are drawn.
fn channels_ui(ui: &mut egui::Ui, draft: &mut TransferFunctionDraft, words: &Translations) {
    // A row that is wider than the menu would push it out of the window.
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 2.0;
        ui.spacing_mut().button_padding.x = 6.0;
        for (channel, (key, ink)) in CHANNELS.into_iter().enumerate() {
            let text = egui::RichText::new(words.get(key)).small().color(ink);
            ui.toggle_value(&mut draft.channels[channel], text);
        }
    });
}

/// The arrows go along the curves and lift or lower those that are drawn there, each from its own value.
fn edit_by_keys(ui: &egui::Ui, draft: &TransferFunctionDraft, response: &egui::Response) -> TransferFunctionDraft {
    let filter = egui::EventFilter { horizontal_arrows: true, vertical_arrows: true, ..Default::default() };
    ui.memory_mut(|memory| memory.set_focus_lock_filter(response.id, filter));
    let pressed = |key| ui.input_mut(|input| input.consume_key(egui::Modifiers::NONE, key));
    let here = draft.table()[usize::from(draft.cursor)];
    let lift: fn(u8) -> u8 = if pressed(Key::ArrowLeft) {
        return TransferFunctionDraft { cursor: draft.cursor.saturating_sub(KEY_STEP), ..draft.clone() };
    } else if pressed(Key::ArrowRight) {
        return TransferFunctionDraft { cursor: draft.cursor.saturating_add(KEY_STEP), ..draft.clone() };
    } else if pressed(Key::ArrowUp) {
        |value| value.saturating_add(KEY_STEP)
    } else if pressed(Key::ArrowDown) {
        |value| value.saturating_sub(KEY_STEP)
    } else {
        return draft.clone();
    };
    // A stretch as wide as a step along, so that neighbouring steps leave no spike.
    let [low, high] = [draft.cursor.saturating_sub(KEY_STEP / 2), draft.cursor.saturating_add(KEY_STEP / 2)];
    draft.with_values(low..=high, |_, channel| lift(here[channel]))
}

/// Density and channel value, 0 to 255, at a position of the drawing.
fn entry_at(at: Pos2, rect: Rect) -> [u8; 2] {
    let share = (at - rect.min) / rect.size();
    [share.x, 1.0 - share.y].map(|share| (share.clamp(0.0, 1.0) * 255.0).round() as u8)
}

fn paint(ui: &egui::Ui, draft: &TransferFunctionDraft, heights: &[f32; 256], rect: Rect, has_focus: bool) {
    let painter = ui.painter_at(rect.expand(1.0));
    painter.rect_filled(rect, 3, Color32::WHITE);
    let place = |density: usize, share: f32| {
        let [x, y] = [density as f32 / 255.0, 1.0 - share];
        rect.min + egui::vec2(x, y) * rect.size()
    };
    for (density, height) in heights.iter().enumerate().filter(|(_, height)| **height > 0.0) {
        let line = [place(density, 0.0), place(density, *height)];
        painter.line_segment(line, Stroke::new(1.5, Color32::from_gray(0xdd)));
    }
    // Those that are drawn last, above the others.
    let [still, drawn] =
        [false, true].map(|is_drawn| (0..CHANNELS.len()).filter(move |&c| draft.channels[c] == is_drawn));
    for channel in still.chain(drawn) {
        let value = |density: usize| f32::from(draft.table()[density][channel]) / 255.0;
        let points: Vec<Pos2> = (0..256).map(|density| place(density, value(density))).collect();
        let width = if draft.channels[channel] { 2.5 } else { 1.0 };
        painter.add(egui::Shape::line(points, Stroke::new(width, CHANNELS[channel].1)));
    }
    if has_focus {
        let here = draft.table()[usize::from(draft.cursor)];
        for (value, _) in here.iter().zip(draft.channels).filter(|(_, is_drawn)| *is_drawn) {
            let at = place(usize::from(draft.cursor), f32::from(*value) / 255.0);
            painter.circle_stroke(at, 5.0, Stroke::new(2.0, theme::ACCENT));
        }
    }
    painter.rect_stroke(rect, 3, Stroke::new(1.0, Color32::from_gray(0x99)), egui::StrokeKind::Inside);
}

/// Marks of the tissues' peaks at the upper edge of the drawing, in the tissues' colours, and their names below it. Tissues
/// with the same peak share a mark.
fn peaks_ui<'a>(
    ui: &mut egui::Ui,
    peaks: &[TissuePeak],
    palette: &LabelPalette,
    rect: Rect,
    title: impl Fn(Label) -> &'a str,
) {
    /// Half the width and the height of a mark, points.
    const MARK: egui::Vec2 = egui::vec2(4.0, 8.0);
    let mut densities: Vec<u8> = peaks.iter().map(|peak| peak.density).collect();
    densities.sort_unstable();
    densities.dedup();
    for density in densities {
        let tissues: Vec<Label> = peaks.iter().filter(|p| p.density == density).map(|p| p.tissue).collect();
        let x = rect.min.x + f32::from(density) / 255.0 * rect.width();
        // Within the frame, also at its edges.
        let x = x.clamp(rect.min.x + MARK.x, rect.max.x - MARK.x);
        let corners = [(-MARK.x, 0.0), (MARK.x, 0.0), (0.0, MARK.y)];
        let corners = corners.map(|(dx, dy)| egui::pos2(x + dx, rect.min.y + dy)).to_vec();
        let [r, g, b] = palette.appearance(tissues[0]).colour.map(|share| (share * 255.0).round() as u8);
        let outline = Stroke::new(1.0, Color32::from_gray(0x33));
        ui.painter().add(egui::Shape::convex_polygon(corners, Color32::from_rgb(r, g, b), outline));
        let names: Vec<&str> = tissues.iter().map(|tissue| title(*tissue)).collect();
        ui.small(format!("{density}: {}", names.join(", ")));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_drawn_into_one_channel_of_one_tissue() {
        // Aim: what the mouse draws is what is seen, and nothing else changes. Method: a rising line for one label, drawn
        // from right to left; its ends, its middle, the other channels and the other labels.
        let before = TransferFunctionDraft {
            tissue: Label(2),
            channels: [true, false, false, false],
            ..TransferFunctionDraft::new(TransferFunction::x_ray())
        };
        let after = before.with_line([200, 150], [100, 50]);
        let own = after.function.table(Label(2));
        assert_eq!([own[100][0], own[150][0], own[200][0]], [50, 100, 150]);
        assert_eq!(own[99], before.function.table(Label(2))[99]);
        assert_eq!(own[150][1..], before.function.table(Label(2))[150][1..]);
        assert_eq!(after.function.table(Label(3)), before.function.table(Label(3)));
        assert_eq!(after.cursor, 100);
        let all = TransferFunctionDraft { tissue: Label::AIR, ..before }.with_line([0, 7], [255, 7]);
        assert!([0, 2, 255].iter().all(|&label| all.function.table(Label(label)).iter().all(|entry| entry[0] == 7)));
    }
}
