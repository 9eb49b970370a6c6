//! The god object: an instrument's tip that follows the hand but never enters matter.
//!
//! Takes matter, an instrument and the hand's position. Gives the nearest allowed tip and what it touches there.
//! After Zilles & Salisbury (1995), for a volume: instead of polygons, each place where the working end's surface comes
//! near matter gives a wall, and the tip goes to the point nearest to the hand that the walls allow.

use super::body::{Body, Region};
use super::instrument::Instrument;
use super::material::{Blend, Material, Materials};
use super::matter::Matter;
use super::obstacle::MEETINGS_MAX;
use super::planes::{Held, Plane, Touched, nearest_allowed};
use super::shell::{self, Watch};
use super::walls;
use crate::frame::{Pose, Quat, Vec3};
use crate::volume::{ISO, Label, Volume};

/// Moves of the tip per tick. Two or three settle it; the rest let a fast hand be followed near matter.
const MOVES_MAX: usize = 10;

/// The tip has arrived when a move is shorter than this, mm: 2 mN on the stiffest wall. The next tick starts from there.
const ARRIVED: f32 = 2e-3;

/// Longest move between two looks at the walls, mm; shorter where the density ramp is narrower and shows them later.
const REACH: f32 = 0.12;

/// Most that the stretch between hand and tip may change within one tick unless the hand itself moved more, mm. Where an
/// edge lets go of a bur a massless tip would snap to its new place and the force with it; a real tool takes some ticks.
/// 0.02–0.05 is smooth without feeling sluggish.
const SNAP: f32 = 0.03;

/// Time in which the friction coefficient falls from sticking to sliding, as ticks of exponential decay. Real
/// stick–slip takes milliseconds; an instant fall would be a step in the force. 5–20 feels alike.
const SLIP_TICKS: f32 = 10.0;

/// Distance around a contact over which tissues are mixed, mm. About the contact width of an explorer's tip.
const MIX_RADIUS: f32 = 0.1;

/// A shell has arrived when a move is shorter than this, mm: over such a way its walls stay what they are, to a micrometre
/// at an edge of 0.05 mm.
const SETTLED: f32 = 0.01;

/// Walls that the end is nearer to than this carry it together, mm: the noise of voxel surfaces. At 0.005 torque trembles
/// with it, at 0.05 an end held aslant seems to rest on too much.
const RESTING: f32 = 0.02;

/// Walls face alike whose normals' cosine is above this (20°).
const ALIKE: f32 = 0.94;

/// Share by which the lever follows within one tick: the place where a flat end rests may jump, a torque should not.
/// 0.1–0.3 feels alike.
const LEVER_SHARE: f32 = 0.2;

/// What the tip touches, in tooth space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Tissue that carries most of the push.
    pub label: Label,
    /// Mean of the touched tissues' materials, weighted by what each carries.
    pub material: Material,
    /// Unit, from matter to the tip: the direction of the push without friction.
    pub normal: Vec3,
    /// Torque about the tip for each newton of pull, mm.
    pub lever: Vec3,
    /// Share of the push that the working end carries, not the shank behind it.
    pub at_head: f32,
}

/// An instrument's tip and its state of friction. Positions in tooth space, mm.
#[derive(Clone, Debug)]
pub struct Proxy {
    tip: Vec3,
    /// Where the hand was in the last tick.
    hand: Vec3,
    /// How it was turned then, `tooth_from_handle`.
    turned: Quat,
    contact: Option<Contact>,
    /// 1 while sticking, falling to 0 after sliding has begun.
    grip: f32,
    /// Scratch: walls found in this move.
    planes: Vec<Plane>,
    /// Scratch: what of a shell has matter near.
    watch: Watch,
}

impl Proxy {
    /// A free tip. `matter` and `instruments` are those it will meet: they tell how much scratch is needed.
    pub fn new(matter: &Matter, instruments: &[Instrument], tip: Vec3) -> Proxy {
        let feelers = instruments.iter().map(|i| i.feelers().len()).max().unwrap_or(1);
        let points = instruments.iter().filter_map(|i| i.body()).map(|b| b.shell().len()).max().unwrap_or(0);
        let shapes = matter.around.len() * MEETINGS_MAX;
        Proxy {
            tip,
            hand: tip,
            turned: Quat::IDENTITY,
            contact: None,
            grip: 1.0,
            planes: Vec::with_capacity((feelers + 1 + shapes).max(points * (1 + shapes))),
            watch: Watch::with_capacity(points),
        }
    }

    /// Where the device's tip (a ball's centre, a bur's end) may be.
    pub fn tip(&self) -> Vec3 {
        self.tip
    }

    pub fn contact(&self) -> Option<&Contact> {
        self.contact.as_ref()
    }

    /// Puts the tip at the hand, out of contact.
    pub fn let_go(&mut self, hand_in_tooth: Vec3) {
        self.tip = hand_in_tooth;
        self.hand = hand_in_tooth;
        self.contact = None;
        self.grip = 1.0;
        self.watch.forget();
    }

    /// Matter was laid where there was none: what was known to be clear is not any more.
    pub fn look_again(&mut self) {
        self.watch.forget();
    }

    /// True when the instrument could be held so without entering matter; `hand` is `tooth_from_handle`.
    pub fn is_free_at(matter: &Matter, instrument: &Instrument, hand: &Pose) -> bool {
        if let Some(body) = instrument.body() {
            return is_body_free(matter, body, hand);
        }
        let (radius, place) = (instrument.radius(), hand.position);
        matter.clear_radius(place) > radius
            || instrument.feelers().iter().all(|&f| matter.volume.density_at(place + f * radius) < ISO)
                && matter.volume.density_at(place) < ISO
                && matter.around.iter().all(|s| s.distance(place) > radius)
    }

    /// Moves the tip as near to the hand as matter and friction allow.
    ///
    /// A hand that is free is reached exactly. Near matter the tip follows up to about 0.5 m/s without lag.
    pub fn follow(&mut self, matter: &Matter, instrument: &Instrument, materials: &Materials, held: &Pose) {
        let hand = held.position;
        if self.contact.is_none() && is_free_way(matter, instrument, self.tip, held) {
            self.let_go(hand);
            self.turned = held.orientation;
            return;
        }
        let goal = self.goal_with_friction(hand);
        let walls = match instrument.body() {
            None => self.slide(matter, instrument, goal, hand),
            Some(body) => {
                let held = shell::Held { body, tooth_from_handle: held.orientation, cuts: instrument.cuts };
                self.slide_shell(matter, held, goal, hand)
            }
        };
        self.hand = hand;
        self.turned = held.orientation;
        let friction = goal - hand;
        if let Some(contact) = self.read_contact(matter, materials, &walls, friction) {
            self.contact = Some(contact);
        } else if self.tip.distance(hand) < ARRIVED {
            self.let_go(hand);
        }
        // Otherwise nothing holds the tip, but it still catches up with the hand: what it last touched fades out.
    }

    /// Slides toward the goal; returns the walls that hold the tip at last (indices into `self.planes`).
    fn slide(&mut self, matter: &Matter, instrument: &Instrument, goal: Vec3, hand: Vec3) -> Held {
        let mut held = Held::default();
        // Walls come into view one band away; a longer move could pass through one unseen.
        let reach = (0.75 * matter.volume.band()).min(REACH);
        let leash = Leash { centre: self.tip + (hand - self.hand), length: SNAP.max(hand.distance(self.hand)) };
        let on_leash = self.contact.is_some();
        let mut last_length = f32::INFINITY;
        for _ in 0..MOVES_MAX {
            walls::find(&mut self.planes, matter, instrument, walls::Look { tip: self.tip, goal, reach });
            let allowed;
            (allowed, held) = nearest_allowed(&self.planes, goal);
            let way = allowed - self.tip;
            let length = way.length();
            let is_whole = length <= reach;
            let next = if is_whole { allowed } else { self.tip + way * (reach / length) };
            if on_leash && leash.ends_before(next) {
                self.tip = leash.end(self.tip, next);
                break;
            }
            self.tip = next;
            // In a hollow as narrow as the bur the walls' noise sends the tip to and fro: better is not to be had.
            let is_restless = length > 0.7 * last_length;
            if is_whole && (held.is_empty() || length < ARRIVED || is_restless) {
                break;
            }
            last_length = if is_whole { length } else { f32::INFINITY };
        }
        held
    }

    /// The same for a working end of any shape, which has turned since the last tick.
    fn slide_shell(&mut self, matter: &Matter, held: shell::Held, goal: Vec3, hand: Vec3) -> Held {
        let mut holding = Held::default();
        let reach = (0.75 * matter.volume.band()).min(REACH);
        let travelled = hand.distance(self.hand);
        // Where the end turns into matter its tip is pushed as far as the farthest point has swung.
        let (middle, radius) = held.body.enclosing_ball();
        let swung = self.turned.angle_between(held.tooth_from_handle) * (middle.length() + radius);
        let (from, hands_way, stretch) = (self.tip, hand - self.hand, self.tip.distance(self.hand));
        let pushed = SNAP.max(0.5 * travelled).max(swung);
        let on_rein = self.contact.is_some();
        let mut last_length = f32::INFINITY;
        self.watch.swing(swung);
        for _ in 0..MOVES_MAX {
            let look = walls::Look { tip: self.tip, goal, reach };
            shell::find(&mut self.planes, &mut self.watch, matter, held, look);
            let allowed;
            (allowed, holding) = nearest_allowed(&self.planes, goal);
            let way = allowed - self.tip;
            let length = way.length();
            let is_whole = length <= reach;
            let next = if is_whole { allowed } else { self.tip + way * (reach / length) };
            // What matter pushes aside must get out of its way; what it lets go of has time.
            let slackness = if next.distance(hand) < stretch { SNAP } else { pushed };
            let rein = Rein { from, way: hands_way, length: slackness };
            if on_rein && rein.ends_before(next) {
                self.tip = rein.end(self.tip, next);
                break;
            }
            self.tip = next;
            let is_restless = length > 0.7 * last_length;
            if is_whole && (holding.is_empty() || length < SETTLED || is_restless) {
                break;
            }
            last_length = if is_whole { length } else { f32::INFINITY };
        }
        holding
    }

    /// Where the tip wants to go: toward the hand, but held back within the cone of friction about the contact's normal
    /// (Harwin & Melder 2002).
    fn goal_with_friction(&mut self, hand: Vec3) -> Vec3 {
        let Some(Contact { normal, material, .. }) = self.contact else { return hand };
        let pull = self.tip - hand;
        let depth = pull.dot(normal).max(0.0);
        let aside = pull - normal * pull.dot(normal);
        let dragged = aside.length();
        let coefficient =
            material.dynamic_friction + (material.static_friction - material.dynamic_friction) * self.grip;
        let holds = coefficient * depth;
        if dragged <= holds {
            self.grip += (1.0 - self.grip) / SLIP_TICKS;
            return hand + aside;
        }
        self.grip -= self.grip / SLIP_TICKS;
        hand + aside * (holds / dragged)
    }

    /// What holds the tip. `friction` is what it holds back of the hand's way, mm.
    fn read_contact(&self, matter: &Matter, materials: &Materials, held: &Held, friction: Vec3) -> Option<Contact> {
        if held.is_empty() {
            return None;
        }
        let mut blend = Blend::none();
        let mut push = Vec3::ZERO;
        let (mut by_head, mut by_all) = (0.0, 0.0);
        let (mut most, mut label) = (0.0, Label::AIR);
        for (index, share) in held.iter() {
            let plane = &self.planes[index];
            push += plane.normal * share;
            by_all += share;
            by_head += if plane.by == Region::Head { share } else { 0.0 };
            let touched = match plane.touched {
                Touched::Shape(shape) => {
                    let label = matter.around[shape].label;
                    blend.add(*materials.get(label), share);
                    label
                }
                Touched::Volume => mix_tissues(&mut blend, &matter.volume, materials, plane, share),
            };
            if share > most {
                (most, label) = (share, touched);
            }
        }
        let normal = push.try_normalize()?;
        let material = blend.mean().or_else(|| self.contact.map(|c| c.material))?;
        let lever = self.lever(held, friction);
        let lever = self.contact.map_or(lever, |before| before.lever.lerp(lever, LEVER_SHARE));
        let at_head = if by_head < by_all { by_head / by_all } else { 1.0 };
        Some(Contact { label, material, normal, lever, at_head })
    }

    /// Torque about the tip for each newton of pull, mm: every wall pushes where it is met, and friction drags there too.
    fn lever(&self, held: &Held, friction: Vec3) -> Vec3 {
        let (mut push, mut turning) = (Vec3::ZERO, Vec3::ZERO);
        let (mut middle, mut weight) = (Vec3::ZERO, 0.0);
        for (index, share) in held.iter() {
            let at = self.middle_of_push(&self.planes[index]) - self.tip;
            let part = self.planes[index].normal * share;
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

    /// Where a wall's push acts: a flat end rests on all walls that are as near and face alike, not on one of them.
    fn middle_of_push(&self, wall: &Plane) -> Vec3 {
        if !self.watch.is_looking() {
            return wall.at;
        }
        let (mut sum, mut weight) = (Vec3::ZERO, 0.0);
        for plane in &self.planes {
            let alike = (plane.normal.dot(wall.normal) - ALIKE) / (1.0 - ALIKE);
            let gap = plane.normal.dot(self.tip) - plane.offset;
            let near = 1.0 - gap.abs() / RESTING;
            if alike > 0.0 && near > 0.0 {
                sum += plane.at * (alike * near);
                weight += alike * near;
            }
        }
        if weight > 0.0 { sum / weight } else { wall.at }
    }
}

/// The ball that the tip may not leave within one tick: around where it would be had it moved exactly like the hand.
#[derive(Clone, Copy)]
struct Leash {
    centre: Vec3,
    length: f32,
}

impl Leash {
    fn ends_before(&self, place: Vec3) -> bool {
        place.distance_squared(self.centre) > self.length * self.length
    }

    /// The last place on the way from a place on the leash to one beyond it.
    fn end(&self, from: Vec3, to: Vec3) -> Vec3 {
        let (way, out) = (to - from, from - self.centre);
        let (a, b, c) = (way.length_squared(), way.dot(out), out.length_squared() - self.length * self.length);
        let root = (b * b - a * c).max(0.0).sqrt();
        from + way * ((root - b) / a.max(1e-12)).clamp(0.0, 1.0)
    }
}

/// How far the tip of a shell may stray within one tick from where it is and from where it would be had it moved exactly
/// like the hand. Half the hand's way is what the steepest slope asks of it.
#[derive(Clone, Copy)]
struct Rein {
    from: Vec3,
    way: Vec3,
    length: f32,
}

impl Rein {
    fn ends_before(&self, place: Vec3) -> bool {
        let out = place - self.from;
        let share = (out.dot(self.way) / self.way.length_squared().max(1e-12)).clamp(0.0, 1.0);
        out.distance_squared(self.way * share) > self.length * self.length
    }

    /// The last place within reach on the way from a place within it to one beyond, to a thousandth of that way.
    fn end(&self, from: Vec3, to: Vec3) -> Vec3 {
        let (mut within, mut beyond) = (0.0, 1.0);
        for _ in 0..10 {
            let share = 0.5 * (within + beyond);
            if self.ends_before(from.lerp(to, share)) {
                beyond = share;
            } else {
                within = share;
            }
        }
        from.lerp(to, within)
    }
}

/// True when the straight way from tip to hand surely meets no matter.
fn is_free_way(matter: &Matter, instrument: &Instrument, tip: Vec3, held: &Pose) -> bool {
    let hand = held.position;
    if let Some(body) = instrument.body() {
        let (middle, radius) = body.enclosing_ball();
        return tip.distance(hand) + radius < matter.clear_radius(*held * middle);
    }
    // A clear ball around either end that holds the other end holds the whole way.
    let needed = tip.distance(hand) + instrument.radius();
    needed < matter.clear_radius(hand) || needed < matter.clear_radius(tip)
}

fn is_body_free(matter: &Matter, body: &Body, hand: &Pose) -> bool {
    let (middle, radius) = body.enclosing_ball();
    matter.clear_radius(*hand * middle) > radius
        || body.shell().iter().all(|node| {
            let place = *hand * node.at;
            matter.volume.density_at(place) < ISO && matter.around.iter().all(|s| s.distance(place) > 0.0)
        })
}

/// Adds the tissues around a contact to the blend; returns the one right under it.
fn mix_tissues(blend: &mut Blend, volume: &Volume, materials: &Materials, plane: &Plane, share: f32) -> Label {
    let under = plane.at - plane.normal * MIX_RADIUS;
    let side = plane.normal.any_orthonormal_vector();
    let across = plane.normal.cross(side);
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
