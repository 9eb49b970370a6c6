//! Parts of the program that a build may lack: each is a Cargo feature.

use super::CliError;
use std::fmt;

/// Arguments of a command that this build lacks: all are accepted, so that the missing part is reported and not the
/// arguments.
#[derive(clap::Args)]
pub struct IgnoredArguments {
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, hide = true)]
    _arguments: Vec<std::ffi::OsString>,
}

/// The complaint that this build lacks a part, which is named by its Cargo feature.
pub fn error(what: impl fmt::Display, feature: &str) -> CliError {
    CliError::misuse(format!(
        "missing-part: this build does not include {what}; build the program with `--features {feature}`, or install \
         the complete program"
    ))
}
