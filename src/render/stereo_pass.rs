//! Two eyes' pictures to one screen.

use super::passes::{self, Depth, Faces, Pass};
use super::resources;
use super::stereo::{DUBOIS, Layout};

/// In step with `stereo_pass.wgsl`.
pub mod gpu {
    use bytemuck::{Pod, Zeroable};

    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub struct Pair {
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
        let module = passes::module(device, "stereo_pass", SOURCE);
        let eye =
            resources::texture(wgpu::TextureSampleType::Float { filterable: false }, wgpu::TextureViewDimension::D2);
        let layout = resources::layout(device, "stereo", &[resources::uniform(), eye, eye]);
        let pass = Pass {
            label: "stereo_pass",
            module: &module,
            vertex: "whole_vertex",
            fragment: "stereo_fragment",
            groups: &[Some(&layout)],
            corners: &[],
            faces: Faces::Near,
            depth: Depth::None,
            format,
            blend: None,
        };
        let pipeline = pass.pipeline(device);
        let uniform = resources::uniform_buffer(device, "stereo", size_of::<gpu::Pair>());
        StereoPass { pipeline, layout, uniform, is_linear: format.is_srgb() }
    }

    /// Both eyes' pictures, each of a size, and how they are to be joined.
    pub fn group(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        eyes: [&wgpu::TextureView; 2],
        layout: Layout,
        [width, height]: [u32; 2],
    ) -> wgpu::BindGroup {
        let rows = |eye: usize, row: usize| {
            let [r, g, b] = DUBOIS[eye][row];
            [r, g, b, 0.0]
        };
        let pair = gpu::Pair {
            arrangement: layout.code(),
            is_linear: u32::from(self.is_linear),
            width,
            height,
            dubois: std::array::from_fn(|i| rows(i / 3, i % 3)),
        };
        queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&pair));
        let [left, right] = eyes.map(wgpu::BindingResource::TextureView);
        resources::group(device, &self.layout, [self.uniform.as_entire_binding(), left, right])
    }
}
