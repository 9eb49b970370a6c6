//! `typodont xapi`: sessions for a learning record store, spooled on disk and sent when it can be reached.

mod lrs;
mod sending;

use super::{Failure, cohort, say};
use crate::handover::spool::{Spool, Tally};
use crate::handover::{Naming, Pseudonyms, session_id, statements};
use crate::report::cohort::wording;
use clap::{Args, Subcommand};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

#[derive(Args)]
pub struct Arguments {
    #[command(subcommand)]
    what: What,
}

#[derive(Subcommand)]
enum What {
    /// Make statements of bundles and put them into a spool; what was put before is left
    Make(Make),
    /// Send a spool to a learning record store, again and again until it has everything
    Send(sending::Arguments),
    /// Say how much of a spool waits, is sent, was refused
    Status(Status),
}

#[derive(Args)]
struct Make {
    /// Folder that holds bundles, at any depth
    folder: PathBuf,
    /// Folder of the spool; it is made where there is none
    #[arg(long, value_name = "DIR")]
    spool: PathBuf,
    /// The school's address, under which accounts and activities are named
    #[arg(long, value_name = "URL")]
    home_page: String,
    /// A file with a secret of 16 bytes or more: people are called by a keyed digest of their codes
    #[arg(long, value_name = "FILE")]
    pseudonym_key: Option<PathBuf>,
    /// What this station is called
    #[arg(long, value_name = "NAME")]
    platform: Option<String>,
}

#[derive(Args)]
struct Status {
    /// Folder of the spool
    spool: PathBuf,
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    match &arguments.what {
        What::Make(arguments) => make(arguments),
        What::Send(arguments) => sending::run(arguments),
        What::Status(arguments) => {
            let spool = open(&arguments.spool)?;
            say(in_words(spool.tally().map_err(|e| unusable(&arguments.spool, e))?))
        }
    }
}

fn make(arguments: &Make) -> Result<(), Failure> {
    let cohort = cohort::read(&arguments.folder)?;
    let mut naming = Naming::at(&arguments.home_page).map_err(|e| Failure::misuse(format!("--home-page: {e}")))?;
    naming.platform.clone_from(&arguments.platform);
    if let Some(path) = &arguments.pseudonym_key {
        let key = crate::content::read_file(path)?;
        let wrong = |e| Failure::wrong(format!("{}: weak-key: {e}", path.display()));
        naming.pseudonyms = Pseudonyms::keyed(key.trim_ascii()).map_err(wrong)?;
    }
    std::fs::create_dir_all(&arguments.spool).map_err(|e| unusable(&arguments.spool, e))?;
    let spool = open(&arguments.spool)?;
    let mut words = BTreeMap::new();
    let (mut sessions, mut told) = (0, 0);
    for (_, session) in &cohort.sessions {
        let questionnaire = session.questionnaire.as_ref().map(|q| q.id.as_str());
        if let Some(id) = questionnaire {
            words.entry(id).or_insert_with(|| wording(&cohort, id));
        }
        let wording = questionnaire.and_then(|id| words[id].as_ref());
        let statements = statements(session, &naming, wording);
        if spool.put(&session_id(session), &statements).map_err(|e| unusable(&arguments.spool, e))? {
            sessions += 1;
            told += statements.len();
        }
    }
    say(format!("{}: {told} statements of {sessions} sessions", arguments.spool.display()))
}

/// A spool that is there already.
fn open(folder: &Path) -> Result<Spool, Failure> {
    if !folder.is_dir() {
        return Err(Failure::wrong(format!("{}: missing-folder: there is no such spool", folder.display())));
    }
    Spool::open(folder).map_err(|e| unusable(folder, e))
}

fn unusable(folder: &Path, error: std::io::Error) -> Failure {
    Failure::wrong(format!("{}: unusable-spool: {error}", folder.display()))
}

fn in_words(Tally { waiting, sent, refused }: Tally) -> String {
    format!("{waiting} sessions wait, {sent} are sent, {refused} were refused")
}
