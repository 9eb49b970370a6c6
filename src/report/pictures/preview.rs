//! What the trainee will see, and what an author wants to see: where the decay lies.

use super::tint::Palette;
use super::{LINE, LINE_WIDTH, SIZE, crown_shot, marks, png, tooth_at};
use crate::content::Role;
use crate::frame::Vec3;
use crate::render::Image;
use crate::scenario::{Scenario, Workpiece};
use crate::volume::march::{self, Camera, Picture, Shot, Side};
use crate::volume::{Label, Volume, surface};

/// Decay seen through what covers it: its colour, and how much of it shows.
const MARK: [f32; 3] = [0.83, 0.18, 0.10];
const MARK_SHARE: f32 = 0.30;

/// Width and height of the first picture of a preview, pixels.
pub const SEEN: [u32; 2] = [SIZE * 3 / 2, SIZE];

/// What the trainee sees, a picture of the size [`SEEN`]; then from above, from the side nearest to the first decay, and cut
/// through that decay, side by side.
pub fn preview_png(scenario: &Scenario, workpiece: &Workpiece, seen: &Image) -> Vec<u8> {
    let share = |v: u8| f32::from(v) / 255.0;
    let pixels = seen.rgba.chunks(4).map(|p| [share(p[0]), share(p[1]), share(p[2]), 1.0]).collect();
    let first = Picture { width: seen.width, height: seen.height, pixels };
    let palette = Palette::of(&scenario.tissues);
    let decay = decay_alone(scenario, &workpiece.volume);
    let tooth = &workpiece.teeth[0];
    let middle = workpiece.lesions.first().map_or(0.5 * (tooth.crown_low + tooth.crown_high), |l| l.centre);
    let from = |side: Side| {
        let shot = Shot { camera: Camera::framing(side, &workpiece.volume, 1.0), width: SIZE, height: SIZE };
        let mut picture = march::iso(&workpiece.volume, &shot, |label, _| palette.tissue(label));
        if let Some(decay) = &decay {
            picture.lay_over(&marked(&march::iso(decay, &shot, |_, _| MARK)));
        }
        marks::on_paper(&picture, &shot, tooth.distal())
    };
    let shot = crown_shot(Side::Mesial, tooth_at(&workpiece.teeth, middle));
    let mut cut = march::slice(&workpiece.volume, &shot, middle, |label, _| palette.tissue(label));
    if let Some(decay) = &decay {
        cut.lay_over(&march::outline(decay, &shot, middle, MARK, LINE_WIDTH));
    }
    cut.lay_over(&march::outline(&workpiece.volume, &shot, middle, LINE, LINE_WIDTH));
    let sides = from(Side::Occlusal).beside(&from(nearest_side(workpiece, middle)));
    png(&first.beside(&sides).beside(&marks::on_paper(&cut, &shot, tooth.distal())))
}

/// The decay without the tooth.
fn decay_alone(scenario: &Scenario, volume: &Volume) -> Option<Volume> {
    let is_decay: [bool; 256] = std::array::from_fn(|l| scenario.tissues.role(Label(l as u8)) == Some(Role::Decay));
    surface::volume_of_mask(volume.grid(), |voxel| is_decay[usize::from(volume.tissue(voxel).0)], Label(1))
}

/// The side of the tooth to which a point is nearest.
fn nearest_side(workpiece: &Workpiece, point_in_tooth: Vec3) -> Side {
    let tooth = tooth_at(&workpiece.teeth, point_in_tooth);
    let (low, high) = (point_in_tooth - tooth.crown_low, tooth.crown_high - point_in_tooth);
    let sides = [(Side::Buccal, high.x), (Side::Lingual, low.x), (Side::Mesial, low.y), (Side::Distal, high.y)];
    sides.into_iter().min_by(|a, b| a.1.total_cmp(&b.1)).map_or(Side::Buccal, |(side, _)| side)
}

/// A veil where something hidden is, with a line around it.
fn marked(hidden: &Picture) -> Picture {
    let (width, height) = (hidden.width as usize, hidden.height as usize);
    let mut veil = Picture::clear(hidden.width, hidden.height);
    for (i, pixel) in veil.pixels.iter_mut().enumerate() {
        let (x, y) = (i % width, i / width);
        let rows = y.saturating_sub(1)..=(y + 1).min(height - 1);
        let around = rows.flat_map(|y| (x.saturating_sub(1)..=(x + 1).min(width - 1)).map(move |x| y * width + x));
        let covered = around.map(|n| hidden.pixels[n][3]);
        let (least, most) = covered.fold((1.0f32, 0.0f32), |(low, high), c| (low.min(c), high.max(c)));
        let share = (most - least).max(MARK_SHARE * hidden.pixels[i][3]);
        *pixel = [MARK[0] * share, MARK[1] * share, MARK[2] * share, share];
    }
    veil
}
