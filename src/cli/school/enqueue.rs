//! `typodont enqueue`: asks workers to score sessions.

use super::database::At;
use super::sync::no_class;
use crate::cli::{Failure, say};

use crate::school::records::has_class;
use crate::school::work;
use crate::score::SCORER_VERSION;
use clap::Args;

#[derive(Args)]
pub struct Arguments {
    /// Which version of the formulae: `current`, which is this program's
    #[arg(long, value_name = "VERSION")]
    scorer: String,
    /// Sessions of this class only
    #[arg(long, value_name = "NAME")]
    class: Option<String>,
    /// Let sessions that were set aside be tried again, too; as a worker
    #[arg(long)]
    again: bool,
    #[command(flatten)]
    at: At,
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let Arguments { class, again, at, .. } = arguments;
    scorer(&arguments.scorer)?;
    let mut line = at.line()?;
    if *again {
        line.ask(|client| work::try_again(client, SCORER_VERSION))?;
    }
    if let Some(class) = class
        && !line.ask(|client| has_class(client, class))?
    {
        return Err(no_class(class));
    }
    let new = line.ask(|client| work::enqueue(client, SCORER_VERSION, class.as_deref()))?;
    let tally = line.ask(|client| work::tally(client, SCORER_VERSION))?;
    let work::Tally { waiting, leased, done, set_aside } = tally;
    say(format!(
        "{new} sessions are to be scored by version {SCORER_VERSION}: {waiting} wait, {leased} are being scored, {done} are done, {set_aside} set aside"
    ))
}

/// The version that a word means, if this program is of it.
pub fn scorer(word: &str) -> Result<u32, Failure> {
    match word == "current" || word == SCORER_VERSION.to_string() {
        true => Ok(SCORER_VERSION),
        false => Err(Failure::misuse(format!(
            "--scorer: unknown-version: this program scores by version {SCORER_VERSION}, which is `current`"
        ))),
    }
}
