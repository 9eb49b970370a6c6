//! Render target of the view: a texture of the window's own graphics device, as large as the view.

use eframe::egui;
use eframe::egui_wgpu::RenderState;
use typodont_render::{DeviceErrorListener, RenderError, RenderScene, RenderTarget, Renderer, Stereo, Viewpoint};

/// Format that egui expects of a foreign texture: colours as a screen shows them (sRGB-encoded values).
const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

/// True if a graphics processor draws. In software, drawing triangles is several times as fast as casting rays.
pub fn has_graphics(state: &RenderState) -> bool {
    state.adapter.get_info().device_type != wgpu::DeviceType::Cpu
}

/// Size of the second window's image until the window's size is known, pixels.
const SECOND_EYE_SIZE: [u32; 2] = [1024, 768];

/// Draws scenes for the window.
pub struct Viewport {
    state: RenderState,
    renderer: Renderer,
    error_listener: DeviceErrorListener,
    textures: [Option<OffscreenTexture>; 2],
    /// Last known size of the second window, pixels.
    second_eye_size: [u32; 2],
}

/// The window for which an image is rendered.
#[derive(Clone, Copy)]
pub enum EyeWindow {
    Main,
    /// The window of the right eye, if each eye has its own projector.
    SecondEye,
}

struct OffscreenTexture {
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
            error_listener: DeviceErrorListener::attach(&state.device),
            textures: [None, None],
            second_eye_size: SECOND_EYE_SIZE,
        }
    }

    /// True where a graphics processor draws.
    pub fn has_graphics(&self) -> bool {
        has_graphics(&self.state)
    }

    /// Name of the graphics processor, or of the software in its place.
    pub fn adapter(&self) -> String {
        self.state.adapter.get_info().name
    }

    /// Pixels of the second window from now on.
    pub fn set_second_eye_size(&mut self, size: [u32; 2]) {
        self.second_eye_size = size;
    }

    pub fn second_eye_size(&self) -> [u32; 2] {
        self.second_eye_size
    }

    /// The last image of the main window, if there is one.
    pub fn texture(&self) -> Option<egui::TextureId> {
        self.textures[EyeWindow::Main as usize].as_ref().map(|canvas| canvas.id)
    }

    /// The last image of the second window, if there is one.
    pub fn second_eye_texture(&self) -> Option<egui::TextureId> {
        self.textures[EyeWindow::SecondEye as usize].as_ref().map(|canvas| canvas.id)
    }

    /// Draws a scene at a size in pixels; gives the picture for egui to place.
    pub fn draw(
        &mut self,
        window: EyeWindow,
        scene: &RenderScene,
        viewpoint: &Viewpoint,
        stereo: Option<Stereo>,
        size: [u32; 2],
    ) -> Result<egui::TextureId, RenderError> {
        let known = self.textures[window as usize].take();
        let texture = match known {
            Some(canvas) if canvas.size == size => canvas,
            known => offscreen_texture(&self.state, size, known.map(|c| c.id)),
        };
        let drawn = self.renderer.draw(scene, viewpoint, stereo, RenderTarget { view: &texture.view, size });
        let id = texture.id;
        self.textures[window as usize] = Some(texture);
        drawn?;
        self.error_listener.check()?;
        Ok(id)
    }
}

/// A texture of a size, under the identity of the one it replaces.
fn offscreen_texture(state: &RenderState, size: [u32; 2], known: Option<egui::TextureId>) -> OffscreenTexture {
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
    OffscreenTexture { size, view, id }
}
