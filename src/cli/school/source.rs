//! Source of the sessions that a command reads: a folder, or a school's database with its store.

use super::database::DatabaseArguments;
use super::enqueue::parse_scorer_version;
use super::store_arguments::StoreArguments;
use crate::cli::{CliError, cohort};
use clap::Args;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use typodont_report::cohort::Cohort;
use typodont_report::sanitize_display;
use typodont_review::OverrideSnapshot;
use typodont_school::RECORDING;
use typodont_school::connection::DbConnection;
use typodont_school::records;
use typodont_school::records::{SessionFilter, StoredSession};
use typodont_school::store::ObjectStoreHandle;

#[derive(Args)]
pub struct SessionSource {
    /// Folder that contains bundles, at any depth; to read a database instead, give --database
    pub folder: Option<PathBuf>,
    #[command(flatten)]
    pub at: DatabaseArguments,
    #[command(flatten)]
    pub store: StoreArguments,
    /// With --database: only sessions of this class
    #[arg(long, value_name = "NAME")]
    pub class: Option<String>,
    /// With --database: use the workers' scores of this version (`current`) instead of the stations' scores
    #[arg(long, value_name = "VERSION")]
    pub scorer: Option<String>,
}

/// Map of removal times in a bundle, from which a cohort's maps are drawn.
const REMOVAL_TIMES_FILE: &str = "removal_time.nrrd";

/// Sessions with their source.
pub struct SourcedCohort {
    pub cohort: Cohort,
    /// Name of the source in complaints.
    pub name: String,
    connection: Option<DbConnection>,
    folder: Option<PathBuf>,
    /// Temporary copies of files of the store; they are removed with this value.
    _temp_dir: Option<TempDir>,
}

/// A folder that is removed when this value is dropped.
struct TempDir(PathBuf);

impl Drop for TempDir {
    fn drop(&mut self) {
        // If the folder cannot be removed, it stays among other temporary files.
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

impl SessionSource {
    /// The folder of bundles; `None` where sessions come from a database.
    ///
    /// # Errors
    /// Fails if a folder is combined with an option that filters a database.
    pub fn bundle_folder(&self) -> Result<Option<&Path>, CliError> {
        let folder = self.folder.as_deref().filter(|_| self.at.database.is_none());
        if folder.is_some() {
            self.require_no_filter()?;
        }
        Ok(folder)
    }

    /// Reads all sessions; `maps`: with their maps of removed tissue.
    ///
    /// # Errors
    /// A message if there is no session, or the source cannot be read.
    pub fn read(&self, maps: bool) -> Result<SourcedCohort, CliError> {
        if let Some(folder) = &self.folder {
            if self.at.database.is_some() {
                return Err(CliError::misuse("give either a folder or --database, not both"));
            }
            self.require_no_filter()?;
            let cohort = cohort::read_folder(folder)?;
            let name = folder.display().to_string();
            return Ok(SourcedCohort { cohort, name, connection: None, folder: Some(folder.clone()), _temp_dir: None });
        }
        let (mut connection, stored) = self.stored_sessions()?;
        let mut cohort = Cohort::default();
        let fetched = match maps && self.store.is_configured() {
            true => Some(fetch_removal_maps(&self.store.open(self.at.retry_policy()?)?, &stored, &mut cohort)?),
            false => None,
        };
        let base = fetched.as_ref().map_or(Path::new(""), |fetched| &fetched.0);
        cohort.sessions = stored.iter().map(|k| (base.join(&k.id).join(&k.bundle), k.session.clone())).collect();
        cohort.verification =
            stored.iter().map(|k| (base.join(&k.id).join(&k.bundle), k.verification.clone())).collect();
        audit_read(&mut connection, &stored)?;
        Ok(SourcedCohort {
            cohort,
            name: "--database".into(),
            connection: Some(connection),
            folder: None,
            _temp_dir: fetched,
        })
    }

    /// Checks that no option is given that applies to a database only.
    ///
    /// # Errors
    /// A message on wrong usage if there is such an option.
    pub fn require_no_filter(&self) -> Result<(), CliError> {
        match self.class.is_some() || self.scorer.is_some() {
            true => Err(CliError::misuse("--class and --scorer require --database and do not apply to a folder")),
            false => Ok(()),
        }
    }

    /// Scorer version of the workers' scores that are requested; `None` for the stations' own scores.
    pub fn scorer_version(&self) -> Result<Option<u32>, CliError> {
        self.scorer.as_deref().map(parse_scorer_version).transpose()
    }

    /// Connects to the database, and lists its sessions.
    ///
    /// # Errors
    /// A message if no database is named, it cannot be read, or it holds no session that the login may read.
    pub fn stored_sessions(&self) -> Result<(DbConnection, Vec<StoredSession>), CliError> {
        if !self.at.is_configured() {
            return Err(CliError::misuse("no-sessions: give a folder that contains bundles, or --database"));
        }
        let scorer_version = self.scorer_version()?;
        let which = SessionFilter { class: self.class.clone(), scorer_version };
        let mut connection = self.at.connection()?;
        let (stored, unreadable) = connection.query_with_retry(|client| records::sessions(client, &which))?;
        for what in unreadable {
            eprintln!("--database: skipped: {}", sanitize_display(&what, 300));
        }
        // No warning is needed if the workers' scores were requested.
        for k in stored.iter().filter(|k| k.differs && scorer_version.is_none()) {
            eprintln!(
                "--database: {}: differs: the worker's score differs from the station's; give --scorer current to use \
                the worker's",
                k.id
            );
        }
        match stored.is_empty() {
            true => Err(CliError::wrong("--database: no-sessions: the database contains no session that you may read")),
            false => Ok((connection, stored)),
        }
    }
}

/// Records in the audit log the number of sessions read, and the login.
pub fn audit_read(connection: &mut DbConnection, stored: &[StoredSession]) -> Result<(), CliError> {
    Ok(connection.query_with_retry(|client| records::note_read(client, stored.len()))?)
}

impl SourcedCohort {
    /// Reads the examiners' overrides; prints the issues of a folder's log.
    ///
    /// # Errors
    /// A message if they cannot be read.
    pub fn overrides(&mut self) -> Result<OverrideSnapshot, CliError> {
        if let Some(connection) = &mut self.connection {
            return Ok(connection.query_with_retry(records::read_overrides)?);
        }
        crate::cli::read_override_log(self.folder.as_deref().unwrap_or(Path::new("")))
    }
}

/// Creates a temporary folder that only this user can read.
fn create_private_temp_dir() -> std::io::Result<PathBuf> {
    let mut random = [0; 8];
    getrandom::fill(&mut random).map_err(|e| std::io::Error::other(e.to_string()))?;
    let folder = std::env::temp_dir().join(format!("typodont-{}", typodont_exercise::scenario::hex(&random)));
    let builder = std::fs::DirBuilder::new();
    #[cfg(unix)]
    let builder = {
        use std::os::unix::fs::DirBuilderExt;
        let mut private = builder;
        private.mode(0o700);
        private
    };
    builder.create(&folder)?;
    Ok(folder)
}

/// Downloads the files from which a cohort's maps are drawn, and one recording for the wording of each questionnaire.
fn fetch_removal_maps(
    store: &ObjectStoreHandle,
    stored: &[StoredSession],
    cohort: &mut Cohort,
) -> Result<TempDir, CliError> {
    let folder =
        create_private_temp_dir().map_err(|e| CliError::wrong(format!("temporary folder: unwritable-folder: {e}")))?;
    let fetched = TempDir(folder.clone());
    let mut worded = BTreeSet::new();
    for k in stored {
        let own = folder.join(&k.id).join(&k.bundle);
        let unwritable = |e: std::io::Error| CliError::wrong(format!("{}: unwritable-folder: {e}", folder.display()));
        std::fs::create_dir_all(&own).map_err(unwritable)?;
        let words = k.session.questionnaire.as_ref().is_some_and(|q| worded.insert(q.id.clone()));
        for name in [REMOVAL_TIMES_FILE].into_iter().chain(words.then_some(RECORDING)) {
            if k.manifest.file(name).is_none() {
                continue;
            }
            match store.read_bundle_file(&k.manifest, name) {
                Ok(bytes) => std::fs::write(own.join(name), bytes).map_err(unwritable)?,
                Err((why, _)) => cohort.skipped.push((PathBuf::from(&k.id), why)),
            }
        }
    }
    Ok(fetched)
}
