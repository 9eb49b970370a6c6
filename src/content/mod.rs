//! What the program reads: tables, scans, surfaces, and the texts that people wrote.
//!
//! Takes bytes by name. Gives checked values, or every complaint there is. Never changes a file it reads.

pub mod json;
pub mod pointer;
mod syntax;
pub mod nrrd;
pub mod imaging;
pub mod surfaces;
pub mod obj;
pub mod picture_mesh;
pub mod scan;
mod library;
mod coefficient;
mod tissues;
mod hand_ends;
mod instruments;
mod feel;
pub mod measured;
pub mod sounds;

pub use coefficient::CoefficientName;
pub use feel::{AgeBand, FeelTable};
pub use hand_ends::{BladeEntry, CleoidEntry, PluggerEntry, SpoonEntry};
pub use instruments::{
    BentEntry, EndEntry, InstrumentEntry, InstrumentTable, MirrorEntry, PacksEntry, ProbeEntry, ToolKind,
};
pub use library::{Library, read_file, read_text, text_of};
pub use tissues::{PackingEntry, Role, TissueEntry, TissueTable, parse_color};
