//! Three sections of an imported tooth, so that its author can check the segmentation of its tissues.

use super::verdict_colours::TissueColours;
use super::{CONTOUR, CONTOUR_WIDTH, SIZE, annotations, encode_png};
use crate::raycast;
use crate::raycast::{ImagePlane, OrthographicCamera, ViewSide};
use typodont_core::frame::Vec3;
use typodont_core::volume::{Label, Volume};
use typodont_exercise::catalog::TissueTable;

/// Two upright cuts through the middle of the tooth and a level one through the middle of its crown, side by side.
pub fn sections_png(volume: &Volume, tissues: &TissueTable) -> Vec<u8> {
    let palette = TissueColours::of(tissues);
    let enamel = tissues.by_name("enamel").map(|entry| entry.label());
    let whole = centre_of_voxels(volume, |_| true).unwrap_or_default();
    let crown = centre_of_voxels(volume, |label| Some(label) == enamel).unwrap_or(whole);
    let cut = |side: ViewSide, through: Vec3| {
        let shot =
            ImagePlane { camera: OrthographicCamera::framing_volume(side, volume, 1.0), width: SIZE, height: SIZE };
        let mut picture = raycast::slice(volume, &shot, through, |label, _| palette.tissue(label));
        picture.composite(&raycast::contour(volume, &shot, through, CONTOUR, CONTOUR_WIDTH));
        annotations::annotate(&picture, &shot, None)
    };
    let upright = Vec3::new(crown.x, crown.y, whole.z);
    encode_png(
        &cut(ViewSide::Mesial, upright)
            .hconcat(&cut(ViewSide::Buccal, upright))
            .hconcat(&cut(ViewSide::Occlusal, crown)),
    )
}

/// The middle of the solid voxels of some tissues, mm.
fn centre_of_voxels(volume: &Volume, is_wanted: impl Fn(Label) -> bool) -> Option<Vec3> {
    let grid = volume.grid();
    let [nx, ny, _] = grid.dims;
    let is_wanted_label: [bool; 256] = std::array::from_fn(|l| l != 0 && is_wanted(Label(l as u8)));
    let voxels = |row: usize| (row * nx as usize..(row + 1) * nx as usize).zip(0u64..);
    // Whole numbers: sums over any volume are exact.
    let (mut sum, mut count) = ([0u64; 3], 0u64);
    for row in 0..grid.len() / nx as usize {
        let (mut along, mut own) = (0, 0);
        for (_, x) in voxels(row).filter(|&(index, _)| is_wanted_label[usize::from(volume.tissue(index).0)]) {
            (along, own) = (along + x, own + 1);
        }
        let (y, z) = (row as u64 % u64::from(ny), row as u64 / u64::from(ny));
        sum = [sum[0] + along, sum[1] + own * y, sum[2] + own * z];
        count += own;
    }
    let mean = Vec3::from(sum.map(|s| (s as f64 / count.max(1) as f64) as f32));
    (count > 0).then(|| grid.origin + mean * grid.spacing)
}
