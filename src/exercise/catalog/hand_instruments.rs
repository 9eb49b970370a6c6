//! The working ends of hand instruments that cut, place and condense.
//!
//! Takes lengths from an instrument file. Gives the shapes used for touch and cutting, in handle space: +z along the
//! shaft toward the handle, the lowest point of the working end at the origin.

use schemars::JsonSchema;
use serde::Deserialize;
use typodont_core::frame::{Pose, Quat, Vec3};
use typodont_core::mesh::Mesh;
use typodont_core::touch::{Body, Profile, Shank};
use typodont_core::volume::{Grid, Label, Volume, surface};

/// Voxel size of a working end, mm: the edge of a blade is a few voxels wide.
const SPACING: f32 = 0.04;

/// Radius of a steel edge that has been sharpened often, mm.
const EDGE_ROUNDING: f32 = 0.06;

/// Diameters of the neck behind a working end and of the shaft, and length of the neck, mm: usual values for hand
/// instruments, which differ by some tenths of a millimetre.
const NECK: f32 = 0.9;
const SHAFT: f32 = 2.4;
const NECK_LENGTH: f32 = 9.0;

/// Height above which no part of an instrument can touch a tooth, mm.
const SHAFT_ENDS: f32 = 16.0;

/// The flat round face of a condenser or a carrier.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PluggerEntry {
    /// Diameter of the face, mm: 0.5 to 4. Amalgam condensers have 1.0 to 2.5, carriers' sleeves 1.5 to 3.
    #[schemars(range(min = 0.5, max = 4.0))]
    pub diameter_mm: f32,
}

impl PluggerEntry {
    pub(super) fn profile(&self) -> (Profile, Shank) {
        /// Height of the part with the face, mm.
        const HEIGHT: f32 = 2.0;
        let radius = 0.5 * self.diameter_mm;
        let profile = Profile::frustum(radius, 0.9 * radius, HEIGHT, [EDGE_ROUNDING; 2]);
        (profile, shank_behind(1.6 * radius, HEIGHT))
    }
}

/// The shallow bowl of a spoon excavator or a discoid carver.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SpoonEntry {
    /// Diameter of the bowl, mm: 0.8 to 4. Excavators have 1.0 to 2.0, discoid carvers 1.5 to 3.
    #[schemars(range(min = 0.8, max = 4.0))]
    pub diameter_mm: f32,
    /// Thickness of the bowl, mm: 0.2 to 1.5.
    #[schemars(range(min = 0.2, max = 1.5))]
    pub thickness_mm: f32,
}

impl SpoonEntry {
    /// The face of the bowl points sideways and slightly upward, as that of a contra-angled excavator.
    pub(super) fn body(&self) -> Body {
        let (distance, half, top) = self.solid();
        Body::with_shaft(&voxels(distance, half, top), self.shank())
    }

    /// Returns the neck and the shaft behind the bowl.
    pub fn shank(&self) -> Shank {
        let (_, _, top) = self.solid();
        shank_behind(NECK.min(0.7 * self.diameter_mm), 0.7 * top)
    }

    /// Returns the pose of the bowl in handle space. The bowl is an ellipsoid that is thin along its own z.
    pub fn handle_from_bowl(&self) -> Pose {
        /// Angle between the face and the shaft, radians: 55°.
        const TILT: f32 = 0.96;
        let orientation = Quat::from_rotation_y(TILT);
        // Extent of the tilted ellipsoid below its centre (its support function).
        let low = (orientation.conjugate() * Vec3::Z * self.half_axes()).length();
        Pose { position: Vec3::Z * low, orientation }
    }

    /// Returns half the axes of the bowl, mm.
    pub fn half_axes(&self) -> Vec3 {
        Vec3::new(0.5 * self.diameter_mm, 0.5 * self.diameter_mm, 0.5 * self.thickness_mm)
    }

    /// Returns the surface of the working end, for display; handle space, mm.
    pub fn visual_mesh(&self) -> Mesh {
        let (distance, half, top) = self.solid();
        surface::extract(&voxels(distance, half, top))
    }

    fn solid(&self) -> (impl Fn(Vec3) -> f32 + use<>, Vec3, f32) {
        let half = self.half_axes();
        let Pose { position: centre, orientation: face } = self.handle_from_bowl();
        let distance = move |p: Vec3| ellipsoid_distance(face.conjugate() * (p - centre), half);
        (distance, Vec3::splat(0.5 * self.diameter_mm), 2.0 * centre.z)
    }
}

/// The pointed blade of a cleoid carver.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CleoidEntry {
    /// Greatest width, mm: 0.8 to 3.
    #[schemars(range(min = 0.8, max = 3.0))]
    pub width_mm: f32,
    /// Width of the rounded point, mm: 0.2 to 1.
    #[schemars(range(min = 0.2, max = 1.0))]
    pub point_mm: f32,
    /// Length from the point to the greatest width, mm: 0.5 to 4.
    #[schemars(range(min = 0.5, max = 4.0))]
    pub length_mm: f32,
}

impl CleoidEntry {
    pub(super) fn profile(&self) -> (Profile, Shank) {
        let (point, wide) = (0.5 * self.point_mm, 0.5 * self.width_mm);
        let profile = Profile::round_ended(point, wide, self.length_mm);
        (profile, shank_behind(self.width_mm.min(NECK), self.length_mm))
    }
}

/// The thin blade of a plastic instrument.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BladeEntry {
    /// Width of the blade, mm: 1 to 4.
    #[schemars(range(min = 1.0, max = 4.0))]
    pub width_mm: f32,
    /// Thickness of the blade, mm: 0.3 to 1.
    #[schemars(range(min = 0.3, max = 1.0))]
    pub thickness_mm: f32,
}

impl BladeEntry {
    /// The flat side is perpendicular to the shaft, as that of a contra-angled instrument, so that the whole side
    /// presses.
    pub(super) fn body(&self) -> Body {
        let (distance, half, top) = self.solid();
        Body::with_shaft(&voxels(distance, half, top), self.shank())
    }

    /// Returns the neck and the shaft behind the blade.
    pub fn shank(&self) -> Shank {
        shank_behind(NECK, 0.7 * (2.0 * self.half_extent().z))
    }

    /// Returns half the length (handle space, along x), the width (y) and the thickness (z) of the blade, mm.
    pub fn half_extent(&self) -> Vec3 {
        /// Ratio of a blade's length to its width.
        const LONG: f32 = 1.6;
        Vec3::new(0.5 * self.width_mm * LONG, 0.5 * self.width_mm, 0.5 * self.thickness_mm)
    }

    /// Returns the surface of the working end, for display; handle space, mm.
    pub fn visual_mesh(&self) -> Mesh {
        let (distance, half, top) = self.solid();
        surface::extract(&voxels(distance, half, top))
    }

    fn solid(&self) -> (impl Fn(Vec3) -> f32 + use<>, Vec3, f32) {
        let half = self.half_extent();
        let rounding = 0.9 * half.z;
        let distance = move |p: Vec3| {
            let q = (p - Vec3::Z * half.z).abs() - (half - rounding);
            q.max(Vec3::ZERO).length() + q.max_element().min(0.0) - rounding
        };
        (distance, half, 2.0 * half.z)
    }
}

/// Returns the neck and the shaft behind a working end; `neck` is the diameter of the neck and `top` the height of the
/// working end, mm.
fn shank_behind(neck: f32, top: f32) -> Shank {
    Shank { neck, diameter: SHAFT, begins: top + NECK_LENGTH, ends: SHAFT_ENDS.max(top + NECK_LENGTH + 1.0) }
}

/// Returns a working end as a volume by its signed distance, from its lowest point at the origin to its top.
fn voxels(distance: impl Fn(Vec3) -> f32, half: Vec3, top: f32) -> Volume {
    let reach = Vec3::new(half.x, half.y, 0.0) + 4.0 * SPACING;
    let (low, high) = (-reach.with_z(4.0 * SPACING), reach.with_z(top + 4.0 * SPACING));
    let grid = Grid::covering(low, high, Vec3::splat(SPACING), 2);
    Volume::from_distance(grid, 1.5 * SPACING, |p| (distance(p), Label(1)))
}

/// Returns the approximate signed distance from an ellipsoid's surface, accurate near the surface: the scaled length
/// divided by its gradient.
fn ellipsoid_distance(p: Vec3, half: Vec3) -> f32 {
    let scaled = (p / half).length();
    let slope = (p / (half * half)).length();
    if slope > 1e-6 { scaled * (scaled - 1.0) / slope } else { -half.min_element() }
}
