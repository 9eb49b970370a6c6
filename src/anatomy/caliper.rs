//! Measurement of a generated tooth, on its voxels, as with a caliper.

use crate::TissueLabels;
use crate::form::Sizes;
use typodont_core::frame::Vec3;
use typodont_core::volume::{Label, Volume, distance};

/// Half-width of the strip in the middle of a side in which the cervical line is searched for, mm.
const STRIP: f32 = 0.5;

/// Mean and maximum thickness of enamel, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EnamelThickness {
    pub mean: f32,
    pub most: f32,
}

/// Measures a tooth in tooth space; `None` if one of its sides has no enamel.
///
/// The neck is the end of the enamel: in the middle of the buccal side for lengths and the buccolingual width at the
/// neck, in the middle of the mesial and distal sides for the mesiodistal width at the neck. For `is_mirrored`, see
/// [`ToothForm::is_mirrored`](crate::ToothForm::is_mirrored).
pub fn sizes(volume: &Volume, tissues: &TissueLabels, is_mirrored: bool) -> Option<Sizes> {
    let neck = |is_there: &dyn Fn(Vec3) -> bool| {
        let enamel = solid(volume).filter(|&(tissue, at)| tissue == tissues.enamel && is_there(at));
        Some(span(volume, enamel.map(|(_, at)| at), 2)?[0])
    };
    let buccal = neck(&|p| p.x > 0.0 && p.y.abs() < STRIP)?;
    let [front, back] = [neck(&|p| p.y < 0.0 && p.x.abs() < STRIP)?, neck(&|p| p.y > 0.0 && p.x.abs() < STRIP)?];
    let level = 0.5 * (front + back);
    let within = |low: f32, high: f32, axis: usize| {
        let there = solid(volume).map(|(_, at)| at).filter(|at| (low..high).contains(&at.z));
        span(volume, there, axis).map(|[low, high]| high - low)
    };
    let half = 0.51 * volume.grid().spacing.z;
    let [lowest, highest] = span(volume, solid(volume).map(|(_, at)| at), 2)?;
    let [mesial, distal] = if is_mirrored { [back, front] } else { [front, back] };
    Some(Sizes {
        crown: highest - buccal,
        root: buccal - lowest,
        mesiodistal: [within(buccal, f32::MAX, 1)?, within(level - half, level + half, 1)?],
        buccolingual: [within(buccal, f32::MAX, 0)?, within(buccal - half, buccal + half, 0)?],
        neckline_rise: [mesial - buccal, distal - buccal],
    })
}

/// Measures the enamel by the distances of its outer voxels from the nearest dentine; `None` without enamel or without
/// dentine.
pub fn enamel_thickness(volume: &Volume, tissues: &TissueLabels) -> Option<EnamelThickness> {
    let grid = volume.grid();
    let found: Vec<Label> = volume.tissues().collect();
    if !found.contains(&tissues.dentine) {
        return None;
    }
    let from_dentine = distance::to_set(grid, |i| found[i] == tissues.dentine);
    let faces_air = |i: usize| grid.neighbours(i).any(|n| found[n] == Label::AIR);
    let outer = (0..grid.len()).filter(|&i| found[i] == tissues.enamel && faces_air(i));
    let [mut sum, mut count, mut most] = [0.0f64, 0.0, 0.0];
    for index in outer {
        let thick = f64::from(from_dentine[index]);
        (sum, count, most) = (sum + thick, count + 1.0, most.max(thick));
    }
    (count > 0.0).then(|| EnamelThickness { mean: (sum / count) as f32, most: most as f32 })
}

/// Returns the tissue and the position of every solid voxel.
fn solid(volume: &Volume) -> impl Iterator<Item = (Label, Vec3)> {
    let places = volume.tissues().zip(volume.grid().cells()).filter(|(tissue, _)| *tissue != Label::AIR);
    places.map(|(tissue, cell)| (tissue, volume.grid().centre(cell)))
}

/// Returns the range from the lower face of the lowest voxel to the upper face of the highest, mm.
fn span(volume: &Volume, places: impl Iterator<Item = Vec3>, axis: usize) -> Option<[f32; 2]> {
    let half = 0.5 * volume.grid().spacing[axis];
    let [low, high] = places.fold([f32::MAX, f32::MIN], |[low, high], at| [low.min(at[axis]), high.max(at[axis])]);
    (low <= high).then_some([low - half, high + half])
}
