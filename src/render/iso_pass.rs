//! Traced isosurface of the carved tooth: one ray through each pixel.

use super::passes::{self, DepthMode, Detail, DrawnFaces, PipelineDesc};

pub const SOURCE: &str = include_str!("../../shaders/iso_pass.wgsl");

/// Vertices of the box around all matter, which the pass draws.
pub const BOX_VERTICES: std::ops::Range<u32> = 0..36;

pub fn pipeline(
    device: &wgpu::Device,
    format: wgpu::TextureFormat,
    view: &wgpu::BindGroupLayout,
    tooth: &wgpu::BindGroupLayout,
    detail: Detail,
) -> wgpu::RenderPipeline {
    let module = passes::shader_module(device, "iso_pass", &passes::full_source(SOURCE));
    PipelineDesc {
        label: "iso_pass",
        module: &module,
        vertex: "box_vertex",
        fragment: Some("iso_fragment"),
        groups: &[Some(view), Some(tooth)],
        vertex_buffers: &[],
        faces: DrawnFaces::Back,
        depth: DepthMode::ReadWrite,
        format: Some(format),
        blend: None,
        detail,
    }
    .build(device)
}
