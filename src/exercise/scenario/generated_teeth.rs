//! Teeth generated a short time ago: an exercise is checked, performed and scored with the same ones.
//!
//! Takes a tooth's number, the patient's age and the voxel size. Gives the generated volume: the same voxels whether it
//! was kept or not.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};
use typodont_anatomy::TissueLabels;
use typodont_core::volume::Volume;

/// Maximum number of voxels kept, of all teeth together, 56 MB: those of a mouth, coarse and as the author wants them.
const KEPT_VOXELS_MAX: usize = 28 << 20;

/// Teeth, the last used one first.
static KEPT: Mutex<VecDeque<(GeneratedTooth, Arc<Volume>)>> = Mutex::new(VecDeque::new());

/// Everything that determines the voxels of a generated tooth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct GeneratedTooth {
    pub fdi: u8,
    /// Years.
    pub age: Option<f32>,
    /// mm
    pub spacing: f32,
    /// Length of root that is kept below the neck, mm; `None` for the whole.
    pub root_length: Option<f32>,
    pub tissues: TissueLabels,
}

/// Returns a generated tooth without lesions on the smallest grid of its spacing; `None` if there is no tooth of its number.
pub(super) fn generated_tooth(form: GeneratedTooth) -> Option<Volume> {
    let kept = take(&form);
    let tooth = match kept {
        Some(tooth) => tooth,
        None => {
            let shape = typodont_anatomy::teeth::tooth_of_age(form.fdi, form.age)?;
            let whole = typodont_anatomy::grid_of_spacing(&shape, form.spacing);
            let grid = form.root_length.map_or(whole, |length| whole.above(-length));
            Arc::new(typodont_anatomy::grow(&shape, grid, &form.tissues))
        }
    };
    keep(form, tooth.clone());
    Some(tooth.as_ref().clone())
}

fn take(form: &GeneratedTooth) -> Option<Arc<Volume>> {
    let mut kept = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
    let index = kept.iter().position(|(known, _)| known == form)?;
    kept.remove(index).map(|(_, tooth)| tooth)
}

fn keep(form: GeneratedTooth, tooth: Arc<Volume>) {
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

    fn of_spacing(fdi: u8, spacing: f32) -> GeneratedTooth {
        GeneratedTooth { fdi, age: None, spacing, root_length: None, tissues: TISSUES }
    }

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
                let tooth = generated_tooth(GeneratedTooth { fdi, age, spacing, root_length: None, tissues }).unwrap();
                assert_eq!(tooth.grid(), anew.grid());
                assert!(voxels(&tooth) == voxels(&anew), "{fdi} {age:?} {spacing}");
            }
        }
        assert!(generated_tooth(of_spacing(39, 0.4)).is_none());
    }

    #[test]
    fn the_teeth_kept_have_a_limited_size() {
        for spacing in [0.11, 0.12, 0.13, 0.14, 0.15, 0.16, 0.17] {
            generated_tooth(of_spacing(36, spacing)).unwrap();
        }
        let kept = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
        let voxels: usize = kept.iter().map(|(_, tooth)| tooth.grid().len()).sum();
        assert!(kept.len() >= 2 && voxels <= KEPT_VOXELS_MAX, "{} teeth, {voxels} voxels", kept.len());
    }
}
