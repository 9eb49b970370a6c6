//! Where a picture is taken from.

use crate::frame::Vec3;
use crate::volume::Volume;

/// A side of a tooth, in tooth space.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    Occlusal,
    Buccal,
    Lingual,
    Mesial,
    Distal,
    Apical,
}

impl Side {
    pub const ALL: [Side; 6] = [Side::Occlusal, Side::Buccal, Side::Lingual, Side::Mesial, Side::Distal, Side::Apical];

    /// To the right and upward in a picture from this side, in tooth space. Seen from above the buccal side is up, as for
    /// the trainee; from all around the crown is up.
    pub fn right_and_up(self) -> [Vec3; 2] {
        match self {
            Side::Occlusal => [Vec3::NEG_Y, Vec3::X],
            Side::Apical => [Vec3::Y, Vec3::X],
            Side::Buccal => [Vec3::Y, Vec3::Z],
            Side::Lingual => [Vec3::NEG_Y, Vec3::Z],
            Side::Mesial => [Vec3::X, Vec3::Z],
            Side::Distal => [Vec3::NEG_X, Vec3::Z],
        }
    }
}

/// An orthographic camera: what is a millimetre in the tooth is as long everywhere in the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// In the middle of the picture, in tooth space, mm.
    pub middle: Vec3,
    /// Unit, across each other.
    pub right: Vec3,
    pub up: Vec3,
    /// From the middle of the picture to its upper edge, mm.
    pub half_height: f32,
}

/// Empty space around what a camera frames, as a share of the picture.
const MARGIN: f32 = 0.06;

impl Camera {
    /// Sees all matter of a volume from a side; `ratio` is the picture's width by its height.
    pub fn framing(side: Side, volume: &Volume, ratio: f32) -> Camera {
        let grid = volume.grid();
        let [low, high] = match volume.tight_box() {
            Some([low, high]) => [grid.centre(low), grid.centre(high)],
            None => grid.extent(),
        };
        Camera::around(side, low, high, ratio)
    }

    /// Sees all of a box in tooth space from a side.
    pub fn around(side: Side, low: Vec3, high: Vec3, ratio: f32) -> Camera {
        let [right, up] = side.right_and_up();
        let size = high - low;
        let (width, height) = (size.dot(right).abs(), size.dot(up).abs());
        let half_height = 0.5 * height.max(width / ratio) / (1.0 - 2.0 * MARGIN);
        Camera { middle: 0.5 * (low + high), right, up, half_height }
    }

    /// From the tooth to the eye.
    pub fn back(&self) -> Vec3 {
        self.right.cross(self.up)
    }
}

/// A camera and the size of its picture in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shot {
    pub camera: Camera,
    pub width: u32,
    pub height: u32,
}

impl Shot {
    /// Width of a pixel, mm.
    pub fn pixel(&self) -> f32 {
        2.0 * self.camera.half_height / self.height as f32
    }

    /// The point of the camera's plane under a place in the picture; x right, y down, in pixels.
    pub fn point(&self, x: f32, y: f32) -> Vec3 {
        let Camera { middle, right, up, .. } = self.camera;
        let from_middle = |v: f32, count: u32| (v - 0.5 * count as f32) * self.pixel();
        middle + right * from_middle(x, self.width) - up * from_middle(y, self.height)
    }

    /// Where in the picture a point of tooth space is seen, in pixels.
    pub fn place(&self, point_in_tooth: Vec3) -> [f32; 2] {
        let Camera { middle, right, up, .. } = self.camera;
        let from_middle = (point_in_tooth - middle) / self.pixel();
        [0.5 * self.width as f32 + from_middle.dot(right), 0.5 * self.height as f32 - from_middle.dot(up)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_side_is_seen_from_where_its_name_says() {
        let from = [Vec3::Z, Vec3::X, Vec3::NEG_X, Vec3::NEG_Y, Vec3::Y, Vec3::NEG_Z];
        for (side, from) in Side::ALL.into_iter().zip(from) {
            assert_eq!(Camera::around(side, Vec3::ZERO, Vec3::ONE, 1.0).back(), from, "{side:?}");
        }
    }

    #[test]
    fn a_framed_box_lies_within_the_picture_whatever_its_shape() {
        let (low, high) = (Vec3::new(-4.0, -5.0, -13.0), Vec3::new(5.0, 6.0, 7.0));
        for side in Side::ALL {
            for (width, height) in [(480, 480), (640, 360), (200, 500)] {
                let camera = Camera::around(side, low, high, width as f32 / height as f32);
                let shot = Shot { camera, width, height };
                for corner in [low, high] {
                    let [x, y] = shot.place(corner);
                    assert!(x > 0.0 && x < width as f32 && y > 0.0 && y < height as f32, "{side:?} {x} {y}");
                    let point = shot.point(x, y);
                    assert!((point - corner).cross(camera.back()).length() < 1e-4);
                }
            }
        }
    }
}
