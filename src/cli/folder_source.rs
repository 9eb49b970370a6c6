//! Source of sessions in a build without the part `school`: a folder of bundles.

use super::{CliError, cohort, missing_part};
use clap::Args;
use std::path::{Path, PathBuf};
use typodont_report::cohort::Cohort;

#[derive(Args)]
pub struct FolderSource {
    /// Folder that holds bundles, at any depth
    pub folder: Option<PathBuf>,
    #[command(flatten)]
    school: SchoolArguments,
}

/// Options that only a build with the part `school` has. They are accepted, so that the missing part is reported.
#[derive(Args)]
pub struct SchoolArguments {
    #[arg(long, hide = true)]
    database: Option<String>,
    #[arg(long, hide = true)]
    store: Option<String>,
    #[arg(long, hide = true)]
    class: Option<String>,
    #[arg(long, hide = true)]
    scorer: Option<String>,
}

impl SchoolArguments {
    /// # Errors
    /// Fails if one of the options is given.
    pub fn require_absent(&self) -> Result<(), CliError> {
        let given = [
            ("--database", &self.database),
            ("--store", &self.store),
            ("--class", &self.class),
            ("--scorer", &self.scorer),
        ];
        match given.iter().find(|(_, value)| value.is_some()) {
            Some((option, _)) => Err(missing_part::error(option, "school")),
            None => Ok(()),
        }
    }
}

/// Sessions, and where they came from.
pub struct FolderCohort {
    pub cohort: Cohort,
    /// For complaints.
    #[cfg_attr(not(feature = "integrations"), expect(dead_code, reason = "only gradebooks name the source"))]
    pub name: String,
    #[cfg(feature = "integrations")]
    folder: PathBuf,
}

impl FolderSource {
    /// The folder of bundles.
    ///
    /// # Errors
    /// Fails if none is given, or if an option of the part `school` is.
    fn required_folder(&self) -> Result<&Path, CliError> {
        self.school.require_absent()?;
        self.folder.as_deref().ok_or_else(|| CliError::misuse("no-sessions: name a folder that holds bundles"))
    }

    /// The folder of bundles, as a build with the part `school` gives it where sessions come from no database.
    ///
    /// # Errors
    /// As for [`FolderSource::read`].
    #[cfg(feature = "integrations")]
    pub fn bundle_folder(&self) -> Result<Option<&Path>, CliError> {
        self.required_folder().map(Some)
    }

    /// Reads every session. The removal maps of a folder are always at hand.
    ///
    /// # Errors
    /// Fails if the folder holds no session.
    pub fn read(&self, _maps: bool) -> Result<FolderCohort, CliError> {
        let folder = self.required_folder()?;
        Ok(FolderCohort {
            cohort: cohort::read_folder(folder)?,
            name: folder.display().to_string(),
            #[cfg(feature = "integrations")]
            folder: folder.to_path_buf(),
        })
    }
}

#[cfg(feature = "integrations")]
impl FolderCohort {
    /// The examiners' overrides; damaged entries are reported on standard error.
    ///
    /// # Errors
    /// Fails if the log cannot be read.
    pub fn overrides(&mut self) -> Result<typodont_review::OverrideSnapshot, CliError> {
        super::read_override_log(&self.folder)
    }
}
