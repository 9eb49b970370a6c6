//! Three movable slices through the tooth: across it, along it, and horizontal.

use crate::command::AppCommand;
use crate::editor::EditorCommand;
use crate::editor::EditorState;
use crate::i18n::Translations;
use crate::ui::preview_view::SliceImage;
use crate::ui::ui_anchors::anchor;
use eframe::egui::{self, Color32, Pos2, Rect, Sense, Stroke};
use typodont_core::frame::Vec3;
use typodont_report::raycast;
use typodont_report::raycast::{ImagePlane, OrthographicCamera, ViewSide};

/// The slices: the side from which each is seen, the axis along which it is moved, and its name.
const SLICES: [(ViewSide, usize, &str); 3] = [
    (ViewSide::Occlusal, 2, "author.cut_level"),
    (ViewSide::Mesial, 1, "author.cut_across"),
    (ViewSide::Lingual, 0, "author.cut_along"),
];

/// Background colour of a slice.
const BACKGROUND: [f32; 3] = [0.20, 0.24, 0.27];

/// The three slices, with their last images.
pub fn slices_ui(
    ui: &mut egui::Ui,
    editor: &EditorState,
    images: &mut [Option<SliceImage>; 3],
    words: &Translations,
    commands: &mut Vec<AppCommand>,
) {
    if editor.build.is_none() {
        return;
    }
    let gap = 8.0;
    let width = (ui.available_width() - 2.0 * gap) / 3.0;
    let height = (ui.available_height() - 62.0).max(60.0);
    ui.spacing_mut().item_spacing = egui::vec2(gap, 4.0);
    ui.horizontal_top(|ui| {
        for (place, image) in images.iter_mut().enumerate() {
            ui.vertical(|ui| {
                ui.set_width(width);
                slice_ui(ui, editor, (place, image), egui::vec2(width, height), words, commands);
            });
        }
    });
}

fn slice_ui(
    ui: &mut egui::Ui,
    editor: &EditorState,
    (which, image): (usize, &mut Option<SliceImage>),
    size: egui::Vec2,
    words: &Translations,
    commands: &mut Vec<AppCommand>,
) {
    let (side, axis, key) = SLICES[which];
    let name = ui.add(egui::Label::new(egui::RichText::new(words.get(key)).size(13.0).strong()).truncate());
    let Some(build) = &editor.build else { return };
    let bounds = build.workpiece.bounds();
    let (rect, view) = ui.allocate_exact_size(size, Sense::click_and_drag());
    view.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Canvas, true, words.get(key)));
    anchor(ui, format!("cut:{axis}"), rect);
    let scale = ui.pixels_per_point();
    let pixels = [rect.width(), rect.height()].map(|points| (points * scale).round().max(8.0) as u32);
    let shot = ImagePlane {
        camera: OrthographicCamera::framing_box(side, &bounds, pixels[0] as f32 / pixels[1] as f32),
        width: pixels[0],
        height: pixels[1],
    };
    let id = slice_texture(ui, editor, (which, image), &shot);
    let whole = Rect::from_min_max(Pos2::ZERO, Pos2::new(1.0, 1.0));
    ui.painter().image(id, rect, whole, Color32::WHITE);
    let distal = editor.build.as_ref().map_or(Some(Vec3::Y), |made| made.workpiece.common_distal());
    crosshair_ui(ui, editor.preview.slice_point, &shot, rect, scale);
    if let Some(distal) = distal {
        orientation_letters_ui(ui, &shot.camera, rect, distal.y > 0.0);
    }
    if (view.clicked() || view.dragged())
        && let Some(at) = view.interact_pointer_pos()
    {
        let at = (at - rect.min) * scale;
        let mut point = bounds.nearest(shot.unproject(at.x, at.y));
        point[axis] = editor.preview.slice_point[axis];
        commands.push(AppCommand::Editor(EditorCommand::MoveSlices(point)));
    }
    let mut position = editor.preview.slice_point[axis];
    ui.spacing_mut().slider_width = (size.x - 66.0).max(20.0);
    let slider = egui::Slider::new(&mut position, bounds.low[axis]..=bounds.high[axis]).fixed_decimals(1).suffix(" mm");
    // Adding 0.0 avoids "-0.0".
    let slider = slider.custom_formatter(|mm, _| format!("{:.1}", (mm * 10.0).round() / 10.0 + 0.0));
    ui.spacing_mut().interact_size.x = 50.0;
    ui.spacing_mut().button_padding.x = 4.0;
    ui.style_mut().override_font_id = Some(egui::FontId::proportional(12.0));
    if ui.add(slider).labelled_by(name.id).changed() {
        let mut point = editor.preview.slice_point;
        point[axis] = position;
        commands.push(AppCommand::Editor(EditorCommand::MoveSlices(point)));
    }
}

/// Image of a slice, drawn again only if one of its inputs has changed.
fn slice_texture(
    ui: &egui::Ui,
    editor: &EditorState,
    (which, last): (usize, &mut Option<SliceImage>),
    shot: &ImagePlane,
) -> egui::TextureId {
    let (_, axis, key) = SLICES[which];
    let (generation, position) = (editor.preview.generation, editor.preview.slice_point[axis]);
    let size = [shot.width, shot.height];
    let is_same = |cut: &&SliceImage| cut.generation == generation && cut.position == position && cut.size == size;
    if let Some(cut) = last.as_ref().filter(is_same) {
        return cut.texture.id();
    }
    let palette = &editor.preview.palette;
    let picture = editor.build.as_ref().map(|made| {
        let colour = |label, _| palette.appearance(label).colour;
        let mut background = raycast::PixelBuffer::filled(shot.width, shot.height, BACKGROUND);
        background.composite(&raycast::slice(&made.workpiece.volume, shot, editor.preview.slice_point, colour));
        background.rgb8()
    });
    let image = egui::ColorImage::from_rgb(size.map(|n| n as usize), &picture.unwrap_or_default());
    let texture = ui.ctx().load_texture(key, image, egui::TextureOptions::LINEAR);
    let id = texture.id();
    *last = Some(SliceImage { generation, position, size, texture });
    id
}

/// Lines at the positions of the other two slices.
fn crosshair_ui(ui: &egui::Ui, cut: Vec3, shot: &ImagePlane, rect: Rect, scale: f32) {
    let [x, y] = shot.project(cut);
    let at = rect.min + egui::vec2(x, y) / scale;
    let pen = Stroke::new(1.0, Color32::from_rgba_unmultiplied(0xff, 0xd0, 0x40, 0xb0));
    let painter = ui.painter_at(rect);
    painter.vline(at.x, rect.y_range(), pen);
    painter.hline(rect.x_range(), at.y, pen);
}

/// A letter at each edge for the direction there: buccal, lingual, mesial, distal, occlusal, root.
fn orientation_letters_ui(ui: &egui::Ui, camera: &OrthographicCamera, rect: Rect, distal_is_plus: bool) {
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
        // A dark background, because enamel is as white as the letter.
        painter.rect_filled(place.expand2(egui::vec2(3.0, 0.0)), 3, Color32::from_black_alpha(170));
        painter.galley(place.min, galley, Color32::WHITE);
    }
}
