//! The surface of the carved tooth, met by a ray through each pixel.

use super::passes::{self, Depth, Faces, Pass};

pub const SOURCE: &str = include_str!("../../shaders/iso_pass.wgsl");

/// Corners of the box of matter that the pass draws.
pub const BOX: std::ops::Range<u32> = 0..36;

pub fn pipeline(
    device: &wgpu::Device,
    format: wgpu::TextureFormat,
    view: &wgpu::BindGroupLayout,
    tooth: &wgpu::BindGroupLayout,
) -> wgpu::RenderPipeline {
    let module = passes::module(device, "iso_pass", &passes::source(SOURCE));
    Pass {
        label: "iso_pass",
        module: &module,
        vertex: "box_vertex",
        fragment: "iso_fragment",
        groups: &[Some(view), Some(tooth)],
        corners: &[],
        faces: Faces::Far,
        depth: Depth::Nearest,
        format,
        blend: None,
    }
    .pipeline(device)
}
