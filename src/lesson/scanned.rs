//! The CT of a real tooth, or a map of its tissues, in the place of an exercise's own.

use super::Failed;
use crate::content::{self, nrrd, scan};
use crate::scenario::{self, Form, Scenario, hex};
use sha2::{Digest, Sha256};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A scan that was read, and is no tooth yet: which tissues there are the exercise says.
pub struct Scan {
    path: PathBuf,
    image: nrrd::Image,
    /// Between voxels, mm, in place of what the header says.
    spacing: Option<f32>,
    digest: String,
}

impl Scan {
    /// Reads a CT volume or a label map (NRRD).
    pub fn read(path: &Path, spacing: Option<f32>) -> Result<Scan, Failed> {
        let bytes = content::read_file(path)?;
        let image = nrrd::read(path).map_err(|error| wrong(path, error.to_string()))?;
        Ok(Scan { path: path.to_path_buf(), image, spacing, digest: hex(&Sha256::digest(&bytes)) })
    }

    /// SHA-256 of the file.
    pub fn digest(&self) -> &str {
        &self.digest
    }

    /// Puts it in the place of every tooth.
    pub fn replace_teeth(&self, scenario: &mut Scenario) -> Result<(), Failed> {
        let tissues = scenario::anatomy_tissues(&scenario.tissues);
        let spacing = self.spacing.map(|mm| [mm; 3]);
        let volume = scan::tooth(&self.image, spacing, &scenario.tissues, &tissues);
        let volume = Arc::new(volume.map_err(|why| wrong(&self.path, why))?);
        for tooth in &mut scenario.scene.teeth {
            tooth.form = Form::Given(volume.clone());
        }
        Ok(())
    }
}

fn wrong(path: &Path, why: String) -> Failed {
    Failed::WrongVolume { path: path.to_path_buf(), why }
}
