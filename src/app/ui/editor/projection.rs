//! Projection of points of the tooth to the screen.

use crate::editor::EditorState;
use eframe::egui::{self, Pos2, Rect};
use typodont_core::frame::Vec3;
use typodont_render::Eye;

/// Screen position of a point of tooth space (mm), with the scale there, points per mm; `None` behind the camera.
pub fn project(editor: &EditorState, eye: &Eye, rect: Rect, point_in_tooth: Vec3) -> Option<(Pos2, f32)> {
    let build = editor.build.as_ref()?;
    let ([x, y], depth) = eye.project(build.workpiece.world_from_tooth * point_in_tooth);
    let height = depth * (eye.window.top - eye.window.bottom);
    (depth > 0.0).then(|| (rect.min + egui::vec2(x * rect.width(), y * rect.height()), rect.height() / height))
}
