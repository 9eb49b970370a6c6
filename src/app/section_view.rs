//! A section through the working end, beside the picture: how deep the instrument is, which the picture does not show.

use super::lesson_scene::LessonScene;
use super::snapshot::LessonSnapshot;
use eframe::egui::{self, Color32, Pos2, Rect, Stroke, vec2};
use typodont_core::frame::{Quat, Vec3};
use typodont_core::volume::{ISO, Label, Volume};
use typodont_exercise::catalog::InstrumentEntry;
use typodont_render::{LabelPalette, Orbit};
use typodont_scene::pointing::ring_radius;

/// Side of the section in the scene, mm: a crown with its surroundings.
const SIDE_MM: f32 = 10.0;

/// Number of samples along each side.
const SAMPLES: usize = 96;

/// Side of the section on the screen, points, and its distance from the view's edges.
const SIDE: f32 = 190.0;
const MARGIN: f32 = 12.0;

const BACKGROUND: Color32 = Color32::from_rgb(0x1d, 0x24, 0x2a);
const SOFT_TISSUE: Color32 = Color32::from_rgb(0xb0, 0x6c, 0x68);
const LINE: Color32 = Color32::from_rgba_premultiplied(190, 190, 190, 190);

/// Draws the section in the lower right corner of the view. The section plane is upright, contains the tip, and is
/// parallel to the picture's horizontal.
pub fn section_ui(
    ui: &egui::Ui,
    view: Rect,
    scene: &LessonScene,
    orbit: &Orbit,
    snapshot: &LessonSnapshot,
    instrument: &InstrumentEntry,
) {
    if view.width() < 3.0 * SIDE || view.height() < 2.0 * SIDE {
        return;
    }
    let rect = Rect::from_min_size(view.right_bottom() - vec2(SIDE + MARGIN, SIDE + MARGIN + 36.0), vec2(SIDE, SIDE));
    let right = Quat::from_rotation_y(orbit.azimuth) * Vec3::X;
    let plane = TipPlane { middle: snapshot.tip, right, up: Vec3::Y };
    let image = section_image(scene, &plane);
    let id = ui.scope_id().with("section");
    let texture = ui.data(|data| data.get_temp::<egui::TextureHandle>(id));
    let texture = match texture {
        Some(mut texture) => {
            texture.set(image, egui::TextureOptions::LINEAR);
            texture
        }
        None => {
            let texture = ui.ctx().load_texture("section", image, egui::TextureOptions::LINEAR);
            ui.data_mut(|data| data.insert_temp(id, texture.clone()));
            texture
        }
    };
    let painter = ui.painter().with_clip_rect(rect);
    let whole = Rect::from_min_max(Pos2::ZERO, Pos2::new(1.0, 1.0));
    painter.image(texture.id(), rect, whole, Color32::WHITE);
    let points_per_mm = SIDE / SIDE_MM;
    // The outline of the working end: a ball about the tip, or an upright cylinder on it.
    let radius = ring_radius(&instrument.end) * points_per_mm;
    let length = typodont_scene::pointing::working_length(&instrument.end) * points_per_mm;
    let tip = rect.center();
    let outline = match length > 0.0 {
        true => Rect::from_min_max(tip - vec2(radius, length), tip + vec2(radius, 0.0)),
        false => Rect::from_center_size(tip, vec2(2.0 * radius, 2.0 * radius)),
    };
    let rounding = if length > 0.0 { 1.0 } else { radius };
    let shaft = [outline.center_top(), Pos2::new(tip.x, rect.min.y)];
    painter.line_segment(shaft, Stroke::new(2.0, LINE));
    painter.rect(outline, rounding, Color32::from_white_alpha(70), Stroke::new(1.5, LINE), egui::StrokeKind::Inside);
    scale_ui(&painter, rect, points_per_mm);
    ui.painter().rect_stroke(rect, 4.0, Stroke::new(1.0, Color32::from_black_alpha(120)), egui::StrokeKind::Outside);
}

/// A scale of 1 mm marks along the left edge.
fn scale_ui(painter: &egui::Painter, rect: Rect, points_per_mm: f32) {
    let marks = (SIDE_MM * 0.5) as i32;
    for mm in -marks..=marks {
        let y = rect.center().y + mm as f32 * points_per_mm;
        let length = if mm == 0 { 12.0 } else { 6.0 };
        painter.line_segment([Pos2::new(rect.min.x, y), Pos2::new(rect.min.x + length, y)], Stroke::new(1.0, LINE));
    }
    let at = Pos2::new(rect.min.x + 4.0, rect.center().y + points_per_mm);
    painter.text(at + vec2(6.0, 0.0), egui::Align2::LEFT_CENTER, "1 mm", egui::FontId::proportional(11.0), LINE);
}

/// A plane in world space, mm, with its directions to the right and up.
struct TipPlane {
    middle: Vec3,
    right: Vec3,
    up: Vec3,
}

/// Colours of the tissues in a plane.
fn section_image(scene: &LessonScene, plane: &TipPlane) -> egui::ColorImage {
    let LessonScene { volume, workpiece, palette, .. } = scene;
    let tooth_from_world = workpiece.world_from_tooth.inverse();
    let step = SIDE_MM / SAMPLES as f32;
    let corner = plane.middle + (plane.up - plane.right) * (0.5 * (SIDE_MM - step));
    let (right, down) = (tooth_from_world.rotate(plane.right) * step, tooth_from_world.rotate(-plane.up) * step);
    let corner = tooth_from_world * corner;
    let half_diagonal = SIDE_MM;
    let middle = tooth_from_world * plane.middle;
    let nearby: Vec<_> = workpiece.surroundings.iter().filter(|c| c.distance(middle) < half_diagonal).collect();
    // Distances to meshes are slow: one per block of samples.
    const BLOCK: usize = 4;
    let blocks = SAMPLES / BLOCK;
    let at = |x: f32, y: f32| corner + right * x + down * y;
    let is_beside: Vec<bool> = (0..blocks * blocks)
        .map(|i| at(((i % blocks) * BLOCK) as f32 + 1.5, ((i / blocks) * BLOCK) as f32 + 1.5))
        .map(|place| nearby.iter().any(|c| c.distance(place) <= 0.0))
        .collect();
    let colour = |i: usize| {
        let (x, y) = (i % SAMPLES, i / SAMPLES);
        match tissue_at(volume, at(x as f32, y as f32)) {
            Some(label) => tissue_colour(palette, label),
            None if is_beside[(y / BLOCK) * blocks + x / BLOCK] => SOFT_TISSUE,
            None => BACKGROUND,
        }
    };
    egui::ColorImage::new([SAMPLES; 2], (0..SAMPLES * SAMPLES).map(colour).collect())
}

fn tissue_at(volume: &Volume, place: Vec3) -> Option<Label> {
    let grid = volume.grid();
    let voxel = grid.nearest(place).filter(|_| volume.density_at(place) >= ISO)?;
    Some(volume.labels()[grid.index(voxel)])
}

fn tissue_colour(palette: &LabelPalette, label: Label) -> Color32 {
    let [r, g, b] = palette.appearance(label).colour.map(|share| (share.clamp(0.0, 1.0) * 255.0).round() as u8);
    Color32::from_rgb(r, g, b)
}
