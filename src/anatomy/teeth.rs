//! The 32 permanent teeth by their numbers (ISO 3950, "FDI").
//!
//! Buccal, distal and occlusal are a right-handed space in the upper right (11–18) and the lower left (31–38) of a mouth, and a
//! left-handed one in the upper left and the lower right. Tooth space is right-handed everywhere: x is buccal and z occlusal in
//! all four quadrants, y is distal in the first and third and mesial in the second and fourth.

use super::age::Aged;
use super::form::Form;
use super::{canines, incisors, lower_molars, molar, premolars, upper_molars};

/// Upper teeth from the midline outward, as in the upper right.
pub const UPPER: [Form; 8] = [
    incisors::UPPER_CENTRAL,
    incisors::UPPER_LATERAL,
    canines::UPPER,
    premolars::UPPER_FIRST,
    premolars::UPPER_SECOND,
    upper_molars::FIRST,
    upper_molars::SECOND,
    upper_molars::THIRD,
];

/// Lower teeth from the midline outward, as in the lower left.
pub const LOWER: [Form; 8] = [
    incisors::LOWER_CENTRAL,
    incisors::LOWER_LATERAL,
    canines::LOWER,
    premolars::LOWER_FIRST,
    premolars::LOWER_SECOND,
    molar::LOWER_FIRST,
    lower_molars::SECOND,
    lower_molars::THIRD,
];

/// The form of a permanent tooth, mirrored where its side needs it; `None` for a number that no tooth has.
pub fn tooth(fdi: u8) -> Option<Form> {
    let (quadrant, position) = (fdi / 10, usize::from(fdi % 10));
    let half = match quadrant {
        1 | 2 => &UPPER,
        3 | 4 => &LOWER,
        _ => return None,
    };
    let form = half.get(position.checked_sub(1)?)?;
    Some(Form { is_mirrored: is_mirrored(fdi), ..*form })
}

/// The same as it is in a mouth of so many years; as written without.
pub fn tooth_of_age(fdi: u8, years: Option<f32>) -> Option<Form> {
    let aged = years.and_then(|years| Aged::of(fdi, years));
    tooth(fdi).map(|form| Form { aged, ..form })
}

/// All numbers, quadrant by quadrant, from the midline outward.
pub fn numbers() -> impl Iterator<Item = u8> {
    (1..=4).flat_map(|quadrant| (1..=8).map(move |position| 10 * quadrant + position))
}

/// True in the upper left and the lower right: y is mesial in tooth space.
pub fn is_mirrored(fdi: u8) -> bool {
    matches!(fdi / 10, 2 | 4)
}

/// Which way along y of tooth space is distal: 1 or −1.
pub fn distal(fdi: u8) -> f32 {
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
