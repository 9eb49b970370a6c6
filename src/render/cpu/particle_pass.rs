//! Particles in great number: balls and discs. Twin of `particle_pass.wgsl`.

use super::{CpuView, Framebuffer, Pixel};
use crate::scene::{Appearance, Particle};
use typodont_core::frame::Vec3;
use typodont_core::parallel::{available_threads, par_rows};

/// Bulge of a disc of water: outward inclination of the normal at its rim.
const BULGE: f32 = 0.7;
/// A ray more parallel to a disc than this does not meet it.
const EDGE_ON: f32 = 1e-4;

pub fn opaque(particles: &[Particle], view: &CpuView, framebuffer: &mut Framebuffer) {
    draw(particles, view, framebuffer, |speck, met, point, pixel, depth| {
        pixel.colour = view.shade(speck.appearance, 1.0, point, met.normal);
        pixel.depth = depth;
    });
}

pub fn translucent(particles: &[Particle], view: &CpuView, framebuffer: &mut Framebuffer) {
    draw(particles, view, framebuffer, |speck, met, point, pixel, _| {
        let matt = Vec3::from(view.shade(Appearance { gloss: 0.0, ..speck.appearance }, 1.0, point, met.normal));
        let wet = Vec3::from(view.shade(speck.appearance, 1.0, point, met.normal));
        // A lamp is mirrored by clear water as brightly as by milk.
        let glint = (wet - matt).max_element();
        let opacity = met.thick * (speck.opacity + (1.0 - speck.opacity) * glint);
        pixel.colour = (wet * opacity + Vec3::from(pixel.colour) * (1.0 - opacity)).to_array();
    });
}

/// Intersection of a ray with a particle.
struct ParticleHit {
    z: f32,
    normal: Vec3,
    /// Thickness of the particle there, as a share of its greatest thickness.
    thick: f32,
}

/// Draws the particles in order, each on the pixels that it may cover.
fn draw(
    particles: &[Particle],
    view: &CpuView,
    framebuffer: &mut Framebuffer,
    paint: impl Fn(&Particle, &ParticleHit, Vec3, &mut Pixel, f32) + Sync,
) {
    if particles.is_empty() {
        return;
    }
    let (width, height, eye) = (framebuffer.width, framebuffer.height, &view.eye);
    let bands = available_threads();
    let rows = height.div_ceil(bands as u32).max(1);
    par_rows(&mut framebuffer.pixels, rows * width, bands, |band, pixels| {
        let first = band * rows;
        let last = first + (pixels.len() / width as usize) as u32;
        for speck in particles {
            let to = speck.position - eye.position;
            let z = to.dot(eye.forward);
            if z < eye.near || z > eye.far {
                continue;
            }
            let reach = speck.radius * room(to, z, speck.radius);
            let corner = |side: f32| eye.project(speck.position + (eye.right - eye.up) * (side * reach)).0;
            let ([left, top], [right, bottom]) = (corner(-1.0), corner(1.0));
            let span = |low: f32, high: f32, size: u32, least: u32, most: u32| {
                let [low, high] = [low.floor(), high.ceil()].map(|v| v.clamp(0.0, size as f32) as u32);
                low.max(least)..high.min(most)
            };
            for y in span(top * height as f32, bottom * height as f32, height, first, last) {
                for x in span(left * width as f32, right * width as f32, width, 0, width) {
                    let direction = view.ray(x as f32 + 0.5, y as f32 + 0.5);
                    let Some(met) =
                        intersect(to, speck.radius, speck.facing, direction).filter(|met| met.z >= eye.near)
                    else {
                        continue;
                    };
                    let depth = eye.buffer_depth(met.z);
                    let pixel = &mut pixels[((y - first) * width + x) as usize];
                    if depth < pixel.depth {
                        paint(speck, &met, eye.position + direction * met.z, pixel, depth);
                    }
                }
            }
        }
    });
}

/// Factor by which a square facing the eye must be larger than the particle to cover its whole outline.
fn room(to: Vec3, z: f32, radius: f32) -> f32 {
    1.02 * to.length() / z * (z / (z - radius).max(1e-6)).min(2.0)
}

/// The front of a ball, or a disc.
fn intersect(to: Vec3, radius: f32, facing: Option<Vec3>, direction: Vec3) -> Option<ParticleHit> {
    let Some(facing) = facing else {
        let nearest = to.dot(direction) / direction.length_squared();
        let left = radius * radius - (direction * nearest - to).length_squared();
        if left < 0.0 {
            return None;
        }
        let z = nearest - left.sqrt() / direction.length();
        return Some(ParticleHit { z, normal: (direction * z - to) / radius, thick: left.sqrt() / radius });
    };
    let slope = direction.dot(facing);
    if slope.abs() < EDGE_ON {
        return None;
    }
    let z = to.dot(facing) / slope;
    let aside = (direction * z - to) / radius;
    let out = aside.length_squared();
    let toward_eye = if slope > 0.0 { -facing } else { facing };
    let met = ParticleHit { z, normal: (toward_eye + aside * (BULGE * out)).normalize(), thick: 1.0 - out * out };
    (out <= 1.0).then_some(met)
}
