//! Colours of the tissues, and the seed of their fine relief.

use typodont_core::volume::Label;
use typodont_exercise::catalog::{TissueRole, TissueTable};
use typodont_exercise::scenario::{Scenario, Workpiece};
use typodont_render::{Appearance, ENAMEL_GLOSS, GROUND_GLOSS, LabelPalette, UnworkedTooth};

/// Gloss of materials under a film of saliva, of dull decay and deposits, and of the wet pulp; see
/// [`Appearance`](typodont_render::Appearance). Enamel's own says that it has ridges and cracks.
pub(super) const GLOSS: f32 = 0.22;
const DULL: f32 = 0.1;
const WET: f32 = 0.3;

/// Gloss of dentine, which is less than enamel's all the way to where it is cut: softer than enamel, it is left smoother by a bur, with the
/// silky sheen of its tubules.
const DENTINE: f32 = 0.185;
const CUT_DENTINE: f32 = 0.17;

/// Seed of the fine relief of a patient's teeth and of their cracks: each exercise has its own, and a report that of the lesson. It
/// knows nothing of what a session's seed has drawn, such as the place of hidden caries.
pub fn relief_seed(scenario: &Scenario) -> u16 {
    // FNV-1a, whose two halves become one.
    let hash =
        scenario.id.bytes().fold(0x811C_9DC5, |hash: u32, byte| (hash ^ u32::from(byte)).wrapping_mul(0x0100_0193));
    (hash ^ hash >> 16) as u16
}

/// Colour of each tissue. Unless the exercise shows decay, it has the colour of enamel and cannot be seen; dentine does not
/// shine through enamel then, because its absence above decayed dentine would give the decay away.
pub fn tissue_palette(tissues: &TissueTable, is_decay_shown: bool) -> LabelPalette {
    let enamel = tissues.by_name("enamel");
    let entry =
        |label: u8| tissues.by_label(Label(label)).filter(|e| is_decay_shown || e.role != TissueRole::Decay).or(enamel);
    let dentine = tissues.by_name("dentine");
    let is_dentine = |label: u8| dentine.is_some_and(|dentine| dentine.label() == Label(label));
    let appearances = std::array::from_fn(|label| {
        let entry = entry(label as u8);
        let gloss = match entry.map(|entry| entry.role) {
            _ if entry.map(|entry| entry.label()) == enamel.map(|enamel| enamel.label()) => ENAMEL_GLOSS,
            Some(TissueRole::Decay | TissueRole::Deposit) => DULL,
            Some(TissueRole::Vulnerable) => WET,
            _ if is_dentine(label as u8) => DENTINE,
            _ => GLOSS,
        };
        Appearance { colour: entry.map_or([0.85, 0.82, 0.75], |e| e.rgb()), gloss }
    });
    let is_decay = std::array::from_fn(|label| entry(label as u8).is_some_and(|entry| entry.role == TissueRole::Decay));
    let cut_gloss = std::array::from_fn(|label| {
        entry(label as u8).filter(|entry| entry.role == TissueRole::Sound)?;
        Some(if is_dentine(label as u8) { CUT_DENTINE } else { GROUND_GLOSS })
    });
    let under_translucent = dentine.filter(|_| is_decay_shown).map(|entry| entry.rgb());
    LabelPalette { appearances, is_decay, cut_gloss, translucent: enamel.map(|entry| entry.label()), under_translucent }
}

/// A tooth that nobody has worked on yet, with its enamel over sound dentine and pulp. Decay does not count as
/// dentine: what is decayed is drawn as decay, and its part in enamel would make the enamel around it look thin.
pub fn unworked_tooth(workpiece: &Workpiece, tissues: &TissueTable) -> UnworkedTooth {
    // Cavities that an exercise begins with are cuts, too.
    let volume = workpiece.original.as_ref().unwrap_or(&workpiece.volume);
    let under = ["dentine", "pulp"].map(|name| tissues.by_name(name).map(|entry| entry.label()));
    UnworkedTooth::of(volume, &under.into_iter().flatten().collect::<Vec<_>>())
}

/// Attenuation of X-rays by enamel, per mm; see [`x_ray_attenuation`].
pub(super) const ENAMEL_ATTENUATION: f32 = 0.276;

/// Attenuation of X-rays by a tissue, per mm, at 40 keV: about the mean of a dental tube of 65 kV. Unless the exercise
/// shows decay, all hard tissues of a tooth attenuate alike, and decay cannot be seen between them.
///
/// Sums over the elements of their mass attenuation coefficients (Elam, Ravel and Sieber, Radiation Physics and Chemistry
/// 63, 2002; those of NISTIR 5632 give the same within 1 %): hydroxyapatite 0.988 cm²/g, water 0.268, collagen 0.232.
/// Enamel: 2.9 g/cm³ with 95 % mineral; dentine: 2.14 g/cm³ with 70 % mineral, 20 % collagen and 10 % water; soft decay has
/// lost half of dentine's mineral to water, firm decay a fifth. Soft tissue and bone are those of ICRU Report 44. Amalgam:
/// 11.5 g/cm³ of mercury, silver, tin and copper (50, 33, 13 and 4 %). A radiopaque composite attenuates as enamel, and
/// calculus as dentine that has lost a fifth of its mineral; both are estimates.
pub fn x_ray_attenuation(tissues: &TissueTable, label: Label, is_decay_shown: bool) -> f32 {
    const DENTINE: f32 = 0.164;
    const HARD_TISSUE: f32 = 0.5 * (ENAMEL_ATTENUATION + DENTINE);
    const SOFT: f32 = 0.0277;
    const SOFT_DECAY: f32 = 0.098;
    const FIRM_DECAY: f32 = 0.138;
    const CALCULUS: f32 = 0.138;
    const BONE: f32 = 0.128;
    const AMALGAM: f32 = 17.4;
    let Some(entry) = tissues.by_label(label) else { return 0.0 };
    match entry.name.as_str() {
        "amalgam" | "fresh_amalgam" => return AMALGAM,
        "bone" => return BONE,
        "enamel" | "stain" if is_decay_shown => return ENAMEL_ATTENUATION,
        "firm_caries" if is_decay_shown => return FIRM_DECAY,
        _ => {}
    }
    match entry.role {
        TissueRole::Decay if is_decay_shown => SOFT_DECAY,
        TissueRole::Sound if is_decay_shown => DENTINE,
        TissueRole::Decay | TissueRole::Sound => HARD_TISSUE,
        TissueRole::Vulnerable | TissueRole::Soft => SOFT,
        TissueRole::Neighbour | TissueRole::Material => ENAMEL_ATTENUATION,
        TissueRole::Deposit => CALCULUS,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use typodont_formats::Library;

    #[test]
    fn a_radiograph_tells_tissues_apart_and_keeps_hidden_decay_hidden() {
        // Aim: enamel, dentine, decay and pulp differ by a tenth at least; where an exercise hides decay, its place cannot be
        // found between hard tissues. Method: every tissue of the shipped table.
        let tissues = TissueTable::read(&Library::shipped()).unwrap();
        let of = |name: &str, is_shown| x_ray_attenuation(&tissues, tissues.label_of(name).unwrap(), is_shown);
        let order = ["enamel", "dentine", "caries", "pulp"].map(|name| of(name, true));
        assert!(order.windows(2).all(|pair| pair[1] < 0.9 * pair[0]), "{order:?}");
        for entry in tissues.entries().iter().filter(|entry| entry.role == TissueRole::Decay) {
            assert_eq!(of(&entry.name, false), of("enamel", false), "{}", entry.name);
            assert_eq!(of("dentine", false), of("enamel", false));
            assert!(of(&entry.name, true) < of("dentine", true), "{}", entry.name);
        }
        assert!(of("pulp", false) < 0.5 * of("dentine", false), "the pulp is still seen");
    }
}
