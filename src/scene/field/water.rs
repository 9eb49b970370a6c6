//! The handpiece's water: droplets on their way to the bur, splashes, and the film and pools they leave.

use super::chance::Chance;
use super::dust::Dust;
use super::ground::{Ground, Way};
use super::suction::Suction;
use super::{Bur, MOUTH, STEP, slowed};
use crate::frame::Vec3;
use crate::render::{Finish, Speck};
use std::collections::VecDeque;
use std::f32::consts::TAU;

/// Droplets in the air, and patches of water on surfaces, at most.
const FLYING_MOST: usize = 500;
const LYING_MOST: usize = 320;

/// Both together.
pub const MOST: usize = FLYING_MOST + LYING_MOST;

/// Droplets that leave the handpiece in one step of 4 ms. They stand for its 50 ml a minute (ISO 14457), most of which is
/// finer than can be drawn.
const EACH_STEP: usize = 8;

/// Ports in the handpiece's head, and their distance from the shaft, mm.
const PORTS: usize = 3;
const PORT_RADIUS: f32 = 3.4;

/// How fast it leaves, mm/s: so that an eye sees jets. True ones go some metres a second.
const LEAVING: f32 = 330.0;

/// How far jets widen: sideways by this share of their way.
const WIDENS: f32 = 0.10;

/// Radii of droplets, mm, and water that one of them leaves where it falls, mm³.
const RADII: [f32; 2] = [0.06, 0.14];
const LEFT: f32 = 0.004;

/// One of so many is a puff of mist: it grows by so much, mm/s, and is gone after so long, s.
const MIST_EACH: u32 = 3;
const MIST_GROWS: f32 = 4.5;
const MIST_LASTS: f32 = 0.16;

/// Time in which a droplet takes on the air's velocity, s: of 100 µm.
const AIR_TIME: f32 = 0.031;

/// Share of droplets that splash, what is left of their velocity, and how long splashes last, s.
const SPLASHES: f32 = 0.4;
const SPLASH_SPEED: f32 = 0.4;
const SPLASH_LASTS: f32 = 0.3;

/// Water runs down a wall at this speed, mm/s. A film of a tenth of a millimetre would run three times as fast, but enamel
/// holds it.
const RUNS: f32 = 12.0;

/// Slope (sine) on which a patch stays as a film.
const HOLDS: f32 = 0.35;

/// Most that clings to a place that walls do not close in, mm³; more drips off. And from which on it is a level pool.
const CLINGS: f32 = 0.10;
const HEAVY: f32 = 0.4;

/// A drop of volume V spreads to a radius of the cube root of 4 V, as one that meets its surface at 25° does, and is so high.
const SPREADS: f32 = 4.0;
const HEIGHT: f32 = 0.22;

/// Greatest volume of one pool, mm³: a cavity's. More overflows.
const POOL_MOST: f32 = 7.0;

/// Share of a film that dries in a second.
const DRIES: f32 = 0.03;
/// Less than this is dry, mm³.
const DRY: f32 = 0.0015;

/// Air that draws lying water along, mm/s: it is gone in about a second there, sooner nearer to the mouth.
const DRAWS: f32 = 400.0;

/// One in so many patches is moved in each step, for as many steps at once.
const EACH_TURN: usize = 4;
const LONG_STEP: f32 = EACH_TURN as f32 * STEP;

/// A patch sits so far over its surface, mm, and finds it within this reach up and down.
const OVER: f32 = 0.05;
const REACH: f32 = 0.5;

const WATER: Finish = Finish { colour: [0.80, 0.89, 0.95], gloss: 0.7 };
const MIST: Finish = Finish { colour: [0.93, 0.96, 0.98], gloss: 0.0 };

pub struct Water {
    flying: VecDeque<Droplet>,
    lying: VecDeque<Patch>,
    /// Steps so far.
    turn: usize,
    /// Droplets that have left so far: decides from which port, and what becomes of them.
    count: u32,
}

#[derive(Clone, Copy)]
struct Droplet {
    /// World space, mm.
    place: Vec3,
    /// mm/s
    velocity: Vec3,
    radius: f32,
    kind: Kind,
    /// s
    age: f32,
}

#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Jet,
    Mist,
    Splash,
}

/// Water on a surface.
#[derive(Clone, Copy)]
struct Patch {
    place: Vec3,
    /// The surface's normal.
    out: Vec3,
    /// mm³
    volume: f32,
}

impl Patch {
    fn radius(&self) -> f32 {
        libm::cbrtf(SPREADS * self.volume)
    }

    /// 0 for a film, which clings, 1 for a pool, which is level.
    fn is_pool(&self) -> f32 {
        ((self.volume - CLINGS) / (HEAVY - CLINGS)).clamp(0.0, 1.0)
    }
}

impl Water {
    pub fn new() -> Water {
        Water {
            flying: VecDeque::with_capacity(FLYING_MOST),
            lying: VecDeque::with_capacity(LYING_MOST),
            turn: 0,
            count: 0,
        }
    }

    /// One step's droplets leave the handpiece toward the bur.
    pub fn spray(&mut self, bur: &Bur, chance: &mut Chance) {
        let axis = bur.world_from_tip.turn(Vec3::Z);
        let (aside, across) = axis.any_orthonormal_pair();
        let tip = bur.world_from_tip.position;
        for _ in 0..EACH_STEP {
            self.count = self.count.wrapping_add(1);
            let angle = TAU * (self.count % PORTS as u32) as f32 / PORTS as f32;
            let port = tip + axis * bur.height + (aside * libm::cosf(angle) + across * libm::sinf(angle)) * PORT_RADIUS;
            let way = (tip - port).normalize_or(-axis) + chance.anywhere() * WIDENS;
            let kind = if self.count.is_multiple_of(MIST_EACH) { Kind::Mist } else { Kind::Jet };
            let velocity = way * (LEAVING * chance.between(0.8, 1.2));
            // They leave all through the step, not in waves.
            let place = port + velocity * (STEP * chance.unit());
            let radius = chance.between(RADII[0], RADII[1]);
            put(&mut self.flying, FLYING_MOST, Droplet { place, velocity, radius, kind, age: 0.0 });
        }
    }

    /// One step of all that flies. What falls washes dust away, splashes, and leaves water.
    pub fn fly(&mut self, ground: &Ground, suction: Option<&Suction>, dust: &mut Dust, chance: &mut Chance) {
        let Water { flying, lying, .. } = self;
        flying.retain_mut(|drop| {
            drop.age += STEP;
            let lasts = match drop.kind {
                Kind::Jet => f32::INFINITY,
                Kind::Mist => MIST_LASTS,
                Kind::Splash => SPLASH_LASTS,
            };
            let air = suction.map_or(Vec3::ZERO, |suction| suction.wind(drop.place));
            drop.velocity = slowed(drop.velocity, air, AIR_TIME);
            let goal = drop.place + drop.velocity * STEP;
            // A place that is none is outside, too.
            let is_inside = goal.length_squared() <= MOUTH * MOUTH;
            let is_gone =
                drop.age > lasts || !is_inside || suction.is_some_and(|suction| suction.swallows(drop.place, goal));
            if is_gone {
                return false;
            }
            match ground.way(drop.place, goal) {
                Way::Free => drop.place = goal,
                Way::Buried => return false,
                Way::Ends { .. } if drop.kind != Kind::Jet => return false,
                Way::Ends { place, out } => {
                    let bounced = drop.velocity - out * (2.0 * drop.velocity.dot(out));
                    drop.velocity = (bounced + chance.anywhere() * LEAVING * 0.5) * SPLASH_SPEED;
                    let reach = wet(lying, Patch { place, out, volume: LEFT });
                    dust.wash(place + out * OVER, drop.velocity, reach);
                    (drop.place, drop.kind, drop.age) = (place + out * OVER, Kind::Splash, 0.0);
                    drop.radius *= 0.6;
                    return chance.unit() < SPLASHES;
                }
            }
            true
        });
    }

    /// One step of what lies: it runs downhill, joins, dries, and is drawn off.
    pub fn run(&mut self, ground: &Ground, suction: Option<&Suction>) {
        self.turn = self.turn.wrapping_add(1);
        let mut place_in_turn = self.turn;
        self.lying.retain_mut(|patch| {
            place_in_turn = place_in_turn.wrapping_add(1);
            if patch.volume > 0.0 && !place_in_turn.is_multiple_of(EACH_TURN) {
                return true;
            }
            let air = suction.map_or(0.0, |suction| suction.wind(patch.place).length());
            let drawn = if air > DRAWS { air / DRAWS } else { 0.0 };
            patch.volume -= patch.volume * ((DRIES + drawn) * LONG_STEP).min(1.0);
            let most = if patch.volume < CLINGS || is_closed_in(patch, ground) { POOL_MOST } else { CLINGS };
            patch.volume = patch.volume.min(most);
            patch.volume > DRY && runs(patch, ground)
        });
        // Joining is seldom urgent.
        if !self.turn.is_multiple_of(EACH_TURN) {
            return;
        }
        for place in 0..self.lying.len() {
            let Patch { volume, place: here, .. } = self.lying[place];
            if volume == 0.0 {
                continue;
            }
            let reach = 0.5 * self.lying[place].radius();
            for other in place + 1..self.lying.len() {
                let near = self.lying[other];
                let within = reach.max(0.5 * near.radius());
                if near.volume > 0.0 && near.place.distance_squared(here) < within * within {
                    // The larger takes the smaller, and stays where it is.
                    let (gains, loses) =
                        if near.volume > self.lying[place].volume { (other, place) } else { (place, other) };
                    self.lying[gains].volume += self.lying[loses].volume;
                    self.lying[loses].volume = 0.0;
                    if loses == place {
                        break;
                    }
                }
            }
        }
    }

    pub fn specks(&self) -> impl Iterator<Item = Speck> + '_ {
        /// Of a droplet, a puff, a film and a pool.
        const OPACITY: [f32; 4] = [0.70, 0.17, 0.12, 0.22];
        let flying = self.flying.iter().map(|drop| {
            let fading = (1.0 - drop.age / MIST_LASTS).max(0.0);
            let (radius, finish, opacity) = match drop.kind {
                Kind::Mist => (0.2 + MIST_GROWS * drop.age, MIST, OPACITY[1] * fading),
                _ => (drop.radius, WATER, OPACITY[0]),
            };
            Speck { place: drop.place, radius, facing: None, finish, opacity }
        });
        let lying = self.lying.iter().filter(|patch| patch.volume > 0.0).map(|patch| {
            let pool = patch.is_pool();
            let facing = patch.out.lerp(Vec3::Y, pool).normalize_or(Vec3::Y);
            let place = patch.place + facing * (OVER + HEIGHT * patch.radius() * pool);
            let opacity = OPACITY[2] + (OPACITY[3] - OPACITY[2]) * pool;
            Speck { place, radius: patch.radius(), facing: Some(facing), finish: WATER, opacity }
        });
        flying.chain(lying)
    }

    /// All the water that lies, mm³.
    #[cfg(test)]
    pub fn lying_mm3(&self) -> f32 {
        self.lying.iter().map(|patch| patch.volume).sum()
    }
}

/// Puts one more into a pool; the oldest gives way.
fn put<T>(pool: &mut VecDeque<T>, most: usize, one: T) {
    if pool.len() == most {
        pool.pop_front();
    }
    pool.push_back(one);
}

/// Water comes down: to a patch that is there, or as a new one. Gives that patch's radius, mm.
fn wet(lying: &mut VecDeque<Patch>, new: Patch) -> f32 {
    let there = |patch: &&mut Patch| {
        let reach = 0.7 * patch.radius();
        patch.volume > 0.0 && patch.place.distance_squared(new.place) < reach * reach
    };
    match lying.iter_mut().find(there) {
        Some(patch) => {
            patch.volume += new.volume;
            patch.radius()
        }
        None => {
            put(lying, LYING_MOST, new);
            new.radius()
        }
    }
}

/// True where walls stand around a patch, or the ground goes on under it, on all four sides.
fn is_closed_in(patch: &Patch, ground: &Ground) -> bool {
    let radius = patch.radius();
    let middle = patch.place + patch.out * OVER + Vec3::Y * (HEIGHT * radius);
    [Vec3::X, Vec3::NEG_X, Vec3::Z, Vec3::NEG_Z].iter().all(|aside| {
        let rim = middle + *aside * radius;
        ground.is_closed(middle, rim) || ground.is_closed(rim, rim - Vec3::Y * radius)
    })
}

/// One step of a patch down its surface; false when it has come to an edge and dripped off.
fn runs(patch: &mut Patch, ground: &Ground) -> bool {
    let downhill = Vec3::NEG_Y + patch.out * patch.out.y;
    let slope = downhill.length();
    let pace = RUNS * (0.3 + patch.is_pool());
    let is_held = slope < HOLDS * (1.0 - patch.is_pool()) + 0.02;
    let goal = if is_held { patch.place } else { patch.place + downhill * (pace * LONG_STEP) };
    match ground.way(goal + patch.out * REACH, goal - patch.out * REACH) {
        Way::Ends { place, out } => {
            patch.place = place;
            // Voxels are rough; water is not.
            patch.out = patch.out.lerp(out, 0.3).normalize_or(out);
            true
        }
        // Another wall stands over it: the lowest place there is.
        Way::Buried => true,
        Way::Free => false,
    }
}
