//! Where sessions are read from: a folder, or a school's database with its store.

use super::asking::Line;
use super::database::At;
use super::enqueue::scorer;
use super::store::{Named, Store};
use crate::cli::{Failure, cohort};
use crate::report::cohort::Cohort;
use crate::report::harmless;
use crate::review::{Log, OVERRIDES, Told};
use crate::school::RECORDING;
use crate::school::records::{self, Kept, Which};
use clap::Args;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

#[derive(Args)]
pub struct Source {
    /// Folder that holds bundles, at any depth; or a database, by --database
    pub folder: Option<PathBuf>,
    #[command(flatten)]
    pub at: At,
    #[command(flatten)]
    pub store: Named,
    /// Of a database: sessions of this class only
    #[arg(long, value_name = "NAME")]
    pub class: Option<String>,
    /// Of a database: as workers scored them, rather than as their stations did; `current`
    #[arg(long, value_name = "VERSION")]
    pub scorer: Option<String>,
}

/// Maps of what was removed, by which a cohort draws its own.
const TIMES: &str = "removal_time.nrrd";

/// Sessions, and where they came from.
pub struct Read {
    pub cohort: Cohort,
    /// For complaints.
    pub name: String,
    line: Option<Line>,
    folder: Option<PathBuf>,
    /// Files out of the store; they go when this does.
    _fetched: Option<Fetched>,
}

/// A folder that goes when nobody needs it any more.
struct Fetched(PathBuf);

impl Drop for Fetched {
    fn drop(&mut self) {
        // What cannot be removed lies among other temporary files.
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

impl Source {
    /// Reads every session; fails where there is none. `maps` says whether what was removed is asked for, too.
    pub fn read(&self, maps: bool) -> Result<Read, Failure> {
        if let Some(folder) = &self.folder {
            if self.at.database.is_some() {
                return Err(Failure::misuse("a folder, or --database: sessions come from one of them"));
            }
            self.takes_all()?;
            let cohort = cohort::read(folder)?;
            let name = folder.display().to_string();
            return Ok(Read { cohort, name, line: None, folder: Some(folder.clone()), _fetched: None });
        }
        let (mut line, kept) = self.kept()?;
        let mut cohort = Cohort::default();
        let fetched = match maps && self.store.is_named() {
            true => Some(fetch(&self.store.open(self.at.patience()?)?, &kept, &mut cohort)?),
            false => None,
        };
        let base = fetched.as_ref().map_or(Path::new(""), |fetched| &fetched.0);
        cohort.sessions = kept.iter().map(|k| (base.join(&k.id).join(&k.bundle), k.session.clone())).collect();
        note_read(&mut line, &kept)?;
        Ok(Read { cohort, name: "--database".into(), line: Some(line), folder: None, _fetched: fetched })
    }

    /// Fails where a choice is made that a folder does not offer.
    pub fn takes_all(&self) -> Result<(), Failure> {
        match self.class.is_some() || self.scorer.is_some() {
            true => {
                Err(Failure::misuse("--class and --scorer choose among the sessions of a --database, not of a folder"))
            }
            false => Ok(()),
        }
    }

    /// Whose scores are asked for: workers' of this version, or else the stations' own.
    pub fn scorer_version(&self) -> Result<Option<u32>, Failure> {
        self.scorer.as_deref().map(scorer).transpose()
    }

    /// The sessions of a database, whatever is known of them.
    pub fn kept(&self) -> Result<(Line, Vec<Kept>), Failure> {
        if !self.at.is_named() {
            return Err(Failure::misuse("no-sessions: name a folder that holds bundles, or a --database"));
        }
        let scorer_version = self.scorer_version()?;
        let which = Which { class: self.class.clone(), scorer_version };
        let mut line = self.at.line()?;
        let (kept, unread) = line.ask(|client| records::sessions(client, &which))?;
        for what in unread {
            eprintln!("--database: skipped: {}", harmless(&what, 300));
        }
        // Whoever asks for the workers' scores has them.
        for k in kept.iter().filter(|k| k.differs && scorer_version.is_none()) {
            eprintln!(
                "--database: {}: differs: a worker found another score than its station wrote; --scorer current takes the worker's",
                k.id
            );
        }
        match kept.is_empty() {
            true => Err(Failure::wrong("--database: no-sessions: it holds none that you may read")),
            false => Ok((line, kept)),
        }
    }
}

/// Writes down that so many sessions were read, and by whom.
pub fn note_read(line: &mut Line, kept: &[Kept]) -> Result<(), Failure> {
    line.ask(|client| client.query("SELECT typodont.note('sessions read', $1)", &[&kept.len().to_string()]))?;
    Ok(())
}

impl Read {
    /// What examiners judged, and what is wrong with it.
    pub fn judgements(&mut self) -> Result<Told, Failure> {
        if let Some(line) = &mut self.line {
            return Ok(line.ask(records::judgements)?);
        }
        let folder = self.folder.clone().unwrap_or_default();
        let path = folder.join(OVERRIDES);
        let unread = |e| Failure::wrong(format!("{}: unreadable-file: {e}", path.display()));
        let told = Log::of(&folder).told(None).map_err(unread)?;
        for trouble in &told.troubles {
            eprintln!("{}: {trouble}", path.display());
        }
        Ok(told)
    }
}

/// A new folder that only this user can look into.
fn own_folder() -> std::io::Result<PathBuf> {
    let mut chance = [0; 8];
    getrandom::fill(&mut chance).map_err(|e| std::io::Error::other(e.to_string()))?;
    let folder = std::env::temp_dir().join(format!("typodont-{}", crate::scenario::hex(&chance)));
    let mut builder = std::fs::DirBuilder::new();
    #[cfg(unix)]
    std::os::unix::fs::DirBuilderExt::mode(&mut builder, 0o700);
    builder.create(&folder)?;
    Ok(folder)
}

/// What a cohort's maps are drawn from, and one recording for the words of each questionnaire.
fn fetch(store: &Store, kept: &[Kept], cohort: &mut Cohort) -> Result<Fetched, Failure> {
    let folder = own_folder().map_err(|e| Failure::wrong(format!("temporary folder: unwritable-folder: {e}")))?;
    let fetched = Fetched(folder.clone());
    let mut worded = BTreeSet::new();
    for k in kept {
        let own = folder.join(&k.id).join(&k.bundle);
        let unwritable = |e: std::io::Error| Failure::wrong(format!("{}: unwritable-folder: {e}", folder.display()));
        std::fs::create_dir_all(&own).map_err(unwritable)?;
        let words = k.session.questionnaire.as_ref().is_some_and(|q| worded.insert(q.id.clone()));
        for name in [TIMES].into_iter().chain(words.then_some(RECORDING)) {
            if k.manifest.file(name).is_none() {
                continue;
            }
            match store.take(&k.manifest, name) {
                Ok(bytes) => std::fs::write(own.join(name), bytes).map_err(unwritable)?,
                Err((why, _)) => cohort.skipped.push((PathBuf::from(&k.id), why)),
            }
        }
    }
    Ok(fetched)
}
