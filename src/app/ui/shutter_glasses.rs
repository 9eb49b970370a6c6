//! Stereo for shutter glasses: one eye's picture in each frame, and the mark by which the glasses tell the eyes apart.
//!
//! The mark is a line along the lower edge of the screen: white over the left quarter of the width in frames of the left
//! eye, over the left three quarters in frames of the right eye, black beside it. It is the line code that emitters for
//! CrystalEyes glasses read from the picture's last rows (as Psychtoolbox draws it, `SetStereoBlueLineSyncParameters`).

use crate::settings::MirroredWindow;
use eframe::egui::{Color32, Context, Id, LayerId, Order, Rect, Vec2};

/// Share of the screen's width that is white in frames of the left and of the right eye.
pub const MARKED: [f32; 2] = [0.25, 0.75];

/// Height of the mark, pixels: more than one row, because some drivers cut off the last one.
const HEIGHT: f32 = 3.0;

/// True in every other frame: that of the right eye.
pub fn is_right_eye(ctx: &Context) -> bool {
    ctx.cumulative_frame_nr() % 2 == 1
}

/// Draws the mark of this frame's eye over everything else, where the emitter reads it, also in a window that is flipped.
pub fn eye_mark_ui(ctx: &Context, mirrored: MirroredWindow) {
    let screen = ctx.viewport_rect();
    let row = Rect::from_min_max(screen.left_bottom() - Vec2::Y * (HEIGHT / ctx.pixels_per_point()), screen.max);
    let marked = MARKED[usize::from(is_right_eye(ctx))] * row.width();
    let painter = ctx.layer_painter(LayerId::new(Order::Debug, Id::unique("eye mark")));
    let white = Rect::from_min_size(row.min, Vec2::new(marked, row.height()));
    painter.rect_filled(mirrored.rect(row, screen), 0, Color32::BLACK);
    painter.rect_filled(mirrored.rect(white, screen), 0, Color32::WHITE);
}
