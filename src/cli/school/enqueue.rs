//! `typodont enqueue`: queues sessions for scoring by workers.

use super::database::DatabaseArguments;
use super::sync::unknown_class_error;
use crate::cli::{CliError, print_line};

use clap::Args;
use typodont_exercise::score::SCORER_VERSION;
use typodont_school::jobs;
use typodont_school::records::has_class;

#[derive(Args)]
pub struct Arguments {
    /// Scoring version; `current` is that of this program
    #[arg(long, value_name = "VERSION")]
    scorer: String,
    /// Only sessions of this class
    #[arg(long, value_name = "NAME")]
    class: Option<String>,
    /// Also retry sessions that were set aside (requires the role of a worker)
    #[arg(long)]
    again: bool,
    #[command(flatten)]
    at: DatabaseArguments,
}

pub fn run(arguments: &Arguments) -> Result<(), CliError> {
    let Arguments { class, again, at, .. } = arguments;
    parse_scorer_version(&arguments.scorer)?;
    let mut connection = at.connection()?;
    if *again {
        connection.query_with_retry(|client| jobs::retry_set_aside(client, SCORER_VERSION))?;
    }
    if let Some(class) = class
        && !connection.query_with_retry(|client| has_class(client, class))?
    {
        return Err(unknown_class_error(class));
    }
    let new = connection.query_with_retry(|client| jobs::enqueue(client, SCORER_VERSION, class.as_deref()))?;
    let tally = connection.query_with_retry(|client| jobs::count_jobs(client, SCORER_VERSION))?;
    let jobs::JobCounts { waiting, leased, done, set_aside } = tally;
    print_line(format!(
        "{new} sessions queued for scoring version {SCORER_VERSION}: {waiting} waiting, {leased} in progress, {done} \
        done, {set_aside} set aside"
    ))
}

/// Parses a scorer version.
///
/// # Errors
/// A message if it is not the version of this program.
pub fn parse_scorer_version(word: &str) -> Result<u32, CliError> {
    match word == "current" || word == SCORER_VERSION.to_string() {
        true => Ok(SCORER_VERSION),
        false => Err(CliError::misuse(format!(
            "--scorer: unknown-version: this program has scoring version {SCORER_VERSION} only; give --scorer current"
        ))),
    }
}
