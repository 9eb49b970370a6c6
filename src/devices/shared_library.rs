//! Search for a vendor's shared library at run time: vendors' licences forbid shipping it with the program.
//!
//! Takes the paths to try and a function that loads one. Gives the loaded library, or one error with the system
//! loader's message. Never loads anything itself: loading runs foreign code, so that is left to the drivers.

use crate::OpenError;
use std::error::Error;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

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
    let most_telling = complaints.iter().find(|(place, words)| !is_absent(place, words)).or(complaints.first());
    Err(match most_telling {
        Some((place, words)) if is_absent(place, words) => {
            OpenError::absent(format!("cannot load {}: {words}", place.display()), help)
        }
        Some((place, words)) => OpenError::new(
            format!("cannot load {}: {words}", place.display()),
            format!("the installed library is too old, damaged or made for another processor; {help}"),
        ),
        None => OpenError::absent("no location of the library is known", help),
    })
}

/// True if the loader's message means that there is no such file. The messages for a library without a function, and
/// for one that needs another missing library, say so about an existing file.
fn is_absent(place: &Path, words: &str) -> bool {
    let is_about_place = words.starts_with(&*place.to_string_lossy());
    match cfg!(target_os = "linux") {
        true => is_about_place && words.contains("cannot open shared object file"),
        false => !place.is_file(),
    }
}

/// Returns the system loader's message; the text of `error` itself only says that something failed.
fn loader_message(error: &libloading::Error) -> String {
    error.source().map_or_else(|| error.to_string(), |source| source.to_string())
}
