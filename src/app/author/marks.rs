//! Where on the screen things are, for whoever cannot see it: names with the middles of what they stand for.
//!
//! Written into the diary; without one nothing is noted.

use super::super::diary::Diary;
use eframe::egui::{self, Rect};

#[derive(Clone, Default)]
struct Marks(Vec<(String, Rect)>);

fn place() -> egui::Id {
    egui::Id::unique("author marks")
}

/// Remembers where something stands, as long as it can be seen.
pub fn mark(ui: &egui::Ui, name: impl Into<String>, rect: Rect) {
    let seen = rect.intersect(ui.clip_rect());
    if seen.is_positive() {
        ui.data_mut(|data| data.get_temp_mut_or_default::<Marks>(place()).0.push((name.into(), seen)));
    }
}

/// Writes down what was remembered in this picture, in pixels: `name=x,y` each.
pub fn note(ctx: &egui::Context, diary: &mut Diary) {
    let marks = ctx.data_mut(|data| std::mem::take(data.get_temp_mut_or_default::<Marks>(place())));
    let scale = ctx.pixels_per_point();
    let line = marks.0.iter().map(|(name, rect)| {
        let at = rect.center() * scale;
        format!("{name}={:.0},{:.0}", at.x, at.y)
    });
    diary.note("marks", line.collect::<Vec<_>>().join(" "));
}
