//! Triangles with per-pixel lighting: the background, mesh instances, and the tooth's surface.

use super::eye::Eye;
use super::mesh_parts::{MeshParts, VisibleParts};
use super::passes::{self, DepthMode, Detail, DrawnFaces, PipelineDesc};
use super::resources;
use super::scene::{MeshInstance, VertexTint};
use super::surface_mesh;
use super::vertex::Vertex;
use std::sync::Arc;
use typodont_core::frame::{Pose, Vec3};
use typodont_core::mesh::Mesh;

/// Structs of `surface_pass.wgsl`; keep in step.
pub mod gpu {
    use bytemuck::{Pod, Zeroable};

    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub struct SolidUniform {
        pub world_from_solid: [[f32; 4]; 4],
        pub finish: [f32; 4],
    }
}

pub const SOURCE: &str = include_str!("../../shaders/surface_pass.wgsl");

pub struct SurfacePass {
    pub background: wgpu::RenderPipeline,
    pub tooth: wgpu::RenderPipeline,
    solid: wgpu::RenderPipeline,
    /// For meshes with stippling and for teeth; `None` without relief.
    in_relief: Option<[wgpu::RenderPipeline; 2]>,
    pub layout: wgpu::BindGroupLayout,
    cached_meshes: Vec<CachedMesh>,
    /// One entry per mesh instance of a scene, in its order.
    draws: Vec<MeshDraw>,
}

/// An uploaded mesh, kept for as long as scenes refer to it.
struct CachedMesh {
    mesh: Arc<Mesh>,
    vertex_tints: Arc<Vec<VertexTint>>,
    parts: MeshParts,
    vertices: wgpu::Buffer,
    indices: wgpu::Buffer,
    is_stippled: bool,
    is_used: bool,
}

struct MeshDraw {
    uniform: wgpu::Buffer,
    group: wgpu::BindGroup,
    /// Index of the cached mesh.
    mesh: usize,
    world_from_solid: Pose,
    is_enamel: bool,
    casts_shadow: bool,
}

impl SurfacePass {
    pub fn new(
        device: &wgpu::Device,
        format: wgpu::TextureFormat,
        view: &wgpu::BindGroupLayout,
        tooth: &wgpu::BindGroupLayout,
        detail: Detail,
    ) -> SurfacePass {
        let module = passes::shader_module(device, "surface_pass", &passes::full_source(SOURCE));
        let layout = resources::layout(device, "solid", &[resources::uniform()]);
        let corners = [Some(Vertex::layout())];
        let pass = |label, vertex, fragment, groups, corners, depth| {
            let (module, faces, blend) = (&module, DrawnFaces::Front, None);
            PipelineDesc {
                label,
                module,
                vertex,
                fragment: Some(fragment),
                groups,
                vertex_buffers: corners,
                faces,
                depth,
                format: Some(format),
                blend,
                detail,
            }
            .build(device)
        };
        let alone = [Some(view)];
        let (with_tooth, with_solid) = ([Some(view), Some(tooth)], [Some(view), None, Some(&layout)]);
        SurfacePass {
            background: pass(
                "background",
                "background_vertex",
                "background_fragment",
                &alone,
                &[],
                DepthMode::ReadOnly,
            ),
            tooth: pass("tooth", "tooth_vertex", "tooth_fragment", &with_tooth, &corners, DepthMode::ReadWrite),
            in_relief: detail.has_relief.then(|| {
                [("stippled", "stippled_fragment"), ("enamel", "enamel_fragment")].map(|(label, fragment)| {
                    pass(label, "relief_vertex", fragment, &with_solid, &corners, DepthMode::ReadWrite)
                })
            }),
            solid: pass("solid", "solid_vertex", "solid_fragment", &with_solid, &corners, DepthMode::ReadWrite),
            layout,
            cached_meshes: Vec::new(),
            draws: Vec::new(),
        }
    }

    /// Uploads new meshes and drops those that the scene no longer contains.
    pub fn prepare(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, solids: &[MeshInstance]) {
        self.cached_meshes.iter_mut().for_each(|cached| cached.is_used = false);
        let cache_indices: Vec<CacheIndex> = solids.iter().map(|solid| self.cache_mesh(device, queue, solid)).collect();
        let mut used_count = 0;
        // Index of each cached mesh after the unused ones are removed.
        let new_indices: Vec<usize> = self
            .cached_meshes
            .iter()
            .map(|cached| {
                used_count += usize::from(cached.is_used);
                used_count.saturating_sub(1)
            })
            .collect();
        self.cached_meshes.retain(|cached| cached.is_used);
        self.draws.truncate(solids.len());
        for (i, (solid, CacheIndex(mesh))) in solids.iter().zip(cache_indices).enumerate() {
            if i == self.draws.len() {
                let uniform = resources::uniform_buffer(device, "solid", size_of::<gpu::SolidUniform>());
                let group = resources::group(device, &self.layout, [uniform.as_entire_binding()]);
                let &MeshInstance { world_from_solid, is_enamel, casts_shadow, .. } = solid;
                self.draws.push(MeshDraw { uniform, group, mesh, world_from_solid, is_enamel, casts_shadow });
            }
            self.draws[i].mesh = new_indices[mesh];
            self.draws[i].world_from_solid = solid.world_from_solid;
            self.draws[i].is_enamel = solid.is_enamel;
            self.draws[i].casts_shadow = solid.casts_shadow;
            let [r, g, b] = solid.appearance.colour;
            let uniform = gpu::SolidUniform {
                world_from_solid: resources::columns(solid.world_from_solid, Vec3::ONE, Vec3::ZERO),
                finish: [r, g, b, solid.appearance.gloss],
            };
            queue.write_buffer(&self.draws[i].uniform, 0, bytemuck::bytes_of(&uniform));
        }
    }

    fn cache_mesh(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, solid: &MeshInstance) -> CacheIndex {
        let is_same =
            |k: &CachedMesh| Arc::ptr_eq(&k.mesh, &solid.mesh) && Arc::ptr_eq(&k.vertex_tints, &solid.vertex_tints);
        let found = self.cached_meshes.iter().position(is_same).unwrap_or_else(|| {
            let filled = |label, usage, bytes: &[u8]| {
                let usage = usage | wgpu::BufferUsages::COPY_DST;
                let size = bytes.len().max(4) as u64;
                let descriptor = wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false };
                let buffer = device.create_buffer(&descriptor);
                queue.write_buffer(&buffer, 0, bytes);
                buffer
            };
            let vertices = surface_mesh::instance_vertices(solid);
            let vertices = filled("corners", wgpu::BufferUsages::VERTEX, bytemuck::cast_slice(&vertices));
            let parts = MeshParts::new(&solid.mesh);
            let indices = bytemuck::cast_slice(&parts.triangles);
            let indices = filled("triangles", wgpu::BufferUsages::INDEX, indices);
            let (mesh, vertex_tints) = (solid.mesh.clone(), solid.vertex_tints.clone());
            let is_stippled = vertex_tints.iter().any(|tint| tint.stippling > 0.0);
            self.cached_meshes.push(CachedMesh {
                mesh,
                vertex_tints,
                parts,
                vertices,
                indices,
                is_stippled,
                is_used: true,
            });
            self.cached_meshes.len() - 1
        });
        self.cached_meshes[found].is_used = true;
        CacheIndex(found)
    }

    /// Draws all prepared mesh instances that an eye may see, nearer ones first, so that little is shaded that is then covered; the
    /// view's bind group must be set.
    pub fn draw_solids(&self, pass: &mut wgpu::RenderPass, eye: &Eye) {
        let seen = |draw| (draw, self.visible(draw, eye));
        let mut draws: Vec<(&MeshDraw, VisibleParts)> = self.draws.iter().map(seen).collect();
        draws.sort_by(|(_, a), (_, b)| a.distance.total_cmp(&b.distance));
        for (draw, parts) in &draws {
            let pipeline = match &self.in_relief {
                Some([_, enamel]) if draw.is_enamel => enamel,
                Some([stippled, _]) if self.cached_meshes[draw.mesh].is_stippled => stippled,
                _ => &self.solid,
            };
            pass.set_pipeline(pipeline);
            self.draw(pass, draw, parts);
        }
    }

    /// Draws all prepared mesh instances that cast shadows and that a lamp may see, with the pipeline that is set.
    pub fn draw_shadows(&self, pass: &mut wgpu::RenderPass, lamp: &Eye) {
        for draw in self.draws.iter().filter(|draw| draw.casts_shadow) {
            self.draw(pass, draw, &self.visible(draw, lamp));
        }
    }

    fn visible(&self, draw: &MeshDraw, eye: &Eye) -> VisibleParts {
        self.cached_meshes[draw.mesh].parts.visible(eye, draw.world_from_solid)
    }

    fn draw(&self, pass: &mut wgpu::RenderPass, draw: &MeshDraw, parts: &VisibleParts) {
        if parts.runs.is_empty() {
            return;
        }
        let cached = &self.cached_meshes[draw.mesh];
        pass.set_bind_group(2, &draw.group, &[]);
        pass.set_vertex_buffer(0, cached.vertices.slice(..));
        pass.set_index_buffer(cached.indices.slice(..), wgpu::IndexFormat::Uint32);
        for run in &parts.runs {
            pass.draw_indexed(3 * run.start..3 * run.end, 0, 0..1);
        }
    }
}

/// Index of a cached mesh before the unused ones are removed.
struct CacheIndex(usize);
