//! Colours and opacities by density, blended along each ray. Twin of `volume_pass.wgsl`.

use super::matter::{Matter, Ray};
use super::{Canvas, Sight};
use crate::frame::Vec3;
use crate::render::blending_step;
use crate::render::empty::{self, EVEN};
use crate::render::scene::Finish;
use crate::render::transfer::{Table, TransferFunction};

/// Opacity at which nothing behind is seen any more.
const OPAQUE: f32 = 0.99;
/// Gloss of what is lit.
const GLOSS: f32 = 0.12;

pub fn volume_pass(matter: &Matter, function: &TransferFunction, sight: &Sight, canvas: &mut Canvas) {
    let step = blending_step(matter.volume);
    let tables = function.stepped(step);
    canvas.each(|x, y, pixel| {
        let (ray, way) = matter.ray(sight, x, y);
        let behind = sight.eye.depth(pixel.depth);
        let blended = blend(matter, &tables, &ray, step / way.length(), sight.eye.near, behind);
        let Some(z) = blended.first else { return };
        let plain = blended.colour / blended.alpha;
        let normal = matter.normal(ray.at(z), -way);
        let finish = Finish { colour: plain.to_array(), gloss: GLOSS };
        let lit = Vec3::from(sight.lit(finish, 1.0, sight.eye.position + way * z, normal));
        let colour = plain + (lit - plain) * function.light;
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
fn blend(matter: &Matter, tables: &[Table], ray: &Ray, pace: f32, near: f32, behind: f32) -> Blended {
    let [first, last] = matter.span(ray);
    let end = last.min(behind);
    // Samples lie at whole steps from the eye, so that leaping over nothing changes nothing.
    let mut number = (first.max(near) / pace).ceil();
    let mut z = number * pace;
    let mut blended = Blended { colour: Vec3::ZERO, alpha: 0.0, first: None };
    while z < end {
        let (brick, way_out) = matter.leap(ray.at(z), ray.along);
        let out = z + way_out;
        if empty::steps(brick) > 0 {
            number = (out / pace).ceil().max(number + 1.0);
            z = number * pace;
            continue;
        }
        let out = out.min(end);
        // Where all samples are one, one is taken for all.
        let samples = if brick == EVEN { ((out / pace).ceil() - number).max(1.0) } else { 1.0 };
        while z < out {
            let [r, g, b, a] = entry(matter, tables, ray.at(z)).map(|v| f32::from(v) / 255.0);
            if a > 0.0 {
                let opacity = if brick == EVEN { 1.0 - libm::powf(1.0 - a, samples) } else { a };
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

/// What the table of the nearest voxel's label says for the density at a place.
fn entry(matter: &Matter, tables: &[Table], at: Vec3) -> [u8; 4] {
    let grid = matter.volume.grid();
    let last = Vec3::from(grid.dims.map(|n| n as f32 - 1.0));
    let nearest = (at + 0.5).floor().clamp(Vec3::ZERO, last);
    let label = matter.volume.labels()[grid.index([nearest.x as u32, nearest.y as u32, nearest.z as u32])];
    let density = (matter.density(at) * 255.0 + 0.5) as usize;
    tables[usize::from(label.0)][density.min(255)]
}
