//! What a patient's age makes of teeth and gum: secondary dentine narrows the pulp, chewing wears cusps and edges, gum goes back.
//!
//! Forms are written as unworn teeth with the pulp of an adult of [`AS_WRITTEN`] years. Rates are means of studies; patients differ
//! by more than decades, so an age says what is usual, not what a patient has.

use super::form::{Cusp, Form};
use super::periodontium::{AtSites, Pockets};

/// The age whose pulp and gum are as written, years: molars then have the coronal index (26 %) that Drusini (*The coronal pulp
/// cavity index*, 2008) has at some 35, and a margin on enamel.
pub const AS_WRITTEN: f32 = 30.0;

/// Ages that teeth are made of, years: before, roots are open and second molars not yet there; beyond, nobody has measured.
pub const LEAST: f32 = 12.0;
pub const MOST: f32 = 90.0;

/// What a pulp's shadow loses in a year, share of what it is at [`AS_WRITTEN`]. On X-rays of canines age = 99.9 − 533 × the
/// pulp's share of the tooth's shadow (Cameriere and others, *J Forensic Sci* 52, 2007; Jeevan and others, *Forensic Sci Int* 204,
/// 2011, found 96.8 − 514); turned round with a scatter of r² = 0.86 the share is 0.126 at 30 and falls by 0.0016 a year.
const PULP_A_YEAR: f32 = 0.0127;

/// Shares between which that line is followed: pulps of the very old are threads, not gone; walls of the young are not thinner than so.
const PULP_LEAST: f32 = 0.25;
const PULP_MOST: f32 = 1.15;

/// What contact with the opposite teeth takes off enamel in a year, mm: incisors, canines and premolars, and molars (Lambrechts and
/// others, *Quantitative in vivo wear of human enamel*, J Dent Res 68, 1989: 15 and 29 µm; Pintado and others, *J Prosthet Dent*
/// 77, 1997, found 11 µm over all teeth of young adults). 10 to 40 µm are usual.
const WEAR: f32 = 0.015;
const WEAR_OF_MOLARS: f32 = 0.029;

/// When teeth come through, years, from the midline outward (Logan and Kronfeld's chronology, middles of its spans).
const ERUPTION: [[f32; 8]; 2] =
    [[7.5, 8.5, 11.5, 10.5, 11.0, 6.5, 12.5, 19.0], [6.5, 7.5, 10.0, 11.0, 11.5, 6.5, 12.0, 19.0]];

/// How far gum goes back in a year, mm, in the middle of the cheek's side, of the tongue's, and beside the neighbours: 1.0 mm in the
/// mean of six sites over the 45 years from 30 on (Billings and others, *J Clin Periodontol* 45, 2018, NHANES 2009 to 2014), most on
/// the cheek's side (Albandar and Kingman, *J Periodontol* 70, 1999). Pockets stay as deep as they were (Billings).
const RECESSION: [f32; 3] = [0.034, 0.022, 0.019];

/// What years have made of one tooth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aged {
    /// Chewed off the tips of the cusps that bite between two others, mm.
    pub wear: f32,
    /// Which cusps these are: 1 the buccal ones (below), −1 the lingual ones (above).
    pub working: f32,
    /// Share of the pulp's shadow on an X-ray that is left.
    pub pulp: f32,
}

impl Aged {
    /// A tooth at an age in years, taken as within [`LEAST`] and [`MOST`]; `None` for a number that no tooth has.
    pub fn of(fdi: u8, years: f32) -> Option<Aged> {
        let years = years.clamp(LEAST, MOST);
        let (jaw, place) = (usize::from(fdi / 10 > 2), usize::from(fdi % 10).checked_sub(1)?);
        let at_work = (years - ERUPTION[jaw].get(place)?).max(0.0);
        let rate = if place < 5 { WEAR } else { WEAR_OF_MOLARS };
        Some(Aged {
            wear: rate * at_work,
            working: if jaw == 0 { -1.0 } else { 1.0 },
            pulp: (1.0 - PULP_A_YEAR * (years - AS_WRITTEN)).clamp(PULP_LEAST, PULP_MOST),
        })
    }

    /// What a cusp on a side of the tooth has lost, mm: `x` is its place, lingual (−) to buccal (+).
    pub fn off_cusp(&self, x: f32) -> f32 {
        /// Cusps that do not bite between two others wear by this share of what those do, by eye.
        const GUIDING: f32 = 0.5;
        if x * self.working > 0.0 { self.wear } else { GUIDING * self.wear }
    }

    /// How much lower the highest place of a form's crown is, mm.
    pub fn off_crown(&self, form: &Form) -> f32 {
        let height = |cusp: &Cusp, off: f32| cusp.tip[2].min(1.0) * form.sizes.crown - off;
        let highest =
            |off: &dyn Fn(&Cusp) -> f32| form.relief.cusps.iter().map(|cusp| height(cusp, off(cusp))).reduce(f32::max);
        let both = highest(&|_| 0.0).zip(highest(&|cusp| self.off_cusp(cusp.tip[0])));
        both.map_or(self.wear, |(written, worn)| written - worn)
    }
}

/// How much lower the gum's margin stands at each site than at [`AS_WRITTEN`] years, mm; negative: higher.
pub fn recession(years: f32) -> AtSites {
    let [buccal, lingual, beside] = RECESSION.map(|a_year| a_year * (years.clamp(LEAST, MOST) - AS_WRITTEN));
    [beside, buccal, beside, beside, lingual, beside]
}

/// Healthy gum of an age.
pub fn healthy(years: Option<f32>) -> Pockets {
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
        let aged = Aged::of(36, AS_WRITTEN).unwrap();
        assert_eq!((aged.pulp, healthy(Some(AS_WRITTEN))), (1.0, Pockets::HEALTHY));
        assert!((aged.wear - 0.68).abs() < 0.01, "{aged:?}");
        assert_eq!(Aged::of(38, 18.0).unwrap().wear, 0.0, "not yet through");
        assert_eq!(Aged::of(39, 40.0), None);
    }

    #[test]
    fn gum_goes_back_by_a_millimetre_in_45_years() {
        let mean = |years: f32| recession(years).iter().sum::<f32>() / 6.0;
        assert!((mean(75.0) - mean(30.0) - 1.0).abs() < 0.1, "{}", mean(75.0) - mean(30.0));
    }
}
