//! Preview of an exercise: the trainee's first view, and the position of the decay for the author.

use super::tooth_surface::ToothMaterial;
use super::verdict_colours::TissueColours;
use super::{CONTOUR, CONTOUR_WIDTH, SIZE, annotations, crown_image_plane, encode_png, nearest_tooth};
use crate::raycast;
use crate::raycast::{ImagePlane, OrthographicCamera, PixelBuffer, ViewSide};
use typodont_core::frame::Vec3;
use typodont_core::image::RgbaImage;
use typodont_core::volume::{Label, Volume, surface};
use typodont_exercise::catalog::TissueRole;
use typodont_exercise::scenario::{Scenario, Workpiece};

/// Decay seen through the tissue that covers it: its colour and its opacity.
const DECAY_HIGHLIGHT: [f32; 3] = [0.83, 0.18, 0.10];
const HIGHLIGHT_OPACITY: f32 = 0.30;

/// Width and height of the first picture of a preview, pixels.
pub const PREVIEW_SIZE: [u32; 2] = [SIZE * 3 / 2, SIZE];

/// PNG with four pictures side by side: the trainee's first view (of [`PREVIEW_SIZE`]), the tooth from above, the tooth
/// from the side nearest to the first decay, and a section through that decay.
pub fn preview_png(scenario: &Scenario, workpiece: &Workpiece, first_view: &RgbaImage) -> Vec<u8> {
    let share = |v: u8| f32::from(v) / 255.0;
    let pixels = first_view.rgba.chunks(4).map(|p| [share(p[0]), share(p[1]), share(p[2]), 1.0]).collect();
    let first = PixelBuffer { width: first_view.width, height: first_view.height, pixels };
    let palette = TissueColours::of(&scenario.tissues);
    let material = ToothMaterial::of(scenario, workpiece);
    let surface = material.surface_of(&workpiece.volume);
    let decay = decay_volume(scenario, &workpiece.volume);
    let tooth = &workpiece.teeth[0];
    let middle = workpiece.lesions_in_volume().first().map_or(tooth.crown.centre(), |l| l.centre);
    let from = |side: ViewSide| {
        let shot = ImagePlane {
            camera: OrthographicCamera::framing_volume(side, &workpiece.volume, 1.0),
            width: SIZE,
            height: SIZE,
        };
        let mut picture = surface.paint(&raycast::render(&workpiece.volume, &shot));
        if let Some(decay) = &decay {
            picture.composite(&highlight(&raycast::render_iso(decay, &shot, |_, _| DECAY_HIGHLIGHT)));
        }
        annotations::annotate(&picture, &shot, workpiece.common_distal())
    };
    let shot = crown_image_plane(ViewSide::Mesial, nearest_tooth(workpiece, middle));
    let mut cut = raycast::slice(&workpiece.volume, &shot, middle, |label, _| palette.tissue(label));
    if let Some(decay) = &decay {
        cut.composite(&raycast::contour(decay, &shot, middle, DECAY_HIGHLIGHT, CONTOUR_WIDTH));
    }
    cut.composite(&raycast::contour(&workpiece.volume, &shot, middle, CONTOUR, CONTOUR_WIDTH));
    let sides = from(ViewSide::Occlusal).hconcat(&from(nearest_side(workpiece, middle)));
    encode_png(&first.hconcat(&sides).hconcat(&annotations::annotate(&cut, &shot, workpiece.common_distal())))
}

/// The decay without the tooth.
fn decay_volume(scenario: &Scenario, volume: &Volume) -> Option<Volume> {
    let is_decay: [bool; 256] =
        std::array::from_fn(|l| scenario.tissues.role(Label(l as u8)) == Some(TissueRole::Decay));
    surface::volume_of_mask(volume.grid(), |voxel| is_decay[usize::from(volume.tissue(voxel).0)], Label(1))
}

/// The side of the tooth to which a point is nearest.
fn nearest_side(workpiece: &Workpiece, point_in_tooth: Vec3) -> ViewSide {
    let tooth = nearest_tooth(workpiece, point_in_tooth);
    let (low, high) = (point_in_tooth - tooth.crown.low, tooth.crown.high - point_in_tooth);
    let sides =
        [(ViewSide::Buccal, high.x), (ViewSide::Lingual, low.x), (ViewSide::Mesial, low.y), (ViewSide::Distal, high.y)];
    sides.into_iter().min_by(|a, b| a.1.total_cmp(&b.1)).map_or(ViewSide::Buccal, |(side, _)| side)
}

/// A translucent veil over a hidden part, with a line around it.
fn highlight(hidden: &PixelBuffer) -> PixelBuffer {
    let (width, height) = (hidden.width as usize, hidden.height as usize);
    let mut veil = PixelBuffer::transparent(hidden.width, hidden.height);
    for (i, pixel) in veil.pixels.iter_mut().enumerate() {
        let (x, y) = (i % width, i / width);
        let rows = y.saturating_sub(1)..=(y + 1).min(height - 1);
        let around = rows.flat_map(|y| (x.saturating_sub(1)..=(x + 1).min(width - 1)).map(move |x| y * width + x));
        let covered = around.map(|n| hidden.pixels[n][3]);
        let (least, most) = covered.fold((1.0f32, 0.0f32), |(low, high), c| (low.min(c), high.max(c)));
        let share = (most - least).max(HIGHLIGHT_OPACITY * hidden.pixels[i][3]);
        *pixel = [DECAY_HIGHLIGHT[0] * share, DECAY_HIGHLIGHT[1] * share, DECAY_HIGHLIGHT[2] * share, share];
    }
    veil
}
