//! Key of the link to a second device: from a file, the environment or, with a warning, the command line.

use super::CliError;
use super::secret_file::{self, require_private};
use std::path::Path;

/// Environment variable with the key.
const VARIABLE: &str = "TYPODONT_LINK_KEY";

/// Minimum length of a key, characters.
const LENGTH_MIN: usize = 8;

/// Key given on the command line, and the option by which it was given.
pub struct TypedKey<'a> {
    pub option: &'static str,
    pub key: &'a str,
}

/// Reads the key: from the file, the environment, or as it was typed.
///
/// # Errors
/// A message if there is none, it is too short, or the file cannot be read or can be read by others.
pub fn read(file: Option<&Path>, typed: Option<TypedKey>, file_option: &str) -> Result<String, CliError> {
    let key = match (file, typed) {
        (Some(path), _) => {
            require_private(path)?;
            typodont_formats::read_text(path)?.text.trim().to_string()
        }
        (None, Some(TypedKey { option, key })) => {
            eprintln!(
                "{option}: open-secret: other users of this computer can read the key in the list of processes; give \
                {file_option}, or set the environment variable {VARIABLE}"
            );
            key.to_string()
        }
        (None, None) => std::env::var(VARIABLE).map_err(|_| {
            CliError::misuse(format!("no-key: give {file_option}, or set the environment variable {VARIABLE}"))
        })?,
    };
    match key.chars().count() < LENGTH_MIN {
        true => Err(CliError::misuse(format!(
            "weak-key: the key must have at least {LENGTH_MIN} characters; typodont assist --new-key FILE makes one"
        ))),
        false => Ok(key),
    }
}

/// Writes a new random key to a file that did not exist, readable only by its owner.
///
/// # Errors
/// A message if the file exists or cannot be written.
pub fn write_new(path: &Path) -> Result<(), CliError> {
    let key = typodont_devices::generate_key().map_err(|why| CliError::wrong(format!("no-key: {why}")))?;
    secret_file::write_new(path, &key)
}
