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
use super::density_grid::{CellRange, Crossing, DensityGrid, EdgeEnds, Neighbours, shifted_sample};
use super::planes::{EvenDensity, LAYERS, SamplePlane, SamplePlanes};
use crate::frame::{Mat3, Vec3};
use crate::volume::{BRICK, ISO, Volume};
use std::collections::BTreeMap;
use std::sync::LazyLock;

/// Bend of the density over three samples, as a share of its slope at a plane, from which on an edge is sought: a ball
/// with a radius of three voxels bends by a third.
const BEND_MIN: f32 = 0.35;

/// Cosine of the angle between two sides from which on they are an edge: 35°, more than a wall of the smallest round bur (0.5 mm)
/// turns by in a cell of 0.1 mm.
const EDGE_COSINE: f32 = 0.82;

/// Deviation of a density from the lesser of both sides up to which they explain it: half a voxel of the ramp.
const SIDES_TOLERANCE: f32 = 0.15;

/// Distance from the middle of a cell's edge up to which planes are looked for, voxels: nearer there are none beside a
/// thin edge of matter, and farther away a round side is another plane.
const REACH: f32 = 2.1;

/// Steps to the far end of the edges of the cell beyond a cell, in which an edge may go on.
const CELL_BEYOND: i32 = 1;

// A brick depends on its neighbours only: on the next cell, on samples around the end of its edge, and on two more for the slope.
const _: () = assert!(1 + CELL_BEYOND + REACH as i32 + 2 <= BRICK as i32);
// From the cells before to those beyond, with what is within reach of their edges.
const _: () = assert!(2 * (CELL_BEYOND + REACH as i32) + 2 <= LAYERS as i32);
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
    planes: SamplePlanes,
    /// Bend of the density from which on an edge is sought, along each axis.
    bend_min: Vec3,
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
    /// The edges in a range of cells.
    pub fn new(volume: &Volume, smoothed: &'a Volume, cells: &CellRange) -> SharpEdges<'a> {
        let slope = 0.5 / volume.half_band();
        SharpEdges {
            planes: SamplePlanes::new(cells, CELL_BEYOND + REACH as i32, slope),
            bend_min: BEND_MIN * slope * volume.grid().spacing,
            smoothed,
            crossings: BTreeMap::new(),
            vertices: BTreeMap::new(),
        }
    }

    /// The crossing on the edge from a sample along an axis, and whether a sharp edge is near.
    pub fn crossing(&mut self, field: &DensityGrid, start: [i32; 3], axis: usize) -> (Crossing, bool) {
        let ends = field.ends(start, axis);
        if let NearEdge::Edge(_, position) = self.near_edge(field, &ends, (start, axis)) {
            let normal = self.normal(position).unwrap_or_else(|| field.crossing(start, axis).normal);
            return (Crossing { position, normal }, true);
        }
        let part = ends.crossing_part();
        let position = field.place_along(start, axis, part);
        let normal = DensityGrid::of(self.smoothed).ends(start, axis).normal(part, field.grid.spacing);
        (Crossing { position, normal: normal.unwrap_or_else(|| field.crossing(start, axis).normal) }, false)
    }

    /// Normal of the smoothed volume, in which both sides of an edge go over into each other.
    fn normal(&self, position: Vec3) -> Option<Vec3> {
        (-self.smoothed.density_and_gradient_at(position).1).try_normalize()
    }

    fn near_edge(&mut self, field: &DensityGrid, ends: &EdgeEnds, edge: EdgeOfCell) -> NearEdge {
        if !ends.0.iter().any(|end| end.are_bent(self.bend_min)) {
            return NearEdge::Even;
        }
        *self.crossings.entry(edge).or_insert_with(|| match Sides::beside(field, ends, edge, &mut self.planes) {
            Some(sides) => NearEdge::Edge(sides, sides.crossing(field, ends, edge)),
            None => NearEdge::Unknown,
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
            let ends = field.ends(start, axis);
            match self.near_edge(field, &ends, (start, axis)) {
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
                    places.push(field.place_along(start, axis, ends.crossing_part()));
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

impl Neighbours {
    /// Returns true if the density falls more steeply on one side of the sample than it rises on the other, as across an
    /// edge of matter: by more than a limit for each axis.
    fn are_bent(&self, limits: Vec3) -> bool {
        self.here < 1.0
            && self.beside.iter().zip(limits.to_array()).any(|([below, above], limit)| {
                // Deep in matter the ramp has ended, which is no edge.
                below.max(*above) < 1.0 && 2.0 * self.here - below - above > limit
            })
    }
}

/// A sample beside a cell's edge.
struct WindowSample {
    /// Steps from the sample at which the edge starts.
    steps: [i32; 3],
    /// Weight of the sample's plane.
    weight: f32,
}

/// Samples beside an edge along each axis.
static WINDOWS: LazyLock<[Vec<WindowSample>; 3]> = LazyLock::new(|| [0, 1, 2].map(window));

fn window(axis: usize) -> Vec<WindowSample> {
    let middle = 0.5 * Vec3::AXES[axis];
    let steps = || -(REACH as i32)..=REACH.ceil() as i32;
    let all = steps().flat_map(|z| steps().flat_map(move |y| steps().map(move |x| [x, y, z])));
    all.filter_map(|steps| {
        let distance_squared = Vec3::from(steps.map(|v| v as f32)).distance_squared(middle);
        (distance_squared < REACH * REACH).then(|| WindowSample { steps, weight: (0.25 + distance_squared).powi(-2) })
    })
    .collect()
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
    /// Sides around a cell's edge, if there are two.
    fn beside(
        field: &DensityGrid,
        ends: &EdgeEnds,
        (start, axis): EdgeOfCell,
        planes: &mut SamplePlanes,
    ) -> Option<Sides> {
        let mut seen: Vec<Seen> = Vec::with_capacity(WINDOWS[axis].len());
        for &WindowSample { steps, weight } in &WINDOWS[axis] {
            let Some(plane) = planes.at(field, std::array::from_fn(|a| start[a] + steps[a])) else { continue };
            let SamplePlane { density: EvenDensity { value, slope }, inward } = *plane;
            let offset = Vec3::from(steps.map(|v| v as f32)) * field.grid.spacing;
            let at_start = EvenDensity { value: value - slope.dot(offset), slope };
            seen.push(Seen { at_start, inward, offset, weight });
        }
        let least_like = |inward: Vec3| {
            let cosines = seen.iter().map(|s| (inward.dot(s.inward), s.inward));
            cosines.reduce(|least, other| if other.0 < least.0 { other } else { least }).map(|(_, inward)| inward)
        };
        let first = least_like(seen.first()?.inward)?;
        let second = least_like(first)?;
        if first.dot(second) > EDGE_COSINE {
            return None;
        }
        let mut sums = [(EvenDensity::default(), Vec3::ZERO, 0.0); 2];
        for Seen { at_start, inward, offset, weight } in &seen {
            let is_first = first.dot(*inward) >= second.dot(*inward);
            for ((side, place, total), is_its) in sums.iter_mut().zip([is_first, !is_first]) {
                let weight = if is_its { *weight } else { 0.0 };
                side.value += weight * at_start.value;
                side.slope += weight * at_start.slope;
                *place += weight * *offset;
                *total += weight;
            }
        }
        let [(a, at_a), (b, at_b)] = sums.map(|(side, place, total)| {
            (EvenDensity { value: side.value / total, slope: side.slope / total }, place / total)
        });
        let is_lesser_of_both = a.at(at_a) < b.at(at_a) && b.at(at_b) < a.at(at_b);
        // A third side, as in a corner, or none at all.
        let offsets = [Vec3::ZERO, Vec3::AXES[axis] * field.grid.spacing];
        let is_explained = ends.0.iter().zip(offsets).all(|(end, offset)| {
            let lesser = a.at(offset).min(b.at(offset)).clamp(0.0, 1.0);
            (lesser - end.here).abs() < SIDES_TOLERANCE
        });
        (is_lesser_of_both && is_explained).then_some(Sides([a, b]))
    }

    /// The place on a cell's edge at which the first of both sides leaves matter; where neither does, that of the
    /// density itself.
    fn crossing(&self, field: &DensityGrid, ends: &EdgeEnds, (start, axis): EdgeOfCell) -> Vec3 {
        let [from, to] = ends.0.map(|end| end.here - ISO);
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
