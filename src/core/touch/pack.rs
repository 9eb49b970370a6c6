//! Placement of filling material by a carrier, and its condensation.
//!
//! Takes the load on an instrument and the selected filling. Gives the changed voxels, in order.
//!
//! A carrier delivers a volume per second while it is pressed: the surface under its face moves outward by as much as
//! that volume fills. New material grows only from existing matter, never in free space, and the surface keeps the
//! width of its density ramp. Material is also laid where the face is, which pushes the instrument back, as a plug of
//! amalgam does. Material laid with less than the condensing force contains voids: balls on a fixed lattice, so that
//! the same hand motion leaves the same voids. A condenser pressed harder closes the voids under its face; the
//! material for them comes from the surface, which sinks by the same volume.

use super::carve::ToolLoad;
use super::collision_scene::CollisionScene;
use super::instrument::{Instrument, PackingTip};
use crate::frame::Vec3;
use crate::tick::TICK_S;
use crate::volume::{Density, Edit, ISO, Label, Voxel, density_at_distance};

/// Filling material that can be placed and condensed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FillingMaterial {
    pub label: Label,
    /// Spring force from which the material leaves the carrier, N.
    pub min_force: f32,
    /// Spring force from which material is laid without voids, and from which a condenser closes voids, N.
    pub condense_force: f32,
    /// Volume fraction of voids when the material is laid with the least force, 0 to [`MAX_VOID_SHARE`].
    pub void_share: f32,
}

/// Spacing of the lattice of possible voids, and radius of a void, mm: the size of voids visible on bitewings
/// (0.2–0.5).
const VOID_SPACING: f32 = 0.5;
const VOID_RADIUS: f32 = 0.2;

/// Greatest volume fraction of voids, with a void at every point of the lattice.
pub const MAX_VOID_SHARE: f32 = 0.268;

/// Distance ahead of the face up to which material is laid, mm: a load is pushed to the depth of a usual cavity.
const LAID_AHEAD: f32 = 2.5;

/// Distance below its face up to which a condenser acts, mm: amalgam is condensed in increments of 1 mm.
const CONDENSED_AHEAD: f32 = 1.2;

/// Depth below the face, mm, from which on points receive the full load; at the level of the face they receive only
/// the fraction [`LOAD_AT_FACE`]. A load therefore levels itself before it pushes the carrier back.
const LOAD_FALLOFF: f32 = 0.15;
const LOAD_AT_FACE: f32 = 0.1;

/// Distance beyond the edge of the face to which a load spreads below it, mm: into corners that a round face cannot
/// reach.
const SPREAD: f32 = 0.4;

/// Distance behind the face up to which material is laid and pushes the face back, mm: more than the advance of an
/// increment at any voxel size.
const LAID_BEHIND: f32 = 0.2;

/// Ticks over which an increment is spread, each processing every third row of voxels, as for a bur.
const INTERLEAVE: u32 = 3;

/// Fastest rise of a surface below the face, mm/s; at the face a tenth of it. A hand can follow it, and the tip is
/// never thrown back.
const MAX_RISE_SPEED: f32 = 20.0;

/// Fastest sinking of a surface under a condenser, mm/s.
const MAX_SINK_SPEED: f32 = 6.0;

/// Density that a closing void gains per increment: closed within a tenth of a second.
const CLOSING_STEP: f32 = 0.03;

/// Pending sinking of the surface, mm, above which no further voids are closed, so that the surface keeps pace.
const MAX_PENDING_SINK: f32 = 0.01;

/// Ticks of delivered volume that are saved up at most: a slow increment must still change a stored density.
const SAVED_TICKS: f32 = 100.0;

/// Bounds of the estimated area of the rising surface, as fractions of the face.
const AREA_BOUNDS: [f32; 2] = [0.05, 4.0];

/// Maximum number of voxels changed in one tick.
const EDITS_MAX: usize = 1 << 15;

/// Packing state: volumes still to be laid or to sink, and the edits of this tick.
#[derive(Clone, Debug)]
pub struct Packer {
    /// Number of phases of the increment that are done.
    phase: u32,
    increment: LayIncrement,
    /// Volume delivered by the carrier and not laid yet, mm³.
    pending_volume: f32,
    /// Volume by which the surface has still to sink for voids already closed, mm³.
    pending_sink: f32,
    /// Estimated area of the rising surface, mm²; 0 before the first increment.
    area: f32,
    /// Volume laid by the current increment so far, mm³.
    moved: f32,
    edits: Vec<Edit>,
}

/// Increment in which material is laid.
#[derive(Clone, Copy, Debug, Default)]
struct LayIncrement {
    /// Displacement of the surface, mm.
    rise: f32,
    /// Fraction of the lattice points that keep a void.
    void_share: f32,
}

/// Face of an instrument and the space in front of it.
struct ToolFace<'a> {
    instrument: &'a Instrument,
    load: &'a ToolLoad,
    /// Unit vector from the face toward the hand, tooth space.
    axis: Vec3,
    radius: f32,
}

impl Packer {
    pub fn new() -> Packer {
        Packer {
            phase: 0,
            increment: LayIncrement::default(),
            pending_volume: 0.0,
            pending_sink: 0.0,
            area: 0.0,
            moved: 0.0,
            edits: Vec::with_capacity(EDITS_MAX),
        }
    }

    /// Voxels changed in this tick, in the order of their changes.
    pub fn edits(&self) -> &[Edit] {
        &self.edits
    }

    /// Resets the state for a tick without packing.
    pub fn reset(&mut self) {
        self.edits.clear();
        // `pending_sink` is kept: the surface still has to sink for closed voids when a condenser returns.
        (self.phase, self.pending_volume, self.area, self.moved) = (0, 0.0, 0.0, 0.0);
    }

    /// Packs with an instrument in contact, if it is pressed hard enough.
    pub fn pack(
        &mut self,
        scene: &mut CollisionScene,
        instrument: &Instrument,
        tip: &PackingTip,
        filling: &FillingMaterial,
        load: &ToolLoad,
    ) {
        self.edits.clear();
        let force = load.contact_force.spring;
        let is_laying = tip.rate > 0.0 && force >= filling.min_force;
        let is_condensing = tip.condenses && force >= filling.condense_force;
        if !is_laying && !is_condensing {
            return self.reset();
        }
        let radius = instrument.face_radius();
        let face = ToolFace { instrument, load, axis: load.orientation * Vec3::Z, radius };
        if is_condensing {
            self.close_voids(scene, &face, filling);
            self.sink(scene, &face, filling);
        }
        if is_laying {
            self.lay(scene, &face, tip, filling);
        }
    }

    /// Lays the phase of an increment that is due in this tick.
    fn lay(&mut self, scene: &mut CollisionScene, face: &ToolFace, tip: &PackingTip, filling: &FillingMaterial) {
        let tick = tip.rate * TICK_S as f32;
        self.pending_volume = (self.pending_volume + tick).min(SAVED_TICKS * tick);
        if self.phase == 0 {
            let disc = core::f32::consts::PI * face.radius * face.radius;
            // The volume laid by the last increment gives the area of the rising surface.
            if self.area <= 0.0 {
                self.area = disc;
            } else if self.increment.rise > 0.0 && self.moved > 0.0 {
                self.area = (self.moved / self.increment.rise).clamp(AREA_BOUNDS[0] * disc, AREA_BOUNDS[1] * disc);
            }
            let most = MAX_RISE_SPEED * TICK_S as f32 * INTERLEAVE as f32;
            let short = filling.condense_force - face.load.contact_force.spring;
            let span = (filling.condense_force - filling.min_force).max(1e-6);
            self.increment = LayIncrement {
                rise: (self.pending_volume / self.area).clamp(0.0, most),
                void_share: filling.void_share / MAX_VOID_SHARE * (short / span).clamp(0.0, 1.0),
            };
            self.moved = 0.0;
        }
        if self.increment.rise > 0.0 {
            let laid = self.raise(scene, face, filling);
            self.moved += laid;
            self.pending_volume -= laid;
        }
        self.phase = (self.phase + 1) % INTERLEAVE;
    }

    /// Moves the surface in front of the face outward; returns the volume laid, mm³.
    fn raise(&mut self, scene: &mut CollisionScene, face: &ToolFace, filling: &FillingMaterial) -> f32 {
        let (grid, band) = (*scene.volume.grid(), scene.volume.half_band());
        let Some([xs, ys, zs]) = face.cells(scene, SPREAD, [-LAID_AHEAD, LAID_BEHIND]) else { return 0.0 };
        let per_mm = 0.5 / band;
        let (phase, voxel_mm3) = (self.phase, grid.voxel_mm3() as f32);
        let mut laid = 0.0;
        for z in zs {
            for y in ys.clone().filter(|y| (y + z) % INTERLEAVE == phase) {
                for x in xs.clone() {
                    let cell = [x, y, z];
                    let index = grid.index(cell);
                    let before = scene.volume.voxel(index);
                    if before.density == Density::FULL || self.edits.len() >= EDITS_MAX {
                        continue;
                    }
                    let at = grid.centre(cell);
                    let share = face.load_share(at);
                    if share <= 0.0 {
                        continue;
                    }
                    let virtual_density = virtual_density(scene, cell, before.density.unit(), per_mm);
                    if virtual_density <= 0.0 {
                        continue;
                    }
                    let wanted = virtual_density + self.increment.rise * share * per_mm;
                    let allowed = wanted.min(max_density_beside_voids(at, self.increment.void_share, band));
                    let density = Density::from_unit(allowed);
                    if density <= before.density || scene.colliders.iter().any(|s| s.distance(at) < 0.0) {
                        continue;
                    }
                    let label = if before.density.is_solid() { before.label } else { filling.label };
                    self.edits.push(scene.volume.set_cell(cell, Voxel { density, label }));
                    laid += (density.unit() - before.density.unit()) * voxel_mm3;
                }
            }
        }
        laid
    }

    /// Closes voids that lie below the face and are covered by the filling.
    fn close_voids(&mut self, scene: &mut CollisionScene, face: &ToolFace, filling: &FillingMaterial) {
        let (grid, band) = (*scene.volume.grid(), scene.volume.half_band());
        if self.pending_sink > MAX_PENDING_SINK * core::f32::consts::PI * face.radius * face.radius {
            return;
        }
        let Some([xs, ys, zs]) = face.cells(scene, 0.0, [-CONDENSED_AHEAD, 0.0]) else { return };
        let phase = self.phase;
        let voxel_mm3 = grid.voxel_mm3() as f32;
        for z in zs {
            for y in ys.clone().filter(|y| (y + z) % INTERLEAVE == phase) {
                for x in xs.clone() {
                    let cell = [x, y, z];
                    let before = scene.volume.voxel(grid.index(cell));
                    let is_hollow = before.label == filling.label || before.density == Density::EMPTY;
                    if before.density == Density::FULL || !is_hollow || self.edits.len() >= EDITS_MAX {
                        continue;
                    }
                    let at = grid.centre(cell);
                    // The density ramp of the surface itself is no void.
                    let is_below = {
                        let (aside, along) = face.to_cylindrical(at);
                        aside < face.radius && along < -band
                    };
                    if !is_below || !face.is_covered(scene, at, filling.label) {
                        continue;
                    }
                    let density = Density::from_unit(before.density.unit() + CLOSING_STEP);
                    self.edits.push(scene.volume.set_cell(cell, Voxel { density, label: filling.label }));
                    self.pending_sink += (density.unit() - before.density.unit()) * voxel_mm3;
                }
            }
        }
    }

    /// Lets the surface under the face sink by the volume of closed voids.
    fn sink(&mut self, scene: &mut CollisionScene, face: &ToolFace, filling: &FillingMaterial) {
        let (grid, band) = (*scene.volume.grid(), scene.volume.half_band());
        let phase = self.phase;
        if self.pending_sink <= 0.0 {
            self.phase = (phase + 1) % INTERLEAVE;
            return;
        }
        let most = MAX_SINK_SPEED * TICK_S as f32 * INTERLEAVE as f32;
        let area = core::f32::consts::PI * face.radius * face.radius;
        let down = face.axis * -(self.pending_sink / area).min(most);
        let voxel_mm3 = grid.voxel_mm3() as f32;
        if let Some([xs, ys, zs]) = face.cells(scene, band, [-band, LAID_BEHIND + band]) {
            for z in zs {
                for y in ys.clone().filter(|y| (y + z) % INTERLEAVE == phase) {
                    for x in xs.clone() {
                        let cell = [x, y, z];
                        let before = scene.volume.voxel(grid.index(cell));
                        if before.label != filling.label || self.pending_sink <= 0.0 || self.edits.len() >= EDITS_MAX {
                            continue;
                        }
                        let distance = face.distance(grid.centre(cell) - down);
                        let density = density_at_distance(-distance, band);
                        if density < before.density {
                            self.edits.push(scene.volume.set_cell(cell, Voxel { density, ..before }));
                            self.pending_sink -= (before.density.unit() - density.unit()) * voxel_mm3;
                        }
                    }
                }
            }
        }
        self.phase = (phase + 1) % INTERLEAVE;
    }
}

impl Default for Packer {
    fn default() -> Self {
        Packer::new()
    }
}

impl ToolFace<'_> {
    /// Distance from the shaft and height along it, mm, of a point in tooth space, relative to the face.
    fn to_cylindrical(&self, point_in_tooth: Vec3) -> (f32, f32) {
        let out = point_in_tooth - self.load.tip;
        let along = out.dot(self.axis);
        ((out - self.axis * along).length(), along)
    }

    /// Fraction of the load that a point receives, 0 to 1.
    fn load_share(&self, point_in_tooth: Vec3) -> f32 {
        let (aside, along) = self.to_cylindrical(point_in_tooth);
        if !(-LAID_AHEAD..=LAID_BEHIND).contains(&along) || (along > 0.0 && aside > self.radius) {
            return 0.0;
        }
        let beside = ((self.radius + SPREAD - aside) / SPREAD).clamp(0.0, 1.0);
        beside * (-along / LOAD_FALLOFF).clamp(LOAD_AT_FACE, 1.0)
    }

    /// Signed distance of a point in tooth space from the working end, mm.
    fn distance(&self, point_in_tooth: Vec3) -> f32 {
        let at = self.load.orientation.conjugate() * (point_in_tooth - self.load.tip);
        self.instrument.end_distance(at)
    }

    /// Cells of the box around the face, extended by `beside` mm and from `from` to `to` mm along the shaft. The
    /// outermost cells of the grid are excluded, because matter must end within it.
    fn cells(&self, scene: &CollisionScene, beside: f32, [from, to]: [f32; 2]) -> Option<[core::ops::Range<u32>; 3]> {
        let grid = scene.volume.grid();
        let (a, b) = (self.load.tip + self.axis * from, self.load.tip + self.axis * to);
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

    /// Returns true if filling lies between a point and the face.
    fn is_covered(&self, scene: &CollisionScene, point_in_tooth: Vec3, label: Label) -> bool {
        let grid = scene.volume.grid();
        let step = grid.spacing.min_element();
        let height = (self.load.tip - point_in_tooth).dot(self.axis);
        (1..=(height / step) as u32).any(|i| {
            let above = grid.nearest(point_in_tooth + self.axis * (i as f32 * step));
            above.is_some_and(|cell| scene.volume.tissue(grid.index(cell)) == label)
        })
    }
}

/// Density of a voxel, with the density ramp of its neighbours continued outward: a measure of the distance to the
/// surface also where the stored density is 0, and negative far outside.
fn virtual_density(scene: &CollisionScene, [x, y, z]: [u32; 3], own: f32, per_mm: f32) -> f32 {
    let volume = &scene.volume;
    let grid = volume.grid();
    let spacing = grid.spacing;
    // Well inside the ramp the voxel's own density is more accurate.
    if own > ISO * 0.7 {
        return own;
    }
    let density = |[x, y, z]: [u32; 3]| volume.densities()[grid.index([x, y, z])];
    // Most of the air in front of a face is far from matter, as its six neighbours show.
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
                let offset = Vec3::new(i as f32 - 1.0, j as f32 - 1.0, k as f32 - 1.0) * spacing;
                best = best.max(density.unit() - offset.length() * per_mm);
            }
        }
    }
    best
}

/// Greatest density at a point next to voids; 1 where there is none.
fn max_density_beside_voids(at: Vec3, share_of_places: f32, band: f32) -> f32 {
    if share_of_places <= 0.0 {
        return 1.0;
    }
    let place = (at / VOID_SPACING).floor();
    if hash01(place) >= share_of_places {
        return 1.0;
    }
    let middle = (place + 0.5) * VOID_SPACING;
    0.5 - 0.5 * (VOID_RADIUS - at.distance(middle)) / band
}

/// Hash of a lattice point to 0–1 (after Teschner et al. 2003, mixed by SplitMix64): the same on every machine.
fn hash01(place: Vec3) -> f32 {
    let [x, y, z] = place.to_array().map(|v| v as i32 as u32);
    let mut bits = u64::from(x.wrapping_mul(73_856_093) ^ y.wrapping_mul(19_349_663)) << 32;
    bits ^= u64::from(z.wrapping_mul(83_492_791));
    bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    bits ^= bits >> 31;
    (bits >> 40) as f32 / (1u32 << 24) as f32
}
