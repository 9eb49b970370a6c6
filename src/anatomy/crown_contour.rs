//! The contour of a crown at every height, for placing teeth side by side before any of them is generated.

use crate::form::ToothForm;
use crate::tooth_sdf::ToothSdf;
use std::f32::consts::TAU;
use std::ops::Range;
use typodont_core::frame::Vec3;

/// Number of heights and of directions at which the contour is sampled; interpolation between them is accurate to a few
/// hundredths of a millimetre.
const HEIGHTS: usize = 10;
const DIRECTIONS: usize = 48;

/// Range of heights above the neck, as shares of the crown: contacts lie well within it.
const FROM: f32 = 0.12;
const TO: f32 = 0.96;

/// Contour of the crown's sides about the axis of its tooth space, mm. The occlusal surface is omitted, since adjacent
/// teeth do not meet there.
#[derive(Clone, Debug)]
pub struct CrownContour {
    low: f32,
    high: f32,
    /// Distances from the axis to the side, mm, one ring per height.
    rings: Vec<[f32; DIRECTIONS]>,
}

impl CrownContour {
    /// Samples the contour of a form; for a mirrored tooth, the contour is that of its unmirrored form.
    pub fn of(form: &ToothForm) -> CrownContour {
        CrownContour::of_part(form, FROM..TO)
    }

    /// Samples another part of the contour: from one height above the neck to another, as shares of the crown.
    pub fn of_part(form: &ToothForm, part: Range<f32>) -> CrownContour {
        let shape = ToothSdf::new(form, 0.0);
        let (low, high) = (part.start * form.sizes.crown, part.end * form.sizes.crown);
        let bounds = shape.bounds();
        let reach = bounds.low.abs().max(bounds.high.abs()).max_element() * 1.5;
        let ring = |i: usize| {
            let z = low + (high - low) * i as f32 / (HEIGHTS - 1) as f32;
            let slice = shape.at_height(z);
            std::array::from_fn(|turn| {
                let outward = direction(turn);
                let (mut inside, mut outside) = (0.0, reach);
                for _ in 0..12 {
                    let middle = 0.5 * (inside + outside);
                    match slice.side([outward.x * middle, outward.y * middle]) < 0.0 {
                        true => inside = middle,
                        false => outside = middle,
                    }
                }
                0.5 * (inside + outside)
            })
        };
        CrownContour { low, high, rings: (0..HEIGHTS).map(ring).collect() }
    }

    /// Returns points around the crown's sides, tooth space, mm.
    pub fn points(&self) -> impl Iterator<Item = Vec3> + '_ {
        let height = move |i: usize| self.low + (self.high - self.low) * i as f32 / (HEIGHTS - 1) as f32;
        let ring = move |(i, ring): (usize, &[f32; DIRECTIONS])| {
            let z = height(i);
            let ring = *ring;
            (0..DIRECTIONS).map(move |turn| (direction(turn) * ring[turn]).with_z(z))
        };
        self.rings.iter().enumerate().flat_map(ring)
    }

    /// Returns the approximate distance of a point outside the crown's side, mm; negative inside, infinite above and
    /// below the sampled heights.
    pub fn distance_outside(&self, place: Vec3) -> f32 {
        if place.z < self.low || place.z > self.high {
            return f32::INFINITY;
        }
        let level = (place.z - self.low) / (self.high - self.low) * (HEIGHTS - 1) as f32;
        let (below, part) = ((level as usize).min(HEIGHTS - 2), level - (level as usize).min(HEIGHTS - 2) as f32);
        let step = (libm::atan2f(place.y, place.x) / TAU).rem_euclid(1.0) * DIRECTIONS as f32;
        let (before, share) = (step as usize % DIRECTIONS, step.fract());
        let round = |ring: &[f32; DIRECTIONS]| ring[before] + (ring[(before + 1) % DIRECTIONS] - ring[before]) * share;
        let (a, b) = (round(&self.rings[below]), round(&self.rings[below + 1]));
        libm::hypotf(place.x, place.y) - (a + (b - a) * part)
    }
}

fn direction(step: usize) -> Vec3 {
    let angle = TAU * step as f32 / DIRECTIONS as f32;
    Vec3::new(libm::cosf(angle), libm::sinf(angle), 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::teeth;
    use typodont_core::aabb::Aabb;

    #[test]
    fn a_girth_is_as_wide_as_its_tooth() {
        for fdi in [11, 13, 16, 31, 36] {
            let form = teeth::tooth(fdi).unwrap();
            let girth = CrownContour::of(&form);
            let Aabb { low, high } = Aabb::around(girth.points());
            let sizes = form.sizes;
            assert!((high.y - low.y - sizes.mesiodistal[0]).abs() < 0.25, "{fdi}: {} mesiodistally", high.y - low.y);
            assert!((high.x - low.x - sizes.buccolingual[0]).abs() < 0.35, "{fdi}: {} buccolingually", high.x - low.x);
            for place in girth.points().step_by(7) {
                let further = place + place.with_z(0.0).normalize() * 0.3;
                assert!(
                    (girth.distance_outside(further) - 0.3).abs() < 0.02,
                    "{fdi} at {place}: {}",
                    girth.distance_outside(further)
                );
            }
        }
    }
}
