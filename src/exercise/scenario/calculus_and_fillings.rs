//! Calculus on a root and existing fillings, applied to a tooth's volume.

use super::tooth_bounds::ToothBounds;
use super::{Calculus, OldFilling};
use crate::catalog::{TissueRole, TissueTable};
use std::f32::consts::PI;
use typodont_anatomy::periodontium::Periodontium;
use typodont_core::frame::Vec3;
use typodont_core::volume::{ISO, Label, Volume, density_at_distance};

/// Amplitude of a deposit's roughness, mm, and its wave numbers, rad/mm. An explorer detects this roughness.
const ROUGH: f32 = 0.05;
const WAVES: [f32; 3] = [11.0, 9.0, 13.0];

/// Returns the tooth with a deposit on it; `None` if there is no root at the deposit's site.
pub(super) fn apply_calculus(volume: &Volume, gum: &Periodontium, calculus: &Calculus) -> Option<Volume> {
    let azimuth = calculus.site.azimuth();
    let (out, height) = (gum.outward(azimuth), gum.margin(azimuth) - calculus.below_margin);
    let at = surface_toward(volume, gum.middle().with_z(height), out)?;
    let square = (-volume.density_and_gradient_at(at).1).try_normalize().filter(|n| n.dot(out) > 0.3).unwrap_or(out);
    let along = (Vec3::Z - square * square.z).normalize_or(Vec3::Z);
    let round = along.cross(square);
    let half = [0.5 * calculus.width, 0.5 * calculus.height];
    let grid = *volume.grid();
    let mut density = volume.densities().to_vec();
    let mut label: Vec<Label> = volume.tissues().collect();
    let reach = Vec3::splat(half[0].max(half[1]) + calculus.thickness + volume.half_band());
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
        // A dome over the root's surface; its slope is level at the top and at the rim.
        let dome = calculus.thickness * square_of(libm::cosf(0.5 * PI * aside));
        let distance = gum.distance_to_tooth(place) - dome - roughness(place) * (1.0 - aside);
        let here = density_at_distance(distance, volume.half_band());
        if here > density[index] {
            let is_new = here.is_solid() && !density[index].is_solid();
            density[index] = here;
            if is_new {
                label[index] = calculus.label;
                count += 1;
            }
        }
    }
    (count > 0).then(|| Volume::new(grid, volume.half_band(), density, label, calculus.label))
}

fn square_of(value: f32) -> f32 {
    value * value
}

fn roughness(place: Vec3) -> f32 {
    ROUGH * libm::sinf(WAVES[0] * place.x) * libm::sinf(WAVES[1] * place.y) * libm::sinf(WAVES[2] * place.z)
}

/// Returns the outermost surface point on a horizontal ray from the centre of the tooth.
pub(super) fn surface_toward(volume: &Volume, middle: Vec3, out: Vec3) -> Option<Vec3> {
    /// Distance greater than the half-width of any tooth, mm.
    const BEYOND: f32 = 10.0;
    let step = 0.25 * volume.grid().spacing.min_element();
    let at = |i: u32| middle + out * (BEYOND - i as f32 * step);
    (0..(BEYOND / step) as u32).map(at).find(|p| volume.density_at(*p) >= ISO)
}

/// Returns the tooth with an existing filling: hard tissue within a box below the occlusal surface is relabelled.
/// `None` if the box contains none.
pub(super) fn apply_old_filling(
    mut volume: Volume,
    filling: &OldFilling,
    place: &ToothBounds,
    tissues: &TissueTable,
) -> Option<Volume> {
    let grid = *volume.grid();
    let [nx, ny, nz] = grid.dims;
    let crown = place.crown.centre();
    let middle = crown + Vec3::X * filling.offset[0] + place.distal() * filling.offset[1];
    let half = [0.5 * filling.size[0], 0.5 * filling.size[1]];
    let is_solid: Vec<bool> = volume.densities().iter().map(|d| d.is_solid()).collect();
    // The top of each column of voxels is the occlusal surface.
    let top = |x: u32, y: u32| (0..nz).rev().find(|&z| is_solid[grid.index([x, y, z])]);
    let tops: Vec<Option<u32>> = (0..ny).flat_map(|y| (0..nx).map(move |x| (x, y))).map(|(x, y)| top(x, y)).collect();
    let mut count = 0;
    volume.relabel(|index, label| {
        let [x, y, z] = grid.cell(index);
        let at = grid.centre([x, y, z]);
        let is_beside = (at.x - middle.x).abs() > half[0] || (at.y - middle.y).abs() > half[1];
        let Some(top) = tops[(y * nx + x) as usize].filter(|_| !is_beside) else { return label };
        let below = (top as f32 - z as f32) * grid.spacing.z;
        let is_hard = matches!(tissues.role(label), Some(TissueRole::Sound | TissueRole::Decay | TissueRole::Material));
        let is_hit = below <= filling.depth && at.z > place.crown.low.z && is_hard;
        count += usize::from(is_hit && is_solid[index]);
        if is_hit { filling.label } else { label }
    });
    (count > 0).then_some(volume)
}
