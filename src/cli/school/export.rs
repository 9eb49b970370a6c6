//! Parquet out of the records, by class and month; what left is written down first.

use super::asking::Line;
use super::patience::Patience;
use super::source::Source;
use super::store::Store;
use crate::cli::{Failure, say};
use crate::report::harmless;
use crate::school::partition;
use crate::school::records::{self, Kept, Which};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// Writes every partition to a folder, or to a store by URL.
pub fn write(source: &Source, destination: &Path) -> Result<(), Failure> {
    if source.folder.is_some() {
        return Err(Failure::misuse("a folder, or --database: sessions come from one of them"));
    }
    let patience = source.at.patience()?;
    let destination = written(destination)?;
    let wrong = |e: String| Failure::misuse(format!("--output: {e}"));
    let (mut line, kept) = source.kept()?;
    let store = Store::at(&destination, patience).map_err(wrong)?;
    note(&mut line, &destination, source.scorer_version()?, &kept)?;
    let count = kept.len();
    let partitions = partition::partitions(kept);
    for (name, sessions) in &partitions {
        for (file, bytes) in partition::files(name, sessions).map_err(Failure::Wrong)? {
            store.put(&file, bytes)?;
        }
    }
    say(format!("{destination}: {count} sessions in {} partitions", partitions.len()))
}

/// A destination as it is written down: the same from wherever it is named.
fn written(destination: &Path) -> Result<String, Failure> {
    let text = destination.display().to_string();
    match text.contains("://") {
        true => Ok(text.trim_end_matches('/').to_string()),
        false => std::path::absolute(destination)
            .map(|path| path.display().to_string())
            .map_err(|e| Failure::wrong(format!("{text}: unwritable-folder: {e}"))),
    }
}

/// Writes down which sessions go where, before any of them does.
fn note(line: &mut Line, destination: &str, scorer_version: Option<u32>, kept: &[Kept]) -> Result<(), Failure> {
    let version = scorer_version.map(i64::from);
    let ids: Vec<&str> = kept.iter().map(|k| k.id.as_str()).collect();
    line.ask(|client| {
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

/// Makes a partition of an export anew, or removes it where nothing is left of it.
///
/// `Err` where the export cannot be reached from here.
pub fn anew(line: &mut Line, destination: &str, partition: &str, patience: Patience) -> Result<(), Failure> {
    let place = Path::new(destination);
    if !destination.contains("://") && !place.is_dir() {
        let why = "missing-folder: it is not here; delete what it holds of them by hand, then say --done, or --gone if it \
                   is no more";
        return Err(Failure::wrong(format!("{destination}: {why}")));
    }
    let store = Store::at(destination, patience).map_err(Failure::Wrong)?;
    let class = partition.split('/').next().and_then(|part| part.strip_prefix("class=")).map(String::from);
    // Only what this export held, with the scores that it had: sessions that came later are no part of it.
    let sql = "SELECT DISTINCT ON (x.session_id) x.session_id::text, e.scorer_version
      FROM typodont.exported x JOIN typodont.export e ON e.id = x.export_id
      WHERE e.destination = $1 ORDER BY x.session_id, e.id DESC";
    let held: BTreeMap<String, Option<i64>> =
        line.ask(|client| client.query(sql, &[&destination]))?.iter().map(|row| (row.get(0), row.get(1))).collect();
    let versions: BTreeSet<Option<i64>> = held.values().copied().collect();
    let mut kept = Vec::new();
    for version in versions {
        let which = Which { class: class.clone(), scorer_version: version.and_then(|v| u32::try_from(v).ok()) };
        let (read, unread) = line.ask(|client| records::sessions(client, &which))?;
        for what in unread {
            eprintln!("{destination}: {partition}: skipped: {}", harmless(&what, 300));
        }
        kept.extend(read.into_iter().filter(|k| held.get(&k.id) == Some(&version)));
    }
    let mut partitions = partition::partitions(kept);
    for file in partition::names(partition) {
        store.settle(file.rsplit_once('/').map_or("", |(folder, _)| folder));
    }
    match partitions.remove(partition) {
        Some(sessions) => {
            for (file, bytes) in partition::files(partition, &sessions).map_err(Failure::Wrong)? {
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
