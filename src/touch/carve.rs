//! What a bur takes away in one tick.
//!
//! Takes the bur's tip, the hand's pull and the tissues' thresholds. Gives the changed voxels, in order.
//!
//! Two laws say how much. The rate law is in [`super::rate`]. The other is the thesis's (5.3), made smooth: where the spring force exceeds a tissue's threshold, the bur advances
//! into that tissue until the force is back at the threshold; after resting on one spot for a while a third of the
//! threshold suffices, because the bur rotates. The thesis set whole voxels to zero; here the bur's surface is cut into
//! the density itself, so what falls does not depend on the voxels' size. Neither does how much: the advance per tick
//! is limited in millimetres, never in voxels.

use super::body::Body;
use super::instrument::Instrument;
use super::law::Pull;
use super::material::Materials;
use super::rate::{Account, Rate};
use crate::frame::{Quat, Vec3};
use crate::tick::TICK_S;
use crate::volume::{Density, Edit, Label, Volume, Voxel, ramp};

/// The carving law's numbers, from the scenario.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Carving {
    /// Time on one spot after which less force suffices, s.
    pub dwell: f32,
    /// Share of the threshold that suffices then. The thesis: 1/3.
    pub dwell_share: f32,
    /// Fastest advance into matter, mm/s: what a bur can clear away.
    pub max_feed: f32,
    pub law: CuttingLaw,
}

/// What decides how far a bur advances.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum CuttingLaw {
    /// The thesis's thresholds of force, with dwell.
    #[default]
    Threshold,
    /// The bur's work, by the tissue's hardness.
    Rate(Rate),
}

/// A hand that has moved less than this rests, mm: it neither wanders nor tries to push in.
const SPOT_RADIUS: f32 = 0.2;

/// How much wider than itself a rotating bur cuts, mm: handpieces run out by 0.01–0.03. Without it a bur would jam in
/// the very groove it has cut.
const RUN_OUT: f32 = 0.01;

/// How far behind its centre a bur still clears its sides, as a share of its radius.
const BEHIND: f32 = 0.2;

/// A surface cuts that faces the way by more than this (cosine). The sides of a plunging fissure bur do not: what its tip has
/// opened is wide enough, and cutting there again with every tremble of the hand would ream the hole out.
const FACING: f32 = 0.02;

/// A bite is carried out over this many ticks, every so many-th row of voxels in each: a bur at full contact changes
/// thousands of fine voxels, and no single tick should bear them all. Rows interleave, so the surface sinks evenly.
const SHARES: u32 = 3;

/// Voxels that one tick may change. At 512×512×322 a third of what a bur of 1.2 mm radius changes is about 7 000.
const EDITS_MAX: usize = 1 << 15;

/// The bur's memory of where the hand rests, and scratch for this tick's edits.
#[derive(Clone, Debug)]
pub struct Carver {
    carving: Carving,
    spot: Vec3,
    rested_ticks: u32,
    /// The bite being carried out, and how many shares of it are done.
    biting: Option<(Bite, u32)>,
    /// Where the last bite should have let the tip go.
    owed: Option<Vec3>,
    /// What the rate law has to spend.
    account: Account,
    edits: Vec<Edit>,
    /// How far the bur advances into each tissue in this bite, mm.
    advance: [f32; 256],
}

impl Carver {
    pub fn new(carving: Carving) -> Carver {
        Carver {
            carving,
            spot: Vec3::ZERO,
            rested_ticks: 0,
            biting: None,
            owed: None,
            account: Account::default(),
            edits: Vec::with_capacity(EDITS_MAX),
            advance: [0.0; 256],
        }
    }

    /// This tick's changes, in the order they were made.
    pub fn edits(&self) -> &[Edit] {
        &self.edits
    }

    /// A tick in which nothing is touched.
    pub fn rest(&mut self) {
        self.edits.clear();
        self.rested_ticks = 0;
        self.biting = None;
        self.owed = None;
        self.account.close();
    }

    /// Cuts with a tip in contact. True while matter is being cut.
    pub fn cut(&mut self, volume: &mut Volume, instrument: &Instrument, materials: &Materials, press: &Press) -> bool {
        self.edits.clear();
        // A blade does not turn: it needs the whole force, and no bur's work.
        let share = if instrument.turns { self.threshold_share(press.hand) } else { 1.0 };
        let law = self.law_of(instrument);
        let is_wearing = match law {
            CuttingLaw::Threshold => false,
            // What cannot be cut is not worn either, however hard a bur leans on it.
            CuttingLaw::Rate(_) if materials.get(press.label).cut_force.is_none() => {
                self.account.close();
                return false;
            }
            CuttingLaw::Rate(rate) => self.account.save(&rate, instrument.head_radius(), press.pull.spring),
        };
        let planned = self.biting.or_else(|| Some((self.plan(volume, instrument, materials, press, share)?, 0)));
        let Some((bite, done)) = planned else { return is_wearing };
        match instrument.body() {
            None => self.carve(volume, &bite, done),
            Some(body) => self.carve_body(volume, body, &bite, done),
        }
        if let CuttingLaw::Rate(_) = law {
            self.account.pay(&self.edits, materials, volume.grid().voxel_mm3() as f32);
        }
        self.biting = (done + 1 < SHARES).then_some((bite, done + 1));
        true
    }

    fn law_of(&self, instrument: &Instrument) -> CuttingLaw {
        if instrument.turns { self.carving.law } else { CuttingLaw::Threshold }
    }

    /// The next bite, if the force suffices for any tissue.
    fn plan(
        &mut self,
        volume: &Volume,
        instrument: &Instrument,
        materials: &Materials,
        press: &Press,
        share: f32,
    ) -> Option<Bite> {
        let Press { tip, hand, orientation, pull, .. } = *press;
        let law = self.law_of(instrument);
        let (deepest, run_out) = match law {
            CuttingLaw::Threshold => (self.plan_advance(materials, &pull, share), RUN_OUT),
            CuttingLaw::Rate(_) => {
                let most = self.most();
                let deepest = self.account.plan(&mut self.advance, materials, most);
                // What run-out clears is paid for as well: a slow bite clears less of it.
                (deepest, RUN_OUT.min(deepest))
            }
        };
        if deepest <= 0.0 {
            self.owed = None;
            return None;
        }
        let way = (hand - tip).normalize_or_zero() * deepest + self.arrears(tip, volume.band());
        // The rate law's account already remembers what a bite was too short for.
        self.owed = matches!(law, CuttingLaw::Threshold).then_some(tip + way);
        Some(Bite { tip, way, deepest, run_out, radius: instrument.radius() + run_out, orientation })
    }

    /// What the last bite owes to the tip: the part of its way that was too short to change a stored density.
    ///
    /// Without it a bur that is mostly dragged sideways would never sink into coarse voxels.
    fn arrears(&self, tip: Vec3, band: f32) -> Vec3 {
        let quantum = 2.0 * band / f32::from(u8::MAX);
        self.owed.map_or(Vec3::ZERO, |owed| (owed - tip).clamp_length_max(2.0 * quantum))
    }

    /// 1, or the dwell's share when the hand has rested long enough.
    fn threshold_share(&mut self, hand: Vec3) -> f32 {
        if self.rested_ticks == 0 || hand.distance(self.spot) > SPOT_RADIUS {
            self.spot = hand;
            self.rested_ticks = 0;
        }
        self.rested_ticks += 1;
        let rested = self.rested_ticks as f32 * TICK_S as f32;
        if rested > self.carving.dwell { self.carving.dwell_share } else { 1.0 }
    }

    /// Farthest that a bite may advance, mm.
    fn most(&self) -> f32 {
        self.carving.max_feed * TICK_S as f32 * SHARES as f32
    }

    /// Fills `advance` for every tissue; returns the greatest.
    fn plan_advance(&mut self, materials: &Materials, pull: &Pull, share: f32) -> f32 {
        let most = self.most();
        let stiffness = pull.stiffness.max(1e-6);
        let mut deepest = 0.0;
        for (label, material) in materials.known() {
            let over = material.cut_force.map_or(0.0, |threshold| pull.spring - threshold * share);
            let advance = (over / stiffness).clamp(0.0, most);
            self.advance[usize::from(label.0)] = advance;
            deepest = f32::max(deepest, advance);
        }
        deepest
    }

    /// Carries out one share of a bite.
    fn carve(&mut self, volume: &mut Volume, bite: &Bite, share: u32) {
        let Bite { tip, way, radius, .. } = *bite;
        let (grid, band) = (*volume.grid(), volume.band());
        let centre = tip + way;
        let reach = Vec3::splat(radius + band);
        let [xs, ys, zs] = grid.cells_within(centre - reach, centre + reach);
        if xs.is_empty() {
            return;
        }
        let to_steps = grid.spacing.x.recip();
        let ahead = way.normalize_or_zero();
        for z in zs {
            for y in ys.clone().filter(|y| (y + z) % SHARES == share) {
                // From the bur's advanced centre to the row's first voxel.
                let first = grid.centre([xs.start, y, z]) - centre;
                let aside_squared = first.y * first.y + first.z * first.z;
                let half_squared = reach.x * reach.x - aside_squared;
                if half_squared <= 0.0 {
                    continue;
                }
                let half = half_squared.sqrt();
                let (mut low, mut high) = (-half, half);
                // The bur has been where it is: what lies well behind it is not new to it.
                let behind = -BEHIND * radius - first.y * ahead.y - first.z * ahead.z;
                match ahead.x {
                    x if x > 1e-3 => low = low.max(behind / x),
                    x if x < -1e-3 => high = high.min(behind / x),
                    _ if behind > 0.0 => continue,
                    _ => {}
                }
                if low >= high {
                    continue;
                }
                let step_at = |x: f32| (((x - first.x) * to_steps).max(-1.0) + 1.0) as u32;
                let row = Row { cell: [xs.start, y, z], first_x: first.x, aside_squared };
                self.carve_run(volume, bite, &row, step_at(low)..step_at(high).min(xs.len() as u32));
            }
        }
    }

    /// Carries out one share of a bite with a working end of any shape.
    fn carve_body(&mut self, volume: &mut Volume, body: &Body, bite: &Bite, share: u32) {
        let (grid, band) = (*volume.grid(), volume.band());
        let cylinder = Cylinder::of(body, bite, bite.run_out + band);
        let [low, high] = cylinder.extent();
        let [xs, ys, zs] = grid.cells_within(low, high);
        if xs.is_empty() {
            return;
        }
        let to_steps = grid.spacing.x.recip();
        for z in zs {
            for y in ys.clone().filter(|y| (y + z) % SHARES == share) {
                let first = grid.centre([xs.start, y, z]);
                let Some([low, high]) = cylinder.cut(first) else { continue };
                let step_at = |x: f32| (x * to_steps).clamp(0.0, xs.len() as f32) as u32;
                let steps = step_at(low)..(step_at(high) + 1).min(xs.len() as u32);
                self.carve_body_run(volume, body, bite, [xs.start, y, z], steps);
            }
        }
    }

    /// Carves a part of a row, given in steps from one of its cells.
    fn carve_body_run(
        &mut self,
        volume: &mut Volume,
        body: &Body,
        bite: &Bite,
        row: [u32; 3],
        steps: std::ops::Range<u32>,
    ) {
        let start = volume.grid().index(row);
        let run = volume.densities().get(start + steps.start as usize..start + steps.end as usize);
        if run.is_none_or(|run| run.iter().all(|&d| d == Density::EMPTY)) {
            return;
        }
        let [x, y, z] = row;
        let (grid, band) = (*volume.grid(), volume.band());
        let handle_from_tooth = glam::Mat3::from_quat(bite.orientation.conjugate());
        let first = handle_from_tooth * (grid.centre(row) - bite.tip - bite.way);
        let along = handle_from_tooth.x_axis * grid.spacing.x;
        // Into a harder tissue the bur goes less far: there it is this much farther back for each lost share of its way.
        let back = handle_from_tooth * bite.way;
        let far = bite.way.length();
        for step in steps {
            if volume.densities()[start + step as usize] == Density::EMPTY {
                continue;
            }
            let before = volume.voxel(start + step as usize);
            let advance = self.advance[usize::from(before.label.0)];
            if advance <= 0.0 {
                continue;
            }
            let share = advance / bite.deepest;
            let here = first + along * step as f32;
            let distance = body.head_distance(here + back * (1.0 - share));
            let left = ramp(bite.run_out - distance, band);
            if left >= before.density || self.edits.len() >= EDITS_MAX {
                continue;
            }
            let gained = body.head_distance(here + back) - distance;
            if gained > FACING * far * share {
                self.edits.push(volume.set_cell([x + step, y, z], Voxel { density: left, ..before }));
            }
        }
    }

    /// Carves a part of a row, given in steps from the row's first voxel.
    fn carve_run(&mut self, volume: &mut Volume, bite: &Bite, row: &Row, steps: std::ops::Range<u32>) {
        let (spacing, band) = (volume.grid().spacing.x, volume.band());
        let [x, y, z] = row.cell;
        let start = volume.grid().index(row.cell);
        // A bur that only grazes the row leaves an empty or backward range: nothing to do.
        let run = volume.densities().get(start + steps.start as usize..start + steps.end as usize);
        if run.is_none_or(|run| run.iter().all(|&d| d == Density::EMPTY)) {
            return;
        }
        // A voxel loses something when the bur's surface leaves less than it has: nearer than a distance that its
        // density names. Squared, so that most voxels cost no root. Half a quantum is the rounding of densities.
        let (base, rise) = (bite.radius - band * (1.0 + 1.0 / f32::from(u8::MAX)), 2.0 * band / f32::from(u8::MAX));
        for step in steps {
            let density = volume.densities()[start + step as usize].bits();
            let along = row.first_x + step as f32 * spacing;
            let squared = along * along + row.aside_squared;
            let nearer_than = (base + rise * f32::from(density)).max(0.0);
            if density > 0 && squared < nearer_than * nearer_than {
                self.carve_voxel(volume, bite, [x + step, y, z], squared.sqrt());
            }
        }
    }

    /// `distance`: of the voxel's centre from the bur's, at full advance.
    fn carve_voxel(&mut self, volume: &mut Volume, bite: &Bite, cell: [u32; 3], distance: f32) {
        let before = volume.voxel(volume.grid().index(cell));
        let advance = self.advance[usize::from(before.label.0)];
        let distance = match advance {
            0.0 => return,
            a if a == bite.deepest => distance,
            // Into a harder tissue the bur goes less far.
            a => (volume.grid().centre(cell) - bite.tip - bite.way * (a / bite.deepest)).length(),
        };
        let left = ramp(bite.radius - distance, volume.band());
        if left < before.density && self.edits.len() < EDITS_MAX {
            self.edits.push(volume.set_cell(cell, Voxel { density: left, ..before }));
        }
    }
}

/// How the hand presses the bur in a tick; positions in tooth space, mm.
#[derive(Clone, Copy, Debug)]
pub struct Press {
    /// The bur's centre.
    pub tip: Vec3,
    /// Where the hand is, inside matter: the bur advances toward it.
    pub hand: Vec3,
    /// `tooth_from_handle`.
    pub orientation: Quat,
    pub pull: Pull,
    /// Tissue that carries most of it.
    pub label: Label,
}

/// A row of voxels along x, seen from the bur's advanced centre.
#[derive(Clone, Copy)]
struct Row {
    /// Its first voxel.
    cell: [u32; 3],
    /// Where that voxel's centre lies along x, mm.
    first_x: f32,
    /// Squared distance of the row from the centre, mm².
    aside_squared: f32,
}

/// What is to be cut away: everything within the bur when it has gone its way.
#[derive(Clone, Copy, Debug)]
struct Bite {
    tip: Vec3,
    /// Into the softest tissue, mm; into harder ones a share of it.
    way: Vec3,
    /// Length of that way as the law gave it, mm.
    deepest: f32,
    /// Of a ball with its run-out, mm.
    radius: f32,
    /// How much wider than itself the bur cuts, mm.
    run_out: f32,
    /// `tooth_from_handle`.
    orientation: Quat,
}

/// What a bite can reach with a working end of any shape: a cylinder about its shaft, in tooth space.
struct Cylinder {
    middle: Vec3,
    /// Unit.
    axis: Vec3,
    radius: f32,
    half_length: f32,
}

impl Cylinder {
    fn of(body: &Body, bite: &Bite, margin: f32) -> Cylinder {
        let (radius, [low, high]) = body.head_cylinder();
        let axis = bite.orientation * Vec3::Z;
        // A harder tissue sees the end less advanced: half of the way lies on either side of the middle.
        let middle = bite.tip + bite.way * 0.5 + axis * (0.5 * (low + high));
        let margin = margin + 0.5 * bite.way.length();
        Cylinder { middle, axis, radius: radius + margin, half_length: 0.5 * (high - low) + margin }
    }

    /// Lowest and highest corner of the box around it.
    fn extent(&self) -> [Vec3; 2] {
        let aside = |along: f32| self.half_length * along.abs() + self.radius * (1.0 - along * along).max(0.0).sqrt();
        let half = Vec3::new(aside(self.axis.x), aside(self.axis.y), aside(self.axis.z));
        [self.middle - half, self.middle + half]
    }

    /// Where a line along x from a place enters and leaves, as distances from that place.
    fn cut(&self, from: Vec3) -> Option<[f32; 2]> {
        let out = from - self.middle;
        let (along, climb) = (out.dot(self.axis), self.axis.x);
        let aside = out - self.axis * along;
        let drift = Vec3::X - self.axis * climb;
        let (mut low, mut high) = (f32::NEG_INFINITY, f32::INFINITY);
        let (a, b, c) = (drift.length_squared(), drift.dot(aside), aside.length_squared() - self.radius * self.radius);
        if a > 1e-6 {
            let inside = b * b - a * c;
            if inside <= 0.0 {
                return None;
            }
            (low, high) = ((-b - inside.sqrt()) / a, (-b + inside.sqrt()) / a);
        } else if c > 0.0 {
            return None;
        }
        if climb.abs() > 1e-4 {
            let (near, far) = ((-self.half_length - along) / climb, (self.half_length - along) / climb);
            (low, high) = (low.max(near.min(far)), high.min(near.max(far)));
        } else if along.abs() > self.half_length {
            return None;
        }
        (low < high).then_some([low, high])
    }
}
