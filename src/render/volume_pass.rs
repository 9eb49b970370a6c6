//! Colours and opacities by density, blended along each ray in front of what is already drawn.

use super::passes::{self, DepthMode, Detail, DrawnFaces, PipelineDesc};
use super::resources;

pub const SOURCE: &str = include_str!("../../shaders/volume_pass.wgsl");

pub struct VolumePass {
    pub pipeline: wgpu::RenderPipeline,
    layout: wgpu::BindGroupLayout,
}

impl VolumePass {
    pub fn new(
        device: &wgpu::Device,
        format: wgpu::TextureFormat,
        view: &wgpu::BindGroupLayout,
        tooth: &wgpu::BindGroupLayout,
        detail: Detail,
    ) -> VolumePass {
        let module = passes::shader_module(device, "volume_pass", &passes::full_source(SOURCE));
        let numbers = wgpu::TextureSampleType::Float { filterable: false };
        let depth = resources::texture(numbers, wgpu::TextureViewDimension::D2);
        let layout = resources::layout(device, "scene depth", &[depth]);
        let pass = PipelineDesc {
            label: "volume_pass",
            module: &module,
            vertex: "box_vertex",
            fragment: Some("volume_fragment"),
            groups: &[Some(view), Some(tooth), Some(&layout)],
            vertex_buffers: &[],
            faces: DrawnFaces::Back,
            depth: DepthMode::None,
            format: Some(format),
            blend: Some(wgpu::BlendState::PREMULTIPLIED_ALPHA_BLENDING),
            detail,
        };
        VolumePass { pipeline: pass.build(device), layout }
    }

    /// The depths that end the rays.
    pub fn group(&self, device: &wgpu::Device, depth: &wgpu::TextureView) -> wgpu::BindGroup {
        resources::group(device, &self.layout, [wgpu::BindingResource::TextureView(depth)])
    }
}
