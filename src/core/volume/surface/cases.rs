//! Marching-cubes cases: the surface in a cell for each of the 256 combinations of solid corners.
//!
//! Derived, not copied: on every face of the cell a line cuts off each run of solid corners, so that two cells that
//! share a face draw the same lines on it. The lines join to rings around the cell, and each ring is filled with
//! triangles. No inner edge of these lies in a face, where the neighbouring cell might have the same edge.

use std::sync::LazyLock;

/// Number of one of the twelve edges of a cell: four parallel edges per axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EdgeIndex(pub u8);

impl EdgeIndex {
    fn new(axis: usize, corner: usize) -> EdgeIndex {
        let (b, c) = other_axes(axis);
        EdgeIndex((axis * 4 + (corner >> b & 1) + 2 * (corner >> c & 1)) as u8)
    }

    fn cell_edge(self) -> &'static CellEdge {
        &CELL_EDGES[usize::from(self.0)]
    }

    /// Returns true if the face contains the edge.
    pub fn lies_in(self, face: CellFace) -> bool {
        self.cell_edge().axis != face.axis && self.cell_edge().start[face.axis] == face.side
    }

    /// The face of the cell that contains both edges.
    pub fn shared_face(self, other: EdgeIndex) -> Option<CellFace> {
        CellFace::ALL.into_iter().find(|&face| self.lies_in(face) && other.lies_in(face))
    }

    /// Number of this edge in the cell on the other side of a face that contains it.
    pub fn beyond(self, face: CellFace) -> EdgeIndex {
        let CellEdge { axis, mut start, .. } = *self.cell_edge();
        start[face.axis] = 1 - face.side;
        EdgeIndex::new(axis, start[0] | start[1] << 1 | start[2] << 2)
    }
}

/// Face of a cell: the axis across it, and 0 or 1 for its lower or upper side.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CellFace {
    pub axis: usize,
    pub side: usize,
}

impl CellFace {
    const ALL: [CellFace; 6] = [
        CellFace { axis: 0, side: 0 },
        CellFace { axis: 0, side: 1 },
        CellFace { axis: 1, side: 0 },
        CellFace { axis: 1, side: 1 },
        CellFace { axis: 2, side: 0 },
        CellFace { axis: 2, side: 1 },
    ];
}

/// The two other axes, in right-handed order.
const fn other_axes(axis: usize) -> (usize, usize) {
    ((axis + 1) % 3, (axis + 2) % 3)
}

/// Position of an edge in a cell: its axis, and its lower corner relative to the lowest corner of the cell.
pub struct CellEdge {
    pub axis: usize,
    pub start: [usize; 3],
    /// Axes on whose lower side the edge lies, one bit each: cells there have it in common and come first.
    pub low_sides: u8,
}

/// Edges by number.
pub static CELL_EDGES: [CellEdge; 12] = {
    const fn cell_edge(edge: usize) -> CellEdge {
        let axis = edge / 4;
        let (b, c) = other_axes(axis);
        let mut start = [0; 3];
        start[b] = edge & 1;
        start[c] = edge >> 1 & 1;
        let before = ((1 - start[b]) << b | (1 - start[c]) << c) as u8;
        CellEdge { axis, start, low_sides: before }
    }
    [
        cell_edge(0),
        cell_edge(1),
        cell_edge(2),
        cell_edge(3),
        cell_edge(4),
        cell_edge(5),
        cell_edge(6),
        cell_edge(7),
        cell_edge(8),
        cell_edge(9),
        cell_edge(10),
        cell_edge(11),
    ]
};

/// Surface in one cell.
#[derive(Clone, Debug, Default)]
pub struct CubeCase {
    /// Edges crossed by the surface.
    pub edges: Vec<EdgeIndex>,
    pub triangles: Vec<[EdgeIndex; 3]>,
    /// Outlines of the same surface: edges in the order in which lines on the cell's faces join them.
    pub rings: Vec<Vec<EdgeIndex>>,
}

/// Cases by the solid corners of the cell: bit `x + 2y + 4z` for each.
pub static CASES: LazyLock<Vec<CubeCase>> = LazyLock::new(|| (0..256).map(CubeCase::of).collect());

impl CubeCase {
    fn of(solid: usize) -> CubeCase {
        let mut next = contour_segments(solid);
        let mut case = CubeCase::default();
        for first in 0..12u8 {
            let mut ring = Vec::new();
            let mut at = EdgeIndex(first);
            while let Some(following) = next[usize::from(at.0)].take() {
                ring.push(at);
                at = following;
            }
            if !ring.is_empty() {
                case.triangles.extend(triangulate_ring(&ring).1);
                case.edges.extend(&ring);
                case.rings.push(ring);
            }
        }
        case
    }
}

/// For each crossed edge, the edge to which a line leads from it. The solid part is on the left of the line as seen
/// from outside the cell.
fn contour_segments(solid: usize) -> [Option<EdgeIndex>; 12] {
    let is_solid = |corner: usize| solid >> corner & 1 == 1;
    let mut next = [None; 12];
    for face in CellFace::ALL {
        let corners = around_face(face);
        for (i, &corner) in corners.iter().enumerate() {
            // A run of solid corners begins here: the line goes from the edge before the run to the edge after it.
            let before = corners[(i + 3) % 4];
            if is_solid(corner) && !is_solid(before) {
                let run = (0..4).take_while(|n| is_solid(corners[(i + n) % 4])).count();
                let (last, after) = (corners[(i + run - 1) % 4], corners[(i + run) % 4]);
                next[usize::from(edge_between(before, corner).0)] = Some(edge_between(last, after));
            }
        }
    }
    next
}

/// Corners of a face, counter-clockwise as seen from outside the cell.
fn around_face(CellFace { axis, side }: CellFace) -> [usize; 4] {
    let (b, c) = other_axes(axis);
    let mut corners = [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(u, v)| u << b | v << c | side << axis);
    if side == 0 {
        corners.reverse();
    }
    corners
}

fn edge_between(a: usize, b: usize) -> EdgeIndex {
    EdgeIndex::new((a ^ b).trailing_zeros() as usize, a & b)
}

/// Triangulates a ring with as few inner edges in faces as possible; returns their number and the triangles.
fn triangulate_ring(ring: &[EdgeIndex]) -> (u32, Vec<[EdgeIndex; 3]>) {
    let (Some(&first), Some(&last)) = (ring.first(), ring.last()) else { return (0, Vec::new()) };
    let mut best: Option<(u32, Vec<[EdgeIndex; 3]>)> = None;
    for middle in 1..ring.len().saturating_sub(1) {
        let apex = ring[middle];
        let in_face = |is_inner: bool, end: EdgeIndex| u32::from(is_inner && apex.shared_face(end).is_some());
        let (left, mut triangles) = triangulate_ring(&ring[..=middle]);
        let (right, others) = triangulate_ring(&ring[middle..]);
        let cost = left + right + in_face(middle > 1, first) + in_face(middle + 2 < ring.len(), last);
        if best.as_ref().is_none_or(|(least, _)| cost < *least) {
            triangles.extend(others);
            triangles.push([first, apex, last]);
            best = Some((cost, triangles));
        }
    }
    best.unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_case_is_closed_up_to_the_lines_on_its_faces() {
        // Aim: the reverse of each triangle edge occurs too, or the edge is a line that the neighbouring cell draws
        // as well.
        for (solid, case) in CASES.iter().enumerate() {
            let lines = contour_segments(solid);
            let mut edges: Vec<[u8; 2]> = Vec::new();
            for [a, b, c] in &case.triangles {
                edges.extend([[a.0, b.0], [b.0, c.0], [c.0, a.0]]);
            }
            for [a, b] in &edges {
                let is_line = lines[usize::from(*a)] == Some(EdgeIndex(*b));
                assert_eq!(edges.iter().filter(|e| *e == &[*a, *b]).count(), 1, "case {solid}");
                assert_ne!(is_line, edges.contains(&[*b, *a]), "case {solid}: edge {a}–{b}");
                assert!(
                    is_line || EdgeIndex(*a).shared_face(EdgeIndex(*b)).is_none(),
                    "case {solid}: {a}–{b} lies in a face"
                );
            }
            for (from, to) in lines.iter().enumerate().filter_map(|(from, to)| Some((from as u8, (*to)?))) {
                assert!(edges.contains(&[from, to.0]), "case {solid}: line {from}–{to:?} is not filled");
            }
        }
    }

    #[test]
    fn a_lone_corner_is_cut_off_by_one_triangle() {
        for corner in 0..8 {
            assert_eq!(CASES[1 << corner].triangles.len(), 1);
            assert_eq!(CASES[255 - (1 << corner)].triangles.len(), 1);
        }
        assert!(CASES[0].triangles.is_empty() && CASES[255].triangles.is_empty());
    }
}
