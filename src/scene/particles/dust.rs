//! Chips of carved tissue: they leave the bur's rim, fall, and come to rest.

use super::collision::{CollisionWorld, Sweep};
use super::suction::Suction;
use super::xorshift::Xorshift32;
use super::{RunningBur, STEP, WORLD_RADIUS, apply_drag};
use std::collections::VecDeque;
use typodont_core::frame::Vec3;
use typodont_core::volume::{Edit, Grid, Label};
use typodont_render::{Appearance, LabelPalette, Particle, Rgb};

/// Most chips.
pub const MAX_CHIPS: usize = 2000;

/// Most chips that one frame adds; matter carved beyond that adds none.
const MAX_PENDING: usize = 96;

/// Matter for each chip that is drawn, mm³. True dust is a thousand times finer.
pub const CHIP_VOLUME: f32 = 0.004;

/// Radii of chips, mm.
const RADII: [f32; 2] = [0.045, 0.10];

/// Speed at which chips leave the rim, mm/s: slow enough for the eye to follow. The rim of a turbine's bur moves at
/// some 20 m/s.
const LAUNCH_SPEED: f32 = 420.0;

/// Shares of that speed: along the shaft, because a bur's flutes lift the chips, and in a random direction.
const LIFT: f32 = 0.55;
const SPREAD: f32 = 0.25;

/// Time in which a chip takes on the air's velocity, s: of dentine (2.1 g/cm³), 60 µm wide.
const AIR_TIME: f32 = 0.023;

/// Restitution: shares of the velocity along a surface and out of it that remain after a collision.
const TANGENTIAL_RESTITUTION: f32 = 0.5;
const NORMAL_RESTITUTION: f32 = 0.2;

/// Speed below which a chip stays after a collision, mm/s: every surface in a mouth is moist.
const STICK_SPEED: f32 = 110.0;

/// Height of a resting chip above its surface, mm; and the distance to matter below it beyond which it falls again, mm.
const SURFACE_OFFSET: f32 = 0.03;
const SUPPORT_DISTANCE: f32 = 0.25;

/// In each step, the support of one in so many resting chips is checked.
const UPDATE_INTERVAL: usize = 8;

/// Air speed that lifts a moist chip, mm/s.
const LIFTING_AIR_SPEED: f32 = 2500.0;

/// Distance from a running bur within which it throws resting chips, mm.
const DISTURB_DISTANCE: f32 = 0.2;

/// Shortest and longest time that wet chips rest before the water carries them away, s.
const WET_CHIP_TIME: [f32; 2] = [0.15, 0.9];

/// Radius around a falling drop within which it carries chips away, mm.
const WASH_RADIUS: f32 = 0.7;

/// Powder is paler than the tissue: share of white.
const WHITENING: f32 = 0.25;

pub struct Dust {
    chips: VecDeque<Chip>,
    /// Carved voxels that have not become chips yet.
    pending: Vec<PendingChip>,
    /// Carved volume below that of one chip, mm³.
    unspent_volume: f32,
    /// Steps so far.
    step_count: usize,
}

struct PendingChip {
    place_in_tooth: Vec3,
    label: Label,
}

#[derive(Clone, Copy)]
struct Chip {
    /// World space, mm.
    place: Vec3,
    /// mm/s
    velocity: Vec3,
    radius: f32,
    colour: Rgb,
    /// True for a chip bound by water, which carries it away after a while.
    is_wet: bool,
    /// True once water has taken up its powder.
    has_clouded: bool,
    /// Time that a wet chip still rests, s.
    wet_time_left: f32,
    /// Unit normal of the surface on which the chip rests; `None` while it flies.
    resting_normal: Option<Vec3>,
}

impl Dust {
    pub fn new() -> Dust {
        Dust {
            chips: VecDeque::with_capacity(MAX_CHIPS),
            pending: Vec::with_capacity(MAX_PENDING),
            unspent_volume: 0.0,
            step_count: 0,
        }
    }

    /// Records the removal of one voxel.
    pub fn add_carved(&mut self, edit: &Edit, grid: &Grid) {
        self.unspent_volume += grid.voxel_mm3() as f32;
        while self.unspent_volume >= CHIP_VOLUME && self.pending.len() < MAX_PENDING {
            self.unspent_volume -= CHIP_VOLUME;
            let place_in_tooth = grid.centre(grid.cell(edit.index as usize));
            self.pending.push(PendingChip { place_in_tooth, label: edit.before.label });
        }
        self.unspent_volume = self.unspent_volume.min(CHIP_VOLUME);
    }

    /// Launches chips of the pending matter from the bur. Without a running bur, as in a window that lags, the pending
    /// matter is dropped.
    pub fn emit(
        &mut self,
        bur: Option<&RunningBur>,
        is_wet: bool,
        world: &CollisionWorld,
        palette: &LabelPalette,
        rng: &mut Xorshift32,
    ) {
        let Dust { chips, pending, .. } = self;
        for PendingChip { place_in_tooth, label } in pending.drain(..) {
            // The bur may have moved on since, so a free place near the removed voxel is used.
            let Some(bur) = bur else { continue };
            let Some(at_rim) = world.nearest_free(world.world_from_tooth * place_in_tooth) else { continue };
            let velocity = launch_velocity(bur, at_rim, rng);
            let pale = rng.in_range(0.3, 1.0) * WHITENING;
            let colour = palette.appearance(label).colour.map(|c| c + (1.0 - c) * pale);
            if chips.len() == MAX_CHIPS {
                chips.pop_front();
            }
            chips.push_back(Chip {
                place: at_rim,
                velocity,
                radius: rng.in_range(RADII[0], RADII[1]),
                colour,
                is_wet,
                has_clouded: false,
                wet_time_left: rng.in_range(WET_CHIP_TIME[0], WET_CHIP_TIME[1]),
                resting_normal: None,
            });
        }
    }

    /// One step of all flying chips, and of chips that have lost their support.
    pub fn step(&mut self, world: &CollisionWorld, suction: Option<&Suction>) {
        self.step_count = self.step_count.wrapping_add(1);
        let mut chip_number = self.step_count;
        self.chips.retain_mut(|chip| {
            chip_number = chip_number.wrapping_add(1);
            if chip.resting_normal.is_some() && !chip_number.is_multiple_of(UPDATE_INTERVAL) {
                return true;
            }
            let air = suction.map_or(Vec3::ZERO, |suction| suction.air_velocity(chip.place));
            if let Some(out) = chip.resting_normal {
                let is_supported = world.is_blocked(chip.place, chip.place - out * SUPPORT_DISTANCE);
                if chip.is_wet {
                    chip.wet_time_left -= UPDATE_INTERVAL as f32 * STEP;
                }
                if is_supported && air.length_squared() < LIFTING_AIR_SPEED * LIFTING_AIR_SPEED {
                    return chip.wet_time_left > 0.0;
                }
                chip.resting_normal = None;
            }
            chip.velocity = apply_drag(chip.velocity, air, AIR_TIME);
            let goal = chip.place + chip.velocity * STEP;
            if suction.is_some_and(|suction| suction.captures(chip.place, goal)) {
                return false;
            }
            match world.sweep(chip.place, goal) {
                Sweep::Free => chip.place = goal,
                Sweep::Hit { place, normal: out } => {
                    let into = out * chip.velocity.dot(out).min(0.0);
                    chip.velocity = (chip.velocity - into) * TANGENTIAL_RESTITUTION - into * NORMAL_RESTITUTION;
                    chip.place = place + out * SURFACE_OFFSET;
                    if chip.velocity.length_squared() < STICK_SPEED * STICK_SPEED {
                        chip.resting_normal = Some(out);
                        chip.velocity = Vec3::ZERO;
                    }
                }
                Sweep::Inside => return false,
            }
            chip.place.length_squared() < WORLD_RADIUS * WORLD_RADIUS
        });
    }

    /// Launches the chips that rest near a running bur again.
    pub fn disturb(&mut self, bur: &RunningBur, rng: &mut Xorshift32) {
        let reach = bur.radius + DISTURB_DISTANCE;
        let tip = bur.world_from_tip.position;
        for chip in self.chips.iter_mut().filter(|chip| chip.resting_normal.is_some()) {
            if chip.place.distance_squared(tip) < reach * reach {
                chip.velocity = launch_velocity(bur, chip.place, rng);
                chip.resting_normal = None;
            }
        }
    }

    /// Effect of a falling drop: chips near it are carried away, and chips within the water that it joins become wet.
    /// `reach` is the radius of that water, mm. Gives the dust that the water takes up, mm³.
    pub fn wash(&mut self, place: Vec3, velocity: Vec3, reach: f32) -> f32 {
        let mut washed = 0.0;
        for chip in self.chips.iter_mut().filter(|chip| chip.resting_normal.is_some()) {
            let away = chip.place.distance_squared(place);
            chip.is_wet |= away < reach * reach;
            if away < WASH_RADIUS * WASH_RADIUS {
                (chip.velocity, chip.resting_normal, chip.is_wet) = (velocity, None, true);
                washed += if chip.has_clouded { 0.0 } else { CHIP_VOLUME };
                chip.has_clouded = true;
            }
        }
        washed
    }

    pub fn particles(&self) -> impl Iterator<Item = Particle> + '_ {
        /// Powder does not shine.
        const GLOSS: f32 = 0.03;
        self.chips.iter().map(|chip| Particle {
            position: chip.place,
            radius: chip.radius,
            facing: None,
            appearance: Appearance { colour: chip.colour, gloss: GLOSS },
            opacity: 1.0,
        })
    }

    /// Positions of the resting chips.
    #[cfg(test)]
    pub fn resting_positions(&self) -> impl Iterator<Item = Vec3> + '_ {
        self.chips.iter().filter(|chip| chip.resting_normal.is_some()).map(|chip| chip.place)
    }

    #[cfg(test)]
    pub fn mean_velocity(&self) -> Vec3 {
        self.chips.iter().map(|chip| chip.velocity).sum::<Vec3>() / self.chips.len().max(1) as f32
    }
}

/// Velocity with which a chip leaves a bur from a place at its rim, mm/s. Seen from the handpiece, burs rotate
/// clockwise.
fn launch_velocity(bur: &RunningBur, place: Vec3, rng: &mut Xorshift32) -> Vec3 {
    let axis = bur.world_from_tip.rotate(Vec3::Z);
    let from_tip = place - bur.world_from_tip.position;
    let outward = (from_tip - axis * from_tip.dot(axis)).normalize_or(axis.any_orthonormal_vector());
    let speed = LAUNCH_SPEED * rng.in_range(0.6, 1.3);
    let along_rim = outward.cross(axis);
    (along_rim + axis * LIFT + rng.in_cube() * SPREAD) * speed
}
