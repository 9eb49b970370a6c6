//! Gingiva, calculus and existing fillings in the scenario file.

use super::ProbingSite;
use schemars::JsonSchema;
use serde::Deserialize;

/// Gingiva and pockets around the tooth to be treated, at the six sites of a periodontal chart. Omitted sites are
/// healthy.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PeriodontiumFile {
    /// Probing depth from the gingival margin to the floor of the sulcus or pocket, mm: 0.5 to 12 at each site.
    /// Healthy: 1 to 3.
    #[serde(default)]
    pub pocket_mm: PocketFile,
    /// Recession of the gingival margin below the cemento-enamel junction, mm: -4 (the margin covers enamel) to 8 at
    /// each site. The crest of the bone lies 2 mm below the floor of the pocket.
    #[serde(default)]
    pub recession_mm: RecessionFile,
}

/// Probing depth at each site.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PocketFile {
    /// Mesiobuccal.
    #[serde(default, rename = "MB")]
    pub mb: Option<DepthFile>,
    /// Mid-buccal.
    #[serde(default, rename = "B")]
    pub b: Option<DepthFile>,
    /// Distobuccal.
    #[serde(default, rename = "DB")]
    pub db: Option<DepthFile>,
    /// Mesiolingual.
    #[serde(default, rename = "ML")]
    pub ml: Option<DepthFile>,
    /// Mid-lingual (palatal in the upper jaw).
    #[serde(default, rename = "L")]
    pub l: Option<DepthFile>,
    /// Distolingual.
    #[serde(default, rename = "DL")]
    pub dl: Option<DepthFile>,
}

impl PocketFile {
    /// Returns the values in the order of a periodontal chart; `None` for an omitted site.
    pub fn at_sites(&self) -> [Option<f32>; 6] {
        [self.mb, self.b, self.db, self.ml, self.l, self.dl].map(|depth| depth.map(|d| d.0))
    }
}

/// Recession at each site.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RecessionFile {
    /// Mesiobuccal.
    #[serde(default, rename = "MB")]
    pub mb: Option<HeightFile>,
    /// Mid-buccal.
    #[serde(default, rename = "B")]
    pub b: Option<HeightFile>,
    /// Distobuccal.
    #[serde(default, rename = "DB")]
    pub db: Option<HeightFile>,
    /// Mesiolingual.
    #[serde(default, rename = "ML")]
    pub ml: Option<HeightFile>,
    /// Mid-lingual (palatal in the upper jaw).
    #[serde(default, rename = "L")]
    pub l: Option<HeightFile>,
    /// Distolingual.
    #[serde(default, rename = "DL")]
    pub dl: Option<HeightFile>,
}

impl RecessionFile {
    /// Returns the values in the order of a periodontal chart; `None` for an omitted site.
    pub fn at_sites(&self) -> [Option<f32>; 6] {
        [self.mb, self.b, self.db, self.ml, self.l, self.dl].map(|height| height.map(|h| h.0))
    }
}

/// Probing depth, mm: 0.5 to 12.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct DepthFile(#[schemars(range(min = 0.5, max = 12.0))] pub f32);

/// Recession, mm: -4 to 8.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct HeightFile(#[schemars(range(min = -4.0, max = 8.0))] pub f32);

/// One of the six sites of a periodontal chart.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
pub enum SiteFile {
    /// Mesiobuccal.
    #[serde(rename = "MB")]
    MesioBuccal,
    /// Mid-buccal.
    #[serde(rename = "B")]
    Buccal,
    /// Distobuccal.
    #[serde(rename = "DB")]
    DistoBuccal,
    /// Mesiolingual.
    #[serde(rename = "ML")]
    MesioLingual,
    /// Mid-lingual (palatal in the upper jaw).
    #[serde(rename = "L")]
    Lingual,
    /// Distolingual.
    #[serde(rename = "DL")]
    DistoLingual,
}

impl From<SiteFile> for ProbingSite {
    fn from(written: SiteFile) -> ProbingSite {
        match written {
            SiteFile::MesioBuccal => ProbingSite::MesioBuccal,
            SiteFile::Buccal => ProbingSite::Buccal,
            SiteFile::DistoBuccal => ProbingSite::DistoBuccal,
            SiteFile::MesioLingual => ProbingSite::MesioLingual,
            SiteFile::Lingual => ProbingSite::Lingual,
            SiteFile::DistoLingual => ProbingSite::DistoLingual,
        }
    }
}

/// A deposit of calculus on the root or the neck.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CalculusFile {
    /// Name of the deposit: lower-case letters, digits, hyphens, underscores.
    #[schemars(length(min = 1, max = 40), regex(pattern = r"^[a-z0-9_-]+$"))]
    pub id: String,
    /// Tissue of which the deposit consists.
    #[serde(default = "CalculusFile::tissue")]
    pub tissue: String,
    /// Site of the periodontal chart at which the deposit is.
    pub site: SiteFile,
    /// Distance of the deposit's centre below the gingival margin, mm: -3 (above the margin) to 10.
    #[serde(default = "CalculusFile::below")]
    #[schemars(range(min = -3.0, max = 10.0))]
    pub below_margin_mm: f32,
    /// Thickness of the deposit on the root, mm: 0.2 to 1.
    #[serde(default = "CalculusFile::thickness")]
    #[schemars(range(min = 0.2, max = 1.0))]
    pub thickness_mm: f32,
    /// Width around the root, mm: 0.5 to 6.
    #[serde(default = "CalculusFile::width")]
    #[schemars(range(min = 0.5, max = 6.0))]
    pub width_mm: f32,
    /// Height along the root, mm: 0.5 to 6.
    #[serde(default = "CalculusFile::height")]
    #[schemars(range(min = 0.5, max = 6.0))]
    pub height_mm: f32,
}

impl CalculusFile {
    fn tissue() -> String {
        "calculus".into()
    }

    fn below() -> f32 {
        2.0
    }

    fn thickness() -> f32 {
        0.5
    }

    fn width() -> f32 {
        2.5
    }

    fn height() -> f32 {
        2.0
    }
}

/// An existing filling in the occlusal surface.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FillingFile {
    /// Name of the filling: lower-case letters, digits, hyphens, underscores.
    #[schemars(length(min = 1, max = 40), regex(pattern = r"^[a-z0-9_-]+$"))]
    pub id: String,
    /// Tissue of which the filling consists.
    #[serde(default = "FillingFile::tissue")]
    pub tissue: String,
    /// Offset of the filling's centre from the centre of the crown, mm: buccal and distal.
    #[serde(default = "FillingFile::middle")]
    pub offset_mm: [super::file::CoordinateFile; 2],
    /// Size of the filling, mm: buccolingual and mesiodistal, 0.5 to 8 each.
    pub size_mm: [FillingSizeFile; 2],
    /// Depth of the filling below the occlusal surface, mm: 0.5 to 5.
    #[serde(default = "FillingFile::depth")]
    #[schemars(range(min = 0.5, max = 5.0))]
    pub depth_mm: f32,
}

/// Size, mm: 0.5 to 8.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct FillingSizeFile(#[schemars(range(min = 0.5, max = 8.0))] pub f32);

impl FillingFile {
    fn tissue() -> String {
        "amalgam".into()
    }

    fn middle() -> [super::file::CoordinateFile; 2] {
        [super::file::CoordinateFile(0.0); 2]
    }

    fn depth() -> f32 {
        2.0
    }
}

/// Finding that a trainee records in the periodontal chart of a stage.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ChartFile {
    /// Probing depths, read off a periodontal probe.
    Depth,
    /// Sites at which calculus is detected.
    Calculus,
}
