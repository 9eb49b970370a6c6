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

    /// Replaces every tooth of a scenario by the scan.
    ///
    /// # Errors
    ///
    /// [`LessonError::WrongVolume`] if the scan does not contain a tooth with the tissues of the scenario.
    pub fn replace_teeth(&self, scenario: &mut Scenario) -> Result<(), LessonError> {
        let tissues = scenario::anatomy_tissues(&scenario.tissues);
        let spacing = self.spacing.map(|mm| [mm; 3]);
        let volume = tooth_import::tooth_volume(&self.image, spacing, &scenario.tissues, &tissues);
        let volume = Arc::new(volume.map_err(|why| wrong_volume(&self.path, why))?);
        for tooth in &mut scenario.scene.teeth {
            tooth.source = ToothSource::Given(volume.clone());
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
