//! The folder of the user's own files: settings, languages, sounds and drafts. Gives paths; never reads or writes.

use std::path::{Path, PathBuf};

/// The folder of the user's own files. A page, and a user without a home folder, have none.
#[derive(Clone, Debug, Default)]
pub struct UserFolder(Option<PathBuf>);

impl UserFolder {
    pub fn new(path: Option<PathBuf>) -> UserFolder {
        UserFolder(path)
    }

    pub fn path(&self) -> Option<&Path> {
        self.0.as_deref()
    }

    pub fn settings_file(&self) -> Option<PathBuf> {
        Some(self.path()?.join("settings.json"))
    }

    /// Languages that the user added to those of the program.
    pub fn languages(&self) -> Option<PathBuf> {
        Some(self.path()?.join("languages"))
    }

    /// Sounds that replace those of the program.
    pub fn sounds(&self) -> Option<PathBuf> {
        Some(self.path()?.join("sounds"))
    }

    /// Automatically saved drafts of exercises.
    pub fn drafts(&self) -> Option<PathBuf> {
        Some(self.path()?.join("drafts"))
    }

    /// Bundles of an author's test runs; in the system's temporary folder for a user without a folder.
    pub fn test_runs(&self) -> PathBuf {
        self.0.clone().unwrap_or_else(std::env::temp_dir).join("tried")
    }
}
