//! File formats: scans, surfaces, label maps, tables, and JSON and TOML that people write.
//!
//! Takes files and bytes. Gives validated values, or complaints with their places. Never changes a file that it
//! reads.
//!
//! A wrong value is reported with its line, column and JSON pointer:
//!
//! ```
//! use typodont_formats::diagnostic::SourceText;
//! use typodont_formats::json;
//!
//! let source = SourceText::new("depths.json", "[0.5, 1.0, \"deep\"]");
//! let complaints = json::read::<Vec<f64>>(source).unwrap_err();
//! assert_eq!(
//!     complaints[0].headline(),
//!     "depths.json:1:12: wrong-type: /2: expected a number, found the text \"deep\""
//! );
//! ```

pub mod diagnostic;
pub mod json;
pub mod pointer;
mod json_hints;
pub mod toml_reader;
mod library;
mod file_writer;
pub mod limits;
pub mod nrrd;
pub mod imaging;
pub mod surfaces;
pub mod obj;
pub mod solid_mesh;
pub mod picture;
pub mod visual_mesh;
pub mod csv_tables;
pub mod import;
pub mod zip;

pub use file_writer::{remove_unfinished, sync_folder, write_atomically, write_synced};
pub use library::{Library, decode_text, read_file, read_text, write_failure};
