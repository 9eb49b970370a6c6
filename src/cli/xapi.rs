//! `typodont xapi`: exports sessions to a learning record store, by a spool on disk from which they are sent.

mod sending;

use super::verification::{self, VerificationArguments};
use super::{CliError, cohort, print_line};
use clap::{Args, Subcommand};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use typodont_integrations::spool::{Spool, SpoolCounts};
use typodont_integrations::{Pseudonyms, XapiNaming, session_id, statements};
use typodont_report::cohort::wording;

#[derive(Args)]
pub struct Arguments {
    #[command(subcommand)]
    what: XapiCommand,
}

#[derive(Subcommand)]
enum XapiCommand {
    /// Write the statements of bundles into a spool; sessions already in it are not changed
    Make(MakeArguments),
    /// Send a spool to a learning record store, and retry until everything is accepted
    Send(sending::Arguments),
    /// Print how many sessions of a spool are waiting, sent and refused
    Status(StatusArguments),
}

#[derive(Args)]
struct MakeArguments {
    /// Folder that contains bundles, at any depth
    folder: PathBuf,
    /// Folder of the spool; it is created if necessary
    #[arg(long, value_name = "DIR")]
    spool: PathBuf,
    /// Home page of the school, which identifies its accounts and activities
    #[arg(long, value_name = "URL")]
    home_page: String,
    /// File with a secret of at least 16 bytes; participants are then identified by a keyed digest of their codes
    #[arg(long, value_name = "FILE")]
    pseudonym_key: Option<PathBuf>,
    /// Name of this station
    #[arg(long, value_name = "NAME")]
    platform: Option<String>,
    #[command(flatten)]
    verification: VerificationArguments,
}

#[derive(Args)]
struct StatusArguments {
    /// Folder of the spool
    spool: PathBuf,
}

pub fn run(arguments: &Arguments) -> Result<(), CliError> {
    match &arguments.what {
        XapiCommand::Make(arguments) => make_statements(arguments),
        XapiCommand::Send(arguments) => sending::run(arguments),
        XapiCommand::Status(arguments) => {
            let spool = open_spool(&arguments.spool)?;
            print_line(describe(spool.counts().map_err(|e| spool_error(&arguments.spool, e))?))
        }
    }
}

fn make_statements(arguments: &MakeArguments) -> Result<(), CliError> {
    let mut cohort = cohort::read_folder(&arguments.folder)?;
    verification::settle(&mut cohort, &arguments.verification)?;
    let mut naming =
        XapiNaming::with_home_page(&arguments.home_page).map_err(|e| CliError::misuse(format!("--home-page: {e}")))?;
    naming.platform.clone_from(&arguments.platform);
    if let Some(path) = &arguments.pseudonym_key {
        let key = typodont_formats::read_file(path)?;
        let wrong = |e| CliError::wrong(format!("{}: weak-key: {e}", path.display()));
        naming.pseudonyms = Pseudonyms::keyed(key.trim_ascii()).map_err(wrong)?;
    }
    std::fs::create_dir_all(&arguments.spool).map_err(|e| spool_error(&arguments.spool, e))?;
    let spool = open_spool(&arguments.spool)?;
    let mut words = BTreeMap::new();
    let (mut sessions, mut statement_count) = (0, 0);
    for (path, session) in &cohort.sessions {
        let questionnaire = session.questionnaire.as_ref().map(|q| q.id.as_str());
        if let Some(id) = questionnaire {
            words.entry(id).or_insert_with(|| wording(&cohort, id));
        }
        let wording = questionnaire.and_then(|id| words[id].as_ref());
        let statements = statements(session, cohort.status(path), &naming, wording);
        if spool.put(&session_id(session), &statements).map_err(|e| spool_error(&arguments.spool, e))? {
            sessions += 1;
            statement_count += statements.len();
        }
    }
    print_line(format!("{}: {statement_count} statements of {sessions} sessions", arguments.spool.display()))
}

/// Opens an existing spool.
fn open_spool(folder: &Path) -> Result<Spool, CliError> {
    if !folder.is_dir() {
        return Err(CliError::wrong(format!("{}: missing-folder: the spool does not exist", folder.display())));
    }
    Spool::open(folder).map_err(|e| spool_error(folder, e))
}

fn spool_error(folder: &Path, error: std::io::Error) -> CliError {
    CliError::wrong(format!("{}: unusable-spool: {error}", folder.display()))
}

fn describe(SpoolCounts { waiting, sent, refused }: SpoolCounts) -> String {
    format!("{waiting} sessions waiting, {sent} sent, {refused} refused")
}
