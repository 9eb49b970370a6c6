//! Exports for a school's other systems: gradebooks, learning record stores, learning platforms and data analysis.
//!
//! Takes a cohort of sessions. Gives CSV tables for Moodle and Canvas, xAPI statements in a spool on disk, and
//! Parquet tables. Never reads a clock. Only [`lrs`] opens network connections, behind the feature `network`.
//!
//! ```
//! use typodont_integrations::Pseudonyms;
//!
//! let pseudonyms = Pseudonyms::keyed(b"a secret of 16 bytes or more")?;
//! let name = pseudonyms.name_for("student-7", "session id");
//! assert!(name.starts_with("p-") && !name.contains("student-7"));
//! // The same participant has the same pseudonym in every session.
//! assert_eq!(name, pseudonyms.name_for("student-7", "another session id"));
//! # Ok::<(), String>(())
//! ```

pub mod gradebook;
mod identity;
mod iri;
pub mod learning_platform;
#[cfg(feature = "network")]
pub mod lrs;
pub mod spool;
mod xapi;
pub mod parquet_tables;
mod this_machine;
#[cfg(feature = "network")]
pub mod tls_roots;

pub use identity::{Pseudonyms, session_id};
pub use this_machine::is_this_machine;
pub use xapi::{XapiNaming, statements};
