//! Closed surfaces as written by scanners, segmentation programs and modellers: STL, PLY, OBJ, glTF.
//!
//! Takes a file. Gives its triangles unchanged, in the file's own unit, or the first error. Never checks whether the
//! triangles enclose an inside; [`crate::import::voxelize`] does.

mod stl;
mod ply;

use crate::diagnostic::Diagnostic;
use crate::imaging::ScanError;
use crate::limits::SCAN_TRIANGLES_MAX;
use crate::visual_mesh::triangles_of_gltf;
use crate::{obj, read_file};
use std::path::{Component, Path};
use typodont_core::mesh::Mesh;
use typodont_core::volume::solid::Triangle;

pub(super) const DOING: &str = "reading a surface";

/// Extensions of files that are read as surfaces.
pub const ENDINGS: [&str; 5] = ["stl", "ply", "obj", "glb", "gltf"];

/// Returns true if the file's extension is that of a surface.
pub fn is_surface(path: &Path) -> bool {
    ENDINGS.contains(&ending(path).as_str())
}

fn ending(path: &Path) -> String {
    path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase()
}

fn wrong(what: impl Into<String>, remedy: &str) -> ScanError {
    ScanError::new(DOING, what, remedy)
}

/// Reads all triangles of a file, in its own unit, with the corners in the file's order.
///
/// # Errors
/// Fails when the file or a file that it names cannot be read, or is invalid.
pub fn read(path: &Path) -> Result<Vec<Triangle>, ScanError> {
    let bytes = read_file(path).map_err(|refused| {
        wrong(refused.message, "check that the file is there, that you may read it, and that it is one surface")
    });
    let beside = |name: &str| match Path::new(name).components().all(|c| matches!(c, Component::Normal(_))) {
        true => read_file(&path.with_file_name(name)),
        false => Err(Diagnostic::about_file(name, "outside-folder", "it is not beside the surface", None)),
    };
    bytes.and_then(|bytes| parse(&bytes, &ending(path), beside)).map_err(|unread| unread.in_file(path))
}

/// Parses the triangles of a file in memory by its extension; `fetch` returns the files that it names.
///
/// # Errors
/// Fails when the extension is unknown, when the file is invalid, or when it has no triangles or too many.
pub fn parse(
    bytes: &[u8],
    ending: &str,
    fetch: impl Fn(&str) -> Result<Vec<u8>, Diagnostic>,
) -> Result<Vec<Triangle>, ScanError> {
    if bytes.is_empty() {
        return Err(wrong("the file is empty", "copy or export the file again"));
    }
    let export = "export the surface again, as STL, PLY, OBJ or glTF without compression";
    let triangles = match ending {
        "stl" => stl::parse(bytes),
        "ply" => ply::parse(bytes),
        "obj" => obj::triangles(bytes).map_err(|e| wrong(e.to_string(), export)).map(triangle_soup),
        "glb" | "gltf" => {
            triangles_of_gltf(bytes, SCAN_TRIANGLES_MAX, fetch).map_err(|e| wrong(e, export)).map(triangle_soup)
        }
        other => Err(wrong(
            format!("\".{other}\" is not a supported surface format"),
            "give .stl, .ply, .obj, .glb or .gltf",
        )),
    }?;
    match triangles.len() {
        0 => Err(wrong("there are no triangles in it", export)),
        n if n > SCAN_TRIANGLES_MAX => {
            Err(wrong(format!("it has {n} triangles, more than {SCAN_TRIANGLES_MAX}"), "reduce it in a mesh program"))
        }
        _ => Ok(triangles),
    }
}

fn triangle_soup(mesh: Mesh) -> Vec<Triangle> {
    mesh.triangles.iter().map(|t| t.map(|corner| mesh.positions[corner as usize])).collect()
}
