//! Maps of the share of people who removed each voxel, drawn on the tooth as it was at the start.

use super::{
    CONTOUR, CONTOUR_WIDTH, EncodedPicture, SECTIONS, SIZE, ViewKind, annotations, encode_all, verdict_colours,
};
use crate::raycast;
use crate::raycast::{ImagePlane, OrthographicCamera, ViewSide};
use std::collections::BTreeMap;
use std::path::Path;
use typodont_core::aabb::Aabb;
use typodont_core::frame::Vec3;
use typodont_core::volume::{Grid, Label, Volume, surface};
use typodont_exercise::tooth_import;
use typodont_formats::nrrd;
use typodont_formats::nrrd::segmentation::Segmentation;

/// Colours of shares, each up to its bound: a fifth of ColorBrewer's YlGnBu, which darkens steadily, so that it is read in grey and
/// by colour-blind eyes.
pub const SHARE_BANDS: [(f32, [u8; 3]); 5] = [
    (0.10, [0xc7, 0xe9, 0xb4]),
    (0.25, [0x7f, 0xcd, 0xbb]),
    (0.50, [0x41, 0xb6, 0xc4]),
    (0.75, [0x22, 0x5e, 0xa8]),
    (1.00, [0x0c, 0x2c, 0x84]),
];

/// Margin around the matter that anybody removed, mm: enough of the tooth to recognise the place.
const FOCUS_MARGIN: f32 = 2.5;

/// The segment that holds decay, and the line around it.
const DECAY: &str = "caries";
const DECAY_LINE: [f32; 3] = [1.0, 0.62, 0.24];

/// Width of the line around the matter that at least half removed, relative to the line around the decay.
const HALF_LINE_FACTOR: f32 = 1.8;

/// The occlusal side and three sections through the centre of the removed matter. `tooth` is a label map; `distal` is
/// the distal direction in its space, `None` for an arch; `share` is the share of people (0 to 1) per voxel of `grid`, in the same space.
///
/// # Errors
///
/// When the label map cannot be read.
pub fn draw_removal_share(
    tooth: &Path,
    distal: Option<Vec3>,
    grid: &Grid,
    share: &[f32],
) -> Result<Vec<EncodedPicture>, String> {
    let image = nrrd::read(tooth).map_err(|e| e.to_string())?;
    let names: BTreeMap<u8, Label> = (1..=u8::MAX).map(|n| (n, Label(n))).collect();
    let volume = tooth_import::labelled(&image, None, &names)?;
    let segments = Segmentation::from_image(image).map_err(|e| e.to_string())?.segments;
    let decay = segments.iter().find(|s| s.id == DECAY).map(|s| Label(s.label_value));
    let tissue = |label: Label| {
        let own = segments.iter().find(|s| s.label_value == label.0).map_or([0.9; 3], |s| s.color);
        verdict_colours::lerp_colour([0.93; 3], own, 0.3)
    };
    let colour = |label: Label, voxel: usize| {
        let at = grid.nearest(volume.grid().centre(volume.grid().cell(voxel))).map_or(0.0, |c| share[grid.index(c)]);
        band_colour(at).unwrap_or_else(|| tissue(label))
    };
    let half = surface::volume_of_mask(grid, |v| share[v] >= 0.5, Label(1));
    let decay = decay.and_then(|d| surface::volume_of_mask(volume.grid(), |v| volume.tissue(v) == d, d));
    let focus = focus_box(&volume, grid);
    let middle = weighted_centre(grid, share);
    let shot =
        |side| ImagePlane { camera: OrthographicCamera::framing_box(side, &focus, 1.0), width: SIZE, height: SIZE };

    let above = shot(ViewSide::Occlusal);
    let mut drawn = vec![("occlusal", "Occlusal view", raycast::render_iso(&volume, &above, colour), above)];
    for (side, name, title) in SECTIONS {
        let shot = shot(side);
        let shot =
            ImagePlane { camera: distal.map_or(shot.camera, |distal| shot.camera.with_mesial_left(distal)), ..shot };
        let mut pixels = raycast::slice(&volume, &shot, middle, colour);
        for (part, line, width) in
            [(&half, CONTOUR, HALF_LINE_FACTOR * CONTOUR_WIDTH), (&decay, DECAY_LINE, CONTOUR_WIDTH)]
        {
            if let Some(part) = part {
                pixels.composite(&raycast::contour(part, &shot, middle, line, width));
            }
        }
        drawn.push((name, title, pixels, shot));
    }
    let on_paper = drawn.into_iter().map(|(name, title, pixels, shot)| super::RawPicture {
        name: format!("share-{name}"),
        title: title.to_string(),
        kind: ViewKind::Map,
        pixels: annotations::annotate(&pixels, &shot, distal),
    });
    Ok(encode_all(on_paper.collect()))
}

/// Colour of a share; `None` for 0.
fn band_colour(share: f32) -> Option<[f32; 3]> {
    let (_, colour) = SHARE_BANDS.iter().find(|(to, _)| share <= *to).filter(|_| share > 0.0)?;
    Some(colour.map(|c| f32::from(c) / 255.0))
}

/// The box to show: the removed matter with a margin, but nothing beyond the tooth.
fn focus_box(volume: &Volume, grid: &Grid) -> Aabb {
    let removed = grid.extent().grown(Vec3::splat(FOCUS_MARGIN));
    let tooth = volume.bounding_box().map_or(grid.extent(), |cells| volume.grid().extent_of(&cells));
    Aabb::around([removed.low.max(tooth.low), removed.high.min(tooth.high)])
}

/// Centre of the removed matter, each voxel weighted by its share.
fn weighted_centre(grid: &Grid, share: &[f32]) -> Vec3 {
    let weighed = share.iter().enumerate().filter(|(_, s)| **s > 0.0);
    let (sum, weight) = weighed.fold((glam::DVec3::ZERO, 0.0), |(sum, weight), (voxel, &s)| {
        (sum + grid.centre(grid.cell(voxel)).as_dvec3() * f64::from(s), weight + f64::from(s))
    });
    if weight > 0.0 { (sum / weight).as_vec3() } else { grid.extent().centre() }
}
