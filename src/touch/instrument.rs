//! What the hand holds.

use super::body::Body;
use super::pack::Packs;
use crate::frame::Vec3;
use std::sync::Arc;

/// An instrument as touch knows it: the shape of its working end, and whether that end cuts.
#[derive(Clone, Debug, PartialEq)]
pub struct Instrument {
    pub end: WorkingEnd,
    /// A bur or a blade removes matter; an explorer never does.
    pub cuts: bool,
    /// A bur turns; a blade cuts by the hand's force alone.
    pub turns: bool,
    /// What it does with a filling, if anything.
    pub packs: Option<Packs>,
    /// Directions from the end's centre in which its surface is watched, unit vectors.
    feelers: Vec<Vec3>,
}

/// The part that touches.
#[derive(Clone, Debug, PartialEq)]
pub enum WorkingEnd {
    /// The tip of an explorer.
    Point,
    /// A spherical bur; its centre is where the device's tip is. Radius in mm.
    Ball { radius: f32 },
    /// Any other, with its shank, as the hand turns it. A bur's tip is where the device's tip is.
    Shaped(Arc<Body>),
}

/// How far a ball may bulge past the surface between two feelers, mm. Well below what a hand resolves.
pub(super) const FEELER_SAG: f32 = 0.012;

impl Instrument {
    pub fn new(end: WorkingEnd, cuts: bool) -> Instrument {
        let feelers = match end {
            WorkingEnd::Point => vec![Vec3::ZERO],
            WorkingEnd::Ball { radius } => spread_over_sphere(feelers_for(radius)),
            WorkingEnd::Shaped(_) => Vec::new(),
        };
        Instrument { end, cuts, turns: cuts, packs: None, feelers }
    }

    /// The same, moved by the hand alone.
    pub fn by_hand(self) -> Instrument {
        Instrument { turns: false, ..self }
    }

    /// The same, for fillings.
    pub fn packing(self, packs: Packs) -> Instrument {
        Instrument { packs: Some(packs), ..self }
    }

    /// A working end of any shape.
    pub fn shaped(body: Body, cuts: bool) -> Instrument {
        Instrument::new(WorkingEnd::Shaped(Arc::new(body)), cuts)
    }

    /// A ball's radius, mm; zero for what has its surface where the device's tip is.
    pub fn radius(&self) -> f32 {
        match self.end {
            WorkingEnd::Ball { radius } => radius,
            WorkingEnd::Point | WorkingEnd::Shaped(_) => 0.0,
        }
    }

    /// Greatest radius of what cuts, mm; zero for a point.
    pub fn head_radius(&self) -> f32 {
        self.body().map_or(self.radius(), Body::head_radius)
    }

    /// Radius of the end as it is seen along the shaft, mm.
    pub fn face_radius(&self) -> f32 {
        self.body().map_or(self.radius(), Body::face_radius)
    }

    /// Signed distance in mm (negative inside) of a point of handle space from the working end.
    pub fn end_distance(&self, point_in_handle: Vec3) -> f32 {
        self.body().map_or_else(|| point_in_handle.length() - self.radius(), |b| b.head_distance(point_in_handle))
    }

    pub(super) fn body(&self) -> Option<&Body> {
        match &self.end {
            WorkingEnd::Shaped(body) => Some(body),
            WorkingEnd::Point | WorkingEnd::Ball { .. } => None,
        }
    }

    pub(super) fn feelers(&self) -> &[Vec3] {
        &self.feelers
    }
}

/// Points needed so that no place on the ball is farther from one than a cap of height [`FEELER_SAG`] is wide.
///
/// A cap of height h on radius r spans a circle of radius √(2rh); Fibonacci points cover the sphere with circles of
/// about 1.9 times their share of the area.
fn feelers_for(radius: f32) -> usize {
    let cap_squared = 2.0 * radius * FEELER_SAG;
    (1.9 * 4.0 * radius * radius / cap_squared).ceil().clamp(32.0, 512.0) as usize
}

/// Fibonacci lattice: even, deterministic, any count.
fn spread_over_sphere(count: usize) -> Vec<Vec3> {
    let golden_angle = core::f32::consts::PI * (3.0 - 5.0f32.sqrt());
    (0..count)
        .map(|i| {
            let z = 1.0 - 2.0 * (i as f32 + 0.5) / count as f32;
            let ring = (1.0 - z * z).max(0.0).sqrt();
            let turn = golden_angle * i as f32;
            Vec3::new(ring * libm::cosf(turn), ring * libm::sinf(turn), z)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn feelers_leave_no_gap_wider_than_promised() {
        // Aim: a spike between feelers enters by at most FEELER_SAG. Method: many directions, nearest feeler to each.
        for radius in [0.25, 0.7, 1.15] {
            let instrument = Instrument::new(WorkingEnd::Ball { radius }, true);
            for direction in spread_over_sphere(5000) {
                let nearest = instrument.feelers().iter().map(|f| f.dot(direction)).fold(-1.0, f32::max);
                let sag = radius * (1.0 - nearest);
                assert!(sag < 1.6 * FEELER_SAG, "radius {radius}: {sag} mm with {}", instrument.feelers().len());
            }
        }
    }
}
