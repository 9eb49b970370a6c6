//! How a pass becomes a pipeline: its shaders, groups, target and depth.

use super::{tooth, view};

/// Format of every depth buffer.
pub const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// What one pipeline is made of.
pub struct Pass<'a> {
    pub label: &'static str,
    pub module: &'a wgpu::ShaderModule,
    pub vertex: &'static str,
    pub fragment: &'static str,
    /// By group number; `None` where the pass uses none.
    pub groups: &'a [Option<&'a wgpu::BindGroupLayout>],
    pub corners: &'a [Option<wgpu::VertexBufferLayout<'a>>],
    pub faces: Faces,
    pub depth: Depth,
    pub format: wgpu::TextureFormat,
    pub blend: Option<wgpu::BlendState>,
}

/// Which sides of triangles are drawn.
pub enum Faces {
    Near,
    Far,
}

/// What a pass has to do with the depth buffer.
pub enum Depth {
    /// Not attached.
    None,
    /// Attached and left alone.
    Ignored,
    /// Nearer wins and is written.
    Nearest,
    /// What is nearer is drawn and leaves the depth as it was.
    Compared,
}

impl Pass<'_> {
    pub fn pipeline(&self, device: &wgpu::Device) -> wgpu::RenderPipeline {
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(self.label),
            bind_group_layouts: self.groups,
            immediate_size: 0,
        });
        let cull_mode = match self.faces {
            Faces::Near => Some(wgpu::Face::Back),
            Faces::Far => Some(wgpu::Face::Front),
        };
        let depth = |write, compare| wgpu::DepthStencilState {
            format: DEPTH,
            depth_write_enabled: Some(write),
            depth_compare: Some(compare),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        };
        let target =
            wgpu::ColorTargetState { format: self.format, blend: self.blend, write_mask: wgpu::ColorWrites::ALL };
        device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(self.label),
            layout: Some(&layout),
            vertex: wgpu::VertexState {
                module: self.module,
                entry_point: Some(self.vertex),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                buffers: self.corners,
            },
            fragment: Some(wgpu::FragmentState {
                module: self.module,
                entry_point: Some(self.fragment),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                targets: &[Some(target)],
            }),
            primitive: wgpu::PrimitiveState { cull_mode, ..Default::default() },
            depth_stencil: match self.depth {
                Depth::None => None,
                Depth::Ignored => Some(depth(false, wgpu::CompareFunction::Always)),
                Depth::Nearest => Some(depth(true, wgpu::CompareFunction::Less)),
                Depth::Compared => Some(depth(false, wgpu::CompareFunction::Less)),
            },
            multisample: wgpu::MultisampleState::default(),
            multiview_mask: None,
            cache: None,
        })
    }
}

/// A pass's shader with all that it builds on.
pub fn source(own: &str) -> String {
    [view::SOURCE, tooth::SOURCE, own].concat()
}

pub fn module(device: &wgpu::Device, label: &str, source: &str) -> wgpu::ShaderModule {
    let source = wgpu::ShaderSource::Wgsl(source.into());
    device.create_shader_module(wgpu::ShaderModuleDescriptor { label: Some(label), source })
}
