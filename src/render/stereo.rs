//! Two eyes on one scene, and the ways to bring two pictures to two eyes.

use super::camera::Viewpoint;
use super::eye::{Eye, Window};
use super::scene::Rgb;

/// Both eyes, or one of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stereo {
    pub layout: Layout,
    /// mm. People's are about 63; less is easier on the eyes where the scene is near, because a mouth on a screen is larger
    /// than life. 0 to 80.
    pub eye_distance: f32,
}

/// How two pictures share a screen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layout {
    /// The left eye's picture in the left half, each squeezed to half its width.
    SideBySide,
    /// The left eye's picture in the upper half, each squeezed to half its height.
    TopBottom,
    /// Even rows from above are the left eye's: passive 3-D screens.
    Rows,
    /// For red-cyan glasses, red before the left eye.
    Anaglyph,
    /// One eye alone, for a window or projector of its own.
    Left,
    Right,
}

impl Stereo {
    /// The two frusta, left first: eyes side by side, both windows on the focus plane through the viewpoint's focus.
    pub fn eyes(&self, viewpoint: &Viewpoint, ratio: f32) -> [Eye; 2] {
        let middle = viewpoint.eye(ratio);
        [-0.5, 0.5].map(|side| {
            let aside = side * self.eye_distance;
            let shift = aside / viewpoint.focus_distance();
            let Window { left, right, .. } = middle.window;
            let window = Window { left: left - shift, right: right - shift, ..middle.window };
            Eye { position: middle.position + middle.right * aside, window, ..middle }
        })
    }
}

impl Layout {
    /// The size of each eye's own picture for a whole of this size.
    pub fn eye_size(self, [width, height]: [u32; 2]) -> [u32; 2] {
        match self {
            Layout::SideBySide => [width.div_ceil(2), height],
            Layout::TopBottom => [width, height.div_ceil(2)],
            _ => [width, height],
        }
    }

    /// Which eyes are looked through at all: left, right.
    pub fn needs(self) -> [bool; 2] {
        [self != Layout::Right, self != Layout::Left]
    }

    /// The number the shader knows a layout by.
    pub(super) fn code(self) -> u32 {
        match self {
            Layout::SideBySide => 0,
            Layout::TopBottom => 1,
            Layout::Rows => 2,
            Layout::Anaglyph => 3,
            Layout::Left => 4,
            Layout::Right => 5,
        }
    }
}

/// What red-cyan glasses let through of two pictures' linear light, as near to both as a screen's primaries allow: rows are
/// red, green, blue. E. Dubois, *A projection method to generate anaglyph stereo images*, ICASSP 2001, for CRT primaries.
pub(super) const DUBOIS: [[Rgb; 3]; 2] = [
    [[0.456, 0.500, 0.176], [-0.040, -0.038, -0.016], [-0.015, -0.021, -0.005]],
    [[-0.043, -0.088, -0.002], [0.378, 0.734, -0.018], [-0.072, -0.113, 1.226]],
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Vec3;

    #[test]
    fn parallax_is_what_geometry_says() {
        // Aim: none on the focus plane, crossed before it, uncrossed behind it. For eyes e apart, a focus plane at f and a
        // point at depth z, similar triangles give e * (z - f) / z on the focus plane.
        let (distance, focus) = (9.0f32, 80.0f32);
        let viewpoint = Viewpoint::looking(Vec3::new(5.0, 20.0, 80.0), Vec3::new(5.0, 20.0, 80.0 - focus), Vec3::Y);
        let eyes = Stereo { layout: Layout::Rows, eye_distance: distance }.eyes(&viewpoint, 1.5);
        let wide = (eyes[0].window.right - eyes[0].window.left) * focus;
        for z in [40.0f32, 60.0, 80.0, 120.0, 400.0] {
            let point = viewpoint.position + Vec3::new(0.07 * z, -0.04 * z, -z);
            let [left, right] = eyes.map(|eye| eye.place(point).0);
            let parallax = (right[0] - left[0]) * wide;
            let expected = distance * (z - focus) / z;
            assert!((parallax - expected).abs() < 1e-3, "depth {z}: {parallax} mm, not {expected}");
            assert!((left[1] - right[1]).abs() < 1e-6, "no parallax upward");
        }
    }

    #[test]
    fn white_stays_white_through_the_glasses() {
        for row in 0..3 {
            let sum: f32 = DUBOIS.iter().flat_map(|eye| eye[row]).sum();
            assert!((sum - 1.0).abs() < 0.01, "row {row}: {sum}");
        }
    }
}
