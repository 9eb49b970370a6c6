//! Construction of a pass's pipeline from its shaders, bind groups, target and depth mode.

use super::{relief, tooth, view};

/// Format of every depth buffer.
pub const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// Description of a pipeline.
pub struct PipelineDesc<'a> {
    pub label: &'static str,
    pub module: &'a wgpu::ShaderModule,
    pub vertex: &'static str,
    /// `None` if depths alone are drawn.
    pub fragment: Option<&'static str>,
    /// Bind group layouts by group number; `None` where the pass uses none.
    pub groups: &'a [Option<&'a wgpu::BindGroupLayout>],
    pub vertex_buffers: &'a [Option<wgpu::VertexBufferLayout<'a>>],
    pub faces: DrawnFaces,
    pub depth: DepthMode,
    /// Format of the colours; `None` if depths alone are drawn.
    pub format: Option<wgpu::TextureFormat>,
    pub blend: Option<wgpu::BlendState>,
    pub detail: Detail,
}

/// Constants of the fragment shaders: what a scene draws and where, which costs time even where nothing of it is seen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Detail {
    /// Shadows of the chair lamp.
    pub has_shadows: bool,
    /// Fine relief of surfaces.
    pub has_relief: bool,
    /// The target turns linear light into a screen's colours by itself.
    pub is_srgb_target: bool,
}

impl Detail {
    /// Constants of the shaders, beside their defaults.
    fn constants(self) -> Vec<(&'static str, f64)> {
        let all = [
            ("has_shadows", self.has_shadows),
            ("has_relief", self.has_relief),
            ("is_srgb_target", self.is_srgb_target),
        ];
        all.into_iter().filter(|(_, is_so)| *is_so).map(|(name, _)| (name, 1.0)).collect()
    }
}

/// Faces of triangles that are drawn.
pub enum DrawnFaces {
    Front,
    Back,
}

/// Use of the depth buffer by a pass.
pub enum DepthMode {
    /// Not attached.
    None,
    /// Tested and written: the nearer fragment wins.
    ReadWrite,
    /// Tested but not written.
    ReadOnly,
}

impl PipelineDesc<'_> {
    pub fn build(&self, device: &wgpu::Device) -> wgpu::RenderPipeline {
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(self.label),
            bind_group_layouts: self.groups,
            immediate_size: 0,
        });
        let cull_mode = match self.faces {
            DrawnFaces::Front => Some(wgpu::Face::Back),
            DrawnFaces::Back => Some(wgpu::Face::Front),
        };
        let depth = |write, compare| wgpu::DepthStencilState {
            format: DEPTH,
            depth_write_enabled: Some(write),
            depth_compare: Some(compare),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        };
        let target = self.format.map(|format| wgpu::ColorTargetState {
            format,
            blend: self.blend,
            write_mask: wgpu::ColorWrites::ALL,
        });
        let targets = match target {
            Some(_) => &[target][..],
            None => &[],
        };
        let constants = self.detail.constants();
        device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(self.label),
            layout: Some(&layout),
            vertex: wgpu::VertexState {
                module: self.module,
                entry_point: Some(self.vertex),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                buffers: self.vertex_buffers,
            },
            fragment: self.fragment.map(|fragment| wgpu::FragmentState {
                module: self.module,
                entry_point: Some(fragment),
                compilation_options: wgpu::PipelineCompilationOptions { constants: &constants, ..Default::default() },
                targets,
            }),
            primitive: wgpu::PrimitiveState { cull_mode, ..Default::default() },
            depth_stencil: match self.depth {
                DepthMode::None => None,
                DepthMode::ReadWrite => Some(depth(true, wgpu::CompareFunction::Less)),
                DepthMode::ReadOnly => Some(depth(false, wgpu::CompareFunction::Less)),
            },
            multisample: wgpu::MultisampleState::default(),
            multiview_mask: None,
            cache: None,
        })
    }
}

/// Returns the source of a pass's shader, preceded by the common sources that it builds on.
pub fn full_source(own: &str) -> String {
    [view::SOURCE, relief::SOURCE, tooth::SOURCE, own].concat()
}

pub fn shader_module(device: &wgpu::Device, label: &str, source: &str) -> wgpu::ShaderModule {
    let source = wgpu::ShaderSource::Wgsl(source.into());
    device.create_shader_module(wgpu::ShaderModuleDescriptor { label: Some(label), source })
}
