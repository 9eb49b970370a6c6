//! Lighting of a surface. Twin of `view.wgsl`.

use super::CpuView;
use crate::scene::{Appearance, Rgb};
use typodont_core::frame::Vec3;

/// Light lost where a surface turns away from the eye.
const RIM: f32 = 0.25;
/// The share by which red gains and blue loses in shade.
const WARMTH: f32 = 0.12;
/// Share of the ambient light that comes from above.
const SKY: f32 = 0.25;

impl CpuView {
    /// Ray through a pixel, per mm of depth; world space.
    pub fn ray(&self, x: f32, y: f32) -> Vec3 {
        self.eye.ray(x / self.width as f32, y / self.height as f32)
    }

    /// Shaded colour of a surface at a point of world space with a unit normal; `open` is the share of light that
    /// reaches it.
    pub fn shade(&self, finish: Appearance, open: f32, point: Vec3, normal: Vec3) -> Rgb {
        let to_eye = (self.eye.position - point).normalize_or_zero();
        let away = 1.0 - normal.dot(to_eye).clamp(0.0, 1.0);
        let mut light = Vec3::splat(self.lights.ambient * (1.0 - SKY + SKY * normal.y));
        let mut shine = Vec3::ZERO;
        for lamp in [&self.lights.chair, &self.lights.head] {
            let colour = Vec3::from(lamp.colour) * lamp.strength;
            let to_lamp = (lamp.position - point).normalize_or_zero();
            light += colour * ((normal.dot(to_lamp) + lamp.wrap) / (1.0 + lamp.wrap)).max(0.0);
            let halfway = (to_lamp + to_eye).normalize_or_zero();
            shine += colour * pow32(normal.dot(halfway).max(0.0));
        }
        light *= open * (1.0 - RIM * away * away);
        let warm = light + Vec3::new(WARMTH, 0.0, -WARMTH) * (Vec3::ONE - light).max(Vec3::ZERO) * light;
        let colour = Vec3::from(finish.colour);
        let linear = colour * colour * warm + shine * (finish.gloss * open);
        linear.clamp(Vec3::ZERO, Vec3::ONE).to_array().map(f32::sqrt)
    }
}

/// To the power of 32, a highlight as wide as on wet enamel.
fn pow32(x: f32) -> f32 {
    let x2 = x * x;
    let x4 = x2 * x2;
    let x8 = x4 * x4;
    let x16 = x8 * x8;
    x16 * x16
}
