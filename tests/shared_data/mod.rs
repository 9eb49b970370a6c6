//! Data that others made: in `$TYPODONT_DATA`, or in `../shared/data` beside the project.

use std::io::Write;
use std::path::{Path, PathBuf};

/// The file's path; without the file the test says loudly that it did nothing.
pub fn find(name: &str) -> Option<PathBuf> {
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data");
    let folder = std::env::var_os("TYPODONT_DATA").map_or_else(beside, PathBuf::from);
    let path = folder.join(name);
    if !path.exists() {
        // Straight to the terminal: the test harness would keep what a passing test prints to itself.
        let _ = writeln!(std::io::stderr(), "SKIPPED: no {} — set TYPODONT_DATA", path.display());
        return None;
    }
    Some(path)
}
