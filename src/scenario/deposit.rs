//! Calculus on a root, and fillings from long ago: what becomes of a tooth's volume.

use super::workpiece::ToothPlace;
use super::{Calculus, Filling};
use crate::anatomy::periodontium::Periodontium;
use crate::content::{Role, TissueTable};
use crate::frame::Vec3;
use crate::volume::{ISO, Label, Volume, ramp};
use std::f32::consts::PI;

/// Amplitude of a deposit's roughness, mm, and its waves, rad/mm: what an explorer clicks over.
const ROUGH: f32 = 0.05;
const WAVES: [f32; 3] = [11.0, 9.0, 13.0];

/// The tooth with a deposit on it; `None` where there is no root to sit on.
pub(super) fn put_calculus(volume: &Volume, gum: &Periodontium, calculus: &Calculus) -> Option<Volume> {
    let turn = calculus.site.turn();
    let (out, height) = (gum.outward(turn), gum.margin(turn) - calculus.below_margin);
    let at = surface_toward(volume, gum.middle().with_z(height), out)?;
    let square = (-volume.density_and_gradient_at(at).1).try_normalize().filter(|n| n.dot(out) > 0.3).unwrap_or(out);
    let along = (Vec3::Z - square * square.z).normalize_or(Vec3::Z);
    let round = along.cross(square);
    let half = [0.5 * calculus.width, 0.5 * calculus.height];
    let grid = *volume.grid();
    let mut density = volume.densities().to_vec();
    let mut label: Vec<Label> = volume.tissues().collect();
    let reach = Vec3::splat(half[0].max(half[1]) + calculus.thickness + volume.band());
    let [xs, ys, zs] = grid.cells_within(at - reach, at + reach);
    let mut count = 0;
    for (x, y, z) in zs.flat_map(|z| {
        ys.clone().flat_map({
            let xs = xs.clone();
            move |y| xs.clone().map(move |x| (x, y, z))
        })
    }) {
        let (index, place) = (grid.index([x, y, z]), grid.centre([x, y, z]));
        let off = place - at;
        let aside = libm::hypotf(off.dot(round) / half[0], off.dot(along) / half[1]);
        if aside >= 1.0 {
            continue;
        }
        // A dome over the root as it is, its slope level at top and rim.
        let dome = calculus.thickness * square_of(libm::cosf(0.5 * PI * aside));
        let distance = gum.away(place) - dome - roughness(place) * (1.0 - aside);
        let here = ramp(distance, volume.band());
        if here > density[index] {
            let is_new = here.is_solid() && !density[index].is_solid();
            density[index] = here;
            if is_new {
                label[index] = calculus.label;
                count += 1;
            }
        }
    }
    (count > 0).then(|| Volume::new(grid, volume.band(), density, label, calculus.label))
}

fn square_of(value: f32) -> f32 {
    value * value
}

fn roughness(place: Vec3) -> f32 {
    ROUGH * libm::sinf(WAVES[0] * place.x) * libm::sinf(WAVES[1] * place.y) * libm::sinf(WAVES[2] * place.z)
}

/// The outermost surface on a level ray from the tooth's middle.
pub(super) fn surface_toward(volume: &Volume, middle: Vec3, out: Vec3) -> Option<Vec3> {
    /// Farther out than any tooth, mm.
    const BEYOND: f32 = 10.0;
    let step = 0.25 * volume.grid().spacing.min_element();
    let at = |i: u32| middle + out * (BEYOND - i as f32 * step);
    (0..(BEYOND / step) as u32).map(at).find(|p| volume.density_at(*p) >= ISO)
}

/// The tooth with an old filling: what is hard within a box below the chewing surface is of that material; `None` if nothing is.
pub(super) fn put_filling(
    mut volume: Volume,
    filling: &Filling,
    place: &ToothPlace,
    tissues: &TissueTable,
) -> Option<Volume> {
    let grid = *volume.grid();
    let [nx, ny, nz] = grid.dims;
    let crown = 0.5 * (place.crown_low + place.crown_high);
    let middle = crown + Vec3::X * filling.offset[0] + place.distal() * filling.offset[1];
    let half = [0.5 * filling.size[0], 0.5 * filling.size[1]];
    let is_solid: Vec<bool> = volume.densities().iter().map(|d| d.is_solid()).collect();
    // The top of each column of voxels is where the chewing surface is.
    let top = |x: u32, y: u32| (0..nz).rev().find(|&z| is_solid[grid.index([x, y, z])]);
    let tops: Vec<Option<u32>> = (0..ny).flat_map(|y| (0..nx).map(move |x| (x, y))).map(|(x, y)| top(x, y)).collect();
    let mut count = 0;
    volume.relabel(|index, label| {
        let [x, y, z] = grid.cell(index);
        let at = grid.centre([x, y, z]);
        let is_beside = (at.x - middle.x).abs() > half[0] || (at.y - middle.y).abs() > half[1];
        let Some(top) = tops[(y * nx + x) as usize].filter(|_| !is_beside) else { return label };
        let below = (top as f32 - z as f32) * grid.spacing.z;
        let is_hard = matches!(tissues.role(label), Some(Role::Sound | Role::Decay | Role::Material));
        let is_hit = below <= filling.depth && at.z > place.crown_low.z && is_hard;
        count += usize::from(is_hit && is_solid[index]);
        if is_hit { filling.label } else { label }
    });
    (count > 0).then_some(volume)
}
