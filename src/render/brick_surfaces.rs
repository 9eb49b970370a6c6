//! Triangles of the tooth's surface, brick by brick, in one buffer that is drawn with one call.
//!
//! Each brick has a slot with a little spare capacity, and degenerate triangles fill the unused part of a slot. A
//! brick that outgrows its slot moves to a free one or to the end of the buffer.

use super::surface_mesh;
use super::vertex::Vertex;
use std::ops::Range;
use typodont_core::parallel::par_map;
use typodont_core::volume::{Volume, surface};

/// Slot sizes, in vertices and in triangles, are multiples of this, so that small cuts seldom move a brick.
const SLOT_GRANULARITY: usize = 24;

/// Spare capacity at the end of a buffer for bricks that outgrow their slots, as a share of the initial length. When
/// it is used up, the buffer doubles.
const SPARE_SHARE: f32 = 0.25;

/// Vertex and index buffers of the tooth's surface.
pub struct BrickSurfaces {
    vertices: GrowableBuffer,
    indices: GrowableBuffer,
    slots: Vec<Slot>,
    free: Vec<Slot>,
}

/// Ranges of a brick's vertices and triangles (three indices each) in the buffers.
#[derive(Clone, Default)]
struct Slot {
    vertices: Range<usize>,
    triangles: Range<usize>,
}

impl Slot {
    fn fits(&self, part: &BrickMesh) -> bool {
        part.vertices.len() <= self.vertices.len() && part.triangles.len() <= self.triangles.len()
    }
}

/// A tooth's volume, and what has its normals: the smoothed copy, or itself where the copy is coarser.
#[derive(Clone, Copy)]
pub struct DrawnTooth<'a> {
    pub volume: &'a Volume,
    pub smoothed: &'a Volume,
}

/// Surface of one brick.
struct BrickMesh {
    vertices: Vec<Vertex>,
    triangles: Vec<[u32; 3]>,
}

impl BrickMesh {
    fn extract(tooth: DrawnTooth, brick: usize) -> BrickMesh {
        let mesh = surface::extract_brick(tooth.volume, tooth.smoothed, brick);
        BrickMesh { vertices: surface_mesh::tooth_vertices(&mesh), triangles: mesh.triangles }
    }

    /// Returns the triangles with indices into the common vertex buffer, filled up with degenerate ones to the slot's
    /// length.
    fn indices_in(&self, slot: &Slot) -> Vec<[u32; 3]> {
        let first = slot.vertices.start as u32;
        let mut placed: Vec<[u32; 3]> = self.triangles.iter().map(|t| t.map(|i| first + i)).collect();
        placed.resize(slot.triangles.len(), [first; 3]);
        placed
    }
}

impl BrickSurfaces {
    /// Extracts and uploads the surfaces of all bricks of a volume.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue, tooth: DrawnTooth) -> BrickSurfaces {
        let parts = par_map(tooth.volume.bricks().len(), |brick| BrickMesh::extract(tooth, brick));
        let mut slots = Vec::with_capacity(parts.len());
        let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
        for part in &parts {
            let slot = slot_after(vertices.len(), triangles.len(), part);
            vertices.extend_from_slice(&part.vertices);
            vertices.resize(slot.vertices.end, Vertex::PADDING);
            triangles.extend(part.indices_in(&slot));
            slots.push(slot);
        }
        BrickSurfaces {
            vertices: GrowableBuffer::filled(device, queue, "corners", wgpu::BufferUsages::VERTEX, &vertices),
            indices: GrowableBuffer::filled(device, queue, "triangles", wgpu::BufferUsages::INDEX, &triangles),
            slots,
            free: Vec::new(),
        }
    }

    /// Extracts again all surfaces that changed bricks can affect. Returns their number.
    pub fn update(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        tooth: DrawnTooth,
        changed: &[usize],
    ) -> usize {
        if changed.is_empty() {
            return 0;
        }
        let affected = surface::dirty_neighbourhood(tooth.volume, changed);
        let parts = par_map(affected.len(), |i| BrickMesh::extract(tooth, affected[i]));
        for (&brick, part) in affected.iter().zip(&parts) {
            if !self.slots[brick].fits(part) {
                self.move_to_larger_slot(device, queue, brick, part);
            }
            let slot = &self.slots[brick];
            if slot.triangles.is_empty() {
                continue;
            }
            self.vertices.write(queue, slot.vertices.start, &part.vertices);
            self.indices.write(queue, slot.triangles.start, &part.indices_in(slot));
        }
        affected.len()
    }

    fn move_to_larger_slot(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, brick: usize, part: &BrickMesh) {
        let old_slot = std::mem::take(&mut self.slots[brick]);
        if !old_slot.triangles.is_empty() {
            let nothing = BrickMesh { vertices: Vec::new(), triangles: Vec::new() };
            self.indices.write(queue, old_slot.triangles.start, &nothing.indices_in(&old_slot));
            self.free.push(old_slot);
        }
        let slot = match self.free.iter().position(|slot| slot.fits(part)) {
            Some(found) => self.free.swap_remove(found),
            None => {
                let slot = slot_after(self.vertices.used, self.indices.used, part);
                self.vertices.reserve(device, queue, slot.vertices.end);
                self.indices.reserve(device, queue, slot.triangles.end);
                slot
            }
        };
        self.slots[brick] = slot;
    }

    /// Draws all surfaces with the pipeline and the bind groups that are set.
    pub fn draw(&self, pass: &mut wgpu::RenderPass) {
        if self.indices.used > 0 {
            pass.set_vertex_buffer(0, self.vertices.buffer.slice(..));
            pass.set_index_buffer(self.indices.buffer.slice(..), wgpu::IndexFormat::Uint32);
            pass.draw_indexed(0..3 * self.indices.used as u32, 0, 0..1);
        }
    }
}

fn slot_after(vertices: usize, triangles: usize, part: &BrickMesh) -> Slot {
    let roomy =
        |count: usize| if count == 0 { 0 } else { (count + SLOT_GRANULARITY / 4).next_multiple_of(SLOT_GRANULARITY) };
    Slot {
        vertices: vertices..vertices + roomy(part.vertices.len()),
        triangles: triangles..triangles + roomy(part.triangles.len()),
    }
}

/// A GPU buffer that at least doubles when it is full. Lengths are in items.
struct GrowableBuffer {
    buffer: wgpu::Buffer,
    label: &'static str,
    usage: wgpu::BufferUsages,
    item_size: usize,
    used: usize,
    capacity: usize,
}

impl GrowableBuffer {
    fn filled<T: bytemuck::Pod>(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        label: &'static str,
        usage: wgpu::BufferUsages,
        items: &[T],
    ) -> GrowableBuffer {
        let usage = usage | wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC;
        let capacity = items.len() + (items.len() as f32 * SPARE_SHARE) as usize + 64 * SLOT_GRANULARITY;
        let buffer = buffer(device, label, usage, capacity * size_of::<T>());
        queue.write_buffer(&buffer, 0, bytemuck::cast_slice(items));
        GrowableBuffer { buffer, label, usage, item_size: size_of::<T>(), used: items.len(), capacity }
    }

    fn write<T: bytemuck::Pod>(&self, queue: &wgpu::Queue, first: usize, items: &[T]) {
        queue.write_buffer(&self.buffer, (first * self.item_size) as u64, bytemuck::cast_slice(items));
    }

    fn reserve(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, used: usize) {
        if used > self.capacity {
            self.capacity = used.max(2 * self.capacity);
            let larger = buffer(device, self.label, self.usage, self.capacity * self.item_size);
            let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            encoder.copy_buffer_to_buffer(&self.buffer, 0, &larger, 0, Some((self.used * self.item_size) as u64));
            queue.submit([encoder.finish()]);
            self.buffer = larger;
        }
        self.used = self.used.max(used);
    }
}

fn buffer(device: &wgpu::Device, label: &str, usage: wgpu::BufferUsages, size: usize) -> wgpu::Buffer {
    let descriptor = wgpu::BufferDescriptor { label: Some(label), size: size as u64, usage, mapped_at_creation: false };
    device.create_buffer(&descriptor)
}
