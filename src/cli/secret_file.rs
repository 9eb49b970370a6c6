//! Files that hold a secret.

use super::CliError;
use std::fs::OpenOptions;
use std::io::{ErrorKind, Write};
use std::path::Path;

/// Checks that only its owner can read a file.
///
/// # Errors
/// A message if other users can.
#[cfg(all(unix, any(feature = "devices", feature = "school")))]
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

#[cfg(all(not(unix), any(feature = "devices", feature = "school")))]
pub fn require_private(_: &Path) -> Result<(), CliError> {
    Ok(())
}

/// Writes a secret to a file that did not exist, readable only by its owner.
///
/// # Errors
/// A message if the file exists or cannot be written.
pub fn write_new(path: &Path, secret: &str) -> Result<(), CliError> {
    let mut options = OpenOptions::new();
    options.write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    let written = options.open(path).and_then(|mut file| writeln!(file, "{secret}"));
    written.map_err(|error| {
        let place = path.display();
        CliError::wrong(match error.kind() {
            ErrorKind::AlreadyExists => {
                format!("{place}: known-file: the file already exists; choose another name, or delete it first")
            }
            _ => format!("{place}: unwritable-file: {error}"),
        })
    })
}
