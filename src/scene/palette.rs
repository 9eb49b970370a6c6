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

/// Attenuation of X-rays by a tissue, per mm, at 40 keV: about the mean of a dental tube of 65 kV. Unless the exercise shows
/// decay, it attenuates as sound tissue and cannot be seen.
///
/// Mass attenuation coefficients are those of Hubbell and Seltzer, NISTIR 5632 (hydroxyapatite 0.99 cm²/g by its elements,
/// soft tissue 0.27 cm²/g, silver 17 cm²/g), densities and mineral contents those of textbooks: enamel 2.9 g/cm³ with 95 %
/// mineral, dentine 2.14 g/cm³ with 70 %; soft decay has lost half of its mineral, firm decay a fifth. A radiopaque
/// composite is as dense as enamel.
pub fn x_ray_attenuation(tissues: &TissueTable, label: Label, is_decay_shown: bool) -> f32 {
    const ENAMEL: f32 = 0.276;
    const DENTINE: f32 = 0.165;
    const SOFT: f32 = 0.0285;
    const SOFT_DECAY: f32 = 0.094;
    const FIRM_DECAY: f32 = 0.133;
    const CALCULUS: f32 = 0.14;
    const BONE: f32 = 0.128;
    const AMALGAM: f32 = 18.0;
    let Some(entry) = tissues.by_label(label) else { return 0.0 };
    match entry.name.as_str() {
        "enamel" | "stain" => return ENAMEL,
        "amalgam" | "fresh_amalgam" => return AMALGAM,
        "bone" => return BONE,
        "firm_caries" if is_decay_shown => return FIRM_DECAY,
        _ => {}
    }
    match entry.role {
        TissueRole::Decay if is_decay_shown => SOFT_DECAY,
        TissueRole::Decay | TissueRole::Sound => DENTINE,
        TissueRole::Vulnerable | TissueRole::Soft => SOFT,
        TissueRole::Neighbour | TissueRole::Material => ENAMEL,
        TissueRole::Deposit => CALCULUS,
    }
}
