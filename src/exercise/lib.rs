//! Exercises: the catalogue, scenarios, workpieces, sessions, scripted operators, recordings and scores.
//!
//! Takes texts that people wrote, readings of a device, and inputs. Gives sessions, recordings of them, and scores that
//! follow from a recording alone. Never opens a device or a window, and never reads a clock.
//!
//! A scenario is read with the tables that ship with the program. Every fault is reported, never repaired:
//!
//! ```
//! use std::path::Path;
//! use typodont_exercise::scenario::{ResolveMode, resolve};
//! use typodont_formats::{Library, read_text};
//!
//! let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios/10-class-one.json");
//! let scenario = resolve(read_text(&file).unwrap(), &Library::shipped(), ResolveMode::ReadScans).unwrap();
//! let rubric = scenario.rubric.unwrap();
//! let points: f64 = rubric.items.iter().map(|item| item.points).sum();
//! assert_eq!((points, rubric.pass_points), (100.0, 70.0));
//! ```

pub mod local_text;
pub mod catalog;
pub mod tooth_import;
mod instrument_import;
pub mod scenario;
pub mod session;
pub mod record;
pub mod score;
