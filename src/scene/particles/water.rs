//! The handpiece's water and the blood of an opened pulp: droplets, splashes, and the film and pools they leave, clouded by dust.

use super::collision::{CollisionWorld, Sweep};
use super::dust::Dust;
use super::mirror_drops::MirrorDrops;
use super::suction::Suction;
use super::xorshift::Xorshift32;
use super::{RunningBur, STEP, WATER_OFFSET, WORLD_RADIUS, apply_drag};
use std::collections::VecDeque;
use std::f32::consts::TAU;
use typodont_core::frame::Vec3;
use typodont_render::{Appearance, Particle};

/// Droplets in the air, and patches of water on surfaces, at most.
const MAX_FLYING: usize = 500;
const MAX_LYING: usize = 320;

/// Both together.
pub const MAX_PARTICLES: usize = MAX_FLYING + MAX_LYING;

/// Droplets that leave the handpiece in one step of 4 ms. They stand for its 50 ml a minute (ISO 14457), most of which is
/// finer than can be drawn.
const DROPLETS_PER_STEP: usize = 8;

/// Ports in the handpiece's head, and their distance from the shaft, mm.
const PORTS: usize = 3;
const PORT_RADIUS: f32 = 3.4;

/// Speed of the spray, mm/s: slow enough for jets to be visible. Real jets move at some metres per second.
const SPRAY_SPEED: f32 = 330.0;

/// Widening of the jets: sideways, as a share of the distance travelled.
const SPREAD_SHARE: f32 = 0.10;

/// Radii of droplets, mm, and water that one of them leaves where it falls, mm³.
const RADII: [f32; 2] = [0.06, 0.14];
const DEPOSIT_VOLUME: f32 = 0.004;
/// The same of a splash or a puff of mist on a mirror, mm³.
const FINE_VOLUME: f32 = 0.0005;

/// One droplet in so many is a puff of mist; growth of its radius, mm/s; and its lifetime, s.
const MIST_INTERVAL: u32 = 3;
const MIST_GROWTH: f32 = 4.5;
const MIST_LIFETIME: f32 = 0.16;

/// Time in which a droplet takes on the air's velocity, s: of 100 µm.
const AIR_TIME: f32 = 0.031;

/// Share of droplets that splash, share of the velocity that splashes keep, and their lifetime, s.
const SPLASH_SHARE: f32 = 0.4;
const SPLASH_SPEED: f32 = 0.4;
const SPLASH_LIFETIME: f32 = 0.3;

/// Water runs down a wall at this speed, mm/s. A film of a tenth of a millimetre would run three times as fast, but enamel
/// holds it.
const FLOW_SPEED: f32 = 12.0;

/// Slope (sine) on which a patch stays as a film.
const FILM_SLOPE: f32 = 0.35;

/// Most that clings to a place that walls do not close in, mm³; more drips off. And from which on it is a level pool.
const MAX_FILM_VOLUME: f32 = 0.10;
const POOL_VOLUME: f32 = 0.4;

/// A drop of volume V spreads to a radius of the cube root of 4 V, as one that meets its surface at 25° does, and is so high.
const SPREAD_FACTOR: f32 = 4.0;
const HEIGHT_SHARE: f32 = 0.22;

/// Greatest volume of one pool, mm³: a cavity's. More overflows.
const MAX_POOL_VOLUME: f32 = 7.0;

/// Share of a film that dries in a second.
const DRYING_RATE: f32 = 0.03;
/// Less than this is dry, mm³.
const DRY_VOLUME: f32 = 0.0015;

/// Air speed that draws water along a surface, mm/s: such water is removed in about a second, sooner nearer to the
/// inlet.
const SUCTION_AIR_SPEED: f32 = 400.0;

/// In each step, one patch in so many is moved, by as many steps at once.
const UPDATE_INTERVAL: usize = 4;
const LONG_STEP: f32 = UPDATE_INTERVAL as f32 * STEP;

/// A patch finds its surface within this reach up and down, mm.
const SURFACE_SEARCH: f32 = 0.5;

/// Share of blood from which a patch clots instead of drying.
const CLOTTING_SHARE: f32 = 0.5;

/// Most dust that water holds, as a share.
const MAX_DUST_SHARE: f32 = 0.6;

/// Speed at which drops of blood leave an opening, mm/s: they well up.
const BLEEDING_SPEED: f32 = 12.0;

const WATER: Appearance = Appearance { colour: [0.80, 0.89, 0.95], gloss: 0.7 };
const BLOOD: Appearance = Appearance { colour: [0.55, 0.015, 0.015], gloss: 0.2 };
/// Wet powder of enamel and dentine.
const SLURRY: Appearance = Appearance { colour: [0.88, 0.84, 0.74], gloss: 0.2 };
const MIST: Appearance = Appearance { colour: [0.93, 0.96, 0.98], gloss: 0.0 };

pub struct Water {
    flying: VecDeque<Droplet>,
    lying: VecDeque<WaterPatch>,
    /// Steps so far.
    step_count: usize,
    /// Droplets that have left so far; determines the port and the kind of the next one.
    droplet_count: u32,
}

#[derive(Clone, Copy)]
struct Droplet {
    /// World space, mm.
    place: Vec3,
    /// mm/s
    velocity: Vec3,
    radius: f32,
    kind: DropletKind,
    /// Share of blood in it.
    blood: f32,
    /// s
    age: f32,
}

#[derive(Clone, Copy, PartialEq)]
enum DropletKind {
    Jet,
    Mist,
    Splash,
}

/// Water on a surface.
#[derive(Clone, Copy)]
struct WaterPatch {
    place: Vec3,
    /// The surface's normal.
    normal: Vec3,
    /// mm³
    volume: f32,
    /// Share of blood in it.
    blood: f32,
    /// Share of dust in it: with much of it, it is slurry.
    dust: f32,
    /// True once it has come to rest.
    is_held: bool,
}

impl WaterPatch {
    fn radius(&self) -> f32 {
        libm::cbrtf(SPREAD_FACTOR * self.volume)
    }

    /// Takes up other water.
    fn add(&mut self, other: &WaterPatch) {
        let volume = self.volume + other.volume;
        let mean = |own: f32, others: f32| (own * self.volume + others * other.volume) / volume.max(1e-9);
        (self.blood, self.dust) = (mean(self.blood, other.blood), mean(self.dust, other.dust));
        self.volume = volume;
    }

    /// Takes up dust, mm³.
    fn cloud(&mut self, dust: f32) {
        self.dust = (self.dust + dust / self.volume.max(1e-9)).min(MAX_DUST_SHARE);
    }

    /// 0 for a film, which clings, 1 for a pool, which is level.
    fn pool_share(&self) -> f32 {
        ((self.volume - MAX_FILM_VOLUME) / (POOL_VOLUME - MAX_FILM_VOLUME)).clamp(0.0, 1.0)
    }
}

impl Water {
    pub fn new() -> Water {
        Water {
            flying: VecDeque::with_capacity(MAX_FLYING),
            lying: VecDeque::with_capacity(MAX_LYING),
            step_count: 0,
            droplet_count: 0,
        }
    }

    /// One step's droplets leave the handpiece toward the bur.
    pub fn spray(&mut self, bur: &RunningBur, rng: &mut Xorshift32) {
        let axis = bur.world_from_tip.rotate(Vec3::Z);
        let (aside, across) = axis.any_orthonormal_pair();
        let tip = bur.world_from_tip.position;
        for _ in 0..DROPLETS_PER_STEP {
            self.droplet_count = self.droplet_count.wrapping_add(1);
            let angle = TAU * (self.droplet_count % PORTS as u32) as f32 / PORTS as f32;
            let port = tip + axis * bur.height + (aside * libm::cosf(angle) + across * libm::sinf(angle)) * PORT_RADIUS;
            let direction = (tip - port).normalize_or(-axis) + rng.in_cube() * SPREAD_SHARE;
            let kind =
                if self.droplet_count.is_multiple_of(MIST_INTERVAL) { DropletKind::Mist } else { DropletKind::Jet };
            let velocity = direction * (SPRAY_SPEED * rng.in_range(0.8, 1.2));
            // They leave all through the step, not in waves.
            let place = port + velocity * (STEP * rng.next_f32());
            let radius = rng.in_range(RADII[0], RADII[1]);
            push_bounded(&mut self.flying, MAX_FLYING, Droplet { place, velocity, radius, kind, blood: 0.0, age: 0.0 });
        }
    }

    /// A drop of blood that leaves an opening.
    pub fn bleed(&mut self, place: Vec3, rng: &mut Xorshift32) {
        let (velocity, radius) = (rng.in_cube() * BLEEDING_SPEED, rng.in_range(RADII[0], RADII[1]));
        let drop = Droplet { place, velocity, radius, kind: DropletKind::Jet, blood: 1.0, age: 0.0 };
        push_bounded(&mut self.flying, MAX_FLYING, drop);
    }

    /// Water that leaves a syringe in one step, toward a place.
    pub fn jet(&mut self, nozzle: Vec3, aim: Vec3, rng: &mut Xorshift32) {
        /// Droplets in a step, and their speed, mm/s, and spread: water and air together make a spray.
        const DROPLETS: usize = 12;
        const SPEED: f32 = 600.0;
        const SPREAD: f32 = 0.3;
        let toward = (aim - nozzle).normalize_or(Vec3::NEG_Y);
        for _ in 0..DROPLETS {
            let velocity = (toward + rng.in_cube() * SPREAD) * (SPEED * rng.in_range(0.8, 1.2));
            let place = nozzle + velocity * (STEP * rng.next_f32());
            let radius = rng.in_range(RADII[0], RADII[1]);
            let drop = Droplet { place, velocity, radius, kind: DropletKind::Jet, blood: 0.0, age: 0.0 };
            push_bounded(&mut self.flying, MAX_FLYING, drop);
        }
    }

    /// One step of all flying droplets. Droplets that land wash dust away, splash, and leave water; those that meet a mirror stay there.
    pub fn step_flying(
        &mut self,
        world: &CollisionWorld,
        suction: Option<&Suction>,
        (dust, mirror): (&mut Dust, &mut MirrorDrops),
        rng: &mut Xorshift32,
    ) {
        let Water { flying, lying, .. } = self;
        flying.retain_mut(|drop| {
            drop.age += STEP;
            let lifetime = match drop.kind {
                DropletKind::Jet => f32::INFINITY,
                DropletKind::Mist => MIST_LIFETIME,
                DropletKind::Splash => SPLASH_LIFETIME,
            };
            let air = suction.map_or(Vec3::ZERO, |suction| suction.air_velocity(drop.place));
            drop.velocity = apply_drag(drop.velocity, air, AIR_TIME);
            let goal = drop.place + drop.velocity * STEP;
            // A position that is not a number counts as outside, too.
            let is_inside = goal.length_squared() <= WORLD_RADIUS * WORLD_RADIUS;
            let is_gone =
                drop.age > lifetime || !is_inside || suction.is_some_and(|suction| suction.captures(drop.place, goal));
            if is_gone {
                return false;
            }
            let volume = if drop.kind == DropletKind::Jet { DEPOSIT_VOLUME } else { FINE_VOLUME };
            if drop.blood == 0.0 && mirror.catch(drop.place, goal, volume) {
                return false;
            }
            match world.sweep(drop.place, goal) {
                Sweep::Free => drop.place = goal,
                Sweep::Inside => return false,
                Sweep::Hit { .. } if drop.kind != DropletKind::Jet => return false,
                Sweep::Hit { place, normal: out } => {
                    let bounced = drop.velocity - out * (2.0 * drop.velocity.dot(out));
                    drop.velocity = (bounced + rng.in_cube() * SPRAY_SPEED * 0.5) * SPLASH_SPEED;
                    let (volume, blood) = (DEPOSIT_VOLUME, drop.blood);
                    let new = WaterPatch { place, normal: out, volume, blood, dust: 0.0, is_held: false };
                    let patch = add_water(lying, new);
                    patch.cloud(dust.wash(place + out * WATER_OFFSET, drop.velocity, patch.radius()));
                    (drop.place, drop.kind, drop.age) = (place + out * WATER_OFFSET, DropletKind::Splash, 0.0);
                    drop.radius *= 0.6;
                    // Blood wells up and does not splash.
                    return drop.blood == 0.0 && rng.next_f32() < SPLASH_SHARE;
                }
            }
            true
        });
    }

    /// One step of the water on surfaces: it flows downhill, joins, dries, and is drawn off.
    pub fn step_lying(&mut self, world: &CollisionWorld, suction: Option<&Suction>) {
        self.step_count = self.step_count.wrapping_add(1);
        let mut patch_number = self.step_count;
        self.lying.retain_mut(|patch| {
            patch_number = patch_number.wrapping_add(1);
            if patch.volume > 0.0 && !patch_number.is_multiple_of(UPDATE_INTERVAL) {
                return true;
            }
            let air = suction.map_or(0.0, |suction| suction.air_velocity(patch.place).length());
            let drawn = if air > SUCTION_AIR_SPEED { air / SUCTION_AIR_SPEED } else { 0.0 };
            let drying = if patch.blood > CLOTTING_SHARE { 0.0 } else { DRYING_RATE };
            patch.volume -= patch.volume * ((drying + drawn) * LONG_STEP).min(1.0);
            let most = if patch.volume < MAX_FILM_VOLUME || is_enclosed(patch, world) {
                MAX_POOL_VOLUME
            } else {
                MAX_FILM_VOLUME
            };
            patch.volume = patch.volume.min(most);
            patch.volume > DRY_VOLUME && flow(patch, world)
        });
        // Joining is seldom urgent.
        if !self.step_count.is_multiple_of(UPDATE_INTERVAL) {
            return;
        }
        for place in 0..self.lying.len() {
            let WaterPatch { volume, place: here, .. } = self.lying[place];
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
                    let taken = self.lying[loses];
                    self.lying[gains].add(&taken);
                    self.lying[loses].volume = 0.0;
                    if loses == place {
                        break;
                    }
                }
            }
        }
    }

    pub fn particles(&self) -> impl Iterator<Item = Particle> + '_ {
        /// Opacity of a puff of mist.
        const MIST_OPACITY: f32 = 0.17;
        let flying = self.flying.iter().map(|drop| {
            let (radius, (appearance, opacity)) = match drop.kind {
                DropletKind::Mist => {
                    let fading = (1.0 - drop.age / MIST_LIFETIME).max(0.0);
                    (0.2 + MIST_GROWTH * drop.age, (MIST, MIST_OPACITY * fading))
                }
                _ => (drop.radius, look_of([drop.blood, 0.0], [0.70, 0.95, 0.95])),
            };
            Particle { position: drop.place, radius, facing: None, appearance, opacity }
        });
        let lying = self.lying.iter().filter(|patch| patch.volume > 0.0).map(|patch| {
            let pool = patch.pool_share();
            let facing = patch.normal.lerp(Vec3::Y, pool).normalize_or(Vec3::Y);
            let position = patch.place + facing * (WATER_OFFSET + HEIGHT_SHARE * patch.radius() * pool);
            let opacities = [mix(0.12, 0.22, pool), mix(0.8, 0.97, pool), mix(0.6, 0.9, pool)];
            let (appearance, opacity) = look_of([patch.blood, patch.dust], opacities);
            Particle { position, radius: patch.radius(), facing: Some(facing), appearance, opacity }
        });
        flying.chain(lying)
    }

    /// Number of droplets and patches that move or dry; blood that has come to rest does neither.
    pub fn moving_count(&self) -> usize {
        let clotted = |patch: &&WaterPatch| patch.is_held && patch.blood > CLOTTING_SHARE;
        self.flying.len() + self.lying.len() - self.lying.iter().filter(clotted).count()
    }

    /// All the blood that lies, mm³.
    #[cfg(test)]
    pub fn lying_blood_mm3(&self) -> f32 {
        self.lying.iter().map(|patch| patch.volume * patch.blood).sum()
    }

    /// All the dust in the water that lies, mm³.
    #[cfg(test)]
    pub fn lying_dust_mm3(&self) -> f32 {
        self.lying.iter().map(|patch| patch.volume * patch.dust).sum()
    }

    /// All the water that lies, mm³.
    #[cfg(test)]
    pub fn lying_mm3(&self) -> f32 {
        self.lying.iter().map(|patch| patch.volume).sum()
    }
}

/// Appearance and opacity of water with shares of blood and dust, given the opacities of water, of blood and of slurry. A little of
/// either colours much water.
fn look_of([blood, dust]: [f32; 2], [clear, red, cloudy]: [f32; 3]) -> (Appearance, f32) {
    let mixed = |(from, opacity): (Appearance, f32), (to, its_opacity): (Appearance, f32), share: f32| {
        let colour = std::array::from_fn(|c| mix(from.colour[c], to.colour[c], share));
        (Appearance { colour, gloss: mix(from.gloss, to.gloss, share) }, mix(opacity, its_opacity, share))
    };
    mixed(mixed((WATER, clear), (SLURRY, cloudy), dust.sqrt()), (BLOOD, red), blood.sqrt())
}

fn mix(a: f32, b: f32, share: f32) -> f32 {
    a + (b - a) * share
}

/// Adds an element to a bounded queue; if the queue is full, the oldest element is dropped.
fn push_bounded<T>(queue: &mut VecDeque<T>, most: usize, one: T) {
    if queue.len() == most {
        queue.pop_front();
    }
    queue.push_back(one);
}

/// Water comes down: to a patch that is there, or as a new one. Gives that patch.
fn add_water(lying: &mut VecDeque<WaterPatch>, new: WaterPatch) -> &mut WaterPatch {
    let is_near = |patch: &WaterPatch| {
        let reach = 0.7 * patch.radius();
        patch.volume > 0.0 && patch.place.distance_squared(new.place) < reach * reach
    };
    let place = match lying.iter().position(is_near) {
        Some(place) => {
            lying[place].add(&new);
            place
        }
        None => {
            push_bounded(lying, MAX_LYING, new);
            lying.len() - 1
        }
    };
    &mut lying[place]
}

/// True where walls stand around a patch, or the ground goes on under it, on all four sides.
fn is_enclosed(patch: &WaterPatch, world: &CollisionWorld) -> bool {
    let radius = patch.radius();
    let middle = patch.place + patch.normal * WATER_OFFSET + Vec3::Y * (HEIGHT_SHARE * radius);
    [Vec3::X, Vec3::NEG_X, Vec3::Z, Vec3::NEG_Z].iter().all(|aside| {
        let rim = middle + *aside * radius;
        world.is_blocked(middle, rim) || world.is_blocked(rim, rim - Vec3::Y * radius)
    })
}

/// One step of a patch down its surface; false when it has come to an edge and dripped off.
fn flow(patch: &mut WaterPatch, world: &CollisionWorld) -> bool {
    let downhill = Vec3::NEG_Y + patch.normal * patch.normal.y;
    let slope = downhill.length();
    let pace = FLOW_SPEED * (0.3 + patch.pool_share());
    patch.is_held = slope < FILM_SLOPE * (1.0 - patch.pool_share()) + 0.02;
    let goal = if patch.is_held { patch.place } else { patch.place + downhill * (pace * LONG_STEP) };
    match world.sweep(goal + patch.normal * SURFACE_SEARCH, goal - patch.normal * SURFACE_SEARCH) {
        Sweep::Hit { place, normal: out } => {
            patch.place = place;
            // Voxels are rough; water is not.
            patch.normal = patch.normal.lerp(out, 0.3).normalize_or(out);
            true
        }
        // Another wall is above the patch: this is the lowest place.
        Sweep::Inside => true,
        Sweep::Free => false,
    }
}
