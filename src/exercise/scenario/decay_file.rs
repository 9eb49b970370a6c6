//! Decay and stains in the scenario file.

use schemars::JsonSchema;
use serde::Deserialize;

/// A carious lesion.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DecayFile {
    /// Name by which questions refer to the decay: lower-case letters, digits, hyphens, underscores.
    #[schemars(length(min = 1, max = 40), regex(pattern = r"^[a-z0-9_-]+$"))]
    pub id: String,
    /// Tissue of which the decay is made.
    #[serde(default = "caries")]
    pub tissue: String,
    /// Shape of the decay. Only the part within the tooth's hard tissue counts.
    pub shape: DecayShapeFile,
    /// Surface on which the decay lies.
    #[serde(default)]
    pub surface: SurfaceFile,
    /// Position on that surface.
    #[serde(default)]
    pub at: DecayPlaceFile,
    /// Depth of the centre of a sphere or an ellipsoid below the surface, mm: -3 (above the surface) to 8.
    #[serde(default)]
    #[schemars(range(min = -3.0, max = 8.0))]
    pub depth_mm: f32,
    /// Outer part of a fissure or smooth-surface lesion, for example of firmer decay. If omitted, the whole lesion
    /// consists of one tissue.
    #[serde(default)]
    pub rim: Option<RimFile>,
}

/// A stain.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StainFile {
    /// Name of the stain: lower-case letters, digits, hyphens, underscores.
    #[schemars(length(min = 1, max = 40), regex(pattern = r"^[a-z0-9_-]+$"))]
    pub id: String,
    /// Tissue of which the stain is made.
    #[serde(default = "stain")]
    pub tissue: String,
    /// Shape of the stain. Only the part within the tooth's sound tissue counts.
    pub shape: DecayShapeFile,
    /// Surface on which the stain lies.
    #[serde(default)]
    pub surface: SurfaceFile,
    /// Position on that surface.
    #[serde(default)]
    pub at: DecayPlaceFile,
    /// Depth of the centre of a sphere or an ellipsoid below the surface, mm: -3 (above the surface) to 8.
    #[serde(default)]
    #[schemars(range(min = -3.0, max = 8.0))]
    pub depth_mm: f32,
}

fn stain() -> String {
    "stain".into()
}

/// The outer part of a lesion.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RimFile {
    /// Tissue of which the rim is made.
    pub tissue: String,
    /// Extent of the rim, as a share of the distance from the lesion's border to its core: 0.05 to 0.95.
    #[serde(default = "half")]
    #[schemars(range(min = 0.05, max = 0.95))]
    pub share: f32,
}

fn half() -> f32 {
    0.5
}

fn caries() -> String {
    "caries".into()
}

/// Shape of a decay.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum DecayShapeFile {
    /// A sphere.
    Sphere(SphereFile),
    /// An ellipsoid along the axes of tooth space.
    Ellipsoid(EllipsoidFile),
    /// A lesion that follows the groove of the occlusal surface nearest to its position, and spreads under the enamel.
    Fissure(FissureFile),
    /// A lesion that enters through a smooth surface, narrows in the enamel and spreads beneath it. On a root it begins
    /// in the dentine.
    Smooth(SmoothFile),
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FissureFile {
    /// Depth of the lesion. If several depths are given, the session's seed selects one of them.
    #[schemars(length(min = 1, max = 5))]
    pub reaches: Vec<LesionDepthFile>,
    /// Length of the lesion along the groove, mm: 0.5 to 15.
    #[schemars(range(min = 0.5, max = 15.0))]
    pub length_mm: f32,
    /// Spread of the lesion to each side along the enamel–dentine junction, mm: 0.2 to 4.
    #[serde(default = "one_mm")]
    #[schemars(range(min = 0.2, max = 4.0))]
    pub spread_mm: f32,
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SmoothFile {
    /// Depth of the lesion. If several depths are given, the session's seed selects one of them.
    #[schemars(length(min = 1, max = 5))]
    pub reaches: Vec<LesionDepthFile>,
    /// Width on the surface, along the first of the two directions that `offset_mm` has on this surface, mm: 0.4 to 10.
    #[schemars(range(min = 0.4, max = 10.0))]
    pub width_mm: f32,
    /// Height on the surface, mm: 0.4 to 10.
    #[schemars(range(min = 0.4, max = 10.0))]
    pub height_mm: f32,
    /// Spread of the lesion to each side along the enamel–dentine junction, mm: 0.2 to 4.
    #[serde(default = "one_mm")]
    #[schemars(range(min = 0.2, max = 4.0))]
    pub spread_mm: f32,
}

fn one_mm() -> f32 {
    1.0
}

/// Depth of a lesion, by the radiographic scores of ICCMS (2014).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LesionDepthFile {
    /// RA1: the outer half of the enamel.
    OuterEnamel,
    /// RA2: the inner half of the enamel.
    InnerEnamel,
    /// RA3: the outer third of the dentine.
    OuterDentine,
    /// RB4: the middle third of the dentine.
    MiddleDentine,
    /// RC5: the inner third of the dentine, short of the pulp.
    InnerDentine,
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SphereFile {
    /// Radius, mm: 0.2 to 6.
    #[schemars(range(min = 0.2, max = 6.0))]
    pub radius_mm: f32,
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EllipsoidFile {
    /// Semi-axes: buccolingual, mesiodistal, occlusoapical.
    pub radii_mm: [RadiusFile; 3],
}

/// Semi-axis, mm: 0.2 to 6.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct RadiusFile(#[schemars(range(min = 0.2, max = 6.0))] pub f32);

/// Surface of a tooth: mesial, occlusal, distal, buccal or lingual.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
pub enum SurfaceFile {
    M,
    #[default]
    O,
    D,
    B,
    L,
}

/// Position of decay on a surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum DecayPlaceFile {
    /// The centre of the surface.
    #[default]
    Centre,
    /// One of the four quadrants of the occlusal surface, selected by the session's seed.
    RandomQuadrant,
    /// Any position on the surface, selected by the session's seed.
    Random,
    /// A quadrant of the occlusal surface, as seen by the trainee from above: 1 upper left, 2 upper right, 3 lower
    /// left, 4 lower right.
    Quadrant(#[schemars(range(min = 1, max = 4))] u8),
    /// Offset from the centre of the surface, mm: buccal and distal on the occlusal surface, distal and occlusal on the
    /// buccal and lingual surfaces, buccal and occlusal on the mesial and distal surfaces.
    OffsetMm([OffsetFile; 2]),
}

/// Offset, mm: -8 to 8.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct OffsetFile(#[schemars(range(min = -8.0, max = 8.0))] pub f32);
