//! A prepared cavity, cut into a tooth before the session begins.

use super::lesion::surface_over;
use super::workpiece::ToothPlace;
use super::{DecayPlace, Workpiece};
use crate::content::{Role, TissueTable};
use crate::frame::Vec3;
use crate::volume::{Volume, Voxel, ramp};

/// A cavity to be cut; lengths in mm, its angle in radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cavity {
    pub place: DecayPlace,
    pub length: f32,
    pub width: f32,
    pub depth: f32,
    /// By which its walls lean outward from the floor up.
    pub lean: f32,
    pub corner: f32,
    pub proximal: Option<Proximal>,
}

/// The box at a side of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Proximal {
    pub is_distal: bool,
    pub width: f32,
    pub axial: f32,
    pub depth: f32,
}

/// Why a cavity cannot be cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Uncuttable {
    /// It meets no tissue.
    Outside,
    /// It opens the pulp.
    Pulp,
}

/// A box with rounded corners, walls that lean, and no lid; tooth space.
#[derive(Clone, Copy)]
struct Hollow {
    middle: Vec3,
    half: [f32; 2],
    lean: f32,
    corner: f32,
}

impl Hollow {
    /// Signed distance from its wall, mm, negative inside; `middle.z` is the floor's height.
    fn distance(&self, point_in_tooth: Vec3) -> f32 {
        let p = point_in_tooth - self.middle;
        let aside = p.z.max(0.0) * libm::tanf(self.lean);
        // Upright distances from walls that lean are longer by this.
        let shortened = libm::cosf(self.lean);
        let corner = self.corner.min(self.half[0]).min(self.half[1]);
        let over = |along: f32, half: f32| (along.abs() - half - aside) * shortened + corner;
        let q = Vec3::new(over(p.x, self.half[0]), over(p.y, self.half[1]), -p.z + corner);
        q.max(Vec3::ZERO).length() + q.max_element().min(0.0) - corner
    }
}

impl Cavity {
    /// The tooth with the cavity cut into it.
    pub(super) fn cut(
        &self,
        mut tooth: Volume,
        place: &ToothPlace,
        tissues: &TissueTable,
        seed: u64,
    ) -> Result<Volume, Uncuttable> {
        let surface = surface_over(self.place, place, &tooth, seed);
        let occlusal = Hollow {
            middle: surface - Vec3::Z * self.depth,
            half: [0.5 * self.width, 0.5 * self.length],
            lean: self.lean,
            corner: self.corner,
        };
        let side = self.proximal.map(|p| self.proximal_hollow(&p, place, surface));
        let (grid, band) = (*tooth.grid(), tooth.band());
        let mut taken = 0;
        for (index, cell) in grid.cells().enumerate() {
            let before = tooth.voxel(index);
            if before == Voxel::AIR {
                continue;
            }
            let at = grid.centre(cell);
            let distance = side.iter().map(|s| s.distance(at)).fold(occlusal.distance(at), f32::min);
            let density = ramp(-distance, band);
            if density >= before.density {
                continue;
            }
            if before.density.is_solid() && !density.is_solid() {
                taken += 1;
                if tissues.role(before.label) == Some(Role::Vulnerable) {
                    return Err(Uncuttable::Pulp);
                }
            }
            tooth.set(index, Voxel { density, ..before });
        }
        tooth.take_dirty();
        if taken == 0 { Err(Uncuttable::Outside) } else { Ok(tooth) }
    }

    /// The proximal box: it reaches from the axial wall out beyond the crown, and over to the occlusal part.
    fn proximal_hollow(&self, proximal: &Proximal, place: &ToothPlace, surface: Vec3) -> Hollow {
        /// How far it reaches beyond the crown, mm.
        const BEYOND: f32 = 2.0;
        let outward = place.distal().y * if proximal.is_distal { 1.0 } else { -1.0 };
        let rim = if outward > 0.0 { place.crown_high.y } else { place.crown_low.y };
        let (axial, open) = (rim - outward * proximal.axial, rim + outward * BEYOND);
        Hollow {
            middle: Vec3::new(surface.x, 0.5 * (axial + open), surface.z - proximal.depth),
            half: [0.5 * proximal.width, 0.5 * (open - axial).abs()],
            lean: self.lean,
            corner: self.corner,
        }
    }
}

impl Workpiece {
    /// True where a solid voxel of the tooth has been cut away before the session, by array index.
    pub fn is_in_cavity(&self, voxel: usize) -> bool {
        let solid = |volume: &Volume| volume.densities()[voxel].is_solid();
        self.original.as_ref().is_some_and(|original| solid(original)) && !solid(&self.volume)
    }

    /// A volume in which a cavity was cut, before and after, with nothing else known of it.
    #[cfg(test)]
    pub fn prepared(whole: Volume, cut: Volume) -> Workpiece {
        Workpiece {
            volume: cut.into(),
            original: Some(whole.into()),
            teeth: Vec::new(),
            lesions: Vec::new(),
            around: Vec::new(),
            periodontium: None,
            arch: Default::default(),
            world_from_tooth: crate::frame::Pose::IDENTITY,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hollow_is_as_wide_as_written_at_its_floor_and_leans_from_there() {
        let lean = 0.1f32;
        let hollow = Hollow { middle: Vec3::ZERO, half: [1.0, 2.0], lean, corner: 0.2 };
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
