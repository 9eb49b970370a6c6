//! Orthographic cameras that view a tooth from one of its sides.

use typodont_core::aabb::Aabb;
use typodont_core::frame::Vec3;
use typodont_core::volume::Volume;

/// A side of a tooth, in tooth space.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ViewSide {
    Occlusal,
    Buccal,
    Lingual,
    Mesial,
    Distal,
    Apical,
}

impl ViewSide {
    pub const ALL: [ViewSide; 6] =
        [ViewSide::Occlusal, ViewSide::Buccal, ViewSide::Lingual, ViewSide::Mesial, ViewSide::Distal, ViewSide::Apical];

    /// To the right and upward in a picture from this side, in tooth space. Seen from above the buccal side is up, as for
    /// the trainee; from all around the crown is up.
    pub fn right_and_up(self) -> [Vec3; 2] {
        match self {
            ViewSide::Occlusal => [Vec3::NEG_Y, Vec3::X],
            ViewSide::Apical => [Vec3::Y, Vec3::X],
            ViewSide::Buccal => [Vec3::Y, Vec3::Z],
            ViewSide::Lingual => [Vec3::NEG_Y, Vec3::Z],
            ViewSide::Mesial => [Vec3::X, Vec3::Z],
            ViewSide::Distal => [Vec3::NEG_X, Vec3::Z],
        }
    }
}

/// An orthographic camera: a millimetre has the same length everywhere in the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrthographicCamera {
    /// Point at the middle of the picture, in tooth space, mm.
    pub middle: Vec3,
    /// Unit, across each other.
    pub right: Vec3,
    pub up: Vec3,
    /// From the middle of the picture to its upper edge, mm.
    pub half_height: f32,
}

/// Empty space around what a camera frames, as a share of the picture.
const MARGIN: f32 = 0.06;

impl OrthographicCamera {
    /// Sees all matter of a volume from a side; `ratio` is the picture's width by its height.
    pub fn framing_volume(side: ViewSide, volume: &Volume, ratio: f32) -> OrthographicCamera {
        OrthographicCamera::framing_box(side, &volume.extent(), ratio)
    }

    /// Sees all of a box in tooth space from a side.
    pub fn framing_box(side: ViewSide, bounds: &Aabb, ratio: f32) -> OrthographicCamera {
        let [right, up] = side.right_and_up();
        let size = bounds.size();
        let (width, height) = (size.dot(right).abs(), size.dot(up).abs());
        let half_height = 0.5 * height.max(width / ratio) / (1.0 - 2.0 * MARGIN);
        OrthographicCamera { middle: bounds.centre(), right, up, half_height }
    }

    /// The same camera, or one that sees the plane of a section so that mesial is on the left: an upright section from its
    /// other side, a level one turned by half. `distal` is the distal direction in tooth space.
    pub fn with_mesial_left(self, distal: Vec3) -> OrthographicCamera {
        if self.right.dot(distal) > -0.5 {
            return self;
        }
        let is_level = self.up.z == 0.0;
        OrthographicCamera { right: -self.right, up: if is_level { -self.up } else { self.up }, ..self }
    }

    /// From the tooth to the eye.
    pub fn back(&self) -> Vec3 {
        self.right.cross(self.up)
    }
}

/// A camera and the size of its picture in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImagePlane {
    pub camera: OrthographicCamera,
    pub width: u32,
    pub height: u32,
}

impl ImagePlane {
    /// Width of a pixel, mm.
    pub fn pixel_mm(&self) -> f32 {
        2.0 * self.camera.half_height / self.height as f32
    }

    /// The point of the camera's plane under a place in the picture; x right, y down, in pixels.
    pub fn unproject(&self, x: f32, y: f32) -> Vec3 {
        let OrthographicCamera { middle, right, up, .. } = self.camera;
        let from_middle = |v: f32, count: u32| (v - 0.5 * count as f32) * self.pixel_mm();
        middle + right * from_middle(x, self.width) - up * from_middle(y, self.height)
    }

    /// Position in the picture, pixels, of a point in tooth space.
    pub fn project(&self, point_in_tooth: Vec3) -> [f32; 2] {
        let OrthographicCamera { middle, right, up, .. } = self.camera;
        let from_middle = (point_in_tooth - middle) / self.pixel_mm();
        [0.5 * self.width as f32 + from_middle.dot(right), 0.5 * self.height as f32 - from_middle.dot(up)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_side_is_seen_from_where_its_name_says() {
        let from = [Vec3::Z, Vec3::X, Vec3::NEG_X, Vec3::NEG_Y, Vec3::Y, Vec3::NEG_Z];
        for (side, from) in ViewSide::ALL.into_iter().zip(from) {
            assert_eq!(
                OrthographicCamera::framing_box(side, &Aabb::new(Vec3::ZERO, Vec3::ONE), 1.0).back(),
                from,
                "{side:?}"
            );
        }
    }

    #[test]
    fn sections_that_show_mesial_have_it_on_the_left() {
        for distal in [Vec3::Y, Vec3::NEG_Y] {
            for side in [ViewSide::Mesial, ViewSide::Buccal, ViewSide::Occlusal] {
                let camera = OrthographicCamera::framing_box(side, &Aabb::new(Vec3::ZERO, Vec3::ONE), 1.0)
                    .with_mesial_left(distal);
                let expected = if side == ViewSide::Mesial { 0.0 } else { 1.0 };
                assert_eq!(camera.right.dot(distal), expected, "{side:?}");
                // An upright section has the crown up; a level one is seen from above.
                assert_eq!(if side == ViewSide::Occlusal { camera.back().z } else { camera.up.z }, 1.0, "{side:?}");
            }
        }
    }

    #[test]
    fn a_framed_box_lies_within_the_picture_whatever_its_shape() {
        let bounds = Aabb::new(Vec3::new(-4.0, -5.0, -13.0), Vec3::new(5.0, 6.0, 7.0));
        for side in ViewSide::ALL {
            for (width, height) in [(480, 480), (640, 360), (200, 500)] {
                let camera = OrthographicCamera::framing_box(side, &bounds, width as f32 / height as f32);
                let shot = ImagePlane { camera, width, height };
                for corner in [bounds.low, bounds.high] {
                    let [x, y] = shot.project(corner);
                    assert!(x > 0.0 && x < width as f32 && y > 0.0 && y < height as f32, "{side:?} {x} {y}");
                    let point = shot.unproject(x, y);
                    assert!((point - corner).cross(camera.back()).length() < 1e-4);
                }
            }
        }
    }
}
