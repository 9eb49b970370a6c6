//! Two pictures to one. Twin of `stereo_pass.wgsl`.

use crate::stereo::{DUBOIS, StereoLayout};
use typodont_core::image::RgbaImage;

/// Brings the pictures of the left and the right eye to one screen of a size; each has the layout's `eye_size`.
pub fn stereo_pass(eyes: [&RgbaImage; 2], layout: StereoLayout, [width, height]: [u32; 2]) -> RgbaImage {
    let [left, right] = eyes;
    let at = |x: u32, y: u32| match layout {
        StereoLayout::SideBySide if x < left.width => left.pixel(x, y),
        StereoLayout::SideBySide => right.pixel(x - left.width, y),
        StereoLayout::TopBottom if y < left.height => left.pixel(x, y),
        StereoLayout::TopBottom => right.pixel(x, y - left.height),
        StereoLayout::Rows if y.is_multiple_of(2) => left.pixel(x, y),
        StereoLayout::Rows => right.pixel(x, y),
        StereoLayout::Anaglyph => anaglyph([left.pixel(x, y), right.pixel(x, y)]),
        StereoLayout::Left => left.pixel(x, y),
        StereoLayout::Right => right.pixel(x, y),
    };
    let rgba = (0..height).flat_map(|y| (0..width).flat_map(move |x| at(x, y))).collect();
    RgbaImage { width, height, rgba }
}

fn anaglyph(pixels: [[u8; 4]; 2]) -> [u8; 4] {
    let mut sum = [0.0f32; 3];
    for (pixel, matrix) in pixels.into_iter().zip(DUBOIS) {
        let linear = [0, 1, 2].map(|c| linear(f32::from(pixel[c]) / 255.0));
        for (sum, row) in sum.iter_mut().zip(matrix) {
            *sum += row[0] * linear[0] + row[1] * linear[1] + row[2] * linear[2];
        }
    }
    let [r, g, b] = sum.map(|v| (encoded(v.clamp(0.0, 1.0)) * 255.0 + 0.5) as u8);
    [r, g, b, u8::MAX]
}

/// A screen's value as linear light (IEC 61966-2-1).
fn linear(value: f32) -> f32 {
    if value <= 0.04045 { value / 12.92 } else { libm::powf((value + 0.055) / 1.055, 2.4) }
}

fn encoded(value: f32) -> f32 {
    if value <= 0.0031308 { value * 12.92 } else { 1.055 * libm::powf(value, 1.0 / 2.4) - 0.055 }
}
