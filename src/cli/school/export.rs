//! Parquet exports of the records, by class and month; every export is recorded before it is written.

use super::source::SessionSource;
use crate::cli::verification::VerificationArguments;
use crate::cli::{CliError, print_line};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use typodont_report::sanitize_display;
use typodont_school::connection::DbConnection;
use typodont_school::partition;
use typodont_school::records;
use typodont_school::records::{SessionFilter, StoredSession};
use typodont_school::retry::RetryPolicy;
use typodont_school::store::ObjectStoreHandle;

/// Writes all partitions to a folder, or to an object store by URL.
pub fn write(source: &SessionSource, destination: &Path, verification: &VerificationArguments) -> Result<(), CliError> {
    if source.folder.is_some() {
        return Err(CliError::misuse("give either a folder or --database, not both"));
    }
    let retry_policy = source.at.retry_policy()?;
    let destination = canonical_destination(destination)?;
    let wrong = |e: String| CliError::misuse(format!("--output: {e}"));
    let (mut connection, mut stored) = source.stored_sessions()?;
    verification.retain(&mut stored, |k| k.verification.clone())?;
    let store = ObjectStoreHandle::open_folder_or_url(&destination, retry_policy).map_err(wrong)?;
    record_export(&mut connection, &destination, source.scorer_version()?, &stored)?;
    let count = stored.len();
    let partitions = partition::by_partition(stored);
    for (name, sessions) in &partitions {
        for (file, bytes) in partition::files(name, sessions).map_err(CliError::Wrong)? {
            store.put(&file, bytes)?;
        }
    }
    print_line(format!("{destination}: {count} sessions in {} partitions", partitions.len()))
}

/// A destination in the form in which it is recorded: the same from every working folder.
fn canonical_destination(destination: &Path) -> Result<String, CliError> {
    let text = destination.display().to_string();
    match text.contains("://") {
        true => Ok(text.trim_end_matches('/').to_string()),
        false => std::path::absolute(destination)
            .map(|path| path.display().to_string())
            .map_err(|e| CliError::wrong(format!("{text}: unwritable-folder: {e}"))),
    }
}

/// Records the sessions of an export and its destination, before any of them is written.
fn record_export(
    connection: &mut DbConnection,
    destination: &str,
    scorer_version: Option<u32>,
    kept: &[StoredSession],
) -> Result<(), CliError> {
    let version = scorer_version.map(i64::from);
    let ids: Vec<&str> = kept.iter().map(|k| k.id.as_str()).collect();
    connection.query_with_retry(|client| {
        let mut change = client.transaction()?;
        let sql =
            "INSERT INTO typodont.export (what, destination, scorer_version) VALUES ('parquet', $1, $2) RETURNING id";
        let export: i64 = change.query_one(sql, &[&destination, &version])?.get(0);
        let sql = "INSERT INTO typodont.exported (export_id, session_id)
          SELECT $1, id::uuid FROM unnest($2::text[]) AS chosen (id)";
        change.execute(sql, &[&export, &ids])?;
        change.query("SELECT typodont.note('exported', $1)", &[&format!("{} sessions to {destination}", ids.len())])?;
        change.commit()
    })?;
    Ok(())
}

/// Writes a partition of an export again, or removes it if no session of it is left.
///
/// # Errors
/// A message if the export cannot be reached from this computer.
pub fn rewrite_partition(
    connection: &mut DbConnection,
    destination: &str,
    partition: &str,
    retry_policy: RetryPolicy,
) -> Result<(), CliError> {
    let place = Path::new(destination);
    if !destination.contains("://") && !place.is_dir() {
        let why = "missing-folder: this computer cannot reach the export; delete the erased sessions there by hand and \
                   give --done, or give --gone if the export no longer exists";
        return Err(CliError::wrong(format!("{destination}: {why}")));
    }
    let store = ObjectStoreHandle::open_folder_or_url(destination, retry_policy).map_err(CliError::Wrong)?;
    let class = partition.split('/').next().and_then(|part| part.strip_prefix("class=")).map(String::from);
    // Only the sessions of this export, with the scores that it had: later sessions do not belong to it.
    let sql = "SELECT DISTINCT ON (x.session_id) x.session_id::text, e.scorer_version
      FROM typodont.exported x JOIN typodont.export e ON e.id = x.export_id
      WHERE e.destination = $1 ORDER BY x.session_id, e.id DESC";
    let exported: BTreeMap<String, Option<i64>> = connection
        .query_with_retry(|client| client.query(sql, &[&destination]))?
        .iter()
        .map(|row| (row.get(0), row.get(1)))
        .collect();
    let versions: BTreeSet<Option<i64>> = exported.values().copied().collect();
    let mut stored = Vec::new();
    for version in versions {
        let which = SessionFilter { class: class.clone(), scorer_version: version.and_then(|v| u32::try_from(v).ok()) };
        let (read, unreadable) = connection.query_with_retry(|client| records::sessions(client, &which))?;
        for what in unreadable {
            eprintln!("{destination}: {partition}: skipped: {}", sanitize_display(&what, 300));
        }
        stored.extend(read.into_iter().filter(|k| exported.get(&k.id) == Some(&version)));
    }
    let mut partitions = partition::by_partition(stored);
    for file in partition::names(partition) {
        store.remove_partial_uploads(file.rsplit_once('/').map_or("", |(folder, _)| folder));
    }
    match partitions.remove(partition) {
        Some(sessions) => {
            for (file, bytes) in partition::files(partition, &sessions).map_err(CliError::Wrong)? {
                store.put(&file, bytes)?;
            }
        }
        None => {
            for file in partition::names(partition) {
                store.remove(&file)?;
            }
        }
    }
    Ok(())
}
