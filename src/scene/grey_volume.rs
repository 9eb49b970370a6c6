//! A tooth of a CT scan as radiographs and transfer functions show it: by its grey values.

use crate::palette;
use std::sync::Arc;
use typodont_core::volume::{Density, Edit, Label, Volume, Voxel};
use typodont_exercise::catalog::TissueTable;
use typodont_exercise::scenario::Workpiece;
use typodont_formats::import::{ENAMEL_GREY, GreyValues};
use typodont_render::TransferFunction;

/// Attenuation of the highest grey value, per mm.
const MOST_ATTENUATION: f32 = palette::ENAMEL_ATTENUATION * 255.0 / ENAMEL_GREY as f32;

/// The volume of a workpiece with grey values in place of densities, kept up to date while it is carved.
///
/// Matter has the grey value that was scanned, in proportion to what is left of it; 255 is 1.6 times the enamel of the scan.
/// Matter that the scanner has not seen, such as decay that the exercise placed, has the grey value of its attenuation; amalgam,
/// which attenuates more than any grey value, has its density. Decay is shown: such pictures look into the tooth.
pub struct GreyVolume {
    values: Arc<GreyValues>,
    /// The workpiece at its start: a voxel with another tissue was filled since.
    start: Arc<Volume>,
    /// For each label the grey value of a full voxel that was not scanned.
    unscanned: [u8; 256],
    volume: Volume,
}

impl GreyVolume {
    /// Returns `None` if the workpiece has no grey values. `now`: its volume as far as it is carved.
    pub fn new(workpiece: &Workpiece, now: &Volume, tissues: &TissueTable) -> Option<GreyVolume> {
        let values = workpiece.grey_values.clone().filter(|values| values.values().len() == now.grid().len())?;
        let unscanned = std::array::from_fn(|label| {
            let share = palette::x_ray_attenuation(tissues, Label(label as u8), true) / MOST_ATTENUATION;
            if share > 1.0 { u8::MAX } else { (255.0 * share + 0.5) as u8 }
        });
        let start = workpiece.volume.clone();
        let density = (0..now.grid().len()).map(|index| shown(&values, &start, &unscanned, index, now.voxel(index)));
        let volume = Volume::from_parts(*now.grid(), now.half_band(), density.collect(), now.labels().to_vec())?;
        Some(GreyVolume { values, start, unscanned, volume })
    }

    pub fn volume(&self) -> &Volume {
        &self.volume
    }

    /// Applies an edit of the volume of the workpiece.
    pub fn apply_edit(&mut self, edit: &Edit) {
        let index = edit.index as usize;
        let density = shown(&self.values, &self.start, &self.unscanned, index, edit.after);
        self.volume.set(index, Voxel { density, label: edit.after.label });
    }

    /// The radiograph of such a volume: the line integral of the grey values, scaled so that the enamel of the scan attenuates
    /// as enamel.
    pub fn radiograph(tissues: &TissueTable) -> TransferFunction {
        TransferFunction::radiograph(|label| palette::x_ray_attenuation(tissues, label, true).max(MOST_ATTENUATION))
    }
}

fn shown(values: &GreyValues, start: &Volume, unscanned: &[u8; 256], index: usize, voxel: Voxel) -> Density {
    let Voxel { density, label } = voxel;
    let unscanned = unscanned[usize::from(label.0)];
    let is_scanned = values.values()[index] > 0 && start.labels()[index] == label && unscanned < u8::MAX;
    match density {
        Density::EMPTY => density,
        // Matter keeps its label, even where it is hardly seen.
        _ if is_scanned => Density::from_bits(values.of_voxel(index, voxel).max(1)),
        _ => Density::from_bits((density.unit() * f32::from(unscanned) + 0.5).max(1.0) as u8),
    }
}
