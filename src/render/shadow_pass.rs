//! The depths that the chair lamp sees.

use super::passes::{self, DEPTH, DepthMode, DrawnFaces, PipelineDesc};
use super::vertex::Vertex;
use super::{iso_pass, resources, shadow, surface_pass};

/// Map of the depths that a lamp sees, and the samplers by which surfaces read it.
pub struct ShadowMap {
    pub depths: wgpu::TextureView,
    pub compare: wgpu::Sampler,
    pub nearest: wgpu::Sampler,
}

impl ShadowMap {
    /// A map for scenes without shadows.
    pub fn none(device: &wgpu::Device) -> ShadowMap {
        ShadowMap::new(device, 1)
    }

    fn new(device: &wgpu::Device, size: u32) -> ShadowMap {
        let texture = resources::target_texture(device, "shadow map", [size; 2], DEPTH);
        ShadowMap {
            depths: texture.create_view(&wgpu::TextureViewDescriptor::default()),
            compare: device.create_sampler(&wgpu::SamplerDescriptor {
                label: Some("shadow_sampler"),
                mag_filter: wgpu::FilterMode::Linear,
                min_filter: wgpu::FilterMode::Linear,
                compare: Some(wgpu::CompareFunction::LessEqual),
                ..Default::default()
            }),
            nearest: device.create_sampler(&wgpu::SamplerDescriptor::default()),
        }
    }
}

/// Pipelines that draw depths alone, and their target. Made when a scene first has shadows.
pub struct ShadowPass {
    pub map: ShadowMap,
    pub solid: wgpu::RenderPipeline,
    pub tooth: wgpu::RenderPipeline,
    pub iso: wgpu::RenderPipeline,
}

impl ShadowPass {
    pub fn new(
        device: &wgpu::Device,
        view: &wgpu::BindGroupLayout,
        tooth: &wgpu::BindGroupLayout,
        solid: &wgpu::BindGroupLayout,
    ) -> ShadowPass {
        let triangles = passes::shader_module(device, "surface_pass", &passes::full_source(surface_pass::SOURCE));
        let rays = passes::shader_module(device, "iso_pass", &passes::full_source(iso_pass::SOURCE));
        let corners = [Some(Vertex::layout())];
        let pass = |label, module, (vertex, fragment), groups, vertex_buffers, faces| {
            PipelineDesc {
                label,
                module,
                vertex,
                fragment,
                groups,
                vertex_buffers,
                faces,
                depth: DepthMode::ReadWrite,
                format: None,
                blend: None,
                detail: passes::Detail::default(),
            }
            .build(device)
        };
        let (with_tooth, with_solid) = ([Some(view), Some(tooth)], [Some(view), None, Some(solid)]);
        let front = DrawnFaces::Front;
        ShadowPass {
            map: ShadowMap::new(device, shadow::MAP_SIZE),
            solid: pass("solid shadow", &triangles, ("solid_vertex", None), &with_solid, &corners, front),
            tooth: pass("tooth shadow", &triangles, ("tooth_vertex", None), &with_tooth, &corners, DrawnFaces::Front),
            iso: pass(
                "iso shadow",
                &rays,
                ("box_vertex", Some("iso_depth_fragment")),
                &with_tooth,
                &[],
                DrawnFaces::Back,
            ),
        }
    }
}
