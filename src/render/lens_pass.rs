//! Blur of what is not in a lens's focus, in a finished picture; see `lens`.

use super::lens::{LensView, SOURCE, Tap};
use super::passes::{self, DepthMode, Detail, DrawnFaces, PipelineDesc};
use super::resources;

/// Layout that matches `lens_pass.wgsl`.
pub mod gpu {
    use bytemuck::{Pod, Zeroable};

    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub struct LensUniform {
        pub focus: [f32; 4],
        pub taps: [[f32; 4]; crate::lens::TAPS],
    }
}

pub struct LensPass {
    pub pipeline: wgpu::RenderPipeline,
    layout: wgpu::BindGroupLayout,
}

/// Blurred colours of one eye.
pub struct LensTarget {
    pub group: wgpu::BindGroup,
    pub colour: wgpu::TextureView,
    uniform: wgpu::Buffer,
}

impl LensPass {
    pub fn new(device: &wgpu::Device, format: wgpu::TextureFormat, view: &wgpu::BindGroupLayout) -> LensPass {
        let module = passes::shader_module(device, "lens_pass", &passes::full_source(SOURCE));
        let numbers = wgpu::TextureSampleType::Float { filterable: false };
        let [drawn, depths] = [0; 2].map(|_| resources::texture(numbers, wgpu::TextureViewDimension::D2));
        let layout = resources::layout(device, "lens", &[drawn, depths, resources::uniform()]);
        let pass = PipelineDesc {
            label: "lens_pass",
            module: &module,
            vertex: "lens_vertex",
            fragment: Some("lens_fragment"),
            groups: &[Some(view), None, Some(&layout)],
            vertex_buffers: &[],
            faces: DrawnFaces::Front,
            depth: DepthMode::None,
            format: Some(format),
            blend: None,
            detail: Detail::default(),
        };
        LensPass { pipeline: pass.build(device), layout }
    }

    /// Target for the blurred picture of an eye, whose sharp colours and depths are given.
    pub fn target(
        &self,
        device: &wgpu::Device,
        [drawn, depths]: [&wgpu::TextureView; 2],
        colour: wgpu::TextureView,
    ) -> LensTarget {
        let uniform = resources::uniform_buffer(device, "lens", size_of::<gpu::LensUniform>());
        let [drawn, depths] = [drawn, depths].map(wgpu::BindingResource::TextureView);
        let group = resources::group(device, &self.layout, [drawn, depths, uniform.as_entire_binding()]);
        LensTarget { group, colour, uniform }
    }
}

impl LensTarget {
    /// Sets the lens for the next picture.
    pub fn write_uniform(&self, queue: &wgpu::Queue, lens: &LensView) {
        let LensView { focus, scale, largest, ref taps } = *lens;
        let tap = |Tap { steps: [x, y], ring: [inner, outer] }: Tap| [x as f32, y as f32, inner, outer];
        let uniform = gpu::LensUniform { focus: [focus, scale, largest, 0.0], taps: taps.map(tap) };
        queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&uniform));
    }
}
