//! The tooth in three cuts that can be moved: across it, along it, and level.

use super::super::command::Command;
use super::super::language::Words;
use super::Ask;
use super::document::Authoring;
use super::marks::mark;
use super::view::Cut;
use crate::frame::Vec3;
use crate::volume::march::{self, Camera, Shot, Side};
use eframe::egui::{self, Color32, Pos2, Rect, Sense, Stroke};

/// The cuts: the side they are seen from, the axis that they are moved along, and their names.
const CUTS: [(Side, usize, &str); 3] = [
    (Side::Occlusal, 2, "author.cut_level"),
    (Side::Mesial, 1, "author.cut_across"),
    (Side::Lingual, 0, "author.cut_along"),
];

/// Behind a cut.
const GROUND: [f32; 3] = [0.20, 0.24, 0.27];

pub fn slices_ui(ui: &mut egui::Ui, authoring: &mut Authoring, words: &Words, asked: &mut Vec<Command>) {
    if authoring.made.is_none() {
        return;
    }
    let gap = 8.0;
    let width = (ui.available_width() - 2.0 * gap) / 3.0;
    let height = (ui.available_height() - 62.0).max(60.0);
    ui.spacing_mut().item_spacing = egui::vec2(gap, 4.0);
    ui.horizontal_top(|ui| {
        for place in 0..CUTS.len() {
            ui.vertical(|ui| {
                ui.set_width(width);
                slice_ui(ui, authoring, place, egui::vec2(width, height), words, asked);
            });
        }
    });
}

fn slice_ui(
    ui: &mut egui::Ui,
    authoring: &mut Authoring,
    which: usize,
    size: egui::Vec2,
    words: &Words,
    asked: &mut Vec<Command>,
) {
    let (side, axis, key) = CUTS[which];
    let name = ui.add(egui::Label::new(egui::RichText::new(words.of(key)).size(13.0).strong()).truncate());
    let Some(made) = &authoring.made else { return };
    let [low, high] = {
        let teeth = &made.workpiece.teeth;
        let low = teeth.iter().map(|t| t.low).fold(Vec3::INFINITY, Vec3::min);
        [low, teeth.iter().map(|t| t.high).fold(Vec3::NEG_INFINITY, Vec3::max)]
    };
    let (rect, view) = ui.allocate_exact_size(size, Sense::click_and_drag());
    view.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Canvas, true, words.of(key)));
    mark(ui, format!("cut:{axis}"), rect);
    let scale = ui.pixels_per_point();
    let pixels = [rect.width(), rect.height()].map(|points| (points * scale).round().max(8.0) as u32);
    let shot = Shot {
        camera: Camera::around(side, low, high, pixels[0] as f32 / pixels[1] as f32),
        width: pixels[0],
        height: pixels[1],
    };
    let id = texture(ui, authoring, which, &shot);
    let whole = Rect::from_min_max(Pos2::ZERO, Pos2::new(1.0, 1.0));
    ui.painter().image(id, rect, whole, Color32::WHITE);
    let distal_is_plus = authoring.made.as_ref().is_none_or(|made| made.workpiece.distal().y > 0.0);
    cross_ui(ui, authoring.view.cut, &shot, rect, scale);
    letters_ui(ui, &shot.camera, rect, distal_is_plus);
    if (view.clicked() || view.dragged())
        && let Some(at) = view.interact_pointer_pos()
    {
        let at = (at - rect.min) * scale;
        let mut point = shot.point(at.x, at.y).clamp(low, high);
        point[axis] = authoring.view.cut[axis];
        asked.push(Command::Author(Ask::CutAt(point)));
    }
    let mut through = authoring.view.cut[axis];
    ui.spacing_mut().slider_width = (size.x - 66.0).max(20.0);
    let slider = egui::Slider::new(&mut through, low[axis]..=high[axis]).fixed_decimals(1).suffix(" mm");
    // Not "-0.0".
    let slider = slider.custom_formatter(|mm, _| format!("{:.1}", (mm * 10.0).round() / 10.0 + 0.0));
    ui.spacing_mut().interact_size.x = 50.0;
    ui.spacing_mut().button_padding.x = 4.0;
    ui.style_mut().override_font_id = Some(egui::FontId::proportional(12.0));
    if ui.add(slider).labelled_by(name.id).changed() {
        let mut point = authoring.view.cut;
        point[axis] = through;
        asked.push(Command::Author(Ask::CutAt(point)));
    }
}

/// The cut's picture, drawn anew only where something of it has changed.
fn texture(ui: &egui::Ui, authoring: &mut Authoring, which: usize, shot: &Shot) -> egui::TextureId {
    let (_, axis, key) = CUTS[which];
    let (generation, through) = (authoring.view.generation, authoring.view.cut[axis]);
    let size = [shot.width, shot.height];
    let is_same = |cut: &&Cut| cut.generation == generation && cut.through == through && cut.size == size;
    if let Some(cut) = authoring.view.cuts[which].as_ref().filter(is_same) {
        return cut.texture.id();
    }
    let palette = &authoring.view.palette;
    let picture = authoring.made.as_ref().map(|made| {
        let colour = |label, _| palette.finish(label).colour;
        let mut ground = march::Picture::plain(shot.width, shot.height, GROUND);
        ground.lay_over(&march::slice(&made.workpiece.volume, shot, authoring.view.cut, colour));
        ground.rgb8()
    });
    let image = egui::ColorImage::from_rgb(size.map(|n| n as usize), &picture.unwrap_or_default());
    let texture = ui.ctx().load_texture(key, image, egui::TextureOptions::LINEAR);
    let id = texture.id();
    authoring.view.cuts[which] = Some(Cut { generation, through, size, texture });
    id
}

/// Where the other two cuts run.
fn cross_ui(ui: &egui::Ui, cut: Vec3, shot: &Shot, rect: Rect, scale: f32) {
    let [x, y] = shot.place(cut);
    let at = rect.min + egui::vec2(x, y) / scale;
    let pen = Stroke::new(1.0, Color32::from_rgba_unmultiplied(0xff, 0xd0, 0x40, 0xb0));
    let painter = ui.painter_at(rect);
    painter.vline(at.x, rect.y_range(), pen);
    painter.hline(rect.x_range(), at.y, pen);
}

/// Which way is which, in a letter at each edge: buccal, lingual, mesial, distal, occlusal, root.
fn letters_ui(ui: &egui::Ui, camera: &Camera, rect: Rect, distal_is_plus: bool) {
    let letter = |way: Vec3| match way {
        w if w.x > 0.5 => "B",
        w if w.x < -0.5 => "L",
        w if w.z > 0.5 => "O",
        w if w.z < -0.5 => "R",
        w if (w.y > 0.5) == distal_is_plus => "D",
        _ => "M",
    };
    let inner = rect.shrink(4.0);
    let painter = ui.painter_at(rect);
    let edges = [
        (inner.left_center(), egui::Align2::LEFT_CENTER, -camera.right),
        (inner.right_center(), egui::Align2::RIGHT_CENTER, camera.right),
        (inner.center_top(), egui::Align2::CENTER_TOP, camera.up),
        (inner.center_bottom(), egui::Align2::CENTER_BOTTOM, -camera.up),
    ];
    for (at, align, way) in edges {
        let galley = painter.layout_no_wrap(letter(way).into(), egui::FontId::proportional(13.0), Color32::WHITE);
        let place = align.anchor_size(at, galley.size());
        // Enamel is as white as the letter.
        painter.rect_filled(place.expand2(egui::vec2(3.0, 0.0)), 3, Color32::from_black_alpha(170));
        painter.galley(place.min, galley, Color32::WHITE);
    }
}
