//! `typodont school`, `sync`, `enqueue`, `worker`, `rescore`: for schools that outgrew one machine and a folder.

mod admit;
mod asking;
mod database;
pub mod enqueue;
mod erase;
mod export;
pub mod fetch;
mod http;
mod mark;
mod metrics;
mod patience;
pub mod rescore;
mod source;
mod store;
pub mod sync;
pub mod worker;

use super::{Failure, say};
use crate::report::harmless;
use crate::school;
use clap::{Args, Subcommand};
pub use database::At;
pub use export::write as write_partitions;
pub use source::Source;
pub use store::{Named, Store};

#[derive(Args)]
pub struct Arguments {
    #[command(subcommand)]
    what: What,
}

#[derive(Subcommand)]
enum What {
    /// Make or update the tables in a database; as its owner
    Init(Init),
    /// Make a class, or change for how long its sessions are kept
    Class(Class),
    /// Let a login in as a station, examiner, registrar or worker; as the database's owner
    Admit(admit::Arguments),
    /// Fetch the bundles of a class into a folder, each file checked by its digest
    Fetch(fetch::Arguments),
    /// Enter what an examiner judged in a folder (see `typodont review`), and take over what others judged
    Judgements(fetch::Judgements),
    /// Forget a participant: records, bundles and exports
    Erase(erase::Erase),
    /// Erase sessions that their class no longer keeps
    Retain(erase::Retain),
    /// Print who did what, a line of JSON each
    Audit(Audit),
}

#[derive(Args)]
struct Init {
    #[command(flatten)]
    at: At,
}

#[derive(Args)]
struct Class {
    /// Letters, digits, dot, dash and underscore
    name: String,
    /// Sessions are kept for so many days after they began; without it, as they were kept before, at first for ever
    #[arg(long, value_name = "DAYS", value_parser = clap::value_parser!(i32).range(1..=36500))]
    keep_days: Option<i32>,
    /// Sessions are kept for ever again
    #[arg(long, conflicts_with = "keep_days")]
    keep_always: bool,
    #[command(flatten)]
    at: At,
}

#[derive(Args)]
struct Audit {
    #[command(flatten)]
    at: At,
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    match &arguments.what {
        What::Init(arguments) => init(arguments),
        What::Class(arguments) => class(arguments),
        What::Admit(arguments) => admit::run(arguments),
        What::Fetch(arguments) => fetch::run(arguments),
        What::Judgements(arguments) => fetch::judgements(arguments),
        What::Erase(arguments) => erase::erase(arguments),
        What::Retain(arguments) => erase::retain(arguments),
        What::Audit(arguments) => audit(arguments),
    }
}

fn init(arguments: &Init) -> Result<(), Failure> {
    let mut client = arguments.at.client()?;
    let new = school::apply(&mut client).map_err(|e| Failure::wrong(format!("--database: {e}")))?;
    match new.is_empty() {
        true => say("the schema is as it should be"),
        false => say(format!("applied: {}", new.join(", "))),
    }
}

fn class(arguments: &Class) -> Result<(), Failure> {
    let fits = |c: char| c.is_ascii_alphanumeric() || "._-".contains(c);
    let name = &arguments.name;
    if name.is_empty() || name.len() > 64 || !name.chars().all(fits) || name.starts_with(['.', '_', '-']) {
        return Err(Failure::misuse(format!(
            "\"{}\": wrong-class: letters, digits, dot, dash and underscore, a letter or digit first; 64 at most",
            harmless(name, 80)
        )));
    }
    let mut line = arguments.at.line()?;
    let sql = "INSERT INTO typodont.class (name, keep_days) VALUES ($1, $2)
      ON CONFLICT (name) DO UPDATE
      SET keep_days = CASE WHEN $3 THEN NULL ELSE coalesce(excluded.keep_days, class.keep_days) END
      RETURNING keep_days";
    let values: &[&(dyn postgres::types::ToSql + Sync)] =
        &[&arguments.name, &arguments.keep_days, &arguments.keep_always];
    let row = line.ask(|client| client.query_one(sql, values))?;
    match row.get::<_, Option<i32>>(0) {
        Some(1) => say(format!("{}: sessions are kept for a day", arguments.name)),
        Some(days) => say(format!("{}: sessions are kept for {days} days", arguments.name)),
        None => say(format!("{}: sessions are kept", arguments.name)),
    }
}

fn audit(arguments: &Audit) -> Result<(), Failure> {
    let sql =
        "SELECT json_build_object('number', id, 'at', at, 'login', login, 'action', action, 'session', session_id,
      'detail', detail)::text FROM typodont.audit ORDER BY id";
    for row in arguments.at.line()?.ask(|client| client.query(sql, &[]))? {
        say(row.get::<_, String>(0))?;
    }
    Ok(())
}
