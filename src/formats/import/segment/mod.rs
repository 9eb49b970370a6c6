//! Segmentation of a CT scan of one tooth into enamel, dentine and pulp.
//!
//! Takes values on a grid. Gives a volume in tooth space with the voxels of the scan. Never separates tissues by a
//! plane: for a voxel that is only partly filled, the nearest reliable tissue decides and not its value.

mod pulp_chamber;
mod coarse_to_fine;
mod layers;
mod grey_levels;

use crate::import::{GreyValues, ImportedTooth, orientation};
pub use coarse_to_fine::labels;
use grey_levels::GreyLevels;
use std::fmt;
use typodont_anatomy::TissueLabels;
use typodont_core::volume::components::Components;
use typodont_core::volume::redistance;
use typodont_core::volume::redistance::signed_distance_from_field;
use typodont_core::volume::subgrid::PaddedGrid;
use typodont_core::volume::{CellBox, Density, Grid, Label, density_at_distance};

/// Maximum ratio of a voxel's longest side to its shortest. Clinical scans have up to 10.
const FLATNESS_MAX: f32 = 20.0;

/// Plausible length of a tooth, or of its scanned part, mm: from the crown of a primary incisor to a canine with its
/// root, with a margin.
const LENGTH: std::ops::RangeInclusive<f32> = 4.0..=50.0;

/// Reason why a scan cannot be segmented.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SegmentationError {
    /// All values are equal, or none is a number.
    Flat,
    /// Nothing in the scan is solid.
    NoBody,
    /// The hard tissue has one grey level instead of the two of dentine and enamel.
    OneLevel,
    /// Ratio of the longest side of a voxel to its shortest, which is too large.
    Uneven(f32),
    /// Length of the largest solid object, mm, which is not that of a tooth.
    Size(f32),
}

impl fmt::Display for SegmentationError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            SegmentationError::Flat => f.write_str(
                "there is no tooth in it: all values are the same; name the CT volume of a tooth, or crop another part \
                 of it (--at, --crop)",
            ),
            SegmentationError::NoBody => f.write_str(
                "there is no tooth in it: nothing is solid; give a CT volume in which hard tissue is bright, or crop \
                 another part of it (--at, --crop)",
            ),
            SegmentationError::OneLevel => f.write_str(
                "there is no tooth in it: the solid matter has one grey value, not the two of enamel and dentine; \
                 crop the part with one tooth (--at, --crop), give a CT volume in which enamel is brighter, \
                 or a label map (--labels)",
            ),
            SegmentationError::Uneven(times) => write!(
                f,
                "its voxels are {times:.0} times longer than wide, and more than {FLATNESS_MAX:.0} times is implausible; \
                 check the spacing"
            ),
            SegmentationError::Size(mm) => write!(
                f,
                "there is no single tooth in it: its largest solid piece is {mm:.1} mm long, and a tooth is {} to {} mm \
                 long; crop one tooth (--at, --crop), or give the voxel spacing in mm if the file's is wrong (--spacing-mm)",
                LENGTH.start(),
                LENGTH.end()
            ),
        }
    }
}

impl std::error::Error for SegmentationError {}

/// Material of a voxel of a scan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum TissueClass {
    Air,
    Dentine,
    Enamel,
    Pulp,
}

impl TissueClass {
    fn is_hard(self) -> bool {
        matches!(self, TissueClass::Dentine | TissueClass::Enamel)
    }
}

/// Segments the tissues of a tooth and sets it upright: crown up along z, which is 0 at the lowest enamel.
///
/// Values must rise from background over dentine to enamel. Their scale does not matter; NaN counts as background. The
/// tooth keeps them as [`GreyValues`].
///
/// # Errors
/// Fails when no tooth is found, or when its tissues cannot be told apart.
pub fn segment(grid: &Grid, values: Vec<f32>, tissues: &TissueLabels) -> Result<ImportedTooth, SegmentationError> {
    let ClassifiedScan { window, levels, mut values, matter, nearest_enamel } = classify(grid, values)?;
    let grid = &window.grid;
    let measured: Vec<u8> = values.iter().map(|&value| levels.grey_value(value)).collect();
    into_field(&mut values, &matter, &levels, &nearest_enamel);
    drop(nearest_enamel);
    keep_one_piece(grid, &mut values);

    let mut signed_distance = signed_distance_from_field(grid, &values, redistance::max_distance(grid));
    drop(values);
    redistance::binomial_smooth(grid, &mut signed_distance);
    let band = redistance::half_band(grid);
    let density: Vec<Density> =
        signed_distance.into_iter().map(|distance| density_at_distance(distance, band)).collect();
    let grey_values = GreyValues::of_matter(&measured, &density).into_values();
    drop(measured);
    let label = matter.into_iter().map(|matter| label_of(matter, tissues)).collect();
    let whole = window.enlarged_whole();
    let parts = (whole, window.paste(density, Density::EMPTY), window.paste(label, Label::AIR));
    let (volume, permutation) = orientation::upright(parts, band, tissues);
    let grey_values = permutation.array(&whole, window.paste(grey_values, 0));
    Ok(ImportedTooth { volume, grey_values: Some(GreyValues::from_values(grey_values)) })
}

/// The part of a scan that contains the tooth, and the tissue of each of its voxels.
struct ClassifiedScan {
    window: PaddedGrid,
    levels: GreyLevels,
    /// Values of the window, without NaN.
    values: Vec<f32>,
    matter: Vec<TissueClass>,
    /// For each voxel: true if the nearest hard tissue is enamel.
    nearest_enamel: Vec<bool>,
}

fn classify(grid: &Grid, values: Vec<f32>) -> Result<ClassifiedScan, SegmentationError> {
    let solid_threshold = grey_levels::solid_threshold(&values)?;
    let window = window_of_tooth(grid, &values, solid_threshold)?;
    let background = grey_levels::background_level(&values, solid_threshold);
    let mut values = window.crop(values, background);
    values.iter_mut().filter(|value| value.is_nan()).for_each(|value| *value = background);
    let grid = &window.grid;

    let levels = GreyLevels::of(grid, &values, background, solid_threshold)?;
    let mut matter = hard_tissue(grid, &values, &levels);
    let nearest_enamel = layers::separate_enamel_and_dentine(grid, &values, &levels, &mut matter);
    pulp_chamber::fill(grid, &values, &levels, &mut matter);
    Ok(ClassifiedScan { window, levels, values, matter, nearest_enamel })
}

fn label_of(matter: TissueClass, tissues: &TissueLabels) -> Label {
    match matter {
        TissueClass::Air => Label::AIR,
        TissueClass::Dentine => tissues.dentine,
        TissueClass::Enamel => tissues.enamel,
        TissueClass::Pulp => tissues.pulp,
    }
}

/// Returns the part of the grid around the largest solid piece, with a margin for the following steps.
fn window_of_tooth(grid: &Grid, values: &[f32], solid_threshold: f32) -> Result<PaddedGrid, SegmentationError> {
    let pieces = Components::of(grid, |i| values[i] >= solid_threshold);
    let (tooth, _) = pieces.largest().ok_or(SegmentationError::NoBody)?;
    let of_tooth = grid.cells().enumerate().filter(|(index, _)| pieces.at(*index) == Some(tooth));
    let cells = CellBox::around(of_tooth.map(|(_, cell)| cell)).ok_or(SegmentationError::NoBody)?;
    let length = (grid.extent_of(&cells).size() + grid.spacing).max_element();
    // Thin slices are ordinary; beyond this ratio a header is wrong, and distances in voxels lose their meaning.
    let flatness = grid.spacing.max_element() / grid.spacing.min_element();
    if flatness > FLATNESS_MAX {
        return Err(SegmentationError::Uneven(flatness));
    }
    if !LENGTH.contains(&length) {
        return Err(SegmentationError::Size(length));
    }
    // One more, so that the corner of the window stays outside the voxels that bridging seals.
    let bridge = pulp_chamber::bridge(grid);
    let spare = grid.spacing.to_array().map(|step| (bridge / step).ceil() as u32 + 1);
    Ok(PaddedGrid::around(grid, &cells, spare))
}

/// Marks the hard tissue of the tooth; all of it is dentine at this step.
fn hard_tissue(grid: &Grid, values: &[f32], levels: &GreyLevels) -> Vec<TissueClass> {
    let from = levels.dentine_threshold();
    let pieces = Components::of(grid, |i| values[i] >= from);
    let tooth = pieces.largest().map(|(number, _)| number);
    let matter = |i| if tooth.is_some() && pieces.at(i) == tooth { TissueClass::Dentine } else { TissueClass::Air };
    (0..grid.len()).map(matter).collect()
}

/// Converts each value to the fraction by which the voxel exceeds half full: the surface of the tooth is where this
/// is zero.
///
/// The half-full value depends on the material: it is higher on enamel than on dentine.
fn into_field(values: &mut [f32], matter: &[TissueClass], levels: &GreyLevels, nearest_enamel: &[bool]) {
    /// Magnitude for voxels that are certainly inside, or not part of the tooth, whatever their value.
    const SURE: f32 = 0.5;
    for ((value, matter), is_enamel) in values.iter_mut().zip(matter).zip(nearest_enamel) {
        let full = if *is_enamel { levels.enamel } else { levels.dentine };
        let above_half = (*value - levels.background) / (full - levels.background) - 0.5;
        *value = match matter {
            TissueClass::Pulp => SURE,
            TissueClass::Air => above_half.clamp(-SURE, -0.01),
            TissueClass::Dentine | TissueClass::Enamel => above_half.min(SURE),
        };
    }
}

/// Empties the pieces that the exact position of the surface has cut off.
fn keep_one_piece(grid: &Grid, field: &mut [f32]) {
    let pieces = Components::of(grid, |i| field[i] >= 0.0);
    let tooth = pieces.largest().map(|(number, _)| number);
    for (index, value) in field.iter_mut().enumerate() {
        if pieces.at(index) != tooth {
            *value = value.min(-0.01);
        }
    }
}

#[cfg(test)]
mod tests;
