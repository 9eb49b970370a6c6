//! Surfaces as one glTF 2.0 binary file, coloured per vertex.

use super::pictures::srgb_to_linear;
use gltf_json as json;
use json::validation::{Checked, USize64, Validate};
use std::borrow::Cow;
use std::collections::BTreeMap;
use typodont_core::mesh::Mesh;

/// A surface with a name and a colour per vertex.
pub struct SurfacePart {
    pub name: String,
    pub mesh: Mesh,
    /// Linear red, green, blue in 0–1, one per position.
    pub colors: Vec<[f32; 3]>,
}

impl SurfacePart {
    /// A surface with an sRGB colour (0 to 1) per position.
    pub fn coloured(name: &str, mesh: Mesh, rgb: &[[f32; 3]]) -> SurfacePart {
        let colors = rgb.iter().map(|c| srgb_to_linear(*c)).collect();
        SurfacePart { name: name.into(), mesh, colors }
    }

    /// A surface of one sRGB colour (0 to 1).
    pub fn plain(name: &str, mesh: Mesh, rgb: [f32; 3]) -> SurfacePart {
        let colors = vec![srgb_to_linear(rgb); mesh.positions.len()];
        SurfacePart { name: name.into(), mesh, colors }
    }
}

/// Converts millimetres to the metres of glTF, and z up to y up.
const NODE_FROM_TOOTH: [f32; 16] =
    [0.0, 0.0, 0.001, 0.0, 0.001, 0.0, 0.0, 0.0, 0.0, 0.001, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0];

/// Encodes the parts as one glTF 2.0 binary file; empty parts are left out.
///
/// # Errors
///
/// When the glTF document is not valid or cannot be written.
pub fn encode(parts: &[SurfacePart]) -> Result<Vec<u8>, String> {
    let mut file = GlbBuilder::default();
    for part in parts.iter().filter(|p| !p.mesh.is_empty()) {
        file.add(part);
    }
    file.finish()
}

#[derive(Default)]
struct GlbBuilder {
    data: Vec<u8>,
    views: Vec<json::buffer::View>,
    accessors: Vec<json::Accessor>,
    meshes: Vec<json::Mesh>,
    nodes: Vec<json::Node>,
}

impl GlbBuilder {
    fn add(&mut self, part: &SurfacePart) {
        let mesh = &part.mesh;
        let low = mesh.positions.iter().copied().reduce(|a, b| a.min(b)).unwrap_or_default();
        let high = mesh.positions.iter().copied().reduce(|a, b| a.max(b)).unwrap_or_default();
        let positions = mesh.positions.iter().flat_map(|p| p.to_array()).flat_map(f32::to_le_bytes);
        let positions =
            self.vertices(positions.collect(), mesh.positions.len(), Some((low.to_array(), high.to_array())));
        let unit = |n: &typodont_core::frame::Vec3| n.try_normalize().unwrap_or(typodont_core::frame::Vec3::Z);
        let normals = mesh.normals.iter().flat_map(|n| unit(n).to_array()).flat_map(f32::to_le_bytes);
        let normals = self.vertices(normals.collect(), mesh.normals.len(), None);
        let colors = part.colors.iter().flatten().flat_map(|c| c.to_le_bytes());
        let colors = self.vertices(colors.collect(), part.colors.len(), None);
        let indices = mesh.triangles.iter().flatten().flat_map(|i| i.to_le_bytes());
        let indices = self.indices(indices.collect(), 3 * mesh.triangles.len());
        let attributes = [
            (json::mesh::Semantic::Positions, positions),
            (json::mesh::Semantic::Normals, normals),
            (json::mesh::Semantic::Colors(0), colors),
        ];
        self.meshes.push(json::Mesh {
            extensions: Default::default(),
            extras: Default::default(),
            name: Some(part.name.clone()),
            primitives: vec![json::mesh::Primitive {
                attributes: attributes.into_iter().map(|(s, i)| (Checked::Valid(s), i)).collect::<BTreeMap<_, _>>(),
                extensions: Default::default(),
                extras: Default::default(),
                indices: Some(indices),
                material: Some(json::Index::new(0)),
                mode: Checked::Valid(json::mesh::Mode::Triangles),
                targets: None,
            }],
            weights: None,
        });
        self.nodes.push(json::Node {
            mesh: Some(json::Index::new(self.meshes.len() as u32 - 1)),
            name: Some(part.name.clone()),
            matrix: Some(NODE_FROM_TOOTH),
            ..Default::default()
        });
    }

    fn view(
        &mut self,
        bytes: Vec<u8>,
        target: json::buffer::Target,
        stride: Option<usize>,
    ) -> json::Index<json::buffer::View> {
        let offset = self.data.len();
        self.views.push(json::buffer::View {
            buffer: json::Index::new(0),
            byte_length: USize64::from(bytes.len()),
            byte_offset: Some(USize64::from(offset)),
            byte_stride: stride.map(json::buffer::Stride),
            extensions: Default::default(),
            extras: Default::default(),
            name: None,
            target: Some(Checked::Valid(target)),
        });
        self.data.extend(bytes);
        json::Index::new(self.views.len() as u32 - 1)
    }

    fn vertices(
        &mut self,
        bytes: Vec<u8>,
        count: usize,
        range: Option<([f32; 3], [f32; 3])>,
    ) -> json::Index<json::Accessor> {
        let view = self.view(bytes, json::buffer::Target::ArrayBuffer, Some(12));
        let (low, high) = range.unzip();
        self.accessor(view, count, json::accessor::ComponentType::F32, json::accessor::Type::Vec3, low, high)
    }

    fn indices(&mut self, bytes: Vec<u8>, count: usize) -> json::Index<json::Accessor> {
        let view = self.view(bytes, json::buffer::Target::ElementArrayBuffer, None);
        self.accessor(view, count, json::accessor::ComponentType::U32, json::accessor::Type::Scalar, None, None)
    }

    fn accessor(
        &mut self,
        view: json::Index<json::buffer::View>,
        count: usize,
        component: json::accessor::ComponentType,
        kind: json::accessor::Type,
        low: Option<[f32; 3]>,
        high: Option<[f32; 3]>,
    ) -> json::Index<json::Accessor> {
        let bound = |b: Option<[f32; 3]>| b.map(|b| json::Value::from(b.to_vec()));
        self.accessors.push(json::Accessor {
            buffer_view: Some(view),
            byte_offset: Some(USize64(0)),
            count: USize64::from(count),
            component_type: Checked::Valid(json::accessor::GenericComponentType(component)),
            extensions: Default::default(),
            extras: Default::default(),
            type_: Checked::Valid(kind),
            min: bound(low),
            max: bound(high),
            name: None,
            normalized: false,
            sparse: None,
        });
        json::Index::new(self.accessors.len() as u32 - 1)
    }

    fn finish(self) -> Result<Vec<u8>, String> {
        let GlbBuilder { data, views, accessors, meshes, nodes } = self;
        let material = json::Material {
            double_sided: true,
            pbr_metallic_roughness: json::material::PbrMetallicRoughness {
                metallic_factor: json::material::StrengthFactor(0.0),
                roughness_factor: json::material::StrengthFactor(0.6),
                ..Default::default()
            },
            ..Default::default()
        };
        let root = json::Root {
            asset: json::Asset {
                generator: Some(concat!("typodont ", env!("CARGO_PKG_VERSION")).into()),
                ..Default::default()
            },
            scenes: vec![json::Scene {
                extensions: Default::default(),
                extras: Default::default(),
                name: None,
                nodes: (0..nodes.len() as u32).map(json::Index::new).collect(),
            }],
            scene: Some(json::Index::new(0)),
            materials: if meshes.is_empty() { Vec::new() } else { vec![material] },
            buffers: if data.is_empty() {
                Vec::new()
            } else {
                vec![json::Buffer {
                    byte_length: USize64::from(data.len()),
                    extensions: Default::default(),
                    extras: Default::default(),
                    name: None,
                    uri: None,
                }]
            },
            buffer_views: views,
            accessors,
            meshes,
            nodes,
            ..Default::default()
        };
        let mut validation_errors = Vec::new();
        root.validate(&root, json::Path::new, &mut |path, error| {
            validation_errors.push(format!("{}: {error}", path()))
        });
        if !validation_errors.is_empty() {
            return Err(format!("writing glTF — {}", validation_errors.join("; ")));
        }
        let text = json::serialize::to_string(&root).map_err(|e| format!("writing glTF — {e}"))?;
        Ok(glb_container(text.as_bytes(), &data))
    }
}

/// The binary container: a header, a chunk of JSON padded with spaces, a chunk of data padded with zeros.
fn glb_container(text: &[u8], data: &[u8]) -> Vec<u8> {
    let pad = |bytes: &[u8], with: u8| {
        let mut padded = Cow::Borrowed(bytes).into_owned();
        padded.resize(bytes.len().next_multiple_of(4), with);
        padded
    };
    let (text, data) = (pad(text, b' '), pad(data, 0));
    let data_length = if data.is_empty() { 0 } else { 8 + data.len() };
    let length = 12 + 8 + text.len() + data_length;
    let mut file = Vec::with_capacity(length);
    let word = |file: &mut Vec<u8>, v: u32| file.extend(v.to_le_bytes());
    file.extend(b"glTF");
    word(&mut file, 2);
    word(&mut file, length as u32);
    word(&mut file, text.len() as u32);
    file.extend(b"JSON");
    file.extend(text);
    if !data.is_empty() {
        word(&mut file, data.len() as u32);
        file.extend(b"BIN\0");
        file.extend(data);
    }
    file
}
