//! Collision of dust and water with the tooth and its surroundings.

use typodont_core::frame::{Pose, Vec3};
use typodont_core::touch::Collider;
use typodont_core::volume::{ISO, Volume};

/// The tooth as it is now, and the colliders around it.
#[derive(Clone, Copy)]
pub struct CollisionWorld<'a> {
    pub volume: &'a Volume,
    pub world_from_tooth: Pose,
    /// Tooth space.
    pub obstacles: &'a [Collider],
}

/// Result of a straight movement; world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Sweep {
    Free,
    /// The last place before matter, and the unit normal out of it.
    Hit {
        place: Vec3,
        normal: Vec3,
    },
    /// The movement begins within matter.
    Inside,
}

/// Halvings of a way to its end: of 2 mm a thirtieth of a millimetre is left.
const HALVINGS: usize = 6;

impl CollisionWorld<'_> {
    pub(super) fn sweep(&self, from: Vec3, to: Vec3) -> Sweep {
        let tooth_from_world = self.world_from_tooth.inverse();
        let (mut free, mut within) = (tooth_from_world * from, tooth_from_world * to);
        let (middle, half) = (free.midpoint(within), 0.5 * free.distance(within));
        // Distance queries to a mesh are slow: one per movement, if the mesh is far away.
        let is_beside = self.obstacles.iter().any(|shape| shape.distance(middle) <= half);
        let nearby = CollisionWorld { obstacles: if is_beside { self.obstacles } else { &[] }, ..*self };
        if !nearby.contains(within) {
            return Sweep::Free;
        }
        if nearby.contains(free) {
            return Sweep::Inside;
        }
        for _ in 0..HALVINGS {
            let middle = free.midpoint(within);
            *(if nearby.contains(middle) { &mut within } else { &mut free }) = middle;
        }
        let normal = self.world_from_tooth.rotate(nearby.outward_normal(within));
        Sweep::Hit { place: self.world_from_tooth * free, normal }
    }

    /// A free place at or just above a place, world space; `None` if there is none within reach.
    pub(super) fn nearest_free(&self, place: Vec3) -> Option<Vec3> {
        /// Steps outward, and their length, mm: together they are less than a bur is thick.
        const STEPS: usize = 4;
        const STEP: f32 = 0.15;
        let mut in_tooth = self.world_from_tooth.inverse() * place;
        for _ in 0..STEPS {
            if !self.contains(in_tooth) {
                return Some(self.world_from_tooth * in_tooth);
            }
            in_tooth += self.outward_normal(in_tooth) * STEP;
        }
        None
    }

    /// True if matter is at the end of a movement or on its path.
    pub(super) fn is_blocked(&self, from: Vec3, to: Vec3) -> bool {
        !matches!(self.sweep(from, to), Sweep::Free)
    }

    /// True for a place of tooth space within matter.
    fn contains(&self, place: Vec3) -> bool {
        self.volume.density_at(place) >= ISO || self.obstacles.iter().any(|shape| shape.distance(place) <= 0.0)
    }

    /// The unit normal at a place of tooth space that has just come into matter.
    fn outward_normal(&self, place: Vec3) -> Vec3 {
        let (density, rise) = self.volume.density_and_gradient_at(place);
        if density >= ISO {
            return (-rise).normalize_or(Vec3::Z);
        }
        let deepest = self.obstacles.iter().min_by(|a, b| a.distance(place).total_cmp(&b.distance(place)));
        deepest.map_or(Vec3::Z, |shape| shape.distance_and_normal(place).1)
    }
}
