//! A CT scan or label map of a real tooth that replaces the teeth of an exercise.

use super::LessonError;
use sha2::{Digest, Sha256};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use typodont_exercise::scenario;
use typodont_exercise::scenario::{Scenario, ToothSource, hex};
use typodont_exercise::tooth_import;
use typodont_formats::nrrd;

/// A scan that was read but not yet converted to a tooth; the exercise determines its tissues.
pub struct ToothScan {
    path: PathBuf,
    image: nrrd::VoxelImage,
    /// Voxel spacing, mm, that replaces the one in the file's header.
    spacing: Option<f32>,
    /// FDI number of the tooth; `None` for the number of the exercise's own tooth.
    fdi: Option<u8>,
    digest: String,
}

impl ToothScan {
    /// Reads a CT volume or a label map (NRRD). `spacing` (mm) replaces the one in the file's header, and `fdi` the
    /// number of the exercise's own tooth.
    ///
    /// # Errors
    ///
    /// When the file cannot be read or is not a volume.
    pub fn read(path: &Path, spacing: Option<f32>, fdi: Option<u8>) -> Result<ToothScan, LessonError> {
        let bytes = typodont_formats::read_file(path)?;
        let image = nrrd::read(path).map_err(|error| wrong_volume(path, error.to_string()))?;
        Ok(ToothScan { path: path.to_path_buf(), image, spacing, fdi, digest: hex(&Sha256::digest(&bytes)) })
    }

    /// SHA-256 of the file.
    pub fn digest(&self) -> &str {
        &self.digest
    }

    /// Replaces every tooth of a scenario by the scan; of an arch, the tooth with the scan's FDI number.
    ///
    /// # Errors
    ///
    /// [`LessonError::WrongVolume`] if the scan does not contain a tooth with the tissues of the scenario, or if its FDI
    /// number is not that of a tooth of the arch.
    pub fn replace_teeth(&self, scenario: &mut Scenario) -> Result<(), LessonError> {
        let tissues = scenario::anatomy_tissues(&scenario.tissues);
        let spacing = self.spacing.map(|mm| [mm; 3]);
        let scanned = tooth_import::tooth_volume(&self.image, spacing, &scenario.tissues, &tissues);
        let scanned = Arc::new(scanned.map_err(|why| wrong_volume(&self.path, why))?);
        if scenario.scene.is_arch() {
            let why = "the exercise has all teeth of a jaw; --fdi with the number of one of them says which the volume replaces";
            let mut teeth = scenario.scene.teeth.iter_mut();
            let tooth = teeth.find(|tooth| self.fdi == Some(tooth.fdi));
            tooth.ok_or_else(|| wrong_volume(&self.path, why.into()))?.source = ToothSource::Given(scanned);
            return Ok(());
        }
        let treated = scenario.scene.teeth_in_volume().len();
        for tooth in &mut scenario.scene.teeth[..treated] {
            tooth.source = ToothSource::Given(scanned.clone());
        }
        if let Some(fdi) = self.fdi {
            scenario.renumber_teeth(fdi).map_err(|why| wrong_volume(&self.path, why))?;
        }
        Ok(())
    }
}

fn wrong_volume(path: &Path, why: String) -> LessonError {
    LessonError::WrongVolume { path: path.to_path_buf(), why }
}
