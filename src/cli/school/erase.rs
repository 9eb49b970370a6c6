//! `typodont school erase` and `retain`: out of the records, the store and the exports.

use super::asking::Line;
use super::database::At;
use super::export::anew;
use super::mark;
use super::store::{Named, Store};
use crate::cli::{Failure, say};
use crate::school::{Left, erase_participant, left, outlived, removed};
use clap::Args;

#[derive(Args)]
pub struct Erase {
    /// The participant's code; `-` reads it from standard input
    #[arg(required_unless_present_any = ["done", "gone"])]
    participant: Option<String>,
    #[command(flatten)]
    at: At,
    #[command(flatten)]
    store: Named,
    /// Say what there is of the participant, and erase nothing
    #[arg(long)]
    dry_run: bool,
    /// Also a code of which the records hold no session: what stations have not sent yet is refused, for good
    #[arg(long)]
    unsent: bool,
    /// An export that was dealt with by hand, as it was listed
    #[arg(long, value_name = "DESTINATION", conflicts_with_all = ["participant", "dry_run"])]
    done: Option<String>,
    /// An export that is no more, as it was listed: nobody is looked for there from now on
    #[arg(long, value_name = "DESTINATION", conflicts_with_all = ["participant", "dry_run", "done"])]
    gone: Option<String>,
}

#[derive(Args)]
pub struct Retain {
    #[command(flatten)]
    at: At,
    #[command(flatten)]
    store: Named,
    /// Say how many sessions would go, and erase nothing
    #[arg(long)]
    dry_run: bool,
}

pub fn erase(arguments: &Erase) -> Result<(), Failure> {
    let mut line = arguments.at.line()?;
    if let Some(destination) = &arguments.done {
        let sql = "DELETE FROM typodont.erasing WHERE kind = 'export' AND place = $1";
        let done = line.ask(|client| client.execute(sql, &[destination]))?;
        if done == 0 {
            return Err(Failure::wrong(format!("{destination}: unknown-export: nothing is left to do there")));
        }
        return say(format!("{destination}: {done} partitions dealt with"));
    }
    if let Some(destination) = &arguments.gone {
        let sql = "DELETE FROM typodont.export WHERE destination = $1";
        if line.ask(|client| client.execute(sql, &[destination]))? == 0 {
            return Err(Failure::wrong(format!("{destination}: unknown-export: nothing was exported there")));
        }
        let sql = "DELETE FROM typodont.erasing WHERE kind = 'export' AND place = $1";
        line.ask(|client| client.execute(sql, &[destination]))?;
        return say(format!("{destination}: forgotten"));
    }
    let code = code(arguments.participant.as_deref().unwrap_or_default())?;
    if code.is_empty() {
        return Err(Failure::misuse("no-code: name a participant; sessions without a code are nobody's"));
    }
    if arguments.dry_run {
        return foretell(&mut line, &code);
    }
    let store = arguments.store.open(arguments.at.patience()?)?;
    mark::check(&mut line, &store)?;
    if sessions_of(&mut line, &code)? == 0 && !arguments.unsent {
        // What broke off before is still gone on with.
        sweep(&mut line, &store, arguments.at.patience()?)?;
        return Err(Failure::wrong(
            "unknown-participant: the records hold no session under this code, and nothing was erased; with --unsent \
             stations refuse it from now on all the same",
        ));
    }
    let gone = line.ask(|client| erase_participant(client, &code))?;
    say(format!("{gone} sessions erased from the records"))?;
    sweep(&mut line, &store, arguments.at.patience()?)
}

pub fn retain(arguments: &Retain) -> Result<(), Failure> {
    let mut line = arguments.at.line()?;
    if arguments.dry_run {
        let due = line.ask(|client| outlived(client, false))?;
        return say(format!("{due} sessions are older than their class keeps them"));
    }
    let store = arguments.store.open(arguments.at.patience()?)?;
    mark::check(&mut line, &store)?;
    let gone = line.ask(|client| outlived(client, true))?;
    say(format!("{gone} sessions erased from the records"))?;
    sweep(&mut line, &store, arguments.at.patience()?)
}

/// A code out of the command line, or of standard input, where no list of processes shows it.
fn code(given: &str) -> Result<String, Failure> {
    if given != "-" {
        return Ok(given.to_string());
    }
    let mut line = String::new();
    std::io::stdin()
        .read_line(&mut line)
        .map_err(|e| Failure::wrong(format!("standard input: unreadable-file: {e}")))?;
    Ok(line.trim_end_matches(['\r', '\n']).to_string())
}

fn sessions_of(line: &mut Line, code: &str) -> Result<i64, Failure> {
    let sql = "SELECT count(*) FROM typodont.session s JOIN typodont.participant p ON p.id = s.participant_id
      WHERE p.code = $1";
    Ok(line.ask(|client| client.query_one(sql, &[&code]))?.get(0))
}

fn foretell(line: &mut Line, code: &str) -> Result<(), Failure> {
    let sessions = sessions_of(line, code)?;
    say(format!("{sessions} sessions with their bundles would go"))?;
    let sql = "SELECT DISTINCT e.destination FROM typodont.export e JOIN typodont.exported x ON x.export_id = e.id
      JOIN typodont.session s ON s.id = x.session_id JOIN typodont.participant p ON p.id = s.participant_id
      WHERE p.code = $1 ORDER BY 1";
    for row in line.ask(|client| client.query(sql, &[&code]))? {
        say(format!("{}: an export that holds some of them", row.get::<_, String>(0)))?;
    }
    Ok(())
}

/// Removes what is left outside the records, also of an erasure that broke off. Fails where an export cannot be reached.
fn sweep(line: &mut Line, store: &Store, patience: super::patience::Patience) -> Result<(), Failure> {
    let mut unreached = false;
    for what in line.ask(left)? {
        match &what {
            Left::Bundle { folder, .. } => {
                let count = store.clear(folder)?;
                say(format!("{folder}: {count} objects removed from the store"))?;
            }
            Left::Export { destination, partition, .. } => match anew(line, destination, partition, patience) {
                Ok(()) => say(format!("{destination}: {partition} is made anew without them"))?,
                Err(failure) => {
                    unreached = true;
                    failure.tell();
                    continue;
                }
            },
        }
        line.ask(|client| removed(client, &what))?;
    }
    if unreached { Err(Failure::Told) } else { Ok(()) }
}
