//! Rendering on a GPU without a window, with images read back.

use super::camera::Viewpoint;
use super::error::RenderError;
use super::gpu::Gpu;
use super::renderer::{RenderTarget, Renderer};
use super::scene::RenderScene;
use super::stereo::Stereo;
use super::tooth::Uploads;
use super::{resources, validate};
use typodont_core::image::RgbaImage;

/// A renderer on a GPU.
pub struct GpuOffscreenRenderer {
    gpu: Gpu,
    renderer: Renderer,
    target: Option<ReadbackTarget>,
}

/// A render target that can be read back.
struct ReadbackTarget {
    size: [u32; 2],
    texture: wgpu::Texture,
    view: wgpu::TextureView,
    buffer: wgpu::Buffer,
}

const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

impl GpuOffscreenRenderer {
    /// Creates a renderer on a given device.
    ///
    /// # Errors
    /// Fails if the device was lost or rejects a pipeline.
    pub fn new(gpu: Gpu) -> Result<GpuOffscreenRenderer, RenderError> {
        let renderer = Renderer::new(&gpu.device, &gpu.queue, FORMAT);
        gpu.error_listener.check()?;
        Ok(GpuOffscreenRenderer { gpu, renderer, target: None })
    }

    /// Name of the adapter.
    pub fn adapter(&self) -> &str {
        &self.gpu.name
    }

    /// Renders and waits for completion, without reading the image back.
    ///
    /// # Errors
    /// Fails if the scene, the viewpoint or the size is invalid, or if the device fails.
    pub fn paint(
        &mut self,
        scene: &RenderScene,
        viewpoint: &Viewpoint,
        stereo: Option<Stereo>,
        size: [u32; 2],
    ) -> Result<Uploads, RenderError> {
        self.gpu.error_listener.check()?;
        validate(scene, viewpoint, stereo, size, self.gpu.device.limits().max_texture_dimension_2d)?;
        if self.target.as_ref().is_none_or(|target| target.size != size) {
            self.target = Some(ReadbackTarget::new(&self.gpu.device, size));
        }
        let Some(readback) = &self.target else { return Ok(Uploads::default()) };
        let target = RenderTarget { view: &readback.view, size };
        let uploads = self.renderer.draw(scene, viewpoint, stereo, target)?;
        self.wait()?;
        Ok(uploads)
    }

    fn wait(&self) -> Result<(), RenderError> {
        let polled = self.gpu.device.poll(wgpu::PollType::Wait { submission_index: None, timeout: None });
        self.gpu.error_listener.check()?;
        polled.map(|_| ()).map_err(|e| RenderError::Refused { why: e.to_string() })
    }

    /// Reads back the last rendered image.
    pub(super) fn read(&self) -> Result<RgbaImage, RenderError> {
        let Some(readback) = &self.target else {
            return Err(RenderError::Impossible { why: "no image was rendered yet".into() });
        };
        let [width, height] = readback.size;
        let mut encoder = self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let layout =
            wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(padded(width)), rows_per_image: None };
        encoder.copy_texture_to_buffer(
            readback.texture.as_image_copy(),
            wgpu::TexelCopyBufferInfo { buffer: &readback.buffer, layout },
            wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        );
        self.gpu.queue.submit([encoder.finish()]);
        readback.buffer.map_async(wgpu::MapMode::Read, .., |_| ());
        self.wait()?;
        let mapped = readback.buffer.get_mapped_range(..).map_err(|e| RenderError::Refused { why: e.to_string() })?;
        let rows = mapped.chunks(padded(width) as usize).take(height as usize);
        let rgba = rows.flat_map(|row| &row[..4 * width as usize]).copied().collect();
        drop(mapped);
        readback.buffer.unmap();
        Ok(RgbaImage { width, height, rgba })
    }
}

/// Returns the bytes of a row, padded as copies from a texture require.
fn padded(width: u32) -> u32 {
    (4 * width).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT)
}

impl ReadbackTarget {
    fn new(device: &wgpu::Device, size: [u32; 2]) -> ReadbackTarget {
        let texture = resources::target_texture(device, "picture", size, FORMAT);
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        let buffer = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("picture"),
            size: u64::from(padded(size[0])) * u64::from(size[1]),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        ReadbackTarget { size, texture, view, buffer }
    }
}
