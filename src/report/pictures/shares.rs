//! How many people removed what, on the tooth as it stood before.

use super::{CUTS, LINE, LINE_WIDTH, Picture, SIZE, Shows, encoded, marks, tint};
use crate::content::nrrd::segmentation::Segmentation;
use crate::content::{nrrd, scan};
use crate::frame::Vec3;
use crate::volume::march::{self, Camera, Shot, Side};
use crate::volume::{Grid, Label, Volume, surface};
use std::collections::BTreeMap;
use std::path::Path;

/// Colours of shares, each up to its bound: a fifth of ColorBrewer's YlGnBu, which darkens steadily, so that it is read in grey and
/// by colour-blind eyes.
pub const BANDS: [(f32, [u8; 3]); 5] = [
    (0.10, [0xc7, 0xe9, 0xb4]),
    (0.25, [0x7f, 0xcd, 0xbb]),
    (0.50, [0x41, 0xb6, 0xc4]),
    (0.75, [0x22, 0x5e, 0xa8]),
    (1.00, [0x0c, 0x2c, 0x84]),
];

/// Around what anybody removed, mm: enough of the tooth to know the place again.
const AROUND: f32 = 2.5;

/// The segment that holds decay, and the line around it.
const DECAY: &str = "caries";
const DECAY_LINE: [f32; 3] = [1.0, 0.62, 0.24];

/// The line around what at least half removed is this much wider than that around the decay.
const HALF_WIDER: f32 = 1.8;

/// The occlusal side and three cuts through the middle of what was removed. `tooth` is a label map in which `distal` is that way;
/// `share`, of people, lies on `grid` in the same space.
pub fn shares(tooth: &Path, distal: Vec3, grid: &Grid, share: &[f32]) -> Result<Vec<Picture>, String> {
    let image = nrrd::read(tooth).map_err(|e| e.to_string())?;
    let names: BTreeMap<u8, Label> = (1..=u8::MAX).map(|n| (n, Label(n))).collect();
    let volume = scan::labelled(&image, None, &names)?;
    let segments = Segmentation::from_image(image).map_err(|e| e.to_string())?.segments;
    let decay = segments.iter().find(|s| s.id == DECAY).map(|s| Label(s.label_value));
    let tissue = |label: Label| {
        let own = segments.iter().find(|s| s.label_value == label.0).map_or([0.9; 3], |s| s.color);
        tint::mixed([0.93; 3], own, 0.3)
    };
    let colour = |label: Label, voxel: usize| {
        let at = grid.nearest(volume.grid().centre(volume.grid().cell(voxel))).map_or(0.0, |c| share[grid.index(c)]);
        band(at).unwrap_or_else(|| tissue(label))
    };
    let half = surface::volume_of_mask(grid, |v| share[v] >= 0.5, Label(1));
    let decay = decay.and_then(|d| surface::volume_of_mask(volume.grid(), |v| volume.tissue(v) == d, d));
    let (low, high) = focus(&volume, grid);
    let middle = middle(grid, share);
    let shot = |side| Shot { camera: Camera::around(side, low, high, 1.0), width: SIZE, height: SIZE };

    let above = shot(Side::Occlusal);
    let mut drawn = vec![("occlusal", "Seen from the chewing surface", march::iso(&volume, &above, colour), above)];
    for (side, name, title) in CUTS {
        let shot = shot(side);
        let mut pixels = march::slice(&volume, &shot, middle, colour);
        for (part, line, width) in [(&half, LINE, HALF_WIDER * LINE_WIDTH), (&decay, DECAY_LINE, LINE_WIDTH)] {
            if let Some(part) = part {
                pixels.lay_over(&march::outline(part, &shot, middle, line, width));
            }
        }
        drawn.push((name, title, pixels, shot));
    }
    let on_paper = drawn.into_iter().map(|(name, title, pixels, shot)| super::Drawn {
        name: format!("share-{name}"),
        title: title.to_string(),
        shows: Shows::Map,
        pixels: marks::on_paper(&pixels, &shot, distal),
    });
    Ok(encoded(on_paper.collect()))
}

/// The colour of a share; none of nothing.
fn band(share: f32) -> Option<[f32; 3]> {
    let (_, colour) = BANDS.iter().find(|(to, _)| share <= *to).filter(|_| share > 0.0)?;
    Some(colour.map(|c| f32::from(c) / 255.0))
}

/// The box to show: what was removed and something around it, but nothing beyond the tooth.
fn focus(volume: &Volume, grid: &Grid) -> (Vec3, Vec3) {
    let [low, high] = grid.extent();
    let [first, last] =
        volume.tight_box().map_or(grid.extent(), |[a, b]| [volume.grid().centre(a), volume.grid().centre(b)]);
    let (low, high) = ((low - AROUND).max(first), (high + AROUND).min(last));
    (low.min(high), high.max(low))
}

/// The middle of what was removed, each voxel weighing what its share is.
fn middle(grid: &Grid, share: &[f32]) -> Vec3 {
    let weighed = share.iter().enumerate().filter(|(_, s)| **s > 0.0);
    let (sum, weight) = weighed.fold((glam::DVec3::ZERO, 0.0), |(sum, weight), (voxel, &s)| {
        (sum + grid.centre(grid.cell(voxel)).as_dvec3() * f64::from(s), weight + f64::from(s))
    });
    let [low, high] = grid.extent();
    if weight > 0.0 { (sum / weight).as_vec3() } else { 0.5 * (low + high) }
}
