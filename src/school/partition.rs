//! Parquet exports partitioned by class and month: `sessions/class=2026-A/month=2026-11/sessions.parquet`.
//!
//! Folder names follow Hive's partitioning, which DuckDB, pandas and Spark read as two additional columns.

use super::records::StoredSession;
use std::collections::BTreeMap;
use std::path::PathBuf;
use typodont_integrations::parquet_tables;
use typodont_report::cohort::Cohort;

/// File names of the tables of an export.
const TABLES: [&str; 3] = [parquet_tables::SESSIONS, parquet_tables::METRICS, parquet_tables::EVENTS];

/// Groups sessions by partition name, such as `class=2026-A/month=2026-11`.
pub fn by_partition(stored: Vec<StoredSession>) -> BTreeMap<String, Cohort> {
    let mut parts: BTreeMap<String, Cohort> = BTreeMap::new();
    for StoredSession { id, class, bundle, month, session, verification, .. } in stored {
        let name = format!("class={class}/month={month}");
        let (path, part) = (PathBuf::from(id).join(bundle), parts.entry(name).or_default());
        part.verification.insert(path.clone(), verification);
        part.sessions.push((path, session));
    }
    parts
}

/// Encodes a partition's tables. Names are relative to the export.
///
/// # Errors
///
/// Returns a message when a table cannot be encoded.
pub fn files(partition: &str, sessions: &Cohort) -> Result<Vec<(String, Vec<u8>)>, String> {
    let made = parquet_tables::all_tables(sessions)?;
    Ok(made.into_iter().map(|(table, bytes)| (name(table, partition), bytes)).collect())
}

/// Returns the names of a partition's files, relative to the export.
pub fn names(partition: &str) -> [String; 3] {
    TABLES.map(|table| name(table, partition))
}

fn name(table: &str, partition: &str) -> String {
    format!("{}/{partition}/{table}", table.trim_end_matches(".parquet"))
}
