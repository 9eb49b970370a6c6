//! Data that others made and that is not part of the project: below the folder that `TYPODONT_DATA` names.

use std::io::Write;
use std::path::PathBuf;

/// The file's path. Without the variable the test is left out, aloud; with it the file must be there.
pub fn find(name: &str) -> Option<PathBuf> {
    let Some(folder) = std::env::var_os("TYPODONT_DATA") else {
        // Straight to the terminal: the test harness would keep what a passing test prints to itself.
        let _ = writeln!(std::io::stderr(), "LEFT OUT: TYPODONT_DATA names no folder with {name}");
        return None;
    };
    let path = PathBuf::from(folder).join(name);
    assert!(path.exists(), "TYPODONT_DATA: there is no {}", path.display());
    Some(path)
}
