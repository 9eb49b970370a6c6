//! A section through the working end, beside the picture: how deep the instrument is, which the picture does not show.

use crate::i18n::Translations;
use crate::lesson_scene::LessonScene;
use crate::lesson_state::LessonState;
use crate::snapshot::is_still;
use eframe::egui::{self, Color32, Pos2, Rect, Stroke, vec2};
use typodont_core::frame::{Quat, Vec3};
use typodont_report::raycast::{self, ImagePlane, OrthographicCamera, PixelBuffer};
use typodont_scene::pointing::ring_radius;

/// Side of the section in the scene, mm: a crown with its surroundings.
const SIDE_MM: f32 = 10.0;

/// Number of pixels along each side.
const PIXELS: u32 = 96;

/// Side of the section on the screen, points, and its distance from the view's edges.
const SIDE: f32 = 190.0;
const MARGIN: f32 = 12.0;

/// Colour of the empty space, and share of their brightness in which the surroundings of the tooth are drawn.
const BACKGROUND: [f32; 3] = [0.11, 0.14, 0.16];
const SURROUNDINGS: f32 = 0.8;

/// Image of a section, and what it depends on.
pub struct SectionImage {
    tip: Vec3,
    azimuth: f32,
    edit_count: u64,
    texture: egui::TextureHandle,
}

const LINE: Color32 = Color32::from_rgba_premultiplied(190, 190, 190, 190);

/// Draws the section in the lower right corner of the view. The section plane is upright, contains the tip, and is
/// parallel to the picture's horizontal.
pub fn section_ui(
    ui: &egui::Ui,
    view: Rect,
    lesson: &LessonState,
    section: &mut Option<SectionImage>,
    words: &Translations,
) {
    let (Some(scene), Some(snapshot)) = (&lesson.scene, &lesson.snapshot) else { return };
    let Some(instrument) = lesson.scenario.instruments.get(snapshot.instrument as usize) else { return };
    if view.width() < 3.0 * SIDE || view.height() < 2.0 * SIDE {
        return;
    }
    let rect = Rect::from_min_size(view.right_bottom() - vec2(SIDE + MARGIN, SIDE + MARGIN + 36.0), vec2(SIDE, SIDE));
    let texture = section_texture(ui, scene, section, lesson.orbit.azimuth, snapshot.tip);
    let painter = ui.painter().with_clip_rect(rect);
    let whole = Rect::from_min_max(Pos2::ZERO, Pos2::new(1.0, 1.0));
    painter.image(texture, rect, whole, Color32::WHITE);
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
    let title_at = rect.left_top() + vec2(6.0, 4.0);
    let font = egui::FontId::proportional(12.0);
    painter.text(title_at, egui::Align2::LEFT_TOP, words.get("practice.section"), font, Color32::WHITE);
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

/// Texture of the section, drawn again only if one of its inputs has changed visibly, as the view is.
fn section_texture(
    ui: &egui::Ui,
    scene: &LessonScene,
    section: &mut Option<SectionImage>,
    azimuth: f32,
    tip: Vec3,
) -> egui::TextureId {
    let edit_count = scene.edit_count;
    let is_same =
        |image: &&SectionImage| is_still(image.tip, tip) && image.azimuth == azimuth && image.edit_count == edit_count;
    if let Some(image) = section.as_ref().filter(is_same) {
        return image.texture.id();
    }
    let size = [PIXELS as usize; 2];
    let image = egui::ColorImage::from_rgb(size, &section_picture(scene, azimuth, tip).rgb8());
    let texture = ui.ctx().load_texture("section", image, egui::TextureOptions::LINEAR);
    let id = texture.id();
    *section = Some(SectionImage { tip, azimuth, edit_count, texture });
    id
}

/// The tooth in the section plane, in the colours of its tissues, and what surrounds it.
fn section_picture(scene: &LessonScene, azimuth: f32, tip_in_world: Vec3) -> PixelBuffer {
    let LessonScene { volume, workpiece, palette, .. } = scene;
    let tooth_from_world = workpiece.world_from_tooth.inverse();
    let middle = tooth_from_world * tip_in_world;
    let camera = OrthographicCamera {
        middle,
        right: tooth_from_world.rotate(Quat::from_rotation_y(azimuth) * Vec3::X),
        up: tooth_from_world.rotate(Vec3::Y),
        half_height: 0.5 * SIDE_MM,
    };
    let plane = ImagePlane { camera, width: PIXELS, height: PIXELS };
    let mut picture = PixelBuffer::filled(PIXELS, PIXELS, BACKGROUND);
    let nearby: Vec<_> = workpiece.surroundings.iter().filter(|c| c.distance(middle) < SIDE_MM).collect();
    for collider in nearby {
        let colour = palette.appearance(collider.label).colour.map(|part| SURROUNDINGS * part);
        blend_solid(&mut picture, colour, |x, y| collider.distance(plane.unproject(x, y)));
    }
    picture.composite(&raycast::slice(volume, &plane, middle, |label, _| palette.appearance(label).colour));
    picture
}

/// Blends the part of a picture that is within a solid. `distance`: from a place of the picture, pixels, to the solid, mm. Parts
/// that are thinner than `STEP` pixels may be missing.
fn blend_solid(picture: &mut PixelBuffer, colour: [f32; 3], distance: impl Fn(f32, f32) -> f32) {
    /// Pixels between places at which the distance is asked for: distances to meshes are slow.
    const STEP: u32 = 4;
    const PER_SIDE: u32 = PIXELS / STEP + 1;
    const MM_PER_PIXEL: f32 = SIDE_MM / PIXELS as f32;
    let places = (0..PER_SIDE).flat_map(|y| (0..PER_SIDE).map(move |x| (x * STEP, y * STEP)));
    let known: Vec<f32> = places.map(|(x, y)| distance(x as f32, y as f32)).collect();
    for (x, y) in (0..PIXELS).flat_map(|y| (0..PIXELS).map(move |x| (x, y))) {
        let [(column, right), (row, below)] =
            [x, y].map(|pixel| (pixel / STEP, ((pixel % STEP) as f32 + 0.5) / STEP as f32));
        let at = |row: u32, column: u32| known[(row * PER_SIDE + column) as usize];
        let [above, under] = [row, row + 1].map(|row| lerp(at(row, column), at(row, column + 1), right));
        let share = (0.5 - lerp(above, under, below) / MM_PER_PIXEL).clamp(0.0, 1.0);
        picture.blend_pixel(i64::from(x), i64::from(y), colour, share);
    }
}

fn lerp(from: f32, to: f32, share: f32) -> f32 {
    from + (to - from) * share
}
