//! What an author writes of gum, calculus and old fillings.

use super::Site;
use schemars::JsonSchema;
use serde::Deserialize;

/// Gum and pockets round the tooth that is worked on, at the six sites of a periodontal chart; what is left out is healthy.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PeriodontiumFile {
    /// From the gum's margin to the floor of the sulcus or pocket, mm: 0.5 to 12 at each site. Healthy: 1 to 3.
    #[serde(default)]
    pub pocket_mm: PocketFile,
    /// How far the margin has gone back below the cemento-enamel junction, mm: -4 (it covers enamel) to 8 at each site. The bone
    /// follows 2 mm below the pocket's floor.
    #[serde(default)]
    pub recession_mm: RecessionFile,
}

/// A depth at each site.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PocketFile {
    /// Mesiobuccal.
    #[serde(default, rename = "MB")]
    pub mb: Option<DepthFile>,
    /// Buccal, in the middle.
    #[serde(default, rename = "B")]
    pub b: Option<DepthFile>,
    /// Distobuccal.
    #[serde(default, rename = "DB")]
    pub db: Option<DepthFile>,
    /// Mesiolingual.
    #[serde(default, rename = "ML")]
    pub ml: Option<DepthFile>,
    /// Lingual (palatal in the upper jaw), in the middle.
    #[serde(default, rename = "L")]
    pub l: Option<DepthFile>,
    /// Distolingual.
    #[serde(default, rename = "DL")]
    pub dl: Option<DepthFile>,
}

impl PocketFile {
    /// In the order of a chart.
    pub fn at_sites(&self) -> [Option<f32>; 6] {
        [self.mb, self.b, self.db, self.ml, self.l, self.dl].map(|depth| depth.map(|d| d.0))
    }
}

/// A recession at each site.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RecessionFile {
    /// Mesiobuccal.
    #[serde(default, rename = "MB")]
    pub mb: Option<HeightFile>,
    /// Buccal, in the middle.
    #[serde(default, rename = "B")]
    pub b: Option<HeightFile>,
    /// Distobuccal.
    #[serde(default, rename = "DB")]
    pub db: Option<HeightFile>,
    /// Mesiolingual.
    #[serde(default, rename = "ML")]
    pub ml: Option<HeightFile>,
    /// Lingual (palatal in the upper jaw), in the middle.
    #[serde(default, rename = "L")]
    pub l: Option<HeightFile>,
    /// Distolingual.
    #[serde(default, rename = "DL")]
    pub dl: Option<HeightFile>,
}

impl RecessionFile {
    /// In the order of a chart.
    pub fn at_sites(&self) -> [Option<f32>; 6] {
        [self.mb, self.b, self.db, self.ml, self.l, self.dl].map(|height| height.map(|h| h.0))
    }
}

/// mm, 0.5 to 12.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct DepthFile(#[schemars(range(min = 0.5, max = 12.0))] pub f32);

/// mm, -4 to 8.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct HeightFile(#[schemars(range(min = -4.0, max = 8.0))] pub f32);

/// One of the six sites of a periodontal chart.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
pub enum SiteFile {
    /// Mesiobuccal.
    #[serde(rename = "MB")]
    MesioBuccal,
    /// Buccal, in the middle.
    #[serde(rename = "B")]
    Buccal,
    /// Distobuccal.
    #[serde(rename = "DB")]
    DistoBuccal,
    /// Mesiolingual.
    #[serde(rename = "ML")]
    MesioLingual,
    /// Lingual (palatal in the upper jaw), in the middle.
    #[serde(rename = "L")]
    Lingual,
    /// Distolingual.
    #[serde(rename = "DL")]
    DistoLingual,
}

impl From<SiteFile> for Site {
    fn from(written: SiteFile) -> Site {
        match written {
            SiteFile::MesioBuccal => Site::MesioBuccal,
            SiteFile::Buccal => Site::Buccal,
            SiteFile::DistoBuccal => Site::DistoBuccal,
            SiteFile::MesioLingual => Site::MesioLingual,
            SiteFile::Lingual => Site::Lingual,
            SiteFile::DistoLingual => Site::DistoLingual,
        }
    }
}

/// A hard deposit on the root or the neck.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CalculusFile {
    /// Name of the deposit: small letters, digits, hyphens, underscores.
    #[schemars(length(min = 1, max = 40), regex(pattern = r"^[a-z0-9_-]+$"))]
    pub id: String,
    /// Tissue of which it is made.
    #[serde(default = "CalculusFile::tissue")]
    pub tissue: String,
    /// Site of the chart at which it sits.
    pub site: SiteFile,
    /// Its middle below the gum's margin, mm: -3 (above it) to 10.
    #[serde(default = "CalculusFile::below")]
    #[schemars(range(min = -3.0, max = 10.0))]
    pub below_margin_mm: f32,
    /// How far it stands off the root, mm: 0.2 to 1.
    #[serde(default = "CalculusFile::thickness")]
    #[schemars(range(min = 0.2, max = 1.0))]
    pub thickness_mm: f32,
    /// Round the root, mm: 0.5 to 6.
    #[serde(default = "CalculusFile::width")]
    #[schemars(range(min = 0.5, max = 6.0))]
    pub width_mm: f32,
    /// Along the root, mm: 0.5 to 6.
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

/// A filling that the tooth has had for long, in its chewing surface.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FillingFile {
    /// Name of the filling: small letters, digits, hyphens, underscores.
    #[schemars(length(min = 1, max = 40), regex(pattern = r"^[a-z0-9_-]+$"))]
    pub id: String,
    /// What it is made of.
    #[serde(default = "FillingFile::tissue")]
    pub tissue: String,
    /// Its middle from the crown's, mm: buccal and distal.
    #[serde(default = "FillingFile::middle")]
    pub offset_mm: [super::file::CoordinateFile; 2],
    /// Across the tooth and along the arch, mm: 0.5 to 8.
    pub size_mm: [FillingSizeFile; 2],
    /// Below the chewing surface, mm: 0.5 to 5.
    #[serde(default = "FillingFile::depth")]
    #[schemars(range(min = 0.5, max = 5.0))]
    pub depth_mm: f32,
}

/// mm, 0.5 to 8.
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

/// What a trainee notes in the chart of a stage.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ChartFile {
    /// Depths, read off a probe.
    Depth,
    /// Sites at which calculus is felt.
    Calculus,
}
