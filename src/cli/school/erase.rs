//! `typodont school erase` and `retain`: erase sessions from the records, the store and the exports.

use super::database::DatabaseArguments;
use super::export::rewrite_partition;
use super::store_arguments::StoreArguments;
use super::store_marker;
use crate::cli::{CliError, print_line};
use clap::Args;
use typodont_school::connection::DbConnection;
use typodont_school::retry::RetryPolicy;
use typodont_school::store::ObjectStoreHandle;
use typodont_school::{PendingDeletion, erase_participant, expired_sessions, mark_deleted, pending_deletions};

#[derive(Args)]
pub struct EraseArguments {
    /// Participant code; `-` reads it from standard input
    #[arg(required_unless_present_any = ["done", "gone"])]
    participant: Option<String>,
    #[command(flatten)]
    at: DatabaseArguments,
    #[command(flatten)]
    store: StoreArguments,
    /// Print what would be erased, and erase nothing
    #[arg(long)]
    dry_run: bool,
    /// Also accept a code without sessions in the records: sessions that stations send later are refused permanently
    #[arg(long)]
    unsent: bool,
    /// Mark an export, named as it was listed, as corrected by hand
    #[arg(long, value_name = "DESTINATION", conflicts_with_all = ["participant", "dry_run"])]
    done: Option<String>,
    /// Remove an export, named as it was listed, from the records because it no longer exists
    #[arg(long, value_name = "DESTINATION", conflicts_with_all = ["participant", "dry_run", "done"])]
    gone: Option<String>,
}

#[derive(Args)]
pub struct RetainArguments {
    #[command(flatten)]
    at: DatabaseArguments,
    #[command(flatten)]
    store: StoreArguments,
    /// Print how many sessions would be erased, and erase nothing
    #[arg(long)]
    dry_run: bool,
}

pub fn erase(arguments: &EraseArguments) -> Result<(), CliError> {
    let mut connection = arguments.at.connection()?;
    if let Some(destination) = &arguments.done {
        let sql = "DELETE FROM typodont.erasing WHERE kind = 'export' AND place = $1";
        let done = connection.query_with_retry(|client| client.execute(sql, &[destination]))?;
        if done == 0 {
            return Err(CliError::wrong(format!("{destination}: unknown-export: nothing is pending for this export")));
        }
        return print_line(format!("{destination}: {done} partitions marked as done"));
    }
    if let Some(destination) = &arguments.gone {
        let sql = "DELETE FROM typodont.export WHERE destination = $1";
        if connection.query_with_retry(|client| client.execute(sql, &[destination]))? == 0 {
            return Err(CliError::wrong(format!(
                "{destination}: unknown-export: the records contain no export to this \
            destination"
            )));
        }
        let sql = "DELETE FROM typodont.erasing WHERE kind = 'export' AND place = $1";
        connection.query_with_retry(|client| client.execute(sql, &[destination]))?;
        return print_line(format!("{destination}: removed from the records"));
    }
    let code = read_code(arguments.participant.as_deref().unwrap_or_default())?;
    if code.is_empty() {
        return Err(CliError::misuse(
            "no-code: the participant code is empty; sessions without a code cannot be erased \
        by participant",
        ));
    }
    if arguments.dry_run {
        return print_dry_run(&mut connection, &code);
    }
    let store = arguments.store.open(arguments.at.retry_policy()?)?;
    store_marker::verify(&mut connection, &store)?;
    if count_sessions(&mut connection, &code)? == 0 && !arguments.unsent {
        // An erasure that was interrupted earlier is still completed.
        remove_pending(&mut connection, &store, arguments.at.retry_policy()?)?;
        return Err(CliError::wrong(
            "unknown-participant: the records contain no session with this code, and nothing was erased; give --unsent \
             to make stations refuse the code in future",
        ));
    }
    let gone = connection.query_with_retry(|client| erase_participant(client, &code))?;
    print_line(format!("{gone} sessions erased from the records"))?;
    remove_pending(&mut connection, &store, arguments.at.retry_policy()?)
}

pub fn retain(arguments: &RetainArguments) -> Result<(), CliError> {
    let mut connection = arguments.at.connection()?;
    if arguments.dry_run {
        let due = connection.query_with_retry(|client| expired_sessions(client, false))?;
        return print_line(format!("{due} sessions would be erased because their retention period has expired"));
    }
    let store = arguments.store.open(arguments.at.retry_policy()?)?;
    store_marker::verify(&mut connection, &store)?;
    let gone = connection.query_with_retry(|client| expired_sessions(client, true))?;
    print_line(format!("{gone} sessions erased from the records"))?;
    remove_pending(&mut connection, &store, arguments.at.retry_policy()?)
}

/// The participant code of the command line, or of standard input, which the list of processes does not show.
fn read_code(given: &str) -> Result<String, CliError> {
    if given != "-" {
        return Ok(given.to_string());
    }
    let mut line = String::new();
    std::io::stdin()
        .read_line(&mut line)
        .map_err(|e| CliError::wrong(format!("standard input: unreadable-file: {e}")))?;
    Ok(line.trim_end_matches(['\r', '\n']).to_string())
}

fn count_sessions(connection: &mut DbConnection, code: &str) -> Result<i64, CliError> {
    let sql = "SELECT count(*) FROM typodont.session s JOIN typodont.participant p ON p.id = s.participant_id
      WHERE p.code = $1";
    Ok(connection.query_with_retry(|client| client.query_one(sql, &[&code]))?.get(0))
}

fn print_dry_run(connection: &mut DbConnection, code: &str) -> Result<(), CliError> {
    let sessions = count_sessions(connection, code)?;
    print_line(format!("{sessions} sessions and their bundles would be erased"))?;
    let sql = "SELECT DISTINCT e.destination FROM typodont.export e JOIN typodont.exported x ON x.export_id = e.id
      JOIN typodont.session s ON s.id = x.session_id JOIN typodont.participant p ON p.id = s.participant_id
      WHERE p.code = $1 ORDER BY 1";
    for row in connection.query_with_retry(|client| client.query(sql, &[&code]))? {
        print_line(format!("{}: this export contains some of them", row.get::<_, String>(0)))?;
    }
    Ok(())
}

/// Removes erased data outside the records, including that of interrupted erasures.
///
/// # Errors
/// A message if an export cannot be reached.
fn remove_pending(
    connection: &mut DbConnection,
    store: &ObjectStoreHandle,
    retry_policy: RetryPolicy,
) -> Result<(), CliError> {
    let mut unreached = false;
    for what in connection.query_with_retry(pending_deletions)? {
        match &what {
            PendingDeletion::Bundle { folder, .. } => {
                let count = store.remove_folder(folder)?;
                print_line(format!("{folder}: {count} objects removed from the store"))?;
            }
            PendingDeletion::Export { destination, partition, .. } => {
                match rewrite_partition(connection, destination, partition, retry_policy) {
                    Ok(()) => print_line(format!("{destination}: {partition} was rewritten without them"))?,
                    Err(failure) => {
                        unreached = true;
                        failure.report();
                        continue;
                    }
                }
            }
        }
        connection.query_with_retry(|client| mark_deleted(client, &what))?;
    }
    if unreached { Err(CliError::AlreadyReported) } else { Ok(()) }
}
