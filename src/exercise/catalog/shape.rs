//! Working ends whose shape is a file: a closed surface, or voxels.
//!
//! Takes the keys of an instrument file. Holds the shape once the exercise has been resolved. Never reads a file.

use schemars::JsonSchema;
use serde::Deserialize;
use std::sync::Arc;
use typodont_core::frame::{Pose, Vec3, rotation_about_axes};
use typodont_core::mesh::Mesh;
use typodont_core::touch::Body;

/// An instrument of any shape, from a file of its own. It is drawn as it is felt.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ShapeEntry {
    /// File with the shape of the instrument, relative to the scenario's folder: a closed surface (.stl, .ply or .obj),
    /// or a label map in which 0 is air and every other number is the instrument (.nrrd, .nii or .nii.gz). What is
    /// farther than 20 mm from the tip is drawn but makes no contact.
    #[schemars(length(min = 1, max = 500))]
    pub file: String,
    /// Unit of the lengths in the file; millimetres if omitted.
    #[serde(default)]
    pub unit: LengthUnitEntry,
    /// Position of the file's origin, mm, after the rotation. The tip of the instrument must come to lie at [0, 0, 0],
    /// with +z along the shaft toward the handle.
    #[serde(default)]
    pub position_mm: [ShapeCoordinateEntry; 3],
    /// Rotation of the shape about the x, then the y, then the z axis, degrees.
    #[serde(default)]
    pub orientation_deg: [ShapeAngleEntry; 3],
    /// Part of the instrument that cuts; the rest only makes contact. If omitted, the whole instrument cuts, provided
    /// that it cuts at all.
    #[serde(default)]
    pub cutting: Option<CuttingPartEntry>,
    /// The shape as read from the file; `None` before the exercise has been resolved.
    #[serde(skip)]
    pub sampled: Option<Arc<SampledEnd>>,
}

/// Part of an instrument that cuts.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum CuttingPartEntry {
    /// Length of the cutting part along the shaft from the tip, mm: 0.1 to 20.
    LengthMm(CuttingLengthEntry),
    /// File with the shape of the cutting part, with the unit, position and rotation of the instrument's file.
    File(#[schemars(length(min = 1, max = 500))] String),
}

/// Length, mm: 0.1 to 20.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct CuttingLengthEntry(#[schemars(range(min = 0.1, max = 20.0))] pub f32);

/// Coordinate, mm: -200 to 200.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct ShapeCoordinateEntry(#[schemars(range(min = -200.0, max = 200.0))] pub f32);

/// Angle, degrees: -180 to 180.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct ShapeAngleEntry(#[schemars(range(min = -180.0, max = 180.0))] pub f32);

/// Unit of length of a file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LengthUnitEntry {
    #[default]
    Mm,
    Cm,
    M,
    /// Micrometres.
    Um,
    /// Inches.
    In,
}

impl LengthUnitEntry {
    /// Length of the unit, mm.
    pub fn mm(self) -> f32 {
        match self {
            LengthUnitEntry::Mm => 1.0,
            LengthUnitEntry::Cm => 10.0,
            LengthUnitEntry::M => 1000.0,
            LengthUnitEntry::Um => 0.001,
            LengthUnitEntry::In => 25.4,
        }
    }
}

/// Shape of an instrument, read from its file; handle space, mm.
#[derive(Clone, Debug)]
pub struct SampledEnd {
    /// Shape that is felt.
    pub body: Arc<Body>,
    /// Surface of which the felt shape was made, for display; each triangle has its own corners and normal.
    pub surface: Arc<Mesh>,
}

impl ShapeEntry {
    /// Returns the names of the files of the shape.
    pub fn files(&self) -> impl Iterator<Item = &str> {
        let cutting = match &self.cutting {
            Some(CuttingPartEntry::File(name)) => Some(name.as_str()),
            Some(CuttingPartEntry::LengthMm(_)) | None => None,
        };
        std::iter::once(self.file.as_str()).chain(cutting)
    }

    /// Returns the pose of the file's space in handle space, after its lengths have been converted to mm.
    pub fn handle_from_file(&self) -> Pose {
        let orientation = rotation_about_axes(self.orientation_deg.map(|angle| angle.0));
        Pose { position: Vec3::from(self.position_mm.map(|c| c.0)), orientation }
    }

    /// Returns the distance from the instrument's reference point to a plane that it touches, mm; 0 before the exercise
    /// has been resolved. `normal` points out of the plane, handle space.
    pub fn support(&self, normal: Vec3) -> f32 {
        let points = self.sampled.iter().flat_map(|end| end.body.surface_points());
        points.map(|point| -point.position.dot(normal)).reduce(f32::max).unwrap_or(0.0)
    }
}
