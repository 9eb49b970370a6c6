//! A tooth that came from elsewhere, cut three ways, so that its owner sees whether its tissues were told apart.

use super::tint::Palette;
use super::{LINE, LINE_WIDTH, SIZE, marks, png};
use crate::content::TissueTable;
use crate::frame::Vec3;
use crate::volume::march::{self, Camera, Shot, Side};
use crate::volume::{Label, Volume};

/// Two upright cuts through the middle of the tooth and a level one through the middle of its crown, side by side.
pub fn sections_png(volume: &Volume, tissues: &TissueTable) -> Vec<u8> {
    let palette = Palette::of(tissues);
    let enamel = tissues.by_name("enamel").map(|entry| entry.label());
    let whole = middle(volume, |_| true).unwrap_or_default();
    let crown = middle(volume, |label| Some(label) == enamel).unwrap_or(whole);
    let cut = |side: Side, through: Vec3| {
        let shot = Shot { camera: Camera::framing(side, volume, 1.0), width: SIZE, height: SIZE };
        let mut picture = march::slice(volume, &shot, through, |label, _| palette.tissue(label));
        picture.lay_over(&march::outline(volume, &shot, through, LINE, LINE_WIDTH));
        marks::with_scale(&picture, &shot)
    };
    let upright = Vec3::new(crown.x, crown.y, whole.z);
    png(&cut(Side::Mesial, upright).beside(&cut(Side::Buccal, upright)).beside(&cut(Side::Occlusal, crown)))
}

/// The middle of the solid voxels of some tissues, mm.
fn middle(volume: &Volume, is_meant: impl Fn(Label) -> bool) -> Option<Vec3> {
    let grid = volume.grid();
    let [nx, ny, _] = grid.dims;
    let is_meant: [bool; 256] = std::array::from_fn(|l| l != 0 && is_meant(Label(l as u8)));
    let voxels = |row: usize| (row * nx as usize..(row + 1) * nx as usize).zip(0u64..);
    // Whole numbers: sums over any volume are exact.
    let (mut sum, mut count) = ([0u64; 3], 0u64);
    for row in 0..grid.len() / nx as usize {
        let (mut along, mut own) = (0, 0);
        for (_, x) in voxels(row).filter(|&(index, _)| is_meant[usize::from(volume.tissue(index).0)]) {
            (along, own) = (along + x, own + 1);
        }
        let (y, z) = (row as u64 % u64::from(ny), row as u64 / u64::from(ny));
        sum = [sum[0] + along, sum[1] + own * y, sum[2] + own * z];
        count += own;
    }
    let mean = Vec3::from(sum.map(|s| (s as f64 / count.max(1) as f64) as f32));
    (count > 0).then(|| grid.origin + mean * grid.spacing)
}
