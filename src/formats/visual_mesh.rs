//! Meshes for display: an instrument from a Wavefront OBJ or a glTF 2.0 file.
//!
//! Takes the bytes of a file, in millimetres. Gives one mesh with normals, or the first error. Never reads materials,
//! textures and animations; never requires a closed surface.

use crate::Library;
use crate::diagnostic::Diagnostic;
use crate::limits::DISPLAY_TRIANGLES_MAX;
use crate::obj;
use base64::Engine;
use gltf_json as json;
use json::accessor::{ComponentType, Type};
use json::mesh::{Mode, Semantic};
use json::validation::Checked;
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
    let [low, high] =
        mesh.positions.iter().fold([Vec3::INFINITY, Vec3::NEG_INFINITY], |[l, h], p| [l.min(*p), h.max(*p)]);
    let extent = (high - low).max_element();
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
    let (text, blob) = if bytes.starts_with(b"glTF") { chunks(bytes)? } else { (bytes, None) };
    let root = json::Root::from_slice(text).map_err(|e| format!("this is not a glTF 2.0 file: {e}"))?;
    if let Some(unknown) = root.extensions_required.iter().find(|name| !is_ignorable(name)) {
        let shown: String = unknown.chars().filter(|c| !c.is_control()).take(60).collect();
        return Err(format!("the glTF file requires the extension \"{shown}\", which is not supported"));
    }
    let buffers = root.buffers.iter().map(|buffer| match (&buffer.uri, blob) {
        (None, Some(blob)) => Ok(blob.to_vec()),
        (None, None) => Err("a buffer of the glTF file has no data".to_string()),
        (Some(uri), _) => match uri.strip_prefix("data:") {
            Some(inline) => {
                let (_, coded) = inline.split_once("base64,").ok_or("a buffer of the glTF file is not in base64")?;
                let decoded = base64::engine::general_purpose::STANDARD.decode(coded);
                decoded.map_err(|e| format!("a buffer of the glTF file is not in base64: {e}"))
            }
            None => fetch(uri).map_err(|e| format!("the glTF file's \"{uri}\": {}", e.message)),
        },
    });
    let file = GltfFile { buffers: buffers.collect::<Result<_, _>>()?, root: &root };
    let mut walk = Walk { mesh: Mesh::default(), is_visited: vec![false; root.nodes.len()], triangles_max };
    let scene = root.scene.map_or(0, |scene| scene.value());
    match root.scenes.get(scene) {
        Some(scene) => {
            scene.nodes.iter().try_for_each(|node| file.node(node.value(), NodeTransform::IDENTITY, 0, &mut walk))?
        }
        None => (0..root.meshes.len()).try_for_each(|number| file.add(number, &NodeTransform::IDENTITY, &mut walk))?,
    }
    Ok(walk.mesh)
}

/// Returns true for a required extension that changes only materials, textures or lights, which are never read.
/// Without any other, such as one for compression, the shape would be missing or wrong.
fn is_ignorable(extension: &str) -> bool {
    ["KHR_materials_", "KHR_texture_", "EXT_texture_", "KHR_lights_"].iter().any(|kind| extension.starts_with(kind))
}

/// Returns the two parts of a binary glTF file: its JSON text, and its binary data if there are any.
fn chunks(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), String> {
    let cut_off = || "the glTF file is cut off".to_string();
    let word = |at: usize| Some(u32::from_le_bytes(bytes.get(at..at + 4)?.try_into().ok()?));
    if word(4).ok_or_else(cut_off)? != 2 {
        return Err("the glTF file is not of version 2".into());
    }
    let chunk = |at: usize| {
        let length = word(at)? as usize;
        Some((bytes.get(at + 4..at + 8)?, bytes.get(at + 8..(at + 8).checked_add(length)?)?))
    };
    let (kind, text) = chunk(12).ok_or_else(cut_off)?;
    if kind != b"JSON" {
        return Err("the glTF file does not begin with its JSON text".into());
    }
    let next = 20 + text.len();
    if next >= bytes.len() {
        return Ok((text, None));
    }
    let (kind, blob) = chunk(next).ok_or_else(cut_off)?;
    Ok((text, (kind == b"BIN\0").then_some(blob)))
}

struct GltfFile<'a> {
    root: &'a json::Root,
    buffers: Vec<Vec<u8>>,
}

/// State of the traversal of a scene's nodes.
struct Walk {
    mesh: Mesh,
    /// For each node. glTF requires a strict tree; a node that is visited twice is a cycle, or work that doubles at
    /// every level.
    is_visited: Vec<bool>,
    /// Number of triangles beyond which no more meshes are added.
    triangles_max: usize,
}

impl GltfFile<'_> {
    fn node(&self, number: usize, parent: NodeTransform, depth: usize, walk: &mut Walk) -> Result<(), String> {
        let node = self.root.nodes.get(number).ok_or("the glTF file refers to a missing node")?;
        if std::mem::replace(&mut walk.is_visited[number], true) {
            return Err(format!("node {number} of the glTF file has two parents or is its own parent"));
        }
        if depth > DEPTH_MAX {
            return Err(format!("the glTF file's nodes are nested more than {DEPTH_MAX} deep"));
        }
        let here = parent.then(&NodeTransform::of(node));
        if let Some(number) = node.mesh {
            self.add(number.value(), &here, walk)?;
        }
        let children = node.children.iter().flatten();
        children.into_iter().try_for_each(|child| self.node(child.value(), here, depth + 1, walk))
    }

    fn add(&self, number: usize, here: &NodeTransform, walk: &mut Walk) -> Result<(), String> {
        let found = self.root.meshes.get(number).ok_or("the glTF file refers to a missing mesh")?;
        let mesh = &mut walk.mesh;
        for part in found.primitives.iter().filter(|p| p.mode == Checked::Valid(Mode::Triangles)) {
            if mesh.triangles.len() > walk.triangles_max {
                return Ok(());
            }
            let of = |wanted| part.attributes.get(&Checked::Valid(wanted)).map(|accessor| accessor.value());
            let places = self.vectors(of(Semantic::Positions).ok_or("a part of the glTF file has no positions")?)?;
            let corners: Vec<u32> = match part.indices {
                Some(accessor) => self.indices(accessor.value())?,
                None => (0..places.len() as u32).collect(),
            };
            let is_mirrored = here.determinant() < 0.0;
            let turned = |[a, b, c]: [u32; 3]| if is_mirrored { [a, c, b] } else { [a, b, c] };
            let triangles: Vec<[u32; 3]> = corners.chunks_exact(3).map(|t| turned([t[0], t[1], t[2]])).collect();
            if triangles.iter().flatten().any(|&i| i as usize >= places.len()) {
                return Err("a triangle of the glTF file refers to a missing corner".into());
            }
            let places: Vec<Vec3> = places.into_iter().map(|p| here.transform_point(p)).collect();
            let normals = match of(Semantic::Normals).map(|n| self.vectors(n)).transpose()? {
                Some(normals) if normals.len() == places.len() => {
                    normals.into_iter().map(|n| here.transform_normal(n)).collect()
                }
                _ => obj::normals_of(&places, &triangles),
            };
            let first = mesh.positions.len() as u32;
            mesh.triangles.extend(triangles.iter().map(|t| t.map(|i| first + i)));
            mesh.positions.extend(places);
            mesh.normals.extend(normals);
        }
        Ok(())
    }

    fn vectors(&self, accessor: usize) -> Result<Vec<Vec3>, String> {
        let (kind, items) = self.items(accessor, Type::Vec3)?;
        if kind != ComponentType::F32 {
            return Err("positions and normals of the glTF file are not floating-point numbers".into());
        }
        let number = |b: &[u8]| f32::from_le_bytes([b[0], b[1], b[2], b[3]]);
        Ok(items.map(|b| Vec3::new(number(b), number(&b[4..]), number(&b[8..]))).collect())
    }

    fn indices(&self, accessor: usize) -> Result<Vec<u32>, String> {
        let (kind, items) = self.items(accessor, Type::Scalar)?;
        match kind {
            ComponentType::U8 => Ok(items.map(|b| u32::from(b[0])).collect()),
            ComponentType::U16 => Ok(items.map(|b| u32::from(u16::from_le_bytes([b[0], b[1]]))).collect()),
            ComponentType::U32 => Ok(items.map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect()),
            _ => Err("the glTF file's corner indices are not whole numbers".into()),
        }
    }

    /// Returns the bytes of each item of an accessor, without the padding between items.
    fn items(&self, accessor: usize, wanted: Type) -> Result<(ComponentType, impl Iterator<Item = &[u8]>), String> {
        let missing = || "the glTF file refers to missing data".to_string();
        let found = self.root.accessors.get(accessor).ok_or_else(missing)?;
        if found.sparse.is_some() {
            return Err("the glTF file uses sparse accessors, which are not supported".into());
        }
        let (Checked::Valid(kind), Checked::Valid(shape)) = (found.component_type, found.type_) else {
            return Err(missing());
        };
        if shape != wanted {
            return Err("an accessor of the glTF file does not have the shape of positions or corner indices".into());
        }
        let view = found.buffer_view.and_then(|view| self.root.buffer_views.get(view.value()));
        let view = view.ok_or("the glTF file stores its data in an unsupported way (compressed?)")?;
        let buffer = self.buffers.get(view.buffer.value()).ok_or_else(missing)?;
        let size = kind.0.size() * shape.multiplicity();
        let stride = view.byte_stride.map_or(size, |s| s.0.max(size));
        let offset = |offset: &Option<json::validation::USize64>| offset.map_or(0, |o| o.0);
        let start = offset(&view.byte_offset).checked_add(offset(&found.byte_offset));
        let start = start.and_then(|start| usize::try_from(start).ok()).ok_or_else(missing)?;
        let count = usize::try_from(found.count.0).map_err(|_| missing())?;
        let length =
            count.saturating_sub(1).checked_mul(stride).and_then(|l| l.checked_add(size)).ok_or_else(missing)?;
        let length = if count == 0 { 0 } else { length };
        let bytes =
            start.checked_add(length).and_then(|end| buffer.get(start..end)).ok_or("the glTF file is cut off")?;
        Ok((kind.0, bytes.chunks(stride).map(move |item| &item[..size])))
    }
}

/// A transform as in glTF: the columns of a matrix and an offset.
#[derive(Clone, Copy)]
struct NodeTransform {
    columns: [Vec3; 3],
    offset: Vec3,
}

impl NodeTransform {
    const IDENTITY: NodeTransform = NodeTransform { columns: Vec3::AXES, offset: Vec3::ZERO };

    fn of(node: &json::Node) -> NodeTransform {
        if let Some(m) = node.matrix {
            let column = |c: usize| Vec3::new(m[4 * c], m[4 * c + 1], m[4 * c + 2]);
            return NodeTransform { columns: [column(0), column(1), column(2)], offset: column(3) };
        }
        let rotation = node.rotation.map_or(Quat::IDENTITY, |q| Quat::from_array(q.0).normalize());
        let scale = Vec3::from(node.scale.unwrap_or([1.0; 3]));
        let columns = [0, 1, 2].map(|a| rotation * (Vec3::AXES[a] * scale[a]));
        NodeTransform { columns, offset: Vec3::from(node.translation.unwrap_or_default()) }
    }

    fn transform_vector(&self, v: Vec3) -> Vec3 {
        self.columns[0] * v.x + self.columns[1] * v.y + self.columns[2] * v.z
    }

    fn transform_point(&self, p: Vec3) -> Vec3 {
        self.transform_vector(p) + self.offset
    }

    fn then(&self, inner: &NodeTransform) -> NodeTransform {
        NodeTransform {
            columns: inner.columns.map(|c| self.transform_vector(c)),
            offset: self.transform_point(inner.offset),
        }
    }

    fn determinant(&self) -> f32 {
        let [x, y, z] = self.columns;
        x.cross(y).dot(z)
    }

    /// Transforms by the cofactors of the columns, so that a normal stays perpendicular under any scaling.
    fn transform_normal(&self, n: Vec3) -> Vec3 {
        let [x, y, z] = self.columns;
        let turned = y.cross(z) * n.x + z.cross(x) * n.y + x.cross(y) * n.z;
        (turned * self.determinant().signum()).normalize_or(Vec3::Z)
    }
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
        broken("\"byteLength\":24", "\"byteLength\":24,\"byteOffset\":4000", "not a glTF 2.0 file");
        broken("\"count\":12", "\"count\":1200", "cut off");
        broken("\"count\":12", "\"count\":0", "no triangles");
        broken("\"count\":4,", "\"count\":2,", "missing corner");
        broken("\"mesh\":0", "\"mesh\":7", "missing mesh");
        broken("\"children\":[1]", "\"children\":[0]", "two parents");
        broken("\"POSITION\":0", "\"POSITION\":1", "does not have the shape");
        broken("\"POSITION\":0", "\"NORMAL\":0", "no positions");
        broken(";base64,", ";base64,%", "not in base64");
        broken("data:application/octet-stream;base64,", "away.bin?", "away.bin");
        broken("\"bufferView\":1,", "", "compressed");
        broken("5123", "5126", "cut off");
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
