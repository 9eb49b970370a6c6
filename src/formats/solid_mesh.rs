//! Closed meshes of objects that are touched, from the formats that modellers write: OBJ, glTF, STL, PLY.
//!
//! Takes the bytes of a file. Gives one closed mesh in millimetres, facing outward, or the first error. Never reads
//! materials and colours.

use crate::diagnostic::Diagnostic;
use crate::limits::DISPLAY_TRIANGLES_MAX;
use crate::{obj, surfaces};
use std::collections::BTreeMap;
use std::fmt;
use typodont_core::frame::Vec3;
use typodont_core::mesh::Mesh;
use typodont_core::volume::solid::Triangle;

/// Valid lengths of the longest side of a mesh's bounding box, mm: a mesh smaller than a clamp or larger than a head
/// is in another unit.
const EXTENT: std::ops::RangeInclusive<f32> = 0.5..=400.0;

/// Reason why a mesh cannot be used.
#[derive(Clone, Debug, PartialEq)]
pub enum SolidMeshError {
    /// The file is not of its format.
    Unreadable {
        what: String,
        help: String,
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

impl SolidMeshError {
    /// Returns the name of the violated rule, for complaints.
    pub fn code(&self) -> &'static str {
        match self {
            SolidMeshError::Unreadable { .. } | SolidMeshError::NotFinite => "wrong-mesh",
            SolidMeshError::Empty => "empty-mesh",
            SolidMeshError::TooLarge { .. } => "too-large",
            SolidMeshError::Size { .. } => "wrong-size",
            SolidMeshError::Open { .. } => "open-mesh",
            SolidMeshError::Tangled { .. } | SolidMeshError::Inconsistent { .. } | SolidMeshError::InsideOut => {
                "inconsistent-mesh"
            }
        }
    }

    /// Returns the remedy.
    pub fn help(&self) -> &str {
        match self {
            SolidMeshError::Unreadable { help, .. } => help,
            SolidMeshError::NotFinite => "every coordinate must be a finite number in millimetres",
            SolidMeshError::Empty => "the file needs faces; in an OBJ file they are the lines that begin with \"f\"",
            SolidMeshError::TooLarge { .. } => "reduce it in a mesh program to at most 300 000 triangles",
            SolidMeshError::Size { .. } => "export it in millimetres: its longest side must be 0.5 to 400 mm",
            SolidMeshError::Open { .. } => "close the surface's holes: only a closed surface has an inside",
            SolidMeshError::Tangled { .. } => {
                "remove inner walls and duplicate faces: exactly two faces must meet at each edge"
            }
            SolidMeshError::Inconsistent { .. } => {
                "make all faces face outward (\"recalculate normals\" in a mesh program)"
            }
            SolidMeshError::InsideOut => "flip all faces: seen from outside, their corners must run counter-clockwise",
        }
    }
}

impl fmt::Display for SolidMeshError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            SolidMeshError::Unreadable { what, .. } => f.write_str(what),
            SolidMeshError::Empty => f.write_str("the mesh has no triangles"),
            SolidMeshError::NotFinite => f.write_str("a coordinate is not a finite number"),
            SolidMeshError::TooLarge { triangles } => write!(f, "the mesh has {triangles} triangles"),
            SolidMeshError::Size { extent } => write!(f, "the mesh's longest side is {extent} mm"),
            SolidMeshError::Open { edges } => write!(f, "the surface is not closed: {edges} edges have one face only"),
            SolidMeshError::Tangled { edges } => write!(f, "{edges} edges have more than two faces"),
            SolidMeshError::Inconsistent { edges } => {
                write!(f, "at {edges} edges the faces on both sides face opposite ways")
            }
            SolidMeshError::InsideOut => f.write_str("the surface faces inward"),
        }
    }
}

impl std::error::Error for SolidMeshError {}

/// Reads a closed mesh from all objects of a file together, mm, by the file's extension; `fetch` returns the files that it
/// names. Corners at identical positions are merged.
///
/// # Errors
/// Fails when the file is not of its format, or when the mesh is empty, too large, of the wrong size, open or inconsistent.
pub fn parse(
    bytes: &[u8],
    ending: &str,
    fetch: impl Fn(&str) -> Result<Vec<u8>, Diagnostic>,
) -> Result<Mesh, SolidMeshError> {
    let soup = match ending {
        "obj" => obj::triangle_soup(bytes).map_err(|what| SolidMeshError::Unreadable {
            what,
            help: "export the surface as Wavefront OBJ (.obj), as text".into(),
        })?,
        _ => surfaces::parse(bytes, ending, fetch)
            .map_err(|refused| SolidMeshError::Unreadable { what: refused.what, help: refused.remedy })?,
    };
    if soup.len() > DISPLAY_TRIANGLES_MAX {
        return Err(SolidMeshError::TooLarge { triangles: soup.len() });
    }
    let mesh = welded(&soup);
    if mesh.triangles.is_empty() {
        return Err(SolidMeshError::Empty);
    }
    if mesh.positions.iter().any(|p| !p.is_finite()) {
        return Err(SolidMeshError::NotFinite);
    }
    let low = mesh.positions.iter().copied().fold(Vec3::INFINITY, Vec3::min);
    let high = mesh.positions.iter().copied().fold(Vec3::NEG_INFINITY, Vec3::max);
    let extent = (high - low).max_element();
    if !EXTENT.contains(&extent) {
        return Err(SolidMeshError::Size { extent });
    }
    check_edges(&mesh)?;
    if mesh.volume_mm3() <= 0.0 {
        return Err(SolidMeshError::InsideOut);
    }
    Ok(mesh)
}

/// Merges corners at identical positions into one mesh; triangles that degenerate by this are left out.
fn welded(soup: &[Triangle]) -> Mesh {
    let mut corners = BTreeMap::new();
    let mut mesh = Mesh::default();
    for triangle in soup {
        let corner = |place: Vec3| {
            // Adding zero makes −0 and +0 the same position.
            let place = place + Vec3::ZERO;
            *corners.entry(place.to_array().map(f32::to_bits)).or_insert_with(|| {
                mesh.positions.push(place);
                mesh.positions.len() as u32 - 1
            })
        };
        let [a, b, c] = triangle.map(corner);
        if a != b && b != c && c != a {
            mesh.triangles.push([a, b, c]);
        }
    }
    mesh.normals = obj::normals_of(&mesh.positions, &mesh.triangles);
    mesh
}

/// Checks that every edge has two faces that run along it in opposite directions.
fn check_edges(mesh: &Mesh) -> Result<(), SolidMeshError> {
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
        (0, 0, edges) => Err(SolidMeshError::Inconsistent { edges }),
        (0, edges, _) => Err(SolidMeshError::Tangled { edges }),
        (edges, ..) => Err(SolidMeshError::Open { edges }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TETRAHEDRON: &str = "v 0 0 0\nv 4 0 0\nv 0 4 0\nv 0 0 4\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

    fn check(text: &str, expected: Result<f64, &str>) {
        let found = parse(text.as_bytes(), "obj", no_files).map(|m| m.volume_mm3()).map_err(|u| u.code());
        match (found, expected) {
            (Ok(volume), Ok(wanted)) => assert!((volume - wanted).abs() < 1e-4, "{volume}"),
            (found, expected) => assert_eq!(found.err(), expected.err(), "{text}"),
        }
    }

    fn no_files(name: &str) -> Result<Vec<u8>, Diagnostic> {
        Err(Diagnostic::about_file(name, "missing-file", "there are no other files", None))
    }

    #[test]
    fn other_formats_give_the_same_solid() {
        // Aim: a school's modeller may write any format. Method: the tetrahedron as STL and as PLY.
        let solid = parse(TETRAHEDRON.as_bytes(), "obj", no_files).unwrap();
        let facet = |t: &[u32; 3]| {
            let corner = |i: u32| {
                format!(
                    "vertex {} {} {}",
                    solid.positions[i as usize].x, solid.positions[i as usize].y, solid.positions[i as usize].z
                )
            };
            format!(
                "facet normal 0 0 0\nouter loop\n{}\n{}\n{}\nendloop\nendfacet\n",
                corner(t[0]),
                corner(t[1]),
                corner(t[2])
            )
        };
        let stl = format!("solid t\n{}endsolid t\n", solid.triangles.iter().map(facet).collect::<String>());
        let found = parse(stl.as_bytes(), "stl", no_files).unwrap();
        assert_eq!((found.positions, found.triangles), (solid.positions, solid.triangles));
        let open = stl.replacen("facet", "rubbish", 1);
        assert_eq!(parse(open.as_bytes(), "stl", no_files).unwrap_err().code(), "wrong-mesh");
        assert_eq!(parse(b"x", "max", no_files).unwrap_err().code(), "wrong-mesh");
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
