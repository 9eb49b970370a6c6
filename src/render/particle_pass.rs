//! Particles, which are dust and water: balls and discs, with a ray through each pixel.

use super::passes::{self, DepthMode, Detail, DrawnFaces, PipelineDesc};
use super::scene::Particle;
use std::ops::Range;
use typodont_core::frame::Vec3;

/// Structs of `particle_pass.wgsl`; keep in step.
pub mod gpu {
    use bytemuck::{Pod, Zeroable};

    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub struct ParticleInstance {
        pub place: [f32; 4],
        pub colour: [f32; 4],
        pub facing: [f32; 4],
    }
}

pub const SOURCE: &str = include_str!("../../shaders/particle_pass.wgsl");

/// Vertices of the two triangles around each particle.
const CORNERS: Range<u32> = 0..6;

/// Number of particles that the first buffer can hold. It grows to the next power of two when there are more.
const INITIAL_CAPACITY: usize = 1024;

pub struct ParticlePass {
    opaque: wgpu::RenderPipeline,
    translucent: wgpu::RenderPipeline,
    /// Opaque particles, then translucent ones.
    buffer: wgpu::Buffer,
    capacity: usize,
    instances: Vec<gpu::ParticleInstance>,
    /// Number of opaque particles.
    opaque_count: u32,
}

impl ParticlePass {
    pub fn new(
        device: &wgpu::Device,
        format: wgpu::TextureFormat,
        view: &wgpu::BindGroupLayout,
        detail: Detail,
    ) -> ParticlePass {
        let module = passes::shader_module(device, "particle_pass", &passes::full_source(SOURCE));
        let attributes = wgpu::vertex_attr_array![0 => Float32x4, 1 => Float32x4, 2 => Float32x4];
        let corners = [Some(wgpu::VertexBufferLayout {
            array_stride: size_of::<gpu::ParticleInstance>() as u64,
            step_mode: wgpu::VertexStepMode::Instance,
            attributes: &attributes,
        })];
        let pass = |label, fragment, depth, blend| {
            let (module, vertex, faces) = (&module, "speck_vertex", DrawnFaces::Front);
            let (groups, corners) = (&[Some(view)], &corners);
            PipelineDesc {
                label,
                module,
                vertex,
                fragment: Some(fragment),
                groups,
                vertex_buffers: corners,
                faces,
                depth,
                format: Some(format),
                blend,
                detail,
            }
            .build(device)
        };
        let clear = Some(wgpu::BlendState::PREMULTIPLIED_ALPHA_BLENDING);
        ParticlePass {
            opaque: pass("grains", "grain_fragment", DepthMode::ReadWrite, None),
            translucent: pass("drops", "drop_fragment", DepthMode::ReadOnly, clear),
            buffer: buffer(device, INITIAL_CAPACITY),
            capacity: INITIAL_CAPACITY,
            instances: Vec::new(),
            opaque_count: 0,
        }
    }

    /// Uploads a scene's particles.
    pub fn prepare(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        opaque: &[Particle],
        translucent: &[Particle],
    ) {
        self.instances.clear();
        self.instances.extend(opaque.iter().chain(translucent).map(encode));
        self.opaque_count = opaque.len() as u32;
        if self.instances.len() > self.capacity {
            self.capacity = self.instances.len().next_power_of_two();
            self.buffer = buffer(device, self.capacity);
        }
        if !self.instances.is_empty() {
            queue.write_buffer(&self.buffer, 0, bytemuck::cast_slice(&self.instances));
        }
    }

    /// Draws the opaque particles; the view's bind group must be set.
    pub fn draw_opaque(&self, pass: &mut wgpu::RenderPass) {
        self.draw(pass, &self.opaque, 0..self.opaque_count);
    }

    /// Draws the translucent particles over everything opaque; the view's bind group must be set.
    pub fn draw_translucent(&self, pass: &mut wgpu::RenderPass) {
        self.draw(pass, &self.translucent, self.opaque_count..self.instances.len() as u32);
    }

    fn draw(&self, pass: &mut wgpu::RenderPass, pipeline: &wgpu::RenderPipeline, particles: Range<u32>) {
        if !particles.is_empty() {
            pass.set_pipeline(pipeline);
            pass.set_vertex_buffer(0, self.buffer.slice(..));
            pass.draw(CORNERS, particles);
        }
    }
}

fn encode(particle: &Particle) -> gpu::ParticleInstance {
    let Particle { position, radius, facing, appearance, opacity } = *particle;
    let [r, g, b] = appearance.colour;
    gpu::ParticleInstance {
        place: position.extend(radius).to_array(),
        colour: [r, g, b, opacity],
        facing: facing.unwrap_or(Vec3::ZERO).extend(appearance.gloss).to_array(),
    }
}

fn buffer(device: &wgpu::Device, capacity: usize) -> wgpu::Buffer {
    device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("particles"),
        size: (capacity * size_of::<gpu::ParticleInstance>()) as u64,
        usage: wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}
