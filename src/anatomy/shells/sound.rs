//! Whether a surface has an inside: closed, in one sense, and of a tooth's size.

use crate::frame::Vec3;
use crate::volume::solid::Triangle;
use std::collections::BTreeMap;
use std::fmt;

/// How long a tooth is, or a jaw with all its teeth, mm. What is outside is another unit.
const LENGTH: std::ops::RangeInclusive<f32> = 3.0..=160.0;

/// How long a single tooth is, mm, for guessing units.
const TOOTH: std::ops::RangeInclusive<f32> = 4.0..=50.0;

/// Units that surfaces come in: the option's word, and mm.
pub const UNITS: [(&str, f32); 5] = [("mm", 1.0), ("cm", 10.0), ("m", 1000.0), ("um", 0.001), ("in", 25.4)];

/// Why a surface has no inside that can be trusted.
#[derive(Clone, Debug, PartialEq)]
pub enum Unsound {
    Empty,
    NotFinite,
    /// Its longest side, mm.
    Size(f32),
    /// Rims: how many, the longest one's length and middle, mm, and whether no triangle hangs together with another.
    Open {
        rims: usize,
        length: f32,
        middle: Vec3,
        is_loose: bool,
    },
    /// Edges that an odd number of triangles share, or more on one side than on the other, and the place of one.
    Tangled {
        edges: usize,
        place: Vec3,
    },
    /// One side of the surface runs over into the other, as on a Möbius strip.
    OneSided {
        place: Vec3,
    },
    /// So much of what is inside, mm³ and as a share, is inside twice or inside out.
    Crossing {
        mm3: f64,
        share: f64,
        place: Vec3,
    },
    /// Shells stand in one another so many levels deep, and so many tissues were named.
    Levels {
        found: usize,
        named: usize,
    },
    /// The grid would have too many voxels.
    TooFine {
        spacing: f32,
        voxels: f64,
    },
    /// Nothing of it is in the box to be cut out.
    Outside {
        low: Vec3,
        high: Vec3,
    },
    /// It is thinner than its voxels.
    NothingLeft,
}

fn place(f: &mut fmt::Formatter, Vec3 { x, y, z }: &Vec3) -> fmt::Result {
    write!(f, "({x:.1}, {y:.1}, {z:.1}) mm")
}

impl fmt::Display for Unsound {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Unsound::Empty => f.write_str("there are no triangles in it — export the surface again"),
            Unsound::NotFinite => f.write_str("a coordinate is not a finite number — export the surface again"),
            Unsound::Size(length) => {
                // Digits enough for metres taken for millimetres, and no zeros behind them.
                let told = format!("{length:.4}");
                let told = told.trim_end_matches('0').trim_end_matches('.');
                write!(
                    f,
                    "its longest side is {told} mm, and a tooth is {} to {} mm long",
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
            Unsound::Open { is_loose: true, .. } => f.write_str(
                "no triangle of it hangs together with another — merge corners that lie in the same place (MeshLab: \
                 Merge Close Vertices; Blender: Merge by Distance) and export it again",
            ),
            Unsound::Open { rims, length, middle, .. } => {
                match rims {
                    1 => write!(f, "the surface has a hole: its rim is {length:.1} mm long and lies around ")?,
                    n => {
                        write!(f, "the surface has {n} holes: the longest rim is {length:.1} mm long and lies around ")?
                    }
                }
                place(f, middle)?;
                f.write_str(" — close it in a mesh program (MeshLab: Close Holes; Blender: Fill), since only what is closed has an inside")
            }
            Unsound::Tangled { edges, place: at } => {
                write!(f, "{edges} edges are shared by triangles that do not pair up, one of them at ")?;
                place(f, at)?;
                f.write_str(
                    " — remove doubled faces and inner walls (MeshLab: Repair Non Manifold Edges) and export it again",
                )
            }
            Unsound::OneSided { place: at } => {
                f.write_str("the surface's one side runs over into its other at ")?;
                place(f, at)?;
                f.write_str(" — repair it in a mesh program, since what has one side has no inside")
            }
            Unsound::Crossing { mm3, share, place: at } => {
                write!(
                    f,
                    "the surface crosses itself: {mm3:.2} mm³ ({:.1} %) lie inside twice or inside out, around ",
                    share * 100.0
                )?;
                place(f, at)?;
                f.write_str(" — join its parts in a mesh program (Blender: Boolean Union; Meshmixer: Make Solid)")
            }
            Unsound::Levels { found, named } => write!(
                f,
                "its closed shells stand in one another {found} deep, and {named} tissues were named — name one tissue for \
                 each from outside in, as in --shells enamel,dentine,pulp, or give one file per tissue with --tissue"
            ),
            Unsound::TooFine { spacing, voxels } => write!(
                f,
                "at {spacing} mm it would have {voxels:.0} voxels, too many — take a larger --spacing-mm, or cut one tooth \
                 out with --crop"
            ),
            Unsound::Outside { low, high } => {
                f.write_str("nothing of it is in the box to be cut out; it reaches from ")?;
                place(f, low)?;
                f.write_str(" to ")?;
                place(f, high)
            }
            Unsound::NothingLeft => f.write_str(
                "no voxel's centre is inside it — take a smaller --spacing-mm, or give a solid instead of a sheet",
            ),
        }
    }
}

/// A closed surface in pieces that each face outward, or inward around a hollow.
#[derive(Clone, Debug)]
pub(super) struct Sound {
    pub positions: Vec<Vec3>,
    /// The triangles of each piece.
    pub pieces: Vec<Vec<[u32; 3]>>,
    /// Triangles that were turned to agree with their neighbours.
    pub turned: usize,
}

impl Sound {
    /// Joins corners that lie in the very same place, and looks whether what comes of it is closed.
    pub fn of(triangles: &[Triangle]) -> Result<Sound, Unsound> {
        if triangles.iter().flatten().any(|corner| !corner.is_finite()) {
            return Err(Unsound::NotFinite);
        }
        let (positions, mut corners) = welded(triangles);
        if corners.is_empty() {
            return Err(Unsound::Empty);
        }
        let [low, high] = bounds(positions.iter().copied());
        let length = (high - low).max_element();
        if !LENGTH.contains(&length) {
            return Err(Unsound::Size(length));
        }
        let edges = edges(&corners);
        check_rims(&edges, &positions)?;
        let turned = agree(&mut corners, &edges, &positions)?;
        check_balance(&corners, &positions)?;
        let pieces = pieces(&corners, positions.len());
        Ok(Sound { positions, pieces, turned })
    }

    pub fn triangles(&self, piece: usize) -> Vec<Triangle> {
        self.pieces[piece].iter().map(|t| t.map(|corner| self.positions[corner as usize])).collect()
    }
}

pub(super) fn bounds(points: impl Iterator<Item = Vec3>) -> [Vec3; 2] {
    points.fold([Vec3::INFINITY, Vec3::NEG_INFINITY], |[low, high], p| [low.min(p), high.max(p)])
}

/// Places once, and triangles of their numbers; those that have lost a side by that are left out.
fn welded(triangles: &[Triangle]) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    // Adding zero makes -0 the same place as 0.
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
struct Edge {
    /// The lower number first.
    ends: [u32; 2],
    /// True when the triangle runs from the lower number to the higher.
    is_rising: bool,
    triangle: u32,
}

/// All sides, those with the same ends together.
fn edges(corners: &[[u32; 3]]) -> Vec<Edge> {
    let mut edges: Vec<Edge> = Vec::with_capacity(3 * corners.len());
    for (triangle, &[a, b, c]) in (0..).zip(corners) {
        for [from, to] in [[a, b], [b, c], [c, a]] {
            edges.push(Edge { ends: [from.min(to), from.max(to)], is_rising: from < to, triangle });
        }
    }
    edges.sort_unstable_by_key(|edge| (edge.ends, edge.triangle));
    edges
}

fn same(a: &Edge, b: &Edge) -> bool {
    a.ends == b.ends
}

/// Every edge has two triangles, or some other even number where shells touch.
fn check_rims(edges: &[Edge], positions: &[Vec3]) -> Result<(), Unsound> {
    let open: Vec<[u32; 2]> = edges.chunk_by(same).filter(|e| e.len() == 1).map(|e| e[0].ends).collect();
    if open.is_empty() {
        return Ok(());
    }
    let is_loose = open.len() == edges.len() && edges.len() > 3;
    // Rims are pieces of the graph that the open edges make.
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
                // Each edge is met from both of its ends.
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
    Err(Unsound::Open { rims: rims.len(), length, middle, is_loose })
}

/// Turns triangles around until each agrees with its neighbours; returns how many it turned, as few as will do.
fn agree(corners: &mut [[u32; 3]], edges: &[Edge], positions: &[Vec3]) -> Result<usize, Unsound> {
    let mut beside: Vec<Vec<(u32, bool)>> = vec![Vec::new(); corners.len()];
    for pair in edges.chunk_by(same).filter(|edge| edge.len() == 2) {
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
                        return Err(Unsound::OneSided { place: positions[corners[here][0] as usize] });
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

/// As many triangles run along each edge one way as the other: then, and only then, is what is inside certain.
fn check_balance(corners: &[[u32; 3]], positions: &[Vec3]) -> Result<(), Unsound> {
    let edges = edges(corners);
    let balance = |edge: &[Edge]| edge.iter().map(|e| if e.is_rising { 1 } else { -1 }).sum::<i32>();
    let wrong: Vec<[u32; 2]> = edges.chunk_by(same).filter(|e| balance(e) != 0).map(|e| e[0].ends).collect();
    match wrong.first() {
        None => Ok(()),
        Some([a, b]) => {
            let place = 0.5 * (positions[*a as usize] + positions[*b as usize]);
            Err(Unsound::Tangled { edges: wrong.len(), place })
        }
    }
}

/// Triangles that share corners, piece by piece, in the order of their first triangle.
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
