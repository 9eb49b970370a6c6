//! Validation of surfaces: closed, consistently oriented, and of a tooth's size.

use std::collections::BTreeMap;
use std::fmt;
use typodont_core::aabb::Aabb;
use typodont_core::frame::Vec3;
use typodont_core::volume::solid::Triangle;

/// Plausible length of a tooth, or of a jaw with all its teeth, mm. A length outside this range is in another unit.
const LENGTH: std::ops::RangeInclusive<f32> = 3.0..=160.0;

/// Plausible length of a single tooth, mm, for guessing the unit.
const TOOTH: std::ops::RangeInclusive<f32> = 4.0..=50.0;

/// Units of surface files: the word of the option, and the length in mm.
pub const UNITS: [(&str, f32); 5] = [("mm", 1.0), ("cm", 10.0), ("m", 1000.0), ("um", 0.001), ("in", 25.4)];

/// Reason why a surface has no reliable inside.
#[derive(Clone, Debug, PartialEq)]
pub enum VoxelizeError {
    Empty,
    NotFinite,
    /// Longest side of the surface, mm.
    Size(f32),
    /// Rims: their number, the length and the middle of the longest, mm, and whether no triangle is connected to
    /// another.
    Open {
        rims: usize,
        length: f32,
        middle: Vec3,
        is_loose: bool,
    },
    /// Edges that an odd number of triangles share, or more triangles on one side than on the other; and the position
    /// of one, mm.
    Tangled {
        edges: usize,
        place: Vec3,
    },
    /// One side of the surface continues into the other, as on a Möbius strip.
    OneSided {
        place: Vec3,
    },
    /// Volume that is inside twice or inside out, mm³ and as a fraction of the inside.
    Crossing {
        mm3: f64,
        share: f64,
        place: Vec3,
    },
    /// Nesting depth of the shells, which differs from the number of named tissues.
    Levels {
        found: usize,
        named: usize,
    },
    /// Number of separate pieces, more than an object has.
    Pieces(usize),
    /// The grid would have too many voxels.
    TooFine {
        spacing: f32,
        voxels: f64,
    },
    /// No part of the surface is in the crop box.
    Outside {
        low: Vec3,
        high: Vec3,
    },
    /// The surface encloses no voxel centre.
    NothingLeft,
}

fn write_position(f: &mut fmt::Formatter, Vec3 { x, y, z }: &Vec3) -> fmt::Result {
    write!(f, "({x:.1}, {y:.1}, {z:.1}) mm")
}

impl fmt::Display for VoxelizeError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            VoxelizeError::Empty => f.write_str("there are no triangles in it — export the surface again"),
            VoxelizeError::NotFinite => f.write_str("a coordinate is not a finite number — export the surface again"),
            VoxelizeError::Size(length) => {
                // Enough digits for metres mistaken for millimetres, without trailing zeros.
                let digits = format!("{length:.4}");
                let digits = digits.trim_end_matches('0').trim_end_matches('.');
                write!(
                    f,
                    "its longest side is {digits} mm, and a tooth is {} to {} mm long",
                    TOOTH.start(),
                    TOOTH.end()
                )?;
                let fits = |(_, mm): &&(&str, f32)| TOOTH.contains(&(length * mm));
                match UNITS.iter().find(fits) {
                    Some((unit, _)) => {
                        write!(f, " — its unit is not mm: give --unit {unit} if that is what it was made in")
                    }
                    None => f.write_str(" — give the --unit it was made in, or scale it in a mesh program"),
                }
            }
            VoxelizeError::Open { is_loose: true, .. } => f.write_str(
                "no triangle is connected to another — merge corners at the same position (MeshLab: \
                 Merge Close Vertices; Blender: Merge by Distance) and export it again",
            ),
            VoxelizeError::Open { rims, length, middle, .. } => {
                match rims {
                    1 => write!(f, "the surface has a hole: its rim is {length:.1} mm long and lies around ")?,
                    n => {
                        write!(f, "the surface has {n} holes: the longest rim is {length:.1} mm long and lies around ")?
                    }
                }
                write_position(f, middle)?;
                f.write_str(" — close it in a mesh program (MeshLab: Close Holes; Blender: Fill), since only a closed surface has an inside")
            }
            VoxelizeError::Tangled { edges, place: at } => {
                write!(f, "{edges} edges are shared by triangles that do not pair up, one of them at ")?;
                write_position(f, at)?;
                f.write_str(
                    " — remove duplicate faces and inner walls (MeshLab: Repair Non Manifold Edges) and export it again",
                )
            }
            VoxelizeError::OneSided { place: at } => {
                f.write_str("one side of the surface continues into the other at ")?;
                write_position(f, at)?;
                f.write_str(" — repair it in a mesh program, since a one-sided surface has no inside")
            }
            VoxelizeError::Crossing { mm3, share, place: at } => {
                write!(
                    f,
                    "the surface crosses itself: {mm3:.2} mm³ ({:.1} %) lie inside twice or inside out, around ",
                    share * 100.0
                )?;
                write_position(f, at)?;
                f.write_str(" — join its parts in a mesh program (Blender: Boolean Union; Meshmixer: Make Solid)")
            }
            VoxelizeError::Levels { found, named } => write!(
                f,
                "its closed shells are nested {found} deep, and {named} tissues were named — name one tissue for \
                 each from outside in, as in --shells enamel,dentine,pulp, or give one file per tissue with --tissue"
            ),
            VoxelizeError::Pieces(found) => write!(
                f,
                "it has {found} separate pieces — keep those of the object (MeshLab: Remove Isolated Pieces) and export it \
                 again"
            ),
            VoxelizeError::TooFine { spacing, voxels } => write!(
                f,
                "at {spacing} mm it would have {voxels:.0} voxels, too many — use a larger --spacing-mm, or crop one \
                 tooth with --crop"
            ),
            VoxelizeError::Outside { low, high } => {
                f.write_str("no part of it is in the crop box; it extends from ")?;
                write_position(f, low)?;
                f.write_str(" to ")?;
                write_position(f, high)
            }
            VoxelizeError::NothingLeft => f.write_str(
                "it contains no voxel centre — use a smaller --spacing-mm, or give a solid instead of a sheet",
            ),
        }
    }
}

impl std::error::Error for VoxelizeError {}

/// A closed surface in pieces, each of which faces outward, or inward around a hollow.
#[derive(Clone, Debug)]
pub(super) struct CheckedMesh {
    pub positions: Vec<Vec3>,
    /// The triangles of each piece.
    pub pieces: Vec<Vec<[u32; 3]>>,
    /// Number of triangles that were flipped to agree with their neighbours.
    pub flipped_triangles: usize,
}

impl CheckedMesh {
    /// Joins corners at identical positions and checks that the result is closed.
    ///
    /// # Errors
    /// Fails when the mesh is empty, not finite, of an implausible size, not closed, or cannot be oriented
    /// consistently.
    pub fn of(triangles: &[Triangle]) -> Result<CheckedMesh, VoxelizeError> {
        let length = Aabb::around(triangles.iter().flatten().copied()).size().max_element();
        if triangles.iter().flatten().all(|corner| corner.is_finite())
            && !triangles.is_empty()
            && !LENGTH.contains(&length)
        {
            return Err(VoxelizeError::Size(length));
        }
        CheckedMesh::of_any_size(triangles)
    }

    /// Does the same for a surface of any size.
    ///
    /// # Errors
    /// Fails when the mesh is empty, not finite, not closed, or cannot be oriented consistently.
    pub fn of_any_size(triangles: &[Triangle]) -> Result<CheckedMesh, VoxelizeError> {
        if triangles.iter().flatten().any(|corner| !corner.is_finite()) {
            return Err(VoxelizeError::NotFinite);
        }
        let (positions, mut corners) = welded(triangles);
        if corners.is_empty() {
            return Err(VoxelizeError::Empty);
        }
        let edges = half_edges(&corners);
        check_rims(&edges, &positions)?;
        let turned = orient_consistently(&mut corners, &edges, &positions)?;
        check_balance(&corners, &positions)?;
        let pieces = pieces(&corners, positions.len());
        Ok(CheckedMesh { positions, pieces, flipped_triangles: turned })
    }

    pub fn triangles(&self, piece: usize) -> Vec<Triangle> {
        self.pieces[piece].iter().map(|t| t.map(|corner| self.positions[corner as usize])).collect()
    }
}

/// Merges identical positions and returns the triangles as indices; triangles that degenerate by this are left out.
fn welded(triangles: &[Triangle]) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    // Adding zero makes −0 and +0 the same position.
    let key = |p: Vec3| (p + Vec3::ZERO).to_array().map(f32::to_bits);
    let mut order: Vec<u32> = (0..3 * triangles.len() as u32).collect();
    let at = |n: u32| triangles[n as usize / 3][n as usize % 3];
    order.sort_unstable_by_key(|&n| key(at(n)));
    let mut positions: Vec<Vec3> = Vec::new();
    let mut number = vec![0; order.len()];
    for &n in &order {
        if positions.last().is_none_or(|last| key(*last) != key(at(n))) {
            positions.push(at(n));
        }
        number[n as usize] = positions.len() as u32 - 1;
    }
    let corners = number.as_chunks::<3>().0.iter().copied().filter(|[a, b, c]| a != b && b != c && c != a).collect();
    (positions, corners)
}

/// One side of a triangle.
#[derive(Clone, Copy, Debug)]
struct HalfEdge {
    /// Indices of both ends, the lower first.
    ends: [u32; 2],
    /// True when the triangle runs from the lower index to the higher.
    is_rising: bool,
    triangle: u32,
}

/// Returns the sides of all triangles, sorted so that those with the same ends are adjacent.
fn half_edges(corners: &[[u32; 3]]) -> Vec<HalfEdge> {
    let mut edges: Vec<HalfEdge> = Vec::with_capacity(3 * corners.len());
    for (triangle, &[a, b, c]) in (0..).zip(corners) {
        for [from, to] in [[a, b], [b, c], [c, a]] {
            edges.push(HalfEdge { ends: [from.min(to), from.max(to)], is_rising: from < to, triangle });
        }
    }
    edges.sort_unstable_by_key(|edge| (edge.ends, edge.triangle));
    edges
}

fn has_same_ends(a: &HalfEdge, b: &HalfEdge) -> bool {
    a.ends == b.ends
}

/// Checks that every edge has two triangles, or some other even number where shells touch.
fn check_rims(edges: &[HalfEdge], positions: &[Vec3]) -> Result<(), VoxelizeError> {
    let open: Vec<[u32; 2]> = edges.chunk_by(has_same_ends).filter(|e| e.len() == 1).map(|e| e[0].ends).collect();
    if open.is_empty() {
        return Ok(());
    }
    let is_loose = open.len() == edges.len() && edges.len() > 3;
    // Rims are the connected components of the graph of open edges.
    let mut next: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for [a, b] in open {
        next.entry(a).or_default().push(b);
        next.entry(b).or_default().push(a);
    }
    let at = |n: u32| positions[n as usize];
    let mut rims: Vec<(f32, Vec3)> = Vec::new();
    let mut seen: BTreeMap<u32, ()> = BTreeMap::new();
    for &start in next.keys() {
        if seen.insert(start, ()).is_some() {
            continue;
        }
        let (mut length, mut sum, mut count) = (0.0, Vec3::ZERO, 0.0);
        let mut waiting = vec![start];
        while let Some(here) = waiting.pop() {
            sum += at(here);
            count += 1.0;
            for &there in &next[&here] {
                // Each edge is visited from both of its ends.
                length += 0.5 * at(here).distance(at(there));
                if seen.insert(there, ()).is_none() {
                    waiting.push(there);
                }
            }
        }
        rims.push((length, sum / count));
    }
    let longest = rims.iter().copied().reduce(|a, b| if b.0 > a.0 { b } else { a });
    let (length, middle) = longest.unwrap_or_default();
    Err(VoxelizeError::Open { rims: rims.len(), length, middle, is_loose })
}

/// Flips triangles until each agrees with its neighbours; returns the number of flipped triangles, which is minimal
/// per piece.
fn orient_consistently(
    corners: &mut [[u32; 3]],
    edges: &[HalfEdge],
    positions: &[Vec3],
) -> Result<usize, VoxelizeError> {
    let mut beside: Vec<Vec<(u32, bool)>> = vec![Vec::new(); corners.len()];
    for pair in edges.chunk_by(has_same_ends).filter(|edge| edge.len() == 2) {
        let disagree = pair[0].is_rising == pair[1].is_rising;
        beside[pair[0].triangle as usize].push((pair[1].triangle, disagree));
        beside[pair[1].triangle as usize].push((pair[0].triangle, disagree));
    }
    let mut is_turned: Vec<Option<bool>> = vec![None; corners.len()];
    let mut turned = 0;
    for start in 0..corners.len() {
        if is_turned[start].is_some() {
            continue;
        }
        is_turned[start] = Some(false);
        let mut piece = vec![start];
        let mut done = 0;
        while let Some(&here) = piece.get(done) {
            done += 1;
            for &(there, disagree) in &beside[here] {
                let wanted = is_turned[here] == Some(!disagree);
                match is_turned[there as usize] {
                    None => {
                        is_turned[there as usize] = Some(wanted);
                        piece.push(there as usize);
                    }
                    Some(known) if known != wanted => {
                        return Err(VoxelizeError::OneSided { place: positions[corners[here][0] as usize] });
                    }
                    Some(_) => {}
                }
            }
        }
        let count = piece.iter().filter(|&&n| is_turned[n] == Some(true)).count();
        let is_most = 2 * count > piece.len();
        turned += count.min(piece.len() - count);
        for n in piece {
            if (is_turned[n] == Some(true)) != is_most {
                corners[n].swap(1, 2);
            }
        }
    }
    Ok(turned)
}

/// Checks that along each edge as many triangles run one way as the other: only then is the inside well defined.
fn check_balance(corners: &[[u32; 3]], positions: &[Vec3]) -> Result<(), VoxelizeError> {
    let edges = half_edges(corners);
    let balance = |edge: &[HalfEdge]| edge.iter().map(|e| if e.is_rising { 1 } else { -1 }).sum::<i32>();
    let wrong: Vec<[u32; 2]> = edges.chunk_by(has_same_ends).filter(|e| balance(e) != 0).map(|e| e[0].ends).collect();
    match wrong.first() {
        None => Ok(()),
        Some([a, b]) => {
            let place = 0.5 * (positions[*a as usize] + positions[*b as usize]);
            Err(VoxelizeError::Tangled { edges: wrong.len(), place })
        }
    }
}

/// Groups triangles that share corners into pieces, in the order of their first triangle.
fn pieces(corners: &[[u32; 3]], count: usize) -> Vec<Vec<[u32; 3]>> {
    let mut root: Vec<u32> = (0..count as u32).collect();
    fn find(root: &mut [u32], mut n: u32) -> u32 {
        while root[n as usize] != n {
            root[n as usize] = root[root[n as usize] as usize];
            n = root[n as usize];
        }
        n
    }
    for &[a, b, c] in corners {
        let [a, b, c] = [a, b, c].map(|n| find(&mut root, n));
        root[b as usize] = a;
        let c = find(&mut root, c);
        root[c as usize] = a;
    }
    let mut number: BTreeMap<u32, usize> = BTreeMap::new();
    let mut pieces: Vec<Vec<[u32; 3]>> = Vec::new();
    for &triangle in corners {
        let piece = *number.entry(find(&mut root, triangle[0])).or_insert(pieces.len());
        if piece == pieces.len() {
            pieces.push(Vec::new());
        }
        pieces[piece].push(triangle);
    }
    pieces
}
