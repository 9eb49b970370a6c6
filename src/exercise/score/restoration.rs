//! The comparison of a filling with the tooth's original contour.
//!
//! Takes the tooth before its cavity was cut, at the start and at the end. Gives the quality of the filling: the
//! distance of its surface from the contour, overhangs, deficits and voids.

use super::voxel_set::VoxelSet;
use crate::scenario::Workpiece;
use typodont_core::frame::Vec3;
use typodont_core::volume::subgrid::SubGrid;
use typodont_core::volume::{ISO, Volume, surface};

/// Maximum distance along the contour's normal at which the surface is searched for, mm: more than the depth of any
/// cavity.
const PROBE_LENGTH: f32 = 6.0;

/// Comparison of a filling with the contour to be restored.
#[derive(Clone, Debug, Default)]
pub struct Restoration {
    /// Signed distances of the surface from the contour over the restored region, mm, positive outside; each with its
    /// position, tooth space, mm.
    pub offsets: Vec<(f32, Vec3)>,
    /// Number of voxels of the cavity.
    pub cavity: usize,
    pub filled: usize,
    /// Volume of material outside the original contour, mm³.
    pub overhang_mm3: f64,
    /// Volume of enclosed air inside the original contour, mm³.
    pub void_mm3: f64,
    /// Voxels of the enclosed air.
    pub voids: VoxelSet,
}

impl Restoration {
    /// Compares the volume at the end with the original; `None` for a session without a prepared cavity.
    pub fn of(workpiece: &Workpiece, end: &Volume) -> Option<Restoration> {
        let original = workpiece.original.as_ref()?;
        let start = &workpiece.volume;
        let grid = original.grid();
        let is_cavity = |voxel: usize| workpiece.is_in_cavity(voxel);
        let cavity = (0..grid.len()).filter(|&v| is_cavity(v)).count();
        let filled = (0..grid.len()).filter(|&v| is_cavity(v) && end.densities()[v].is_solid()).count();
        let voids = enclosed_air(end, &is_cavity);
        // Volumes from densities are more accurate than counts of voxels.
        let over = |voxel: usize| {
            let was = original.densities()[voxel].max(start.densities()[voxel]);
            f64::from(end.densities()[voxel].unit() - was.unit()).max(0.0)
        };
        let overhang = (0..grid.len()).filter(|&v| end.densities()[v] > original.densities()[v]).map(over).sum::<f64>();
        Some(Restoration {
            offsets: offsets(original, start, end),
            cavity,
            filled,
            overhang_mm3: overhang * grid.voxel_mm3(),
            void_mm3: voids.count() as f64 * grid.voxel_mm3(),
            voids,
        })
    }

    /// Returns the mean distance of the surface from the contour, mm; `None` if nothing was to be restored.
    pub fn mean(&self) -> Option<f64> {
        let sum: f64 = self.offsets.iter().map(|(mm, _)| f64::from(mm.abs())).sum();
        (!self.offsets.is_empty()).then(|| sum / self.offsets.len() as f64)
    }

    /// Returns a percentile of the distances (nearest rank), mm; `share` is 0 to 1. `None` if nothing was to be
    /// restored.
    pub fn percentile(&self, share: f64) -> Option<f64> {
        let mut distances: Vec<f32> = self.offsets.iter().map(|(mm, _)| mm.abs()).collect();
        distances.sort_by(f32::total_cmp);
        let rank = (share * distances.len() as f64).ceil() as usize;
        distances.get(rank.clamp(1, distances.len().max(1)) - 1).map(|&mm| f64::from(mm))
    }

    /// Returns the greatest signed distance of the surface from the contour, mm, with its position.
    pub fn highest(&self) -> Option<(f32, Vec3)> {
        self.offsets.iter().copied().max_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// Returns the least signed distance of the surface from the contour, mm (negative inside), with its position.
    pub fn lowest(&self) -> Option<(f32, Vec3)> {
        self.offsets.iter().copied().min_by(|a, b| a.0.total_cmp(&b.0))
    }
}

/// Returns the air of the cavity that is enclosed on all sides.
fn enclosed_air(end: &Volume, is_cavity: &impl Fn(usize) -> bool) -> VoxelSet {
    let grid = end.grid();
    let is_air = |voxel: usize| !end.densities()[voxel].is_solid();
    let mut is_enclosed = vec![false; grid.len()];
    if let Some(crop) = SubGrid::around(grid, 1, (0..grid.len()).filter(|&v| is_cavity(v) && is_air(v))) {
        // The outside is reached from the border of the box and from all air that was never tooth; the remaining air is
        // enclosed.
        let mut is_open = vec![false; crop.grid.len()];
        let mut front: Vec<usize> = Vec::new();
        for (index, is_open) in is_open.iter_mut().enumerate() {
            let voxel = crop.whole_index(index);
            let at_rim = crop.grid.neighbours(index).count() < 6;
            *is_open = is_air(voxel) && (at_rim || !is_cavity(voxel));
            front.extend(is_open.then_some(index));
        }
        while let Some(index) = front.pop() {
            for next in crop.grid.neighbours(index) {
                if !is_open[next] && is_air(crop.whole_index(next)) {
                    is_open[next] = true;
                    front.push(next);
                }
            }
        }
        for index in (0..crop.grid.len()).filter(|&i| !is_open[i]) {
            let voxel = crop.whole_index(index);
            is_enclosed[voxel] = is_air(voxel) && is_cavity(voxel);
        }
    }
    is_enclosed.into_iter().collect()
}

/// Returns the signed distances of the surface along the contour's normals, mm, over the mouth of the cavity and
/// wherever material lies on the tooth, with their positions.
fn offsets(original: &Volume, start: &Volume, end: &Volume) -> Vec<(f32, Vec3)> {
    let mesh = surface::extract(original);
    let spacing = original.grid().spacing.max_element();
    // The density ramp of a surface ends at a voxel and a half; a point at a smaller distance is still on its own side.
    let aside = 0.75 * spacing;
    let is_restored = |place: Vec3, normal: Vec3| {
        let is_mouth = start.density_at(place - normal * aside) < ISO;
        let outside = place + normal * aside;
        is_mouth || (start.density_at(outside) < ISO && end.density_at(outside) >= ISO)
    };
    let places = mesh.positions.iter().zip(&mesh.normals);
    let restored = places.filter(|(place, normal)| is_restored(**place, **normal));
    let probe = ContourProbe { original, end, step: 0.25 * spacing };
    restored.map(|(&place, &normal)| (probe.offset(place, normal), place)).collect()
}

/// The volumes before and after, and the step of the search, mm.
struct ContourProbe<'a> {
    original: &'a Volume,
    end: &'a Volume,
    step: f32,
}

impl ContourProbe<'_> {
    /// Returns the signed distance from a point of the contour along its normal to the surface, mm: outward through
    /// placed material, or inward through air. In a fissure, the outward search ends at the opposite slope of the
    /// tooth.
    fn offset(&self, place: Vec3, normal: Vec3) -> f32 {
        let density = |distance: f32| self.end.density_at(place + normal * distance);
        let here = density(0.0);
        let out = if here >= ISO { 1.0 } else { -1.0 };
        let mut before = here;
        // The contour's own density ramp ends at a voxel and a half.
        let left = 6.0 * self.step;
        for i in 1..=(PROBE_LENGTH / self.step) as u32 {
            let distance = self.step * i as f32;
            let now = density(out * distance);
            if (now >= ISO) != (here >= ISO) {
                return out * (distance - self.step * (1.0 - (ISO - before) / (now - before)));
            }
            if out > 0.0 && distance > left && self.original.density_at(place + normal * distance) >= ISO {
                return distance;
            }
            before = now;
        }
        out * PROBE_LENGTH
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use typodont_core::volume::{Grid, Label, Voxel};

    const TOOTH: Label = Label(1);
    const FILLING: Label = Label(21);

    /// A block with its top at z = 0 and a round hole of 1.5 mm radius, 2 mm deep, before it was cut and after.
    fn cavity(spacing: f32) -> Workpiece {
        let grid = Grid::centred([(7.0 / spacing) as u32; 3], Vec3::splat(spacing));
        let band = 1.5 * spacing;
        let hole = |p: Vec3| (p.truncate().length() - 1.5).max(-2.0 - p.z);
        let whole = Volume::from_distance(grid, band, |p| (p.z, TOOTH));
        let cut = Volume::from_distance(grid, band, |p| (p.z.max(-hole(p)), TOOTH));
        Workpiece::prepared(whole, cut)
    }

    /// The hole filled up to a height over the former surface.
    fn filled(workpiece: &Workpiece, height: impl Fn(Vec3) -> f32) -> Volume {
        let cut = &workpiece.volume;
        let mut end = Volume::clone(cut);
        for (index, cell) in cut.grid().cells().enumerate() {
            let at = cut.grid().centre(cell);
            let density = typodont_core::volume::density_at_distance(
                (at.z - height(at)).max(at.truncate().length() - 1.55),
                cut.half_band(),
            );
            if density > cut.densities()[index] {
                end.set(index, Voxel { density, label: FILLING });
            }
        }
        end
    }

    #[test]
    fn a_surface_that_lies_two_tenths_too_high_or_too_low_measures_so() {
        // Aim: distances are what they are, with their sign, at two voxel sizes. Method: a filling with a plane top.
        for spacing in [0.1, 0.2] {
            let workpiece = cavity(spacing);
            for off in [0.2f32, -0.2] {
                let found = Restoration::of(&workpiece, &filled(&workpiece, |_| off)).unwrap();
                let [mean, p95] = [found.mean().unwrap(), found.percentile(0.95).unwrap()];
                assert!((mean - 0.2).abs() < 0.03 && (p95 - 0.2).abs() < 0.02, "{spacing}: {mean} {p95}");
                let (signed, _) = if off > 0.0 { found.highest().unwrap() } else { found.lowest().unwrap() };
                assert!((signed - off).abs() < 0.06, "{spacing}: {signed}");
                let disc = std::f64::consts::PI * 1.55 * 1.55 * 0.2;
                let expected = if off > 0.0 { disc } else { 0.0 };
                assert!((found.overhang_mm3 - expected).abs() < 0.12 * disc, "{spacing}: {}", found.overhang_mm3);
            }
        }
    }

    #[test]
    fn the_original_contour_itself_measures_nothing() {
        let workpiece = cavity(0.1);
        let found = Restoration::of(&workpiece, workpiece.original.as_ref().unwrap()).unwrap();
        assert!(found.percentile(1.0).unwrap() < 1e-3 && found.overhang_mm3 == 0.0 && found.void_mm3 == 0.0);
        assert_eq!(found.filled, found.cavity);
        assert!(found.offsets.len() > 300, "{}", found.offsets.len());
    }

    #[test]
    fn a_bubble_is_a_void_and_a_gap_to_the_outside_is_none() {
        let workpiece = cavity(0.1);
        let bubble = Vec3::new(0.3, 0.0, -1.0);
        let mut end = filled(&workpiece, |_| 0.0);
        for (index, cell) in workpiece.volume.grid().cells().enumerate() {
            if workpiece.volume.grid().centre(cell).distance(bubble) < 0.4 {
                end.set(index, Voxel::AIR);
            }
        }
        let found = Restoration::of(&workpiece, &end).unwrap();
        let expected = 4.0 / 3.0 * std::f64::consts::PI * 0.064;
        assert!((found.void_mm3 / expected - 1.0).abs() < 0.1, "{} of {expected}", found.void_mm3);
        assert!(found.percentile(0.95).unwrap() < 0.03, "it is not seen from outside");
        let empty = Restoration::of(&workpiece, &workpiece.volume).unwrap();
        assert_eq!((empty.void_mm3, empty.filled), (0.0, 0));
        assert!(empty.lowest().unwrap().0 < -1.8, "an empty cavity is a deficit: {:?}", empty.lowest());
    }
}
