//! Each tissue in its colour.

use crate::content::{Role, TissueTable};
use crate::render::Palette;

/// Wet enamel and dull decay lie on either side; see [`Finish`](crate::render::Finish).
pub(super) const GLOSS: f32 = 0.15;

/// Each tissue in its colour; decay in that of enamel, in which it hides, where the exercise does not show it.
pub fn palette(tissues: &TissueTable, is_decay_shown: bool) -> Palette {
    let sound = tissues.by_name("enamel");
    Palette::of(
        |label| {
            let entry = tissues.by_label(label).filter(|e| is_decay_shown || e.role != Role::Decay).or(sound);
            entry.map_or([0.85, 0.82, 0.75], |e| e.rgb())
        },
        GLOSS,
    )
}
