//! Search for a vendor's shared library at run time: vendors' licences forbid shipping it with the program.
//!
//! Takes the paths to try and a function that loads one. Gives the loaded library, or one error with the system
//! loader's message. Never loads anything itself: loading runs foreign code, so that is left to the drivers.

use crate::OpenError;
use std::error::Error;
use std::ffi::OsStr;
use std::path::PathBuf;

/// Loads the first library that can be loaded: only the path that the user named, or else the default paths in order.
///
/// # Errors
///
/// Returns an error with the most informative message of the loader if none can be loaded.
pub fn load<L>(
    named: Option<&str>,
    default_paths: Vec<PathBuf>,
    help: &str,
    load: impl Fn(&OsStr) -> Result<L, libloading::Error>,
) -> Result<L, OpenError> {
    let places = match named {
        Some(path) => vec![PathBuf::from(path)],
        None => default_paths,
    };
    let mut complaints = Vec::new();
    for place in &places {
        match load(place.as_os_str()) {
            Ok(library) => return Ok(library),
            Err(error) => complaints.push((place, loader_message(&error))),
        }
    }
    // A file that exists but cannot be loaded is more informative than any number of missing ones.
    let is_absent = |(place, words): &(&PathBuf, String)| words.starts_with(&*place.to_string_lossy());
    let most_telling = complaints.iter().find(|c| !is_absent(c)).or(complaints.first());
    let what = match most_telling {
        Some((place, words)) => format!("cannot load {}: {words}", place.display()),
        None => "no location of the library is known".to_string(),
    };
    Err(OpenError::new(what, help))
}

/// Returns the system loader's message; the text of `error` itself only says that something failed.
fn loader_message(error: &libloading::Error) -> String {
    error.source().map_or_else(|| error.to_string(), |source| source.to_string())
}
