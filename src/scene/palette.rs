//! Colours of the tissues.

use typodont_exercise::catalog::{TissueRole, TissueTable};
use typodont_render::LabelPalette;

/// Gloss of every tissue, between that of wet enamel and that of dull decay; see
/// [`Appearance`](typodont_render::Appearance).
pub(super) const GLOSS: f32 = 0.15;

/// Colour of each tissue. Unless the exercise shows decay, it has the colour of enamel and cannot be seen.
pub fn tissue_palette(tissues: &TissueTable, is_decay_shown: bool) -> LabelPalette {
    let enamel = tissues.by_name("enamel");
    LabelPalette::from_colours(
        |label| {
            let entry = tissues.by_label(label).filter(|e| is_decay_shown || e.role != TissueRole::Decay).or(enamel);
            entry.map_or([0.85, 0.82, 0.75], |e| e.rgb())
        },
        GLOSS,
    )
}
