//! Antialiasing (FXAA) of a finished image: edges of triangles, of traced surfaces, of particles and of the mirror
//! alike.
//!
//! An edge is detected by its contrast and followed in both directions to its next steps; between two steps the
//! pixels beside the edge are blended across it as a straight edge would cover them. After T. Lottes, *FXAA* (NVIDIA,
//! 2009), and A. Reshetov, *Morphological Antialiasing* (HPG 2009). Multisampling would multiply the cost of the
//! traced passes.

use super::passes::{self, DepthMode, DrawnFaces, PipelineDesc};
use super::resources;

pub const SOURCE: &str = include_str!("../../shaders/fxaa_pass.wgsl");

pub struct FxaaPass {
    pub pipeline: wgpu::RenderPipeline,
    layout: wgpu::BindGroupLayout,
}

impl FxaaPass {
    pub fn new(device: &wgpu::Device, format: wgpu::TextureFormat) -> FxaaPass {
        let module = passes::shader_module(device, "fxaa_pass", &passes::full_source(SOURCE));
        let drawn =
            resources::texture(wgpu::TextureSampleType::Float { filterable: false }, wgpu::TextureViewDimension::D2);
        let layout = resources::layout(device, "fxaa", &[drawn]);
        let pass = PipelineDesc {
            label: "fxaa_pass",
            module: &module,
            vertex: "smooth_vertex",
            fragment: Some("smooth_fragment"),
            groups: &[None, None, Some(&layout)],
            vertex_buffers: &[],
            faces: DrawnFaces::Front,
            depth: DepthMode::None,
            format: Some(format),
            blend: None,
            detail: passes::Detail::default(),
        };
        FxaaPass { pipeline: pass.build(device), layout }
    }

    /// Returns the bind group of the image to be filtered.
    pub fn group(&self, device: &wgpu::Device, drawn: &wgpu::TextureView) -> wgpu::BindGroup {
        resources::group(device, &self.layout, [wgpu::BindingResource::TextureView(drawn)])
    }
}
