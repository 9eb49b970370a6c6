//! A finished picture with the stairs along its edges smoothed: triangles', rays', dust's and the mirror's alike.
//!
//! An edge is found by its contrast and followed both ways to where it takes its next stair; between two stairs the pixels
//! beside it are mixed across it as a straight edge would cover them. After T. Lottes, *FXAA* (NVIDIA, 2009), and A. Reshetov,
//! *Morphological Antialiasing* (HPG 2009). Several samples a pixel would cost the rays several pictures.

use super::passes::{self, Depth, Faces, Pass};
use super::resources;

pub const SOURCE: &str = include_str!("../../shaders/smooth_pass.wgsl");

pub struct SmoothPass {
    pub pipeline: wgpu::RenderPipeline,
    layout: wgpu::BindGroupLayout,
}

impl SmoothPass {
    pub fn new(device: &wgpu::Device, format: wgpu::TextureFormat) -> SmoothPass {
        let module = passes::module(device, "smooth_pass", &passes::source(SOURCE));
        let drawn =
            resources::texture(wgpu::TextureSampleType::Float { filterable: false }, wgpu::TextureViewDimension::D2);
        let layout = resources::layout(device, "smooth", &[drawn]);
        let pass = Pass {
            label: "smooth_pass",
            module: &module,
            vertex: "smooth_vertex",
            fragment: "smooth_fragment",
            groups: &[None, None, Some(&layout)],
            corners: &[],
            faces: Faces::Near,
            depth: Depth::None,
            format,
            blend: None,
        };
        SmoothPass { pipeline: pass.pipeline(device), layout }
    }

    /// The picture that is smoothed.
    pub fn group(&self, device: &wgpu::Device, drawn: &wgpu::TextureView) -> wgpu::BindGroup {
        resources::group(device, &self.layout, [wgpu::BindingResource::TextureView(drawn)])
    }
}
