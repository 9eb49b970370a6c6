//! Colours and opacities by density, blended along each ray. Twin of `volume_pass.wgsl`.

use super::volume_sampler::{Ray, VolumeSampler};
use super::{CpuView, Framebuffer};
use crate::empty_space;
use crate::empty_space::UNIFORM;
use crate::integration_step;
use crate::scene::Appearance;
use crate::transfer_function::{MOST_ATTENUATION, TransferFunction, TransferTable};
use typodont_core::frame::Vec3;

/// Opacity at which nothing behind is visible.
const OPAQUE: f32 = 0.99;
/// Gloss of the shaded share.
const GLOSS: f32 = 0.12;
/// Optical depth shown as white: that of two centimetres of dentine. Up to a share of it the film is linear.
const WHITE_DEPTH: f32 = 3.0;
const FILM_LINEAR_UP_TO: f32 = 0.76;
/// Colour of a lit film.
const FILM: Vec3 = Vec3::new(0.94, 0.97, 1.0);

pub fn volume_pass(
    sampler: &VolumeSampler,
    function: &TransferFunction,
    view: &CpuView,
    framebuffer: &mut Framebuffer,
) {
    let step = integration_step(sampler.volume);
    let tables = function.per_step(step);
    framebuffer.for_each_pixel(|x, y, pixel| {
        let (ray, direction) = sampler.ray(view, x, y);
        let behind = view.eye.depth(pixel.depth);
        if function.is_radiograph {
            let white =
                film(step * optical_depth(sampler, &tables, &ray, step / direction.length(), view.eye.near, behind));
            pixel.colour = (FILM * white + Vec3::from(pixel.colour) * (1.0 - white)).to_array();
            return;
        }
        let blended = blend(sampler, &tables, &ray, step / direction.length(), view.eye.near, behind);
        let Some(z) = blended.first else { return };
        let plain = blended.colour / blended.alpha;
        let normal = sampler.normal(ray.at(z), -direction);
        let finish = Appearance { colour: plain.to_array(), gloss: GLOSS };
        let lit = Vec3::from(view.shade(finish, 1.0, view.eye.position + direction * z, normal));
        let colour = plain + (lit - plain) * function.shading;
        let under = Vec3::from(pixel.colour);
        pixel.colour = (colour * blended.alpha + under * (1.0 - blended.alpha)).to_array();
    });
}

struct Blended {
    /// Multiplied by opacity.
    colour: Vec3,
    alpha: f32,
    /// Depth of the first sample that shows anything.
    first: Option<f32>,
}

/// From front to back until nothing shines through or the scene ends the ray.
fn blend(sampler: &VolumeSampler, tables: &[TransferTable], ray: &Ray, pace: f32, near: f32, behind: f32) -> Blended {
    let [first, last] = sampler.span(ray);
    let end = last.min(behind);
    // Samples lie at whole steps from the eye, so that leaping over nothing changes nothing.
    let mut number = (first.max(near) / pace).ceil();
    let mut z = number * pace;
    let mut blended = Blended { colour: Vec3::ZERO, alpha: 0.0, first: None };
    while z < end {
        let (brick, way_out) = sampler.leap(ray.at(z), ray.along);
        let out = z + way_out;
        if empty_space::distance(brick) > 0 {
            number = (out / pace).ceil().max(number + 1.0);
            z = number * pace;
            continue;
        }
        let out = out.min(end);
        // In a uniform brick all samples are equal, so one sample stands for all of them.
        let samples = if brick == UNIFORM { ((out / pace).ceil() - number).max(1.0) } else { 1.0 };
        while z < out {
            let [r, g, b, a] = entry(sampler, tables, ray.at(z)).map(|v| f32::from(v) / 255.0);
            if a > 0.0 {
                let opacity = if brick == UNIFORM { 1.0 - libm::powf(1.0 - a, samples) } else { a };
                let share = opacity * (1.0 - blended.alpha);
                blended.colour += Vec3::new(r, g, b) * share;
                blended.alpha += share;
                blended.first = blended.first.or(Some(z));
                if blended.alpha > OPAQUE {
                    return blended;
                }
            }
            number += samples;
            z = number * pace;
        }
    }
    blended
}

/// Line integral of the attenuation along a ray, per mm and step, up to the end of the scene. The steps are those of
/// [`blend`], but no ray ends early.
fn optical_depth(
    sampler: &VolumeSampler,
    tables: &[TransferTable],
    ray: &Ray,
    pace: f32,
    near: f32,
    behind: f32,
) -> f32 {
    let [first, last] = sampler.span(ray);
    let end = last.min(behind);
    let mut number = (first.max(near) / pace).ceil();
    let mut z = number * pace;
    let mut sum = 0.0;
    while z < end {
        let (brick, way_out) = sampler.leap(ray.at(z), ray.along);
        let out = z + way_out;
        if empty_space::distance(brick) > 0 {
            number = (out / pace).ceil().max(number + 1.0);
            z = number * pace;
            continue;
        }
        let out = out.min(end);
        let samples = if brick == UNIFORM { ((out / pace).ceil() - number).max(1.0) } else { 1.0 };
        while z < out {
            let [high, low, ..] = entry(sampler, tables, ray.at(z));
            sum += (f32::from(high) * 256.0 + f32::from(low)) * samples;
            number += samples;
            z = number * pace;
        }
    }
    sum * (MOST_ATTENUATION / 65535.0)
}

/// Brightness of the film: linear in optical depth, as sensors show it, then compressed, so that no filling burns out.
fn film(depth: f32) -> f32 {
    let linear = depth / WHITE_DEPTH;
    if linear <= FILM_LINEAR_UP_TO {
        return linear;
    }
    let left = 1.0 - FILM_LINEAR_UP_TO;
    1.0 - left * left / (linear + left - FILM_LINEAR_UP_TO)
}

/// Entry of the table of the nearest voxel's label for the density at a place.
fn entry(sampler: &VolumeSampler, tables: &[TransferTable], at: Vec3) -> [u8; 4] {
    let grid = sampler.volume.grid();
    let last = Vec3::from(grid.dims.map(|n| n as f32 - 1.0));
    let nearest = (at + 0.5).floor().clamp(Vec3::ZERO, last);
    let label = sampler.volume.labels()[grid.index([nearest.x as u32, nearest.y as u32, nearest.z as u32])];
    let density = (sampler.density(at) * 255.0 + 0.5) as usize;
    tables[usize::from(label.0)][density.min(255)]
}
