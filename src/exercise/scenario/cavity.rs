//! A prepared cavity, cut into a tooth before the session begins.

use super::lesion::occlusal_point;
use super::tooth_bounds::ToothBounds;
use super::{DecayPlace, Workpiece};
use crate::catalog::{TissueRole, TissueTable};
use typodont_core::frame::Vec3;
use typodont_core::volume::{Volume, Voxel, density_at_distance};

/// A cavity to be cut; lengths in mm, angle in radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PreparedCavity {
    pub place: DecayPlace,
    pub length: f32,
    pub width: f32,
    pub depth: f32,
    /// Divergence of the walls from the floor upward.
    pub taper: f32,
    pub corner: f32,
    pub proximal: Option<ProximalBox>,
}

/// The proximal box of a cavity; lengths in mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProximalBox {
    pub is_distal: bool,
    pub width: f32,
    pub axial: f32,
    pub depth: f32,
}

/// Reason for which a cavity cannot be cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum CavityError {
    /// The cavity contains no tissue.
    Outside,
    /// The cavity opens the pulp.
    Pulp,
}

/// A box with rounded corners, divergent walls and an open top; tooth space, mm.
#[derive(Clone, Copy)]
struct CavitySolid {
    middle: Vec3,
    half: [f32; 2],
    taper: f32,
    corner: f32,
}

impl CavitySolid {
    /// Returns the signed distance from the wall, mm, negative inside; `middle.z` is the height of the floor.
    fn distance(&self, point_in_tooth: Vec3) -> f32 {
        let p = point_in_tooth - self.middle;
        let aside = p.z.max(0.0) * libm::tanf(self.taper);
        // Distances measured horizontally from inclined walls are longer by this factor.
        let shortened = libm::cosf(self.taper);
        let corner = self.corner.min(self.half[0]).min(self.half[1]);
        let over = |along: f32, half: f32| (along.abs() - half - aside) * shortened + corner;
        let q = Vec3::new(over(p.x, self.half[0]), over(p.y, self.half[1]), -p.z + corner);
        q.max(Vec3::ZERO).length() + q.max_element().min(0.0) - corner
    }
}

impl PreparedCavity {
    /// Returns the tooth with the cavity cut into it.
    ///
    /// # Errors
    /// Returns an error if the cavity contains no tissue or opens the pulp.
    pub(super) fn cut(
        &self,
        mut tooth: Volume,
        place: &ToothBounds,
        tissues: &TissueTable,
        seed: u64,
    ) -> Result<Volume, CavityError> {
        let surface = occlusal_point(self.place, place, &tooth, seed);
        let occlusal = CavitySolid {
            middle: surface - Vec3::Z * self.depth,
            half: [0.5 * self.width, 0.5 * self.length],
            taper: self.taper,
            corner: self.corner,
        };
        let side = self.proximal.map(|p| self.proximal_box(&p, place, surface));
        let (grid, band) = (*tooth.grid(), tooth.half_band());
        let mut taken = 0;
        for (index, cell) in grid.cells().enumerate() {
            let before = tooth.voxel(index);
            if before == Voxel::AIR {
                continue;
            }
            let at = grid.centre(cell);
            let distance = side.iter().map(|s| s.distance(at)).fold(occlusal.distance(at), f32::min);
            let density = density_at_distance(-distance, band);
            if density >= before.density {
                continue;
            }
            if before.density.is_solid() && !density.is_solid() {
                taken += 1;
                if tissues.role(before.label) == Some(TissueRole::Vulnerable) {
                    return Err(CavityError::Pulp);
                }
            }
            tooth.set(index, Voxel { density, ..before });
        }
        tooth.take_dirty();
        if taken == 0 { Err(CavityError::Outside) } else { Ok(tooth) }
    }

    /// Returns the proximal box, which extends from the axial wall beyond the crown and joins the occlusal part.
    fn proximal_box(&self, proximal: &ProximalBox, place: &ToothBounds, surface: Vec3) -> CavitySolid {
        /// Extent beyond the crown, mm.
        const BEYOND: f32 = 2.0;
        let outward = place.distal().y * if proximal.is_distal { 1.0 } else { -1.0 };
        let rim = if outward > 0.0 { place.crown.high.y } else { place.crown.low.y };
        let (axial, open) = (rim - outward * proximal.axial, rim + outward * BEYOND);
        CavitySolid {
            middle: Vec3::new(surface.x, 0.5 * (axial + open), surface.z - proximal.depth),
            half: [0.5 * proximal.width, 0.5 * (open - axial).abs()],
            taper: self.taper,
            corner: self.corner,
        }
    }
}

impl Workpiece {
    /// Returns true if the voxel with this array index was solid and has been cut away before the session.
    pub fn is_in_cavity(&self, voxel: usize) -> bool {
        let solid = |volume: &Volume| volume.densities()[voxel].is_solid();
        self.original.as_ref().is_some_and(|original| solid(original)) && !solid(&self.volume)
    }

    /// Returns a workpiece with a volume before and after a cavity was cut, and nothing else.
    #[cfg(test)]
    pub fn prepared(whole: Volume, cut: Volume) -> Workpiece {
        Workpiece {
            volume: cut.into(),
            grey_values: None,
            original: Some(whole.into()),
            teeth: Vec::new(),
            teeth_in_volume: 0,
            lesions: Vec::new(),
            drawn: Vec::new(),
            surroundings: Vec::new(),
            own_jaw: false,
            rubber_dam: false,
            retractors: false,
            neighbours: Vec::new(),
            periodontium: None,
            arch: Default::default(),
            tooth_from_arch: None,
            world_from_tooth: typodont_core::frame::Pose::IDENTITY,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hollow_is_as_wide_as_written_at_its_floor_and_leans_from_there() {
        let lean = 0.1f32;
        let hollow = CavitySolid { middle: Vec3::ZERO, half: [1.0, 2.0], taper: lean, corner: 0.2 };
        assert!((hollow.distance(Vec3::Z * 0.5) + 0.5).abs() < 1e-5, "half a millimetre over the floor");
        assert!(hollow.distance(Vec3::new(0.0, 0.0, -0.3)) > 0.29, "below the floor");
        let wall = Vec3::new(1.0 + 2.0 * lean.tan(), 0.0, 2.0);
        assert!(hollow.distance(wall).abs() < 1e-4, "{}", hollow.distance(wall));
        assert!(hollow.distance(wall + Vec3::X * 0.1) > 0.09);
        assert!(hollow.distance(Vec3::Z * 9.0) < -0.5, "no lid");
        // The corner between wall and floor is rounded: its sharp place is matter.
        assert!(hollow.distance(Vec3::new(0.99, 0.0, 0.01)) > 0.0);
    }
}
