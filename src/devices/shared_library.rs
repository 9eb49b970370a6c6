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
            Err(error) => complaints.push((place, is_absent(place, &error), loader_message(&error))),
        }
    }
    // A file that exists but cannot be loaded is more informative than any number of missing ones.
    let most_telling = complaints.iter().find(|(_, is_absent, _)| !is_absent).or(complaints.first());
    Err(match most_telling {
        Some((place, true, words)) => OpenError::absent(format!("cannot load {}: {words}", place.display()), help),
        Some((place, false, words)) => OpenError::new(
            format!("cannot load {}: {words}", place.display()),
            format!("the installed library is too old, damaged or made for another processor; {help}"),
        ),
        None => OpenError::absent("no location of the library is known", help),
    })
}

/// True if there is no such file, or none of that name where the loader looks. A library without a function, and one that
/// needs another missing library, are there.
fn is_absent(place: &Path, error: &libloading::Error) -> bool {
    use libloading::Error::{DlSym, DlSymUnknown, GetProcAddress, GetProcAddressUnknown};
    if matches!(error, DlSym { .. } | DlSymUnknown | GetProcAddress { .. } | GetProcAddressUnknown) {
        return false;
    }
    if cfg!(windows) {
        // The loader gives the same error for the file and for one that it needs.
        !is_on_search_path(place)
    } else if cfg!(target_os = "macos") {
        !loader_message(error).contains("Library not loaded") && !place.is_file()
    } else {
        let words = loader_message(error);
        words.starts_with(&*place.to_string_lossy()) && words.contains("cannot open shared object file")
    }
}

/// True if the file exists or, for a bare name, if a folder of the search path holds it.
fn is_on_search_path(place: &Path) -> bool {
    let is_bare = place.components().count() == 1;
    let folders = std::env::var_os("PATH").filter(|_| is_bare).unwrap_or_default();
    place.is_file() || std::env::split_paths(&folders).any(|folder| folder.join(place).is_file())
}

/// Returns the system loader's message; the text of `error` itself only says that something failed.
fn loader_message(error: &libloading::Error) -> String {
    error.source().map_or_else(|| error.to_string(), |source| source.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bare_name_is_looked_for_on_the_search_path() {
        // Aim: on Windows, a library on the path that lacks a function is too old, not absent. Method: a program that
        // is on the path of every system that builds this one; folders are not searched for a path.
        let cargo = format!("cargo{}", std::env::consts::EXE_SUFFIX);
        assert!(is_on_search_path(Path::new(&cargo)));
        assert!(!is_on_search_path(&Path::new("absent").join(&cargo)));
        assert!(!is_on_search_path(Path::new("typodont-absent.dll")));
    }

    #[test]
    fn only_a_missing_file_is_absent() {
        // Aim: a station without a vendor's software is told apart from one with a damaged library. Method: what the
        // system's own loader says of a name that does not exist, and of a library's missing function.
        let missing = libloading::Error::DlSymUnknown;
        assert!(!is_absent(Path::new("libHD.so"), &missing));
        assert!(!is_absent(Path::new("HD.dll"), &libloading::Error::GetProcAddressUnknown));
    }
}
