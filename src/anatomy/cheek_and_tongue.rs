//! The cheek and the tongue beside a tooth that is worked on, as they are held aside during treatment.
//!
//! Takes the box of the tooth's crown in tooth space, mm. Gives signed distances. Forms and distances are estimates from
//! photographs of retracted mouths; no measurements were found.

use typodont_core::aabb::Aabb;
use typodont_core::frame::{Vec3, smooth_step};

/// Distance of the retracted cheek from the crown, mm: room for a saliva ejector and the head of a handpiece.
const CHEEK_ASIDE: f32 = 9.0;

/// Half the thickness, length and height of the modelled part of the cheek, mm, and the rounding of its edges.
const CHEEK_HALF: Vec3 = Vec3::new(5.0, 27.0, 17.0);
const CHEEK_ROUNDING: f32 = 4.0;

/// Height of the cheek's middle over the neck of the tooth, mm.
const CHEEK_OVER_NECK: f32 = 8.0;

/// Distance by which the cheek comes nearer to the jaw in the fold where it ends, and the height of the fold, mm.
const FOLD: f32 = 6.0;
const FOLD_HEIGHT: f32 = 7.0;

/// Distance of the tongue from the crown, and of its back below the cusps, mm.
const TONGUE_ASIDE: f32 = 6.0;
const TONGUE_BELOW_CUSPS: f32 = 1.0;

/// Half the length and height of the tongue, mm, its least half width, and the rounding of its edges.
const TONGUE_LENGTH: f32 = 30.0;
const TONGUE_HEIGHT: f32 = 12.0;
const TONGUE_LEAST_WIDTH: f32 = 11.0;
const TONGUE_ROUNDING: f32 = 9.0;

/// Depth and width of the furrow along the middle of the tongue, mm.
const FURROW: [f32; 2] = [1.2, 2.5];

/// Soft tissue beside a tooth.
#[derive(Clone, Copy, Debug)]
pub enum SoftNeighbour {
    Cheek,
    Tongue,
}

/// Cheek or tongue in tooth space: x buccal, z occlusal, mm.
#[derive(Clone, Copy, Debug)]
pub struct SoftBody {
    kind: SoftNeighbour,
    crown: Aabb,
    /// Sign of mesial along y.
    mesial: f32,
    /// Distance of the mouth's middle from the middle of the crown, mm.
    to_midline: f32,
}

impl SoftBody {
    /// `mesial`: the sign of mesial along y of tooth space. `to_midline`: distance of the mouth's middle from that of the
    /// crown, mm.
    pub fn new(kind: SoftNeighbour, crown: Aabb, mesial: f32, to_midline: f32) -> SoftBody {
        SoftBody { kind, crown, mesial, to_midline }
    }

    /// Returns a box that contains the body.
    pub fn bounds(&self) -> Aabb {
        let (middle, half, _) = self.block();
        // By as much as it is bent.
        let bent = Vec3::new(12.0, 0.0, 1.0);
        Aabb::around([middle]).grown(half + bent)
    }

    /// Signed distance to the surface, mm, negative inside. It is that of a rounded block that follows the arch; where it is
    /// bent, a little less steep or steeper than a distance.
    pub fn distance(&self, place: Vec3) -> f32 {
        let (middle, half, rounding) = self.block();
        let mut off = place - middle;
        match self.kind {
            SoftNeighbour::Cheek => off.x -= self.bend(place),
            // Toward the front the arch is narrower, on both sides.
            SoftNeighbour::Tongue => off.x *= half.x / (half.x - self.narrowing(place)).max(0.4 * half.x),
        }
        if let SoftNeighbour::Tongue = self.kind {
            let [depth, width] = FURROW;
            off.z += depth * libm::expf(-(off.x / width) * (off.x / width)) * smooth_step(off.z / half.z);
        }
        let beyond = off.abs() - (half - rounding);
        beyond.max(Vec3::ZERO).length() + beyond.max_element().min(0.0) - rounding
    }

    /// Middle, half edges and rounding of the block that is bent.
    fn block(&self) -> (Vec3, Vec3, f32) {
        let Aabb { low, high } = self.crown;
        let along = 0.5 * (low.y + high.y);
        match self.kind {
            SoftNeighbour::Cheek => {
                let middle = Vec3::new(high.x + CHEEK_ASIDE + CHEEK_HALF.x, along, low.z + CHEEK_OVER_NECK);
                (middle, CHEEK_HALF, CHEEK_ROUNDING)
            }
            SoftNeighbour::Tongue => {
                let top = high.z - TONGUE_BELOW_CUSPS;
                let middle_x = 0.5 * (low.x + high.x) - self.to_midline;
                let width = (low.x - TONGUE_ASIDE - middle_x).max(TONGUE_LEAST_WIDTH);
                let half = Vec3::new(width, TONGUE_LENGTH, TONGUE_HEIGHT);
                (Vec3::new(middle_x, along, top - TONGUE_HEIGHT), half, TONGUE_ROUNDING)
            }
        }
    }

    /// Shift of the cheek toward buccal at a place, mm: with the arch, and toward the jaw in its fold.
    fn bend(&self, place: Vec3) -> f32 {
        let below = self.crown.low.z - 1.0 - place.z;
        -0.7 * self.narrowing(place) - FOLD * smooth_step(below / FOLD_HEIGHT)
    }

    /// Distance by which the arch is nearer to the midline at a place than beside the tooth, mm: it curves in front and a
    /// little behind.
    fn narrowing(&self, place: Vec3) -> f32 {
        /// Radii of the arch in front of a molar and behind it, mm.
        const RADII: [f32; 2] = [38.0, 110.0];
        let Aabb { low, high } = self.crown;
        let ahead = (place.y - 0.5 * (low.y + high.y)) * self.mesial;
        let radius = if ahead > 0.0 { RADII[0] } else { RADII[1] };
        ahead * ahead / (2.0 * radius)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cheek_and_tongue_leave_room_around_the_crown_and_lie_in_their_boxes() {
        // Aim: a bur can pass between crown and cheek; nothing is cut off at a grid's border. Method: distances from the sides
        // of a molar's crown, and a raster of places outside the boxes, for both sides of the mouth.
        let crown = Aabb::new(Vec3::new(-5.0, -5.5, 0.0), Vec3::new(5.0, 5.5, 7.0));
        for mesial in [1.0, -1.0] {
            let [cheek, tongue] =
                [SoftNeighbour::Cheek, SoftNeighbour::Tongue].map(|kind| SoftBody::new(kind, crown, mesial, 24.0));
            let beside = |body: &SoftBody, x: f32, z: f32| body.distance(Vec3::new(x, 0.0, z));
            assert!((beside(&cheek, 5.0, 4.0) - CHEEK_ASIDE).abs() < 0.1);
            // The tongue is widest below the neck.
            assert!((beside(&tongue, -5.0, -4.0) - TONGUE_ASIDE).abs() < 0.3);
            for body in [cheek, tongue] {
                let Aabb { low, high } = body.bounds();
                let sides = (0..20).flat_map(|i| (0..20).map(move |j| Vec3::new(i as f32, j as f32, 0.0) / 19.0));
                for share in sides {
                    for (axis, end) in [(0, low), (1, low), (2, low), (0, high), (1, high), (2, high)] {
                        let mut place = low + (high - low) * Vec3::new(share.x, share.y, share.x);
                        place[axis] = end[axis];
                        assert!(body.distance(place) >= 0.0, "{body:?}: {place}");
                    }
                }
            }
        }
    }
}
