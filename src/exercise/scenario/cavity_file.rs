//! Prepared cavities in the scenario file.

use super::decay_file::DecayPlaceFile;
use schemars::JsonSchema;
use serde::Deserialize;

/// A cavity that is prepared before the exercise begins. The tooth without the cavity is the contour with which a
/// filling is compared.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CavityFile {
    /// Position of the cavity's centre on the occlusal surface.
    #[serde(default)]
    pub at: DecayPlaceFile,
    /// Length from mesial to distal, mm: 0.8 to 10.
    #[schemars(range(min = 0.8, max = 10.0))]
    pub length_mm: f32,
    /// Width from buccal to lingual, mm: 0.8 to 8.
    #[schemars(range(min = 0.8, max = 8.0))]
    pub width_mm: f32,
    /// Depth, from the occlusal surface above the cavity's centre to its floor, mm: 0.5 to 6.
    #[schemars(range(min = 0.5, max = 6.0))]
    pub depth_mm: f32,
    /// Divergence of the walls from the floor upward, degrees: -10 (undercut, as for amalgam) to 20.
    #[serde(default)]
    #[schemars(range(min = -10.0, max = 20.0))]
    pub walls_deg: f32,
    /// Radius of the corners and of the line angles between walls and floor, mm: 0.1 to 2; it corresponds to the bur's
    /// radius.
    #[serde(default = "CavityFile::corner")]
    #[schemars(range(min = 0.1, max = 2.0))]
    pub corner_mm: f32,
    /// The proximal box of a Class II cavity.
    #[serde(default)]
    pub proximal: Option<ProximalFile>,
}

impl CavityFile {
    fn corner() -> f32 {
        0.4
    }
}

/// The proximal box of a Class II cavity.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ProximalFile {
    /// The side on which the box is open.
    pub side: ProximalSide,
    /// Width from buccal to lingual, mm: 1 to 8.
    #[schemars(range(min = 1.0, max = 8.0))]
    pub width_mm: f32,
    /// Depth from the outermost point of the crown to the axial wall, mm: 0.5 to 4.
    #[schemars(range(min = 0.5, max = 4.0))]
    pub axial_mm: f32,
    /// Depth from the occlusal surface above the cavity's centre to the gingival floor, mm: 1 to 8.
    #[schemars(range(min = 1.0, max = 8.0))]
    pub depth_mm: f32,
}

/// A proximal side: mesial (M) or distal (D).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
pub enum ProximalSide {
    M,
    D,
}
