//! The dental arches in the scenario file. Around a single tooth they are displayed; the only key that changes what can be
//! touched is `missing`, which removes a neighbouring tooth. In a `dental_arch`, or a `jaw` with `other_teeth`, all teeth and the
//! mucosa can be touched.

use super::file::ToothFile;
use schemars::JsonSchema;
use serde::Deserialize;

/// Positions of the teeth in both jaws. Omitted values are those of the average adult.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ArchFile {
    /// Form of the upper arch.
    #[serde(default)]
    pub upper: ArchFormFile,
    /// Form of the lower arch.
    #[serde(default)]
    pub lower: ArchFormFile,
    /// Position of the lower first molar relative to the upper one (Angle's classification): normal, distal or mesial.
    #[serde(default)]
    pub angle_class: AngleClassFile,
    /// Missing teeth, by their FDI numbers.
    #[serde(default)]
    #[schemars(length(max = 27))]
    pub missing: Vec<u8>,
    /// Teeth that are rotated about their own axes.
    #[serde(default)]
    #[schemars(length(max = 27))]
    pub rotated: Vec<RotatedFile>,
}

/// All teeth of one jaw in their arch, with its gingiva and its palate or the floor of its mouth. Teeth that are not listed
/// are sound.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DentalArchFile {
    /// The teeth with decay, stains or fillings, and those whose shape comes from a scan: one or more, of the same jaw. The
    /// others are generated; each has its FDI number as its name.
    #[schemars(length(min = 1, max = 16))]
    pub teeth: Vec<ToothFile>,
    /// Voxel size of the whole arch, mm: 0.14 (fine) to 0.4 (coarse). Generated teeth must have the same; scans may have
    /// another.
    #[serde(default = "fifth_of_mm")]
    #[schemars(range(min = 0.14, max = 0.4))]
    pub spacing_mm: f32,
    /// Positions of the teeth.
    #[serde(default)]
    pub arch: ArchFile,
}

fn fifth_of_mm() -> f32 {
    0.2
}

/// Form of one jaw's arch, by the beta function of Braun.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ArchFormFile {
    /// Width between the centres of the second molars, mm: 40 to 62. Average: 54 in the upper jaw, 50.3 in the lower
    /// jaw.
    #[serde(default)]
    #[schemars(range(min = 40.0, max = 62.0))]
    pub width_mm: Option<f32>,
    /// Depth from the incisors to the centres of the second molars, mm: 28 to 52. If omitted, it follows from the
    /// widths of the teeth.
    #[serde(default)]
    #[schemars(range(min = 28.0, max = 52.0))]
    pub depth_mm: Option<f32>,
}

/// Class of occlusion (Angle).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
pub enum AngleClassFile {
    /// The mesiobuccal cusp of the upper first molar occludes with the buccal groove of the lower first molar.
    #[default]
    I,
    /// The lower arch is distal by the width of a cusp.
    II,
    /// The lower arch is mesial by the width of a cusp.
    III,
}

/// A rotated tooth.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RotatedFile {
    /// FDI number of the tooth.
    #[schemars(range(min = 11, max = 48))]
    pub fdi: u8,
    /// Rotation, degrees: -60 to 60. At a positive angle the mesial side is turned toward the lip or the cheek.
    #[schemars(range(min = -60.0, max = 60.0))]
    pub degrees: f32,
}
