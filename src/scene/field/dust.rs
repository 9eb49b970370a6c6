//! Chips of what was carved: they leave the bur's rim, fall, and lie about.

use super::chance::Chance;
use super::ground::{Ground, Way};
use super::suction::Suction;
use super::{Bur, MOUTH, STEP, slowed};
use crate::frame::Vec3;
use crate::render::{Finish, Palette, Rgb, Speck};
use crate::volume::{Edit, Grid, Label};
use std::collections::VecDeque;

/// Chips at most.
pub const MOST: usize = 2000;

/// Chips that one picture adds at most; what is carved beyond that adds none.
const BORN_MOST: usize = 96;

/// Matter for each chip that is drawn, mm³. True dust is a thousand times finer.
const CHIP: f32 = 0.004;

/// Radii of chips, mm.
const RADII: [f32; 2] = [0.045, 0.10];

/// How fast chips leave the rim, mm/s: so that an eye can follow them. A turbine's rim goes some 20 m/s.
const LEAVING: f32 = 420.0;

/// Shares of that: along the shaft, for a bur's flutes lift what they cut, and any way.
const LIFT: f32 = 0.55;
const SPREAD: f32 = 0.25;

/// Time in which a chip takes on the air's velocity, s: of dentine (2.1 g/cm³), 60 µm wide.
const AIR_TIME: f32 = 0.023;

/// What is left of the velocity along a surface and out of it when a chip meets one.
const SLIDES: f32 = 0.5;
const BOUNCES: f32 = 0.2;

/// Slower than this it then stays, mm/s: everything in a mouth is moist.
const STAYS: f32 = 110.0;

/// A chip lies so far over its surface, mm, and has lost it when matter is farther beneath it.
const OVER: f32 = 0.03;
const LOST: f32 = 0.25;

/// One in so many lying chips is asked in each step what it lies on.
const EACH_TURN: usize = 8;

/// Air that takes up a moist chip, mm/s.
const TAKES_UP: f32 = 2500.0;

/// A running bur throws what lies nearer to it than this, mm.
const STIRS: f32 = 0.2;

/// How long wet chips lie before they are gone with the water, s, at least and at most.
const SLURRY: [f32; 2] = [0.15, 0.9];

/// A drop takes chips so near to where it falls, mm.
const WASHES: f32 = 0.7;

/// Powder is paler than the tissue: share of white.
const POWDER: f32 = 0.25;

pub struct Dust {
    chips: VecDeque<Chip>,
    /// What was carved and has not become chips yet.
    born: Vec<Born>,
    /// Carved and not a chip's worth yet, mm³.
    account: f32,
    /// Steps so far.
    turn: usize,
}

struct Born {
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
    /// Bound by water, with which it goes on when it has lain for a while.
    is_wet: bool,
    /// How long it lies when it is wet, s.
    stays: f32,
    /// The normal of what it lies on.
    lies: Option<Vec3>,
}

impl Dust {
    pub fn new() -> Dust {
        Dust { chips: VecDeque::with_capacity(MOST), born: Vec::with_capacity(BORN_MOST), account: 0.0, turn: 0 }
    }

    /// A voxel of matter is gone.
    pub fn carved(&mut self, edit: &Edit, grid: &Grid) {
        self.account += grid.voxel_mm3() as f32;
        while self.account >= CHIP && self.born.len() < BORN_MOST {
            self.account -= CHIP;
            let place_in_tooth = grid.centre(grid.cell(edit.index as usize));
            self.born.push(Born { place_in_tooth, label: edit.before.label });
        }
        self.account = self.account.min(CHIP);
    }

    /// What was carved leaves the bur. What was carved while none runs, as in a window that lags, comes to nothing.
    pub fn leave(&mut self, bur: Option<&Bur>, is_wet: bool, ground: &Ground, palette: &Palette, chance: &mut Chance) {
        let Dust { chips, born, .. } = self;
        for Born { place_in_tooth, label } in born.drain(..) {
            // The bur may have gone on since: what it left is free, if only just.
            let Some(bur) = bur else { continue };
            let Some(at_rim) = ground.over(ground.world_from_tooth * place_in_tooth) else { continue };
            let velocity = thrown(bur, at_rim, chance);
            let pale = chance.between(0.3, 1.0) * POWDER;
            let colour = palette.finish(label).colour.map(|c| c + (1.0 - c) * pale);
            if chips.len() == MOST {
                chips.pop_front();
            }
            chips.push_back(Chip {
                place: at_rim,
                velocity,
                radius: chance.between(RADII[0], RADII[1]),
                colour,
                is_wet,
                stays: chance.between(SLURRY[0], SLURRY[1]),
                lies: None,
            });
        }
    }

    /// One step of all that flies, and of what has lost what it lay on.
    pub fn fly(&mut self, ground: &Ground, suction: Option<&Suction>) {
        self.turn = self.turn.wrapping_add(1);
        let mut place_in_turn = self.turn;
        self.chips.retain_mut(|chip| {
            place_in_turn = place_in_turn.wrapping_add(1);
            if chip.lies.is_some() && !place_in_turn.is_multiple_of(EACH_TURN) {
                return true;
            }
            let air = suction.map_or(Vec3::ZERO, |suction| suction.wind(chip.place));
            if let Some(out) = chip.lies {
                let is_held = ground.is_closed(chip.place, chip.place - out * LOST);
                if chip.is_wet {
                    chip.stays -= EACH_TURN as f32 * STEP;
                }
                if is_held && air.length_squared() < TAKES_UP * TAKES_UP {
                    return chip.stays > 0.0;
                }
                chip.lies = None;
            }
            chip.velocity = slowed(chip.velocity, air, AIR_TIME);
            let goal = chip.place + chip.velocity * STEP;
            if suction.is_some_and(|suction| suction.swallows(chip.place, goal)) {
                return false;
            }
            match ground.way(chip.place, goal) {
                Way::Free => chip.place = goal,
                Way::Ends { place, out } => {
                    let into = out * chip.velocity.dot(out).min(0.0);
                    chip.velocity = (chip.velocity - into) * SLIDES - into * BOUNCES;
                    chip.place = place + out * OVER;
                    if chip.velocity.length_squared() < STAYS * STAYS {
                        chip.lies = Some(out);
                        chip.velocity = Vec3::ZERO;
                    }
                }
                Way::Buried => return false,
            }
            chip.place.length_squared() < MOUTH * MOUTH
        });
    }

    /// A running bur throws again what lies where it works.
    pub fn stir(&mut self, bur: &Bur, chance: &mut Chance) {
        let reach = bur.radius + STIRS;
        let tip = bur.world_from_tip.position;
        for chip in self.chips.iter_mut().filter(|chip| chip.lies.is_some()) {
            if chip.place.distance_squared(tip) < reach * reach {
                chip.velocity = thrown(bur, chip.place, chance);
                chip.lies = None;
            }
        }
    }

    /// A drop falls: what lies there goes with it, and what lies in the water that it joins is soaked. `reach`: radius of that
    /// water, mm.
    pub fn wash(&mut self, place: Vec3, velocity: Vec3, reach: f32) {
        for chip in self.chips.iter_mut().filter(|chip| chip.lies.is_some()) {
            let away = chip.place.distance_squared(place);
            chip.is_wet |= away < reach * reach;
            if away < WASHES * WASHES {
                (chip.velocity, chip.lies, chip.is_wet) = (velocity, None, true);
            }
        }
    }

    pub fn specks(&self) -> impl Iterator<Item = Speck> + '_ {
        /// Powder does not shine.
        const GLOSS: f32 = 0.03;
        self.chips.iter().map(|chip| Speck {
            place: chip.place,
            radius: chip.radius,
            facing: None,
            finish: Finish { colour: chip.colour, gloss: GLOSS },
            opacity: 1.0,
        })
    }

    /// Where chips lie.
    #[cfg(test)]
    pub fn places(&self) -> impl Iterator<Item = Vec3> + '_ {
        self.chips.iter().filter(|chip| chip.lies.is_some()).map(|chip| chip.place)
    }

    #[cfg(test)]
    pub fn mean_velocity(&self) -> Vec3 {
        self.chips.iter().map(|chip| chip.velocity).sum::<Vec3>() / self.chips.len().max(1) as f32
    }
}

/// How a chip leaves a bur from a place at its rim, mm/s. Seen from the handpiece burs turn clockwise.
fn thrown(bur: &Bur, place: Vec3, chance: &mut Chance) -> Vec3 {
    let axis = bur.world_from_tip.turn(Vec3::Z);
    let from_tip = place - bur.world_from_tip.position;
    let outward = (from_tip - axis * from_tip.dot(axis)).normalize_or(axis.any_orthonormal_vector());
    let speed = LEAVING * chance.between(0.6, 1.3);
    let along_rim = outward.cross(axis);
    (along_rim + axis * LIFT + chance.anywhere() * SPREAD) * speed
}
