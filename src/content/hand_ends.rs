//! The working ends of hand instruments that cut, lay and press.
//!
//! Takes an author's lengths. Gives the shapes that touch feels and cuts with, in handle space: +z along the shaft toward the
//! hand, the lowest place of the end at the origin.

use crate::frame::{Quat, Vec3};
use crate::mesh::Mesh;
use crate::touch::{Body, Profile, Shank};
use crate::volume::{Grid, Label, Volume, surface};
use schemars::JsonSchema;
use serde::Deserialize;

/// Voxels of an end, mm: a blade's edge is a few of them.
const SPACING: f32 = 0.04;

/// Rounding of a steel edge that has been sharpened often, mm.
const WORN: f32 = 0.06;

/// The neck behind an end, and the shaft it becomes, mm: usual of hand instruments, which differ by some tenths.
const NECK: f32 = 0.9;
const SHAFT: f32 = 2.4;
const NECK_LENGTH: f32 = 9.0;

/// Above this nothing of it can touch a tooth, mm.
const SHAFT_ENDS: f32 = 16.0;

/// A flat round face.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PluggerEntry {
    /// Diameter of the face, mm: 0.5 to 4. Amalgam condensers have 1.0 to 2.5, carriers' sleeves 1.5 to 3.
    #[schemars(range(min = 0.5, max = 4.0))]
    pub diameter_mm: f32,
}

impl PluggerEntry {
    pub(super) fn body(&self) -> Body {
        /// Height of the face's part, mm.
        const HEIGHT: f32 = 2.0;
        let radius = 0.5 * self.diameter_mm;
        let profile = Profile::frustum(radius, 0.9 * radius, HEIGHT, [WORN; 2]);
        Body::turned(profile, Some(behind(1.6 * radius, HEIGHT)))
    }
}

/// A shallow bowl.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SpoonEntry {
    /// Diameter of the bowl, mm: 0.8 to 4. Excavators have 1.0 to 2.0, a discoid 1.5 to 3.
    #[schemars(range(min = 0.8, max = 4.0))]
    pub diameter_mm: f32,
    /// How deep it bulges, mm: 0.2 to 1.5.
    #[schemars(range(min = 0.2, max = 1.5))]
    pub thickness_mm: f32,
}

impl SpoonEntry {
    /// The bowl's face looks aside and a little up, as that of a contra-angled excavator does.
    pub(super) fn body(&self) -> Body {
        let (distance, half, top) = self.solid();
        Body::of_end(&voxels(distance, half, top), behind(NECK.min(0.7 * self.diameter_mm), 0.7 * top))
    }

    /// Its surface, for drawing.
    pub fn drawing(&self) -> Mesh {
        let (distance, half, top) = self.solid();
        surface::extract(&voxels(distance, half, top))
    }

    fn solid(&self) -> (impl Fn(Vec3) -> f32 + use<>, Vec3, f32) {
        /// Between the face and the shaft, radians: 55°.
        const TILT: f32 = 0.96;
        let half = Vec3::new(0.5 * self.diameter_mm, 0.5 * self.diameter_mm, 0.5 * self.thickness_mm);
        let face = Quat::from_rotation_y(TILT);
        // An ellipsoid's support: how far it reaches down when it is tilted.
        let low = (face.conjugate() * Vec3::Z * half).length();
        let distance = move |p: Vec3| ellipsoid(face.conjugate() * (p - Vec3::Z * low), half);
        (distance, Vec3::splat(0.5 * self.diameter_mm), 2.0 * low)
    }
}

/// A pointed blade.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CleoidEntry {
    /// Width where it is widest, mm: 0.8 to 3.
    #[schemars(range(min = 0.8, max = 3.0))]
    pub width_mm: f32,
    /// Width of its rounded point, mm: 0.2 to 1.
    #[schemars(range(min = 0.2, max = 1.0))]
    pub point_mm: f32,
    /// From the point to where it is widest, mm: 0.5 to 4.
    #[schemars(range(min = 0.5, max = 4.0))]
    pub length_mm: f32,
}

impl CleoidEntry {
    pub(super) fn body(&self) -> Body {
        let (point, wide) = (0.5 * self.point_mm, 0.5 * self.width_mm);
        let profile = Profile::round_ended(point, wide, self.length_mm);
        Body::turned(profile, Some(behind(self.width_mm.min(NECK), self.length_mm)))
    }
}

/// A thin blade.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BladeEntry {
    /// Width of the blade, mm: 1 to 4.
    #[schemars(range(min = 1.0, max = 4.0))]
    pub width_mm: f32,
    /// Thickness, mm: 0.3 to 1.
    #[schemars(range(min = 0.3, max = 1.0))]
    pub thickness_mm: f32,
}

impl BladeEntry {
    /// The flat lies across the shaft, as that of a contra-angled instrument: it presses with all of it.
    pub(super) fn body(&self) -> Body {
        let (distance, half, top) = self.solid();
        Body::of_end(&voxels(distance, half, top), behind(NECK, 0.7 * top))
    }

    /// Its surface, for drawing.
    pub fn drawing(&self) -> Mesh {
        let (distance, half, top) = self.solid();
        surface::extract(&voxels(distance, half, top))
    }

    fn solid(&self) -> (impl Fn(Vec3) -> f32 + use<>, Vec3, f32) {
        /// How much longer a blade is than wide.
        const LONG: f32 = 1.6;
        let half = Vec3::new(0.5 * self.width_mm * LONG, 0.5 * self.width_mm, 0.5 * self.thickness_mm);
        let rounding = 0.9 * half.z;
        let distance = move |p: Vec3| {
            let q = (p - Vec3::Z * half.z).abs() - (half - rounding);
            q.max(Vec3::ZERO).length() + q.max_element().min(0.0) - rounding
        };
        (distance, half, 2.0 * half.z)
    }
}

/// The neck and shaft behind an end that is so high.
fn behind(neck: f32, top: f32) -> Shank {
    Shank { neck, diameter: SHAFT, begins: top + NECK_LENGTH, ends: SHAFT_ENDS.max(top + NECK_LENGTH + 1.0) }
}

/// An end by its signed distance, from its lowest place at the origin to its top.
fn voxels(distance: impl Fn(Vec3) -> f32, half: Vec3, top: f32) -> Volume {
    let reach = Vec3::new(half.x, half.y, 0.0) + 4.0 * SPACING;
    let (low, high) = (-reach.with_z(4.0 * SPACING), reach.with_z(top + 4.0 * SPACING));
    let grid = Grid::covering(low, high, Vec3::splat(SPACING), 2);
    Volume::from_distance(grid, 1.5 * SPACING, |p| (distance(p), Label(1)))
}

/// Distance from an ellipsoid's surface, good near it: its scaled length over the length of its slope.
fn ellipsoid(p: Vec3, half: Vec3) -> f32 {
    let scaled = (p / half).length();
    let slope = (p / (half * half)).length();
    if slope > 1e-6 { scaled * (scaled - 1.0) / slope } else { -half.min_element() }
}
