//! Small things in great number, dust and water: balls and discs, met by a ray through each pixel.

use super::passes::{self, Depth, Faces, Pass};
use super::scene::Speck;
use crate::frame::Vec3;
use std::ops::Range;

/// In step with `speck_pass.wgsl`.
pub mod gpu {
    use bytemuck::{Pod, Zeroable};

    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub struct Speck {
        pub place: [f32; 4],
        pub colour: [f32; 4],
        pub facing: [f32; 4],
    }
}

pub const SOURCE: &str = include_str!("../../shaders/speck_pass.wgsl");

/// Corners of the two triangles around each speck.
const CORNERS: Range<u32> = 0..6;

/// Specks that the first buffer has room for; it doubles when they are more.
const ROOM: usize = 1024;

pub struct SpeckPass {
    grains: wgpu::RenderPipeline,
    drops: wgpu::RenderPipeline,
    /// Grains, then drops.
    buffer: wgpu::Buffer,
    room: usize,
    written: Vec<gpu::Speck>,
    /// How many of them are grains.
    count_of_grains: u32,
}

impl SpeckPass {
    pub fn new(device: &wgpu::Device, format: wgpu::TextureFormat, view: &wgpu::BindGroupLayout) -> SpeckPass {
        let module = passes::module(device, "speck_pass", &passes::source(SOURCE));
        let attributes = wgpu::vertex_attr_array![0 => Float32x4, 1 => Float32x4, 2 => Float32x4];
        let corners = [Some(wgpu::VertexBufferLayout {
            array_stride: size_of::<gpu::Speck>() as u64,
            step_mode: wgpu::VertexStepMode::Instance,
            attributes: &attributes,
        })];
        let pass = |label, fragment, depth, blend| {
            let (module, vertex, faces) = (&module, "speck_vertex", Faces::Near);
            let (groups, corners) = (&[Some(view)], &corners);
            Pass { label, module, vertex, fragment, groups, corners, faces, depth, format, blend }.pipeline(device)
        };
        let clear = Some(wgpu::BlendState::PREMULTIPLIED_ALPHA_BLENDING);
        SpeckPass {
            grains: pass("grains", "grain_fragment", Depth::Nearest, None),
            drops: pass("drops", "drop_fragment", Depth::Compared, clear),
            buffer: buffer(device, ROOM),
            room: ROOM,
            written: Vec::new(),
            count_of_grains: 0,
        }
    }

    /// Brings a scene's specks to the adapter.
    pub fn prepare(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, grains: &[Speck], drops: &[Speck]) {
        self.written.clear();
        self.written.extend(grains.iter().chain(drops).map(written));
        self.count_of_grains = grains.len() as u32;
        if self.written.len() > self.room {
            self.room = self.written.len().next_power_of_two();
            self.buffer = buffer(device, self.room);
        }
        if !self.written.is_empty() {
            queue.write_buffer(&self.buffer, 0, bytemuck::cast_slice(&self.written));
        }
    }

    /// Draws what covers all behind it; the view's group is set.
    pub fn draw_grains(&self, pass: &mut wgpu::RenderPass) {
        self.draw(pass, &self.grains, 0..self.count_of_grains);
    }

    /// Draws what lets light through, over all that is opaque; the view's group is set.
    pub fn draw_drops(&self, pass: &mut wgpu::RenderPass) {
        self.draw(pass, &self.drops, self.count_of_grains..self.written.len() as u32);
    }

    fn draw(&self, pass: &mut wgpu::RenderPass, pipeline: &wgpu::RenderPipeline, specks: Range<u32>) {
        if !specks.is_empty() {
            pass.set_pipeline(pipeline);
            pass.set_vertex_buffer(0, self.buffer.slice(..));
            pass.draw(CORNERS, specks);
        }
    }
}

fn written(speck: &Speck) -> gpu::Speck {
    let Speck { place, radius, facing, finish, opacity } = *speck;
    let [r, g, b] = finish.colour;
    gpu::Speck {
        place: place.extend(radius).to_array(),
        colour: [r, g, b, opacity],
        facing: facing.unwrap_or(Vec3::ZERO).extend(finish.gloss).to_array(),
    }
}

fn buffer(device: &wgpu::Device, room: usize) -> wgpu::Buffer {
    device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("specks"),
        size: (room * size_of::<gpu::Speck>()) as u64,
        usage: wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}
