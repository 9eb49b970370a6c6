//! Colours of the tissues.

use typodont_core::volume::Label;
use typodont_exercise::catalog::{TissueRole, TissueTable};
use typodont_render::{Appearance, LabelPalette};

/// Gloss of tissue under a film of saliva, and of dull decay and deposits; see [`Appearance`](typodont_render::Appearance).
pub(super) const GLOSS: f32 = 0.2;
const DULL: f32 = 0.1;

/// Colour of each tissue. Unless the exercise shows decay, it has the colour of enamel and cannot be seen.
pub fn tissue_palette(tissues: &TissueTable, is_decay_shown: bool) -> LabelPalette {
    let enamel = tissues.by_name("enamel");
    let entry =
        |label: u8| tissues.by_label(Label(label)).filter(|e| is_decay_shown || e.role != TissueRole::Decay).or(enamel);
    LabelPalette(std::array::from_fn(|label| {
        let entry = entry(label as u8);
        let is_dull = entry.is_some_and(|e| matches!(e.role, TissueRole::Decay | TissueRole::Deposit));
        Appearance { colour: entry.map_or([0.85, 0.82, 0.75], |e| e.rgb()), gloss: if is_dull { DULL } else { GLOSS } }
    }))
}
