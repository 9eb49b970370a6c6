//! The depths that the chair lamp sees, and the share of the lamp that a surface sees. Twin of `view.wgsl` and of the depths in
//! `surface_pass.wgsl` and `iso_pass.wgsl`.

use super::texture_reads::{Texture, TextureReads};
use super::volume_sampler::VolumeSampler;
use super::{CachedVolume, CpuView, Framebuffer, iso_pass, surface_pass};
use crate::eye::Eye;
use crate::scene::{Background, RenderMode, RenderScene};
use crate::shadow;
use std::sync::Arc;
use typodont_core::frame::{Vec2, Vec3, smooth_step};

/// Places at which a shadow is looked for, and at which its edge is measured.
const SEARCHES: usize = 12;
const TAPS: usize = 24;
/// Gap between caster and receiver, mm, beyond which shadows get no softer.
const GAP: f32 = 10.0;
/// Distance, in texels of the map, by which a receiver is moved out along its normal, so that neither a rounded depth nor a
/// seam of two surfaces shades it.
const LIFT: f32 = 5.0;
/// Steepest surface, as seen by the lamp, whose slope is followed between the places: a tangent.
const SLOPE: f32 = 8.0;
/// Places at which shadows fade toward the map's border, from its middle (0) to there (1).
const FADE: [f32; 2] = [0.8, 0.95];

/// Depths that the lamp sees.
pub struct LampDepths {
    eye: Eye,
    /// Radius of the lamp's luminous area, mm.
    radius: f32,
    /// Values of the depth buffer, row by row.
    depths: Vec<f32>,
    reads: Arc<TextureReads>,
}

/// A receiver of the lamp's light, as the lamp sees it.
struct ShadowReceiver {
    /// Place in the map, from 0 to 1, and depth, mm.
    at: Vec2,
    depth: f32,
    /// Change of the surface's depth per mm to the right and upward.
    slope: Vec2,
    /// Change of the place in the map per mm to the right and upward.
    scale: Vec2,
}

impl ShadowReceiver {
    /// Depth of the surface's plane at an offset in mm.
    fn plane_depth(&self, offset: Vec2) -> f32 {
        self.depth / (1.0 - self.slope.dot(offset) / self.depth).max(0.1)
    }
}

impl LampDepths {
    /// The map of a scene; `None` if the scene has no region for shadows, or its lamp is off or too near.
    pub(super) fn draw(
        scene: &RenderScene,
        known: Option<&CachedVolume>,
        reads: &Arc<TextureReads>,
    ) -> Option<LampDepths> {
        let eye = shadow::chair_eye(scene)?;
        let (width, height) = (shadow::MAP_SIZE, shadow::MAP_SIZE);
        let view = CpuView { eye, lights: scene.lights, width, height, shadows: None, relief: None };
        let mut framebuffer = Framebuffer::with_background(&Background::plain([0.0; 3]), width, height);
        for solid in scene.solids.iter().filter(|solid| solid.casts_shadow) {
            surface_pass::solid_depths(solid, &view, &mut framebuffer);
        }
        if let (Some(tooth), Some(known)) = (&scene.tooth, known) {
            match &tooth.mode {
                RenderMode::Surface => {
                    surface_pass::tooth_depths(known.surface(tooth), tooth, &view, &mut framebuffer);
                }
                RenderMode::Iso => iso_pass::iso_depth_pass(&VolumeSampler::new(tooth, known), &view, &mut framebuffer),
                RenderMode::Volume(_) => {}
            }
        }
        let depths = framebuffer.pixels.iter().map(|pixel| pixel.depth).collect();
        Some(LampDepths { eye, radius: scene.lights.chair.radius, depths, reads: reads.clone() })
    }

    /// Share of the lamp that a point of world space with a unit normal sees.
    pub fn lamp_share(&self, point: Vec3, normal: Vec3) -> f32 {
        let Eye { position, right, up, forward, window, near, far } = self.eye;
        let half = window.right;
        let distance = (point - position).dot(forward);
        let texel = 2.0 * half * distance / shadow::MAP_SIZE as f32;
        let from_lamp = point + normal * (LIFT * texel) - position;
        let z = from_lamp.dot(forward);
        let across = Vec2::new(from_lamp.dot(right), from_lamp.dot(up)) / (z * half);
        let along_depth = (2.0 * z - near - far).abs() / (far - near);
        let from_middle = across.abs().max_element().max(along_depth);
        let fade = smooth_step((from_middle - FADE[0]) / (FADE[1] - FADE[0]));
        if fade == 1.0 {
            return 1.0;
        }
        let facing = (-normal.dot(from_lamp) / z).max(1e-4);
        let steep = Vec2::new(normal.dot(right), normal.dot(up)) / facing;
        let receiver = ShadowReceiver {
            at: Vec2::new(0.5 + 0.5 * across.x, 0.5 - 0.5 * across.y),
            depth: z,
            slope: steep * (SLOPE / steep.length().max(1e-6)).min(1.0),
            scale: Vec2::new(0.5, -0.5) / (z * half),
        };
        let reach = (self.radius * GAP / z).max(texel);
        let Some(caster) = self.caster_depth(&receiver, reach) else { return 1.0 };
        let blur = (self.radius * (z - caster) / caster).clamp(texel, reach);
        self.reads.count(Texture::LampComparison, TAPS as u64);
        let seen: f32 = places::<TAPS>(blur).map(|offset| self.compared(&receiver, offset)).sum();
        let share = seen / TAPS as f32;
        share + (1.0 - share) * fade
    }

    /// Mean depth, mm, of what lies between the lamp and the receiver.
    fn caster_depth(&self, receiver: &ShadowReceiver, reach: f32) -> Option<f32> {
        let (mut sum, mut count) = (0.0, 0.0);
        self.reads.count(Texture::LampDepth, SEARCHES as u64);
        for offset in places::<SEARCHES>(reach) {
            let texel = (receiver.at + offset * receiver.scale) * shadow::MAP_SIZE as f32;
            let depth = self.eye.depth(self.stored(texel.x.floor(), texel.y.floor()));
            if depth < receiver.plane_depth(offset) {
                sum += depth;
                count += 1.0;
            }
        }
        (count > 0.0).then(|| sum / count)
    }

    /// Share of the four texels around a place that do not lie before the receiver, weighted linearly.
    fn compared(&self, receiver: &ShadowReceiver, offset: Vec2) -> f32 {
        let depth = self.eye.buffer_depth(receiver.plane_depth(offset));
        let at = (receiver.at + offset * receiver.scale) * shadow::MAP_SIZE as f32 - 0.5;
        let (base, part) = (at.floor(), at - at.floor());
        let lit = |x: f32, y: f32| if depth <= self.stored(base.x + x, base.y + y) { 1.0 } else { 0.0 };
        let row = |y: f32| lit(0.0, y) * (1.0 - part.x) + lit(1.0, y) * part.x;
        row(0.0) * (1.0 - part.y) + row(1.0) * part.y
    }

    fn stored(&self, x: f32, y: f32) -> f32 {
        let place = |v: f32| v.clamp(0.0, (shadow::MAP_SIZE - 1) as f32) as usize;
        self.depths[place(y) * shadow::MAP_SIZE as usize + place(x)]
    }
}

/// Places spread evenly over a disc of a radius by the golden angle.
fn places<const N: usize>(radius: f32) -> impl Iterator<Item = Vec2> {
    const GOLDEN: Vec2 = Vec2::new(-0.737_368_9, 0.675_490_3);
    let ways = std::iter::successors(Some(Vec2::X), |way| Some(GOLDEN.rotate(*way)));
    ways.take(N).enumerate().map(move |(i, way)| way * (radius * ((i as f32 + 0.5) / N as f32).sqrt()))
}
