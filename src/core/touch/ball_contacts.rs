//! Contact constraints of a point or a ball near matter.
//!
//! Takes the scene, an instrument and its tip. Gives constraints on the tip's centre.

use super::active_set::{Constraint, ConstraintSource};
use super::body::BodyRegion;
use super::collider_bounds::ColliderBounds;
use super::collision_scene::{Collider, ColliderGeometry, CollisionScene, OwnSpace};
use super::instrument::{Instrument, SAMPLE_SAG};
use crate::frame::Vec3;
use crate::volume::{ISO, Volume};

/// Distance below which a sample may become an active contact and is refined, mm.
const REFINE_WITHIN: f32 = 1.5 * SAMPLE_SAG;

/// Depth error, mm, below which a sample needs no refinement toward the true contact point of the ball.
const ALIGNED: f32 = 5e-4;

/// Normals of a voxel surface are accurate to about half a degree: within this tolerance (1 − cos 0.7°), the surface
/// normal counts as opposite to the ball's own.
const NORMAL_TOLERANCE: f32 = 7.5e-5;

/// Tip position, goal and search distance of a contact query; tooth space, mm.
#[derive(Clone, Copy, Debug)]
pub(super) struct ContactQuery {
    pub tip: Vec3,
    pub goal: Vec3,
    pub reach: f32,
}

/// Collects a constraint for every sample direction in which matter is in reach, and for every collider in reach.
pub(super) fn collect_constraints(
    constraints: &mut Vec<Constraint>,
    bounds: &mut ColliderBounds,
    scene: &CollisionScene,
    instrument: &Instrument,
    query: ContactQuery,
) {
    constraints.clear();
    collect_volume_constraints(constraints, &scene.volume, instrument, query, ConstraintSource::Volume);
    collect_collider_constraints(constraints, bounds, scene, instrument, query);
}

/// Adds a constraint for every sample direction in which matter of a volume is in reach; all in the space of the volume.
fn collect_volume_constraints(
    constraints: &mut Vec<Constraint>,
    volume: &Volume,
    instrument: &Instrument,
    query: ContactQuery,
    source: ConstraintSource,
) {
    let ContactQuery { tip, goal, reach } = query;
    let radius = instrument.radius();
    let grid = volume.grid();
    let tip_in_grid = grid.from_tooth(tip);
    let stretch = Vec3::splat(radius) / grid.spacing;
    let slack = slack(volume, instrument);
    let direction = (goal - tip).normalize_or_zero();
    // An additional direction points toward the goal: in a hollow of the ball's own radius all samples are equally
    // near, and without it the tip would drift to the nearest sample instead of moving straight on.
    let ahead = (radius > 0.0 && direction != Vec3::ZERO).then_some(&direction);
    let min_density = ISO - 0.5 * (reach + slack) / volume.half_band();
    for &outward in instrument.sample_directions().iter().chain(ahead) {
        // Samples on the far side cannot meet anything on the way to the goal.
        if outward.dot(direction) < -0.1 {
            continue;
        }
        let density = volume.density_in_grid(tip_in_grid + outward * stretch);
        if density < min_density {
            continue;
        }
        let distance = (ISO - density) * 2.0 * volume.half_band();
        let sample = match distance > REFINE_WITHIN && radius > 0.0 {
            true => BallSurfaceSample { direction: outward, normal: -outward, distance },
            false => BallSurfaceSample::along(volume, tip, outward, radius)
                .refined(volume, tip, radius)
                .or_backwards(direction),
        };
        constraints.push(Constraint {
            normal: sample.normal,
            offset: sample.normal.dot(tip) - sample.distance - slack,
            point: tip + sample.direction * radius - sample.normal * sample.distance,
            source,
            region: BodyRegion::Head,
        });
    }
}

/// Clearance by which the ball may enter the volume, mm.
///
/// Between voxel centres a concave surface reads narrower than it is, by up to h²/8 times the Laplacian of the
/// distance, 2/r on a sphere: without this much slack a bur would jam in the very groove it has cut.
fn slack(volume: &Volume, instrument: &Instrument) -> f32 {
    let (radius, spacing) = (instrument.radius(), volume.grid().spacing);
    match instrument.cuts && radius > 0.0 {
        true => spacing.max_element() * spacing.max_element() / (4.0 * radius),
        false => 0.0,
    }
}

/// Adds a constraint for every contact with a collider in reach.
fn collect_collider_constraints(
    constraints: &mut Vec<Constraint>,
    bounds: &mut ColliderBounds,
    scene: &CollisionScene,
    instrument: &Instrument,
    query: ContactQuery,
) {
    let ContactQuery { tip, reach, .. } = query;
    let radius = instrument.radius();
    for place in 0..bounds.count_candidates(scene, tip, radius + reach) {
        let index = bounds.candidate(place);
        let collider = &scene.colliders[index];
        if bounds.is_far((index, collider), tip, radius + reach) {
            continue;
        }
        if let ColliderGeometry::Voxels(volume) = &collider.geometry {
            let distance = collider.distance(tip);
            bounds.keep(index, tip, distance);
            if distance <= collider.steepness() * (radius + reach) {
                collect_voxel_constraints(constraints, (index, collider), volume, instrument, query);
            }
            continue;
        }
        let distance = collider.for_each_contact(tip, radius + reach, |distance, normal| {
            let clearance = distance - radius;
            if clearance < reach && constraints.len() < constraints.capacity() {
                constraints.push(Constraint {
                    normal,
                    offset: normal.dot(tip) - clearance,
                    point: tip - normal * distance,
                    source: ConstraintSource::Collider(index),
                    region: BodyRegion::Head,
                });
            }
        });
        bounds.keep(index, tip, distance);
    }
}

/// The search distance, mm, for a volume that may have a narrower half band than the one that is worked on, and into which the
/// instrument may enter by `slack`: beyond its band a volume's distances are unknown.
pub(super) fn reach_within_band(volume: &Volume, reach: f32, slack: f32) -> f32 {
    /// Share of the half band within which distances are looked up.
    const SHARE: f32 = 0.75;
    reach.min(SHARE * volume.half_band() - slack).max(0.0)
}

/// Adds the constraints of a collider made of voxels, found in its own space. Those for which the buffer has no room are left
/// out.
fn collect_voxel_constraints(
    constraints: &mut Vec<Constraint>,
    (index, collider): (usize, &Collider),
    volume: &Volume,
    instrument: &Instrument,
    query: ContactQuery,
) {
    let own = OwnSpace::of(collider);
    let [tip, goal] = [query.tip, query.goal].map(|place| own.collider_from_tooth * place);
    let query_in_own =
        ContactQuery { tip, goal, reach: reach_within_band(volume, query.reach, slack(volume, instrument)) };
    let first = constraints.len();
    if constraints.capacity() - first <= instrument.sample_directions().len() {
        return;
    }
    collect_volume_constraints(constraints, volume, instrument, query_in_own, ConstraintSource::Collider(index));
    for constraint in &mut constraints[first..] {
        *constraint = own.to_tooth(*constraint, query.tip);
    }
}

/// Contact sample of the ball's surface in one direction from its centre.
#[derive(Clone, Copy)]
struct BallSurfaceSample {
    /// Unit, from the ball's centre.
    direction: Vec3,
    /// Unit, out of the matter.
    normal: Vec3,
    /// Distance from the ball's surface to matter, mm; negative inside matter. Accurate within the half band of the
    /// volume.
    distance: f32,
}

impl BallSurfaceSample {
    fn along(volume: &Volume, tip: Vec3, direction: Vec3, radius: f32) -> BallSurfaceSample {
        let band = volume.half_band();
        let (density, gradient) = volume.density_and_gradient_at(tip + direction * radius);
        // Deep inside matter or in noise there is no usable gradient: back out toward the centre, as in the point
        // tracing of Hamburg.
        let normal = match gradient.length() * band > 0.05 {
            true => -gradient.normalize_or_zero(),
            false => -direction,
        };
        BallSurfaceSample { direction, normal, distance: (ISO - density) * 2.0 * band }
    }

    /// Uses the reverse of the direction of motion if there is no gradient, as in a pit of one voxel. A point has no
    /// centre toward which it could back out, and would otherwise fall through.
    fn or_backwards(self, direction: Vec3) -> BallSurfaceSample {
        if self.normal == Vec3::ZERO { BallSurfaceSample { normal: -direction, ..self } } else { self }
    }

    /// Returns the sample at the true contact of the ball, where its normal and that of the matter are opposite.
    ///
    /// On a smooth surface the contact lies straight against the surface normal. At an edge the surface normal
    /// rotates on the way there, and a secant step finds the point at which the two agree.
    fn refined(self, volume: &Volume, tip: Vec3, radius: f32) -> BallSurfaceSample {
        let off = 1.0 + self.normal.dot(self.direction);
        if off < NORMAL_TOLERANCE {
            return BallSurfaceSample { normal: -self.direction, ..self };
        }
        if radius * off < ALIGNED {
            return self;
        }
        let there = BallSurfaceSample::along(volume, tip, -self.normal, radius);
        // Slope of the depth along the great circle between the two directions, at its start and at its end.
        let cosine = self.direction.dot(there.direction);
        let departing = (there.direction - self.direction * cosine).normalize_or_zero();
        let arriving = (there.direction * cosine - self.direction).normalize_or_zero();
        let (slope, slope_there) = (-self.normal.dot(departing), -there.normal.dot(arriving));
        let found = match slope > 0.0 && slope_there < 0.0 {
            true => {
                let share = slope / (slope - slope_there);
                let direction = self.direction.lerp(there.direction, share).normalize_or_zero();
                BallSurfaceSample::along(volume, tip, direction, radius)
            }
            false => there,
        };
        BallSurfaceSample { normal: -found.direction, ..found }
    }
}
