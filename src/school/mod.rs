//! Many stations, one record: what a school that outgrew a folder keeps in PostgreSQL and in a store of objects.
//!
//! Takes finished bundles, and an open connection. Gives rows, packs, work to do and what came of it. Never opens a connection or a
//! file of the store, looks at a clock or prints: that is the command line's.

mod address;
mod erasing;
mod migrations;
mod pack;
pub mod partition;
pub mod records;
mod scoring;
mod shard;
pub mod work;

pub use address::{is_near, read_address};
pub use erasing::{Left, erase_participant, left, outlived, removed};
pub use migrations::{Unapplied, apply};
pub use pack::{Changed, FILE as RECORDING, Manifest, PART_BYTES, Pack, PackedFile, PackedPart};
pub use scoring::{Unscored, rescored};
pub use shard::Shard;
