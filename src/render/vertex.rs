//! Memory layout of one vertex, for the shader and for its CPU twin.

use super::scene::{Rgb, VertexTint};
use typodont_core::frame::Vec3;

/// Vertex layout that matches `surface_pass.wgsl`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "gpu", derive(bytemuck::Pod, bytemuck::Zeroable))]
#[repr(C)]
pub struct Vertex {
    /// mm, in the solid's own space.
    position: [f32; 3],
    /// Unit normal and gloss, each scaled by 32767.
    normal: [i16; 4],
    /// Colour and stippling, each scaled by 255.
    colour: [u8; 4],
}

const _: () = assert!(size_of::<Vertex>() == 24);

impl Vertex {
    /// Filler for gaps in a buffer; no triangle uses it.
    #[cfg(feature = "gpu")]
    pub const PADDING: Vertex = Vertex { position: [0.0; 3], normal: [0; 4], colour: [0; 4] };

    #[cfg(feature = "gpu")]
    pub fn layout() -> wgpu::VertexBufferLayout<'static> {
        const ATTRIBUTES: [wgpu::VertexAttribute; 3] =
            wgpu::vertex_attr_array![0 => Float32x3, 1 => Snorm16x4, 2 => Unorm8x4];
        wgpu::VertexBufferLayout {
            array_stride: size_of::<Vertex>() as u64,
            step_mode: wgpu::VertexStepMode::Vertex,
            attributes: &ATTRIBUTES,
        }
    }

    /// A vertex with full gloss.
    pub fn new(position: Vec3, normal: Vec3, tint: VertexTint) -> Vertex {
        let short = |v: f32| (v.clamp(-1.0, 1.0) * 32767.0).round() as i16;
        let byte = |v: f32| (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
        let [r, g, b] = tint.colour.map(byte);
        Vertex {
            position: position.to_array(),
            normal: [short(normal.x), short(normal.y), short(normal.z), i16::MAX],
            colour: [r, g, b, byte(tint.stippling)],
        }
    }

    pub fn position(&self) -> Vec3 {
        Vec3::from(self.position)
    }

    pub fn normal(&self) -> Vec3 {
        let [x, y, z, _] = self.normal.map(|v| f32::from(v) / 32767.0);
        Vec3::new(x, y, z)
    }

    pub fn gloss(&self) -> f32 {
        f32::from(self.normal[3]) / 32767.0
    }

    pub fn stippling(&self) -> f32 {
        f32::from(self.colour[3]) / 255.0
    }

    pub fn colour(&self) -> Rgb {
        let [r, g, b, _] = self.colour.map(|v| f32::from(v) / 255.0);
        [r, g, b]
    }
}
