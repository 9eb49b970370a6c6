//! Triangles with light per pixel: the background, solids, and the tooth's surface.

use super::passes::{self, Depth, Faces, Pass};
use super::resources;
use super::scene::{Rgb, Solid};
use super::surface_mesh;
use super::vertex::Vertex;
use crate::frame::Vec3;
use crate::mesh::Mesh;
use std::sync::Arc;

/// In step with `surface_pass.wgsl`.
pub mod gpu {
    use bytemuck::{Pod, Zeroable};

    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub struct Solid {
        pub world_from_solid: [[f32; 4]; 4],
        pub finish: [f32; 4],
    }
}

pub const SOURCE: &str = include_str!("../../shaders/surface_pass.wgsl");

pub struct SurfacePass {
    pub background: wgpu::RenderPipeline,
    pub tooth: wgpu::RenderPipeline,
    solid: wgpu::RenderPipeline,
    layout: wgpu::BindGroupLayout,
    meshes: Vec<KeptMesh>,
    /// One per solid of a scene, in its order.
    placed: Vec<Placed>,
}

/// A mesh where the adapter can see it, for as long as scenes name it.
struct KeptMesh {
    mesh: Arc<Mesh>,
    tints: Arc<Vec<Rgb>>,
    vertices: wgpu::Buffer,
    indices: wgpu::Buffer,
    is_named: bool,
}

struct Placed {
    uniform: wgpu::Buffer,
    group: wgpu::BindGroup,
    /// Which of the kept meshes.
    mesh: usize,
}

impl SurfacePass {
    pub fn new(
        device: &wgpu::Device,
        format: wgpu::TextureFormat,
        view: &wgpu::BindGroupLayout,
        tooth: &wgpu::BindGroupLayout,
    ) -> SurfacePass {
        let module = passes::module(device, "surface_pass", &passes::source(SOURCE));
        let layout = resources::layout(device, "solid", &[resources::uniform()]);
        let attributes = wgpu::vertex_attr_array![0 => Float32x3, 1 => Snorm16x4, 2 => Unorm8x4];
        let corners = [Some(wgpu::VertexBufferLayout {
            array_stride: size_of::<Vertex>() as u64,
            step_mode: wgpu::VertexStepMode::Vertex,
            attributes: &attributes,
        })];
        let pass = |label, vertex, fragment, groups, corners, depth| {
            let (module, faces, blend) = (&module, Faces::Near, None);
            Pass { label, module, vertex, fragment, groups, corners, faces, depth, format, blend }.pipeline(device)
        };
        let alone = [Some(view)];
        let (with_tooth, with_solid) = ([Some(view), Some(tooth)], [Some(view), None, Some(&layout)]);
        SurfacePass {
            background: pass("background", "background_vertex", "background_fragment", &alone, &[], Depth::Ignored),
            tooth: pass("tooth", "tooth_vertex", "tooth_fragment", &with_tooth, &corners, Depth::Nearest),
            solid: pass("solid", "solid_vertex", "solid_fragment", &with_solid, &corners, Depth::Nearest),
            layout,
            meshes: Vec::new(),
            placed: Vec::new(),
        }
    }

    /// Brings solids that are new to the adapter and forgets those that are gone.
    pub fn prepare(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, solids: &[Solid]) {
        self.meshes.iter_mut().for_each(|kept| kept.is_named = false);
        let named: Vec<Named> = solids.iter().map(|solid| self.keep(device, queue, solid)).collect();
        let mut place = 0;
        // Where each kept mesh lies after the forgotten ones are gone.
        let places: Vec<usize> = self
            .meshes
            .iter()
            .map(|kept| {
                place += usize::from(kept.is_named);
                place.saturating_sub(1)
            })
            .collect();
        self.meshes.retain(|kept| kept.is_named);
        self.placed.truncate(solids.len());
        for (i, (solid, Named(mesh))) in solids.iter().zip(named).enumerate() {
            if i == self.placed.len() {
                let uniform = resources::uniform_buffer(device, "solid", size_of::<gpu::Solid>());
                let group = resources::group(device, &self.layout, [uniform.as_entire_binding()]);
                self.placed.push(Placed { uniform, group, mesh });
            }
            self.placed[i].mesh = places[mesh];
            let [r, g, b] = solid.finish.colour;
            let uniform = gpu::Solid {
                world_from_solid: resources::columns(solid.world_from_solid, Vec3::ONE, Vec3::ZERO),
                finish: [r, g, b, solid.finish.gloss],
            };
            queue.write_buffer(&self.placed[i].uniform, 0, bytemuck::bytes_of(&uniform));
        }
    }

    fn keep(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, solid: &Solid) -> Named {
        let is_same = |k: &KeptMesh| Arc::ptr_eq(&k.mesh, &solid.mesh) && Arc::ptr_eq(&k.tints, &solid.tints);
        let found = self.meshes.iter().position(is_same).unwrap_or_else(|| {
            let filled = |label, usage, bytes: &[u8]| {
                let usage = usage | wgpu::BufferUsages::COPY_DST;
                let size = bytes.len().max(4) as u64;
                let descriptor = wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false };
                let buffer = device.create_buffer(&descriptor);
                queue.write_buffer(&buffer, 0, bytes);
                buffer
            };
            let vertices = surface_mesh::of_solid(solid);
            let vertices = filled("corners", wgpu::BufferUsages::VERTEX, bytemuck::cast_slice(&vertices));
            let indices = bytemuck::cast_slice(&solid.mesh.triangles);
            let indices = filled("triangles", wgpu::BufferUsages::INDEX, indices);
            let (mesh, tints) = (solid.mesh.clone(), solid.tints.clone());
            self.meshes.push(KeptMesh { mesh, tints, vertices, indices, is_named: true });
            self.meshes.len() - 1
        });
        self.meshes[found].is_named = true;
        Named(found)
    }

    /// Draws all prepared solids; the view's group is set.
    pub fn draw_solids(&self, pass: &mut wgpu::RenderPass) {
        pass.set_pipeline(&self.solid);
        for placed in &self.placed {
            let kept = &self.meshes[placed.mesh];
            if kept.mesh.is_empty() {
                continue;
            }
            pass.set_bind_group(2, &placed.group, &[]);
            pass.set_vertex_buffer(0, kept.vertices.slice(..));
            pass.set_index_buffer(kept.indices.slice(..), wgpu::IndexFormat::Uint32);
            pass.draw_indexed(0..3 * kept.mesh.triangles.len() as u32, 0, 0..1);
        }
    }
}

/// A kept mesh's place before others are forgotten.
struct Named(usize);
