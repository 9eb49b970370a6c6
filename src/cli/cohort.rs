//! `typodont cohort`: many bundles, one table.

use super::{Failure, say, write};
use crate::report::cohort::Cohort;
use clap::Args;
use std::path::{Path, PathBuf};

#[derive(Args)]
pub struct Arguments {
    /// Folder that holds bundles, at any depth
    folder: PathBuf,
    /// One line per session, one column per measure
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// A page for people
    #[arg(long, value_name = "FILE")]
    html: Option<PathBuf>,
    /// Means and spreads for programs
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    if !arguments.folder.is_dir() {
        return Err(Failure::wrong(format!("{}: missing-folder: there is no such folder", arguments.folder.display())));
    }
    let cohort = Cohort::read(&arguments.folder);
    for (path, reason) in &cohort.skipped {
        eprintln!("{}: skipped: {reason}", path.display());
    }
    if cohort.sessions.is_empty() {
        let what = format!("{}: no-sessions: no bundle was found there", arguments.folder.display());
        return Err(Failure::Wrong(what));
    }
    let Arguments { csv, html, json, .. } = arguments;
    write_all(&cohort, html.as_deref(), csv.as_deref(), json.as_deref())?;
    say(cohort.text().trim_end())
}

/// Writes what was asked for.
pub fn write_all(cohort: &Cohort, html: Option<&Path>, csv: Option<&Path>, json: Option<&Path>) -> Result<(), Failure> {
    if let Some(path) = html {
        write(path, cohort.html(&super::templates()?, path).map_err(Failure::wrong)?)?;
    }
    if let Some(path) = csv {
        write(path, cohort.csv())?;
    }
    if let Some(path) = json {
        write(path, cohort.json())?;
    }
    Ok(())
}
