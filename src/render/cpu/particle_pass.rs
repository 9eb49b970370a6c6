//! Particles in great number: balls and discs. Twin of `particle_pass.wgsl`.

use super::{CpuView, Framebuffer, Pixel};
use crate::scene::{Appearance, Particle};
use typodont_core::frame::Vec3;
use typodont_core::parallel::{available_threads, par_rows};

/// Bulge of a disc of water: outward inclination of the normal at its rim.
const BULGE: f32 = 0.7;
/// By how much of its radius a disc of water is narrower at places: what lies on a tooth is not round.
const LOBES: f32 = 0.16;
/// Turn of a disc's outline with its place, radians per mm: neighbours differ, and what runs down a wall does not spin.
const LOBE_TURN: Vec3 = Vec3::new(0.31, 0.23, 0.37);
/// Greatest tilt of a disc's normal by ripples, and their wave numbers, radians per mm.
const RIPPLE: f32 = 0.16;
const RIPPLE_WAVES: [Vec3; 2] = [Vec3::new(4.3, 0.0, 2.9), Vec3::new(-3.1, 0.0, 5.2)];
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
            let turn = speck.position.dot(LOBE_TURN);
            let turn = [libm::cosf(turn), libm::sinf(turn)];
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
                    let Some(met) = intersect(to, speck, turn, direction).filter(|met| met.z >= eye.near) else {
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

/// Radius of a disc's outline in the direction of a place beside its middle, as a share of the greatest. `turn`: cosine and sine of
/// its turn.
fn outline(aside: Vec3, [cos, sin]: [f32; 2]) -> f32 {
    let way = aside / aside.length().max(1e-6);
    let [a, b] = [way.dot(Vec3::new(cos, 0.0, sin)), way.dot(Vec3::new(-sin, 0.0, cos))];
    // Two and three lobes: Chebyshev polynomials of the cosines.
    let waves = 0.5 * (2.0 * a * a - 1.0) + 0.5 * (4.0 * b * b - 3.0) * b;
    1.0 - LOBES * (0.5 - 0.5 * waves)
}

/// The front of a ball, or a disc, whose middle is so far from the eye.
fn intersect(to: Vec3, speck: &Particle, turn: [f32; 2], direction: Vec3) -> Option<ParticleHit> {
    let radius = speck.radius;
    let Some(facing) = speck.facing else {
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
    let from_middle = direction * z - to;
    if from_middle.length_squared() > radius * radius {
        return None;
    }
    let aside = from_middle / (radius * outline(from_middle, turn));
    let out = aside.length_squared();
    if out > 1.0 {
        return None;
    }
    let toward_eye = if slope > 0.0 { -facing } else { facing };
    let place = speck.position + from_middle;
    let [a, b] = RIPPLE_WAVES.map(|wave| libm::sinf(place.dot(wave)));
    let normal = (toward_eye + aside * (BULGE * out) + Vec3::new(a, 0.0, b) * RIPPLE).normalize();
    Some(ParticleHit { z, normal, thick: 1.0 - out * out })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_disc_has_lobes_within_its_radius() {
        // Aim: water is not round, no two patches are alike, and none is larger than the square that is drawn for it. Method: the
        // outlines of a hundred discs in 360 directions.
        let radii = |middle: Vec3| -> Vec<f32> {
            let turn = middle.dot(LOBE_TURN);
            let turn = [libm::cosf(turn), libm::sinf(turn)];
            (0..360).map(|n| outline(Vec3::new(libm::cosf(n as f32), 0.0, libm::sinf(n as f32)), turn)).collect()
        };
        let all: Vec<Vec<f32>> = (0..100).map(|n| radii(Vec3::new(0.37 * n as f32, -3.0, 2.0))).collect();
        for radii in &all {
            let [least, most] = [f32::min, f32::max].map(|of| radii.iter().copied().reduce(of).unwrap());
            assert!(
                least >= 1.0 - LOBES - 1e-6 && most <= 1.0 + 1e-6 && most - least > 0.5 * LOBES,
                "{least} to {most}"
            );
        }
        assert!(all.windows(2).all(|pair| pair[0] != pair[1]));
    }

    #[cfg(feature = "gpu")]
    #[test]
    fn the_shader_has_the_same_constants() {
        let [a, b] = RIPPLE_WAVES;
        for line in [
            format!("LOBES: f32 = {LOBES:?};"),
            format!("LOBE_TURN: vec3f = vec3f({:?}, {:?}, {:?});", LOBE_TURN.x, LOBE_TURN.y, LOBE_TURN.z),
            format!("RIPPLE: f32 = {RIPPLE:?};"),
            format!("mat2x2f(vec2f({:?}, {:?}), vec2f({:?}, {:?}));", a.x, b.x, a.z, b.z),
        ] {
            assert!(include_str!("../../../shaders/particle_pass.wgsl").contains(&line), "{line}");
        }
    }
}
