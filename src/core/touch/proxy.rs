//! Proxy (god object): the tip of an instrument, which follows the hand but never enters matter.
//!
//! Takes the scene, an instrument and the hand pose. Gives the nearest allowed tip position and the contact there.
//! After Zilles & Salisbury (1995), for a volume: instead of polygons, each place where the surface of the working
//! end comes near matter gives a constraint, and the tip moves to the point nearest to the hand that satisfies all
//! constraints.

use super::active_set::{ActiveSet, Constraint, ConstraintSource, project_to_feasible};
use super::ball_contacts;
use super::body::{Body, BodyRegion, BodySurfacePoint};
use super::body_contacts::{self, ProximityCache};
use super::closed_mesh::MESH_CONTACTS_MAX;
use super::collider_bounds::{ColliderBounds, ColliderProximity};
use super::collision_scene::{Collider, ColliderGeometry, CollisionScene, OwnSpace, ROUNDING};
use super::instrument::Instrument;
use super::material::{Material, MaterialMean, Materials};
use crate::frame::{Pose, Quat, Vec3};
use crate::volume::{ISO, Label, Volume};

/// Moves of the tip per tick. Two or three settle it; the others let it follow a fast hand near matter.
const MOVES_MAX: usize = 10;

/// Length of a move below which the tip has arrived, mm: 2 mN on the stiffest surface. The next tick continues from
/// there.
const ARRIVED: f32 = 2e-3;

/// Longest move between two collections of constraints, mm; shorter for a narrower density ramp, which is detected
/// later.
const REACH: f32 = 0.12;

/// Greatest change of the stretch between hand and tip within one tick unless the hand itself moved more, mm. Where a
/// bur slips off an edge, a massless tip would snap to its new position, and the force with it; a real tool takes
/// some ticks. 0.02–0.05 is smooth without feeling sluggish.
const MAX_STRETCH_STEP: f32 = 0.03;

/// Time in which the friction coefficient falls from static to dynamic, in ticks of exponential decay. Real
/// stick–slip takes milliseconds; an instantaneous fall would be a step in the force. 5–20 feels alike.
const SLIP_TICKS: f32 = 10.0;

/// Distance around a contact over which tissues are averaged, mm. About the contact width of an explorer's tip.
const MIX_RADIUS: f32 = 0.1;

/// Most colliders of voxels whose contacts are all kept at once: where teeth meet, two; three in a crowded arch.
const NEAR_VOXEL_COLLIDERS_MAX: usize = 3;

/// Length of a move below which a body has arrived, mm: over such a distance its constraints stay valid, to a
/// micrometre at an edge of 0.05 mm radius.
const BODY_ARRIVED: f32 = 0.01;

/// Gap below which contacts share the load, mm: the noise of voxel surfaces. At 0.005 the torque trembles with that
/// noise; at 0.05 a tilted working end seems to rest on too many points.
const SHARED_LOAD_GAP: f32 = 0.02;

/// Cosine of the angle (20°) between two normals up to which contacts share the load.
const SAME_NORMAL_COSINE: f32 = 0.94;

/// Fraction by which the moment arm follows within one tick: the contact point of a flat end may jump, but the torque
/// should not. 0.1–0.3 feels alike.
const MOMENT_ARM_SMOOTHING: f32 = 0.2;

/// Contact of the tip with matter, in tooth space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Tissue that carries most of the force.
    pub label: Label,
    /// Mean of the materials of the touched tissues, weighted by the force that each carries.
    pub material: Material,
    /// Unit vector from the matter to the tip: direction of the force without friction.
    pub normal: Vec3,
    /// Torque about the tip per newton of contact force, mm.
    pub moment_arm: Vec3,
    /// Fraction of the force carried by the working end rather than the shank behind it.
    pub head_share: f32,
}

/// Tip of an instrument and its friction state. Positions in tooth space, mm.
#[derive(Clone, Debug)]
pub struct Proxy {
    tip: Vec3,
    /// Position of the hand in the previous tick.
    last_hand: Vec3,
    /// Orientation of the hand in the previous tick, `tooth_from_handle`.
    last_orientation: Quat,
    contact: Option<Contact>,
    /// 1 while sticking, falling to 0 once sliding has begun.
    stick: f32,
    /// Scratch: constraints of the current move.
    constraints: Vec<Constraint>,
    /// Scratch: surface points of a body that are far from matter.
    proximity: ProximityCache,
    /// Scratch: the same for colliders.
    collider_proximity: ColliderProximity,
    /// Scratch: distances of colliders.
    bounds: ColliderBounds,
}

impl Proxy {
    /// Creates a free tip. `scene` and `instruments` must be those it will be used with, because they determine the
    /// size of the buffers.
    pub fn new(scene: &CollisionScene, instruments: &[Instrument], tip: Vec3) -> Proxy {
        let directions = instruments.iter().map(|i| i.sample_directions().len()).max().unwrap_or(1);
        let points = instruments.iter().filter_map(|i| i.body()).map(|b| b.surface_points().len()).max().unwrap_or(0);
        let is_voxels = |collider: &&Collider| matches!(collider.geometry, ColliderGeometry::Voxels(_));
        let voxel_colliders = scene.colliders.iter().filter(is_voxels).count();
        let near_voxels = voxel_colliders.min(NEAR_VOXEL_COLLIDERS_MAX);
        let simple_contacts = (scene.colliders.len() - voxel_colliders) * MESH_CONTACTS_MAX;
        Proxy {
            tip,
            last_hand: tip,
            last_orientation: Quat::IDENTITY,
            contact: None,
            stick: 1.0,
            constraints: Vec::with_capacity(
                ((directions + 1) * (1 + near_voxels) + simple_contacts)
                    .max(points * (1 + near_voxels + simple_contacts)),
            ),
            proximity: ProximityCache::with_capacity(points),
            collider_proximity: ColliderProximity::with_capacity(scene.colliders.len(), points),
            bounds: ColliderBounds::new(scene),
        }
    }

    /// Position of the device's tip (the centre of a ball, the end of a bur) that matter allows.
    pub fn tip(&self) -> Vec3 {
        self.tip
    }

    pub fn contact(&self) -> Option<&Contact> {
        self.contact.as_ref()
    }

    /// Moves the tip to the hand and ends contact.
    pub fn reset_to(&mut self, hand_in_tooth: Vec3) {
        self.end_contact_at(hand_in_tooth);
        self.collider_proximity.forget();
    }

    fn end_contact_at(&mut self, hand_in_tooth: Vec3) {
        self.tip = hand_in_tooth;
        self.last_hand = hand_in_tooth;
        self.contact = None;
        self.stick = 1.0;
        self.proximity.invalidate();
    }

    /// Discards cached clearances after matter was added.
    pub fn invalidate(&mut self) {
        self.proximity.invalidate();
    }

    /// Returns true if the instrument is clear of matter in the given pose; `hand` is `tooth_from_handle`.
    pub fn is_free_at(scene: &CollisionScene, instrument: &Instrument, hand: &Pose) -> bool {
        if let Some(body) = instrument.body() {
            return is_body_free(scene, body, hand);
        }
        let (radius, place) = (instrument.radius(), hand.position);
        scene.clear_radius(place) > radius
            || instrument.sample_directions().iter().all(|&f| scene.volume.density_at(place + f * radius) < ISO)
                && scene.volume.density_at(place) < ISO
                && scene.colliders.iter().all(|collider| is_ball_outside(collider, instrument, place))
    }

    /// Moves the tip as near to the hand as matter and friction allow.
    ///
    /// The tip reaches a hand in free space exactly. Near matter it follows up to about 0.5 m/s without lag.
    pub fn follow(
        &mut self,
        scene: &CollisionScene,
        instrument: &Instrument,
        materials: &Materials,
        tooth_from_handle: &Pose,
    ) {
        let hand = tooth_from_handle.position;
        if self.contact.is_none() && self.is_path_clear(scene, instrument, tooth_from_handle) {
            self.end_contact_at(hand);
            self.last_orientation = tooth_from_handle.orientation;
            return;
        }
        let goal = self.goal_with_friction(hand);
        let active = match instrument.body() {
            None => self.slide_ball(scene, instrument, goal, hand),
            Some(body) => {
                let posed = body_contacts::PosedBody {
                    body,
                    tooth_from_handle: tooth_from_handle.orientation,
                    cuts: instrument.cuts,
                };
                self.slide_body(scene, posed, goal, hand)
            }
        };
        self.last_hand = hand;
        self.last_orientation = tooth_from_handle.orientation;
        let friction = goal - hand;
        if let Some(contact) =
            self.read_contact(scene, (materials, instrument.cuts && instrument.is_rotary), &active, friction)
        {
            self.contact = Some(contact);
        } else if self.tip.distance(hand) < ARRIVED {
            self.end_contact_at(hand);
        }
        // Otherwise nothing constrains the tip, but it has not caught up with the hand yet: the last contact stays
        // until it has.
    }

    /// Returns true if the straight way from tip to hand is certain to be clear of matter.
    fn is_path_clear(&mut self, scene: &CollisionScene, instrument: &Instrument, tooth_from_handle: &Pose) -> bool {
        let hand = tooth_from_handle.position;
        if let Some(body) = instrument.body() {
            let (middle, radius) = body.bounding_sphere();
            return self.bounds.is_clear(scene, *tooth_from_handle * middle, self.tip.distance(hand) + radius);
        }
        // A clear ball around one end that contains the other end contains the whole way.
        let needed = self.tip.distance(hand) + instrument.radius();
        self.bounds.is_clear(scene, hand, needed) || self.bounds.is_clear(scene, self.tip, needed)
    }

    /// Moves the ball toward the goal; returns the constraints active at the end (indices into `self.constraints`).
    fn slide_ball(&mut self, scene: &CollisionScene, instrument: &Instrument, goal: Vec3, hand: Vec3) -> ActiveSet {
        let mut active = ActiveSet::default();
        // Constraints appear one half band ahead; a longer move could pass through a surface undetected.
        let reach = (0.75 * scene.volume.half_band()).min(REACH);
        let limit = StepBall {
            centre: self.tip + (hand - self.last_hand),
            radius: MAX_STRETCH_STEP.max(hand.distance(self.last_hand)),
        };
        let is_limited = self.contact.is_some();
        let mut last_length = f32::INFINITY;
        for _ in 0..MOVES_MAX {
            ball_contacts::collect_constraints(
                &mut self.constraints,
                &mut self.bounds,
                scene,
                instrument,
                ball_contacts::ContactQuery { tip: self.tip, goal, reach },
            );
            let allowed;
            (allowed, active) = project_to_feasible(&self.constraints, goal);
            let displacement = allowed - self.tip;
            let length = displacement.length();
            let is_whole = length <= reach;
            let next = if is_whole { allowed } else { self.tip + displacement * (reach / length) };
            if is_limited && limit.excludes(next) {
                self.tip = limit.clip(self.tip, next);
                break;
            }
            self.tip = next;
            // In a hollow as narrow as the bur, noise of the surface moves the tip to and fro without getting any
            // closer.
            let is_restless = length > 0.7 * last_length;
            if is_whole && (active.is_empty() || length < ARRIVED || is_restless) {
                break;
            }
            last_length = if is_whole { length } else { f32::INFINITY };
        }
        active
    }

    /// Moves a body, which has rotated since the last tick, toward the goal.
    fn slide_body(
        &mut self,
        scene: &CollisionScene,
        posed: body_contacts::PosedBody,
        goal: Vec3,
        hand: Vec3,
    ) -> ActiveSet {
        let mut active = ActiveSet::default();
        let reach = (0.75 * scene.volume.half_band()).min(REACH);
        let travelled = hand.distance(self.last_hand);
        // A body that rotates into matter pushes its tip by up to the distance that the farthest point has swung.
        let (middle, radius) = posed.body.bounding_sphere();
        let swing = self.last_orientation.angle_between(posed.tooth_from_handle) * (middle.length() + radius);
        let (from, hand_motion, stretch) = (self.tip, hand - self.last_hand, self.tip.distance(self.last_hand));
        let pushed = MAX_STRETCH_STEP.max(0.5 * travelled).max(swing);
        let is_limited = self.contact.is_some();
        let mut last_length = f32::INFINITY;
        self.proximity.add_rotation(swing);
        for _ in 0..MOVES_MAX {
            let query = ball_contacts::ContactQuery { tip: self.tip, goal, reach };
            let proximity = body_contacts::ProximityState {
                volume: &mut self.proximity,
                colliders: &mut self.collider_proximity,
                bounds: &mut self.bounds,
            };
            body_contacts::collect_constraints(&mut self.constraints, proximity, scene, posed, query);
            let allowed;
            (allowed, active) = project_to_feasible(&self.constraints, goal);
            let displacement = allowed - self.tip;
            let length = displacement.length();
            let is_whole = length <= reach;
            let next = if is_whole { allowed } else { self.tip + displacement * (reach / length) };
            // A tip that is pushed away must move at once; one that is released may take its time.
            let max_stray = if next.distance(hand) < stretch { MAX_STRETCH_STEP } else { pushed };
            let limit = StepCapsule { from, motion: hand_motion, radius: max_stray };
            if is_limited && limit.excludes(next) {
                self.tip = limit.clip(self.tip, next);
                break;
            }
            self.tip = next;
            let is_restless = length > 0.7 * last_length;
            if is_whole && (active.is_empty() || length < BODY_ARRIVED || is_restless) {
                break;
            }
            last_length = if is_whole { length } else { f32::INFINITY };
        }
        active
    }

    /// Goal of the tip: the hand position, held back within the friction cone about the contact normal (Harwin &
    /// Melder 2002).
    fn goal_with_friction(&mut self, hand: Vec3) -> Vec3 {
        let Some(Contact { normal, material, .. }) = self.contact else { return hand };
        let stretch = self.tip - hand;
        let depth = stretch.dot(normal).max(0.0);
        let aside = stretch - normal * stretch.dot(normal);
        let dragged = aside.length();
        let coefficient =
            material.dynamic_friction + (material.static_friction - material.dynamic_friction) * self.stick;
        let holds = coefficient * depth;
        if dragged <= holds {
            self.stick += (1.0 - self.stick) / SLIP_TICKS;
            return hand + aside;
        }
        self.stick -= self.stick / SLIP_TICKS;
        hand + aside * (holds / dragged)
    }

    /// Computes the contact of an instrument, a rotating bur or another one, from the active constraints. `friction` is the
    /// displacement of the goal from the hand, mm.
    fn read_contact(
        &self,
        scene: &CollisionScene,
        (materials, is_bur): (&Materials, bool),
        active: &ActiveSet,
        friction: Vec3,
    ) -> Option<Contact> {
        if active.is_empty() {
            return None;
        }
        let mut blend = MaterialMean::empty();
        let mut push = Vec3::ZERO;
        let (mut by_head, mut by_all) = (0.0, 0.0);
        let (mut most, mut label) = (0.0, Label::AIR);
        for (index, share) in active.iter() {
            let constraint = &self.constraints[index];
            push += constraint.normal * share;
            by_all += share;
            by_head += if constraint.region == BodyRegion::Head { share } else { 0.0 };
            let touched = match constraint.source {
                ConstraintSource::Collider(shape) => {
                    let collider = &scene.colliders[shape];
                    match &collider.geometry {
                        ColliderGeometry::Voxels(volume) => {
                            let own = OwnSpace::of(collider).of_tooth(*constraint);
                            let tissue = mix_tissues(&mut blend, volume, materials, &own, share);
                            // What a bur bears on is not its tissue but a tooth that must not be cut.
                            if is_bur { collider.label } else { tissue }
                        }
                        _ => {
                            blend.add(*materials.get(collider.label), share);
                            collider.label
                        }
                    }
                }
                ConstraintSource::Volume => mix_tissues(&mut blend, &scene.volume, materials, constraint, share),
            };
            if share > most {
                (most, label) = (share, touched);
            }
        }
        let normal = push.try_normalize()?;
        let material = blend.mean().or_else(|| self.contact.map(|c| c.material))?;
        let new_arm = self.moment_arm(active, friction);
        let moment_arm = self.contact.map_or(new_arm, |before| before.moment_arm.lerp(new_arm, MOMENT_ARM_SMOOTHING));
        let head_share = if by_head < by_all { by_head / by_all } else { 1.0 };
        Some(Contact { label, material, normal, moment_arm, head_share })
    }

    /// Torque about the tip per newton of contact force, mm: every constraint pushes at its contact point, and
    /// friction acts there too.
    fn moment_arm(&self, active: &ActiveSet, friction: Vec3) -> Vec3 {
        let (mut push, mut turning) = (Vec3::ZERO, Vec3::ZERO);
        let (mut middle, mut weight) = (Vec3::ZERO, 0.0);
        for (index, share) in active.iter() {
            let at = self.push_centre(&self.constraints[index]) - self.tip;
            let part = self.constraints[index].normal * share;
            push += part;
            turning += at.cross(part);
            middle += at * share;
            weight += share;
        }
        let whole = (push + friction).length();
        if whole < ARRIVED || weight <= 0.0 {
            return Vec3::ZERO;
        }
        (turning + (middle / weight).cross(friction)) / whole
    }

    /// Point at which the force of a constraint acts: a flat end rests on all contacts that are equally near and face
    /// alike, not on a single one.
    fn push_centre(&self, constraint: &Constraint) -> Vec3 {
        if !self.proximity.is_active() {
            return constraint.point;
        }
        let (mut sum, mut weight) = (Vec3::ZERO, 0.0);
        for other in &self.constraints {
            let alike = (other.normal.dot(constraint.normal) - SAME_NORMAL_COSINE) / (1.0 - SAME_NORMAL_COSINE);
            let gap = other.normal.dot(self.tip) - other.offset;
            let near = 1.0 - gap.abs() / SHARED_LOAD_GAP;
            if alike > 0.0 && near > 0.0 {
                sum += other.point * (alike * near);
                weight += alike * near;
            }
        }
        if weight > 0.0 { sum / weight } else { constraint.point }
    }
}

/// Ball that the tip may not leave within one tick, around the position it would have if it had moved exactly like
/// the hand.
#[derive(Clone, Copy)]
struct StepBall {
    centre: Vec3,
    radius: f32,
}

impl StepBall {
    fn excludes(&self, place: Vec3) -> bool {
        place.distance_squared(self.centre) > self.radius * self.radius
    }

    /// Last point inside the ball on the way from a point inside to a point outside.
    fn clip(&self, from: Vec3, to: Vec3) -> Vec3 {
        let (path, out) = (to - from, from - self.centre);
        let (a, b, c) = (path.length_squared(), path.dot(out), out.length_squared() - self.radius * self.radius);
        let root = (b * b - a * c).max(0.0).sqrt();
        from + path * ((root - b) / a.max(1e-12)).clamp(0.0, 1.0)
    }
}

/// Capsule that the tip of a body may not leave within one tick, from its position to the one it would have if it had
/// moved exactly like the hand. The radius is at least half of the hand's motion, as required by the steepest slope.
#[derive(Clone, Copy)]
struct StepCapsule {
    from: Vec3,
    motion: Vec3,
    radius: f32,
}

impl StepCapsule {
    fn excludes(&self, place: Vec3) -> bool {
        let out = place - self.from;
        let share = (out.dot(self.motion) / self.motion.length_squared().max(1e-12)).clamp(0.0, 1.0);
        out.distance_squared(self.motion * share) > self.radius * self.radius
    }

    /// Last point inside the capsule on the way from a point inside to a point outside, to a thousandth of that way.
    fn clip(&self, from: Vec3, to: Vec3) -> Vec3 {
        let (mut within, mut beyond) = (0.0, 1.0);
        for _ in 0..10 {
            let share = 0.5 * (within + beyond);
            if self.excludes(from.lerp(to, share)) {
                beyond = share;
            } else {
                within = share;
            }
        }
        from.lerp(to, within)
    }
}

fn is_body_free(scene: &CollisionScene, body: &Body, hand: &Pose) -> bool {
    let (middle, radius) = body.bounding_sphere();
    scene.clear_radius(*hand * middle) > radius
        || body.surface_points().iter().all(|node| scene.volume.density_at(*hand * node.position) < ISO)
            && scene.colliders.iter().all(|collider| is_body_outside(collider, body, hand))
}

/// Returns true if a ball is outside a collider.
fn is_ball_outside(collider: &Collider, instrument: &Instrument, place: Vec3) -> bool {
    let radius = instrument.radius();
    // The distance of voxels is only a lower bound of the true one.
    collider.distance(place) > radius
        || matches!(collider.geometry, ColliderGeometry::Voxels(_))
            && std::iter::once(&Vec3::ZERO)
                .chain(instrument.sample_directions())
                .all(|&outward| collider.distance(place + outward * radius) > 0.0)
}

/// Returns true if all surface points of a body are outside a collider.
fn is_body_outside(collider: &Collider, body: &Body, hand: &Pose) -> bool {
    let is_ball_outside =
        |centre: Vec3, radius: f32| collider.distance(*hand * centre) > collider.steepness() * radius + ROUNDING;
    let (middle, radius) = body.bounding_sphere();
    let are_outside = |points: &[BodySurfacePoint]| points.iter().all(|p| collider.distance(*hand * p.position) > 0.0);
    is_ball_outside(middle, radius)
        || body.chunks().iter().all(|chunk| {
            is_ball_outside(chunk.centre, chunk.radius) || are_outside(&body.surface_points()[chunk.points.clone()])
        })
}

/// Adds the tissues around a contact to the mean; returns the one with the greatest weight.
fn mix_tissues(
    blend: &mut MaterialMean,
    volume: &Volume,
    materials: &Materials,
    constraint: &Constraint,
    share: f32,
) -> Label {
    let under = constraint.point - constraint.normal * MIX_RADIUS;
    let side = constraint.normal.any_orthonormal_vector();
    let across = constraint.normal.cross(side);
    let mut main = Label::AIR;
    let mut heaviest = 0.0;
    for (offset, part) in [(Vec3::ZERO, 2.0), (side, 1.0), (-side, 1.0), (across, 1.0), (-across, 1.0)] {
        for (label, weight) in tissue_weights(volume, under + offset * MIX_RADIUS) {
            if label != Label::AIR {
                blend.add(*materials.get(label), share * part * weight);
                if part * weight > heaviest {
                    (heaviest, main) = (part * weight, label);
                }
            }
        }
    }
    main
}

/// The eight labels around a point with their trilinear weights.
fn tissue_weights(volume: &Volume, point_in_tooth: Vec3) -> [(Label, f32); 8] {
    let grid = volume.grid();
    let at = grid.from_tooth(point_in_tooth);
    let [nx, ny, nz] = grid.dims;
    let is_inside =
        at.cmpge(Vec3::ZERO).all() && at.x < (nx - 1) as f32 && at.y < (ny - 1) as f32 && at.z < (nz - 1) as f32;
    if !is_inside {
        return [(Label::AIR, 0.0); 8];
    }
    let [x, y, z] = [at.x as u32, at.y as u32, at.z as u32];
    let f = at - Vec3::new(x as f32, y as f32, z as f32);
    let corner = grid.index([x, y, z]);
    let (row, slice) = (nx as usize, nx as usize * ny as usize);
    let share = |t: f32, far: usize| if far == 1 { t } else { 1.0 - t };
    std::array::from_fn(|c| {
        let [i, j, k] = [c & 1, c >> 1 & 1, c >> 2];
        let label = volume.labels()[corner + i + j * row + k * slice];
        (label, share(f.x, i) * share(f.y, j) * share(f.z, k))
    })
}
