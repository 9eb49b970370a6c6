//! A disc that shows what its reflected eye sees.

use super::mirror::Mirror;
use super::passes::{self, Depth, Faces, Pass};
use super::resources;

/// In step with `mirror_pass.wgsl`.
pub mod gpu {
    use bytemuck::{Pod, Zeroable};

    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub struct Mirror {
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
        let module = passes::module(device, "mirror_pass", &passes::source(SOURCE));
        let picture =
            resources::texture(wgpu::TextureSampleType::Float { filterable: false }, wgpu::TextureViewDimension::D2);
        let layout = resources::layout(device, "mirror", &[resources::uniform(), picture]);
        let pass = Pass {
            label: "mirror_pass",
            module: &module,
            vertex: "mirror_vertex",
            fragment: "mirror_fragment",
            groups: &[Some(view), None, Some(&layout)],
            corners: &[],
            faces: Faces::Near,
            depth: Depth::Nearest,
            format,
            blend: None,
        };
        let uniform = resources::uniform_buffer(device, "mirror", size_of::<gpu::Mirror>());
        MirrorPass { pipeline: pass.pipeline(device), layout, uniform }
    }

    /// Where the mirror is in this picture.
    pub fn pose(&self, queue: &wgpu::Queue, mirror: &Mirror) {
        let uniform = gpu::Mirror {
            middle: mirror.world_from_mirror.position.extend(mirror.radius).to_array(),
            right: mirror.right().extend(mirror.shine).to_array(),
            up: mirror.up().extend(0.0).to_array(),
            normal: mirror.normal().extend(0.0).to_array(),
        };
        queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&uniform));
    }

    /// What it shows.
    pub fn group(&self, device: &wgpu::Device, reflected: &wgpu::TextureView) -> wgpu::BindGroup {
        let reflected = wgpu::BindingResource::TextureView(reflected);
        resources::group(device, &self.layout, [self.uniform.as_entire_binding(), reflected])
    }
}
