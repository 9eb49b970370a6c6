//! The 32 permanent teeth by their numbers (ISO 3950, FDI).
//!
//! Buccal, distal and occlusal are a right-handed space in the upper right (11–18) and the lower left quadrant (31–38),
//! and a left-handed one in the upper left and the lower right quadrant. Tooth space is right-handed everywhere: x is
//! buccal and z occlusal in all four quadrants; y is distal in the first and third, mesial in the second and fourth.

use crate::age::AgeEffects;
use crate::form::ToothForm;
use crate::{canines, incisors, lower_first_molar, lower_molars, premolars, upper_molars};

/// Upper teeth from the midline outward, in the form of the upper right quadrant.
pub const UPPER: [ToothForm; 8] = [
    incisors::UPPER_CENTRAL,
    incisors::UPPER_LATERAL,
    canines::UPPER,
    premolars::UPPER_FIRST,
    premolars::UPPER_SECOND,
    upper_molars::FIRST,
    upper_molars::SECOND,
    upper_molars::THIRD,
];

/// Lower teeth from the midline outward, in the form of the lower left quadrant.
pub const LOWER: [ToothForm; 8] = [
    incisors::LOWER_CENTRAL,
    incisors::LOWER_LATERAL,
    canines::LOWER,
    premolars::LOWER_FIRST,
    premolars::LOWER_SECOND,
    lower_first_molar::LOWER_FIRST,
    lower_molars::SECOND,
    lower_molars::THIRD,
];

/// Returns the form of a permanent tooth, mirrored if its side requires it; `None` for a number that is not an FDI
/// tooth number.
pub fn tooth(fdi: u8) -> Option<ToothForm> {
    let (quadrant, position) = (fdi / 10, usize::from(fdi % 10));
    let half = match quadrant {
        1 | 2 => &UPPER,
        3 | 4 => &LOWER,
        _ => return None,
    };
    let form = half.get(position.checked_sub(1)?)?;
    Some(ToothForm { is_mirrored: is_mirrored(fdi), ..*form })
}

/// Returns the form of a permanent tooth at an age in years; without an age, the unworn form.
pub fn tooth_of_age(fdi: u8, years: Option<f32>) -> Option<ToothForm> {
    let aged = years.and_then(|years| AgeEffects::of(fdi, years));
    tooth(fdi).map(|form| ToothForm { age_effects: aged, ..form })
}

/// Returns all tooth numbers, quadrant by quadrant, from the midline outward.
pub fn numbers() -> impl Iterator<Item = u8> {
    (1..=4).flat_map(|quadrant| (1..=8).map(move |position| 10 * quadrant + position))
}

/// Returns true for teeth of the upper left and the lower right quadrant, in which y is mesial in tooth space.
pub fn is_mirrored(fdi: u8) -> bool {
    matches!(fdi / 10, 2 | 4)
}

/// Returns the sign of the distal direction along y of tooth space: 1 or −1.
pub fn distal_sign(fdi: u8) -> f32 {
    if is_mirrored(fdi) { -1.0 } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_are_32_numbers_and_no_other() {
        let all: Vec<u8> = (0..=255).filter(|&fdi| tooth(fdi).is_some()).collect();
        assert_eq!(all, numbers().collect::<Vec<_>>());
        assert_eq!(all.len(), 32);
    }
}
