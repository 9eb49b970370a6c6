//! Colours and opacities by density, blended along each ray. Twin of `volume_pass.wgsl`.

use super::texture_reads::{Texture, TextureReads};
use super::volume_sampler::{Ray, VolumeSampler};
use super::{CpuView, Framebuffer};
use crate::empty_space;
use crate::empty_space::{ONE_TISSUE, UNIFORM};
use crate::integration_step;
use crate::scene::Appearance;
use crate::transfer_function::{MOST_ATTENUATION, TransferFunction, TransferTable};
use typodont_core::frame::Vec3;
use typodont_core::volume::{Density, Label, Volume};

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
    let tables = StepTables { of_label: function.per_step(step), alike: function.alike_labels() };
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

/// Tables of a transfer function for one step.
struct StepTables {
    of_label: Vec<TransferTable>,
    /// For each label, the first that has the same table.
    alike: [Label; 256],
}

impl StepTables {
    /// Entry of a label's table for a density, 0 to 1.
    fn entry(&self, label: Label, density: f32) -> [u8; 4] {
        self.of_label[usize::from(label.0)][((density * 255.0 + 0.5) as usize).min(255)]
    }
}

struct Blended {
    /// Multiplied by opacity.
    colour: Vec3,
    alpha: f32,
    /// Depth of the first sample that shows anything.
    first: Option<f32>,
}

/// From front to back until nothing shines through or the scene ends the ray.
fn blend(sampler: &VolumeSampler, tables: &StepTables, ray: &Ray, pace: f32, near: f32, behind: f32) -> Blended {
    let [first, last] = sampler.span(ray);
    let end = last.min(behind);
    // Samples lie at whole steps from the eye, so that leaping over nothing changes nothing.
    let mut number = (first.max(near) / pace).ceil();
    let mut z = number * pace;
    let mut blended = Blended { colour: Vec3::ZERO, alpha: 0.0, first: None };
    while z < end {
        let (brick, way_out) = sampler.leap(ray, ray.at(z));
        let out = z + way_out;
        if empty_space::distance(brick) > 0 {
            number = (out / pace).ceil().max(number + 1.0);
            z = number * pace;
            continue;
        }
        let out = out.min(end);
        // In a uniform brick all samples are equal, so one sample stands for all of them.
        let [code, label] = brick;
        let is_uniform = code == UNIFORM;
        let samples = if is_uniform { ((out / pace).ceil() - number).max(1.0) } else { 1.0 };
        while z < out {
            let [r, g, b, a] = match code {
                UNIFORM => unit(entry(sampler, tables, ray.at(z))),
                ONE_TISSUE => {
                    sampler.reads.count(Texture::TransferTable, 1);
                    unit(tables.entry(Label(label), sampler.density(ray.at(z))))
                }
                _ => mixed_entry(sampler.volume, tables, sampler.reads, ray.at(z)),
            };
            if a > 0.0 {
                let opacity = if is_uniform { 1.0 - libm::powf(1.0 - a, samples) } else { a };
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
fn optical_depth(sampler: &VolumeSampler, tables: &StepTables, ray: &Ray, pace: f32, near: f32, behind: f32) -> f32 {
    let [first, last] = sampler.span(ray);
    let end = last.min(behind);
    let mut number = (first.max(near) / pace).ceil();
    let mut z = number * pace;
    let mut sum = 0.0;
    while z < end {
        let (brick, way_out) = sampler.leap(ray, ray.at(z));
        let out = z + way_out;
        if empty_space::distance(brick) > 0 {
            number = (out / pace).ceil().max(number + 1.0);
            z = number * pace;
            continue;
        }
        let out = out.min(end);
        let samples = if brick[0] == UNIFORM { ((out / pace).ceil() - number).max(1.0) } else { 1.0 };
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

/// Colour and opacity at a place: the entries of the eight labels around it for the density there, by the matter of their
/// voxels, so that no face of a voxel shows where tissues meet.
fn mixed_entry(volume: &Volume, tables: &StepTables, reads: &TextureReads, at: Vec3) -> [f32; 4] {
    reads.count(Texture::Voxel, 8);
    reads.count(Texture::Density, 1);
    let (corner, labels, densities) = voxels_around(volume, at);
    // The shader looks each voxel's label up unless all are equal.
    reads.count(Texture::TransferTable, if labels == [labels[0]; 8] { 1 } else { 9 });
    let labels = labels.map(|label| tables.alike[usize::from(label.0)]);
    let density = volume.density_in_grid(at);
    let entry_of = |label: Label| unit(tables.entry(label, density));
    if labels == [labels[0]; 8] {
        return entry_of(labels[0]);
    }
    let ([near_x, near_y, near_z], [far_x, far_y, far_z]) =
        ((1.0 - (at - corner)).to_array(), (at - corner).to_array());
    let [near, far] = [near_z, far_z].map(|z| [near_y * z, far_y * z]);
    let along_rows = [near[0], near[1], far[0], far[1]];
    let weights: [f32; 8] = std::array::from_fn(|i| {
        let along_x = if i & 1 == 0 { near_x } else { far_x };
        along_x * along_rows[i >> 1] * f32::from(densities[i].bits())
    });
    let mut matter = 0.0;
    // Colours multiplied by opacity.
    let mut sum = [0.0; 4];
    // Each label is looked up once, with the weight of all its voxels.
    let mut left = [true; 8];
    for i in 0..8 {
        if !left[i] {
            continue;
        }
        let mut weight = 0.0;
        for j in 0..8 {
            let is_same = labels[j] == labels[i];
            weight += if is_same { weights[j] } else { 0.0 };
            left[j] &= !is_same;
        }
        if weight > 0.0 {
            let [r, g, b, a] = entry_of(labels[i]);
            for (part, value) in sum.iter_mut().zip([r * a, g * a, b * a, a]) {
                *part += value * weight;
            }
            matter += weight;
        }
    }
    if matter <= 0.0 {
        return entry_of(labels[0]);
    }
    let [r, g, b, a] = sum;
    let opacity = a.max(1e-9);
    [r / opacity, g / opacity, b / opacity, a / matter]
}

/// Position, labels and densities of the eight voxels around a place, x fastest; beyond the grid, labels and densities are
/// those of its nearest voxel.
fn voxels_around(volume: &Volume, at: Vec3) -> (Vec3, [Label; 8], [Density; 8]) {
    let grid = volume.grid();
    let last = Vec3::from(grid.dims.map(|n| n as f32 - 1.0));
    if at.cmpge(Vec3::ZERO).all() && at.cmplt(last).all() {
        let [nx, ny, _] = grid.dims.map(|n| n as usize);
        // The conversion rounds down. By way of `i32` it takes one instruction, `floor` a call.
        let cell = at.to_array().map(|v| v as i32 as u32);
        let start = grid.index(cell);
        let starts = [start, start + nx, start + nx * ny, start + nx * ny + nx];
        let corner = Vec3::from(cell.map(|n| n as f32));
        return (corner, pairs(volume.labels(), starts), pairs(volume.densities(), starts));
    }
    let corner = at.floor();
    let index = |i: usize| {
        let step = Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32);
        let cell = (corner + step).clamp(Vec3::ZERO, last);
        grid.index([cell.x as u32, cell.y as u32, cell.z as u32])
    };
    let around: [usize; 8] = std::array::from_fn(index);
    (corner, around.map(|index| volume.labels()[index]), around.map(|index| volume.densities()[index]))
}

/// The values at each of four places and behind it.
fn pairs<T: Copy>(values: &[T], starts: [usize; 4]) -> [T; 8] {
    let [a, b, c, d] = starts.map(|start| {
        let pair = &values[start..start + 2];
        [pair[0], pair[1]]
    });
    [a[0], a[1], b[0], b[1], c[0], c[1], d[0], d[1]]
}

/// Entry of the table of the nearest voxel's label for the density at a place.
fn entry(sampler: &VolumeSampler, tables: &StepTables, at: Vec3) -> [u8; 4] {
    let grid = sampler.volume.grid();
    let last = Vec3::from(grid.dims.map(|n| n as f32 - 1.0));
    let nearest = (at + 0.5).floor().clamp(Vec3::ZERO, last);
    let label = sampler.volume.labels()[grid.index([nearest.x as u32, nearest.y as u32, nearest.z as u32])];
    sampler.reads.count(Texture::Voxel, 1);
    sampler.reads.count(Texture::TransferTable, 1);
    tables.entry(label, sampler.density(at))
}

/// Colour and opacity of an entry, 0 to 1.
fn unit(entry: [u8; 4]) -> [f32; 4] {
    entry.map(|v| f32::from(v) * (1.0 / 255.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use typodont_core::volume::Grid;

    #[test]
    fn a_border_between_tissues_has_no_steps_and_air_no_colour() {
        // Aim: where two tissues meet, colour and opacity change in proportion to the way, not from voxel to voxel. Method: red
        // faint tissue beside blue denser tissue, with air beyond; samples along a line through all three.
        let [red, blue] = [Label(1), Label(2)];
        let grid = Grid { dims: [12, 4, 4], origin: Vec3::ZERO, spacing: Vec3::splat(0.1) };
        let cells = || grid.cells().map(|[x, ..]| x);
        let densities: Vec<Density> = cells().map(|x| if x < 8 { Density::FULL } else { Density::EMPTY }).collect();
        let labels = cells()
            .map(|x| {
                if x < 4 {
                    red
                } else if x < 8 {
                    blue
                } else {
                    Label::AIR
                }
            })
            .collect();
        let volume = Volume::new(grid, 0.1, densities, labels, red);
        let mut of_label = vec![[[255, 255, 255, 200]; 256]; 256];
        of_label[1] = [[255, 0, 0, 51]; 256];
        of_label[2] = [[0, 0, 255, 102]; 256];
        let tables = StepTables { of_label, alike: std::array::from_fn(|label| Label(label as u8)) };
        let reads = TextureReads::default();
        let at = |x: f32| mixed_entry(&volume, &tables, &reads, Vec3::new(x, 1.3, 1.6));
        let close = |found: [f32; 4], expected: [f32; 4]| found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-5);
        assert!(close(at(2.7), [1.0, 0.0, 0.0, 0.2]), "{:?}", at(2.7));
        assert!(close(at(6.2), [0.0, 0.0, 1.0, 0.4]), "{:?}", at(6.2));
        // Halfway the denser tissue has two thirds of the colour.
        assert!(close(at(3.5), [1.0 / 3.0, 0.0, 2.0 / 3.0, 0.3]), "{:?}", at(3.5));
        for (before, after) in (0..60).map(|i| (at(2.9 + 0.02 * i as f32), at(2.92 + 0.02 * i as f32))) {
            assert!(before.iter().zip(after).all(|(a, b)| (a - b).abs() < 0.04), "{before:?} {after:?}");
        }
        assert!(close(at(7.4), [0.0, 0.0, 1.0, 0.4]), "air at the surface has no colour: {:?}", at(7.4));
    }
}
