//! Wavefront OBJ files.
//!
//! Takes the bytes of a file. Gives one closed mesh in millimetres, facing outward, or the first error; or only the
//! triangles, for display. Also converts a mesh to a file. Never reads materials and colours.

use crate::limits::DISPLAY_TRIANGLES_MAX;
use std::collections::BTreeMap;
use std::fmt;
use typodont_core::frame::Vec3;
use typodont_core::mesh::Mesh;

/// Valid lengths of the longest side of a mesh's bounding box, mm: a mesh smaller than a clamp or larger than a head
/// is in another unit.
const EXTENT: std::ops::RangeInclusive<f32> = 0.5..=400.0;

/// Reason why a mesh cannot be used.
#[derive(Clone, Debug, PartialEq)]
pub enum ObjError {
    /// The text is not OBJ.
    Syntax {
        what: String,
    },
    Empty,
    NotFinite,
    TooLarge {
        triangles: usize,
    },
    /// Longest side of the bounding box, mm.
    Size {
        extent: f32,
    },
    /// Number of edges that belong to one triangle only.
    Open {
        edges: usize,
    },
    /// Number of edges that belong to three triangles or more.
    Tangled {
        edges: usize,
    },
    /// Number of edges whose two triangles face opposite ways.
    Inconsistent {
        edges: usize,
    },
    /// All triangles face inward.
    InsideOut,
}

impl ObjError {
    /// Returns the name of the violated rule, for complaints.
    pub fn code(&self) -> &'static str {
        match self {
            ObjError::Syntax { .. } | ObjError::NotFinite => "wrong-mesh",
            ObjError::Empty => "empty-mesh",
            ObjError::TooLarge { .. } => "too-large",
            ObjError::Size { .. } => "wrong-size",
            ObjError::Open { .. } => "open-mesh",
            ObjError::Tangled { .. } | ObjError::Inconsistent { .. } | ObjError::InsideOut => "inconsistent-mesh",
        }
    }

    /// Returns the remedy.
    pub fn help(&self) -> &'static str {
        match self {
            ObjError::Syntax { .. } => "export the surface as Wavefront OBJ (.obj), as text",
            ObjError::NotFinite => "every coordinate must be a finite number in millimetres",
            ObjError::Empty => "the file needs faces: lines that begin with \"f\"",
            ObjError::TooLarge { .. } => "reduce it in a mesh program to at most 300 000 triangles",
            ObjError::Size { .. } => "export it in millimetres: its longest side must be 0.5 to 400 mm",
            ObjError::Open { .. } => "close the surface's holes: only a closed surface has an inside",
            ObjError::Tangled { .. } => {
                "remove inner walls and duplicate faces: exactly two faces must meet at each edge"
            }
            ObjError::Inconsistent { .. } => "make all faces face outward (\"recalculate normals\" in a mesh program)",
            ObjError::InsideOut => "flip all faces: seen from outside, their corners must run counter-clockwise",
        }
    }
}

impl fmt::Display for ObjError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            ObjError::Syntax { what } => write!(f, "this is not a Wavefront OBJ file: {what}"),
            ObjError::Empty => f.write_str("the mesh has no triangles"),
            ObjError::NotFinite => f.write_str("a coordinate is not a finite number"),
            ObjError::TooLarge { triangles } => write!(f, "the mesh has {triangles} triangles"),
            ObjError::Size { extent } => write!(f, "the mesh's longest side is {extent} mm"),
            ObjError::Open { edges } => write!(f, "the surface is not closed: {edges} edges have one face only"),
            ObjError::Tangled { edges } => write!(f, "{edges} edges have more than two faces"),
            ObjError::Inconsistent { edges } => {
                write!(f, "at {edges} edges the faces on both sides face opposite ways")
            }
            ObjError::InsideOut => f.write_str("the surface faces inward"),
        }
    }
}

impl std::error::Error for ObjError {}

/// Reads a closed mesh from all objects of the file together, mm.
///
/// Corners at identical positions are merged.
///
/// # Errors
/// Fails when the file is not OBJ, or when the mesh is empty, too large, of the wrong size, open or inconsistent.
pub fn parse(bytes: &[u8]) -> Result<Mesh, ObjError> {
    let models = models(bytes, false)?;
    let triangles = models.iter().map(|m| m.mesh.indices.len() / 3).sum();
    if triangles > DISPLAY_TRIANGLES_MAX {
        return Err(ObjError::TooLarge { triangles });
    }
    let mesh = welded(&models);
    if mesh.triangles.is_empty() {
        return Err(ObjError::Empty);
    }
    if mesh.positions.iter().any(|p| !p.is_finite()) {
        return Err(ObjError::NotFinite);
    }
    let low = mesh.positions.iter().copied().fold(Vec3::INFINITY, Vec3::min);
    let high = mesh.positions.iter().copied().fold(Vec3::NEG_INFINITY, Vec3::max);
    let extent = (high - low).max_element();
    if !EXTENT.contains(&extent) {
        return Err(ObjError::Size { extent });
    }
    check_edges(&mesh)?;
    if mesh.volume_mm3() <= 0.0 {
        return Err(ObjError::InsideOut);
    }
    Ok(mesh)
}

/// Reads all triangles of a file unchanged, closed or not, with the file's normals or, if it has none, those of the
/// faces.
pub(super) fn triangles(bytes: &[u8]) -> Result<Mesh, ObjError> {
    let mut all = Mesh::default();
    for tobj::Mesh { positions, normals, indices, .. } in models(bytes, true)?.into_iter().map(|m| m.mesh) {
        let vectors = |numbers: &[f32]| numbers.chunks_exact(3).map(Vec3::from_slice).collect::<Vec<_>>();
        let places = vectors(&positions);
        let corners: Vec<[u32; 3]> = indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect();
        let given = vectors(&normals);
        let first = all.positions.len() as u32;
        all.normals.extend(if given.len() == places.len() { given } else { normals_of(&places, &corners) });
        all.positions.extend(places);
        all.triangles.extend(corners.iter().map(|t| t.map(|i| first + i)));
    }
    Ok(all)
}

/// Reads the objects of a file. With `is_single`, each corner has a single index for its position and its normal.
fn models(bytes: &[u8], is_single: bool) -> Result<Vec<tobj::Model>, ObjError> {
    let options =
        tobj::LoadOptions { triangulate: true, ignore_points: true, ignore_lines: true, single_index: is_single };
    let materials = |_: &std::path::Path| Err(tobj::LoadError::GenericFailure);
    let read = tobj::load_obj_buf(&mut &bytes[..], &options, materials);
    read.map(|(models, _)| models).map_err(|e| ObjError::Syntax { what: e.to_string() })
}

/// Merges corners at identical positions into one mesh; triangles that degenerate by this are left out.
fn welded(models: &[tobj::Model]) -> Mesh {
    let mut corners = BTreeMap::new();
    let mut mesh = Mesh::default();
    for tobj::Mesh { positions, indices, .. } in models.iter().map(|m| &m.mesh) {
        let mut corner = |index: u32| {
            let at = 3 * index as usize;
            // Adding zero makes −0 and +0 the same position.
            let place = Vec3::new(positions[at], positions[at + 1], positions[at + 2]) + Vec3::ZERO;
            *corners.entry(place.to_array().map(f32::to_bits)).or_insert_with(|| {
                mesh.positions.push(place);
                mesh.positions.len() as u32 - 1
            })
        };
        let triangles = indices.chunks_exact(3).map(|t| [corner(t[0]), corner(t[1]), corner(t[2])]);
        let whole = triangles.filter(|[a, b, c]| a != b && b != c && c != a).collect::<Vec<_>>();
        mesh.triangles.extend(whole);
    }
    mesh.normals = normals_of(&mesh.positions, &mesh.triangles);
    mesh
}

/// Returns the outward normals of the corners, weighted by the area of their faces.
pub(super) fn normals_of(positions: &[Vec3], triangles: &[[u32; 3]]) -> Vec<Vec3> {
    let mut normals = vec![Vec3::ZERO; positions.len()];
    for &triangle in triangles {
        let [a, b, c] = triangle.map(|i| positions[i as usize]);
        triangle.iter().for_each(|&i| normals[i as usize] += (b - a).cross(c - a));
    }
    normals.iter().map(|n| n.normalize_or_zero()).collect()
}

/// Checks that every edge has two faces that run along it in opposite directions.
fn check_edges(mesh: &Mesh) -> Result<(), ObjError> {
    let directed = mesh.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
    let mut edges: Vec<([u32; 2], bool)> = directed.map(|[a, b]| ([a.min(b), a.max(b)], a < b)).collect();
    edges.sort_unstable();
    let (mut open, mut tangled, mut inconsistent) = (0, 0, 0);
    for faces in edges.chunk_by(|a, b| a.0 == b.0) {
        match faces {
            [_] => open += 1,
            [a, b] => inconsistent += usize::from(a.1 == b.1),
            _ => tangled += 1,
        }
    }
    match (open, tangled, inconsistent) {
        (0, 0, 0) => Ok(()),
        (0, 0, edges) => Err(ObjError::Inconsistent { edges }),
        (0, edges, _) => Err(ObjError::Tangled { edges }),
        (edges, ..) => Err(ObjError::Open { edges }),
    }
}

/// Returns a mesh as the text of an OBJ file, with a resolution of 0.1 µm.
pub fn text(mesh: &Mesh) -> String {
    let mut text = String::from("# millimetres\n");
    mesh.positions.iter().for_each(|p| text += &format!("v {:.4} {:.4} {:.4}\n", p.x, p.y, p.z));
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|i| i + 1);
        text += &format!("f {a} {b} {c}\n");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    const TETRAHEDRON: &str = "v 0 0 0\nv 4 0 0\nv 0 4 0\nv 0 0 4\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

    fn check(text: &str, expected: Result<f64, &str>) {
        let found = parse(text.as_bytes()).map(|m| m.volume_mm3()).map_err(|u| u.code());
        match (found, expected) {
            (Ok(volume), Ok(wanted)) => assert!((volume - wanted).abs() < 1e-4, "{volume}"),
            (found, expected) => assert_eq!(found.err(), expected.err(), "{text}"),
        }
    }

    #[test]
    fn only_closed_surfaces_facing_outward_are_read() {
        check(TETRAHEDRON, Ok(64.0 / 6.0));
        check(&TETRAHEDRON.replace("f 2 3 4", "f 2 3 9"), Err("wrong-mesh"));
        check(&TETRAHEDRON.replace("f 2 3 4", ""), Err("open-mesh"));
        check(&TETRAHEDRON.replace("f 2 3 4", "f 3 2 4"), Err("inconsistent-mesh"));
        check(&format!("{TETRAHEDRON}f 2 3 4\n"), Err("inconsistent-mesh"));
        check("v 0 0 0\nv 4 0 0\nv 0 4 0\nv 0 0 4\nf 1 2 3\nf 1 4 2\nf 1 3 4\nf 2 4 3\n", Err("inconsistent-mesh"));
        check(&TETRAHEDRON.replace('f', "#"), Err("empty-mesh"));
        check(&TETRAHEDRON.replace("v 4 0 0", "v NaN 0 0"), Err("wrong-mesh"));
        check(&TETRAHEDRON.replace("v 4 0 0", "v 4000 0 0"), Err("wrong-size"));
        check("PK\u{3}\u{4}", Err("empty-mesh"));
        check("v a b c\nf 1 2 3", Err("wrong-mesh"));
        check("f 1 2 3", Err("wrong-mesh"));
    }

    #[test]
    fn identical_corners_are_merged() {
        // Aim: files from programs that write three corners per triangle still give a closed surface.
        let places = ["0 0 0", "4 0 0", "0 4 0", "0 0 4"];
        let faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
        let corners: String = faces.iter().flatten().map(|&i: &usize| format!("v {}\n", places[i])).collect();
        check(&format!("{corners}f 1 2 3\nf 4 5 6\nf 7 8 9\nf 10 11 12\n"), Ok(64.0 / 6.0));
    }
}
