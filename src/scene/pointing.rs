//! The place of a hand that works through a pointer: on the surface under it.
//!
//! Takes the ray of the pointer, the tooth as it is now, and what surrounds it. Gives the spot that the pointer chooses
//! and the target of the hand there. World space, mm.

use super::particles::CollisionWorld;
use typodont_core::frame::{Pose, Quat, Vec3};
use typodont_core::touch::{Collider, ColliderGeometry};
use typodont_core::volume::{RAY_LENGTH_MAX, Volume};
use typodont_exercise::catalog::{InstrumentEntry, WorkingEndEntry};

/// A point of a visible surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceSpot {
    pub place: Vec3,
    /// Unit normal out of the surface.
    pub normal: Vec3,
}

/// Action of a hand at the spot under the pointer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum HandAction {
    /// A bur is held just above the surface; any other instrument rests on it.
    Rest,
    /// Presses with at most this force, N.
    Press { max_force: f32 },
}

/// Place to which the hand moves, and its maximum force on the way, N.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointedHand {
    pub place: Vec3,
    pub max_force: f32,
}

/// Maximum force of a hand that rests, N: less than the weight of an instrument.
pub const REST_FORCE: f32 = 0.12;

/// Returns the surface of the tooth or of a collider that a ray meets first. `along` is a unit vector.
pub fn spot_under_ray(world: &CollisionWorld, from: Vec3, along: Vec3) -> Option<SurfaceSpot> {
    let tooth_from_world = world.world_from_tooth.inverse();
    let (from, along) = (tooth_from_world * from, tooth_from_world.rotate(along).normalize_or(Vec3::NEG_Z));
    let on_voxels = voxels(world).filter_map(|(volume, tooth_from_volume)| {
        let volume_from_tooth = tooth_from_volume.inverse();
        let (place, normal) = volume.raycast(volume_from_tooth * from, volume_from_tooth.rotate(along))?;
        Some((tooth_from_volume * place, tooth_from_volume.rotate(smooth_normal(volume, place, normal))))
    });
    let on_tooth = on_voxels.min_by(|a, b| a.0.distance(from).total_cmp(&b.0.distance(from)));
    let farthest = on_tooth.map_or(RAY_LENGTH_MAX, |(place, _)| place.distance(from));
    let (place, normal) = collider_on_ray(world.obstacles, from, along, farthest).or(on_tooth)?;
    // A surface that is seen faces the eye.
    let normal = if normal.dot(along) > 0.0 { -normal } else { normal };
    Some(SurfaceSpot { place: world.world_from_tooth * place, normal: world.world_from_tooth.rotate(normal) })
}

/// The tooth that is worked on and all others of voxels, with their places in tooth space.
fn voxels<'a>(world: &'a CollisionWorld) -> impl Iterator<Item = (&'a Volume, Pose)> {
    let others = world.obstacles.iter().filter_map(|obstacle| match &obstacle.geometry {
        ColliderGeometry::Voxels(volume) => Some((&**volume, obstacle.tooth_from_collider)),
        _ => None,
    });
    std::iter::once((world.volume, Pose::IDENTITY)).chain(others)
}

/// Mean normal of a tooth around a point of its surface: that of the area on which a bur bears, not of single voxels. In the
/// space of the volume.
fn smooth_normal(volume: &Volume, place: Vec3, normal: Vec3) -> Vec3 {
    /// Distance of the samples, mm.
    const REACH: f32 = 0.35;
    let around = [Vec3::ZERO, Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z];
    let slope = |offset: Vec3| volume.density_and_gradient_at(place + offset * REACH).1;
    (-around.into_iter().map(slope).sum::<Vec3>()).normalize_or(normal)
}

/// First surface of a collider without voxels nearer than `farthest`, and its normal; tooth space.
fn collider_on_ray(obstacles: &[Collider], from: Vec3, along: Vec3, farthest: f32) -> Option<(Vec3, Vec3)> {
    /// Distance at which a surface counts as reached, mm, and the maximum number of steps toward it.
    const REACHED: f32 = 0.02;
    const STEPS: usize = 128;
    let mut way = 0.0;
    for _ in 0..STEPS {
        let place = from + along * way;
        let solid = obstacles.iter().filter(|o| !matches!(o.geometry, ColliderGeometry::Voxels(_)));
        let nearest = solid.map(|o| (o.distance(place), o)).min_by(|a, b| a.0.total_cmp(&b.0));
        let (distance, obstacle) = nearest?;
        if distance <= REACHED {
            return Some((place, obstacle.distance_and_normal(place).1));
        }
        way += distance;
        if way >= farthest {
            break;
        }
    }
    None
}

/// Returns the target of a hand that works at a spot with an instrument. `tip` is the present place of the working end,
/// `world_from_handle` the orientation of the instrument.
///
/// A hand that is to press beside its working end is lifted off the surface first. A bur that rests passes over the tooth on its
/// way to a distant spot.
pub fn hand_at_spot(
    spot: &SurfaceSpot,
    tip: Vec3,
    instrument: &InstrumentEntry,
    world_from_handle: Quat,
    action: HandAction,
) -> PointedHand {
    /// Distance at which a bur is held above the surface, mm.
    const HOVER: f32 = 0.3;
    /// Depth of the target below the surface: of a resting explorer, of an instrument that presses, and of a probe that
    /// is slid into a pocket, mm. Soft caries, felt with 0.09 N/mm, yields 2.2 mm to the 0.2 N that cut it; dentine,
    /// suddenly met behind it, then resists with less than the 2 N that would cut it.
    const REST_DEPTH: f32 = 0.3;
    const PRESS_DEPTH: f32 = 2.5;
    /// Force above which a press goes deeper, N, so that it can be reached, and the further depth, mm/N.
    const DEEP_FORCE: f32 = 2.0;
    const DEPTH_PER_FORCE: f32 = 3.0;
    const PROBE_DEPTH: f32 = 12.0;
    /// Maximum offset of a working end that presses, mm: about the radius of a bur, whose flank may bear on a wall.
    const PRESS_REACH: f32 = 0.9;
    /// Offset up to which a bur moves within one cavity, mm: raised there, it would not get below an overhang again.
    const CAVITY_REACH: f32 = 3.0;
    /// Maximum height by which a bur is raised on its way to another place, mm: that of a crown.
    const CLIMB_MAX: f32 = 6.0;
    /// Distance below that height at which it counts as raised, mm.
    const RAISED: f32 = 0.3;
    /// Share of the way aside that it takes while it is raised.
    const SIDEWAYS: f32 = 0.1;
    let touching = spot.place + spot.normal * support(&instrument.end, world_from_handle.inverse() * spot.normal);
    // Offset of the working end along the surface. A hand that presses is moved by as much beyond the spot, so that a slope
    // does not lead it away.
    let aside = (touching - tip).reject_from_normalized(spot.normal);
    let shaft_down = world_from_handle * Vec3::NEG_Z;
    match action {
        HandAction::Press { max_force } if matches!(instrument.end, WorkingEndEntry::Probe(_)) => {
            PointedHand { place: touching + shaft_down * PROBE_DEPTH, max_force }
        }
        HandAction::Press { max_force } if aside.length() < PRESS_REACH => {
            let depth = PRESS_DEPTH + DEPTH_PER_FORCE * (max_force - DEEP_FORCE).max(0.0);
            PointedHand { place: touching + aside - spot.normal * depth, max_force }
        }
        HandAction::Press { .. } if instrument.is_bur() => {
            PointedHand { place: touching + spot.normal * HOVER, max_force: REST_FORCE }
        }
        HandAction::Rest if instrument.is_bur() => {
            // On its way to a spot beyond a cavity it is raised first, and passes over what stands between.
            let climb = (aside.length() - CAVITY_REACH).clamp(0.0, CLIMB_MAX);
            let over = touching + spot.normal * HOVER - shaft_down * climb;
            let rise = (tip - over).dot(shaft_down);
            // A little aside, so that it slides out from under an overhang.
            let raised = tip - shaft_down * rise + (over - tip).reject_from_normalized(shaft_down) * SIDEWAYS;
            let place = if climb > 0.0 && rise > RAISED { raised } else { over };
            PointedHand { place, max_force: REST_FORCE }
        }
        HandAction::Rest | HandAction::Press { .. } => {
            PointedHand { place: touching - spot.normal * REST_DEPTH, max_force: REST_FORCE }
        }
    }
}

/// Radius of a working end that is round about its reference point, mm; 0 for points and blades.
fn ball_radius(end: &WorkingEndEntry) -> f32 {
    match end {
        WorkingEndEntry::Ball(ball) => 0.5 * ball.diameter_mm,
        WorkingEndEntry::Probe(probe) => 0.5 * probe.diameter_mm,
        _ => 0.0,
    }
}

/// Radius and length of a working end that stands upright on its reference point, mm.
fn cylinder_size(end: &WorkingEndEntry) -> Option<[f32; 2]> {
    match end {
        WorkingEndEntry::Pear(e) => Some([0.5 * e.diameter_mm, e.length_mm]),
        WorkingEndEntry::Cylinder(e) => Some([0.5 * e.diameter_mm, e.length_mm]),
        WorkingEndEntry::Tapered(e) => Some([0.5 * e.diameter_mm, e.length_mm]),
        WorkingEndEntry::InvertedCone(e) => Some([0.5 * e.top_diameter_mm, e.length_mm]),
        WorkingEndEntry::Flame(e) => Some([0.5 * e.diameter_mm, e.length_mm]),
        _ => None,
    }
}

/// Distance of the reference point of a working end from a plane that it touches, mm. `normal` out of the plane, handle
/// space.
fn support(end: &WorkingEndEntry, normal: Vec3) -> f32 {
    if let WorkingEndEntry::Shape(shape) = end {
        return shape.support(normal);
    }
    match cylinder_size(end) {
        Some([radius, length]) => {
            let aside = normal.truncate().length();
            radius * aside + (-normal.z * length).max(0.0)
        }
        None => ball_radius(end),
    }
}

/// Length of a working end that stands upright on its reference point, mm; 0 for one that is round about it.
pub fn working_length(end: &WorkingEndEntry) -> f32 {
    cylinder_size(end).map_or(0.0, |[_, length]| length)
}

/// Radius of the ring that shows a working end on the surface, mm.
pub fn ring_radius(end: &WorkingEndEntry) -> f32 {
    /// Of a point, so that the ring is visible.
    const LEAST: f32 = 0.3;
    cylinder_size(end).map_or(ball_radius(end), |[radius, _]| radius).max(LEAST)
}
