//! Sessions and their measures as Parquet, a folder for each class and month: `sessions/class=2026-A/month=2026-11/`.
//!
//! The folders' names are Hive's, which DuckDB, pandas and Spark read as two columns more.

use super::records::Kept;
use crate::handover::tables;
use crate::report::cohort::Cohort;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Tables of an export.
const TABLES: [&str; 3] = [tables::SESSIONS, tables::METRICS, tables::EVENTS];

/// Sessions by partition.
pub fn partitions(kept: Vec<Kept>) -> BTreeMap<String, Cohort> {
    let mut parts: BTreeMap<String, Cohort> = BTreeMap::new();
    for Kept { class, bundle, month, session, .. } in kept {
        let name = format!("class={class}/month={month}");
        parts.entry(name).or_default().sessions.push((PathBuf::from(bundle), session));
    }
    parts
}

/// A partition's files, by name within the export.
pub fn files(partition: &str, sessions: &Cohort) -> Result<Vec<(String, Vec<u8>)>, String> {
    let made = tables::all(sessions)?;
    Ok(made.into_iter().map(|(table, bytes)| (name(table, partition), bytes)).collect())
}

/// The names of a partition's files.
pub fn names(partition: &str) -> [String; 3] {
    TABLES.map(|table| name(table, partition))
}

fn name(table: &str, partition: &str) -> String {
    format!("{}/{partition}/{table}", table.trim_end_matches(".parquet"))
}
