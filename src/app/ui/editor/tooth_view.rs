//! The tooth of the exercise in three dimensions: it can be rotated and clicked, and its decay resized by dragging.

use crate::command::AppCommand;
use crate::editor::EditorCommand;
use crate::editor::EditorSection;
use crate::editor::EditorState;
use crate::editor::PreviewMode;
use crate::i18n::Translations;
use crate::settings::Settings;
use crate::ui::editor::decay;
use crate::ui::editor::slice_views::slices_ui;
use crate::ui::ui_anchors::anchor;
use crate::ui::views::Views;
use crate::ui::{theme, viewport_input};
use eframe::egui::{self, Color32, Pos2, Rect, Sense};
use typodont_core::frame::Vec3;
use typodont_render::Eye;

/// Height of the slices with their sliders, as a share of the column.
const SLICES_SHARE: f32 = 0.36;

pub fn tooth_view_ui(
    ui: &mut egui::Ui,
    editor: &EditorState,
    settings: &Settings,
    views: &mut Views,
    words: &Translations,
    commands: &mut Vec<AppCommand>,
) {
    let frame = egui::Frame::NONE.inner_margin(8);
    egui::Panel::top("author ways")
        .resizable(false)
        .frame(frame)
        .show(ui, |ui| preview_options_ui(ui, editor, words, commands));
    let height = (SLICES_SHARE * ui.available_height()).max(150.0);
    egui::Panel::bottom("author cuts").exact_size(height).resizable(false).frame(frame).show(ui, |ui| {
        slices_ui(ui, editor, &mut views.preview.slices, words, commands);
    });
    egui::CentralPanel::no_frame().show(ui, |ui| tooth_ui(ui, editor, settings, views, words, commands));
}

/// Display options of the preview, in one row while there is room.
fn preview_options_ui(ui: &mut egui::Ui, editor: &EditorState, words: &Translations, commands: &mut Vec<AppCommand>) {
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 8.0;
        let now = PreviewMode::ALL.iter().find(|(way, _)| *way == editor.preview.mode).map_or("", |(_, key)| *key);
        let combo = egui::ComboBox::from_id_salt("way").width(130.0).truncate().selected_text(words.get(now));
        let shown = combo.show_ui(ui, |ui| {
            for (way, key) in PreviewMode::ALL {
                if ui.selectable_label(way == editor.preview.mode, words.get(key)).clicked() {
                    commands.push(AppCommand::Editor(EditorCommand::SetPreviewMode(way)));
                }
            }
        });
        shown.response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::ComboBox, true, words.get("author.way")));
        if editor.build.as_ref().is_some_and(|build| !build.surroundings.is_empty()) {
            let mut has_around = editor.preview.shows_surroundings;
            if ui.checkbox(&mut has_around, words.get("author.around")).changed() {
                commands.push(AppCommand::Editor(EditorCommand::ShowSurroundings(has_around)));
            }
        }
        let is_by_chance = editor.draft.text().contains("random");
        if is_by_chance {
            let anew = ui.small_button(words.get("author.draw_anew"));
            if anew.on_hover_text(words.get("author.draw_anew_about")).clicked() {
                commands.push(AppCommand::Editor(EditorCommand::Reroll));
            }
        }
    });
}

fn tooth_ui(
    ui: &mut egui::Ui,
    editor: &EditorState,
    settings: &Settings,
    views: &mut Views,
    words: &Translations,
    commands: &mut Vec<AppCommand>,
) {
    let rect = ui.available_rect_before_wrap();
    let view = ui.interact(rect, ui.scope_id().with("tooth"), Sense::click_and_drag());
    view.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Canvas, true, words.get("author.view")));
    anchor(ui, "view", rect);
    viewport_input::collect_commands(ui, &view, false, commands);
    ui.painter().rect_filled(rect, 0, Color32::from_rgb(0xd5, 0xdc, 0xe0));
    let scale = ui.pixels_per_point();
    let size = [rect.width(), rect.height()].map(|points| (points * scale).round().max(1.0) as u32);
    let Views { viewport, preview, .. } = views;
    match viewport.as_mut().map(|viewport| preview.draw(editor, settings, viewport, size)) {
        Some(Ok(Some(id))) => {
            let whole = Rect::from_min_max(Pos2::ZERO, Pos2::new(1.0, 1.0));
            ui.painter().image(id, rect, whole, Color32::WHITE);
        }
        Some(Ok(None)) => {
            let key = if editor.complaints.is_empty() { "practice.making" } else { "author.not_made" };
            ui.put(rect.shrink(30.0), egui::Label::new(words.get(key)).wrap());
        }
        Some(Err(error)) => {
            let text = egui::RichText::new(error.to_string()).color(theme::ERROR);
            ui.put(rect.shrink(30.0), egui::Label::new(text).wrap());
        }
        None => {
            ui.put(rect.shrink(30.0), egui::Label::new(words.get("practice.no_picture")).wrap());
        }
    }
    let eye = editor.preview.orbit.viewpoint().eye(rect.width() / rect.height());
    if editor.section == EditorSection::Decay && decay::handles_ui(ui, editor, &eye, rect, words, commands) {
        return;
    }
    if view.clicked()
        && let Some(at) = view.interact_pointer_pos()
        && let Some((point, outward)) = pick(editor, &eye, rect, at)
    {
        let ask = if editor.section == EditorSection::Decay {
            EditorCommand::PlaceDecay(point, outward)
        } else {
            EditorCommand::MoveSlices(point)
        };
        commands.push(AppCommand::Editor(ask));
    }
    hint_ui(ui, editor, rect, words);
}

/// Hint on the effect of a click, and a notice while the preview is not yet that of the present text.
fn hint_ui(ui: &mut egui::Ui, editor: &EditorState, rect: Rect, words: &Translations) {
    let key = if editor.section == EditorSection::Decay { "author.point" } else { "author.point_cuts" };
    let more =
        if editor.is_tooth_pending() { format!(" · {}", words.get("author.being_made")) } else { String::new() };
    let text = egui::RichText::new(format!("{}{more}", words.get(key))).color(Color32::WHITE).size(13.0);
    let width = (rect.width() - 16.0).max(40.0);
    let galley = egui::WidgetText::from(text).into_galley(
        ui,
        Some(egui::TextWrapMode::Wrap),
        width - 16.0,
        egui::TextStyle::Small,
    );
    let size = galley.size() + egui::vec2(16.0, 8.0);
    let place = Rect::from_center_size(rect.center_bottom() - egui::vec2(0.0, 0.5 * size.y + 8.0), size);
    ui.painter().rect_filled(place, 8, Color32::from_black_alpha(150));
    ui.painter().galley(place.min + egui::vec2(8.0, 4.0), galley, Color32::WHITE);
}

/// Point of the tooth's surface under a screen position, tooth space, mm, with the outward direction there.
fn pick(editor: &EditorState, eye: &Eye, rect: Rect, at: Pos2) -> Option<(Vec3, Vec3)> {
    let build = editor.build.as_ref()?;
    let share = (at - rect.min) / rect.size();
    let tooth_from_world = build.workpiece.world_from_tooth.inverse();
    let from = tooth_from_world * eye.position;
    let along = tooth_from_world.rotate(eye.ray(share.x, share.y)).try_normalize()?;
    build.workpiece.volume.raycast(from, along)
}
