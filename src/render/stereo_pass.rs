//! Combination of two eyes' images on one screen.

use super::passes::{self, DepthMode, DrawnFaces, PipelineDesc};
use super::resources;
use super::stereo::{DUBOIS, StereoLayout};

/// Structs of `stereo_pass.wgsl`; keep in step.
pub mod gpu {
    use bytemuck::{Pod, Zeroable};

    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub struct StereoUniform {
        pub arrangement: u32,
        pub is_linear: u32,
        pub width: u32,
        pub height: u32,
        pub dubois: [[f32; 4]; 6],
    }
}

pub const SOURCE: &str = include_str!("../../shaders/stereo_pass.wgsl");

pub struct StereoPass {
    pub pipeline: wgpu::RenderPipeline,
    layout: wgpu::BindGroupLayout,
    uniform: wgpu::Buffer,
    is_linear: bool,
}

impl StereoPass {
    pub fn new(device: &wgpu::Device, format: wgpu::TextureFormat) -> StereoPass {
        let module = passes::shader_module(device, "stereo_pass", SOURCE);
        let eye =
            resources::texture(wgpu::TextureSampleType::Float { filterable: false }, wgpu::TextureViewDimension::D2);
        let layout = resources::layout(device, "stereo", &[resources::uniform(), eye, eye]);
        let pass = PipelineDesc {
            label: "stereo_pass",
            module: &module,
            vertex: "whole_vertex",
            fragment: Some("stereo_fragment"),
            groups: &[Some(&layout)],
            vertex_buffers: &[],
            faces: DrawnFaces::Front,
            depth: DepthMode::None,
            format: Some(format),
            blend: None,
            detail: passes::Detail::default(),
        };
        let pipeline = pass.build(device);
        let uniform = resources::uniform_buffer(device, "stereo", size_of::<gpu::StereoUniform>());
        StereoPass { pipeline, layout, uniform, is_linear: format.is_srgb() }
    }

    /// Returns the bind group of both eyes' images, each of the given size, and of the layout in which they are
    /// combined.
    pub fn group(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        eyes: [&wgpu::TextureView; 2],
        layout: StereoLayout,
        [width, height]: [u32; 2],
    ) -> wgpu::BindGroup {
        let rows = |eye: usize, row: usize| {
            let [r, g, b] = DUBOIS[eye][row];
            [r, g, b, 0.0]
        };
        let uniform = gpu::StereoUniform {
            arrangement: layout.shader_code(),
            is_linear: u32::from(self.is_linear),
            width,
            height,
            dubois: std::array::from_fn(|i| rows(i / 3, i % 3)),
        };
        queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&uniform));
        let [left, right] = eyes.map(wgpu::BindingResource::TextureView);
        resources::group(device, &self.layout, [self.uniform.as_entire_binding(), left, right])
    }
}
