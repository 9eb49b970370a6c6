//! Sharp edges of a surface, as a bur leaves them: one more vertex in each cell where two sides meet.
//!
//! Takes densities that are the lesser of two ramps, and a cell of them. Gives a vertex on the edge that crosses the
//! cell. Without it, every cell cuts the edge off in its own way, which looks like a saw.
//!
//! Method: Kobbelt, Botsch, Schwanecke & Seidel, *Feature Sensitive Surface Extraction from Volume Data* (2001); the
//! vertex has the least distances from the planes at a cell's crossings, as by Ju, Losasso, Schaefer & Warren, *Dual
//! Contouring of Hermite Data* (2002). The planes come from samples beside the edge, whose differences do not reach
//! across it.

use super::cases::{CASES, CELL_EDGES, CellEdge, CellFace, CubeCase, EdgeIndex};
use super::density_grid::{Crossing, DensityGrid, shifted_sample};
use crate::frame::{Mat3, Vec3};
use crate::volume::{BRICK, ISO, Volume};
use std::collections::BTreeMap;

/// Bend of the density over three samples, as a share of its slope at a plane, from which on an edge is sought: a ball
/// with a radius of three voxels bends by a third.
const BEND_MIN: f32 = 0.35;

/// Bend up to which three samples lie on one plane.
const PLANE_BEND_MAX: f32 = 0.25;

/// Deviation from the surface's density of samples whose planes are asked for: 1.2 voxels, beyond which the ramp's end is near.
const PLANE_DEPTH: f32 = 0.4;

/// Deviation of a plane's slope from that of the ramp, as a share. The distances of carved teeth are within a twentieth.
const PLANE_SLOPE_TOLERANCE: f32 = 0.1;

/// Cosine of the angle between two sides from which on they are an edge: 35°, more than a wall of the smallest round bur (0.5 mm)
/// turns by in a cell of 0.1 mm.
const EDGE_COSINE: f32 = 0.82;

/// Deviation of a density from the lesser of both sides up to which they explain it: half a voxel of the ramp.
const SIDES_TOLERANCE: f32 = 0.15;

/// Samples beside an edge that are looked at, from a crossing along each axis: fewer do not lie beside a thin edge, and more
/// lie on other parts of a round side.
const REACH: i32 = 2;

// A brick depends on its neighbours only: on the next cell, on samples around the end of its edge, and on two more for the slope.
const _: () = assert!(2 + REACH + 2 <= BRICK as i32);
// Normals are taken beyond that cell, from slopes of a copy that is smoothed over one voxel.
const _: () = assert!(2.0 + BEYOND_CELL + 3.0 <= BRICK as f32);

/// Weight of the middle of a cell's crossings against a plane, so that planes that hardly differ do not carry the vertex
/// away.
const MIDDLE_WEIGHT: f32 = 0.02;

/// Distance that a vertex may lie outside its cell, voxels: thin edges end between samples.
const BEYOND_CELL: f32 = 0.9;

/// One outline of the surface in a cell: the cell, and the outline's number there.
pub type Outline = ([i32; 3], usize);

/// An edge of a cell: the sample at its start, and its axis.
type EdgeOfCell = ([i32; 3], usize);

/// Sharp edges of one surface.
pub struct SharpEdges<'a> {
    /// Slope of the density at a plane, per mm.
    plane_slope: f32,
    smoothed: &'a Volume,
    /// Results that were found already.
    crossings: BTreeMap<EdgeOfCell, NearEdge>,
    vertices: BTreeMap<Outline, Option<Crossing>>,
}

/// The surroundings of a crossing.
#[derive(Clone, Copy, Debug)]
enum NearEdge {
    /// No edge is near.
    Even,
    /// The density is bent, but not as by two sides.
    Unknown,
    /// Two sides, and the place of the crossing on one of them.
    Edge(Sides, Vec3),
}

impl<'a> SharpEdges<'a> {
    pub fn new(volume: &Volume, smoothed: &'a Volume) -> SharpEdges<'a> {
        let plane_slope = 0.5 / volume.half_band();
        SharpEdges { plane_slope, smoothed, crossings: BTreeMap::new(), vertices: BTreeMap::new() }
    }

    /// The crossing on the edge from a sample along an axis, and whether a sharp edge is near.
    pub fn crossing(&mut self, field: &DensityGrid, start: [i32; 3], axis: usize) -> (Crossing, bool) {
        if let NearEdge::Edge(_, position) = self.near_edge(field, start, axis) {
            let normal = self.normal(position).unwrap_or_else(|| field.crossing(start, axis).normal);
            return (Crossing { position, normal }, true);
        }
        let part = field.crossing_part(start, axis);
        let position = field.place_along(start, axis, part);
        let normal = DensityGrid::of(self.smoothed).normal(start, axis, part);
        (Crossing { position, normal: normal.unwrap_or_else(|| field.crossing(start, axis).normal) }, false)
    }

    /// Normal of the smoothed volume, in which both sides of an edge go over into each other.
    fn normal(&self, position: Vec3) -> Option<Vec3> {
        (-self.smoothed.density_and_gradient_at(position).1).try_normalize()
    }

    fn near_edge(&mut self, field: &DensityGrid, start: [i32; 3], axis: usize) -> NearEdge {
        let limit = BEND_MIN * self.plane_slope;
        if !field.is_bent(start, limit) && !field.is_bent(shifted_sample(start, axis, 1), limit) {
            return NearEdge::Even;
        }
        *self.crossings.entry((start, axis)).or_insert_with(|| {
            match Sides::beside(field, start, axis, self.plane_slope) {
                Some(sides) => NearEdge::Edge(sides, sides.crossing(field, start, axis)),
                None => NearEdge::Unknown,
            }
        })
    }

    /// The place on the edge that crosses an outline, if one does.
    pub fn vertex(&mut self, field: &DensityGrid, outline: Outline, case: &CubeCase) -> Option<Crossing> {
        if let Some(&known) = self.vertices.get(&outline) {
            return known;
        }
        let (cell, ring) = outline;
        let found = self.vertex_of(field, cell, &case.rings[ring]);
        self.vertices.insert(outline, found);
        found
    }

    fn vertex_of(&mut self, field: &DensityGrid, cell: [i32; 3], ring: &[EdgeIndex]) -> Option<Crossing> {
        let mut places = Vec::with_capacity(12);
        let mut planes: Vec<Plane> = Vec::with_capacity(24);
        // Normals of the planes that are the surface at the crossings.
        let mut normals: Vec<Vec3> = Vec::with_capacity(12);
        let mut is_at_edge = false;
        for edge in ring {
            let CellEdge { axis, start, .. } = CELL_EDGES[usize::from(edge.0)];
            let start = std::array::from_fn(|a| cell[a] + start[a] as i32);
            match self.near_edge(field, start, axis) {
                NearEdge::Edge(sides, place) => {
                    let [a, b] = sides.planes(field, start);
                    normals.push(if a.height(place).abs() < b.height(place).abs() { a.normal } else { b.normal });
                    planes.extend([a, b]);
                    places.push(place);
                    is_at_edge = true;
                }
                NearEdge::Even => {
                    let Crossing { position, normal } = field.crossing(start, axis);
                    normals.push(normal);
                    planes.push(Plane { place: position, normal });
                    places.push(position);
                }
                NearEdge::Unknown => {
                    places.push(field.place_along(start, axis, field.crossing_part(start, axis)));
                }
            }
        }
        if !is_at_edge {
            return None;
        }
        let middle = places.iter().sum::<Vec3>() / places.len() as f32;
        let nearest = nearest_to_planes(&planes, middle);
        let (low, spacing) = (field.place(cell), field.grid.spacing);
        let clamped = |beyond: f32| nearest.clamp(low - beyond * spacing, low + (1.0 + beyond) * spacing);
        let differ = |(i, a): (usize, &Vec3)| normals[..i].iter().any(|b| a.dot(*b) < EDGE_COSINE);
        if !normals.iter().enumerate().any(differ) && clamped(0.0) != nearest {
            return None;
        }
        let position = clamped(BEYOND_CELL);
        Some(Crossing { position, normal: self.normal(position).unwrap_or(normals[0]) })
    }
}

/// A plane in tooth space, mm.
struct Plane {
    place: Vec3,
    /// Unit normal, outward.
    normal: Vec3,
}

impl Plane {
    fn height(&self, place: Vec3) -> f32 {
        self.normal.dot(place - self.place)
    }
}

/// The place with the least sum of squared distances from planes; near a middle, where they leave it open.
fn nearest_to_planes(planes: &[Plane], middle: Vec3) -> Vec3 {
    let mut squares = Mat3::from_diagonal(Vec3::splat(MIDDLE_WEIGHT * planes.len() as f32));
    let mut pull = Vec3::ZERO;
    for plane in planes {
        let normal = plane.normal;
        squares += Mat3::from_cols(normal * normal.x, normal * normal.y, normal * normal.z);
        pull -= normal * plane.height(middle);
    }
    middle + squares.inverse() * pull
}

/// The outline in the cell beyond a face with which an outline has one line on that face in common, from an edge to
/// another.
pub fn outline_beyond(
    field: &DensityGrid,
    cell: [i32; 3],
    own: &[EdgeIndex],
    [from, to]: [EdgeIndex; 2],
    face: CellFace,
) -> Option<(Outline, &'static CubeCase)> {
    let beyond = shifted_sample(cell, face.axis, 2 * face.side as i32 - 1);
    let corner = |n: usize| std::array::from_fn(|a| beyond[a] + (n >> a & 1) as i32);
    let solid = (0..8).filter(|&n| field.at(corner(n)) >= ISO).fold(0, |bits, n| bits | 1 << n);
    let case = &CASES[solid];
    // Seen from the other side a line leads the other way.
    let has_line = |ring: &[EdgeIndex], [from, to]: [EdgeIndex; 2]| {
        lines(ring).any(|line| line == [to.beyond(face), from.beyond(face)])
    };
    let ring = case.rings.iter().position(|ring| has_line(ring, [from, to]))?;
    // Joined twice, both vertices would have an edge too many between them.
    let on_face = lines(own).filter(|line| line.iter().all(|edge| edge.lies_in(face)));
    let shared = on_face.filter(|line| has_line(&case.rings[ring], *line)).count();
    (shared == 1).then_some(((beyond, ring), case))
}

/// Lines of an outline, from each of its edges to the next.
pub fn lines(ring: &[EdgeIndex]) -> impl Iterator<Item = [EdgeIndex; 2]> {
    ring.iter().zip(ring.iter().cycle().skip(1)).map(|(&from, &to)| [from, to])
}

impl DensityGrid<'_> {
    /// Returns true if the density falls more steeply on one side of a sample than it rises on the other, as across an
    /// edge of matter.
    fn is_bent(&self, sample: [i32; 3], limit: f32) -> bool {
        let around = self.around(sample, 1);
        let here = around.at(0, 0);
        here < 1.0
            && (0..3).any(|axis| {
                let [below, above] = [-1, 1].map(|steps| around.at(axis, steps));
                // Deep in matter the ramp has ended, which is no edge.
                below.max(above) < 1.0 && 2.0 * here - below - above > limit * self.grid.spacing[axis]
            })
    }

    /// The density at a sample on a plane, from the neighbours that lie on it as well.
    fn even_density(&self, sample: [i32; 3], plane_slope: f32) -> Option<EvenDensity> {
        let is_within = |density: f32| density > 0.0 && density < 1.0;
        let around = self.around(sample, 2);
        let value = around.at(0, 0);
        if (value - ISO).abs() > PLANE_DEPTH {
            return None;
        }
        let mut slope = Vec3::ZERO;
        for axis in 0..3 {
            let limit = PLANE_BEND_MAX * plane_slope * self.grid.spacing[axis];
            let [below, above] = [-1, 1].map(|steps| around.at(axis, steps));
            let is_even = is_within(below) && is_within(above) && (below - 2.0 * value + above).abs() <= limit;
            // On one side only, if the density goes on evenly there until the ramp ends.
            let goes_on = |near: f32, steps: i32| {
                let expected = (2.0 * near - value).clamp(0.0, 1.0);
                is_within(near) && (around.at(axis, steps) - expected).abs() <= limit
            };
            let rise = match is_even {
                true => 0.5 * (above - below),
                false => match (goes_on(below, -2), goes_on(above, 2)) {
                    (true, false) => value - below,
                    (false, true) => above - value,
                    _ => return None,
                },
            };
            slope[axis] = rise / self.grid.spacing[axis];
        }
        let is_ramp = (slope.length() / plane_slope - 1.0).abs() < PLANE_SLOPE_TOLERANCE;
        is_ramp.then_some(EvenDensity { value, slope })
    }
}

/// A density that rises evenly.
#[derive(Clone, Copy, Debug, Default)]
struct EvenDensity {
    /// Value at the sample from which offsets are measured.
    value: f32,
    /// Per mm.
    slope: Vec3,
}

impl EvenDensity {
    fn at(&self, offset: Vec3) -> f32 {
        self.value + self.slope.dot(offset)
    }
}

/// A sample on a plane near a crossing.
struct Seen {
    /// The plane's density, measured from the sample at which the crossing's edge starts.
    at_start: EvenDensity,
    /// Unit normal into matter.
    inward: Vec3,
    /// Place, mm from the start.
    offset: Vec3,
    weight: f32,
}

/// The two sides of an edge of matter, where the density is the lesser of both. Offsets are measured, in mm, from the
/// sample at which a cell's edge starts.
#[derive(Clone, Copy, Debug)]
struct Sides([EvenDensity; 2]);

impl Sides {
    /// Sides around the edge from a sample along an axis, if there are two.
    fn beside(field: &DensityGrid, start: [i32; 3], axis: usize, plane_slope: f32) -> Option<Sides> {
        let last = |a: usize| REACH + i32::from(a == axis);
        let middle = 0.5 * Vec3::AXES[axis];
        let mut seen: Vec<Seen> = Vec::with_capacity(64);
        for z in -REACH..=last(2) {
            for y in -REACH..=last(1) {
                for x in -REACH..=last(0) {
                    let sample = [start[0] + x, start[1] + y, start[2] + z];
                    let Some(EvenDensity { value, slope }) = field.even_density(sample, plane_slope) else { continue };
                    let steps = Vec3::from([x, y, z].map(|v| v as f32));
                    let weight = (0.25 + steps.distance_squared(middle)).powi(-2);
                    let offset = steps * field.grid.spacing;
                    let at_start = EvenDensity { value: value - slope.dot(offset), slope };
                    seen.push(Seen { at_start, inward: slope.normalize(), offset, weight });
                }
            }
        }
        let least_like =
            |inward: Vec3| seen.iter().map(|s| s.inward).min_by(|a, b| inward.dot(*a).total_cmp(&inward.dot(*b)));
        let first = least_like(seen.first()?.inward)?;
        let second = least_like(first)?;
        if first.dot(second) > EDGE_COSINE {
            return None;
        }
        let mut sums = [(EvenDensity::default(), Vec3::ZERO, 0.0); 2];
        for Seen { at_start, inward, offset, weight } in &seen {
            let (side, place, total) = &mut sums[usize::from(first.dot(*inward) < second.dot(*inward))];
            side.value += weight * at_start.value;
            side.slope += *weight * at_start.slope;
            *place += *weight * *offset;
            *total += weight;
        }
        let [(a, at_a), (b, at_b)] = sums.map(|(side, place, total)| {
            (EvenDensity { value: side.value / total, slope: side.slope / total }, place / total)
        });
        let is_lesser_of_both = a.at(at_a) < b.at(at_a) && b.at(at_b) < a.at(at_b);
        // A third side, as in a corner, or none at all.
        let is_explained =
            [(start, Vec3::ZERO), (shifted_sample(start, axis, 1), Vec3::AXES[axis] * field.grid.spacing)].iter().all(
                |&(sample, offset)| {
                    let lesser = a.at(offset).min(b.at(offset)).clamp(0.0, 1.0);
                    (lesser - field.at(sample)).abs() < SIDES_TOLERANCE
                },
            );
        (is_lesser_of_both && is_explained).then_some(Sides([a, b]))
    }

    /// The place on the edge from a sample along an axis at which the first of both sides leaves matter; where neither
    /// does, that of the density itself.
    fn crossing(&self, field: &DensityGrid, start: [i32; 3], axis: usize) -> Vec3 {
        let [from, to] = [start, shifted_sample(start, axis, 1)].map(|sample| field.at(sample) - ISO);
        let along = Vec3::AXES[axis] * field.grid.spacing;
        let is_start_solid = from >= 0.0;
        let leaves = |side: &EvenDensity| {
            let [from, to] = [Vec3::ZERO, along].map(|offset| side.at(offset) - ISO);
            ((from >= 0.0) == is_start_solid && (to >= 0.0) != is_start_solid).then(|| from / (from - to))
        };
        let parts = self.0.iter().filter_map(leaves);
        let first = match is_start_solid {
            true => parts.min_by(f32::total_cmp),
            false => parts.max_by(f32::total_cmp),
        };
        field.place(start) + along * first.unwrap_or(from / (from - to))
    }

    fn planes(&self, field: &DensityGrid, start: [i32; 3]) -> [Plane; 2] {
        self.0.map(|EvenDensity { value, slope }| {
            let inward = slope.normalize();
            Plane { place: field.place(start) + inward * ((ISO - value) / slope.length()), normal: -inward }
        })
    }
}

#[cfg(test)]
mod tests {
    use crate::frame::{Quat, Vec3};
    use crate::volume::surface::tests::is_watertight;
    use crate::volume::surface::{extract, extract_sharp};
    use crate::volume::{Grid, Label, Volume, phantom};

    const SPACING: f32 = 0.1;
    const RADIUS: f32 = 0.9;

    fn turn() -> Quat {
        Quat::from_rotation_x(0.3) * Quat::from_rotation_y(0.4)
    }

    /// A block whose upper side is cut by a ball, with the height of the ball's centre, mm: the higher, the blunter the rim.
    fn cavity(centre: f32) -> Volume {
        let grid = Grid::centred([60, 60, 40], Vec3::splat(SPACING));
        Volume::from_distance(grid, 1.5 * SPACING, |place| {
            let p = turn() * place;
            (p.z.max(RADIUS - p.distance(Vec3::new(0.0, 0.0, centre))), Label(1))
        })
    }

    #[test]
    fn the_rim_of_a_round_cavity_is_a_circle() {
        // Aim: no teeth along the rim. Method: rims of 60° to 130°; the vertices that lie on no line between samples are
        // those on edges. They go around without a gap and are as far from the circle as the planes of round sides are.
        for centre in [-0.4f32, 0.0, 0.3, 0.6] {
            let volume = cavity(centre);
            let mesh = extract_sharp(&volume, &volume);
            assert!(is_watertight(&mesh));
            let rim = (RADIUS * RADIUS - centre * centre).sqrt();
            let is_inside = |p: &&Vec3| {
                let steps = volume.grid().from_tooth(**p).to_array();
                steps.iter().filter(|s| (*s - s.round()).abs() < 1e-4).count() < 2
            };
            let on_rim = mesh.positions.iter().filter(is_inside).map(|p| turn() * *p);
            let on_rim: Vec<Vec3> = on_rim.filter(|p| p.truncate().length() < rim + 0.3).collect();
            let mut turns: Vec<f32> = on_rim.iter().map(|p| p.y.atan2(p.x)).collect();
            turns.sort_by(f32::total_cmp);
            turns.push(turns[0] + std::f32::consts::TAU);
            let widest = turns.windows(2).map(|pair| rim * (pair[1] - pair[0])).fold(0.0, f32::max);
            assert!(widest < 1.5 * SPACING, "centre {centre}: {widest} mm without a vertex on the rim");
            let (across, along): (Vec<f32>, Vec<f32>) =
                on_rim.iter().map(|p| (p.truncate().length() - rim, p.z)).unzip();
            for offsets in [across, along] {
                let mean = offsets.iter().sum::<f32>() / offsets.len() as f32;
                let spread = offsets.iter().map(|o| (o - mean).powi(2)).sum::<f32>() / offsets.len() as f32;
                let (mean, spread) = (mean / SPACING, spread.sqrt() / SPACING);
                assert!(mean.abs() < 0.25 && spread < 0.12, "centre {centre}: {mean} ± {spread} voxels");
            }
        }
    }

    #[test]
    fn a_wedge_of_flat_voxels_is_sharp() {
        // Aim: distances are measured in mm where voxels are no cubes. Method: a block's upper edge.
        let grid = Grid::centred([40, 30, 36], Vec3::new(0.1, 0.15, 0.12));
        let planes = [Vec3::new(0.6, 0.2, 0.75), Vec3::new(-0.7, 0.3, 0.6)].map(Vec3::normalize);
        let height = |p: Vec3| planes.map(|normal| normal.dot(p) - 0.31);
        let wedge = Volume::from_distance(grid, 0.225, |p| (height(p)[0].max(height(p)[1]), Label(1)));
        let mesh = extract_sharp(&wedge, &wedge);
        let is_inner = |p: &&Vec3| p.abs().cmplt(grid.extent().high - 0.6).all();
        let on_edge = mesh.positions.iter().filter(is_inner).filter(|p| height(**p).iter().all(|h| h.abs() < 0.01));
        assert!(on_edge.count() > 15);
        assert!(is_watertight(&mesh));
    }

    #[test]
    fn a_round_surface_has_no_edges() {
        let ball = phantom::ball([60; 3], Vec3::splat(SPACING), 0.6);
        let [plain, sharp] = [extract(&ball), extract_sharp(&ball, &ball)];
        assert!(plain.positions == sharp.positions && plain.triangles == sharp.triangles);
    }
}
