//! Screen positions of fields and buttons, for tests and tools that cannot see the screen: names with centre points.
//!
//! They are written to the state log; without a state log nothing is recorded.

use crate::state_log::StateLog;
use eframe::egui::{self, Rect};

#[derive(Clone, Default)]
struct UiAnchors(Vec<(String, Rect)>);

fn storage_id() -> egui::Id {
    egui::Id::unique("author marks")
}

/// Records the rectangle of a widget, if any of it is visible.
pub fn anchor(ui: &egui::Ui, name: impl Into<String>, rect: Rect) {
    let visible = rect.intersect(ui.clip_rect());
    if visible.is_positive() {
        ui.data_mut(|data| data.get_temp_mut_or_default::<UiAnchors>(storage_id()).0.push((name.into(), visible)));
    }
}

/// Writes the anchors of this frame to the log, in pixels: `name=x,y` each.
pub fn log_anchors(ctx: &egui::Context, log: &mut StateLog) {
    let anchors = ctx.data_mut(|data| std::mem::take(data.get_temp_mut_or_default::<UiAnchors>(storage_id())));
    let scale = ctx.pixels_per_point();
    let line = anchors.0.iter().map(|(name, rect)| {
        let at = rect.center() * scale;
        format!("{name}={:.0},{:.0}", at.x, at.y)
    });
    log.record("marks", line.collect::<Vec<_>>().join(" "));
}
