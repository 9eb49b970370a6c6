//! Meshes that are only looked at: an instrument from a Wavefront OBJ or a glTF 2.0 file.
//!
//! Takes a file's bytes, in millimetres. Gives one mesh with normals, or the first thing that is wrong with it. It need not
//! be closed. Materials, textures and animations are not read.

use super::Library;
use super::obj;
use crate::diagnostic::Diagnostic;
use crate::frame::{Quat, Vec3};
use crate::mesh::Mesh;
use base64::Engine;
use gltf_json as json;
use json::accessor::{ComponentType, Type};
use json::mesh::{Mode, Semantic};
use json::validation::Checked;

/// Shortest and longest side of the box around what can be held in a hand, mm.
const EXTENT: std::ops::RangeInclusive<f32> = 2.0..=400.0;

/// How deep nodes may stand in nodes: deeper ones go in circles.
const DEPTH_MAX: usize = 32;

/// A mesh by its name in a library: `.obj`, `.glb` or `.gltf`.
pub fn read(library: &Library, name: &str) -> Result<Mesh, Diagnostic> {
    let wrong = |message: String, help: &str| Diagnostic::about_file(name, "wrong-mesh", message, Some(help.into()));
    let bytes = library.bytes(name)?;
    let extension = name.rsplit('.').next().unwrap_or_default().to_ascii_lowercase();
    let read = match extension.as_str() {
        "obj" => obj::triangles(&bytes).map_err(|e| e.to_string()),
        "glb" | "gltf" => triangles_of_gltf(&bytes, |uri| library.bytes(&beside(name, uri)).map(|b| b.to_vec())),
        _ => {
            return Err(wrong(
                format!("a mesh cannot be read from \".{extension}\""),
                "give an .obj, .glb or .gltf file",
            ));
        }
    };
    let export = "export it anew as Wavefront OBJ or glTF 2.0, in millimetres, without compression";
    let mesh = read.map_err(|what| wrong(what, export))?;
    if mesh.triangles.is_empty() {
        return Err(wrong("the mesh has no triangles".into(), export));
    }
    if mesh.triangles.len() > obj::TRIANGLES_MAX {
        let message = format!("the mesh has {} triangles", mesh.triangles.len());
        return Err(wrong(message, "thin it out in a mesh program to at most 300 000 triangles"));
    }
    if mesh.positions.iter().any(|p| !p.is_finite()) {
        return Err(wrong("a coordinate is not a finite number".into(), export));
    }
    let [low, high] =
        mesh.positions.iter().fold([Vec3::INFINITY, Vec3::NEG_INFINITY], |[l, h], p| [l.min(*p), h.max(*p)]);
    let extent = (high - low).max_element();
    if !EXTENT.contains(&extent) {
        let help =
            "one unit of the file is a millimetre, the working end's tip is at the origin, the shaft points to +z";
        return Err(wrong(format!("the mesh's longest side is {extent} mm"), help));
    }
    Ok(mesh)
}

/// A file named in another, by where that one lies.
fn beside(name: &str, uri: &str) -> String {
    match name.rsplit_once('/') {
        Some((folder, _)) => format!("{folder}/{uri}"),
        None => uri.to_string(),
    }
}

/// All triangles of a glTF file's scene, in its own units; `fetch` brings files that it names.
pub(super) fn triangles_of_gltf(
    bytes: &[u8],
    fetch: impl Fn(&str) -> Result<Vec<u8>, Diagnostic>,
) -> Result<Mesh, String> {
    let (text, blob) = if bytes.starts_with(b"glTF") { chunks(bytes)? } else { (bytes, None) };
    let root = json::Root::from_slice(text).map_err(|e| format!("this is not a glTF 2.0 file: {e}"))?;
    let buffers = root.buffers.iter().map(|buffer| match (&buffer.uri, blob) {
        (None, Some(blob)) => Ok(blob.to_vec()),
        (None, None) => Err("a buffer of the glTF file is nowhere".to_string()),
        (Some(uri), _) => match uri.strip_prefix("data:") {
            Some(inline) => {
                let (_, coded) = inline.split_once("base64,").ok_or("a buffer of the glTF file is not in base64")?;
                let decoded = base64::engine::general_purpose::STANDARD.decode(coded);
                decoded.map_err(|e| format!("a buffer of the glTF file is not in base64: {e}"))
            }
            None => fetch(uri).map_err(|e| format!("the glTF file's \"{uri}\": {}", e.message)),
        },
    });
    let file = File { buffers: buffers.collect::<Result<_, _>>()?, root: &root };
    let mut mesh = Mesh::default();
    let scene = root.scene.map_or(0, |scene| scene.value());
    match root.scenes.get(scene) {
        Some(scene) => scene.nodes.iter().try_for_each(|node| file.node(node.value(), Affine::SAME, 0, &mut mesh))?,
        None => (0..root.meshes.len()).try_for_each(|number| file.add(number, &Affine::SAME, &mut mesh))?,
    }
    Ok(mesh)
}

/// The two parts of a binary glTF file: its text, and its numbers if there are any.
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
        return Err("the glTF file does not begin with its text".into());
    }
    let next = 20 + text.len();
    if next >= bytes.len() {
        return Ok((text, None));
    }
    let (kind, blob) = chunk(next).ok_or_else(cut_off)?;
    Ok((text, (kind == b"BIN\0").then_some(blob)))
}

struct File<'a> {
    root: &'a json::Root,
    buffers: Vec<Vec<u8>>,
}

impl File<'_> {
    fn node(&self, number: usize, parent: Affine, depth: usize, mesh: &mut Mesh) -> Result<(), String> {
        let node = self.root.nodes.get(number).ok_or("the glTF file names a node that is not there")?;
        if depth > DEPTH_MAX {
            return Err("the glTF file's nodes stand in one another without end".into());
        }
        let here = parent.then(&Affine::of(node));
        if let Some(number) = node.mesh {
            self.add(number.value(), &here, mesh)?;
        }
        let children = node.children.iter().flatten();
        children.into_iter().try_for_each(|child| self.node(child.value(), here, depth + 1, mesh))
    }

    fn add(&self, number: usize, here: &Affine, mesh: &mut Mesh) -> Result<(), String> {
        let found = self.root.meshes.get(number).ok_or("the glTF file names a mesh that is not there")?;
        for part in found.primitives.iter().filter(|p| p.mode == Checked::Valid(Mode::Triangles)) {
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
                return Err("a triangle of the glTF file has a corner that is not there".into());
            }
            let places: Vec<Vec3> = places.into_iter().map(|p| here.point(p)).collect();
            let normals = match of(Semantic::Normals).map(|n| self.vectors(n)).transpose()? {
                Some(normals) if normals.len() == places.len() => normals.into_iter().map(|n| here.normal(n)).collect(),
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
            _ => Err("the glTF file's corners are not whole numbers".into()),
        }
    }

    /// The bytes of each item of an accessor, as many as the item has.
    fn items(&self, accessor: usize, wanted: Type) -> Result<(ComponentType, impl Iterator<Item = &[u8]>), String> {
        let missing = || "the glTF file names numbers that are not there".to_string();
        let found = self.root.accessors.get(accessor).ok_or_else(missing)?;
        if found.sparse.is_some() {
            return Err("the glTF file keeps its numbers sparse".into());
        }
        let (Checked::Valid(kind), Checked::Valid(shape)) = (found.component_type, found.type_) else {
            return Err(missing());
        };
        if shape != wanted {
            return Err("the glTF file's numbers are not of the shape that positions and corners have".into());
        }
        let view = found.buffer_view.and_then(|view| self.root.buffer_views.get(view.value()));
        let view = view.ok_or("the glTF file keeps its numbers in a way that is not read (compressed?)")?;
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

/// A transform as glTF has them: columns and an offset.
#[derive(Clone, Copy)]
struct Affine {
    columns: [Vec3; 3],
    offset: Vec3,
}

impl Affine {
    const SAME: Affine = Affine { columns: Vec3::AXES, offset: Vec3::ZERO };

    fn of(node: &json::Node) -> Affine {
        if let Some(m) = node.matrix {
            let column = |c: usize| Vec3::new(m[4 * c], m[4 * c + 1], m[4 * c + 2]);
            return Affine { columns: [column(0), column(1), column(2)], offset: column(3) };
        }
        let turn = node.rotation.map_or(Quat::IDENTITY, |q| Quat::from_array(q.0).normalize());
        let scale = Vec3::from(node.scale.unwrap_or([1.0; 3]));
        let columns = [0, 1, 2].map(|a| turn * (Vec3::AXES[a] * scale[a]));
        Affine { columns, offset: Vec3::from(node.translation.unwrap_or_default()) }
    }

    fn way(&self, v: Vec3) -> Vec3 {
        self.columns[0] * v.x + self.columns[1] * v.y + self.columns[2] * v.z
    }

    fn point(&self, p: Vec3) -> Vec3 {
        self.way(p) + self.offset
    }

    fn then(&self, inner: &Affine) -> Affine {
        Affine { columns: inner.columns.map(|c| self.way(c)), offset: self.point(inner.offset) }
    }

    fn determinant(&self) -> f32 {
        let [x, y, z] = self.columns;
        x.cross(y).dot(z)
    }

    /// Stays square to its surface however that is stretched: cofactors of the columns.
    fn normal(&self, n: Vec3) -> Vec3 {
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

    /// The same as glTF, under a node that is turned about x by half a turn and moved back up; with the numbers inline.
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
        library.hold(name, bytes);
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
        // An open surface can be looked at.
        check("a.obj", OBJ.replace("f 2 3 4\n", "").as_bytes(), Ok(0.0));
    }

    #[test]
    fn a_broken_mesh_is_one_clear_complaint() {
        // Aim: never a crash, always a word. Method: everything that goes wrong with files on the way.
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
        broken("\"count\":4,", "\"count\":2,", "corner that is not there");
        broken("\"mesh\":0", "\"mesh\":7", "mesh that is not there");
        broken("\"children\":[1]", "\"children\":[0]", "without end");
        broken("\"POSITION\":0", "\"POSITION\":1", "not of the shape");
        broken("\"POSITION\":0", "\"NORMAL\":0", "no positions");
        broken(";base64,", ";base64,%", "not in base64");
        broken("data:application/octet-stream;base64,", "away.bin?", "away.bin");
        broken("\"bufferView\":1,", "", "compressed");
        broken("5123", "5126", "cut off");
    }

    #[test]
    fn every_byte_cut_from_a_mesh_is_survived() {
        let text = gltf();
        let mut library = Library::empty();
        for end in (0..text.len()).step_by(7) {
            library.hold("a.gltf", &text.as_bytes()[..end]);
            assert!(read(&library, "a.gltf").is_err());
        }
    }
}
