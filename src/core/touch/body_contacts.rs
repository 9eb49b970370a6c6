//! Contact constraints of a body (a working end of any shape) near matter.
//!
//! Takes the scene, a body and its pose. Gives constraints on the body's origin. Each constraint lies where the body
//! and matter would truly meet, between the sampled surface points, so that the force does not jump when one point
//! takes over from another. After McNeely et al. (1999), with constraints instead of springs.

use super::active_set::{Constraint, ConstraintSource};
use super::ball_contacts::{ContactQuery, reach_within_band};
use super::body::{Body, BodySurfacePoint, CHUNK};
use super::collider_bounds::{ColliderBounds, ColliderProximity};
use super::collision_scene::{ColliderGeometry, CollisionScene, OwnSpace};
use crate::frame::{Pose, Quat, Vec3};
use crate::volume::{ISO, Volume};

/// Distance below which a surface point may become an active contact and is refined, mm.
const REFINE_WITHIN: f32 = 0.018;

/// Tolerance (1 − cos 0.7°) within which the body's normal and that of the matter count as opposite: the angular
/// resolution of a voxel surface.
const NORMAL_TOLERANCE: f32 = 7.5e-5;

/// Clearance from matter, mm, beyond which a contact needs no refinement: more than the last moves of one tick.
const CLEARANCE: f32 = 0.004;

/// Refinement steps along the surface toward the true contact. Three find it on every phantom; a fourth makes no
/// noticeable difference.
const REFINE_STEPS: usize = 3;

/// Search directions tried in turn: where the body is curved in one direction and matter in the other, the deepest
/// point lies off the first.
const DIRECTIONS_MAX: usize = 2;

/// Surface points that need no check yet, because they are farther from matter than the instrument can have moved
/// since.
#[derive(Clone, Debug, Default)]
pub(super) struct ProximityCache {
    /// For each point, the accumulated motion at which it may meet matter again, mm.
    next_check: Vec<f64>,
    /// For each chunk of [`CHUNK`] points, the least of their `next_check` values.
    chunk_next_check: Vec<f64>,
    /// Upper bound of the motion of any point since the cache was last cleared, mm.
    motion: f64,
    last_tip: Option<Vec3>,
}

impl ProximityCache {
    pub fn with_capacity(points: usize) -> ProximityCache {
        ProximityCache {
            next_check: Vec::with_capacity(points),
            chunk_next_check: Vec::with_capacity(points.div_ceil(CHUNK)),
            motion: 0.0,
            last_tip: None,
        }
    }

    /// Returns true if the last query was for a body.
    pub fn is_active(&self) -> bool {
        self.last_tip.is_some()
    }

    /// Discards the cache after a change or a displacement of the instrument: all points are checked again.
    pub fn invalidate(&mut self) {
        self.last_tip = None;
    }

    /// Adds a rotation of the instrument by which no point has moved farther than `most` mm.
    pub fn add_rotation(&mut self, most: f32) {
        self.motion += f64::from(most);
    }

    fn add_motion(&mut self, points: usize, tip: Vec3) {
        match self.last_tip {
            Some(from) => self.motion += f64::from(from.distance(tip)),
            None => {
                self.next_check.clear();
                self.next_check.resize(points, 0.0);
                self.chunk_next_check.clear();
                self.chunk_next_check.resize(points.div_ceil(CHUNK), 0.0);
                self.motion = 0.0;
            }
        }
        self.last_tip = Some(tip);
    }
}

/// Everything known about the distances of a body from matter.
pub(super) struct ProximityState<'a> {
    pub volume: &'a mut ProximityCache,
    pub colliders: &'a mut ColliderProximity,
    pub bounds: &'a mut ColliderBounds,
}

/// Body, its orientation and whether it cuts.
#[derive(Clone, Copy)]
pub(super) struct PosedBody<'a> {
    pub body: &'a Body,
    pub tooth_from_handle: Quat,
    pub cuts: bool,
}

/// Collects a constraint for every surface point with matter in reach, and for every collider in reach of a point.
pub(super) fn collect_constraints(
    constraints: &mut Vec<Constraint>,
    ProximityState { volume: cache, colliders, bounds }: ProximityState,
    scene: &CollisionScene,
    posed: PosedBody,
    query: ContactQuery,
) {
    constraints.clear();
    let ContactQuery { tip, goal, reach } = query;
    let volume = &scene.volume;
    let band = volume.half_band();
    let rotation = glam::Mat3::from_quat(posed.tooth_from_handle);
    let near = VolumeQuery {
        volume,
        frame: ToolFrame { tip, rotation, posed },
        direction: (goal - tip).normalize_or_zero(),
        reach,
        slack: slack(volume, posed),
        source: ConstraintSource::Volume,
    };
    cache.add_motion(posed.body.surface_points().len(), tip);
    let grid = volume.grid();
    let (tip_in_grid, to_grid) = (grid.from_tooth(tip), glam::Mat3::from_diagonal(grid.spacing.recip()) * rotation);
    let chunks = posed.body.surface_points().chunks(CHUNK).zip(cache.next_check.chunks_mut(CHUNK));
    for ((nodes, next_checks), chunk_next) in chunks.zip(&mut cache.chunk_next_check) {
        if *chunk_next > cache.motion {
            continue;
        }
        for (node, next_check) in nodes.iter().zip(next_checks.iter_mut()) {
            if *next_check > cache.motion {
                continue;
            }
            let density = volume.density_in_grid(tip_in_grid + to_grid * node.position);
            if density > 0.0 {
                constraints.extend(near.constraint(node, density));
                continue;
            }
            // Cutting only increases the clearance, so the bound stays valid.
            let clear = scene.clear_radius_of_volume(tip + rotation * node.position).max(band);
            *next_check = cache.motion + f64::from(clear - reach);
        }
        *chunk_next = next_checks.iter().copied().fold(f64::INFINITY, f64::min);
    }
    collect_collider_constraints(constraints, (bounds, colliders), scene, posed, query);
}

/// A body near the matter of a volume; all in the space of the volume.
struct VolumeQuery<'a> {
    volume: &'a Volume,
    frame: ToolFrame<'a>,
    /// Unit, from the tip to the goal; zero if they are the same.
    direction: Vec3,
    /// mm
    reach: f32,
    /// Depth by which the body may enter the volume, mm.
    slack: f32,
    source: ConstraintSource,
}

impl VolumeQuery<'_> {
    /// Constraint of a surface point at which the volume has a density; `None` if no matter is in reach.
    fn constraint(&self, node: &BodySurfacePoint, density: f32) -> Option<Constraint> {
        let VolumeQuery { volume, ref frame, direction, reach, slack, source } = *self;
        let band = volume.half_band();
        let distance = (ISO - density) * 2.0 * band;
        let outward = frame.rotation * node.outward;
        // Matter behind a part that moves away counts only if the body has rotated into it.
        if density < ISO - 0.5 * (reach + slack) / band || distance > 0.0 && outward.dot(direction) < -0.1 {
            return None;
        }
        let contact = match distance > REFINE_WITHIN + slack {
            true => SurfaceContact { at: node.position, normal: -outward, distance },
            false => refined(volume, frame, node),
        };
        Some(Constraint {
            normal: contact.normal,
            offset: contact.normal.dot(frame.tip) - contact.distance - slack,
            point: frame.tip + frame.rotation * contact.at - contact.normal * contact.distance,
            source,
            region: node.region,
        })
    }
}

/// Between voxel centres a concave surface reads narrower than it is; see `ball_contacts`.
fn slack(volume: &Volume, posed: PosedBody) -> f32 {
    let radius = posed.body.head_radius();
    let spacing = volume.grid().spacing.max_element();
    if posed.cuts && radius > 0.0 { spacing * spacing / (4.0 * radius) } else { 0.0 }
}

fn collect_collider_constraints(
    constraints: &mut Vec<Constraint>,
    (bounds, proximity): (&mut ColliderBounds, &mut ColliderProximity),
    scene: &CollisionScene,
    posed: PosedBody,
    query: ContactQuery,
) {
    let ContactQuery { tip, goal, reach } = query;
    let tooth_from_handle = Pose { position: tip, orientation: posed.tooth_from_handle };
    let (middle, radius) = posed.body.bounding_sphere();
    let mut has_moved = false;
    for place in 0..bounds.count_candidates(scene, tooth_from_handle * middle, radius + reach) {
        let index = bounds.candidate(place);
        let collider = &scene.colliders[index];
        if bounds.is_beyond((index, collider), tooth_from_handle * middle, radius + reach) {
            continue;
        }
        if !has_moved {
            proximity.move_to(scene, posed.body, tooth_from_handle);
            has_moved = true;
        }
        if let ColliderGeometry::Voxels(volume) = &collider.geometry {
            let own = OwnSpace::of(collider);
            let orientation = own.collider_from_tooth.orientation * posed.tooth_from_handle;
            let tip_in_own = own.collider_from_tooth * tip;
            let slack = slack(volume, posed);
            let near = VolumeQuery {
                volume,
                frame: ToolFrame { tip: tip_in_own, rotation: glam::Mat3::from_quat(orientation), posed },
                direction: own.collider_from_tooth.rotate((goal - tip).normalize_or_zero()),
                reach: reach_within_band(volume, reach, slack),
                slack,
                source: ConstraintSource::Collider(index),
            };
            proximity.for_each_near((index, collider), posed.body, reach + near.slack, |point| {
                let node = &posed.body.surface_points()[point];
                let density = volume.density_at(tip_in_own + near.frame.rotation * node.position);
                if constraints.len() < constraints.capacity() {
                    constraints.extend(near.constraint(node, density).map(|found| own.to_tooth(found, tip)));
                }
            });
            continue;
        }
        proximity.for_each_near((index, collider), posed.body, reach, |point| {
            let node = &posed.body.surface_points()[point];
            let place = tooth_from_handle * node.position;
            if constraints.len() < constraints.capacity() {
                let (distance, normal) = collider.distance_and_normal(place);
                constraints.push(Constraint {
                    normal,
                    offset: normal.dot(tip) - distance,
                    point: place - normal * distance,
                    source: ConstraintSource::Collider(index),
                    region: node.region,
                });
            }
        });
    }
}

/// Pose of the instrument.
struct ToolFrame<'a> {
    tip: Vec3,
    rotation: glam::Mat3,
    posed: PosedBody<'a>,
}

/// Contact between a point of the instrument's surface and matter.
#[derive(Clone, Copy)]
struct SurfaceContact {
    /// Handle space.
    at: Vec3,
    /// Unit, out of the matter, tooth space.
    normal: Vec3,
    /// mm; negative inside matter.
    distance: f32,
}

/// Sample of the matter at a point of the instrument's surface; all in handle space.
#[derive(Clone, Copy)]
struct SurfaceSample {
    at: Vec3,
    /// Unit, out of the instrument.
    outward: Vec3,
    /// Unit, out of the matter.
    normal: Vec3,
    distance: f32,
}

impl SurfaceSample {
    fn from(volume: &Volume, frame: &ToolFrame, at: Vec3, outward: Vec3) -> SurfaceSample {
        let band = volume.half_band();
        let (density, gradient) = volume.density_and_gradient_at(frame.tip + frame.rotation * at);
        // Deep inside matter or in noise there is no usable gradient: back out toward the inside of the instrument.
        let normal = match gradient.length() * band > 0.05 {
            true => frame.rotation.transpose() * -gradient.normalize_or_zero(),
            false => -outward,
        };
        SurfaceSample { at, outward, normal, distance: (ISO - density) * 2.0 * band }
    }

    /// Rate at which the distance to matter decreases along a direction on the surface.
    fn slope(&self, along: Vec3) -> f32 {
        -self.normal.dot(along)
    }

    fn is_opposite(&self) -> bool {
        1.0 + self.normal.dot(self.outward) < NORMAL_TOLERANCE
    }
}

/// Searches the surface around a point for the deepest contact: where the normals of body and matter are opposite, or
/// where the point's patch of the surface ends.
fn refined(volume: &Volume, frame: &ToolFrame, node: &BodySurfacePoint) -> SurfaceContact {
    let mut found = SurfaceSample::from(volume, frame, node.position, node.outward);
    let mut normal = -found.outward;
    for _ in 0..DIRECTIONS_MAX {
        let downhill = found.outward * found.normal.dot(found.outward) - found.normal;
        let along = downhill.normalize_or_zero();
        // Even at its deepest, at the end of the patch, the point would not touch.
        let is_clear = found.distance > found.slope(along) * reach_along(node, along) + CLEARANCE;
        if is_clear || found.is_opposite() || along == Vec3::ZERO {
            break;
        }
        let is_beyond;
        (found, normal, is_beyond) = deepest_along(volume, frame, node, &found, along);
        if is_beyond {
            break;
        }
    }
    SurfaceContact { at: found.at, normal: frame.rotation * normal, distance: found.distance }
}

/// Searches along one direction. Returns the deepest sample, the contact normal there, and true if the depth still
/// increases beyond the patch, where the neighbouring point takes over.
fn deepest_along(
    volume: &Volume,
    frame: &ToolFrame,
    node: &BodySurfacePoint,
    first: &SurfaceSample,
    along: Vec3,
) -> (SurfaceSample, Vec3, bool) {
    let reach = reach_along(node, along);
    let sample_at = |share: f32| {
        let (at, outward) = frame.posed.body.project_to_surface(first.at + along * (reach * share), node.region);
        SurfaceSample::from(volume, frame, at, outward)
    };
    // False position between a point where the depth still increases and one where it no longer does.
    let (mut low, mut low_slope) = (0.0, first.slope(along));
    let (mut high, mut found) = (1.0, sample_at(1.0));
    let mut high_slope = found.slope_beyond(along);
    let last = found;
    for _ in 1..REFINE_STEPS {
        if high_slope >= 0.0 || found.is_opposite() {
            break;
        }
        let share = low + (high - low) * low_slope / (low_slope - high_slope);
        found = sample_at(share);
        let slope = found.slope_beyond(along);
        if slope > 0.0 {
            (low, low_slope) = (share, slope);
        } else {
            (high, high_slope) = (share, slope);
        }
    }
    // Of two touching bodies, the one that is flatter at the contact gives the more accurate normal.
    let tool_bend = (last.outward - first.outward).length();
    let matter_bend = (last.normal - first.normal).length();
    let normal = (found.normal * tool_bend - found.outward * matter_bend).try_normalize().unwrap_or(-found.outward);
    (found, normal, last.slope_beyond(along) >= 0.0)
}

impl SurfaceSample {
    /// Slope along the direction projected onto the surface here.
    fn slope_beyond(&self, along: Vec3) -> f32 {
        self.slope((along - self.outward * along.dot(self.outward)).normalize_or_zero())
    }
}

/// Extent of a point's patch of the surface in a direction, mm.
fn reach_along(node: &BodySurfacePoint, along: Vec3) -> f32 {
    let lengthwise = along.dot(node.along);
    let across = (1.0 - lengthwise * lengthwise).max(0.0).sqrt();
    1.0 / ((lengthwise / node.half_extent[0]).powi(2) + (across / node.half_extent[1]).powi(2)).sqrt()
}
