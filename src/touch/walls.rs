//! Where the surface of a working end comes near matter, and which way out is.
//!
//! Takes matter, an instrument and its tip. Gives walls for the tip's centre to stay in front of.

use super::body::Region;
use super::instrument::{FEELER_SAG, Instrument};
use super::matter::Matter;
use super::planes::{Plane, Touched};
use crate::frame::Vec3;
use crate::volume::{ISO, Volume};

/// Distance below which a feeler may be what holds the tip, mm: it is looked at closely.
const CLOSE: f32 = 1.5 * FEELER_SAG;

/// A feeler that misses a ball's true point of contact by less than this, mm of depth, is as good as it.
const ALIGNED: f32 = 5e-4;

/// Normals of a voxel surface are good to about half a degree: closer than this (1 − cos 0.7°) to a ball's own normal they
/// are the same.
const GRAIN: f32 = 7.5e-5;

/// From where, toward where and how far ahead walls are looked for; tooth space, mm.
#[derive(Clone, Copy, Debug)]
pub(super) struct Look {
    pub tip: Vec3,
    pub goal: Vec3,
    pub reach: f32,
}

/// Collects a wall for every feeler that matter is in reach of, and for every shape in reach.
pub(super) fn find(planes: &mut Vec<Plane>, matter: &Matter, instrument: &Instrument, look: Look) {
    planes.clear();
    let Look { tip, goal, reach } = look;
    let volume = &matter.volume;
    let radius = instrument.radius();
    let grid = volume.grid();
    let tip_in_grid = grid.from_tooth(tip);
    let stretch = Vec3::splat(radius) / grid.spacing;
    // Between voxel centres a hollow reads narrower than it is, by up to h²/8 times the Laplacian of the distance, 2/r on a
    // sphere: without this much slack a bur would jam in the very groove it has cut.
    let slack = match instrument.cuts && radius > 0.0 {
        true => grid.spacing.max_element() * grid.spacing.max_element() / (4.0 * radius),
        false => 0.0,
    };
    let way = (goal - tip).normalize_or_zero();
    // One feeler more points where the tip is pulled: in a hollow of the ball's own shape all feelers are equally near, and
    // without it the tip would drift to the nearest of them instead of going straight on.
    let ahead = (radius > 0.0 && way != Vec3::ZERO).then_some(&way);
    let seen_from = ISO - 0.5 * (reach + slack) / volume.band();
    for &feeler in instrument.feelers().iter().chain(ahead) {
        // Feelers on the far side cannot meet anything on the way to the goal.
        if feeler.dot(way) < -0.1 {
            continue;
        }
        let density = volume.density_in_grid(tip_in_grid + feeler * stretch);
        if density < seen_from {
            continue;
        }
        let distance = (ISO - density) * 2.0 * volume.band();
        let seen = match distance > CLOSE && radius > 0.0 {
            true => Sight { direction: feeler, normal: -feeler, distance },
            false => Sight::along(volume, tip, feeler, radius).settled(volume, tip, radius).or_back(way),
        };
        planes.push(Plane {
            normal: seen.normal,
            offset: seen.normal.dot(tip) - seen.distance - slack,
            at: tip + seen.direction * radius - seen.normal * seen.distance,
            touched: Touched::Volume,
            by: Region::Head,
        });
    }
    for (index, shape) in matter.around.iter().enumerate() {
        shape.meet(tip, radius + reach, |distance, normal| {
            let clearance = distance - radius;
            if clearance < reach {
                planes.push(Plane {
                    normal,
                    offset: normal.dot(tip) - clearance,
                    at: tip - normal * distance,
                    touched: Touched::Shape(index),
                    by: Region::Head,
                });
            }
        });
    }
}

/// What the working end's surface sees of matter in one direction from its centre.
#[derive(Clone, Copy)]
struct Sight {
    /// Unit, from the centre.
    direction: Vec3,
    /// Unit, out of matter.
    normal: Vec3,
    /// From the end's surface to matter, mm; negative when it has entered. Good to within the volume's band.
    distance: f32,
}

impl Sight {
    fn along(volume: &Volume, tip: Vec3, direction: Vec3, radius: f32) -> Sight {
        let band = volume.band();
        let (density, gradient) = volume.density_and_gradient_at(tip + direction * radius);
        // Deep inside or on noise there is no slope to go by: back out toward the centre, as in Hamburg's point tracing.
        let normal = match gradient.length() * band > 0.05 {
            true => -gradient.normalize_or_zero(),
            false => -direction,
        };
        Sight { direction, normal, distance: (ISO - density) * 2.0 * band }
    }

    /// A point has no centre to back out toward: where there is no slope, as in a pit of one voxel, it goes back the way
    /// it came, or it would fall through.
    fn or_back(self, way: Vec3) -> Sight {
        if self.normal == Vec3::ZERO { Sight { normal: -way, ..self } } else { self }
    }

    /// Looks again where a ball truly meets matter: where its own normal and matter's are opposite.
    ///
    /// On a smooth surface that is straight against the normal. At an edge matter's normal turns on the way there, and
    /// a secant step finds the place where the two agree.
    fn settled(self, volume: &Volume, tip: Vec3, radius: f32) -> Sight {
        let off = 1.0 + self.normal.dot(self.direction);
        if off < GRAIN {
            return Sight { normal: -self.direction, ..self };
        }
        if radius * off < ALIGNED {
            return self;
        }
        let there = Sight::along(volume, tip, -self.normal, radius);
        // How fast it gets deeper along the great circle between the two directions, at its start and its end.
        let cosine = self.direction.dot(there.direction);
        let setting_out = (there.direction - self.direction * cosine).normalize_or_zero();
        let arriving = (there.direction * cosine - self.direction).normalize_or_zero();
        let (slope, slope_there) = (-self.normal.dot(setting_out), -there.normal.dot(arriving));
        let found = match slope > 0.0 && slope_there < 0.0 {
            true => {
                let share = slope / (slope - slope_there);
                let direction = self.direction.lerp(there.direction, share).normalize_or_zero();
                Sight::along(volume, tip, direction, radius)
            }
            false => there,
        };
        Sight { normal: -found.direction, ..found }
    }
}
