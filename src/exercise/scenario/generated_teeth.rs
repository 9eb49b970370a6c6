//! Teeth generated a short time ago: an exercise is checked, performed and scored with the same ones.
//!
//! Takes a tooth's number, the patient's age and the voxel size. Gives the generated volume: the same voxels whether it
//! was kept or not.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};
use typodont_anatomy::TissueLabels;
use typodont_core::volume::Volume;

/// Maximum number of voxels kept, of all teeth together: 32 MB.
const KEPT_VOXELS_MAX: usize = 16 << 20;

/// Teeth, the last used one first.
static KEPT: Mutex<VecDeque<(Form, Arc<Volume>)>> = Mutex::new(VecDeque::new());

/// Everything that determines the voxels of a generated tooth.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Form {
    fdi: u8,
    /// Years.
    age: Option<f32>,
    /// mm
    spacing: f32,
    tissues: TissueLabels,
}

/// Returns a generated tooth without lesions on the smallest grid of a spacing, mm; `None` if there is no tooth of this
/// number. The age is in years.
pub(super) fn generated_tooth(fdi: u8, age: Option<f32>, spacing: f32, tissues: TissueLabels) -> Option<Volume> {
    let form = Form { fdi, age, spacing, tissues };
    let kept = take(&form);
    let tooth = match kept {
        Some(tooth) => tooth,
        None => {
            let shape = typodont_anatomy::teeth::tooth_of_age(fdi, age)?;
            let grid = typodont_anatomy::grid_of_spacing(&shape, spacing);
            Arc::new(typodont_anatomy::grow(&shape, grid, &tissues))
        }
    };
    keep(form, tooth.clone());
    Some(tooth.as_ref().clone())
}

fn take(form: &Form) -> Option<Arc<Volume>> {
    let mut kept = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
    let index = kept.iter().position(|(known, _)| known == form)?;
    kept.remove(index).map(|(_, tooth)| tooth)
}

fn keep(form: Form, tooth: Arc<Volume>) {
    let mut kept = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
    kept.retain(|(known, _)| *known != form);
    kept.push_front((form, tooth));
    let mut voxels = 0;
    kept.retain(|(_, tooth)| {
        voxels += tooth.grid().len();
        voxels <= KEPT_VOXELS_MAX
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use typodont_core::volume::Label;

    const TISSUES: TissueLabels = TissueLabels { enamel: Label(1), dentine: Label(2), pulp: Label(3) };

    fn voxels(volume: &Volume) -> Vec<typodont_core::volume::Voxel> {
        (0..volume.grid().len()).map(|index| volume.voxel(index)).collect()
    }

    #[test]
    fn a_kept_tooth_is_the_one_that_is_generated_anew() {
        let other_labels = TissueLabels { enamel: Label(2), dentine: Label(1), pulp: Label(3) };
        for (fdi, age, spacing, tissues) in [
            (36, None, 0.4, TISSUES),
            (36, Some(70.0), 0.4, TISSUES),
            (46, None, 0.4, TISSUES),
            (36, None, 0.5, TISSUES),
            (36, None, 0.4, other_labels),
        ] {
            let shape = typodont_anatomy::teeth::tooth_of_age(fdi, age).unwrap();
            let grid = typodont_anatomy::grid_of_spacing(&shape, spacing);
            let anew = typodont_anatomy::grow(&shape, grid, &tissues);
            for _ in 0..2 {
                let tooth = generated_tooth(fdi, age, spacing, tissues).unwrap();
                assert_eq!(tooth.grid(), anew.grid());
                assert!(voxels(&tooth) == voxels(&anew), "{fdi} {age:?} {spacing}");
            }
        }
        assert!(generated_tooth(39, None, 0.4, TISSUES).is_none());
    }

    #[test]
    fn the_teeth_kept_have_a_limited_size() {
        for spacing in [0.11, 0.12, 0.13, 0.14, 0.15, 0.16, 0.17] {
            generated_tooth(36, None, spacing, TISSUES).unwrap();
        }
        let kept = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
        let voxels: usize = kept.iter().map(|(_, tooth)| tooth.grid().len()).sum();
        assert!(kept.len() >= 2 && voxels <= KEPT_VOXELS_MAX, "{} teeth, {voxels} voxels", kept.len());
    }
}
