//! Decay and stain as an author writes them.

use schemars::JsonSchema;
use serde::Deserialize;

/// One decayed place.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DecayFile {
    /// Name by which questions refer to the decay: small letters, digits, hyphens, underscores.
    #[schemars(length(min = 1, max = 40), regex(pattern = r"^[a-z0-9_-]+$"))]
    pub id: String,
    /// Tissue of which the decay is made.
    #[serde(default = "caries")]
    pub tissue: String,
    /// Shape of the decay; only its part within the tooth's hard tissue counts.
    pub shape: DecayShapeFile,
    /// Surface on which the decay lies.
    #[serde(default)]
    pub surface: SurfaceFile,
    /// Where on that surface.
    #[serde(default)]
    pub at: DecayPlaceFile,
    /// How deep a sphere's or ellipsoid's centre lies under the surface, mm: -3 (above it) to 8.
    #[serde(default)]
    #[schemars(range(min = -3.0, max = 8.0))]
    pub depth_mm: f32,
    /// What lies around the core of a fissure or smooth lesion: firmer decay, say. Without it all of it is of one tissue.
    #[serde(default)]
    pub rim: Option<RimFile>,
}

/// One stained place.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StainFile {
    /// Name of the place: small letters, digits, hyphens, underscores.
    #[schemars(length(min = 1, max = 40), regex(pattern = r"^[a-z0-9_-]+$"))]
    pub id: String,
    /// Tissue of which the stain is made.
    #[serde(default = "stain")]
    pub tissue: String,
    /// Shape of the stain; only its part within the tooth's sound tissue counts.
    pub shape: DecayShapeFile,
    /// Surface on which the stain lies.
    #[serde(default)]
    pub surface: SurfaceFile,
    /// Where on that surface.
    #[serde(default)]
    pub at: DecayPlaceFile,
    /// How deep a sphere's or ellipsoid's centre lies under the surface, mm: -3 (above it) to 8.
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
    /// How far it reaches from the lesion's border toward its core, as a share of that way: 0.05 to 0.95.
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
    Sphere(SphereFile),
    Ellipsoid(EllipsoidFile),
    /// Follows the groove of the chewing surface that is nearest to the place, and spreads under the enamel.
    Fissure(FissureFile),
    /// Comes in through a smooth surface, narrows in the enamel and spreads under it; on a root it begins in the dentine.
    Smooth(SmoothFile),
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FissureFile {
    /// How deep it has come; of several one is drawn by the session's seed.
    #[schemars(length(min = 1, max = 5))]
    pub reaches: Vec<ReachFile>,
    /// How long it is, by way of the groove, mm: 0.5 to 15.
    #[schemars(range(min = 0.5, max = 15.0))]
    pub length_mm: f32,
    /// How far it has spread to each side along the border of enamel and dentine, mm: 0.2 to 4.
    #[serde(default = "one_mm")]
    #[schemars(range(min = 0.2, max = 4.0))]
    pub spread_mm: f32,
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SmoothFile {
    /// How deep it has come; of several one is drawn by the session's seed.
    #[schemars(length(min = 1, max = 5))]
    pub reaches: Vec<ReachFile>,
    /// Width on the surface, along the first of the surface's two directions as `offset_mm` has them, mm: 0.4 to 10.
    #[schemars(range(min = 0.4, max = 10.0))]
    pub width_mm: f32,
    /// Height on the surface, mm: 0.4 to 10.
    #[schemars(range(min = 0.4, max = 10.0))]
    pub height_mm: f32,
    /// How far it has spread to each side along the border of enamel and dentine, mm: 0.2 to 4.
    #[serde(default = "one_mm")]
    #[schemars(range(min = 0.2, max = 4.0))]
    pub spread_mm: f32,
}

fn one_mm() -> f32 {
    1.0
}

/// How deep a lesion has come, in the thirds in which radiographs are read (ICCMS 2014).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ReachFile {
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
    /// mm, 0.2 to 6.
    #[schemars(range(min = 0.2, max = 6.0))]
    pub radius_mm: f32,
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EllipsoidFile {
    /// Half axes: buccolingual, mesiodistal, occlusoapical.
    pub radii_mm: [RadiusFile; 3],
}

/// Half an axis, mm: 0.2 to 6.
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

/// Where on a surface a decay lies.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum DecayPlaceFile {
    /// In the middle of the surface.
    #[default]
    Centre,
    /// In one of the four quadrants of the occlusal surface, drawn by the session's seed.
    RandomQuadrant,
    /// Anywhere on the surface, drawn by the session's seed.
    Random,
    /// In a quadrant of the occlusal surface, counted as the trainee sees it from above: 1 upper left, 2 upper right,
    /// 3 lower left, 4 lower right.
    Quadrant(#[schemars(range(min = 1, max = 4))] u8),
    /// At a distance from the middle of the surface: on the occlusal one buccal and distal, on the buccal and lingual ones
    /// distal and occlusal, on the mesial and distal ones buccal and occlusal; mm.
    OffsetMm([OffsetFile; 2]),
}

/// mm, -8 to 8.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct OffsetFile(#[schemars(range(min = -8.0, max = 8.0))] pub f32);
