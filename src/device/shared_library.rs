//! Looks for a vendor's shared library: vendors' licences forbid to ship it, so it is sought when a device is.
//!
//! Takes the names to try and how to load one. Gives what was loaded, or one complaint with the loader's own words.
//! Never loads anything itself: loading runs foreign code, and that stands in the drivers.

use super::Trouble;
use std::error::Error;
use std::ffi::OsStr;
use std::path::PathBuf;

/// Loads the first that can be loaded: what the user named and nothing else, or else the usual places in their order.
pub fn load<L>(
    named: Option<&str>,
    usual: Vec<PathBuf>,
    help: &str,
    load: impl Fn(&OsStr) -> Result<L, libloading::Error>,
) -> Result<L, Trouble> {
    let places = match named {
        Some(path) => vec![PathBuf::from(path)],
        None => usual,
    };
    let mut complaints = Vec::new();
    for place in &places {
        match load(place.as_os_str()) {
            Ok(library) => return Ok(library),
            Err(error) => complaints.push((place, loaders_words(&error))),
        }
    }
    // A file that is there but cannot be loaded says more than ten that are not there.
    let is_absent = |(place, words): &(&PathBuf, String)| words.starts_with(&*place.to_string_lossy());
    let telling = complaints.iter().find(|c| !is_absent(c)).or(complaints.first());
    let what = match telling {
        Some((place, words)) => format!("cannot load {}: {words}", place.display()),
        None => "there is no place to look for the library in".to_string(),
    };
    Err(Trouble::new(what, help))
}

/// The loader's text; the error's own says only that something failed.
fn loaders_words(error: &libloading::Error) -> String {
    error.source().map_or_else(|| error.to_string(), |source| source.to_string())
}
