//! Central records of a school with many stations: rows in PostgreSQL, bundles in an object store.
//!
//! Takes finished bundles, and the addresses of a database and a store. Gives database rows, bundle archives, scoring
//! jobs and their results. Never prints, and reads no clock but the one by which [`retry`] ends. Only [`connection`] and
//! [`UreqHttpClient`] open connections.
//!
//! ```
//! use typodont_school::Shard;
//!
//! // Four machines that share the work without talking to each other: each session belongs to exactly one.
//! let shards: Vec<Shard> = (1..=4).map(|n| format!("{n}/4").parse()).collect::<Result<_, _>>()?;
//! let session = "2ed6657d-e927-568b-95e1-2665a8aea6a2";
//! assert_eq!(shards.iter().filter(|shard| shard.contains(session)).count(), 1);
//! # Ok::<(), String>(())
//! ```

mod database_url;
mod erasure;
mod http_client;
mod migrations;
pub mod roles;
mod archive;
pub mod partition;
pub mod records;
mod scoring;
mod shard;
pub mod retry;
pub mod connection;
pub mod store;
pub mod jobs;

pub use archive::{
    ArchiveError, ArchivedFile, ArchivedPart, BundleArchive, Manifest, PART_BYTES, RECORDING_FILE as RECORDING,
};
pub use database_url::{is_local, parse_database_url};
pub use erasure::{PendingDeletion, erase_participant, expired_sessions, mark_deleted, pending_deletions};
pub use http_client::UreqHttpClient;
pub use migrations::{MigrationError, apply_migrations};
pub use scoring::{ScoringError, rescore};
pub use shard::Shard;
