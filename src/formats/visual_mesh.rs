//! Meshes for display: an instrument from a Wavefront OBJ or a glTF 2.0 file.
//!
//! Takes the bytes of a file, in millimetres. Gives one mesh with normals, or the first error. Never reads materials,
//! textures and animations; never requires a closed surface.

use crate::Library;
use crate::diagnostic::Diagnostic;
use crate::limits::DISPLAY_TRIANGLES_MAX;
use crate::obj;
use base64::Engine;
use glam::{Affine3A, Mat4};
use gltf::accessor::{DataType, Dimensions, Item, Iter};
use gltf::buffer::Source;
use gltf::json::validation::Validate;
use gltf::mesh::{Mode, Semantic};
use gltf::scene::Transform;
use gltf::{Accessor, Gltf, Node};
use typodont_core::aabb::Aabb;
use typodont_core::frame::{Quat, Vec3};
use typodont_core::mesh::Mesh;

/// Valid lengths of the longest side of the bounding box of a hand-held object, mm.
const EXTENT: std::ops::RangeInclusive<f32> = 2.0..=400.0;

/// Maximum nesting depth of nodes. Instruments and scans have a few levels; the limit bounds the stack of the
/// traversal.
const DEPTH_MAX: usize = 32;

/// Reads a mesh by its name in a library: `.obj`, `.glb` or `.gltf`.
///
/// # Errors
/// Fails when the file is missing, is not a mesh, or is empty, too large or of the wrong size.
pub fn read(library: &Library, name: &str) -> Result<Mesh, Diagnostic> {
    let wrong = |message: String, help: &str| Diagnostic::about_file(name, "wrong-mesh", message, Some(help.into()));
    let too_large = |count: usize| {
        let help = format!("reduce it in a mesh program to at most {} triangles", DISPLAY_TRIANGLES_MAX);
        wrong(format!("the mesh has {count} triangles or more"), &help)
    };
    let bytes = library.bytes(name)?;
    let extension = name.rsplit('.').next().unwrap_or_default().to_ascii_lowercase();
    let read = match extension.as_str() {
        "obj" => obj::triangles(&bytes).map_err(|e| e.to_string()),
        "glb" | "gltf" => {
            let fetch = |uri: &str| library.bytes(&sibling_path(name, uri)).map(|b| b.to_vec());
            triangles_of_gltf(&bytes, DISPLAY_TRIANGLES_MAX, fetch)
        }
        _ => {
            return Err(wrong(
                format!("a mesh cannot be read from \".{extension}\""),
                "give an .obj, .glb or .gltf file",
            ));
        }
    };
    let export = "export it again as Wavefront OBJ or glTF 2.0, in millimetres, without compression";
    let mesh = read.map_err(|what| wrong(what, export))?;
    if mesh.triangles.is_empty() {
        return Err(wrong("the mesh has no triangles".into(), export));
    }
    if mesh.triangles.len() > DISPLAY_TRIANGLES_MAX {
        return Err(too_large(mesh.triangles.len()));
    }
    if mesh.positions.iter().any(|p| !p.is_finite()) {
        return Err(wrong("a coordinate is not a finite number".into(), export));
    }
    let extent = Aabb::around(mesh.positions.iter().copied()).size().max_element();
    if !EXTENT.contains(&extent) {
        let help = "one unit of the file must be a millimetre, with the working end's tip at the origin and the shaft towards +z";
        return Err(wrong(format!("the mesh's longest side is {extent} mm"), help));
    }
    Ok(mesh)
}

/// Resolves a file name that another file mentions, relative to that file.
fn sibling_path(name: &str, uri: &str) -> String {
    match name.rsplit_once('/') {
        Some((folder, _)) => format!("{folder}/{uri}"),
        None => uri.to_string(),
    }
}

/// Reads all triangles of a glTF file's scene, in its own units; `fetch` returns the files that it names.
///
/// Reading stops soon after `triangles_max`: the mesh then has more triangles than that, but not all of the file's.
pub(super) fn triangles_of_gltf(
    bytes: &[u8],
    triangles_max: usize,
    fetch: impl Fn(&str) -> Result<Vec<u8>, Diagnostic>,
) -> Result<Mesh, String> {
    let Gltf { document, mut blob } = parse_gltf(bytes)?;
    let buffers = document.buffers().map(|buffer| match buffer.source() {
        Source::Bin => blob.take().ok_or_else(|| "a buffer of the glTF file has no data".to_string()),
        Source::Uri(uri) => match uri.strip_prefix("data:") {
            Some(inline) => {
                let (_, coded) = inline.split_once("base64,").ok_or("a buffer of the glTF file is not in base64")?;
                let decoded = base64::engine::general_purpose::STANDARD.decode(coded);
                decoded.map_err(|e| format!("a buffer of the glTF file is not in base64: {e}"))
            }
            None => fetch(uri).map_err(|e| format!("the glTF file's \"{uri}\": {}", e.message)),
        },
    });
    let buffers: Vec<Vec<u8>> = buffers.collect::<Result<_, _>>()?;
    let is_visited = vec![false; document.nodes().len()];
    let mut walk = Walk { buffers: &buffers, mesh: Mesh::default(), is_visited, triangles_max };
    match document.default_scene().or_else(|| document.scenes().next()) {
        Some(scene) => scene.nodes().try_for_each(|node| walk.visit(&node, Affine3A::IDENTITY, 0))?,
        None => document.meshes().try_for_each(|mesh| walk.add(&mesh, Affine3A::IDENTITY))?,
    }
    Ok(walk.mesh)
}

/// Parses and validates a glTF file, so that every reference in it leads to something.
fn parse_gltf(bytes: &[u8]) -> Result<Gltf, String> {
    if bytes.starts_with(b"glTF") {
        // The crate subtracts the length of the header from the length that the header declares.
        let word = |at: usize| Some(u32::from_le_bytes(bytes.get(at..at + 4)?.try_into().ok()?));
        match (word(4), word(8)) {
            (Some(2), Some(length)) if length >= 12 => {}
            (Some(2) | None, _) => return Err("the glTF file is cut off".into()),
            _ => return Err("the glTF file is not of version 2".into()),
        }
    }
    let file = Gltf::from_slice_without_validation(bytes).map_err(|error| match error {
        gltf::Error::Binary(error) => format!("the glTF file is cut off or damaged: {error}"),
        error => format!("this is not a glTF 2.0 file: {error}"),
    })?;
    let root = file.document.as_json();
    if let Some(unknown) = root.extensions_required.iter().find(|name| !is_ignorable(name)) {
        let shown: String = unknown.chars().filter(|c| !c.is_control()).take(60).collect();
        return Err(format!("the glTF file requires the extension \"{shown}\", which is not supported"));
    }
    // The crate's own validation follows the reference of positions before it checks it.
    let mut attributes = root.meshes.iter().flat_map(|mesh| &mesh.primitives).flat_map(|part| part.attributes.values());
    if attributes.any(|accessor| accessor.value() >= root.accessors.len()) {
        return Err("a mesh of the glTF file refers to missing data".into());
    }
    let mut first = None;
    root.validate(root, gltf::json::Path::new, &mut |path, error| {
        let place = path().to_string();
        // Bounds are never used, and some programs leave them out. Missing data are reported with their likely cause
        // when they are read. Ignorable extensions were judged above.
        let is_ignored = match error {
            gltf::json::validation::Error::Missing => {
                [".min", ".max", ".bufferView"].iter().any(|end| place.ends_with(end))
            }
            gltf::json::validation::Error::Unsupported => place.starts_with("extensionsRequired"),
            _ => false,
        };
        if !is_ignored {
            let place = place.chars().filter(|c| !c.is_control()).take(100).collect::<String>();
            first.get_or_insert_with(|| format!("this is not a valid glTF 2.0 file: {place}: {error}"));
        }
    });
    match first {
        Some(what) => Err(what),
        None => Ok(file),
    }
}

/// Returns true for a required extension that changes only materials, textures or lights, which are never read.
/// Without any other, such as one for compression, the shape would be missing or wrong.
fn is_ignorable(extension: &str) -> bool {
    ["KHR_materials_", "KHR_texture_", "EXT_texture_", "KHR_lights_"].iter().any(|kind| extension.starts_with(kind))
}

/// State of the traversal of a scene's nodes.
struct Walk<'a> {
    buffers: &'a [Vec<u8>],
    mesh: Mesh,
    /// For each node. glTF requires a strict tree; a node that is visited twice is a cycle, or work that doubles at
    /// every level.
    is_visited: Vec<bool>,
    /// Number of triangles beyond which no more meshes are added.
    triangles_max: usize,
}

impl Walk<'_> {
    fn visit(&mut self, node: &Node, parent: Affine3A, depth: usize) -> Result<(), String> {
        let number = node.index();
        if std::mem::replace(&mut self.is_visited[number], true) {
            return Err(format!("node {number} of the glTF file has two parents or is its own parent"));
        }
        if depth > DEPTH_MAX {
            return Err(format!("the glTF file's nodes are nested more than {DEPTH_MAX} deep"));
        }
        let here = parent * node_transform(node);
        if let Some(mesh) = node.mesh() {
            self.add(&mesh, here)?;
        }
        node.children().try_for_each(|child| self.visit(&child, here, depth + 1))
    }

    fn add(&mut self, added: &gltf::Mesh, here: Affine3A) -> Result<(), String> {
        for part in added.primitives().filter(|part| part.mode() == Mode::Triangles) {
            if self.mesh.triangles.len() > self.triangles_max {
                return Ok(());
            }
            let of = |wanted| part.get(&wanted);
            let positions = of(Semantic::Positions).ok_or("a part of the glTF file has no positions")?;
            let places = self.vectors(&positions)?;
            let corners: Vec<u32> = match part.indices() {
                Some(accessor) => self.corners(&accessor)?,
                None => (0..places.len() as u32).collect(),
            };
            let is_mirrored = here.matrix3.determinant() < 0.0;
            let turned = |[a, b, c]: [u32; 3]| if is_mirrored { [a, c, b] } else { [a, b, c] };
            let triangles: Vec<[u32; 3]> = corners.chunks_exact(3).map(|t| turned([t[0], t[1], t[2]])).collect();
            if triangles.iter().flatten().any(|&i| i as usize >= places.len()) {
                return Err("a triangle of the glTF file refers to a missing corner".into());
            }
            let places: Vec<Vec3> = places.into_iter().map(|p| here.transform_point3(p)).collect();
            let normals = match of(Semantic::Normals).map(|n| self.vectors(&n)).transpose()? {
                Some(normals) if normals.len() == places.len() => {
                    normals.into_iter().map(|n| transform_normal(&here, n)).collect()
                }
                _ => obj::normals_of(&places, &triangles),
            };
            let mesh = &mut self.mesh;
            let first = mesh.positions.len() as u32;
            mesh.triangles.extend(triangles.iter().map(|t| t.map(|i| first + i)));
            mesh.positions.extend(places);
            mesh.normals.extend(normals);
        }
        Ok(())
    }

    fn vectors(&self, accessor: &Accessor) -> Result<Vec<Vec3>, String> {
        if accessor.dimensions() != Dimensions::Vec3 || accessor.data_type() != DataType::F32 {
            return Err("positions and normals of the glTF file are not three floating-point numbers each".into());
        }
        Ok(self.items::<[f32; 3]>(accessor)?.map(Vec3::from).collect())
    }

    fn corners(&self, accessor: &Accessor) -> Result<Vec<u32>, String> {
        match (accessor.dimensions(), accessor.data_type()) {
            (Dimensions::Scalar, DataType::U8) => Ok(self.items::<u8>(accessor)?.map(u32::from).collect()),
            (Dimensions::Scalar, DataType::U16) => Ok(self.items::<u16>(accessor)?.map(u32::from).collect()),
            (Dimensions::Scalar, DataType::U32) => Ok(self.items::<u32>(accessor)?.collect()),
            _ => Err("the glTF file's corner indices are not whole numbers".into()),
        }
    }

    /// Returns the items of an accessor. The crate's reader trusts counts and strides, so they are checked here.
    fn items<T: Item + Copy>(&self, accessor: &Accessor) -> Result<impl Iterator<Item = T>, String> {
        if accessor.sparse().is_some() {
            return Err("the glTF file uses sparse accessors, which are not supported".into());
        }
        let view = accessor.view().ok_or("the glTF file stores its data in an unsupported way (compressed?)")?;
        let size = accessor.size();
        let stride = view.stride().unwrap_or(size);
        if stride < size {
            return Err(format!("items of {size} bytes overlap in the glTF file: their stride is {stride} bytes"));
        }
        let Some(last) = accessor.count().checked_sub(1) else { return Ok(None.into_iter().flatten()) };
        let end = last.checked_mul(stride).and_then(|l| l.checked_add(size)?.checked_add(accessor.offset()));
        let end_of_view = view.offset().checked_add(view.length());
        let available = self.buffers.get(view.buffer().index()).map_or(0, Vec::len);
        let is_inside = end.is_some_and(|end| end <= view.length()) && end_of_view.is_some_and(|end| end <= available);
        let items = match is_inside {
            true => Iter::new(accessor.clone(), |buffer| self.buffers.get(buffer.index()).map(Vec::as_slice)),
            false => None,
        };
        items.map(|items| Some(items).into_iter().flatten()).ok_or_else(|| "the glTF file is cut off".to_string())
    }
}

fn node_transform(node: &Node) -> Affine3A {
    match node.transform() {
        Transform::Matrix { matrix } => Affine3A::from_mat4(Mat4::from_cols_array_2d(&matrix)),
        Transform::Decomposed { translation, rotation, scale } => {
            let rotation = Quat::from_array(rotation).normalize();
            Affine3A::from_scale_rotation_translation(scale.into(), rotation, translation.into())
        }
    }
}

/// Transforms by the cofactors of the columns, so that a normal stays perpendicular under any scaling.
fn transform_normal(here: &Affine3A, normal: Vec3) -> Vec3 {
    let [x, y, z] = [here.matrix3.x_axis, here.matrix3.y_axis, here.matrix3.z_axis].map(Vec3::from);
    let turned = y.cross(z) * normal.x + z.cross(x) * normal.y + x.cross(y) * normal.z;
    (turned * here.matrix3.determinant().signum()).normalize_or(Vec3::Z)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A pyramid 40 mm high, its tip at the origin, as OBJ.
    const OBJ: &str = "v 0 0 0\nv 4 0 40\nv 0 4 40\nv -4 -4 40\nf 1 3 2\nf 1 4 3\nf 1 2 4\nf 2 3 4\n";

    /// The same pyramid as glTF with inline data, under a node that is rotated by 180° about x and moved back up.
    fn gltf() -> String {
        let places: [[f32; 3]; 4] = [[0.0, 0.0, 40.0], [4.0, 0.0, 0.0], [0.0, -4.0, 0.0], [-4.0, 4.0, 0.0]];
        let corners: [u16; 12] = [0, 2, 1, 0, 3, 2, 0, 1, 3, 1, 2, 3];
        let numbers = places.iter().flatten().flat_map(|v| v.to_le_bytes());
        let bytes: Vec<u8> = numbers.chain(corners.iter().flat_map(|v| v.to_le_bytes())).collect();
        let coded = base64::engine::general_purpose::STANDARD.encode(bytes);
        format!(
            r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],
            "nodes":[{{"children":[1],"translation":[0,0,40]}},{{"mesh":0,"rotation":[1,0,0,0]}}],
            "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1}}]}}],
            "accessors":[
                {{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","min":[-4,-4,0],"max":[4,4,40]}},
                {{"bufferView":1,"componentType":5123,"count":12,"type":"SCALAR"}}],
            "bufferViews":[{{"buffer":0,"byteLength":48}},{{"buffer":0,"byteOffset":48,"byteLength":24}}],
            "buffers":[{{"byteLength":72,"uri":"data:application/octet-stream;base64,{coded}"}}]}}"#
        )
    }

    fn check(name: &str, bytes: &[u8], expected: Result<f64, &str>) {
        let mut library = Library::empty();
        library.insert(name, bytes);
        match (read(&library, name), expected) {
            (Ok(mesh), Ok(volume)) => {
                assert!((mesh.volume_mm3() - volume).abs() < 1e-3, "{name}: {}", mesh.volume_mm3());
                assert_eq!(mesh.normals.len(), mesh.positions.len());
                assert!(mesh.positions.iter().any(|p| p.length() < 1e-4), "the tip is at the origin");
            }
            (Err(found), Err(said)) => {
                assert!(found.message.contains(said), "{name}: {}, not {said}", found.message);
                assert!(found.help.is_some() && found.headline().contains(name), "{}", found.headline());
            }
            (found, _) => panic!("{name}: {found:?}, not {expected:?}"),
        }
    }

    #[test]
    fn meshes_come_from_obj_and_from_gltf_alike() {
        check("a.obj", OBJ.as_bytes(), Ok(320.0));
        check("a.gltf", gltf().as_bytes(), Ok(320.0));
        check("A.GLB", gltf().as_bytes(), Ok(320.0));
        // An open surface can be displayed.
        check("a.obj", OBJ.replace("f 2 3 4\n", "").as_bytes(), Ok(0.0));
    }

    #[test]
    fn a_broken_mesh_is_one_clear_complaint() {
        // Aim: never a crash, always one message. Method: everything that commonly goes wrong with files.
        let broken = |from: &str, to: &str, said| {
            assert!(gltf().contains(from), "{from}");
            check("a.gltf", gltf().replace(from, to).as_bytes(), Err(said));
        };
        check("a.obj", b"v 1 2\nf 1 2 3\n", Err("not a Wavefront OBJ"));
        check("a.obj", b"f 1 2 3\n", Err("not a Wavefront OBJ"));
        check("a.obj", b"", Err("no triangles"));
        check("a.obj", b"v 0 0 0\nv 0.04 0 0.4\nv 0 0.04 0.4\nf 1 2 3\n", Err("longest side"));
        check("a.stl", OBJ.as_bytes(), Err("cannot be read from \".stl\""));
        check("a.gltf", b"{ \"asset\": ", Err("not a glTF 2.0 file"));
        check("a.glb", b"glTF\x02\0\0\0\xff\0\0\0\xff\xff\xff\xffJSON{", Err("cut off"));
        check("a.glb", b"glTF\x01\0\0\0", Err("version 2"));
        check("a.glb", b"glTF", Err("cut off"));
        broken("\"POSITION\":0", "\"POSITION\":2", "refers to missing data");
        check("a.glb", b"glTF\x02\0\0\0\x01\0\0\0", Err("cut off"));
        broken("\"byteLength\":24", "\"byteLength\":24,\"byteOffset\":4000", "not a glTF 2.0 file");
        broken("\"count\":12", "\"count\":1200", "cut off");
        broken("\"count\":12", "\"count\":0", "no triangles");
        broken("\"count\":4,", "\"count\":2,", "missing corner");
        broken("\"mesh\":0", "\"mesh\":7", "nodes[1].mesh: Index out of bounds");
        broken("\"byteLength\":24", "\"byteLength\":24,\"byteStride\":1", "not a valid glTF 2.0 file");
        broken("\"buffer\":0,\"byteLength\":48", "\"buffer\":3,\"byteLength\":48", "buffer: Index out of bounds");
        broken("\"byteLength\":48", "\"byteLength\":18446744073709551615", "cut off");
        broken("\"count\":4,", "\"count\":18446744073709551615,", "cut off");
        broken("\"children\":[1]", "\"children\":[0]", "two parents");
        broken("\"POSITION\":0", "\"POSITION\":1", "three floating-point numbers");
        broken("\"POSITION\":0", "\"NORMAL\":0", "[\"POSITION\"]: Missing data");
        broken(";base64,", ";base64,%", "not in base64");
        broken("data:application/octet-stream;base64,", "away.bin?", "away.bin");
        broken("\"bufferView\":1,", "", "compressed");
        broken("5123", "5126", "not whole numbers");
        let requires =
            |name: &str| gltf().replace("\"scene\":0", &format!("\"extensionsRequired\":[\"{name}\"],\"scene\":0"));
        for name in ["KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_mesh_quantization", "ACME_odd"] {
            check("a.gltf", requires(name).as_bytes(), Err(&format!("requires the extension \"{name}\"")));
        }
        check("a.gltf", requires("KHR_materials_unlit").as_bytes(), Ok(320.0));
    }

    #[test]
    fn a_small_file_cannot_ask_for_endless_work() {
        // Aim: the work is bounded by the size of the file. Method: 32 levels of nodes that name their child twice,
        // which would be 2³² visits; a chain of 40; and one mesh of a few triangles that 100 000 nodes show.
        // Regression: the first file once caused a hang.
        let nodes = |children: &dyn Fn(usize) -> String, count: usize| {
            let list = (0..count).map(|n| format!(r#"{{"mesh":0{}}}"#, children(n))).collect::<Vec<_>>().join(",");
            let text = gltf();
            let (head, rest) = text.split_once("\"nodes\":[{\"children\"").expect("the fixture has nodes");
            let (_, tail) = rest.split_once("\"meshes\":").expect("the fixture has meshes");
            format!("{head}\"nodes\":[{list}],\"meshes\":{tail}")
        };
        let twice = |n: usize| if n < 32 { format!(r#","children":[{0},{0}]"#, n + 1) } else { String::new() };
        check("a.gltf", nodes(&twice, 33).as_bytes(), Err("two parents"));
        let chain = |n: usize| if n < 39 { format!(r#","children":[{}]"#, n + 1) } else { String::new() };
        check("a.gltf", nodes(&chain, 40).as_bytes(), Err("nested more than 32 deep"));
        let all = |n: usize| match n {
            0 => format!(r#","children":[{}]"#, (1..100_000).map(|n| n.to_string()).collect::<Vec<_>>().join(",")),
            _ => String::new(),
        };
        let wide = nodes(&all, 100_000);
        check("a.gltf", wide.as_bytes(), Err("300004 triangles or more"));
    }

    #[test]
    fn a_mesh_truncated_at_any_byte_is_refused() {
        let text = gltf();
        let mut library = Library::empty();
        for end in (0..text.len()).step_by(7) {
            library.insert("a.gltf", &text.as_bytes()[..end]);
            assert!(read(&library, "a.gltf").is_err());
        }
    }
}
