//! What the program reads: tables, scans, surfaces, and the texts that people wrote.
//!
//! Takes bytes by name. Gives checked values, or every complaint there is. Never changes a file it reads.

pub mod json;
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
mod instruments;
mod feel;
pub mod measured;
pub mod sounds;

pub use coefficient::CoefficientName;
pub use feel::{AgeBand, FeelTable};
pub use instruments::{EndEntry, InstrumentEntry, InstrumentTable, MirrorEntry, ToolKind};
pub use library::{Library, read_file, read_text};
pub use tissues::{Role, TissueEntry, TissueTable, parse_color};
