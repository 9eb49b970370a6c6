//! A tooth of a CT scan as radiographs and transfer functions show it: by its grey values.

use crate::palette;
use std::sync::Arc;
use typodont_core::volume::{Density, Edit, Label, Volume, Voxel};
use typodont_exercise::catalog::{TissueRole, TissueTable};
use typodont_exercise::scenario::Workpiece;
use typodont_formats::import::{ENAMEL_GREY, GreyValues};
use typodont_render::TransferFunction;

/// The volume of a workpiece with grey values in place of densities, kept up to date while it is carved.
///
/// Tissue of the scanned tooth has its grey value (255 is 1.6 times the enamel of the scan), in proportion to the matter that
/// is left. What the scanner has not seen, such as decay that the exercise placed or a filling, has its density.
pub struct GreyVolume {
    values: Arc<GreyValues>,
    is_scanned: [bool; 256],
    volume: Volume,
}

impl GreyVolume {
    /// Returns `None` if the workpiece has no grey values. Decay that is not shown has the grey values of the sound tissue in
    /// whose place it is, so that nobody can find it.
    ///
    /// `now`: the volume of the workpiece as far as it is carved.
    pub fn new(workpiece: &Workpiece, now: &Volume, tissues: &TissueTable, is_decay_shown: bool) -> Option<GreyVolume> {
        let values = workpiece.grey_values.clone().filter(|values| values.values().len() == now.grid().len())?;
        let is_scanned = std::array::from_fn(|label| is_scanned(tissues, Label(label as u8), is_decay_shown));
        let density = (0..now.grid().len()).map(|index| shown(&values, &is_scanned, index, now.voxel(index)));
        let volume = Volume::from_parts(*now.grid(), now.half_band(), density.collect(), now.labels().to_vec())?;
        Some(GreyVolume { values, is_scanned, volume })
    }

    pub fn volume(&self) -> &Volume {
        &self.volume
    }

    /// Applies an edit of the volume of the workpiece.
    pub fn apply_edit(&mut self, edit: &Edit) {
        let index = edit.index as usize;
        let density = shown(&self.values, &self.is_scanned, index, edit.after);
        self.volume.set(index, Voxel { density, label: edit.after.label });
    }

    /// The radiograph of such a volume: the line integral of the grey values, scaled so that the enamel of the scan attenuates
    /// as enamel.
    pub fn radiograph(tissues: &TissueTable, is_decay_shown: bool) -> TransferFunction {
        TransferFunction::radiograph(|label| match is_scanned(tissues, label, is_decay_shown) {
            true => palette::ENAMEL_ATTENUATION * 255.0 / f32::from(ENAMEL_GREY),
            false => palette::x_ray_attenuation(tissues, label, is_decay_shown),
        })
    }
}

/// True for tissue of the scanned tooth itself.
fn is_scanned(tissues: &TissueTable, label: Label, is_decay_shown: bool) -> bool {
    match tissues.by_label(label).map(|entry| entry.role) {
        Some(TissueRole::Sound | TissueRole::Vulnerable) => true,
        Some(TissueRole::Decay) => !is_decay_shown,
        _ => false,
    }
}

fn shown(values: &GreyValues, is_scanned: &[bool; 256], index: usize, voxel: Voxel) -> Density {
    match is_scanned[usize::from(voxel.label.0)] {
        // Matter keeps its label, even where the scanner saw nothing.
        true if voxel.density > Density::EMPTY => Density::from_bits(values.of_voxel(index, voxel).max(1)),
        _ => voxel.density,
    }
}
