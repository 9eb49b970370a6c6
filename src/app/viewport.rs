//! Where the picture goes: a texture of the window's own device, as large as the view.

use crate::render::{Error, Renderer, Scene, Stereo, Target, Viewpoint, Watch};
use eframe::egui;
use eframe::egui_wgpu::RenderState;

/// What egui expects of a picture that is not its own: colours as a screen shows them.
const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

/// True where a graphics processor draws. In software triangles are several times as fast as rays.
pub fn has_graphics(state: &RenderState) -> bool {
    state.adapter.get_info().device_type != wgpu::DeviceType::Cpu
}

/// The second window's picture until its size is known, pixels.
const SECOND_SIZE: [u32; 2] = [1024, 768];

/// Draws scenes for the window.
pub struct Viewport {
    state: RenderState,
    renderer: Renderer,
    watch: Watch,
    canvases: [Option<Canvas>; 2],
    /// Pixels of the second window, as it was last seen.
    second_size: [u32; 2],
}

/// The window that a picture is for.
#[derive(Clone, Copy)]
pub enum Place {
    Main,
    /// The right eye's own, where each eye has a projector.
    Second,
}

struct Canvas {
    size: [u32; 2],
    view: wgpu::TextureView,
    id: egui::TextureId,
}

impl Viewport {
    pub fn new(state: &RenderState) -> Viewport {
        let renderer = Renderer::new(&state.device, &state.queue, FORMAT);
        Viewport {
            state: state.clone(),
            renderer,
            watch: Watch::over(&state.device),
            canvases: [None, None],
            second_size: SECOND_SIZE,
        }
    }

    /// True where a graphics processor draws.
    pub fn has_graphics(&self) -> bool {
        has_graphics(&self.state)
    }

    /// Pixels of the second window from now on.
    pub fn size_second(&mut self, size: [u32; 2]) {
        self.second_size = size;
    }

    pub fn second_size(&self) -> [u32; 2] {
        self.second_size
    }

    /// The picture that was last drawn for the second window, if one was.
    pub fn second(&self) -> Option<egui::TextureId> {
        self.canvases[Place::Second as usize].as_ref().map(|canvas| canvas.id)
    }

    /// Draws a scene at a size in pixels; gives the picture for egui to place.
    pub fn draw(
        &mut self,
        place: Place,
        scene: &Scene,
        viewpoint: &Viewpoint,
        stereo: Option<Stereo>,
        size: [u32; 2],
    ) -> Result<egui::TextureId, Error> {
        let known = self.canvases[place as usize].take();
        let canvas = match known {
            Some(canvas) if canvas.size == size => canvas,
            known => canvas(&self.state, size, known.map(|c| c.id)),
        };
        let drawn = self.renderer.draw(scene, viewpoint, stereo, Target { view: &canvas.view, size });
        let id = canvas.id;
        self.canvases[place as usize] = Some(canvas);
        drawn?;
        self.watch.check()?;
        Ok(id)
    }
}

/// A texture of a size, under the identity of the one it replaces.
fn canvas(state: &RenderState, size: [u32; 2], known: Option<egui::TextureId>) -> Canvas {
    let texture = state.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("view"),
        size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: FORMAT,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    });
    let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
    let filter = wgpu::FilterMode::Linear;
    let mut egui_renderer = state.renderer.write();
    let id = match known {
        Some(id) => {
            egui_renderer.update_egui_texture_from_wgpu_texture(&state.device, &view, filter, id);
            id
        }
        None => egui_renderer.register_native_texture(&state.device, &view, filter),
    };
    Canvas { size, view, id }
}
