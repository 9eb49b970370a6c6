//! `typodont xapi send`: sends the spool to the store, with retries.

use super::{CliError, describe, open_spool, print_line, spool_error};
use serde_json::Value as Json;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::{Duration, Instant};
use typodont_integrations::lrs::{Lrs, LrsResponse};
use typodont_integrations::spool::Spool;

#[derive(clap::Args)]
pub struct Arguments {
    /// Folder of the spool
    spool: PathBuf,
    /// Address of the store's xAPI endpoint
    #[arg(long, value_name = "URL")]
    endpoint: String,
    /// User name of this station at the store
    #[arg(long, value_name = "NAME")]
    key: String,
    /// File with the secret; by default the secret is taken from TYPODONT_LRS_SECRET
    #[arg(long, value_name = "FILE")]
    secret_file: Option<PathBuf>,
    /// Certificates to trust instead of the public authorities, for a school's own authority
    #[arg(long, value_name = "FILE.pem")]
    certificates: Option<PathBuf>,
    /// Version of xAPI that the store speaks
    #[arg(long, value_name = "VERSION", default_value = "1.0.3", value_parser = ["1.0.3", "2.0.0"])]
    xapi_version: String,
    /// Time to keep trying a store that does not respond, in seconds
    #[arg(long, value_name = "SECONDS", default_value_t = 60.0)]
    patience: f64,
    /// Keep running and send new statements of the spool until the program is stopped
    #[arg(long)]
    stay: bool,
}

/// Maximum number of statements in one request: usually all of a session, and below the limit of any store.
const STATEMENTS_PER_REQUEST: usize = 50;

/// First and longest pause between two requests to a store that does not respond.
const BACKOFF: Duration = Duration::from_millis(250);
const BACKOFF_MAX: Duration = Duration::from_secs(30);

/// Poll interval of the spool.
const POLL_INTERVAL: Duration = Duration::from_secs(2);

/// Reason why sending ended before everything was sent.
enum SendError {
    Unauthorized(String),
    Unreachable(String),
    Spool(std::io::Error),
}

impl From<std::io::Error> for SendError {
    fn from(error: std::io::Error) -> SendError {
        SendError::Spool(error)
    }
}

pub fn run(arguments: &Arguments) -> Result<(), CliError> {
    let spool = open_spool(&arguments.spool)?;
    let lrs = connect(arguments)?;
    let Some(_held) = spool.lock().map_err(|e| spool_error(&arguments.spool, e))? else {
        return Err(CliError::wrong(format!(
            "{}: busy-spool: another program is sending from this spool",
            arguments.spool.display()
        )));
    };
    let patience =
        Duration::try_from_secs_f64(arguments.patience).map_err(|e| CliError::misuse(format!("--patience: {e}")))?;
    loop {
        match send_waiting(&spool, &lrs, patience) {
            Ok(()) if !arguments.stay => break,
            Err(SendError::Unreachable(why)) if arguments.stay => {
                eprintln!("{}: will be tried again: {why}", arguments.endpoint)
            }
            Ok(()) => {}
            Err(SendError::Unauthorized(why)) => {
                return Err(CliError::wrong(format!(
                    "{}: locked-out: {why}; check --key and its secret",
                    arguments.endpoint
                )));
            }
            Err(SendError::Unreachable(why)) => {
                let left = spool.counts().map_err(|e| spool_error(&arguments.spool, e))?;
                let what = format!("{}: no-answer: {why}; {}", arguments.endpoint, describe(left));
                return Err(CliError::wrong(what));
            }
            Err(SendError::Spool(error)) => return Err(spool_error(&arguments.spool, error)),
        }
        thread::sleep(POLL_INTERVAL);
    }
    print_line(describe(spool.counts().map_err(|e| spool_error(&arguments.spool, e))?))
}

fn connect(arguments: &Arguments) -> Result<Lrs, CliError> {
    let secret = match &arguments.secret_file {
        Some(path) => typodont_formats::read_text(path)?.text.trim().to_string(),
        None => std::env::var("TYPODONT_LRS_SECRET").map_err(|_| {
            CliError::misuse("no-secret: give --secret-file, or set the environment variable TYPODONT_LRS_SECRET")
        })?,
    };
    let roots = arguments.certificates.as_deref().map(typodont_formats::read_file).transpose()?;
    Lrs::at(&arguments.endpoint, &arguments.key, &secret, roots.as_deref(), &arguments.xapi_version)
        .map_err(|e| CliError::misuse(format!("--endpoint: {e}")))
}

/// Sends all waiting files. A refused file is moved aside and does not delay the others.
fn send_waiting(spool: &Spool, lrs: &Lrs, patience: Duration) -> Result<(), SendError> {
    for file in spool.waiting()? {
        match send_file(spool, lrs, &file, patience)? {
            None => spool.mark_sent(&file)?,
            Some(why) => {
                eprintln!("{}: refused: {why}", file.display());
                spool.mark_refused(&file, &why)?;
            }
        }
    }
    Ok(())
}

/// Sends a file; returns the reason if the store refuses it.
fn send_file(spool: &Spool, lrs: &Lrs, file: &Path, patience: Duration) -> Result<Option<String>, SendError> {
    let statements = match spool.statements(file) {
        Ok(statements) => statements,
        Err(error) => return Ok(Some(format!("the file is damaged: {error}"))),
    };
    for part in statements.chunks(STATEMENTS_PER_REQUEST) {
        let refused = match with_retry(patience, || lrs.post(part))? {
            LrsResponse::Rejected(why) => Some(why),
            // One statement is in the store with other content; the others may be missing.
            LrsResponse::Conflict => send_individually(lrs, part, patience)?,
            _ => None,
        };
        if refused.is_some() {
            return Ok(refused);
        }
    }
    Ok(None)
}

fn send_individually(lrs: &Lrs, statements: &[Json], patience: Duration) -> Result<Option<String>, SendError> {
    for statement in statements {
        let id = statement["id"].as_str().unwrap_or_default();
        match with_retry(patience, || lrs.post(std::slice::from_ref(statement)))? {
            LrsResponse::Rejected(why) => return Ok(Some(why)),
            // A statement that the store already has is kept as first sent: records are not rewritten.
            LrsResponse::Conflict => {
                if let LrsResponse::Rejected(why) = with_retry(patience, || lrs.has(id))? {
                    return Ok(Some(why));
                }
            }
            _ => {}
        }
    }
    Ok(None)
}

/// Repeats a request until the store responds or `patience` has passed.
fn with_retry(patience: Duration, ask: impl Fn() -> LrsResponse) -> Result<LrsResponse, SendError> {
    let begun = Instant::now();
    let mut pause = BACKOFF;
    loop {
        match ask() {
            LrsResponse::Unauthorized(why) => return Err(SendError::Unauthorized(why)),
            LrsResponse::RetryLater(why) if begun.elapsed() + pause > patience => {
                return Err(SendError::Unreachable(why));
            }
            LrsResponse::RetryLater(_) => {
                thread::sleep(pause);
                pause = (pause * 2).min(BACKOFF_MAX);
            }
            answer => return Ok(answer),
        }
    }
}
