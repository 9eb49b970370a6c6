//! Removal of matter by a bur or blade in one tick.
//!
//! Takes the tool's tip, the contact force and the tissues' cutting thresholds. Gives the changed voxels, in order.
//!
//! Two laws determine the advance. The rate law is in `wear`. The threshold law is that of the thesis (5.3), made
//! smooth: where the spring force exceeds the threshold of a tissue, the bur advances into that tissue until the
//! force is back at the threshold; after a dwell on one spot a third of the threshold suffices, because the bur
//! rotates. The thesis set whole voxels to zero; here the bur's surface is cut into the density itself, so that the
//! removed volume does not depend on voxel size. Neither does the speed: the advance per tick is limited in
//! millimetres, never in voxels.

use super::body::Body;
use super::contact_spring::ContactForce;
use super::instrument::Instrument;
use super::material::Materials;
use super::wear::{WearRate, WorkBudget};
use crate::aabb::Aabb;
use crate::frame::{Quat, Vec3};
use crate::tick::TICK_S;
use crate::volume::{BRICK, Density, Edit, Label, Volume, Voxel, density_at_distance};
use std::ops::Range;

/// Parameters of the cutting laws, from the scenario.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CarvingParameters {
    /// Dwell time on one spot after which less force suffices, s.
    pub dwell: f32,
    /// Fraction of the threshold that suffices after the dwell; 1/3 in the thesis.
    pub dwell_share: f32,
    /// Fastest advance into matter, mm/s: the rate at which a bur can clear chips.
    pub max_feed: f32,
    pub law: CuttingLaw,
}

/// Law that determines the advance of a bur.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum CuttingLaw {
    /// Force thresholds with dwell, as in the thesis.
    #[default]
    Threshold,
    /// Removal in proportion to the bur's work and in inverse proportion to the tissue's hardness.
    Rate(WearRate),
}

/// Hand motion below which the hand counts as dwelling, mm: it neither wanders nor pushes in.
const DWELL_RADIUS: f32 = 0.2;

/// Run-out of a rotating bur, mm: it cuts wider than itself by this much. Handpieces have 0.01–0.03. Without run-out
/// a bur would jam in the very groove it has cut.
const RUN_OUT: f32 = 0.01;

/// Distance behind its centre up to which a bur still clears its sides, as a fraction of its radius.
const REAR_CLEARANCE: f32 = 0.2;

/// Minimum cosine between the tool's surface normal and the feed direction for that part of the surface to cut. The
/// sides of a plunging fissure bur do not cut: the hole that its tip has opened is wide enough, and cutting again
/// with every tremor of the hand would ream it out.
const MIN_FACING_COSINE: f32 = 0.02;

/// Ticks over which a cut increment is spread, each cutting every third row of voxels: a bur at full contact changes
/// thousands of small voxels, too many for a single tick. Rows interleave, so that the surface recedes evenly.
const INTERLEAVE: u32 = 3;

/// Number of voxels after which a phase is continued in the next tick, so that a tick ends in time whatever the size of
/// the bur and the voxels: comparing so many takes about half a millisecond. At 512×512×322 a round bur of 1.2 mm radius
/// examines 18 000 in a tick and changes 7 000, a third of its increment, so that only larger bites take more ticks.
const EXAMINED_MAX: usize = 1 << 15;

/// Voxels of a whole bite up to which its trailing side is left out, as a multiple of [`EXAMINED_MAX`]: so few that none of its
/// phases is spread.
const SHORTENED_MAX: f32 = 2.5;

/// Greatest number of voxels examined, and so of edits, in one tick: a row that has been begun is finished. No row of
/// voxels within a bur is longer than [`EXAMINED_MAX`].
const EDITS_MAX: usize = 2 * EXAMINED_MAX;

/// Cutting state: dwell, the increment in progress and the edits of this tick.
#[derive(Clone, Debug)]
pub struct Carver {
    carving: CarvingParameters,
    dwell_point: Vec3,
    dwell_ticks: u32,
    /// Cut increment in progress, and the part of it that is done.
    increment: Option<(CutIncrement, CutProgress)>,
    /// Tip position that the last increment should have made reachable, tooth space.
    carry: Option<Vec3>,
    /// Work available to the rate law.
    work_budget: WorkBudget,
    edits: Vec<Edit>,
    /// Number of voxels compared with the tool in this tick.
    examined: usize,
    /// Advance into each tissue in this increment, mm, by label.
    advance: [f32; 256],
}

impl Carver {
    pub fn new(carving: CarvingParameters) -> Carver {
        Carver {
            carving,
            dwell_point: Vec3::ZERO,
            dwell_ticks: 0,
            increment: None,
            carry: None,
            work_budget: WorkBudget::default(),
            edits: Vec::with_capacity(EDITS_MAX),
            examined: 0,
            advance: [0.0; 256],
        }
    }

    /// Voxels changed in this tick, in the order of their changes.
    pub fn edits(&self) -> &[Edit] {
        &self.edits
    }

    /// Resets the state for a tick without contact.
    pub fn reset(&mut self) {
        self.edits.clear();
        self.dwell_ticks = 0;
        self.increment = None;
        self.carry = None;
        self.work_budget.reset();
    }

    /// Cuts with a tip in contact; returns true while matter is being cut.
    pub fn cut(
        &mut self,
        volume: &mut Volume,
        instrument: &Instrument,
        materials: &Materials,
        load: &ToolLoad,
    ) -> bool {
        self.edits.clear();
        self.examined = 0;
        // A blade does not rotate: it needs the whole threshold force and follows the threshold law.
        let threshold_share = if instrument.is_rotary { self.threshold_share(load.hand) } else { 1.0 };
        let cutting_law = self.cutting_law(instrument);
        let is_wearing = match cutting_law {
            CuttingLaw::Threshold => false,
            // A tissue that cannot be cut does not wear either, whatever the force.
            CuttingLaw::Rate(_) if materials.get(load.label).cut_force.is_none() => {
                self.work_budget.reset();
                return false;
            }
            CuttingLaw::Rate(rate) => {
                self.work_budget.accumulate(&rate, instrument.head_radius(), load.contact_force.spring)
            }
        };
        let planned = self.increment.or_else(|| {
            Some((self.plan_increment(volume, instrument, materials, load, threshold_share)?, CutProgress::default()))
        });
        let Some((increment, progress)) = planned else { return is_wearing };
        let rows_left = match instrument.body() {
            None => self.carve_ball(volume, &increment, progress),
            Some(body) => self.carve_body(volume, body, &increment, progress),
        };
        if let CuttingLaw::Rate(_) = cutting_law {
            self.work_budget.spend(&self.edits, materials, volume.grid().voxel_mm3() as f32);
        }
        let next = match rows_left {
            Some(rows) => CutProgress { rows, ..progress },
            None => CutProgress { phase: progress.phase + 1, rows: 0 },
        };
        self.increment = (next.phase < INTERLEAVE).then_some((increment, next));
        true
    }

    fn cutting_law(&self, instrument: &Instrument) -> CuttingLaw {
        if instrument.is_rotary { self.carving.law } else { CuttingLaw::Threshold }
    }

    /// Plans the next increment, if the force suffices for any tissue.
    fn plan_increment(
        &mut self,
        volume: &Volume,
        instrument: &Instrument,
        materials: &Materials,
        load: &ToolLoad,
        threshold_share: f32,
    ) -> Option<CutIncrement> {
        let ToolLoad { tip, hand, orientation, contact_force, .. } = *load;
        let cutting_law = self.cutting_law(instrument);
        let (deepest, run_out) = match cutting_law {
            CuttingLaw::Threshold => (self.plan_advance(materials, &contact_force, threshold_share), RUN_OUT),
            CuttingLaw::Rate(_) => {
                let max_advance = self.max_advance();
                let deepest = self.work_budget.plan_advance(&mut self.advance, materials, max_advance);
                // The matter cleared by run-out is charged to the budget as well: a slow increment clears less of it.
                (deepest, RUN_OUT.min(deepest))
            }
        };
        if deepest <= 0.0 {
            self.carry = None;
            return None;
        }
        let feed = (hand - tip).normalize_or_zero() * deepest + self.carried_over(tip, volume.half_band());
        // The work budget of the rate law already carries the unused part of an increment.
        self.carry = matches!(cutting_law, CuttingLaw::Threshold).then_some(tip + feed);
        Some(CutIncrement { tip, feed, deepest, run_out, radius: instrument.radius() + run_out, orientation })
    }

    /// Carried-over advance of the last increment: the part that was too small to change a stored density.
    ///
    /// Without it a bur that is mostly dragged sideways would never sink into coarse voxels.
    fn carried_over(&self, tip: Vec3, band: f32) -> Vec3 {
        let quantum = 2.0 * band / f32::from(u8::MAX);
        self.carry.map_or(Vec3::ZERO, |owed| (owed - tip).clamp_length_max(2.0 * quantum))
    }

    /// Returns the dwell fraction of the threshold once the hand has dwelt long enough, otherwise 1.
    fn threshold_share(&mut self, hand: Vec3) -> f32 {
        if self.dwell_ticks == 0 || hand.distance(self.dwell_point) > DWELL_RADIUS {
            self.dwell_point = hand;
            self.dwell_ticks = 0;
        }
        self.dwell_ticks += 1;
        let dwelt = self.dwell_ticks as f32 * TICK_S as f32;
        if dwelt > self.carving.dwell { self.carving.dwell_share } else { 1.0 }
    }

    /// Greatest advance of an increment, mm.
    fn max_advance(&self) -> f32 {
        self.carving.max_feed * TICK_S as f32 * INTERLEAVE as f32
    }

    /// Fills `advance` for every tissue by the threshold law; returns the greatest.
    fn plan_advance(&mut self, materials: &Materials, contact_force: &ContactForce, threshold_share: f32) -> f32 {
        let max_advance = self.max_advance();
        let stiffness = contact_force.stiffness.max(1e-6);
        let mut deepest = 0.0;
        for (label, material) in materials.labelled() {
            let excess_force =
                material.cut_force.map_or(0.0, |threshold| contact_force.spring - threshold * threshold_share);
            let advance = (excess_force / stiffness).clamp(0.0, max_advance);
            self.advance[usize::from(label.0)] = advance;
            deepest = f32::max(deepest, advance);
        }
        deepest
    }

    /// Carries out one phase of an increment with a ball, or a part of it. Returns the number of rows of the phase that
    /// are done, if any are left.
    fn carve_ball(&mut self, volume: &mut Volume, increment: &CutIncrement, progress: CutProgress) -> Option<u32> {
        let CutIncrement { tip, feed, radius, .. } = *increment;
        let (grid, band) = (*volume.grid(), volume.half_band());
        let centre = tip + feed;
        let reach = Vec3::splat(radius + band);
        let [xs, ys, zs] = grid.cells_within(centre - reach, centre + reach);
        if xs.is_empty() {
            return None;
        }
        let to_steps = grid.spacing.x.recip();
        let ahead = feed.normalize_or_zero();
        for (row, [y, z]) in progress.rows_left(ys, zs) {
            if self.examined >= EXAMINED_MAX {
                return Some(row);
            }
            // Vector from the bur's advanced centre to the first voxel of the row.
            let first = grid.centre([xs.start, y, z]) - centre;
            let aside_squared = first.y * first.y + first.z * first.z;
            let half_squared = reach.x * reach.x - aside_squared;
            if half_squared <= 0.0 {
                continue;
            }
            let half = half_squared.sqrt();
            let (mut low, mut high) = (-half, half);
            // The bur already occupies its position: matter well behind its centre needs no clearing.
            let behind = -REAR_CLEARANCE * radius - first.y * ahead.y - first.z * ahead.z;
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
            let voxels = VoxelRow { cell: [xs.start, y, z], first_x: first.x, aside_squared };
            self.carve_ball_row(volume, increment, &voxels, step_at(low)..step_at(high).min(xs.len() as u32));
        }
        None
    }

    /// Carries out one phase of an increment with a body, as [`Carver::carve_ball`] does.
    fn carve_body(
        &mut self,
        volume: &mut Volume,
        body: &Body,
        increment: &CutIncrement,
        progress: CutProgress,
    ) -> Option<u32> {
        let (grid, band) = (*volume.grid(), volume.half_band());
        let cylinder = SweptCylinder::of(body, increment, increment.run_out + band);
        // A bite that is spread over more ticks is spread as if all of it were compared.
        let is_spread = cylinder.volume() / grid.voxel_mm3() as f32 > SHORTENED_MAX * EXAMINED_MAX as f32;
        let trailing = TrailingSide::of(body, increment, &self.advance).filter(|_| !is_spread);
        let placed = PlacedIncrement::new(increment, grid.spacing.x);
        let Aabb { low, high } = cylinder.extent();
        let [xs, ys, zs] = grid.cells_within(low, high);
        if xs.is_empty() {
            return None;
        }
        let to_steps = grid.spacing.x.recip();
        let row_length = grid.spacing.x * xs.len() as f32;
        let bricks = xs.start / BRICK..=(xs.end - 1) / BRICK;
        let (mut last_brick_row, mut is_empty) = (None, true);
        for (row, [y, z]) in progress.rows_left(ys, zs) {
            if self.examined >= EXAMINED_MAX {
                return Some(row);
            }
            let first = grid.centre([xs.start, y, z]);
            // Rows beside each other are mostly of the same bricks.
            let brick_row = [y / BRICK, z / BRICK];
            if last_brick_row != Some(brick_row) {
                last_brick_row = Some(brick_row);
                let [brick_y, brick_z] = brick_row;
                is_empty = !bricks.clone().any(|brick_x| volume.bricks().is_occupied([brick_x, brick_y, brick_z]));
            }
            if is_empty {
                continue;
            }
            let trailing = trailing.as_ref().map_or(TrailingSide::NOWHERE, |trailing| trailing.along_row(first));
            if trailing[0] <= 0.0 && trailing[1] >= row_length {
                continue;
            }
            let Some(within) = cylinder.clip_row(first) else { continue };
            let Some([low, high]) = without(within, trailing) else { continue };
            let step_at = |x: f32| (x * to_steps).clamp(0.0, xs.len() as f32) as u32;
            let steps = step_at(low)..(step_at(high) + 1).min(xs.len() as u32);
            self.carve_body_row(volume, body, &placed, [xs.start, y, z], steps);
        }
        None
    }

    /// Cuts a part of a row; `steps` counts from the cell `row`.
    fn carve_body_row(
        &mut self,
        volume: &mut Volume,
        body: &Body,
        placed: &PlacedIncrement,
        row: [u32; 3],
        steps: Range<u32>,
    ) {
        let start = volume.grid().index(row);
        let end = start + steps.end as usize;
        let mut next = next_matter(volume, start + steps.start as usize..end);
        if next.is_none() {
            return;
        }
        self.examined += steps.len();
        let [x, y, z] = row;
        let (grid, band) = (*volume.grid(), volume.half_band());
        let PlacedIncrement { increment, handle_from_tooth, along, feed, feed_length } = *placed;
        let first = handle_from_tooth * (grid.centre(row) - increment.tip - increment.feed);
        // Distance, by density, beyond which the tool certainly removes nothing: a step of density more than exact, for rounding.
        let per_density = 2.0 * band / f32::from(u8::MAX);
        let of_empty = increment.run_out - band + per_density;
        let (mut label, mut share) = (Label::AIR, 0.0);
        while let Some(index) = next {
            next = next_matter(volume, index + 1..end);
            let (step, before) = ((index - start) as u32, volume.voxel(index));
            if before.label != label {
                label = before.label;
                share = self.advance[usize::from(label.0)] / increment.deepest;
            }
            if share <= 0.0 {
                continue;
            }
            let here = first + along * step as f32;
            let distance = body.head_distance(here + feed * (1.0 - share));
            if distance > of_empty + per_density * f32::from(before.density.bits()) {
                continue;
            }
            let remaining = density_at_distance(increment.run_out - distance, band);
            if remaining >= before.density || self.edits.len() >= EDITS_MAX {
                continue;
            }
            let clearance_gain = body.head_distance(here + feed) - distance;
            if clearance_gain > MIN_FACING_COSINE * feed_length * share {
                self.edits.push(volume.set_cell([x + step, y, z], Voxel { density: remaining, ..before }));
            }
        }
    }

    /// Cuts a part of a row; `steps` counts from the first voxel of the row.
    fn carve_ball_row(&mut self, volume: &mut Volume, increment: &CutIncrement, row: &VoxelRow, steps: Range<u32>) {
        let (spacing, band) = (volume.grid().spacing.x, volume.half_band());
        let [x, y, z] = row.cell;
        let start = volume.grid().index(row.cell);
        // A bur that only grazes the row gives an empty or reversed range.
        let run = volume.densities().get(start + steps.start as usize..start + steps.end as usize);
        if run.is_none_or(|run| run.iter().all(|&d| d == Density::EMPTY)) {
            return;
        }
        self.examined += steps.len();
        // A voxel loses density if the bur's surface leaves less than it has, that is, if it is nearer to the bur's
        // centre than a distance given by its density. Distances are compared squared, to avoid a square root per
        // voxel. The margin of half a density step covers rounding.
        let (base, rise) =
            (increment.radius - band * (1.0 + 1.0 / f32::from(u8::MAX)), 2.0 * band / f32::from(u8::MAX));
        for step in steps {
            let density = volume.densities()[start + step as usize].bits();
            let along = row.first_x + step as f32 * spacing;
            let squared = along * along + row.aside_squared;
            let nearer_than = (base + rise * f32::from(density)).max(0.0);
            if density > 0 && squared < nearer_than * nearer_than {
                self.carve_voxel(volume, increment, [x + step, y, z], squared.sqrt());
            }
        }
    }

    /// `distance`: from the bur's centre at full advance to the centre of the voxel, mm.
    fn carve_voxel(&mut self, volume: &mut Volume, increment: &CutIncrement, cell: [u32; 3], distance: f32) {
        let before = volume.voxel(volume.grid().index(cell));
        let advance = self.advance[usize::from(before.label.0)];
        let distance = match advance {
            0.0 => return,
            a if a == increment.deepest => distance,
            // In a harder tissue the bur advances less.
            a => (volume.grid().centre(cell) - increment.tip - increment.feed * (a / increment.deepest)).length(),
        };
        let remaining = density_at_distance(increment.radius - distance, volume.half_band());
        if remaining < before.density && self.edits.len() < EDITS_MAX {
            self.edits.push(volume.set_cell(cell, Voxel { density: remaining, ..before }));
        }
    }
}

/// Load on the tool in a tick; positions in tooth space, mm.
#[derive(Clone, Copy, Debug)]
pub struct ToolLoad {
    /// Centre of the ball, or origin of the body.
    pub tip: Vec3,
    /// Position of the hand, inside matter: the bur advances toward it.
    pub hand: Vec3,
    /// `tooth_from_handle`.
    pub orientation: Quat,
    pub contact_force: ContactForce,
    /// Tissue that carries most of the contact force.
    pub label: Label,
}

/// Row of voxels along x, relative to the bur's advanced centre.
#[derive(Clone, Copy)]
struct VoxelRow {
    /// First voxel of the row.
    cell: [u32; 3],
    /// Coordinate of that voxel's centre along x, mm.
    first_x: f32,
    /// Squared distance of the row from the bur's centre, mm².
    aside_squared: f32,
}

/// Cut increment: removes everything inside the bur after its advance.
#[derive(Clone, Copy, Debug)]
struct CutIncrement {
    tip: Vec3,
    /// Advance vector into the softest tissue, mm; in harder tissues a fraction of it.
    feed: Vec3,
    /// Length of the advance as determined by the law, mm.
    deepest: f32,
    /// Radius of a ball including run-out, mm.
    radius: f32,
    /// Run-out, mm.
    run_out: f32,
    /// `tooth_from_handle`.
    orientation: Quat,
}

/// An increment with what every row needs of it, in handle space.
struct PlacedIncrement<'a> {
    increment: &'a CutIncrement,
    handle_from_tooth: glam::Mat3,
    /// From a voxel to the next one of its row, mm.
    along: Vec3,
    /// Added to a place relative to the advanced tool, it gives the place relative to the tool before. In a harder tissue the
    /// bur advances less: it is set back along the feed in proportion to the missing advance.
    feed: Vec3,
    /// mm
    feed_length: f32,
}

impl PlacedIncrement<'_> {
    fn new(increment: &CutIncrement, spacing: f32) -> PlacedIncrement<'_> {
        let handle_from_tooth = glam::Mat3::from_quat(increment.orientation.conjugate());
        PlacedIncrement {
            increment,
            handle_from_tooth,
            along: handle_from_tooth.x_axis * spacing,
            feed: handle_from_tooth * increment.feed,
            feed_length: increment.feed.length(),
        }
    }
}

/// Index of the first voxel of a range that is not empty; `None` if there is none, or no such range. Most voxels of a row
/// within a bur are empty: it has cut them.
#[inline]
fn next_matter(volume: &Volume, range: Range<usize>) -> Option<usize> {
    let (chunks, rest) = volume.densities().get(range.clone())?.as_chunks::<8>();
    for (number, chunk) in chunks.iter().enumerate() {
        let bits = u64::from_le_bytes(chunk.map(Density::bits));
        if bits != 0 {
            return Some(range.start + 8 * number + bits.trailing_zeros() as usize / 8);
        }
    }
    let at = rest.iter().position(|&density| density != Density::EMPTY)?;
    Some(range.start + 8 * chunks.len() + at)
}

/// Part of an increment that is done: whole phases, and rows of the next one.
#[derive(Clone, Copy, Debug, Default)]
struct CutProgress {
    phase: u32,
    rows: u32,
}

impl CutProgress {
    /// The rows of the phase that are not done yet, as their number within the phase and their y and z, in order.
    fn rows_left(self, ys: Range<u32>, zs: Range<u32>) -> impl Iterator<Item = (u32, [u32; 2])> {
        let rows = zs.flat_map(move |z| {
            let first = (self.phase + INTERLEAVE - (ys.start + z) % INTERLEAVE) % INTERLEAVE;
            (ys.start + first..ys.end).step_by(INTERLEAVE as usize).map(move |y| [y, z])
        });
        (0..).zip(rows).skip(self.rows as usize)
    }
}

/// The part of the space beside a body's straight side that the feed leads away from: nothing is cut there. What moves
/// neither toward the side nor off one of its ends comes no nearer to the body.
struct TrailingSide {
    tip: Vec3,
    /// Unit.
    axis: Vec3,
    /// Part of the feed across the axis, unit.
    ahead: Vec3,
    /// Lowest and highest coordinate along the axis from the tip, mm.
    along: [f32; 2],
    /// Change of the coordinates ahead and along the axis per step along x.
    ahead_rise: Rise,
    along_rise: Rise,
}

/// Feed into a tissue, mm, below which the rounding of distances may make a place beside the tool count as one before it.
const CLEAR_FEED: f32 = 1e-4;

/// Distance by which the trailing side is taken smaller than it is, mm: more than rounding.
const TRAILING_MARGIN: f32 = 1e-4;

impl TrailingSide {
    /// A trailing side that a row does not meet.
    const NOWHERE: [f32; 2] = [f32::INFINITY, f32::NEG_INFINITY];

    /// `advance`: into each tissue, mm, by label. `None` if there is no such side, or the feed is too small to tell.
    fn of(body: &Body, increment: &CutIncrement, advance: &[f32; 256]) -> Option<TrailingSide> {
        let side = body.straight_side()?;
        let axis = increment.orientation * Vec3::Z;
        let (feed_length, climb) = (increment.feed.length(), increment.feed.dot(axis));
        let least = advance.iter().copied().filter(|&advance| advance > 0.0).fold(increment.deepest, f32::min);
        if feed_length * least < CLEAR_FEED * increment.deepest {
            return None;
        }
        // A leaning side also cuts by its feed along the axis.
        if side.sine * climb > 0.5 * MIN_FACING_COSINE * feed_length {
            return None;
        }
        let ahead = (increment.feed - axis * climb).try_normalize()?;
        let [low, high] = side.z;
        let margin = climb.abs() + TRAILING_MARGIN;
        Some(TrailingSide {
            tip: increment.tip,
            axis,
            ahead,
            along: [low + margin, high - margin],
            ahead_rise: Rise::of(ahead.x),
            along_rise: Rise::of(axis.x),
        })
    }

    /// The part of a line along x through `from` that is on the trailing side, as signed distances from that point.
    fn along_row(&self, from: Vec3) -> [f32; 2] {
        let out = from - self.tip;
        let behind = self.ahead_rise.below(out.dot(self.ahead) + TRAILING_MARGIN);
        let along = out.dot(self.axis);
        let above = self.along_rise.above(along - self.along[0]);
        let under = self.along_rise.below(along - self.along[1]);
        [behind[0].max(above[0]).max(under[0]), behind[1].min(above[1]).min(under[1])]
    }
}

/// Change of a linear quantity along x, as its reciprocal: infinite if it does not change.
#[derive(Clone, Copy)]
struct Rise(f32);

impl Rise {
    fn of(rise: f32) -> Rise {
        Rise(if rise.abs() < 1e-6 { f32::INFINITY } else { rise.recip() })
    }

    /// The interval of x in which the quantity, `at` at the origin, is negative.
    fn below(self, at: f32) -> [f32; 2] {
        let zero = -at * self.0;
        match self.0 {
            f32::INFINITY if at < 0.0 => [f32::NEG_INFINITY, f32::INFINITY],
            f32::INFINITY => TrailingSide::NOWHERE,
            inverse if inverse > 0.0 => [f32::NEG_INFINITY, zero],
            _ => [zero, f32::INFINITY],
        }
    }

    /// The interval in which it is positive.
    fn above(self, at: f32) -> [f32; 2] {
        let opposite = if self.0 == f32::INFINITY { self } else { Rise(-self.0) };
        opposite.below(-at)
    }
}

/// An interval without the part of it that another takes from one of its ends; `None` if nothing is left.
fn without([low, high]: [f32; 2], taken: [f32; 2]) -> Option<[f32; 2]> {
    let low = if taken[0] <= low { low.max(taken[1]) } else { low };
    let high = if taken[1] >= high { high.min(taken[0]) } else { high };
    (low < high).then_some([low, high])
}

/// Cylinder about the shaft that contains everything an increment of a body can reach, tooth space.
struct SweptCylinder {
    middle: Vec3,
    /// Unit.
    axis: Vec3,
    radius: f32,
    half_length: f32,
    /// Part of x across the axis, its squared length and the reciprocal of that.
    drift: Vec3,
    drift_squared: f32,
    drift_inverse: f32,
}

impl SweptCylinder {
    fn of(body: &Body, increment: &CutIncrement, margin: f32) -> SweptCylinder {
        let (radius, [low, high]) = body.head_cylinder();
        let axis = increment.orientation * Vec3::Z;
        // In a harder tissue the body advances less, so the cylinder is centred at half the advance.
        let middle = increment.tip + increment.feed * 0.5 + axis * (0.5 * (low + high));
        let margin = margin + 0.5 * increment.feed.length();
        let drift = Vec3::X - axis * axis.x;
        SweptCylinder {
            middle,
            axis,
            radius: radius + margin,
            half_length: 0.5 * (high - low) + margin,
            drift,
            drift_squared: drift.length_squared(),
            drift_inverse: drift.length_squared().recip(),
        }
    }

    /// mm³
    fn volume(&self) -> f32 {
        2.0 * std::f32::consts::PI * self.radius * self.radius * self.half_length
    }

    /// Bounding box.
    fn extent(&self) -> Aabb {
        let aside = |along: f32| self.half_length * along.abs() + self.radius * (1.0 - along * along).max(0.0).sqrt();
        let half = Vec3::new(aside(self.axis.x), aside(self.axis.y), aside(self.axis.z));
        Aabb::new(self.middle - half, self.middle + half)
    }

    /// Entry and exit of a line along x through `from`, as signed distances from that point.
    fn clip_row(&self, from: Vec3) -> Option<[f32; 2]> {
        let out = from - self.middle;
        let (along, climb) = (out.dot(self.axis), self.axis.x);
        let (mut low, mut high) = (f32::NEG_INFINITY, f32::INFINITY);
        if climb.abs() > 1e-4 {
            let (near, far) = ((-self.half_length - along) / climb, (self.half_length - along) / climb);
            (low, high) = (near.min(far), near.max(far));
        } else if along.abs() > self.half_length {
            return None;
        }
        let aside = out - self.axis * along;
        let (a, b, c) = (self.drift_squared, self.drift.dot(aside), aside.length_squared() - self.radius * self.radius);
        if a > 1e-6 {
            let inside = b * b - a * c;
            if inside <= 0.0 {
                return None;
            }
            let (middle, half) = (-b * self.drift_inverse, inside.sqrt() * self.drift_inverse);
            (low, high) = (low.max(middle - half), high.min(middle + half));
        } else if c > 0.0 {
            return None;
        }
        (low < high).then_some([low, high])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::touch::{EDGE_RADIUS, Material, Profile, WorkingEnd};
    use crate::volume::Grid;

    /// Digs to the full feed with a working end whose centre is at the surface of a block. Returns the greatest number
    /// of voxels examined in a tick, the number of ticks and the solid voxels removed.
    fn dig(end: WorkingEnd, spacing: f32) -> (usize, u32, usize) {
        let tissue = Label(1);
        let dims = [3.4, 3.4, 5.0].map(|extent| (extent / spacing) as u32);
        let band = 1.5 * spacing;
        let mut block = Volume::from_distance(Grid::centred(dims, Vec3::splat(spacing)), band, |p| (p.x, tissue));
        let material = Material { stiffness: 1.0, cut_force: Some(0.1), ..Material::ZERO };
        let materials = Materials::new().with(tissue, material);
        let law = CuttingLaw::Threshold;
        let mut carver = Carver::new(CarvingParameters { dwell: 1.0, dwell_share: 1.0, max_feed: 20.0, law });
        let instrument = Instrument::new(end, true);
        let contact_force = ContactForce { force: Vec3::X, spring: 1.0, stiffness: 1.0 };
        let tip = Vec3::new(0.0, 0.0, -2.0);
        let load = ToolLoad { tip, hand: tip - Vec3::X, orientation: Quat::IDENTITY, contact_force, label: tissue };
        let (mut examined, mut ticks, mut removed) = (0, 0, 0);
        loop {
            assert!(carver.cut(&mut block, &instrument, &materials, &load));
            examined = examined.max(carver.examined);
            removed += carver.edits().iter().filter(|edit| edit.removes()).count();
            ticks += 1;
            if carver.increment.is_none() {
                return (examined, ticks, removed);
            }
        }
    }

    /// Numbers from −1 to 1, always the same.
    fn random_numbers(seed: u32) -> impl FnMut() -> f32 {
        let mut state = seed;
        move || {
            state = state.wrapping_mul(1664525).wrapping_add(1013904223);
            (state >> 8) as f32 / (1 << 24) as f32 * 2.0 - 1.0
        }
    }

    #[test]
    fn nothing_is_cut_on_the_trailing_side() {
        // Aim: what is left out would not have been cut. Method: rows beside burs that are fed in random directions; every
        // point of a row that is on the trailing side comes no nearer to the bur, whatever part of the feed its tissue allows.
        let mut random = random_numbers(7);
        let profiles = [
            Profile::frustum(0.5, 0.5, 4.0, [EDGE_RADIUS; 2]),
            Profile::frustum(0.3, 0.45, 4.2, [EDGE_RADIUS; 2]),
            Profile::frustum(0.6, 0.5, 4.0, [EDGE_RADIUS; 2]),
            Profile::round_ended(0.4, 0.5, 4.0),
            Profile::round_ended(0.5, 0.3, 4.0),
        ];
        let (mut left_out, mut cut) = (0, 0);
        for (round, profile) in profiles.iter().cycle().take(5000).enumerate() {
            let body = Body::revolved(profile.clone(), None);
            let mut direction = || Vec3::new(random(), random(), random()).normalize_or(Vec3::X);
            // Upright, along x or in any direction.
            let axis = [Vec3::Z, Vec3::X, direction()][round % 3];
            let tip = direction();
            let feed = direction() * 0.06 * [1.0, 0.1, 0.01, 1e-3, 1e-4, 1e-5][round / 15 % 6];
            let orientation = Quat::from_rotation_arc(Vec3::Z, axis);
            let deepest = feed.length();
            let increment = CutIncrement { tip, feed, deepest, run_out: RUN_OUT, radius: 0.0, orientation };
            let mut advance = [0.0; 256];
            (advance[1], advance[2]) = (deepest, 0.25 * deepest);
            let Some(trailing) = TrailingSide::of(&body, &increment, &advance) else { continue };
            let from = tip + axis * (2.0 + 2.2 * random()) + Vec3::new(-4.0, 0.7 * random(), 0.7 * random());
            let [low, high] = trailing.along_row(from);
            for step in 0..80 {
                let x = step as f32 * 0.1;
                let at = from + Vec3::X * x;
                let distance = |advance: f32| body.head_distance(orientation.conjugate() * (at - tip - feed * advance));
                let gain = |share: f32| distance(0.0) - distance(share) - MIN_FACING_COSINE * deepest * share;
                let is_cut = [0.25, 1.0].into_iter().any(|share| gain(share) > 0.0);
                if low < x && x < high && distance(0.0) < 0.45 {
                    assert!(!is_cut, "{profile:?} {increment:?} {at}: {} {}", gain(0.25), gain(1.0));
                    left_out += 1;
                } else if is_cut {
                    cut += 1;
                }
            }
        }
        assert!(left_out > 5000 && cut > 5000, "{left_out} left out, {cut} cut");
    }

    /// Removes in one phase what a body's increment reaches, voxel by voxel, without any shortcut.
    fn carved_plainly(
        volume: &mut Volume,
        body: &Body,
        carver: &Carver,
        increment: &CutIncrement,
        phase: u32,
    ) -> Vec<Edit> {
        let (grid, band) = (*volume.grid(), volume.half_band());
        let placed = PlacedIncrement::new(increment, grid.spacing.x);
        let mut edits = Vec::new();
        for cell in grid.cells().filter(|[_, y, z]| (y + z) % INTERLEAVE == phase) {
            let before = volume.voxel(grid.index(cell));
            let share = carver.advance[usize::from(before.label.0)] / increment.deepest;
            if before.density == Density::EMPTY || share <= 0.0 {
                continue;
            }
            // As the carver counts along a row, so that roundings are the same: from the first cell within reach.
            let cylinder = SweptCylinder::of(body, increment, increment.run_out + band);
            let [xs, ys, zs] = grid.cells_within(cylinder.extent().low, cylinder.extent().high);
            if !(xs.contains(&cell[0]) && ys.contains(&cell[1]) && zs.contains(&cell[2])) {
                continue;
            }
            let row = grid.centre([xs.start, cell[1], cell[2]]);
            let first = placed.handle_from_tooth * (row - increment.tip - increment.feed);
            let here = first + placed.along * (cell[0] - xs.start) as f32;
            let distance = body.head_distance(here + placed.feed * (1.0 - share));
            let remaining = density_at_distance(increment.run_out - distance, band);
            let gain = body.head_distance(here + placed.feed) - distance;
            if remaining < before.density && gain > MIN_FACING_COSINE * placed.feed_length * share {
                edits.push(volume.set_cell(cell, Voxel { density: remaining, ..before }));
            }
        }
        edits
    }

    #[test]
    fn shortcuts_change_no_voxel() {
        // Aim: recordings replay bit by bit. Method: burs in random poses and with feeds of any length in matter of two tissues
        // that they have partly removed; each phase gives the very edits of a loop over all voxels.
        let mut random = random_numbers(11);
        let profiles = [
            Profile::frustum(0.5, 0.5, 2.4, [EDGE_RADIUS; 2]),
            Profile::frustum(0.3, 0.4, 2.2, [EDGE_RADIUS; 2]),
            Profile::round_ended(0.4, 0.5, 2.4),
            Profile::flame(0.5, 2.4, 0.1),
        ];
        let mut edited = 0;
        for round in 0..240 {
            let spacing = [Vec3::splat(0.09), Vec3::splat(0.13), Vec3::new(0.1, 0.08, 0.15)][round % 3];
            let dims = std::array::from_fn(|a| (3.6 / spacing[a]) as u32);
            let label = |p: Vec3| if p.x + p.y > 0.0 { Label(1) } else { Label(2) };
            let top = 0.8 * random();
            let band = 1.5 * spacing.max_element();
            let grid = Grid::centred(dims, spacing);
            let mut volume = Volume::from_distance(grid, band, |p| (p.z - top, label(p)));
            let body = Body::revolved(profiles[round % 4].clone(), None);
            let mut vector = || Vec3::new(random(), random(), random());
            let axis = if round % 2 == 0 { Vec3::Z } else { vector().normalize_or(Vec3::Z) };
            let orientation = Quat::from_rotation_arc(Vec3::Z, axis);
            let tip = vector() - axis;
            let law = CuttingLaw::Threshold;
            let mut carver = Carver::new(CarvingParameters { dwell: 1.0, dwell_share: 1.0, max_feed: 20.0, law });
            // The first increment clears the place where the bur is.
            for length in [0.06, 0.06 * [1.0, 0.1, 1e-2, 1e-4, 1e-6][round % 5]] {
                let feed = vector().normalize_or(Vec3::X) * length;
                (carver.advance[1], carver.advance[2]) = (length, [1.0, 0.3, 0.0][round / 4 % 3] * length);
                let increment = CutIncrement { tip, feed, deepest: length, run_out: RUN_OUT, radius: 0.0, orientation };
                for phase in 0..INTERLEAVE {
                    let mut plain = volume.clone();
                    let expected = carved_plainly(&mut plain, &body, &carver, &increment, phase);
                    carver.edits.clear();
                    carver.examined = 0;
                    assert_eq!(carver.carve_body(&mut volume, &body, &increment, CutProgress { phase, rows: 0 }), None);
                    assert_eq!(carver.edits, expected, "round {round}, feed {feed}");
                    edited += expected.len();
                }
            }
        }
        assert!(edited > 20_000, "{edited}");
    }

    #[test]
    fn a_bite_is_spread_over_ticks_whatever_its_size() {
        // Aim: no tick examines more voxels than its limit allows, a large bite is finished all the same, and what it
        // removes does not depend on the number of ticks. Method: half of a long and of a thick working end in matter,
        // from coarse voxels to very fine ones.
        let long = || {
            let profile = Profile::frustum(0.8, 0.8, 4.0, [EDGE_RADIUS; 2]);
            WorkingEnd::Body(std::sync::Arc::new(Body::revolved(profile, None)))
        };
        for end in [long(), WorkingEnd::Ball { radius: 1.4 }] {
            let mm3 = [0.17, 0.086, 0.043, 0.02].map(|spacing| {
                let (examined, ticks, removed) = dig(end.clone(), spacing);
                println!("{spacing} mm: {examined} voxels in a tick, {ticks} ticks, {removed} removed");
                assert!(examined < EXAMINED_MAX + EXAMINED_MAX / 16, "{spacing} mm: {examined}");
                assert!(
                    if spacing > 0.08 { ticks == INTERLEAVE } else { ticks >= INTERLEAVE },
                    "{spacing} mm: {ticks} ticks"
                );
                removed as f32 * spacing.powi(3)
            });
            let finest = mm3[3];
            assert!(mm3[1..].iter().all(|mm3| (mm3 / finest - 1.0).abs() < 0.05), "{mm3:?}");
        }
    }
}
