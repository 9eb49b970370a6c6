//! `typodont school`, `sync`, `enqueue`, `worker`, `rescore`: for schools with many stations and a database.

mod admit;
mod database;
pub mod enqueue;
mod erase;
mod export;
pub mod fetch;
mod store_marker;
mod metrics;
pub mod rescore;
mod source;
mod errors;
mod store_arguments;
pub mod sync;
pub mod worker;

use super::{CliError, print_line};
use clap::{Args, Subcommand};
pub use database::DatabaseArguments;
pub use export::write as write_partitions;
pub use source::SessionSource;
#[cfg(feature = "review")]
pub use store_arguments::StoreArguments;
use typodont_report::sanitize_display;
use typodont_school as school;
use typodont_school::records::{self, Retention};
pub use typodont_school::store::ObjectStoreHandle;

#[derive(Args)]
pub struct Arguments {
    #[command(subcommand)]
    what: SchoolCommand,
}

#[derive(Subcommand)]
enum SchoolCommand {
    /// Create or update the tables of a database, as the database's owner
    Init(InitArguments),
    /// Create a class, or change its retention period
    Class(ClassArguments),
    /// Give a login the role of a station, examiner, registrar or worker, as the database's owner
    Admit(admit::Arguments),
    /// Download the bundles of a class into a folder; the digest of each file is checked
    Fetch(fetch::Arguments),
    /// Upload an examiner's overrides from a folder (see `typodont review`), and download those of others
    Judgements(fetch::JudgementsArguments),
    /// Erase a participant: records, bundles and exports
    Erase(erase::EraseArguments),
    /// Erase sessions whose retention period has expired
    Retain(erase::RetainArguments),
    /// Print the audit log, one JSON object per line
    Audit(AuditArguments),
}

#[derive(Args)]
struct InitArguments {
    #[command(flatten)]
    at: DatabaseArguments,
}

#[derive(Args)]
struct ClassArguments {
    /// Name of the class: letters, digits, dot, dash and underscore
    name: String,
    /// Retention period of sessions, in days after they began; by default the present period is kept, which is unlimited for a new
    /// class
    #[arg(long, value_name = "DAYS", value_parser = clap::value_parser!(i32).range(1..=36500))]
    keep_days: Option<i32>,
    /// Remove the limit of the retention period
    #[arg(long, conflicts_with = "keep_days")]
    keep_always: bool,
    #[command(flatten)]
    at: DatabaseArguments,
}

#[derive(Args)]
struct AuditArguments {
    #[command(flatten)]
    at: DatabaseArguments,
}

pub fn run(arguments: &Arguments) -> Result<(), CliError> {
    match &arguments.what {
        SchoolCommand::Init(arguments) => init(arguments),
        SchoolCommand::Class(arguments) => class(arguments),
        SchoolCommand::Admit(arguments) => admit::run(arguments),
        SchoolCommand::Fetch(arguments) => fetch::run(arguments),
        SchoolCommand::Judgements(arguments) => fetch::run_judgements(arguments),
        SchoolCommand::Erase(arguments) => erase::erase(arguments),
        SchoolCommand::Retain(arguments) => erase::retain(arguments),
        SchoolCommand::Audit(arguments) => audit(arguments),
    }
}

fn init(arguments: &InitArguments) -> Result<(), CliError> {
    let mut client = arguments.at.connect()?;
    let new = school::apply_migrations(&mut client).map_err(|e| CliError::wrong(format!("--database: {e}")))?;
    match new.is_empty() {
        true => print_line("the schema is up to date"),
        false => print_line(format!("applied: {}", new.join(", "))),
    }
}

fn class(arguments: &ClassArguments) -> Result<(), CliError> {
    let fits = |c: char| c.is_ascii_alphanumeric() || "._-".contains(c);
    let name = &arguments.name;
    if name.is_empty() || name.len() > 64 || !name.chars().all(fits) || name.starts_with(['.', '_', '-']) {
        return Err(CliError::misuse(format!(
            "\"{}\": wrong-class: a class name consists of up to 64 letters, digits, dots, dashes and underscores, and \
            begins with a letter or digit",
            sanitize_display(name, 80)
        )));
    }
    let mut connection = arguments.at.connection()?;
    let retention = Retention { days: arguments.keep_days, is_unlimited: arguments.keep_always };
    match connection.query_with_retry(|client| records::set_class(client, &arguments.name, retention))? {
        Some(1) => print_line(format!("{}: sessions are kept for 1 day", arguments.name)),
        Some(days) => print_line(format!("{}: sessions are kept for {days} days", arguments.name)),
        None => print_line(format!("{}: sessions are kept without limit", arguments.name)),
    }
}

fn audit(arguments: &AuditArguments) -> Result<(), CliError> {
    let lines = arguments.at.connection()?.query_with_retry(records::audit_log)?;
    lines.iter().try_for_each(print_line)
}
