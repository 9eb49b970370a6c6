//! What dust and water can fall on.

use crate::frame::{Pose, Vec3};
use crate::touch::Shape;
use crate::volume::{ISO, Volume};

/// The tooth as it is now, and what is touched around it.
#[derive(Clone, Copy)]
pub struct Ground<'a> {
    pub volume: &'a Volume,
    pub world_from_tooth: Pose,
    /// Tooth space.
    pub around: &'a [Shape],
}

/// A way through the world, as far as it leads; world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Way {
    Free,
    /// The last place before matter, and the unit normal out of it.
    Ends {
        place: Vec3,
        out: Vec3,
    },
    /// It begins within matter.
    Buried,
}

/// Halvings of a way to its end: of 2 mm a thirtieth of a millimetre is left.
const HALVINGS: usize = 6;

impl Ground<'_> {
    pub(super) fn way(&self, from: Vec3, to: Vec3) -> Way {
        let tooth_from_world = self.world_from_tooth.inverse();
        let (mut free, mut within) = (tooth_from_world * from, tooth_from_world * to);
        let (middle, half) = (free.midpoint(within), 0.5 * free.distance(within));
        // A mesh is slow to ask: once a way, where it is far off.
        let is_beside = self.around.iter().any(|shape| shape.distance(middle) <= half);
        let ground = Ground { around: if is_beside { self.around } else { &[] }, ..*self };
        if !ground.holds(within) {
            return Way::Free;
        }
        if ground.holds(free) {
            return Way::Buried;
        }
        for _ in 0..HALVINGS {
            let middle = free.midpoint(within);
            *(if ground.holds(middle) { &mut within } else { &mut free }) = middle;
        }
        let out = self.world_from_tooth.turn(ground.out_of(within));
        Way::Ends { place: self.world_from_tooth * free, out }
    }

    /// A place in the air at a place or just over it, world space; `None` where matter goes on.
    pub(super) fn over(&self, place: Vec3) -> Option<Vec3> {
        /// Steps outward, and their length, mm: together they are less than a bur is thick.
        const STEPS: usize = 4;
        const STEP: f32 = 0.15;
        let mut in_tooth = self.world_from_tooth.inverse() * place;
        for _ in 0..STEPS {
            if !self.holds(in_tooth) {
                return Some(self.world_from_tooth * in_tooth);
            }
            in_tooth += self.out_of(in_tooth) * STEP;
        }
        None
    }

    /// True where matter is at the end of a way, or stands in it.
    pub(super) fn is_closed(&self, from: Vec3, to: Vec3) -> bool {
        !matches!(self.way(from, to), Way::Free)
    }

    /// True within matter. A place of tooth space.
    fn holds(&self, place: Vec3) -> bool {
        self.volume.density_at(place) >= ISO || self.around.iter().any(|shape| shape.distance(place) <= 0.0)
    }

    /// The unit normal at a place of tooth space that has just come into matter.
    fn out_of(&self, place: Vec3) -> Vec3 {
        let (density, rise) = self.volume.density_and_gradient_at(place);
        if density >= ISO {
            return (-rise).normalize_or(Vec3::Z);
        }
        let deepest = self.around.iter().min_by(|a, b| a.distance(place).total_cmp(&b.distance(place)));
        deepest.map_or(Vec3::Z, |shape| shape.distance_and_normal(place).1)
    }
}
