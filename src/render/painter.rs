//! One door to pictures without a window: on an adapter, or by the processor where there is none.

use super::camera::Viewpoint;
use super::gpu::{Error, Gpu};
use super::picture::Image;
use super::renderer::{Renderer, Target};
use super::scene::Scene;
use super::stereo::Stereo;
use super::tooth::Uploads;
use super::twin::{self, Twin};
use super::{resources, sound};

/// Paints scenes; keeps what it knows of a volume from picture to picture.
pub enum Painter {
    Gpu(Box<GpuPainter>),
    Cpu(Box<Twin>),
}

pub struct GpuPainter {
    gpu: Gpu,
    renderer: Renderer,
    canvas: Option<Canvas>,
}

/// A target that can be read back.
struct Canvas {
    size: [u32; 2],
    texture: wgpu::Texture,
    view: wgpu::TextureView,
    buffer: wgpu::Buffer,
}

const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

/// The processor has no limit of its own; beyond this a picture is a mistake.
const LARGEST: u32 = 16384;

impl Painter {
    /// On the best adapter there is.
    pub fn gpu() -> Result<Painter, Error> {
        Painter::on(Gpu::open()?)
    }

    /// On a device of the caller's choice.
    pub fn on(gpu: Gpu) -> Result<Painter, Error> {
        let renderer = Renderer::new(&gpu.device, &gpu.queue, FORMAT);
        gpu.watch.check()?;
        Ok(Painter::Gpu(Box::new(GpuPainter { gpu, renderer, canvas: None })))
    }

    /// By the processor.
    pub fn cpu() -> Painter {
        Painter::Cpu(Box::default())
    }

    /// On an adapter, or else by the processor, with the reason why.
    pub fn best() -> (Painter, Option<Error>) {
        match Painter::gpu() {
            Ok(painter) => (painter, None),
            Err(error) => (Painter::cpu(), Some(error)),
        }
    }

    /// What draws: the adapter's name, or `cpu`.
    pub fn adapter(&self) -> &str {
        match self {
            Painter::Gpu(painter) => &painter.gpu.name,
            Painter::Cpu(_) => "cpu",
        }
    }

    /// A picture of a scene; `size` is width and height in pixels.
    ///
    /// After [`Error::Lost`] this painter is of no more use: make another.
    pub fn draw(
        &mut self,
        scene: &Scene,
        viewpoint: &Viewpoint,
        stereo: Option<Stereo>,
        size: [u32; 2],
    ) -> Result<Image, Error> {
        match self {
            Painter::Gpu(painter) => {
                painter.paint(scene, viewpoint, stereo, size)?;
                painter.read()
            }
            Painter::Cpu(twin) => {
                sound(scene, viewpoint, stereo, size, LARGEST)?;
                twin.prepare(scene);
                Ok(draw_with(twin, scene, viewpoint, stereo, size))
            }
        }
    }

    /// The same without handing the picture over: what a window's frame costs.
    pub fn draw_only(
        &mut self,
        scene: &Scene,
        viewpoint: &Viewpoint,
        stereo: Option<Stereo>,
        size: [u32; 2],
    ) -> Result<(), Error> {
        match self {
            Painter::Gpu(painter) => painter.paint(scene, viewpoint, stereo, size).map(|_| ()),
            Painter::Cpu(_) => self.draw(scene, viewpoint, stereo, size).map(|_| ()),
        }
    }
}

fn draw_with(twin: &Twin, scene: &Scene, viewpoint: &Viewpoint, stereo: Option<Stereo>, size: [u32; 2]) -> Image {
    let ratio = size[0] as f32 / size[1] as f32;
    let Some(stereo) = stereo else { return twin.draw(scene, &viewpoint.eye(ratio), size) };
    let own = stereo.layout.eye_size(size);
    let eyes = stereo.eyes(viewpoint, ratio);
    let [left, right] = [0, 1].map(|side: usize| match stereo.layout.needs()[side] {
        true => twin.draw(scene, &eyes[side], own),
        false => Image { width: 0, height: 0, rgba: Vec::new() },
    });
    twin::stereo_pass([&left, &right], stereo.layout, size)
}

impl GpuPainter {
    /// Draws and waits until it is done, without reading the picture back.
    pub fn paint(
        &mut self,
        scene: &Scene,
        viewpoint: &Viewpoint,
        stereo: Option<Stereo>,
        size: [u32; 2],
    ) -> Result<Uploads, Error> {
        self.gpu.watch.check()?;
        sound(scene, viewpoint, stereo, size, self.gpu.device.limits().max_texture_dimension_2d)?;
        if self.canvas.as_ref().is_none_or(|canvas| canvas.size != size) {
            self.canvas = Some(Canvas::new(&self.gpu.device, size));
        }
        let Some(canvas) = &self.canvas else { return Ok(Uploads::default()) };
        let target = Target { view: &canvas.view, size };
        let uploads = self.renderer.draw(scene, viewpoint, stereo, target)?;
        self.wait()?;
        Ok(uploads)
    }

    fn wait(&self) -> Result<(), Error> {
        let polled = self.gpu.device.poll(wgpu::PollType::Wait { submission_index: None, timeout: None });
        self.gpu.watch.check()?;
        polled.map(|_| ()).map_err(|e| Error::Refused { why: e.to_string() })
    }

    /// The last painted picture.
    fn read(&self) -> Result<Image, Error> {
        let Some(canvas) = &self.canvas else { return Err(Error::Impossible { why: "nothing was painted".into() }) };
        let [width, height] = canvas.size;
        let mut encoder = self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let layout =
            wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(padded(width)), rows_per_image: None };
        encoder.copy_texture_to_buffer(
            canvas.texture.as_image_copy(),
            wgpu::TexelCopyBufferInfo { buffer: &canvas.buffer, layout },
            wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        );
        self.gpu.queue.submit([encoder.finish()]);
        canvas.buffer.map_async(wgpu::MapMode::Read, .., |_| ());
        self.wait()?;
        let mapped = canvas.buffer.get_mapped_range(..).map_err(|e| Error::Refused { why: e.to_string() })?;
        let rows = mapped.chunks(padded(width) as usize).take(height as usize);
        let rgba = rows.flat_map(|row| &row[..4 * width as usize]).copied().collect();
        drop(mapped);
        canvas.buffer.unmap();
        Ok(Image { width, height, rgba })
    }
}

/// Bytes of a row as adapters copy it.
fn padded(width: u32) -> u32 {
    (4 * width).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT)
}

impl Canvas {
    fn new(device: &wgpu::Device, size: [u32; 2]) -> Canvas {
        let texture = resources::target_texture(device, "picture", size, FORMAT);
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        let buffer = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("picture"),
            size: u64::from(padded(size[0])) * u64::from(size[1]),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        Canvas { size, texture, view, buffer }
    }
}
