//! The tooth's triangles, brick by brick, in one buffer that one call draws.
//!
//! Each brick has a slot with a little room to grow. What a slot does not fill is triangles without area. A brick that
//! outgrows its slot takes a free one or the next at the end.

use super::scene::Palette;
use super::surface_mesh;
use super::vertex::Vertex;
use crate::volume::rows::each;
use crate::volume::{Volume, surface};
use std::ops::Range;

/// Slots are this many corners and triangles long, or a multiple: small cuts then seldom move a brick.
const GRAIN: usize = 24;

/// Room at the end for bricks that outgrow their slots, as a share of all: after that the buffers double.
const SPARE: f32 = 0.25;

pub struct BrickSurfaces {
    vertices: Grown,
    indices: Grown,
    slots: Vec<Slot>,
    free: Vec<Slot>,
    palette: Palette,
}

/// Where a brick's corners and triangles (three indices each) lie.
#[derive(Clone, Default)]
struct Slot {
    vertices: Range<usize>,
    triangles: Range<usize>,
}

impl Slot {
    fn holds(&self, part: &Part) -> bool {
        part.vertices.len() <= self.vertices.len() && part.triangles.len() <= self.triangles.len()
    }
}

/// One brick's surface.
struct Part {
    vertices: Vec<Vertex>,
    triangles: Vec<[u32; 3]>,
}

impl Part {
    fn of(volume: &Volume, palette: &Palette, brick: usize) -> Part {
        let mesh = surface::brick(volume, brick);
        Part { vertices: surface_mesh::of_tooth(volume, palette, &mesh), triangles: mesh.triangles }
    }

    /// Its triangles among all corners, filled up with some that have no area.
    fn placed(&self, slot: &Slot) -> Vec<[u32; 3]> {
        let first = slot.vertices.start as u32;
        let mut placed: Vec<[u32; 3]> = self.triangles.iter().map(|t| t.map(|i| first + i)).collect();
        placed.resize(slot.triangles.len(), [first; 3]);
        placed
    }
}

impl BrickSurfaces {
    /// Every brick of a volume.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue, volume: &Volume, palette: &Palette) -> BrickSurfaces {
        let parts = each(volume.bricks().len(), |brick| Part::of(volume, palette, brick));
        let mut slots = Vec::with_capacity(parts.len());
        let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
        for part in &parts {
            let slot = slot_after(vertices.len(), triangles.len(), part);
            vertices.extend_from_slice(&part.vertices);
            vertices.resize(slot.vertices.end, Vertex::NOWHERE);
            triangles.extend(part.placed(&slot));
            slots.push(slot);
        }
        BrickSurfaces {
            vertices: Grown::filled(device, queue, "corners", wgpu::BufferUsages::VERTEX, &vertices),
            indices: Grown::filled(device, queue, "triangles", wgpu::BufferUsages::INDEX, &triangles),
            slots,
            free: Vec::new(),
            palette: palette.clone(),
        }
    }

    /// True when the corners have these colours.
    pub fn has(&self, palette: &Palette) -> bool {
        self.palette == *palette
    }

    /// Makes the surfaces anew that changed bricks can have changed; gives their number.
    pub fn update(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, volume: &Volume, changed: &[usize]) -> usize {
        let affected = surface::affected(volume, changed);
        for &brick in &affected {
            let part = Part::of(volume, &self.palette, brick);
            if !self.slots[brick].holds(&part) {
                self.move_to_larger_slot(device, queue, brick, &part);
            }
            let slot = &self.slots[brick];
            if slot.triangles.is_empty() {
                continue;
            }
            self.vertices.write(queue, slot.vertices.start, &part.vertices);
            self.indices.write(queue, slot.triangles.start, &part.placed(slot));
        }
        affected.len()
    }

    fn move_to_larger_slot(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, brick: usize, part: &Part) {
        let left = std::mem::take(&mut self.slots[brick]);
        if !left.triangles.is_empty() {
            let nothing = Part { vertices: Vec::new(), triangles: Vec::new() };
            self.indices.write(queue, left.triangles.start, &nothing.placed(&left));
            self.free.push(left);
        }
        let slot = match self.free.iter().position(|slot| slot.holds(part)) {
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

    /// Draws all of it, with the pipeline and groups that are set.
    pub fn draw(&self, pass: &mut wgpu::RenderPass) {
        if self.indices.used > 0 {
            pass.set_vertex_buffer(0, self.vertices.buffer.slice(..));
            pass.set_index_buffer(self.indices.buffer.slice(..), wgpu::IndexFormat::Uint32);
            pass.draw_indexed(0..3 * self.indices.used as u32, 0, 0..1);
        }
    }
}

fn slot_after(vertices: usize, triangles: usize, part: &Part) -> Slot {
    let roomy = |count: usize| if count == 0 { 0 } else { (count + GRAIN / 4).next_multiple_of(GRAIN) };
    Slot {
        vertices: vertices..vertices + roomy(part.vertices.len()),
        triangles: triangles..triangles + roomy(part.triangles.len()),
    }
}

/// A buffer that doubles when it is full. Lengths are in items.
struct Grown {
    buffer: wgpu::Buffer,
    label: &'static str,
    usage: wgpu::BufferUsages,
    item: usize,
    used: usize,
    room: usize,
}

impl Grown {
    fn filled<T: bytemuck::Pod>(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        label: &'static str,
        usage: wgpu::BufferUsages,
        items: &[T],
    ) -> Grown {
        let usage = usage | wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC;
        let room = items.len() + (items.len() as f32 * SPARE) as usize + 64 * GRAIN;
        let buffer = buffer(device, label, usage, room * size_of::<T>());
        queue.write_buffer(&buffer, 0, bytemuck::cast_slice(items));
        Grown { buffer, label, usage, item: size_of::<T>(), used: items.len(), room }
    }

    fn write<T: bytemuck::Pod>(&self, queue: &wgpu::Queue, first: usize, items: &[T]) {
        queue.write_buffer(&self.buffer, (first * self.item) as u64, bytemuck::cast_slice(items));
    }

    fn reserve(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, used: usize) {
        if used > self.room {
            self.room = used.max(2 * self.room);
            let larger = buffer(device, self.label, self.usage, self.room * self.item);
            let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            encoder.copy_buffer_to_buffer(&self.buffer, 0, &larger, 0, Some((self.used * self.item) as u64));
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
