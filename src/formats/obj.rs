//! Wavefront OBJ files.
//!
//! Takes the bytes of a file. Gives its triangles, or what is wrong with it. Also converts a mesh to a file. Never reads
//! materials and colours.

use typodont_core::frame::Vec3;
use typodont_core::mesh::Mesh;
use typodont_core::volume::solid::Triangle;

/// Reads all triangles of a file unchanged, closed or not, with the file's normals or, if it has none, those of the
/// faces.
pub(super) fn triangles(bytes: &[u8]) -> Result<Mesh, String> {
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

/// Reads the triangles of all objects of a file, whose corners are not joined.
///
/// # Errors
/// Returns what is wrong if the file is not OBJ.
pub(super) fn triangle_soup(bytes: &[u8]) -> Result<Vec<Triangle>, String> {
    let mut soup = Vec::new();
    for tobj::Mesh { positions, indices, .. } in models(bytes, false)?.into_iter().map(|m| m.mesh) {
        let place = |index: u32| Vec3::from_slice(&positions[3 * index as usize..][..3]);
        soup.extend(indices.chunks_exact(3).map(|t| [place(t[0]), place(t[1]), place(t[2])]));
    }
    Ok(soup)
}

/// Reads the objects of a file. With `is_single`, each corner has a single index for its position and its normal.
fn models(bytes: &[u8], is_single: bool) -> Result<Vec<tobj::Model>, String> {
    let options =
        tobj::LoadOptions { triangulate: true, ignore_points: true, ignore_lines: true, single_index: is_single };
    let materials = |_: &std::path::Path| Err(tobj::LoadError::GenericFailure);
    let read = tobj::load_obj_buf(&mut &bytes[..], &options, materials);
    read.map(|(models, _)| models).map_err(|e| format!("this is not a Wavefront OBJ file: {e}"))
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
