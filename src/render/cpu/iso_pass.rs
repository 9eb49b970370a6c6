//! The surface of the carved tooth, met by a ray through each pixel. Twin of `iso_pass.wgsl`.

use super::volume_sampler::{Ray, VolumeSampler};
use super::{CpuView, Framebuffer};
use crate::empty_space;
use typodont_core::volume::ISO;

/// Step within a surface, in voxels: even a single voxel is solid for longer than that.
const STEP: f32 = 0.8;
/// Step where nothing is, in the same: matter can be noticed, if not yet solid, two voxels long.
const STEP_IN_AIR: f32 = 1.6;
/// False positions after one halving: together a hundredth of a voxel.
const SECANTS: u32 = 2;

pub fn iso_pass(sampler: &VolumeSampler, view: &CpuView, framebuffer: &mut Framebuffer) {
    framebuffer.for_each_pixel(|x, y, pixel| {
        let (ray, direction) = sampler.ray(view, x, y);
        let Some(z) = first_hit(sampler, &ray, view.eye.near) else { return };
        let depth = view.eye.buffer_depth(z);
        if !(0.0..=1.0).contains(&depth) || depth >= pixel.depth {
            return;
        }
        let at = ray.at(z);
        let normal = sampler.normal(at, -direction);
        pixel.colour = sampler.shade(view, at, view.eye.position + direction * z, normal);
        pixel.depth = depth;
    });
}

/// The depths alone, for shadows.
pub fn iso_depth_pass(sampler: &VolumeSampler, view: &CpuView, framebuffer: &mut Framebuffer) {
    framebuffer.for_each_pixel(|x, y, pixel| {
        let (ray, _) = sampler.ray(view, x, y);
        let Some(z) = first_hit(sampler, &ray, view.eye.near) else { return };
        let depth = view.eye.buffer_depth(z);
        if (0.0..pixel.depth).contains(&depth) {
            pixel.depth = depth;
        }
    });
}

/// Depth of the first place with matter along a ray.
fn first_hit(sampler: &VolumeSampler, ray: &Ray, near: f32) -> Option<f32> {
    let [first, last] = sampler.span(ray);
    let pace = ray.along.abs().max_element();
    let (step, step_in_air) = (STEP / pace, STEP_IN_AIR / pace);
    let mut z = first.max(near);
    let (mut before, mut density_before) = (z, 0.0);
    while z < last {
        let (brick, way_out) = sampler.leap(ray, ray.at(z));
        let out = z + way_out;
        if empty_space::distance(brick) > 0 {
            (z, before, density_before) = (out, out, 0.0);
            continue;
        }
        while z < out {
            let now = sampler.density(ray.at(z));
            if now >= ISO {
                return Some(refine_crossing(sampler, ray, [before, z], [density_before, now]));
            }
            (before, density_before) = (z, now);
            z += if now > 0.0 { step } else { step_in_air };
        }
    }
    None
}

/// The surface between a place without and a place with matter.
fn refine_crossing(
    sampler: &VolumeSampler,
    ray: &Ray,
    [mut outside, mut inside]: [f32; 2],
    [mut low, mut high]: [f32; 2],
) -> f32 {
    let mut middle = 0.5 * (outside + inside);
    for _ in 0..=SECANTS {
        let value = sampler.density(ray.at(middle));
        if value >= ISO {
            (inside, high) = (middle, value)
        } else {
            (outside, low) = (middle, value)
        }
        let part = ((ISO - low) / (high - low).max(1e-6)).clamp(0.05, 0.95);
        middle = outside + (inside - outside) * part;
    }
    middle
}
