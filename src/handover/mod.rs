//! What a school's own systems take: its gradebook, its learning record store, its analysis.
//!
//! Takes a cohort of sessions. Gives tables for Moodle and Canvas, xAPI statements in a spool on disk, and Parquet. Never looks at
//! a clock or at the network: sending is the command line's.

pub mod gradebook;
mod identity;
mod iri;
pub mod spool;
mod statement;
pub mod tables;

pub use identity::{Pseudonyms, session_id};
pub use statement::{Naming, statements};
