//! Closed surfaces as scanners, segmentation programs and modellers write them: STL, PLY, OBJ, glTF.
//!
//! Takes a file. Gives its triangles as they are, in the file's own unit, or the first thing that is wrong with it. Whether
//! they have an inside, [`crate::anatomy::shells`] says.

mod stl;
mod ply;

use super::imaging::Unread;
use super::picture_mesh::triangles_of_gltf;
use super::{obj, read_file};
use crate::diagnostic::Diagnostic;
use crate::mesh::Mesh;
use crate::volume::solid::Triangle;
use std::path::{Component, Path};

pub(super) const DOING: &str = "reading a surface";

/// Most triangles: a scanned arch has half a million; ten times that is a mistake or needs no more detail.
pub const TRIANGLES_MAX: usize = 5_000_000;

/// The endings of files that are read as surfaces.
pub const ENDINGS: [&str; 5] = ["stl", "ply", "obj", "glb", "gltf"];

/// True when a file is a surface by its name.
pub fn is_surface(path: &Path) -> bool {
    ENDINGS.contains(&ending(path).as_str())
}

fn ending(path: &Path) -> String {
    path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase()
}

fn wrong(what: impl Into<String>, remedy: &str) -> Unread {
    Unread::new(DOING, what, remedy)
}

/// All triangles of a file, counter-clockwise as it has them.
pub fn read(path: &Path) -> Result<Vec<Triangle>, Unread> {
    let bytes = read_file(path).map_err(|refused| {
        wrong(refused.message, "check that the file is there, that you may read it, and that it is one surface")
    });
    let beside = |name: &str| match Path::new(name).components().all(|c| matches!(c, Component::Normal(_))) {
        true => read_file(&path.with_file_name(name)),
        false => Err(Diagnostic::about_file(name, "outside-folder", "it does not lie beside the surface", None)),
    };
    bytes.and_then(|bytes| parse(&bytes, &ending(path), beside)).map_err(|unread| unread.in_file(path))
}

/// The triangles of a file in memory, by its ending; `fetch` brings files that it names.
pub fn parse(
    bytes: &[u8],
    ending: &str,
    fetch: impl Fn(&str) -> Result<Vec<u8>, Diagnostic>,
) -> Result<Vec<Triangle>, Unread> {
    if bytes.is_empty() {
        return Err(wrong("the file is empty", "copy or export the file again"));
    }
    let export = "export the surface again, as STL, PLY, OBJ or glTF without compression";
    let triangles = match ending {
        "stl" => stl::parse(bytes),
        "ply" => ply::parse(bytes),
        "obj" => obj::triangles(bytes).map_err(|e| wrong(e.to_string(), export)).map(apart),
        "glb" | "gltf" => triangles_of_gltf(bytes, fetch).map_err(|e| wrong(e, export)).map(apart),
        other => {
            Err(wrong(format!("\".{other}\" is no surface that is read here"), "give .stl, .ply, .obj, .glb or .gltf"))
        }
    }?;
    match triangles.len() {
        0 => Err(wrong("there are no triangles in it", export)),
        n if n > TRIANGLES_MAX => {
            Err(wrong(format!("it has {n} triangles, more than {TRIANGLES_MAX}"), "thin it out in a mesh program"))
        }
        _ => Ok(triangles),
    }
}

fn apart(mesh: Mesh) -> Vec<Triangle> {
    mesh.triangles.iter().map(|t| t.map(|corner| mesh.positions[corner as usize])).collect()
}
