//! Effects of a patient's age on teeth and gingiva: secondary dentine narrows the pulp, attrition wears cusps and
//! edges, and the gingiva recedes.
//!
//! Tooth forms describe unworn teeth with the pulp of an adult of [`REFERENCE_AGE`] years. The rates are means of
//! studies; individual patients differ by more than decades, so that an age gives usual values, not those of a
//! particular patient.

use crate::form::{Cusp, ToothForm};
use crate::periodontium::{Pockets, SiteLengths};

/// Age of the pulp and the gingiva in the tooth forms, years: molars have the coronal index (26 %) that Drusini (*The
/// coronal pulp cavity index*, 2008) found at about 35, and the gingival margin lies on enamel.
pub const REFERENCE_AGE: f32 = 30.0;

/// Range of ages for which teeth are generated, years: at lower ages roots are open and second molars not erupted; for
/// higher ages there are no measurements.
pub const MIN_AGE: f32 = 12.0;
pub const MAX_AGE: f32 = 90.0;

/// Annual loss of the pulp's area on a radiograph, as a share of the area at [`REFERENCE_AGE`]. On radiographs of
/// canines, age = 99.9 − 533 × the pulp's share of the tooth's area (Cameriere and others, *J Forensic Sci* 52, 2007;
/// Jeevan and others, *Forensic Sci Int* 204, 2011, found 96.8 − 514). Inverted with a scatter of r² = 0.86, the share
/// is 0.126 at 30 years and decreases by 0.0016 a year.
const PULP_LOSS_PER_YEAR: f32 = 0.0127;

/// Range of shares in which this line is applied: in very old teeth the pulp is a thread but not absent, and in young
/// teeth the walls have a minimum thickness.
const MIN_PULP_SHARE: f32 = 0.25;
const MAX_PULP_SHARE: f32 = 1.15;

/// Annual wear of enamel by contact with the opposing teeth, mm: of incisors, canines and premolars, and of molars
/// (Lambrechts and others, *Quantitative in vivo wear of human enamel*, J Dent Res 68, 1989: 15 and 29 µm; Pintado and
/// others, *J Prosthet Dent* 77, 1997, found 11 µm over all teeth of young adults). 10 to 40 µm are usual.
const WEAR: f32 = 0.015;
const WEAR_OF_MOLARS: f32 = 0.029;

/// Ages of eruption, years, from the midline outward (chronology of Logan and Kronfeld, centres of its ranges).
const ERUPTION: [[f32; 8]; 2] =
    [[7.5, 8.5, 11.5, 10.5, 11.0, 6.5, 12.5, 19.0], [6.5, 7.5, 10.0, 11.0, 11.5, 6.5, 12.0, 19.0]];

/// Annual recession of the gingiva, mm: mid-buccal, mid-lingual, and interproximal. The mean of six sites is 1.0 mm
/// over the 45 years from 30 on (Billings and others, *J Clin Periodontol* 45, 2018, NHANES 2009 to 2014); recession is
/// greatest on the buccal side (Albandar and Kingman, *J Periodontol* 70, 1999). The depth of pockets does not change
/// (Billings).
const RECESSION: [f32; 3] = [0.034, 0.022, 0.019];

/// Effects of age on one tooth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AgeEffects {
    /// Wear of the working (supporting) cusps at their tips, mm.
    pub wear: f32,
    /// Side of the working cusps: 1 for buccal (lower teeth), −1 for lingual (upper teeth).
    pub working_side: f32,
    /// Remaining share of the pulp's area on a radiograph.
    pub pulp_share: f32,
}

impl AgeEffects {
    /// Returns the effects of an age in years, limited to [`MIN_AGE`] to [`MAX_AGE`]; `None` for a number that is not
    /// an FDI tooth number.
    pub fn of(fdi: u8, years: f32) -> Option<AgeEffects> {
        let years = years.clamp(MIN_AGE, MAX_AGE);
        let (jaw, place) = (usize::from(fdi / 10 > 2), usize::from(fdi % 10).checked_sub(1)?);
        let at_work = (years - ERUPTION[jaw].get(place)?).max(0.0);
        let rate = if place < 5 { WEAR } else { WEAR_OF_MOLARS };
        Some(AgeEffects {
            wear: rate * at_work,
            working_side: if jaw == 0 { -1.0 } else { 1.0 },
            pulp_share: (1.0 - PULP_LOSS_PER_YEAR * (years - REFERENCE_AGE)).clamp(MIN_PULP_SHARE, MAX_PULP_SHARE),
        })
    }

    /// Returns the wear of a cusp, mm; `x` is its position, lingual (−) to buccal (+).
    pub fn cusp_wear(&self, x: f32) -> f32 {
        /// Wear of the non-working (guiding) cusps, as a share of that of the working cusps; estimated by eye.
        const GUIDING: f32 = 0.5;
        if x * self.working_side > 0.0 { self.wear } else { GUIDING * self.wear }
    }

    /// Returns the loss of crown height by wear, mm.
    pub fn crown_wear(&self, form: &ToothForm) -> f32 {
        let height = |cusp: &Cusp, off: f32| cusp.tip[2].min(1.0) * form.sizes.crown - off;
        let highest = |off: &dyn Fn(&Cusp) -> f32| {
            form.occlusal.cusps.iter().map(|cusp| height(cusp, off(cusp))).reduce(f32::max)
        };
        let both = highest(&|_| 0.0).zip(highest(&|cusp| self.cusp_wear(cusp.tip[0])));
        both.map_or(self.wear, |(written, worn)| written - worn)
    }
}

/// Returns the recession of the gingival margin at each site relative to [`REFERENCE_AGE`], mm; negative for a higher
/// margin.
pub fn recession(years: f32) -> SiteLengths {
    let [buccal, lingual, beside] = RECESSION.map(|a_year| a_year * (years.clamp(MIN_AGE, MAX_AGE) - REFERENCE_AGE));
    [beside, buccal, beside, beside, lingual, beside]
}

/// Returns healthy pockets at an age in years; `None` gives [`Pockets::HEALTHY`].
pub fn healthy_pockets(years: Option<f32>) -> Pockets {
    let Some(years) = years else { return Pockets::HEALTHY };
    let gone = recession(years);
    let recession = std::array::from_fn(|site| Pockets::HEALTHY.recession[site] + gone[site]);
    Pockets { recession, ..Pockets::HEALTHY }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thirty_is_as_written_but_for_wear() {
        let aged = AgeEffects::of(36, REFERENCE_AGE).unwrap();
        assert_eq!((aged.pulp_share, healthy_pockets(Some(REFERENCE_AGE))), (1.0, Pockets::HEALTHY));
        assert!((aged.wear - 0.68).abs() < 0.01, "{aged:?}");
        assert_eq!(AgeEffects::of(38, 18.0).unwrap().wear, 0.0, "not yet through");
        assert_eq!(AgeEffects::of(39, 40.0), None);
    }

    #[test]
    fn gum_goes_back_by_a_millimetre_in_45_years() {
        let mean = |years: f32| recession(years).iter().sum::<f32>() / 6.0;
        assert!((mean(75.0) - mean(30.0) - 1.0).abs() < 0.1, "{}", mean(75.0) - mean(30.0));
    }
}
