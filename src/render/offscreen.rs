//! Rendering without a window: on a GPU, or on the CPU where there is none.

use super::camera::Viewpoint;
use super::cpu::{self, CpuRenderer};
use super::error::RenderError;
use super::scene::RenderScene;
use super::stereo::Stereo;
use super::validate;
#[cfg(feature = "gpu")]
use super::{gpu::Gpu, gpu_offscreen::GpuOffscreenRenderer};
use typodont_core::image::RgbaImage;

/// Renders scenes into images. Keeps the data of a volume from image to image.
pub enum OffscreenRenderer {
    #[cfg(feature = "gpu")]
    Gpu(Box<GpuOffscreenRenderer>),
    Cpu(Box<CpuRenderer>),
}

/// Maximum width and height of an image on the CPU, pixels. The CPU has no limit of its own; a larger image is a
/// mistake.
const MAX_CPU_SIZE: u32 = 16384;

impl OffscreenRenderer {
    /// Creates a renderer on the best available adapter.
    ///
    /// # Errors
    /// Fails if there is no adapter, or if opening a device on it fails.
    #[cfg(feature = "gpu")]
    pub fn gpu() -> Result<OffscreenRenderer, RenderError> {
        OffscreenRenderer::with_gpu(Gpu::open()?)
    }

    /// Creates a renderer on a given device.
    ///
    /// # Errors
    /// Fails if the device was lost or rejects a pipeline.
    #[cfg(feature = "gpu")]
    pub fn with_gpu(gpu: Gpu) -> Result<OffscreenRenderer, RenderError> {
        Ok(OffscreenRenderer::Gpu(Box::new(GpuOffscreenRenderer::new(gpu)?)))
    }

    /// Creates a renderer on the CPU.
    pub fn cpu() -> OffscreenRenderer {
        OffscreenRenderer::Cpu(Box::default())
    }

    /// Creates a renderer on a GPU, or else on the CPU together with the reason.
    pub fn gpu_or_cpu() -> (OffscreenRenderer, Option<RenderError>) {
        #[cfg(feature = "gpu")]
        let gpu = OffscreenRenderer::gpu();
        #[cfg(not(feature = "gpu"))]
        let gpu = Err(RenderError::Missing { what: "support in this build of the program (feature `desktop`)".into() });
        match gpu {
            Ok(renderer) => (renderer, None),
            Err(error) => (OffscreenRenderer::cpu(), Some(error)),
        }
    }

    /// Name of the adapter, or `cpu`.
    pub fn adapter(&self) -> &str {
        match self {
            #[cfg(feature = "gpu")]
            OffscreenRenderer::Gpu(renderer) => renderer.adapter(),
            OffscreenRenderer::Cpu(_) => "cpu",
        }
    }

    /// Renders an image of a scene; `size` is width and height in pixels.
    ///
    /// # Errors
    /// Fails if the scene, the viewpoint or the size is invalid, or if the device fails. After [`RenderError::Lost`]
    /// this renderer cannot be used any more: create another.
    pub fn draw(
        &mut self,
        scene: &RenderScene,
        viewpoint: &Viewpoint,
        stereo: Option<Stereo>,
        size: [u32; 2],
    ) -> Result<RgbaImage, RenderError> {
        match self {
            #[cfg(feature = "gpu")]
            OffscreenRenderer::Gpu(renderer) => {
                renderer.paint(scene, viewpoint, stereo, size)?;
                renderer.read()
            }
            OffscreenRenderer::Cpu(cpu) => {
                validate(scene, viewpoint, stereo, size, MAX_CPU_SIZE)?;
                cpu.prepare(scene);
                Ok(draw_on_cpu(cpu, scene, viewpoint, stereo, size))
            }
        }
    }

    /// Renders without reading the image back, at the cost of a frame in a window.
    ///
    /// # Errors
    /// As for [`OffscreenRenderer::draw`].
    pub fn draw_only(
        &mut self,
        scene: &RenderScene,
        viewpoint: &Viewpoint,
        stereo: Option<Stereo>,
        size: [u32; 2],
    ) -> Result<(), RenderError> {
        match self {
            #[cfg(feature = "gpu")]
            OffscreenRenderer::Gpu(renderer) => renderer.paint(scene, viewpoint, stereo, size).map(|_| ()),
            OffscreenRenderer::Cpu(_) => self.draw(scene, viewpoint, stereo, size).map(|_| ()),
        }
    }
}

fn draw_on_cpu(
    cpu: &CpuRenderer,
    scene: &RenderScene,
    viewpoint: &Viewpoint,
    stereo: Option<Stereo>,
    size: [u32; 2],
) -> RgbaImage {
    let aspect = size[0] as f32 / size[1] as f32;
    let Some(stereo) = stereo else { return cpu.draw(scene, &viewpoint.eye(aspect), size) };
    let own = stereo.layout.eye_size(size);
    let eyes = stereo.eyes(viewpoint, aspect);
    let [left, right] = [0, 1].map(|side: usize| match stereo.layout.visible_eyes()[side] {
        true => cpu.draw(scene, &eyes[side], own),
        false => RgbaImage { width: 0, height: 0, rgba: Vec::new() },
    });
    cpu::stereo_pass([&left, &right], stereo.layout, size)
}
