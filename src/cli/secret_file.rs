//! Files that hold a secret.

use super::CliError;
use std::path::Path;

/// Checks that only its owner can read a file.
///
/// # Errors
/// A message if other users can.
#[cfg(unix)]
pub fn require_private(path: &Path) -> Result<(), CliError> {
    use std::os::unix::fs::PermissionsExt;
    let mode = std::fs::metadata(path).map_or(0, |meta| meta.permissions().mode());
    match mode & 0o077 {
        0 => Ok(()),
        _ => Err(CliError::wrong(format!(
            "{}: open-secret: other users can read the file; run chmod 600",
            path.display()
        ))),
    }
}

#[cfg(not(unix))]
pub fn require_private(_: &Path) -> Result<(), CliError> {
    Ok(())
}
