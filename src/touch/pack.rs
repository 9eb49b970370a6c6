//! What a carrier lays down and a condenser packs.
//!
//! Takes how an instrument is pressed, and the filling that the stage gives. Gives the changed voxels, in order.
//!
//! A carrier lays so many mm³ a second while it is pressed: the surface under its face moves outward, as far as that volume
//! reaches. New matter begins at matter, never in the middle of nothing, and the surface keeps the width of its ramp. It is laid
//! where the face stands as well, which pushes the instrument back, as a plug of amalgam does. What is laid with less than the
//! condensing force keeps voids: balls on a lattice of places, so that the same hand leaves the same voids. A condenser that is
//! pressed harder closes those under its face; the matter for it comes from the surface, which sinks by as much.

use super::carve::Press;
use super::instrument::Instrument;
use super::matter::Matter;
use crate::frame::Vec3;
use crate::tick::TICK_S;
use crate::volume::{Density, Edit, ISO, Label, Voxel, ramp};

/// A material that can be laid and condensed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Filling {
    pub label: Label,
    /// Spring force from which it leaves the carrier, N.
    pub least_force: f32,
    /// Spring force from which nothing that is laid keeps voids, and from which a condenser closes them, N.
    pub condense_force: f32,
    /// Share of its volume that voids take when it is laid with the least force, 0 to [`VOIDS_MOST`].
    pub void_share: f32,
}

/// What an instrument does with a filling.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Packs {
    /// What it lays down while it is pressed, mm³/s; 0: nothing.
    pub rate: f32,
    /// Whether it closes voids.
    pub condenses: bool,
}

/// Distance between places that may keep a void, and a void's radius, mm: what is seen on a bitewing (0.2–0.5).
const VOID_APART: f32 = 0.5;
const VOID_RADIUS: f32 = 0.2;

/// Greatest share of voids: every place of the lattice keeps one.
pub const VOIDS_MOST: f32 = 0.268;

/// How far ahead of a face matter is laid, mm: a load falls and is pushed as deep as a usual cavity.
const LAID_AHEAD: f32 = 2.5;

/// How far a condenser acts below its face, mm: increments of amalgam are condensed at 1 mm.
const CONDENSED_AHEAD: f32 = 1.2;

/// What lies lower than the face by this fills first, mm; at the face's own level only a share of that is laid. So a load finds
/// its level before it pushes the carrier back.
const LEVEL: f32 = 0.15;
const AT_FACE: f32 = 0.1;

/// How far beside the face a load is squeezed out below it, mm: into the corners that a round face leaves.
const SPREAD: f32 = 0.4;

/// How far behind the face matter is laid and pushes it back, mm: more than a bite's advance at any voxel size.
const LAID_BEHIND: f32 = 0.2;

/// A bite is carried out over so many ticks, every so many-th row of voxels in each, as a bur's is.
const SHARES: u32 = 3;

/// Fastest that a surface rises below the face, mm/s; at the face a tenth of it: a hand follows, and the tip is never thrown.
const RISE_MOST: f32 = 20.0;

/// Fastest that a surface sinks under a condenser, mm/s.
const SINK_MOST: f32 = 6.0;

/// Density that a closing void gains in each bite: closed within a tenth of a second.
const CLOSING: f32 = 0.03;

/// Voids close no faster than the surface pays for them: within this, as mm that it has still to sink.
const OWED_MOST: f32 = 0.01;

/// Work of so many ticks is saved up at most: a slow bite must change a stored density.
const SAVED_TICKS: f32 = 100.0;

/// Bounds of the estimate of the surface that rises, as shares of the face.
const AREA: [f32; 2] = [0.05, 4.0];

/// Voxels that one tick may change.
const EDITS_MAX: usize = 1 << 15;

/// The state of packing: what is still to be laid or to sink, and scratch for this tick's edits.
#[derive(Clone, Debug)]
pub struct Packer {
    /// Shares of the bite that are done.
    done: u32,
    bite: Bite,
    /// mm³ that the carrier has given and that is not laid yet.
    saved: f32,
    /// mm³ by which the surface has still to sink for what closed voids have taken.
    owed: f32,
    /// Estimate of the rising surface, mm²; 0 before the first bite.
    area: f32,
    /// What the bite has moved so far, mm³.
    moved: f32,
    edits: Vec<Edit>,
}

/// One bite's advance and what it is made with.
#[derive(Clone, Copy, Debug, Default)]
struct Bite {
    /// How far the surface moves, mm.
    rise: f32,
    /// Share of places that keep a void.
    voids: f32,
}

/// A face and what lies before it: handle space and back.
struct Face<'a> {
    instrument: &'a Instrument,
    press: &'a Press,
    /// Unit, tooth space, from the face toward the hand.
    axis: Vec3,
    radius: f32,
}

impl Packer {
    pub fn new() -> Packer {
        Packer {
            done: 0,
            bite: Bite::default(),
            saved: 0.0,
            owed: 0.0,
            area: 0.0,
            moved: 0.0,
            edits: Vec::with_capacity(EDITS_MAX),
        }
    }

    /// This tick's changes, in the order they were made.
    pub fn edits(&self) -> &[Edit] {
        &self.edits
    }

    /// A tick in which nothing is packed.
    pub fn rest(&mut self) {
        self.edits.clear();
        // What closed voids have taken is still owed to them when a condenser comes back.
        (self.done, self.saved, self.area, self.moved) = (0, 0.0, 0.0, 0.0);
    }

    /// Packs with an instrument in contact, if it is pressed hard enough.
    pub fn pack(
        &mut self,
        matter: &mut Matter,
        instrument: &Instrument,
        packs: &Packs,
        filling: &Filling,
        press: &Press,
    ) {
        self.edits.clear();
        let force = press.pull.spring;
        let is_laying = packs.rate > 0.0 && force >= filling.least_force;
        let is_condensing = packs.condenses && force >= filling.condense_force;
        if !is_laying && !is_condensing {
            return self.rest();
        }
        let radius = instrument.face_radius();
        let face = Face { instrument, press, axis: press.orientation * Vec3::Z, radius };
        if is_condensing {
            self.close_voids(matter, &face, filling);
            self.sink(matter, &face, filling);
        }
        if is_laying {
            self.lay(matter, &face, packs, filling);
        }
    }

    /// Lays this tick's share of a bite.
    fn lay(&mut self, matter: &mut Matter, face: &Face, packs: &Packs, filling: &Filling) {
        let tick = packs.rate * TICK_S as f32;
        self.saved = (self.saved + tick).min(SAVED_TICKS * tick);
        if self.done == 0 {
            let disc = core::f32::consts::PI * face.radius * face.radius;
            // What the last bite has laid tells how large the rising surface is.
            if self.area <= 0.0 {
                self.area = disc;
            } else if self.bite.rise > 0.0 && self.moved > 0.0 {
                self.area = (self.moved / self.bite.rise).clamp(AREA[0] * disc, AREA[1] * disc);
            }
            let most = RISE_MOST * TICK_S as f32 * SHARES as f32;
            let short = filling.condense_force - face.press.pull.spring;
            let span = (filling.condense_force - filling.least_force).max(1e-6);
            self.bite = Bite {
                rise: (self.saved / self.area).clamp(0.0, most),
                voids: filling.void_share / VOIDS_MOST * (short / span).clamp(0.0, 1.0),
            };
            self.moved = 0.0;
        }
        if self.bite.rise > 0.0 {
            let laid = self.raise(matter, face, filling);
            self.moved += laid;
            self.saved -= laid;
        }
        self.done = (self.done + 1) % SHARES;
    }

    /// Moves the surface before the face outward; returns the volume, mm³.
    fn raise(&mut self, matter: &mut Matter, face: &Face, filling: &Filling) -> f32 {
        let (grid, band) = (*matter.volume.grid(), matter.volume.band());
        let Some([xs, ys, zs]) = face.cells(matter, SPREAD, [-LAID_AHEAD, LAID_BEHIND]) else { return 0.0 };
        let per_mm = 0.5 / band;
        let (share, voxel_mm3) = (self.done, grid.voxel_mm3() as f32);
        let mut laid = 0.0;
        for z in zs {
            for y in ys.clone().filter(|y| (y + z) % SHARES == share) {
                for x in xs.clone() {
                    let cell = [x, y, z];
                    let index = grid.index(cell);
                    let before = matter.volume.voxel(index);
                    if before.density == Density::FULL || self.edits.len() >= EDITS_MAX {
                        continue;
                    }
                    let at = grid.centre(cell);
                    let share = face.share_of_load(at);
                    if share <= 0.0 {
                        continue;
                    }
                    let reached = reached(matter, cell, before.density.unit(), per_mm);
                    if reached <= 0.0 {
                        continue;
                    }
                    let wanted = reached + self.bite.rise * share * per_mm;
                    let allowed = wanted.min(most_beside_voids(at, self.bite.voids, band));
                    let density = Density::from_unit(allowed);
                    if density <= before.density || matter.around.iter().any(|s| s.distance(at) < 0.0) {
                        continue;
                    }
                    let label = if before.density.is_solid() { before.label } else { filling.label };
                    self.edits.push(matter.volume.set_cell(cell, Voxel { density, label }));
                    laid += (density.unit() - before.density.unit()) * voxel_mm3;
                }
            }
        }
        laid
    }

    /// Closes what is hollow below the face and covered by the filling.
    fn close_voids(&mut self, matter: &mut Matter, face: &Face, filling: &Filling) {
        let (grid, band) = (*matter.volume.grid(), matter.volume.band());
        if self.owed > OWED_MOST * core::f32::consts::PI * face.radius * face.radius {
            return;
        }
        let Some([xs, ys, zs]) = face.cells(matter, 0.0, [-CONDENSED_AHEAD, 0.0]) else { return };
        let share = self.done;
        let voxel_mm3 = grid.voxel_mm3() as f32;
        for z in zs {
            for y in ys.clone().filter(|y| (y + z) % SHARES == share) {
                for x in xs.clone() {
                    let cell = [x, y, z];
                    let before = matter.volume.voxel(grid.index(cell));
                    let is_hollow = before.label == filling.label || before.density == Density::EMPTY;
                    if before.density == Density::FULL || !is_hollow || self.edits.len() >= EDITS_MAX {
                        continue;
                    }
                    let at = grid.centre(cell);
                    // The surface's own ramp is no void.
                    let is_below = {
                        let (aside, along) = face.seen(at);
                        aside < face.radius && along < -band
                    };
                    if !is_below || !face.is_covered(matter, at, filling.label) {
                        continue;
                    }
                    let density = Density::from_unit(before.density.unit() + CLOSING);
                    self.edits.push(matter.volume.set_cell(cell, Voxel { density, label: filling.label }));
                    self.owed += (density.unit() - before.density.unit()) * voxel_mm3;
                }
            }
        }
    }

    /// Lets the surface under the face sink by what closed voids have taken.
    fn sink(&mut self, matter: &mut Matter, face: &Face, filling: &Filling) {
        let (grid, band) = (*matter.volume.grid(), matter.volume.band());
        let share = self.done;
        if self.owed <= 0.0 {
            self.done = (share + 1) % SHARES;
            return;
        }
        let most = SINK_MOST * TICK_S as f32 * SHARES as f32;
        let area = core::f32::consts::PI * face.radius * face.radius;
        let down = face.axis * -(self.owed / area).min(most);
        let voxel_mm3 = grid.voxel_mm3() as f32;
        if let Some([xs, ys, zs]) = face.cells(matter, band, [-band, LAID_BEHIND + band]) {
            for z in zs {
                for y in ys.clone().filter(|y| (y + z) % SHARES == share) {
                    for x in xs.clone() {
                        let cell = [x, y, z];
                        let before = matter.volume.voxel(grid.index(cell));
                        if before.label != filling.label || self.owed <= 0.0 || self.edits.len() >= EDITS_MAX {
                            continue;
                        }
                        let distance = face.distance(grid.centre(cell) - down);
                        let density = ramp(-distance, band);
                        if density < before.density {
                            self.edits.push(matter.volume.set_cell(cell, Voxel { density, ..before }));
                            self.owed -= (before.density.unit() - density.unit()) * voxel_mm3;
                        }
                    }
                }
            }
        }
        self.done = (share + 1) % SHARES;
    }
}

impl Default for Packer {
    fn default() -> Self {
        Packer::new()
    }
}

impl Face<'_> {
    /// Distance from the shaft and height along it of a point of tooth space, seen from the face.
    fn seen(&self, point_in_tooth: Vec3) -> (f32, f32) {
        let out = point_in_tooth - self.press.tip;
        let along = out.dot(self.axis);
        ((out - self.axis * along).length(), along)
    }

    /// How much of the load a place gets, 0 to 1.
    fn share_of_load(&self, point_in_tooth: Vec3) -> f32 {
        let (aside, along) = self.seen(point_in_tooth);
        if !(-LAID_AHEAD..=LAID_BEHIND).contains(&along) || (along > 0.0 && aside > self.radius) {
            return 0.0;
        }
        let beside = ((self.radius + SPREAD - aside) / SPREAD).clamp(0.0, 1.0);
        beside * (-along / LEVEL).clamp(AT_FACE, 1.0)
    }

    /// Signed distance of a point of tooth space from the working end, mm.
    fn distance(&self, point_in_tooth: Vec3) -> f32 {
        let at = self.press.orientation.conjugate() * (point_in_tooth - self.press.tip);
        self.instrument.end_distance(at)
    }

    /// Cells of the box around a stretch of the shaft and so far beside the face; the grid's outermost are left out, since matter must end within it.
    fn cells(&self, matter: &Matter, beside: f32, [from, to]: [f32; 2]) -> Option<[core::ops::Range<u32>; 3]> {
        let grid = matter.volume.grid();
        let (a, b) = (self.press.tip + self.axis * from, self.press.tip + self.axis * to);
        let aside = |along: f32| (self.radius + beside) * (1.0 - along * along).max(0.0).sqrt();
        let half = Vec3::new(aside(self.axis.x), aside(self.axis.y), aside(self.axis.z));
        let cells = grid.cells_within(a.min(b) - half, a.max(b) + half);
        let mut axis = 0;
        let inner = cells.map(|range| {
            let inner = range.start.max(1)..range.end.min(grid.dims[axis] - 1);
            axis += 1;
            inner
        });
        inner.iter().all(|range| !range.is_empty()).then_some(inner)
    }

    /// True where the filling lies between a point and the face.
    fn is_covered(&self, matter: &Matter, point_in_tooth: Vec3, label: Label) -> bool {
        let grid = matter.volume.grid();
        let step = grid.spacing.min_element();
        let height = (self.press.tip - point_in_tooth).dot(self.axis);
        (1..=(height / step) as u32).any(|i| {
            let above = grid.nearest(point_in_tooth + self.axis * (i as f32 * step));
            above.is_some_and(|cell| matter.volume.tissue(grid.index(cell)) == label)
        })
    }
}

/// The density that a voxel has, or would have if ramps reached as far out as they are wide inside: what its neighbours
/// tell of the surface's distance.
fn reached(matter: &Matter, [x, y, z]: [u32; 3], own: f32, per_mm: f32) -> f32 {
    let volume = &matter.volume;
    let grid = volume.grid();
    let spacing = grid.spacing;
    // Well inside the ramp the voxel knows better than its neighbours.
    if own > ISO * 0.7 {
        return own;
    }
    let density = |[x, y, z]: [u32; 3]| volume.densities()[grid.index([x, y, z])];
    // Most of the air before a face is far from matter: six looks tell.
    let beside = [[x - 1, y, z], [x + 1, y, z], [x, y - 1, z], [x, y + 1, z], [x, y, z - 1], [x, y, z + 1]];
    if own == 0.0 && beside.into_iter().all(|cell| density(cell) == Density::EMPTY) {
        return 0.0;
    }
    let mut best = own;
    for k in 0..3u32 {
        for j in 0..3u32 {
            for i in 0..3u32 {
                let density = density([x + i - 1, y + j - 1, z + k - 1]);
                if density == Density::EMPTY {
                    continue;
                }
                let way = Vec3::new(i as f32 - 1.0, j as f32 - 1.0, k as f32 - 1.0) * spacing;
                best = best.max(density.unit() - way.length() * per_mm);
            }
        }
    }
    best
}

/// The most density that voids leave to a place: 1 where there is none.
fn most_beside_voids(at: Vec3, share_of_places: f32, band: f32) -> f32 {
    if share_of_places <= 0.0 {
        return 1.0;
    }
    let place = (at / VOID_APART).floor();
    if drawn(place) >= share_of_places {
        return 1.0;
    }
    let middle = (place + 0.5) * VOID_APART;
    0.5 - 0.5 * (VOID_RADIUS - at.distance(middle)) / band
}

/// A number of 0–1 for a place of the lattice (after Teschner and others 2003, mixed by SplitMix64): the same on every machine.
fn drawn(place: Vec3) -> f32 {
    let [x, y, z] = place.to_array().map(|v| v as i32 as u32);
    let mut bits = u64::from(x.wrapping_mul(73_856_093) ^ y.wrapping_mul(19_349_663)) << 32;
    bits ^= u64::from(z.wrapping_mul(83_492_791));
    bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    bits ^= bits >> 31;
    (bits >> 40) as f32 / (1u32 << 24) as f32
}
