//! What the surface looks like in a cell, for each of the 256 ways its corners can be solid.
//!
//! Worked out, not copied: on every face of the cell each run of solid corners is cut off by a line, so that two cells that
//! share a face draw the same lines on it. The lines join to rings around the cell, and each ring is filled with triangles
//! none of whose inner edges lies in a face, where the neighbour might have the same edge.

use std::sync::LazyLock;

/// One of a cell's twelve edges: axis, and which of four parallel edges it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Edge(pub u8);

impl Edge {
    fn new(axis: usize, corner: usize) -> Edge {
        let (b, c) = others(axis);
        Edge((axis * 4 + (corner >> b & 1) + 2 * (corner >> c & 1)) as u8)
    }

    fn way(self) -> &'static Way {
        &WAYS[usize::from(self.0)]
    }

    /// True when one face of the cell holds both edges.
    fn shares_face(self, other: Edge) -> bool {
        let holds = |edge: Edge, axis: usize, side: usize| edge.way().axis != axis && edge.way().start[axis] == side;
        (0..3).any(|axis| [0, 1].into_iter().any(|side| holds(self, axis, side) && holds(other, axis, side)))
    }
}

/// The two axes across one, right-handed.
const fn others(axis: usize) -> (usize, usize) {
    ((axis + 1) % 3, (axis + 2) % 3)
}

/// Where an edge of a cell lies: its axis and its lower corner, seen from the cell's lowest.
pub struct Way {
    pub axis: usize,
    pub start: [usize; 3],
    /// Axes on whose lower side it lies, one bit each: other cells there have had it before.
    pub before: u8,
}

/// By the edge's number.
pub static WAYS: [Way; 12] = {
    const fn way(edge: usize) -> Way {
        let axis = edge / 4;
        let (b, c) = others(axis);
        let mut start = [0; 3];
        start[b] = edge & 1;
        start[c] = edge >> 1 & 1;
        let before = ((1 - start[b]) << b | (1 - start[c]) << c) as u8;
        Way { axis, start, before }
    }
    [way(0), way(1), way(2), way(3), way(4), way(5), way(6), way(7), way(8), way(9), way(10), way(11)]
};

/// The surface in one cell.
#[derive(Clone, Debug, Default)]
pub struct Case {
    /// Edges that the surface crosses.
    pub edges: Vec<Edge>,
    pub triangles: Vec<[Edge; 3]>,
}

/// By the cell's solid corners: bit `x + 2y + 4z` for each.
pub static CASES: LazyLock<Vec<Case>> = LazyLock::new(|| (0..256).map(Case::of).collect());

impl Case {
    fn of(solid: usize) -> Case {
        let mut next = lines(solid);
        let mut case = Case::default();
        for first in 0..12u8 {
            let mut ring = Vec::new();
            let mut at = Edge(first);
            while let Some(following) = next[usize::from(at.0)].take() {
                ring.push(at);
                at = following;
            }
            if !ring.is_empty() {
                case.triangles.extend(fill(&ring).1);
                case.edges.extend(ring);
            }
        }
        case
    }
}

/// For each edge that is crossed, the one to which a line leads from it, with what is solid on the line's left as seen from
/// outside the cell.
fn lines(solid: usize) -> [Option<Edge>; 12] {
    let is_solid = |corner: usize| solid >> corner & 1 == 1;
    let mut next = [None; 12];
    for (axis, side) in (0..3).flat_map(|axis| [(axis, 0), (axis, 1)]) {
        let corners = around_face(axis, side);
        for (i, &corner) in corners.iter().enumerate() {
            // A run of solid corners begins here: the line goes from where it is entered to where it is left.
            let before = corners[(i + 3) % 4];
            if is_solid(corner) && !is_solid(before) {
                let run = (0..4).take_while(|n| is_solid(corners[(i + n) % 4])).count();
                let (last, after) = (corners[(i + run - 1) % 4], corners[(i + run) % 4]);
                next[usize::from(between(before, corner).0)] = Some(between(last, after));
            }
        }
    }
    next
}

/// A face's corners, counter-clockwise as seen from outside the cell.
fn around_face(axis: usize, side: usize) -> [usize; 4] {
    let (b, c) = others(axis);
    let mut corners = [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(u, v)| u << b | v << c | side << axis);
    if side == 0 {
        corners.reverse();
    }
    corners
}

fn between(a: usize, b: usize) -> Edge {
    Edge::new((a ^ b).trailing_zeros() as usize, a & b)
}

/// Triangles that fill a ring with as few inner edges in faces as possible, and how many those are.
fn fill(ring: &[Edge]) -> (u32, Vec<[Edge; 3]>) {
    let (Some(&first), Some(&last)) = (ring.first(), ring.last()) else { return (0, Vec::new()) };
    let mut best: Option<(u32, Vec<[Edge; 3]>)> = None;
    for middle in 1..ring.len().saturating_sub(1) {
        let apex = ring[middle];
        let in_face = |is_inner: bool, end: Edge| u32::from(is_inner && apex.shares_face(end));
        let (left, mut triangles) = fill(&ring[..=middle]);
        let (right, others) = fill(&ring[middle..]);
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
        // Aim: each triangle's edge is met by its reverse, or is one of the lines that the neighbour draws as well.
        for (solid, case) in CASES.iter().enumerate() {
            let lines = lines(solid);
            let mut edges: Vec<[u8; 2]> = Vec::new();
            for [a, b, c] in &case.triangles {
                edges.extend([[a.0, b.0], [b.0, c.0], [c.0, a.0]]);
            }
            for [a, b] in &edges {
                let is_line = lines[usize::from(*a)] == Some(Edge(*b));
                assert_eq!(edges.iter().filter(|e| *e == &[*a, *b]).count(), 1, "case {solid}");
                assert_ne!(is_line, edges.contains(&[*b, *a]), "case {solid}: edge {a}–{b}");
                assert!(is_line || !Edge(*a).shares_face(Edge(*b)), "case {solid}: {a}–{b} lies in a face");
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
