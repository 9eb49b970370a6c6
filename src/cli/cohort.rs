//! `typodont cohort`: many bundles, compared.

use super::school::Source;
use super::{Failure, say, write};
use crate::report::cohort::{Cohort, Rating, ratings};
use crate::report::harmless;
use clap::Args;
use std::path::{Path, PathBuf};

#[derive(Args)]
pub struct Arguments {
    #[command(flatten)]
    source: Source,
    /// One line per session, one column per measure
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// A page for people: spreads, maps, learning curves, reliability, pass marks, the questionnaire
    #[arg(long, value_name = "FILE")]
    html: Option<PathBuf>,
    /// The same numbers for programs
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Participants whom the others are compared with
    #[arg(long, value_name = "CODE[,CODE]", value_delimiter = ',')]
    expert: Vec<String>,
    /// Examiners' judgements, for pass marks: a CSV with the columns participant, rating (1 to 5) and, if it matters, scenario
    #[arg(long, value_name = "FILE.csv")]
    ratings: Option<PathBuf>,
    /// Folder for the maps of what share of people removed each voxel, as NRRD
    #[arg(long, value_name = "DIR")]
    maps: Option<PathBuf>,
}

/// Letters of a path or a reason that are told.
const TOLD_MAX: usize = 300;

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let Arguments { csv, html, json, maps, .. } = arguments;
    let compares = csv.is_some() && !arguments.expert.is_empty();
    let mut read = arguments.source.read(html.is_some() || json.is_some() || maps.is_some() || compares)?;
    let mut cohort = std::mem::take(&mut read.cohort);
    cohort.experts = experts(&cohort, &arguments.expert)?;
    cohort.ratings =
        arguments.ratings.as_deref().map(|path| judgements(&cohort, path)).transpose()?.unwrap_or_default();
    let known = cohort.skipped.len();
    if html.is_some() || json.is_some() || maps.is_some() || csv.is_some() && !cohort.experts.is_empty() {
        cohort.map_removals();
    }
    tell_skipped(&cohort, known);
    write_all(&cohort, html.as_deref(), csv.as_deref(), json.as_deref())?;
    if let Some(folder) = maps {
        write_maps(&cohort, folder)?;
    }
    say(cohort.text().trim_end())
}

/// The bundles below a folder; complains about what is none, and fails where there is none.
pub fn read(folder: &Path) -> Result<Cohort, Failure> {
    if !folder.is_dir() {
        return Err(Failure::wrong(format!("{}: missing-folder: there is no such folder", folder.display())));
    }
    let cohort = Cohort::read(folder);
    tell_skipped(&cohort, 0);
    if cohort.sessions.is_empty() {
        return Err(Failure::Wrong(format!("{}: no-sessions: no bundle was found there", folder.display())));
    }
    Ok(cohort)
}

fn tell_skipped(cohort: &Cohort, known: usize) {
    for (path, reason) in &cohort.skipped[known..] {
        eprintln!("{}: skipped: {}", harmless(&path.display().to_string(), TOLD_MAX), harmless(reason, TOLD_MAX));
    }
}

fn experts(cohort: &Cohort, asked: &[String]) -> Result<Vec<String>, Failure> {
    let is_there = |code: &&String| cohort.sessions.iter().any(|(_, s)| s.participant == **code && !code.is_empty());
    let missing: Vec<String> = asked.iter().filter(|code| !is_there(code)).map(|c| harmless(c, 40)).collect();
    match missing.is_empty() {
        true => Ok(asked.to_vec()),
        false => {
            let what = format!(
                "unknown-expert: no session is by \"{}\"; codes are written as in session.json",
                missing.join("\", \"")
            );
            Err(Failure::Wrong(what))
        }
    }
}

fn judgements(cohort: &Cohort, path: &Path) -> Result<Vec<Rating>, Failure> {
    let source = crate::content::read_text(path)?;
    let found = ratings(&path.display().to_string(), &source.text).map_err(|e| Failure::Wrong(e.join("\n")))?;
    for rating in &found {
        if !cohort.sessions.iter().any(|(_, s)| s.participant == rating.participant) {
            let code = harmless(&rating.participant, 40);
            eprintln!("{}: no-session: nobody is \"{code}\" here; that rating counts for nothing", path.display());
        }
    }
    Ok(found)
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

fn write_maps(cohort: &Cohort, folder: &Path) -> Result<(), Failure> {
    let unmade = |e: std::io::Error| Failure::wrong(format!("{}: unwritable-folder: {e}", folder.display()));
    std::fs::create_dir_all(folder).map_err(unmade)?;
    for removal in &cohort.removals {
        write(&folder.join(removal.file_name()), removal.nrrd().map_err(Failure::wrong)?)?;
    }
    Ok(())
}
