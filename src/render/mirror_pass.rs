//! The disc of a mirror, showing what its reflected eye sees.

use super::mirror::PlaneMirror;
use super::passes::{self, DepthMode, DrawnFaces, PipelineDesc};
use super::resources;

/// Structs of `mirror_pass.wgsl`; keep in step.
pub mod gpu {
    use bytemuck::{Pod, Zeroable};

    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub struct MirrorUniform {
        pub middle: [f32; 4],
        pub right: [f32; 4],
        pub up: [f32; 4],
        pub normal: [f32; 4],
    }
}

pub const SOURCE: &str = include_str!("../../shaders/mirror_pass.wgsl");

pub struct MirrorPass {
    pub pipeline: wgpu::RenderPipeline,
    layout: wgpu::BindGroupLayout,
    uniform: wgpu::Buffer,
}

impl MirrorPass {
    pub fn new(device: &wgpu::Device, format: wgpu::TextureFormat, view: &wgpu::BindGroupLayout) -> MirrorPass {
        let module = passes::shader_module(device, "mirror_pass", &passes::full_source(SOURCE));
        let picture =
            resources::texture(wgpu::TextureSampleType::Float { filterable: false }, wgpu::TextureViewDimension::D2);
        let layout = resources::layout(device, "mirror", &[resources::uniform(), picture]);
        let pass = PipelineDesc {
            label: "mirror_pass",
            module: &module,
            vertex: "mirror_vertex",
            fragment: Some("mirror_fragment"),
            groups: &[Some(view), None, Some(&layout)],
            vertex_buffers: &[],
            faces: DrawnFaces::Front,
            depth: DepthMode::ReadWrite,
            format: Some(format),
            blend: None,
            detail: passes::Detail::default(),
        };
        let uniform = resources::uniform_buffer(device, "mirror", size_of::<gpu::MirrorUniform>());
        MirrorPass { pipeline: pass.build(device), layout, uniform }
    }

    /// Writes the pose, radius and reflectance of the mirror for this image.
    pub fn write_uniform(&self, queue: &wgpu::Queue, mirror: &PlaneMirror) {
        let uniform = gpu::MirrorUniform {
            middle: mirror.world_from_mirror.position.extend(mirror.radius).to_array(),
            right: mirror.right().extend(mirror.reflectance).to_array(),
            up: mirror.up().extend(0.0).to_array(),
            normal: mirror.normal().extend(0.0).to_array(),
        };
        queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&uniform));
    }

    /// Returns the bind group of the image that the mirror shows.
    pub fn group(&self, device: &wgpu::Device, reflected: &wgpu::TextureView) -> wgpu::BindGroup {
        let reflected = wgpu::BindingResource::TextureView(reflected);
        resources::group(device, &self.layout, [self.uniform.as_entire_binding(), reflected])
    }
}
