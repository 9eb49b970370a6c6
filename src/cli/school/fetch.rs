//! `typodont school fetch` and `judgements`: downloads bundles, and exchanges examiners' overrides and ratings with the
//! records.

use super::database::DatabaseArguments;
use super::source::{SessionSource, audit_read};
use super::store_arguments::StoreArguments;
use super::store_marker;
use crate::cli::progress::progress_bar;
use crate::cli::{CliError, print_line};
use clap::Args;
use sha2::{Digest, Sha256};
use std::fs;
use std::path::{Path, PathBuf};
use typodont_exercise::scenario::hex;
use typodont_report::name_folding::examiner_key;
use typodont_report::sanitize_display;
use typodont_review::{
    AppendError, ChainedLog, LogEntry, LogSnapshot, LoggedDraft, OverrideSnapshot, RatingEntry, RatingSnapshot,
};
use typodont_school::connection::{DbConnection, DbError};
use typodont_school::records;
use typodont_school::records::{LogTable, StoredSession, is_plain_name};

#[derive(Args)]
pub struct Arguments {
    #[command(flatten)]
    source: SessionSource,
}

#[derive(Args)]
pub struct JudgementsArguments {
    /// Folder in which `typodont review` was used
    folder: PathBuf,
    #[command(flatten)]
    at: DatabaseArguments,
}

pub fn run(arguments: &Arguments) -> Result<(), CliError> {
    let SessionSource { folder, at, store, class, .. } = &arguments.source;
    let Some(folder) = folder else {
        return Err(CliError::misuse("no-folder: give the folder for the bundles"));
    };
    let (fetched, failed) = fetch_bundles(at, store, class.as_deref(), folder)?;
    print_line(format!("{}: {fetched} bundles downloaded, {failed} failed", folder.display()))?;
    if failed > 0 { Err(CliError::AlreadyReported) } else { Ok(()) }
}

/// Downloads bundles that are missing in the folder; a bundle is complete or absent. Returns the numbers of bundles
/// downloaded and failed.
pub fn fetch_bundles(
    at: &DatabaseArguments,
    store: &StoreArguments,
    class: Option<&str>,
    folder: &Path,
) -> Result<(usize, usize), CliError> {
    let class = class.map(String::from);
    let source = SessionSource { folder: None, at: at.clone(), store: store.clone(), class, scorer: None };
    let store = store.open(at.retry_policy()?)?;
    let (mut connection, stored) = source.stored_sessions()?;
    store_marker::verify(&mut connection, &store)?;
    audit_read(&mut connection, &stored)?;
    let bar = progress_bar(stored.len() as u64, "fetched");
    let (mut fetched, mut failed) = (0, 0);
    for k in &stored {
        let (path, partial) = (folder.join(&k.id), folder.join(format!("{}.partial", k.id)));
        if !path.exists() {
            match fetch_bundle(&store, k, &partial) {
                Ok(()) => {
                    let unwritable = |e| CliError::wrong(format!("{}: unwritable-folder: {e}", path.display()));
                    fs::rename(&partial, &path).map_err(unwritable)?;
                    fetched += 1;
                }
                Err(why) => {
                    failed += 1;
                    eprintln!("{}: {}", k.id, sanitize_display(&why, 300));
                }
            }
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok((fetched, failed))
}

fn fetch_bundle(store: &super::ObjectStoreHandle, stored: &StoredSession, partial: &Path) -> Result<(), String> {
    let unwritable = |e: std::io::Error| format!("unwritable-folder: {e}: {}", partial.display());
    for file in &stored.manifest.files {
        // The name comes from a station: it must not lead to another folder.
        if !file.name.split('/').all(is_plain_name) {
            return Err(format!("\"{}\" is not a file of a bundle", file.name));
        }
        let path = partial.join(&file.name);
        fs::create_dir_all(path.parent().unwrap_or(partial)).map_err(unwritable)?;
        let bytes = store.read_bundle_file(&stored.manifest, &file.name).map_err(|(why, _)| why)?;
        fs::write(path, bytes).map_err(unwritable)?;
    }
    Ok(())
}

pub fn run_judgements(arguments: &JudgementsArguments) -> Result<(), CliError> {
    let JudgementsArguments { folder, at } = arguments;
    let mut connection = at.connection()?;
    let overrides = exchange_overrides(&mut connection, folder)?;
    let ratings = exchange_ratings(&mut connection, folder)?;
    print_line(format!(
        "{}: {} overrides uploaded, {} downloaded; {} ratings uploaded, {} downloaded",
        folder.display(),
        overrides.uploaded,
        overrides.downloaded,
        ratings.uploaded,
        ratings.downloaded
    ))
}

/// Number of lines exchanged in each direction.
pub struct ExchangeCounts {
    pub uploaded: u64,
    pub downloaded: usize,
}

/// Exchanges the overrides of a folder with the records; see [`exchange_log`].
///
/// # Errors
/// A message if the log cannot be read or written, or the database does not answer.
pub fn exchange_overrides(connection: &mut DbConnection, folder: &Path) -> Result<ExchangeCounts, CliError> {
    // A later override made here takes precedence: a downloaded line must not replace it.
    exchange_log(connection, folder, LogTable::Overrides, |local_log: &OverrideSnapshot, entry| {
        let item = entry.draft.item.as_ref().map(|item| item.index);
        local_log.latest_for(&entry.draft.session, item).is_some_and(|last| last.at > entry.at)
    })
}

/// Exchanges the ratings of a folder with the records; see [`exchange_log`].
///
/// # Errors
/// A message if the log cannot be read or written, the records have no table for ratings yet, or the database does not
/// answer.
pub fn exchange_ratings(connection: &mut DbConnection, folder: &Path) -> Result<ExchangeCounts, CliError> {
    // Of ratings that are not blind the latest counts: an earlier one of the same examiner must not follow it.
    exchange_log(connection, folder, LogTable::Ratings, |local_log: &RatingSnapshot, entry| {
        let is_later = |own: &&RatingEntry| {
            own.at > entry.at
                && own.draft.session == entry.draft.session
                && examiner_key(&own.draft.name) == examiner_key(&entry.draft.name)
        };
        !entry.draft.blind && local_log.valid_entries().any(|own| is_later(&own))
    })
}

/// Uploads, word for word, the valid lines of a folder's log that are not in the records yet, and appends to the log
/// the lines of other examiners, except those that `is_overtaken` by a line of the log.
fn exchange_log<D: LoggedDraft + PartialEq>(
    connection: &mut DbConnection,
    folder: &Path,
    table: LogTable,
    is_overtaken: impl Fn(&LogSnapshot<D>, &LogEntry<D>) -> bool,
) -> Result<ExchangeCounts, CliError> {
    let path = folder.join(D::FILE_NAME);
    let failed = |e| CliError::wrong(format!("{}: unreadable-file: {e}", path.display()));
    let mut log = ChainedLog::<D>::of(folder);
    let local_log = log.read(None).map_err(failed)?;
    let remote_log = match connection.query_with_retry(|client| records::read_log::<D>(client, table)) {
        Err(DbError::Rejected(error)) if records::is_missing_table(&error) => {
            return Err(CliError::wrong(
                "old-schema: the database has no table for examiners' ratings yet; its owner runs typodont school init",
            ));
        }
        read => read?,
    };
    let is_in = |snapshot: &LogSnapshot<D>, entry: &LogEntry<D>| {
        snapshot.valid_entries().any(|e| e.at == entry.at && e.draft == entry.draft)
    };
    let text = if path.is_file() { typodont_formats::read_text(&path)?.text.clone() } else { String::new() };
    let mut lines = Vec::new();
    for entry in local_log.valid_entries().filter(|entry| !is_in(&remote_log, entry)) {
        let line = text.lines().find(|line| serde_json::from_str::<LogEntry<D>>(line).is_ok_and(|e| e == *entry));
        lines.extend(line.map(|line| (entry.clone(), line.to_string(), hex(&Sha256::digest(line)))));
    }
    let mut uploaded = 0;
    if !lines.is_empty() {
        // A log is identified by its first line and its login.
        let first = hex(&Sha256::digest(text.lines().next().unwrap_or_default()));
        let name = format!("{}:{}", connection.query_with_retry(records::login_name)?, &first[..16]);
        uploaded = connection.query_with_retry(|client| records::insert_log_lines(client, table, &name, &lines))?;
    }
    let mut downloaded = 0;
    let remote_lines = remote_log.valid_entries();
    for entry in remote_lines.filter(|entry| !is_in(&local_log, entry) && !is_overtaken(&local_log, entry)) {
        let append = log.append(&entry.at, None, |_| Ok::<_, std::convert::Infallible>(entry.draft.clone()));
        append.map_err(|unwritten| match unwritten {
            AppendError::Io(error) => failed(error),
            AppendError::Rejected(never) => match never {},
        })?;
        downloaded += 1;
    }
    Ok(ExchangeCounts { uploaded, downloaded })
}
