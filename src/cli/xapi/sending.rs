//! `typodont xapi send`: from the spool to the store, as long as it takes.

use super::lrs::{Answer, Lrs};
use super::{Failure, in_words, open, say, unusable};
use crate::handover::spool::Spool;
use serde_json::Value as Json;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::{Duration, Instant};

#[derive(clap::Args)]
pub struct Arguments {
    /// Folder of the spool
    spool: PathBuf,
    /// Address of the store's xAPI
    #[arg(long, value_name = "URL")]
    endpoint: String,
    /// Name under which the store knows this station
    #[arg(long, value_name = "NAME")]
    key: String,
    /// A file with the secret; without it the secret is taken from TYPODONT_LRS_SECRET
    #[arg(long, value_name = "FILE")]
    secret_file: Option<PathBuf>,
    /// Certificates to trust in place of the usual, for a school's own
    #[arg(long, value_name = "FILE.pem")]
    certificates: Option<PathBuf>,
    /// Version of xAPI that the store speaks
    #[arg(long, value_name = "VERSION", default_value = "1.0.3", value_parser = ["1.0.3", "2.0.0"])]
    xapi_version: String,
    /// For how long a store that does not answer is tried again, in seconds
    #[arg(long, value_name = "SECONDS", default_value_t = 60.0)]
    patience: f64,
    /// Stay, and send whatever comes into the spool, until ended
    #[arg(long)]
    stay: bool,
}

/// Statements in one request: a session's as a rule, and small enough for any store's limit.
const AT_ONCE: usize = 50;

/// Between two tries of a store that does not answer: the first and the longest pause.
const PAUSE: Duration = Duration::from_millis(250);
const PAUSE_MAX: Duration = Duration::from_secs(30);

/// Between two looks into the spool.
const LOOK_EVERY: Duration = Duration::from_secs(2);

/// Why sending ended before everything was sent.
enum Stopped {
    LockedOut(String),
    Unanswered(String),
    Spool(std::io::Error),
}

impl From<std::io::Error> for Stopped {
    fn from(error: std::io::Error) -> Stopped {
        Stopped::Spool(error)
    }
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let spool = open(&arguments.spool)?;
    let lrs = store(arguments)?;
    let Some(_held) = spool.hold().map_err(|e| unusable(&arguments.spool, e))? else {
        return Err(Failure::wrong(format!(
            "{}: busy-spool: another program sends from it",
            arguments.spool.display()
        )));
    };
    let patience =
        Duration::try_from_secs_f64(arguments.patience).map_err(|e| Failure::misuse(format!("--patience: {e}")))?;
    loop {
        match send(&spool, &lrs, patience) {
            Ok(()) if !arguments.stay => break,
            Err(Stopped::Unanswered(why)) if arguments.stay => {
                eprintln!("{}: it is tried again: {why}", arguments.endpoint)
            }
            Ok(()) => {}
            Err(Stopped::LockedOut(why)) => {
                return Err(Failure::wrong(format!(
                    "{}: locked-out: {why}; look at --key and its secret",
                    arguments.endpoint
                )));
            }
            Err(Stopped::Unanswered(why)) => {
                let left = spool.tally().map_err(|e| unusable(&arguments.spool, e))?;
                let what = format!("{}: no-answer: {why}; {}", arguments.endpoint, in_words(left));
                return Err(Failure::wrong(what));
            }
            Err(Stopped::Spool(error)) => return Err(unusable(&arguments.spool, error)),
        }
        thread::sleep(LOOK_EVERY);
    }
    say(in_words(spool.tally().map_err(|e| unusable(&arguments.spool, e))?))
}

fn store(arguments: &Arguments) -> Result<Lrs, Failure> {
    let secret = match &arguments.secret_file {
        Some(path) => crate::content::read_text(path)?.text.trim().to_string(),
        None => std::env::var("TYPODONT_LRS_SECRET").map_err(|_| {
            Failure::misuse("no-secret: give --secret-file, or the secret in the environment's TYPODONT_LRS_SECRET")
        })?,
    };
    let roots = arguments.certificates.as_deref().map(crate::content::read_file).transpose()?;
    Lrs::at(&arguments.endpoint, &arguments.key, &secret, roots.as_deref(), &arguments.xapi_version)
        .map_err(|e| Failure::misuse(format!("--endpoint: {e}")))
}

/// Sends everything that waits. A refused file is put aside and does not hold up the rest.
fn send(spool: &Spool, lrs: &Lrs, patience: Duration) -> Result<(), Stopped> {
    for file in spool.waiting()? {
        match send_file(spool, lrs, &file, patience)? {
            None => spool.sent(&file)?,
            Some(why) => {
                eprintln!("{}: refused: {why}", file.display());
                spool.refused(&file, &why)?;
            }
        }
    }
    Ok(())
}

/// Sends a file; why it is refused, if it is.
fn send_file(spool: &Spool, lrs: &Lrs, file: &Path, patience: Duration) -> Result<Option<String>, Stopped> {
    let statements = match spool.statements(file) {
        Ok(statements) => statements,
        Err(error) => return Ok(Some(format!("the file is damaged: {error}"))),
    };
    for part in statements.chunks(AT_ONCE) {
        let refused = match patiently(patience, || lrs.post(part))? {
            Answer::Refused(why) => Some(why),
            // One of them is there with other content; the others may not be.
            Answer::Conflict => one_by_one(lrs, part, patience)?,
            _ => None,
        };
        if refused.is_some() {
            return Ok(refused);
        }
    }
    Ok(None)
}

fn one_by_one(lrs: &Lrs, statements: &[Json], patience: Duration) -> Result<Option<String>, Stopped> {
    for statement in statements {
        let id = statement["id"].as_str().unwrap_or_default();
        match patiently(patience, || lrs.post(std::slice::from_ref(statement)))? {
            Answer::Refused(why) => return Ok(Some(why)),
            // Where it is there it stays as it was first told: a record is not rewritten.
            Answer::Conflict => {
                if let Answer::Refused(why) = patiently(patience, || lrs.has(id))? {
                    return Ok(Some(why));
                }
            }
            _ => {}
        }
    }
    Ok(None)
}

/// The store's answer, once it has one.
fn patiently(patience: Duration, ask: impl Fn() -> Answer) -> Result<Answer, Stopped> {
    let begun = Instant::now();
    let mut pause = PAUSE;
    loop {
        match ask() {
            Answer::LockedOut(why) => return Err(Stopped::LockedOut(why)),
            Answer::Later(why) if begun.elapsed() + pause > patience => return Err(Stopped::Unanswered(why)),
            Answer::Later(_) => {
                thread::sleep(pause);
                pause = (pause * 2).min(PAUSE_MAX);
            }
            answer => return Ok(answer),
        }
    }
}
