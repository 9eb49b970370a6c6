//! Stereo rendering: two eyes, and the layouts that present two images to them.

use super::camera::Viewpoint;
use super::eye::{Eye, FrustumWindow};
use super::scene::Rgb;

/// Stereo for both eyes, or for one of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stereo {
    pub layout: StereoLayout,
    /// Distance between the eyes, mm, 0 to 80. People's is about 63; less is easier on the eyes where the scene is
    /// near, because a mouth on a screen is larger than life. A negative distance exchanges the eyes' pictures.
    pub eye_distance: f32,
}

/// Layout of two images on a screen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StereoLayout {
    /// The left eye's image in the left half, each image squeezed to half its width.
    SideBySide,
    /// The left eye's image in the upper half, each image squeezed to half its height.
    TopBottom,
    /// The left eye's image in even rows, counted from the top: passive 3-D screens.
    Rows,
    /// For red-cyan glasses, with red in front of the left eye.
    Anaglyph,
    /// The left eye alone, for a window or projector of its own.
    Left,
    /// The right eye alone, for a window or projector of its own.
    Right,
}

impl Stereo {
    /// Returns the two eyes, left first: side by side, with frusta that agree on the focus plane through the
    /// viewpoint's focus.
    pub fn eyes(&self, viewpoint: &Viewpoint, aspect: f32) -> [Eye; 2] {
        let middle = viewpoint.eye(aspect);
        [-0.5, 0.5].map(|side| {
            let aside = side * self.eye_distance;
            let shift = aside / viewpoint.focus_distance();
            let FrustumWindow { left, right, .. } = middle.window;
            let window = FrustumWindow { left: left - shift, right: right - shift, ..middle.window };
            Eye { position: middle.position + middle.right * aside, window, ..middle }
        })
    }
}

impl StereoLayout {
    /// Returns the size of each eye's own image for a total size, pixels.
    pub fn eye_size(self, [width, height]: [u32; 2]) -> [u32; 2] {
        match self {
            StereoLayout::SideBySide => [width.div_ceil(2), height],
            StereoLayout::TopBottom => [width, height.div_ceil(2)],
            _ => [width, height],
        }
    }

    /// Returns which eyes are shown at all: left, right.
    pub fn visible_eyes(self) -> [bool; 2] {
        [self != StereoLayout::Right, self != StereoLayout::Left]
    }

    /// Returns the number that stands for the layout in the shader.
    #[cfg(feature = "gpu")]
    pub(super) fn shader_code(self) -> u32 {
        match self {
            StereoLayout::SideBySide => 0,
            StereoLayout::TopBottom => 1,
            StereoLayout::Rows => 2,
            StereoLayout::Anaglyph => 3,
            StereoLayout::Left => 4,
            StereoLayout::Right => 5,
        }
    }
}

/// Matrices from the linear light of the two images to that of an anaglyph for red-cyan glasses, as close to both
/// images as a screen's primaries allow: rows are red, green, blue. E. Dubois, *A projection method to generate
/// anaglyph stereo images*, ICASSP 2001, for CRT primaries.
pub(super) const DUBOIS: [[Rgb; 3]; 2] = [
    [[0.456, 0.500, 0.176], [-0.040, -0.038, -0.016], [-0.015, -0.021, -0.005]],
    [[-0.043, -0.088, -0.002], [0.378, 0.734, -0.018], [-0.072, -0.113, 1.226]],
];

#[cfg(test)]
mod tests {
    use super::*;
    use typodont_core::frame::Vec3;

    #[test]
    fn parallax_follows_from_similar_triangles() {
        // Aim: parallax is zero on the focus plane, crossed in front of it and uncrossed behind it. Method: for eyes
        // e apart, a focus plane at f and a point at depth z, similar triangles give e * (z - f) / z on the focus
        // plane.
        let (distance, focus) = (9.0f32, 80.0f32);
        let viewpoint = Viewpoint::look_at(Vec3::new(5.0, 20.0, 80.0), Vec3::new(5.0, 20.0, 80.0 - focus), Vec3::Y);
        let eyes = Stereo { layout: StereoLayout::Rows, eye_distance: distance }.eyes(&viewpoint, 1.5);
        let wide = (eyes[0].window.right - eyes[0].window.left) * focus;
        for z in [40.0f32, 60.0, 80.0, 120.0, 400.0] {
            let point = viewpoint.position + Vec3::new(0.07 * z, -0.04 * z, -z);
            let [left, right] = eyes.map(|eye| eye.project(point).0);
            let parallax = (right[0] - left[0]) * wide;
            let expected = distance * (z - focus) / z;
            assert!((parallax - expected).abs() < 1e-3, "depth {z}: {parallax} mm, not {expected}");
            assert!((left[1] - right[1]).abs() < 1e-6, "no vertical parallax");
        }
    }

    #[test]
    fn white_stays_white_in_an_anaglyph() {
        for row in 0..3 {
            let sum: f32 = DUBOIS.iter().flat_map(|eye| eye[row]).sum();
            assert!((sum - 1.0).abs() < 0.01, "row {row}: {sum}");
        }
    }
}
