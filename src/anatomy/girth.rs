//! A crown's girth at every height: quick to ask, for teeth that are set side by side before any is grown.

use super::form::Form;
use super::shape::Shape;
use crate::frame::Vec3;
use std::f32::consts::TAU;

/// Heights and directions at which the girth is taken: between two of them it is good to a few hundredths of a millimetre.
const HEIGHTS: usize = 10;
const TURNS: usize = 48;

/// From the neck up, shares of the crown: a contact lies well between.
const FROM: f32 = 0.12;
const TO: f32 = 0.96;

/// The crown's sides about the axis of its tooth space, mm. The chewing surface is left out: no two teeth meet there.
#[derive(Clone, Debug)]
pub struct Girth {
    low: f32,
    high: f32,
    /// From the axis to the side.
    rings: Vec<[f32; TURNS]>,
}

impl Girth {
    /// As the form is written: of a mirrored tooth the girth of its twin.
    pub fn of(form: &Form) -> Girth {
        let shape = Shape::new(form, 0.0);
        let (low, high) = (FROM * form.sizes.crown, TO * form.sizes.crown);
        let [least, most] = shape.bounds();
        let reach = least.abs().max(most.abs()).max_element() * 1.5;
        let ring = |i: usize| {
            let z = low + (high - low) * i as f32 / (HEIGHTS - 1) as f32;
            let slice = shape.cut(z);
            std::array::from_fn(|turn| {
                let way = direction(turn);
                let (mut inside, mut outside) = (0.0, reach);
                for _ in 0..12 {
                    let middle = 0.5 * (inside + outside);
                    match slice.side([way.x * middle, way.y * middle]) < 0.0 {
                        true => inside = middle,
                        false => outside = middle,
                    }
                }
                0.5 * (inside + outside)
            })
        };
        Girth { low, high, rings: (0..HEIGHTS).map(ring).collect() }
    }

    /// Places all round the crown's sides, tooth space.
    pub fn places(&self) -> impl Iterator<Item = Vec3> + '_ {
        let height = move |i: usize| self.low + (self.high - self.low) * i as f32 / (HEIGHTS - 1) as f32;
        let ring = move |(i, ring): (usize, &[f32; TURNS])| {
            let z = height(i);
            let ring = *ring;
            (0..TURNS).map(move |turn| (direction(turn) * ring[turn]).with_z(z))
        };
        self.rings.iter().enumerate().flat_map(ring)
    }

    /// About how far a place lies outside the crown's side, mm; negative inside, and infinite above and below it.
    pub fn outside(&self, place: Vec3) -> f32 {
        if place.z < self.low || place.z > self.high {
            return f32::INFINITY;
        }
        let level = (place.z - self.low) / (self.high - self.low) * (HEIGHTS - 1) as f32;
        let (below, part) = ((level as usize).min(HEIGHTS - 2), level - (level as usize).min(HEIGHTS - 2) as f32);
        let turn = (libm::atan2f(place.y, place.x) / TAU).rem_euclid(1.0) * TURNS as f32;
        let (before, share) = (turn as usize % TURNS, turn.fract());
        let round = |ring: &[f32; TURNS]| ring[before] + (ring[(before + 1) % TURNS] - ring[before]) * share;
        let (a, b) = (round(&self.rings[below]), round(&self.rings[below + 1]));
        libm::hypotf(place.x, place.y) - (a + (b - a) * part)
    }
}

fn direction(turn: usize) -> Vec3 {
    let angle = TAU * turn as f32 / TURNS as f32;
    Vec3::new(libm::cosf(angle), libm::sinf(angle), 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::anatomy::teeth;

    #[test]
    fn a_girth_is_as_wide_as_its_tooth() {
        for fdi in [11, 13, 16, 31, 36] {
            let form = teeth::tooth(fdi).unwrap();
            let girth = Girth::of(&form);
            let [low, high] =
                girth.places().fold([Vec3::INFINITY, Vec3::NEG_INFINITY], |[l, h], p| [l.min(p), h.max(p)]);
            let sizes = form.sizes;
            assert!((high.y - low.y - sizes.mesiodistal[0]).abs() < 0.25, "{fdi}: {} mesiodistally", high.y - low.y);
            assert!((high.x - low.x - sizes.buccolingual[0]).abs() < 0.35, "{fdi}: {} buccolingually", high.x - low.x);
            for place in girth.places().step_by(7) {
                let further = place + place.with_z(0.0).normalize() * 0.3;
                assert!((girth.outside(further) - 0.3).abs() < 0.02, "{fdi} at {place}: {}", girth.outside(further));
            }
        }
    }
}
