//! Instrument in the hand.

use super::body::Body;
use crate::frame::Vec3;
use std::sync::Arc;

/// Instrument for contact: the shape of its working end, and its effect on matter.
#[derive(Clone, Debug, PartialEq)]
pub struct Instrument {
    pub end: WorkingEnd,
    /// True if the instrument removes matter, as a bur or a blade does; false for an explorer.
    pub cuts: bool,
    /// True for a rotating bur; false for a blade, which cuts by the force of the hand alone.
    pub is_rotary: bool,
    /// Effect on a filling, if any.
    pub packing_tip: Option<PackingTip>,
    /// Unit vectors from the centre in whose direction the surface of a point or ball is sampled.
    sample_directions: Vec<Vec3>,
}

/// Effect of an instrument on a filling.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PackingTip {
    /// Volume that the instrument lays while it is pressed, mm³/s; 0 for none.
    pub rate: f32,
    /// True if the instrument closes voids.
    pub condenses: bool,
}

/// Working end: the part that makes contact.
#[derive(Clone, Debug, PartialEq)]
pub enum WorkingEnd {
    /// Tip of an explorer.
    Point,
    /// Spherical bur with its centre at the tip of the device. Radius in mm.
    Ball { radius: f32 },
    /// Any other shape, with its shank and orientation. The tip of a bur is at the tip of the device.
    Body(Arc<Body>),
}

/// Greatest protrusion of a ball beyond the surface between two sample directions, mm. Well below what a hand can
/// resolve.
pub(super) const SAMPLE_SAG: f32 = 0.012;

impl Instrument {
    pub fn new(end: WorkingEnd, cuts: bool) -> Instrument {
        let sample_directions = match end {
            WorkingEnd::Point => vec![Vec3::ZERO],
            WorkingEnd::Ball { radius } => fibonacci_sphere(sample_count(radius)),
            WorkingEnd::Body(_) => Vec::new(),
        };
        Instrument { end, cuts, is_rotary: cuts, packing_tip: None, sample_directions }
    }

    /// Returns the instrument as a blade, moved by the hand alone.
    pub fn non_rotary(self) -> Instrument {
        Instrument { is_rotary: false, ..self }
    }

    /// Returns the instrument with an effect on fillings.
    pub fn with_packing_tip(self, packing_tip: PackingTip) -> Instrument {
        Instrument { packing_tip: Some(packing_tip), ..self }
    }

    /// Creates an instrument with a working end of any shape.
    pub fn with_body(body: Body, cuts: bool) -> Instrument {
        Instrument::new(WorkingEnd::Body(Arc::new(body)), cuts)
    }

    /// Radius of a ball, mm; zero for a point or a body.
    pub fn radius(&self) -> f32 {
        match self.end {
            WorkingEnd::Ball { radius } => radius,
            WorkingEnd::Point | WorkingEnd::Body(_) => 0.0,
        }
    }

    /// Greatest radius of the cutting part, mm; zero for a point.
    pub fn head_radius(&self) -> f32 {
        self.body().map_or(self.radius(), Body::head_radius)
    }

    /// Radius of the face as seen along the shaft, mm.
    pub fn face_radius(&self) -> f32 {
        self.body().map_or(self.radius(), Body::face_radius)
    }

    /// Signed distance in mm (negative inside) of a point in handle space from the working end.
    pub fn end_distance(&self, point_in_handle: Vec3) -> f32 {
        self.body().map_or_else(|| point_in_handle.length() - self.radius(), |b| b.head_distance(point_in_handle))
    }

    pub(super) fn body(&self) -> Option<&Body> {
        match &self.end {
            WorkingEnd::Body(body) => Some(body),
            WorkingEnd::Point | WorkingEnd::Ball { .. } => None,
        }
    }

    pub(super) fn sample_directions(&self) -> &[Vec3] {
        &self.sample_directions
    }
}

/// Number of sample directions for which no point of the ball is farther from a sample than a cap of height
/// [`SAMPLE_SAG`] is wide.
///
/// A cap of height h on radius r spans a circle of radius √(2rh); Fibonacci points cover the sphere with circles of
/// about 1.9 times their share of the area.
fn sample_count(radius: f32) -> usize {
    let cap_squared = 2.0 * radius * SAMPLE_SAG;
    (1.9 * 4.0 * radius * radius / cap_squared).ceil().clamp(32.0, 512.0) as usize
}

/// Fibonacci lattice on the unit sphere: even, deterministic, for any number of points.
fn fibonacci_sphere(count: usize) -> Vec<Vec3> {
    let golden_angle = core::f32::consts::PI * (3.0 - 5.0f32.sqrt());
    (0..count)
        .map(|i| {
            let z = 1.0 - 2.0 * (i as f32 + 0.5) / count as f32;
            let ring = (1.0 - z * z).max(0.0).sqrt();
            let angle = golden_angle * i as f32;
            Vec3::new(ring * libm::cosf(angle), ring * libm::sinf(angle), z)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn feelers_leave_no_gap_wider_than_promised() {
        // Aim: a spike between sample directions enters by at most 1.6 times SAMPLE_SAG. Method: for many directions,
        // the nearest sample direction.
        for radius in [0.25, 0.7, 1.15] {
            let instrument = Instrument::new(WorkingEnd::Ball { radius }, true);
            for direction in fibonacci_sphere(5000) {
                let nearest = instrument.sample_directions().iter().map(|f| f.dot(direction)).fold(-1.0, f32::max);
                let sag = radius * (1.0 - nearest);
                assert!(
                    sag < 1.6 * SAMPLE_SAG,
                    "radius {radius}: {sag} mm with {}",
                    instrument.sample_directions().len()
                );
            }
        }
    }
}
